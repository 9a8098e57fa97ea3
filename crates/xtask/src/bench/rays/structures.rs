//! Generated meshes of simple parts, which are the same on every machine.

use std::f32::consts::TAU;

use pt_math::noise::Octaves;
use pt_math::{Mat3, Vec3, trig, warp};
use pt_testing::Random;

use super::input::{PinholeCamera, TriangleMesh};
use super::random::random as numbers;
use super::shapes;

/// Corners of a unit box, by the bits of their numbers, and its triangles.
const BOX: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

/// Hills of 2n² triangles, seen from a height at which most rays graze them.
pub(super) fn terrain(n: u32) -> TriangleMesh {
    let view = PinholeCamera {
        eye: Vec3::new(-9.0, 1.6, -9.0),
        look: Vec3::new(4.0, -0.6, 5.0),
        fov_degrees: 60.0,
    };
    let mut mesh = TriangleMesh { view: Some(view), ..TriangleMesh::default() };
    mesh.sheet([n, n], |u, v| {
        let p = Vec3::new(20.0 * u - 10.0, 0.0, 20.0 * v - 10.0);
        p.with_y(height(p))
    });
    mesh
}

/// Height of the hills.
fn height(p: Vec3) -> f32 {
    2.4 * Octaves::new(8, 0.5).fbm::<f32>(p.with_y(3.5) * 0.15)
}

/// Boxes of twelve triangles in all orientations, between a twentieth of a metre and two metres
/// long, in a cube of 20 m.
pub(super) fn boxes(count: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for number in 0..count {
        let mut random = numbers(7, number);
        let center = in_cube(&mut random, 10.0);
        let mut side = || 0.05 + 2.0 * cubed(random.unit());
        let sides = Vec3::new(side(), side(), side());
        mesh.add_box(center, turned(&mut random) * Mat3::from_diagonal(sides));
    }
    mesh
}

/// Rods of six sides in all directions, up to 12 m long and between 4 mm and 4 cm thick, in a cube
/// of 20 m.
pub(super) fn rods(count: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for number in 0..count {
        let mut random = numbers(8, number);
        let center = in_cube(&mut random, 10.0);
        let along = warp::uniform_sphere(random.unit_2d()) * random.between(0.5, 6.0);
        let radius = 0.002 + 0.02 * cubed(random.unit());
        mesh.add_rod([center - along, center + along], radius, 6);
    }
    mesh
}

/// Hills with boxes, rods and balls of all sizes on and above them.
pub(super) fn playground() -> TriangleMesh {
    let mut mesh = terrain(300);
    for number in 0..6_000 {
        let mut random = numbers(9, number);
        let above = random.unit() * random.unit() * 3.0;
        let at = in_cube(&mut random, 9.5);
        let at = at.with_y(height(at) + above);
        let size = 0.02 + 0.6 * cubed(random.unit());
        match number % 3 {
            0 => mesh.add_box(at, turned(&mut random) * size),
            1 => {
                let along = warp::uniform_sphere(random.unit_2d()) * (5.0 * size);
                mesh.add_rod([at - along, at + along], 0.1 * size, 8);
            }
            _ => mesh.add_ball(at, size),
        }
    }
    mesh
}

/// An office: floor, walls and ceiling of two triangles each, rows of desks with chairs, screens,
/// lamps and things upon them, full shelves along the walls, blinds before the windows, and pipes
/// under the ceiling.
pub(super) fn office() -> TriangleMesh {
    let view = PinholeCamera {
        eye: Vec3::new(-11.0, 1.7, -6.5),
        look: Vec3::new(6.0, 0.8, 3.0),
        fov_degrees: 70.0,
    };
    let mut mesh = TriangleMesh { view: Some(view), ..TriangleMesh::default() };
    let size = Vec3::new(24.0, 3.2, 16.0);
    let room = |u: f32, v: f32, w: f32| Vec3::new(u - 0.5, v, w - 0.5) * size;
    for side in [0.0, 1.0] {
        mesh.sheet([1, 1], |u, v| room(u, side, v));
        mesh.sheet([1, 1], |u, v| room(side, u, v));
    }
    mesh.sheet([1, 1], |u, v| room(u, v, 0.0));
    for pane in 0..12 {
        blind(&mut mesh, Vec3::new(-11.5 + 2.0 * pane as f32, 0.8, 7.9));
    }
    for (i, x) in (0..9).map(|i| (i, -10.0 + 2.5 * i as f32)) {
        for (j, z) in (0..4).map(|j| (j, -5.0 + 3.0 * j as f32)) {
            desk(&mut mesh, Vec3::new(x, 0.0, z), 4 * i + j);
        }
        shelf(&mut mesh, Vec3::new(x, 0.0, -7.8), i);
        let start = Vec3::new(x + 0.4, 2.9, -8.0);
        mesh.add_rod([start, start + Vec3::Z * 16.0], 0.06, 24);
    }
    mesh
}

/// A blind of forty slats.
fn blind(mesh: &mut TriangleMesh, corner: Vec3) {
    for slat in 0..40 {
        let (s, c) = trig::sin_cos(0.6);
        let tilt = Mat3::from_cols(Vec3::X, Vec3::new(0.0, c, s), Vec3::new(0.0, -s, c));
        let sides = Mat3::from_diagonal(Vec3::new(1.8, 0.002, 0.05));
        mesh.add_box(corner + Vec3::new(0.9, 0.05 * slat as f32, 0.0), tilt * sides);
    }
}

/// A desk with a chair, and a screen, a lamp and some things upon it.
fn desk(mesh: &mut TriangleMesh, at: Vec3, number: usize) {
    let mut random = numbers(10, number);
    let mut part = |center: [f32; 3], sides: [f32; 3]| {
        mesh.add_box(at + Vec3::from(center), Mat3::from_diagonal(sides.into()));
    };
    part([0.0, 0.72, 0.0], [1.6, 0.03, 0.8]);
    for [x, z] in [[-0.75, -0.35], [0.75, -0.35], [-0.75, 0.35], [0.75, 0.35]] {
        part([x, 0.35, z], [0.04, 0.7, 0.04]);
    }
    part([0.0, 1.05, -0.2], [0.7, 0.4, 0.03]);
    part([0.0, 0.8, -0.22], [0.05, 0.16, 0.05]);
    part([0.0, 0.45, 0.8], [0.45, 0.06, 0.45]);
    part([0.0, 0.8, 1.0], [0.45, 0.6, 0.04]);
    for key in 0..60 {
        let (row, column) = (key / 15, key % 15);
        let place = [-0.14 + 0.02 * column as f32, 0.745, 0.1 + 0.02 * row as f32];
        part(place, [0.016, 0.008, 0.016]);
    }
    mesh.add_rod([at + Vec3::Y * 0.05, at + Vec3::new(0.0, 0.45, 0.8)], 0.03, 16);
    let lamp = at + Vec3::new(-0.6, 0.73, -0.25);
    mesh.add_rod([lamp, lamp + Vec3::new(0.1, 0.5, 0.0)], 0.01, 8);
    mesh.add_ball(lamp + Vec3::new(0.12, 0.55, 0.0), 0.08);
    for _ in 0..3 {
        let place = Vec3::new(random.between(0.4, 0.7), 0.78, random.between(-0.3, 0.3));
        mesh.add_ball(at + place, random.between(0.02, 0.05));
    }
}

/// A shelf of six boards with books.
fn shelf(mesh: &mut TriangleMesh, at: Vec3, number: usize) {
    let mut random = numbers(11, number);
    for board in 0..6 {
        let height = 0.1 + 0.38 * board as f32;
        let center = at + Vec3::new(0.0, height, 0.0);
        mesh.add_box(center, Mat3::from_diagonal(Vec3::new(2.2, 0.02, 0.3)));
        let mut x = -1.08;
        while x < 1.05 {
            let [thick, high, deep] = [[0.01, 0.06], [0.2, 0.34], [0.15, 0.26]]
                .map(|[low, end]| random.between(low, end));
            let book = center + Vec3::new(x + 0.5 * thick, 0.5 * high + 0.011, 0.0);
            let (s, c) = trig::sin_cos(random.between(-0.02, 0.02));
            let lean = Mat3::from_cols(Vec3::new(c, s, 0.0), Vec3::new(-s, c, 0.0), Vec3::Z);
            mesh.add_box(book, lean * Mat3::from_diagonal(Vec3::new(0.9 * thick, high, deep)));
            x += thick;
        }
    }
}

fn cubed(x: f32) -> f32 {
    x * x * x
}

/// Point of a cube with edges of `2 * half`.
fn in_cube(random: &mut Random, half: f32) -> Vec3 {
    let mut place = || random.between(-half, half);
    Vec3::new(place(), place(), place())
}

/// A random rotation.
fn turned(random: &mut Random) -> Mat3 {
    let axis = warp::uniform_sphere(random.unit_2d());
    let (across, up) = axis.any_orthonormal_pair();
    let (s, c) = trig::sin_cos(random.between(0.0, TAU));
    Mat3::from_cols(across * c + up * s, up * c - across * s, axis)
}

impl TriangleMesh {
    /// Adds a unit box around 0 that is transformed and moved to `center`.
    fn add_box(&mut self, center: Vec3, transform: Mat3) {
        let corner = |number: u32| {
            let half = |axis: u32| (number >> axis & 1) as f32 - 0.5;
            center + transform * Vec3::new(half(0), half(1), half(2))
        };
        self.add(&BOX, (0..8).map(corner));
    }

    /// Adds a straight rod with open ends.
    fn add_rod(&mut self, [from, to]: [Vec3; 2], radius: f32, sides: u32) {
        let (right, up) = (to - from).normalize().any_orthonormal_pair();
        self.sheet([sides, 1], |u, v| {
            let (s, c) = trig::sin_cos(TAU * u);
            from.lerp(to, v) + (right * c + up * s) * radius
        });
    }

    /// Adds a ball of 512 triangles.
    fn add_ball(&mut self, center: Vec3, radius: f32) {
        let ball = shapes::sphere(8);
        self.add(&ball.triangles, ball.positions.iter().map(|&p| center + p * radius));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::rays::shapes::tests::check;

    #[test]
    fn structures_have_no_flat_triangles() {
        check(&terrain(20), 800);
        check(&boxes(100), 1200);
        check(&rods(100), 1200);
        check(&playground(), 180_000 + 2_000 * (12 + 16 + 512));
        let office = office();
        check(&office, office.triangles.len());
        assert!(office.triangles.len() > 60_000, "{}", office.triangles.len());
    }

    /// Each edge of a box has a triangle on either side, in opposite directions.
    #[test]
    fn boxes_are_closed() {
        let mesh = boxes(1);
        let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let all: Vec<_> = mesh.triangles.iter().flat_map(edges).collect();
        for [a, b] in &all {
            assert_eq!(all.iter().filter(|edge| *edge == &[*b, *a]).count(), 1, "{a} {b}");
        }
    }
}
