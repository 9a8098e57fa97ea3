//! Sky behind a portal.

use std::sync::Arc;

use pt_math::{DVec3, Mat3, Pdf, SolidAngle, Spectrum, Vec3};
use pt_scene::Rows;
use pt_scene::image::Image;

use super::environment::{Environment, EnvironmentMap, PlacedMap};
#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level, midpoints};
use super::spherical_triangle::SphericalTriangle;
use super::tree::LightBounds;
use super::{EscapedRay, Light, LightHit, LightSample, LightSampleContext, LightTables};

/// A sky whose light arrives only along rays that pass through a rectangle from its front.
/// [Bitterli, Novák & Jarosz 2015, "Portal-Masked Environment Map Sampling"; pbrt-v4 has such
/// lights]
///
/// Half of the samples are directions to the rectangle, half are those of the map, many of which
/// miss the rectangle: p = ½ p_rectangle + ½ p_map within the rectangle. Without a map, all samples
/// are directions to the rectangle.
#[derive(Clone, Copy, Debug)]
pub struct PortalSky {
    /// The sky.
    pub sky: Environment,
    /// Index into [`LightTables::portals`].
    pub portal: u32,
}

/// A rectangle through which rays leave the scene.
#[derive(Clone, Copy, Debug)]
pub struct Portal {
    corner: Vec3,
    e1: Vec3,
    e2: Vec3,
    /// Unit normal on the side to which rays leave.
    outwards: Vec3,
    /// One over the area.
    inverse_area: f32,
}

/// Intersection of a ray with a portal.
#[derive(Clone, Copy)]
struct Crossing {
    distance: f32,
    /// Cosine of the angle to the normal.
    cos: f32,
}

/// A rectangle as seen from a point, split into two triangles.
struct VisiblePart([SphericalTriangle; 2]);

impl VisiblePart {
    fn solid_angle(&self) -> f32 {
        self.0[0].solid_angle + self.0[1].solid_angle
    }
}

impl Portal {
    /// Creates a portal from a corner, and the edges from there to the next and to the last corner,
    /// counter-clockwise as seen from the front.
    pub fn new(corner: DVec3, e1: DVec3, e2: DVec3) -> Self {
        let across = e2.cross(e1);
        Self {
            corner: corner.as_vec3(),
            e1: e1.as_vec3(),
            e2: e2.as_vec3(),
            outwards: across.normalize_or(DVec3::Z).as_vec3(),
            inverse_area: (1.0 / across.length()) as f32,
        }
    }

    /// Returns the intersection of the ray from `p` in the unit direction `d`, or `None` unless it
    /// passes to the outside. The rim is extended by about the rounding error of a direction.
    #[inline]
    fn crossing(&self, p: Vec3, d: Vec3) -> Option<Crossing> {
        const ROUNDING: f32 = f32::EPSILON;
        let cos = d.dot(self.outwards);
        let distance = (self.corner - p).dot(self.outwards) / cos;
        let from_corner = (p - self.corner) + d * distance;
        let is_between = |e: Vec3| {
            let length = e.length();
            let unit = e / length;
            let rim = ROUNDING * distance;
            let along = from_corner.dot(unit);
            along >= -rim && along <= length + rim
        };
        let goes_through =
            cos > 0.0 && distance > 0.0 && is_between(self.e1) && is_between(self.e2);
        goes_through.then_some(Crossing { distance, cos })
    }

    /// Returns the rectangle as seen from `p` if it is near enough to be sampled by solid angle, or
    /// else `None`.
    fn seen(&self, p: Vec3) -> Option<VisiblePart> {
        const NEAR: f32 = 1.0;
        let Self { corner, e1, e2, .. } = *self;
        let d0 = corner - p;
        let diagonal = e1 + e2;
        let to_middle = d0 + diagonal * 0.5;
        if to_middle.length_squared() >= NEAR * (e1.length_squared() + e2.length_squared()) {
            return None;
        }
        let seen = |a: Vec3, b: Vec3| SphericalTriangle::new(d0, a, b);
        let parts = [seen(e1, diagonal), seen(diagonal, e2)];
        parts.iter().all(|part| part.solid_angle > 0.0).then_some(VisiblePart(parts))
    }

    /// Samples a direction from `p` to the rectangle: uniformly by solid angle if it is near, or
    /// else by area, as [`super::MeshLight`] does. Due to rounding, it may just miss.
    fn sample(&self, p: Vec3, [u, v]: [f32; 2]) -> Option<Vec3> {
        const MAX: f32 = 1.0f32.next_down();
        let Self { corner, e1, e2, .. } = *self;
        let [b1, b2] = match self.seen(p) {
            None => [u, v],
            Some(seen) => {
                let [first, second] = &seen.0;
                let share = first.solid_angle / seen.solid_angle();
                if u < share {
                    let [b1, b2] = first.sample([(u / share).min(MAX), v]);
                    [b1 + b2, b2]
                } else {
                    let [b1, b2] = second.sample([((u - share) / (1.0 - share)).min(MAX), v]);
                    [b1, b1 + b2]
                }
            }
        };
        ((corner - p) + e1 * b1 + e2 * b2).try_normalize()
    }

    /// Density of [`Self::sample`] for a direction whose ray passes through.
    fn pdf(&self, p: Vec3, crossing: Crossing) -> f32 {
        match self.seen(p) {
            Some(seen) => 1.0 / seen.solid_angle(),
            None => crossing.distance * crossing.distance * self.inverse_area / crossing.cos,
        }
    }
}

impl PortalSky {
    fn portal<'a>(&self, tables: &'a LightTables) -> &'a Portal {
        &tables.portals[self.portal as usize]
    }

    /// Density of a direction whose ray passes through the portal.
    fn pdf_of(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        wi: Vec3,
        crossing: Crossing,
    ) -> f32 {
        let of_portal = self.portal(tables).pdf(context.p, crossing);
        if self.sky.is_sampled_by_map(tables) {
            0.5 * (of_portal + self.sky.pdf(tables, context, wi, None).get())
        } else {
            of_portal
        }
    }
}

impl Light for PortalSky {
    const DELTA: bool = false;

    #[inline(never)]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        [u, v]: [f32; 2],
    ) -> Option<LightSample> {
        let portal = self.portal(tables);
        let wi = if !self.sky.is_sampled_by_map(tables) {
            portal.sample(context.p, [u, v])?
        } else if u < 0.5 {
            self.sky.sample(tables, context, [2.0 * u, v])?.wi
        } else {
            portal.sample(context.p, [2.0 * u - 1.0, v])?
        };
        let crossing = portal.crossing(context.p, wi)?;
        let pdf = self.pdf_of(tables, context, wi, crossing);
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            wi,
            distance: f32::INFINITY,
            end: None,
            radiance: self.sky.le_infinite(tables, EscapedRay::new(context.p, wi)),
            pdf: Some(Pdf::new(pdf)),
        })
    }

    #[inline(never)]
    fn pdf(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        wi: Vec3,
        _: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        let crossing = self.portal(tables).crossing(context.p, wi);
        crossing.map_or(Pdf::ZERO, |at| Pdf::new(self.pdf_of(tables, context, wi, at)))
    }

    #[inline(never)]
    fn le_infinite(&self, tables: &LightTables, ray: EscapedRay) -> Spectrum {
        match self.portal(tables).crossing(ray.origin, ray.direction) {
            Some(_) => self.sky.le_infinite(tables, ray),
            None => Spectrum::ZERO,
        }
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// A square window in the ceiling under a constant environment, and a tilted one, longer than
    /// wide, under a map with a bright texel, which is visible from some points.
    fn examples() -> Vec<(Self, LightTables)> {
        let ceiling = Portal::new(DVec3::new(-1.0, 2.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
        let even = Environment { radiance: Spectrum::splat(0.5), map: None };
        let (s, t) = (DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.48, 0.36, 0.8));
        let tilted = Portal::new(DVec3::new(-1.3, 1.2, -0.5), s * 2.2, t * 1.1);
        let (width, height) = (16u32, 8u32);
        let texel = |i: u32| match (i % width, i / width) {
            (9, 1) => [30.0; 3],
            (x, y) => [0.1 * x as f32, 0.2 * y as f32, 0.3],
        };
        let pixels = (0..width * height).map(texel).collect();
        let image = Arc::new(Image { width, height, pixels });
        let map = PlacedMap { index: 0, to_world: Mat3::from_rotation_x(0.4) };
        let mapped = Environment { radiance: Spectrum::splat(0.7), map: Some(map) };
        let of = |sky, portal, environments| {
            let tables =
                LightTables { portals: vec![portal], environments, ..LightTables::default() };
            (Self { sky, portal: 0 }, tables)
        };
        vec![
            of(even, ceiling, Vec::new()),
            of(mapped, tilted, vec![EnvironmentMap::of_image(image, Rows::PixelCenters).into()]),
        ]
    }
}

#[cfg(test)]
impl LightLaws for PortalSky {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    /// Midpoint rule over many parts of the rectangle.
    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        const PARTS: u32 = 600;
        let [corner, e1, e2] = tables.portals[self.portal as usize].sides();
        let across = e1.cross(e2);
        midpoints(PARTS, |u, v| {
            let to_part = corner + e1 * u + e2 * v - p;
            let (r2, d) = (to_part.length_squared(), to_part.normalize());
            let ray = EscapedRay::new(p.as_vec3(), d.as_vec3());
            let radiance = level(self.sky.le_infinite(tables, ray));
            radiance * (-d.dot(across)).max(0.0) * d.dot(n).max(0.0) / r2
        })
    }
}

#[cfg(test)]
impl Portal {
    /// Returns the corner and the two edges.
    pub(super) fn sides(&self) -> [DVec3; 3] {
        [self.corner, self.e1, self.e2].map(Vec3::as_dvec3)
    }
}
