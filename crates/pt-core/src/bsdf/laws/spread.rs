//! Directions sampled for one viewer serve others within [`Lobe::lobe_width`].

use pt_math::Vec3;

use super::{AnyLobe, for_all_smooth, unit_3d};
use crate::bsdf::world::serves;

/// Maximum mean squared weight for the other viewer, relative to the greater of 1 and that for the
/// first; ideal weights have at most 1.
const MAX: f32 = 2.0;

/// Another viewing direction, close to the greatest distance at which reuse is allowed.
fn turned(wo: Vec3, spread: f32, towards: Vec3) -> Option<Vec3> {
    let across = (towards - wo * towards.dot(wo)).try_normalize()?;
    let w = (wo + across * (spread * 0.9 * wo.z)).normalize();
    serves(spread, wo, w).then_some(w)
}

/// Lobes with a positive width only reflect, and are not Dirac deltas; diffuse lobes are equal for
/// all viewers; and sampled directions have little more variance for a viewer at the edge of the
/// width than for the first.
#[test]
fn directions_drawn_for_one_viewer_serve_others_within_the_spread() {
    const SAMPLES: u16 = 4000;
    for_all_smooth(|lobe: &AnyLobe, wo, random| {
        let spread = lobe.lobe_width();
        if spread == 0.0 || wo.z <= 1e-3 {
            return;
        }
        assert!(!lobe.is_delta() && !lobe.laws().properties().has_delta_part, "{lobe:?}");
        for _ in 0..4 {
            let other = turned(wo, spread.min(1.0), random.direction());
            let Some(other) = other else { continue };
            // A viewer at a more grazing angle receives a smaller fraction.
            let share = (other.z / wo.z).min(1.0);
            let mut squares = [0.0; 2];
            for _ in 0..SAMPLES {
                let Some(s) = lobe.sample(wo, unit_3d(random)) else { continue };
                assert!(s.wi.z > 0.0, "{lobe:?} lets light through");
                let (own, f) = (lobe.eval(wo, s.wi), lobe.eval(other, s.wi));
                assert!(spread < f32::INFINITY || own == f, "{lobe:?}");
                let pdf = s.pdf.expect("it has no delta").get();
                squares[0] += (own / pdf).max_channel().powi(2);
                squares[1] += (f / pdf).max_channel().powi(2) * share * share;
            }
            let [own, others] = squares.map(|s| s / f32::from(SAMPLES));
            assert!(others < MAX * own.max(1.0), "{lobe:?} {wo} {other}: {own}, {others}");
        }
    });
}
