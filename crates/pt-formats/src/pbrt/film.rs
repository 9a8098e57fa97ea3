//! `Film`, `PixelFilter`, `Sampler`, `Integrator` and `Option`: render settings.

use pt_scene::{Filter, RenderHints, Warning};

use super::camera::CameraSetup;
use super::entity::Entity;
use crate::LoadError;
use crate::shared::names::quote;

const FILMS: [&str; 3] = ["rgb", "gbuffer", "spectral"];
const FILTERS: [&str; 5] = ["box", "gaussian", "mitchell", "sinc", "triangle"];
const SAMPLERS: [&str; 7] =
    ["halton", "independent", "paddedsobol", "pmj02bn", "sobol", "stratified", "zsobol"];
/// Largest width and height of an image.
const MAX_SIZE: u32 = 65_536;

/// Returns the render settings, and the sensitivity of the sensor for an exposure of one second.
pub(super) fn settings(
    sight: &CameraSetup,
    warnings: &mut Vec<Warning>,
) -> Result<(RenderHints, f64), LoadError> {
    let mut settings = RenderHints { resolution: Some([1280, 720]), ..RenderHints::default() };
    let mut sensitivity = 1.0;
    if let Some(film) = &sight.film {
        sensitivity = read_film(film, &mut settings, warnings)?;
    }
    settings.filter = Some(match &sight.filter {
        Some(entity) => filter(entity, warnings)?,
        None => Filter::Gaussian { stddev: 0.5, radius: 1.5 },
    });
    settings.spp = Some(sight.sampler.as_ref().map_or(Ok(16), samples)?);
    integrator(sight.integrator.as_ref(), &mut settings, warnings)?;
    Ok((settings, sensitivity))
}

/// Reads the film and returns the sensitivity of its sensor.
fn read_film(
    entity: &Entity,
    settings: &mut RenderHints,
    warnings: &mut Vec<Warning>,
) -> Result<f64, LoadError> {
    if !FILMS.contains(&entity.kind.as_str()) {
        return Err(entity.unsupported(&FILMS));
    }
    let mut warn = |message: String| warnings.push(Warning { at: entity.at.span(""), message });
    if entity.kind != "rgb" {
        warn(format!("only the colours of {} are written", entity.describe()));
    }
    entity.pass_over(&["filename", "savefp16", "diagonal", "coordinatesystem"]);
    entity.pass_over(&["nbuckets", "lambdamin", "lambdamax"]);
    let size = [
        entity.count("xresolution", 1280, [1, MAX_SIZE])?,
        entity.count("yresolution", 720, [1, MAX_SIZE])?,
    ];
    settings.resolution = Some(size);
    settings.crop = crop(entity, size)?;
    if entity.given_float("maxcomponentvalue")?.is_some() {
        warn("\"maxcomponentvalue\" is ignored: radiance is not clamped".to_owned());
    }
    match entity.text("sensor")? {
        None | Some("cie1931") => {}
        Some(other) => warn(format!(
            "the sensor {} is approximated by \"cie1931\": colours differ slightly",
            quote(other)
        )),
    }
    if white_balance(entity)?.is_some() {
        warn(
            "white balance is applied to the colours of light, not to the response of the sensor"
                .to_owned(),
        );
    }
    let iso = entity.positive("iso", 100.0)?;
    entity.finish()?;
    Ok(iso / 100.0)
}

/// Reads the temperature in kelvins of the daylight that becomes white; `None` for no white
/// balance.
///
/// # Errors
/// If it is out of range.
pub(super) fn white_balance(film: &Entity) -> Result<Option<f64>, LoadError> {
    const RANGE: std::ops::RangeInclusive<f64> = 2000.0..=25_000.0;
    match film.float("whitebalance", 0.0)? {
        0.0 => Ok(None),
        kelvin if RANGE.contains(&kelvin) => Ok(Some(kelvin)),
        kelvin => {
            let (least, most) = (RANGE.start(), RANGE.end());
            let message = format!(
                "found \"whitebalance\" = {kelvin}, expected 0, or {least} to {most} kelvins"
            );
            Err(film.refuse("whitebalance", message))
        }
    }
}

/// Reads the crop window; `None` if it is the whole image. `cropwindow` takes precedence over
/// `pixelbounds`.
fn crop(entity: &Entity, size: [u32; 2]) -> Result<Option<[u32; 4]>, LoadError> {
    let pixels = match entity.indices("pixelbounds", MAX_SIZE as usize + 1)? {
        None => [[0, size[0]], [0, size[1]]],
        Some(bounds) => match bounds[..] {
            [x0, x1, y0, y1] => [[x0, x1.min(size[0])], [y0, y1.min(size[1])]],
            _ => return Err(entity.refuse("pixelbounds", "expected four numbers: x0 x1 y0 y1")),
        },
    };
    let ranges = match entity.floats("cropwindow")? {
        None => pixels,
        Some(&[x0, x1, y0, y1]) => {
            let range = |a: f64, b: f64, n: u32| {
                [a.min(b), a.max(b)].map(|edge| (f64::from(n) * edge.clamp(0.0, 1.0)).ceil() as u32)
            };
            [range(x0, x1, size[0]), range(y0, y1, size[1])]
        }
        Some(_) => return Err(entity.refuse("cropwindow", "expected four numbers: x0 x1 y0 y1")),
    };
    if ranges.iter().any(|[start, end]| start >= end) {
        let name = if entity.find("cropwindow").is_some() { "cropwindow" } else { "pixelbounds" };
        return Err(entity.refuse(
            name,
            "found a crop window without pixels of the film, expected x0 < x1 and y0 < y1",
        ));
    }
    let [[x0, x1], [y0, y1]] = ranges;
    let crop = [x0, y0, x1 - x0, y1 - y0];
    Ok((crop != [0, 0, size[0], size[1]]).then_some(crop))
}

/// Reads a reconstruction filter.
fn filter(entity: &Entity, warnings: &mut Vec<Warning>) -> Result<Filter, LoadError> {
    let default = match entity.kind.as_str() {
        "box" => 0.5,
        "gaussian" => 1.5,
        "mitchell" | "triangle" => 2.0,
        "sinc" => 4.0,
        _ => return Err(entity.unsupported(&FILTERS)),
    };
    let [radius, y_radius] =
        [entity.positive("xradius", default)?, entity.positive("yradius", default)?];
    if radius != y_radius {
        return Err(entity
            .refuse("yradius", "found different xradius and yradius, expected the same radius"));
    }
    let fixed = |expected: f64| {
        let message =
            format!("found a radius of {} of {radius}, expected {expected}", entity.describe());
        if radius == expected { Ok(()) } else { Err(entity.refuse("xradius", message)) }
    };
    let filter = match entity.kind.as_str() {
        "box" => {
            fixed(0.5)?;
            Filter::Box
        }
        "gaussian" => Filter::Gaussian { stddev: entity.positive("sigma", 0.5)?, radius },
        "mitchell" => {
            fixed(2.0)?;
            Filter::Mitchell { b: entity.float("B", 1.0 / 3.0)?, c: entity.float("C", 1.0 / 3.0)? }
        }
        "triangle" => Filter::Tent { radius },
        _ => {
            let tau = entity.positive("tau", 3.0)?;
            if tau != radius {
                let message =
                    format!("the filter ends at its tau, {tau} pixels, instead of {radius}");
                warnings.push(Warning { at: entity.at.span(""), message });
            }
            Filter::Lanczos { lobes: tau }
        }
    };
    filter.check().map_err(|message| entity.refuse("xradius", message))?;
    entity.finish()?;
    Ok(filter)
}

/// Reads the number of samples per pixel.
fn samples(entity: &Entity) -> Result<u32, LoadError> {
    if !SAMPLERS.contains(&entity.kind.as_str()) {
        return Err(entity.unsupported(&SAMPLERS));
    }
    entity.pass_over(&["seed", "randomization", "jitter"]);
    let samples = if entity.kind == "stratified" {
        let [x, y] = ["xsamples", "ysamples"].map(|name| entity.count(name, 4, [1, MAX_SIZE - 1]));
        x? * y?
    } else {
        entity.count("pixelsamples", 16, [1, i32::MAX as u32])?
    };
    entity.finish()?;
    Ok(samples)
}

/// Reads the integrator and its path depth.
fn integrator(
    entity: Option<&Entity>,
    settings: &mut RenderHints,
    warnings: &mut Vec<Warning>,
) -> Result<(), LoadError> {
    const EXACT: [&str; 4] = ["path", "simplepath", "simplevolpath", "volpath"];
    const OTHERS: [&str; 4] = ["bdpt", "lightpath", "mlt", "sppm"];
    const DEPTH: u32 = 5;
    let Some(entity) = entity else {
        (settings.integrator, settings.max_depth) = (Some("volpath"), Some(DEPTH));
        return Ok(());
    };
    let kind = entity.kind.as_str();
    let is_other = OTHERS.contains(&kind);
    if !is_other && !EXACT.contains(&kind) {
        return Err(entity.unsupported(&[EXACT.as_slice(), OTHERS.as_slice()].concat()));
    }
    if is_other {
        let message = format!(
            "{} is replaced by the path tracer, which converges to the same image",
            entity.describe()
        );
        warnings.push(Warning { at: entity.at.span(""), message });
        entity.pass_over(&[
            "visualizestrategies",
            "visualizeweights",
            "bootstrapsamples",
            "chains",
        ]);
        entity.pass_over(&[
            "mutationsperpixel",
            "largestepprobability",
            "sigma",
            "photonsperiteration",
            "radius",
        ]);
        entity.pass_over(&["iterations", "seed"]);
    }
    entity.pass_over(&["lightsampler", "samplelights", "samplebsdf", "rrthreshold"]);
    if entity.boolean("regularize", false)? {
        let message = "\"regularize\" is ignored: smooth surfaces stay smooth".to_owned();
        warnings.push(Warning { at: entity.at.span(""), message });
    }
    let is_without_media = kind == "path" || kind == "simplepath" || kind == "sppm";
    settings.integrator = (!is_without_media).then_some("volpath");
    settings.max_depth = Some(entity.count("maxdepth", DEPTH, [0, i32::MAX as u32])?);
    entity.finish()
}

/// Rejects options that would change the image.
pub(super) fn check_option(entity: &Entity) -> Result<(), LoadError> {
    entity.pass_over(&[
        "disabletexturefiltering",
        "disablewavelengthjitter",
        "displacementedgescale",
    ]);
    entity.pass_over(&[
        "msereferenceimage",
        "msereferenceout",
        "pixelstats",
        "rendercoordsys",
        "seed",
    ]);
    entity.pass_over(&["wavefront", "gpu", "nthreads", "quiet", "logutilization"]);
    for name in ["disablepixeljitter", "forcediffuse"] {
        if entity.boolean(name, false)? {
            return Err(entity.refuse(name, format!("unsupported option {}", quote(name))));
        }
    }
    entity.finish()
}
