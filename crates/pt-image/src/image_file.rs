//! Content of image files with all channels, from which the files can be written again.

use std::path::Path;

use pt_io::guarded;
use pt_scene::image::Image;

use super::{
    Decoded, DisplayWindow, ImageError, ImageMemory, PixelEncoding, SaveOptions, Transfer,
    codec_with, content_error, read_file,
};

/// Content of an image file, and the options with which it can be written again.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFile {
    /// Colours, premultiplied with alpha if there is one.
    pub image: Image,
    /// Alpha, other channels, texts, and the pixel type and compression of an EXR file. A method of
    /// compression that cannot be written is replaced by the default.
    pub options: SaveOptions,
    /// See [`Decoded::frame`].
    pub frame: Option<DisplayWindow>,
}

impl ImageFile {
    /// Creates the content of a file without other channels; the colours are premultiplied.
    pub(super) fn new(
        Decoded { image, alpha, frame }: Decoded,
        metadata: Vec<(String, String)>,
    ) -> Self {
        Self { image, options: SaveOptions { metadata, alpha, ..SaveOptions::default() }, frame }
    }

    /// Returns the colours with their alpha.
    pub fn into_decoded(self) -> Decoded {
        Decoded { image: self.image, alpha: self.options.alpha, frame: self.frame }
    }

    /// Returns the content of the display window, as [`Decoded::framed`] does, with all channels.
    ///
    /// # Errors
    /// Returns a message if it has more than a gibibyte of pixels.
    pub fn framed(mut self) -> Result<Self, String> {
        let Some(window) = self.frame.take() else { return Ok(self) };
        let bytes = size_of::<[f32; 4]>() + size_of::<f32>() * self.options.channels.len();
        let _grant = ImageMemory::OF_PROCESS.ask(window.area().checked_mul(bytes as u64))?;
        let size = [self.image.width, self.image.height];
        let [width, height] = window.size;
        self.image = Image { width, height, pixels: window.content(&self.image.pixels, size) };
        self.options.alpha = self.options.alpha.map(|alpha| window.content(&alpha, size));
        for channel in &mut self.options.channels {
            channel.samples = window.samples(&channel.samples, size);
        }
        Ok(self)
    }
}

/// Reads an image file in linear light, with all of its channels. Files without a transfer function
/// are decoded as sRGB, and straight colours are multiplied by alpha.
///
/// # Errors
/// Returns the errors of [`load`](super::load).
pub fn load_file(path: &Path) -> Result<ImageFile, ImageError> {
    let codec = codec_with(path, |codec| {
        Some((codec.name, codec.read?, codec.read_all, codec.metadata.is_some()))
    });
    let (name, read, read_all, has_texts) = codec?;
    let bytes = read_file(path)?;
    let room = &ImageMemory::OF_PROCESS;
    if let Some(read_all) = read_all {
        return guarded(name, || read_all(&bytes, room)).flatten().map_err(content_error(path));
    }
    let numbers = PixelEncoding::Light(Transfer::Srgb);
    let decoded = guarded(name, || read(&bytes, numbers, room));
    let mut decoded = decoded.flatten().map_err(content_error(path))?;
    if let Some(alpha) = &decoded.alpha {
        let pixels = decoded.image.pixels.iter_mut().zip(alpha);
        pixels.for_each(|(pixel, alpha)| *pixel = pixel.map(|v| v * alpha));
    }
    let metadata = if has_texts { super::metadata(path)? } else { Vec::new() };
    Ok(ImageFile::new(decoded, metadata))
}
