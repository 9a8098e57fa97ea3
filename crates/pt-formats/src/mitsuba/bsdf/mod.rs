//! `<bsdf>`: surface scattering.

mod hair;
mod inputs;
mod measured;
mod principled;
mod refraction;
mod wrappers;

use inputs::Inputs;
use pt_scene::Surface;
use pt_scene::material::{
    CoatedDiffuse, Conductor, Diffuse, Distribution, FresnelPlastic, Glass, Masking,
    RoughCoatedDiffuse, RoughDiffuse, Roughness, ThinGlass,
};
use pt_scene::metals::{METALS, Metal};
use pt_scene::texture::Scalar;
use refraction::relative_index;

use super::object::{ColorRole, MitsubaObject, unsupported};
use super::texture::MitsubaTextureCache;
use crate::LoadError;
use crate::shared::names::quote;

const KINDS: [&str; 23] = [
    "diffuse",
    "roughdiffuse",
    "conductor",
    "roughconductor",
    "dielectric",
    "roughdielectric",
    "thindielectric",
    "plastic",
    "roughplastic",
    "pplastic",
    "principled",
    "principledthin",
    "hair",
    "measured",
    "twosided",
    "blendbsdf",
    "normalmap",
    "bumpmap",
    "polarizer",
    "retarder",
    "circular",
    "mask (outermost)",
    "null (outermost)",
];

/// A surface and its opacity.
pub(super) struct Scattering {
    pub(super) surface: Surface,
    pub(super) opacity: Scalar,
}

/// Reads a bsdf, with its opacity.
pub(super) fn scattering(
    textures: &mut MitsubaTextureCache<'_>,
    object: &MitsubaObject,
) -> Result<Scattering, LoadError> {
    match object.kind.as_str() {
        "mask" => wrappers::mask(textures, object),
        "null" => wrappers::null(textures, object),
        _ => Ok(Scattering { surface: surface(textures, object)?, opacity: 1.0.into() }),
    }
}

/// Reads the surface of a bsdf.
fn surface(
    textures: &mut MitsubaTextureCache<'_>,
    object: &MitsubaObject,
) -> Result<Surface, LoadError> {
    let mut inputs = Inputs::new(textures, object);
    let surface = match object.kind.as_str() {
        "diffuse" => {
            let reflectance = inputs.color("reflectance", 0.5)?;
            Diffuse { reflectance, two_sided: false }.into()
        }
        "roughdiffuse" => RoughDiffuse {
            reflectance: inputs.color("reflectance", 0.5)?,
            roughness: inputs.share("roughness", 0.5)?,
            two_sided: false,
        }
        .into(),
        "conductor" => conductor(&mut inputs, None)?.into(),
        "roughconductor" => {
            let roughness = Some(roughness(&mut inputs)?);
            conductor(&mut inputs, roughness)?.into()
        }
        "dielectric" => glass(&mut inputs, None)?.into(),
        "roughdielectric" => {
            let roughness = Some(roughness(&mut inputs)?);
            glass(&mut inputs, roughness)?.into()
        }
        "thindielectric" => {
            let Glass { reflectance, transmittance, ior, .. } = glass(&mut inputs, None)?;
            ThinGlass { reflectance, transmittance, ior }.into()
        }
        "plastic" => plastic(&mut inputs)?.into(),
        "roughplastic" => rough_plastic(&mut inputs)?.into(),
        "pplastic" => unpolarized_plastic(&mut inputs)?.into(),
        "principled" => principled::principled(&mut inputs)?.into(),
        "principledthin" => principled::principled_thin(&mut inputs)?.into(),
        "hair" => hair::hair(&mut inputs)?.into(),
        "measured" => measured::measured(&mut inputs)?,
        "twosided" => wrappers::two_sided(&mut inputs)?,
        "blendbsdf" => wrappers::blend(&mut inputs)?,
        "normalmap" => wrappers::normal_map(&mut inputs)?,
        "bumpmap" => wrappers::bump_map(&mut inputs)?,
        "polarizer" => filter(&mut inputs, &["theta", "polarizing"], 0.5)?,
        "circular" => filter(&mut inputs, &["left_handed"], 0.5)?,
        "retarder" => filter(&mut inputs, &["theta", "delta"], 1.0)?,
        _ => return Err(unsupported(object, &KINDS)),
    };
    inputs.finish()?;
    Ok(surface)
}

/// Reads a metal by name, or by η and k; the default is a perfect mirror.
fn conductor(
    inputs: &mut Inputs<'_, '_>,
    roughness: Option<Roughness>,
) -> Result<Conductor, LoadError> {
    let parameters = &mut inputs.parameters;
    let name = parameters.text("material")?;
    let Some(metal) = named_metal(name) else {
        let names: Vec<_> = METALS.iter().map(|metal| metal.name).collect();
        let message = format!(
            "unknown metal {}; give eta and k as <rgb>, the material \"none\" for a perfect \
             mirror, or one of {}",
            quote(name.unwrap_or_default()),
            names.join(", ")
        );
        return Err(parameters.refuse("material", message));
    };
    let (eta, k) = (
        parameters.given_color("eta", ColorRole::Index)?,
        parameters.given_color("k", ColorRole::Index)?,
    );
    if name.is_some() && (eta.is_some() || k.is_some()) {
        let message = "found a material and eta or k, expected one of the two";
        return Err(parameters.refuse("material", message));
    }
    Ok(Conductor {
        eta: eta.unwrap_or(metal.eta),
        k: k.unwrap_or(metal.k),
        reflectance: inputs.color("specular_reflectance", 1.0)?,
        roughness,
        two_sided: false,
    })
}

/// A metal that reflects all light.
const PERFECT: Metal = Metal { name: "none", eta: [0.0; 3], k: [1.0; 3], palik: false };

/// Returns the metal with a name; [`PERFECT`] without one.
fn named_metal(name: Option<&str>) -> Option<Metal> {
    match name {
        None | Some("none") => Some(PERFECT),
        Some(name) => Metal::named(name),
    }
}

/// Reads a dielectric.
fn glass(inputs: &mut Inputs<'_, '_>, roughness: Option<Roughness>) -> Result<Glass, LoadError> {
    Ok(Glass {
        reflectance: inputs.color("specular_reflectance", 1.0)?,
        transmittance: inputs.color("specular_transmittance", 1.0)?,
        ior: relative_index(&mut inputs.parameters, "bk7")?,
        roughness,
    })
}

/// Reads a polarization filter as a straight transmission by a fraction. Without polarization, its
/// rotation has no effect.
fn filter(
    inputs: &mut Inputs<'_, '_>,
    of_polarization: &[&'static str],
    share: f32,
) -> Result<Surface, LoadError> {
    inputs.parameters.pass_over(of_polarization);
    let transmittance = inputs.color("transmittance", 1.0)?.times(&share.into());
    Ok(ThinGlass { reflectance: [1.0; 3].into(), transmittance, ior: 1.0 }.into())
}

/// Reads a diffuse base under a smooth coat.
fn plastic(inputs: &mut Inputs<'_, '_>) -> Result<CoatedDiffuse, LoadError> {
    Ok(CoatedDiffuse {
        diffuse: inputs.color("diffuse_reflectance", 0.5)?,
        specular: inputs.color("specular_reflectance", 1.0)?,
        ior: relative_index(&mut inputs.parameters, "polypropylene")?,
        nonlinear: inputs.parameters.boolean("nonlinear")?,
        two_sided: false,
    })
}

/// Reads a diffuse base under a rough coat, whose roughness is constant and isotropic.
fn rough_plastic(inputs: &mut Inputs<'_, '_>) -> Result<RoughCoatedDiffuse, LoadError> {
    let CoatedDiffuse { diffuse, specular, ior, nonlinear, two_sided } = plastic(inputs)?;
    if ior <= 1.0 {
        let message = format!(
            "found a relative index of refraction of {ior} of the coat, expected int_ior greater \
             than ext_ior"
        );
        return Err(inputs.parameters.refuse("int_ior", message));
    }
    let distribution = distribution(inputs)?;
    let alpha = inputs.parameters.positive("alpha", 0.1)? as f32;
    Ok(RoughCoatedDiffuse { diffuse, specular, ior, alpha, distribution, nonlinear, two_sided })
}

/// Reads a "pplastic", without its polarization.
fn unpolarized_plastic(inputs: &mut Inputs<'_, '_>) -> Result<FresnelPlastic, LoadError> {
    Ok(FresnelPlastic {
        diffuse: inputs.color("diffuse_reflectance", 0.5)?,
        specular: inputs.color("specular_reflectance", 1.0)?,
        ior: relative_index(&mut inputs.parameters, "polypropylene")?,
        roughness: roughness(inputs)?,
        two_sided: false,
    })
}

/// Reads the microfacet distribution.
fn distribution(inputs: &mut Inputs<'_, '_>) -> Result<Distribution, LoadError> {
    let parameters = &mut inputs.parameters;
    parameters.pass_over(&["sample_visible"]);
    match parameters.text("distribution")? {
        None | Some("beckmann") => Ok(Distribution::Beckmann),
        Some("ggx") => Ok(Distribution::Ggx),
        Some(other) => {
            let message =
                format!("unknown distribution {}; expected beckmann or ggx", quote(other));
            Err(parameters.refuse("distribution", message))
        }
    }
}

/// Reads the roughness; `alpha` is the default of `alpha_u` and `alpha_v`.
fn roughness(inputs: &mut Inputs<'_, '_>) -> Result<Roughness, LoadError> {
    let distribution = distribution(inputs)?;
    let alpha = inputs.alpha("alpha", &0.1.into())?;
    let alpha = [inputs.alpha("alpha_u", &alpha)?, inputs.alpha("alpha_v", &alpha)?];
    Ok(Roughness { alpha, distribution, masking: Masking::Separable, multiple_scattering: false })
}
