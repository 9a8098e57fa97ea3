//! Transforms of a node, composed in the order in which they are written.

use pt_math::{DAffine3, DMat3, DVec3};

use super::reader::{ColladaReader, elements};
use crate::LoadError;
use crate::shared::transform::rotation;
use crate::shared::xml::XmlNode;

/// Returns the transform from a node to its parent: the product of its transform elements, the
/// first one outermost.
///
/// # Errors
/// Returns an error if an element has the wrong number of values, or is no affine transform.
pub(super) fn local<'a>(
    reader: &mut ColladaReader<'a>,
    node: XmlNode<'a>,
) -> Result<DAffine3, LoadError> {
    let mut local = DAffine3::IDENTITY;
    for element in elements(node) {
        local *= match element.tag_name().name() {
            "matrix" => matrix(reader, element)?,
            "translate" => DAffine3::from_translation(DVec3::from(reader.vector(element)?)),
            "scale" => DAffine3::from_scale(DVec3::from(reader.vector(element)?)),
            "rotate" => rotate(reader, element)?,
            "lookat" => look_at(reader, element)?,
            "skew" => skew(reader, element)?,
            _ => continue,
        };
    }
    if local.is_finite() {
        Ok(local)
    } else {
        Err(reader.error(node, "the product of the transforms is infinite; use smaller numbers"))
    }
}

/// Returns true if a node has only matrices as transforms: the program of the profile `CGL`
/// supports no others.
pub(super) fn has_matrices(node: XmlNode<'_>) -> bool {
    let others = ["translate", "scale", "rotate", "lookat", "skew"];
    elements(node).all(|element| !others.contains(&element.tag_name().name()))
}

/// Reads sixteen numbers in row-major order, of a matrix that multiplies column vectors from the
/// left.
pub(super) fn matrix(
    reader: &ColladaReader<'_>,
    element: XmlNode<'_>,
) -> Result<DAffine3, LoadError> {
    let m: [f64; 16] = reader.vector(element)?;
    let w = m[15];
    if m[12..15] != [0.0; 3] || w == 0.0 {
        let message = format!(
            "found the last row {} {} {} {w}, expected 0 0 0 1 of an affine transform",
            m[12], m[13], m[14]
        );
        return Err(reader.error(element, message));
    }
    let column = |i: usize| DVec3::new(m[i], m[4 + i], m[8 + i]) / w;
    Ok(DAffine3::from_cols(column(0), column(1), column(2), column(3)))
}

/// Reads an axis and an angle in degrees, by the right-hand rule.
fn rotate<'a>(reader: &mut ColladaReader<'a>, element: XmlNode<'a>) -> Result<DAffine3, LoadError> {
    let [x, y, z, degrees] = reader.vector(element)?;
    if let Some(axis) = DVec3::new(x, y, z).try_normalize() {
        return Ok(DAffine3::from_mat3(rotation(axis, sin_cos_degrees(degrees))));
    }
    if degrees != 0.0 {
        reader.warn(element, "found a zero rotation axis; the rotation is ignored");
    }
    Ok(DAffine3::IDENTITY)
}

/// Returns sine and cosine, exact at multiples of a right angle.
pub(super) fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turned = degrees.rem_euclid(360.0);
    let quarter = (turned / 90.0).round();
    let rest = (turned - 90.0 * quarter).to_radians();
    let (sin, cos) = (libm::sin(rest), libm::cos(rest));
    match quarter as u32 % 4 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Reads a position, a target of −z, and a direction to which +y is as close as possible.
fn look_at<'a>(
    reader: &mut ColladaReader<'a>,
    element: XmlNode<'a>,
) -> Result<DAffine3, LoadError> {
    let [ex, ey, ez, tx, ty, tz, ux, uy, uz] = reader.vector(element)?;
    let eye = DVec3::new(ex, ey, ez);
    let Some(back) = (eye - DVec3::new(tx, ty, tz)).try_normalize() else {
        let message = "found equal eye point (numbers 1 to 3) and target point (numbers 4 to 6), \
                       expected different points";
        return Err(reader.error(element, message));
    };
    let right = DVec3::new(ux, uy, uz).cross(back).try_normalize().unwrap_or_else(|| {
        reader.warn(
            element,
            "found an up direction (numbers 7 to 9) parallel to the view; another one is used",
        );
        back.any_orthonormal_vector()
    });
    Ok(DAffine3::from_cols(right, back.cross(right), back, eye))
}

/// Reads an angle in degrees and two axes a and b: a shear along b that rotates a towards b by the
/// angle, as `RiSkew` of the RenderMan Interface 3.2 is defined; COLLADA does not specify the
/// details.
///
/// In the basis n₁ ⊥ b̂ of the plane of a and b, a = (a₁, a₂) must become parallel to its rotated
/// self r = (r₁, r₂). The shear 1 + α b̂ n₁ᵀ gives (a₁, a₂ + α a₁), hence α = r₂/r₁ − a₂/a₁.
fn skew<'a>(reader: &mut ColladaReader<'a>, element: XmlNode<'a>) -> Result<DAffine3, LoadError> {
    let [degrees, ax, ay, az, bx, by, bz] = reader.vector(element)?;
    let axes = DVec3::new(ax, ay, az).try_normalize().zip(DVec3::new(bx, by, bz).try_normalize());
    let plane = axes.and_then(|(a, b)| Some((a, b, a.reject_from_normalized(b).try_normalize()?)));
    let Some((a, b, n)) = plane else {
        return Err(reader.error(element, "found two axes that are parallel or of zero length"));
    };
    let (a1, a2) = (a.dot(n), a.dot(b));
    let (sin, cos) = sin_cos_degrees(degrees);
    let (r1, r2) = (a1 * cos - a2 * sin, a1 * sin + a2 * cos);
    if r1 <= 0.0 {
        let message = format!(
            "found an angle of {degrees}°, expected one that does not turn the first axis past the \
             second"
        );
        return Err(reader.error(element, message));
    }
    let alpha = r2 / r1 - a2 / a1;
    let column = |e: DVec3| e + b * (alpha * n.dot(e));
    Ok(DAffine3::from_mat3(DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))))
}
