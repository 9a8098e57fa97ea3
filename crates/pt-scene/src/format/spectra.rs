//! Spectra: functions of the wavelength to colours.
//!
//! Three integrals over the observer give CIE XYZ and from that linear Rec. 709. Light is
//! integrated as it is; what multiplies light (reflectances, and indices of refraction as well)
//! is integrated under daylight D65, which is white. Channels below 0, of colours outside of
//! Rec. 709, become 0.

use pt_math::cie;

/// A function of the wavelength, by its colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spectrum {
    /// As light.
    pub(super) emitted: [f64; 3],
    /// As what multiplies light.
    pub(super) reflected: [f64; 3],
    /// Its largest value.
    pub(super) most: f64,
}

impl Spectrum {
    /// The same at all wavelengths: equal energy as light, and grey as what multiplies it.
    pub(super) fn constant(value: f64) -> Self {
        let equal_energy = cie::rec709_from_xyz([1.0; 3]);
        Self { emitted: equal_energy.map(|c| c * value), reflected: [value; 3], most: value }
    }

    /// Linear between wavelengths in nanometres, and 0 outside of them.
    pub(super) fn sampled(samples: &[(f64, f64)]) -> Result<Self, String> {
        let [first, .., last] = samples else {
            let count = samples.len();
            return Err(format!("expected at least 2 wavelengths, but there are {count}"));
        };
        if let Some((nanometres, value)) = samples.iter().find(|(_, value)| *value < 0.0) {
            return Err(format!(
                "the value at {nanometres} nm is {value}; it has to be at least 0"
            ));
        }
        if let Some(two) = samples.windows(2).find(|two| two[0].0 >= two[1].0) {
            let [before, after] = [two[0].0, two[1].0];
            return Err(format!("wavelengths have to increase, but {after} comes after {before}"));
        }
        let [shortest, longest] = cie::WAVELENGTHS;
        if last.0 < shortest || first.0 > longest {
            let message = format!(
                "no wavelength is visible; expected nanometres from {shortest} to {longest}"
            );
            return Err(message);
        }
        let colors = integrals(|nanometres| {
            if nanometres < first.0 || nanometres > last.0 {
                return 0.0;
            }
            let after = samples.partition_point(|(n, _)| *n <= nanometres);
            let i = after.clamp(1, samples.len() - 1);
            let ((n0, v0), (n1, v1)) = (samples[i - 1], samples[i]);
            let t = (nanometres - n0) / (n1 - n0);
            v0 * (1.0 - t) + v1 * t
        });
        let most = samples.iter().fold(0.0, |most: f64, (_, value)| most.max(*value));
        Ok(Self { most, ..colors })
    }

    /// The radiance of a black body, in W m⁻² sr⁻¹ nm⁻¹. [Planck's law with the constants of
    /// CODATA 2014, as in Mitsuba 3.9]
    pub(super) fn black_body(kelvin: f64) -> Self {
        const LIGHT_SPEED: f64 = 2.997_924_58e8;
        const PLANCK: f64 = 6.626_070_04e-34;
        const BOLTZMANN: f64 = 1.380_648_52e-23;
        integrals(|nanometres| {
            let metres = nanometres * 1e-9;
            let photons = PLANCK * LIGHT_SPEED / (metres * BOLTZMANN * kelvin);
            let square = metres * metres;
            let flux = 2.0 * PLANCK * LIGHT_SPEED * LIGHT_SPEED / (square * square * metres);
            flux / libm::expm1(photons) * 1e-9
        })
    }
}

/// The colours of a function, and its largest value, by sums over the 1000 wavelengths that
/// Mitsuba takes, with its two factors: the sum of ȳ, which makes Y of equal energy 1, and the mean
/// of D65 weighted by ȳ. The latter is off by 0.1 %, so that a perfect reflector has Y = 0.9989; it
/// is kept, for both renderers to have the same colours.
fn integrals(value_at: impl Fn(f64) -> f64) -> Spectrum {
    const COUNT: u32 = 1000;
    const EQUAL_ENERGY: f64 = 106.750_259_399_414_06;
    const DAYLIGHT: f64 = 98.997_417_518_762_55;
    let [shortest, longest] = cie::WAVELENGTHS;
    let range = longest - shortest;
    let (mut emitted, mut reflected, mut most) = ([0.0; 3], [0.0; 3], 0.0_f64);
    for i in 0..COUNT {
        let nanometres = shortest + f64::from(i) / f64::from(COUNT - 1) * range;
        let value = value_at(nanometres);
        let weight = value * range / f64::from(COUNT) / EQUAL_ENERGY;
        let (observer, daylight) = (cie::observer(nanometres), cie::d65(nanometres) / DAYLIGHT);
        for c in 0..3 {
            emitted[c] += weight * observer[c];
            reflected[c] += weight * daylight * observer[c];
        }
        most = most.max(value);
    }
    let color = |xyz| cie::rec709_from_xyz(xyz).map(|c| c.max(0.0));
    Spectrum { emitted: color(emitted), reflected: color(reflected), most }
}
