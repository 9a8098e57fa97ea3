//! A Cornell box with a blob beside the tall box.

use pt_math::Vec3;

use super::scene::{PeerCamera, PeerMesh, PeerScene, PeerSurface};
use super::shapes;

const WHITE: [f32; 3] = [0.885_809, 0.698_859, 0.666_422];
const GREEN: [f32; 3] = [0.105_421, 0.377_98, 0.076_425];
const RED: [f32; 3] = [0.570_068, 0.043_013_5, 0.044_370_6];
const STONE: [f32; 3] = [0.7, 0.6, 0.45];
const LAMP: [f32; 3] = [18.387, 13.9873, 6.75357];

/// Squares along the edges of the cube from which the blob is generated: 307,200 triangles.
const SEGMENTS: u32 = 160;

/// The scene `cornell_box` of Mitsuba 3 with its small box replaced.
pub(super) fn scene() -> PeerScene {
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|v| 2.0 * v);
    let diffuse = |name: &str, albedo| PeerMesh::new(name, PeerSurface::Diffuse(albedo));
    let (positions, triangles) = shapes::blob(SEGMENTS, 0.62, [0.36, -0.999, 0.33]);
    let meshes = vec![
        diffuse("floor", WHITE).quad([-1.0, -1.0, 1.0], x, -z),
        diffuse("ceiling", WHITE).quad([-1.0, 1.0, -1.0], x, z),
        diffuse("back", WHITE).quad([-1.0, -1.0, -1.0], x, y),
        diffuse("green_wall", GREEN).quad([1.0, -1.0, -1.0], z, y),
        diffuse("red_wall", RED).quad([-1.0, -1.0, 1.0], -z, y),
        diffuse("tall_box", WHITE).cuboid([-0.33, -0.4, -0.28], [0.3, 0.61, 0.3], 18.25),
        diffuse("blob", STONE).with(positions, &triangles),
        PeerMesh::new("lamp", PeerSurface::Emission(LAMP)).quad(
            [-0.23, 0.99, -0.18],
            [0.46, 0.0, 0.0],
            [0.0, 0.0, 0.38],
        ),
    ];
    let camera =
        PeerCamera { eye: Vec3::new(0.0, 0.0, 3.9), look: Vec3::ZERO, fov_degrees: 39.3077 };
    PeerScene { camera, sky: false, meshes }
}
