//! Exceptions of the module.

use std::io::ErrorKind;

use pathtracer::{LoadError, suggestions};
use pt_cli::CommandError;
use pyo3::exceptions::{
    PyBlockingIOError, PyFileNotFoundError, PyKeyboardInterrupt, PyOSError, PyPermissionError,
    PyRuntimeError, PyTypeError, PyValueError,
};
use pyo3::prelude::*;

use crate::finding::Finding;
use crate::places::Places;

pyo3::create_exception!(
    pathtracer,
    SceneError,
    PyValueError,
    "A scene that cannot be read or rendered; `errors` is a list of `Finding`."
);
pyo3::create_exception!(
    pathtracer,
    Interrupted,
    PyKeyboardInterrupt,
    "A render that Ctrl-C ended; `partial` is the `Image` so far, or None before the first sample."
);

/// Error of reading a scene: FileNotFoundError and its like if the file cannot be opened, otherwise
/// [`SceneError`].
pub(crate) fn of_load(py: Python<'_>, error: &LoadError) -> PyErr {
    if let LoadError::Io { path, source } = error {
        return match source.raw_os_error() {
            // Python chooses the subclass by the number, as for its own functions.
            Some(number) => PyOSError::new_err((number, strerror(py, number), path.clone())),
            None => PyOSError::new_err(error.to_string()),
        };
    }
    let findings = error.each().iter().map(Finding::of_error).collect();
    of_scene(py, error.to_string(), findings)
}

/// Error of a scene that was made of values.
pub(crate) fn of_values(py: Python<'_>, error: &LoadError, places: &Places) -> PyErr {
    let findings: Vec<_> = error.each().iter().map(|e| Finding::of_value(e, places)).collect();
    let lines = findings.iter().take(LoadError::MAX_SHOWN).map(Finding::to_string);
    let message = lines.collect::<Vec<_>>().join("\n");
    of_scene(py, message, findings)
}

/// Error of a command on films and images.
pub(crate) fn of_command(py: Python<'_>, error: CommandError) -> PyErr {
    // The keyword is a list, unlike the option.
    let message = error.to_string().replace("allow_folder ", "allow_folders ");
    match error {
        CommandError::File { kind: ErrorKind::NotFound, .. } => {
            PyFileNotFoundError::new_err(message)
        }
        CommandError::File { kind: ErrorKind::PermissionDenied, .. } => {
            PyPermissionError::new_err(message)
        }
        CommandError::File { kind: ErrorKind::WouldBlock, .. } => {
            PyBlockingIOError::new_err(message)
        }
        CommandError::File { .. } => PyOSError::new_err(message),
        CommandError::Scene(_) => of_render(py, message),
        CommandError::Input(_) => PyValueError::new_err(message),
        CommandError::Different(_) => PyRuntimeError::new_err(message),
    }
}

/// Message of the operating system for the number of an error.
fn strerror(py: Python<'_>, number: i32) -> String {
    let message = py.import("os").and_then(|os| os.call_method1("strerror", (number,))?.extract());
    message.unwrap_or_default()
}

/// [`SceneError`] with its findings.
pub(crate) fn of_scene(py: Python<'_>, message: String, findings: Vec<Finding>) -> PyErr {
    let error = SceneError::new_err(message);
    match error.value(py).setattr("errors", findings) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// [`SceneError`] of a scene that cannot be rendered.
pub(crate) fn of_render(py: Python<'_>, message: String) -> PyErr {
    let finding = Finding::new("error", None, message.clone());
    of_scene(py, message, vec![finding])
}

/// Error of a worker thread that ended without a result.
pub(crate) fn internal() -> PyErr {
    PyRuntimeError::new_err("internal error: a thread panicked; please report it with the scene")
}

/// Adds the name of an argument to its TypeError or ValueError.
pub(crate) fn in_argument(value: &Bound<'_, PyAny>, name: &str, error: &PyErr) -> PyErr {
    let py = value.py();
    let message = format!("{name}: {}", error.value(py));
    if error.is_instance_of::<PyTypeError>(py) {
        PyTypeError::new_err(message)
    } else {
        PyValueError::new_err(message)
    }
}

/// TypeError of a keyword that is none of the parts and options of a function.
pub(crate) fn unknown_keyword(name: &str, parts: &[&str], options: &[&str]) -> PyErr {
    let known = parts.iter().chain(options).copied();
    PyTypeError::new_err(match suggestions(name, known).first() {
        Some(near) => format!("unknown keyword {name:?}; did you mean {near:?}?"),
        None => format!("unknown keyword {name:?}; known: {}", parts.join(", ")),
    })
}
