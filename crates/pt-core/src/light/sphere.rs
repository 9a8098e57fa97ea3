//! Emissive sphere.

#[cfg(test)]
use std::f64::consts::PI;

#[cfg(test)]
use pt_math::DVec3;
use pt_math::float_error::gamma;
use pt_math::lanes::Vec3Lanes;
use pt_math::ray::offset_origin;
use pt_math::sampler::{LANES, Lanes};
use pt_math::{Frame, Pdf, SolidAngle, Spectrum, Vec3, warp};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level};
use super::sample_block::SampleBlock;
use super::tree::LightBounds;
use super::{Light, LightHit, LightSample, LightSampleContext, LightTables};
use crate::bsdf::emitted_through;

/// A sphere of constant radiance on its outside, or on its inside. From points outside, the cone of
/// directions to it is sampled [Shirley, Wang & Zimmerman 1996, "Monte Carlo Techniques for Direct
/// Lighting Calculations", §3.2]; from points inside, all directions.
#[derive(Clone, Copy, Debug)]
pub struct SphereLight {
    /// Centre.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
    /// Radiance of the outside, or of the inside if `inward`.
    pub radiance: Spectrum,
    /// True if it emits light inwards.
    pub inward: bool,
    /// Fraction of the area under a clear coat; see [`emitted_through`].
    pub coat: f32,
}

/// Upper bound of the rounding error of a point of the sphere, relative to the radius.
const ROUNDING: f32 = 1e-5;

/// A point of a sphere with its normal, in the unit direction `wi` from the receiving point.
#[derive(Clone, Copy)]
struct SpherePoint {
    n: Vec3,
    wi: Vec3,
    /// 0 or less if there is none.
    distance: f32,
}

/// A point for each lane.
struct SpherePoints {
    n: Vec3Lanes,
    wi: Vec3Lanes,
    distance: Lanes<f32>,
}

impl SpherePoints {
    const ZERO: Self = Self { n: Vec3Lanes::ZERO, wi: Vec3Lanes::ZERO, distance: [0.0; LANES] };

    #[inline(always)]
    fn get(&self, lane: usize) -> SpherePoint {
        SpherePoint { n: self.n.get(lane), wi: self.wi.get(lane), distance: self.distance[lane] }
    }
}

/// 1 − cos of an angle, from sin².
#[inline(always)]
fn one_minus_cos(sin2: f32) -> f32 {
    sin2 / (1.0 + (1.0 - sin2).sqrt())
}

impl SphereLight {
    /// Returns 1 − cos of the half angle of the cone of directions from `p` to the outside, without
    /// cancellation for distant spheres; `None` from inside.
    #[inline]
    fn one_minus_cos(&self, p: Vec3) -> Option<f32> {
        let sin2 = self.sin2(p);
        (sin2 < 1.0).then(|| one_minus_cos(sin2))
    }

    /// Returns sin² of the half angle of the cone of directions from `p` to the outside; 1 or more
    /// from inside.
    #[inline(always)]
    fn sin2(&self, p: Vec3) -> f32 {
        self.radius * self.radius / (self.center - p).length_squared()
    }

    /// Returns true if `p` is inside of the sphere, or on it up to rounding.
    #[inline]
    fn holds(&self, p: Vec3) -> bool {
        (p - self.center).length() <= self.radius * (1.0 + ROUNDING)
    }

    /// Returns the sample in direction `wi`, which hits the sphere at the normal `n`.
    #[inline]
    fn at(&self, hit: SpherePoint, pdf: Pdf<SolidAngle>) -> Option<LightSample> {
        let SpherePoint { n, wi, distance } = hit;
        let offset = n * self.radius;
        let error = (self.center.abs() + offset.abs()) * gamma(5);
        let end = Some(offset_origin(self.center + offset, error, n, -wi));
        let radiance = self.coated(self.radiance, n.dot(wi).abs());
        (distance > 0.0).then_some(LightSample { wi, distance, end, radiance, pdf: Some(pdf) })
    }

    /// Multiplies radiance by the transmittance of the coat at this cosine to the normal.
    #[inline]
    pub(super) fn coated(&self, radiance: Spectrum, cos: f32) -> Spectrum {
        if self.coat > 0.0 { radiance * emitted_through(self.coat, cos) } else { radiance }
    }

    /// Samples a direction of the cone, from outside, without branches.
    #[inline(always)]
    fn cone_point(&self, p: Vec3, u: [f32; 2]) -> SpherePoint {
        let to_center = self.center - p;
        let d = to_center.length();
        let frame = Frame::from_normal(to_center / d);
        let local = warp::uniform_cone(u, one_minus_cos(self.sin2(p)));
        let sin2 = local.x * local.x + local.y * local.y;
        let half_chord = (self.radius * self.radius - d * d * sin2).max(0.0).sqrt();
        let distance = d * local.z - half_chord;
        // Avoids the difference to the centre, which cancels for distant spheres.
        let z = -(d * sin2 + half_chord * local.z);
        let n = Vec3::new(local.x * distance, local.y * distance, z).normalize();
        SpherePoint { n: frame.to_world(n), wi: frame.to_world(local), distance }
    }

    /// [`Self::cone_point`] of each lane.
    #[inline(never)]
    fn cone_points(&self, p: &Vec3Lanes, [x, y]: &[Lanes<f32>; 2], found: &mut SpherePoints) {
        for lane in 0..LANES {
            let point = self.cone_point(p.get(lane), [x[lane], y[lane]]);
            found.n.set(lane, point.n);
            found.wi.set(lane, point.wi);
            found.distance[lane] = point.distance;
        }
    }

    /// Returns the sample of a point of the cone from `p`; `None` from inside.
    #[inline(always)]
    fn of_cone(&self, p: Vec3, point: SpherePoint) -> Option<LightSample> {
        self.at(point, warp::uniform_cone_pdf(self.one_minus_cos(p)?))
    }

    /// Samples a direction of the sphere, from inside.
    #[inline]
    fn sample_inside(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        if !self.holds(p) {
            return None;
        }
        let wi = warp::uniform_sphere(u);
        let from_center = p - self.center;
        let b = from_center.dot(wi);
        let power = from_center.length_squared() - self.radius * self.radius;
        let root = (b * b - power).max(0.0).sqrt();
        // The larger root of t² + 2bt + power.
        let distance = if b > 0.0 { -power / (b + root) } else { root - b };
        let n = (from_center + wi * distance).normalize();
        self.at(SpherePoint { n, wi, distance }, warp::uniform_sphere_pdf())
    }
}

impl Light for SphereLight {
    const DELTA: bool = false;

    #[inline]
    fn sample(
        &self,
        _: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        if self.inward {
            return self.sample_inside(context.p, u);
        }
        self.of_cone(context.p, self.cone_point(context.p, u))
    }

    #[inline(always)]
    fn sample_each(
        &self,
        _: &LightTables,
        mut points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        if self.inward {
            return samples.extend(points.map(|(at, u)| self.sample_inside(at.p, u)));
        }
        while let Some(SampleBlock { p, u, count }) = SampleBlock::take(&mut points) {
            let mut found = SpherePoints::ZERO;
            self.cone_points(&p, &u, &mut found);
            samples.extend((0..count).map(|lane| self.of_cone(p.get(lane), found.get(lane))));
        }
    }

    #[inline]
    fn pdf(
        &self,
        _: &LightTables,
        context: &LightSampleContext,
        _wi: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        match (hit, self.inward) {
            (None, _) => Pdf::ZERO,
            (_, true) if self.holds(context.p) => warp::uniform_sphere_pdf(),
            (_, true) => Pdf::ZERO,
            (_, false) => self.one_minus_cos(context.p).map_or(Pdf::ZERO, warp::uniform_cone_pdf),
        }
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        Some(LightBounds::of_sphere(self.center, self.radius, self.radiance, 1.0))
    }

    fn examples() -> Vec<(Self, LightTables)> {
        let at = |y, radius, inward| Self {
            center: Vec3::new(0.0, y, 0.0),
            radius,
            radiance: Spectrum::splat(2.0),
            inward,
            coat: 0.0,
        };
        [at(3.0, 1.0, false), at(500.0, 0.5, false), at(0.5, 2.0, true)]
            .map(|l| (l, LightTables::default()))
            .into()
    }
}

#[cfg(test)]
impl LightLaws for SphereLight {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::Sphere(*self)
    }

    /// Inside of a sphere that emits inwards, radiance is equal from all directions.
    fn irradiance(&self, _: &LightTables, p: DVec3, n: DVec3) -> f64 {
        let (center, radius) = (self.center.as_dvec3(), f64::from(self.radius));
        level(self.radiance)
            * match ((p - center).length() > radius, self.inward) {
                (true, false) => pt_testing::irradiance::of_sphere(center, radius, p, n),
                (false, true) => PI,
                _ => 0.0,
            }
    }
}
