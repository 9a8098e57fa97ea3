//! Studio light for scenes without light: soft light from three sides, and a grey ground.
//!
//! The key light is to the left of the camera and above it, the fill light lower to its right, and
//! the rim light behind the object, high above. All are discs with soft edges on the sky, outside
//! of the view of the studio's camera, so that the light does not depend on the scale of the scene.
//! There is no floor.

use std::f32::consts::PI;

use pt_math::{Vec3, trig};

use crate::light::EnvironmentMap;

/// Direction to the studio's camera from the centre of the scene: azimuth from +z towards +x, and
/// elevation, in degrees.
const CAMERA: [f32; 2] = [35.0, 20.0];
/// Columns and rows of the map: its edges are soft, so 1.4 degrees suffice.
const SIZE: [u32; 2] = [256, 128];
/// Radiance at the horizon, above and below: the visible background.
const GROUND: [f32; 3] = [0.20, 0.30, 0.10];

/// A disc on the sky.
struct Lamp {
    /// Azimuth and elevation of the centre, in degrees.
    at: [f32; 2],
    /// Angles from the centre at which the fade to black begins and ends, in degrees.
    edge: [f32; 2],
    /// Radiance.
    color: [f32; 3],
}

/// Key, fill and rim.
const LAMPS: [Lamp; 3] = [
    Lamp { at: [-20.0, 50.0], edge: [14.0, 34.0], color: [4.6, 4.4, 4.1] },
    Lamp { at: [100.0, 10.0], edge: [20.0, 45.0], color: [0.70, 0.75, 0.82] },
    Lamp { at: [-115.0, 60.0], edge: [10.0, 24.0], color: [3.6, 3.7, 3.9] },
];

/// Direction from the centre of the scene to the studio's camera.
pub(super) fn camera() -> Vec3 {
    direction(CAMERA)
}

/// Environment map of the studio.
pub(super) fn environment() -> EnvironmentMap {
    let [w, h] = SIZE;
    let lamps = LAMPS.map(|lamp| {
        let [inner, outer] = lamp.edge.map(|angle| trig::sin_cos(angle.to_radians()).1);
        (direction(lamp.at), inner, outer, lamp.color)
    });
    let texel = |i: u32| {
        let d = texel_direction((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
        let [horizon, above, below] = GROUND;
        let pole = if d.y > 0.0 { above } else { below };
        let ground = [horizon + (pole - horizon) * d.y.abs(); 3];
        lamps.iter().fold(ground, |sum, (middle, inner, outer, color)| {
            let share = smooth_step((d.dot(*middle) - outer) / (inner - outer));
            [0, 1, 2].map(|c| sum[c] + share * color[c])
        })
    };
    EnvironmentMap::new(w, h, (0..w * h).map(texel).collect())
}

/// Direction of a position on the map in texels: see [`EnvironmentMap`].
fn texel_direction(column: f32, row: f32) -> Vec3 {
    let [w, h] = SIZE.map(|n| n as f32);
    let (sin_phi, cos_phi) = trig::sin_cos(2.0 * PI * column / w);
    let (sin_theta, cos_theta) = trig::sin_cos(PI * row / h);
    Vec3::new(-sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
}

/// Direction of an azimuth from +z towards +x, and an elevation, in degrees.
fn direction([azimuth, height]: [f32; 2]) -> Vec3 {
    let (sin_a, cos_a) = trig::sin_cos(azimuth.to_radians());
    let (sin_h, cos_h) = trig::sin_cos(height.to_radians());
    Vec3::new(sin_a * cos_h, sin_h, cos_a * cos_h)
}

/// 3x² − 2x³ between 0 and 1.
fn smooth_step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions, radiance and solid angle of all texels.
    fn texels() -> impl Iterator<Item = (Vec3, [f32; 3], f32)> {
        let map = environment();
        let [w, h] = SIZE;
        let pixels = map.image().pixels.clone();
        pixels.into_iter().zip(0..).map(move |(radiance, i)| {
            let d = texel_direction((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
            let area = 2.0 * PI * PI / (w * h) as f32 * (1.0 - d.y * d.y).sqrt();
            (d, radiance, area)
        })
    }

    /// E = ∫ L cos θ dω: a diffuse surface of albedo 0.5 has a radiance of E / 2π.
    fn irradiance(normal: Vec3) -> f32 {
        texels().map(|(d, radiance, area)| radiance[1] * d.dot(normal).max(0.0) * area).sum()
    }

    #[test]
    fn what_faces_the_camera_is_bright_and_what_looks_down_is_darker() {
        let front = irradiance(camera()) / (2.0 * PI);
        assert!((0.25..0.5).contains(&front), "{front}");
        let below = irradiance(Vec3::NEG_Y) / (2.0 * PI);
        assert!((0.05..0.5 * front).contains(&below), "{below}");
    }

    /// The view is 50 by 39 degrees, so its corners are 30 degrees from its centre.
    #[test]
    fn the_camera_sees_the_ground_alone() {
        let cone = 30_f32.to_radians().cos();
        let seen: Vec<_> = texels().filter(|(d, ..)| d.dot(-camera()) > cone).collect();
        assert!(!seen.is_empty());
        for (_, [r, g, b], _) in seen {
            assert!(r == g && g == b && (0.1..=0.3).contains(&r), "{r} {g} {b}");
        }
    }
}
