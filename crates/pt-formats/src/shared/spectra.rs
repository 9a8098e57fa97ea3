//! Conversion of spectra to colours.
//!
//! Three integrals with the colour matching functions give CIE XYZ, and from that linear Rec. 709.
//! Emission is integrated directly; factors of light (reflectances, and indices of refraction as
//! well) are integrated under daylight D65, which is white. Negative channels, of colours outside
//! of Rec. 709, become 0.

use std::cmp::Ordering;

use pt_math::cie;

/// Colours of a function of the wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpectrumColors {
    /// Colour as emission.
    pub(crate) emitted: [f64; 3],
    /// Colour as a factor of light.
    pub(crate) reflected: [f64; 3],
    /// Maximum of the function.
    pub(crate) most: f64,
}

impl SpectrumColors {
    /// Returns a constant spectrum: equal energy as emission, and grey as a factor.
    pub(crate) fn constant(value: f64) -> Self {
        let equal_energy = cie::rec709_from_xyz([1.0; 3]);
        Self { emitted: equal_energy.map(|c| c * value), reflected: [value; 3], most: value }
    }

    /// Returns a piecewise linear spectrum from wavelengths in nanometres and values; 0 outside of
    /// their range.
    pub(crate) fn sampled(samples: &[(f64, f64)]) -> Result<Self, String> {
        let [first, .., last] = samples else {
            let count = samples.len();
            return Err(format!("found {count} wavelengths, expected at least 2"));
        };
        if let Some((nanometres, value)) = samples.iter().find(|(_, value)| *value < 0.0) {
            return Err(format!("found the value {value} at {nanometres} nm, expected at least 0"));
        }
        if let Some(two) = samples.windows(2).find(|two| two[0].0 >= two[1].0) {
            let [before, after] = [two[0].0, two[1].0];
            return Err(format!(
                "found wavelength {after} after {before}, expected increasing wavelengths"
            ));
        }
        let [shortest, longest] = cie::WAVELENGTHS;
        if last.0 < shortest || first.0 > longest {
            let message = format!(
                "found no visible wavelength, expected nanometres from {shortest} to {longest}"
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

    /// Returns the radiance of a black body, in W m⁻² sr⁻¹ nm⁻¹. [Planck's law with the constants
    /// of CODATA 2014, as in Mitsuba 3.9]
    pub(crate) fn black_body(kelvin: f64) -> Self {
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

/// Returns the colours of a function, and its maximum.
fn integrals(value_at: impl Fn(f64) -> f64) -> SpectrumColors {
    let (mut emitted, mut reflected, mut most) = ([0.0; 3], [0.0; 3], 0.0_f64);
    for Seen { nanometres, light, daylight } in seen() {
        let value = value_at(nanometres);
        for c in 0..3 {
            emitted[c] += value * light[c];
            reflected[c] += value * daylight[c];
        }
        most = most.max(value);
    }
    let color = |xyz| cie::rec709_from_xyz(xyz).map(|c| c.max(0.0));
    SpectrumColors { emitted: color(emitted), reflected: color(reflected), most }
}

/// Returns the contribution of each wavelength (in nanometres) to the colour of a factor of light
/// that is piecewise linear and constant beyond the ends: the sum of values times weights is linear
/// Rec. 709. Weights may be negative.
///
/// # Errors
/// Returns a message if there are fewer than two, they do not increase, or none is visible.
pub(crate) fn reflectance_weights(wavelengths: &[f32]) -> Result<Vec<[f64; 3]>, String> {
    if wavelengths.len() < 2 {
        return Err(format!("found {} wavelengths, expected at least 2", wavelengths.len()));
    }
    let decrease = |two: &&[f32]| two[0].partial_cmp(&two[1]) != Some(Ordering::Less);
    if let Some([before, after]) = wavelengths.windows(2).find(decrease) {
        return Err(format!(
            "found wavelength {after} after {before}, expected increasing wavelengths"
        ));
    }
    let [shortest, longest] = cie::WAVELENGTHS;
    let last = wavelengths.len() - 1;
    if f64::from(wavelengths[last]) < shortest || f64::from(wavelengths[0]) > longest {
        return Err(format!(
            "found no visible wavelength, expected nanometres from {shortest} to {longest}"
        ));
    }
    let mut weights = vec![[0.0; 3]; wavelengths.len()];
    for Seen { nanometres, daylight, .. } in seen() {
        let after = wavelengths.partition_point(|n| f64::from(*n) <= nanometres).clamp(1, last);
        let [n0, n1] = [after - 1, after].map(|i| f64::from(wavelengths[i]));
        let t = ((nanometres - n0) / (n1 - n0)).clamp(0.0, 1.0);
        for c in 0..3 {
            weights[after - 1][c] += (1.0 - t) * daylight[c];
            weights[after][c] += t * daylight[c];
        }
    }
    Ok(weights.into_iter().map(cie::rec709_from_xyz).collect())
}

/// Contribution of a wavelength to CIE XYZ.
struct Seen {
    nanometres: f64,
    /// Contribution as emission.
    light: [f64; 3],
    /// Contribution as a factor of light, under daylight.
    daylight: [f64; 3],
}

/// Returns the 1000 wavelengths over which Mitsuba sums, with its two constants: the sum of ȳ,
/// which makes Y of equal energy 1, and the mean of D65 weighted by ȳ. The latter is off by 0.1 %,
/// so that a perfect reflector has Y = 0.9989; it is kept so that both renderers have the same
/// colours.
fn seen() -> impl Iterator<Item = Seen> {
    const COUNT: u32 = 1000;
    const EQUAL_ENERGY: f64 = 106.750_259_399_414_06;
    const DAYLIGHT: f64 = 98.997_417_518_762_55;
    let [shortest, longest] = cie::WAVELENGTHS;
    let range = longest - shortest;
    (0..COUNT).map(move |i| {
        let nanometres = shortest + f64::from(i) / f64::from(COUNT - 1) * range;
        let light = cie::observer(nanometres).map(|c| c * range / f64::from(COUNT) / EQUAL_ENERGY);
        let power = cie::d65(nanometres) / DAYLIGHT;
        Seen { nanometres, light, daylight: light.map(|c| c * power) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sum of weights times values equals the colour of the spectrum with these values.
    #[test]
    fn weights_are_those_of_spectra() {
        let wavelengths: Vec<f32> = (0..=94_u16).map(|i| 360.0 + 5.0 * f32::from(i)).collect();
        let samples: Vec<_> = wavelengths
            .iter()
            .map(|&n| (f64::from(n), 0.5 + 0.4 * libm::sin(f64::from(n) / 60.0)))
            .collect();
        let expected = SpectrumColors::sampled(&samples).unwrap().reflected;
        let weights = reflectance_weights(&wavelengths).unwrap();
        for c in 0..3 {
            let sum: f64 = weights.iter().zip(&samples).map(|(w, (_, value))| w[c] * value).sum();
            assert!((sum - expected[c]).abs() < 1e-12, "{sum} {expected:?}");
        }
        // The function is constant beyond its ends.
        let weights = reflectance_weights(&[500.0, 600.0]).unwrap();
        let white = SpectrumColors::sampled(&[(300.0, 1.0), (900.0, 1.0)]).unwrap().reflected;
        for c in 0..3 {
            assert!((weights[0][c] + weights[1][c] - white[c]).abs() < 1e-12, "{weights:?}");
        }
    }

    #[test]
    fn wavelengths_that_make_no_sense_are_reported() {
        for (wavelengths, want) in [
            (&[500.0][..], "at least 2"),
            (&[500.0, 500.0], "found wavelength 500 after 500"),
            (&[500.0, f32::NAN], "expected increasing wavelengths"),
            (&[f32::NAN, 500.0], "expected increasing wavelengths"),
            (&[0.1, 0.2], "found no visible wavelength"),
            (&[831.0, 832.0], "found no visible wavelength"),
        ] {
            let message = reflectance_weights(wavelengths).unwrap_err();
            assert!(message.contains(want), "{message}");
        }
    }
}
