//! Indices of refraction, by number or name.

use super::super::object::Parameters;
use super::super::value::ParameterValue;
use crate::LoadError;
use crate::shared::names::quote;

/// Indices of refraction at 589 nm, by Mitsuba's names. [Hecht, "Optics", 4th ed., as tabulated in
/// Mitsuba 3.9]
const REFRACTIVE_INDICES: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// Returns the index of refraction of the interior, `default` if none is given, relative to the
/// exterior.
pub(super) fn relative_index(
    parameters: &mut Parameters<'_>,
    default: &str,
) -> Result<f32, LoadError> {
    let inside = refractive_index(parameters, "int_ior", default)?;
    let outside = refractive_index(parameters, "ext_ior", "air")?;
    Ok((inside / outside) as f32)
}

/// Reads an index of refraction by number or name.
fn refractive_index(
    parameters: &mut Parameters<'_>,
    name: &'static str,
    default: &str,
) -> Result<f64, LoadError> {
    let text = match parameters.find(name).map(|p| &p.value) {
        None => default,
        Some(ParameterValue::Text(text)) => text,
        Some(_) => return parameters.positive(name, 1.0),
    };
    let lower = text.to_lowercase();
    let found = REFRACTIVE_INDICES.iter().find(|(material, _)| *material == lower);
    found.map(|(_, index)| *index).ok_or_else(|| {
        let names: Vec<_> = REFRACTIVE_INDICES.iter().map(|(material, _)| *material).collect();
        let names = names.join(", ");
        let message = format!("unknown material {}; give a number, or one of {names}", quote(text));
        parameters.refuse(name, message)
    })
}
