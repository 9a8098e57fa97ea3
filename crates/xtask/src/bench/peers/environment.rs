//! Environment map with a sky and a sun.

use pt_math::{Vec3, trig};
use pt_scene::image::Image;

const WIDTH: u32 = 1024;

const HEIGHT: u32 = 512;

/// Radiance at the centre of the sun, and the standard deviation of its profile in radians. It is
/// wider than the real sun, several pixels of the map, so that the interpolation matters little.
const SUN: [f32; 3] = [1000.0, 900.0, 750.0];

const SUN_SIZE: f32 = 0.026;

/// Direction of the sun; not of unit length.
const SUN_DIRECTION: Vec3 = Vec3::new(-0.55, 0.6, 0.35);

/// Environment map: latitude and longitude, +y above, its middle towards +z and a quarter further
/// towards −x.
pub(super) fn pixels() -> Image {
    let sun = SUN_DIRECTION.normalize();
    let pixel = |i: u32| {
        let u = ((i % WIDTH) as f32 + 0.5) / WIDTH as f32;
        let v = ((i / WIDTH) as f32 + 0.5) / HEIGHT as f32;
        let [(sin_phi, cos_phi), (sin_theta, cos_theta)] =
            [trig::sin_cos_tau(u), trig::sin_cos_tau(0.5 * v)];
        radiance(Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi), sun)
    };
    Image { width: WIDTH, height: HEIGHT, pixels: (0..WIDTH * HEIGHT).map(pixel).collect() }
}

/// Radiance of a sky that is blue above and pale at the horizon, brown ground, and a Gaussian sun.
fn radiance(d: Vec3, sun: Vec3) -> [f32; 3] {
    let [zenith, horizon, ground] =
        [Vec3::new(0.12, 0.22, 0.50), Vec3::new(0.50, 0.53, 0.60), Vec3::new(0.13, 0.11, 0.08)];
    let up = d.y.clamp(0.0, 1.0).sqrt();
    // Blends ground and sky over a few degrees, so that no edge depends on the pixels.
    let above = (0.5 + 10.0 * d.y).clamp(0.0, 1.0);
    let sky = ground.lerp(horizon.lerp(zenith, up), above);
    let angle = d.distance(sun) / SUN_SIZE;
    (sky + Vec3::from(SUN) * trig::exp(-0.5 * angle * angle)).to_array()
}
