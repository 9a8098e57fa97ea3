//! Images, each of which contains the channels of several parameters of a material.

use std::collections::HashMap;
use std::sync::Arc;

use pt_image::{BitDepth, Decoded, encode_stored};
use pt_math::color::srgb_from_linear;
use pt_scene::image::Image;
use pt_scene::texture::{Edge, Filter, Wrap};
use serde_json::{Map, Value, json};

use super::super::texture::{TextureUsage, part};
use super::GltfWriter;
use super::binary::BinaryBuffer;
use super::layer::Layer;

/// Images, samplers and textures of a file.
#[derive(Default)]
pub(super) struct ImageTables {
    files: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    /// Files by the addresses of their source images.
    made: HashMap<Vec<(TextureUsage, usize)>, usize>,
    /// Source images, kept alive so that their addresses remain unique.
    kept: Vec<Arc<Image>>,
    /// Files by their hashes.
    known: HashMap<blake3::Hash, usize>,
}

impl ImageTables {
    /// Returns the arrays of a file with their names.
    pub(super) fn lists(self) -> [(&'static str, Vec<Value>); 3] {
        [("images", self.files), ("samplers", self.samplers), ("textures", self.textures)]
    }

    /// Returns the index of an image that contains these channels.
    fn image(
        &mut self,
        parts: Vec<(TextureUsage, Arc<Image>)>,
        binary: &mut BinaryBuffer,
    ) -> Result<usize, String> {
        let key = parts.iter().map(|(content, image)| (*content, Arc::as_ptr(image).addr()));
        let key: Vec<_> = key.collect();
        if let Some(known) = self.made.get(&key) {
            return Ok(*known);
        }
        let bytes = encoded(&parts)?;
        let index = *self.known.entry(blake3::hash(&bytes)).or_insert_with(|| {
            let view = binary.view(bytes);
            self.files.push(json!({"bufferView": view, "mimeType": "image/png"}));
            self.files.len() - 1
        });
        self.kept.extend(parts.into_iter().map(|(_, image)| image));
        self.made.insert(key, index);
        Ok(index)
    }

    fn texture(&mut self, image: usize, wrap: Wrap, filter: Filter) -> usize {
        let code = |edge| match edge {
            Edge::Repeat => 10_497,
            Edge::Clamp | Edge::Black => 33_071,
            Edge::Mirror => 33_648,
        };
        let (near, far) = match filter {
            Filter::Nearest => (9728, 9728),
            Filter::Bilinear | Filter::Trilinear => (9729, 9987),
        };
        let sampler = json!({"magFilter": near, "minFilter": far, "wrapS": code(wrap.u), "wrapT": code(wrap.v)});
        let sampler = index_of(&mut self.samplers, sampler);
        index_of(&mut self.textures, json!({"source": image, "sampler": sampler}))
    }
}

impl GltfWriter<'_> {
    /// Writes a texture with channels from several layers; all of them use the mapping of the first
    /// one.
    pub(super) fn texture(
        &mut self,
        parts: &[(TextureUsage, &Layer)],
        place: &str,
    ) -> Result<Value, String> {
        let first = parts[0].1;
        if parts.iter().any(|(_, layer)| !layer.lies_as(first)) {
            self.notes.note(
                place,
                "two images share one glTF texture, but have different mappings; the second one \
                 uses the mapping of the first",
            );
        }
        let sizes = || parts.iter().map(|(_, layer)| [layer.image.width, layer.image.height]);
        let largest = sizes().reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])]).unwrap_or([1; 2]);
        let sized = parts.iter().map(|(content, layer)| (*content, layer.with_size(largest)));
        let image = self.images.image(sized.collect(), &mut self.binary)?;
        let mut info = json!({"index": self.images.texture(image, first.wrap, first.filter)});
        match first.transform() {
            Ok(None) => {}
            Ok(Some(transform)) => {
                let extensions = self.extended([("KHR_texture_transform", transform)]);
                info["extensions"] = extensions;
            }
            Err(_) => self.notes.note(
                place,
                "a shear of texture coordinates is not representable in glTF; it is omitted",
            ),
        }
        Ok(info)
    }

    /// Creates the object of extensions and marks them as used.
    pub(super) fn extended(
        &mut self,
        extensions: impl IntoIterator<Item = (&'static str, Value)>,
    ) -> Value {
        let mut all = Map::new();
        for (name, value) in extensions {
            self.extensions.insert(name);
            all.insert(name.to_owned(), value);
        }
        Value::Object(all)
    }
}

/// Returns the index of a value in a list, to which it is appended if it is missing.
fn index_of(list: &mut Vec<Value>, value: Value) -> usize {
    let known = list.iter().position(|known| *known == value);
    known.unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    })
}

/// Encodes an image with these channels: with 8 bits if that is lossless, otherwise with 16.
fn encoded(parts: &[(TextureUsage, Arc<Image>)]) -> Result<Vec<u8>, String> {
    let eight = stored(parts, 255.0);
    let is_exact = parts.iter().all(|(content, image)| part(&eight, *content) == **image);
    if is_exact {
        return encode_stored(&eight, BitDepth::Eight);
    }
    encode_stored(&stored(parts, 65_535.0), BitDepth::Sixteen)
}

/// Combines channels of images of the same size, quantized to multiples of 1/`highest`. Unused
/// channels are 1.
fn stored(parts: &[(TextureUsage, Arc<Image>)], highest: f32) -> Decoded {
    let &Image { width, height, ref pixels } = &*parts[0].1;
    let mut pixels = vec![[1.0; 3]; pixels.len()];
    let mut alpha = None;
    let level = |share: f32| (highest * share + 0.5).floor().clamp(0.0, highest) / highest;
    for (content, image) in parts {
        let numbers = pixels.iter_mut().zip(&image.pixels);
        match content {
            TextureUsage::Colors => numbers.for_each(|(pixel, color)| {
                *pixel = color.map(|c| level(srgb_from_linear(c)));
            }),
            TextureUsage::Channel(c) => numbers.for_each(|(pixel, [x, ..])| pixel[*c] = level(*x)),
            TextureUsage::Opposite(c) => {
                numbers.for_each(|(pixel, [x, ..])| pixel[*c] = level(1.0 - *x));
            }
            TextureUsage::Normals { .. } => numbers.for_each(|(pixel, normal)| {
                *pixel = normal.map(level);
            }),
            TextureUsage::Opacity | TextureUsage::Mask(_) => {
                alpha = Some(image.pixels.iter().map(|[x, ..]| level(*x)).collect());
            }
        }
    }
    Decoded { image: Image { width, height, pixels: pixels.into() }, alpha, frame: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: &[[f32; 3]]) -> Arc<Image> {
        Arc::new(Image { width: pixels.len() as u32, height: 1, pixels: pixels.to_vec().into() })
    }

    #[test]
    fn levels_of_8_bits_stay_so_and_others_take_16() {
        let eight = image(&[[0.2; 3], [1.0; 3]]);
        let sixteen = image(&[[0.2; 3], [1.0 / 65_535.0; 3]]);
        for (image, bits) in [(eight, 8), (sixteen, 16)] {
            let bytes =
                encoded(&[(TextureUsage::Channel(2), Arc::clone(&image))]).expect("it fits");
            assert_eq!(bytes[24], bits, "the depth of a PNG file is its byte 24");
        }
    }

    #[test]
    fn contents_are_read_from_one_image_as_they_were() {
        let colors = image(&[[0.0, 1.0, 0.0], [1.0, 0.0, 1.0]]);
        let opacity = image(&[[0.2; 3], [0.6; 3]]);
        let parts = [(TextureUsage::Colors, colors), (TextureUsage::Opacity, opacity)];
        let both = stored(&parts, 255.0);
        for (content, image) in parts {
            assert_eq!(part(&both, content), *image);
        }
    }
}
