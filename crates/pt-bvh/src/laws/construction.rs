//! Trees are the same for any number of threads, valid, and never too deep.

use pt_math::{Ray, Vec3};
use pt_testing::Random;
use rayon::ThreadPoolBuilder;

use super::{Soup, bumpy_ball};
use crate::{
    BuildError, BuildOptions, Builder, Bvh, Bvh2, Geometry, MAX_DEPTH, Quality, Sphere, check,
};

const BUILDERS: [Builder; 2] = [Builder::Sah, Builder::Mean];

fn with_threads(threads: usize, soup: &Soup, options: BuildOptions) -> Bvh2 {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    pool.install(|| Bvh2::build(&soup.geometry(), &options)).expect("indices are in range")
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let soup = bumpy_ball(7);
    let qualities = [Quality::Fast, Quality::Balanced, Quality::High].into_iter();
    let builders = qualities.map(|quality| (Builder::Sah, quality));
    for (builder, quality) in builders.chain([(Builder::Mean, Quality::default())]) {
        let options = BuildOptions { builder, quality, ..BuildOptions::default() };
        let one = with_threads(1, &soup, options);
        let many = with_threads(5, &soup, options);
        assert!(one.nodes == many.nodes && one.order == many.order, "{options:?}");
        assert_eq!(check::verify(&one, &soup.geometry()), Ok(()));
    }
}

/// One small triangle at each position.
fn triangles_at(places: impl Iterator<Item = (Vec3, f32)>) -> Soup {
    let mut soup = Soup::default();
    for (p, size) in places {
        let i = soup.positions.len() as u32;
        soup.positions.extend([p, p + Vec3::X * size, p + Vec3::Y * size]);
        soup.triangles.push([i, i + 1, i + 2]);
    }
    soup
}

#[test]
fn hopeless_distributions_do_not_grow_deep() {
    let n = 300_000;
    let coincident = triangles_at((0..n).map(|_| (Vec3::ONE, 1.0)));
    let mut r = Random::new(5);
    // Each at half the distance from 0 of the one before, in several passes.
    let exponential = triangles_at((0..n).map(|i| {
        let size = 2f32.powi(40 - i % 90);
        (Vec3::splat(size) * (1.0 + 0.001 * r.unit()), size * 0.01)
    }));
    for soup in [coincident, exponential] {
        for builder in BUILDERS {
            let options = BuildOptions { builder, max_leaf_size: 4, ..BuildOptions::default() };
            let tree = Bvh2::build(&soup.geometry(), &options).expect("indices are in range");
            assert_eq!(check::verify(&tree, &soup.geometry()), Ok(()));
            assert!(tree.depth() as usize <= MAX_DEPTH);
            assert!(tree.nodes.iter().all(|n| n.count <= 4));
        }
    }
}

#[test]
fn of_coincident_triangles_the_first_is_hit() {
    let soup = triangles_at((0..1000).map(|_| (Vec3::ZERO, 1.0)));
    for builder in BUILDERS {
        let options = BuildOptions { builder, ..BuildOptions::default() };
        let bvh = Bvh::build(soup.geometry(), &options).expect("indices are in range");
        let hit = bvh.intersect(&Ray::new(Vec3::new(0.25, 0.25, -3.0), Vec3::Z));
        assert_eq!(hit.map(|h| (h.primitive, h.t)), Some((0, 3.0)));
    }
}

#[test]
fn unusable_primitives_are_skipped_and_counted() {
    let positions = [
        Vec3::ZERO,
        Vec3::X,
        Vec3::Y,
        Vec3::new(f32::NAN, 0.0, 0.0),
        Vec3::new(0.0, f32::NEG_INFINITY, 0.0),
        Vec3::X * 3.0,
        Vec3::Z * 2e18,
    ];
    let triangles = [[0, 1, 3], [0, 1, 2], [4, 1, 2], [0, 1, 5], [0, 0, 1], [0, 1, 6]];
    let sphere = |radius: f32| Sphere { center: Vec3::Z * 5.0, radius };
    let spheres = [sphere(0.0), sphere(f32::NAN), sphere(-1.0), sphere(1.0), sphere(f32::INFINITY)];
    let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &spheres };
    for builder in [Builder::Sah, Builder::Mean, Builder::None] {
        let options = BuildOptions { builder, ..BuildOptions::default() };
        let bvh = Bvh::build(geometry, &options).expect("indices are in range");
        // Triangle 1 and sphere 3 are left.
        assert_eq!(bvh.skipped(), 9);
        let hit = |o: Vec3| bvh.intersect(&Ray::new(o, Vec3::Z)).map(|h| h.primitive);
        assert_eq!(hit(Vec3::new(0.25, 0.25, -1.0)), Some(1));
        assert_eq!(hit(Vec3::new(-0.25, -0.25, -1.0)), Some(9));
    }
}

#[test]
fn nothing_is_hit_where_there_is_nothing() {
    for builder in [Builder::Sah, Builder::Mean, Builder::None] {
        let options = BuildOptions { builder, ..BuildOptions::default() };
        let bvh = Bvh::build(Geometry::default(), &options).expect("nothing is wrong");
        assert!(bvh.bounds().is_empty());
        assert_eq!(bvh.intersect(&Ray::new(Vec3::ZERO, Vec3::X)), None);
        assert!(!bvh.occluded(&Ray::new(Vec3::ZERO, Vec3::X)));
    }
}

#[test]
fn rays_without_direction_or_place_hit_nothing() {
    let soup = bumpy_ball(2);
    for builder in [Builder::Sah, Builder::Mean, Builder::None] {
        let options = BuildOptions { builder, ..BuildOptions::default() };
        let bvh = Bvh::build(soup.geometry(), &options).expect("indices are in range");
        let wrong = [f32::NAN, f32::INFINITY];
        let directions = wrong.map(|x| Ray::new(Vec3::ZERO, Vec3::new(x, 1.0, 0.0)));
        let origins = wrong.map(|x| Ray::new(Vec3::new(0.0, x, 0.0), Vec3::X));
        let none = Ray::new(Vec3::ZERO, Vec3::ZERO);
        for ray in directions.into_iter().chain(origins).chain([none]) {
            assert_eq!(bvh.intersect(&ray), None, "{ray:?}");
            assert!(!bvh.occluded(&ray));
        }
    }
}

#[test]
fn indices_out_of_range_are_an_error() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let triangles = [[0, 1, 2], [0, 3, 7]];
    let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
    for builder in [Builder::Sah, Builder::Mean, Builder::None] {
        let options = BuildOptions { builder, ..BuildOptions::default() };
        let error = Bvh::build(geometry, &options).err();
        let expected = BuildError::IndexOutOfRange { triangle: 1, index: 3, vertices: 3 };
        assert_eq!(error, Some(expected));
    }
}

#[test]
fn verification_notices_damage() {
    let soup = bumpy_ball(3);
    let geometry = soup.geometry();
    let good = Bvh2::build(&geometry, &BuildOptions::default()).expect("indices are in range");
    let damaged = |damage: &dyn Fn(&mut Bvh2)| {
        let mut bvh = good.clone();
        damage(&mut bvh);
        check::verify(&bvh, &geometry)
    };
    assert_eq!(damaged(&|_| ()), Ok(()));
    let last = good.nodes.len() - 1;
    assert!(damaged(&|b| b.order[0] = b.order[1]).is_err());
    assert!(damaged(&|b| b.nodes[last].max.x += 1.0).is_err());
    assert!(damaged(&|b| b.nodes[0].min.y += 0.1).is_err());
    assert!(damaged(&|b| b.nodes[last].count -= 1).is_err());
    assert!(damaged(&|b| b.nodes[0].offset += 1).is_err());
    assert!(damaged(&|b| b.order.reverse()).is_err());
}
