//! Cameras of many views.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::editing;
use crate::errors::of_command;
use crate::scene::Scene;

/// File of views and numbers of those that a path selects, all without a selection.
#[pyfunction]
pub(crate) fn view_numbers(py: Python<'_>, path: PathBuf) -> PyResult<(PathBuf, Vec<u32>)> {
    py.detach(|| pt_cli::view_numbers(&path)).map_err(|error| of_command(py, error))
}

/// A camera of a scene, by its name or number.
#[pyfunction]
pub(crate) fn camera_of<'py>(
    scene: &Bound<'py, Scene>,
    key: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (py, scene) = (scene.py(), &scene.get().source.scene);
    let names = editing::names(&scene.cameras, |camera| &camera.name);
    let index = editing::number("cameras", key, &names)?;
    editing::only(editing::cameras(py, scene, vec![scene.cameras[index].clone()])?)
}
