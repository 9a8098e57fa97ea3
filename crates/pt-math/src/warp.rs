//! Maps from the unit square to the domains that a renderer samples.
//!
//! Each domain has three functions: `x(u)` maps a uniform point `u` of [0, 1)² into it, `x_pdf`
//! is the density of the result, and `x_invert` maps back. The hemisphere, the sphere and the
//! cone surround +z.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4};

use glam::Vec3;

use crate::measure::{Area, Pdf, SolidAngle};
use crate::trig;

/// Signed radius of a point of the concentric disk, and the point. |r| is its distance to the
/// centre.
#[inline]
fn concentric(u: [f32; 2]) -> (f32, [f32; 2]) {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    // |a| > |b|, as the sign of the difference.
    let wide = ((b.abs() - a.abs()).to_bits() as i32 >> 31) as u32;
    let (other, r) = trig::swap_where(wide, a, b);
    // The angle to the nearer axis is π/4 · other/r, one eighth of a turn at most.
    let ratio = if r == 0.0 { 0.0 } else { other / r };
    let (s, c) = trig::sin_cos_eighth(0.125 * ratio);
    let (x, y) = trig::swap_where(wide, s, c);
    (r, [r * x, r * y])
}

/// Uniform point in the unit disk; concentric squares become concentric circles. ["A Low Distortion
/// Map Between Disk and Square", Shirley & Chiu 1997]
#[inline]
pub fn concentric_disk(u: [f32; 2]) -> [f32; 2] {
    concentric(u).1
}

/// Density of [`concentric_disk`] per unit of area: 1/π.
#[inline]
pub const fn concentric_disk_pdf() -> Pdf<Area> {
    Pdf::new(FRAC_1_PI)
}

/// Inverse of [`concentric_disk`].
#[inline]
pub fn concentric_disk_invert(p: [f32; 2]) -> [f32; 2] {
    let [x, y] = p;
    let r = (x * x + y * y).sqrt();
    let wide = x.abs() > y.abs();
    let (major, minor) = if wide { (x, y) } else { (y, x) };
    let r = r.copysign(major);
    let other = if major == 0.0 { 0.0 } else { r * trig::atan(minor / major) * (1.0 / FRAC_PI_4) };
    let (a, b) = if wide { (r, other) } else { (other, r) };
    [0.5 * a + 0.5, 0.5 * b + 0.5]
}

/// Cosine-weighted direction on the upper hemisphere: a uniform point of the disk, projected up.
/// [Malley's method; Pharr, Jakob & Humphreys, Physically Based Rendering, 4th ed., §A.5.3]
///
/// cos θ is never 0, so the density of the result is never 0 either.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    // On the rim of the disk: 1 − r² at the middle of the last cell of a 24-bit u.
    const MIN_Z2: f32 = f32::EPSILON;
    let (r, [x, y]) = concentric(u);
    let z2 = (1.0 - r) * (1.0 + r);
    Vec3::new(x, y, z2.max(MIN_Z2).sqrt())
}

/// Density of [`cosine_hemisphere`] by the cosine to +z: cos θ / π, and 0 below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> Pdf<SolidAngle> {
    Pdf::new(cos.max(0.0) * FRAC_1_PI)
}

/// Inverse of [`cosine_hemisphere`].
#[inline]
pub fn cosine_hemisphere_invert(w: Vec3) -> [f32; 2] {
    concentric_disk_invert([w.x, w.y])
}

/// Uniform direction in the cone of directions ω with 1 − ω·z ≤ `one_minus_cos_max`.
///
/// The cone is given by 1 − cos θₘ, in (0, 2], because cos θₘ itself has no digits left for the sun
/// and smaller lights. A point of the disk at distance r is mapped to 1 − cos θ = r²·(1 − cos θₘ).
#[inline]
pub fn uniform_cone(u: [f32; 2], one_minus_cos_max: f32) -> Vec3 {
    let (r, [x, y]) = concentric(u);
    let one_minus_cos = r * r * one_minus_cos_max;
    // sin θ / r = √((1 − cos θ)(1 + cos θ)) / r
    let stretch = (one_minus_cos_max * (2.0 - one_minus_cos)).sqrt();
    Vec3::new(x * stretch, y * stretch, 1.0 - one_minus_cos)
}

/// Density of [`uniform_cone`]: 1 / (2π(1 − cos θₘ)) inside.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos_max: f32) -> Pdf<SolidAngle> {
    Pdf::new(0.5 * FRAC_1_PI / one_minus_cos_max)
}

/// Inverse of [`uniform_cone`].
#[inline]
pub fn uniform_cone_invert(w: Vec3, one_minus_cos_max: f32) -> [f32; 2] {
    let sin2 = w.x * w.x + w.y * w.y;
    // 1 − cos θ without cancellation on the upper side.
    let one_minus_cos = if w.z > 0.0 { sin2 / (1.0 + w.z) } else { 1.0 - w.z };
    let r = (one_minus_cos / one_minus_cos_max).sqrt();
    let scale = if sin2 > 0.0 { r / sin2.sqrt() } else { 0.0 };
    concentric_disk_invert([w.x * scale, w.y * scale])
}

/// Uniform direction on the upper hemisphere.
#[inline]
pub fn uniform_hemisphere(u: [f32; 2]) -> Vec3 {
    uniform_cone(u, 1.0)
}

/// Density of [`uniform_hemisphere`] by the cosine to +z: 1/(2π), and 0 below the horizon.
#[inline]
pub fn uniform_hemisphere_pdf(cos: f32) -> Pdf<SolidAngle> {
    if cos < 0.0 { Pdf::ZERO } else { uniform_cone_pdf(1.0) }
}

/// Inverse of [`uniform_hemisphere`].
#[inline]
pub fn uniform_hemisphere_invert(w: Vec3) -> [f32; 2] {
    uniform_cone_invert(w, 1.0)
}

/// Uniform direction on the unit sphere.
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    uniform_cone(u, 2.0)
}

/// Density of [`uniform_sphere`]: 1/(4π).
#[inline]
pub fn uniform_sphere_pdf() -> Pdf<SolidAngle> {
    uniform_cone_pdf(2.0)
}

/// Inverse of [`uniform_sphere`].
#[inline]
pub fn uniform_sphere_invert(w: Vec3) -> [f32; 2] {
    uniform_cone_invert(w, 2.0)
}

/// Barycentric coordinates [b₁, b₂] of a uniform point of a triangle; b₀ = 1 − b₁ − b₂. ["A
/// Low-Distortion Map Between Triangle and Square", Heitz 2019]
#[inline]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 2] {
    let [x, y] = u;
    // Branch-free, since the branch would be taken for half of the points.
    let half = 0.5 * if x < y { x } else { y };
    [x - half, y - half]
}

/// Density of [`uniform_triangle`] per unit of area of a triangle with this area: 1/A.
#[inline]
pub fn uniform_triangle_pdf(area: f32) -> Pdf<Area> {
    Pdf::new(1.0 / area)
}

/// Inverse of [`uniform_triangle`].
#[inline]
pub fn uniform_triangle_invert(b: [f32; 2]) -> [f32; 2] {
    let [b1, b2] = b;
    if b2 > b1 { [2.0 * b1, b1 + b2] } else { [b1 + b2, 2.0 * b2] }
}
