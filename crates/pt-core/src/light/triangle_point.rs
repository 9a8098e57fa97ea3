//! Points of emissive triangles, sampled by solid angle where they are near, or else by area.

use pt_math::float_error::gamma;
use pt_math::lanes::{F32Lanes, Mask, Real, Real3};
use pt_math::ray::offset_origin;
use pt_math::{Area, Pdf, SolidAngle, Spectrum, Vec3};

use super::LightSample;
use super::emitter_triangle::EmitterTriangle;
use super::spherical_triangle::SphericalTriangle;
use crate::bsdf::emitted_through;

/// Largest |distance of the centroid|² / (|e₁|² + |e₂|²) of triangles that are near. Points of
/// farther triangles contribute so evenly that sampling by area, which is cheaper, is as good.
pub(super) const NEAR: f32 = 1.0;

/// A triangle p₀, p₀ + e₁, p₀ + e₂ and the point `p` that it lights.
#[derive(Clone, Copy, Default)]
pub(super) struct LitTriangle<R> {
    p: Real3<R>,
    p0: Real3<R>,
    e1: Real3<R>,
    e2: Real3<R>,
}

/// A sampled point of a triangle, for a receiving point.
#[derive(Clone, Copy)]
pub(super) struct TrianglePoint<R = f32> {
    /// Barycentric coordinates b₁ and b₂.
    pub(super) barycentric: [R; 2],
    /// Unit direction to the point.
    wi: Real3<R>,
    distance: R,
    distance_squared: R,
    /// Solid angle of the triangle if the point was sampled by it, or else 0.
    solid_angle: R,
}

impl LitTriangle<f32> {
    pub(super) fn new(triangle: &EmitterTriangle, p: Vec3) -> Self {
        let [p, p0, e1, e2] = [p, triangle.p0, triangle.e1, triangle.e2].map(Real3::from);
        Self { p, p0, e1, e2 }
    }

    /// Returns the triangle with these corners.
    pub(super) fn of_corners([p0, p1, p2]: [Vec3; 3], p: Vec3) -> Self {
        let [p, p0, e1, e2] = [p, p0, p1 - p0, p2 - p0].map(Real3::from);
        Self { p, p0, e1, e2 }
    }
}

impl LitTriangle<F32Lanes> {
    /// Changes the triangle and the point of a lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, triangle: &EmitterTriangle, p: Vec3) {
        self.p.set(lane, p);
        self.p0.set(lane, triangle.p0);
        self.e1.set(lane, triangle.e1);
        self.e2.set(lane, triangle.e2);
    }
}

impl<R: Real> LitTriangle<R> {
    /// Returns true if the triangle is near, as [`NEAR`] is.
    #[inline(always)]
    fn is_near(&self, near: f32) -> R::Mask {
        let Self { p, p0, e1, e2 } = *self;
        let to_middle = (p0 - p) + (e1 + e2) * R::splat(1.0 / 3.0);
        let size_squared = e1.length_squared() + e2.length_squared();
        to_middle.length_squared().lt(R::splat(near) * size_squared)
    }

    #[inline(always)]
    fn seen(&self) -> SphericalTriangle<R> {
        SphericalTriangle::new(self.p0 - self.p, self.e1, self.e2)
    }

    /// Returns the solid angle of the triangle if points are sampled by it, or else 0.
    #[inline(always)]
    pub(super) fn solid_angle(&self, near: f32) -> R {
        let is_near = self.is_near(near);
        let zero = R::splat(0.0);
        if is_near.any() { R::select(is_near, self.seen().solid_angle, zero) } else { zero }
    }

    /// Samples a point: by solid angle if the triangle is near, as [`NEAR`] is, or else by area.
    #[inline(always)]
    pub(super) fn sample(&self, near: f32, u: [R; 2]) -> TrianglePoint<R> {
        let (mut barycentric, mut solid_angle) = (uniform(u), R::splat(0.0));
        let is_near = self.is_near(near);
        if is_near.any() {
            let seen = self.seen();
            solid_angle = R::select(is_near, seen.solid_angle, R::splat(0.0));
            let is_seen = R::splat(0.0).lt(solid_angle);
            let ([b1, b2], by_angle) = (barycentric, seen.sample(u));
            barycentric =
                [R::select(is_seen, by_angle[0], b1), R::select(is_seen, by_angle[1], b2)];
        }
        let [b1, b2] = barycentric;
        let d = self.p0 + self.e1 * b1 + self.e2 * b2 - self.p;
        let distance_squared = d.length_squared();
        let distance = distance_squared.sqrt();
        let wi = d / distance;
        TrianglePoint { barycentric, wi, distance, distance_squared, solid_angle }
    }
}

/// [`warp::uniform_triangle`](pt_math::warp::uniform_triangle)
#[inline(always)]
fn uniform<R: Real>([x, y]: [R; 2]) -> [R; 2] {
    let half = x.min(y) * R::splat(0.5);
    [x - half, y - half]
}

impl TrianglePoint<F32Lanes> {
    /// Returns the point of a lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> TrianglePoint {
        let [b1, b2] = self.barycentric;
        TrianglePoint {
            barycentric: [b1.0[lane], b2.0[lane]],
            wi: self.wi.get(lane).into(),
            distance: self.distance.0[lane],
            distance_squared: self.distance_squared.0[lane],
            solid_angle: self.solid_angle.0[lane],
        }
    }
}

impl TrianglePoint {
    /// Returns the light sample of the point, with the radiance of its barycentric coordinates.
    /// `probability` is that of its triangle, and `by_area` the density of the point by area.
    /// `None` if the triangle turns its back.
    #[inline(always)]
    pub(super) fn light_sample(
        &self,
        triangle: &EmitterTriangle,
        radiance: impl FnOnce([f32; 2]) -> Spectrum,
        probability: f32,
        by_area: impl FnOnce() -> Pdf<Area>,
    ) -> Option<LightSample> {
        let &EmitterTriangle { p0, e1, e2, normal, coat } = triangle;
        let &Self { barycentric, distance, distance_squared, solid_angle, .. } = self;
        let wi = Vec3::from(self.wi);
        let cos = -wi.dot(normal);
        if cos.is_nan() || cos <= 0.0 {
            return None;
        }
        let pdf = if solid_angle > 0.0 {
            Pdf::new(probability / solid_angle)
        } else {
            by_area().to_solid_angle(distance_squared, cos)
        };
        let (q1, q2) = (e1 * barycentric[0], e2 * barycentric[1]);
        let error = (p0.abs() + q1.abs() + q2.abs()) * gamma(7);
        let end = offset_origin(p0 + q1 + q2, error, normal, -wi);
        let radiance = radiance(barycentric);
        let radiance = if coat > 0.0 { radiance * emitted_through(coat, cos) } else { radiance };
        Some(LightSample { wi, distance, end: Some(end), radiance, pdf: Some(pdf) })
    }
}

/// Samples one triangle, whose radiance depends on the barycentric coordinates.
#[inline]
pub(super) fn seen_sample(
    triangle: &EmitterTriangle,
    radiance: impl FnOnce([f32; 2]) -> Spectrum,
    p: Vec3,
    u: [f32; 2],
) -> Option<LightSample> {
    let point = LitTriangle::new(triangle, p).sample(NEAR, u);
    let by_area = || Pdf::new(1.0 / triangle.area());
    point
        .light_sample(triangle, radiance, 1.0, by_area)
        .filter(|sample| sample.pdf.is_some_and(Pdf::is_positive))
}

/// Density of [`seen_sample`].
#[inline]
pub(super) fn seen_area_pdf(p: Vec3, hit: super::LightHit) -> Pdf<SolidAngle> {
    let Some([p0, p1, p2]) = hit.triangle else { return Pdf::ZERO };
    let solid_angle = LitTriangle::of_corners([p0, p1, p2], p).solid_angle(NEAR);
    if solid_angle > 0.0 {
        return Pdf::new(1.0 / solid_angle);
    }
    let area = 0.5 * (p1 - p0).cross(p2 - p0).length();
    Pdf::<Area>::new(1.0 / area).to_solid_angle(hit.distance_squared, hit.cos)
}
