//! Principled (Disney) materials.

use pt_scene::material::{Principled, PrincipledThin};

use super::inputs::Inputs;
use crate::LoadError;

/// Reads a `principled`. Its index of refraction is given directly, or by the specular reflectance.
pub(super) fn principled(inputs: &mut Inputs<'_, '_>) -> Result<Principled, LoadError> {
    inputs.parameters.pass_over(&[
        "main_specular_sampling_rate",
        "clearcoat_sampling_rate",
        "diffuse_reflectance_sampling_rate",
    ]);
    Ok(Principled {
        base_color: inputs.color("base_color", 0.5)?,
        roughness: inputs.share("roughness", 0.5)?,
        anisotropic: inputs.share("anisotropic", 0.0)?,
        metallic: inputs.share("metallic", 0.0)?,
        spec_trans: inputs.share("spec_trans", 0.0)?,
        ior: index(inputs)?,
        spec_tint: inputs.share("spec_tint", 0.0)?,
        sheen: inputs.share("sheen", 0.0)?,
        sheen_tint: inputs.share("sheen_tint", 0.0)?,
        flatness: inputs.share("flatness", 0.0)?,
        clearcoat: inputs.share("clearcoat", 0.0)?,
        clearcoat_gloss: inputs.share("clearcoat_gloss", 0.0)?,
        ..Principled::default()
    })
}

/// Reads a `principledthin`: a thin sheet, equal on both sides.
pub(super) fn principled_thin(inputs: &mut Inputs<'_, '_>) -> Result<PrincipledThin, LoadError> {
    inputs.parameters.pass_over(&[
        "specular_reflectance_sampling_rate",
        "specular_transmittance_sampling_rate",
        "diffuse_reflectance_sampling_rate",
        "diffuse_transmittance_sampling_rate",
    ]);
    Ok(PrincipledThin {
        base_color: inputs.color("base_color", 0.5)?,
        roughness: inputs.share("roughness", 0.5)?,
        anisotropic: inputs.share("anisotropic", 0.0)?,
        spec_trans: inputs.share("spec_trans", 0.0)?,
        ior: inputs.parameters.positive("eta", 1.5)? as f32,
        spec_tint: inputs.share("spec_tint", 0.0)?,
        sheen: inputs.share("sheen", 0.0)?,
        sheen_tint: inputs.share("sheen_tint", 0.0)?,
        flatness: inputs.share("flatness", 0.0)?,
        diff_trans: inputs.number("diff_trans", 2.0)?,
    })
}

/// Returns `eta`, or the index whose reflectance at normal incidence is 0.08 times `specular`.
/// [Burley 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering", §4.2]
fn index(inputs: &mut Inputs<'_, '_>) -> Result<f32, LoadError> {
    let parameters = &mut inputs.parameters;
    let is_both = parameters.find("eta").is_some() && parameters.find("specular").is_some();
    if is_both {
        let message = "found eta and specular, expected one of the two";
        return Err(parameters.refuse("specular", message));
    }
    if parameters.find("eta").is_some() {
        return Ok(parameters.positive("eta", 1.5)? as f32);
    }
    let specular = parameters.float("specular")?.unwrap_or(0.5);
    if !(0.0..=1.0).contains(&specular) {
        let message = format!("found \"specular\" = {specular}, expected a number from 0 to 1");
        return Err(parameters.refuse("specular", message));
    }
    Ok((2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0) as f32)
}
