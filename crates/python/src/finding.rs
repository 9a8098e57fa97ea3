//! Findings about scenes.

use std::fmt;
use std::path::PathBuf;

use pathtracer::{LoadError, Span, Warning};
use pyo3::prelude::*;

use crate::places::Places;

/// An error of a scene, a missing file, or a note.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Finding {
    /// str: "error", "missing" or "note".
    #[pyo3(get)]
    severity: &'static str,
    /// str: Problem, expected value and remedy.
    #[pyo3(get)]
    message: String,
    at: Option<Span>,
}

impl Finding {
    pub(crate) fn new(severity: &'static str, at: Option<Span>, message: String) -> Self {
        Self { severity, message, at }
    }

    pub(crate) fn of_warning(severity: &'static str, Warning { at, message }: &Warning) -> Self {
        Self::new(severity, Some(at.clone()), message.clone())
    }

    /// An error of a scene that was made of values, which have names in place of locations.
    pub(crate) fn of_value(error: &LoadError, places: &Places) -> Self {
        let element = error.place().map(|at| places.of(&at.element)).unwrap_or_default();
        let (file, line, column) = (PathBuf::new(), 0, 0);
        Self::new("error", Some(Span { file, line, column, element }), error.message())
    }

    pub(crate) fn of_error(error: &LoadError) -> Self {
        Self::new("error", error.place().cloned(), error.message())
    }
}

#[pymethods]
impl Finding {
    /// pathlib.Path or None: File.
    #[getter]
    fn file(&self) -> Option<PathBuf> {
        self.at.as_ref().map(|at| at.file.clone()).filter(|file| !file.as_os_str().is_empty())
    }

    /// int or None: Line, from 1.
    #[getter]
    fn line(&self) -> Option<u32> {
        self.at.as_ref().map(|at| at.line).filter(|line| *line > 0)
    }

    /// int or None: Column in characters, from 1.
    #[getter]
    fn column(&self) -> Option<u32> {
        self.at.as_ref().map(|at| at.column).filter(|column| *column > 0)
    }

    /// str or None: Element of the file.
    #[getter]
    fn element(&self) -> Option<&str> {
        self.at.as_ref().map(|at| at.element.as_str()).filter(|element| !element.is_empty())
    }

    fn __str__(&self) -> String {
        self.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Finding {}: {self}>", self.severity)
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let message = &self.message;
        match &self.at {
            Some(at) if !at.file.as_os_str().is_empty() => write!(f, "{at}: {message}"),
            Some(at) if !at.element.is_empty() => write!(f, "{}: {message}", at.element),
            _ => f.write_str(message),
        }
    }
}
