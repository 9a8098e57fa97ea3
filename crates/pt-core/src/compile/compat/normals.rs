//! Vertex normals of the program, which does not use those of files.

use pt_math::Vec3;

/// Unit normals at vertices: the sum of the cross products of the adjacent triangles, which are
/// thus weighted by area. Vertices without area get zero.
///
/// At the boundary of an open mesh the program walks around the wrong vertex: the normal
/// at p is the sum of (a − p) × (n − p) over the neighbours n of a, where a is the vertex before p
/// along the boundary. This inverts the normals of flat meshes. The Cornell boxes of the course
/// rely on that: their walls are wound to face outwards, and lit on the inside.
pub(super) fn vertex_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for &corners in triangles {
        let [a, b, c] = corners.map(|i| positions[i as usize]);
        let n = (b - a).cross(c - a);
        for i in corners {
            sums[i as usize] += n;
        }
    }
    let edges = DirectedEdges::new(triangles);
    for [before, p] in edges.rim() {
        let origin = positions[p as usize];
        let arm = positions[before as usize] - origin;
        let around = edges.from(before).chain(edges.to(before));
        let mut ends: Vec<u32> = around.collect();
        ends.sort_unstable();
        ends.dedup();
        sums[p as usize] = ends.iter().map(|&n| arm.cross(positions[n as usize] - origin)).sum();
    }
    sums.into_iter().map(Vec3::normalize_or_zero).collect()
}

/// Directed edges of triangles, for look-ups by either end.
struct DirectedEdges {
    by_start: Vec<[u32; 2]>,
    by_end: Vec<[u32; 2]>,
}

impl DirectedEdges {
    fn new(triangles: &[[u32; 3]]) -> Self {
        let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut by_start: Vec<_> = edges.collect();
        let mut by_end: Vec<_> = by_start.iter().map(|&[a, b]| [b, a]).collect();
        by_start.sort_unstable();
        by_end.sort_unstable();
        Self { by_start, by_end }
    }

    /// End vertices of the edges from a vertex.
    fn from(&self, v: u32) -> impl Iterator<Item = u32> {
        Self::of(&self.by_start, v)
    }

    /// Start vertices of the edges to a vertex.
    fn to(&self, v: u32) -> impl Iterator<Item = u32> {
        Self::of(&self.by_end, v)
    }

    fn of(sorted: &[[u32; 2]], v: u32) -> impl Iterator<Item = u32> {
        let start = sorted.partition_point(|e| e[0] < v);
        sorted[start..].iter().take_while(move |e| e[0] == v).map(|e| e[1])
    }

    /// Edges with a triangle on one side only, in the direction of that triangle.
    fn rim(&self) -> impl Iterator<Item = [u32; 2]> {
        let alone = |&[a, b]: &[u32; 2]| self.by_start.binary_search(&[b, a]).is_err();
        self.by_start.iter().copied().filter(alone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_meshes_face_outwards_and_open_ones_turn_around() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let closed = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let normals = vertex_normals(&corners, &closed);
        assert!(normals[1].x > 0.0 && normals[2].y > 0.0 && normals[0].dot(Vec3::ONE) < 0.0);
        assert_eq!(vertex_normals(&corners[..3], &[[0, 1, 2]]), [Vec3::NEG_Z; 3]);
    }
}
