//! Findings about scenes.

use std::path::PathBuf;

use pathtracer::{LoadError, Span, Warning};
use pyo3::prelude::*;

/// An error of a scene, a missing file, or a note.
#[pyclass(frozen, get_all, module = "pathtracer")]
#[derive(Clone)]
pub(crate) struct Finding {
    /// str: "error", "missing" or "note".
    severity: &'static str,
    /// str: Problem, expected value and remedy.
    message: String,
    /// pathlib.Path or None: File.
    file: Option<PathBuf>,
    /// int or None: Line, from 1.
    line: Option<u32>,
    /// int or None: Column in characters, from 1.
    column: Option<u32>,
    /// str or None: Element of the file.
    element: Option<String>,
}

impl Finding {
    pub(crate) fn new(severity: &'static str, at: Option<&Span>, message: String) -> Self {
        let known = |number: u32| (number > 0).then_some(number);
        Self {
            severity,
            message,
            file: at.map(|at| at.file.clone()),
            line: at.and_then(|at| known(at.line)),
            column: at.and_then(|at| known(at.column)),
            element: at.map(|at| at.element.clone()).filter(|element| !element.is_empty()),
        }
    }

    pub(crate) fn of_warning(severity: &'static str, Warning { at, message }: &Warning) -> Self {
        Self::new(severity, Some(at), message.clone())
    }

    pub(crate) fn of_error(error: &LoadError) -> Self {
        let message = match error {
            LoadError::Content { message, .. } | LoadError::Broken { message, .. } => {
                message.clone()
            }
            other => other.to_string(),
        };
        Self::new("error", error.place(), message)
    }

    /// Location, as far as it is known, and message.
    fn text(&self) -> String {
        let file = self.file.as_ref().map(|file| file.display().to_string());
        let number = |number: Option<u32>| number.map(|number| number.to_string());
        let at = [file, number(self.line), number(self.column)].into_iter().flatten();
        let element = self.element.clone().map(|element| format!(" {element}"));
        let parts = at.chain(element).chain(std::iter::once(format!(" {}", self.message)));
        parts.collect::<Vec<_>>().join(":").trim_start().to_owned()
    }
}

#[pymethods]
impl Finding {
    fn __str__(&self) -> String {
        self.text()
    }

    fn __repr__(&self) -> String {
        format!("<Finding {}: {}>", self.severity, self.text())
    }
}
