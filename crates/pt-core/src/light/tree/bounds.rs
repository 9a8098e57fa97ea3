//! Bounds of the emission of sets of lights: strength, position and direction.

use std::f32::consts::PI;

use pt_math::{Bounds3, Spectrum, Vec3};

use super::TreeLight;
use crate::light::LightTables;

/// Tolerance for the rounding error of cosines, within which lights are not culled.
pub(super) const MARGIN: f32 = 1e-3;

/// Strengths are clamped to this range, so that no sum of them underflows or overflows.
const MIN: f32 = 1e-30;
const MAX: f32 = 1e30;

/// Mean cosine of lights that emit equally in all directions: the mean of max(0, cos) over the
/// sphere.
const EVERYWHERE: f32 = 0.25;

/// Emission of a set of lights.
///
/// Each light emits either by the cosine to an axis (for triangles, the normal), or equally in all
/// directions. The irradiance at distance 1 in the direction w is about strength · max(0, m·w) with
/// the mean axis m, which is the shorter the more the axes differ. [as Tokuyoshi et al. 2024,
/// "Hierarchical Light Sampling with Accurate Spherical Gaussian Lighting", represent the
/// directions of many lights by the mean of their axes]
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// Bounding box of all lights.
    pub(super) bounds: Bounds3,
    /// Mean position, weighted by strength.
    pub(super) center: Vec3,
    /// Radius of a sphere around `center` that contains all lights.
    pub(super) radius: f32,
    /// Irradiance at distance 1 of all lights, if they face the point.
    pub(super) strength: f32,
    /// Mean axis, weighted by strength.
    pub(super) axis: Vec3,
    /// Smallest cosine to the axis at which light is emitted.
    pub(super) cut: f32,
}

/// Value of `cut` for lights that emit in all directions, and for sets of lights.
const NO_CUT: f32 = -4.0;

impl LightBounds {
    /// Returns the emission of one light.
    pub(super) fn of(light: &TreeLight, tables: &LightTables) -> Self {
        match light {
            TreeLight::Triangle(t, radiance) => {
                let corners = [t.p0, t.p0 + t.e1, t.p0 + t.e2];
                let center = t.p0 + (t.e1 + t.e2) * (1.0 / 3.0);
                let far = |c: Vec3| (c - center).length_squared();
                let [a, b, c] = corners.map(far);
                Self {
                    bounds: corners.into_iter().collect(),
                    center,
                    radius: a.max(b).max(c).sqrt(),
                    strength: held(level(*radiance) * t.area()),
                    axis: t.normal,
                    cut: -MARGIN,
                }
            }
            TreeLight::Textured(t, laid) => {
                let mean = tables.textured_triangles[*laid as usize].mean;
                Self::of(&TreeLight::Triangle(*t, Spectrum::splat(mean)), tables)
            }
            TreeLight::Other(light) => light.bounds(tables).expect("a light of a tree has bounds"),
        }
    }

    /// Returns the emission of a light without extent, equal in all directions.
    pub(in crate::light) fn of_point(position: Vec3, intensity: Spectrum, factor: f32) -> Self {
        Self::everywhere(position, 0.0, level(intensity) * factor)
    }

    /// Returns the emission of a light without extent, equal in all directions up to an angle from
    /// the axis with the cosine `cut`.
    pub(in crate::light) fn of_cone(
        position: Vec3,
        intensity: Spectrum,
        axis: Vec3,
        cut: f32,
        factor: f32,
    ) -> Self {
        let strength = level(intensity) * factor;
        let everywhere = Self::everywhere(position, 0.0, strength);
        if cut <= 0.0 {
            return everywhere;
        }
        Self { strength: held(strength), axis, cut: cut - MARGIN, ..everywhere }
    }

    /// Returns the emission of a sphere whose radiance is multiplied by `factor`.
    pub(in crate::light) fn of_sphere(
        center: Vec3,
        radius: f32,
        radiance: Spectrum,
        factor: f32,
    ) -> Self {
        let strength = level(radiance) * PI * radius * radius;
        Self::everywhere(center, radius, strength * factor)
    }

    fn everywhere(center: Vec3, radius: f32, strength: f32) -> Self {
        let size = Vec3::splat(radius);
        Self {
            bounds: Bounds3 { min: center - size, max: center + size },
            center,
            radius,
            strength: held(strength / EVERYWHERE),
            axis: Vec3::ZERO,
            cut: NO_CUT,
        }
    }

    /// Returns the emission of a set of at least one light.
    pub(super) fn of_all<'a>(all: impl Iterator<Item = &'a Self> + Clone) -> Self {
        let (mut bounds, mut strength) = (Bounds3::EMPTY, 0.0);
        let (mut place, mut axis) = (Vec3::ZERO, Vec3::ZERO);
        for one in all.clone() {
            bounds = bounds.union(one.bounds);
            strength += one.strength;
            place += one.center * one.strength;
            axis += one.axis * one.strength;
        }
        let center = place / strength;
        let farthest = |one: &Self| (one.center - center).length() + one.radius;
        Self {
            bounds,
            center,
            radius: all.map(farthest).fold(0.0, f32::max),
            strength,
            axis: axis / strength,
            cut: NO_CUT,
        }
    }
}

/// Weight of a spectrum for choosing lights: √(r² + g² + b²), up to a constant, which minimises the
/// sum of the variances of the three channels.
fn level(spectrum: Spectrum) -> f32 {
    let [r, g, b] = spectrum.to_array();
    ((r * r + g * g + b * b) * (1.0 / 3.0)).sqrt()
}

fn held(strength: f32) -> f32 {
    strength.clamp(MIN, MAX)
}

/// Emission across the mean axis, which is 0 for lights with a common axis.
///
/// Axes that are uniform over a cap of half angle α have |m| = (1 + cos α)/2, so α ≈ 2 √(1 − |m|),
/// and emit about α/8 across it; from a hemisphere on, the mean over all directions.
pub(super) fn across(axis: Vec3) -> f32 {
    let less = (1.0 - axis.length()).clamp(0.0, 0.5);
    EVERYWHERE * (2.0 * less).sqrt()
}
