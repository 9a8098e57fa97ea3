//! Emissive triangles.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::distribution::AliasTable;
use pt_math::{Area, Pdf, SolidAngle, Spectrum, Vec3};

use super::emitter_triangle::EmitterTriangle;
#[cfg(test)]
use super::emitter_triangle::of_triangle;
#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level};
use super::tree::LightBounds;
use super::triangle_choice::{ChosenPoint, TriangleChoice};
use super::triangle_point::{LitTriangle, NEAR};
use super::{Light, LightHit, LightSample, LightSampleContext, LightTables};

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

    #[inline(always)]
    fn triangles<'t>(&self, tables: &'t LightTables) -> TriangleChoice<'t> {
        TriangleChoice {
            table: &tables.triangle_choice[self.choice as usize],
            triangles: &tables.triangles[self.first as usize..],
            near: self.near,
        }
    }

    /// Returns the light sample of a point.
    #[inline(always)]
    fn of_point(&self, chosen: &ChosenPoint) -> Option<LightSample> {
        let &ChosenPoint { ref point, triangle, probability, .. } = chosen;
        point.light_sample(triangle, |_| self.radiance, probability, || self.area_pdf())
    }
}

impl Light for MeshLight {
    const DELTA: bool = false;

    #[inline(always)]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        self.of_point(&self.triangles(tables).sample(context.p, u))
    }

    #[inline(always)]
    fn sample_each(
        &self,
        tables: &LightTables,
        points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        self.triangles(tables).sample_each(points, samples, |chosen| self.of_point(chosen));
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
        let solid_angle = LitTriangle::of_corners([p0, p1, p2], context.p).solid_angle(self.near);
        if solid_angle > 0.0 {
            let area = 0.5 * (p1 - p0).cross(p2 - p0).length();
            Pdf::new(area * self.inverse_area / solid_angle)
        } else {
            self.area_pdf().to_solid_angle(hit.distance_squared, hit.cos)
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
