//! A room with metal furniture, lit through a window and by a small lamp.

use pt_math::Vec3;

use super::scene::{PeerCamera, PeerMesh, PeerScene, PeerSurface};
use super::shapes;

/// Index of refraction and extinction of metals at 630, 532 and 467 nm. [Johnson & Christy 1972;
/// Rakić 1995]
const COPPER: [[f32; 3]; 2] = [[0.200, 0.924, 1.102], [3.912, 2.452, 2.142]];
const GOLD: [[f32; 3]; 2] = [[0.143, 0.375, 1.442], [3.983, 2.386, 1.603]];
const ALUMINIUM: [[f32; 3]; 2] = [[1.657, 0.880, 0.521], [9.224, 6.270, 4.838]];

const PLASTER: [f32; 3] = [0.75, 0.72, 0.68];
const WOOD: [f32; 3] = [0.40, 0.24, 0.13];
const CLOTH: [f32; 3] = [0.15, 0.25, 0.50];

/// Half of the room's width and depth, and its height, in metres.
const ROOM: Vec3 = Vec3::new(3.0, 2.8, 2.5);
/// Window in the left wall: its lower and upper edge, and half of its width.
const SILL: f32 = 0.9;
const LINTEL: f32 = 2.3;
const JAMB: f32 = 1.1;

/// The room, seen from its open end.
pub(super) fn scene() -> PeerScene {
    let mut meshes = vec![room(), window_wall()];
    meshes.extend(furniture());
    meshes.extend([
        // Outside, so that the sill and the lintel cast shadows.
        PeerMesh::new("daylight", PeerSurface::Emission([9.0, 10.0, 12.0])).quad(
            [-ROOM.x - 0.6, SILL - 0.2, JAMB + 0.3],
            [0.0, 0.0, -2.0 * JAMB - 0.6],
            [0.0, LINTEL - SILL + 0.8, 0.0],
        ),
        PeerMesh::new("lamp", PeerSurface::Emission([24.0, 17.0, 10.0])).quad(
            [1.6, 2.1, -1.9],
            [0.3, 0.0, 0.0],
            [0.0, 0.0, 0.3],
        ),
    ]);
    let camera = PeerCamera {
        eye: Vec3::new(0.6, 1.5, 5.6),
        look: Vec3::new(0.0, 1.3, -0.5),
        fov_degrees: 46.0,
    };
    PeerScene { camera, sky: false, meshes }
}

/// Ceiling and walls except that of the window, single-sided towards the inside.
fn room() -> PeerMesh {
    let Vec3 { x, y, z } = ROOM;
    PeerMesh::new("room", PeerSurface::Diffuse(PLASTER))
        .quad([-x, y, -z], [2.0 * x, 0.0, 0.0], [0.0, 0.0, 2.0 * z])
        .quad([-x, 0.0, -z], [2.0 * x, 0.0, 0.0], [0.0, y, 0.0])
        .quad([x, 0.0, -z], [0.0, 0.0, 2.0 * z], [0.0, y, 0.0])
}

/// The left wall, as four boards around the window that are 20 cm thick.
fn window_wall() -> PeerMesh {
    let Vec3 { x, y, z } = ROOM;
    let board = |mesh: PeerMesh, [low, high]: [f32; 2], [near, far]: [f32; 2]| {
        let centre = [-x - 0.1, 0.5 * (low + high), 0.5 * (near + far)];
        mesh.cuboid(centre, [0.1, 0.5 * (high - low), 0.5 * (far - near)], 0.0)
    };
    let mesh = PeerMesh::new("window_wall", PeerSurface::Diffuse(PLASTER));
    let mesh = board(mesh, [0.0, SILL], [-z, z]);
    let mesh = board(mesh, [LINTEL, y], [-z, z]);
    let mesh = board(mesh, [SILL, LINTEL], [-z, -JAMB]);
    board(mesh, [SILL, LINTEL], [JAMB, z])
}

fn furniture() -> Vec<PeerMesh> {
    let Vec3 { x, z, .. } = ROOM;
    let metal = |name: &str, alpha, [eta, k]: [[f32; 3]; 2]| {
        PeerMesh::new(name, PeerSurface::Metal { alpha, eta, k })
    };
    let (positions, triangles) = shapes::blob(48, 0.55, [-1.2, 0.8, -1.2]);
    vec![
        metal("floor", 0.3, ALUMINIUM).quad(
            [-x, 0.0, z],
            [2.0 * x, 0.0, 0.0],
            [0.0, 0.0, -2.0 * z],
        ),
        table(PeerMesh::new("table", PeerSurface::Diffuse(WOOD))),
        PeerMesh::new("sofa", PeerSurface::Diffuse(CLOTH))
            .cuboid([1.9, 0.25, -0.2], [0.5, 0.25, 1.1], 0.0)
            .cuboid([2.5, 0.5, -0.2], [0.15, 0.5, 1.1], 0.0),
        PeerMesh::new("plinth", PeerSurface::Diffuse(PLASTER)).cuboid(
            [-1.2, 0.4, -1.2],
            [0.35, 0.4, 0.35],
            20.0,
        ),
        metal("sculpture", 0.15, COPPER).with(positions, &triangles),
        metal("balls", 0.1, GOLD).ball(32, [-0.3, 0.98, 0.5], 0.2).ball(
            32,
            [0.35, 0.93, 0.75],
            0.15,
        ),
        metal("cabinet", 0.2, ALUMINIUM).cuboid([1.2, 0.9, -2.2], [0.9, 0.9, 0.25], 0.0),
    ]
}

fn table(mesh: PeerMesh) -> PeerMesh {
    let mesh = mesh.cuboid([0.0, 0.75, 0.6], [0.8, 0.03, 0.45], 0.0);
    [[-0.7, 0.25], [0.7, 0.25], [-0.7, 0.95], [0.7, 0.95]]
        .iter()
        .fold(mesh, |mesh, &[x, z]| mesh.cuboid([x, 0.36, z], [0.03, 0.36, 0.03], 0.0))
}
