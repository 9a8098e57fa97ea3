//! Cameras.

use pt_math::DAffine3;

use super::reader::{Reader, child, name_of};
use crate::format::xml::Node;
use crate::{Camera, Fit, LoadError, Placement, Projection};

/// Horizontal field of view, in degrees, of cameras that give none (as in the course program).
const DEFAULT_X_FOV: f64 = 50.0;
/// Half of the width that orthographic cameras see which give no size.
const DEFAULT_X_MAG: f64 = 1.0;
/// Width over height where it follows from nothing, of images that have no size yet and under
/// `--cs184` (800×600 in the course program).
const DEFAULT_ASPECT: f64 = 4.0 / 3.0;
/// Limits of sight that are not written (as in the course program).
const DEFAULT_NEAR: f64 = 0.001;
const DEFAULT_FAR: f64 = 1000.0;
/// Focal distance of cameras; they are pinholes, so it only matters once a lens is asked for.
const DEFAULT_FOCAL_DISTANCE: f64 = 4.7;

/// Reads a camera; one without a view is left out with a warning.
pub(super) fn read<'a>(
    reader: &mut Reader<'a>,
    camera: Node<'a>,
    to_world: DAffine3,
) -> Result<Option<Camera>, LoadError> {
    let technique = child(camera, "optics").and_then(|o| child(o, "technique_common"));
    let view = |tag| technique.and_then(|t| child(t, tag));
    let (view, projection, fit) = if let Some(perspective) = view("perspective") {
        let ([x_fov, y_fov], fit) = fields_of_view(reader, perspective)?;
        (perspective, Projection::Perspective { x_fov, y_fov }, fit)
    } else if let Some(orthographic) = view("orthographic") {
        let ([half_width, half_height], fit) = magnifications(reader, orthographic)?;
        (orthographic, Projection::Orthographic { half_width, half_height }, fit)
    } else {
        let message = "it has no <optics> with a <technique_common> with a <perspective> or \
                       <orthographic>; it is left out";
        reader.warn(camera, message);
        return Ok(None);
    };
    let distance = |tag, default| {
        child(view, tag).map_or(Ok(default), |element| match reader.scalar(element)? {
            distance if distance >= 0.0 => Ok(distance),
            bad => {
                Err(reader.error(element, format!("expected a distance from 0 up, found {bad}")))
            }
        })
    };
    let near = distance("znear", DEFAULT_NEAR)?;
    let far = distance("zfar", DEFAULT_FAR.max(2.0 * near))?;
    if near >= far {
        let message = format!("<znear> is {near}, <zfar> is {far}; expected znear < zfar");
        return Err(reader.error(view, message));
    }
    Ok(Some(Camera {
        name: name_of(camera),
        to_world,
        motion: None,
        shutter: [0.0; 2],
        projection,
        near,
        far,
        lens_radius: 0.0,
        aperture: None,
        focal_distance: DEFAULT_FOCAL_DISTANCE,
        principal_point_offset: [0.0; 2],
        fit,
        medium: None,
        placement: Placement::Node,
        meter: None,
    }))
}

/// Half of the width and height of what an orthographic camera sees, from what there is of
/// `xmag`, `ymag` and `aspect_ratio`: x = aspect · y. COLLADA calls them magnifications; that they
/// are halves is what glTF says of the same two numbers, and what Blender writes.
fn magnifications<'a>(
    reader: &mut Reader<'a>,
    orthographic: Node<'a>,
) -> Result<([f64; 2], Fit), LoadError> {
    let size = |tag| {
        child(orthographic, tag)
            .map(|element| match reader.scalar(element)? {
                size if size > 0.0 && size.is_finite() => Ok(size),
                bad => {
                    let message = format!("expected half of what is seen, above 0, found {bad}");
                    Err(reader.error(element, message))
                }
            })
            .transpose()
    };
    let sizes = [size("xmag")?, size("ymag")?];
    if sizes == [None; 2] {
        let message = format!("it has no <xmag> and no <ymag>; <xmag> {DEFAULT_X_MAG} is taken");
        reader.warn(orthographic, message);
    }
    let times = |size: f64, factor: f64| size * factor;
    sides(reader, orthographic, sizes, DEFAULT_X_MAG, times)
}

/// Both fields of view, in degrees, from what there is of `xfov`, `yfov` and `aspect_ratio`.
///
/// tan(x/2) = aspect · tan(y/2).
fn fields_of_view<'a>(
    reader: &mut Reader<'a>,
    perspective: Node<'a>,
) -> Result<([f64; 2], Fit), LoadError> {
    let angle = |tag| {
        child(perspective, tag)
            .map(|element| match reader.scalar(element)? {
                angle if angle > 0.0 && angle < 180.0 => Ok(angle),
                bad => {
                    let message = format!("expected an angle between 0° and 180°, found {bad}");
                    Err(reader.error(element, message))
                }
            })
            .transpose()
    };
    let angles = [angle("xfov")?, angle("yfov")?];
    if angles == [None; 2] {
        let message = format!("it has no <xfov> and no <yfov>; <xfov> {DEFAULT_X_FOV} is taken");
        reader.warn(perspective, message);
    }
    sides(reader, perspective, angles, DEFAULT_X_FOV, with_tangent_of_half_times)
}

/// Two sides of a view, from what there is of them and of `aspect_ratio`; `times` makes the one of
/// the other, by the ratio of their lengths. Without a ratio, the given side is kept, and the other
/// follows from the shape of the image. [COLLADA 1.5.0, "perspective"]
fn sides<'a>(
    reader: &mut Reader<'a>,
    view: Node<'a>,
    [x, y]: [Option<f64>; 2],
    default_x: f64,
    times: impl Fn(f64, f64) -> f64,
) -> Result<([f64; 2], Fit), LoadError> {
    /// By how much of itself a ratio may differ from that of the sides.
    const TOLERANCE: f64 = 0.01;
    let given = aspect_ratio(reader, view)?;
    let aspect = given.unwrap_or(DEFAULT_ASPECT);
    let fit = |side| if given.is_some() { Fit::Whole } else { side };
    Ok(match (x, y) {
        (Some(x), Some(y)) => {
            let follows = times(y, aspect);
            if given.is_some() && (follows - x).abs() > TOLERANCE * x {
                let message = "its width, its height and its <aspect_ratio> do not fit together; width and height \
                               are taken";
                reader.warn(view, message);
            }
            ([x, y], Fit::Whole)
        }
        (None, Some(y)) => ([times(y, aspect), y], fit(Fit::Height)),
        (x, None) => {
            let x = x.unwrap_or(default_x);
            ([x, times(x, aspect.recip())], fit(Fit::Width))
        }
    })
}

/// Width over height, if it is given.
fn aspect_ratio<'a>(reader: &Reader<'a>, view: Node<'a>) -> Result<Option<f64>, LoadError> {
    let Some(element) = child(view, "aspect_ratio") else { return Ok(None) };
    match reader.scalar(element)? {
        aspect if aspect > 0.0 && aspect.is_finite() => Ok(Some(aspect)),
        bad => {
            let message = format!("expected width over height, above 0, found {bad}");
            Err(reader.error(element, message))
        }
    }
}

/// The angle whose half has `factor` times the tangent of half the given angle; degrees.
fn with_tangent_of_half_times(degrees: f64, factor: f64) -> f64 {
    let tangent = libm::tan(degrees.to_radians() / 2.0) * factor;
    (2.0 * libm::atan(tangent)).to_degrees()
}
