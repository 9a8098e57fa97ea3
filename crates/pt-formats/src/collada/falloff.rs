//! Attenuation of lights.

use pt_scene::Span;

/// Attenuation of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Attenuation {
    pub(super) constant: f64,
    pub(super) linear: f64,
    pub(super) quadratic: f64,
}

/// A light whose intensity is computed after all of the scene has been read.
pub(super) struct Attenuated {
    /// Index of the light in the scene.
    pub(super) light: usize,
    pub(super) attenuation: Attenuation,
    /// Location in the file.
    pub(super) at: Span,
}

impl Attenuation {
    /// Returns the ratio of the intensity to the colour, in units of the file.
    pub(super) fn scale(self, distance: f64) -> f64 {
        let Self { constant, linear, quadratic } = self;
        distance * distance / (constant + distance * (linear + distance * quadratic))
    }
}
