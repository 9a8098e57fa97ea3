//! Mesh values that patterns use: colours, and named values.

use pt_scene::texture::Pattern;
use pt_scene::{Mesh, Shared};

/// Values at corners, and their indices unless they are those of the positions.
type OfVertices<'m> = (&'m [[f32; 3]], Option<&'m [[u32; 3]]>);

/// Values at corners that a pattern uses; `None` if the mesh has none.
pub(super) fn values_of_vertices<'m>(mesh: &'m Mesh, pattern: &Pattern) -> Option<OfVertices<'m>> {
    match pattern {
        Pattern::VertexColors => {
            let colors = mesh.colors.as_ref()?;
            Some((&colors.values, colors.indices.as_deref()))
        }
        Pattern::VertexAttribute(name) => Some((mesh.attributes.vertices.get(name)?, None)),
        _ => None,
    }
}

/// Values of triangles that a pattern uses; `None` if the mesh has none.
pub(super) fn values_of_faces<'m>(mesh: &'m Mesh, pattern: &Pattern) -> Option<&'m [[f32; 3]]> {
    match pattern {
        Pattern::FaceColors => mesh.face_colors.as_deref(),
        Pattern::FaceAttribute(name) => mesh.attributes.faces.get(name).map(Shared::as_slice),
        _ => None,
    }
}

/// Message about a mesh without the values that a pattern uses.
pub(super) fn missing_values(pattern: &Pattern) -> String {
    let what = match pattern {
        Pattern::VertexAttribute(name) => format!("values {name:?} of vertices"),
        Pattern::FaceAttribute(name) => format!("values {name:?} of faces"),
        Pattern::FaceColors => "colours of faces".to_owned(),
        _ => "colours of vertices".to_owned(),
    };
    let kind = match pattern {
        Pattern::VertexAttribute(_) | Pattern::FaceAttribute(_) => "values",
        _ => "colours",
    };
    format!(
        "found a material with {what} on a mesh without them, expected a file with such {kind}, or \
         another material"
    )
}
