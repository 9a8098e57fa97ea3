//! Environments with a portal.

use std::sync::Arc;

use pathtracer::{Film, Image, LightKind, Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::{Camera, Portal, Rows};

use crate::furnace::ESTIMATORS;
use crate::measure::{assert_all_agree, render, settings};
use crate::scenes::{Builder, camera, facing, matte, metal, size};

/// The window in the wall z = −1, from −x and −y to +x and +y.
const WINDOW: [[f64; 2]; 2] = [[-0.4, -0.2], [0.4, 0.6]];

/// Its corners, seen from inside.
fn portal() -> Portal {
    let [[left, low], [right, high]] = WINDOW;
    let corners = [[left, low], [right, low], [right, high], [left, high]];
    Portal { corners: corners.map(|[x, y]| [x, y, -1.0]) }
}

/// An environment with a bright part in the direction of the window, a constant one, or both.
fn infinite_lights(builder: Builder, portal: Option<Portal>, which: &[bool]) -> Builder {
    let pixels = (0..128u16).map(|i| match (i % 16, i / 16) {
        (10..13, 1..4) => [6.0, 5.0, 4.0],
        (x, y) => [0.05 * f32::from(x), 0.1 * f32::from(y), 0.4],
    });
    let image = Arc::new(Image { width: 16, height: 8, pixels: pixels.collect() });
    which.iter().fold(builder, |builder, is_map| {
        let kind = if *is_map {
            let image = Arc::clone(&image);
            LightKind::Environment { image, scale: 0.7, rows: Rows::default(), portal }
        } else {
            LightKind::Constant { radiance: [1.0, 0.5, 0.25], portal }
        };
        builder.light(kind, DAffine3::from_rotation_y(0.3))
    })
}

/// A room of side 2 with a block of metal and the window.
fn room(portal: Option<Portal>, which: &[bool]) -> Scene {
    let [[left, low], [right, high]] = WINDOW;
    let wall = |b: Builder, normal: DVec3| b.quad(facing(-normal, normal, 1.0), matte([0.6; 3]));
    let walls = [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::NEG_X, DVec3::NEG_Z];
    let around = [
        [[-1.0, -1.0], [1.0, low]],
        [[-1.0, high], [1.0, 1.0]],
        [[-1.0, low], [left, high]],
        [[right, low], [1.0, high]],
    ];
    let part = |b: Builder, [[x0, y0], [x1, y1]]: [[f64; 2]; 2]| {
        let size = DVec3::new(0.5 * (x1 - x0), 0.5 * (y1 - y0), 1.0);
        let center = DVec3::new(0.5 * (x0 + x1), 0.5 * (y0 + y1), -1.0);
        let place = DAffine3::from_translation(center) * DAffine3::from_scale(size);
        b.quad(place, matte([0.6; 3]))
    };
    let built = around.into_iter().fold(walls.into_iter().fold(Builder::default(), wall), part);
    let block = DAffine3::from_translation(DVec3::new(0.4, -0.7, 0.0))
        * DAffine3::from_rotation_y(0.5)
        * DAffine3::from_scale(DVec3::splat(0.3));
    let built = built.mesh(pt_scene::shapes::cube(), block, metal());
    infinite_lights(built, portal, which).seen_by(inside())
}

/// Two environments with a portal in the window of a room.
pub(crate) fn behind_a_window() -> Scene {
    room(Some(portal()), &[false, true])
}

fn inside() -> Camera {
    camera(DVec3::new(0.1, 0.3, 0.95), DVec3::new(0.0, -0.2, -1.0), [80.0, 66.0])
}

fn film(scene: &Scene, settings: Settings) -> Film {
    render(scene, size([12, 10]), settings).film().clone()
}

/// Asserts that a portal in the window of a room does not change the image, with every estimator.
fn assert_nobody_can_tell(which: &[bool]) {
    let base = Settings { max_depth: 3, ..settings(2048) };
    let mut films = vec![("without".to_owned(), film(&room(None, which), base.clone()))];
    let scene = room(Some(portal()), which);
    for (&direct, seed) in ESTIMATORS.iter().zip(1..) {
        let settings = Settings { direct, seed, ..base.clone() };
        films.push((format!("path {direct:?}"), film(&scene, settings)));
    }
    let volumetric = Settings { integrator: "volpath".into(), light_samples: 2, ..base.clone() };
    films.push(("volpath".to_owned(), film(&scene, Settings { seed: 5, ..volumetric })));
    let shared = Settings { reuse: 2, seed: 6, ..base };
    films.push(("shared".to_owned(), film(&scene, shared)));
    assert_all_agree(&films);
}

#[test]
fn a_portal_in_a_window_changes_nothing_under_an_image_of_the_sky() {
    assert_nobody_can_tell(&[true]);
}

#[test]
fn portals_in_a_window_change_nothing_under_two_skies() {
    assert_nobody_can_tell(&[false, true]);
}

/// Without walls, the environment is visible only through the portal, and not at all from its back.
#[test]
fn the_sky_is_seen_through_the_front_of_the_portal() {
    let seen = |from: DVec3, to: DVec3| {
        let eye = camera(from, to, [8.0, 6.0]);
        let scene = infinite_lights(Builder::default(), Some(portal()), &[false]).seen_by(eye);
        let film = film(&scene, settings(4));
        let colors: Vec<_> = film.pixels().map(|pixel| pixel.luminance().0).collect();
        let sky = 0.2126 + 0.7152 * 0.5 + 0.0722 * 0.25;
        let is = |value: f64| colors.iter().all(|seen| (seen - value).abs() < 1e-6);
        [is(sky), is(0.0)]
    };
    let middle = DVec3::new(0.0, 0.2, -1.0);
    assert_eq!(seen(DVec3::ZERO, middle), [true, false]);
    assert_eq!(seen(DVec3::ZERO, DVec3::new(0.8, 0.2, -1.0)), [false, true]);
    assert_eq!(seen(DVec3::ZERO, DVec3::Z), [false, true]);
    assert_eq!(seen(DVec3::NEG_Z * 2.0, middle), [false, true]);
    assert_eq!(seen(DVec3::NEG_Z * 2.0, DVec3::NEG_Z * 3.0), [false, true]);
}
