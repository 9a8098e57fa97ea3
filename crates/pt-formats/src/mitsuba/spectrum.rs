//! Spectra in the formats of Mitsuba, which [`SpectrumColors`] converts to colours as its RGB modes
//! do.

use std::path::Path;

use super::object::{
    ChildObject, ChildTarget, ColorRole, MitsubaObject, ObjectTree, Parameters, error, unsupported,
};
use super::value::{self, ParameterValue};
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::names::quote;
use crate::shared::number::number;
use crate::shared::spectra::SpectrumColors;
use crate::shared::text;

const KINDS: [&str; 6] = ["blackbody", "d65", "irregular", "regular", "srgb", "uniform"];

impl SpectrumColors {
    /// Parses a number, or a list of `WAVELENGTH:VALUE`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        if !text.contains(':') {
            return number(text).map(Self::constant);
        }
        let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',');
        let pair = |word: &str| match word.split_once(':') {
            Some((nanometres, value)) => Ok((number(nanometres)?, number(value)?)),
            None => Err(format!("found {}, expected WAVELENGTH:VALUE", quote(word))),
        };
        let samples: Result<Vec<_>, _> = words.filter(|w| !w.is_empty()).map(pair).collect();
        Self::sampled(&samples?)
    }

    /// Reads a file with lines of `WAVELENGTH VALUE`; lines that begin with `#` are comments.
    pub(in super::super) fn read(context: &LoadContext, path: &Path) -> Result<Self, String> {
        let bytes = context.read(path)?;
        let mut samples = Vec::new();
        let text = text::characters(&bytes, path).map_err(|error| error.to_string())?;
        for (line, i) in text.lines().zip(1_u32..) {
            if line.starts_with('#') || line.trim().is_empty() {
                continue;
            }
            let message = |message: String| format!("{}:{i}: {message}", path.display());
            match value::numbers(line).map_err(message)?.as_slice() {
                [nanometres, value] => samples.push((*nanometres, *value)),
                _ => {
                    return Err(message(format!(
                        "found {}, expected WAVELENGTH VALUE",
                        quote(line)
                    )));
                }
            }
        }
        Self::sampled(&samples).map_err(|message| format!("{}: {message}", path.display()))
    }
}

/// Converts objects `<spectrum type="…">` to parameters of the objects that contain or reference
/// them.
pub(super) fn resolve(tree: &mut ObjectTree) -> Result<(), LoadError> {
    // In Mitsuba a spectrum is a texture, and may be written as one.
    let is_spectrum = |object: &&MitsubaObject| {
        object.tag == "spectrum" || object.tag == "texture" && KINDS.contains(&object.kind.as_str())
    };
    if tree.objects.iter().find(is_spectrum).is_none() {
        return Ok(());
    }
    let value = |object: &MitsubaObject| {
        if !is_spectrum(&object) {
            return Ok(None);
        }
        let whole = if object.is_broken {
            Err(LoadError::AlreadyReported)
        } else {
            of_object(tree, object)
        };
        Ok(Some(tree.context.ok_or_report(whole)?))
    };
    let values = tree.objects.iter().map(value).collect::<Result<Vec<_>, LoadError>>()?;
    for i in 0..tree.objects.len() {
        for child in std::mem::take(&mut tree.objects[i].children) {
            let target = match &child.target {
                ChildTarget::Object(target) => Some(*target),
                ChildTarget::Reference(id) => tree.ids.find(id).copied(),
            };
            let object = &mut tree.objects[i];
            match target.and_then(|target| values[target].clone()) {
                None => object.children.push(child),
                // A spectrum of the scene itself is only referenced by others.
                Some(_) if i == 0 => {}
                Some(value) => {
                    let added = add(object, child, value);
                    object.is_broken |= tree.context.ok_or_report(added)?.is_none();
                }
            }
        }
    }
    Ok(())
}

/// Adds a spectrum as a parameter of the object around it. A missing value was reported.
fn add(
    object: &mut MitsubaObject,
    child: ChildObject,
    value: Option<ParameterValue>,
) -> Result<(), LoadError> {
    if child.name.is_empty() {
        let message = "missing attribute name=\"…\", which selects the parameter";
        return Err(error(&child.at, message));
    }
    object.add_parameter(child.name, value.ok_or(LoadError::AlreadyReported)?, child.at)
}

/// Reads an object `<spectrum type="…">`.
fn of_object(tree: &ObjectTree, object: &MitsubaObject) -> Result<ParameterValue, LoadError> {
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    let value = match object.kind.as_str() {
        "blackbody" => {
            required(&mut parameters, "temperature")?;
            let kelvin = parameters.positive("temperature", 1.0)?;
            ParameterValue::Spectrum(SpectrumColors::black_body(kelvin))
        }
        // Daylight is white, and so is a constant reflectance.
        "d65" => {
            let scale = parameters.float("scale")?.unwrap_or(1.0);
            let color = parameters.color("color", ColorRole::Emission, 1.0)?;
            ParameterValue::Rgb(color.map(|c| f64::from(c) * scale))
        }
        "irregular" => {
            let wavelengths = list(&mut parameters, "wavelengths")?;
            let values = list(&mut parameters, "values")?;
            if wavelengths.len() != values.len() {
                let message = format!(
                    "found {} values for {} wavelengths, expected the same number",
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
        "srgb" => {
            ParameterValue::Rgb(parameters.color("color", ColorRole::Emission, 1.0)?.map(f64::from))
        }
        "uniform" => ParameterValue::Rgb([parameters.float("value")?.unwrap_or(1.0); 3]),
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    Ok(value)
}

/// Checks that an object has a parameter.
fn required(parameters: &mut Parameters<'_>, name: &'static str) -> Result<(), LoadError> {
    match parameters.find(name) {
        Some(_) => Ok(()),
        None => Err(parameters.refuse(name, format!("missing {}", quote(name)))),
    }
}

/// Reads the numbers of a required string parameter.
fn list(parameters: &mut Parameters<'_>, name: &'static str) -> Result<Vec<f64>, LoadError> {
    required(parameters, name)?;
    let text = parameters.text(name)?.unwrap_or_default();
    value::numbers(text).map_err(|message| parameters.refuse(name, message))
}

/// Creates a spectrum from samples of the parameter `values`.
fn sampled(
    parameters: &Parameters<'_>,
    samples: impl Iterator<Item = (f64, f64)>,
) -> Result<ParameterValue, LoadError> {
    let samples: Vec<_> = samples.collect();
    let spectrum = SpectrumColors::sampled(&samples);
    spectrum.map(ParameterValue::Spectrum).map_err(|message| parameters.refuse("values", message))
}
