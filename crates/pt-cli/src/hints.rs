//! Remedies of the libraries as options of the command line.

use pathtracer::checkpoint::CheckpointError;
use pathtracer::{CompileError, Hint, SaveError};

use crate::message::WithHints;

/// Prints advice for each remedy.
pub(crate) fn report<'h>(hints: impl IntoIterator<Item = &'h Hint>) {
    for hint in hints {
        report!("help: {}", advice(hint));
    }
}

/// Prints advice for an error, if there is any.
pub(crate) fn report_for(error: &anyhow::Error) {
    if let Some(WithHints { hints, .. }) = error.downcast_ref() {
        report(hints);
    }
    let advice = if let Some(SaveError::Exists { .. }) = error.downcast_ref() {
        Some("--force overwrites it")
    } else if error.downcast_ref::<CheckpointError>().is_some() {
        Some("render to another file with -f, or discard the samples with --restart")
    } else if let Some(CompileError::LightGroups(_)) = error.downcast_ref() {
        Some("--light-groups names the lights of each group")
    } else {
        None
    };
    if let Some(advice) = advice {
        report!("help: {advice}");
    }
    report_memory();
}

/// Prints advice if memory was denied.
pub(crate) fn report_memory() {
    if pathtracer::memory::is_short() {
        report!("help: --max-memory SIZE allows more memory");
    }
}

/// Remedy in words.
pub(crate) fn advice(hint: &Hint) -> String {
    match hint {
        Hint::AllowFolder(folder) => {
            let folder = folder.display().to_string();
            let typed = shlex::try_quote(&folder).map_or(folder.clone(), Into::into);
            format!(
                "if you trust the scene, --allow-folder {typed} lets it read that folder, and --allow-outside all folders"
            )
        }
        Hint::RaiseLimit(name) => format!("--limit {name}=NUMBER raises the limit"),
        Hint::SelectCamera => "--camera NAME or NUMBER selects another camera".into(),
        Hint::CameraOfFile => "--camera file places the camera as in the file".into(),
        Hint::FitCamera => "--camera fit shows all surfaces".into(),
        Hint::SetTime => "--time SECONDS shows the animations at that time".into(),
        Hint::SetPointRadius => "--point-radius LENGTH sets the radius".into(),
        Hint::AddEnvironment => "-e FILE.exr lights the scene with an environment map".into(),
        Hint::SetSkyLayout => {
            "--environment FILE --environment-layout LAYOUT reads other layouts of the sky".into()
        }
        Hint::ShowNormals => "--integrator normals shows the shapes without light".into(),
        Hint::UseIntegrator(name) => format!("--integrator {name} renders them"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_typed_as_a_shell_needs_them() {
        let of = |folder: &str| advice(&Hint::AllowFolder(folder.into()));
        assert!(of("/a/b").contains("--allow-folder /a/b lets"), "{}", of("/a/b"));
        assert!(of("/a b").contains("--allow-folder '/a b' lets"), "{}", of("/a b"));
    }
}
