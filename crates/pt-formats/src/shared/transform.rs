//! Transforms shared by several formats.

use pt_math::{DAffine3, DMat3, DVec3};

/// Returns a rotation about an axis, counter-clockwise as seen from the tip of the axis.
pub(crate) fn rotate(axis: DVec3, degrees: f64) -> DAffine3 {
    let turn = rotation(axis.normalize_or_zero(), libm::sincos(degrees.to_radians()));
    DAffine3::from_mat3(turn)
}

/// Returns a rotation about a unit vector by the angle with this sine and cosine.
///
/// v ↦ v cos θ + (a × v) sin θ + a (a·v)(1 − cos θ). [Rodrigues 1840]
pub(crate) fn rotation(a: DVec3, (sin, cos): (f64, f64)) -> DMat3 {
    let turn = |v: DVec3| v * cos + a.cross(v) * sin + a * (a.dot(v) * (1.0 - cos));
    DMat3::from_cols(turn(DVec3::X), turn(DVec3::Y), turn(DVec3::Z))
}

/// Returns a node at `origin` with its +z towards `target` and its +y in the half plane of `up`; +x
/// is then up × z. `None` if the three do not span a plane.
pub(crate) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Option<DAffine3> {
    const MIN_SINE: f64 = 1e-9; // of the angle between up and z, far above rounding
    let z = (target - origin).try_normalize()?;
    let side = up.try_normalize()?.cross(z);
    let x = side.try_normalize().filter(|_| side.length() > MIN_SINE)?;
    Some(DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), origin))
}

/// Returns a unit vector perpendicular to `v`.
pub(crate) fn perpendicular(v: DVec3) -> DVec3 {
    let axis = if v.x.abs() < 0.5 * v.length() { DVec3::X } else { DVec3::Y };
    v.cross(axis).normalize_or_zero()
}

/// Parses a matrix of 9 or 16 numbers in row-major order.
pub(crate) fn matrix(numbers: &[f64]) -> Result<DAffine3, String> {
    let size = match numbers.len() {
        9 => 3,
        16 => 4,
        count => return Err(format!("found {count} numbers, expected 9 or 16")),
    };
    if size == 4 && numbers[12..] != [0.0, 0.0, 0.0, 1.0] {
        let message = "found a last row other than 0 0 0 1; only affine transforms are supported";
        return Err(message.to_owned());
    }
    let column = |c: usize| DVec3::from_array([0, 1, 2].map(|row| numbers[size * row + c]));
    let translation = if size == 4 { column(3) } else { DVec3::ZERO };
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    Ok(DAffine3::from_mat3_translation(linear, translation))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: DVec3, b: DVec3) -> bool {
        a.distance(b) < 1e-12
    }

    #[test]
    fn a_third_of_a_turn_about_the_diagonal_permutes_the_axes() {
        let turn = rotate(DVec3::ONE, 120.0);
        assert!(close(turn.transform_point3(DVec3::X), DVec3::Y));
        assert!(close(turn.transform_point3(DVec3::Y), DVec3::Z));
    }

    #[test]
    fn look_at_is_rigid_and_looks_along_z() {
        let (origin, target) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 0.5, 3.0));
        let node = look_at(origin, target, DVec3::new(0.2, 1.0, 0.0)).unwrap();
        assert!((node.matrix3.determinant() - 1.0).abs() < 1e-12);
        assert!(close(node.matrix3.z_axis, (target - origin).normalize()));
        assert!(node.matrix3.y_axis.y > 0.0);
        assert_eq!(look_at(origin, target, target - origin), None);
        assert_eq!(look_at(origin, origin, DVec3::Y), None);
    }

    #[test]
    fn matrices_are_written_by_rows() {
        let numbers: Vec<f64> = (1..=12).map(f64::from).chain([0.0, 0.0, 0.0, 1.0]).collect();
        let m = matrix(&numbers).unwrap();
        assert_eq!(m.transform_point3(DVec3::X), DVec3::new(5.0, 13.0, 21.0));
        let small = matrix(&[0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]).unwrap();
        assert_eq!(small.transform_point3(DVec3::X), DVec3::Y);
        assert!(matrix(&[1.0; 16]).is_err() && matrix(&[1.0; 12]).is_err());
    }

    #[test]
    fn perpendiculars_are() {
        for v in [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::new(3.0, -2.0, 0.1)] {
            let p = perpendicular(v);
            assert!(p.dot(v).abs() < 1e-12 && (p.length() - 1.0).abs() < 1e-12);
        }
    }
}
