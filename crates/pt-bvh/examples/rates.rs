//! Measures build time, memory and query rates on generated bumpy spheres, after a check of the
//! results against scalar code.
//!
//! `cargo run --release -p pt-bvh --example rates`

use std::collections::HashMap;
use std::time::Instant;

use pt_bvh::{BuildOptions, Builder, Bvh, Bvh2, Geometry, Hit};
use pt_math::{Frame, Ray, Vec3};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;
/// Edge, in pixels, of the square tiles in which rays are ordered.
const TILE: u32 = 4;
const REPETITIONS: usize = 5;
/// Rays per batch.
const BATCH: usize = 1024;
const LIGHT: Vec3 = Vec3::new(3.0, 4.0, 5.0);

struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn geometry(&self) -> Geometry<'_> {
        Geometry { positions: &self.positions, triangles: &self.triangles, spheres: &[] }
    }

    fn normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.triangles[triangle as usize].map(|i| self.positions[i as usize]);
        (b - a).cross(c - a).normalize()
    }
}

/// An octahedron with `n` segments along each edge, blown up to a sphere with bumps: 8n² triangles.
fn bumpy_sphere(n: i32) -> Mesh {
    // On the octahedron |x| + |y| + |z| = n, vertices are the points with integer coordinates.
    let mut numbers = HashMap::new();
    let mut positions = Vec::new();
    let mut vertex = |p: [i32; 3]| {
        *numbers.entry(p).or_insert_with(|| {
            positions.push(Vec3::from_array(p.map(|c| c as f32)).normalize());
            positions.len() as u32 - 1
        })
    };
    let mut triangles = Vec::new();
    for signs in (0..8).map(|octant| [0, 1, 2].map(|axis| 1 - 2 * (octant >> axis & 1))) {
        let mut at = |i: i32, j: i32| vertex([signs[0] * i, signs[1] * j, signs[2] * (n - i - j)]);
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < n {
                triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    let wave = |x: f32| {
        let r = x - x.floor();
        4.0 * r * (1.0 - r)
    };
    for p in &mut positions {
        let bump = wave(3.1 * p.x) * wave(3.7 * p.y) * wave(4.3 * p.z);
        let ripple = wave(17.0 * p.x) + wave(19.0 * p.y) + wave(23.0 * p.z);
        *p *= 0.7 + 0.4 * bump + 0.01 * ripple;
    }
    Mesh { positions, triangles }
}

/// Returns a uniform number in [0, 1) that depends only on `index`.
fn random(index: u32) -> f32 {
    let mut h = index.wrapping_mul(0x9E37_79B9) ^ 0x85EB_CA6B;
    for _ in 0..3 {
        h = (h ^ h >> 16).wrapping_mul(0x7FEB_352D);
        h = (h ^ h >> 15).wrapping_mul(0x846C_A68B);
    }
    (h >> 8) as f32 / (1u32 << 24) as f32
}

/// Rays from a camera that sees the whole mesh.
fn primary(eye: Vec3) -> Vec<Ray> {
    let frame = Frame::from_normal(-eye.normalize());
    let pixel = |x: u32, y: u32| {
        let u = (x as f32 + 0.5) / WIDTH as f32 - 0.5;
        let v = (y as f32 + 0.5) / HEIGHT as f32 - 0.5;
        Ray::new(eye, frame.to_world(Vec3::new(u * 0.9, v * 0.675, 1.0)).normalize())
    };
    let tiles = (0..HEIGHT).step_by(TILE as usize);
    tiles
        .flat_map(|y| (0..WIDTH).step_by(TILE as usize).map(move |x| (x, y)))
        .flat_map(|(x, y)| (0..TILE * TILE).map(move |i| (x + i % TILE, y + i / TILE)))
        .map(|(x, y)| pixel(x, y))
        .collect()
}

/// For each hit, a ray in a cosine-distributed direction and a ray to the light.
fn secondary(mesh: &Mesh, rays: &[Ray], hits: &[Option<Hit>]) -> (Vec<Ray>, Vec<Ray>) {
    let mut bounce = Vec::new();
    let mut shadow = Vec::new();
    for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        let Some(hit) = hit else { continue };
        let n = mesh.normal(hit.primitive);
        let n = if n.dot(ray.direction) > 0.0 { -n } else { n };
        let origin = ray.at(hit.t) + n * 1e-4;
        // A uniform point on the unit sphere around the tip of the normal, by rejection.
        let inside = (0..100)
            .map(|k| {
                let u = |j: u32| random((i as u32).wrapping_mul(97) + 3 * k + j) * 2.0 - 1.0;
                Vec3::new(u(0), u(1), u(2))
            })
            .find(|v| (0.01..=1.0).contains(&v.length_squared()));
        let towards = inside.map_or(n, |v| n + v.normalize() * 0.999);
        bounce.push(Ray::new(origin, towards.normalize()));
        if n.dot(LIGHT - origin) > 0.0 {
            shadow.push(Ray::to(origin, LIGHT - origin, 1.0));
        }
    }
    (bounce, shadow)
}

/// Returns millions of rays per second: the best of [`REPETITIONS`].
fn rate(rays: &[Ray], mut query: impl FnMut(&[Ray])) -> f64 {
    let best = (0..REPETITIONS).map(|_| {
        let start = Instant::now();
        rays.chunks(BATCH).for_each(&mut query);
        start.elapsed().as_secs_f64()
    });
    rays.len() as f64 / best.fold(f64::INFINITY, f64::min) * 1e-6
}

/// Rates of single queries and of batches: nearest hits first, then occlusion.
fn rates(bvh: &Bvh, rays: &[Ray]) -> [[f64; 2]; 2] {
    let each = |rays: &[Ray], query: &dyn Fn(&Ray)| rays.iter().for_each(query);
    let nearest = |ray: &Ray| _ = std::hint::black_box(bvh.intersect(ray));
    let any = |ray: &Ray| _ = std::hint::black_box(bvh.occluded(ray));
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    [
        [rate(rays, |r| each(r, &nearest)), rate(rays, |r| bvh.intersect_batch(r, &mut hits))],
        [rate(rays, |r| each(r, &any)), rate(rays, |r| bvh.occluded_batch(r, &mut occluded))],
    ]
}

/// Returns the time of a build with `threads` threads in milliseconds: the best of [`REPETITIONS`].
fn build_time(mesh: &Mesh, options: BuildOptions, threads: usize) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let Ok(pool) = pool else { return f64::NAN };
    let once = || {
        let start = Instant::now();
        std::hint::black_box(Bvh::build(mesh.geometry(), &options)).ok();
        start.elapsed().as_secs_f64() * 1e3
    };
    (0..REPETITIONS).map(|_| pool.install(once)).fold(f64::INFINITY, f64::min)
}

fn measure(mesh: &Mesh, builder: Builder) -> Result<(), Box<dyn std::error::Error>> {
    let options = BuildOptions { builder, ..BuildOptions::default() };
    let bvh = Bvh::build(mesh.geometry(), &options)?;
    let statistics = bvh.statistics();
    let n = mesh.triangles.len();
    println!(
        "{n} triangles, {builder:?}: build {:.0} ms (1 thread), {:.0} ms (2 threads)",
        build_time(mesh, options, 1),
        build_time(mesh, options, 2)
    );
    println!("  {:.1} bytes per triangle, {statistics:?}", statistics.bytes as f64 / n as f64);
    let eye = Vec3::new(1.8, 1.4, 2.4);
    let camera = primary(eye);
    let hits: Vec<_> = camera.iter().map(|r| bvh.intersect(r)).collect();
    let (bounce, shadow) = secondary(mesh, &camera, &hits);
    verify(mesh, &bvh, &[&camera, &bounce, &shadow])?;
    let tests = |rays: &[Ray]| {
        let mut tests = 0;
        for ray in rays {
            bvh.intersect_counted(ray, &mut tests);
        }
        tests as f64 / rays.len() as f64
    };
    for (kind, rays) in [("primary", &camera), ("bounce", &bounce), ("shadow", &shadow)] {
        let [[nearest, nearest_batch], [any, any_batch]] = rates(&bvh, rays);
        println!(
            "  {kind:<8} nearest {nearest:>6.2}, in batches {nearest_batch:>6.2}; any {any:>6.2}, in \
             batches {any_batch:>6.2} million rays/s; {:.1} tests a ray",
            tests(rays)
        );
    }
    Ok(())
}

/// Compares with the scalar binary tree, and for some rays with the loop over all primitives.
fn verify(mesh: &Mesh, bvh: &Bvh, sets: &[&[Ray]]) -> Result<(), Box<dyn std::error::Error>> {
    let geometry = mesh.geometry();
    let hub = Bvh2::build(&geometry, &BuildOptions::default())?;
    let list = BuildOptions { builder: Builder::None, ..BuildOptions::default() };
    let list = Bvh::build(geometry, &list)?;
    for &rays in sets {
        let (mut hits, mut occluded) = (Vec::new(), Vec::new());
        bvh.intersect_batch(rays, &mut hits);
        bvh.occluded_batch(rays, &mut occluded);
        for (i, ray) in rays.iter().enumerate().step_by(7) {
            let hit = bvh.intersect(ray);
            let mut same = hit == hub.intersect(&geometry, ray);
            same &= bvh.occluded(ray) == hit.is_some();
            same &= hits[i] == hit && occluded[i] == hit.is_some();
            if i % 7000 == 0 {
                same &= hit == list.intersect(ray);
            }
            if !same {
                return Err(format!("kernels disagree on {ray:?}").into());
            }
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 73,728 and 301,088 triangles.
    for segments in [96, 194] {
        let mesh = bumpy_sphere(segments);
        for builder in [Builder::Sah, Builder::Mean] {
            measure(&mesh, builder)?;
        }
    }
    Ok(())
}
