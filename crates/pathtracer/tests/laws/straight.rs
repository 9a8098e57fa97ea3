//! Straight transmission through thin glass, which is not counted as an interaction.

use std::f64::consts::PI;

use pathtracer::{DirectLight, Film, Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::ThinGlass;
use pt_scene::{LightKind, Surface};

use crate::measure::{assert_all_agree, assert_uniform, render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

fn pane() -> Surface {
    ThinGlass { reflectance: [1.0; 3].into(), transmittance: [1.0; 3].into(), ior: 1.5 }.into()
}

/// Transmittance of a pane along its normal: each face reflects F = (0.5 / 2.5)² = 0.04, and with
/// all reflections between them the pane reflects 2F / (1 + F).
const TRANSMITTANCE: f64 = 1.0 - 2.0 * 0.04 / 1.04;

fn film(scene: &Scene, settings: Settings) -> Film {
    render(scene, size([10, 8]), settings).film().clone()
}

fn with_depth(spp: u32, max_depth: u32, straight_is_free: bool) -> Settings {
    let integrator = "volpath".into();
    Settings { integrator, max_depth, straight_is_free, ..settings(spp) }
}

/// Two panes under an environment of radiance 1, seen along their normal: without counted
/// interactions the radiance is T², and 0 if all are counted; with one, it also has R from the
/// first pane, and T R T from the second.
#[test]
fn panes_are_free_and_reflections_are_not() {
    let scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), pane())
        .quad(facing(DVec3::Z, DVec3::Z, 1.0), pane())
        .sky(1.0)
        .seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [2.0, 1.6]));
    let (t, r) = (TRANSMITTANCE, 1.0 - TRANSMITTANCE);
    assert_uniform(&film(&scene, with_depth(4096, 0, true)), t * t, 1e-4, "none");
    assert_uniform(&film(&scene, with_depth(64, 0, false)), 0.0, 1e-4, "all count");
    let one = t * t + r + t * t * r;
    assert_uniform(&film(&scene, with_depth(4096, 1, true)), one, 1e-4, "one");
    assert_uniform(&film(&scene, with_depth(64, u32::MAX, true)), 1.0, 1e-4, "a furnace");
}

/// A point light behind a pane lights a surface with the fraction that the pane transmits.
#[test]
fn points_shine_through_panes() {
    let scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), matte([1.0; 3]))
        .quad(facing(DVec3::Z, DVec3::Z, 1.0), pane())
        .light(
            LightKind::Point { intensity: [4.0 * PI as f32; 3] },
            DAffine3::from_translation(DVec3::Z * 2.0),
        )
        .seen_by(camera(DVec3::Z * 0.5, DVec3::ZERO, [2.0, 1.6]));
    for pixel in film(&scene, with_depth(4, 1, true)).pixels() {
        let got = pixel.luminance().0;
        assert!((got - TRANSMITTANCE).abs() < 1e-3, "{got}");
    }
}

/// Light from a panel behind a pane is found by light samples and by hits, and counted once: the
/// result equals that with counted interactions, where light samples do not pass the pane.
#[test]
fn panels_behind_panes_count_once() {
    let scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), matte([0.6; 3]))
        .quad(facing(DVec3::Z * 0.5, DVec3::new(0.2, 0.0, 1.0), 1.5), pane())
        .emissive_quad(facing(DVec3::Z * 1.2, DVec3::NEG_Z, 0.6), 2.0)
        .seen_by(camera(DVec3::new(0.0, -1.5, 0.4), DVec3::ZERO, [40.0, 32.0]));
    let films: Vec<_> =
        [(DirectLight::Mis, true), (DirectLight::Light, true), (DirectLight::Mis, false)]
            .into_iter()
            .zip(0..)
            .map(|((direct, free), seed)| {
                let settings = Settings { direct, seed, ..with_depth(4096, 64, free) };
                (format!("{direct:?} {free}"), film(&scene, settings))
            })
            .collect();
    assert_all_agree(&films);
}
