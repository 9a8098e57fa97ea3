//! `LightSource`: lights without a shape.

use std::f64::consts::PI;
use std::sync::Arc;

use pt_image::{PixelEncoding, Transfer};
use pt_math::{DAffine3, DMat3, DVec2, DVec3, Spectrum};
use pt_scene::image::Image;
use pt_scene::light::Portal;
use pt_scene::sky_layout::{latitude_longitude, square_of};
use pt_scene::texture::{Bitmap, Filter, Pattern, Texture, Wrap};
use pt_scene::{IesProfile, Light, LightKind, Rows};

use super::color::{SpectrumType, color};
use super::entity::Entity;
use super::state::GraphicsState;
use super::world::PbrtWorld;
use crate::LoadError;
use crate::shared::placeholder;
use crate::shared::transform::perpendicular;

const KINDS: [&str; 6] = ["distant", "goniometric", "infinite", "point", "projection", "spot"];
/// Tolerance of matrices, which are written with few digits.
const TOLERANCE: f64 = 1e-4;

impl PbrtWorld {
    /// Adds a light to the scene.
    pub(super) fn add_light(
        &mut self,
        entity: &Entity,
        state: &GraphicsState,
    ) -> Result<(), LoadError> {
        let [node, end] = state.ctm;
        if node != end {
            return Err(entity.at.error(
                "found a moving light without a shape, expected the same transform at all times",
            ));
        }
        if !node.inverse().is_finite() {
            return Err(entity
                .at
                .error("found a transform that flattens space, expected an invertible one"));
        }
        let (to_world, kind) = match entity.kind.as_str() {
            "point" => self.point(entity, node)?,
            "spot" => self.spot(entity, node)?,
            "goniometric" => self.goniometric(entity, node)?,
            "projection" => self.projection(entity, node)?,
            "distant" => self.distant(entity, node)?,
            "infinite" => self.infinite(entity, node)?,
            _ => return Err(entity.unsupported(&KINDS)),
        };
        entity.finish()?;
        let name = entity.kind.clone();
        self.scene.lights.push(Light { name, to_world, kind, at: entity.at.span("") });
        Ok(())
    }

    /// Reads the colour of a light times its scale; white of the colour space by default.
    fn emitted(
        &self,
        entity: &Entity,
        name: &'static str,
        scale: f64,
    ) -> Result<[f32; 3], LoadError> {
        let white = || entity.color_space.to_rec709([1.0; 3]).map(|c| c as f32);
        let light =
            color(entity, name, SpectrumType::Light, &self.textures.folder)?.unwrap_or_else(white);
        let scale = scale * entity.not_negative("scale", 1.0)?;
        let light = light.map(|c| (f64::from(c) * scale) as f32);
        if light.iter().all(|c| c.is_finite()) {
            return Ok(light);
        }
        Err(entity.refuse("scale", "found a light that is too bright to be represented"))
    }

    fn point(&self, entity: &Entity, node: DAffine3) -> Result<(DAffine3, LightKind), LoadError> {
        let from = entity.point("from")?.unwrap_or_default();
        let scale = power(entity, 4.0 * PI)?;
        let intensity = self.emitted(entity, "I", scale)?;
        let place = DAffine3::from_translation(node.transform_point3(from));
        Ok((place, LightKind::Point { intensity }))
    }

    /// Reads a spot light. Between two angles to its axis, the intensity falls off as 3t² − 2t³ of
    /// the cosine, which is tabulated.
    fn spot(&self, entity: &Entity, node: DAffine3) -> Result<(DAffine3, LightKind), LoadError> {
        const STEPS: u16 = 256;
        let from = entity.point("from")?.unwrap_or_default();
        let to = entity.point("to")?.unwrap_or(DVec3::Z);
        let cone = entity.float("coneangle", 30.0)?;
        let delta = entity.float("conedeltaangle", 5.0)?;
        if !(0.0 < cone && cone < 180.0 && (0.0..=cone).contains(&delta)) {
            let message = format!(
                "found coneangle {cone}° and conedeltaangle {delta}°, expected a coneangle above 0 \
                 and below 180 and a conedeltaangle from 0 to that"
            );
            return Err(entity.refuse("coneangle", message));
        }
        let inner = cone - delta;
        let [end, start] = [cone, inner].map(|angle| libm::cos(angle.to_radians()));
        let k = 2.0 * PI * ((1.0 - start) + 0.5 * (start - end));
        let intensity = self.emitted(entity, "I", power(entity, k)?)?;
        let axis = node.transform_vector3(to - from).try_normalize();
        let Some(axis) = axis else {
            return Err(entity.refuse("to", "found equal points from and to, expected a direction"));
        };
        let fade = |angle: f64| {
            let t = ((libm::cos(angle.to_radians()) - end) / (start - end)).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        let mut table = vec![(0.0, 1.0)];
        if inner > 0.0 {
            table.push((inner, 1.0));
        }
        if delta > 0.0 {
            let angles = (1..=STEPS).map(|i| inner + delta * f64::from(i) / f64::from(STEPS));
            table.extend(angles.map(|angle| (angle, fade(angle))));
        }
        let (angles, values) =
            table.into_iter().map(|(angle, value)| (angle as f32, value as f32)).unzip();
        let profile = Arc::new(IesProfile::around_axis(angles, values));
        let place =
            DAffine3::from_mat3_translation(hanging_along(axis), node.transform_point3(from));
        Ok((place, LightKind::Ies { profile, scale: intensity }))
    }

    /// Reads a light whose intensities are given by a square map of directions.
    fn goniometric(
        &self,
        entity: &Entity,
        node: DAffine3,
    ) -> Result<(DAffine3, LightKind), LoadError> {
        const DEGREES: u16 = 1;
        let image = self.square_map(entity)?;
        let Some(image) = image else { return Err(no_file(entity)) };
        let mean =
            image.pixels.iter().map(|p| f64::from(Spectrum::from(*p).luminance())).sum::<f64>()
                / image.pixels.len() as f64;
        let intensity = self.emitted(entity, "I", power(entity, 4.0 * PI * mean)?)?;
        // The nadir of the table is −z, which is +z of the light: half a turn about x. The light
        // exchanges y and z of the map. [pbrt-v4, `GoniometricLight` in lights.cpp]
        let vertical: Vec<f32> = (0..=180 / DEGREES).map(|i| f32::from(i * DEGREES)).collect();
        let horizontal: Vec<f32> = (0..=360 / DEGREES).map(|i| f32::from(i * DEGREES)).collect();
        let mut candela = Vec::with_capacity(vertical.len() * horizontal.len());
        for &turn in &horizontal {
            for &angle in &vertical {
                let (sin, cos) = libm::sincos(f64::from(angle).to_radians());
                let (across, along) = libm::sincos(f64::from(turn).to_radians());
                let [u, v] = square_of(DVec3::new(sin * along, cos, -sin * across));
                candela.push(Spectrum::from(bilinear(&image, u, v)).luminance());
            }
        }
        let profile = Arc::new(IesProfile::of_table(vertical, horizontal, candela));
        let flipped = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let turn = turned(entity, node.matrix3)? * flipped;
        Ok((
            DAffine3::from_mat3_translation(turn, node.translation),
            LightKind::Ies { profile, scale: intensity },
        ))
    }

    /// Reads an image projected along z. y is up in it, and its shorter side spans the angle.
    fn projection(
        &self,
        entity: &Entity,
        node: DAffine3,
    ) -> Result<(DAffine3, LightKind), LoadError> {
        /// Factor by which the cone extends beyond the corners.
        const MARGIN: f64 = 1.0 + 1e-6;
        /// Maximum angle of a slide in degrees; beyond, tangents exceed single precision.
        const WIDEST: f64 = 179.0;
        let fov = entity.float("fov", 90.0)?;
        if !(fov > 0.0 && fov <= WIDEST) {
            let message = format!(
                "found a field of view of {fov}°, expected more than 0 and at most {WIDEST}"
            );
            return Err(entity.refuse("fov", message));
        }
        let Some(image) = self.picture(entity)? else { return Err(no_file(entity)) };
        let aspect = f64::from(image.width) / f64::from(image.height);
        let tangent = libm::tan(0.5 * fov.to_radians());
        let half = DVec2::new(aspect, 1.0) * (tangent / aspect.min(1.0));
        let intensity = entity.not_negative("scale", 1.0)? * power(entity, flux(&image, half))?;
        // From the square slide of the cone to the image in its centre.
        let cone = half.length() * MARGIN;
        let scale = DVec2::splat(cone) / half;
        let to_pattern = DMat3::from_cols(
            DVec3::X * scale.x,
            DVec3::Y * scale.y,
            (DVec2::splat(0.5) - scale * 0.5).extend(1.0),
        );
        let bitmap = Bitmap { image: Arc::new(image), wrap: Wrap::BLACK, filter: Filter::Nearest };
        let slide = Texture::on_surface(Pattern::Bitmap(bitmap), to_pattern);
        let angle = libm::atan(cone).to_degrees();
        let kind = LightKind::LinearSpot {
            intensity: [intensity as f32; 3],
            beam_angle: angle,
            cutoff_angle: angle,
            texture: Some(Arc::new(slide)),
        };
        let turn = turned(entity, node.matrix3)? * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
        Ok((DAffine3::from_mat3_translation(turn, node.translation), kind))
    }

    fn distant(&self, entity: &Entity, node: DAffine3) -> Result<(DAffine3, LightKind), LoadError> {
        let from = entity.point("from")?.unwrap_or_default();
        let to = entity.point("to")?.unwrap_or(DVec3::Z);
        let Some(direction) = node.transform_vector3(to - from).try_normalize() else {
            return Err(entity.refuse("to", "found equal points from and to, expected a direction"));
        };
        let illuminance = entity.float("illuminance", -1.0)?;
        let scale = if illuminance > 0.0 { illuminance } else { 1.0 };
        let irradiance = self.emitted(entity, "L", scale)?;
        Ok((DAffine3::from_mat3(hanging_along(direction)), LightKind::Directional { irradiance }))
    }

    fn infinite(
        &mut self,
        entity: &Entity,
        node: DAffine3,
    ) -> Result<(DAffine3, LightKind), LoadError> {
        let portal = portal(entity)?;
        let illuminance = entity.float("illuminance", -1.0)?;
        if portal.is_some() && illuminance > 0.0 {
            return Err(entity.refuse(
                "illuminance",
                "found an illuminance of a light with a portal, expected scale instead",
            ));
        }
        let Some(image) = self.sky_map(entity)? else {
            let scale = if illuminance > 0.0 { illuminance / PI } else { 1.0 };
            let radiance = self.emitted(entity, "L", scale)?;
            return Ok((DAffine3::IDENTITY, LightKind::Constant { radiance, portal }));
        };
        if entity.spectrum("L")?.is_some() {
            return Err(entity.refuse("L", "found L and filename, expected one of the two"));
        }
        if illuminance > 0.0 {
            return Err(entity.refuse(
                "illuminance",
                "found an illuminance of a light with an image, expected scale instead",
            ));
        }
        let scale = entity.not_negative("scale", 1.0)? as f32;
        // The map has +y up in pbrt-v4; the axes y and z are exchanged.
        let swap = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
        let to_world = DAffine3::from_mat3(turned(entity, node.matrix3)? * swap);
        Ok((to_world, LightKind::Environment { image, scale, rows: Rows::PixelCenters, portal }))
    }

    /// Returns the environment map of a light in latitude and longitude, if it has one; it is
    /// created once per file.
    fn sky_map(&mut self, entity: &Entity) -> Result<Option<Arc<Image>>, LoadError> {
        let Some(name) = entity.text("filename")? else { return Ok(None) };
        let path = self.textures.folder.join(name);
        if let Some(known) = self.skies.get(&path) {
            return Ok(Some(Arc::clone(known)));
        }
        let map = self.square_map(entity)?.map(|image| Arc::new(latitude_longitude(&image)));
        self.skies.extend(map.iter().map(|map| (path.clone(), Arc::clone(map))));
        Ok(map)
    }

    /// Reads the square map of a light, if it has one.
    fn square_map(&self, entity: &Entity) -> Result<Option<Image>, LoadError> {
        let image = self.picture(entity)?;
        if let Some(Image { width, height, .. }) = image.as_ref().filter(|i| i.width != i.height) {
            let message = format!(
                "found an image of {width} × {height} pixels, expected a square equal-area map, as \
                 written by imgtool makeequiarea"
            );
            return Err(entity.refuse("filename", message));
        }
        Ok(image)
    }

    /// Reads the image of a light, if it has one.
    fn picture(&self, entity: &Entity) -> Result<Option<Image>, LoadError> {
        let Some(name) = entity.text("filename")? else { return Ok(None) };
        let path = self.textures.folder.join(name);
        let context = &self.textures.folder.context;
        let mut image = match context.pixels(&path, PixelEncoding::Light(Transfer::Srgb)) {
            Ok(decoded) => decoded.image,
            Err(why) => {
                let message = format!("{why}; {}", placeholder::INSTEAD);
                context.missing(entity.place("filename").span(""), message);
                placeholder::light()
            }
        };
        if let Some(message) = image.make_radiance() {
            context.note(entity.place("filename").span(""), message);
        }
        Ok(Some(image))
    }
}

/// Reads the portal of an infinite light: a rectangle whose corners are in world space, regardless
/// of the transform. In pbrt-v4, light arrives from the side to which the cross product of the
/// edges to the last and to the second corner points.
fn portal(entity: &Entity) -> Result<Option<Portal>, LoadError> {
    let Some(corners) = entity.points("portal")? else { return Ok(None) };
    let Ok(corners) = <[_; 4]>::try_from(corners) else {
        return Err(entity.refuse("portal", "expected the four corners of a rectangle"));
    };
    let portal = Portal { corners };
    portal.edges().map_err(|message| entity.refuse("portal", message))?;
    Ok(Some(portal))
}

fn no_file(entity: &Entity) -> LoadError {
    entity.at.error("missing parameter \"string filename\"")
}

/// Returns the power of a light of intensity 1 through a slide at distance 1 with half side lengths
/// `half`: ∫ I cos³ θ dA, by the centres of texels.
fn flux(image: &Image, half: DVec2) -> f64 {
    let size = DVec2::new(f64::from(image.width), f64::from(image.height));
    let texel = |(i, pixel): (usize, &[f32; 3])| {
        let (row, column) = (i / image.width as usize, i % image.width as usize);
        let at = (DVec2::new(column as f64, row as f64) + 0.5) / size * 2.0 - 1.0;
        let squared = 1.0 + (at * half).length_squared();
        f64::from(Spectrum::from(*pixel).luminance()) / (squared * squared.sqrt())
    };
    let sum: f64 = image.pixels.iter().enumerate().map(texel).sum();
    sum * 4.0 * half.element_product() / size.element_product()
}

/// Returns the factor that gives a light the requested power. `k` is its power for a colour of 1.
fn power(entity: &Entity, k: f64) -> Result<f64, LoadError> {
    let power = entity.float("power", -1.0)?;
    Ok(if power > 0.0 { power / k } else { 1.0 })
}

/// Removes the scale of a transform, which must be uniform.
fn turned(entity: &Entity, node: DMat3) -> Result<DMat3, LoadError> {
    let scale = node.x_axis.length();
    let turn = node * scale.recip();
    let difference = turn.transpose() * turn - DMat3::IDENTITY;
    if difference.to_cols_array().iter().any(|x| x.is_nan() || x.abs() > TOLERANCE) {
        let message = "found a non-uniform scale of a light with an image, expected a transform of \
                       rotations, reflections and uniform scales";
        return Err(entity.at.error(message));
    }
    Ok(turn)
}

/// Returns a rotation whose −z axis is a unit vector.
fn hanging_along(direction: DVec3) -> DMat3 {
    let z = -direction;
    let x = perpendicular(z);
    DMat3::from_cols(x, z.cross(x), z)
}

/// Interpolation between texel centres.
fn bilinear(image: &Image, u: f64, v: f64) -> [f32; 3] {
    let place = |t: f64, count: u32| {
        let x = (t * f64::from(count) - 0.5).clamp(0.0, f64::from(count - 1));
        let i = (x as u32).min(count.saturating_sub(2));
        (i, (i + 1).min(count - 1), (x - f64::from(i)) as f32)
    };
    let ((x0, x1, s), (y0, y1, t)) = (place(u, image.width), place(v, image.height));
    let texel = |x: u32, y: u32| image.pixels[y as usize * image.width as usize + x as usize];
    let [a, b, c, d] = [texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1)];
    std::array::from_fn(|i| {
        (a[i] * (1.0 - s) + b[i] * s) * (1.0 - t) + (c[i] * (1.0 - s) + d[i] * s) * t
    })
}
