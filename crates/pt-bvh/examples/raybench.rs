//! Shoots the rays of one file at the mesh of another, and prints one line of JSON.
//!
//! ```text
//! cargo run --release -p pt-bvh --example raybench -- MESH.bin RAYS.rays
//!     [--hits OUT] [--threads N] [--batch] [--occluded] [--quality Q]
//! ```
//!
//! All numbers in files are little-endian and have 4 bytes.
//!
//! * Mesh: the numbers of vertices and of triangles, three coordinates of each vertex, three vertex
//!   indices of each triangle.
//! * Rays: the number of rays, 8, then for each ray its origin, t_min, direction and t_max.
//! * Hits: the number of rays, 2, then for each ray the triangle as a signed integer (−1 for none)
//!   and t (+∞ for none). With `--occluded`, the hit itself is unknown: triangle and t are 0 for an
//!   occluded ray.
//!
//! `--batch` queries many rays at a time, `--occluded` tests occlusion only, and `--threads` is the
//! number of threads that build and shoot (default 1). An invalid argument or file is reported in
//! one line, with exit status 2.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use pt_bvh::{BuildOptions, Bvh, Geometry, Quality};
use pt_math::{Ray, Vec3};
use rayon::prelude::*;
use serde_json::json;

/// Rays per batch, and per task of a thread.
const BATCH: usize = 1024;
/// Passes over all rays; the fastest counts.
const PASSES: usize = 3;
const USAGE: &str = "usage: raybench MESH.bin RAYS.rays [--hits OUT] [--threads N] [--batch] [--occluded] \
     [--quality fast|balanced|high]";

/// Command-line options.
#[derive(Debug, PartialEq)]
struct Options {
    mesh: PathBuf,
    rays: PathBuf,
    hits: Option<PathBuf>,
    threads: usize,
    batch: bool,
    occluded: bool,
    quality: Quality,
}

/// Entry of a ray in the file of hits: triangle and t.
type Record = (i32, f32);
const NOTHING: Record = (-1, f32::INFINITY);

fn main() -> ExitCode {
    let options = parse_options(std::env::args().skip(1));
    match options.and_then(|options| run(&options)) {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("raybench: {message}");
            ExitCode::from(2)
        }
    }
}

fn parse_options(mut arguments: impl Iterator<Item = String>) -> Result<Options, String> {
    let (mut files, mut hits, mut threads) = (Vec::new(), None, 1);
    let (mut batch, mut occluded, mut quality) = (false, false, Quality::default());
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value; {USAGE}"));
        match argument.as_str() {
            "--hits" => hits = Some(PathBuf::from(value()?)),
            "--threads" => threads = thread_count(&value()?)?,
            "--batch" => batch = true,
            "--occluded" => occluded = true,
            "--quality" => quality = quality_named(&value()?)?,
            option if option.starts_with('-') => {
                return Err(format!("unknown option {option}; {USAGE}"));
            }
            file => files.push(PathBuf::from(file)),
        }
    }
    let [mesh, rays] = files.try_into().map_err(|_| format!("two files are needed; {USAGE}"))?;
    Ok(Options { mesh, rays, hits, threads, batch, occluded, quality })
}

fn quality_named(name: &str) -> Result<Quality, String> {
    match name {
        "fast" => Ok(Quality::Fast),
        "balanced" => Ok(Quality::Balanced),
        "high" => Ok(Quality::High),
        _ => Err(format!("--quality {name}: not fast, balanced or high")),
    }
}

fn thread_count(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| (1..=1024).contains(n));
    number.ok_or(format!("--threads {text}: not a number from 1 to 1024"))
}

/// Runs the benchmark and returns the line to print.
fn run(options: &Options) -> Result<serde_json::Value, String> {
    let (positions, triangles) = load(&options.mesh, parse_mesh)?;
    let rays = load(&options.rays, parse_rays)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    let pool = pool.map_err(|e| format!("threads cannot be started: {e}"))?;
    let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
    let build = BuildOptions { quality: options.quality, ..BuildOptions::default() };
    let start = Instant::now();
    let bvh = pool.install(|| Bvh::build(geometry, &build));
    let build_seconds = start.elapsed().as_secs_f64();
    let bvh = bvh.map_err(|e| format!("{}: {e}", options.mesh.display()))?;
    let (seconds, records) = pool.install(|| shoot(&bvh, &rays, options));
    if let Some(path) = &options.hits {
        write_hits(path, &records).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(json!({
        "triangles": triangles.len(),
        "rays": rays.len(),
        "hits": records.iter().filter(|record| record.0 >= 0).count(),
        "kernel": bvh.kernel(),
        "query": if options.occluded { "occluded" } else { "intersect" },
        "batch": options.batch,
        "threads": options.threads,
        "build_seconds": build_seconds,
        "bytes": bvh.statistics().bytes,
        "mrays_per_second": rays.len() as f64 / seconds * 1e-6,
    }))
}

/// Returns the shortest time of a pass in seconds, and the hits of the rays.
fn shoot(bvh: &Bvh, rays: &[Ray], options: &Options) -> (f64, Vec<Record>) {
    let mut records = vec![NOTHING; rays.len()];
    let mut least = f64::INFINITY;
    for _ in 0..PASSES {
        let start = Instant::now();
        rays.par_chunks(BATCH)
            .zip(records.par_chunks_mut(BATCH))
            .for_each(|(rays, records)| answer(bvh, rays, records, options));
        least = least.min(start.elapsed().as_secs_f64());
    }
    (least, records)
}

/// Queries some rays and writes their records.
fn answer(bvh: &Bvh, rays: &[Ray], records: &mut [Record], options: &Options) {
    let hit = |hit: Option<pt_bvh::Hit>| hit.map_or(NOTHING, |h| (h.primitive as i32, h.t));
    let any = |occluded: bool| if occluded { (0, 0.0) } else { NOTHING };
    let pairs = records.iter_mut().zip(rays);
    match (options.batch, options.occluded) {
        (false, false) => pairs.for_each(|(to, ray)| *to = hit(bvh.intersect(ray))),
        (false, true) => pairs.for_each(|(to, ray)| *to = any(bvh.occluded(ray))),
        (true, false) => {
            let mut hits = Vec::with_capacity(rays.len());
            bvh.intersect_batch(rays, &mut hits);
            records.iter_mut().zip(hits).for_each(|(to, from)| *to = hit(from));
        }
        (true, true) => {
            let mut occluded = Vec::with_capacity(rays.len());
            bvh.occluded_batch(rays, &mut occluded);
            records.iter_mut().zip(occluded).for_each(|(to, from)| *to = any(from));
        }
    }
}

/// Reads a file. Errors begin with its name.
fn load<T>(path: &Path, parse: fn(&[u8]) -> Result<T, String>) -> Result<T, String> {
    let read = std::fs::read(path).map_err(|e| e.to_string());
    read.and_then(|bytes| parse(&bytes)).map_err(|e| format!("{}: {e}", path.display()))
}

/// Splits a file into the two numbers at its start and the numbers that follow.
fn head(bytes: &[u8]) -> Result<([u32; 2], &[[u8; 4]]), String> {
    let (words, rest) = bytes.as_chunks::<4>();
    match words {
        [a, b, body @ ..] if rest.is_empty() => Ok(([a, b].map(|w| u32::from_le_bytes(*w)), body)),
        _ => Err(format!("{} bytes are not two counts and whole numbers of 4 bytes", bytes.len())),
    }
}

/// Returns an error unless the counts match the number of values that follow.
fn expect_length(body: &[[u8; 4]], wanted: u64) -> Result<(), String> {
    let found = body.len() as u64;
    if found == wanted {
        return Ok(());
    }
    let what = if found < wanted { "truncated" } else { "too long" };
    Err(format!("{what}: {found} numbers after the counts instead of {wanted}"))
}

/// Parses vertices and triangles.
fn parse_mesh(bytes: &[u8]) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), String> {
    let ([vertices, triangles], body) = head(bytes)?;
    expect_length(body, 3 * (u64::from(vertices) + u64::from(triangles)))?;
    let (coordinates, corners) = body.split_at(3 * vertices as usize);
    let positions: Vec<Vec3> = coordinates
        .as_chunks::<3>()
        .0
        .iter()
        .map(|p| Vec3::from_array(p.map(f32::from_le_bytes)))
        .collect();
    if let Some(bad) = positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("vertex {bad} has a coordinate that is not a finite number"));
    }
    let corners = corners.as_chunks::<3>().0.iter();
    let triangles: Vec<_> = corners.map(|t| t.map(u32::from_le_bytes)).collect();
    Ok((positions, triangles))
}

fn parse_rays(bytes: &[u8]) -> Result<Vec<Ray>, String> {
    let ([count, numbers], body) = head(bytes)?;
    if numbers != 8 {
        return Err(format!("{numbers} numbers a ray instead of 8"));
    }
    expect_length(body, 8 * u64::from(count))?;
    let words = body.as_chunks::<8>().0.iter();
    words.enumerate().map(|(i, words)| ray(i, words.map(f32::from_le_bytes))).collect()
}

/// Parses ray `i` of a file.
fn ray(i: usize, [ox, oy, oz, t_min, dx, dy, dz, t_max]: [f32; 8]) -> Result<Ray, String> {
    let (origin, direction) = (Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz));
    if !origin.is_finite() || !direction.is_finite() {
        return Err(format!("ray {i} has an origin or a direction that is not finite"));
    }
    if direction == Vec3::ZERO {
        return Err(format!("ray {i} has no direction"));
    }
    if t_min.is_nan() || t_max.is_nan() {
        return Err(format!("ray {i} has an end that is not a number"));
    }
    Ok(Ray { origin, direction, t_min, t_max })
}

/// Writes the file of hits atomically: complete, or not at all.
fn write_hits(path: &Path, records: &[Record]) -> std::io::Result<()> {
    let mut bytes = Vec::with_capacity(8 + 8 * records.len());
    bytes.extend((records.len() as u32).to_le_bytes());
    bytes.extend(2u32.to_le_bytes());
    for (triangle, t) in records {
        bytes.extend(triangle.to_le_bytes());
        bytes.extend(t.to_le_bytes());
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let write = || {
        let mut file = File::create_new(&part)?;
        file.write_all(&bytes)?;
        file.sync_all()?;
        std::fs::rename(&part, path)
    };
    write().inspect_err(|_| {
        // The error is reported by the caller; failure to remove the partial file adds nothing.
        std::fs::remove_file(&part).ok();
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|w| w.to_le_bytes()).collect()
    }

    fn reals(reals: &[f32]) -> Vec<u32> {
        reals.iter().map(|r| r.to_bits()).collect()
    }

    fn mesh_file() -> Vec<u8> {
        let corners = reals(&[0.0, 0.0, 2.0, 1.0, 0.0, 2.0, 0.0, 1.0, 2.0]);
        words(&[&[3, 1], &corners[..], &[0, 1, 2]].concat())
    }

    fn rays_file() -> Vec<u8> {
        let hit = reals(&[0.25, 0.25, 0.0, 0.0, 0.0, 0.0, 1.0, f32::INFINITY]);
        let miss = reals(&[0.25, 0.25, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0]);
        words(&[&[2, 8], &hit[..], &miss].concat())
    }

    fn options(arguments: &[&str]) -> Result<Options, String> {
        parse_options(arguments.iter().map(|&a| a.to_owned()))
    }

    #[test]
    fn wrong_arguments_are_refused() {
        for wrong in [
            &["m.bin"][..],
            &["m", "r", "x"],
            &["m", "r", "--hits"],
            &["m", "r", "--threads", "0"],
            &["m", "r", "--theads", "1"],
        ] {
            let message = options(wrong).unwrap_err();
            assert!(!message.contains('\n'), "{message}");
        }
        let all = [
            "m",
            "--batch",
            "r",
            "--threads",
            "2",
            "--hits",
            "h",
            "--occluded",
            "--quality",
            "high",
        ];
        let all = options(&all).unwrap();
        assert_eq!((all.threads, all.batch, all.occluded), (2, true, true));
        assert_eq!(all.quality, Quality::High);
        assert_eq!(all.hits, Some("h".into()));
    }

    #[test]
    fn wrong_files_are_refused() {
        let (mesh, rays) = (mesh_file(), rays_file());
        assert_eq!(parse_mesh(&mesh).unwrap().1, [[0, 1, 2]]);
        assert_eq!(parse_rays(&rays).unwrap().len(), 2);
        for length in 0..mesh.len() {
            assert!(parse_mesh(&mesh[..length]).is_err(), "{length}");
        }
        for length in 0..rays.len() {
            assert!(parse_rays(&rays[..length]).is_err(), "{length}");
        }
        assert!(parse_mesh(&[&mesh[..], &[0; 4]].concat()).unwrap_err().contains("too long"));
        assert!(parse_mesh(&words(&[u32::MAX, u32::MAX])).unwrap_err().contains("truncated"));
        assert!(parse_rays(&words(&[0, 7])).unwrap_err().contains("instead of 8"));
        let with = |file: &[u8], word: usize, value: f32| {
            let mut file = file.to_vec();
            file[4 * word..4 * word + 4].copy_from_slice(&value.to_le_bytes());
            file
        };
        assert!(parse_mesh(&with(&mesh, 2, f32::NAN)).unwrap_err().contains("vertex 0"));
        assert!(parse_rays(&with(&rays, 12, f32::NAN)).unwrap_err().contains("ray 1"));
        assert!(parse_rays(&with(&rays, 8, 0.0)).unwrap_err().contains("no direction"));
        assert!(parse_rays(&with(&rays, 9, f32::NAN)).unwrap_err().contains("not a number"));
    }

    #[test]
    fn hits_are_written_for_all_ways_to_ask() {
        let folder = std::env::temp_dir().join(format!("raybench-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = |name: &str| folder.join(name);
        std::fs::write(path("m.bin"), mesh_file()).unwrap();
        std::fs::write(path("r.rays"), rays_file()).unwrap();
        let miss = [u32::MAX, f32::INFINITY.to_bits()];
        for (batch, occluded) in [(false, false), (false, true), (true, false), (true, true)] {
            let [mesh, rays, hits] = ["m.bin", "r.rays", "h"].map(path);
            let (hits, quality) = (Some(hits), Quality::default());
            let options = Options { mesh, rays, hits, threads: 2, batch, occluded, quality };
            let line = run(&options).unwrap();
            assert_eq!((&line["rays"], &line["hits"]), (&json!(2), &json!(1)));
            let t = if occluded { 0.0f32 } else { 2.0 };
            let expected = words(&[&[2, 2, 0, t.to_bits()], &miss[..]].concat());
            assert_eq!(std::fs::read(path("h")).unwrap(), expected);
        }
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3, "a part is left over");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
