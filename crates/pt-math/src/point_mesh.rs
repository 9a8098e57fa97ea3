//! Proximity of points to surfaces.

use crate::{Bounds3, Vec3};

/// Returns true if a point is on one of the triangles, to within a thousandth of the diagonal of
/// their bounds.
pub fn touches_triangles(p: Vec3, triangles: impl Iterator<Item = [Vec3; 3]> + Clone) -> bool {
    let bounds: Bounds3 = triangles.clone().flatten().collect();
    let size = if bounds.is_empty() { 0.0 } else { bounds.diagonal().length() };
    let near = 1e-3 * if size > 0.0 { size } else { 1.0 };
    let mut triangles = triangles;
    triangles.any(|t| distance_to_triangle(p, t) <= near)
}

/// Distance of a point from a triangle: to its plane if the foot point is inside, else to the
/// nearest edge.
fn distance_to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let n = (b - a).cross(c - a);
    let inside = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(n) >= 0.0;
    if n != Vec3::ZERO && inside(a, b) && inside(b, c) && inside(c, a) {
        return (p - a).dot(n.normalize()).abs();
    }
    let to_edge = |from: Vec3, to: Vec3| {
        let e = to - from;
        let t = ((p - from).dot(e) / e.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p - from - e * t).length()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_triangle() {
        let t = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0];
        let cases = [
            (Vec3::new(0.5, 0.5, 0.25), 0.25),
            (Vec3::new(-3.0, 0.0, 4.0), 5.0),
            (Vec3::new(1.0, -2.0, 0.0), 2.0),
            (Vec3::new(2.0, 2.0, 0.0), 2f32.sqrt()),
        ];
        for (p, want) in cases {
            assert!((distance_to_triangle(p, t) - want).abs() < 1e-6, "{p}");
        }
    }

    /// Points at half a thousandth of the diagonal are on the triangles, points at two thousandths
    /// are not.
    #[test]
    fn what_is_near_is_on_triangles() {
        let triangles = [[Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 4.0]];
        let on = |z: f32| touches_triangles(Vec3::new(0.5, 0.5, z), triangles.into_iter());
        assert!(on(0.0) && on(0.002) && !on(0.01));
        assert!(!touches_triangles(Vec3::ZERO, std::iter::empty()));
    }
}
