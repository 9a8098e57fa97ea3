//! Ambient occlusion against closed forms.

use std::f64::consts::PI;

use pathtracer::{CompileOptions, Region, Session, Settings};
use pt_math::{DAffine3, DVec3};
use pt_testing::{irradiance, sidak};

use crate::measure::{assert_uniform, finish, settings};
use crate::scenes::{Builder, camera, facing, inward_cube, matte, size};

/// The size of the image of which a few pixels are rendered: they are so small that the occlusion
/// does not vary within.
const RESOLUTION: [u32; 2] = [2001, 2001];
const PIXELS: [[u32; 2]; 3] = [[1000, 1000], [400, 800], [1500, 1250]];

fn ao(spp: u32, ao_distance: f32) -> Settings {
    Settings { integrator: "ao".into(), ao_distance, ..settings(spp) }
}

fn floor() -> Builder {
    Builder::default().quad(facing(DVec3::ZERO, DVec3::Y, 50.0), matte([0.5; 3]))
}

/// Renders a few pixels of a floor, and compares them with the expected values of its points.
fn check(scene: Builder, settings: &Settings, tests: usize, want: impl Fn(DVec3) -> f64) {
    let view = camera(DVec3::new(7.0, 6.0, 5.0), DVec3::new(2.0, 0.0, 0.0), [20.0, 20.0]);
    let options = CompileOptions { resolution: Some(RESOLUTION), ..CompileOptions::default() };
    let scene = scene.seen_by(view);
    let mut session = Session::new(&scene, options, settings.clone()).expect("it makes sense");
    for [x, y] in PIXELS {
        session.restrict(Region { x, y, width: 1, height: 1 }).expect("inside");
        finish(&mut session);
        let ray = session.scene().camera.ray([x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let p = o - d * (o.y / d.y);
        let what = format!("at {p} up to {}", settings.ao_distance);
        assert_uniform(session.film(), want(p), sidak(1e-4, tests * PIXELS.len()), &what);
    }
}

#[test]
fn an_open_plane_sees_all_of_the_sky_from_both_sides() {
    for height in [3.0, -3.0] {
        let view = camera(DVec3::new(0.0, height, 4.0), DVec3::ZERO, [30.0, 30.0]);
        let scene = floor().seen_by(view);
        let mut session = Session::new(&scene, size([8, 8]), ao(64, f32::INFINITY)).expect("valid");
        finish(&mut session);
        assert!(session.film().pixels().all(|p| p.mean() == [1.0; 3]), "from {height}");
    }
}

#[test]
fn a_closed_room_sees_nothing_of_it() {
    let view = camera(DVec3::new(0.3, -0.2, 0.4), DVec3::NEG_Z, [80.0, 80.0]);
    let room = Builder::default().mesh(inward_cube(), DAffine3::IDENTITY, matte([0.5; 3]));
    let scene = room.seen_by(view);
    for (distance, want) in [(f32::INFINITY, 0.0), (1e-3, 1.0)] {
        let mut session = Session::new(&scene, size([8, 8]), ao(64, distance)).expect("valid");
        finish(&mut session);
        let mean = session.film().pixels().map(|p| p.mean()[0]).sum::<f64>() / 64.0;
        // Within a thousandth of the edges, walls are that near.
        assert!((mean - want).abs() <= 0.01 * want, "{mean} up to {distance}");
    }
}

/// Projected on to the floor, the directions ω of the hemisphere are a unit disk in which the
/// density of the cosine is uniform. [Nusselt 1928] An infinite wall at distance h is nearer than R
/// for ω·n > h/R, with n towards it: a segment of the disk, of area acos c − c √(1 − c²) with c =
/// h/R.
#[test]
fn beside_an_infinite_wall_the_occluded_part_is_a_segment_of_a_disk() {
    const DISTANCES: [f32; 4] = [f32::INFINITY, 20.0, 4.0, 2.0];
    for distance in DISTANCES {
        for light_samples in [1, 5] {
            let wall = facing(DVec3::ZERO, DVec3::X, 1e4);
            let settings = Settings { light_samples, ..ao(32_768 / light_samples, distance) };
            check(floor().quad(wall, matte([0.5; 3])), &settings, 2 * DISTANCES.len(), |p| {
                assert!(p.x > 0.5, "{p} is beside the wall");
                let c = (p.x / f64::from(distance)).min(1.0);
                1.0 - (c.acos() - c * (1.0 - c * c).sqrt()) / PI
            });
        }
    }
}

/// The occlusion by a sphere is E/π, with the irradiance E of an emissive sphere of radiance 1.
#[test]
fn below_a_sphere_its_form_factor_is_occluded() {
    let center = DVec3::new(2.3, 1.5, -0.2);
    let scene = floor().sphere(center, 0.6, matte([0.5; 3]));
    check(scene, &ao(32_768, f32::INFINITY), 1, |p| {
        1.0 - irradiance::of_sphere(center, 0.6, p, DVec3::Y) / PI
    });
}
