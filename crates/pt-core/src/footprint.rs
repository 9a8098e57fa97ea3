//! How much of a surface a path sees at once: ray cones. [Akenine-Möller, Nilsson, Andersson,
//! Barré-Brisebois, Toth & Karras 2019, "Texture Level of Detail Strategies for Real-Time Ray
//! Tracing", §20.3.4]

use pt_math::{Pdf, SolidAngle, Vec2, Vec3};

use crate::camera::{Camera, Projection};
use crate::scene::{Interaction, RenderScene};

/// The width of a pixel that one sample stands for. The samples of a pixel lie all over it, so that
/// less than 1 is blurred less, and not seen as noise.
const SHARE_OF_PIXEL: f32 = 0.5;
/// The width of what a lobe scatters into, 1/√p for the density p of the direction, that one sample
/// stands for: that of one of 64 samples. [Suykens & Willems 2001, "Path Differentials and
/// Applications"]
const SHARE_OF_LOBE: f32 = 0.125;

/// A cone around a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cone {
    /// Its width where the ray begins, in metres.
    pub width: f32,
    /// By how much it grows per metre.
    pub spread: f32,
}

impl Cone {
    /// Its width at a distance from where the ray begins, both in metres.
    #[inline]
    pub fn width_at(self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }

    /// That of the ray behind a surface at a distance, by the density of its direction.
    ///
    /// Mirrors and panes that are flat keep the spread, up to a factor of the index of refraction.
    /// What a curved one does to it is not followed: there the cone becomes the ray alone,
    /// which blurs nothing.
    #[inline]
    pub fn scattered(self, distance: f32, pdf: Option<Pdf<SolidAngle>>, is_flat: bool) -> Self {
        let width = self.width_at(distance);
        match pdf {
            Some(pdf) => {
                let spread = self.spread.max(SHARE_OF_LOBE / pdf.get().sqrt());
                Self { width, spread }
            }
            None if is_flat => Self { width, ..self },
            None => Self::default(),
        }
    }
}

impl Camera {
    /// The cone of a ray in a unit direction: its solid angle is that of the pixel there, but for
    /// the share that one sample stands for. Lenses do not widen it.
    pub fn cone(&self, direction: Vec3) -> Cone {
        let [[w, h], [x, y]] = [self.resolution.map(|n| n as f32), self.half_extent];
        let pixel = (4.0 * x * y / (w * h)).sqrt();
        let of_sample = |pixel: f32| SHARE_OF_PIXEL * pixel;
        match self.projection {
            Projection::Orthographic => Cone { width: of_sample(pixel), spread: 0.0 },
            // dω = dA cos³ θ for the area at distance 1 along the axis.
            Projection::Perspective => {
                let cos = direction.dot(self.forward).clamp(0.0, 1.0);
                Cone { width: 0.0, spread: of_sample(pixel * cos * cos.sqrt()) }
            }
            Projection::Panorama => {
                let sin = direction.dot(self.up);
                let cos = (1.0 - sin * sin).max(0.0).sqrt();
                let pixel = std::f32::consts::PI * (2.0 * cos / (w * h)).sqrt();
                Cone { width: 0.0, spread: of_sample(pixel) }
            }
        }
    }
}

impl RenderScene {
    /// The cone of a camera ray in a unit direction, at a time.
    pub fn camera_cone(&self, direction: Vec3, time: f32) -> Cone {
        match self.camera_motion {
            _ if self.meter.is_some() => Cone::default(),
            None => self.camera.cone(direction),
            Some(_) => self.camera_at(time).cone(direction),
        }
    }

    /// Returns true if some texture asks how much of it is seen at once.
    #[inline]
    pub fn uses_footprints(&self) -> bool {
        self.materials.textures.uses_footprints
    }

    /// Returns true if a primitive is a triangle that is seen as flat.
    #[inline]
    pub fn is_flat(&self, primitive: u32) -> bool {
        match self.shapes.primitive_surface.get(primitive as usize) {
            Some(_) => self.shapes.is_flat(primitive as usize),
            None => self.with_instances(|placed| placed.is_flat(primitive)),
        }
    }
}

/// The ellipse that a cone covers where its ray meets a surface; without a width, a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Its axes over its width: one across the ray, and one that is longer by 1/cos.
    axes: [Vec3; 2],
    /// The width of the cone, in metres.
    width: f32,
}

impl Footprint {
    /// That of a cone of a width, in metres.
    pub fn new(at: &Interaction, width: f32) -> Self {
        let n = at.point.normal;
        let cos = at.wo.dot(n).abs();
        let across = n.cross(at.wo).normalize_or(n.any_orthonormal_vector());
        Self { axes: [across, n.cross(across) / cos], width }
    }

    /// Its axes in metres.
    pub fn in_space(&self) -> [Vec3; 2] {
        let axes = self.axes.map(|axis| axis * self.width);
        if axes.iter().all(|a| a.is_finite()) { axes } else { [Vec3::ZERO; 2] }
    }

    /// Its axes in texture coordinates, by ∂p/∂u and ∂p/∂v.
    pub fn on_surface(&self, u: Vec3, v: Vec3) -> [Vec2; 2] {
        // a = x ∂p/∂u + y ∂p/∂v, by the Gram matrix of these.
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let per_determinant = self.width / (uu * vv - uv * uv);
        let axes = self.axes.map(|a| {
            let (au, av) = (a.dot(u), a.dot(v));
            Vec2::new(vv * au - uv * av, uu * av - uv * au) * per_determinant
        });
        if axes.iter().all(|a| a.is_finite()) { axes } else { [Vec2::ZERO; 2] }
    }
}
