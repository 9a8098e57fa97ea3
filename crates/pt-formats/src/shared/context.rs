//! What the readers of scenes share: the files, what may be read of them, and what is wrong with a
//! scene.
//!
//! An error about an item of a scene (a shape, a material, a parameter …) does not end the reading:
//! [`Context::ok_or_report`] notes it, and the reader goes on without the item, so that all that is
//! wrong is told at once. What follows from an error that was told is
//! [`LoadError::AlreadyReported`], and is not told again.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pt_memory::Grant;

use super::limits::Limits;
use super::prefetch::Prefetcher;
use super::xml::quote;
use super::{LoadOptions, LoadResult, measured, mesh_file};
use crate::file::resolved;
use crate::image::{self, Decoded, Image, ImageError, PixelEncoding, Room};
use crate::measured::Measurements;
use crate::{Geometry, LoadError, Scene, SourceFile, Span, Warning, source};

/// Most items with an error, whether it was told before or not.
const MAX_FAILURES: usize = 20_000;

/// State shared by the readers of a scene.
#[derive(Debug)]
pub(super) struct Context {
    options: LoadOptions,
    /// The scene's own file.
    file: PathBuf,
    /// The folder that paths may not leave, with all links resolved.
    root: PathBuf,
    start: Instant,
    noted: Mutex<Noted>,
    pictures: Prefetcher<(PathBuf, PixelEncoding), Result<Picture, String>>,
}

/// A picture in a file.
#[derive(Debug)]
struct Picture {
    source: SourceFile,
    decoded: Result<Decoded, ImageError>,
}

/// Why a file cannot be used; the messages are meant for the place where the scene names it.
#[derive(Debug)]
pub(super) enum Unusable {
    /// It cannot be read, or may not be.
    Missing(String),
    /// What is in it makes no sense.
    Broken(String),
}

/// What was read and found so far.
#[derive(Debug, Default)]
struct Noted {
    sources: Vec<SourceFile>,
    measurements: HashMap<PathBuf, Arc<Measurements>>,
    errors: Vec<LoadError>,
    missing: Vec<Warning>,
    /// Notes about files.
    notes: Vec<Warning>,
    /// All errors and missing files as texts.
    told: HashSet<String>,
    /// Items that had an error.
    failures: usize,
    /// Bytes of files and pictures.
    bytes: u64,
    /// True if a texture was asked for whose image is missing.
    placeholder_used: bool,
}

impl Context {
    /// Most errors that are noted, and as many missing files; after that the scene is not read on.
    pub(super) const MAX_NOTED: usize = 1000;

    /// For the scene in a file, whose folder is the one that paths may not leave.
    pub(super) fn new(file: &Path, options: &LoadOptions) -> Arc<Self> {
        Arc::new(Self {
            options: options.clone(),
            root: resolved(&mesh_file::folder_of(file)),
            file: file.to_owned(),
            start: Instant::now(),
            noted: Mutex::default(),
            pictures: Prefetcher::default(),
        })
    }

    /// How the scene is to be read.
    pub(super) fn options(&self) -> &LoadOptions {
        &self.options
    }

    /// What it may take.
    pub(super) fn limits(&self) -> &Limits {
        &self.options.limits
    }

    fn noted(&self) -> MutexGuard<'_, Noted> {
        self.noted.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the scene's own file.
    ///
    /// # Errors
    /// If it cannot be read, or is larger than the limits allow.
    pub(super) fn scene_file(&self, path: &Path) -> Result<Vec<u8>, LoadError> {
        let (bytes, source) =
            source::read(path).map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
        self.spend(bytes.len() as u64)
            .map_err(|message| LoadError::Broken { at: mesh_file::place(path, 0), message })?;
        self.noted().sources.push(source);
        Ok(bytes)
    }

    /// Reads the scene's own file, of so many bytes, by `read`, which does not hold all of it;
    /// `None` if it cannot, or the limits do not allow it: then [`Self::scene_file`] is to
    /// tell.
    pub(super) fn scene_in_pieces<T>(
        &self,
        length: usize,
        read: impl FnOnce() -> Option<(T, SourceFile)>,
    ) -> Option<T> {
        let length = length as u64;
        if self.limits().memory.is_some_and(|most| length > most) {
            return None;
        }
        let (item, source) = read()?;
        let mut noted = self.noted();
        noted.bytes = noted.bytes.saturating_add(length);
        noted.sources.push(source);
        Some(item)
    }

    /// Reads a file that the scene names.
    ///
    /// # Errors
    /// If it is outside of the scene's folder, cannot be read, or is no regular file: devices and
    /// pipes may never end; or if a limit is reached. The message is meant for the place where
    /// the scene names it.
    pub(super) fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        self.check_admissible(path)?;
        let (bytes, source) =
            source::read(path).map_err(|error| unreadable(path, &error.to_string()))?;
        self.noted().sources.push(source);
        Ok(bytes)
    }

    /// Counts a file that the scene names, if it may be read.
    fn check_admissible(&self, path: &Path) -> Result<(), String> {
        let length = self.length(path)?;
        self.check_time()?;
        self.spend(length).map_err(|why| unreadable(path, &why))
    }

    /// The bytes of a regular file that the scene may name.
    fn length(&self, path: &Path) -> Result<u64, String> {
        self.check_inside(path)?;
        let failed = |error: std::io::Error| unreadable(path, &error.to_string());
        let metadata = std::fs::metadata(path).map_err(failed)?;
        if metadata.is_file() {
            Ok(metadata.len())
        } else {
            Err(unreadable(path, "it is no regular file"))
        }
    }

    /// Reads a picture that the scene names. Values that are no finite numbers are replaced, with a
    /// note.
    ///
    /// # Errors
    /// As [`Self::read`], or if it is no picture, or larger than the limits allow.
    pub(super) fn picture(&self, path: &Path, numbers: PixelEncoding) -> Result<Decoded, String> {
        let pixels = self.pixels(path, numbers)?;
        if pixels.frame.is_none() {
            return Ok(pixels);
        }
        let whole = pixels.framed().map_err(|why| format!("{} {why}", path.display()))?;
        self.check_picture(Ok(whole), path)
    }

    /// As [`Self::picture`], but the pixels alone that the file has, wherever they lie in the
    /// picture, as Mitsuba and pbrt-v4 read them.
    ///
    /// # Errors
    /// As [`Self::picture`].
    pub(super) fn pixels(&self, path: &Path, numbers: PixelEncoding) -> Result<Decoded, String> {
        // An unknown ending is the better message where the file is missing as well.
        image::check_readable(path).map_err(|error| error.to_string())?;
        self.check_admissible(path)?;
        let key = (path.to_owned(), numbers);
        let ahead = self.pictures.get(&key, Clone::clone, |key| self.inspect_picture(&key))?;
        // There may be too little memory for several at a time.
        let alone = if ahead.decoded.is_err() { self.inspect_picture(&key)? } else { ahead };
        let Picture { source, decoded } = alone;
        self.noted().sources.push(source);
        let mut decoded = self.check_picture(decoded, path)?;
        if let Some(message) = decoded.image.make_finite() {
            self.note(mesh_file::place(path, 0), message);
        }
        Ok(decoded)
    }

    /// Says which pictures the scene is likely to ask for, in this order, so that threads can
    /// decode several at once. Where memory is limited, they are decoded one by one.
    pub(super) fn expect_pictures(
        &self,
        pictures: impl IntoIterator<Item = (PathBuf, PixelEncoding)>,
    ) {
        if self.limits().memory.is_none() {
            self.pictures.expect(pictures);
        }
    }

    /// A picture as it is in a file, before it is known whether the scene needs it.
    fn inspect_picture(
        &self,
        (path, numbers): &(PathBuf, PixelEncoding),
    ) -> Result<Picture, String> {
        self.length(path)?;
        let (bytes, source) =
            source::read(path).map_err(|error| unreadable(path, &error.to_string()))?;
        let grant = |bytes| self.grant_picture(bytes);
        let decoded = image::decode_in(&bytes, path, *numbers, &Room::new(&grant));
        Ok(Picture { source, decoded })
    }

    /// Grants the memory of a picture, half of which it keeps, if the limits allow it.
    pub(super) fn grant_picture(&self, bytes: u64) -> Result<Grant, String> {
        match self.limits().memory {
            Some(most) if bytes / 2 > self.room() => Err(beyond(most)),
            _ => pt_memory::ask(bytes),
        }
    }

    /// Holds a picture to the limits, and counts it; `path` is the name for messages.
    ///
    /// # Errors
    /// If it is none, or larger than the limits allow.
    pub(super) fn check_picture(
        &self,
        decoded: Result<Decoded, ImageError>,
        path: &Path,
    ) -> Result<Decoded, String> {
        let decoded = decoded.map_err(|error| error.to_string())?;
        let Image { width, height, pixels } = &decoded.image;
        let (side, count) = (u64::from(*width.max(height)), pixels.len() as u64);
        let Limits { texture_side, texture_pixels, .. } = self.limits();
        for (limit, found, what) in
            [(texture_side, side, "pixels along a side"), (texture_pixels, count, "pixels")]
        {
            if let Some(limit) = limit.filter(|limit| found > *limit) {
                return Err(format!(
                    "{} has {found} {what}, more than the limit of {limit}",
                    path.display()
                ));
            }
        }
        self.spend(size_of_val(pixels.as_slice()) as u64)
            .map_err(|why| format!("{}: {why}", path.display()))?;
        Ok(decoded)
    }

    /// What was measured of a material, from a file that the scene names; each is read once.
    ///
    /// # Errors
    /// As [`Self::read`], or if it is no such file.
    pub(super) fn measurements(&self, path: &Path) -> Result<Arc<Measurements>, Unusable> {
        if let Some(known) = self.noted().measurements.get(path) {
            return Ok(Arc::clone(known));
        }
        let bytes = self.read(path).map_err(Unusable::Missing)?;
        let named = |why: String| format!("{}: {why}", path.display());
        let parsed = measured::parse(&bytes).map_err(|why| Unusable::Broken(named(why)))?;
        self.spend(parsed.bytes() as u64).map_err(|why| Unusable::Missing(named(why)))?;
        let measurements = Arc::new(parsed);
        self.noted().measurements.insert(path.to_owned(), Arc::clone(&measurements));
        Ok(measurements)
    }

    /// Bytes that may still be taken.
    pub(super) fn room(&self) -> u64 {
        self.limits().memory.map_or(u64::MAX, |most| most.saturating_sub(self.noted().bytes))
    }

    /// Counts bytes that are about to be taken and kept, and asks for them.
    ///
    /// # Errors
    /// If they are more than the limits allow, or the process may hold.
    pub(super) fn reserve(&self, bytes: u64) -> Result<Grant, String> {
        self.spend(bytes)?;
        pt_memory::ask(bytes)
    }

    /// Counts bytes that are taken.
    ///
    /// # Errors
    /// If they are more than the limits allow.
    fn spend(&self, bytes: u64) -> Result<(), String> {
        let mut noted = self.noted();
        noted.bytes = noted.bytes.saturating_add(bytes);
        let most = self.limits().memory.unwrap_or(u64::MAX);
        if noted.bytes <= most {
            return Ok(());
        }
        Err(beyond(most))
    }

    /// Refuses a path that leads out of the scene's folder, unless that is allowed.
    ///
    /// # Errors
    /// If it does; the message says where it leads, and which option allows it.
    pub(super) fn check_inside(&self, path: &Path) -> Result<(), String> {
        if self.options.allow_outside {
            return Ok(());
        }
        let target = resolved(path);
        let allowed = &self.options.allowed_folders;
        let is_in = |folder: &PathBuf| target.starts_with(resolved(folder));
        if target.starts_with(&self.root) || allowed.iter().any(is_in) {
            return Ok(());
        }
        let folder = if target.is_dir() { &*target } else { target.parent().unwrap_or(&target) };
        let shown = folder.display().to_string();
        let is_plain = shown.chars().all(|c| c.is_alphanumeric() || "/\\:._-+".contains(c));
        let typed = if is_plain { shown } else { quote(&shown) };
        Err(format!(
            "{} leads to {}, outside of the folder of the scene; if you trust the scene, --allow-folder {typed} allows \
             this folder, and --allow-outside all",
            path.display(),
            target.display()
        ))
    }

    fn check_time(&self) -> Result<(), String> {
        match self.limits().time() {
            Some(most) if self.start.elapsed() >= most => Err(out_of_time(most)),
            _ => Ok(()),
        }
    }

    /// What an item of the scene is, or `None` after its error is noted, so that the rest can be
    /// read.
    ///
    /// # Errors
    /// If nothing more can be read.
    pub(super) fn ok_or_report<T>(
        &self,
        result: Result<T, LoadError>,
    ) -> Result<Option<T>, LoadError> {
        let ended = |message| {
            let at = mesh_file::place(&self.file, 0);
            Err(LoadError::Broken { at, message })
        };
        if let Err(message) = self.check_time() {
            return ended(message);
        }
        match result {
            Ok(item) => Ok(Some(item)),
            Err(LoadError::AlreadyReported) => Ok(None),
            Err(error @ LoadError::Broken { .. }) => Err(error),
            Err(error) => {
                let mut noted = self.noted();
                noted.failures += 1;
                // What is wrong with a material is found by each shape that has it.
                if noted.told.insert(error.to_string()) {
                    noted.errors.push(error);
                }
                if noted.errors.len() < Self::MAX_NOTED && noted.failures < MAX_FAILURES {
                    return Ok(None);
                }
                drop(noted);
                ended("there are too many errors; the rest of the scene is not read".to_owned())
            }
        }
    }

    /// What an item of the scene is, or `None` after its error became a note of what is done
    /// instead, which costs nothing else; an error where everything has to be as the file says
    /// ([`LoadOptions::strict`]).
    ///
    /// # Errors
    /// Those that are not about the content of the file, and all of them if it has to be so.
    pub(super) fn forgive<T>(
        &self,
        result: Result<T, LoadError>,
        instead: &str,
    ) -> Result<Option<T>, LoadError> {
        match result {
            Err(LoadError::Content { at, message }) if !self.options.strict => {
                self.note(at, format!("{message}; {instead}"));
                Ok(None)
            }
            result => result.map(Some),
        }
    }

    /// Returns true if an error was noted.
    pub(super) fn has_errors(&self) -> bool {
        !self.noted().errors.is_empty()
    }

    /// An error that ends the reading, since a limit is exceeded.
    pub(super) fn exceeded(at: Span, message: impl Into<String>) -> LoadError {
        LoadError::Broken { at, message: message.into() }
    }

    /// Notes a file that the scene names and that cannot be used, and what was done instead.
    pub(super) fn missing(&self, at: Span, message: impl Into<String>) {
        let mut noted = self.noted();
        let missing = Warning { at, message: message.into() };
        if noted.missing.len() < Self::MAX_NOTED && noted.told.insert(missing.to_string()) {
            noted.missing.push(missing);
        }
    }

    /// Notes what the user should know about a file, once.
    pub(super) fn note(&self, at: Span, message: String) {
        let (mut noted, note) = (self.noted(), Warning { at, message });
        if noted.notes.len() < Self::MAX_NOTED && !noted.notes.contains(&note) {
            noted.notes.push(note);
        }
    }

    /// Tells those who make a material that it shows a texture whose image is missing.
    pub(super) fn set_placeholder_used(&self) {
        self.noted().placeholder_used = true;
    }

    /// Returns true if that was told since this was asked last.
    pub(super) fn take_placeholder_used(&self) -> bool {
        std::mem::take(&mut self.noted().placeholder_used)
    }

    /// What came of the reading. With [`LoadOptions::strict`], missing files are errors.
    pub(super) fn finish(&self, result: Result<Scene, LoadError>) -> LoadResult {
        let Noted { sources, mut errors, missing, notes: of_files, .. } =
            std::mem::take(&mut *self.noted());
        let mut scene = result
            .and_then(|scene| match self.spend_on_meshes(&scene) {
                Ok(()) => Ok(scene),
                Err(message) => {
                    Err(LoadError::Broken { at: mesh_file::place(&self.file, 0), message })
                }
            })
            .map_err(|error| errors.push(error))
            .ok();
        errors.retain(|error| !matches!(error, LoadError::AlreadyReported));
        if self.options.strict {
            let as_error = |Warning { at, message }: Warning| LoadError::Content { at, message };
            errors.extend(missing.iter().cloned().map(as_error));
        }
        errors.sort_by_key(|error| self.order(error.place()));
        if let Some(scene) = &mut scene {
            scene.warnings.extend(of_files);
        }
        let notes = scene.as_ref().map(|scene| scene.warnings.clone()).unwrap_or_default();
        if let Some(scene) = &mut scene {
            scene.missing.clone_from(&missing);
        }
        let scene = match (errors.len(), scene) {
            (0, Some(scene)) => Ok(scene),
            (1, _) => Err(errors.remove(0)),
            _ => Err(LoadError::Several(errors)),
        };
        LoadResult { scene, missing, notes, sources }
    }

    /// Counts the meshes and points of a scene, each once.
    fn spend_on_meshes(&self, scene: &Scene) -> Result<(), String> {
        let mut seen = HashSet::new();
        for object in &scene.objects {
            let (place, bytes) = match &object.geometry {
                Geometry::Mesh(mesh) => (Arc::as_ptr(mesh).addr(), mesh.bytes()),
                Geometry::Points { points, .. } => (Arc::as_ptr(points).addr(), points.bytes()),
                Geometry::Sphere { .. } => continue,
            };
            if seen.insert(place) {
                self.spend(bytes)?;
            }
        }
        Ok(())
    }

    /// Where an error comes in a list: by lines, those of the scene's own file first.
    fn order(&self, at: Option<&Span>) -> (bool, PathBuf, u32, u32) {
        at.map_or((false, PathBuf::new(), 0, 0), |at| {
            (at.file != self.file, at.file.clone(), at.line, at.column)
        })
    }
}

/// The message about a scene that is larger than the limit of memory.
fn beyond(most: u64) -> String {
    format!("the scene takes more memory than the limit of {most} bytes")
}

/// The message about a scene whose reading takes longer than it may.
pub(super) fn out_of_time(most: Duration) -> String {
    format!("reading takes longer than the limit of {} seconds", most.as_secs())
}

/// The message about a file that cannot be read.
fn unreadable(path: &Path, why: &str) -> String {
    format!("{} cannot be read: {why}", path.display())
}

/// The folder in which a scene looks for files.
#[derive(Clone, Debug)]
pub(super) struct Folder {
    pub(super) path: PathBuf,
    pub(super) context: Arc<Context>,
}

impl Folder {
    /// The path of a file in it.
    pub(super) fn join(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}
