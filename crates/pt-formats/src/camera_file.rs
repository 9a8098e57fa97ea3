//! Camera settings files of the university course's program: 30 numbers in plain text,
//!
//! ```text
//! hFov vFov aspect near far
//! position target
//! phi theta r minR maxR
//! camera-to-world, 9 numbers row by row
//! screenW screenH screenDist
//! focalDistance lensRadius
//! ```

use std::path::Path;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::{Camera, Fit, Placement, Projection, SourceFile, Span};

use crate::LoadError;

/// Names of the numbers, for messages.
const NAMES: [&str; 30] = [
    "hFov",
    "vFov",
    "aspect",
    "near",
    "far",
    "position x",
    "position y",
    "position z",
    "target x",
    "target y",
    "target z",
    "phi",
    "theta",
    "r",
    "minR",
    "maxR",
    "c2w 1",
    "c2w 2",
    "c2w 3",
    "c2w 4",
    "c2w 5",
    "c2w 6",
    "c2w 7",
    "c2w 8",
    "c2w 9",
    "screenW",
    "screenH",
    "screenDist",
    "focalDistance",
    "lensRadius",
];

/// Reads a camera settings file. Also returns the record of the file.
///
/// # Errors
/// Returns an error if the file cannot be read, or does not consist of 30 finite numbers.
pub fn load(path: &Path) -> Result<(Camera, SourceFile), LoadError> {
    let bytes = pt_io::file::read(path)
        .map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
    let camera = parse(&String::from_utf8_lossy(&bytes), path)?;
    Ok((camera, crate::shared::source::source_file(path, &bytes)))
}

/// Reads the text of a camera settings file; the path is used for messages.
///
/// # Errors
/// Returns an error if the text does not consist of 30 finite numbers.
pub fn parse(text: &str, path: &Path) -> Result<Camera, LoadError> {
    let n = numbers(text, path)?;
    // The columns of the matrix are right, up and back; the file contains its rows.
    let matrix = DMat3::from_cols_slice(&n[16..25]).transpose();
    let position = DVec3::from_slice(&n[5..8]);
    Ok(Camera {
        name: path.display().to_string(),
        to_world: DAffine3::from_mat3_translation(matrix, position),
        motion: None,
        shutter: [0.0; 2],
        projection: Projection::Perspective { x_fov: n[0], y_fov: n[1] },
        near: n[3],
        far: n[4],
        lens_radius: n[29],
        aperture: None,
        focal_distance: n[28],
        principal_point_offset: [0.0; 2],
        fit: Fit::Whole,
        medium: None,
        placement: Placement::Node,
        meter: None,
    })
}

/// Parses the numbers; errors contain the name of the invalid one.
fn numbers(text: &str, path: &Path) -> Result<[f64; NAMES.len()], LoadError> {
    let fail = |line: usize, message: String| {
        let element = "camera settings".to_owned();
        let at = Span { file: path.to_owned(), line: line as u32, column: 0, element };
        LoadError::Content { at, message }
    };
    let mut found = [0.0; NAMES.len()];
    let lines = text.lines().zip(1..);
    let mut words = lines.flat_map(|(l, number)| l.split_whitespace().map(move |w| (number, w)));
    for (value, name) in found.iter_mut().zip(NAMES) {
        let Some((line, word)) = words.next() else {
            let last = text.lines().count();
            let message = format!(
                "found the end of the file before {name}, expected {} numbers",
                NAMES.len()
            );
            return Err(fail(last, message));
        };
        *value = match word.parse::<f64>() {
            Ok(v) if v.is_finite() => v,
            _ => {
                let start: String = word.chars().take(40).collect();
                return Err(fail(line, format!("found \"{start}\" for {name}, expected a number")));
            }
        };
    }
    match words.next() {
        None => Ok(found),
        Some((line, _)) => Err(fail(line, format!("found more than {} numbers", NAMES.len()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "50 38.5 1.333 0.1 100\n1 2 3 0 0 0\n1.5 0 4 0.1 10\n\
                        1 0 0 0 1 0 0 0 1\n800 600 875\n4.7 0.25\n";

    #[test]
    fn a_file_of_the_course_is_read() {
        let camera = parse(GOOD, Path::new("cam.txt")).unwrap();
        assert_eq!(camera.to_world.translation, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(camera.to_world.matrix3, DMat3::IDENTITY);
        let view = Projection::Perspective { x_fov: 50.0, y_fov: 38.5 };
        assert_eq!((camera.projection, camera.far, camera.lens_radius), (view, 100.0, 0.25));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let message = |text: &str| parse(text, Path::new("cam.txt")).unwrap_err().to_string();
        assert_eq!(
            message(&GOOD.replace("4 0.1 10", "4 zero 10")),
            "cam.txt:3: camera settings: found \"zero\" for minR, expected a number"
        );
        assert!(message("50 38").contains("found the end of the file before aspect"));
        assert!(message(&format!("{GOOD} 7")).contains("found more than 30 numbers"));
        assert!(message(&GOOD.replace("875", "NaN")).contains("screenDist"));
    }
}
