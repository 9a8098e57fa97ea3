//! Options for reading scenes.

use std::path::PathBuf;

use bytesize::ByteSize;
use pathtracer::{Limits, LoadOptions, Placement};

use crate::{config, resolve};

/// Folders whose files a scene may reference.
#[derive(clap::Args, Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Folders {
    /// Let the scene name files outside of its own folder
    #[arg(long, help_heading = "Scene")]
    pub(crate) allow_outside: bool,

    /// Let the scene name files in this folder and in those inside of it; may be given for several
    #[arg(long, value_name = "DIR", value_parser = config::folder, help_heading = "Scene")]
    pub(crate) allow_folder: Vec<PathBuf>,
}

/// Options for reading scenes.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Loading {
    /// Value of $NAME in a Mitsuba scene, instead of its <default>; may be given for
    /// several names
    #[arg(short = 'D', long, value_name = "NAME=VALUE", value_parser = resolve::definition)]
    #[arg(help_heading = "Scene")]
    pub(crate) define: Vec<(String, String)>,

    #[command(flatten)]
    pub(crate) folders: Folders,

    /// Most that reading the scene may take, as in memory=2GB; may be given for several of memory,
    /// depth, shapes, elements, texture-side, texture-pixels, include-depth, files, seconds
    #[arg(long, value_name = "NAME=VALUE", value_parser = limit, help_heading = "Scene")]
    limit: Vec<(String, u64)>,

    /// Show the animations of a glTF scene at this time [default: all stands where it does at
    /// rest]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = resolve::seconds)]
    #[arg(help_heading = "Scene")]
    pub(crate) time: Option<f64>,

    /// Camera placement: as in the file (file), as in the program of the course CS184 (course), or
    /// so that all surfaces are visible (fit); or the camera to use, by its name or its number in
    /// the file, from 0 [default: as in the file; course for COLLADA of the course]
    #[arg(long, value_name = "CAMERA", help_heading = "Scene")]
    pub(crate) camera: Option<String>,

    /// Radius of points and lines, which are shown as spheres and cylinders, in the unit of the
    /// scene [default: as the file says, or half of the mean distance between points; of
    /// lines, 1/250 of their extent]
    #[arg(long, value_name = "RADIUS", value_parser = resolve::radius)]
    #[arg(help_heading = "Scene")]
    pub(crate) point_radius: Option<f64>,
}

impl Loading {
    /// Converts the options to those of the scene readers; with `strict`, missing files are errors.
    pub(crate) fn options(&self, strict: bool) -> LoadOptions {
        let mut limits = Limits::default();
        for (name, value) in &self.limit {
            // The parser has checked the names.
            let _ = limits.set(name, *value);
        }
        let Self {
            define,
            folders: Folders { allow_outside, allow_folder },
            time,
            camera,
            point_radius,
            ..
        } = self;
        LoadOptions {
            definitions: define.clone(),
            strict,
            allow_outside: *allow_outside,
            allowed_folders: allow_folder
                .iter()
                .chain(config::allowed_folders())
                .cloned()
                .collect(),
            limits,
            time: *time,
            course: false,
            camera: camera.clone().filter(|_| self.placement().is_none()),
            point_radius: *point_radius,
        }
    }

    /// Placement of the camera, or `None` if `--camera` is not given or names a camera.
    pub(crate) fn placement(&self) -> Option<Placement> {
        match self.camera.as_deref()? {
            "file" => Some(Placement::Node),
            "course" => Some(Placement::Course),
            "fit" => Some(Placement::Fit),
            _ => None,
        }
    }
}

/// Parses the name and the value of a limit.
fn limit(text: &str) -> Result<(String, u64), String> {
    let Some((name, value)) = text.split_once('=') else {
        let names = Limits::NAMES.join(", ");
        return Err(format!("expected NAME=VALUE, with one of the names {names}"));
    };
    let expected = "expected a whole number from 1 up, or an amount as in memory=2GB";
    let value = value.parse::<ByteSize>().map_err(|_| expected)?.as_u64();
    if value == 0 {
        return Err(expected.to_owned());
    }
    Limits::default().set(name, value)?;
    Ok((name.to_owned(), value))
}
