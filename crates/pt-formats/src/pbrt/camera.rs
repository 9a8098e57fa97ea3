//! `Camera`.

use std::rc::Rc;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::{Camera, Fit, Key, Motion, Placement, Projection, Warning};

use super::entity::Entity;
use super::lens::{self, Lens};
use super::types::{MediumInterface, Moving};
use crate::LoadError;
use crate::shared::context::Folder;

/// Camera, film, sampler, integrator and filter of a scene.
#[derive(Default)]
pub(super) struct CameraSetup {
    /// The camera, its transform to the world, and the media around it.
    pub(super) camera: Option<(Entity, Moving, Rc<MediumInterface>)>,
    pub(super) film: Option<Entity>,
    pub(super) sampler: Option<Entity>,
    pub(super) integrator: Option<Entity>,
    pub(super) filter: Option<Entity>,
}

const KINDS: [&str; 4] = ["perspective", "orthographic", "spherical", "realistic"];
/// Distance of the near plane, which pbrt-v4 does not have.
const NEAR: f64 = 1e-6;
/// Distance of the far plane: practically infinite.
const FAR: f64 = 1e30;

/// Context of a camera: the state and settings outside of its directive.
pub(super) struct Around<'a> {
    /// Transforms to the world at the two times.
    pub(super) to_world: Moving,
    pub(super) times: [f64; 2],
    pub(super) medium: Option<u32>,
    /// Width and height of the image in pixels.
    pub(super) resolution: [u32; 2],
    /// Diagonal of the film in millimetres.
    pub(super) diagonal: f64,
    /// Folder of lens files.
    pub(super) folder: &'a Folder,
}

/// Builds a camera and returns it with the factor by which it multiplies light: the exposure time
/// in seconds, and the transmission of a lens.
pub(super) fn camera(
    entity: &Entity,
    around: &Around<'_>,
    warnings: &mut Vec<Warning>,
) -> Result<(Camera, f64), LoadError> {
    let Around { to_world, times, medium, resolution: [width, height], .. } = *around;
    if !KINDS.contains(&entity.kind.as_str()) {
        return Err(entity.unsupported(&KINDS));
    }
    let shutter = [entity.float("shutteropen", 0.0)?, entity.float("shutterclose", 1.0)?];
    if shutter[0] >= shutter[1] {
        let message = format!(
            "found a shutter from {} s to {} s, expected a shutterclose after shutteropen",
            shutter[0], shutter[1]
        );
        return Err(entity.refuse("shutterclose", message));
    }
    let aspect = f64::from(width) / f64::from(height);
    let lens = (entity.kind == "realistic").then(|| realistic(entity, around, warnings));
    let lens = lens.transpose()?;
    let (projection, film_offset, node) = match entity.kind.as_str() {
        "spherical" => (panorama(entity)?, [0.0; 2], EAST),
        kind => {
            let (view, offset) = match &lens {
                Some(lens) => (lens.projection(), [0.0; 2]),
                None => view(entity, aspect, kind == "perspective")?,
            };
            (view, offset, DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)))
        }
    };
    let before_film = lens.map_or(0.0, |lens| lens.distance);
    let node = DAffine3::from_mat3_translation(node, DVec3::Z * before_film);
    let [start, end] = to_world.map(|map| map * node);
    let moves = start != end;
    let motion = moves.then(|| {
        let keys =
            times.into_iter().zip([start, end]).map(|(time, to_world)| Key { time, to_world });
        Motion::new(keys.collect()).map_err(|error| entity.at.error(error.message))
    });
    let [lens_radius, focal_distance] = match lens {
        Some(lens) => [lens.radius, lens.focal_distance],
        None => [entity.not_negative("lensradius", 0.0)?, entity.positive("focaldistance", 1e6)?],
    };
    if lens.is_none() && lens_radius > 0.0 && entity.kind != "perspective" {
        let message = "found a lens of a non-perspective camera, expected a lensradius of 0";
        return Err(entity.refuse("lensradius", message));
    }
    let camera = Camera {
        name: entity.kind.clone(),
        to_world: if moves { DAffine3::IDENTITY } else { start },
        motion: motion.transpose()?,
        shutter,
        projection,
        near: NEAR,
        far: FAR,
        lens_radius,
        aperture: None,
        focal_distance,
        principal_point_offset: film_offset,
        fit: Fit::Whole,
        medium,
        placement: Placement::Node,
        meter: None,
    };
    entity.finish()?;
    Ok((camera, (shutter[1] - shutter[0]) * lens.map_or(1.0, |lens| lens.light)))
}

/// Reads the lens of a realistic camera.
fn realistic(
    entity: &Entity,
    around: &Around<'_>,
    warnings: &mut Vec<Warning>,
) -> Result<Lens, LoadError> {
    let [width, height] = around.resolution.map(f64::from);
    let film = [width, height].map(|side| around.diagonal * side / libm::hypot(width, height));
    let lens = lens::lens(entity, film, around.folder)?;
    let mut warn = |message| warnings.push(Warning { at: entity.at.span(""), message });
    warn(format!(
        "the lens of {:.1} mm and f/{:.1} is approximated by a thin lens, without distortion and \
         vignetting",
        lens.focal_length, lens.number
    ));
    if entity.text("aperture")?.is_some() {
        warn("\"aperture\" is ignored: the lens opening is round".to_owned());
    }
    Ok(lens)
}

/// Rotation from the node of our panoramas, which face −z with +x to the right, to a spherical
/// camera: the left edge of its image is along +x, and a quarter of its width further, it faces +z.
const EAST: DMat3 = DMat3::from_cols(DVec3::new(0.0, 0.0, -1.0), DVec3::Y, DVec3::X);

fn panorama(entity: &Entity) -> Result<Projection, LoadError> {
    match entity.text("mapping")? {
        Some("equirectangular") => Ok(Projection::Panorama),
        other => {
            let mapping = other.unwrap_or("equalarea");
            let message = format!("unsupported mapping \"{mapping}\"; supported: equirectangular");
            Err(entity.refuse("mapping", message))
        }
    }
}

/// Returns the projection and the principal point offset of the screen window. The field of view is
/// that of the square from −1 to 1, to which the shorter side of the window is fitted.
fn view(
    entity: &Entity,
    aspect: f64,
    in_perspective: bool,
) -> Result<(Projection, [f64; 2]), LoadError> {
    let frame = entity.positive("frameaspectratio", aspect)?;
    let fitted = if frame > 1.0 {
        [-frame, frame, -1.0, 1.0]
    } else {
        [-1.0, 1.0, -1.0 / frame, 1.0 / frame]
    };
    let [x0, x1, y0, y1] = match entity.floats("screenwindow")? {
        None => fitted,
        Some(&[x0, x1, y0, y1]) if x0 < x1 && y0 < y1 => [x0, x1, y0, y1],
        Some(_) => {
            let message =
                "expected a screenwindow of left, right, lower and upper edge, in this order";
            return Err(entity.refuse("screenwindow", message));
        }
    };
    let [half_width, half_height] = [0.5 * (x1 - x0), 0.5 * (y1 - y0)];
    if (half_width / half_height / aspect - 1.0).abs() > 1e-3 {
        let message = "found a screenwindow with an aspect ratio other than that of the image, \
                       expected that of xresolution and yresolution";
        let name =
            if entity.find("screenwindow").is_some() { "screenwindow" } else { "frameaspectratio" };
        return Err(entity.refuse(name, message));
    }
    // Without an offset the axis is in the centre. It is at −x0/(x1 − x0) from the left and y1/(y1
    // − y0) from the top.
    let offset = [0.5 * (x0 + x1) / (x1 - x0), -0.5 * (y0 + y1) / (y1 - y0)];
    if !in_perspective {
        if offset.iter().any(|x| x.abs() > 1e-6) {
            let message = "found an off-centre window of an orthographic camera, expected one \
                           centred at 0; move the camera instead";
            return Err(entity.refuse("screenwindow", message));
        }
        return Ok((Projection::Orthographic { half_width, half_height }, [0.0; 2]));
    }
    let fov = match entity.given_float("halffov")? {
        Some(half) => 2.0 * half,
        None => entity.float("fov", 90.0)?,
    };
    if !(0.0 < fov && fov < 180.0) {
        let message = format!("found a fov of {fov}, expected degrees above 0 and below 180");
        return Err(entity.refuse("fov", message));
    }
    let scale = libm::tan(0.5 * fov.to_radians());
    let degrees = |half: f64| 2.0 * libm::atan(half * scale).to_degrees();
    let projection =
        Projection::Perspective { x_fov: degrees(half_width), y_fov: degrees(half_height) };
    let is_good = |fov: f64| 0.0 < fov && fov < 180.0;
    match projection {
        Projection::Perspective { x_fov, y_fov } if is_good(x_fov) && is_good(y_fov) => {
            Ok((projection, offset))
        }
        _ => Err(entity.refuse(
            "screenwindow",
            "found a window that is too small or too large to be represented",
        )),
    }
}
