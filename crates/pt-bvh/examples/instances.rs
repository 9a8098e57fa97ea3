//! Measures the cost of two-level trees: query rates on many instances of a ring, against one tree
//! over all their triangles, and the build time of the upper level. Checks results against single
//! queries and a loop over all instances first.
//!
//! `cargo run --release -p pt-bvh --example instances`

use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;

use pt_bvh::{BuildOptions, Bvh, Geometry, Instance, InstanceBvh};
use pt_math::{DAffine3, DMat3, DQuat, DVec3, Ray, Vec3};

/// Numbers of segments around and across a ring. It has twice as many triangles as segments.
const SEGMENTS: [u32; 2] = [64, 32];
const INSTANCES: u64 = 256;
/// Edge of the image in pixels.
const EDGE: u32 = 512;
/// Edge, in pixels, of the square tiles in which rays are ordered.
const TILE: u32 = 4;
/// Rays per batch.
const BATCH: usize = 4096;
const REPETITIONS: usize = 3;

/// Returns a uniform number in [−1, 1) that depends only on `index`.
fn random(index: u64) -> f64 {
    let z = index.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ z >> 31) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn random_vector(index: u64) -> DVec3 {
    DVec3::new(random(3 * index), random(3 * index + 1), random(3 * index + 2))
}

/// Vertices and triangles of a ring around z.
fn ring() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let [n, m] = SEGMENTS;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let around = DQuat::from_rotation_z(TAU * f64::from(i) / f64::from(n));
        let across = DQuat::from_rotation_y(TAU * f64::from(j) / f64::from(m));
        positions.push((around * (DVec3::X + across * DVec3::X * 0.4)).as_vec3());
        let at = |i: u32, j: u32| i % n * m + j % m;
        let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
    }
    (positions, triangles)
}

/// Random rotation and scale, at a random position in a cube whose volume grows with `number`.
fn transform(index: u64, number: u64) -> DAffine3 {
    let axis = random_vector(3 * index).normalize_or(DVec3::Z);
    let turn = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, axis));
    let size = DVec3::ONE + random_vector(3 * index + 1) * 0.5;
    let place = random_vector(3 * index + 2) * (number as f64).cbrt() * 1.5;
    DAffine3::from_mat3_translation(turn * DMat3::from_diagonal(size), place)
}

fn place(object: &Arc<Bvh>, number: u64) -> Result<Vec<Instance>, Box<dyn Error>> {
    let all = (0..number).map(|i| Instance::new(Arc::clone(object), transform(i, number)));
    Ok(all.collect::<Result<_, _>>()?)
}

/// Builds one tree over the triangles of all instances.
fn flattened(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Bvh, Box<dyn Error>> {
    let (mut all, mut indices) = (Vec::new(), Vec::new());
    for to_world in (0..INSTANCES).map(|i| transform(i, INSTANCES)) {
        let first = all.len() as u32;
        all.extend(positions.iter().map(|p| to_world.transform_point3(p.as_dvec3()).as_vec3()));
        indices.extend(triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let geometry = Geometry { positions: &all, triangles: &indices, spheres: &[] };
    Ok(Bvh::build(geometry, &BuildOptions::default())?)
}

/// Rays of a camera that sees all instances, ordered in tiles.
fn primary() -> Vec<Ray> {
    let eye = DVec3::new(0.0, 0.0, (INSTANCES as f64).cbrt() * 4.0);
    let ray = |x: u32, y: u32| {
        let [u, v] = [x, y].map(|x| (f64::from(x) + 0.5) / f64::from(EDGE) - 0.5);
        Ray::new(eye.as_vec3(), DVec3::new(u, v, -1.0).normalize().as_vec3())
    };
    let corners = (0..EDGE * EDGE / (TILE * TILE)).map(|i| (i % (EDGE / TILE), i / (EDGE / TILE)));
    let pixels = (0..TILE * TILE).map(|i| (i % TILE, i / TILE));
    let all =
        corners.flat_map(|c| pixels.clone().map(move |p| (c.0 * TILE + p.0, c.1 * TILE + p.1)));
    all.map(|(x, y)| ray(x, y)).collect()
}

/// Rays with random origins in the cube and random directions.
fn scattered() -> Vec<Ray> {
    let edge = (INSTANCES as f64).cbrt() * 1.5;
    let ray = |i: u64| {
        Ray::new((random_vector(2 * i) * edge).as_vec3(), random_vector(2 * i + 1).as_vec3())
    };
    (1 << 20..(1 << 20) + u64::from(EDGE * EDGE)).map(ray).collect()
}

/// Returns the time of `work` in milliseconds: the best of [`REPETITIONS`].
fn time(mut work: impl FnMut()) -> f64 {
    let once = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64() * 1e3
    };
    (0..REPETITIONS).map(once).fold(f64::INFINITY, f64::min)
}

/// Returns an error if batches disagree with single queries, or these with the loop.
fn verify(scene: &InstanceBvh, rays: &[Ray]) -> Result<(), Box<dyn Error>> {
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    scene.intersect_batch(rays, &mut hits);
    scene.occluded_batch(rays, &mut occluded);
    for (i, ray) in rays.iter().enumerate().step_by(17) {
        let mut is_same = scene.intersect(ray) == hits[i];
        is_same &= [scene.occluded(ray), occluded[i]] == [hits[i].is_some(); 2];
        let ts = scene.primitives().iter().map(|instance| {
            instance.object().intersect(&instance.to_object(ray)).map_or(f32::INFINITY, |hit| hit.t)
        });
        is_same &=
            hits[i].map_or(f32::INFINITY, |hit| hit.hit.t) == ts.fold(f32::INFINITY, f32::min);
        if !is_same {
            return Err(format!("queries disagree on {ray:?}").into());
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let (positions, triangles) = ring();
    let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
    let object = Arc::new(Bvh::build(geometry, &BuildOptions::default())?);
    let scene = InstanceBvh::build(place(&object, INSTANCES)?)?;
    let flat = flattened(&positions, &triangles)?;
    println!(
        "{INSTANCES} instances of {} triangles: {:.2} MB, one tree {:.2} MB; million rays/s",
        triangles.len(),
        (object.statistics().bytes + size_of_val(scene.primitives().as_slice())) as f64 * 1e-6,
        flat.statistics().bytes as f64 * 1e-6
    );
    for (kind, rays) in [("primary", primary()), ("scattered", scattered())] {
        verify(&scene, &rays)?;
        let rate = |work: &mut dyn FnMut(&[Ray])| {
            rays.len() as f64 / time(|| rays.chunks(BATCH).for_each(&mut *work)) * 1e-3
        };
        let (mut hits, mut occluded, mut flat_hits) = (Vec::new(), Vec::new(), Vec::new());
        println!(
            "  {kind:<9} nearest {:.2}, in batches {:.2}; any {:.2}, in batches {:.2}; \
             one tree: nearest {:.2}, in batches {:.2}",
            rate(&mut |r| r.iter().for_each(|ray| _ = std::hint::black_box(scene.intersect(ray)))),
            rate(&mut |r| scene.intersect_batch(r, &mut hits)),
            rate(&mut |r| r.iter().for_each(|ray| _ = std::hint::black_box(scene.occluded(ray)))),
            rate(&mut |r| scene.occluded_batch(r, &mut occluded)),
            rate(&mut |r| r.iter().for_each(|ray| _ = std::hint::black_box(flat.intersect(ray)))),
            rate(&mut |r| flat.intersect_batch(r, &mut flat_hits)),
        );
    }
    for number in [1000, 10_000, 100_000] {
        let mut scene = InstanceBvh::build(place(&object, number)?)?;
        println!("{number} instances: upper level in {:.2} ms", time(|| _ = scene.update(|_| ())));
    }
    Ok(())
}
