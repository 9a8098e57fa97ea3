//! Animations and shutters of Mitsuba scenes.

use std::sync::Arc;

use pt_math::DVec3;
use pt_scene::{Geometry, Object, Projection};

use crate::{assert_close, good, read};

/// Returns the position of a point of an object at a time.
fn place(object: &Object, time: f64, p: DVec3) -> DVec3 {
    let motion = object.motion.as_ref().expect("it moves");
    motion.at(time).transform_point3(object.to_world.transform_point3(p))
}

#[test]
fn shapes_and_instances_move_as_their_animations_say() {
    let scene = good("motion.xml");
    let [ball, cube, disk] = scene.objects.as_slice() else { panic!("{:?}", scene.objects) };
    assert_eq!(ball.geometry, Geometry::Sphere { radius: 1.0 });
    for (time, x) in [(-9.0, 2.0), (-1.0, 2.0), (0.0, 3.0), (1.0, 4.0), (7.0, 4.0)] {
        assert_close(place(ball, time, DVec3::ZERO), DVec3::new(x, 2.0, 3.0));
    }
    let shared = [cube, disk].map(|object| object.motion.clone().expect("it moves"));
    assert!(Arc::ptr_eq(&shared[0], &shared[1]), "instances move as a whole");
    for (time, scale) in [(0.0, 2.0), (0.5, 2.5), (1.0, 3.0)] {
        assert_close(place(cube, time, DVec3::ZERO), DVec3::Y * scale);
        assert_close(place(disk, time, DVec3::X), DVec3::X * scale);
    }
}

#[test]
fn sensors_have_shutters_and_move() {
    let scene = good("motion.xml");
    let camera = &scene.cameras[0];
    assert_eq!(camera.shutter, [0.5, 2.0]);
    let motion = camera.motion.as_ref().expect("it moves");
    let node = motion.at(1.0) * camera.to_world;
    assert_close(node.translation, DVec3::X * 0.5);
    assert_close(node.transform_vector3(DVec3::NEG_Z), DVec3::Z);
    assert_close(node.transform_vector3(DVec3::NEG_X), DVec3::X);
    let Projection::Orthographic { half_width, half_height } = camera.projection else {
        panic!("{:?}", camera.projection)
    };
    assert!((half_width - 2.0).abs() < 1e-12 && (half_height - 1.5).abs() < 1e-12);
}

#[test]
fn shutters_that_are_not_written_are_open_for_no_time() {
    assert_eq!(read("<sensor type=\"perspective\"/>").cameras[0].shutter, [0.0; 2]);
    let open = |close: &str| {
        read(&format!(
            "<sensor type=\"perspective\"><float name=\"shutter_open\" value=\"0.25\"/>\
             <float name=\"shutter_close\" value=\"{close}\"/></sensor>"
        ))
    };
    assert_eq!(open("0.25").cameras[0].shutter, [0.25; 2]);
    assert_eq!(open("1.5").cameras[0].shutter, [0.25, 1.5]);
}
