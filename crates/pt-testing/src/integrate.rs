//! Adaptive integration over rectangles.

/// A rectangle [x₀, x₁] × [y₀, y₁].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    pub(crate) x: [f64; 2],
    pub(crate) y: [f64; 2],
}

impl Rectangle {
    /// The four quarters.
    fn quarters(self) -> [Self; 4] {
        let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
        let (mx, my) = (middle(self.x), middle(self.y));
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        [([x0, mx], [y0, my]), ([mx, x1], [y0, my]), ([x0, mx], [my, y1]), ([mx, x1], [my, y1])]
            .map(|(x, y)| Self { x, y })
    }
}

/// Maximum depth of subdivision, at an edge of the integrand.
const MAX_DEPTH: u32 = 11;

/// ∫f over the rectangle, to about `tolerance` if `f` is smooth or has edges along lines. A peak
/// that is narrower than the parts after `min_depth` subdivisions may be overlooked.
pub(crate) fn integrate(
    f: &impl Fn(f64, f64) -> f64,
    rectangle: Rectangle,
    tolerance: f64,
    min_depth: u32,
) -> f64 {
    refine(f, rectangle, gauss(f, rectangle), tolerance, [0, min_depth])
}

/// Subdivides the rectangle until the sum changes little; `whole` is the estimate for all of it.
fn refine(
    f: &impl Fn(f64, f64) -> f64,
    rectangle: Rectangle,
    whole: f64,
    tolerance: f64,
    [depth, min_depth]: [u32; 2],
) -> f64 {
    let quarters = rectangle.quarters().map(|quarter| (quarter, gauss(f, quarter)));
    let sum: f64 = quarters.iter().map(|q| q.1).sum();
    let settled = (sum - whole).abs() <= tolerance || !sum.is_finite();
    if depth >= MAX_DEPTH || (settled && depth >= min_depth) {
        return sum;
    }
    // An edge runs through two of the four quarters, so each may have half of the error.
    let depths = [depth + 1, min_depth];
    quarters.into_iter().map(|(r, value)| refine(f, r, value, 0.5 * tolerance, depths)).sum()
}

/// Gauss–Legendre rule with 3 × 3 points: exact for polynomials of degree 5 in each variable.
fn gauss(f: &impl Fn(f64, f64) -> f64, rectangle: Rectangle) -> f64 {
    const WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
    let offset = 0.15f64.sqrt();
    let nodes = |[a, b]: [f64; 2]| [-offset, 0.0, offset].map(|t| 0.5 * (a + b) + t * (b - a));
    let (xs, ys) = (nodes(rectangle.x), nodes(rectangle.y));
    let area = (rectangle.x[1] - rectangle.x[0]) * (rectangle.y[1] - rectangle.y[0]);
    let mut sum = 0.0;
    for (x, wx) in xs.iter().zip(WEIGHTS) {
        for (y, wy) in ys.iter().zip(WEIGHTS) {
            sum += wx * wy * f(*x, *y);
        }
    }
    sum * area
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Rectangle = Rectangle { x: [0.0, 1.0], y: [0.0, 1.0] };

    #[test]
    fn polynomials_are_exact() {
        let f = |x: f64, y: f64| x.powi(5) * y.powi(4);
        assert!((integrate(&f, UNIT, 1.0, 2) - 1.0 / 30.0).abs() < 1e-14);
    }

    #[test]
    fn peaks_and_edges_are_found() {
        // Gaussian around the middle, far inside: √π/k in each variable.
        let k = 200.0;
        let bell = |x: f64, y: f64| (-k * k * ((x - 0.5).powi(2) + (y - 0.5).powi(2))).exp();
        let exact = std::f64::consts::PI / (k * k);
        assert!((integrate(&bell, UNIT, 1e-10, 2) / exact - 1.0).abs() < 1e-5);
        let disk = |x: f64, y: f64| if x * x + y * y < 0.5 { 1.0 } else { 0.0 };
        let exact = std::f64::consts::PI / 8.0;
        assert!((integrate(&disk, UNIT, 1e-6, 2) - exact).abs() < 1e-4);
    }
}
