//! Which set of texture coordinates of a mesh a material lies on.

use super::geometry::Sets;
use super::material::bindings;
use super::reader::{Reader, child, children};
use super::source::whole_number;
use crate::LoadError;
use crate::format::xml::Node;

/// The set for each symbol of a material, where an instance of a geometry binds one: an effect
/// names coordinates (`<texture texcoord="…">`), to which a `<bind_vertex_input>` gives the number
/// of a set. [COLLADA 1.5.0, reference of `<bind_vertex_input>`]
pub(super) fn sets<'a>(reader: &mut Reader<'a>, instance: Node<'a>) -> Result<Sets<'a>, LoadError> {
    let mut sets = Sets::new();
    for binding in bindings(instance) {
        let Some(symbol) = binding.attribute("symbol") else { continue };
        if let Some(set) = set(reader, binding)? {
            sets.entry(symbol).or_insert(set);
        }
    }
    Ok(sets)
}

/// The set that a material is bound to: that of its first texture that has one, with a warning
/// where those of others differ.
fn set<'a>(reader: &mut Reader<'a>, binding: Node<'a>) -> Result<Option<usize>, LoadError> {
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
            let message = "textures of one material on different sets of texture coordinates are not supported; all lie \
                           on that of the first one";
            reader.warn(*bind, message);
            break;
        }
        chosen = chosen.or(set);
    }
    Ok(chosen)
}

/// The coordinates that the textures of a bound material name: of its colour first.
fn names<'a>(reader: &Reader<'a>, binding: Node<'a>) -> Vec<&'a str> {
    let look_up = |node: Node<'a>, attribute: &str, tag| {
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
