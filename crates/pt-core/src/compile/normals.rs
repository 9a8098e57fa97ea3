//! Vertex normals as the university course's program makes them, which does not use those of
//! files.

use pt_math::Vec3;

/// Unit normals at vertices: the sum of the cross products of the triangles around each, which
/// weighs them by area, turned around at the rim of open meshes. Vertices without area get zero.
///
/// At the rim the course's program walks along the hole instead of around the vertex, which
/// gives flat pieces the opposite normal. Its Cornell boxes rely on it: their walls are wound to
/// face outwards, and lit on the inside.
pub(super) fn course(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for &corners in triangles {
        let [a, b, c] = corners.map(|i| positions[i as usize]);
        let n = (b - a).cross(c - a);
        for i in corners {
            sums[i as usize] += n;
        }
    }
    let mut normals: Vec<_> = sums.into_iter().map(Vec3::normalize_or_zero).collect();
    for vertex in rim(triangles, positions.len()) {
        normals[vertex] = -normals[vertex];
    }
    normals
}

/// The vertices at which an edge has a triangle on one side only.
fn rim(triangles: &[[u32; 3]], vertices: usize) -> Vec<usize> {
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    let mut on_rim = vec![false; vertices];
    for same in edges.chunk_by(|a, b| a == b) {
        if let &[[a, b]] = same {
            (on_rim[a as usize], on_rim[b as usize]) = (true, true);
        }
    }
    (0..vertices).filter(|&v| on_rim[v]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_meshes_face_outwards_and_open_ones_turn_around() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let closed = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let normals = course(&corners, &closed);
        assert!(normals[1].x > 0.0 && normals[2].y > 0.0 && normals[0].dot(Vec3::ONE) < 0.0);
        assert_eq!(course(&corners[..3], &[[0, 1, 2]]), [Vec3::NEG_Z; 3]);
    }
}
