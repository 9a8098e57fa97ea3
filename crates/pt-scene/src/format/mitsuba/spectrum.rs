//! Spectra: functions of the wavelength to colours, as Mitsuba's RGB modes take them.
//!
//! Three integrals over the observer give CIE XYZ and from that linear Rec. 709. Light is
//! integrated as it is; what multiplies light (reflectances, and indices of refraction as well)
//! is integrated under daylight D65, which is white. Channels below 0, of colours outside of
//! Rec. 709, become 0.

use std::path::Path;

use pt_math::cie;

use super::super::mesh_file;
use super::super::xml::quote;
use super::object::{Object, Parameters, Role, Target, Tree, error, unsupported};
use super::value::{self, Value};
use crate::LoadError;

const KINDS: [&str; 6] = ["blackbody", "d65", "irregular", "regular", "srgb", "uniform"];

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

    /// One number, or `WAVELENGTH:VALUE` several times.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        if !text.contains(':') {
            return value::number(text).map(Self::constant);
        }
        let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',');
        let pair = |word: &str| match word.split_once(':') {
            Some((nanometres, value)) => Ok((value::number(nanometres)?, value::number(value)?)),
            None => Err(format!("{} is no pair; expected WAVELENGTH:VALUE", quote(word))),
        };
        let samples: Result<Vec<_>, _> = words.filter(|w| !w.is_empty()).map(pair).collect();
        Self::sampled(&samples?)
    }

    /// The lines `WAVELENGTH VALUE` of a file; those that begin with `#` are comments.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let bytes = mesh_file::read(path)?;
        let mut samples = Vec::new();
        for (line, i) in String::from_utf8_lossy(&bytes).lines().zip(1_u32..) {
            if line.starts_with('#') || line.trim().is_empty() {
                continue;
            }
            let message = |message: String| format!("{}:{i}: {message}", path.display());
            match value::numbers(line).map_err(message)?.as_slice() {
                [nanometres, value] => samples.push((*nanometres, *value)),
                _ => return Err(message(format!("{} is no WAVELENGTH VALUE", quote(line)))),
            }
        }
        Self::sampled(&samples).map_err(|message| format!("{}: {message}", path.display()))
    }

    /// Linear between wavelengths in nanometres, and 0 outside of them.
    fn sampled(samples: &[(f64, f64)]) -> Result<Self, String> {
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
    fn black_body(kelvin: f64) -> Self {
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

/// Turns the objects `<spectrum type="…">` into parameters of the objects that they are in, or
/// that refer to them.
pub(super) fn resolve(tree: &mut Tree) -> Result<(), LoadError> {
    let is_spectrum = |object: &&Object| object.tag == "spectrum";
    if tree.objects.iter().find(is_spectrum).is_none() {
        return Ok(());
    }
    let value = |object: &Object| is_spectrum(&object).then(|| of_object(tree, object)).transpose();
    let values = tree.objects.iter().map(value).collect::<Result<Vec<_>, _>>()?;
    for i in 0..tree.objects.len() {
        for child in std::mem::take(&mut tree.objects[i].children) {
            let target = match &child.target {
                Target::Object(target) => Some(*target),
                Target::Reference(id) => tree.ids.get(id).copied(),
            };
            let object = &mut tree.objects[i];
            match target.and_then(|target| values[target].clone()) {
                None => object.children.push(child),
                // Written for those who refer to it.
                Some(_) if i == 0 => {}
                Some(_) if child.name.is_empty() => {
                    let message = "the attribute name=\"…\" is missing, which says what it is for";
                    return Err(error(&child.at, message));
                }
                Some(value) => object.add_parameter(child.name, value, child.at)?,
            }
        }
    }
    Ok(())
}

/// What an object `<spectrum type="…">` describes.
fn of_object(tree: &Tree, object: &Object) -> Result<Value, LoadError> {
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    let value = match object.kind.as_str() {
        "blackbody" => {
            required(&mut parameters, "temperature")?;
            let kelvin = parameters.positive("temperature", 1.0)?;
            Value::Spectrum(Spectrum::black_body(kelvin))
        }
        // Daylight is white, and so is what reflects equally at all wavelengths.
        "d65" => {
            let scale = parameters.float("scale")?.unwrap_or(1.0);
            let color = parameters.color("color", Role::Emission, 1.0)?;
            Value::Rgb(color.map(|c| f64::from(c) * scale))
        }
        "irregular" => {
            let wavelengths = list(&mut parameters, "wavelengths")?;
            let values = list(&mut parameters, "values")?;
            if wavelengths.len() != values.len() {
                let message = format!(
                    "{} values are given for {} wavelengths",
                    values.len(),
                    wavelengths.len()
                );
                return Err(parameters.refuse("values", message));
            }
            sampled(&parameters, wavelengths.into_iter().zip(values))?
        }
        "regular" => {
            required(&mut parameters, "wavelength_min")?;
            required(&mut parameters, "wavelength_max")?;
            let shortest = parameters.positive("wavelength_min", 1.0)?;
            let longest = parameters.positive("wavelength_max", 1.0)?;
            let values = list(&mut parameters, "values")?;
            let step = (longest - shortest) / values.len().saturating_sub(1).max(1) as f64;
            let wavelengths = (0..values.len()).map(|i| shortest + step * i as f64);
            sampled(&parameters, wavelengths.zip(values.iter().copied()))?
        }
        "srgb" => Value::Rgb(parameters.color("color", Role::Emission, 1.0)?.map(f64::from)),
        "uniform" => Value::Rgb([parameters.float("value")?.unwrap_or(1.0); 3]),
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    Ok(value)
}

/// Refuses an object without a parameter.
fn required(parameters: &mut Parameters<'_>, name: &'static str) -> Result<(), LoadError> {
    match parameters.find(name) {
        Some(_) => Ok(()),
        None => Err(parameters.refuse(name, format!("{} is missing", quote(name)))),
    }
}

/// Numbers in a string, which has to be there.
fn list(parameters: &mut Parameters<'_>, name: &'static str) -> Result<Vec<f64>, LoadError> {
    required(parameters, name)?;
    let text = parameters.text(name)?.unwrap_or_default();
    value::numbers(text).map_err(|message| parameters.refuse(name, message))
}

/// A spectrum of samples that `values` gives.
fn sampled(
    parameters: &Parameters<'_>,
    samples: impl Iterator<Item = (f64, f64)>,
) -> Result<Value, LoadError> {
    let samples: Vec<_> = samples.collect();
    let spectrum = Spectrum::sampled(&samples);
    spectrum.map(Value::Spectrum).map_err(|message| parameters.refuse("values", message))
}
