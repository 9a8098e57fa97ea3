//! Clear daylight sky. [Hosek & Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome
//! Radiance"]

use std::f32::consts::PI;

#[cfg(test)]
use pt_math::DVec3;
use pt_math::distribution::Piecewise2D;
use pt_math::{Mat3, Pdf, SolidAngle, Spectrum, Vec3, trig};

use super::environment::{to_direction, to_image};
use super::hosek_wilkie::{self, SkyChannel};
#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, of_infinite_light};
use super::tree::LightBounds;
use super::{EscapedRay, Light, LightHit, LightSample, LightSampleContext, LightTables};

/// A clear sky above the horizon of an up axis.
#[derive(Clone, Copy, Debug)]
pub struct HosekWilkieSky {
    /// Index into [`LightTables::clear_skies`].
    pub index: u32,
    /// Orthogonal matrix from directions of the model, where +y is up, to those of the world.
    pub to_world: Mat3,
}

/// Radiance of a clear sky by direction, where +y is up, and its sampling table.
pub struct HosekWilkieModel {
    to_sun: Vec3,
    channels: [SkyChannel; 3],
    /// Factor of the radiance.
    scale: f32,
    /// Sampling table over azimuth and zenith angle, as in the upper half of an environment map.
    density: Option<Piecewise2D>,
}

impl HosekWilkieModel {
    /// Creates a sky with the sun in a unit direction that is not below the horizon, a turbidity in
    /// [`hosek_wilkie::TURBIDITIES`] and a ground albedo in [0, 1].
    pub(crate) fn new(to_sun: Vec3, turbidity: f64, albedo: [f32; 3], scale: f32) -> Self {
        let mut model = Self::without_density(to_sun, turbidity, albedo, scale);
        model.density = model.table();
        model
    }

    /// Creates a sky without its sampling table.
    pub(super) fn without_density(
        to_sun: Vec3,
        turbidity: f64,
        albedo: [f32; 3],
        scale: f32,
    ) -> Self {
        let elevation = libm::asin(f64::from(to_sun.y).clamp(0.0, 1.0));
        let channels = hosek_wilkie::sky(elevation, turbidity, albedo);
        Self { to_sun, channels, scale, density: None }
    }

    /// Returns the sampling table: luminance at the centre of each cell, at least a small minimum,
    /// times sin θ.
    fn table(&self) -> Option<Piecewise2D> {
        const COLUMNS: usize = 512;
        const ROWS: usize = 128;
        const MIN: f32 = 1e-3;
        let cells = (0..COLUMNS * ROWS).map(|i| {
            let middle = |i: usize, count: usize| (i as f32 + 0.5) / count as f32;
            let (d, sin) =
                to_direction([middle(i % COLUMNS, COLUMNS), 0.5 * middle(i / COLUMNS, ROWS)]);
            (self.radiance(d).luminance(), sin)
        });
        let cells: Vec<_> = cells.collect();
        let brightest = cells.iter().map(|cell| cell.0).fold(0.0, f32::max);
        let weights: Vec<_> = cells.iter().map(|(l, sin)| l.max(MIN * brightest) * sin).collect();
        Piecewise2D::new(&weights, COLUMNS, ROWS)
    }

    /// Radiance from a direction; black below the horizon.
    ///
    /// F(θ, γ) = (1 + A e^(B / (cos θ + 0.01))) (C + D e^(Eγ) + F cos²γ + G χ(I, γ) + H √cos θ) at
    /// the angles θ to the zenith and γ to the sun, with χ(g, γ) = (1 + cos²γ) / (1 + g² − 2g
    /// cos γ)^(3/2), times the mean radiance. [ibid., equations 8 and 9, where H and I are
    /// exchanged]
    #[inline]
    pub(super) fn radiance(&self, d: Vec3) -> Spectrum {
        if d.y < 0.0 {
            return Spectrum::ZERO;
        }
        let cos_gamma = d.dot(self.to_sun).clamp(-1.0, 1.0);
        let gamma = trig::atan2(d.cross(self.to_sun).length(), cos_gamma);
        let squared = cos_gamma * cos_gamma;
        let root = d.y.sqrt();
        let of_channel = |[a, b, c, d_, e, f, g, h, i, mean]: SkyChannel| {
            let s = 1.0 + i * i - 2.0 * i * cos_gamma;
            let chi = (1.0 + squared) / (s * s.sqrt());
            let zenith = 1.0 + a * trig::exp(b / (d.y + 0.01));
            let sun = c + d_ * trig::exp(e * gamma) + f * squared + g * chi + h * root;
            (zenith * sun * mean * self.scale).max(0.0)
        };
        Spectrum::from(self.channels.map(of_channel))
    }

    /// Density of a direction: dω = π² sin θ dx dy over the table.
    #[inline]
    fn pdf(&self, d: Vec3) -> Pdf<SolidAngle> {
        let sin = (d.x * d.x + d.z * d.z).sqrt();
        let Some(density) = &self.density else { return Pdf::ZERO };
        if d.y < 0.0 || sin <= 0.0 {
            return Pdf::ZERO;
        }
        let [x, y] = to_image(d);
        Pdf::new(density.pdf([x, (2.0 * y).min(1.0)]) / (PI * PI * sin))
    }
}

impl HosekWilkieSky {
    fn of<'a>(&self, tables: &'a LightTables) -> &'a HosekWilkieModel {
        &tables.clear_skies[self.index as usize]
    }

    fn local(&self, d: Vec3) -> Vec3 {
        self.to_world.transpose() * d
    }
}

impl Light for HosekWilkieSky {
    const DELTA: bool = false;

    #[inline]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let ([x, y], _) = self.of(tables).density.as_ref()?.sample(u);
        let wi = self.to_world * to_direction([x, 0.5 * y]).0;
        // Density of the rounded direction, which may be in the next cell.
        let pdf = self.pdf(tables, context, wi, None);
        (pdf.get() > 0.0).then(|| LightSample {
            wi,
            distance: f32::INFINITY,
            end: None,
            radiance: self.le_infinite(tables, EscapedRay::new(context.p, wi)),
            pdf: Some(pdf),
        })
    }

    #[inline]
    fn pdf(
        &self,
        tables: &LightTables,
        _: &LightSampleContext,
        wi: Vec3,
        _: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        self.of(tables).pdf(self.local(wi))
    }

    #[inline]
    fn le_infinite(&self, tables: &LightTables, ray: EscapedRay) -> Spectrum {
        self.of(tables).radiance(self.local(ray.direction))
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// A high sun in clear air, and a low one in haze, rotated.
    fn examples() -> Vec<(Self, LightTables)> {
        let (s, t) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.48, 0.36, 0.8));
        let of = |to_sun, turbidity, albedo, to_world| {
            let model = HosekWilkieModel::new(to_sun, turbidity, albedo, 2.0);
            let tables = LightTables { clear_skies: vec![model], ..LightTables::default() };
            (Self { index: 0, to_world }, tables)
        };
        vec![
            of(Vec3::new(0.36, 0.8, 0.48), 2.3, [0.1; 3], Mat3::IDENTITY),
            of(Vec3::new(0.96, 0.0, 0.28), 8.0, [0.7, 0.4, 0.1], Mat3::from_cols(s, t, s.cross(t))),
        ]
    }
}

#[cfg(test)]
impl LightLaws for HosekWilkieSky {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    fn irradiance(&self, tables: &LightTables, _: DVec3, n: DVec3) -> f64 {
        of_infinite_light(self, tables, n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of `sunsky` of Mitsuba 3.9.1 in mode scalar_rgb without its sun, where +z is up: for
    /// a sun and an atmosphere each, in five directions.
    #[test]
    fn the_sky_has_the_colours_of_mitsuba() {
        let directions = [
            [0.0, 0.0, 1.0],
            [0.999_800_1, 0.0, 0.019_996],
            [-0.940_720_9, 0.282_216_3, 0.188_144_2],
            [0.527_046_3, 0.105_409_3, 0.843_274],
            [0.0, -0.894_427_2, 0.447_213_6],
        ];
        let cases = [
            (
                [0.6, 0.0, 0.8],
                3.0,
                [0.3; 3],
                [
                    [0.029_080_08, 0.048_235_63, 0.095_586_7],
                    [0.198_379_1, 0.248_517_7, 0.282_389_2],
                    [0.087_991_77, 0.142_443_4, 0.226_244_6],
                    [0.124_423_8, 0.150_031_5, 0.195_222_9],
                    [0.045_692_96, 0.082_014_45, 0.151_849_9],
                ],
            ),
            (
                [0.96, 0.0, 0.28],
                8.0,
                [0.7, 0.4, 0.1],
                [
                    [0.022_956_78, 0.029_470_21, 0.042_438_16],
                    [1.408_718, 0.954_505_7, 0.487_733_6],
                    [0.087_180_99, 0.090_099_4, 0.096_299_59],
                    [0.063_497_86, 0.065_499_54, 0.069_021_49],
                    [0.051_879_26, 0.060_652_55, 0.073_388_67],
                ],
            ),
            (
                [0.6, -0.64, 0.48],
                1.7,
                [0.05, 0.1, 0.2],
                [
                    [0.011_594_85, 0.025_555_24, 0.056_516_11],
                    [0.134_212_9, 0.181_313_4, 0.191_138_5],
                    [0.073_047_3, 0.124_626_1, 0.186_436_3],
                    [0.017_629_8, 0.035_742_44, 0.072_609_21],
                    [0.045_262_94, 0.079_181_75, 0.134_213_4],
                ],
            ),
        ];
        let upright = |[x, y, z]: [f32; 3]| Vec3::new(x, z, -y);
        for (to_sun, turbidity, albedo, colours) in cases {
            let model = HosekWilkieModel::new(upright(to_sun), turbidity, albedo, 1.0);
            for (d, want) in directions.into_iter().zip(colours) {
                let got = model.radiance(upright(d)).to_array();
                for (got, want) in got.into_iter().zip(want) {
                    assert!((got / want - 1.0).abs() < 1e-5, "{to_sun:?} {d:?}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn the_sky_is_black_below_the_horizon() {
        let model = HosekWilkieModel::new(Vec3::Y, 3.0, [0.3; 3], 1.0);
        let below = Vec3::new(0.8, -0.6, 0.0);
        assert!(model.radiance(below).is_black() && model.pdf(below).get() == 0.0);
        assert!(!model.radiance(Vec3::X).is_black());
    }
}
