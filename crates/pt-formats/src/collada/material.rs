//! Materials: assignment to slots, and materials of the profile `CGL`.

use std::collections::HashMap;

use pt_scene::material::{Black, Conductor, Diffuse, Glass, Mirror, Refraction, Roughness};
use pt_scene::{Material, Surface};

use super::effect;
use super::reader::{ColladaReader, child, children, elements, is_cgl_technique, name_of};
use crate::LoadError;
use crate::collada::effect::clamped;
use crate::shared::names::quote;
use crate::shared::placeholder;
use crate::shared::xml::XmlNode;

/// Returns the materials, by index, that an instance of a geometry assigns to the slots with these
/// symbols.
///
/// A primitive without a symbol, and a sphere, take the first material of the instance. A symbol
/// without a binding takes the material whose id is the symbol.
pub(super) fn bind<'a>(
    reader: &mut ColladaReader<'a>,
    instance: XmlNode<'a>,
    symbols: &[Option<&'a str>],
) -> Result<Vec<Option<u32>>, LoadError> {
    let bound: Vec<_> = bindings(instance).collect();
    let mut by_symbol = HashMap::new();
    for binding in &bound {
        by_symbol.entry(binding.attribute("symbol").unwrap_or_default()).or_insert(*binding);
    }
    let mut materials = Vec::with_capacity(symbols.len());
    for symbol in symbols {
        let binding = match symbol {
            None => bound.first(),
            Some(symbol) => by_symbol.get(symbol),
        };
        let material = match (binding, symbol) {
            (Some(binding), _) => {
                let found = reader.resolve(*binding, "target", &["material"]);
                reader.context.forgive(found, "the default material (grey, 0.5) is used")?.flatten()
            }
            (None, Some(symbol)) => unbound(reader, instance, symbol),
            (None, None) => None,
        };
        materials.push(match material {
            Some(material) => read(reader, material)?,
            None => None,
        });
    }
    Ok(materials)
}

/// Iterates over the materials that an instance of a geometry binds.
pub(super) fn bindings(instance: XmlNode<'_>) -> impl Iterator<Item = XmlNode<'_>> {
    children(instance, "bind_material")
        .filter_map(|bind| child(bind, "technique_common"))
        .flat_map(|technique| children(technique, "instance_material"))
}

/// Returns the replacement of a material that is not bound, with a warning.
fn unbound<'a>(
    reader: &mut ColladaReader<'a>,
    instance: XmlNode<'a>,
    symbol: &str,
) -> Option<XmlNode<'a>> {
    let namesake = reader.find(symbol, &["material"]);
    let stand_in = if namesake.is_some() {
        "the material with this id is used"
    } else {
        "the default material (grey, 0.5) is used"
    };
    let message = format!(
        "missing <instance_material> for the material symbol {} of the mesh; {stand_in}",
        quote(symbol)
    );
    reader.warn(instance, message);
    namesake
}

/// Returns the index of a material, which is read on first use; `None` if its effect is in another
/// file.
fn read<'a>(
    reader: &mut ColladaReader<'a>,
    material: XmlNode<'a>,
) -> Result<Option<u32>, LoadError> {
    if let Some(index) = reader.materials.get(&material.id()) {
        return Ok(Some(*index));
    }
    let Some(instance) = child(material, "instance_effect") else {
        return Err(reader.error(material, "missing <instance_effect url=\"#…\">"));
    };
    let Some(effect) = reader.resolve(instance, "url", &["effect"])? else { return Ok(None) };
    reader.context.take_placeholder_used();
    let (mut surface, emission) = match cgl_material(reader, effect)? {
        Some((surface, emission)) => (surface, emission.into()),
        None => effect::read(reader, effect, instance)?,
    };
    if reader.context.take_placeholder_used() {
        surface = placeholder::surface();
    }
    let index = reader.scene.materials.len() as u32;
    reader.scene.materials.push(Material {
        name: name_of(material),
        surface,
        emission,
        hidden_emission: false,
        opacity: 1.0.into(),
    });
    reader.materials.insert(material.id(), index);
    Ok(Some(index))
}

/// Returns the material of an effect in the profile `CGL`, with its emission; the last one if
/// there are several.
fn cgl_material<'a>(
    reader: &mut ColladaReader<'a>,
    effect: XmlNode<'a>,
) -> Result<Option<(Surface, [f32; 3])>, LoadError> {
    let techniques = effect.descendants().filter(|n| is_cgl_technique(*n));
    let mut found = None;
    for technique in techniques {
        for element in elements(technique) {
            if let Some(material) = cgl_surface(reader, element)? {
                found = Some(material);
            } else {
                let message = "unknown material; expected <diffuse>, <emission>, <mirror>, \
                               <glass>, <refraction> or <microfacet>; it is omitted";
                reader.warn(element, message);
            }
        }
    }
    Ok(found)
}

/// Reads the surface and emission of one element of the profile `CGL`.
fn cgl_surface<'a>(
    reader: &mut ColladaReader<'a>,
    element: XmlNode<'a>,
) -> Result<Option<(Surface, [f32; 3])>, LoadError> {
    let surface = match element.tag_name().name() {
        "emission" => {
            let radiance = required(reader, element, "radiance", "10 10 10")?;
            return Ok(Some((Black.into(), reader.rgb(radiance)?)));
        }
        "diffuse" => {
            let names = ["reflectance", "albedo", "color"];
            let tag = names.into_iter().find(|tag| child(element, tag).is_some());
            let reflectance = tint(reader, element, tag.unwrap_or(names[0]))?;
            Diffuse { reflectance: reflectance.into(), two_sided: true }.into()
        }
        "mirror" => Mirror { reflectance: tint(reader, element, "reflectance")?.into() }.into(),
        "glass" => Glass {
            reflectance: tint(reader, element, "reflectance")?.into(),
            transmittance: tint(reader, element, "transmittance")?.into(),
            ior: positive(reader, element, "ior", "1.5")?,
            roughness: None,
        }
        .into(),
        "refraction" => Refraction {
            transmittance: tint(reader, element, "transmittance")?.into(),
            ior: positive(reader, element, "ior", "1.5")?,
        }
        .into(),
        "microfacet" => {
            let eta = required(reader, element, "eta", "0.2 0.9 1.1")?;
            let k = required(reader, element, "k", "3.9 2.4 2.2")?;
            Conductor {
                eta: reader.rgb(eta)?,
                k: reader.rgb(k)?,
                reflectance: [1.0; 3].into(),
                roughness: Some(Roughness::beckmann(positive(reader, element, "alpha", "0.1")?)),
                two_sided: true,
            }
            .into()
        }
        _ => return Ok(None),
    };
    Ok(Some((surface, [0.0; 3])))
}

/// Returns a required child element.
fn required<'a>(
    reader: &ColladaReader<'a>,
    parent: XmlNode<'a>,
    tag: &str,
    example: &str,
) -> Result<XmlNode<'a>, LoadError> {
    child(parent, tag).ok_or_else(|| {
        let message = format!("missing <{tag}>; expected, for example, <{tag}>{example}</{tag}>");
        reader.error(parent, message)
    })
}

/// Reads a reflectance or transmittance; 1, with a warning, if it is missing.
fn tint<'a>(
    reader: &mut ColladaReader<'a>,
    parent: XmlNode<'a>,
    tag: &str,
) -> Result<[f32; 3], LoadError> {
    if let Some(element) = child(parent, tag) {
        let color = reader.rgb(element)?;
        return Ok(clamped(reader, element, color));
    }
    reader.warn(parent, format!("missing <{tag}>; 1 1 1 is used"));
    Ok([1.0; 3])
}

/// Reads a number above 0.
fn positive<'a>(
    reader: &ColladaReader<'a>,
    parent: XmlNode<'a>,
    tag: &str,
    example: &str,
) -> Result<f32, LoadError> {
    let element = required(reader, parent, tag, example)?;
    match reader.scalar(element)? as f32 {
        number if number > 0.0 && number.is_finite() => Ok(number),
        bad => Err(reader.error(element, format!("expected a number above 0, found {bad}"))),
    }
}
