//! Options for reading scenes.

use std::path::PathBuf;

use pathtracer::{Limits, LoadOptions, Placement};

use crate::{config, parse};

/// Folders whose files a scene may reference.
#[derive(clap::Args, Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Folders {
    /// Allow the scene to refer to files outside of its folder
    #[arg(long, help_heading = "Scene")]
    pub(crate) allow_outside: bool,

    /// Allow the scene to refer to files in this folder and its subfolders; may be repeated
    #[arg(long, value_name = "DIR", value_parser = config::folder, help_heading = "Scene")]
    pub(crate) allow_folder: Vec<PathBuf>,
}

/// Options for reading scenes.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Loading {
    /// Value of $NAME in a Mitsuba scene, in place of its <default>; may be repeated
    #[arg(short = 'D', long, value_name = "NAME=VALUE", value_parser = parse::definition)]
    #[arg(help_heading = "Scene")]
    pub(crate) define: Vec<(String, String)>,

    #[command(flatten)]
    pub(crate) folders: Folders,

    /// Limit for reading the scene, such as memory=2GB; may be repeated. The names are memory,
    /// depth, shapes, triangles, elements, texture-side, texture-pixels, include-depth, files and
    /// seconds
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse::limit, help_heading = "Scene")]
    limit: Vec<(String, u64)>,

    /// Time at which animations are shown, such as 1.5 or 2m: a glTF scene as at this time, one of
    /// Mitsuba or pathtracer as if its shutter opened then [default: the rest pose; the shutter of
    /// the file]
    #[arg(long, value_name = "TIME", allow_negative_numbers = true, value_parser = parse::seconds)]
    #[arg(help_heading = "Scene")]
    pub(crate) time: Option<f64>,

    /// Camera placement: as in the file (file), as in the course's program (course), or so that all
    /// surfaces are visible (fit); or the camera to use, by its name or its number in the file,
    /// from 0 [default: as in the file; course for COLLADA of the course]
    #[arg(long, value_name = "CAMERA", help_heading = "Scene")]
    pub(crate) camera: Option<String>,

    /// Radius of points and lines, which are shown as spheres and cylinders, in the unit of the
    /// scene [default: as in the file, or half of the median distance to the fourth nearest
    /// point; for lines, 1/250 of their extent]
    #[arg(long, value_name = "RADIUS", value_parser = parse::radius)]
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
            ignore_attenuation: false,
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
