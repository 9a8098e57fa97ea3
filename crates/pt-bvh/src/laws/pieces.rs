//! Hits in trees with cut triangles are those of a loop over all primitives.

use pt_math::{Ray, Vec3};
use pt_testing::Random;
use rayon::ThreadPoolBuilder;

use super::{Soup, bumpy_ball};
use crate::{BuildOptions, Builder, Bvh, Bvh2, Quality, check};

/// A small ball and `n` triangles with a width of about `width` that extend across the whole scene.
pub(super) fn needles(r: &mut Random, n: u32, width: f32) -> Soup {
    let mut soup = bumpy_ball(3);
    for p in &mut soup.positions {
        *p *= 0.3;
    }
    for _ in 0..n {
        let first = soup.positions.len() as u32;
        let (a, b) = (r.in_cube() * 2.0, r.in_cube() * 2.0);
        soup.positions.extend([a, b, b.lerp(a, r.unit()) + r.in_cube() * width]);
        soup.triangles.push([first, first + 1, first + 2]);
    }
    soup
}

fn options(quality: Quality) -> BuildOptions {
    BuildOptions { quality, ..BuildOptions::default() }
}

/// Builds with a given number of threads.
fn with_threads(threads: usize, soup: &Soup, quality: Quality) -> Bvh2 {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    pool.install(|| Bvh2::build(&soup.geometry(), &options(quality))).expect("indices are in range")
}

/// Asserts that each kernel returns the bits of the loop.
fn assert_same(soup: &Soup, rays: &[Ray]) {
    let list = BuildOptions { builder: Builder::None, ..BuildOptions::default() };
    let list = Bvh::build(soup.geometry(), &list).expect("indices are in range");
    for quality in [Quality::Balanced, Quality::High] {
        let options = BuildOptions { quality, ..BuildOptions::default() };
        for max_leaf_size in [1, 8, 64] {
            let options = BuildOptions { max_leaf_size, ..options };
            let hub = Bvh2::build(&soup.geometry(), &options).expect("indices are in range");
            assert!(hub.order.len() > soup.triangles.len(), "triangles are in pieces");
            assert_eq!(check::verify(&hub, &soup.geometry()), Ok(()));
            let bvh = Bvh::build(soup.geometry(), &options).expect("indices are in range");
            assert_eq!(bvh.bounds(), list.bounds());
            let (mut hits, mut occluded) = (Vec::new(), Vec::new());
            bvh.intersect_batch(rays, &mut hits);
            bvh.occluded_batch(rays, &mut occluded);
            for (i, ray) in rays.iter().enumerate() {
                let expected = list.intersect(ray);
                let found = [bvh.intersect(ray), hits[i], hub.intersect(&soup.geometry(), ray)];
                assert_eq!(found, [expected; 3], "{ray:?}");
                assert_eq!([bvh.occluded(ray), occluded[i]], [expected.is_some(); 2], "{ray:?}");
            }
        }
    }
}

#[test]
fn kernels_agree_on_needles_in_pieces() {
    let mut r = Random::new(23);
    let mut hits = 0;
    for width in [1e-1, 1e-3, 1e-5] {
        for (scale, offset) in [(1.0, Vec3::ZERO), (1.0, Vec3::splat(1e4)), (1e-21, Vec3::ZERO)] {
            let mut soup = needles(&mut r, 400, width);
            for p in &mut soup.positions {
                *p = *p * scale + offset;
            }
            let mut rays: Vec<Ray> = Vec::new();
            for i in 0..300 {
                let origin = r.in_cube() * 3.0 * scale + offset;
                let [a, b, c] = soup.corners(r.below(soup.triangles.len()));
                let inside = a.lerp(b, r.unit()).lerp(c, r.unit());
                let target = [a, a.lerp(b, r.unit()), inside][i % 3];
                rays.push(Ray::new(origin, target - origin));
                // Nearly along the triangle, where rounding matters most.
                let behind = a - (target - a) * 0.1;
                rays.push(Ray::new(behind, target - behind));
            }
            // Coherent rays.
            for _ in 0..200 {
                let origin = Vec3::new(0.0, 0.0, 4.0) * scale + offset;
                rays.push(Ray::new(origin, (r.in_cube() * 0.2 - Vec3::Z) * scale));
            }
            assert_same(&soup, &rays);
            let bvh = Bvh::build(soup.geometry(), &BuildOptions::default()).expect("in range");
            hits += rays.iter().filter(|ray| bvh.intersect(ray).is_some()).count();
        }
    }
    assert!(hits > 3000, "most rays hit something: {hits}");
}

#[test]
fn pieces_do_not_depend_on_the_number_of_threads() {
    let soup = needles(&mut Random::new(29), 20_000, 1e-2);
    for quality in [Quality::Fast, Quality::Balanced, Quality::High] {
        let one = with_threads(1, &soup, quality);
        for threads in [2, 3, 7] {
            let many = with_threads(threads, &soup, quality);
            assert!(one.nodes == many.nodes && one.order == many.order, "{quality:?} {threads}");
        }
    }
}

#[test]
fn references_stay_within_the_budget() {
    let soup = needles(&mut Random::new(31), 20_000, 1e-2);
    let n = soup.triangles.len();
    for (quality, least, most) in
        [(Quality::Fast, 1.0, 1.0), (Quality::Balanced, 1.1, 1.3), (Quality::High, 1.2, 1.5)]
    {
        let bvh = Bvh::build(soup.geometry(), &options(quality)).expect("indices are in range");
        let share = bvh.statistics().references as f32 / n as f32;
        assert!((least..=most).contains(&share), "{quality:?}: {share}");
        assert_eq!(bvh.skipped(), 0);
    }
}

#[test]
fn meshes_without_needles_stay_whole() {
    let soup = bumpy_ball(5);
    let bvh = Bvh::build(soup.geometry(), &options(Quality::High)).expect("indices are in range");
    assert_eq!(bvh.statistics().references, soup.triangles.len());
}

#[test]
fn verification_notices_a_lost_piece() {
    let soup = needles(&mut Random::new(37), 400, 1e-3);
    let geometry = soup.geometry();
    let good = Bvh2::build(&geometry, &options(Quality::High)).expect("indices are in range");
    let times = |id: u32| good.order.iter().filter(|&&o| o == id).count();
    let cut = (0..soup.triangles.len() as u32).max_by_key(|&id| times(id)).expect("there are some");
    assert!(times(cut) > 3);
    // In each leaf in turn, the piece is replaced by a triangle of the ball.
    let (mut lost, mut noticed) = (0, 0);
    for leaf in good.nodes.iter().filter(|n| n.is_leaf()) {
        let places = leaf.offset as usize..(leaf.offset + leaf.count) as usize;
        if good.order[places.clone()].contains(&cut) {
            let mut damaged = good.clone();
            damaged.order[places].iter_mut().filter(|id| **id == cut).for_each(|id| *id = 0);
            noticed += u32::from(check::verify(&damaged, &geometry).is_err());
            lost += 1;
        }
    }
    // A corner of a piece may lie between the sample points.
    assert!(lost > 2 && noticed > lost / 2, "{noticed} of {lost}");
}
