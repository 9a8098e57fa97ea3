//! Colours: `rgb`, `blackbody` and `spectrum`, by their use.

use pt_math::color::luminance;

use super::color_space::light_of;
use super::entity::Entity;
use super::named_spectra::{self, NamedSpectrum};
use super::parameter::{ParameterValues, ParsedParameter};
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::spectra::SpectrumColors;

/// Meaning and range of a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SpectrumType {
    /// A reflectance or transmittance, in [0, 1].
    Share,
    /// Emitted light, non-negative. Spectra other than `rgb` are scaled to luminance 1.
    Light,
    /// Non-negative: an index of refraction, or a coefficient per unit of length.
    Unbounded,
}

/// Reads a colour, in linear Rec. 709; `None` if it is not specified. `folder` contains spectrum
/// files.
pub(super) fn color(
    entity: &Entity,
    name: &'static str,
    role: SpectrumType,
    folder: &Folder,
) -> Result<Option<[f32; 3]>, LoadError> {
    let Some(parameter) = entity.spectrum(name)? else { return Ok(None) };
    let refuse = |message: String| parameter.at.error(message);
    let color = match (parameter.kind, &parameter.values) {
        ("rgb", ParameterValues::Numbers(numbers)) => {
            let rgb: [f64; 3] = numbers.as_slice().try_into().map_err(|_| {
                refuse(format!("expected three numbers of an rgb, found {}", numbers.len()))
            })?;
            let range =
                if role == SpectrumType::Share { 0.0..=1.0 } else { 0.0..=f64::from(f32::MAX) };
            if let Some(bad) = rgb.iter().find(|c| !range.contains(c)) {
                let expected =
                    if role == SpectrumType::Share { "from 0 to 1" } else { "of at least 0" };
                return Err(refuse(format!(
                    "found a channel of {bad} in \"{name}\", expected numbers {expected}"
                )));
            }
            let color = entity.color_space.to_rec709(rgb);
            if role == SpectrumType::Share { color.map(|c| c.min(1.0)) } else { color }
        }
        ("blackbody", ParameterValues::Numbers(numbers)) if role == SpectrumType::Light => {
            match numbers.as_slice() {
                [kelvin] if *kelvin > 0.0 => {
                    normalized(SpectrumColors::black_body(*kelvin).emitted)
                }
                _ => return Err(refuse("expected one temperature above 0, in kelvins".to_owned())),
            }
        }
        ("blackbody", _) => {
            return Err(refuse(
                "found a black-body temperature of a material; black bodies are supported for \
                 light only"
                    .to_owned(),
            ));
        }
        ("spectrum", ParameterValues::Numbers(numbers)) => {
            of_spectrum(&pairs(numbers).map_err(refuse)?, role)
        }
        ("spectrum", ParameterValues::Texts(texts)) if texts.len() == 1 => {
            named_or_file(&texts[0], role, folder).map_err(refuse)?
        }
        _ => {
            return Err(refuse(format!(
                "found other values for \"{name}\", expected {}",
                parameter.kind
            )));
        }
    };
    if color.iter().all(|c| c.is_finite() && *c <= f64::from(f32::MAX)) {
        return Ok(Some(color.map(|c| c as f32)));
    }
    Err(refuse(format!(
        "found a colour that is not finite for \"{name}\", expected finite numbers"
    )))
}

/// Reads an index of refraction as one number for all wavelengths; pbrt-v4 supports dispersion.
pub(super) fn index(
    entity: &Entity,
    name: &'static str,
    default: f64,
    folder: &Folder,
) -> Result<f32, LoadError> {
    let is_number = entity.find(name).is_none_or(|p| p.kind == "float");
    let index = if is_number {
        entity.positive(name, default)? as f32
    } else {
        let glass = |p: &ParsedParameter| match &p.values {
            ParameterValues::Texts(texts) => {
                texts.first().and_then(|text| named_spectra::glass(text))
            }
            _ => None,
        };
        if let Some(index) = entity.spectrum(name)?.and_then(glass) {
            index as f32
        } else {
            let color = color(entity, name, SpectrumType::Unbounded, folder)?;
            pt_math::Spectrum::from(color.unwrap_or([default as f32; 3])).luminance()
        }
    };
    if index > 0.0 {
        return Ok(index);
    }
    Err(entity.refuse(
        name,
        format!("found \"{name}\" = {index}, expected an index of refraction above 0"),
    ))
}

/// Creates a spectrum from pairs of a wavelength and a value.
fn pairs(numbers: &[f64]) -> Result<SpectrumColors, String> {
    let (pairs, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() {
        return Err(format!(
            "found {} numbers, expected pairs of wavelength and value",
            numbers.len()
        ));
    }
    let samples: Vec<_> = pairs.iter().map(|[nanometres, value]| (*nanometres, *value)).collect();
    SpectrumColors::sampled(&samples)
}

fn of_spectrum(spectrum: &SpectrumColors, role: SpectrumType) -> [f64; 3] {
    match role {
        SpectrumType::Light => normalized(spectrum.emitted),
        SpectrumType::Share => spectrum.reflected.map(|c| c.min(1.0)),
        SpectrumType::Unbounded => spectrum.reflected,
    }
}

/// Returns the colour of a named spectrum of pbrt-v4, or of a file.
fn named_or_file(text: &str, role: SpectrumType, folder: &Folder) -> Result<[f64; 3], String> {
    match (named_spectra::named(text)?, role) {
        (Some(NamedSpectrum::Illuminant(chromaticity)), SpectrumType::Light) => {
            Ok(normalized(light_of(chromaticity)))
        }
        (Some(NamedSpectrum::Illuminant(_)), _) => {
            Err(format!("found the illuminant {text:?}, expected a spectrum of a material"))
        }
        (Some(NamedSpectrum::Optical(_)), SpectrumType::Light) => {
            Err(format!("found the material spectrum {text:?}, expected an illuminant"))
        }
        (Some(NamedSpectrum::Optical(color)), _) => Ok(color.map(f64::from)),
        (None, _) => {
            Ok(of_spectrum(&SpectrumColors::read(&folder.context, &folder.join(text))?, role))
        }
    }
}

/// Scales a colour to luminance 1; black if the luminance is not positive.
fn normalized(color: [f64; 3]) -> [f64; 3] {
    let luminance = luminance(color);
    if luminance > 0.0 { color.map(|c| c / luminance) } else { [0.0; 3] }
}
