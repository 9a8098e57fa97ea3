//! `<sensor>` with its film and sampler, and `<integrator>`.

use pt_math::{DAffine3, DVec3};

use super::super::xml::quote;
use super::object::{Object, Parameters, Tree, unsupported};
use crate::{Camera, FileSettings, LoadError, Warning};

const SENSORS: [&str; 2] = ["perspective", "thinlens"];
const SAMPLERS: [&str; 5] = ["independent", "ldsampler", "multijitter", "orthogonal", "stratified"];
const FILTERS: [&str; 6] = ["box", "catmullrom", "gaussian", "lanczos", "mitchell", "tent"];
/// Largest width and height of an image.
const MAX_SIZE: u32 = 65_536;

/// The diagonal of 35 mm film in millimetres, to which focal lengths refer.
fn film_diagonal() -> f64 {
    f64::sqrt(36.0 * 36.0 + 24.0 * 24.0)
}

/// A camera.
pub(super) fn camera(tree: &Tree, object: &Object) -> Result<Camera, LoadError> {
    if !SENSORS.contains(&object.kind.as_str()) {
        return Err(unsupported(object, &SENSORS));
    }
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["shutter_open", "shutter_close"]);
    let [width, height] = film(tree, object, &mut Vec::new())?;
    let [x_fov, y_fov] = fields_of_view(&mut parameters, f64::from(width) / f64::from(height))?;
    let near = parameters.positive("near_clip", 0.01)?;
    let far = parameters.positive("far_clip", 10_000.0)?;
    if near >= far {
        let message = format!("far_clip ({far}) is not behind near_clip ({near})");
        return Err(parameters.refuse("far_clip", message));
    }
    let focal_distance = parameters.positive("focus_distance", far)?;
    let is_lens = object.kind == "thinlens";
    let lens_radius = if is_lens { parameters.positive("aperture_radius", 0.0)? } else { 0.0 };
    for name in ["principal_point_offset_x", "principal_point_offset_y"] {
        if parameters.float(name)?.is_some_and(|x| x != 0.0) {
            let message = format!("{name} is not supported; the axis meets the image centre");
            return Err(parameters.refuse(name, message));
        }
    }
    let to_world = node(&mut parameters)?;
    parameters.finish()?;
    let name = object.name().to_owned();
    Ok(Camera { name, to_world, x_fov, y_fov, near, far, lens_radius, focal_distance })
}

/// The node of a camera, turned from Mitsuba's axes to ours.
fn node(parameters: &mut Parameters<'_>) -> Result<DAffine3, LoadError> {
    const TOLERANCE: f64 = 1e-3; // matrices are written with a few digits
    let to_world = parameters.transform("to_world")?;
    let linear = to_world.matrix3;
    let error = linear.transpose() * linear - pt_math::DMat3::IDENTITY;
    if error.to_cols_array().iter().any(|x| x.abs() > TOLERANCE) {
        let message = "the camera is scaled or sheared; expected turns and translations only";
        return Err(parameters.refuse("to_world", message));
    }
    Ok(to_world * DAffine3::from_scale(DVec3::new(-1.0, 1.0, -1.0)))
}

/// Horizontal and vertical field of view in degrees, for an aspect of width over height.
fn fields_of_view(parameters: &mut Parameters<'_>, aspect: f64) -> Result<[f64; 2], LoadError> {
    let axis = parameters.text("fov_axis")?.unwrap_or("x");
    let (fov, focal_length) = (parameters.float("fov")?, parameters.text("focal_length")?);
    // Half the extent of the image at unit distance, along the axis.
    let (half, axis) = match (fov, focal_length) {
        (Some(_), Some(_)) => {
            return Err(parameters.refuse("fov", "expected fov or focal_length, not both"));
        }
        (Some(fov), None) if 0.0 < fov && fov < 180.0 => (libm::tan(0.5 * fov.to_radians()), axis),
        (Some(fov), None) => {
            let message = format!("the fov is {fov}; expected degrees above 0 and below 180");
            return Err(parameters.refuse("fov", message));
        }
        (None, text) => {
            let text = text.unwrap_or("50mm");
            let length = text.strip_suffix("mm").unwrap_or(text).trim().parse().ok();
            let length = length.filter(|x: &f64| x.is_finite() && *x > 0.0);
            let length = length.ok_or_else(|| {
                let message = format!("{} is no length like \"50mm\"", quote(text));
                parameters.refuse("focal_length", message)
            })?;
            (0.5 * film_diagonal() / length, "diagonal")
        }
    };
    let half_x = match axis {
        "x" => half,
        "y" => half * aspect,
        "smaller" => half * aspect.max(1.0),
        "larger" => half * aspect.min(1.0),
        "diagonal" => half / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
        other => {
            let message =
                format!("{} is no axis; expected x, y, smaller, larger or diagonal", quote(other));
            return Err(parameters.refuse("fov_axis", message));
        }
    };
    let degrees = |half: f64| 2.0 * libm::atan(half).to_degrees();
    Ok([degrees(half_x), degrees(half_x / aspect)])
}

/// Size of the image and samples per pixel that a sensor asks for.
pub(super) fn settings(
    tree: &Tree,
    object: &Object,
    warnings: &mut Vec<Warning>,
) -> Result<FileSettings, LoadError> {
    let resolution = Some(film(tree, object, warnings)?);
    let children = tree.children(object, &["film", "sampler"])?;
    let Some(sampler) = tree.only(&children, "sampler")? else {
        return Ok(FileSettings { resolution, ..FileSettings::default() });
    };
    let sampler = &tree.objects[sampler];
    if !SAMPLERS.contains(&sampler.kind.as_str()) {
        return Err(unsupported(sampler, &SAMPLERS));
    }
    tree.children(sampler, &[])?;
    let mut parameters = Parameters::new(sampler);
    parameters.pass_over(&["jitter", "seed"]);
    let spp = parameters.count("sample_count", u32::MAX)?;
    parameters.finish()?;
    Ok(FileSettings { resolution, spp, max_depth: None })
}

/// Width and height of the film of a sensor, in pixels.
fn film(tree: &Tree, sensor: &Object, warnings: &mut Vec<Warning>) -> Result<[u32; 2], LoadError> {
    const DEFAULT: [u32; 2] = [768, 576];
    let children = tree.children(sensor, &["film", "sampler"])?;
    let Some(film) = tree.only(&children, "film")? else { return Ok(DEFAULT) };
    let film = &tree.objects[film];
    if film.kind != "hdrfilm" {
        return Err(unsupported(film, &["hdrfilm"]));
    }
    let children = tree.children(film, &["rfilter"])?;
    let filter = tree.only(&children, "rfilter")?.map(|i| &tree.objects[i]);
    let (kind, at) = filter.map_or(("gaussian", &film.at), |f| (f.kind.as_str(), &f.at));
    if let Some(filter) = filter.filter(|f| !FILTERS.contains(&f.kind.as_str())) {
        return Err(unsupported(filter, &FILTERS));
    }
    if kind != "box" {
        let origin = if filter.is_some() { "" } else { ", Mitsuba's default," };
        let message = format!(
            "the reconstruction filter \"{kind}\"{origin} is not supported; \"box\" is used"
        );
        warnings.push(Warning { at: at.clone(), message });
    }
    let mut parameters = Parameters::new(film);
    let format = ["file_format", "pixel_format", "component_format"];
    parameters.pass_over(&format);
    parameters.pass_over(&["sample_border", "high_quality_edges", "compensate", "banner"]);
    let width = parameters.count("width", MAX_SIZE)?.unwrap_or(DEFAULT[0]);
    let height = parameters.count("height", MAX_SIZE)?.unwrap_or(DEFAULT[1]);
    parameters.finish()?;
    Ok([width, height])
}

/// How many interactions with surfaces an integrator allows.
pub(super) fn max_depth(
    tree: &Tree,
    object: Option<&Object>,
    warnings: &mut Vec<Warning>,
) -> Result<u32, LoadError> {
    let Some(object) = object else { return Ok(u32::MAX) };
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    if parameters.boolean("hide_emitters")? {
        let message = "emitters cannot be hidden; they are seen directly".to_owned();
        warnings.push(Warning { at: object.at.clone(), message });
    }
    let depth = match object.kind.as_str() {
        "path" => {
            parameters.pass_over(&["rr_depth"]);
            match parameters.integer("max_depth")? {
                None | Some(-1) => u32::MAX,
                Some(depth) => {
                    let interactions = depth.checked_sub(1).and_then(|d| u32::try_from(d).ok());
                    interactions.ok_or_else(|| {
                        let message = format!(
                            "max_depth is {depth}; expected -1 (no limit), 1 (emitters only), 2 \
                             (direct light) or more"
                        );
                        parameters.refuse("max_depth", message)
                    })?
                }
            }
        }
        "direct" => {
            parameters.pass_over(&["shading_samples", "emitter_samples", "bsdf_samples"]);
            1
        }
        _ => return Err(unsupported(object, &["path", "direct"])),
    };
    parameters.finish()?;
    Ok(depth)
}
