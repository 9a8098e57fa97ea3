//! Lights.

use std::f64::consts::PI;

use pt_math::DVec3;

use super::unit;
use crate::Random;

/// A light that surfaces sample.
#[derive(Clone, Debug)]
pub enum Light {
    /// A square which emits towards −`along`.
    Area {
        /// Its middle.
        middle: DVec3,
        /// Its two edges.
        edges: [DVec3; 2],
        /// The direction away from which it emits.
        along: DVec3,
        /// Its radiance.
        radiance: DVec3,
    },
    /// A point whose light does not fall off: where it is, and its irradiance.
    Point(DVec3, DVec3),
    /// Light from one direction: that towards it, and its irradiance.
    Directional(DVec3, DVec3),
    /// The half of the sky above +y, which no ray sees, and its radiance.
    Ambient(DVec3),
    /// All of the sky, which the camera sees.
    Environment(Map),
}

/// Radiance by direction in latitude and longitude: width, height, and texels from the upper row
/// on.
#[derive(Clone, Debug)]
pub struct Map(pub usize, pub usize, pub Vec<[f32; 3]>);

impl Map {
    /// Interpolated between the centres of texels; it wraps around in x, and ends in y.
    fn at(&self, d: DVec3) -> DVec3 {
        let Self(width, height, texels) = self;
        let (theta, phi) = (libm::acos(d.y), libm::atan2(-d.z, d.x) + PI);
        let x = phi / (2.0 * PI) * *width as f64 - 0.5;
        let y = theta / PI * *height as f64 - 0.5;
        let texel = |x: f64, y: f64| {
            let column = (x as i64).rem_euclid(*width as i64) as usize;
            let row = y.clamp(0.0, (height - 1) as f64) as usize;
            DVec3::from(texels[row * width + column].map(f64::from))
        };
        let row = |y: f64| texel(x.floor(), y).lerp(texel(x.floor() + 1.0, y), x - x.floor());
        row(y.floor()).lerp(row(y.floor() + 1.0), y - y.floor())
    }
}

/// A uniform direction whose y is in this range, and the solid angle of all of these.
fn above(least: f64, random: &mut Random) -> (DVec3, f64) {
    let (y, phi) = (least + (1.0 - least) * unit(random), 2.0 * PI * unit(random));
    let r = (1.0 - y * y).sqrt();
    (DVec3::new(r * libm::cos(phi), y, r * libm::sin(phi)), 2.0 * PI * (1.0 - least))
}

impl Light {
    /// Returns true if one sample is as good as many.
    pub(super) fn is_delta(&self) -> bool {
        matches!(self, Self::Point(..) | Self::Directional(..))
    }

    /// What the camera sees of it in a direction without surfaces.
    pub(super) fn seen(&self, d: DVec3) -> DVec3 {
        if let Self::Environment(map) = self { map.at(d) } else { DVec3::ZERO }
    }

    /// A sample for a point: the direction towards the light, its distance, and radiance over
    /// density.
    pub(super) fn sample(&self, p: DVec3, random: &mut Random) -> Option<(DVec3, f64, DVec3)> {
        match self {
            Self::Area { middle, edges: [a, b], along, radiance } => {
                let to = middle + (unit(random) - 0.5) * a + (unit(random) - 0.5) * b - p;
                let distance = to.length();
                let (d, area) = (to / distance, a.cross(*b).length());
                let cos = d.dot(*along);
                // The density lacks one division by the distance.
                (cos > 0.0).then_some((d, distance, radiance * (cos * area / distance)))
            }
            Self::Point(at, irradiance) => {
                let to = at - p;
                Some((to.normalize(), to.length(), *irradiance))
            }
            Self::Directional(towards, irradiance) => {
                Some((towards.normalize(), f64::INFINITY, *irradiance))
            }
            Self::Ambient(radiance) => {
                let (d, solid_angle) = above(0.0, random);
                Some((d, f64::INFINITY, radiance * solid_angle))
            }
            Self::Environment(map) => {
                let (d, solid_angle) = above(-1.0, random);
                Some((d, f64::INFINITY, map.at(d) * solid_angle))
            }
        }
    }
}
