//! The sun's disk through the atmosphere. [Hosek & Wilkie 2013, "Adding a Solar-Radiance Function
//! to the Hosek-Wilkie Skylight Model"]

use std::f32::consts::FRAC_PI_2;

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, trig};
#[cfg(test)]
use std::f64::consts::TAU;

use super::hosek_wilkie::{self, COEFFICIENTS, HEIGHT_POWERS, LIMB_POWERS, PARTS};
#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level, midpoints};
use super::tree::LightBounds;
use super::{
    DistantDisk, EscapedRay, Light, LightHit, LightSample, LightSampleContext, LightTables,
};

/// A disk at infinity that is invisible below the horizon.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    /// The disk, with its mean radiance, or with the factor of the radiance of the table.
    pub disk: DistantDisk,
    /// Unit vector to the zenith.
    pub up: Vec3,
    /// Index into [`LightTables::limbs`]; `None` for constant radiance.
    pub limb: Option<u32>,
}

/// Radiance of the sun by elevation and position on its disk.
pub struct LimbDarkening(Vec<f32>);

impl LimbDarkening {
    /// Creates the table for a turbidity in [`hosek_wilkie::TURBIDITIES`].
    pub(crate) fn new(turbidity: f64) -> Self {
        Self(hosek_wilkie::limb(turbidity))
    }

    /// Radiance Σ c_jk x^j cos^k ψ at a sine of the elevation, where x is the elevation above the
    /// beginning of its interval, and ψ the angle between the normal of the sun and the ray.
    fn radiance(&self, sin_elevation: f32, cos_psi: f32) -> Spectrum {
        let elevation = FRAC_PI_2 - trig::acos(sin_elevation.clamp(0.0, 1.0));
        let part = (libm::cbrtf(elevation / FRAC_PI_2) * PARTS as f32) as usize;
        let part = part.min(PARTS - 1);
        let begin = part as f32 / PARTS as f32;
        let x = elevation - FRAC_PI_2 * begin * begin * begin;
        let polynomial = |c: &[f32], x: f32| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let of_channel = |c: &[f32]| {
            let mut powers = [0.0; HEIGHT_POWERS];
            for (power, limb) in powers.iter_mut().zip(c.chunks_exact(LIMB_POWERS)) {
                *power = polynomial(limb, cos_psi);
            }
            polynomial(&powers, x).max(0.0)
        };
        let of_part = &self.0[part * COEFFICIENTS..(part + 1) * COEFFICIENTS];
        let channel = HEIGHT_POWERS * LIMB_POWERS;
        Spectrum::from([0, 1, 2].map(|i| of_channel(&of_part[i * channel..(i + 1) * channel])))
    }
}

impl Sun {
    /// Radiance from a direction in the disk.
    #[inline]
    fn radiance(&self, tables: &LightTables, d: Vec3) -> Spectrum {
        let Some(limb) = self.limb else { return self.disk.radiance };
        let one_minus_cos = self.disk.one_minus_cos;
        let sin2_rim = one_minus_cos * (2.0 - one_minus_cos);
        let sin2 = d.cross(self.disk.to_light).length_squared();
        let cos_psi = (1.0 - sin2 / sin2_rim).max(0.0).sqrt();
        tables.limbs[limb as usize].radiance(d.dot(self.up), cos_psi) * self.disk.radiance
    }
}

impl Light for Sun {
    const DELTA: bool = false;

    #[inline]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let sample = self.disk.sample(tables, context, u)?;
        (sample.wi.dot(self.up) >= 0.0)
            .then(|| LightSample { radiance: self.radiance(tables, sample.wi), ..sample })
    }

    #[inline]
    fn pdf(
        &self,
        t: &LightTables,
        context: &LightSampleContext,
        wi: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        if wi.dot(self.up) >= 0.0 { self.disk.pdf(t, context, wi, hit) } else { Pdf::ZERO }
    }

    #[inline]
    fn le_infinite(&self, tables: &LightTables, ray: EscapedRay) -> Spectrum {
        let d = ray.direction;
        if self.disk.le_infinite(tables, ray).is_black() || d.dot(self.up) < 0.0 {
            return Spectrum::ZERO;
        }
        self.radiance(tables, d)
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// A high sun of real size, a wide one without limb darkening, and a low one with limb
    /// darkening, cut by the horizon.
    fn examples() -> Vec<(Self, LightTables)> {
        let of = |to_light, radius, limb: Option<f64>| {
            let disk = DistantDisk::of_radiance(to_light, radius, Spectrum::splat(1e-2));
            let limbs: Vec<_> = limb.into_iter().map(LimbDarkening::new).collect();
            let index = (!limbs.is_empty()).then_some(0);
            let tables = LightTables { limbs, ..LightTables::default() };
            (Self { disk, up: Vec3::Y, limb: index }, tables)
        };
        vec![
            of(Vec3::new(0.36, 0.8, 0.48), hosek_wilkie::SUN_RADIUS as f32, Some(3.0)),
            of(Vec3::new(0.96, 0.28, 0.0), 0.5, None),
            of(Vec3::new(0.0, 0.0, -1.0), 0.2, Some(6.5)),
        ]
    }
}

#[cfg(test)]
impl LightLaws for Sun {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    /// Midpoint rule over parts of equal solid angle.
    fn irradiance(&self, tables: &LightTables, _: DVec3, n: DVec3) -> f64 {
        const PARTS: u32 = 600;
        let one_minus_cos = f64::from(self.disk.one_minus_cos);
        let axis = self.disk.to_light.as_dvec3();
        let (x, y) = axis.any_orthonormal_pair();
        midpoints(PARTS, |u, v| {
            let (height, (sin, cos)) = (u * one_minus_cos, (v * TAU).sin_cos());
            let away = (height * (2.0 - height)).sqrt();
            let d = axis * (1.0 - height) + (x * cos + y * sin) * away;
            let radiance = self.le_infinite(tables, EscapedRay::new(Vec3::ZERO, d.as_vec3()));
            level(radiance) * d.dot(n).max(0.0)
        }) * TAU
            * one_minus_cos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Direction of the sun, turbidity, radiance of the constant sun, and that of the one with limb
    /// darkening at the centre, at its side, above and below the centre.
    type Case = (Vec3, f64, [f32; 3], [(Vec3, [f32; 3]); 4]);

    /// Values of `sunsky` of Mitsuba 3.9.1 in mode scalar_rgb without its sky; +z is up.
    fn cases() -> [Case; 2] {
        [
            (
                Vec3::new(0.6, 0.0, 0.8),
                3.0,
                [21_689.34, 18_034.51, 13_663.24],
                [
                    (Vec3::new(0.6, 0.0, 0.8), [26_147.15, 22_559.85, 18_082.72]),
                    (
                        Vec3::new(0.599_997_3, -0.003, 0.799_996_4),
                        [23_322.46, 19_642.49, 15_164.95],
                    ),
                    (Vec3::new(0.596_394, 0.0, 0.802_691_9), [15_724.31, 12_091.05, 8_045.845]),
                    (Vec3::new(0.603_195_2, 0.0, 0.797_593_6), [19_854.28, 16_145.91, 11_768.09]),
                ],
            ),
            (
                Vec3::new(0.96, 0.0, 0.28),
                8.0,
                [9_958.667, 6_617.565, 3_486.679],
                [
                    (Vec3::new(0.96, 0.0, 0.28), [12_067.98, 8_307.29, 4_633.982]),
                    (
                        Vec3::new(0.959_995_7, -0.003, 0.279_998_7),
                        [10_751.88, 7_229.963, 3_878.862],
                    ),
                    (Vec3::new(0.958_730_3, 0.0, 0.284_317_1), [7_311.938, 4_521.955, 2_091.892]),
                    (Vec3::new(0.961_111_2, 0.0, 0.276_157_8), [9_030.151, 5_845.86, 2_931.977]),
                ],
            ),
        ]
    }

    fn assert_close(got: [f32; 3], want: [f32; 3], bound: f32) {
        for (g, w) in got.into_iter().zip(want) {
            assert!((g / w - 1.0).abs() < bound, "{got:?} {want:?}");
        }
    }

    #[test]
    fn the_even_sun_has_the_colours_of_mitsuba() {
        for (to_sun, turbidity, want, _) in cases() {
            let elevation = libm::asin(f64::from(to_sun.z));
            let got = hosek_wilkie::sun(elevation, turbidity).map(|c| c as f32);
            assert_close(got, want, 2e-6);
        }
    }

    /// Near the rim, directions of seven digits determine the radiance to three.
    #[test]
    fn the_sun_darkens_to_its_rim_as_that_of_mitsuba() {
        for (to_light, turbidity, _, places) in cases() {
            let radius = hosek_wilkie::SUN_RADIUS as f32;
            let disk = DistantDisk::of_radiance(to_light, radius, Spectrum::ONE);
            let limbs = vec![LimbDarkening::new(turbidity)];
            let tables = LightTables { limbs, ..LightTables::default() };
            let sun = Sun { disk, up: Vec3::Z, limb: Some(0) };
            for (d, want) in places {
                assert_close(
                    sun.le_infinite(&tables, EscapedRay::new(Vec3::ZERO, d)).to_array(),
                    want,
                    2e-3,
                );
            }
        }
    }
}
