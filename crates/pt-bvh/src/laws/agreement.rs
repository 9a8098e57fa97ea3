//! All builders and kernels return the bits of a loop over all primitives.

use proptest::prelude::*;
use pt_math::{Ray, RayColumns, Vec3};
use pt_testing::Random;

use super::{Soup, bumpy_ball, in_pieces};
use crate::{BuildOptions, Builder, Bvh, Bvh2, Hit, Sphere, check};

/// The bits of a hit, so that −0 differs from 0 and NaN equals itself.
pub(super) fn bits(hit: Option<Hit>) -> Option<[u32; 4]> {
    hit.map(|h| [h.t.to_bits(), h.b1.to_bits(), h.b2.to_bits(), h.primitive])
}

/// Coordinates on a small grid, so that many coincide, or arbitrary ones.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => (-3i8..=3).prop_map(f32::from),
        3 => -3.0f32..3.0,
        1 => prop_oneof![Just(-0.0f32), Just(1e-30), Just(-1e-6), Just(1e4)],
    ]
}

pub(super) fn point() -> impl Strategy<Value = Vec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array)
}

/// Points, among them some that make a primitive unusable.
fn vertex() -> impl Strategy<Value = Vec3> {
    prop_oneof![
        40 => point(),
        1 => Just(Vec3::new(f32::NAN, 0.0, 0.0)),
        1 => Just(Vec3::new(0.0, f32::INFINITY, 1.0)),
        1 => Just(Vec3::new(0.0, 1.0, -1e30)),
    ]
}

fn sphere() -> impl Strategy<Value = Sphere> {
    let radius = prop_oneof![
        8 => 0.01f32..2.0,
        1 => prop_oneof![Just(0.0f32), Just(-1.0), Just(f32::NAN), Just(1e-20), Just(1e6)],
    ];
    (vertex(), radius).prop_map(|(center, radius)| Sphere { center, radius })
}

pub(super) fn soup() -> impl Strategy<Value = Soup> {
    let vertices = prop::collection::vec(vertex(), 1..24);
    let triangles = prop::collection::vec(any::<[prop::sample::Index; 3]>(), 0..60);
    let spheres = prop::collection::vec(sphere(), 0..12);
    // Powers of two change no result except by overflow and underflow; other factors blur the grid.
    let scale = prop_oneof![4 => Just(1.0f32), 1 => Just(0.37), 1 => Just(2f32.powi(40)),
        1 => Just(2f32.powi(-40)), 1 => Just(2f32.powi(-75))];
    (vertices, triangles, spheres, scale).prop_map(|(positions, triangles, spheres, scale)| {
        let n = positions.len();
        let scaled = |s: Sphere| Sphere { center: s.center * scale, radius: s.radius * scale };
        Soup {
            triangles: triangles.iter().map(|t| t.map(|i| i.index(n) as u32)).collect(),
            positions: positions.into_iter().map(|p| p * scale).collect(),
            spheres: spheres.into_iter().map(scaled).collect(),
        }
    })
}

/// Recipe for a ray in a given scene.
#[derive(Clone, Debug)]
struct RayRecipe {
    origin: Vec3,
    direction: Vec3,
    /// Target of the ray, a vertex or the midpoint of two, instead of `direction`.
    at: Option<(prop::sample::Index, prop::sample::Index)>,
    from_vertex: Option<prop::sample::Index>,
    length: f32,
    interval: (f32, f32),
}

fn recipe() -> impl Strategy<Value = RayRecipe> {
    let axis = prop_oneof![Just(0.0f32), Just(-0.0), Just(1.0), Just(-1.0)];
    let direction = prop_oneof![
        [axis.clone(), axis.clone(), axis].prop_map(Vec3::from_array),
        point(),
        (point(), Just(1e-8f32)).prop_map(|(p, e)| Vec3::X + p * e),
    ];
    let length = prop_oneof![4 => Just(1.0f32), 1 => Just(3e-20), 1 => Just(2f32.powi(60))];
    let interval = prop_oneof![
        4 => Just((0.0f32, f32::INFINITY)),
        1 => Just((-1.0, 2.0)),
        1 => (0.0f32..3.0, 0.0f32..6.0),
        1 => Just((0.0, f32::NAN)),
    ];
    let index = || any::<prop::sample::Index>();
    let at = proptest::option::of((index(), index()));
    (point(), direction, at, proptest::option::weighted(0.2, index()), length, interval).prop_map(
        |(origin, direction, at, from_vertex, length, interval)| RayRecipe {
            origin,
            direction,
            at,
            from_vertex,
            length,
            interval,
        },
    )
}

impl RayRecipe {
    fn ray(&self, soup: &Soup) -> Ray {
        let p = &soup.positions;
        let scale = soup.positions.iter().fold(0.0f32, |s, p| {
            if p.is_finite() && p.abs().max_element() < 1e29 {
                s.max(p.abs().max_element())
            } else {
                s
            }
        });
        let scale = if scale > 0.0 { scale / 3.0 } else { 1.0 };
        let origin = self.from_vertex.map_or(self.origin * scale, |i| *i.get(p));
        let direction = match self.at {
            Some((i, j)) => (*i.get(p) + *j.get(p)) * 0.5 - origin,
            None => self.direction * scale,
        };
        let (t_min, t_max) = self.interval;
        Ray { origin, direction: direction * self.length, t_min, t_max }
    }
}

/// Returns the hit on which all kernels and trees agree, or an error that names the disagreement.
fn agreed(soup: &Soup, ray: &Ray, kernels: &[Bvh], trees: &[Bvh2]) -> Result<Option<Hit>, String> {
    let geometry = soup.geometry();
    let expected = kernels[0].intersect(ray);
    for (i, tree) in trees.iter().enumerate() {
        let hit = tree.intersect(&geometry, ray);
        if bits(hit) != bits(expected) {
            return Err(format!("tree {i}: {hit:?} instead of {expected:?} for {ray:?}"));
        }
    }
    for (i, kernel) in kernels.iter().enumerate() {
        let hit = kernel.intersect(ray);
        if bits(hit) != bits(expected) {
            return Err(format!("kernel {i}: {hit:?} instead of {expected:?} for {ray:?}"));
        }
        let mut tests = 0;
        let counted = kernel.intersect_counted(ray, &mut tests);
        if bits(counted) != bits(expected) || (expected.is_some() && tests == 0) {
            return Err(format!("kernel {i} counts {tests} tests, {counted:?}"));
        }
        if kernel.occluded(ray) != expected.is_some()
            || kernel.occluded_counted(ray, &mut tests) != expected.is_some()
        {
            return Err(format!("kernel {i} sees otherwise that {ray:?} is occluded"));
        }
    }
    Ok(expected)
}

/// Returns an error if the results of a kernel for a slice of rays differ from those for single
/// rays. The counted queries take the rays by columns.
fn batches_agree(kernels: &[Bvh], rays: &[Ray]) -> Result<(), String> {
    let columns: RayColumns = rays.iter().copied().collect();
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    let and_without = |kernel: &Bvh| [kernel.clone(), kernel.clone().without_avx512()];
    for (k, kernel) in kernels.iter().flat_map(and_without).enumerate() {
        kernel.intersect_batch(rays, &mut hits);
        kernel.occluded_batch(rays, &mut occluded);
        let mut counted = (Vec::new(), Vec::new(), 0);
        kernel.intersect_batch_counted(&columns, &mut counted.0, &mut counted.2);
        let hit_any = hits.iter().any(Option::is_some);
        if counted.0.iter().map(|&h| bits(h)).ne(hits.iter().map(|&h| bits(h)))
            || (hit_any && counted.2 == 0)
        {
            return Err(format!("kernel {k} counts {} tests and finds otherwise", counted.2));
        }
        counted.2 = 0;
        kernel.occluded_batch_counted(&columns, &mut counted.1, &mut counted.2);
        if counted.1 != occluded || (hit_any && counted.2 == 0) {
            return Err(format!("kernel {k} counts {} tests and sees otherwise", counted.2));
        }
        if hits.len() != rays.len() || occluded.len() != rays.len() {
            return Err(format!("kernel {k} answers {} of {} rays", hits.len(), rays.len()));
        }
        for (ray, (&hit, &occluded)) in rays.iter().zip(hits.iter().zip(&occluded)) {
            let expected = kernel.intersect(ray);
            if bits(hit) != bits(expected) || occluded != expected.is_some() {
                return Err(format!(
                    "kernel {k} in a batch: {hit:?}, {occluded}, instead of {expected:?} for {ray:?}"
                ));
            }
        }
    }
    Ok(())
}

/// The loop first, then a kernel and a binary tree for each combination of build options.
fn all_ways(soup: &Soup, leaf_sizes: &[u32]) -> (Vec<Bvh>, Vec<Bvh2>) {
    let geometry = soup.geometry();
    let (mut kernels, mut trees) = (Vec::new(), Vec::new());
    let list = BuildOptions { builder: Builder::None, ..BuildOptions::default() };
    kernels.push(Bvh::build(geometry, &list).expect("indices are in range"));
    for builder in [Builder::Sah, Builder::Mean] {
        for &max_leaf_size in leaf_sizes {
            let options = BuildOptions { builder, max_leaf_size, ..BuildOptions::default() };
            let tree = Bvh2::build(&geometry, &options).expect("indices are in range");
            assert_eq!(check::verify(&tree, &geometry), Ok(()), "{options:?}");
            let kernel = Bvh::build(geometry, &options).expect("indices are in range");
            assert_eq!(kernel.bounds(), kernels[0].bounds());
            assert_eq!(kernel.skipped(), kernels[0].skipped());
            trees.push(tree);
            kernels.push(kernel);
        }
    }
    for &max_leaf_size in leaf_sizes {
        let options = BuildOptions { max_leaf_size, ..BuildOptions::default() };
        let (tree, kernel) = in_pieces(soup, options);
        assert_eq!(check::verify(&tree, &geometry), Ok(()), "in pieces");
        assert_eq!(kernel.bounds(), kernels[0].bounds());
        assert_eq!(kernel.skipped(), kernels[0].skipped());
        trees.push(tree);
        kernels.extend([kernel.clone().taken_for_large(), kernel]);
    }
    (kernels, trees)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn kernels_agree_on_hostile_soups(
        soup in soup(),
        recipes in prop::collection::vec(recipe(), 24),
        leaf_size in prop_oneof![Just(1u32), Just(2), Just(4), Just(8), Just(64)],
    ) {
        let (kernels, trees) = all_ways(&soup, &[leaf_size]);
        let mut rays = Vec::new();
        for recipe in recipes {
            let ray = recipe.ray(&soup);
            rays.push(ray);
            let hit = agreed(&soup, &ray, &kernels, &trees).map_err(TestCaseError::fail)?;
            // An interval that ends at the hit excludes it.
            if let Some(hit) = hit {
                let before = Ray { t_max: hit.t, ..ray };
                let after = Ray { t_min: hit.t, ..ray };
                rays.extend([before, after]);
                for ray in [before, after] {
                    let other = agreed(&soup, &ray, &kernels, &trees);
                    let other = other.map_err(TestCaseError::fail)?;
                    prop_assert!(other.is_none_or(|h| h.t > hit.t));
                }
            }
        }
        batches_agree(&kernels, &rays).map_err(TestCaseError::fail)?;
    }
}

/// Triangles with corners on a grid: many coincide, touch and are coplanar.
fn grid_soup(n: usize) -> Soup {
    let mut r = Random::new(7);
    let mut soup = Soup::default();
    for i in 0..n as u32 {
        let corner = (r.in_cube() * 10.0).floor();
        for _ in 0..3 {
            soup.positions.push(corner + (r.in_cube() * 2.0).floor());
        }
        soup.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        if i % 16 == 0 {
            soup.spheres.push(Sphere { center: corner, radius: 0.5 + r.unit() });
        }
    }
    soup
}

#[test]
fn kernels_agree_on_a_grid_where_much_coincides() {
    let soup = grid_soup(4000);
    let (kernels, trees) = all_ways(&soup, &[4, 8]);
    let mut r = Random::new(11);
    let mut hits = 0;
    let mut rays = Vec::new();
    for i in 0..1500 {
        let origin = (r.in_cube() * 14.0).floor();
        let direction = match i % 3 {
            0 => (r.in_cube() * 3.0).floor(),
            1 => (r.in_cube() * 10.0).floor() - origin,
            _ => r.in_cube(),
        };
        rays.push(Ray::new(origin, direction));
        let hit = agreed(&soup, &Ray::new(origin, direction), &kernels, &trees);
        hits += usize::from(hit.expect("all agree").is_some());
    }
    for n in [0, 1, 9, 127, 128, 129, 1500] {
        assert_eq!(batches_agree(&kernels[1..], &rays[..n]), Ok(()));
    }
    assert!(hits > 700, "most rays hit something: {hits}");
}

#[test]
fn kernels_agree_on_a_mesh_from_near_and_far() {
    let soup = bumpy_ball(5);
    let (kernels, trees) = all_ways(&soup, &[8]);
    let mut r = Random::new(3);
    let mut rays = Vec::new();
    for i in 0..600 {
        let distance = [0.1, 1.0, 3.0, 1e4][i % 4];
        let origin = r.in_cube() * distance;
        let target = soup.positions[r.below(soup.positions.len())];
        rays.push(Ray::new(origin, target - origin));
        let hit = agreed(&soup, &Ray::new(origin, target - origin), &kernels, &trees);
        hit.expect("all agree");
    }
    assert_eq!(batches_agree(&kernels[1..], &rays), Ok(()));
}

/// Rays through a small window: most are traced as packets, with some among them that end early,
/// start late, or are unusable.
fn side_by_side(r: &mut Random, origin: Vec3, target: Vec3, spread: f32, lens: f32) -> Vec<Ray> {
    let ray = |i: usize| {
        let origin = origin + r.in_cube() * lens;
        let direction = target - origin + r.in_cube() * spread;
        let whole = Ray::new(origin, direction);
        match i {
            0..128 => whole,
            128..256 => Ray { t_min: r.unit(), t_max: 2.0 * r.unit(), ..whole },
            _ if i % 40 == 3 => Ray { direction: Vec3::ZERO, ..whole },
            _ => whole,
        }
    };
    (0..384).map(ray).collect()
}

#[test]
fn kernels_agree_on_rays_side_by_side() {
    let mut r = Random::new(17);
    let mut touching = grid_soup(2000);
    touching.positions.iter_mut().for_each(|p| *p *= 0.1);
    for sphere in &mut touching.spheres {
        *sphere = Sphere { center: sphere.center * 0.1, radius: sphere.radius * 0.1 };
    }
    let mut hits = Vec::new();
    for soup in [bumpy_ball(5), touching] {
        let (kernels, _) = all_ways(&soup, &[8]);
        for i in 0..200 {
            let spread = 10f32.powi(-(i % 7));
            let lens = [0.0, 1e-6, 0.01][i as usize % 3];
            // From far and near, along the axes and across.
            let origin = match i % 5 {
                0 => Vec3::new(0.0, 0.0, 4.0),
                1 => (r.in_cube() * 2.0).round() * 0.5,
                2 => r.in_cube() * 1e3,
                _ => r.in_cube() * 2.0,
            };
            // Towards a vertex, where all may miss, or into a triangle.
            let triangle = soup.triangles[r.below(soup.triangles.len())];
            let [a, b, c] = triangle.map(|v| soup.positions[v as usize]);
            let is_inside = i % 2 == 1 && (b - a).cross(c - a).length() > 1e-5;
            let target = if is_inside { (a + b + c) / 3.0 } else { a };
            let rays = side_by_side(&mut r, origin, target, spread, lens);
            assert_eq!(batches_agree(&kernels[1..], &rays), Ok(()), "{i}");
            kernels[1].intersect_batch(&rays, &mut hits);
            assert!(
                spread > 0.01 || !is_inside || hits.iter().flatten().count() > 100,
                "{i}: most are aimed well"
            );
        }
    }
}

/// Neighbouring rays hit distant triangles of a dense mesh: packets would test all between them.
#[test]
fn packets_are_given_up_before_they_take_more_work_than_single_rays() {
    const SIZE: [usize; 2] = [32, 24];
    let soup = bumpy_ball(8);
    let bvh = Bvh::build(soup.geometry(), &BuildOptions::default()).expect("in range");
    let tile = |i: usize| [8 * (i / 64 % 4) + i % 8, 8 * (i / 256) + i / 8 % 8];
    let ray = |i: usize| {
        let [x, y] = [0, 1].map(|k| (tile(i)[k] as f32 + 0.5) / SIZE[k] as f32 - 0.5);
        Ray::new(Vec3::new(0.3, 0.2, 3.0), Vec3::new(0.8 * x, 0.6 * y, -1.0))
    };
    let pixels = SIZE[0] * SIZE[1];
    let rays: Vec<_> = (0..5 * pixels).map(|i| ray(i % pixels)).collect();
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    let [mut single, mut closest, mut any] = [0; 3];
    bvh.intersect_batch_counted(&rays, &mut hits, &mut closest);
    bvh.occluded_batch_counted(&rays, &mut occluded, &mut any);
    for ((ray, hit), is_hit) in rays.iter().zip(&hits).zip(&occluded) {
        assert_eq!(bits(*hit), bits(bvh.intersect_counted(ray, &mut single)));
        assert_eq!(*is_hit, hit.is_some());
    }
    assert!(hits.iter().flatten().count() > 2000);
    assert!(closest < 3 * single && any < 3 * single, "{closest} and {any}, {single} one by one");
}

/// Triangles seen edge-on, within rounding: their intersections are ill-conditioned, and the order
/// of hits depends on the last bits.
#[test]
fn kernels_agree_on_needles_along_the_ray() {
    let mut r = Random::new(13);
    let mut hits = 0;
    for i in 0..300 {
        let width = 10f32.powi(-3 - i % 5);
        let axis = r.direction();
        let near_axis = |r: &mut Random| axis * (10.0 * r.between(-1.0, 1.0)) + r.in_cube() * width;
        let mut soup = Soup::default();
        for k in 0..300 {
            soup.positions.extend([0; 3].map(|_| near_axis(&mut r)));
            soup.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
        }
        let (kernels, trees) = all_ways(&soup, &[1]);
        let mut rays = Vec::new();
        for _ in 0..200 {
            let origin = axis * -12.0 + r.in_cube() * width;
            let ray = Ray::new(origin, near_axis(&mut r) - origin);
            rays.push(ray);
            hits +=
                usize::from(agreed(&soup, &ray, &kernels, &trees).expect("all agree").is_some());
        }
        assert_eq!(batches_agree(&kernels, &rays), Ok(()));
    }
    assert!(hits > 10_000, "{hits}");
}
