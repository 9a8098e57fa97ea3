//! A hall with ten thousand small lights of many colours.

use pt_math::Vec3;
use pt_testing::Random;

use super::scene::{PeerCamera, PeerMesh, PeerScene, PeerSurface};
use super::shapes;

/// Number of meshes, each of one colour, and number of lights per mesh.
const COLOURS: usize = 20;
const LIGHTS: usize = 500;

/// Half of the width and depth of the hall, and its height, in metres.
const HALL: Vec3 = Vec3::new(8.0, 6.0, 12.0);
/// Half of the edge of a light.
const HALF: f32 = 0.012;

/// The hall, seen from its open end.
pub(super) fn scene() -> PeerScene {
    let Vec3 { x, y, z } = HALL;
    let diffuse = |name: &str, albedo| PeerMesh::new(name, PeerSurface::Diffuse(albedo));
    let (positions, triangles) = shapes::blob(60, 1.6, [0.0, 0.0, -3.0]);
    let columns = [-4.5, 4.5]
        .iter()
        .flat_map(|&x| (0..5).map(move |i| [x, 0.5 * y, 4.0 * i as f32 - 9.0]))
        .fold(diffuse("columns", [0.6, 0.58, 0.5]), |mesh, at| {
            mesh.cuboid(at, [0.35, 0.5 * y, 0.35], 0.0)
        });
    let mut meshes = vec![
        diffuse("floor", [0.5, 0.45, 0.4]).quad(
            [-x, 0.0, z],
            [2.0 * x, 0.0, 0.0],
            [0.0, 0.0, -2.0 * z],
        ),
        diffuse("walls", [0.7, 0.7, 0.7])
            .quad([-x, y, -z], [2.0 * x, 0.0, 0.0], [0.0, 0.0, 2.0 * z])
            .quad([-x, 0.0, -z], [2.0 * x, 0.0, 0.0], [0.0, y, 0.0])
            .quad([x, 0.0, -z], [0.0, 0.0, 2.0 * z], [0.0, y, 0.0])
            .quad([-x, 0.0, z], [0.0, 0.0, -2.0 * z], [0.0, y, 0.0]),
        columns,
        diffuse("stone", [0.7, 0.6, 0.45]).with(positions, &triangles),
    ];
    let mut random = Random::new(1);
    meshes.extend((0..COLOURS).map(|i| lights(i, &mut random)));
    let camera = PeerCamera {
        eye: Vec3::new(0.0, 2.5, 13.0),
        look: Vec3::new(0.0, 2.2, 0.0),
        fov_degrees: 55.0,
    };
    PeerScene { camera, sky: false, meshes }
}

/// Lights of one colour with random orientations. Some are alone, and more are in clusters.
fn lights(number: usize, random: &mut Random) -> PeerMesh {
    let hue = number as f32 / COLOURS as f32;
    let channel = |shift: f32| {
        let distance = ((hue - shift + 1.5) % 1.0 - 0.5).abs();
        (1.2 - 3.0 * distance).clamp(0.08, 1.0)
    };
    let bright = 40.0 * (1.0 + (number % 4) as f32);
    let colour = [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| bright * channel(shift));
    let cluster = place(random);
    let mesh = PeerMesh::new(format!("lights_{number}"), PeerSurface::Emission(colour));
    (0..LIGHTS).fold(mesh, |mesh, i| {
        let at = if i % 5 < 2 { place(random) } else { cluster + random.in_cube() };
        let (u, v) = sides(random);
        mesh.quad(at - u - v, 2.0 * u, 2.0 * v)
    })
}

/// A random position in the hall, at least a metre from its walls.
fn place(random: &mut Random) -> Vec3 {
    let [x, z] = [HALL.x - 1.0, HALL.z - 2.0];
    Vec3::new(random.between(-x, x), random.between(1.1, HALL.y - 1.1), random.between(-z, z - 2.0))
}

/// Half of two sides of a small square with a random orientation.
fn sides(random: &mut Random) -> (Vec3, Vec3) {
    let mut direction = || loop {
        let v = random.in_cube();
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    };
    let normal = direction();
    let u = normal.any_orthonormal_vector();
    (HALF * u, HALF * normal.cross(u))
}
