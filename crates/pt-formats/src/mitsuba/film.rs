//! `<film>` with its `<rfilter>`.

use pt_scene::Filter;

use super::meter::is_aimed;
use super::object::{MitsubaObject, ObjectTree, Parameters, unsupported};
use crate::LoadError;
use crate::shared::names::quote;

const FILTERS: [&str; 6] = ["box", "catmullrom", "gaussian", "lanczos", "mitchell", "tent"];
/// Largest width and height of an image.
const MAX_SIZE: u32 = 65_536;

/// Film of a sensor.
pub(super) struct SensorFilm {
    /// Width and height in pixels, without the crop.
    pub(super) resolution: [u32; 2],
    /// Crop window x, y, width and height in pixels; `None` for the whole image.
    pub(super) crop: Option<[u32; 4]>,
    pub(super) filter: Filter,
    /// True if the pixel format has an alpha channel.
    pub(super) has_alpha: bool,
}

/// Returns the objects inside of a sensor; a shape is allowed only in sensors with a target.
pub(super) fn parts(tree: &ObjectTree, sensor: &MitsubaObject) -> Result<Vec<usize>, LoadError> {
    let supported = ["film", "sampler", "medium", "sensor", "shape"];
    tree.children(sensor, &supported[..if is_aimed(sensor) { 5 } else { 4 }])
}

/// Reads the film of a sensor; Mitsuba's default if there is none.
pub(super) fn film(tree: &ObjectTree, sensor: &MitsubaObject) -> Result<SensorFilm, LoadError> {
    const DEFAULT: [u32; 2] = [768, 576];
    let children = parts(tree, sensor)?;
    let Some(film) = tree.only(&children, "film")? else {
        return Ok(SensorFilm {
            resolution: DEFAULT,
            crop: None,
            filter: Filter::GAUSSIAN,
            has_alpha: false,
        });
    };
    let film = &tree.objects[film];
    if film.kind != "hdrfilm" {
        return Err(unsupported(film, &["hdrfilm"]));
    }
    let children = tree.children(film, &["rfilter"])?;
    let filter = match tree.only(&children, "rfilter")? {
        Some(index) => filter(tree, &tree.objects[index])?,
        None => Filter::GAUSSIAN,
    };
    let mut parameters = Parameters::new(film);
    let has_alpha = has_alpha(&mut parameters)?;
    parameters.pass_over(&["file_format", "component_format"]);
    parameters.pass_over(&["sample_border", "high_quality_edges", "compensate", "banner"]);
    let width = parameters.count("width", MAX_SIZE)?.unwrap_or(DEFAULT[0]);
    let height = parameters.count("height", MAX_SIZE)?.unwrap_or(DEFAULT[1]);
    let crop = crop(&mut parameters, [width, height])?;
    parameters.finish()?;
    Ok(SensorFilm { resolution: [width, height], crop, filter, has_alpha })
}

/// Returns true if the pixel format has an alpha channel. All formats are written in colour.
fn has_alpha(parameters: &mut Parameters<'_>) -> Result<bool, LoadError> {
    match parameters.text("pixel_format")?.unwrap_or("rgb").to_ascii_lowercase().as_str() {
        "rgba" | "luminance_alpha" | "xyza" => Ok(true),
        "rgb" | "luminance" | "xyz" => Ok(false),
        other => {
            let message = format!(
                "unknown pixel format {}; expected luminance, luminance_alpha, rgb, rgba, xyz or \
                 xyza",
                quote(other)
            );
            Err(parameters.refuse("pixel_format", message))
        }
    }
}

/// Reads the crop window; `None` if it is the whole image.
fn crop(
    parameters: &mut Parameters<'_>,
    [width, height]: [u32; 2],
) -> Result<Option<[u32; 4]>, LoadError> {
    let mut range = |[offset, size]: [&'static str; 2], whole: u32| {
        let start = parameters.integer(offset)?.unwrap_or(0);
        let length = parameters.count(size, MAX_SIZE)?.unwrap_or(whole);
        match u32::try_from(start) {
            Ok(start) if start.saturating_add(length) <= whole => Ok((start, length)),
            _ => {
                let message = format!(
                    "found a crop window of {length} of {whole} pixels from pixel {start} on, \
                     expected one inside of the film"
                );
                Err(parameters.refuse(offset, message))
            }
        }
    };
    let (x, crop_width) = range(["crop_offset_x", "crop_width"], width)?;
    let (y, crop_height) = range(["crop_offset_y", "crop_height"], height)?;
    let is_all = [crop_width, crop_height] == [width, height];
    Ok((!is_all).then_some([x, y, crop_width, crop_height]))
}

/// Reads a reconstruction filter.
fn filter(tree: &ObjectTree, object: &MitsubaObject) -> Result<Filter, LoadError> {
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    let (filter, main) = match object.kind.as_str() {
        "box" => (Filter::Box, ""),
        "tent" => (Filter::Tent { radius: parameters.positive("radius", 1.0)? }, "radius"),
        "gaussian" => (Filter::gaussian(parameters.positive("stddev", 0.5)?), "stddev"),
        "mitchell" => {
            let mut third = |name| Ok(parameters.float(name)?.unwrap_or(1.0 / 3.0));
            (Filter::Mitchell { b: third("B")?, c: third("C")? }, "B")
        }
        "catmullrom" => (Filter::CATMULL_ROM, ""),
        "lanczos" => {
            let lobes = parameters.count("lobes", Filter::MAX_RADIUS as u32)?.unwrap_or(3);
            (Filter::Lanczos { lobes: f64::from(lobes) }, "lobes")
        }
        _ => return Err(unsupported(object, &FILTERS)),
    };
    filter.check().map_err(|message| parameters.refuse(main, message))?;
    parameters.finish()?;
    Ok(filter)
}
