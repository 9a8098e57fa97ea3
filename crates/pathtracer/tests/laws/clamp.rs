//! Clamping: kept and removed light add up to all of the light.

use pathtracer::{Clamp, DirectLight, Film, Settings};
use pt_math::DVec3;

use crate::furnace::ESTIMATORS;
use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, cornell, facing, size};

const INFINITY: f32 = f32::INFINITY;

fn film(clamp: Clamp, direct: DirectLight, integrator: &str) -> Film {
    let integrator = integrator.into();
    let settings = Settings { clamp, direct, integrator, max_depth: 6, ..settings(64) };
    render(&cornell(), size([24, 20]), settings).film().clone()
}

/// Paths do not depend on the limit, so the sums differ by nothing but rounding.
#[test]
fn kept_and_removed_light_add_up_to_all() {
    for direct in ESTIMATORS {
        for integrator in ["path", "direct"] {
            let (all, nothing) = film(Clamp::NONE, direct, integrator).luminance();
            assert_eq!(nothing, 0.0);
            for (limit, both) in [(0.1, true), (1.0, true), (0.05, false), (0.2, false)] {
                let clamp = Clamp { direct: if both { limit } else { INFINITY }, indirect: limit };
                let (kept, removed) = film(clamp, direct, integrator).luminance();
                let what = format!("{direct:?} {integrator} {clamp:?}: {kept} + {removed}, {all}");
                assert!((kept + removed - all).abs() < 1e-6 * all, "{what}");
                let has_bright = both || integrator == "path";
                assert!(if has_bright { removed > 1e-4 * all } else { removed == 0.0 }, "{what}");
            }
        }
    }
}

/// A lamp of radiance 5, clamped to 2.
#[test]
fn what_is_left_has_the_limit() {
    let lamp = Builder::default()
        .emissive_quad(facing(DVec3::new(0.0, 0.0, -1.0), DVec3::Z, 50.0), 5.0)
        .seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [40.0, 40.0]));
    let clamp = Clamp { direct: 2.0, indirect: INFINITY };
    let session = render(&lamp, size([4, 4]), Settings { clamp, max_depth: 0, ..settings(8) });
    assert!(session.film().pixels().all(|p| p.mean().iter().all(|v| (v - 2.0).abs() < 1e-6)));
    let (kept, removed) = session.film().luminance();
    assert!((kept - 2.0 * 128.0).abs() < 1e-4, "{kept}");
    assert!((removed - 3.0 * 128.0).abs() < 1e-4, "{removed}");
}

/// A limit above all contributions changes no bit.
#[test]
fn a_high_limit_is_none() {
    let high = Clamp { direct: 1e30, indirect: 1e30 };
    let [with, without] = [high, Clamp::NONE].map(|c| film(c, DirectLight::Mis, "path"));
    assert!(with == without);
}
