//! Files of views, as of datasets for reconstruction: `transforms.json` of NeRF and its successors,
//! and the text format of COLMAP.

mod colmap;
mod transforms;

use std::path::Path;

use pt_math::{DAffine3, DMat4};
use pt_scene::{Camera, Fit, Placement, Projection, SourceFile};

use crate::LoadError;
use crate::shared::mesh_file::error;

/// Maximum difference between the focal lengths of both axes, as a fraction: pixels are square.
const MAX_ANISOTROPY: f64 = 0.01;

/// A camera with the size of its image.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Camera with the name of its image in the file.
    pub camera: Camera,
    /// Width and height of the image in pixels, if the file specifies them.
    pub resolution: Option<[u32; 2]>,
}

/// Reads a file of views: `transforms.json` [Mildenhall et al. 2020, "NeRF: Representing Scenes as
/// Neural Radiance Fields for View Synthesis", data of the paper], or `images.txt` of COLMAP with
/// `cameras.txt` beside it. Also returns the records of the files.
///
/// # Errors
/// If a file cannot be read, has no views, or has other than pinhole cameras.
pub fn load(path: &Path) -> Result<(Vec<View>, Vec<SourceFile>), LoadError> {
    let (text, source) = read(path)?;
    let mut sources = vec![source];
    let views = if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
        transforms::parse(&text, path)?
    } else {
        let cameras = path.with_file_name("cameras.txt");
        let (cameras_text, source) = read(&cameras)?;
        sources.push(source);
        colmap::parse((&text, path), (&cameras_text, &cameras))?
    };
    if views.is_empty() {
        return Err(error(path, 0, "found no views, expected at least one"));
    }
    Ok((views, sources))
}

fn read(path: &Path) -> Result<(String, SourceFile), LoadError> {
    let bytes = pt_io::file::read(path)
        .map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
    let text = String::from_utf8_lossy(&bytes).into_owned();
    Ok((text, crate::shared::source::source_file(path, &bytes)))
}

/// Pinhole of a view, in pixels.
#[derive(Clone, Copy, Debug)]
struct Pinhole {
    /// Width and height of the image.
    size: [f64; 2],
    focal_lengths: [f64; 2],
    /// Distance of the principal point from the upper left corner; `None` is the middle.
    principal_point: Option<[f64; 2]>,
}

impl Pinhole {
    /// # Errors
    /// A message if a number is out of range, or the pixels are not square.
    fn check(&self) -> Result<(), String> {
        let Self { size, focal_lengths: [x, y], .. } = self;
        let is_positive = |number: &f64| *number > 0.0 && number.is_finite();
        if ![*x, *y].iter().chain(size).all(is_positive) {
            return Err(format!(
                "found focal lengths of {x} and {y} pixels and an image of {} x {}, expected \
                 positive numbers",
                size[0], size[1]
            ));
        }
        if (x / y - 1.0).abs() > MAX_ANISOTROPY {
            return Err(format!(
                "found focal lengths of {x} and {y} pixels, expected equal ones: pixels are square"
            ));
        }
        Ok(())
    }

    fn projection(&self) -> Projection {
        let fov = |axis: usize| {
            2.0 * libm::atan(0.5 * self.size[axis] / self.focal_lengths[axis]).to_degrees()
        };
        Projection::Perspective { x_fov: fov(0), y_fov: fov(1) }
    }

    fn offset(&self) -> [f64; 2] {
        let point = self.principal_point.unwrap_or(self.size.map(|size| 0.5 * size));
        [0, 1].map(|axis| 0.5 - point[axis] / self.size[axis])
    }
}

/// Camera with axes to the right, up and back.
fn camera(name: &str, to_world: DAffine3, projection: Projection, offset: [f64; 2]) -> Camera {
    Camera {
        name: name.to_owned(),
        to_world,
        motion: None,
        shutter: [0.0; 2],
        projection,
        fit: Fit::Width,
        near: 0.0,
        far: f64::INFINITY,
        lens_radius: 0.0,
        aperture: None,
        focal_distance: 1.0,
        principal_point_offset: offset,
        medium: None,
        placement: Placement::Node,
        meter: None,
    }
}

/// Returns an affine transform of finite numbers with independent axes.
///
/// # Errors
/// A message if the matrix is none.
fn affine(matrix: DMat4) -> Result<DAffine3, String> {
    let is_affine = matrix.is_finite() && matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0];
    if !is_affine || matrix.determinant().abs() < 1e-12 {
        return Err(
            "found a matrix that is no camera-to-world transform, expected finite numbers, \
                    independent axes and the last row 0 0 0 1"
                .to_owned(),
        );
    }
    Ok(DAffine3::from_mat4(matrix))
}

/// Rejects lenses with distortion.
///
/// # Errors
/// A message with the coefficient.
fn check_distortion(name: &str, coefficient: f64) -> Result<(), String> {
    if coefficient == 0.0 {
        return Ok(());
    }
    Err(format!(
        "found lens distortion ({name} = {coefficient}), expected a pinhole camera; undistort the \
         images first, as with colmap image_undistorter"
    ))
}
