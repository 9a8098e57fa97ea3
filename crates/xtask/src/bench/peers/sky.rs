//! Things on a plane under the sky.

use pt_math::{Vec3, trig};
use pt_scene::image::Image;

use super::scene::{Camera, Mesh, Scene, Surface};
use super::shapes;

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 512;

/// Radiance in the middle of the sun, and how much wider than the real one it is: its standard
/// deviation in radians, several pixels of the map, so that it matters little how these are joined.
const SUN: [f32; 3] = [1000.0, 900.0, 750.0];
const SUN_SIZE: f32 = 0.026;
/// Where the sun is; not of unit length.
const SUN_DIRECTION: Vec3 = Vec3::new(-0.55, 0.6, 0.35);

/// The map: latitude and longitude, +y above, its middle towards +z and a quarter further towards
/// −x.
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

/// A sky that is blue above and pale at the horizon, brown ground, and a Gaussian for the sun.
fn radiance(d: Vec3, sun: Vec3) -> [f32; 3] {
    let [zenith, horizon, ground] =
        [Vec3::new(0.12, 0.22, 0.50), Vec3::new(0.50, 0.53, 0.60), Vec3::new(0.13, 0.11, 0.08)];
    let up = d.y.clamp(0.0, 1.0).sqrt();
    // From the ground to the sky within a few degrees, so that no edge depends on the pixels.
    let above = (0.5 + 10.0 * d.y).clamp(0.0, 1.0);
    let sky = ground.lerp(horizon.lerp(zenith, up), above);
    let angle = d.distance(sun) / SUN_SIZE;
    (sky + Vec3::from(SUN) * trig::exp(-0.5 * angle * angle)).to_array()
}

/// Stones and metal on a plane.
pub(super) fn scene() -> Scene {
    let diffuse = |name: &str, albedo| Mesh::new(name, Surface::Diffuse(albedo));
    let (positions, triangles) = shapes::blob(80, 0.9, [-0.9, 0.0, 0.0]);
    let silver = Surface::Metal { alpha: 0.1, eta: [0.135, 0.130, 0.140], k: [4.02, 3.17, 2.54] };
    let meshes =
        vec![
            diffuse("plane", [0.45, 0.42, 0.38]).quad(
                [-20.0, 0.0, 20.0],
                [40.0, 0.0, 0.0],
                [0.0, 0.0, -40.0],
            ),
            diffuse("stone", [0.65, 0.60, 0.55]).with(positions, &triangles),
            diffuse("wall", [0.70, 0.30, 0.20])
                .cuboid([0.3, 0.5, -1.8], [2.2, 0.5, 0.1], 12.0)
                .cuboid([1.9, 0.25, 0.2], [0.25, 0.25, 0.25], 35.0),
            Mesh::new("ball", silver).ball(64, [0.75, 0.6, 0.1], 0.6),
            diffuse("pebbles", [0.25, 0.45, 0.30])
                .ball(16, [-0.1, 0.2, 1.1], 0.2)
                .ball(16, [0.5, 0.15, 1.3], 0.15)
                .ball(16, [1.3, 0.25, 1.0], 0.25),
        ];
    let camera =
        Camera { eye: Vec3::new(0.5, 1.6, 5.0), look: Vec3::new(0.2, 0.5, 0.0), fov_degrees: 40.0 };
    Scene { camera, sky: true, meshes }
}
