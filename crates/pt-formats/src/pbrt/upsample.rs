//! Reflectances under coloured light: a spectral renderer multiplies spectra where this renderer
//! multiplies colours.
//!
//! pbrt-v4 upsamples a reflectance to a smooth spectrum, a sigmoid of a quadratic polynomial of the
//! wavelength, and light to such a spectrum times daylight. Their product has another colour than
//! the product of their colours. [Jakob & Hanika 2019, "A Low-Dimensional Function Space for
//! Efficient Spectral Upsampling"]

use std::sync::Arc;

use pt_math::{DMat3, DVec3, cie};
use pt_scene::material::{Hair, Mix, Pigment, SurfaceDetail};
use pt_scene::texture::{Color, Input, Pattern, Texture};
use pt_scene::{Light, LightKind, Material, Surface};

/// Step of the sum over wavelengths, in nanometres.
const STEP: f64 = 5.0;
/// Tolerance below which the colours of lights are equal, and colours are grey.
const TOLERANCE: f64 = 1e-3;

/// Conversion of reflectances for light of one colour.
pub(super) struct Illuminant {
    /// Weights of the wavelengths of the light for red, green and blue. They add up to white,
    /// (1, 1, 1).
    weights: Vec<[f64; 3]>,
}

/// Reflectance by wavelength: ½ + x / 2√(1 + x²) with x = c₀ + c₁ t + c₂ t², and t from 0 to 1 over
/// the wavelengths of the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sigmoid(DVec3);

impl Sigmoid {
    /// Returns the reflectance at t, and its derivative with respect to x.
    fn at(self, t: f64) -> (f64, f64) {
        let x = self.0.dot(DVec3::new(1.0, t, t * t));
        let root = (1.0 + x * x).sqrt();
        (0.5 + 0.5 * x / root, 0.5 / (root * root * root))
    }

    /// Fits the spectrum that has a colour under daylight; `None` if the fit does not converge.
    ///
    /// Uses the Levenberg-Marquardt method.
    fn of_color(rgb: [f64; 3], daylight: &[[f64; 3]]) -> Option<Self> {
        const ITERATIONS: u32 = 200;
        const NEAR: f64 = 1e-4;
        let target = DVec3::from_array(rgb).clamp(DVec3::splat(0.003), DVec3::splat(0.997));
        let mut fit = Self(DVec3::ZERO);
        let (mut color, mut slope) = fit.seen(daylight);
        let mut damping = 1e-3;
        for _ in 0..ITERATIONS {
            let miss = target - color;
            if miss.length() < NEAR * 0.1 {
                break;
            }
            let gram = slope.transpose() * slope;
            let step = (gram + DMat3::from_diagonal(DVec3::splat(damping * 1e-3))).inverse()
                * (slope.transpose() * miss);
            let next = Self(fit.0 + step);
            let (seen, next_slope) = next.seen(daylight);
            if (target - seen).length() < miss.length() {
                (fit, color, slope) = (next, seen, next_slope);
                damping *= 0.3;
            } else {
                damping *= 5.0;
            }
        }
        ((target - color).length() < NEAR).then_some(fit)
    }

    /// Returns the colour, and its derivative with respect to the coefficients.
    fn seen(self, weights: &[[f64; 3]]) -> (DVec3, DMat3) {
        let (mut color, mut slope) = (DVec3::ZERO, DMat3::ZERO);
        for (t, weight) in shares(weights.len()).zip(weights) {
            let (value, growth) = self.at(t);
            let weight = DVec3::from_array(*weight);
            color += weight * value;
            for (power, factor) in [1.0, t, t * t].into_iter().enumerate() {
                *slope.col_mut(power) += weight * (growth * factor);
            }
        }
        (color, slope)
    }
}

/// Returns `count` equidistant numbers from 0 to 1.
fn shares(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| i as f64 / (count - 1) as f64)
}

/// Returns the weights of the wavelengths of daylight for red, green and blue.
fn daylight() -> Vec<[f64; 3]> {
    let [shortest, longest] = cie::WAVELENGTHS;
    let count = ((longest - shortest) / STEP) as usize + 1;
    let weight = |i: usize| {
        let nanometres = shortest + STEP * i as f64;
        cie::rec709_from_xyz(cie::observer(nanometres).map(|bar| bar * cie::d65(nanometres)))
    };
    normalized((0..count).map(weight).collect())
}

/// Scales weights so that each channel adds up to 1.
fn normalized(mut weights: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let sums: [f64; 3] = std::array::from_fn(|c| weights.iter().map(|w| w[c]).sum());
    for weight in &mut weights {
        *weight = std::array::from_fn(|c| weight[c] / sums[c]);
    }
    weights
}

impl Illuminant {
    /// Creates the illuminant of a colour; `None` for white, which leaves reflectances unchanged,
    /// and for colours without a spectrum.
    pub(super) fn of_color(rgb: [f64; 3]) -> Option<Self> {
        let most = rgb.iter().fold(0.0, |a: f64, b| a.max(*b));
        if most <= 0.0 || rgb.iter().all(|c| most - c <= TOLERANCE * most) {
            return None;
        }
        let mut weights = daylight();
        let light = Sigmoid::of_color(rgb.map(|c| 0.5 * c / most), &weights)?;
        for (t, weight) in shares(weights.len()).zip(&mut weights) {
            *weight = weight.map(|w| w * light.at(t).0);
        }
        Some(Self { weights: normalized(weights) })
    }

    /// Creates the illuminant of a scene; `None` unless all lights have the same colour, other than
    /// white.
    pub(super) fn of_scene(lights: &[Light], materials: &[Material]) -> Option<Self> {
        let mut found: Option<[f64; 3]> = None;
        let emission = materials.iter().map(|material| color_of_emission(&material.emission));
        for color in lights.iter().map(|light| color_of(&light.kind)).chain(emission) {
            let color = color?.map(f64::from);
            let most = color.iter().fold(0.0, |a: f64, b| a.max(*b));
            if most <= 0.0 {
                continue;
            }
            let color = color.map(|c| c / most);
            match found {
                None => found = Some(color),
                Some(known) if (0..3).all(|c| (known[c] - color[c]).abs() < TOLERANCE) => {}
                Some(_) => return None,
            }
        }
        Self::of_color(found?)
    }

    /// Converts a reflectance: its colour under this light relative to that of the light.
    pub(super) fn reflected(&self, rgb: [f32; 3]) -> [f32; 3] {
        let [least, most] = [
            rgb.iter().fold(1.0, |a: f32, b| a.min(*b)),
            rgb.iter().fold(0.0, |a: f32, b| a.max(*b)),
        ];
        if most - least <= TOLERANCE as f32 || most > 1.0 {
            return rgb;
        }
        let Some(spectrum) = Sigmoid::of_color(rgb.map(f64::from), &daylight()) else { return rgb };
        let (color, _) = spectrum.seen(&self.weights);
        color.clamp(DVec3::ZERO, DVec3::ONE).as_vec3().to_array()
    }

    /// Converts all reflectances of a surface, except those of images.
    pub(super) fn light_up(&self, surface: &mut Surface) {
        match surface {
            Surface::Diffuse(s) => self.color(&mut s.reflectance),
            Surface::DiffuseTransmission(s) => {
                self.color(&mut s.reflectance);
                self.color(&mut s.transmittance);
            }
            Surface::Hair(Hair { pigment: Pigment::Reflectance(color), .. }) => self.color(color),
            Surface::CoatedDiffuse(s) => self.color(&mut s.diffuse),
            Surface::RoughCoatedDiffuse(s) => self.color(&mut s.diffuse),
            Surface::Mix(Mix { first, second, .. }) => {
                self.light_up(first);
                self.light_up(second);
            }
            Surface::SurfaceDetail(SurfaceDetail { surface, .. }) => self.light_up(surface),
            _ => {}
        }
    }

    fn color(&self, color: &mut Color) {
        match color {
            Input::Value(value) => *value = self.reflected(*value),
            Input::Texture(texture) => {
                let pattern = match &texture.pattern {
                    Pattern::Checkerboard(colors) => {
                        Pattern::Checkerboard(colors.map(|color| self.reflected(color)))
                    }
                    Pattern::Procedural(pattern) => {
                        let pattern = pattern.recolored(|color| self.reflected(color));
                        let Some(pattern) = pattern else { return };
                        Pattern::Procedural(pattern)
                    }
                    Pattern::Blend(blend) => {
                        let mut blend = blend.clone();
                        self.color(&mut blend.first);
                        self.color(&mut blend.second);
                        Pattern::Blend(blend)
                    }
                    _ => return,
                };
                *texture = Arc::new(Texture { pattern, ..Texture::clone(texture) });
            }
        }
    }
}

/// Returns the colour of an emission, if it is constant. It may be multiplied by a texture, such as
/// an opacity.
fn color_of_emission(emission: &Color) -> Option<[f32; 3]> {
    match emission {
        Input::Value(value) => Some(*value),
        Input::Texture(texture) => match &texture.pattern {
            Pattern::Product(factors) => match factors.as_ref() {
                [Input::Value(value), Input::Texture(_)] => Some(*value),
                _ => None,
            },
            _ => None,
        },
    }
}

/// Returns the colour of a light, if it is constant.
fn color_of(kind: &LightKind) -> Option<[f32; 3]> {
    if kind.slide().is_some() { None } else { kind.strength().copied() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spectrum_has_its_colour() {
        let daylight = daylight();
        for rgb in
            [[0.5; 3], [0.63, 0.065, 0.05], [0.14, 0.45, 0.091], [0.05, 0.05, 0.9], [0.9, 0.8, 0.1]]
        {
            let spectrum = Sigmoid::of_color(rgb, &daylight).expect("a spectrum");
            let (color, _) = spectrum.seen(&daylight);
            assert!((color - DVec3::from_array(rgb)).length() < 1e-3, "{rgb:?}: {color}");
        }
    }

    #[test]
    fn grey_is_grey_under_any_light_and_white_light_changes_nothing() {
        let warm = Illuminant::of_color([17.0, 12.0, 6.0]).expect("a coloured light");
        assert_eq!(warm.reflected([0.3; 3]), [0.3; 3]);
        assert!(
            Illuminant::of_color([2.0; 3]).is_none() && Illuminant::of_color([0.0; 3]).is_none()
        );
        // Reflectances remain in [0, 1].
        let seen = warm.reflected([0.63, 0.065, 0.05]);
        assert!(
            seen.iter().all(|c| (0.0..=1.0).contains(c)) && seen != [0.63, 0.065, 0.05],
            "{seen:?}"
        );
    }
}
