//! Textures: images, the channels that are used, and their mapping to surfaces. [glTF 2.0, §3.8]

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use pt_image::{Decoded, ImageError, ImageMemory, PixelEncoding};
use pt_math::color::linear_from_srgb;
use pt_math::{DMat3, DVec3, Vec3};
use pt_scene::image::Image;
use pt_scene::texture::{
    Bitmap, Color, Edge, Filter, Input, Pattern, Scalar, Texture, TextureMapping, Wrap,
};

use super::item::Item;
use super::{GltfReader, buffer};
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::placeholder;
use crate::shared::prefetch::Prefetcher;

/// Maximum number of texels in all images of a scene, counted each time they are read.
const MAX_TEXELS: usize = 1 << 28;

/// Fields of normal maps.
const NORMALS: [&str; 2] = ["normalTexture", "clearcoatNormalTexture"];

/// Channels of an image, and their meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum TextureUsage {
    /// Colours in sRGB.
    Colors,
    /// One channel, 0 to 2, as stored.
    Channel(usize),
    /// 1 minus a channel.
    Opposite(usize),
    /// Alpha; 1 if there is no such channel.
    Opacity,
    /// Alpha mask: 1 if alpha is at least the cutoff, whose bits are given.
    Mask(u32),
    /// Tangent-space normals.
    Normals {
        /// Bits of the factor of x and y.
        scale: u32,
        /// True if y is reversed, for mirrored texture coordinates.
        is_mirrored: bool,
    },
}

/// Cache of images.
#[derive(Default)]
pub(super) struct ImageCache {
    /// Decoded images by index.
    stored: HashMap<usize, Result<Arc<Decoded>, String>>,
    ahead: Prefetcher<usize, Result<GltfImage, String>>,
    made: HashMap<(usize, TextureUsage), Arc<Image>>,
    texels: usize,
}

/// Decoded image file.
struct GltfImage {
    /// File name with the extension of the format.
    name: &'static str,
    /// Size of the file in bytes.
    bytes: usize,
    decoded: Result<Decoded, ImageError>,
}

impl GltfImage {
    /// If it is none of the formats of glTF.
    fn of(bytes: &[u8], context: &LoadContext) -> Result<Self, String> {
        let name = match bytes {
            [0x89, b'P', b'N', b'G', ..] => "image.png",
            [0xFF, 0xD8, ..] => "image.jpg",
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => "image.webp",
            [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', ..] => "image.ktx2",
            [b'D', b'D', b'S', b' ', ..] => "image.dds",
            _ => {
                return Err(
                    "found an image format other than PNG, JPEG, WebP, KTX 2.0 and DDS".to_owned()
                );
            }
        };
        let grant = |bytes| context.grant_picture(bytes);
        let room = ImageMemory::new(&grant);
        let decoded = pt_image::decode_in(bytes, Path::new(name), PixelEncoding::Stored, &room);
        Ok(Self { name, bytes: bytes.len(), decoded })
    }
}

impl ImageCache {
    /// Counts texels against the limit.
    fn count(&mut self, texels: usize) -> Result<(), String> {
        self.texels = self.texels.saturating_add(texels);
        if self.texels > MAX_TEXELS {
            return Err(format!("the images of the scene exceed {MAX_TEXELS} texels"));
        }
        Ok(())
    }
}

impl<'a> GltfReader<'a> {
    /// Returns the texture to which a field of a material refers; `None` if there is none. A
    /// missing image is reported and replaced by a placeholder, which is noted in the context for
    /// the material.
    pub(super) fn texture(
        &mut self,
        from: &Item<'a>,
        field: &str,
        content: TextureUsage,
    ) -> Result<Option<Arc<Texture>>, LoadError> {
        let Some(info) = from.child(field)? else { return Ok(None) };
        let texture = self.root.member("textures", info.needed("index")?, &info, "index")?;
        let Some(source) = source_of(&texture)? else {
            let message =
                "missing \"source\" of a supported format; the factor is used without the texture";
            self.warn(&texture, message);
            return Ok(None);
        };
        let described = self.root.member("images", source, &texture, "source")?;
        let image = match self.image(source, &described, content) {
            Ok(image) => image,
            Err(why) => {
                let message = format!("the image is not shown: {why}; {}", placeholder::INSTEAD);
                self.context.missing(described.span(), message);
                self.context.set_placeholder_used();
                return Ok(Some(placeholder::texture()));
            }
        };
        let (wrap, mut filter) = self.sampler(&texture)?;
        if matches!(content, TextureUsage::Normals { .. }) && filter == Filter::Trilinear {
            filter = Filter::Bilinear;
        }
        let to_pattern = placement(&info)?;
        let pattern = Pattern::Bitmap(Bitmap { image, wrap, filter });
        // Normal maps use the texture coordinates of the mesh.
        let set = Self::uv_set_of(from, field)?
            .filter(|set| !NORMALS.contains(&field) && Some(*set) != self.uv_set);
        let layout = match set.map(u32::try_from) {
            Some(Ok(set)) => TextureMapping::Coordinates { set },
            _ => TextureMapping::Surface,
        };
        Ok(Some(Arc::new(Texture { pattern, layout, to_pattern })))
    }

    /// Returns the texture coordinate set of the texture to which a field refers, if there is one.
    pub(super) fn uv_set_of(from: &Item<'a>, field: &str) -> Result<Option<usize>, LoadError> {
        let Some(info) = from.child(field)? else { return Ok(None) };
        let moved = info.extension("KHR_texture_transform")?;
        let set = moved.map_or(Ok(None), |moved| moved.whole("texCoord"))?;
        Ok(Some(set.or(info.whole("texCoord")?).unwrap_or(0)))
    }

    /// Returns the requested channels of an image, which are cached. The error is a message.
    fn image(
        &mut self,
        index: usize,
        described: &Item<'a>,
        content: TextureUsage,
    ) -> Result<Arc<Image>, String> {
        if let Some(known) = self.images.made.get(&(index, content)) {
            return Ok(Arc::clone(known));
        }
        let known = self.images.stored.get(&index).cloned();
        let stored = known.unwrap_or_else(|| {
            let stored = self.decoded(index, described).map(Arc::new);
            self.images.stored.insert(index, stored.clone());
            stored
        })?;
        self.images.count(stored.image.pixels.len())?;
        let pixels = stored.image.pixels.as_slice();
        let _grant = self.context.reserve(size_of_val(pixels) as u64)?;
        let image = Arc::new(part(&stored, content));
        self.images.made.insert((index, content), Arc::clone(&image));
        Ok(image)
    }

    /// Decodes the stored values of an image; colour space metadata of the file are ignored.
    fn decoded(&mut self, index: usize, described: &Item<'a>) -> Result<Decoded, String> {
        if self.images.stored.is_empty() && self.context.limits().memory.is_none() {
            self.images.ahead.expect(self.shown_images());
        }
        let bytes = |index: &usize| {
            let found = self.root.member("images", *index, described, "source");
            self.bytes(&found.map_err(|error| error.to_string())?)
        };
        let context = self.context;
        let ahead =
            self.images.ahead.get(&index, bytes, |bytes| GltfImage::of(&bytes?, context))?;
        // There may not be enough memory for several images at a time.
        let alone =
            if ahead.decoded.is_err() { GltfImage::of(&bytes(&index)?, context)? } else { ahead };
        let GltfImage { name, bytes, decoded } = alone;
        // Images that fail late cost time as well.
        self.images.count(bytes)?;
        let decoded = self.context.check_picture(decoded, Path::new(name))?;
        self.images.count(decoded.image.pixels.len())?;
        Ok(decoded)
    }

    /// Returns the images of all textures, in the order of the textures.
    fn shown_images(&self) -> Vec<usize> {
        let textures = self.root.children("textures").unwrap_or_default();
        textures.iter().filter_map(|texture| source_of(texture).ok()?).collect()
    }

    /// Returns the file of an image, from a URI or a buffer view.
    fn bytes(&self, described: &Item<'a>) -> Result<Cow<'a, [u8]>, String> {
        let text = |error: LoadError| match error {
            LoadError::AlreadyReported => "missing buffer of the image".to_owned(),
            error => error.to_string(),
        };
        let uri = described.text("uri").map_err(text)?;
        let view = described.whole("bufferView").map_err(text)?;
        match (uri, view) {
            (Some(uri), None) => buffer::resource(uri, self.file, self.context).map(Cow::Owned),
            (None, Some(view)) => {
                let view = self.buffers.view(&self.root, view, described, "bufferView");
                Ok(Cow::Borrowed(view.map_err(text)?.bytes))
            }
            _ => Err("expected a \"uri\" or a \"bufferView\"".to_owned()),
        }
    }

    /// Reads the wrap modes and the filter of the sampler of a texture.
    fn sampler(&self, texture: &Item<'a>) -> Result<(Wrap, Filter), LoadError> {
        /// Code of nearest filtering.
        const NEAREST: usize = 9728;
        let Some(index) = texture.whole("sampler")? else {
            return Ok((Wrap::REPEAT, Filter::Trilinear));
        };
        let sampler = self.root.member("samplers", index, texture, "sampler")?;
        let edge = |field| {
            Ok(match sampler.whole(field)?.unwrap_or(10_497) {
                10_497 => Edge::Repeat,
                33_071 => Edge::Clamp,
                33_648 => Edge::Mirror,
                other => {
                    let message =
                        format!("found wrap mode {other}, expected 33071, 33648 or 10497");
                    return Err(sampler.refuse(field, message));
                }
            })
        };
        let wrap = Wrap { u: edge("wrapS")?, v: edge("wrapT")? };
        let is_nearest = sampler.whole("magFilter")? == Some(NEAREST);
        Ok((wrap, if is_nearest { Filter::Nearest } else { Filter::Trilinear }))
    }
}

/// Returns the image index of a texture, if there is one. An extension takes precedence over the
/// fallback for readers without that extension.
fn source_of(texture: &Item<'_>) -> Result<Option<usize>, LoadError> {
    for name in ["EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"] {
        if let Some(other) = texture.extension(name)? {
            return other.whole("source");
        }
    }
    texture.whole("source")
}

/// Returns the transform of KHR_texture_transform, from the coordinates of a surface to those of an
/// image, both with v upwards. With v downwards, coordinates are scaled, then rotated by an angle
/// such that +u turns to −v, then translated. The listing in the text of the extension rotates in
/// the opposite direction from its words and all readers. [KhronosGroup/glTF, issue 1563]
pub(super) fn placement(info: &Item<'_>) -> Result<DMat3, LoadError> {
    let Some(moved) = info.extension("KHR_texture_transform")? else { return Ok(DMat3::IDENTITY) };
    let [scale_u, scale_v] = moved.vector("scale")?.unwrap_or([1.0; 2]);
    let [u, v] = moved.vector("offset")?.unwrap_or([0.0; 2]);
    let (sin, cos) = libm::sincos(moved.number("rotation")?.unwrap_or(0.0));
    let upside_down =
        DMat3::from_cols(DVec3::X, DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 1.0));
    let placed = DMat3::from_cols(
        DVec3::new(cos, -sin, 0.0) * scale_u,
        DVec3::new(sin, cos, 0.0) * scale_v,
        DVec3::new(u, v, 1.0),
    );
    Ok(upside_down * placed * upside_down)
}

/// Extracts the requested channels of an image.
pub(super) fn part(stored: &Decoded, content: TextureUsage) -> Image {
    let Decoded { image: Image { width, height, pixels }, alpha, .. } = stored;
    let opacity = |i: usize| alpha.as_ref().map_or(1.0, |alpha| alpha[i]);
    let texels = pixels.iter().enumerate();
    let pixels = match content {
        TextureUsage::Colors => linear(pixels),
        TextureUsage::Channel(c) => pixels.iter().map(|pixel| [pixel[c]; 3]).collect(),
        TextureUsage::Opposite(c) => pixels.iter().map(|pixel| [1.0 - pixel[c]; 3]).collect(),
        TextureUsage::Opacity => texels.map(|(i, _)| [opacity(i); 3]).collect(),
        TextureUsage::Mask(least) => {
            let is_there = |i| f32::from(u8::from(opacity(i) >= f32::from_bits(least)));
            texels.map(|(i, _)| [is_there(i); 3]).collect()
        }
        TextureUsage::Normals { scale, is_mirrored } => {
            let along_u = f32::from_bits(scale);
            let along_v = if is_mirrored { -along_u } else { along_u };
            pixels.iter().map(|pixel| steeper(*pixel, [along_u, along_v])).collect()
        }
    };
    Image { width: *width, height: *height, pixels: pixels.into() }
}

/// Converts sRGB to linear values.
fn linear(pixels: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let table: [f32; 256] = std::array::from_fn(|level| linear_from_srgb(level as f32 / 255.0));
    let light = |share: f32| {
        let level = (255.0 * share).round();
        if level / 255.0 == share { table[level as usize] } else { linear_from_srgb(share) }
    };
    pixels.iter().map(|pixel| pixel.map(light)).collect()
}

/// Scales x and y of a normal that is encoded as a colour, and normalizes it. [glTF 2.0, §5.20.3]
fn steeper(color: [f32; 3], [x, y]: [f32; 2]) -> [f32; 3] {
    let normal = 2.0 * Vec3::from_array(color) - Vec3::ONE;
    let normal = (normal * Vec3::new(x, y, 1.0)).normalize_or(Vec3::Z);
    (0.5 * normal + Vec3::splat(0.5)).to_array()
}

/// Multiplies a colour by a texture, if there is one.
pub(super) fn painted(factor: [f32; 3], texture: Option<Arc<Texture>>) -> Color {
    match texture {
        None => factor.into(),
        Some(texture) if factor == [1.0; 3] => Input::Texture(texture),
        Some(texture) => {
            let factors = [Input::Texture(texture), factor.into()];
            Input::Texture(Arc::new(Pattern::Product(Box::new(factors)).into()))
        }
    }
}

/// Multiplies a number by a texture, if there is one.
pub(super) fn measured(factor: f32, texture: Option<Arc<Texture>>) -> Scalar {
    match painted([factor; 3], texture) {
        Input::Value([value, ..]) => Input::Value(value),
        Input::Texture(texture) => Input::Texture(texture),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// A quarter turn takes +u to −v. Since v increases downwards, that is counter-clockwise.
    #[test]
    fn coordinates_turn_counter_clockwise() {
        let turn = json!({"extensions": {"KHR_texture_transform": {
            "rotation": std::f64::consts::FRAC_PI_2, "offset": [0.25, 0.5], "scale": [2, 1]
        }}});
        let info = Item::root(&turn, Path::new("a.gltf")).expect("an object");
        let placed = placement(&info).expect("a transform");
        // With v downwards: (1, 0) is scaled to (2, 0), rotated to (0, −2), and translated to
        // (0.25, −1.5).
        let found = placed * DVec3::new(1.0, 1.0, 1.0);
        assert!(found.distance(DVec3::new(0.25, 1.0 + 1.5, 1.0)) < 1e-12, "{found}");
    }

    #[test]
    fn normals_keep_their_length_when_they_get_steeper() {
        for scale in [0.0, 0.5, 1.0, 3.0] {
            let normal =
                2.0 * Vec3::from_array(steeper([0.8, 0.6, 0.9], [scale, -scale])) - Vec3::ONE;
            assert!((normal.length() - 1.0).abs() < 1e-6);
            assert!((normal.x / normal.z - 0.75 * scale).abs() < 1e-6);
            assert!((normal.y / normal.z + 0.25 * scale).abs() < 1e-6);
        }
    }

    #[test]
    fn levels_of_srgb_become_the_light_that_they_stand_for() {
        let pixels = [[0.0, 1.0, 100.0 / 255.0], [0.1, 0.5, 0.033]];
        for (found, stored) in linear(&pixels).iter().zip(pixels) {
            assert_eq!(*found, stored.map(linear_from_srgb));
        }
    }
}
