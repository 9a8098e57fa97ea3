//! Scene formats, and formats of files that scenes refer to: each converts bytes to a [`Scene`] or
//! a part of one.
//!
//! To add a scene format: write its folder, add its line to [`FORMATS`]. `shared/` contains what
//! several formats need: text, source locations, limits, transforms, meshes.

mod archive;
pub mod camera_file;
pub mod collada;
mod encoded;
mod error;
mod gltf;
pub mod ies;
mod json;
mod measured;
mod mitsuba;
mod nanovdb;
mod obj;
mod pbrt;
mod ply;
mod save;
mod serialized;
mod shared;
mod stl;
mod tensor;
pub mod views;
mod vol;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

pub use encoded::Encoded;
pub use error::LoadError;
pub use json::{
    Attachment, Numbers, SceneValues, names_of, schema as json_schema, values_of, values_of_parts,
};
use pt_io::guarded;
use pt_scene::{Geometry, Hint, Scene, SourceFile, Warning};
pub use save::{SaveError, save};
pub use shared::cameras::find as camera_index;
use shared::context::{self, LoadContext};
pub use shared::limits::Limits;
use shared::names::quote;
pub use shared::names::suggestions;
pub use shared::source::source_file;
use shared::{cameras, deadline, mesh_file};

/// Options of reading a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Names, without the dollar, and their values: they replace `$name` in the file, in formats
    /// that support this, and take precedence over definitions of the file. Each name must be
    /// unique, and used in the file.
    pub definitions: Vec<(String, String)>,
    /// True if missing files are errors; otherwise they are replaced by placeholders.
    pub strict: bool,
    /// True if the scene may refer to files outside of its folder.
    pub allow_outside: bool,
    /// Further folders to whose files the scene may refer.
    pub allowed_folders: Vec<PathBuf>,
    /// Resource limits.
    pub limits: Limits,
    /// Time of animations in seconds, in formats that support this: glTF scenes are shown at this
    /// time, and the shutters of Mitsuba's and pathtracer's own files open then and stay open as
    /// long as in the file. `None` for the rest pose, and for the shutters of the file.
    pub time: Option<f64>,
    /// True if the light of COLLADA files falls off with the square of the distance, whatever
    /// attenuation they specify.
    pub ignore_attenuation: bool,
    /// Active camera: its name or, if no camera has that name, its index in file order, from 0.
    /// `None` for the default of the format.
    pub camera: Option<String>,
    /// Radius of all points and segments, above 0, in units of the scene; `None` for that of the
    /// file.
    pub point_radius: Option<f64>,
}

/// Result of reading a scene.
#[derive(Debug)]
pub struct LoadResult {
    /// The scene, or all errors.
    pub scene: Result<Scene, LoadError>,
    /// Files that could not be read, as in [`Scene::missing`].
    pub missing: Vec<Warning>,
    /// Warnings, as in [`Scene::warnings`].
    pub notes: Vec<Warning>,
    /// Remedies for errors, missing files and notes, each once.
    pub hints: Vec<Hint>,
    /// Files that were read, in this order, once per read.
    pub sources: Vec<SourceFile>,
}

impl LoadResult {
    /// Result of a file that is not read.
    fn failed(error: LoadError) -> Self {
        let (missing, notes, hints, sources) = Default::default();
        Self { scene: Err(error), missing, notes, hints, sources }
    }
}

/// Converts the content and path of a file to a scene. The path is used for messages and to resolve
/// references. If errors were added to the context, the result is the remainder of the scene.
type Parser = fn(&[u8], &Path, &Arc<LoadContext>) -> Result<Scene, LoadError>;

/// Reads a file in pieces, without holding all of it in memory; `None` if this is not supported for
/// the file or there is any error in it: the whole file is then read for the [`Parser`].
type PieceReader = fn(&Path, &LoadContext) -> Option<Scene>;

/// A scene format.
pub struct Format {
    /// Name for messages.
    pub name: &'static str,
    /// File name extensions, lower case, without the dot.
    pub extensions: &'static [&'static str],
    parser: Parser,
    /// Reader of large files in pieces, in formats that support this.
    in_pieces: Option<PieceReader>,
    /// True if the format supports [`LoadOptions::definitions`].
    has_names: bool,
    /// True if the format supports [`LoadOptions::time`].
    has_times: bool,
}

impl Format {
    /// Reads a scene of this format; see [`parse_with`].
    ///
    /// # Errors
    /// Returns an error if the content is invalid, names are defined twice or not used, or a time
    /// is given that the format does not support.
    pub fn parse(
        &self,
        bytes: &[u8],
        path: &Path,
        options: &LoadOptions,
    ) -> Result<Scene, LoadError> {
        self.read_content(bytes, path, options).scene
    }

    fn read_content(&self, bytes: &[u8], path: &Path, options: &LoadOptions) -> LoadResult {
        let context = LoadContext::new(path, options);
        self.read(path, &context, || (self.parser)(bytes, path, &context))
    }

    /// Reads a file. With a time limit, the read is abandoned soon after that time, whatever its
    /// state.
    fn read_in_time(&'static self, path: &Path, context: &Arc<LoadContext>) -> LoadResult {
        /// Allowance for readers that check the time themselves, and report their position.
        const GRACE: Duration = Duration::from_millis(500);
        let Some(most) = context.limits().time() else { return self.read_file(path, context) };
        let (file, of_thread) = (path.to_owned(), Arc::clone(context));
        let read = move || self.read_file(&file, &of_thread);
        let message = match deadline::within(most.saturating_add(GRACE), read) {
            Ok(Some(reading)) => return reading,
            Ok(None) => context::out_of_time(most),
            Err(error) => {
                format!("cannot start a thread for reading with a time limit: {error}")
            }
        };
        context.finish(Err(LoadError::Broken { at: mesh_file::place(path, 0), message }))
    }

    /// Reads a file.
    fn read_file(&self, path: &Path, context: &Arc<LoadContext>) -> LoadResult {
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
        context: &LoadContext,
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

/// Sets the radius of all points and segments of a scene, in world space.
fn set_point_radius(scene: &mut Scene, wanted: f64, path: &Path) {
    let mut has_points = false;
    for object in &mut scene.objects {
        if let Geometry::Points { radius, .. } = &mut object.geometry {
            *radius = Some(wanted / pt_scene::points::scale(object.to_world.matrix3));
            has_points = true;
        }
    }
    if !has_points {
        let message = "the radius of points has no effect: the scene has no points or lines".into();
        scene.warnings.push(Warning { at: mesh_file::place(path, 0), message });
    }
}

impl Format {
    /// Returns true if its files contain scenes of other formats.
    fn is_archive(&self) -> bool {
        self.extensions.contains(&"zip")
    }

    /// Returns the reason why the format does not support these options, or `None` if it does.
    fn refusal(&self, options: &LoadOptions) -> Option<String> {
        let names_of = |has: fn(&Self) -> bool| {
            let all = FORMATS.iter().filter(|f| has(f) && !f.is_archive());
            let all: Vec<_> = all.map(|f| f.name).collect();
            all.join(", ")
        };
        if let Some((name, _)) = options.definitions.first().filter(|_| !self.has_names) {
            return Some(format!(
                "unsupported definition {}: {} has no definitions; formats with definitions: {}",
                quote(name),
                self.name,
                names_of(|f| f.has_names)
            ));
        }
        let time = options.time.filter(|_| !self.has_times)?;
        Some(format!(
            "unsupported time {time}: animations of {} are not read; omit the time or use a scene \
             of {}",
            self.name,
            names_of(|f| f.has_times)
        ))
    }
}

/// All formats.
pub static FORMATS: &[Format] = &[
    format("COLLADA", &["dae"], collada::parse),
    Format { has_times: true, ..format("glTF 2.0", &["gltf", "glb"], gltf::parse) },
    Format { has_names: true, has_times: true, ..format("Mitsuba 3", &["xml"], mitsuba::parse) },
    format("pbrt-v4", &["pbrt"], pbrt::parse),
    Format { has_times: true, ..format("pathtracer JSON", &["json"], json::parse) },
    format("Stanford PLY", &["ply"], ply::parse),
    Format { in_pieces: stl::IN_PIECES, ..format("STL", &["stl"], stl::parse) },
    format("Wavefront OBJ", &["obj"], obj::parse),
    Format {
        has_names: true,
        has_times: true,
        ..format("ZIP archive", &["zip", "zae"], archive::parse)
    },
];

/// Creates a format without definitions, times, and a reader of pieces.
const fn format(name: &'static str, extensions: &'static [&'static str], parser: Parser) -> Format {
    Format { name, extensions, parser, in_pieces: None, has_names: false, has_times: false }
}

/// Reads a scene in the format of its file name extension.
///
/// # Errors
/// Returns an error if the extension is unknown, the file cannot be read, or its content is
/// invalid.
pub fn load(path: &Path) -> Result<Scene, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Reads a scene as [`load`] does, with options.
///
/// # Errors
/// Returns the errors of [`load`], and an error if names are defined twice or not used.
pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    read_with(path, options).scene
}

/// Reads a scene as [`load_with`] does, and returns the missing files, warnings and source files as
/// well.
pub fn read_with(path: &Path, options: &LoadOptions) -> LoadResult {
    match format_of(path) {
        Ok(format) => format.read_in_time(path, &LoadContext::new(path, options)),
        Err(error) => LoadResult::failed(error),
    }
}

/// Reads a scene as [`parse_with`] does, and returns the missing files, warnings and source files
/// as well; the content itself is not among these.
pub fn read_content_with(bytes: &[u8], path: &Path, options: &LoadOptions) -> LoadResult {
    match format_of(path) {
        Ok(format) => format.read_content(bytes, path, options),
        Err(error) => LoadResult::failed(error),
    }
}

/// Reads a scene from the values of the project's own format; `folder` is the one to which paths in
/// it are relative.
pub fn read_values_with(values: SceneValues, folder: &Path, options: &LoadOptions) -> LoadResult {
    let path = &folder.join("scene.json");
    match format_of(path) {
        Ok(format) => {
            let context = LoadContext::new(path, options);
            format.read(path, &context, || json::parse_values(values, path, &context))
        }
        Err(error) => LoadResult::failed(error),
    }
}

/// Reads a scene as [`load`] does, from its content; the path determines the format, resolves
/// references, and is used for messages.
///
/// # Errors
/// Returns an error if the extension is unknown, or the content is invalid.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    parse_with(bytes, path, &LoadOptions::default())
}

/// Reads a scene as [`parse`] does, with options.
///
/// # Errors
/// Returns the errors of [`parse`], and an error if names are defined twice or not used.
pub fn parse_with(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    format_of(path)?.parse(bytes, path, options)
}

/// Returns true if the extension of a file name is that of a scene format.
pub fn is_scene(path: &Path) -> bool {
    format_of(path).is_ok()
}

/// Returns the format of a file name extension.
fn format_of(path: &Path) -> Result<&'static Format, LoadError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let known = FORMATS.iter().find(|f| f.extensions.contains(&ending.as_str()));
    known.ok_or_else(|| LoadError::UnknownFormat { path: path.to_owned(), known: known_endings() })
}

/// Returns all extensions, for messages.
fn known_endings() -> String {
    let all: Vec<_> = FORMATS.iter().flat_map(|f| f.extensions).map(|e| format!(".{e}")).collect();
    all.join(", ")
}
