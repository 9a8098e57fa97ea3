//! Triangulated spheres, for those that are stretched.

use pt_math::DVec3;
use pt_scene::{Attribute, Mesh};

/// A sphere of radius 1 as 16,128 triangles with exact normals.
pub(super) fn unit_sphere_mesh() -> Mesh {
    const RINGS: u32 = 64;
    const SECTORS: u32 = 128;
    let point = |ring: u32, sector: u32| {
        let theta = f64::from(ring) / f64::from(RINGS) * std::f64::consts::PI;
        let phi = f64::from(sector) / f64::from(SECTORS) * std::f64::consts::TAU;
        let (sin, cos) = libm::sincos(theta);
        let (s, c) = libm::sincos(phi);
        DVec3::new(sin * c, cos, -sin * s).as_vec3().to_array()
    };
    let positions: Vec<_> = (0..=RINGS)
        .flat_map(|r| (0..SECTORS).map(move |s| (r, s)))
        .map(|(r, s)| point(r, s))
        .collect();
    let at = |ring: u32, sector: u32| ring * SECTORS + sector % SECTORS;
    let mut triangles = Vec::new();
    for r in 0..RINGS {
        for s in 0..SECTORS {
            let quad = [at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s + 1)];
            if r > 0 {
                triangles.push([quad[0], quad[1], quad[3]]);
            }
            if r + 1 < RINGS {
                triangles.push([quad[1], quad[2], quad[3]]);
            }
        }
    }
    let normals = Some(Attribute { values: positions.clone().into(), indices: None });
    Mesh {
        name: "sphere".into(),
        positions: positions.into(),
        triangles: triangles.into(),
        normals,
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use pt_math::Vec3;

    use super::*;

    #[test]
    fn the_triangle_sphere_faces_outwards() {
        let mesh = unit_sphere_mesh();
        assert_eq!(mesh.triangles.len(), 16_128);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| Vec3::from_array(mesh.positions[i as usize]));
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{t:?}");
        }
    }
}
