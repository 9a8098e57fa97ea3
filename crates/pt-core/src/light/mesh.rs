//! Emissive triangles.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::distribution::AliasTable;
use pt_math::float_error::gamma;
use pt_math::ray::offset_origin;
use pt_math::{Area, Pdf, SolidAngle, Spectrum, Vec3, warp};

use super::emitter_triangle::EmitterTriangle;
#[cfg(test)]
use super::emitter_triangle::of_triangle;
#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level};
use super::spherical_triangle::SphericalTriangle;
use super::tree::LightBounds;
use super::{Light, LightHit, LightSample, LightSampleContext, LightTables};
use crate::bsdf::emitted_through;

/// Triangles with a common radiance. One of them is chosen by area, and a point of it by solid
/// angle if it is near, or else by area.
#[derive(Clone, Copy, Debug)]
pub struct MeshLight {
    /// First of its triangles in [`LightTables::triangles`].
    pub first: u32,
    /// Index of its sampling table of triangles in [`LightTables::triangle_choice`].
    pub choice: u32,
    /// One over the total area.
    pub inverse_area: f32,
    /// Radiance of the front side.
    pub radiance: Spectrum,
    /// Largest |distance of the centroid|² / (|e₁|² + |e₂|²) of triangles that are near.
    pub near: f32,
}

/// Points of farther triangles contribute so evenly that sampling by area, which is cheaper, is as
/// good.
const NEAR: f32 = 1.0;

impl MeshLight {
    /// Adds triangles to the tables; `None` if they have no area.
    pub fn new(
        tables: &mut LightTables,
        triangles: &[EmitterTriangle],
        radiance: Spectrum,
    ) -> Option<Self> {
        let areas: Vec<f32> = triangles.iter().map(EmitterTriangle::area).collect();
        let choice = AliasTable::new(&areas)?;
        let area: f64 = areas.iter().map(|&a| f64::from(a)).sum();
        let light = Self {
            first: tables.triangles.len() as u32,
            choice: tables.triangle_choice.len() as u32,
            inverse_area: (1.0 / area) as f32,
            radiance,
            near: NEAR,
        };
        tables.triangles.extend_from_slice(triangles);
        tables.triangle_choice.push(choice);
        Some(light)
    }

    #[inline(always)]
    fn area_pdf(&self) -> Pdf<Area> {
        Pdf::new(self.inverse_area)
    }

    /// Returns the triangle p₀, p₀ + e₁, p₀ + e₂ as seen from `p` if it is sampled by solid angle,
    /// or else `None`.
    #[inline(always)]
    fn seen(&self, p: Vec3, p0: Vec3, e1: Vec3, e2: Vec3) -> Option<SphericalTriangle> {
        seen(self.near, p, p0, e1, e2)
    }
}

/// Returns a triangle as seen from `p` if it is near enough to be sampled by solid angle, or else
/// `None`.
#[inline(always)]
pub(super) fn seen_nearby(p: Vec3, triangle: &EmitterTriangle) -> Option<SphericalTriangle> {
    seen(NEAR, p, triangle.p0, triangle.e1, triangle.e2)
}

#[inline(always)]
fn seen(near: f32, p: Vec3, p0: Vec3, e1: Vec3, e2: Vec3) -> Option<SphericalTriangle> {
    let d0 = p0 - p;
    let to_middle = d0 + (e1 + e2) * (1.0 / 3.0);
    let size_squared = e1.length_squared() + e2.length_squared();
    let is_near = to_middle.length_squared() < near * size_squared;
    if is_near { SphericalTriangle::new(d0, e1, e2) } else { None }
}

/// A sampled point of a triangle, for a receiving point.
pub(super) struct TrianglePoint {
    wi: Vec3,
    distance: f32,
    end: Vec3,
    /// Squared distance from the receiving point.
    pub(super) distance_squared: f32,
    /// Cosine of the angle to the normal of the triangle.
    pub(super) cos: f32,
    /// Barycentric coordinates b₁ and b₂.
    pub(super) barycentric: [f32; 2],
    coat: f32,
}

impl TrianglePoint {
    /// Returns the light sample of the point.
    #[inline(always)]
    pub(super) fn sample(&self, radiance: Spectrum, pdf: Pdf<SolidAngle>) -> LightSample {
        let &Self { wi, distance, end, coat, .. } = self;
        let radiance =
            if coat > 0.0 { radiance * emitted_through(coat, self.cos) } else { radiance };
        LightSample { wi, distance, end: Some(end), radiance, pdf: Some(pdf) }
    }
}

/// Samples a point of a triangle whose front faces `p`: by solid angle if `seen` is given, or else
/// by area.
#[inline(always)]
pub(super) fn point_of(
    triangle: &EmitterTriangle,
    seen: Option<&SphericalTriangle>,
    p: Vec3,
    u: [f32; 2],
) -> Option<TrianglePoint> {
    let &EmitterTriangle { p0, e1, e2, normal, coat } = triangle;
    let [b1, b2] = match seen {
        Some(seen) => seen.sample(u),
        None => warp::uniform_triangle(u),
    };
    let (q1, q2) = (e1 * b1, e2 * b2);
    let q = p0 + q1 + q2;
    let d = q - p;
    let distance_squared = d.length_squared();
    let distance = distance_squared.sqrt();
    let cos = -d.dot(normal) / distance;
    if cos.is_nan() || cos <= 0.0 {
        return None;
    }
    let error = (p0.abs() + q1.abs() + q2.abs()) * gamma(7);
    let end = offset_origin(q, error, normal, -d);
    let barycentric = [b1, b2];
    let wi = d / distance;
    Some(TrianglePoint { wi, distance, end, distance_squared, cos, barycentric, coat })
}

/// Samples one triangle, whose radiance depends on the barycentric coordinates.
#[inline]
pub(super) fn seen_sample(
    triangle: &EmitterTriangle,
    radiance: impl FnOnce([f32; 2]) -> Spectrum,
    p: Vec3,
    u: [f32; 2],
) -> Option<LightSample> {
    let seen = seen_nearby(p, triangle);
    let point = point_of(triangle, seen.as_ref(), p, u)?;
    let pdf = match seen {
        Some(seen) => Pdf::new(1.0 / seen.solid_angle),
        None => Pdf::<Area>::new(1.0 / triangle.area())
            .to_solid_angle(point.distance_squared, point.cos),
    };
    pdf.is_positive().then(|| point.sample(radiance(point.barycentric), pdf))
}

/// Density of [`seen_sample`].
#[inline]
pub(super) fn seen_area_pdf(p: Vec3, hit: LightHit) -> Pdf<SolidAngle> {
    let Some([p0, p1, p2]) = hit.triangle else { return Pdf::ZERO };
    let (e1, e2) = (p1 - p0, p2 - p0);
    if let Some(seen) = seen(NEAR, p, p0, e1, e2) {
        return Pdf::new(1.0 / seen.solid_angle);
    }
    let area = 0.5 * e1.cross(e2).length();
    Pdf::<Area>::new(1.0 / area).to_solid_angle(hit.distance_squared, hit.cos)
}

impl Light for MeshLight {
    const DELTA: bool = false;

    #[inline(always)]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        [u, v]: [f32; 2],
    ) -> Option<LightSample> {
        let (i, probability, u) = tables.triangle_choice[self.choice as usize].sample(u);
        let triangle = &tables.triangles[self.first as usize + i];
        let seen = self.seen(context.p, triangle.p0, triangle.e1, triangle.e2);
        let point = point_of(triangle, seen.as_ref(), context.p, [u, v])?;
        let pdf = match seen {
            Some(seen) => Pdf::new(probability / seen.solid_angle),
            None => self.area_pdf().to_solid_angle(point.distance_squared, point.cos),
        };
        Some(point.sample(self.radiance, pdf))
    }

    #[inline(always)]
    fn pdf(
        &self,
        _: &LightTables,
        context: &LightSampleContext,
        _wi: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        let Some(hit) = hit else { return Pdf::ZERO };
        let Some([p0, p1, p2]) = hit.triangle else { return Pdf::ZERO };
        let (e1, e2) = (p1 - p0, p2 - p0);
        match self.seen(context.p, p0, e1, e2) {
            Some(seen) => {
                let area = 0.5 * e1.cross(e2).length();
                Pdf::new(area * self.inverse_area / seen.solid_angle)
            }
            None => self.area_pdf().to_solid_angle(hit.distance_squared, hit.cos),
        }
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// A square of side 2 at height 2 that faces down, split into triangles of different area; and
    /// a flat triangle that stands on a corner.
    fn examples() -> Vec<(Self, LightTables)> {
        let corner = |x, z| Vec3::new(x, 2.0, z);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let inner = corner(0.5, 0.2);
        let triangles: Vec<_> = (0..4)
            .map(|i| EmitterTriangle {
                p0: inner,
                e1: corners[i] - inner,
                e2: corners[(i + 1) % 4] - inner,
                normal: Vec3::NEG_Y,
                coat: 0.0,
            })
            .collect();
        let (e1, e2) = (Vec3::new(0.2, 3.0, 0.1), Vec3::new(0.4, 2.9, 0.3));
        let p0 = Vec3::new(0.5, 0.1, -0.3);
        let flat = EmitterTriangle { p0, e1, e2, normal: e2.cross(e1).normalize(), coat: 0.0 };
        let light = |triangles: &[_]| {
            let mut tables = LightTables::default();
            let light = Self::new(&mut tables, triangles, Spectrum::splat(2.0));
            light.map(|l| (l, tables))
        };
        [light(&triangles), light(&[flat])].into_iter().flatten().collect()
    }
}

#[cfg(test)]
impl LightLaws for MeshLight {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, tables: &LightTables) -> LightGeometry {
        LightGeometry::Triangles(tables.triangles.iter().map(|t| (*t, 0)).collect())
    }

    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        let sum: f64 = tables.triangles.iter().map(|t| of_triangle(t, p, n)).sum();
        level(self.radiance) * sum
    }
}
