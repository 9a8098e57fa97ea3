//! Smooth normals where a file's own are not wanted.

use pt_math::Vec3;

/// Unit normals at vertices: the sum of the cross products of the triangles around each, which
/// weighs them by area. Vertices without area get zero.
pub(super) fn smooth(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for &corners in triangles {
        let [a, b, c] = corners.map(|i| positions[i as usize]);
        let n = (b - a).cross(c - a);
        corners.iter().for_each(|&i| sums[i as usize] += n);
    }
    sums.into_iter().map(Vec3::normalize_or_zero).collect()
}
