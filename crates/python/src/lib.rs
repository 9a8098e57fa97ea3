//! The Python module `pathtracer._native`; the package `pathtracer` around it has the names that
//! users see.

#![expect(clippy::needless_pass_by_value, reason = "arguments of Python are converted to values")]

mod arrays;
mod bvh;
mod cluster;
mod denoise;
mod editing;
mod errors;
mod explain;
mod films;
mod finding;
mod image;
mod image_files;
mod lent;
mod load;
mod parts;
mod places;
mod pose;
mod probes;
mod progress;
mod queries;
mod reading;
mod render;
mod sampler;
mod scene;
mod settings;
mod source;
mod values;
mod views;
mod worker;

use std::ffi::OsString;
use std::process::ExitCode;

use pyo3::prelude::*;

/// Runs the program with arguments, the first of which is its name; returns its exit status.
#[pyfunction]
fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    let status = py.detach(|| pt_cli::program(arguments));
    // An exit status can be compared, but not converted.
    (0..=u8::MAX).find(|&number| ExitCode::from(number) == status).unwrap_or(u8::MAX)
}

/// Contents of `pathtracer._native`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<finding::Finding>()?;
    module.add_class::<bvh::Bvh>()?;
    module.add_class::<queries::Hits>()?;
    module.add_class::<probes::Bsdf>()?;
    module.add_class::<probes::Light>()?;
    module.add_class::<probes::PhaseFunction>()?;
    module.add_class::<sampler::Sampler>()?;
    module.add_function(wrap_pyfunction!(probes::lights, module)?)?;
    module.add_class::<image::Image>()?;
    module.add_class::<render::Images>()?;
    module.add_class::<progress::Progress>()?;
    module.add_class::<parts::PartialRender>()?;
    module.add("SceneError", module.py().get_type::<errors::SceneError>())?;
    module.add("Interrupted", module.py().get_type::<errors::Interrupted>())?;
    module.add_function(wrap_pyfunction!(program, module)?)?;
    module.add_function(wrap_pyfunction!(load::load, module)?)?;
    module.add_function(wrap_pyfunction!(load::loads, module)?)?;
    module.add_function(wrap_pyfunction!(load::default_scene, module)?)?;
    module.add_function(wrap_pyfunction!(render::render, module)?)?;
    module.add_function(wrap_pyfunction!(render::render_until, module)?)?;
    module.add_function(wrap_pyfunction!(render::render_iter, module)?)?;
    module.add_function(wrap_pyfunction!(films::resume, module)?)?;
    module.add_function(wrap_pyfunction!(films::merge, module)?)?;
    module.add_function(wrap_pyfunction!(films::rerender, module)?)?;
    module.add_function(wrap_pyfunction!(image_files::develop, module)?)?;
    module.add_function(wrap_pyfunction!(image_files::denoise, module)?)?;
    module.add_function(wrap_pyfunction!(image_files::join, module)?)?;
    module.add_function(wrap_pyfunction!(explain::explain, module)?)?;
    module.add_function(wrap_pyfunction!(parts::merge_parts, module)?)?;
    module.add_function(wrap_pyfunction!(cluster::cluster_commands, module)?)?;
    module.add_function(wrap_pyfunction!(cluster::reading_options, module)?)?;
    module.add_function(wrap_pyfunction!(cluster::with_camera, module)?)?;
    module.add_function(wrap_pyfunction!(cluster::hierarchies, module)?)?;
    module.add_function(wrap_pyfunction!(cluster::with_hierarchies, module)?)?;
    module.add_function(wrap_pyfunction!(views::view_numbers, module)?)?;
    module.add_function(wrap_pyfunction!(views::camera_of, module)?)?;
    module.add_function(wrap_pyfunction!(settings::settings, module)?)
}
