//! Cameras of rendered images, as datasets have them.

use pt_core::camera::Projection;
use pt_core::{Region, RenderScene};
use pt_math::{DAffine3, Vec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::editing::matrix;

/// Perspective camera of an image.
#[derive(Clone)]
pub(crate) struct Pose {
    /// Camera to world; the axes point to the right, up and backwards.
    to_world: DAffine3,
    /// Focal lengths in pixels.
    focal_length: [f64; 2],
    /// Image point on the viewing axis, in pixels from the upper left corner.
    center: [f64; 2],
    size: [u32; 2],
}

impl Pose {
    /// Camera when the shutter opens, for a region of the image and a unit of length in metres;
    /// `None` if it is no perspective one.
    pub(crate) fn new(scene: &RenderScene, region: Region, metres_per_unit: f64) -> Option<Self> {
        let camera = scene.camera_at(0.0);
        if camera.projection != Projection::Perspective {
            return None;
        }
        let position = camera.position.as_dvec3() / metres_per_unit;
        let [x, y, z] = [camera.right, camera.up, -camera.forward].map(Vec3::as_dvec3);
        let to_world = DAffine3::from_cols(x, y, z, position);
        let focal_length = [0, 1].map(|axis| {
            0.5 * f64::from(camera.resolution[axis]) / f64::from(camera.half_extent[axis])
        });
        let [left, top] = [region.x, region.y].map(f64::from);
        let [cx, cy] = camera.principal_point.map(f64::from);
        Some(Self {
            to_world,
            focal_length,
            center: [cx - left, cy - top],
            size: [region.width, region.height],
        })
    }

    pub(crate) fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        all.set_item("transform_matrix", matrix(py, &self.to_world)?)?;
        for (name, value) in [
            ("fl_x", self.focal_length[0]),
            ("fl_y", self.focal_length[1]),
            ("cx", self.center[0]),
            ("cy", self.center[1]),
        ] {
            all.set_item(name, value)?;
        }
        all.set_item("w", self.size[0])?;
        all.set_item("h", self.size[1])?;
        Ok(all)
    }
}
