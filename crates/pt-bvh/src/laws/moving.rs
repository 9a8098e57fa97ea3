//! Hits on moving objects are those of a loop that intersects each at the time of the ray, and the
//! objects are always inside of their boxes.

use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DQuat, DVec3, Ray, Vec3};
use pt_testing::Random;

use super::agreement::bits;
use super::{Soup, ball, bumpy_ball};
use crate::{
    AnimatedBvh, AnimatedInstance, BuildOptions, Bvh, Instance, InstanceHit, MotionKey,
    TransformError,
};

fn object(soup: &Soup) -> Arc<Bvh> {
    Arc::new(Bvh::build(soup.geometry(), &BuildOptions::default()).expect("indices are in range"))
}

fn random_turn(r: &mut Random) -> DQuat {
    let [from, to] = [0; 2].map(|_| r.direction().as_dvec3());
    DQuat::from_rotation_arc(from, to)
}

/// Random position, rotation, scale and shear.
fn random_place(r: &mut Random) -> DAffine3 {
    let size = DVec3::splat(1.5) + r.in_cube().as_dvec3();
    let shear = DMat3::from_cols(
        DVec3::X,
        DVec3::new(f64::from(r.unit()), 1.0, 0.0),
        DVec3::new(0.0, f64::from(r.unit()), 1.0),
    );
    let m = DMat3::from_quat(random_turn(r)) * shear * DMat3::from_diagonal(size);
    DAffine3::from_mat3_translation(m, r.in_cube().as_dvec3() * 8.0)
}

/// Keys between which an object rotates by about a radian, changes its size and moves by about its
/// diameter.
fn random_knots(r: &mut Random, count: u32) -> Vec<MotionKey> {
    let mut to_world = random_place(r);
    let mut keys = Vec::new();
    for i in 0..count {
        keys.push(MotionKey { time: i as f32 / count as f32, to_world });
        let turn = DQuat::from_scaled_axis(r.direction().as_dvec3());
        let size = DVec3::ONE + r.in_cube().as_dvec3() * 0.3;
        let step = DAffine3::from_scale_rotation_translation(size, turn, r.in_cube().as_dvec3());
        to_world = step * to_world;
    }
    keys
}

fn scene(soups: &[Soup], r: &mut Random) -> AnimatedBvh {
    let objects: Vec<_> = soups.iter().map(object).collect();
    let instance = |i: usize| {
        let keys = random_knots(r, 1 + i as u32 % 5);
        AnimatedInstance::new(Arc::clone(&objects[i % objects.len()]), keys)
    };
    let instances: Vec<_> = (0..30).map(instance).filter_map(Result::ok).collect();
    assert!(instances.len() > 20, "{} of 30 make sense", instances.len());
    AnimatedBvh::build(instances).expect("there are few")
}

#[test]
fn moving_objects_are_hit_as_in_a_loop() {
    let r = &mut Random::new(41);
    let soups = [ball(0), bumpy_ball(2)];
    for _ in 0..6 {
        let scene = scene(&soups, r);
        let all_bits = |hit: Option<InstanceHit>| hit.map(|h| (h.instance, bits(Some(h.hit))));
        let mut hits = 0;
        for _ in 0..4000 {
            let time = r.between(-0.1, 1.1);
            // From a random point to a vertex, which is where boxes are tight.
            let aim = r.below(scene.instances().len());
            let vertex = soups[aim % 2].positions[r.below(6)];
            let target = scene.instances()[aim].to_world(time).transform_point3(vertex.as_dvec3());
            let origin = target.as_vec3() + r.in_cube() * [0.1, 3.0, 1e3][r.below(3)];
            let ray = Ray::new(origin, target.as_vec3() - origin);
            let looped = (0..).zip(scene.instances()).filter_map(|(instance, moving)| {
                let hit = moving.object().intersect(&moving.to_object(&ray, time))?;
                Some(InstanceHit { instance, hit })
            });
            let looped = looped.min_by(|a, b| a.hit.t.total_cmp(&b.hit.t));
            assert_eq!(all_bits(scene.intersect(&ray, time)), all_bits(looped), "{time} {ray:?}");
            assert_eq!(scene.occluded(&ray, time), looped.is_some());
            hits += u32::from(looped.is_some());
        }
        assert!(hits > 2000, "{hits}");
    }
}

#[test]
fn points_are_in_the_box_at_every_time() {
    let r = &mut Random::new(43);
    let soups = [ball(1), bumpy_ball(2)];
    for _ in 0..10 {
        for moving in scene(&soups, r).instances() {
            let bounds = moving.bounds();
            for _ in 0..300 {
                let corner = moving.object().bounds();
                let part = (r.in_cube() + Vec3::ONE) * 0.5;
                let p = corner.min + (corner.max - corner.min) * part.round();
                let time = r.between(-0.5, 1.5);
                let p = moving.to_world(time).transform_point3(p.as_dvec3());
                let [min, max] = [bounds.min, bounds.max].map(Vec3::as_dvec3);
                assert!(p.cmpge(min).all() && p.cmple(max).all(), "{p} at {time} in {bounds:?}");
            }
        }
    }
}

/// Rays from inside of a closed mesh always hit it.
#[test]
fn no_ray_slips_through_a_moving_closed_mesh() {
    let r = &mut Random::new(47);
    let soup = bumpy_ball(3);
    let object = object(&soup);
    for _ in 0..20 {
        let keys = random_knots(r, 4);
        let Ok(moving) = AnimatedInstance::new(Arc::clone(&object), keys) else { continue };
        let scene = AnimatedBvh::build(vec![moving]).expect("there is one");
        for _ in 0..2000 {
            let time = r.unit();
            let to_world = scene.instances()[0].to_world(time);
            // Towards vertices and edges, where leaks are likeliest.
            let [a, b, _] = soup.corners(r.below(soup.triangles.len()));
            let aim = if r.below(2) == 0 { a } else { (a + b) * 0.5 };
            let aim = to_world.transform_point3(aim.as_dvec3()).as_vec3();
            let origin = to_world.transform_point3(r.in_cube().as_dvec3() * 0.2).as_vec3();
            let ray = Ray::new(origin, aim - origin);
            assert!(scene.intersect(&ray, time).is_some(), "{time} {ray:?}");
            assert!(scene.occluded(&ray, time));
        }
    }
}

/// With equal keys, and with one.
#[test]
fn what_does_not_move_is_hit_as_an_instance() {
    let r = &mut Random::new(53);
    let object = object(&bumpy_ball(3));
    for _ in 0..20 {
        let to_world = random_place(r);
        let still = Instance::new(Arc::clone(&object), to_world).expect("not flat");
        let at = |time| MotionKey { time, to_world };
        for keys in [vec![at(0.5)], vec![at(0.0), at(0.3), at(1.0)]] {
            let moving = AnimatedInstance::new(Arc::clone(&object), keys).expect("not flat");
            for _ in 0..100 {
                let origin = r.in_cube() * 20.0;
                let ray = Ray::new(origin, to_world.translation.as_vec3() + r.in_cube() - origin);
                let [a, b] = [still.to_object(&ray), moving.to_object(&ray, r.unit())];
                assert_eq!(bits(object.intersect(&a)), bits(object.intersect(&b)));
            }
        }
    }
}

#[test]
fn motions_that_make_no_sense_are_refused() {
    let object = object(&ball(1));
    let at =
        |time, scale: f64| MotionKey { time, to_world: DAffine3::from_scale(DVec3::splat(scale)) };
    let new =
        |keys: &[MotionKey]| AnimatedInstance::new(Arc::clone(&object), keys.to_vec()).map(|_| ());
    assert_eq!(new(&[at(0.0, 1.0), at(1.0, 2.0)]), Ok(()));
    for times in [&[][..], &[at(f32::NAN, 1.0)], &[at(0.0, 1.0); 2], &[at(1.0, 1.0), at(0.0, 1.0)]]
    {
        assert_eq!(new(times), Err(TransformError::Times), "{times:?}");
    }
    // At some time in between, the object is a point.
    let inverted = TransformError::Flat { condition: f64::INFINITY };
    assert_eq!(new(&[at(0.0, 1.0), at(1.0, -1.0)]), Err(inverted));
    assert_eq!(new(&[at(0.0, -0.1), at(1.0, 3.0)]), Err(inverted));
    assert_eq!(new(&[at(0.0, 0.0), at(1.0, 3.0)]), Err(inverted));
    assert_eq!(new(&[at(0.0, 1.0), at(1.0, f64::NAN)]), Err(TransformError::NotFinite));
    assert_eq!(new(&[at(0.0, 1.0), at(1.0, 1e30)]), Err(TransformError::TooFar));
}
