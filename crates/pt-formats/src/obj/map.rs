//! Images that vary the values of a material.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use pt_image::PixelEncoding;
use pt_math::{DMat3, DVec3};
use pt_scene::Span;
use pt_scene::image::Image;
use pt_scene::texture::{Bitmap, Filter, Pattern, Texture, Wrap};

use super::library;
use super::notes::MaterialNotes;
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::line::Line;
use crate::shared::names::quote;
use crate::shared::placeholder;

/// A statement like `map_Kd -s 2 2 wood.png`.
#[derive(Clone, Debug)]
pub(super) struct TextureMap {
    pub(super) at: Span,
    pub(super) file: String,
    /// Factor of the texture coordinates.
    scale: [f32; 2],
    /// Offset of the scaled texture coordinates.
    offset: [f32; 2],
    wrap: Wrap,
    /// Factor of heights (`-bm`).
    pub(super) height: f32,
    /// Channel of a scalar (`-imfchan`), 0 to 2; `None` is the luminance.
    channel: Option<usize>,
}

/// Interpretation of an image's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum MapUsage {
    /// sRGB colours.
    Colors,
    /// A raw scalar: the luminance or a channel.
    Number,
    /// The alpha channel if there is one, otherwise as [`Self::Number`].
    Opacity,
    /// Raw normals or heights.
    Relief,
}

impl MapUsage {
    /// Returns the encoding of the image's pixels.
    fn numbers(self) -> PixelEncoding {
        PixelEncoding::of_raw(self != Self::Colors)
    }
}

/// Options with one word that have no effect, or only on the filtering of texels: `-blendu on`,
/// `-boost 2` …
const PASSED_OVER: [&str; 5] = ["-blendu", "-blendv", "-boost", "-texres", "-type"];

impl TextureMap {
    /// Reads a statement with an image; `None`, with a warning, if it names no file.
    ///
    /// # Errors
    /// Returns an error if an option lacks its number.
    pub(super) fn parse(line: Line, notes: &mut MaterialNotes) -> Result<Option<Self>, LoadError> {
        let keyword = line.keyword();
        let mut map = Self {
            at: line.at(line.text.trim_start()),
            file: String::new(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            wrap: Wrap::REPEAT,
            height: 1.0,
            channel: None,
        };
        let mut rest = LineWords(line.text.trim_start()[keyword.len()..].trim());
        while let Some(option) = rest.peek().filter(|word| word.starts_with('-')) {
            rest.next();
            map.option(line, option, &mut rest, notes)?;
        }
        map.file = rest.0.trim().to_owned();
        if map.file.is_empty() {
            let message = format!(
                "missing name of an image after {}; the statement is ignored",
                quote(keyword)
            );
            notes.add(map.at, message);
            return Ok(None);
        }
        Ok(Some(map))
    }

    fn option<'a>(
        &mut self,
        line: Line<'a>,
        option: &'a str,
        rest: &mut LineWords<'a>,
        notes: &mut MaterialNotes,
    ) -> Result<(), LoadError> {
        match option {
            "-s" => self.scale = pair(line, rest, 1.0)?,
            "-o" => self.offset = pair(line, rest, 0.0)?,
            "-bm" => [self.height] = line.numbers(&mut *rest)?,
            "-clamp" if rest.next() == Some("on") => {
                self.wrap = Wrap::CLAMP;
                let message = "\"-clamp on\": the image is extended by the colour of its edges";
                notes.add(line.at(option), message.to_owned());
            }
            "-clamp" => self.wrap = Wrap::REPEAT,
            "-imfchan" => self.channel = channel(line, option, rest.next(), notes),
            "-mm" => {
                let range: [f32; 2] = line.numbers(&mut *rest)?;
                if range != [0.0, 1.0] {
                    notes.add(
                        line.at(option),
                        "\"-mm\" is ignored: images are not scaled".to_owned(),
                    );
                }
            }
            "-t" => {
                if pair(line, rest, 0.0)? != [0.0; 2] {
                    notes.add(
                        line.at(option),
                        "\"-t\" is ignored: turbulence is not supported".to_owned(),
                    );
                }
            }
            "-cc" => {
                if rest.next() == Some("on") {
                    let message =
                        "\"-cc on\" is ignored: colour correction is not supported".to_owned();
                    notes.add(line.at(option), message);
                }
            }
            _ if PASSED_OVER.contains(&option) => drop(rest.next()),
            _ => {
                let message = format!(
                    "unknown option {} of an image; it is ignored with the numbers after it",
                    quote(option)
                );
                notes.add(line.at(option), message);
                while rest.peek().is_some_and(is_number) {
                    rest.next();
                }
            }
        }
        Ok(())
    }
}

/// Words of a line, with the text that follows them.
struct LineWords<'a>(&'a str);

impl<'a> LineWords<'a> {
    fn peek(&self) -> Option<&'a str> {
        self.0.split_ascii_whitespace().next()
    }
}

impl<'a> Iterator for LineWords<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let word = self.peek()?;
        self.0 = &self.0.trim_ascii_start()[word.len()..];
        Some(word)
    }
}

fn is_number(word: &str) -> bool {
    word.parse::<f32>().is_ok()
}

/// Reads one to three numbers for u, v and w; w is ignored for images.
fn pair<'a>(line: Line<'a>, rest: &mut LineWords<'a>, default: f32) -> Result<[f32; 2], LoadError> {
    let [u] = line.numbers(&mut *rest)?;
    let mut next = || match rest.peek().filter(|word| is_number(word)) {
        Some(_) => line.numbers(&mut *rest).map(|[number]| number),
        None => Ok(default),
    };
    let (v, _) = (next()?, next()?);
    Ok([u, v])
}

/// Returns the channel that a word names; `None` is the luminance.
fn channel(
    line: Line,
    option: &str,
    word: Option<&str>,
    notes: &mut MaterialNotes,
) -> Option<usize> {
    match word {
        Some("r") => Some(0),
        Some("g") => Some(1),
        Some("b") => Some(2),
        Some("l") => None,
        _ => {
            let message = "\"-imfchan\": expected r, g, b or l; the luminance is used".to_owned();
            notes.add(line.at(option), message);
            None
        }
    }
}

/// An image, or the reason why there is none.
type MapImage = Result<Arc<Image>, String>;

/// Images that were read, once per content.
pub(super) struct MapImages<'f> {
    folder: &'f Folder,
    made: HashMap<(PathBuf, MapUsage, Option<usize>), MapImage>,
}

impl<'f> MapImages<'f> {
    pub(super) fn new(folder: &'f Folder) -> Self {
        Self { folder, made: HashMap::new() }
    }

    /// Returns the texture of a map. A missing image is replaced by a placeholder, and its use is
    /// recorded for the material.
    pub(super) fn texture(&mut self, map: &TextureMap, content: MapUsage) -> Arc<Texture> {
        let context = &self.folder.context;
        let image = match self.image(map, content) {
            Ok(image) => image,
            Err(why) => {
                let message = format!("the image is not shown: {why}; {}", placeholder::INSTEAD);
                context.missing(map.at.clone(), message);
                context.set_placeholder_used();
                return placeholder::texture();
            }
        };
        // The mean of normals is not a normal.
        let filter = if content == MapUsage::Relief { Filter::Bilinear } else { Filter::Trilinear };
        let [u, v] = map.scale.map(f64::from);
        let offset = DVec3::new(map.offset[0].into(), map.offset[1].into(), 1.0);
        let to_pattern = DMat3::from_cols(DVec3::X * u, DVec3::Y * v, offset);
        let pattern = Pattern::Bitmap(Bitmap { image, wrap: map.wrap, filter });
        Arc::new(Texture::on_surface(pattern, to_pattern))
    }

    /// Reads the image of a map. The error is a message.
    fn image(&mut self, map: &TextureMap, content: MapUsage) -> Result<Arc<Image>, String> {
        let path = library::file(self.folder, &map.file);
        let channel =
            map.channel.filter(|_| matches!(content, MapUsage::Number | MapUsage::Opacity));
        let context = &self.folder.context;
        let key = (path, content, channel);
        let image = self.made.entry(key).or_insert_with_key(|(path, ..)| {
            let mut decoded = context.picture(path, content.numbers())?;
            match (channel, decoded.alpha) {
                (Some(channel), _) => {
                    decoded.image.pixels.iter_mut().for_each(|p| *p = [p[channel]; 3]);
                }
                (None, Some(alpha)) if content == MapUsage::Opacity => {
                    decoded.image.pixels.iter_mut().zip(alpha).for_each(|(p, a)| *p = [a; 3]);
                }
                _ => {}
            }
            Ok(Arc::new(decoded.image))
        });
        image.clone()
    }
}
