//! Textures of materials.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_image::{PixelEncoding, Transfer};
use pt_scene::texture::{Bitmap, Edge, Filter, Pattern, Texture, Wrap};

use super::reader::ColladaReader;
use crate::shared::mesh_file::{locate, percent_decoded};
use crate::shared::names::quote;
use crate::shared::xml::XmlNode;

/// Encoding of pixels.
const NUMBERS: PixelEncoding = PixelEncoding::Light(Transfer::Srgb);

/// Returns the texture of an image file, which is read once for all materials.
///
/// # Errors
/// Returns a message about the element if the file cannot be read.
pub(super) fn read(
    reader: &mut ColladaReader<'_>,
    file: &str,
    wrap: Wrap,
) -> Result<Arc<Texture>, String> {
    let path = path_of(reader, file);
    let context = reader.context;
    let image = reader.images.entry(path).or_insert_with_key(|path| {
        let decoded = context.picture(path, NUMBERS)?;
        Ok(Arc::new(decoded.image))
    });
    let image = image.clone()?;
    let bitmap = Bitmap { image, wrap, filter: Filter::Trilinear };
    Ok(Arc::new(Pattern::Bitmap(bitmap).into()))
}

/// Returns the images to which a document refers.
pub(super) fn pictures(reader: &ColladaReader<'_>) -> Vec<(PathBuf, PixelEncoding)> {
    let names = reader.document.elements().filter(|e| e.tag_name().name() == "init_from");
    let files = names.filter_map(|element| element.text()).map(str::trim);
    files.map(|file| (path_of(reader, file), NUMBERS)).collect()
}

/// Returns the path of a URL: relative to the folder of the scene, or with `file:`.
fn path_of(reader: &ColladaReader<'_>, url: &str) -> PathBuf {
    let folder = reader.document.path().parent().unwrap_or(Path::new(""));
    let text = ["file://localhost", "file://", "file:"]
        .into_iter()
        .find_map(|scheme| url.strip_prefix(scheme))
        .unwrap_or(url);
    // Many exporters do not encode names.
    let as_written = locate(folder, text);
    if as_written.is_file() { as_written } else { locate(folder, &percent_decoded(text)) }
}

/// Returns the wrap mode of a sampler.
pub(super) fn wrap<'a>(reader: &mut ColladaReader<'a>, sampler: Option<XmlNode<'a>>) -> Wrap {
    let mode = |tag: &str| {
        let found = sampler?.descendants().find(|n| n.tag_name().name() == tag)?;
        Some((found, found.text().unwrap_or_default().trim()))
    };
    let edge = |mode: Option<(XmlNode<'a>, &str)>| match mode.map_or("WRAP", |(_, text)| text) {
        "WRAP" => Some(Edge::Repeat),
        "MIRROR" => Some(Edge::Mirror),
        "CLAMP" => Some(Edge::Clamp),
        "BORDER" | "NONE" => Some(Edge::Black),
        _ => None,
    };
    let modes = ["wrap_s", "wrap_t"].map(mode);
    let edges = modes.map(edge);
    for (element, text) in
        modes.iter().zip(edges).filter_map(|(m, edge)| m.filter(|_| edge.is_none()))
    {
        let message = format!(
            "unsupported wrap mode {}; expected WRAP, MIRROR, CLAMP, BORDER or NONE; the image is \
             repeated",
            quote(text)
        );
        reader.warn(element, message);
    }
    let [u, v] = edges.map(Option::unwrap_or_default);
    if let Some((border, color)) = mode("border_color").filter(|_| [u, v].contains(&Edge::Black))
        && color.split_whitespace().take(3).any(|c| c.parse() != Ok(0.0))
    {
        let message = format!("{} around an image is replaced by black", quote(color));
        reader.warn(border, message);
    }
    Wrap { u, v }
}
