//! Spot light.

use std::f32::consts::{FRAC_PI_3, FRAC_PI_6, PI};

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Spectrum, Vec3, trig};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, inverse_square, level};
use super::point::sample_point;
use super::tree::LightBounds;
use super::{Light, LightSample, LightSampleContext, LightTables};

/// A point light whose intensity falls off with the angle to its axis, and is zero outside of its
/// cone.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// World-space position.
    pub position: Vec3,
    /// Unit vector of the optical axis.
    pub axis: Vec3,
    /// Radiant intensity along the axis.
    pub intensity: Spectrum,
    /// Falloff with the angle to the axis.
    pub falloff: Falloff,
}

/// Relative intensity of a spot light at an angle θ to its axis.
#[derive(Clone, Copy, Debug)]
pub enum Falloff {
    /// cosᵉ θ, cut off. [COLLADA 1.4.1 specification, `<spot>`]
    Cosine {
        /// Cosine of half the opening angle of the cone.
        cos_cutoff: f32,
        /// Exponent e.
        exponent: f32,
    },
    /// 1 up to an angle, and from there linear in θ down to 0. [Mitsuba 3.9 documentation, `spot`]
    Linear {
        /// Angle at which the falloff begins, in radians.
        beam: f32,
        /// Angle at which the intensity becomes 0, in radians.
        cutoff: f32,
    },
    /// 1/cos³ θ up to an angle, which makes the irradiance on a plane perpendicular to the axis
    /// uniform. [Mitsuba 3.9 documentation, `projector`]
    Flat {
        /// Cutoff angle in radians, less than a right angle.
        cutoff: f32,
    },
    /// 1 up to an inner angle, and from there ((cos θ − cos o) / (cos i − cos o))² down to 0 at an
    /// outer one. The specification limits the divisor to at least 0.001, which would darken narrow
    /// cones; here it is exact. [KHR_lights_punctual, "Inner and Outer Cone Angles"]
    Punctual {
        /// The inner angle i, in radians.
        inner: f32,
        /// The outer angle o, in radians.
        outer: f32,
    },
}

impl Falloff {
    /// Returns the relative intensity towards the unit vector `w`; 0 outside of the cone.
    #[inline]
    pub fn factor(self, axis: Vec3, w: Vec3) -> f32 {
        let cos = axis.dot(w);
        match self {
            Self::Cosine { cos_cutoff, .. } if cos <= cos_cutoff => 0.0,
            // A cone wider than a hemisphere has no positive cosine to fall off by.
            Self::Cosine { exponent: 0.0, .. } => 1.0,
            Self::Cosine { exponent, .. } => trig::powf(cos.max(0.0), exponent),
            Self::Linear { beam, cutoff } => {
                let angle = angle(axis, w);
                let inside = f32::from(u8::from(angle <= beam));
                if beam < cutoff {
                    ((cutoff - angle) / (cutoff - beam)).clamp(0.0, 1.0)
                } else {
                    inside
                }
            }
            Self::Flat { cutoff } if angle(axis, w) > cutoff => 0.0,
            Self::Flat { .. } => (cos * cos * cos).recip(),
            Self::Punctual { inner, outer } => {
                let angle = angle(axis, w);
                if angle <= inner {
                    return 1.0;
                }
                let share = cosines_apart(angle, outer) / cosines_apart(inner, outer);
                if angle < outer { share * share } else { 0.0 }
            }
        }
    }
}

impl Falloff {
    /// Returns the cosine of the angle beyond which no light is emitted.
    fn cos_cutoff(self) -> f32 {
        match self {
            Self::Cosine { cos_cutoff, .. } => cos_cutoff,
            Self::Linear { cutoff, .. }
            | Self::Flat { cutoff }
            | Self::Punctual { outer: cutoff, .. } => trig::sin_cos(cutoff.min(PI)).1,
        }
    }
}

impl Spot {
    /// Returns the bounds of the emission if the intensity is multiplied by `factor`.
    pub(super) fn bounds_of(&self, factor: f32) -> LightBounds {
        let cut = self.falloff.cos_cutoff();
        LightBounds::of_cone(self.position, self.intensity, self.axis, cut, factor)
    }
}

/// Returns the angle between two unit vectors; the arc cosine would cancel for small angles.
fn angle(a: Vec3, b: Vec3) -> f32 {
    trig::atan2(a.cross(b).length(), a.dot(b))
}

/// Returns cos a − cos b, without cancellation for small angles.
fn cosines_apart(a: f32, b: f32) -> f32 {
    2.0 * trig::sin_cos(0.5 * (b + a)).0 * trig::sin_cos(0.5 * (b - a)).0
}

impl Light for Spot {
    const DELTA: bool = true;

    #[inline]
    fn sample(
        &self,
        _: &LightTables,
        context: &LightSampleContext,
        _u: [f32; 2],
    ) -> Option<LightSample> {
        let on_axis = sample_point(self.position, context.p, self.intensity)?;
        let falloff = self.falloff.factor(self.axis, -on_axis.wi);
        let radiance = on_axis.radiance * falloff;
        (falloff > 0.0).then_some(LightSample { radiance, ..on_axis })
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        Some(self.bounds_of(1.0))
    }

    /// One light with each falloff, a cone with a sharp edge, and a light without a cone.
    fn examples() -> Vec<(Self, LightTables)> {
        let falloffs = [
            Falloff::Cosine { cos_cutoff: 0.5, exponent: 2.0 },
            Falloff::Linear { beam: 0.2, cutoff: FRAC_PI_3 },
            Falloff::Linear { beam: FRAC_PI_6, cutoff: FRAC_PI_6 },
            Falloff::Linear { beam: 0.0, cutoff: PI },
            Falloff::Flat { cutoff: FRAC_PI_3 },
            Falloff::Punctual { inner: 0.2, outer: FRAC_PI_3 },
            Falloff::Punctual { inner: FRAC_PI_6, outer: FRAC_PI_6 },
        ];
        let of = |falloff| Self {
            position: Vec3::new(0.0, 2.0, 0.0),
            axis: Vec3::NEG_Y,
            intensity: Spectrum::splat(3.0),
            falloff,
        };
        falloffs.map(|f| (of(f), LightTables::default())).into()
    }
}

#[cfg(test)]
impl LightLaws for Spot {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    fn irradiance(&self, _: &LightTables, p: DVec3, n: DVec3) -> f64 {
        let cos = (p - self.position.as_dvec3()).normalize().dot(self.axis.as_dvec3());
        let falloff = of_falloff(self.falloff, cos);
        level(self.intensity) * falloff * inverse_square(self.position, p, n)
    }
}

/// Factor of the intensity at this cosine to the axis.
#[cfg(test)]
pub(super) fn of_falloff(falloff: Falloff, cos: f64) -> f64 {
    match falloff {
        Falloff::Cosine { cos_cutoff, exponent } => {
            if cos > f64::from(cos_cutoff) {
                cos.powf(f64::from(exponent))
            } else {
                0.0
            }
        }
        Falloff::Linear { beam, cutoff } => {
            let (angle, beam, cutoff) = (cos.acos(), f64::from(beam), f64::from(cutoff));
            if angle <= beam { 1.0 } else { ((cutoff - angle) / (cutoff - beam)).max(0.0) }
        }
        Falloff::Flat { cutoff } => {
            if cos >= f64::from(cutoff).cos() {
                cos.powi(-3)
            } else {
                0.0
            }
        }
        Falloff::Punctual { inner, outer } => {
            let [inner, outer] = [inner, outer].map(|angle| f64::from(angle).cos());
            let inside = (cos - outer) / (inner - outer);
            if cos >= inner { 1.0 } else { inside.max(0.0).powi(2) }
        }
    }
}
