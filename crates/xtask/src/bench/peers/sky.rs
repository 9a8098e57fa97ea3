//! Objects on a plane under the sky.

use pt_math::Vec3;

use super::scene::{PeerCamera, PeerMesh, PeerScene, PeerSurface};
use super::shapes;

/// Stones and metal on a plane.
pub(super) fn scene() -> PeerScene {
    let diffuse = |name: &str, albedo| PeerMesh::new(name, PeerSurface::Diffuse(albedo));
    let (positions, triangles) = shapes::blob(80, 0.9, [-0.9, 0.0, 0.0]);
    let silver =
        PeerSurface::Metal { alpha: 0.1, eta: [0.135, 0.130, 0.140], k: [4.02, 3.17, 2.54] };
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
            PeerMesh::new("ball", silver).ball(64, [0.75, 0.6, 0.1], 0.6),
            diffuse("pebbles", [0.25, 0.45, 0.30])
                .ball(16, [-0.1, 0.2, 1.1], 0.2)
                .ball(16, [0.5, 0.15, 1.3], 0.15)
                .ball(16, [1.3, 0.25, 1.0], 0.25),
        ];
    let camera = PeerCamera {
        eye: Vec3::new(0.5, 1.6, 5.0),
        look: Vec3::new(0.2, 0.5, 0.0),
        fov_degrees: 40.0,
    };
    PeerScene { camera, sky: true, meshes }
}
