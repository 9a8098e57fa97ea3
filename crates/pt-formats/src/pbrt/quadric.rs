//! Spheres, disks, cylinders and bilinear patches as meshes: parametric surfaces over [0, 1]².

use std::f64::consts::TAU;

use pt_math::DVec3;
use pt_scene::Mesh;

use crate::shared::grid::grid;

/// Number of segments of a full turn. For radius r, the deviation is at most r (1 − cos(π / 256)) =
/// 7.5 · 10⁻⁵ r.
const TURN: u32 = 256;

/// Number of segments of a partial turn, given in radians.
fn pieces(phi_max: f64) -> u32 {
    ((phi_max / TAU * f64::from(TURN)).ceil() as u32).clamp(1, TURN)
}

/// Returns a direction in the xy plane. Full turns end exactly at their beginning.
fn around(u: f64, phi_max: f64) -> DVec3 {
    let phi = if u == 1.0 && phi_max == TAU { 0.0 } else { u * phi_max };
    let (sin, cos) = libm::sincos(phi);
    DVec3::new(cos, sin, 0.0)
}

/// Creates a part of a sphere between two heights and from +x around to an angle. v increases from
/// the lower to the upper height, linearly in the polar angle.
pub(super) fn sphere(radius: f64, [z_min, z_max]: [f64; 2], phi_max: f64) -> Mesh {
    let polar = |z: f64| libm::acos((z / radius).clamp(-1.0, 1.0));
    let (low, high) = (polar(z_min), polar(z_max));
    let rows = (((low - high) / TAU * f64::from(TURN)).ceil() as u32).clamp(1, TURN);
    grid("sphere", [pieces(phi_max), rows], |u, v| {
        let theta = low + v * (high - low);
        let (sin, cos) = libm::sincos(theta);
        // The poles are exact points.
        let sin =
            if (v == 0.0 && z_min <= -radius) || (v == 1.0 && z_max >= radius) { 0.0 } else { sin };
        let normal = around(u, phi_max) * sin + DVec3::Z * cos;
        (normal * radius, normal)
    })
}

/// Creates a disk or an annulus. v increases from the outer to the inner radius.
pub(super) fn disk(height: f64, [radius, inner]: [f64; 2], phi_max: f64) -> Mesh {
    grid("disk", [pieces(phi_max), 1], |u, v| {
        let r = if v == 1.0 { inner } else { radius + v * (inner - radius) };
        (around(u, phi_max) * r + DVec3::Z * height, DVec3::Z)
    })
}

/// Creates a cylinder around the z axis, open at both ends. v increases with the height.
pub(super) fn cylinder(radius: f64, [z_min, z_max]: [f64; 2], phi_max: f64) -> Mesh {
    grid("cylinder", [pieces(phi_max), 1], |u, v| {
        let normal = around(u, phi_max);
        (normal * radius + DVec3::Z * (z_min + v * (z_max - z_min)), normal)
    })
}

/// Creates a bilinear patch between four corners: p(u, v) = (1 − u)(1 − v) p₀₀ + u (1 − v) p₁₀ + (1
/// − u) v p₀₁ + u v p₁₁.
pub(super) fn patch([p00, p10, p01, p11]: [DVec3; 4], pieces: u32) -> Mesh {
    grid("bilinearmesh", [pieces; 2], |u, v| {
        let across = (p10 - p00) * (1.0 - v) + (p11 - p01) * v;
        let along = (p01 - p00) * (1.0 - u) + (p11 - p10) * u;
        let position = p00 * ((1.0 - u) * (1.0 - v))
            + p10 * (u * (1.0 - v))
            + p01 * ((1.0 - u) * v)
            + p11 * (u * v);
        (position, across.cross(along).normalize_or(DVec3::Z))
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Returns the area, and twice the integral of p · n by the orientation of the triangles.
    /// Checks that the normals agree with the orientation.
    fn area_and_flux(mesh: &Mesh) -> (f64, f64) {
        let (mut area, mut flux) = (0.0, 0.0);
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] =
                triangle.map(|v| DVec3::from_array(mesh.positions[v as usize].map(f64::from)));
            let normal = (b - a).cross(c - a);
            let shading = mesh.normals.as_ref().map(|n| n.values[triangle[0] as usize]);
            let shading = DVec3::from_array(shading.unwrap_or_default().map(f64::from));
            assert!(normal.dot(shading) >= 0.0, "triangle {i}");
            area += 0.5 * normal.length();
            flux += normal.dot(a);
        }
        (area, flux)
    }

    #[test]
    fn areas_are_those_of_the_surfaces_and_fronts_look_outwards() {
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-3;
        let (area, flux) = area_and_flux(&sphere(2.0, [-2.0, 2.0], TAU));
        assert!(close(area, 16.0 * PI) && flux > 0.0);
        let (area, _) = area_and_flux(&sphere(2.0, [-1.0, 1.5], PI));
        assert!(close(area, PI * 2.0 * 2.5));
        let (area, flux) = area_and_flux(&disk(1.0, [2.0, 0.0], TAU));
        assert!(close(area, 4.0 * PI) && flux > 0.0);
        let (area, _) = area_and_flux(&disk(0.0, [2.0, 1.0], 0.5 * PI));
        assert!(close(area, 0.75 * PI));
        let (area, flux) = area_and_flux(&cylinder(0.5, [-1.0, 2.0], TAU));
        assert!(close(area, 3.0 * PI) && flux > 0.0);
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)];
        let (area, _) = area_and_flux(&patch(corners, 1));
        assert!(close(area, 1.0));
    }

    #[test]
    fn v_grows_upwards_on_spheres_and_inwards_on_disks() {
        let uv_of = |mesh: &Mesh, i: usize| mesh.uvs.as_ref().map(|uvs| uvs.values[i]);
        let ball = sphere(1.0, [-1.0, 1.0], TAU);
        let lowest = ball.positions.iter().position(|p| p[2] == -1.0).expect("a pole");
        assert_eq!(uv_of(&ball, lowest).map(|uv| uv[1]), Some(0.0));
        let ring = disk(0.0, [1.0, 0.25], TAU);
        assert_eq!((ring.positions[0], uv_of(&ring, 0)), ([1.0, 0.0, 0.0], Some([0.0, 0.0])));
    }
}
