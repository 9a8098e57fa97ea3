//! Remedies for problems.

use std::path::PathBuf;

/// Remedy for a problem that a message describes. Programs turn it into advice in their own terms:
/// an option of a command line, an argument, or a button.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Hint {
    /// Let the scene read files of this folder.
    AllowFolder(PathBuf),
    /// Raise the limit of this name.
    RaiseLimit(&'static str),
    /// Choose one of the cameras of the scene.
    SelectCamera,
    /// Place the camera as in the file.
    CameraOfFile,
    /// Place the camera so that all surfaces are visible.
    FitCamera,
    /// Choose the time at which animations are shown.
    SetTime,
    /// Choose the radius of points and lines.
    SetPointRadius,
    /// Light the scene with an environment map.
    AddEnvironment,
    /// Choose how the image shows the sky, unless it is in latitude and longitude.
    SetSkyLayout,
    /// Show shading normals, which need no light.
    ShowNormals,
    /// Use the integrator of this name.
    UseIntegrator(&'static str),
}

/// Notes on a scene for the user, and remedies for what they describe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Notes {
    lines: Vec<String>,
    hints: Vec<Hint>,
}

impl Notes {
    /// Adds a note.
    pub fn push(&mut self, line: impl Into<String>) {
        self.lines.push(line.into());
    }

    /// Adds a remedy, once.
    pub fn suggest(&mut self, hint: Hint) {
        if !self.hints.contains(&hint) {
            self.hints.push(hint);
        }
    }

    /// Adds the notes and the remedies of another list.
    pub fn append(&mut self, other: &Self) {
        self.lines.extend_from_slice(&other.lines);
        other.hints.iter().for_each(|hint| self.suggest(hint.clone()));
    }

    /// The notes, in order.
    pub fn lines(&self) -> &[String] {
        &self.lines
    }

    /// The remedies, each once.
    pub fn hints(&self) -> &[Hint] {
        &self.hints
    }
}

impl<S: Into<String>> Extend<S> for Notes {
    fn extend<I: IntoIterator<Item = S>>(&mut self, lines: I) {
        self.lines.extend(lines.into_iter().map(Into::into));
    }
}
