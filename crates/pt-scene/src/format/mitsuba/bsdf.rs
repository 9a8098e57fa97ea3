//! `<bsdf>`: how surfaces scatter.

use super::super::xml::quote;
use super::object::{Object, Parameters, Role, Tree, error, unsupported};
use super::value::Value;
use crate::material::{
    CoatedDiffuse, Conductor, Distribution, Glass, Masking, Matte, Mirror, Roughness, ThinGlass,
};
use crate::metals::{METALS, Metal};
use crate::{LoadError, Surface};

const KINDS: [&str; 8] = [
    "diffuse",
    "conductor",
    "roughconductor",
    "dielectric",
    "roughdielectric",
    "thindielectric",
    "plastic",
    "twosided",
];

/// Indices of refraction at 589 nm by the names that Mitsuba gives them. [Hecht, "Optics",
/// 4th ed., as tabulated in Mitsuba 3.9]
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

/// The surface that an object describes.
pub(super) fn surface(tree: &Tree, object: &Object) -> Result<Surface, LoadError> {
    if object.kind == "twosided" {
        return two_sided(tree, object);
    }
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    let surface = match object.kind.as_str() {
        "diffuse" => {
            let reflectance = parameters.color("reflectance", Role::Share, 0.5)?;
            Matte { reflectance, two_sided: false }.into()
        }
        "conductor" => conductor(&mut parameters, None)?.into(),
        "roughconductor" => {
            let roughness = Some(roughness(&mut parameters)?);
            conductor(&mut parameters, roughness)?.into()
        }
        "dielectric" => glass(&mut parameters, None)?.into(),
        "roughdielectric" => {
            let roughness = Some(roughness(&mut parameters)?);
            glass(&mut parameters, roughness)?.into()
        }
        "thindielectric" => {
            let Glass { reflectance, transmittance, ior, .. } = glass(&mut parameters, None)?;
            ThinGlass { reflectance, transmittance, ior }.into()
        }
        "plastic" => plastic(&mut parameters)?.into(),
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    Ok(surface)
}

/// The same surface with both sides alike.
fn two_sided(tree: &Tree, object: &Object) -> Result<Surface, LoadError> {
    Parameters::new(object).finish()?;
    let children = tree.children(object, &["bsdf"])?;
    let [child] = children.as_slice() else {
        let message = format!(
            "expected one <bsdf> for both sides, but there are {}; sides that differ are not \
             supported",
            children.len()
        );
        return Err(error(&object.at, message));
    };
    let inner = &tree.objects[*child];
    if inner.kind == "twosided" {
        return Err(error(&inner.at, "it is inside of another bsdf \"twosided\" already"));
    }
    match surface(tree, inner)? {
        Surface::Glass(_) | Surface::ThinGlass(_) => {
            let message =
                format!("{} transmits light; \"twosided\" is for opaque ones", quote(&inner.kind));
            Err(error(&inner.at, message))
        }
        opaque => Ok(on_both_sides(opaque)),
    }
}

/// A surface that reflects on its back as it does on its front.
pub(super) fn on_both_sides(surface: Surface) -> Surface {
    match surface {
        Surface::Matte(matte) => Matte { two_sided: true, ..matte }.into(),
        // Without a real part of the index of refraction, all light is reflected at every angle.
        Surface::Conductor(Conductor {
            eta: [0.0, 0.0, 0.0],
            roughness: None,
            reflectance,
            ..
        }) => Mirror { reflectance }.into(),
        Surface::Conductor(metal) => Conductor { two_sided: true, ..metal }.into(),
        Surface::CoatedDiffuse(coated) => CoatedDiffuse { two_sided: true, ..coated }.into(),
        other => other,
    }
}

/// A metal by name, or by η and k; without either, one that reflects all light.
fn conductor(
    parameters: &mut Parameters<'_>,
    roughness: Option<Roughness>,
) -> Result<Conductor, LoadError> {
    let name = parameters.text("material")?;
    let Some(metal) = name.map_or(Some(PERFECT), named_metal) else {
        let names: Vec<_> = METALS.iter().map(|metal| metal.name).collect();
        let message = format!(
            "the metal {} is unknown; give eta and k as <rgb>, the material \"none\" for a perfect \
             mirror, or one of {}",
            quote(name.unwrap_or_default()),
            names.join(", ")
        );
        return Err(parameters.refuse("material", message));
    };
    let (eta, k) =
        (parameters.given_color("eta", Role::Index)?, parameters.given_color("k", Role::Index)?);
    if name.is_some() && (eta.is_some() || k.is_some()) {
        let message = "both a material and eta or k are given; give one of the two";
        return Err(parameters.refuse("material", message));
    }
    Ok(Conductor {
        eta: eta.unwrap_or(metal.eta),
        k: k.unwrap_or(metal.k),
        reflectance: parameters.color("specular_reflectance", Role::Share, 1.0)?,
        roughness,
        two_sided: false,
    })
}

/// What reflects all light.
const PERFECT: Metal = Metal { name: "none", eta: [0.0; 3], k: [1.0; 3] };

fn named_metal(name: &str) -> Option<Metal> {
    let all = METALS.iter().chain([&PERFECT]);
    all.copied().find(|metal| metal.name == name)
}

/// A dielectric.
fn glass(
    parameters: &mut Parameters<'_>,
    roughness: Option<Roughness>,
) -> Result<Glass, LoadError> {
    Ok(Glass {
        reflectance: parameters.color("specular_reflectance", Role::Share, 1.0)?,
        transmittance: parameters.color("specular_transmittance", Role::Share, 1.0)?,
        ior: relative_index(parameters, "bk7")?,
        roughness,
    })
}

/// A diffuse base under a smooth coat.
fn plastic(parameters: &mut Parameters<'_>) -> Result<CoatedDiffuse, LoadError> {
    Ok(CoatedDiffuse {
        diffuse: parameters.color("diffuse_reflectance", Role::Share, 0.5)?,
        specular: parameters.color("specular_reflectance", Role::Share, 1.0)?,
        ior: relative_index(parameters, "polypropylene")?,
        saturates: parameters.boolean("nonlinear")?,
        two_sided: false,
    })
}

/// Microfacets of one roughness.
fn roughness(parameters: &mut Parameters<'_>) -> Result<Roughness, LoadError> {
    let distribution = match parameters.text("distribution")? {
        None | Some("beckmann") => Distribution::Beckmann,
        Some("ggx") => Distribution::Ggx,
        Some(other) => {
            let message =
                format!("the distribution {} is unknown; there are beckmann and ggx", quote(other));
            return Err(parameters.refuse("distribution", message));
        }
    };
    parameters.pass_over(&["sample_visible"]);
    let alpha = parameters.positive("alpha", 0.1)?;
    let (u, v) = (parameters.positive("alpha_u", alpha)?, parameters.positive("alpha_v", alpha)?);
    if u != v {
        let message = "roughness that depends on the direction is not supported; give one alpha";
        return Err(parameters.refuse("alpha_v", message));
    }
    Ok(Roughness { alpha: u as f32, distribution, masking: Masking::Separable })
}

/// The index of refraction of the inside, `default` if none is given, over that of the outside.
fn relative_index(parameters: &mut Parameters<'_>, default: &str) -> Result<f32, LoadError> {
    let inside = refractive_index(parameters, "int_ior", default)?;
    let outside = refractive_index(parameters, "ext_ior", "air")?;
    Ok((inside / outside) as f32)
}

/// An index of refraction, as a number or by name.
fn refractive_index(
    parameters: &mut Parameters<'_>,
    name: &'static str,
    default: &str,
) -> Result<f64, LoadError> {
    let text = match parameters.find(name).map(|p| &p.value) {
        None => default,
        Some(Value::Text(text)) => text,
        Some(_) => return parameters.positive(name, 1.0),
    };
    let lower = text.to_lowercase();
    let found = REFRACTIVE_INDICES.iter().find(|(material, _)| *material == lower);
    found.map(|(_, index)| *index).ok_or_else(|| {
        let names: Vec<_> = REFRACTIVE_INDICES.iter().map(|(material, _)| *material).collect();
        let names = names.join(", ");
        let message = format!("{} is unknown; give a number, or one of {names}", quote(text));
        parameters.refuse(name, message)
    })
}
