//! Tessellation of parametric surfaces, with parameters from 0 to 1.

use pt_math::DVec3;
use pt_scene::shapes::single_part;
use pt_scene::{Attribute, Attributes, Mesh};

/// Position and normal of a surface at (u, v).
pub(crate) type GridPoint = (DVec3, DVec3);

/// Returns the mesh of a surface with these numbers of pieces along u and v. The front is in the
/// direction of ∂p/∂u × ∂p/∂v, and the texture coordinates are (u, v).
pub(crate) fn grid(
    name: &str,
    [columns, rows]: [u32; 2],
    at: impl Fn(f64, f64) -> GridPoint,
) -> Mesh {
    let share = |i: u32, count: u32| f64::from(i) / f64::from(count);
    let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (share(i, columns), share(j, rows));
            let (position, normal) = at(u, v);
            positions.push(position.as_vec3().to_array());
            normals.push(normal.as_vec3().to_array());
            uvs.push([u as f32, v as f32]);
        }
    }
    let mut triangles = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let [a, b] = [0, 1].map(|row| (j + row) * (columns + 1) + i);
            for corners in [[a, a + 1, b + 1], [a, b + 1, b]] {
                let [p, q, r] = corners.map(|corner| positions[corner as usize]);
                if p != q && q != r && r != p {
                    triangles.push(corners);
                }
            }
        }
    }
    Mesh {
        name: name.to_owned(),
        positions: positions.into(),
        normals: Some(Attribute { values: normals.into(), indices: None }),
        uvs: Some(Attribute { values: uvs.into(), indices: None }),
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: single_part(triangles.len()),
        triangles: triangles.into(),
    }
}
