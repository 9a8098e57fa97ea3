//! Lights of the reference tracer.

use std::f64::consts::PI;

use pt_math::DVec3;

use super::unit;
use crate::Random;

/// Light that is sampled at surfaces.
#[derive(Clone, Debug)]
pub enum CourseLight {
    /// Parallelogram that emits towards −`along`.
    Area {
        /// Center.
        middle: DVec3,
        /// Edge vectors.
        edges: [DVec3; 2],
        /// Direction opposite to that of emission.
        along: DVec3,
        /// Emitted radiance.
        radiance: DVec3,
    },
    /// Point light without distance attenuation: position and irradiance.
    Point(DVec3, DVec3),
    /// Directional light: direction towards it, and irradiance.
    Directional(DVec3, DVec3),
    /// Constant radiance from the hemisphere above +y, invisible to rays.
    Ambient(DVec3),
    /// Environment light, visible to the camera.
    Environment(Map),
}

/// Radiance by direction in latitude and longitude: width, height, and texels from the top row on.
#[derive(Clone, Debug)]
pub struct Map(pub usize, pub usize, pub Vec<[f32; 3]>);

impl Map {
    /// Interpolates between the centres of texels; wraps around in x, and clamps in y.
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

/// Returns a uniform direction with y ≥ `least`, and the solid angle of all such directions.
fn above(least: f64, random: &mut Random) -> (DVec3, f64) {
    let (y, phi) = (least + (1.0 - least) * unit(random), 2.0 * PI * unit(random));
    let r = (1.0 - y * y).sqrt();
    (DVec3::new(r * libm::cos(phi), y, r * libm::sin(phi)), 2.0 * PI * (1.0 - least))
}

impl CourseLight {
    /// Returns true if one sample suffices.
    pub(super) fn is_delta(&self) -> bool {
        matches!(self, Self::Point(..) | Self::Directional(..))
    }

    /// Radiance seen by the camera in a direction without surfaces.
    pub(super) fn seen(&self, d: DVec3) -> DVec3 {
        if let Self::Environment(map) = self { map.at(d) } else { DVec3::ZERO }
    }

    /// Samples the light from a point: the direction towards the light, its distance, and radiance
    /// over density.
    pub(super) fn sample(&self, p: DVec3, random: &mut Random) -> Option<(DVec3, f64, DVec3)> {
        match self {
            Self::Area { middle, edges: [a, b], along, radiance } => {
                let to = middle + (unit(random) - 0.5) * a + (unit(random) - 0.5) * b - p;
                let distance = to.length();
                let (d, area) = (to / distance, a.cross(*b).length());
                let cos = d.dot(*along);
                // As in the course, the division by the squared distance lacks one factor.
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
