//! Skins: meshes that are deformed by the joints of a skeleton. [glTF 2.0, §3.7.3]

use pt_math::{DAffine3, DMat3, DVec3};

use super::GltfReader;
use super::item::Item;
use super::transform::affine;
use crate::LoadError;

impl<'a> GltfReader<'a> {
    /// Returns the transform of each joint of a skin, from bind space to the world. `placed`
    /// returns the transform of a node.
    pub(super) fn joints_of(
        &mut self,
        skin: &Item<'a>,
        placed: impl Fn(usize) -> Option<DAffine3>,
    ) -> Result<Vec<DAffine3>, LoadError> {
        let nodes = skin.wholes("joints")?;
        let inverse = self.accessors.numbers(skin, "inverseBindMatrices", &[16])?;
        let bound = inverse.map_or(Vec::new(), |numbers| numbers.values);
        if !bound.is_empty() && bound.len() / 16 < nodes.len() {
            let message = format!(
                "found {} matrices for {} joints, expected one for each",
                bound.len() / 16,
                nodes.len()
            );
            return Err(skin.refuse("inverseBindMatrices", message));
        }
        let mut bound = bound.as_chunks::<16>().0.iter();
        let joint = |node| {
            let to_world = placed(node).ok_or_else(|| {
                skin.refuse("joints", format!("node {node} is not part of the scene"))
            })?;
            Ok(bound.next().map_or(to_world, |matrix| to_world * affine(matrix)))
        };
        nodes.into_iter().map(joint).collect()
    }
}

/// Applies linear blend skinning to vertices; the weights of each vertex are normalized. Normals
/// are transformed by the inverse transpose, tangents by the transform itself.
pub(super) fn bend(
    influences: &[Vec<(u32, f32)>],
    joints: &[DAffine3],
    positions: &mut [[f32; 3]],
    normals: Option<&mut Vec<[f32; 3]>>,
    tangents: Option<&mut Vec<[f32; 4]>>,
) {
    let bends: Vec<DAffine3> =
        influences.iter().map(|influences| blend(influences, joints)).collect();
    for (position, bend) in positions.iter_mut().zip(&bends) {
        let moved = bend.transform_point3(DVec3::from_array(position.map(f64::from)));
        *position = moved.as_vec3().to_array();
    }
    for (normal, bend) in normals.into_iter().flatten().zip(&bends) {
        let turned = cofactors(&bend.matrix3) * DVec3::from_array(normal.map(f64::from));
        *normal = turned.normalize_or_zero().as_vec3().to_array();
    }
    for ([x, y, z, _], bend) in tangents.into_iter().flatten().zip(&bends) {
        let along = bend.matrix3 * DVec3::from_array([*x, *y, *z].map(f64::from));
        [*x, *y, *z] = along.normalize_or_zero().as_vec3().to_array();
    }
}

/// Returns the inverse transpose times the determinant, which exists for singular matrices as well.
fn cofactors(matrix: &DMat3) -> DMat3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *matrix;
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

/// Returns the weighted mean of the transforms of joints; the identity if there are none.
fn blend(influences: &[(u32, f32)], joints: &[DAffine3]) -> DAffine3 {
    let total: f64 = influences.iter().map(|(_, weight)| f64::from(*weight)).sum();
    // Negative weights have no mean.
    if total <= 0.0 {
        return DAffine3::IDENTITY;
    }
    let mut sum = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
    for (joint, weight) in influences {
        let (share, joint) = (f64::from(*weight) / total, joints[*joint as usize]);
        sum.matrix3 += joint.matrix3 * share;
        sum.translation += joint.translation * share;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_go_with_the_mean_of_their_joints() {
        let joints = [
            DAffine3::from_translation(DVec3::X),
            DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2),
        ];
        let mut positions = [[2.0, 0.0, 0.0]; 3];
        let mut normals = vec![[1.0, 0.0, 0.0]; 3];
        let influences = [vec![(0, 3.0)], vec![(1, 1.0)], vec![(0, 0.5), (1, 0.5)]];
        let mut tangents = vec![[0.0, 1.0, 0.0, -1.0]; 3];
        bend(&influences, &joints, &mut positions, Some(&mut normals), Some(&mut tangents));
        let close = |a: [f32; 3], b: [f32; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-6);
        assert!(close(positions[0], [3.0, 0.0, 0.0]) && close(normals[0], [1.0, 0.0, 0.0]));
        assert!(close(positions[1], [0.0, 2.0, 0.0]) && close(normals[1], [0.0, 1.0, 0.0]));
        assert!(close(positions[2], [1.5, 1.0, 0.0]));
        let half = std::f32::consts::FRAC_1_SQRT_2;
        for (tangent, want) in
            tangents.into_iter().zip([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-half, half, 0.0]])
        {
            let [x, y, z, side] = tangent;
            assert!(close([x, y, z], want) && side == -1.0, "{tangent:?}");
        }
    }
}
