//! The spot light that throws a picture.

use std::f32::consts::FRAC_PI_4;

use pt_math::{Mat3, Spectrum, Vec2, Vec3};

use super::spot::{Falloff, Spot};
use super::{Light, LightSample, LightTables, Lit};
use crate::id::Id;
use crate::parametrization::Parametrization;
use crate::texture::{TextureRecord, Textures};

/// A spot light whose intensity is multiplied by a texture, as if it were a slide before it.
#[derive(Clone, Copy, Debug)]
pub struct Projector {
    /// The light without the slide.
    pub spot: Spot,
    /// Index into [`LightTables::slides`].
    pub slide: u32,
}

/// What a [`Projector`] throws.
#[derive(Clone, Copy, Debug)]
pub struct Slide {
    /// The picture.
    pub texture: Id<TextureRecord>,
    /// Where u and v grow, and the axis, in the world; all of unit length and at right angles.
    pub axes: Mat3,
    /// Tangent of the angle to the axis at which the slide ends along u and v.
    pub tangent: f32,
    /// About the mean luminance of the picture, and positive.
    pub mean: f32,
}

impl Slide {
    /// The share of the light that goes towards the unit vector `w`, which is at an acute angle to the
    /// axis: (u, v) = ½ + ½ (x, y) / (z tan θ). [Mitsuba 3.9 documentation, `spot`]
    pub fn share(&self, textures: &Textures, w: Vec3) -> Spectrum {
        let Vec3 { x, y, z } = self.axes.transpose() * w;
        let uv = Vec2::splat(0.5) + Vec2::new(x, y) * (0.5 / (z * self.tangent));
        textures.radiance(self.texture, &Parametrization::of(uv))
    }
}

impl Light for Projector {
    const DELTA: bool = true;

    fn sample(&self, tables: &LightTables, lit: &Lit, u: [f32; 2]) -> Option<LightSample> {
        let plain = self.spot.sample(tables, lit, u)?;
        let slide = &tables.slides[self.slide as usize];
        let radiance = plain.radiance * slide.share(&tables.textures, -plain.wi);
        (!radiance.is_black()).then_some(LightSample { radiance, ..plain })
    }

    /// A slide of six fields, turned, that points down.
    fn examples() -> Vec<(Self, LightTables)> {
        let values = [1.0, 0.5, 0.2, 0.1, 3.0, 1.5];
        let (texture, textures) = Textures::of_image(3, 2, &values.map(|v| [v; 3]));
        let axes =
            Mat3::from_cols(Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.8, 0.0, -0.6), Vec3::NEG_Y);
        let spot = Spot {
            position: Vec3::new(0.0, 2.0, 0.0),
            axis: Vec3::NEG_Y,
            intensity: Spectrum::splat(3.0),
            falloff: Falloff::Linear { beam: 0.2, cutoff: FRAC_PI_4 },
        };
        let slide = Slide { texture, axes, tangent: 1.0, mean: 1.0 };
        let tables = LightTables {
            textures: textures.into(),
            slides: vec![slide],
            ..LightTables::default()
        };
        vec![(Self { spot, slide: 0 }, tables)]
    }
}
