//! Directions that were drawn for one viewer serve another who stands where [`Lobe::lobe_width`]
//! says.

use pt_math::Vec3;

use super::{AnyLobe, for_all_smooth, has_mirror, unit_3d};
use crate::bsdf::serves;

/// The most that the mean square of weights may grow for the other viewer; of ideal ones it is 1 at
/// most.
const MAX: f32 = 2.0;

/// Another direction, as far away as light is still given.
fn turned(wo: Vec3, spread: f32, towards: Vec3) -> Option<Vec3> {
    let across = (towards - wo * towards.dot(wo)).try_normalize()?;
    let w = (wo + across * (spread * 0.9 * wo.z)).normalize();
    serves(spread, wo, w).then_some(w)
}

/// What has a spread only reflects, and into more than one direction; what is matte looks the same
/// to all; and directions make little more noise for a viewer at the edge of the spread than they
/// might for the first.
#[test]
fn directions_drawn_for_one_viewer_serve_others_within_the_spread() {
    const SAMPLES: u16 = 4000;
    for_all_smooth(|lobe: &AnyLobe, wo, random| {
        let spread = lobe.lobe_width();
        if spread == 0.0 || wo.z <= 1e-3 {
            return;
        }
        assert!(!lobe.is_delta() && !has_mirror(lobe), "{lobe:?}");
        for _ in 0..4 {
            let other = turned(wo, spread.min(1.0), random.direction());
            let Some(other) = other else { continue };
            // Who sees the surface at a smaller angle is given less.
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
