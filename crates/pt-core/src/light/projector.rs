//! Spot light that projects an image.

use std::f32::consts::FRAC_PI_4;
use std::sync::Arc;

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Mat3, Spectrum, Vec2, Vec3, trig};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, inverse_square, level};
#[cfg(test)]
use super::spot::of_falloff;
use super::spot::{Falloff, Spot};
use super::tree::LightBounds;
use super::{Light, LightSample, LightSampleContext, LightTables};
use crate::id::Id;
use crate::texture::Textures;
use crate::texture_eval_context::TextureEvalContext;
use crate::texture_record::TextureRecord;

/// A spot light whose intensity is multiplied by a texture, like a slide projector.
#[derive(Clone, Copy, Debug)]
pub struct Projector {
    /// The light without the slide.
    pub spot: Spot,
    /// Index into [`LightTables::slides`].
    pub slide: u32,
}

/// Image of a [`Projector`].
#[derive(Clone, Copy, Debug)]
pub struct ProjectedImage {
    /// Texture of the image.
    pub texture: Id<TextureRecord>,
    /// Directions of u and v and the optical axis, in the world; orthonormal.
    pub axes: Mat3,
    /// Tangents of the angles to the axis at which the image ends along u and along v.
    pub tangents: [f32; 2],
    /// Approximate mean luminance of the image; positive.
    pub mean: f32,
}

/// Tolerance by which an image extends beyond its edge, relative to half its width.
const EDGE: f32 = 1e-6;

impl ProjectedImage {
    /// Transmittance of the slide towards the unit vector `w`, at an acute angle to the axis:
    /// (u, v) = ½ + ½ (x, y) / (z tan θ), and 0 outside of the unit square. [Mitsuba 3.9
    /// documentation, `spot`, `projector`]
    pub fn transmittance(&self, textures: &Textures, w: Vec3) -> Spectrum {
        let Vec3 { x, y, z } = self.axes.transpose() * w;
        let at = Vec2::new(x, y) / (Vec2::from(self.tangents) * z);
        // Directions to the edge are rounded.
        if at.abs().max_element() > 1.0 + EDGE {
            return Spectrum::ZERO;
        }
        let uv = Vec2::splat(0.5) + at * 0.5;
        textures.radiance(self.texture, &TextureEvalContext::of(uv))
    }
}

impl Light for Projector {
    const DELTA: bool = true;

    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let plain = self.spot.sample(tables, context, u)?;
        let slide = &tables.slides[self.slide as usize];
        let radiance = plain.radiance * slide.transmittance(&tables.textures, -plain.wi);
        (!radiance.is_black()).then_some(LightSample { radiance, ..plain })
    }

    fn bounds(&self, tables: &LightTables) -> Option<LightBounds> {
        Some(self.spot.bounds_of(tables.slides[self.slide as usize].mean))
    }

    /// An image of 3 × 2 texels, rotated and projected downwards, with a spot falloff and with one
    /// that is even on a plane.
    fn examples() -> Vec<(Self, LightTables)> {
        let values = [1.0, 0.5, 0.2, 0.1, 3.0, 1.5];
        let (texture, textures) = Textures::of_image(3, 2, &values.map(|v| [v; 3]));
        let axes =
            Mat3::from_cols(Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.8, 0.0, -0.6), Vec3::NEG_Y);
        let spot = |falloff| Spot {
            position: Vec3::new(0.0, 2.0, 0.0),
            axis: Vec3::NEG_Y,
            intensity: Spectrum::splat(3.0),
            falloff,
        };
        let textures = Arc::new(textures);
        let of = |falloff, tangents| {
            let slide = ProjectedImage { texture, axes, tangents, mean: 1.0 };
            let textures = Arc::clone(&textures);
            let tables = LightTables { textures, slides: vec![slide], ..LightTables::default() };
            (Self { spot: spot(falloff), slide: 0 }, tables)
        };
        let cutoff = trig::atan2(1.25, 1.0);
        vec![
            of(Falloff::Linear { beam: 0.2, cutoff: FRAC_PI_4 }, [1.0; 2]),
            of(Falloff::Flat { cutoff }, [1.0, 0.75]),
        ]
    }
}

#[cfg(test)]
impl LightLaws for Projector {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        let w = (p - self.spot.position.as_dvec3()).normalize();
        let falloff = of_falloff(self.spot.falloff, w.dot(self.spot.axis.as_dvec3()));
        if falloff == 0.0 {
            return 0.0;
        }
        let slide = &tables.slides[self.slide as usize];
        let picture = level(slide.transmittance(&tables.textures, w.as_vec3()));
        let on_axis = level(self.spot.intensity) * inverse_square(self.spot.position, p, n);
        on_axis * falloff * picture
    }
}
