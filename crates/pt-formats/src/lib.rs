//! Scene formats: each turns bytes into a [`Scene`].
//!
//! To add one: write its file, add its line to [`FORMATS`].

mod archive;
mod cameras;
pub mod collada;
mod context;
mod deadline;
mod decimal;
mod gltf;
mod json;
mod legacy_specular;
mod limits;
mod line;
mod measured;
mod mesh_diagnostics;
mod mesh_file;
mod mitsuba;
mod nanovdb;
mod obj;
mod pbrt;
mod placeholder;
mod ply;
mod prefetch;
mod reference_stack;
mod save;
mod serialized;
mod spectra;
mod stl;
mod tensor;
mod text;
mod transform;
mod triangulate;
mod vol;
mod xml;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::catch_panic::guarded;
use crate::{Geometry, LoadError, Scene, SourceFile, Warning};
use context::Context;
pub use json::schema as json_schema;
pub use limits::Limits;
pub use save::{Encoded, SaveError, save};
pub(crate) use text::characters;
use xml::quote;

/// How to read a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Names, without the dollar, and what they stand for: `$name` in the file, where the format
    /// has that. They win over what the file says. Each is given once, and used in the file.
    pub definitions: Vec<(String, String)>,
    /// True if files that are missing are errors; otherwise something loud stands in for them.
    pub strict: bool,
    /// True if the scene may name files outside of its folder.
    pub allow_outside: bool,
    /// Folders outside of it in which files may lie that the scene names.
    pub allowed_folders: Vec<PathBuf>,
    /// What the reading may take.
    pub limits: Limits,
    /// The time in seconds at which animations are shown, where the format has them; `None` is at
    /// rest.
    pub time: Option<f64>,
    /// True if the scene is read as the course's program CS184 reads it, where that differs:
    /// lights of COLLADA fall off with the square of the distance, whatever the file says.
    pub course: bool,
    /// The camera that is used: its name or, if none is called so, its number in the order of the
    /// file, from 0. `None` is the one that the format says.
    pub camera: Option<String>,
    /// Radius of all points and segments, above 0, in units of the scene; `None` is as the file
    /// says.
    pub point_radius: Option<f64>,
}

/// What came of reading a scene.
#[derive(Debug)]
pub struct LoadResult {
    /// The scene, or all that is wrong with it.
    pub scene: Result<Scene, LoadError>,
    /// Files that could not be used, as in [`Scene::missing`].
    pub missing: Vec<Warning>,
    /// What the user should know about what was read, as in [`Scene::warnings`].
    pub notes: Vec<Warning>,
    /// The files that were read: each once for each time, in this order.
    pub sources: Vec<SourceFile>,
}

/// Turns content and path (for files that the scene refers to, relative to it, and for messages)
/// into a scene. With errors that the context keeps, it is what is left of one.
type Parser = fn(&[u8], &Path, &Arc<Context>) -> Result<Scene, LoadError>;

/// Reads a file in pieces, without holding all of it; `None` if it is none of those that can be, or
/// anything is wrong with it: then all of it is read for the [`Parser`].
type PieceReader = fn(&Path, &Context) -> Option<Scene>;

/// A scene format.
pub struct Format {
    /// Name for messages.
    pub name: &'static str,
    /// File name endings, lower case, without the dot.
    pub extensions: &'static [&'static str],
    parser: Parser,
    /// For large files that can be read in pieces, where the format has such.
    in_pieces: Option<PieceReader>,
    /// True if it has names that stand for something.
    has_names: bool,
    /// True if its animations are read, of which a time can be asked for.
    has_times: bool,
}

impl Format {
    /// Reads a scene of this format; see [`parse_with`].
    ///
    /// # Errors
    /// If the content is wrong, names are defined twice or not used, or a time is asked for that
    /// the format does not have.
    pub fn parse(
        &self,
        bytes: &[u8],
        path: &Path,
        options: &LoadOptions,
    ) -> Result<Scene, LoadError> {
        let context = Context::new(path, options);
        self.read(path, &context, || (self.parser)(bytes, path, &context)).scene
    }

    /// Reads a file. Where that may take some time alone, it is given up soon after that time,
    /// whatever it is at.
    fn read_in_time(&'static self, path: &Path, context: &Arc<Context>) -> LoadResult {
        /// For what looks at the time by itself, and tells where it was.
        const GRACE: Duration = Duration::from_millis(500);
        let Some(most) = context.limits().time() else { return self.read_file(path, context) };
        let (file, of_thread) = (path.to_owned(), Arc::clone(context));
        let read = move || self.read_file(&file, &of_thread);
        let message = match deadline::within(most.saturating_add(GRACE), read) {
            Ok(Some(reading)) => return reading,
            Ok(None) => context::out_of_time(most),
            Err(error) => {
                format!("no thread can be started that reads within a limit of time: {error}")
            }
        };
        context.finish(Err(LoadError::Broken { at: mesh_file::place(path, 0), message }))
    }

    /// Reads a file.
    fn read_file(&self, path: &Path, context: &Arc<Context>) -> LoadResult {
        self.read(path, context, || {
            if let Some(scene) = self.in_pieces.and_then(|read| read(path, context)) {
                return Ok(scene);
            }
            let bytes = context.scene_file(path)?;
            (self.parser)(&bytes, path, context)
        })
    }

    fn read(
        &self,
        path: &Path,
        context: &Context,
        read: impl FnOnce() -> Result<Scene, LoadError>,
    ) -> LoadResult {
        let result = match self.refusal(context.options()) {
            None => guarded(self.name, read).unwrap_or_else(|message| {
                Err(LoadError::Broken { at: mesh_file::place(path, 0), message })
            }),
            Some(message) => Err(mesh_file::error(path, 0, message)),
        };
        let result = result.and_then(|mut scene| {
            cameras::choose(&mut scene, path, context)?;
            if let Some(radius) = context.options().point_radius {
                set_point_radius(&mut scene, radius, path);
            }
            Ok(scene)
        });
        let mut reading = context.finish(result);
        if let Ok(scene) = &mut reading.scene
            && scene.name.is_empty()
        {
            scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        reading
    }
}

/// Gives all points and segments of a scene this radius in the world.
fn set_point_radius(scene: &mut Scene, wanted: f64, path: &Path) {
    let mut has_points = false;
    for object in &mut scene.objects {
        if let Geometry::Points { radius, .. } = &mut object.geometry {
            *radius = Some(wanted / crate::points::scale(object.to_world.matrix3));
            has_points = true;
        }
    }
    if !has_points {
        let message =
            "a radius of points is given, but the scene has no points and no lines".into();
        scene.warnings.push(Warning { at: mesh_file::place(path, 0), message });
    }
}

impl Format {
    /// Returns true if its files hold scenes of other formats.
    fn is_archive(&self) -> bool {
        self.extensions.contains(&"zip")
    }

    /// Why it cannot be read with such options.
    fn refusal(&self, options: &LoadOptions) -> Option<String> {
        let names_of = |has: fn(&Self) -> bool| {
            let all = FORMATS.iter().filter(|f| has(f) && !f.is_archive());
            let all: Vec<_> = all.map(|f| f.name).collect();
            all.join(", ")
        };
        if let Some((name, _)) = options.definitions.first().filter(|_| !self.has_names) {
            return Some(format!(
                "{} is defined, but {} has no such names; they are for {}",
                quote(name),
                self.name,
                names_of(|f| f.has_names)
            ));
        }
        let time = options.time.filter(|_| !self.has_times)?;
        Some(format!(
            "the time {time} is asked for, but no animations of {} are read; leave it out, or give a scene of {}",
            self.name,
            names_of(|f| f.has_times)
        ))
    }
}

/// All formats.
pub static FORMATS: &[Format] = &[
    format("COLLADA", &["dae"], collada::parse),
    Format { has_times: true, ..format("glTF 2.0", &["gltf", "glb"], gltf::parse) },
    Format { has_names: true, ..format("Mitsuba 3", &["xml"], mitsuba::parse) },
    format("pbrt-v4", &["pbrt"], pbrt::parse),
    format("pathtracer JSON", &["json"], json::parse),
    format("Stanford PLY", &["ply"], ply::parse),
    Format { in_pieces: stl::IN_PIECES, ..format("STL", &["stl"], stl::parse) },
    format("Wavefront OBJ", &["obj"], obj::parse),
    Format {
        has_names: true,
        has_times: true,
        ..format("ZIP archive", &["zip", "zae"], archive::parse)
    },
];

/// A format without names that stand for something, without animations that are read, and without
/// files that are read in pieces.
const fn format(name: &'static str, extensions: &'static [&'static str], parser: Parser) -> Format {
    Format { name, extensions, parser, in_pieces: None, has_names: false, has_times: false }
}

/// Reads a scene, in the format that the ending of its name says.
///
/// # Errors
/// If the ending is unknown, the file unreadable, or its content wrong.
pub fn load(path: &Path) -> Result<Scene, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Like [`load`], with options.
///
/// # Errors
/// As [`load`]; also if names are defined twice or not used.
pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    read_with(path, options).scene
}

/// Like [`load_with`], and tells all that was found.
pub fn read_with(path: &Path, options: &LoadOptions) -> LoadResult {
    match format_of(path) {
        Ok(format) => format.read_in_time(path, &Context::new(path, options)),
        Err(error) => LoadResult {
            scene: Err(error),
            missing: Vec::new(),
            notes: Vec::new(),
            sources: Vec::new(),
        },
    }
}

/// Like [`load`], with the content at hand; the path serves for the format, for files that the
/// scene refers to, and for messages.
///
/// # Errors
/// If the ending is unknown, or the content wrong.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    parse_with(bytes, path, &LoadOptions::default())
}

/// Like [`parse`], with options.
///
/// # Errors
/// As [`parse`]; also if names are defined twice or not used.
pub fn parse_with(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    format_of(path)?.parse(bytes, path, options)
}

/// Returns true if the ending of a name is that of a scene.
pub fn is_scene(path: &Path) -> bool {
    format_of(path).is_ok()
}

/// The format that the ending of a name says.
fn format_of(path: &Path) -> Result<&'static Format, LoadError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let known = FORMATS.iter().find(|f| f.extensions.contains(&ending.as_str()));
    known.ok_or_else(|| LoadError::UnknownFormat { path: path.to_owned(), known: known_endings() })
}

/// All endings, for messages.
fn known_endings() -> String {
    let all: Vec<_> = FORMATS.iter().flat_map(|f| f.extensions).map(|e| format!(".{e}")).collect();
    all.join(", ")
}
