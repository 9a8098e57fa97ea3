//! Glowing triangles.

use pt_math::distribution::AliasTable;
use pt_math::interval::gamma;
use pt_math::ray::offset_origin;
use pt_math::{Area, Pdf, SolidAngle, Spectrum, Vec3, warp};

use super::{Light, LightHit, LightSample, LightTables};

/// A triangle that glows on its front side.
#[derive(Clone, Copy, Debug)]
pub struct EmitterTriangle {
    /// First corner.
    pub p0: Vec3,
    /// From the first corner to the second.
    pub e1: Vec3,
    /// From the first corner to the third.
    pub e2: Vec3,
    /// Unit vector of the side that glows.
    pub normal: Vec3,
}

impl EmitterTriangle {
    /// Surface area.
    pub fn area(&self) -> f32 {
        0.5 * self.e1.cross(self.e2).length()
    }
}

/// Triangles of one radiance, sampled uniformly by area.
#[derive(Clone, Copy, Debug)]
pub struct MeshLight {
    /// First of its triangles in [`LightTables::triangles`].
    pub first: u32,
    /// Its choice of triangles in [`LightTables::triangle_choice`].
    pub choice: u32,
    /// One over the total area.
    pub inverse_area: f32,
    /// Radiance of the front side.
    pub radiance: Spectrum,
}

impl MeshLight {
    /// Enters triangles into the tables; `None` if they have no area.
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
        };
        tables.triangles.extend_from_slice(triangles);
        tables.triangle_choice.push(choice);
        Some(light)
    }

    #[inline(always)]
    fn area_pdf(&self) -> Pdf<Area> {
        Pdf::new(self.inverse_area)
    }
}

impl Light for MeshLight {
    const DELTA: bool = false;

    #[inline(always)]
    fn sample(&self, tables: &LightTables, p: Vec3, [u, v]: [f32; 2]) -> Option<LightSample> {
        let (i, _, u) = tables.triangle_choice[self.choice as usize].sample(u);
        let triangle = &tables.triangles[self.first as usize + i];
        let [b1, b2] = warp::uniform_triangle([u, v]);
        let (q1, q2) = (triangle.e1 * b1, triangle.e2 * b2);
        let q = triangle.p0 + q1 + q2;
        let d = q - p;
        let distance_squared = d.length_squared();
        let distance = distance_squared.sqrt();
        let cos = -d.dot(triangle.normal) / distance;
        if cos.is_nan() || cos <= 0.0 {
            return None;
        }
        let error = (triangle.p0.abs() + q1.abs() + q2.abs()) * gamma(7);
        Some(LightSample {
            wi: d / distance,
            distance,
            end: Some(offset_origin(q, error, triangle.normal, -d)),
            radiance: self.radiance,
            pdf: Some(self.area_pdf().to_solid_angle(distance_squared, cos)),
        })
    }

    #[inline(always)]
    fn pdf(&self, _: &LightTables, _p: Vec3, _wi: Vec3, hit: Option<LightHit>) -> Pdf<SolidAngle> {
        hit.map_or(Pdf::ZERO, |h| self.area_pdf().to_solid_angle(h.distance_squared, h.cos))
    }

    /// A square of side 2 at height 2, split into triangles of different area, facing down.
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
            })
            .collect();
        let mut tables = LightTables::default();
        let light = Self::new(&mut tables, &triangles, Spectrum::splat(2.0));
        light.into_iter().map(|l| (l, std::mem::take(&mut tables))).collect()
    }
}
