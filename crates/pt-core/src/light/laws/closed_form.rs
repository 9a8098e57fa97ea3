//! Parts of the closed forms of irradiance that several lights share.

use pt_math::{DVec3, Spectrum, Vec3};

use crate::light::{EscapedRay, Light, LightTables};

/// Midpoint rule over n × n cells of the unit square.
pub(in crate::light) fn midpoints(n: u32, f: impl Fn(f64, f64) -> f64) -> f64 {
    let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(n);
    let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    cells.map(|(i, j)| f(middle(i), middle(j))).sum::<f64>() / f64::from(n * n)
}

/// Irradiance of a light at infinity, by quadrature over the sphere.
pub(in crate::light) fn of_infinite_light(
    light: &impl Light,
    tables: &LightTables,
    n: DVec3,
) -> f64 {
    let radiance =
        |d: DVec3| level(light.le_infinite(tables, EscapedRay::new(Vec3::ZERO, d.as_vec3())));
    pt_testing::irradiance::of_sky(n, 512, radiance)
}

/// Level of a spectrum, by its luminance.
pub(in crate::light) fn level(s: Spectrum) -> f64 {
    f64::from(s.luminance())
}

/// cos θ / r².
pub(in crate::light) fn inverse_square(position: Vec3, p: DVec3, n: DVec3) -> f64 {
    let d = position.as_dvec3() - p;
    d.normalize().dot(n).max(0.0) / d.length_squared()
}
