//! Transforms of emitters without size.

use pt_math::DMat3;

use crate::LoadError;
use crate::mitsuba::object::Parameters;

/// Tolerance of matrices, which are written with few digits.
pub(super) const TOLERANCE: f64 = 1e-4;

/// Reads the transform of an emitter at infinity.
pub(super) fn turn(parameters: &mut Parameters<'_>) -> Result<DMat3, LoadError> {
    let node = parameters.transform("to_world")?.matrix3;
    turned(parameters, node, "the sky")
}

/// Checks that a transform consists of rotation and reflection, and returns it.
pub(super) fn turned(
    parameters: &Parameters<'_>,
    node: DMat3,
    what: &str,
) -> Result<DMat3, LoadError> {
    let difference = node.transpose() * node - DMat3::IDENTITY;
    if difference.to_cols_array().iter().any(|x| x.abs() > TOLERANCE) {
        let message = format!(
            "found a scale of {what}, expected a transform of rotations and reflections only"
        );
        return Err(parameters.refuse("to_world", message));
    }
    Ok(node)
}
