//! Checks of the indices of meshes.

use pt_scene::{Attribute, Mesh, Object};

use super::CompileError;

pub(super) fn check_indices(
    object: &Object,
    what: &'static str,
    triangles: &[[u32; 3]],
    count: usize,
) -> Result<(), CompileError> {
    match triangles.iter().flatten().find(|&&i| i as usize >= count) {
        None => Ok(()),
        Some(&index) => Err(CompileError::Index { at: object.at.clone(), what, index, count }),
    }
}

pub(super) fn check_attribute<T>(
    object: &Object,
    what: &'static str,
    mesh: &Mesh,
    attribute: &Attribute<T>,
) -> Result<(), CompileError> {
    check_values(object, what, mesh, attribute.values.len(), attribute.indices.as_deref())
}

/// Checks that each corner has one of `count` values, by `indices`, or by those of the positions if
/// `None`.
pub(super) fn check_values(
    object: &Object,
    what: &'static str,
    mesh: &Mesh,
    count: usize,
    indices: Option<&[[u32; 3]]>,
) -> Result<(), CompileError> {
    let indices = indices.unwrap_or(&mesh.triangles);
    if indices.len() != mesh.triangles.len() {
        return Err(CompileError::Value {
            at: object.at.clone(),
            message: format!(
                "found {what}s for {} triangles, expected {} triangles",
                indices.len(),
                mesh.triangles.len()
            ),
        });
    }
    check_indices(object, what, indices, count)
}
