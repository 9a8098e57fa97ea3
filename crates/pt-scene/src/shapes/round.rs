//! Meshes of round surfaces.

use std::f64::consts::TAU;

use super::single_part;
use crate::{Attribute, Attributes, Mesh};

/// Number of sides of the polygon that approximates a circle. For radius r, its sides are at most r
/// (1 − cos(π / 1024)) = 4.7 · 10⁻⁶ r from the circle, far less than a pixel, and its area is
/// smaller by 6.3 · 10⁻⁶.
const SIDES: u32 = 1024;

/// Returns the disk of radius 1 in the xy plane around the origin; the front is +z. u is the
/// distance from the centre, and v the angle from +x towards +y over a full turn.
///
/// At the centre, where all angles meet, each triangle has the angle of its own axis, which is
/// within 1/2048 of the v of its points.
pub fn disk() -> Mesh {
    let rim = (0..SIDES).map(|i| circle(i, 0.0));
    let positions = std::iter::once([0.0; 3]).chain(rim).collect();
    let triangles: Vec<_> = (0..SIDES).map(|i| [0, 1 + i, 1 + (i + 1) % SIDES]).collect();
    let rim = (0..=SIDES).map(|i| [1.0, share(f64::from(i))]);
    let middles = (0..SIDES).map(|i| [0.0, share(f64::from(i) + 0.5)]);
    let values = rim.chain(middles).collect();
    let indices = (0..SIDES).map(|i| [SIDES + 1 + i, i, i + 1]).collect();
    Mesh {
        name: "disk".to_owned(),
        positions,
        normals: None,
        uvs: Some(Attribute { values, indices: Some(indices) }),
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: single_part(triangles.len()),
        triangles: triangles.into(),
    }
}

/// Returns the sphere of radius 1 around the origin, with normals; the front is outside. u is the
/// longitude from +x towards +y over a full turn, and v the angle from +z over half a turn.
///
/// The triangles are at most 1.6 · 10⁻⁴ inside of the sphere.
pub fn sphere() -> Mesh {
    /// Numbers of meridians, and of intervals of latitude from pole to pole.
    const MERIDIANS: u32 = 256;
    const CIRCLES: u32 = 128;
    let (mut positions, mut uvs) = (Vec::new(), Vec::new());
    for j in 0..=CIRCLES {
        let theta = f64::from(j) / f64::from(CIRCLES);
        let (sin, cos) = libm::sincos(0.5 * TAU * theta);
        for i in 0..=MERIDIANS {
            let phi = f64::from(i) / f64::from(MERIDIANS);
            let (y, x) = libm::sincos(TAU * f64::from(i % MERIDIANS) / f64::from(MERIDIANS));
            // All meridians end at the same point.
            let equator = if j == 0 || j == CIRCLES { 0.0 } else { sin };
            positions.push([equator * x, equator * y, cos].map(|x| x as f32));
            uvs.push([phi, theta].map(|x| x as f32));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..CIRCLES {
        for i in 0..MERIDIANS {
            let north = j * (MERIDIANS + 1) + i;
            let south = north + MERIDIANS + 1;
            if j > 0 {
                triangles.push([north, south, north + 1]);
            }
            if j + 1 < CIRCLES {
                triangles.push([north + 1, south, south + 1]);
            }
        }
    }
    Mesh {
        name: "sphere".to_owned(),
        normals: Some(Attribute { values: positions.clone().into(), indices: None }),
        positions: positions.into(),
        uvs: Some(Attribute { values: uvs.into(), indices: None }),
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: single_part(triangles.len()),
        triangles: triangles.into(),
    }
}

/// Returns the surface of radius 1 around the z axis between z = 0 and z = 1, open at both ends;
/// the front is outside. u is the angle from +x towards +y over a full turn, and v is z.
pub fn cylinder() -> Mesh {
    let ring = |z: f64| (0..SIDES).map(move |i| circle(i, z));
    let positions: Vec<_> = ring(0.0).chain(ring(1.0)).collect();
    let normals = positions.iter().map(|&[x, y, _]| [x, y, 0.0]).collect();
    let values = [0.0, 1.0].map(|v| (0..=SIDES).map(move |i| [share(f64::from(i)), v]));
    let (mut triangles, mut indices) = (Vec::new(), Vec::new());
    for i in 0..SIDES {
        for (all, next, row) in [
            (&mut triangles, (i + 1) % SIDES, SIDES), // positions end where they begin,
            (&mut indices, i + 1, SIDES + 1),         // texture coordinates do not
        ] {
            all.extend([[i, next, row + next], [i, row + next, row + i]]);
        }
    }
    Mesh {
        name: "cylinder".to_owned(),
        positions: positions.into(),
        normals: Some(Attribute { values: normals, indices: None }),
        uvs: Some(Attribute {
            values: values.into_iter().flatten().collect(),
            indices: Some(indices.into()),
        }),
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: single_part(triangles.len()),
        triangles: triangles.into(),
    }
}

/// Returns a corner of the circle of radius 1 at height z.
fn circle(corner: u32, z: f64) -> [f32; 3] {
    let (sin, cos) = libm::sincos(f64::from(corner) / f64::from(SIDES) * TAU);
    [cos as f32, sin as f32, z as f32]
}

/// Returns a number of sides as a fraction of the circle.
fn share(sides: f64) -> f32 {
    (sides / f64::from(SIDES)) as f32
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec2;
    use pt_math::DVec3;

    use super::*;

    fn corners(mesh: &Mesh, triangle: usize) -> [DVec3; 3] {
        mesh.triangles[triangle]
            .map(|i| DVec3::from_array(mesh.positions[i as usize].map(f64::from)))
    }

    /// Returns the total area of all triangles.
    fn area(mesh: &Mesh) -> f64 {
        let of = |i: usize| {
            let [a, b, c] = corners(mesh, i);
            0.5 * (b - a).cross(c - a).length()
        };
        (0..mesh.triangles.len()).map(of).sum()
    }

    #[test]
    fn the_sphere_is_closed_and_looks_outwards() {
        let mesh = sphere();
        let area = area(&mesh);
        assert!((area / (4.0 * PI) - 1.0).abs() < 3e-4, "{area}");
        for i in 0..mesh.triangles.len() {
            let [a, b, c] = corners(&mesh, i);
            let middle = (a + b + c) / 3.0;
            assert!((b - a).cross(c - a).dot(middle) > 0.0);
            let inside = [middle, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
            assert!(inside.iter().all(|p| p.length() > 1.0 - 1.6e-4), "{i}");
        }
    }

    /// Checks at the midpoints of edges and the centres of faces that interpolated texture
    /// coordinates equal those of the surface, modulo a full turn.
    fn check_uvs(mesh: &Mesh, turn_axis: usize, uv_of: impl Fn(DVec3) -> DVec2) {
        let uvs = mesh.uvs.as_ref().unwrap();
        for (i, &triangle) in mesh.triangles.iter().enumerate() {
            let p = corners(mesh, i);
            let uv = uvs
                .corners(i, triangle)
                .map(|c| DVec2::from_array(uvs.values[c as usize].map(f64::from)));
            for w in [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1.0 / 3.0; 3]] {
                let point = p[0] * w[0] + p[1] * w[1] + p[2] * w[2];
                let found = uv[0] * w[0] + uv[1] * w[1] + uv[2] * w[2];
                let mut error = (found - uv_of(point)).abs();
                error[turn_axis] = error[turn_axis].min(1.0 - error[turn_axis]);
                assert!(error.max_element() < 0.5 / f64::from(SIDES) + 1e-5, "{point}: {found}");
            }
        }
    }

    /// Returns the angle from +x over a full turn, in [0, 1).
    fn turn(p: DVec3) -> f64 {
        (p.y.atan2(p.x) / TAU).rem_euclid(1.0)
    }

    #[test]
    fn a_disk_has_its_area_looks_to_z_and_has_polar_coordinates() {
        let mesh = disk();
        assert!((area(&mesh) / PI - 1.0).abs() < 7e-6);
        for i in 0..mesh.triangles.len() {
            let [a, b, c] = corners(&mesh, i);
            assert!((b - a).cross(c - a).z > 0.0);
        }
        check_uvs(&mesh, 1, |p| DVec2::new(p.length(), turn(p)));
    }

    #[test]
    fn a_cylinder_has_its_area_looks_outwards_and_is_open() {
        let mesh = cylinder();
        assert!((area(&mesh) / TAU - 1.0).abs() < 2e-6);
        let normals = mesh.normals.as_ref().unwrap();
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners(&mesh, i);
            let normal = (b - a).cross(c - a).normalize();
            assert!(normal.z.abs() < 1e-6);
            for corner in triangle {
                let smooth = normals.values[*corner as usize].map(f64::from);
                // Half a side from the middle of the facet.
                assert!(normal.dot(DVec3::from_array(smooth)) > (PI / 1000.0).cos());
            }
        }
        assert!(mesh.positions.iter().all(|p| p[2] == 0.0 || p[2] == 1.0));
        check_uvs(&mesh, 0, |p| DVec2::new(turn(p), p.z));
    }
}
