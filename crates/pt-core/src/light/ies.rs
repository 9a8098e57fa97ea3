//! Point light with the intensity distribution of a luminaire (IES profile).

use std::f32::consts::PI;

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Mat3, Spectrum, Vec3, trig};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, inverse_square, level};
use super::point::sample_point;
use super::tree::LightBounds;
use super::{Light, LightSample, LightSampleContext, LightTables};

/// A point light whose intensity is tabulated by vertical and horizontal angle.
#[derive(Clone, Copy, Debug)]
pub struct Ies {
    /// World-space position.
    pub position: Vec3,
    /// Axes of the luminaire in the world: the vertical angle 0 is −z, the horizontal angles 0 and
    /// 90° are +x and +y.
    pub axes: Mat3,
    /// Index into [`LightTables::profiles`].
    pub profile: u32,
    /// Radiant intensity of one candela.
    pub scale: Spectrum,
}

impl Ies {
    /// Luminous intensity towards the unit vector `w`, in candela.
    #[inline]
    fn candela(&self, tables: &LightTables, w: Vec3) -> f32 {
        const DEGREES: f32 = 180.0 / PI;
        let d = self.axes.transpose() * w;
        let vertical = trig::atan2((d.x * d.x + d.y * d.y).sqrt(), -d.z) * DEGREES;
        let around = trig::atan2(d.y, d.x) * DEGREES;
        let horizontal = if around < 0.0 { around + 360.0 } else { around };
        tables.profiles[self.profile as usize].candela(vertical.clamp(0.0, 180.0), horizontal)
    }
}

impl Light for Ies {
    const DELTA: bool = true;

    #[inline]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        _u: [f32; 2],
    ) -> Option<LightSample> {
        let of_one = sample_point(self.position, context.p, self.scale)?;
        let candela = self.candela(tables, -of_one.wi);
        let radiance = of_one.radiance * candela;
        (candela > 0.0).then_some(LightSample { radiance, ..of_one })
    }

    fn bounds(&self, tables: &LightTables) -> Option<LightBounds> {
        let mean = tables.profiles[self.profile as usize].mean_candela();
        Some(LightBounds::of_point(self.position, self.scale, mean))
    }

    /// A rotated luminaire that emits downwards and to one side.
    fn examples() -> Vec<(Self, LightTables)> {
        let candela = [
            [9.0, 8.0, 7.0, 0.0],
            [9.0, 4.0, 2.0, 0.0],
            [9.0, 6.0, 3.0, 1.0],
            [9.0, 4.0, 2.0, 0.0],
            [9.0, 8.0, 7.0, 0.0],
        ];
        let (vertical, horizontal) =
            (vec![0.0, 40.0, 90.0, 120.0], vec![0.0, 90.0, 180.0, 270.0, 360.0]);
        let profile =
            pt_scene::IesProfile::of_table(vertical, horizontal, candela.as_flattened().to_vec());
        let (x, y) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.48, 0.8, -0.36));
        let light = Self {
            position: Vec3::new(0.1, 2.0, 0.3),
            axes: Mat3::from_cols(x, y, x.cross(y)),
            profile: 0,
            scale: Spectrum::splat(0.4),
        };
        vec![(
            light,
            LightTables { profiles: vec![std::sync::Arc::new(profile)], ..LightTables::default() },
        )]
    }
}

#[cfg(test)]
impl LightLaws for Ies {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        let w = (p - self.position.as_dvec3()).normalize();
        let axes = [self.axes.x_axis, self.axes.y_axis, self.axes.z_axis];
        let [x, y, z] = axes.map(|axis| axis.as_dvec3().dot(w));
        let vertical = (-z).acos().to_degrees();
        let horizontal = y.atan2(x).to_degrees().rem_euclid(360.0);
        let profile = &tables.profiles[self.profile as usize];
        let candela = f64::from(profile.candela(vertical as f32, horizontal as f32));
        level(self.scale) * candela * inverse_square(self.position, p, n)
    }
}
