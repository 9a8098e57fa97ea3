//! Command lines and scenes of renders on several machines.

use std::ffi::OsString;

use pathtracer::{Hierarchies, LoadOptions, Placement, camera_index};
use pt_cli::ClusterCommand;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::scene::Scene;

/// Resolves the arguments of the program for renders on several machines: for each image, a
/// dictionary with the scene, the options of `load`, the settings of `render`, and what else they
/// say.
#[pyfunction]
pub(crate) fn cluster_commands(
    py: Python<'_>,
    arguments: Vec<OsString>,
) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let commands = py.detach(|| pt_cli::cluster_commands(&arguments));
    let commands = commands.map_err(PyValueError::new_err)?;
    commands.into_iter().map(|command| dictionary(py, command)).collect()
}

fn dictionary(py: Python<'_>, command: ClusterCommand) -> PyResult<Bound<'_, PyDict>> {
    let ClusterCommand {
        scene,
        load,
        placement,
        keywords,
        output,
        film,
        checkpoint_every,
        restart,
        quiet,
        arguments,
    } = command;
    let settings = PyDict::new(py);
    for (name, values) in keywords {
        match values.as_slice() {
            [] => settings.set_item(name, true)?,
            [value] => settings.set_item(name, value)?,
            several => settings.set_item(name, several)?,
        }
    }
    let all = PyDict::new(py);
    all.set_item("scene", scene)?;
    all.set_item("load", load_options(py, &load, placement)?)?;
    all.set_item("settings", settings)?;
    all.set_item("output", output)?;
    all.set_item("film", film)?;
    all.set_item("checkpoint_every", checkpoint_every.as_secs_f64())?;
    all.set_item("restart", restart)?;
    all.set_item("quiet", quiet)?;
    all.set_item("arguments", arguments)?;
    Ok(all)
}

/// Options with which `load` reads the scene as it is saved.
#[pyfunction]
pub(crate) fn reading_options<'py>(scene: &Bound<'py, Scene>) -> PyResult<Bound<'py, PyDict>> {
    let origin = &scene.get().source.origin;
    let limits = origin.options.limits.clone();
    let of_file = LoadOptions { limits, ..LoadOptions::default() };
    load_options(scene.py(), &of_file, origin.placement)
}

/// The scene as it is read with another camera, by its name or number. It shares the compilation.
/// `None` if it has to be read anew, because its cameras have settings of their own, or because it
/// was read for a time, at which the shutter of its camera opens.
#[pyfunction]
pub(crate) fn with_camera(scene: &Bound<'_, Scene>, camera: &str) -> PyResult<Option<Scene>> {
    let source = &scene.get().source;
    if source.scene.settings_of_camera || source.origin.options.time.is_some() {
        return Ok(None);
    }
    let mut edited = (*source.scene).clone();
    let names: Vec<_> = edited.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let index = camera_index(camera, &names)
        .map_err(|message| PyValueError::new_err(format!("camera: {message}")))?;
    edited.used_camera = (edited.cameras.len() > 1).then_some(index as u32);
    let mut origin = (*source.origin).clone();
    origin.options.camera = Some(camera.to_owned());
    Ok(Some(Scene::of(source.edited(edited, origin))))
}

/// Hierarchies of the scene as it was compiled last, as bytes; without any if it was not.
#[pyfunction]
pub(crate) fn hierarchies<'py>(scene: &Bound<'py, Scene>) -> Bound<'py, PyBytes> {
    let py = scene.py();
    let source = scene.get().source.clone();
    let known = py.detach(|| source.hierarchies().map(|known| known.to_bytes()));
    PyBytes::new(py, &known.unwrap_or_default())
}

/// The same scene, which is compiled with hierarchies of another compilation.
#[pyfunction]
pub(crate) fn with_hierarchies(scene: &Bound<'_, Scene>, known: &[u8]) -> PyResult<Scene> {
    let source = scene.get().source.clone();
    let known = scene.py().detach(|| Hierarchies::from_bytes(known));
    let known = known.map_err(|error| PyValueError::new_err(format!("hierarchies: {error}")))?;
    Ok(Scene::of(source.with_hierarchies(known)))
}

/// Options of `load`.
fn load_options<'py>(
    py: Python<'py>,
    options: &LoadOptions,
    placement: Option<Placement>,
) -> PyResult<Bound<'py, PyDict>> {
    let LoadOptions {
        definitions,
        strict,
        allow_outside,
        allowed_folders,
        limits,
        time,
        ignore_attenuation: _, // an option of the program's policies
        camera,
        point_radius,
    } = options;
    let of_scene = PyDict::new(py);
    for (name, limit) in [
        ("memory", limits.memory),
        ("depth", limits.depth),
        ("shapes", limits.shapes),
        ("elements", limits.elements),
        ("texture_side", limits.texture_side),
        ("texture_pixels", limits.texture_pixels),
        ("include_depth", limits.include_depth),
        ("files", limits.files),
        ("seconds", limits.seconds),
        ("triangles", limits.triangles),
    ] {
        if let Some(limit) = limit {
            of_scene.set_item(name, limit)?;
        }
    }
    let variables = PyDict::new(py);
    for (name, value) in definitions {
        variables.set_item(name, value)?;
    }
    let placed = placement.map(|placement| match placement {
        Placement::Node => "file",
        Placement::Course => "course",
        Placement::Fit => "fit",
    });
    let all = PyDict::new(py);
    all.set_item("variables", variables)?;
    all.set_item("strict", strict)?;
    all.set_item("allow_outside", allow_outside)?;
    all.set_item("allow_folders", PyList::new(py, allowed_folders)?)?;
    all.set_item("limits", of_scene)?;
    all.set_item("time", time)?;
    all.set_item("camera", placed.or(camera.as_deref()))?;
    all.set_item("point_radius", point_radius)?;
    Ok(all)
}
