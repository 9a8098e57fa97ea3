//! Views of `transforms.json`: a list of frames, each with a camera-to-world matrix whose axes are
//! right, up and back, and the intrinsic parameters of all frames or of each.

use std::path::Path;

use pt_math::DMat4;
use pt_scene::Projection;
use serde_json::{Map, Value};

use super::{Pinhole, View, affine, camera, check_distortion};
use crate::LoadError;
use crate::shared::mesh_file::error;

/// Coefficients of lens distortion.
const DISTORTION: [&str; 8] = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];
/// Largest image side.
const MAX_SIDE: f64 = 65536.0;

/// Reads the text of a file; the path is used for messages.
///
/// # Errors
/// If the text is no JSON, or a frame is invalid.
pub(super) fn parse(text: &str, path: &Path) -> Result<Vec<View>, LoadError> {
    let root: Value = serde_json::from_str(text)
        .map_err(|e| error(path, e.line() as u32, format!("found no JSON: {e}")))?;
    let fail = |message: String| error(path, 0, message);
    let root = root.as_object().ok_or_else(|| fail("expected an object".into()))?;
    let frames = root.get("frames").and_then(Value::as_array);
    let frames = frames.ok_or_else(|| fail("missing the list \"frames\"".into()))?;
    let view = |(number, frame): (usize, &Value)| {
        view(Numbers { frame, root }).map_err(|m| fail(format!("frames[{number}]: {m}")))
    };
    frames.iter().enumerate().map(view).collect()
}

fn view(numbers: Numbers<'_>) -> Result<View, String> {
    let Numbers { frame, .. } = numbers;
    let matrix = frame.get("transform_matrix").ok_or("missing \"transform_matrix\"")?;
    let to_world = affine(matrix_of(matrix)?)?;
    for name in DISTORTION {
        check_distortion(name, numbers.find(name)?.unwrap_or(0.0))?;
    }
    if let Some(model) = numbers.text("camera_model").filter(|m| m.contains("FISHEYE")) {
        return Err(format!("found the camera model {model:?}, expected a pinhole camera"));
    }
    let name = frame.get("file_path").and_then(Value::as_str).unwrap_or_default();
    let size = numbers.find("w")?.zip(numbers.find("h")?);
    let is_side = |side: f64| (1.0..=MAX_SIDE).contains(&side);
    if let Some((w, h)) = size.filter(|(w, h)| !is_side(*w) || !is_side(*h)) {
        return Err(format!("found the size {w} x {h}, expected pixels"));
    }
    let (projection, offset) = if let Some((w, h)) = size {
        with_size(numbers, [w, h])?
    } else {
        let x = numbers.angle("camera_angle_x")?.ok_or(
            "missing \"camera_angle_x\", the horizontal field of view in radians, or \"fl_x\" with \
             \"w\" and \"h\"",
        )?;
        let y = numbers.angle("camera_angle_y")?.unwrap_or(x);
        let [x_fov, y_fov] = [x, y].map(f64::to_degrees);
        (Projection::Perspective { x_fov, y_fov }, [0.0; 2])
    };
    Ok(View {
        camera: camera(name, to_world, projection, offset),
        resolution: size.map(|(w, h)| [w, h].map(|side| side.round() as u32)),
    })
}

/// Projection and offset of the film of an image of known size.
fn with_size(numbers: Numbers<'_>, size: [f64; 2]) -> Result<(Projection, [f64; 2]), String> {
    let of_angle = |name, axis: usize| {
        let angle = numbers.angle(name)?;
        Ok::<_, String>(angle.map(|angle| 0.5 * size[axis] / libm::tan(0.5 * angle)))
    };
    let x = numbers.find("fl_x")?.or(of_angle("camera_angle_x", 0)?);
    let y = numbers.find("fl_y")?.or(of_angle("camera_angle_y", 1)?);
    let x = x.ok_or("missing \"fl_x\" or \"camera_angle_x\"")?;
    let principal_point = numbers.find("cx")?.zip(numbers.find("cy")?).map(|(x, y)| [x, y]);
    let pinhole = Pinhole { size, focal_lengths: [x, y.unwrap_or(x)], principal_point };
    pinhole.check()?;
    Ok((pinhole.projection(), pinhole.offset()))
}

/// Values of a frame, or else of the whole file.
#[derive(Clone, Copy)]
struct Numbers<'a> {
    frame: &'a Value,
    root: &'a Map<String, Value>,
}

impl<'a> Numbers<'a> {
    fn value(&self, name: &str) -> Option<&'a Value> {
        self.frame.get(name).or_else(|| self.root.get(name))
    }

    fn text(&self, name: &str) -> Option<&'a str> {
        self.value(name).and_then(Value::as_str)
    }

    fn find(&self, name: &str) -> Result<Option<f64>, String> {
        let Some(value) = self.value(name) else { return Ok(None) };
        let number = value.as_f64();
        number.map(Some).ok_or_else(|| format!("{name}: found {value}, expected a number"))
    }

    /// Angle of a field of view in radians.
    fn angle(&self, name: &str) -> Result<Option<f64>, String> {
        let angle = self.find(name)?;
        match angle.filter(|angle| !(*angle > 0.0 && *angle < std::f64::consts::PI)) {
            Some(angle) => Err(format!("{name}: found {angle}, expected radians between 0 and pi")),
            None => Ok(angle),
        }
    }
}

/// Matrix of four rows, or of three above 0 0 0 1.
fn matrix_of(value: &Value) -> Result<DMat4, String> {
    let row = |row: &Value| {
        let numbers: Vec<f64> = row.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
        <[f64; 4]>::try_from(numbers).ok()
    };
    let of_rows = |rows: [[f64; 4]; 4]| Ok(DMat4::from_cols_array_2d(&rows).transpose());
    let rows: Option<Vec<_>> = value.as_array().and_then(|rows| rows.iter().map(row).collect());
    match rows.as_deref() {
        Some([x, y, z]) => of_rows([*x, *y, *z, [0.0, 0.0, 0.0, 1.0]]),
        Some([x, y, z, w]) => of_rows([*x, *y, *z, *w]),
        _ => Err("transform_matrix: expected 4 rows of 4 numbers".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use pt_math::DVec3;

    use super::*;

    const MATRIX: &str = "[[0,0,1,4],[1,0,0,5],[0,1,0,6],[0,0,0,1]]";

    fn views(of_file: &str, of_frame: &str) -> Result<Vec<View>, String> {
        let text = format!(
            "{{{of_file} \"frames\": [{{\"file_path\": \"./a\", \"transform_matrix\": {MATRIX}\
             {of_frame}}}]}}"
        );
        parse(&text, Path::new("t.json")).map_err(|error| error.to_string())
    }

    #[test]
    fn a_synthetic_dataset_is_read() {
        let [View { camera, resolution }] =
            &*views("\"camera_angle_x\": 0.6911112070083618,", "").unwrap()
        else {
            panic!("one view")
        };
        assert_eq!((camera.name.as_str(), *resolution), ("./a", None));
        assert_eq!(camera.to_world.translation, DVec3::new(4.0, 5.0, 6.0));
        assert_eq!(camera.to_world.transform_vector3(DVec3::X), DVec3::Y);
        let Projection::Perspective { x_fov, y_fov } = camera.projection else { panic!() };
        assert_eq!(x_fov, y_fov);
        assert!((x_fov - 39.597_75).abs() < 1e-4, "{x_fov}");
    }

    #[test]
    fn frames_override_the_intrinsic_parameters_of_the_file() {
        let of_file = "\"fl_x\": 100, \"w\": 200, \"h\": 100, \"cx\": 100, \"cy\": 50,";
        let all = views(of_file, ", \"fl_x\": 50, \"cx\": 80").unwrap();
        let View { camera, resolution } = &all[0];
        assert_eq!(*resolution, Some([200, 100]));
        let Projection::Perspective { x_fov, y_fov } = camera.projection else { panic!() };
        assert!((x_fov - 126.869_897_645_844).abs() < 1e-9 && (y_fov - 90.0).abs() < 1e-9);
        assert!((camera.principal_point_offset[0] - 0.1).abs() < 1e-12);
        assert_eq!(camera.principal_point_offset[1], 0.0);
    }

    #[test]
    fn invalid_frames_are_reported() {
        for (of_file, of_frame, expected) in [
            ("", "", "frames[0]: missing \"camera_angle_x\""),
            ("\"camera_angle_x\": 4,", "", "found 4, expected radians"),
            ("\"camera_angle_x\": \"wide\",", "", "found \"wide\", expected a number"),
            ("\"camera_angle_x\": 1,", ", \"k1\": 0.1", "lens distortion (k1 = 0.1)"),
            ("\"fl_x\": 9, \"fl_y\": 8, \"w\": 9, \"h\": 9,", "", "pixels are square"),
            ("\"fl_x\": 0, \"w\": 9, \"h\": 9,", "", "expected positive numbers"),
            ("\"fl_x\": 9, \"w\": 9e9, \"h\": 9,", "", "expected pixels"),
            ("\"camera_angle_x\": 1,", ", \"transform_matrix\": [[1]]", "4 rows of 4 numbers"),
            (
                "\"camera_angle_x\": 1,",
                ", \"transform_matrix\": [[1,0,0,0],[1,0,0,0],[0,0,1,0]]",
                "independent axes",
            ),
        ] {
            let message = views(of_file, of_frame).unwrap_err();
            assert!(message.contains(expected), "{message}");
            assert!(message.starts_with("t.json: frames[0]: "), "{message}");
        }
        let of_text = |text: &str| parse(text, Path::new("t.json")).unwrap_err().to_string();
        assert!(of_text("{\"frames\":\n[}").starts_with("t.json:2: found no JSON"));
        assert!(of_text("{}").contains("missing the list \"frames\""));
        assert!(of_text("[]").contains("expected an object"));
    }
}
