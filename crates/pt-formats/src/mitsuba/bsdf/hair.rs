//! `hair`: hair fibres.

use pt_scene::material::{Hair, Pigment};

use super::super::object::ColorRole;
use super::inputs::Inputs;
use super::refraction::relative_index;
use crate::LoadError;

/// Default concentrations of eumelanin (brown) and pheomelanin (red).
const MELANIN: [f64; 2] = [1.3, 0.2];

/// Reads a hair with constant parameters.
pub(super) fn hair(inputs: &mut Inputs<'_, '_>) -> Result<Hair, LoadError> {
    let ior = relative_index(&mut inputs.parameters, "amber")?;
    if ior < 1.0 {
        let message = format!(
            "found a relative index of refraction of {ior}, expected at least 1 (int_ior at least \
             ext_ior)"
        );
        return Err(inputs.parameters.refuse("int_ior", message));
    }
    let roughness = number(inputs, "longitudinal_roughness", 0.3, [0.0, 1.0])?;
    let azimuthal_roughness = number(inputs, "azimuthal_roughness", 0.3, [0.0, 1.0])?;
    let scale_angle = number(inputs, "scale_tilt", 2.0, [-45.0, 45.0])?;
    let pigment = pigment(inputs)?;
    Ok(Hair { pigment, ior, roughness, azimuthal_roughness, scale_angle, two_sided: false })
}

/// Reads the pigmentation of fibres: concentrations of melanin, or an absorption coefficient.
fn pigment(inputs: &mut Inputs<'_, '_>) -> Result<Pigment, LoadError> {
    const NAMES: [&str; 2] = ["eumelanin", "pheomelanin"];
    let scale = number(inputs, "scale", 1.0, [0.0, f64::from(f32::MAX)])?;
    let Some(absorption) = inputs.parameters.given_color("sigma_a", ColorRole::Extinction)? else {
        let [eumelanin, pheomelanin] =
            [0, 1].map(|i: usize| number(inputs, NAMES[i], MELANIN[i], [0.0, 1e6]));
        return Ok(Pigment::Melanin([eumelanin?, pheomelanin?]));
    };
    for name in NAMES {
        if inputs.parameters.find(name).is_some() {
            let message = "found a pigment and an absorption, expected one of them";
            return Err(inputs.parameters.refuse(name, message));
        }
    }
    let absorption = absorption.map(|sigma| sigma * scale);
    if absorption.iter().all(|sigma| (0.0..=f32::MAX).contains(sigma)) {
        return Ok(Pigment::Absorption(absorption));
    }
    let message =
        format!("found an absorption of {absorption:?}, expected finite numbers of at least 0");
    Err(inputs.parameters.refuse("sigma_a", message))
}

fn number(
    inputs: &mut Inputs<'_, '_>,
    name: &'static str,
    default: f64,
    [least, most]: [f64; 2],
) -> Result<f32, LoadError> {
    let value = inputs.parameters.float(name)?.unwrap_or(default);
    if (least..=most).contains(&value) {
        return Ok(value as f32);
    }
    let message = format!("found {name} = {value}, expected a number from {least} to {most}");
    Err(inputs.parameters.refuse(name, message))
}
