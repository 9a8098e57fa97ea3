//! Meshes from which scenes are composed.

use std::collections::HashMap;

use pt_math::{DVec3, Vec3, trig};

use super::scene::PeerMesh;

/// Positions, and triangles that index them.
pub(super) type IndexedTriangles = (Vec<Vec3>, Vec<[u32; 3]>);

impl PeerMesh {
    /// Adds a parallelogram: a corner, and two sides whose cross product points outside.
    #[must_use]
    pub(super) fn quad(self, a: impl Into<Vec3>, u: impl Into<Vec3>, v: impl Into<Vec3>) -> Self {
        let (a, u, v) = (a.into(), u.into(), v.into());
        self.with(vec![a, a + u, a + u + v, a + v], &[[0, 1, 2], [0, 2, 3]])
    }

    /// Adds a box with the given center, rotated about +y.
    #[must_use]
    pub(super) fn cuboid(
        self,
        centre: impl Into<Vec3>,
        half: impl Into<Vec3>,
        degrees: f32,
    ) -> Self {
        let (centre, half) = (centre.into(), half.into());
        let (sin, cos) = trig::sin_cos(degrees.to_radians());
        let corner = |i: u8| {
            let signs = [2, 1, 0].map(|bit| if i >> bit & 1 == 0 { -1.0 } else { 1.0 });
            let Vec3 { x, y, z } = Vec3::from(signs) * half;
            Vec3::new(cos * x + sin * z, y, cos * z - sin * x) + centre
        };
        let faces =
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles: Vec<_> =
            faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        self.with((0..8).map(corner).collect(), &triangles)
    }

    /// Adds a sphere of 12n² triangles.
    #[must_use]
    pub(super) fn ball(self, n: u32, centre: impl Into<Vec3>, radius: f32) -> Self {
        let centre = centre.into();
        let (positions, triangles) = sphere(n);
        let place = |p: &DVec3| p.as_vec3() * radius + centre;
        self.with(positions.iter().map(place).collect(), &triangles)
    }
}

/// Unit sphere, from a cube with n × n squares on each face, whose lines have equal angles between
/// them: 12n² triangles.
pub(super) fn sphere(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let line = |i: u32| {
        let angle = (f64::from(i) / f64::from(n) * 2.0 - 1.0) * std::f64::consts::FRAC_PI_4;
        if i == n { 1.0 } else { libm::tan(angle) }
    };
    let (mut numbers, mut positions, mut triangles) = (HashMap::new(), Vec::new(), Vec::new());
    for (axis, end) in (0..3).flat_map(|axis| [(axis, 0), (axis, n)]) {
        let mut at = |i: u32, j: u32| {
            let mut lines = [end; 3];
            (lines[(axis + 1) % 3], lines[(axis + 2) % 3]) = (i, j);
            *numbers.entry(lines).or_insert_with(|| {
                positions.push(DVec3::from(lines.map(line)).normalize());
                positions.len() as u32 - 1
            })
        };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let outward = |[a, b, c]: [u32; 3]| if end == 0 { [c, b, a] } else { [a, b, c] };
            triangles.extend([[a, b, c], [a, c, d]].map(outward));
        }
    }
    (positions, triangles)
}

/// Sphere displaced by six octaves of noise: lobes, and bumps on them. It fits a ball of `radius`,
/// has its center at `x` and `z`, and stands on `floor`.
pub(super) fn blob(n: u32, radius: f64, [x, floor, z]: [f64; 3]) -> IndexedTriangles {
    let (mut positions, triangles) = sphere(n);
    for p in &mut positions {
        let octave = |o: u32| {
            let (scale, height) = (f64::from(1 << o) * 2.3, 0.42 * libm::pow(0.52, f64::from(o)));
            noise(*p * scale + 100.0, u64::from(o)) * height
        };
        *p *= 1.0 + (0..6).map(octave).sum::<f64>();
    }
    let farthest = positions.iter().map(|p| p.length()).fold(0.0, f64::max);
    for p in &mut positions {
        *p *= radius / farthest;
    }
    let lowest = positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let offset = DVec3::new(x, floor - lowest, z);
    (positions.iter().map(|&p| (p + offset).as_vec3()).collect(), triangles)
}

/// Value noise in (−1, 1): hashes of the corners of a unit lattice, interpolated with the quintic
/// of Perlin. [Perlin 2002, "Improving Noise", §2] Coordinates are positive.
fn noise(p: DVec3, seed: u64) -> f64 {
    let corner = p.floor();
    let fraction = (p - corner).to_array();
    let fade = fraction.map(|f| f * f * f * (f * (f * 6.0 - 15.0) + 10.0));
    let cell = corner.to_array().map(|c| c as u64);
    let value = |i: usize| {
        let side = [i >> 2 & 1, i >> 1 & 1, i & 1];
        let weights = [0, 1, 2].map(|a| if side[a] == 1 { fade[a] } else { 1.0 - fade[a] });
        lattice([0, 1, 2].map(|a| cell[a] + side[a] as u64), seed) * weights.iter().product::<f64>()
    };
    (0..8).map(value).sum()
}

/// Pseudorandom number in [−1, 1] for each point of a lattice.
fn lattice([x, y, z]: [u64; 3], seed: u64) -> f64 {
    let mixed = x.wrapping_mul(73_856_093)
        ^ y.wrapping_mul(19_349_663)
        ^ z.wrapping_mul(83_492_791)
        ^ seed.wrapping_mul(2_654_435_761);
    let spread = (mixed ^ (mixed >> 13)).wrapping_mul(1_274_126_177) & 0xffff_ffff;
    ((spread ^ (spread >> 16)) & 0xff_ffff) as f64 / f64::from(0xff_ffff) * 2.0 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume that triangles enclose, positive if they face outward.
    fn volume((positions, triangles): (&[Vec3], &[[u32; 3]])) -> f32 {
        let corner = |i: u32| positions[i as usize];
        triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum()
    }

    #[test]
    fn boxes_and_balls_are_closed_and_face_outward() {
        use super::super::scene::PeerSurface;
        let empty = || PeerMesh::new("", PeerSurface::Diffuse([0.0; 3]));
        let cuboid = empty().cuboid([0.0; 3], [1.0, 2.0, 3.0], 30.0);
        assert!((volume((&cuboid.positions, &cuboid.triangles)) - 6.0 * 48.0).abs() < 1e-3);
        let ball = empty().ball(40, [0.0; 3], 1.0);
        let exact = 8.0 * std::f32::consts::PI;
        let found = volume((&ball.positions, &ball.triangles));
        assert!((found / exact - 1.0).abs() < 2e-3, "{found}");
        // Euler: V − E + F = 2, with 3F = 2E.
        assert_eq!(ball.positions.len(), ball.triangles.len() / 2 + 2);
    }

    #[test]
    fn noise_meets_its_lattice() {
        let p = DVec3::new(7.0, 12.0, 3.0);
        assert_eq!(noise(p, 4), lattice([7, 12, 3], 4));
        assert!((noise(p + 1e-7, 4) - noise(p, 4)).abs() < 1e-12);
    }
}
