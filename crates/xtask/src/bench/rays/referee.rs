//! Referee for disagreements: a plain loop over all triangles in double precision.

use pt_math::{DVec3, Ray, Vec3};

use super::input::TriangleMesh;

/// Relative difference below which two ray parameters are considered equal.
const SAME: f64 = 1e-5;

/// Nearest hit of a ray as reported by a competitor: the parameter and the triangle.
pub(super) type Claim = Option<(f32, u32)>;

/// Returns true if two claims describe the same point: the same triangle, or, on a shared edge, the
/// same parameter.
pub(super) fn agree(a: Claim, b: Claim) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some((t, p)), Some((u, q))) => p == q || close(f64::from(t), f64::from(u)),
        _ => false,
    }
}

/// Returns true if a claim describes the point found by the referee.
pub(super) fn right(claim: Claim, truth: Option<(f64, u32)>) -> bool {
    match (claim, truth) {
        (None, None) => true,
        (Some((t, p)), Some((u, q))) => p == q || close(f64::from(t), u),
        _ => false,
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

/// Nearest hit of a ray in its open interval, and of several the one with the least number.
pub(super) fn nearest(mesh: &TriangleMesh, ray: &Ray) -> Option<(f64, u32)> {
    let mut best: Option<(f64, u32)> = None;
    for i in 0..mesh.triangles.len() {
        if let Some(t) = hit(mesh.corners(i), ray)
            && best.is_none_or(|(nearest, _)| t < nearest)
        {
            best = Some((t, i as u32));
        }
    }
    best
}

/// Parameter of the intersection of a ray and a triangle, if any.
///
/// With the vertices relative to the origin, the sign of d · (a × b) is the side on which the ray
/// passes an edge from a to b. Swapping a and b changes this sign and nothing else, so that
/// triangles that share an edge agree; 0 counts as inside for both.
fn hit(corners: [Vec3; 3], ray: &Ray) -> Option<f64> {
    let direction = ray.direction.as_dvec3();
    let [a, b, c] = corners.map(|p| p.as_dvec3() - ray.origin.as_dvec3());
    let side = |p: DVec3, q: DVec3| direction.dot(p.cross(q));
    let weights = [side(b, c), side(c, a), side(a, b)];
    let sum: f64 = weights.iter().sum();
    let inside = weights.iter().all(|&w| w >= 0.0) || weights.iter().all(|&w| w <= 0.0);
    if !inside || sum == 0.0 {
        return None;
    }
    let normal = (b - a).cross(c - a);
    let t = normal.dot(a) / normal.dot(direction);
    (t > f64::from(ray.t_min) && t < f64::from(ray.t_max)).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles at z = 2, and one triangle behind it.
    fn square() -> TriangleMesh {
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        TriangleMesh {
            positions: vec![
                at(-1.0, -1.0, 2.0),
                at(1.0, -1.0, 2.0),
                at(1.0, 1.0, 2.0),
                at(-1.0, 1.0, 2.0),
                at(-9.0, -9.0, 5.0),
                at(9.0, -9.0, 5.0),
                at(0.0, 9.0, 5.0),
            ],
            triangles: vec![[4, 5, 6], [0, 1, 2], [0, 2, 3]],
            view: None,
        }
    }

    #[test]
    fn the_nearest_triangle_within_the_interval_is_found() {
        let mesh = square();
        let ray = Ray::new(Vec3::new(0.5, 0.0, 0.0), Vec3::Z);
        assert_eq!(nearest(&mesh, &ray), Some((2.0, 1)));
        assert_eq!(nearest(&mesh, &Ray { t_min: 2.0, ..ray }), Some((5.0, 0)));
        assert_eq!(nearest(&mesh, &Ray { t_max: 2.0, ..ray }), None);
        assert_eq!(nearest(&mesh, &Ray::new(ray.origin, -Vec3::Z)), None);
    }

    #[test]
    fn no_ray_passes_through_a_shared_edge() {
        let mesh = square();
        for i in 1..100 {
            let x = i as f32 / 50.3 - 1.0;
            let target = Vec3::new(x, x, 2.0);
            let origin = Vec3::new(0.3, -0.2, -0.7);
            let (t, _) = nearest(&mesh, &Ray::new(origin, target - origin)).unwrap();
            assert!((t - 1.0).abs() < 1e-6, "{t}");
        }
    }

    #[test]
    fn claims_are_judged_by_point() {
        assert!(agree(Some((1.0, 3)), Some((1.000_005, 4))));
        assert!(!agree(Some((1.0, 3)), Some((1.001, 4))));
        assert!(!agree(None, Some((1.0, 3))));
        assert!(right(Some((2.0, 9)), Some((2.0, 1))));
        assert!(!right(None, Some((2.0, 1))) && right(None, None));
    }
}
