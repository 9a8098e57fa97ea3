//! Hits in refitted trees are those of a loop over all primitives.

use pt_math::{Ray, Vec3};
use pt_testing::Random;

use super::pieces::needles;
use super::{Soup, bumpy_ball};
use crate::{BuildOptions, Builder, Bvh, Quality, RefitError, Sphere};

fn every_way() -> impl Iterator<Item = BuildOptions> {
    let builders = [Builder::Sah, Builder::Mean, Builder::None].into_iter();
    builders.flat_map(|builder| {
        let qualities = [Quality::Fast, Quality::Balanced, Quality::High].into_iter();
        qualities.map(move |quality| BuildOptions { builder, quality, ..BuildOptions::default() })
    })
}

/// Asserts that the tree returns the bits of the loop, for rays towards its primitives.
fn assert_right(bvh: &Bvh, soup: &Soup, r: &mut Random) {
    let list = BuildOptions { builder: Builder::None, ..BuildOptions::default() };
    let list = Bvh::build(soup.geometry(), &list).expect("indices are in range");
    assert_eq!((bvh.bounds(), bvh.skipped()), (list.bounds(), list.skipped()));
    let mut rays = Vec::new();
    for _ in 0..300 {
        let origin = r.in_cube() * 3.0;
        let target = soup.positions[r.below(soup.positions.len())] + r.in_cube() * 0.05;
        rays.push(Ray::new(origin, target - origin));
    }
    rays.extend((0..128).map(|_| Ray::new(Vec3::Z * 5.0, r.in_cube() * 0.1 - Vec3::Z)));
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    bvh.intersect_batch(&rays, &mut hits);
    bvh.occluded_batch(&rays, &mut occluded);
    for (i, ray) in rays.iter().enumerate() {
        let expected = list.intersect(ray);
        assert_eq!([bvh.intersect(ray), hits[i]], [expected; 2], "{ray:?}");
        assert_eq!([bvh.occluded(ray), occluded[i]], [expected.is_some(); 2], "{ray:?}");
    }
}

fn scene(r: &mut Random) -> Soup {
    let mut soup = needles(r, 400, 1e-2);
    soup.spheres = (0..40).map(|_| Sphere { center: r.in_cube(), radius: 0.05 }).collect();
    soup
}

#[test]
fn moved_primitives_are_found_where_they_are() {
    let mut r = Random::new(53);
    let start = scene(&mut r);
    for options in every_way() {
        let mut bvh = Bvh::build(start.geometry(), &options).expect("indices are in range");
        let mut soup = start.clone();
        for step in 0..4 {
            for p in &mut soup.positions {
                *p = Vec3::new(p.y, p.z, p.x) + r.in_cube() * 0.1;
            }
            for s in &mut soup.spheres {
                s.center += r.in_cube();
                s.radius = 0.05 + 0.1 * r.unit();
            }
            // At a distance, too.
            let moved = if step == 2 { Vec3::splat(1e3) } else { Vec3::ZERO };
            soup.positions.iter_mut().for_each(|p| *p += moved);
            bvh.refit(soup.geometry()).expect("the same primitives");
            assert_right(&bvh, &soup, &mut r);
            soup.positions.iter_mut().for_each(|p| *p -= moved);
        }
        bvh.refit(start.geometry()).expect("the same primitives");
        assert_right(&bvh, &start, &mut r);
    }
}

#[test]
fn primitives_may_become_unusable_and_usable() {
    let mut r = Random::new(59);
    let whole = scene(&mut r);
    for options in every_way() {
        // Some primitives are unusable from the start.
        let mut soup = whole.clone();
        soup.positions[0] = Vec3::splat(f32::NAN);
        soup.spheres[0].radius = 0.0;
        let mut bvh = Bvh::build(soup.geometry(), &options).expect("indices are in range");
        let mut changed = soup.clone();
        for i in (0..changed.positions.len()).step_by(7) {
            changed.positions[i].y = [f32::INFINITY, f32::NAN, 1e30][i % 3];
        }
        for i in (0..changed.spheres.len()).step_by(3) {
            changed.spheres[i].radius = [-1.0, f32::NAN, 0.0][i % 3];
        }
        let mut nothing = whole.clone();
        nothing.positions.fill(Vec3::ONE);
        nothing.spheres.fill(Sphere { center: Vec3::ONE, radius: 0.0 });
        for next in [&changed, &soup, &changed, &whole, &nothing, &changed, &whole] {
            bvh.refit(next.geometry()).expect("the same primitives");
            assert_right(&bvh, next, &mut r);
        }
    }
}

#[test]
fn a_refitted_tree_survives_being_written_and_read() {
    let mut r = Random::new(61);
    let mut soup = scene(&mut r);
    let mut bvh = Bvh::build(soup.geometry(), &BuildOptions::default()).expect("in range");
    for i in (0..soup.positions.len()).step_by(2) {
        soup.positions[i].x = f32::NAN;
    }
    soup.spheres[3].radius = -1.0;
    bvh.refit(soup.geometry()).expect("the same primitives");
    let mut read = Bvh::from_bytes(&bvh.to_bytes()).expect("nothing was changed");
    assert_right(&read, &soup, &mut r);
    let again = scene(&mut Random::new(53));
    read.refit(again.geometry()).expect("the same numbers of primitives");
    assert_right(&read, &again, &mut r);
}

#[test]
fn other_primitives_are_an_error() {
    let soup = bumpy_ball(2);
    let mut bvh = Bvh::build(soup.geometry(), &BuildOptions::default()).expect("in range");
    let mut fewer = soup.clone();
    fewer.triangles.pop();
    let error = RefitError::Counts { triangles: fewer.triangles.len(), spheres: 0 };
    assert_eq!(bvh.refit(fewer.geometry()), Err(error));
    let mut wrong = soup.clone();
    wrong.triangles[5][1] = 1_000_000;
    assert!(matches!(bvh.refit(wrong.geometry()), Err(RefitError::Geometry(_))));
    assert_right(&bvh, &soup, &mut Random::new(67));
}
