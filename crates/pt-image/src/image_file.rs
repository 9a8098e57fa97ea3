//! Content of image files with all channels, from which the files can be written again.

use std::path::Path;

use pt_io::guarded;
use pt_scene::image::Image;

use super::{
    Decoded, DisplayWindow, ImageError, ImageMemory, PixelEncoding, SaveOptions, Transfer,
    codec_with, content_error, decode_as, read_file,
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
        self.image =
            Image { width, height, pixels: window.content(&self.image.pixels, size).into() };
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
    // An unknown extension gives the better message if the file is missing as well.
    super::check_readable(path)?;
    let mut file = decode_file(&read_file(path)?, path)?;
    if codec_with(path, |codec| codec.read_all.is_none().then_some(codec.metadata?)).is_ok() {
        file.options.metadata = super::metadata(path)?;
    }
    Ok(file)
}

/// Decodes the content of a file as [`load_file`] does, without the texts of formats other than
/// OpenEXR; `path` provides the extension, and the name for messages.
///
/// # Errors
/// Returns the errors of [`decode`](super::decode).
pub fn decode_file(bytes: &[u8], path: &Path) -> Result<ImageFile, ImageError> {
    let room = &ImageMemory::OF_PROCESS;
    if let Ok((name, read_all)) = codec_with(path, |codec| Some((codec.name, codec.read_all?))) {
        return guarded(name, || read_all(bytes, room)).flatten().map_err(content_error(path));
    }
    let mut decoded = decode_as(bytes, path, PixelEncoding::Light(Transfer::Srgb))?;
    if let Some(alpha) = &decoded.alpha {
        let pixels = decoded.image.pixels.iter_mut().zip(alpha);
        pixels.for_each(|(pixel, alpha)| *pixel = pixel.map(|v| v * alpha));
    }
    Ok(ImageFile::new(decoded, Vec::new()))
}
