//! Surfaces by two parameters from 0 to 1, as meshes.

use pt_math::DVec3;

use super::single_part;
use crate::{Attribute, Attributes, Mesh};

/// A surface at (u, v): its position and its normal.
pub(crate) type Point = (DVec3, DVec3);

/// The mesh of a surface with so many pieces along u and v. The front is where ∂p/∂u × ∂p/∂v looks,
/// and (u, v) are its texture coordinates.
pub(crate) fn grid(name: &str, [columns, rows]: [u32; 2], at: impl Fn(f64, f64) -> Point) -> Mesh {
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
        positions,
        normals: Some(Attribute { values: normals, indices: None }),
        uvs: Some(Attribute { values: uvs, indices: None }),
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: single_part(triangles.len()),
        triangles,
    }
}
