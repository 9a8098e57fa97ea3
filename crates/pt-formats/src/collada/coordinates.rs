//! Choice of the set of texture coordinates of a material.

use super::material::bindings;
use super::reader::{ColladaReader, child, children};
use super::shape::Sets;
use super::source::whole_number;
use crate::LoadError;
use crate::shared::xml::XmlNode;

/// Returns the set for each symbol of a material that an instance of a geometry binds: an effect
/// names coordinates (`<texture texcoord="…">`), to which a `<bind_vertex_input>` assigns the
/// number of a set. [COLLADA 1.5.0, reference of `<bind_vertex_input>`]
pub(super) fn sets<'a>(
    reader: &mut ColladaReader<'a>,
    instance: XmlNode<'a>,
) -> Result<Sets<'a>, LoadError> {
    let mut sets = Sets::new();
    for binding in bindings(instance) {
        let Some(symbol) = binding.attribute("symbol") else { continue };
        if let Some(set) = set(reader, binding)? {
            sets.entry(symbol).or_insert(set);
        }
    }
    Ok(sets)
}

/// Returns the set to which a material is bound: that of its first texture that has one, with a
/// warning if other textures have different ones.
fn set<'a>(
    reader: &mut ColladaReader<'a>,
    binding: XmlNode<'a>,
) -> Result<Option<usize>, LoadError> {
    let bound: Vec<_> = children(binding, "bind_vertex_input")
        .filter(|bind| matches!(bind.attribute("input_semantic"), None | Some("TEXCOORD")))
        .collect();
    if bound.is_empty() {
        return Ok(None);
    }
    let mut chosen = None;
    for name in names(reader, binding) {
        let Some(bind) = bound.iter().find(|bind| bind.attribute("semantic") == Some(name)) else {
            continue;
        };
        let set = whole_number(reader, *bind, "input_set")?;
        if chosen.is_some() && set.is_some() && set != chosen {
            let message = "textures of one material on different sets of texture coordinates are \
                           not supported; the set of the first one is used for all";
            reader.warn(*bind, message);
            break;
        }
        chosen = chosen.or(set);
    }
    Ok(chosen)
}

/// Returns the names of the coordinates of the textures of a bound material, those of its colour
/// first.
fn names<'a>(reader: &ColladaReader<'a>, binding: XmlNode<'a>) -> Vec<&'a str> {
    let look_up = |node: XmlNode<'a>, attribute: &str, tag| {
        reader.look_up(node.attribute(attribute).unwrap_or_default(), &[tag])
    };
    let effect = look_up(binding, "target", "material")
        .and_then(|material| child(material, "instance_effect"))
        .and_then(|instance| look_up(instance, "url", "effect"));
    let Some(effect) = effect else { return Vec::new() };
    let textures = ["diffuse", "emission", "specular"].into_iter().flat_map(|tag| {
        let shown = effect.descendants().filter(move |n| n.tag_name().name() == tag);
        shown.filter_map(|n| child(n, "texture"))
    });
    textures.filter_map(|texture| texture.attribute("texcoord")).collect()
}
