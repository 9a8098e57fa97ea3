//! Footprints of paths on surfaces, by ray cones. [Akenine-Möller, Nilsson, Andersson,
//! Barré-Brisebois, Toth & Karras 2019, "Texture Level of Detail Strategies for Real-Time Ray
//! Tracing", §20.3.4]

use pt_math::{Pdf, SolidAngle, Vec2, Vec3};

use crate::camera::{Camera, Projection};
use crate::interaction::Interaction;

/// Width of the cone of a camera ray relative to that of the pixel. The samples of a pixel cover
/// all of it, so a width below 1 blurs less without visible noise.
const SHARE_OF_PIXEL: f32 = 0.5;
/// Width of the cone of a scattered ray relative to that of its lobe, 1/√p for the density p of the
/// direction: the width of one of 64 samples. [Suykens & Willems 2001, "Path Differentials and
/// Applications"]
const SHARE_OF_LOBE: f32 = 0.125;

/// A cone around a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cone {
    /// Width at the origin of the ray, in metres.
    pub width: f32,
    /// Increase of the width per metre.
    pub spread: f32,
}

impl Cone {
    /// Returns the width at a distance from the origin of the ray, both in metres.
    #[inline]
    pub fn width_at(self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }

    /// Returns the cone of the ray scattered by a surface at a distance. `pdf` is the density of
    /// its direction; `None` for a Dirac delta.
    ///
    /// Flat mirrors and panes keep the spread, up to a factor of the index of refraction. The
    /// change of the spread by curved ones is not tracked: the cone is then reduced to the ray,
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
    /// Returns the cone of a camera ray in a unit direction. Its solid angle is that of the pixel
    /// in this direction, reduced to the fraction that one sample represents. Lenses do not widen
    /// it.
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

/// Ellipse that a cone covers where its ray hits a surface; a point if the cone has no width.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Axes divided by the width: one across the ray, and one that is longer by 1/cos.
    axes: [Vec3; 2],
    /// Width of the cone, in metres.
    width: f32,
}

impl Footprint {
    /// Creates the footprint of a cone of this width, in metres.
    pub fn new(at: &Interaction, width: f32) -> Self {
        let n = at.point.normal;
        let cos = at.wo.dot(n).abs();
        let across = n.cross(at.wo).normalize_or(n.any_orthonormal_vector());
        Self { axes: [across, n.cross(across) / cos], width }
    }

    /// Returns its axes in world space, in metres.
    pub fn in_space(&self) -> [Vec3; 2] {
        let axes = self.axes.map(|axis| axis * self.width);
        if axes.iter().all(|a| a.is_finite()) { axes } else { [Vec3::ZERO; 2] }
    }

    /// Returns its axes in texture coordinates, from ∂p/∂u and ∂p/∂v.
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
