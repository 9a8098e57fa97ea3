//! Closed forms of the unoccluded irradiance of lights of radiance 1: ∫ cos θ dω over the
//! directions in which a surface element sees the light.

use std::f64::consts::PI;

use pt_math::DVec3;

/// Irradiance at `p`, on a surface with unit normal `n`, due to a convex polygon with these corners
/// that emits towards `p`: half the sum over its edges of the angle of the edge times the cosine of
/// the plane through the edge and `p`. The part below the horizon is ignored. [Lambert 1760; Baum,
/// Rushmeier & Winget 1989, eq. 7]
pub fn of_polygon(corners: &[DVec3], p: DVec3, n: DVec3) -> f64 {
    let seen: Vec<DVec3> = corners.iter().map(|&c| c - p).collect();
    let polygon = above_horizon(&seen, n);
    let edge = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let cross = a.cross(b);
        cross.length().atan2(a.dot(b)) * cross.normalize_or_zero().dot(n)
    };
    (0.5 * (0..polygon.len()).map(edge).sum::<f64>()).abs()
}

/// Part of a convex polygon with d·n ≥ 0. [Sutherland & Hodgman 1974]
fn above_horizon(polygon: &[DVec3], n: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha >= 0.0 {
            kept.push(a);
        }
        if (ha >= 0.0) != (hb >= 0.0) {
            kept.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    kept
}

/// Irradiance at `p` outside of a sphere, on a surface with unit normal `n`: π cos θ (R/d)² if all
/// of the sphere is above the horizon. [Howell, A Catalog of Radiation Heat Transfer Configuration
/// Factors, sphere and differential element]
pub fn of_sphere(center: DVec3, radius: f64, p: DVec3, n: DVec3) -> f64 {
    let to_center = center - p;
    let h = to_center.length() / radius;
    let cos = to_center.normalize().dot(n);
    if cos * h >= 1.0 {
        return PI * cos / (h * h);
    }
    if cos * h <= -1.0 {
        return 0.0;
    }
    let sin = (1.0 - cos * cos).sqrt();
    let root = (h * h - 1.0).sqrt();
    let cut = cos * (-root * cos / sin).acos() - root * (1.0 - h * h * cos * cos).sqrt();
    0.5 * PI - (root / (h * sin)).asin() + cut / (h * h)
}

/// Irradiance due to a sky of radiance L(d), on a surface with unit normal `n`: the midpoint rule
/// in polar angle from +y and azimuth, with `rows` × 2 `rows` cells.
pub fn of_sky(n: DVec3, rows: u32, radiance: impl Fn(DVec3) -> f64) -> f64 {
    let step = PI / f64::from(rows);
    let cell = |row: u32, column: u32| {
        let (theta, phi) = ((f64::from(row) + 0.5) * step, (f64::from(column) + 0.5) * step);
        let (sin, cos) = theta.sin_cos();
        let d = DVec3::new(sin * phi.cos(), cos, sin * phi.sin());
        let cosine = d.dot(n);
        if cosine > 0.0 { radiance(d) * cosine * sin } else { 0.0 }
    };
    let row = |r| (0..2 * rows).map(|c| cell(r, c)).sum::<f64>();
    (0..rows).map(row).sum::<f64>() * step * step
}

#[cfg(test)]
mod tests {
    use super::*;

    const NORMALS: [DVec3; 3] = [DVec3::Y, DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.96, 0.28, 0.0)];

    /// Compares with a sky that has radiance 1 where a ray hits the shape, and 0 elsewhere.
    fn check(of_shape: impl Fn(DVec3) -> f64, hits: impl Fn(DVec3) -> bool) {
        for n in NORMALS {
            let want = of_sky(n, 800, |d| f64::from(u8::from(hits(d))));
            let got = of_shape(n);
            assert!((got - want).abs() < 2e-3, "{n}: {got} {want}");
        }
    }

    #[test]
    fn formulas_agree_with_quadrature() {
        check(|_| PI, |_| true);
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let corners = square.map(|[x, z]| DVec3::new(x - 1.0, 0.5, z));
        let in_square = |d: DVec3| {
            let q = d * (0.5 / d.y);
            d.y > 0.0 && (q.x + 1.0).abs() < 1.0 && q.z.abs() < 1.0
        };
        check(|n| of_polygon(&corners, DVec3::ZERO, n), in_square);
        for center in [DVec3::new(0.1, 3.0, 0.0), DVec3::new(-1.2, 0.1, 0.3)] {
            let in_sphere = |d: DVec3| {
                let middle = center.dot(d);
                middle > 0.0 && (center - d * middle).length() < 1.0
            };
            check(|n| of_sphere(center, 1.0, DVec3::ZERO, n), in_sphere);
        }
    }
}
