//! Common parameters of sensors.

use pt_math::DAffine3;
use pt_scene::Geometry;

use crate::LoadError;
use crate::mitsuba::object::{MitsubaObject, Parameters};

/// A sensor, and the sensor whose film and sampler it uses.
#[derive(Clone)]
pub(super) struct Seat<'t> {
    pub(super) object: &'t MitsubaObject,
    pub(super) holder: &'t MitsubaObject,
    /// Number of sensors that share the film, side by side.
    pub(super) count: u32,
    /// Surface to which a meter is attached or at which it aims, with its transform.
    pub(super) surface: Option<(Geometry, DAffine3)>,
}

impl<'t> Seat<'t> {
    /// Creates a sensor with its own film.
    pub(super) fn alone(object: &'t MitsubaObject) -> Self {
        Self { object, holder: object, count: 1, surface: None }
    }

    /// Sets the surface.
    pub(super) fn at(self, surface: Option<(Geometry, DAffine3)>) -> Self {
        Self { surface, ..self }
    }
}

/// Reads the opening and closing time of the shutter.
pub(super) fn shutter(parameters: &mut Parameters<'_>) -> Result<[f64; 2], LoadError> {
    let open = parameters.float("shutter_open")?.unwrap_or(0.0);
    let close = parameters.float("shutter_close")?.unwrap_or(0.0);
    if open <= close {
        return Ok([open, close]);
    }
    let name =
        if parameters.find("shutter_close").is_some() { "shutter_close" } else { "shutter_open" };
    let message = format!(
        "found a shutter from {open} s to {close} s, expected a shutter_close of at least \
         shutter_open"
    );
    Err(parameters.refuse(name, message))
}
