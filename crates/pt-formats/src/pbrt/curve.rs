//! `Shape "curve"`: hair and other thin shapes, as tubes and ribbons of triangles.

use pt_math::DVec3;
use pt_scene::Mesh;

use super::entity::Entity;
use crate::LoadError;
use crate::shared::names::quote;
use crate::shared::tube::{Detail, Spline, TubePoint};

/// Maximum number of segments of a curve.
const MAX_SEGMENTS: usize = 10_000;

/// Converts a curve to a mesh. Ribbons are perpendicular to their normals. All others, including
/// those that face the camera in pbrt-v4, are tubes.
pub(super) fn curve(entity: &Entity) -> Result<Mesh, LoadError> {
    entity.pass_over(&["splitdepth"]);
    let spline = spline(entity)?;
    let normals = ribbon(entity, &spline)?;
    let width = entity.not_negative("width", 1.0)?;
    let [start, end] =
        [entity.not_negative("width0", width)?, entity.not_negative("width1", width)?];
    let width = |place: TubePoint| start * (1.0 - place.u) + end * place.u;
    Ok(match normals {
        Some(normals) => spline.ribbon(&normals, width),
        None => spline.tube(Detail::MIN, |place| 0.5 * width(place)),
    })
}

/// Returns true if a shape is a curve that becomes a closed tube.
pub(super) fn is_tube(entity: &Entity) -> Result<bool, LoadError> {
    Ok(entity.kind == "curve" && entity.text("type")? != Some("ribbon"))
}

fn spline(entity: &Entity) -> Result<Spline, LoadError> {
    let Some(points) = entity.points("P")? else {
        return Err(entity.at.error("missing parameter \"point3 P\""));
    };
    let is_bspline = match entity.text("basis")? {
        None | Some("bezier") => false,
        Some("bspline") => true,
        Some(other) => {
            let message = format!("unknown basis {}; expected bezier or bspline", quote(other));
            return Err(entity.refuse("basis", message));
        }
    };
    let degree = entity.count("degree", 3, [2, 3])? as usize;
    let points = points.into_iter().map(DVec3::from_array).collect();
    let spline = Spline { points, degree, is_bspline };
    if spline.is_whole() && spline.segments() <= MAX_SEGMENTS {
        return Ok(spline);
    }
    let message = format!(
        "found {} control points for segments of degree {degree}, expected {} or more in whole \
         segments, up to {MAX_SEGMENTS} segments",
        spline.points.len(),
        degree + 1
    );
    Err(entity.refuse("P", message))
}

/// Returns the normals of a ribbon at the ends of its segments; `None` if the curve is not a
/// ribbon.
fn ribbon(entity: &Entity, spline: &Spline) -> Result<Option<Vec<DVec3>>, LoadError> {
    let normals = entity.normals("N")?;
    match entity.text("type")? {
        None | Some("flat" | "cylinder") => Ok(None),
        Some("ribbon") => {
            let normals = normals.unwrap_or_default();
            let expected = spline.segments() + 1;
            if normals.len() != expected {
                let message = format!(
                    "a ribbon of {} segments requires {expected} normals, found {}",
                    expected - 1,
                    normals.len()
                );
                return Err(entity.refuse("N", message));
            }
            Ok(Some(normals.into_iter().map(DVec3::from_array).collect()))
        }
        Some(other) => {
            let message =
                format!("unknown type {}; expected flat, cylinder or ribbon", quote(other));
            Err(entity.refuse("type", message))
        }
    }
}
