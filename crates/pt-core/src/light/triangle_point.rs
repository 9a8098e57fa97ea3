//! Points of emissive triangles, sampled by solid angle where they are near, or else by area.

use pt_math::float_error::gamma;
use pt_math::lanes::Vec3Lanes;
use pt_math::ray::offset_origin;
use pt_math::sampler::{LANES, Lanes};
use pt_math::warp::uniform_triangle;
use pt_math::{Area, Pdf, SolidAngle, Spectrum, Vec3};

use super::LightSample;
use super::emitter_triangle::EmitterTriangle;
use super::spherical_triangle::SphericalTriangle;
use crate::bsdf::emitted_through;

/// Largest |distance of the centroid|² / (|e₁|² + |e₂|²) of triangles that are near. Points of
/// farther triangles contribute so evenly that sampling by area, which is cheaper, is as good.
pub(super) const NEAR: f32 = 1.0;

/// A triangle p₀, p₀ + e₁, p₀ + e₂ and the point `p` that it lights.
#[derive(Clone, Copy)]
pub(super) struct LitTriangle {
    p: Vec3,
    p0: Vec3,
    e1: Vec3,
    e2: Vec3,
}

/// A triangle and a point for each lane.
pub(super) struct LitTriangles {
    p: Vec3Lanes,
    p0: Vec3Lanes,
    e1: Vec3Lanes,
    e2: Vec3Lanes,
}

/// A sampled point of a triangle, for a receiving point.
#[derive(Clone, Copy)]
pub(super) struct TrianglePoint {
    /// Barycentric coordinates b₁ and b₂.
    pub(super) barycentric: [f32; 2],
    /// Unit direction to the point.
    wi: Vec3,
    distance: f32,
    distance_squared: f32,
    /// Solid angle of the triangle if the point was sampled by it, or else 0.
    solid_angle: f32,
}

/// A sampled point for each lane.
pub(super) struct TrianglePoints {
    barycentric: [Lanes<f32>; 2],
    wi: Vec3Lanes,
    distance: Lanes<f32>,
    distance_squared: Lanes<f32>,
    solid_angle: Lanes<f32>,
}

impl LitTriangle {
    #[inline(always)]
    pub(super) fn new(triangle: &EmitterTriangle, p: Vec3) -> Self {
        let &EmitterTriangle { p0, e1, e2, .. } = triangle;
        Self { p, p0, e1, e2 }
    }

    /// Returns the triangle with these corners.
    #[inline(always)]
    pub(super) fn of_corners([p0, p1, p2]: [Vec3; 3], p: Vec3) -> Self {
        Self { p, p0, e1: p1 - p0, e2: p2 - p0 }
    }

    /// Returns true if the triangle is near, as [`NEAR`] is.
    #[inline(always)]
    fn is_near(&self, near: f32) -> bool {
        let Self { p, p0, e1, e2 } = *self;
        let to_middle = (p0 - p) + (e1 + e2) * (1.0 / 3.0);
        to_middle.length_squared() < near * (e1.length_squared() + e2.length_squared())
    }

    #[inline(always)]
    fn seen(&self) -> SphericalTriangle {
        SphericalTriangle::new(self.p0 - self.p, self.e1, self.e2)
    }

    /// Returns the solid angle of the triangle if points are sampled by it, or else 0.
    #[inline]
    pub(super) fn solid_angle(&self, near: f32) -> f32 {
        if self.is_near(near) { self.seen().solid_angle } else { 0.0 }
    }

    /// Samples a point: by solid angle if the triangle is near, as [`NEAR`] is, or else by area.
    #[inline]
    pub(super) fn sample(&self, near: f32, u: [f32; 2]) -> TrianglePoint {
        if self.is_near(near) {
            self.sampled::<true>(near, u)
        } else {
            self.sampled::<false>(near, u)
        }
    }

    /// [`Self::sample`] without branches. The triangle must not be near unless `MAY_BE_NEAR`.
    #[inline(always)]
    fn sampled<const MAY_BE_NEAR: bool>(&self, near: f32, u: [f32; 2]) -> TrianglePoint {
        let by_area = uniform_triangle(u);
        if !MAY_BE_NEAR {
            return self.at(by_area, 0.0);
        }
        let seen = self.seen();
        let solid_angle = if self.is_near(near) { seen.solid_angle } else { 0.0 };
        let ([a1, a2], [b1, b2]) = (by_area, seen.sample(u));
        let is_seen = solid_angle > 0.0;
        let barycentric = [if is_seen { b1 } else { a1 }, if is_seen { b2 } else { a2 }];
        self.at(barycentric, solid_angle)
    }

    #[inline(always)]
    fn at(&self, barycentric: [f32; 2], solid_angle: f32) -> TrianglePoint {
        let d = self.p0 + self.e1 * barycentric[0] + self.e2 * barycentric[1] - self.p;
        let distance_squared = d.length_squared();
        let distance = distance_squared.sqrt();
        TrianglePoint { barycentric, wi: d / distance, distance, distance_squared, solid_angle }
    }
}

impl LitTriangles {
    pub(super) const ZERO: Self =
        Self { p: Vec3Lanes::ZERO, p0: Vec3Lanes::ZERO, e1: Vec3Lanes::ZERO, e2: Vec3Lanes::ZERO };

    /// Changes the triangle and the point of a lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, lit: LitTriangle) {
        let LitTriangle { p, p0, e1, e2 } = lit;
        self.p.set(lane, p);
        self.p0.set(lane, p0);
        self.e1.set(lane, e1);
        self.e2.set(lane, e2);
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> LitTriangle {
        let Self { p, p0, e1, e2 } = self;
        LitTriangle { p: p.get(lane), p0: p0.get(lane), e1: e1.get(lane), e2: e2.get(lane) }
    }

    /// [`LitTriangle::sample`] of each lane.
    #[inline(never)]
    pub(super) fn sample(&self, near: f32, u: &[Lanes<f32>; 2], found: &mut TrianglePoints) {
        let mut any_near = false;
        for lane in 0..LANES {
            any_near |= self.get(lane).is_near(near);
        }
        if any_near {
            self.sample_each::<true>(near, u, found);
        } else {
            self.sample_each::<false>(near, u, found);
        }
    }

    #[inline(always)]
    fn sample_each<const MAY_BE_NEAR: bool>(
        &self,
        near: f32,
        [x, y]: &[Lanes<f32>; 2],
        found: &mut TrianglePoints,
    ) {
        for lane in 0..LANES {
            let point = self.get(lane).sampled::<MAY_BE_NEAR>(near, [x[lane], y[lane]]);
            found.set(lane, point);
        }
    }
}

impl TrianglePoints {
    pub(super) const ZERO: Self = Self {
        barycentric: [[0.0; LANES]; 2],
        wi: Vec3Lanes::ZERO,
        distance: [0.0; LANES],
        distance_squared: [0.0; LANES],
        solid_angle: [0.0; LANES],
    };

    /// Returns the point of a lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> TrianglePoint {
        TrianglePoint {
            barycentric: [self.barycentric[0][lane], self.barycentric[1][lane]],
            wi: self.wi.get(lane),
            distance: self.distance[lane],
            distance_squared: self.distance_squared[lane],
            solid_angle: self.solid_angle[lane],
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, point: TrianglePoint) {
        self.barycentric[0][lane] = point.barycentric[0];
        self.barycentric[1][lane] = point.barycentric[1];
        self.wi.set(lane, point.wi);
        self.distance[lane] = point.distance;
        self.distance_squared[lane] = point.distance_squared;
        self.solid_angle[lane] = point.solid_angle;
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
        let &Self { barycentric, wi, distance, distance_squared, solid_angle } = self;
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

/// Returns the light sample of a point of one triangle; `None` if its density is not positive.
#[inline]
pub(super) fn seen_sample(
    point: &TrianglePoint,
    triangle: &EmitterTriangle,
    radiance: impl FnOnce([f32; 2]) -> Spectrum,
) -> Option<LightSample> {
    point
        .light_sample(triangle, radiance, 1.0, || Pdf::new(1.0 / triangle.area()))
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
