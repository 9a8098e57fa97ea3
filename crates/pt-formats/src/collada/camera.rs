//! Cameras.

use pt_math::DAffine3;
use pt_scene::{Camera, Fit, Placement, Projection};

use super::reader::{ColladaReader, child, name_of};
use crate::LoadError;
use crate::shared::xml::XmlNode;

/// Default horizontal field of view, in degrees (as in the program of the profile `CGL`).
const DEFAULT_X_FOV: f64 = 50.0;
/// Default half width of the view of orthographic cameras.
const DEFAULT_X_MAG: f64 = 1.0;
/// Default aspect ratio (800×600 in that program).
const DEFAULT_ASPECT: f64 = 4.0 / 3.0;
/// Default clipping distances (as in that program).
const DEFAULT_NEAR: f64 = 0.001;
const DEFAULT_FAR: f64 = 1000.0;
/// Focal distance; the cameras are pinholes, so it matters only if a lens is added.
const DEFAULT_FOCAL_DISTANCE: f64 = 4.7;

/// Reads a camera; one without a projection is omitted with a warning.
pub(super) fn read<'a>(
    reader: &mut ColladaReader<'a>,
    camera: XmlNode<'a>,
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
        let message = "missing <optics> with a <technique_common> with a <perspective> or \
                       <orthographic>; the camera is omitted";
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
        let message = format!("found <znear> {near} and <zfar> {far}, expected znear < zfar");
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

/// Returns half of the width and height of the view of an orthographic camera, from those of
/// `xmag`, `ymag` and `aspect_ratio` that are given: x = aspect · y. COLLADA calls them
/// magnifications; glTF defines the same two numbers as halves, and Blender writes halves.
fn magnifications<'a>(
    reader: &mut ColladaReader<'a>,
    orthographic: XmlNode<'a>,
) -> Result<([f64; 2], Fit), LoadError> {
    let size = |tag| {
        child(orthographic, tag)
            .map(|element| match reader.scalar(element)? {
                size if size > 0.0 && size.is_finite() => Ok(size),
                bad => {
                    let message = format!(
                        "expected half the height or width of the view, above 0, found {bad}"
                    );
                    Err(reader.error(element, message))
                }
            })
            .transpose()
    };
    let sizes = [size("xmag")?, size("ymag")?];
    if sizes == [None; 2] {
        let message = format!("missing <xmag> and <ymag>; <xmag> {DEFAULT_X_MAG} is used");
        reader.warn(orthographic, message);
    }
    let times = |size: f64, factor: f64| size * factor;
    sides(reader, orthographic, sizes, DEFAULT_X_MAG, times)
}

/// Returns both fields of view, in degrees, from those of `xfov`, `yfov` and `aspect_ratio` that
/// are given.
///
/// tan(x/2) = aspect · tan(y/2).
fn fields_of_view<'a>(
    reader: &mut ColladaReader<'a>,
    perspective: XmlNode<'a>,
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
        let message = format!("missing <xfov> and <yfov>; <xfov> {DEFAULT_X_FOV} is used");
        reader.warn(perspective, message);
    }
    sides(reader, perspective, angles, DEFAULT_X_FOV, with_tangent_of_half_times)
}

/// Returns the two sides of a view, from those given and `aspect_ratio`; `times` converts one side
/// to the other by the ratio of their lengths. Without a ratio, the given side is kept, and the
/// other follows from the aspect ratio of the image. [COLLADA 1.5.0, "perspective"]
fn sides<'a>(
    reader: &mut ColladaReader<'a>,
    view: XmlNode<'a>,
    [x, y]: [Option<f64>; 2],
    default_x: f64,
    times: impl Fn(f64, f64) -> f64,
) -> Result<([f64; 2], Fit), LoadError> {
    /// Relative tolerance of the ratio against that of the sides.
    const TOLERANCE: f64 = 0.01;
    let given = aspect_ratio(reader, view)?;
    let aspect = given.unwrap_or(DEFAULT_ASPECT);
    let fit = |side| if given.is_some() { Fit::Whole } else { side };
    Ok(match (x, y) {
        (Some(x), Some(y)) => {
            let follows = times(y, aspect);
            if given.is_some() && (follows - x).abs() > TOLERANCE * x {
                let message = "found inconsistent width, height and <aspect_ratio>; width and \
                               height are used";
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

/// Returns the aspect ratio, or `None` if it is not given.
fn aspect_ratio<'a>(
    reader: &ColladaReader<'a>,
    view: XmlNode<'a>,
) -> Result<Option<f64>, LoadError> {
    let Some(element) = child(view, "aspect_ratio") else { return Ok(None) };
    match reader.scalar(element)? {
        aspect if aspect > 0.0 && aspect.is_finite() => Ok(Some(aspect)),
        bad => {
            let message = format!("expected width over height, above 0, found {bad}");
            Err(reader.error(element, message))
        }
    }
}

/// Returns the angle, in degrees, whose half has `factor` times the tangent of half the given
/// angle.
fn with_tangent_of_half_times(degrees: f64, factor: f64) -> f64 {
    let tangent = libm::tan(degrees.to_radians() / 2.0) * factor;
    (2.0 * libm::atan(tangent)).to_degrees()
}
