//! Displayed values.

/// Displayed value of a radiance, in [0, 1], where `white` is displayed as 1.
pub(super) fn displayed(light: f64, white: f64) -> f64 {
    (light / white).clamp(0.0, 1.0)
}
