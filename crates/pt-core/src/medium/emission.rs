//! Emission of media.

use pt_math::{Spectrum, Vec3, cie, trig};

use super::field::WorldGrid;

/// Emitted radiance Le of a medium, which emits σa Le per metre. It is the radiance of an opaque
/// amount of the medium that only absorbs. Outside of grids it is 0.
#[derive(Clone, Debug)]
pub enum MediumEmission {
    /// Constant radiance.
    Constant(Spectrum),
    /// Radiance given by a grid.
    Field(WorldGrid),
    /// Black-body radiance by temperature.
    Heat(BlackbodyEmission),
}

impl MediumEmission {
    /// Radiance at a point in world space.
    pub(super) fn at(&self, p: Vec3) -> Spectrum {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Field(field) => field.within(p).map_or(Spectrum::ZERO, |p| field.color(p)),
            Self::Heat(heat) => heat.at(p),
        }
    }
}

/// Temperature in kelvins below which the emission is 0: the strongest visible radiance is less
/// than 10⁻⁷⁰ of that at 3000 K.
const COLDEST: f32 = 100.0;
/// Number of table entries per factor e of the temperature: interpolation errors are less than 10⁻³
/// at 700 K, and less above.
const PER_E: f32 = 512.0;

/// Black-body emission by Planck's law, whose strongest wavelength has the same radiance
/// everywhere.
#[derive(Clone, Debug)]
pub struct BlackbodyEmission {
    /// Temperature in kelvins.
    temperature: WorldGrid,
    /// Radiance at temperatures whose logarithms are equidistant, from [`COLDEST`] on.
    colors: Vec<Spectrum>,
}

impl BlackbodyEmission {
    /// Creates the emission from a grid of one channel, in kelvins; `scale` is the radiance of the
    /// strongest wavelength.
    pub fn new(temperature: WorldGrid, scale: f32) -> Self {
        let hottest = temperature.grid.values.iter().fold(COLDEST, |most, t| most.max(*t));
        let count = (trig::ln(hottest / COLDEST) * PER_E).ceil() as u32 + 2;
        let color = |i: u32| {
            let kelvin = f64::from(COLDEST) * libm::exp(f64::from(i) / f64::from(PER_E));
            Spectrum::from(black_body(kelvin).map(|c| (c * f64::from(scale)) as f32))
        };
        Self { temperature, colors: (0..count).map(color).collect() }
    }

    fn at(&self, p: Vec3) -> Spectrum {
        let kelvin = self.temperature.within(p).map_or(0.0, |p| self.temperature.number(p, 0));
        let place = trig::ln(kelvin / COLDEST) * PER_E;
        if place.is_nan() || place < 0.0 {
            return Spectrum::ZERO;
        }
        let first = (place as usize).min(self.colors.len() - 2);
        let (a, b) = (self.colors[first], self.colors[first + 1]);
        a + (b - a) * (place - first as f32).min(1.0)
    }
}

/// Linear Rec. 709 colour of a black body whose strongest wavelength has radiance 1. Negative
/// channels, which occur at the lowest temperatures, are 0. An equal-energy spectrum of radiance 1
/// has luminance 1. [Planck's law, and Wien's, with the constants of CODATA 2018]
fn black_body(kelvin: f64) -> [f64; 3] {
    /// hc / k in metre kelvins, and Wien's displacement constant, the strongest wavelength times
    /// the temperature.
    const SECOND: f64 = 1.438_776_877e-2;
    const WIEN: f64 = 2.897_771_955e-3;
    const STEP: f64 = 5e-9;
    let radiance = |metres: f64| 1.0 / (metres.powi(5) * libm::expm1(SECOND / (metres * kelvin)));
    let most = radiance(WIEN / kelvin);
    let [shortest, longest] = cie::WAVELENGTHS.map(|nanometres| nanometres * 1e-9);
    let steps = ((longest - shortest) / STEP).round() as u32;
    let (mut sum, mut whole) = ([0.0; 3], 0.0);
    for i in 0..=steps {
        let metres = shortest + STEP * f64::from(i);
        let observer = cie::observer(metres * 1e9);
        let share = radiance(metres) / most;
        sum = std::array::from_fn(|c| sum[c] + observer[c] * share);
        whole += observer[1];
    }
    cie::rec709_from_xyz(sum.map(|x| x / whole)).map(|c| c.max(0.0))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use pt_math::Mat3;
    use pt_scene::medium::{Grid, GridFilter};

    use super::*;

    fn heat(kelvin: f32, scale: f32) -> Spectrum {
        let field = WorldGrid {
            grid: Arc::new(Grid::uniform(kelvin)),
            corner: Vec3::ZERO,
            to_unit: Mat3::IDENTITY,
            filter: GridFilter::Trilinear,
        };
        BlackbodyEmission::new(field, scale).at(Vec3::splat(0.5))
    }

    /// Interpolated radiance agrees with Planck's law, and low temperatures emit nothing visible.
    #[test]
    fn heat_emits_by_plancks_law() {
        for kelvin in [700.0, 1000.0, 2856.0, 6504.0, 30_000.0, 1e6_f32] {
            let (got, want) = (heat(kelvin, 3.0).to_array(), black_body(f64::from(kelvin)));
            for (got, want) in got.into_iter().zip(want) {
                let want = 3.0 * want;
                assert!((f64::from(got) - want).abs() <= 2e-3 * want, "{kelvin}: {got} {want}");
            }
        }
        assert!(heat(300.0, 1.0).max_channel() < 1e-20);
        for cold in [0.0, 50.0] {
            assert_eq!(heat(cold, 1.0), Spectrum::ZERO);
        }
    }

    /// Correlated colour temperatures: at 2856 K, standard illuminant A has x = 0.4476, y = 0.4074.
    /// [ISO 11664-2:2007] If the strongest wavelength is in the middle of the visible range, the
    /// luminance is nearly that of an equal-energy spectrum.
    #[test]
    fn black_bodies_have_their_colours() {
        let [r, g, b] = black_body(2856.0);
        let x = 0.412_391 * r + 0.357_584 * g + 0.180_481 * b;
        let y = 0.212_639 * r + 0.715_169 * g + 0.072_192 * b;
        let z = 0.019_331 * r + 0.119_195 * g + 0.950_532 * b;
        let sum = x + y + z;
        assert!((x / sum - 0.4476).abs() < 5e-4 && (y / sum - 0.4074).abs() < 5e-4, "{x} {y} {z}");
        let luminance = |kelvin| Spectrum::from(black_body(kelvin).map(|c| c as f32)).luminance();
        assert!(luminance(5200.0) > 0.97 && luminance(5200.0) < 1.0, "{}", luminance(5200.0));
        assert!(luminance(2856.0) < 0.5 && luminance(2856.0) > 0.1, "{}", luminance(2856.0));
    }
}
