//! `AreaLightSource`: shapes that emit light.

use std::f64::consts::PI;
use std::sync::Arc;

use pt_image::{PixelEncoding, Transfer};
use pt_math::{DAffine3, DVec3, Spectrum};
use pt_scene::texture::{Bitmap, Color, Filter, Input, Pattern, Scalar, Texture, Wrap};
use pt_scene::{Geometry, Mesh};

use super::color::{SpectrumType, color};
use super::entity::Entity;
use super::texture::product;
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::placeholder;

/// Emission of a shape.
pub(super) struct AreaLight {
    /// Radiance of the front.
    pub(super) radiance: Color,
    /// True if the back emits as well.
    pub(super) two_sided: bool,
}

impl AreaLight {
    /// Returns the emission of a shape with this opacity, which is multiplied by it. A shape with
    /// opacity 0 is an invisible light and emits everything.
    pub(super) fn through(self, alpha: &Scalar) -> Color {
        let alpha = match alpha {
            Input::Value(0.0) => return self.radiance,
            Input::Value(alpha) => Input::Value([*alpha; 3]),
            Input::Texture(texture) => Input::Texture(Arc::clone(texture)),
        };
        product([self.radiance, alpha])
    }
}

/// Reads the area light of a shape. `area` is in squared world units; light is multiplied by
/// `exposure`.
///
/// The luminance is that of the colour, or 1 for spectra. With `power`, it is divided by π · area ·
/// sides, and an image by its mean luminance, as in pbrt-v4.
pub(super) fn area_light(
    entity: &Entity,
    area: f64,
    exposure: f64,
    folder: &Folder,
) -> Result<AreaLight, LoadError> {
    if entity.kind != "diffuse" {
        return Err(entity.unsupported(&["diffuse"]));
    }
    let two_sided = entity.boolean("twosided", false)?;
    let given = color(entity, "L", SpectrumType::Light, folder)?;
    let mut mean = 1.0;
    let light = match entity.text("filename")? {
        Some(_) if given.is_some() => {
            return Err(entity.refuse("filename", "found L and filename, expected one of the two"));
        }
        Some(name) => {
            let path = folder.join(name);
            let image = folder.context.pixels(&path, PixelEncoding::Light(Transfer::Srgb));
            let mut image = image.map_or_else(
                |why| {
                    let message = format!("{why}; {}", placeholder::INSTEAD);
                    folder.context.missing(entity.place("filename").span(""), message);
                    placeholder::light()
                },
                |decoded| decoded.image,
            );
            if let Some(message) = image.make_radiance() {
                folder.context.note(entity.place("filename").span(""), message);
            }
            let sum: f64 =
                image.pixels.iter().map(|p| f64::from(Spectrum::from(*p).luminance())).sum();
            mean = sum / image.pixels.len() as f64;
            let bitmap =
                Bitmap { image: Arc::new(image), wrap: Wrap::CLAMP, filter: Filter::Bilinear };
            Input::Texture(Arc::new(Texture::from(Pattern::Bitmap(bitmap))))
        }
        None => Input::Value(
            given.unwrap_or_else(|| entity.color_space.to_rec709([1.0; 3]).map(|c| c as f32)),
        ),
    };
    let mut scale = entity.float("scale", 1.0)? * exposure;
    let power = entity.float("power", -1.0)?;
    if power > 0.0 {
        scale *= power / (mean * area * PI * if two_sided { 2.0 } else { 1.0 });
    }
    let scale = scale as f32;
    if !(scale >= 0.0 && scale.is_finite()) {
        return Err(entity.refuse(
            "scale",
            format!("found a factor {scale} of the light, expected a number of at least 0"),
        ));
    }
    entity.finish()?;
    let radiance = product([light, Input::Value([scale; 3])]);
    if let Input::Value(value) = &radiance
        && !value.iter().all(|c| c.is_finite())
    {
        return Err(entity.refuse("scale", "found a light that is too bright to be represented"));
    }
    Ok(AreaLight { radiance, two_sided })
}

/// Returns the area of a shape in the world. For a stretched sphere, that of a sphere with its mean
/// radius.
pub(super) fn area(geometry: &Geometry, to_world: &DAffine3) -> f64 {
    match geometry {
        Geometry::Sphere { radius } => {
            let scale = libm::cbrt(to_world.matrix3.determinant().abs());
            4.0 * PI * (radius * scale) * (radius * scale)
        }
        Geometry::Mesh(mesh) => {
            let at = |i: u32| to_world.transform_point3(position(mesh, i));
            let of = |[a, b, c]: [u32; 3]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).length();
            mesh.triangles.iter().map(|triangle| of(*triangle)).sum()
        }
        Geometry::Points { .. } => 0.0,
    }
}

fn position(mesh: &Mesh, i: u32) -> DVec3 {
    DVec3::from_array(mesh.positions[i as usize].map(f64::from))
}
