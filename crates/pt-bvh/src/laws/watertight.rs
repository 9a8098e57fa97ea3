//! No ray passes through a closed mesh.

use pt_math::{Bounds3, Ray, Vec3};
use pt_testing::Random;
use rayon::prelude::*;

use super::{Soup, ball, bumpy_ball, in_pieces};
use crate::ray::PreparedRay;
use crate::triangle::{EdgeSide, side};
use crate::{BuildOptions, Bvh};

/// Number of single rays and of rays in batches per mesh, for ten meshes. Fewer if their triangles
/// are in pieces, and for portable vectors (which other architectures have too), where they take
/// four times as long and give the same bits.
const RAYS: [u64; 2] = if cfg!(any(portable, not(target_arch = "x86_64"))) {
    [200_000, 500_000]
} else {
    [1_000_000, 5_000_000]
};
const CHUNK: u64 = 20_000;
/// Scales and offsets of the meshes.
const PLACES: [(f32, Vec3); 5] = [
    (1.0, Vec3::ZERO),
    (1.0, Vec3::new(1e5, -2e5, 3e4)),
    (1e15, Vec3::ZERO),
    (1e-15, Vec3::ZERO),
    // Products of coordinates are below the normal numbers.
    (1e-21, Vec3::ZERO),
];

/// A mesh, scaled about the origin and then moved.
fn placed(mut soup: Soup, scale: f32, offset: Vec3) -> Soup {
    for p in &mut soup.positions {
        *p = *p * scale + offset;
    }
    soup
}

/// A point on the mesh: a vertex, a point of an edge, or any.
fn target(soup: &Soup, r: &mut Random) -> Vec3 {
    let [a, b, c] = soup.corners(r.below(soup.triangles.len()));
    match r.below(4) {
        0 => a,
        1 => (a + b) * 0.5,
        2 => a + (b - a) * r.unit(),
        _ => {
            let (u, v) = (r.unit(), r.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    }
}

/// A ray from the inner half of the mesh; or, if `is_central`, from its centre, where the
/// directions are those of the vertices.
fn ray(soup: &Soup, (scale, offset): (f32, Vec3), is_central: bool, r: &mut Random) -> Ray {
    let origin = if is_central { offset } else { r.in_cube() * 0.25 * scale + offset };
    Ray::new(origin, target(soup, r) - origin)
}

/// Returns the number of rays of a chunk that miss, traced one by one.
fn escaped(bvh: &Bvh, soup: &Soup, place: (f32, Vec3), seed: u64) -> u64 {
    let mut r = Random::new(seed);
    let escapes = (0..CHUNK).filter(|_| {
        bvh.intersect(&ray(soup, place, false, &mut r)).is_none()
            || !bvh.occluded(&ray(soup, place, true, &mut r))
    });
    escapes.count() as u64
}

/// Returns the number of rays of a chunk that miss in batches, of which one in four is coherent.
fn escaped_batch(bvh: &Bvh, soup: &Soup, place: (f32, Vec3), seed: u64) -> u64 {
    let mut r = Random::new(seed);
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    let mut escapes = 0;
    for batch in 0..CHUNK / 1000 {
        let is_central = batch % 2 == 1;
        let mut rays: Vec<_> = (0..1000).map(|_| ray(soup, place, is_central, &mut r)).collect();
        if batch % 4 == 3 {
            let first = rays[0].direction;
            for ray in &mut rays {
                ray.direction = first + ray.direction * 0.05;
            }
        }
        bvh.intersect_batch(&rays, &mut hits);
        bvh.occluded_batch(&rays, &mut occluded);
        let missed = hits.iter().filter(|hit| hit.is_none()).count();
        escapes += missed + occluded.iter().filter(|&&hit| !hit).count();
    }
    escapes as u64
}

/// Asserts that none of `rays` rays escapes from any mesh, chunk by chunk.
fn none_escapes(rays: u64, escaped: impl Fn(&Bvh, &Soup, (f32, Vec3), u64) -> u64 + Sync) {
    let meshes: [fn() -> Soup; 2] = [|| ball(5), || bumpy_ball(5)];
    for (mesh, place) in meshes.iter().flat_map(|mesh| PLACES.map(|place| (mesh, place))) {
        let soup = placed(mesh(), place.0, place.1);
        let bvh = Bvh::build(soup.geometry(), &BuildOptions::default()).expect("in range");
        let (cut, pieces) = in_pieces(&soup, BuildOptions::default());
        assert!(cut.order.len() > soup.triangles.len(), "triangles are in pieces");
        for (bvh, rays) in [(&bvh, rays), (&pieces, rays / 5)] {
            let chunks = (0..rays / CHUNK).into_par_iter();
            let escapes: u64 = chunks.map(|seed| escaped(bvh, &soup, place, seed)).sum();
            assert_eq!(escapes, 0, "{place:?}");
        }
    }
}

#[test]
fn single_rays_do_not_escape() {
    none_escapes(RAYS[0], escaped);
}

#[test]
fn rays_in_batches_do_not_escape() {
    none_escapes(RAYS[1], escaped_batch);
}

/// Ray through a vertex, between triangles of which the one that is hit is seen edge-on and nearer
/// than the error of its depth. For one in 10⁷ rays, it was mistaken for the triangle that the ray
/// leaves.
#[test]
fn a_ray_next_to_an_edge_on_triangle_does_not_escape() {
    let (scale, offset) = PLACES[1];
    let soup = placed(bumpy_ball(5), scale, offset);
    let origin = Vec3::new(100_000.18, -200_000.19, 30_000.219);
    let ray = Ray::new(origin, Vec3::new(0.328_125, 0.234_375, 0.453_125));
    let whole = Bvh::build(soup.geometry(), &BuildOptions::default()).expect("in range");
    let (_, pieces) = in_pieces(&soup, BuildOptions::default());
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    for bvh in [whole, pieces] {
        bvh.intersect_batch(&[ray], &mut hits);
        bvh.occluded_batch(&[ray], &mut occluded);
        assert!(bvh.intersect(&ray).is_some() && bvh.occluded(&ray));
        assert!(hits[0].is_some() && occluded[0]);
    }
}

/// From outside, a ray enters a closed mesh as often as it leaves it. Crossings are counted by the
/// edge functions over all triangles, for rays that meet no edge exactly (two triangles would
/// count).
#[test]
fn rays_from_outside_leave_as_often_as_they_enter() {
    for (scale, offset) in [(1.0, Vec3::ZERO), (1.0, Vec3::splat(1e5)), (1e12, Vec3::ZERO)] {
        let soup = placed(bumpy_ball(4), scale, offset);
        let bounds: Bounds3 = soup.positions.iter().copied().collect();
        let counts = |seed: u64| {
            let mut r = Random::new(seed);
            let mut counted = 0;
            for _ in 0..500 {
                let away = r.direction() * 3.0 * scale;
                let origin = away + offset;
                // Mostly through the silhouette: perpendicular to the direction to the centre.
                let across = r.direction().cross(away).normalize();
                let aim = offset + across * scale * (0.6 + 0.6 * r.unit());
                let ray = Ray::new(origin, aim - origin);
                let ray = PreparedRay::new(&ray, &bounds).expect("a usable ray");
                let mut sum = 0;
                let sides: Vec<_> =
                    (0..soup.triangles.len()).map(|i| side(&ray, soup.corners(i))).collect();
                if sides.contains(&EdgeSide::Edge) {
                    continue;
                }
                for s in sides {
                    sum += match s {
                        EdgeSide::Positive => 1,
                        EdgeSide::Negative => -1,
                        EdgeSide::Edge | EdgeSide::Outside => 0,
                    };
                }
                assert_eq!(sum, 0, "{ray:?}");
                counted += 1;
            }
            counted
        };
        let counted: u32 = (0..8u64).into_par_iter().map(counts).sum();
        assert!(counted > 3000, "{counted} rays meet no edge exactly");
    }
}
