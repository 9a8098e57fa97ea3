//! Materials: which slot has which, and those of the course's profile.

use std::collections::HashMap;

use super::effect;
use super::reader::{Reader, child, children, elements, is_course_technique, name_of};
use crate::format::placeholder;
use crate::format::xml::{Node, quote};
use crate::material::{Black, Conductor, Diffuse, Glass, Mirror, Refraction, Roughness};
use crate::{LoadError, Material, Surface};

/// The materials, by index, that an instance of a geometry gives to the slots with the given
/// symbols.
///
/// A primitive without a symbol, and a sphere, take the first material of the instance. Where a
/// symbol is bound to nothing, the material with the symbol as its id stands in.
pub(super) fn bind<'a>(
    reader: &mut Reader<'a>,
    instance: Node<'a>,
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
                reader
                    .context
                    .forgive(found, "the default material (grey, 0.5) is taken")?
                    .flatten()
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

/// The materials that an instance of a geometry binds.
pub(super) fn bindings(instance: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    children(instance, "bind_material")
        .filter_map(|bind| child(bind, "technique_common"))
        .flat_map(|technique| children(technique, "instance_material"))
}

/// What stands in for a material that is not bound.
fn unbound<'a>(reader: &mut Reader<'a>, instance: Node<'a>, symbol: &str) -> Option<Node<'a>> {
    let namesake = reader.find(symbol, &["material"]);
    let stand_in = if namesake.is_some() {
        "the material with this id is taken"
    } else {
        "the default material (grey, 0.5) is taken"
    };
    let message = format!(
        "no <instance_material> binds the material symbol {} of its mesh; {stand_in}",
        quote(symbol)
    );
    reader.warn(instance, message);
    namesake
}

/// The index of a material, which is read when it is first used; `None` if its effect is in
/// another file.
fn read<'a>(reader: &mut Reader<'a>, material: Node<'a>) -> Result<Option<u32>, LoadError> {
    if let Some(index) = reader.materials.get(&material.id()) {
        return Ok(Some(*index));
    }
    let Some(instance) = child(material, "instance_effect") else {
        return Err(reader.error(material, "it has no <instance_effect url=\"#…\">"));
    };
    let Some(effect) = reader.resolve(instance, "url", &["effect"])? else { return Ok(None) };
    reader.context.take_placeholder_used();
    let (mut surface, emission) = match course_material(reader, effect)? {
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

/// The material that an effect has in the course's profile, the last one if there are several,
/// with its emission.
fn course_material<'a>(
    reader: &mut Reader<'a>,
    effect: Node<'a>,
) -> Result<Option<(Surface, [f32; 3])>, LoadError> {
    let techniques = effect.descendants().filter(|n| is_course_technique(*n));
    let mut found = None;
    for technique in techniques {
        for element in elements(technique) {
            if let Some(material) = course_surface(reader, element)? {
                found = Some(material);
            } else {
                let message = "this material is unknown; expected <diffuse>, <emission>, \
                               <mirror>, <glass>, <refraction> or <microfacet>; it is left out";
                reader.warn(element, message);
            }
        }
    }
    Ok(found)
}

/// What one element of the course's profile describes.
fn course_surface<'a>(
    reader: &mut Reader<'a>,
    element: Node<'a>,
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

/// A child element, without which its parent means nothing.
fn required<'a>(
    reader: &Reader<'a>,
    parent: Node<'a>,
    tag: &str,
    example: &str,
) -> Result<Node<'a>, LoadError> {
    child(parent, tag).ok_or_else(|| {
        let message = format!("it has no <{tag}>; expected, for example, <{tag}>{example}</{tag}>");
        reader.error(parent, message)
    })
}

/// A share of light; 1, with a warning, where it is missing.
fn tint<'a>(reader: &mut Reader<'a>, parent: Node<'a>, tag: &str) -> Result<[f32; 3], LoadError> {
    if let Some(element) = child(parent, tag) {
        let color = reader.rgb(element)?;
        return Ok(clamped(reader, element, color));
    }
    reader.warn(parent, format!("it has no <{tag}>; 1 1 1 is taken"));
    Ok([1.0; 3])
}

/// A share of light, at most 1.
pub(super) fn clamped<'a>(reader: &mut Reader<'a>, element: Node<'a>, color: [f32; 3]) -> [f32; 3] {
    if color.iter().any(|c| *c > 1.0) {
        let message = "it would reflect more light than arrives; components above 1 become 1";
        reader.warn(element, message);
    }
    color.map(|c| c.min(1.0))
}

/// A number above 0.
fn positive<'a>(
    reader: &Reader<'a>,
    parent: Node<'a>,
    tag: &str,
    example: &str,
) -> Result<f32, LoadError> {
    let element = required(reader, parent, tag, example)?;
    match reader.scalar(element)? as f32 {
        number if number > 0.0 && number.is_finite() => Ok(number),
        bad => Err(reader.error(element, format!("expected a number above 0, found {bad}"))),
    }
}
