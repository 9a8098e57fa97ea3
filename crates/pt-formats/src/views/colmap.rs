//! Views of COLMAP's text format: `images.txt` with world-to-camera transforms, whose axes are
//! right, down and forward, and `cameras.txt` with intrinsic parameters.

use std::collections::HashMap;
use std::path::Path;
use std::str::FromStr;

use pt_math::{DMat3, DMat4, DQuat, DVec3};

use super::{Pinhole, View, affine, camera, check_distortion};
use crate::LoadError;
use crate::shared::mesh_file::error;

/// Reads the texts of both files; their paths are used for messages.
///
/// # Errors
/// If a line is invalid, or an image refers to a camera that does not exist.
pub(super) fn parse(
    (images, images_path): (&str, &Path),
    (cameras, cameras_path): (&str, &Path),
) -> Result<Vec<View>, LoadError> {
    let mut pinholes = HashMap::new();
    for (number, line) in lines(cameras).filter(|(_, line)| !line.is_empty()) {
        let (id, pinhole) = pinhole(line).map_err(|m| error(cameras_path, number, m))?;
        pinholes.insert(id.to_owned(), pinhole);
    }
    // Each image has a line of its own and one of points, which may be empty.
    let is_second = |i: usize| i % 2 == 1;
    let with_points: Vec<_> = lines(images).collect();
    let first = with_points.iter().position(|(_, line)| !line.is_empty()).unwrap_or(0);
    let of_images = with_points[first..].iter().enumerate().filter(|(i, _)| !is_second(*i));
    let of_images = of_images.map(|(_, line)| line).filter(|(_, line)| !line.is_empty());
    let view = |(number, line): &(u32, &str)| {
        view(line, &pinholes).map_err(|m| error(images_path, *number, m))
    };
    of_images.map(view).collect()
}

/// Lines with their numbers, without comments.
fn lines(text: &str) -> impl Iterator<Item = (u32, &str)> {
    let all = (1..).zip(text.lines().map(str::trim));
    all.filter(|(_, line)| !line.starts_with('#'))
}

/// Camera: its identifier, model, width, height and parameters.
fn pinhole(line: &str) -> Result<(&str, Pinhole), String> {
    let words: Vec<_> = line.split_whitespace().collect();
    let [id, model, width, height, parameters @ ..] = words.as_slice() else {
        return Err("expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS".to_owned());
    };
    let size = [number(width)?, number(height)?];
    let p: Vec<f64> = parameters.iter().map(|word| number(word)).collect::<Result<_, _>>()?;
    let (focal_lengths, principal_point, distortion) = match (*model, p.as_slice()) {
        ("SIMPLE_PINHOLE", [f, cx, cy]) => ([*f, *f], [*cx, *cy], &[][..]),
        ("SIMPLE_RADIAL" | "RADIAL", [f, cx, cy, k @ ..]) => ([*f, *f], [*cx, *cy], k),
        ("PINHOLE", [fx, fy, cx, cy]) => ([*fx, *fy], [*cx, *cy], &[][..]),
        ("OPENCV", [fx, fy, cx, cy, k @ ..]) => ([*fx, *fy], [*cx, *cy], k),
        _ => {
            return Err(format!(
                "found the model {model} with {} parameters, expected SIMPLE_PINHOLE, PINHOLE, \
                 SIMPLE_RADIAL, RADIAL or OPENCV with its parameters",
                p.len()
            ));
        }
    };
    for (i, k) in distortion.iter().enumerate() {
        check_distortion(&format!("parameter {}", p.len() - distortion.len() + i + 1), *k)?;
    }
    let pinhole = Pinhole { size, focal_lengths, principal_point: Some(principal_point) };
    pinhole.check()?;
    Ok((id, pinhole))
}

/// Image: identifier, rotation as a quaternion with the real part first, translation, identifier of
/// the camera and name.
fn view(line: &str, pinholes: &HashMap<String, Pinhole>) -> Result<View, String> {
    let words: Vec<_> = line.split_whitespace().collect();
    let [_, w, x, y, z, tx, ty, tz, camera_id, name @ ..] = words.as_slice() else {
        return Err("expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME".to_owned());
    };
    let pinhole = pinholes
        .get(*camera_id)
        .ok_or_else(|| format!("found camera {camera_id}, expected one of cameras.txt"))?;
    let rotation = DQuat::from_xyzw(number(x)?, number(y)?, number(z)?, number(w)?);
    if !(rotation.length() > 1e-6 && rotation.is_finite()) {
        return Err("found a quaternion of length 0, expected a rotation".to_owned());
    }
    let translation = DVec3::new(number(tx)?, number(ty)?, number(tz)?);
    let to_camera = DMat4::from_rotation_translation(rotation.normalize(), translation);
    let flip = DMat4::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)));
    let mut to_world = to_camera.inverse() * flip;
    // Rounding of the inverse.
    to_world.x_axis.w = 0.0;
    to_world.y_axis.w = 0.0;
    to_world.z_axis.w = 0.0;
    to_world.w_axis.w = 1.0;
    let to_world = affine(to_world)?;
    Ok(View {
        camera: camera(&name.join(" "), to_world, pinhole.projection(), pinhole.offset()),
        resolution: Some(pinhole.size.map(|side| side.round().clamp(1.0, 65536.0) as u32)),
    })
}

fn number(word: &str) -> Result<f64, String> {
    let number = f64::from_str(word).ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("found \"{word}\", expected a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERAS: &str =
        "# of a test\n1 PINHOLE 200 100 50 50 80 50\n\n7 OPENCV 8 8 9 9 4 4 0 0 0 0\n";
    const IMAGES: &str =
        "# of a test\n1 1 0 0 0 1 2 3 1 a b.png\n1.5 2 -1\n2 0 0 1 0 0 0 0 7 c.png\n\n";

    fn of(images: &str, cameras: &str) -> Result<Vec<View>, String> {
        let (first, second) = (Path::new("images.txt"), Path::new("cameras.txt"));
        parse((images, first), (cameras, second)).map_err(|error| error.to_string())
    }

    #[test]
    fn views_look_forward() {
        let views = of(IMAGES, CAMERAS).unwrap();
        let names: Vec<_> = views.iter().map(|view| view.camera.name.as_str()).collect();
        assert_eq!(names, ["a b.png", "c.png"]);
        let first = &views[0].camera;
        assert_eq!(first.to_world.translation, DVec3::new(-1.0, -2.0, -3.0));
        // The viewing axis is -z, and COLMAP's +z is forward.
        let forward = first.to_world.transform_vector3(DVec3::NEG_Z);
        assert_eq!(forward, DVec3::Z);
        assert_eq!(first.to_world.transform_vector3(DVec3::Y), DVec3::NEG_Y);
        assert!((first.principal_point_offset[0] - 0.1).abs() < 1e-12);
        assert_eq!(views[0].resolution, Some([200, 100]));
        // Half a turn around y.
        let second = views[1].camera.to_world.transform_vector3(DVec3::NEG_Z);
        assert!(second.distance(DVec3::NEG_Z) < 1e-12, "{second}");
    }

    #[test]
    fn invalid_lines_are_reported() {
        for (images, cameras, expected) in [
            (IMAGES, "1 PINHOLE 200", "cameras.txt:1: expected CAMERA_ID"),
            (IMAGES, "1 FOV 2 2 1 1 1 1 1", "cameras.txt:1: found the model FOV with 5"),
            (IMAGES, "1 RADIAL 2 2 1 1 1 0 0.5", "(parameter 5 = 0.5)"),
            (IMAGES, "1 PINHOLE 2 2 x 1 1 1", "found \"x\", expected a number"),
            (IMAGES, "2 PINHOLE 2 2 1 1 1 1", "images.txt:2: found camera 1"),
            ("1 0 0 0 0 0 0 0 1 a", CAMERAS, "images.txt:1: found a quaternion"),
            ("1 0 0", CAMERAS, "images.txt:1: expected IMAGE_ID"),
        ] {
            let message = of(images, cameras).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
