//! Generated meshes, which are the same on every machine.

use std::collections::HashMap;
use std::f32::consts::{PI, TAU};

use pt_math::{Vec3, trig, warp};

use super::input::{PinholeCamera, TriangleMesh};
use super::random::random as numbers;

/// A sphere with lobes and bumps: 8n² triangles, closed, without a preferred direction.
pub(super) fn blob(n: i32) -> TriangleMesh {
    subdivided(n, displaced)
}

/// The unit sphere as 8n² triangles.
pub(super) fn sphere(n: i32) -> TriangleMesh {
    subdivided(n, |p| p)
}

/// A sphere from an octahedron with `n` segments along each edge, with vertices at `place` of
/// points of the unit sphere.
fn subdivided(n: i32, place: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
    // On the octahedron |x| + |y| + |z| = n, vertices are the points with integer coordinates.
    let (mut numbers, mut mesh) = (HashMap::new(), TriangleMesh::default());
    for octant in 0..8 {
        let sign = [1, 2, 4].map(|bit| if octant & bit == 0 { 1 } else { -1 });
        let mut at = |i: i32, j: i32| {
            let p = [sign[0] * i, sign[1] * j, sign[2] * (n - i - j)];
            *numbers.entry(p).or_insert_with(|| {
                mesh.positions.push(place(Vec3::from_array(p.map(|c| c as f32)).normalize()));
                mesh.positions.len() as u32 - 1
            })
        };
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < n {
                mesh.triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

/// A point of the unit sphere, displaced along its normal by waves from large to fine.
fn displaced(p: Vec3) -> Vec3 {
    let wave = |octave: i32| {
        let frequency = 2.6 * 2.0f32.powi(octave);
        // Waves of each octave run in their own directions.
        let q = p * frequency + Vec3::new(1.3, 2.1, 0.7) * octave as f32;
        let turned = Vec3::new(q.y + 0.4 * q.z, q.z + 0.4 * q.x, q.x + 0.4 * q.y);
        sin(q.x + sin(turned.x)) * sin(q.y + sin(turned.y)) * sin(q.z + sin(turned.z))
    };
    let height: f32 = (0..6).map(|octave| wave(octave) * 0.45 * 0.5f32.powi(octave)).sum();
    p * (1.0 + height)
}

/// A hall of columns, arches, drapes, plants and statues, of a third of a million triangles between
/// 60 m and a few centimetres long, with `ropes` diagonal ropes of long thin triangles. It is a
/// soup: parts intersect each other, and its walls are single sheets.
pub(super) fn hall(ropes: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh { view: Some(HALL_VIEW), ..TriangleMesh::default() };
    shell(&mut mesh);
    for (i, (x, side)) in places(COLUMNS).enumerate() {
        for storey in [0.0, STOREY] {
            column(&mut mesh, Vec3::new(x, storey, AISLE * side));
        }
        if i / 2 + 1 < COLUMNS {
            for storey in [0.0, STOREY] {
                arch(&mut mesh, Vec3::new(x, storey + 7.5, AISLE * side));
            }
            drape(&mut mesh, Vec3::new(x, 7.0, AISLE * side), i);
        }
    }
    for (i, (x, side)) in places(PLANTS).enumerate() {
        plant(&mut mesh, Vec3::new(x + 2.0, 0.0, (AISLE - 2.5) * side), i);
    }
    for x in [-LENGTH + 3.0, LENGTH - 3.0] {
        let statue = blob(60);
        mesh.add(
            &statue.triangles,
            statue.positions.iter().map(|&p| p * 2.0 + Vec3::new(x, 4.0, 0.0)),
        );
    }
    (0..ropes).for_each(|i| rope(&mut mesh, i));
    mesh
}

/// Half the length and half the width of the hall, its height, the height of its lower storey, and
/// the distance of columns from the middle, in metres.
const LENGTH: f32 = 30.0;
const WIDTH: f32 = 15.0;
const HEIGHT: f32 = 24.0;
const STOREY: f32 = 10.5;
const AISLE: f32 = 8.0;
/// Numbers of columns and plants along each side.
const COLUMNS: usize = 11;
const PLANTS: usize = 6;
/// View from one end along the hall.
const HALL_VIEW: PinholeCamera = PinholeCamera {
    eye: Vec3::new(-25.0, 5.5, 2.5),
    look: Vec3::new(20.0, 7.5, -2.0),
    fov_degrees: 65.0,
};

/// `count` positions along the hall, each on both sides: x, and the sign of z.
fn places(count: usize) -> impl Iterator<Item = (f32, f32)> {
    let step = 52.0 / count as f32;
    (0..count).flat_map(move |i| [-1.0, 1.0].map(|side| (-26.0 + step * i as f32, side)))
}

/// Distance between columns.
const BAY: f32 = 52.0 / COLUMNS as f32;

/// Floor, walls, galleries, and a vault with ribs.
fn shell(mesh: &mut TriangleMesh) {
    let size = Vec3::new(2.0 * LENGTH, HEIGHT, 2.0 * WIDTH);
    let corner = Vec3::new(-LENGTH, 0.0, -WIDTH);
    // Boards as long as the hall.
    mesh.sheet([2, 120], |u, v| corner + size * Vec3::new(u, 0.0, v));
    for side in [0.0, 1.0] {
        mesh.sheet([3, 16], |u, v| corner + size * Vec3::new(u, v, side));
        mesh.sheet([3, 16], |u, v| corner + size * Vec3::new(side, v, u));
    }
    for side in [-1.0, 1.0] {
        mesh.sheet([40, 2], |u, v| {
            Vec3::new(corner.x + size.x * u, STOREY - 0.6, side * (AISLE + (WIDTH - AISLE) * v))
        });
    }
    mesh.sheet([220, 40], |u, v| {
        let rib = 0.25 * sin(u * TAU * COLUMNS as f32).max(0.0);
        let (s, c) = trig::sin_cos(PI * v);
        Vec3::new(corner.x + size.x * u, HEIGHT - 6.0 + (6.0 - rib) * s, -(WIDTH - rib) * c)
    });
}

/// A fluted column with base and capital that stands on `foot`.
fn column(mesh: &mut TriangleMesh, foot: Vec3) {
    mesh.sheet([44, 25], |u, v| {
        let y = 9.5 * v;
        let flute = 1.0 + 0.05 * sin(TAU * 11.0 * u);
        let end = (0.5 - v).abs() * 2.0;
        let radius = if end > 0.9 { 1.2 } else { (0.85 - 0.1 * v) * flute };
        let (s, c) = trig::sin_cos(TAU * u);
        foot + Vec3::new(radius * c, y, radius * s)
    });
}

/// The inside of a round arch from the column at `spring` to the next.
fn arch(mesh: &mut TriangleMesh, spring: Vec3) {
    mesh.sheet([36, 4], |u, v| {
        let (s, c) = trig::sin_cos(PI * u);
        spring + Vec3::new(BAY * (0.5 - 0.45 * c), 2.2 * s, 1.6 * (v - 0.5))
    });
}

/// A wavy cloth between two columns.
fn drape(mesh: &mut TriangleMesh, top: Vec3, number: usize) {
    let phase = numbers(4, number).between(0.0, TAU);
    mesh.sheet([64, 38], |u, v| {
        let fold = (0.1 + 0.35 * v) * sin(38.0 * u + phase) + 0.2 * sin(7.0 * v + phase);
        let hem = 0.85 + 0.15 * sin(5.0 * u + phase);
        top + Vec3::new(0.6 + (BAY - 1.2) * u, -5.5 * v * hem, fold)
    });
}

/// A vase with 2600 loose leaves.
fn plant(mesh: &mut TriangleMesh, foot: Vec3, number: usize) {
    mesh.sheet([40, 20], |u, v| {
        let radius = 0.35 + 0.4 * sin(PI * (0.15 + 0.8 * v));
        let (s, c) = trig::sin_cos(TAU * u);
        foot + Vec3::new(radius * c, 1.8 * v, radius * s)
    });
    for leaf in 0..2600 {
        let mut random = numbers(5, number * 2600 + leaf);
        let outward = warp::uniform_sphere(random.unit_2d());
        let center = foot + Vec3::new(0.0, 3.2, 0.0) + outward * (1.5 * random.unit());
        let along = warp::uniform_sphere(random.unit_2d()) * random.between(0.05, 0.25);
        let across = along.any_orthogonal_vector().normalize() * (0.35 * along.length());
        let tips = [center + along, center - along * 0.5 + across, center - along * 0.5 - across];
        mesh.add(&[[0, 1, 2]], tips);
    }
}

/// A straight rope with six sides across the hall.
fn rope(mesh: &mut TriangleMesh, number: usize) {
    let mut random = numbers(6, number);
    let mut end = |low: f32| {
        let side = if random.unit() < 0.5 { -AISLE } else { AISLE };
        Vec3::new(random.between(-28.0, 28.0), random.between(low, 20.0), side)
    };
    let (from, to) = (end(12.0), end(8.0));
    let (right, up) = (to - from).normalize_or(Vec3::X).any_orthonormal_pair();
    mesh.sheet([6, 1], |u, v| {
        let (s, c) = trig::sin_cos(TAU * u);
        from.lerp(to, v) + (right * c + up * s) * 0.04
    });
}

fn sin(x: f32) -> f32 {
    trig::sin_cos(x).0
}

impl TriangleMesh {
    /// Adds triangles with their own vertices.
    pub(super) fn add(
        &mut self,
        triangles: &[[u32; 3]],
        positions: impl IntoIterator<Item = Vec3>,
    ) {
        let base = self.positions.len() as u32;
        self.positions.extend(positions);
        self.triangles.extend(triangles.iter().map(|t| t.map(|i| base + i)));
    }

    /// Adds a sheet of `n` × `m` squares, each of two triangles, with vertices at `point(u, v)` for
    /// u and v in [0, 1].
    pub(super) fn sheet(&mut self, [n, m]: [u32; 2], point: impl Fn(f32, f32) -> Vec3) {
        let base = self.positions.len() as u32;
        for i in 0..=n {
            let row = (0..=m).map(|j| point(i as f32 / n as f32, j as f32 / m as f32));
            self.positions.extend(row);
        }
        for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
            let a = base + i * (m + 1) + j;
            let [b, c, d] = [a + m + 1, a + m + 2, a + 1];
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Asserts the number of triangles, and that they are valid.
    pub(in super::super) fn check(mesh: &TriangleMesh, triangles: usize) {
        assert_eq!(mesh.triangles.len(), triangles);
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        let last = mesh.positions.len() as u32 - 1;
        assert!(mesh.triangles.iter().flatten().all(|&i| i <= last));
        let flat = (0..triangles).filter(|&i| {
            let [a, b, c] = mesh.corners(i).map(Vec3::as_dvec3);
            (b - a).cross(c - a).length() < 1e-12
        });
        assert_eq!(flat.count(), 0);
    }

    #[test]
    fn a_blob_is_closed_and_has_eight_n_squared_triangles() {
        let mesh = blob(20);
        check(&mesh, 8 * 20 * 20);
        // Euler: V − E + F = 2 with E = 3F/2.
        assert_eq!(mesh.positions.len(), 2 + mesh.triangles.len() / 2);
    }

    #[test]
    fn ropes_are_added_to_the_hall() {
        let plain = hall(0);
        check(&plain, 332_384);
        check(&hall(260), 332_384 + 260 * 12);
        let size = plain.bounds().diagonal();
        assert!((size.x - 2.0 * LENGTH).abs() < 0.1 && (size.y - HEIGHT).abs() < 0.1, "{size}");
    }
}
