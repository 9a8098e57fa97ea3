//! No ray passes through a closed mesh.

use pt_math::{Bounds3, Ray, Vec3};
use rayon::prelude::*;

use super::{Random, Soup, ball, bumpy_ball, in_pieces};
use crate::ray::Prepared;
use crate::triangle::{Side, side};
use crate::{BuildOptions, Bvh};

/// Rays per mesh; ten meshes. Fewer where their triangles are in pieces.
const RAYS: u64 = 1_000_000;
const CHUNK: u64 = 20_000;

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

/// Rays from the inner half of the mesh that hit nothing.
fn escaped(bvh: &Bvh, rays: u64, soup: &Soup, scale: f32, offset: Vec3) -> u64 {
    let chunk = |seed: u64| {
        let mut r = Random(seed);
        let escapes = (0..CHUNK).filter(|_| {
            let origin = r.vector() * 0.25 * scale + offset;
            let ray = Ray::new(origin, target(soup, &mut r) - origin);
            // From the centre itself the directions are those of the vertices.
            let central = Ray::new(offset, target(soup, &mut r) - offset);
            bvh.intersect(&ray).is_none() || !bvh.occluded(&central)
        });
        escapes.count() as u64
    };
    (0..rays / CHUNK).into_par_iter().map(chunk).sum()
}

#[test]
fn ten_million_rays_do_not_escape() {
    let meshes: [fn() -> Soup; 2] = [|| ball(5), || bumpy_ball(5)];
    let far = Vec3::new(1e5, -2e5, 3e4);
    for mesh in meshes {
        for (scale, offset) in [
            (1.0, Vec3::ZERO),
            (1.0, far),
            (1e15, Vec3::ZERO),
            (1e-15, Vec3::ZERO),
            // Products of coordinates are below the normal numbers.
            (1e-21, Vec3::ZERO),
        ] {
            let soup = placed(mesh(), scale, offset);
            let bvh = Bvh::build(soup.geometry(), &BuildOptions::default()).expect("in range");
            let (cut, pieces) = in_pieces(&soup, BuildOptions::default());
            assert!(cut.order.len() > soup.triangles.len(), "triangles are in pieces");
            let escapes = [(&bvh, RAYS), (&pieces, RAYS / 5)]
                .map(|(bvh, rays)| escaped(bvh, rays, &soup, scale, offset));
            assert_eq!(escapes, [0, 0], "scale {scale}, offset {offset}");
        }
    }
}

/// From outside, a ray enters a closed mesh as often as it leaves it. Counted by the edge
/// functions over all triangles, for rays that meet no edge exactly (two triangles would count).
#[test]
fn rays_from_outside_leave_as_often_as_they_enter() {
    for (scale, offset) in [(1.0, Vec3::ZERO), (1.0, Vec3::splat(1e5)), (1e12, Vec3::ZERO)] {
        let soup = placed(bumpy_ball(4), scale, offset);
        let bounds: Bounds3 = soup.positions.iter().copied().collect();
        let counts = |seed: u64| {
            let mut r = Random(seed);
            let mut counted = 0;
            for _ in 0..500 {
                let away = r.direction().as_vec3() * 3.0 * scale;
                let origin = away + offset;
                // Mostly through the silhouette: perpendicular to the way to the centre.
                let across = r.direction().as_vec3().cross(away).normalize();
                let aim = offset + across * scale * (0.6 + 0.6 * r.unit());
                let ray = Ray::new(origin, aim - origin);
                let ray = Prepared::new(&ray, &bounds).expect("a usable ray");
                let mut sum = 0;
                let sides: Vec<_> =
                    (0..soup.triangles.len()).map(|i| side(&ray, soup.corners(i))).collect();
                if sides.contains(&Side::Edge) {
                    continue;
                }
                for s in sides {
                    sum += match s {
                        Side::Positive => 1,
                        Side::Negative => -1,
                        Side::Edge | Side::Outside => 0,
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
