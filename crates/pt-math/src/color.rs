//! Transfer functions between linear light and the values in image files.
//!
//! NaN becomes 0, and values outside of [0, 1] are clamped.

use crate::trig::powf;

/// Converts linear light to the sRGB signal, both in [0, 1]. [IEC 61966-2-1]
///
/// ```
/// assert_eq!(pt_math::color::srgb_from_linear(1.0), 1.0);
/// ```
#[inline]
pub fn srgb_from_linear(l: f32) -> f32 {
    if l <= 0.003_130_8 {
        12.92 * l.max(0.0)
    } else if l < 1.0 {
        1.055 * powf(l, 1.0 / 2.4) - 0.055
    } else {
        signal_above(l)
    }
}

/// Signal for values that are not below 1: 1, or 0 for NaN.
#[inline]
fn signal_above(l: f32) -> f32 {
    if l.is_nan() { 0.0 } else { 1.0 }
}

/// Converts the sRGB signal in [0, 1] to linear light. [IEC 61966-2-1]
#[inline]
pub fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.040_45 { v.max(0.0) / 12.92 } else { powf((v.min(1.0) + 0.055) / 1.055, 2.4) }
}

/// Converts linear light to the nearest of 256 levels of the sRGB signal.
#[inline]
pub fn encode_srgb8(l: f32) -> u8 {
    (255.0 * srgb_from_linear(l) + 0.5) as u8
}

/// Converts linear light to the nearest of 65 536 levels of the sRGB signal.
#[inline]
pub fn encode_srgb16(l: f32) -> u16 {
    (65_535.0 * srgb_from_linear(l) + 0.5) as u16
}

/// Weights of red, green and blue in the relative luminance of linear Rec. 709. [ITU-R BT.709]
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Relative luminance of a colour in linear Rec. 709; in single precision,
/// [`Spectrum::luminance`](crate::Spectrum::luminance).
#[inline]
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b
}

/// Converts linear light to a signal with exposure √2 and gamma 2.2: v = (√2·L)^(1/2.2), clamped
/// to [0, 1].
#[inline]
pub fn gamma_from_linear(l: f32) -> f32 {
    if l.is_nan() { 0.0 } else { powf((std::f32::consts::SQRT_2 * l).clamp(0.0, 1.0), 1.0 / 2.2) }
}

/// Converts linear light to a byte of this signal, trunc(255·v).
#[inline]
pub fn encode_gamma8(l: f32) -> u8 {
    (255.0 * gamma_from_linear(l)) as u8
}

/// Converts linear light to 16 bits of this signal, trunc(65 535·v).
#[inline]
pub fn encode_gamma16(l: f32) -> u16 {
    (65_535.0 * gamma_from_linear(l)) as u16
}

/// Converts this signal to linear light: v^2.2 / √2.
#[inline]
pub fn linear_from_gamma(v: f32) -> f32 {
    powf(v.max(0.0), 2.2) * std::f32::consts::FRAC_1_SQRT_2
}

/// Converts a byte of this signal to linear light: that of v = (b + ½)/255, the middle of
/// the signals that are encoded as `b`.
#[inline]
pub fn decode_gamma8(b: u8) -> f32 {
    linear_from_gamma((f32::from(b) + 0.5) / 255.0)
}
