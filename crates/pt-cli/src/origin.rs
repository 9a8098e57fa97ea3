//! Origin of scenes in memory.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use pathtracer::{LoadOptions, Placement, SourceFile};

/// Origin of a scene in memory, by which images of it can be rendered again.
#[derive(Clone, Debug, Default)]
pub struct SceneOrigin {
    /// File that was read; `None` for the scene of the program and for content in memory.
    pub file: Option<PathBuf>,
    /// Current folder when it was read.
    pub folder: PathBuf,
    /// Options with which it was read.
    pub options: LoadOptions,
    /// Placement of the camera that replaces the one of the scene.
    pub placement: Option<Placement>,
    /// Files and content that were read.
    pub sources: Vec<SourceFile>,
}

impl SceneOrigin {
    /// The file, as seen from the current folder.
    pub(crate) fn path(&self) -> Option<PathBuf> {
        let file = self.file.as_deref()?;
        let has_moved = std::env::current_dir().is_ok_and(|folder| folder != self.folder);
        Some(if has_moved { self.folder.join(file) } else { file.to_owned() })
    }

    /// Arguments with which the program reads the same scene. Limits, which change no scene, are
    /// omitted.
    pub(crate) fn arguments(&self) -> Vec<String> {
        let LoadOptions {
            definitions,
            strict,
            allow_outside,
            allowed_folders,
            limits: _,
            time,
            ignore_attenuation: _, // an option of the program's policies
            camera,
            point_radius,
        } = &self.options;
        let mut all = Vec::new();
        all.extend(definitions.iter().map(|(name, value)| format!("--define={name}={value}")));
        let flags = [(*strict, "--strict"), (*allow_outside, "--allow-outside")];
        all.extend(flags.into_iter().filter(|(is_set, _)| *is_set).map(|(_, flag)| flag.into()));
        let folders = allowed_folders.iter();
        all.extend(folders.map(|folder| format!("--allow-folder={}", folder.display())));
        all.extend(time.map(|time| format!("--time={time}")));
        all.extend(point_radius.map(|radius| format!("--point-radius={radius}")));
        let placement = self.placement.map(|placement| match placement {
            Placement::Node => "file",
            Placement::Course => "course",
            Placement::Fit => "fit",
        });
        let camera = placement.or(camera.as_deref());
        all.extend(camera.map(|camera| format!("--camera={camera}")));
        all.extend(self.path().map(|path| argument(&path).to_string_lossy().into_owned()));
        all
    }
}

/// Argument of a path that is not mistaken for an option.
pub(crate) fn argument(path: &Path) -> OsString {
    let is_like_option = path.as_os_str().as_encoded_bytes().starts_with(b"-");
    if is_like_option { Path::new(".").join(path).into() } else { path.into() }
}
