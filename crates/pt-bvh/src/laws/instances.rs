//! Hits on instances are those of a loop that intersects each object.

use std::sync::Arc;

use proptest::prelude::*;
use pt_math::{DAffine3, DMat3, DQuat, DVec3, Ray, Vec3};
use pt_testing::Random;

use super::agreement::{bits, soup};
use super::user::assert_looped;
use super::{Soup, ball, bumpy_ball};
use crate::geometry::in_range;
use crate::{BuildOptions, Bvh, Instance, InstanceBvh, InstanceHit, Sphere, TransformError};

fn object(soup: &Soup) -> Arc<Bvh> {
    Arc::new(Bvh::build(soup.geometry(), &BuildOptions::default()).expect("indices are in range"))
}

/// Returns the hit of a loop over the instances.
fn looped(instances: &[Instance], ray: &Ray) -> Option<InstanceHit> {
    let hits = (0..).zip(instances).filter_map(|(instance, placed)| {
        let hit = placed.object().intersect(&placed.to_object(ray))?;
        Some(InstanceHit { instance, hit })
    });
    hits.min_by(|a, b| a.hit.t.total_cmp(&b.hit.t))
}

/// Asserts that single queries and batches return the bits of the loop; returns the number of hits.
fn assert_right(scene: &InstanceBvh, rays: &[Ray]) -> usize {
    let all_bits = |hit: Option<InstanceHit>| hit.map(|h| (h.instance, bits(Some(h.hit))));
    for ray in rays {
        let expected = looped(scene.primitives(), ray);
        assert_eq!(all_bits(scene.intersect(ray)), all_bits(expected), "{ray:?}");
    }
    assert_looped(scene, rays)
}

/// The shortest rotation from one random direction to another.
fn arc(r: &mut Random) -> DQuat {
    let [from, to] = [0; 2].map(|_| r.direction().as_dvec3());
    DQuat::from_rotation_arc(from, to)
}

/// Linear part of a placement: scale, rotation and shear.
fn linear() -> impl Strategy<Value = DMat3> {
    let exponent = || -3.0..3.0f64;
    let size = prop_oneof![
        Just(DVec3::ONE),
        exponent().prop_map(|x| DVec3::splat(10f64.powf(x))),
        [exponent(), exponent(), exponent()]
            .prop_map(|x| DVec3::from_array(x.map(|x| 10f64.powf(x)))),
        Just(DVec3::new(1e3, 1e-3, 1.0)),
    ];
    let sign = || prop_oneof![Just(1.0f64), Just(-1.0)];
    let mirror = [sign(), sign(), sign()].prop_map(DVec3::from_array);
    let shear = prop_oneof![2 => Just([0.0; 3]), 1 => [-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64]];
    let turn = || {
        prop_oneof![
            Just(DQuat::IDENTITY),
            Just(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)),
            any::<u64>().prop_map(|seed| arc(&mut Random::new(seed))),
        ]
    };
    (turn(), size, mirror, shear, turn()).prop_map(|(before, size, mirror, [a, b, c], after)| {
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(a, 1.0, 0.0), DVec3::new(b, c, 1.0));
        let after = DMat3::from_quat(after) * shear;
        after * DMat3::from_diagonal(size * mirror) * DMat3::from_quat(before)
    })
}

fn transform() -> impl Strategy<Value = DAffine3> {
    let coordinate =
        || prop_oneof![3 => (-4i8..=4).prop_map(f64::from), 1 => -4.0..4.0f64, 1 => Just(1e5)];
    let translation = [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array);
    (linear(), translation).prop_map(|(m, t)| DAffine3::from_mat3_translation(m, t))
}

/// Rays through a scene with geometry at each of the points: towards them and between them, from
/// near and far, and along the axes.
fn rays(points: &[Vec3], r: &mut Random, number: usize) -> Vec<Ray> {
    let mut rays = Vec::new();
    while rays.len() < number {
        let target = points[r.below(points.len())];
        let other = points[r.below(points.len())];
        let distance = [1e-2, 1.0, 10.0, 1e3, 1e6][r.below(5)];
        let origin = match r.below(4) {
            0 => target + r.in_cube() * distance,
            1 => target + (r.in_cube() * 2.0).round() * distance,
            2 => other + (other - target) * distance,
            _ => other,
        };
        let towards = if r.below(8) == 0 { (target + other) * 0.5 } else { target };
        let direction = (towards - origin) * [1.0, 1e-12, 1e12][r.below(3)];
        let whole = Ray::new(origin, direction);
        if !in_range(origin) {
            continue;
        }
        rays.push(match r.below(8) {
            0 => Ray { t_max: 0.999, ..whole },
            1 => Ray { t_min: r.unit(), ..whole },
            _ => whole,
        });
    }
    rays
}

/// World positions of the vertices, and of the extremes of spheres along x.
fn points(soup: &Soup, to_world: &DAffine3) -> Vec<Vec3> {
    let corners = |s: &Sphere| [-1.0, 1.0].map(|sign| s.center + Vec3::X * (sign * s.radius));
    let all = soup.positions.iter().copied().chain(soup.spheres.iter().flat_map(corners));
    let all = all.map(|p| to_world.transform_point3(p.as_dvec3()).as_vec3());
    all.filter(|p| in_range(*p)).collect()
}

/// Places soups, and returns points to aim at.
fn place(soups: &[Soup], transforms: &[(usize, DAffine3)]) -> (Vec<Instance>, Vec<Vec3>) {
    let objects: Vec<Arc<Bvh>> = soups.iter().map(object).collect();
    let (mut instances, mut targets) = (Vec::new(), Vec::new());
    for (i, to_world) in transforms {
        let i = i % soups.len();
        // Singular transforms are rejected.
        if let Ok(instance) = Instance::new(Arc::clone(&objects[i]), *to_world) {
            instances.push(instance);
            targets.extend(points(&soups[i], to_world));
        }
    }
    (instances, targets)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn instances_of_hostile_soups_are_hit_as_in_a_loop(
        soups in prop::collection::vec(soup(), 1..4),
        transforms in prop::collection::vec((0usize..4, transform()), 1..24),
        seed: u64,
    ) {
        let (instances, targets) = place(&soups, &transforms);
        let scene = InstanceBvh::build(instances).expect("there are few");
        if !targets.is_empty() {
            assert_right(&scene, &rays(&targets, &mut Random::new(seed), 300));
        }
    }

    /// Rays towards the outermost vertices, which are on the faces of boxes.
    #[test]
    fn instances_are_hit_at_their_extremes(
        transforms in prop::collection::vec((0usize..2, transform()), 2..6),
        seed: u64,
    ) {
        let soups = [ball(0), bumpy_ball(1)];
        let (instances, targets) = place(&soups, &transforms);
        let scene = InstanceBvh::build(instances).expect("there are few");
        let r = &mut Random::new(seed);
        if !targets.is_empty() {
            assert_right(&scene, &rays(&targets, r, 1000));
        }
    }
}

#[test]
fn many_instances_of_a_mesh_are_hit_as_in_a_loop() {
    let mut r = Random::new(71);
    let soup = bumpy_ball(4);
    let object = object(&soup);
    let at = |r: &mut Random| {
        let m = DMat3::from_quat(arc(r));
        let t = r.in_cube().as_dvec3() * 20.0;
        DAffine3::from_mat3_translation(m * (0.5 + f64::from(r.unit())), t)
    };
    let instances: Vec<Instance> = (0..300)
        .map(|_| Instance::new(Arc::clone(&object), at(&mut r)).expect("not flat"))
        .collect();
    let mut scene = InstanceBvh::build(instances).expect("there are few");
    for _ in 0..2 {
        let middles: Vec<Vec3> =
            scene.primitives().iter().map(|i| i.to_world().translation.as_vec3()).collect();
        let mut all = rays(&middles, &mut r, 500);
        all.extend((0..700).map(|_| Ray::new(Vec3::Z * 60.0, r.in_cube() * 0.3 - Vec3::Z)));
        assert!(assert_right(&scene, &all) > 600);
        let moved = scene.update(|instances| {
            instances.iter_mut().try_for_each(|instance| instance.set_transform(at(&mut r)))
        });
        assert_eq!(moved, Ok(Ok(())));
    }
}

/// In the object, the rounding of ray origins exceeds all other rounding.
#[test]
fn objects_with_large_coordinates_are_hit_as_in_a_loop() {
    let mut r = Random::new(89);
    for offset in [1e3, -1e5, 1e7] {
        let offset = Vec3::new(offset, -0.7 * offset, 0.3 * offset);
        let mut soup = ball(1);
        soup.positions.iter_mut().for_each(|p| *p += offset);
        let back = DAffine3::from_translation(-offset.as_dvec3());
        let mut at = |_| {
            let turn = arc(&mut r);
            let place = r.in_cube().as_dvec3() * 3.0;
            (0, DAffine3::from_rotation_translation(turn, place) * back)
        };
        let transforms = [0; 8].map(&mut at);
        let (instances, targets) = place(&[soup], &transforms);
        let scene = InstanceBvh::build(instances).expect("there are few");
        assert!(assert_right(&scene, &rays(&targets, &mut r, 10_000)) > 3000);
    }
}

#[test]
fn an_object_in_its_place_is_hit_as_by_itself() {
    let soup = bumpy_ball(4);
    let object = object(&soup);
    let instance = Instance::new(Arc::clone(&object), DAffine3::IDENTITY).expect("not flat");
    let scene = InstanceBvh::build(vec![instance]).expect("there is one");
    for ray in rays(&soup.positions, &mut Random::new(73), 2000) {
        let hit = scene.intersect(&ray);
        assert_eq!(bits(hit.map(|h| h.hit)), bits(object.intersect(&ray)), "{ray:?}");
    }
}

#[test]
fn of_coincident_instances_the_first_is_hit() {
    let object = object(&ball(2));
    let at = |x: f64| {
        let to_world = DAffine3::from_translation(DVec3::X * x);
        Instance::new(Arc::clone(&object), to_world).expect("not flat")
    };
    let scene = InstanceBvh::build([9.0, 4.0, 0.0, 4.0, 0.0, 0.0].map(at).to_vec());
    let scene = scene.expect("there are few");
    let hit = |x: f32| scene.intersect(&Ray::new(Vec3::new(x, 0.1, -5.0), Vec3::Z));
    assert_eq!([0.0, 4.0, 9.0].map(|x| hit(x).map(|h| h.instance)), [Some(2), Some(1), Some(0)]);
}

#[test]
fn unusable_transforms_are_refused() {
    let object = object(&ball(2));
    let at = |to_world| Instance::new(Arc::clone(&object), to_world).map(|_| ());
    let scaled = |x, y, z| DAffine3::from_scale(DVec3::new(x, y, z));
    assert_eq!(at(scaled(1e3, -1e-3, 1.0)), Ok(()));
    assert_eq!(at(scaled(f64::NAN, 1.0, 1.0)), Err(TransformError::NotFinite));
    let endless = DAffine3::from_translation(DVec3::Y * f64::INFINITY);
    assert_eq!(at(endless), Err(TransformError::NotFinite));
    let flat = scaled(1.0, 0.0, 1.0);
    assert_eq!(at(flat), Err(TransformError::Flat { condition: f64::INFINITY }));
    assert_eq!(at(scaled(1.0, 1e9, 1.0)), Err(TransformError::Flat { condition: 1e9 }));
    assert_eq!(at(scaled(1e30, 1e30, 1e30)), Err(TransformError::TooFar));
    assert_eq!(at(DAffine3::from_translation(DVec3::Z * 1e19)), Err(TransformError::TooFar));

    let mut instance = Instance::new(Arc::clone(&object), scaled(2.0, 2.0, 2.0)).expect("good");
    assert!(instance.set_transform(flat).is_err());
    assert_eq!(instance.to_world(), scaled(2.0, 2.0, 2.0));
}

#[test]
fn instances_without_anything_are_skipped_and_counted() {
    let empty = Instance::new(object(&Soup::default()), DAffine3::IDENTITY).expect("not flat");
    assert!(empty.bounds().is_empty());
    let full = Instance::new(object(&ball(1)), DAffine3::IDENTITY).expect("not flat");
    let scene = InstanceBvh::build(vec![empty.clone(), full, empty]).expect("there are few");
    assert_eq!(scene.skipped(), 2);
    let ray = Ray::new(Vec3::Z * 5.0, Vec3::NEG_Z);
    assert_eq!(scene.intersect(&ray).map(|hit| hit.instance), Some(1));
}

#[test]
fn rays_without_direction_or_place_hit_nothing() {
    let object = object(&ball(1));
    let small = DAffine3::from_scale(DVec3::splat(1e10));
    let instance = Instance::new(object, small).expect("not flat");
    let scene = InstanceBvh::build(vec![instance]).expect("there is one");
    let wrong = [f32::NAN, f32::INFINITY, 1e19];
    let origins = wrong.map(|x| Ray::new(Vec3::X * x, Vec3::NEG_X));
    let directions = [f32::NAN, f32::INFINITY, 0.0].map(|x| Ray::new(Vec3::ZERO, Vec3::X * x));
    // In the object, the digits of the second direction are lost.
    let hit = |length: f32| scene.intersect(&Ray::new(Vec3::ZERO, Vec3::X * length));
    assert!(hit(1e-10).is_some() && hit(1e-22).is_none());
    for ray in origins.into_iter().chain(directions) {
        assert_eq!(scene.intersect(&ray), None, "{ray:?}");
        assert!(!scene.occluded(&ray));
    }
}
