//! Transforms of nodes, which must be decomposable into translation, rotation and scale. [glTF 2.0,
//! §3.5.3]

use pt_math::{DAffine3, DMat3, DVec3};
use serde_json::{Map, Value};

/// Cosine of the angle between two axes below which they count as orthogonal.
const ORTHOGONAL: f64 = 1e-6;
/// Maximum number of Jacobi rotations; four or five suffice for double precision.
const MAX_SWEEPS: usize = 32;

/// Transform of a node, with an additional parent node if a single one cannot represent it.
pub(super) struct Place {
    /// Fields of the parent: a scale that is not along the axes of the node.
    pub(super) parent: Option<Map<String, Value>>,
    /// Fields of the node: the remaining transform.
    pub(super) node: Map<String, Value>,
}

/// Decomposes a transform into the fields of one or two nodes.
pub(super) fn place(to_parent: DAffine3) -> Place {
    if has_orthogonal_axes(&to_parent.matrix3) {
        return Place { parent: None, node: fields(to_parent) };
    }
    // M = (M V) Vᵀ; if the columns of V are the eigenvectors of Mᵀ M, the columns of M V are
    // orthogonal.
    let turn = eigenvectors(to_parent.matrix3.transpose() * to_parent.matrix3);
    let stretched = DAffine3 { matrix3: to_parent.matrix3 * turn, ..to_parent };
    let turned = DAffine3 { matrix3: turn.transpose(), translation: DVec3::ZERO };
    Place { parent: Some(fields(stretched)), node: fields(turned) }
}

fn fields(to_parent: DAffine3) -> Map<String, Value> {
    let mut fields = Map::new();
    let DAffine3 { matrix3, translation } = to_parent;
    if matrix3 != DMat3::IDENTITY {
        let columns = [matrix3.x_axis, matrix3.y_axis, matrix3.z_axis].map(|axis| axis.extend(0.0));
        let all = columns.into_iter().chain([translation.extend(1.0)]);
        let matrix: Vec<f64> = all.flat_map(|column| column.to_array()).collect();
        fields.insert("matrix".to_owned(), matrix.into());
    } else if translation != DVec3::ZERO {
        fields.insert("translation".to_owned(), translation.to_array().to_vec().into());
    }
    fields
}

fn has_orthogonal_axes(m: &DMat3) -> bool {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::normalize_or_zero);
    [x.dot(y), y.dot(z), z.dot(x)].iter().all(|cos| cos.abs() < ORTHOGONAL)
}

/// Returns unit eigenvectors of a symmetric matrix as the columns of a rotation, by Jacobi
/// rotations. [Jacobi 1846; Golub & Van Loan 2013, "Matrix Computations", §8.5]
fn eigenvectors(mut symmetric: DMat3) -> DMat3 {
    let mut vectors = DMat3::IDENTITY;
    for sweep in 0..MAX_SWEEPS {
        let (p, q) = [(0, 1), (1, 2), (0, 2)][sweep % 3];
        let (first, second) = (symmetric.col(p)[p], symmetric.col(q)[q]);
        let between = symmetric.col(q)[p];
        if between == 0.0 {
            continue;
        }
        let (sin, cos) = libm::sincos(0.5 * libm::atan2(2.0 * between, first - second));
        let mut turn = DMat3::IDENTITY;
        turn.col_mut(p)[p] = cos;
        turn.col_mut(p)[q] = sin;
        turn.col_mut(q)[p] = -sin;
        turn.col_mut(q)[q] = cos;
        symmetric = turn.transpose() * symmetric * turn;
        vectors *= turn;
    }
    vectors
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(fields: &Map<String, Value>) -> DMat3 {
        let numbers = fields["matrix"].as_array().expect("a list");
        let column = |c: usize| {
            DVec3::from_array(std::array::from_fn(|r| {
                numbers[4 * c + r].as_f64().expect("a number")
            }))
        };
        DMat3::from_cols(column(0), column(1), column(2))
    }

    #[test]
    fn what_is_sheared_takes_two_nodes_with_orthogonal_axes() {
        let sheared = [
            DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.0), DVec3::new(-3.0, 0.2, 5.0)),
            DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::NEG_Z),
            DMat3::from_cols(
                DVec3::X * 1e3,
                DVec3::new(1.0, 1e-3, 0.0),
                DVec3::new(0.0, 1e-3, 1.0),
            ),
        ];
        for sheared in sheared {
            let placed = place(DAffine3 { matrix3: sheared, translation: DVec3::ONE });
            let parent = matrix(&placed.parent.expect("two nodes"));
            let node = matrix(&placed.node);
            for m in [parent, node] {
                assert!(has_orthogonal_axes(&m), "{m}");
            }
            assert!((node.determinant() - 1.0).abs() < 1e-12);
            let size = sheared.abs_diff_eq(parent * node, 1e-12 * sheared.x_axis.length().max(5.0));
            assert!(size, "{sheared} {}", parent * node);
        }
    }

    #[test]
    fn one_node_is_enough_for_what_is_turned_and_stretched_along_its_axes() {
        let turned =
            DAffine3::from_rotation_y(0.3) * DAffine3::from_scale(DVec3::new(1.0, -2.0, 3.0));
        let placed = place(turned);
        assert!(placed.parent.is_none());
        assert_eq!(matrix(&placed.node), turned.matrix3);
        assert!(place(DAffine3::IDENTITY).node.is_empty());
        assert!(place(DAffine3::from_translation(DVec3::X)).node.contains_key("translation"));
    }
}
