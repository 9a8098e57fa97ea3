//! Motion in the image, by differences of positions that are computed from the scene.

use std::sync::Arc;

use pathtracer::image::Samples;
use pathtracer::{Aov, Camera, Projection, Scene, Session, Settings};
use pt_math::{DAffine3, DVec2, DVec3};
use pt_scene::{Key, Motion};

use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

const SIZE: [u32; 2] = [48, 36];
/// Horizontal and vertical field of view in degrees.
const FOV: [f64; 2] = [40.0, 30.0];

/// From the first to the second transform in one second.
fn motion(first: DAffine3, second: DAffine3) -> Motion {
    let key = |time, to_world| Key { time, to_world };
    Motion::new(vec![key(0.0, first), key(1.0, second)]).expect("the keys are valid")
}

/// A static wall, and a ball that moves, turns and grows.
fn scene(view: Camera) -> (Scene, Motion) {
    let turned = DAffine3::from_rotation_y(0.7) * DAffine3::from_scale(DVec3::new(1.2, 0.9, 1.0));
    let last = DAffine3::from_translation(DVec3::new(0.8, -0.3, 0.5)) * turned;
    let moves = motion(DAffine3::from_translation(DVec3::X * -0.4), last);
    let mut scene = Builder::default()
        .quad(facing(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 4.0), matte([0.5; 3]))
        .sphere(DVec3::ZERO, 0.8, matte([0.5; 3]))
        .sky(1.0)
        .seen_by(view);
    scene.objects[1].motion = Some(Arc::new(moves.clone()));
    (scene, moves)
}

fn view() -> Camera {
    camera(DVec3::new(0.3, 0.4, 5.0), DVec3::ZERO, FOV)
}

fn rendered(scene: &Scene, spp: u32) -> Session {
    let aovs = vec![Aov::Motion, Aov::Position, Aov::Object, Aov::Depth];
    render(scene, size(SIZE), Settings { aovs, max_depth: 0, ..settings(spp) })
}

fn channel(session: &Session, name: &str) -> Vec<f64> {
    let channels = session.channels();
    let channel = channels.into_iter().find(|c| c.name == name).expect("a channel of this name");
    match channel.samples {
        Samples::Real(values) => values.into_iter().map(f64::from).collect(),
        Samples::Whole(values) => values.into_iter().map(f64::from).collect(),
    }
}

/// Motion in pixels and positions of all pixels.
fn motions(session: &Session) -> Vec<DVec2> {
    let [x, y] = ["motion.X", "motion.Y"].map(|name| channel(session, name));
    x.into_iter().zip(y).map(|(x, y)| DVec2::new(x, y)).collect()
}

/// Image point of a position in the coordinates of a perspective camera.
fn image_point(p: DVec3) -> DVec2 {
    let scale = [0, 1].map(|i| 0.5 * f64::from(SIZE[i]) / (0.5 * FOV[i]).to_radians().tan());
    DVec2::new(p.x / -p.z * scale[0], p.y / p.z * scale[1])
}

/// While the shutter is open for a short time, the motion is the derivative of the image point.
#[test]
fn motion_is_the_derivative_of_the_image_point() {
    const STEP: f64 = 1e-3;
    for is_camera_moving in [false, true] {
        let (mut scene, moves) = scene(view());
        let turn = DAffine3::from_rotation_z(0.4) * DAffine3::from_rotation_y(-0.2);
        let turn = DAffine3::from_translation(DVec3::new(0.5, 0.0, -0.6)) * turn;
        let of_camera = motion(DAffine3::IDENTITY, turn);
        if is_camera_moving {
            scene.cameras[0].motion = Some(of_camera.clone());
        }
        let mut compared = [0; 2];
        for start in [0.2, 0.7] {
            scene.cameras[0].shutter = [start, start + STEP];
            let session = rendered(&scene, 1);
            let [px, py, pz] = ["X", "Y", "Z"].map(|c| channel(&session, &format!("position.{c}")));
            let objects = channel(&session, "object.id");
            let to_camera = |time| {
                let motion = if is_camera_moving { of_camera.at(time) } else { DAffine3::IDENTITY };
                (motion * scene.cameras[0].to_world).inverse()
            };
            for (i, found) in motions(&session).into_iter().enumerate() {
                let p = DVec3::new(px[i], py[i], pz[i]);
                let is_ball = objects[i] == 2.0;
                let moved = moves.at(start + STEP) * moves.at(start).inverse();
                let later = if is_ball { moved.transform_point3(p) } else { p };
                let point = |time, p| image_point(to_camera(time).transform_point3(p));
                let wanted = point(start + STEP, later) - point(start, p);
                let off = (found - wanted).length() / STEP;
                assert!(off < 0.02 * wanted.length() / STEP + 0.1, "{found} {wanted} {is_ball}");
                compared[usize::from(is_ball)] += 1;
                assert!(is_camera_moving || is_ball || found == DVec2::ZERO, "a static wall");
            }
        }
        assert!(compared.iter().all(|count| *count > 300), "{compared:?}");
    }
}

/// A translation by 1 in one second, seen by parallel rays, is the same in all pixels at all times.
#[test]
fn translations_are_constant_in_parallel_projection() {
    let projection = Projection::Orthographic { half_width: 2.0, half_height: 1.5 };
    let (mut scene, _) = scene(Camera { projection, shutter: [0.0, 1.0], ..view() });
    let right = DAffine3::from_translation(DVec3::new(1.0, 0.5, 0.0));
    scene.objects[1].motion = Some(Arc::new(motion(DAffine3::IDENTITY, right)));
    scene.cameras[0].to_world = DAffine3::from_translation(DVec3::Z * 5.0);
    let session = rendered(&scene, 1);
    let objects = channel(&session, "object.id");
    let pixel = f64::from(SIZE[0]) / 4.0;
    let balls = motions(&session).into_iter().zip(objects).filter(|(_, object)| *object == 2.0);
    let motions: Vec<_> = balls.map(|(motion, _)| motion).collect();
    assert!(motions.len() > 200);
    for found in motions {
        assert!((found - DVec2::new(pixel, -0.5 * pixel)).length() < 1e-3, "{found}");
    }
}

/// A panorama that turns around its axis moves all points by the same angle, also across its edge.
#[test]
fn a_panorama_takes_the_shorter_way_around() {
    let view = Camera { projection: Projection::Panorama, shutter: [0.0, 1.0], ..view() };
    let mut scene = Builder::default()
        .sphere(DVec3::ZERO, 3.0, matte([0.5; 3]))
        .seen_by(Camera { to_world: DAffine3::IDENTITY, ..view });
    let turned = DAffine3::from_rotation_y(0.5);
    scene.cameras[0].motion = Some(motion(DAffine3::IDENTITY, turned));
    let wanted = 0.5 / std::f64::consts::TAU * f64::from(SIZE[0]);
    let session = rendered(&scene, 2);
    for found in motions(&session) {
        // Between the keys the axes are interpolated, but both ends are exact.
        assert!((found - DVec2::new(wanted, 0.0)).length() < 1e-3, "{found} {wanted}");
    }
}

#[test]
fn static_scenes_have_no_motion() {
    let (mut scene, _) = scene(view());
    scene.cameras[0].shutter = [0.5; 2];
    assert!(motions(&rendered(&scene, 2)).iter().all(|motion| *motion == DVec2::ZERO));
}
