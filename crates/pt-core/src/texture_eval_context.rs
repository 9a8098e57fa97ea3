//! Texture coordinates of surface points.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use pt_bvh::{Hit, Sphere};
use pt_math::{Mat3, Vec2, Vec3, trig};

use crate::footprint::Footprint;
use crate::shapes::{FLAT, ShapeArrays};

/// Texture coordinates at a point of a surface, with the derivatives of the point by them, and its
/// footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureEvalContext {
    /// Coordinates (u, v); on triangles without them, the barycentric ones.
    pub uv: Vec2,
    /// Point in world space, in metres.
    pub point: Vec3,
    /// Unit normal of the shape in world space, on either side; zero if there is none.
    pub normal: Vec3,
    /// ∂p/∂u, in metres; `None` if the surface has no coordinates, or they are collinear.
    pub along_u: Option<Vec3>,
    /// ∂p/∂v, in metres; `None` under the same conditions.
    pub along_v: Option<Vec3>,
    /// Position on a triangle; `None` on spheres.
    pub on_triangle: Option<OnTriangle>,
    /// Index of the sphere in the scene; `None` on triangles.
    pub sphere: Option<u32>,
    /// Footprint of the path on the surface.
    pub footprint: Footprint,
}

impl TextureEvalContext {
    /// Creates the context of a point that is not on a surface of the scene.
    pub fn of(uv: Vec2) -> Self {
        let footprint = Footprint::default();
        Self {
            uv,
            point: Vec3::ZERO,
            normal: Vec3::ZERO,
            along_u: None,
            along_v: None,
            on_triangle: None,
            sphere: None,
            footprint,
        }
    }

    /// Axes of the footprint in texture coordinates; zero if the surface has none.
    pub fn footprint_on_surface(&self) -> [Vec2; 2] {
        match (self.along_u, self.along_v) {
            (Some(u), Some(v)) => self.footprint.on_surface(u, v),
            _ => [Vec2::ZERO; 2],
        }
    }
}

/// A point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnTriangle {
    /// Index of the triangle in the scene.
    pub triangle: u32,
    /// Barycentric coordinates of the second and the third corner.
    pub barycentric: Vec2,
    /// Differences of (u, v) from the first corner to the second, and to the third.
    pub uv_edges: [Vec2; 2],
}

/// Texture coordinates at a hit of a triangle with these at its corners.
#[inline]
fn interpolated([c0, c1, c2]: [Vec2; 3], hit: &Hit) -> Vec2 {
    c0 * (1.0 - hit.b1 - hit.b2) + c1 * hit.b1 + c2 * hit.b2
}

impl ShapeArrays {
    /// Returns the coordinates of [`Self::on_triangle`] alone.
    #[inline]
    pub(crate) fn triangle_uv(&self, i: usize, hit: &Hit) -> Vec2 {
        let corners = self.triangle_uvs.get(i).copied().unwrap_or(FLAT);
        if corners == FLAT {
            return Vec2::new(hit.b1, hit.b2);
        }
        interpolated(corners.map(|v| self.uvs[v as usize]), hit)
    }

    pub(crate) fn on_triangle(&self, i: usize, hit: &Hit) -> TextureEvalContext {
        let barycentric = Vec2::new(hit.b1, hit.b2);
        let on_triangle = |uv_edges| Some(OnTriangle { triangle: i as u32, barycentric, uv_edges });
        let corners = self.triangle_uvs.get(i).copied().unwrap_or(FLAT);
        if corners == FLAT {
            let on_triangle = on_triangle([Vec2::X, Vec2::Y]);
            return TextureEvalContext { on_triangle, ..TextureEvalContext::of(barycentric) };
        }
        let [c0, c1, c2] = corners.map(|v| self.uvs[v as usize]);
        let uv = interpolated([c0, c1, c2], hit);
        let [p0, p1, p2] = self.triangles[i].map(|v| self.positions[v as usize]);
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, c1 - c0, c2 - c0);
        let determinant = d1.perp_dot(d2);
        let along = |v: Vec3| Some(v / determinant).filter(|v| v.is_finite());
        TextureEvalContext {
            along_u: along(e1 * d2.y - e2 * d1.y),
            along_v: along(e2 * d1.x - e1 * d2.x),
            on_triangle: on_triangle([d1, d2]),
            ..TextureEvalContext::of(uv)
        }
    }

    /// See [`sphere_coordinates`].
    pub(crate) fn on_sphere(&self, i: usize, p: Vec3) -> TextureEvalContext {
        let Sphere { center, radius } = self.spheres[i];
        let axes = self.sphere_axes.get(i).copied().unwrap_or(Mat3::IDENTITY);
        let n = axes.transpose() * ((p - center) / radius.abs());
        let equator = (n.x * n.x + n.y * n.y).sqrt();
        let r = radius.abs();
        let along_u = axes * Vec3::new(-n.y, n.x, 0.0) * (TAU * r);
        let toward_south = Vec3::new(n.z * n.x / equator, n.z * n.y / equator, -equator);
        let along_v = axes * toward_south * (PI * r);
        TextureEvalContext {
            along_u: (equator > 0.0).then_some(along_u),
            along_v: Some(along_v).filter(|v| v.is_finite()),
            sphere: Some(i as u32),
            ..TextureEvalContext::of(sphere_coordinates(n))
        }
    }
}

/// Longitude from +x to +y over 2π and polar angle from +z over π, in the sphere's own axes, in
/// which the unit normal is `n`.
pub(crate) fn sphere_coordinates(n: Vec3) -> Vec2 {
    let equator = (n.x * n.x + n.y * n.y).sqrt();
    let phi = trig::atan2(n.y, n.x);
    let phi = if phi < 0.0 { phi + TAU } else { phi };
    let theta = trig::atan2(equator, n.z);
    Vec2::new(phi / TAU, theta * FRAC_1_PI)
}
