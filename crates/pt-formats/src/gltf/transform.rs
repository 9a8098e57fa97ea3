//! Transforms of nodes.

use pt_math::{DAffine3, DMat3, DQuat, DVec3};

/// Normalizes a quaternion; `None` if its length is almost 0 or not finite.
pub(super) fn quaternion(xyzw: [f64; 4]) -> Option<DQuat> {
    let rotation = DQuat::from_array(xyzw);
    let length = rotation.length();
    (length > 1e-12 && length.is_finite()).then(|| rotation.normalize())
}

/// Composes a transform that scales, then rotates, then translates.
pub(super) fn composed(moved: [f64; 3], rotation: DQuat, scale: [f64; 3]) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(scale.into(), rotation, moved.into())
}

/// Converts a column-major matrix and ignores its last row.
pub(super) fn affine(m: &[f64; 16]) -> DAffine3 {
    let column = |c: usize| DVec3::new(m[4 * c], m[4 * c + 1], m[4 * c + 2]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}
