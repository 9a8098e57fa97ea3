//! State shared by the readers of scenes: files, limits and diagnostics.
//!
//! An error about an item of a scene (a shape, a material, a parameter …) does not end the read:
//! [`LoadContext::ok_or_report`] records it, and the reader continues without the item, so that all
//! errors are reported at once. A consequence of an error that was reported is
//! [`LoadError::AlreadyReported`], and is not reported again.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pt_image::{Decoded, ImageError, ImageMemory, PixelEncoding};
use pt_io::file::resolved;
use pt_memory::Grant;
use pt_scene::image::Image;
use pt_scene::measured::Measurements;
use pt_scene::{Geometry, Hint, Scene, SourceFile, Span, Warning};

use super::limits::Limits;
use super::mesh_file;
use super::prefetch::Prefetcher;
use crate::shared::source;
use crate::{LoadError, LoadOptions, LoadResult, measured};

/// Maximum number of items with an error, including errors reported before.
const MAX_FAILURES: usize = 20_000;

/// State shared by the readers of a scene.
#[derive(Debug)]
pub(crate) struct LoadContext {
    options: LoadOptions,
    /// Scene file.
    file: PathBuf,
    /// Folder that paths must not leave, with symbolic links resolved.
    root: PathBuf,
    start: Instant,
    noted: Mutex<Noted>,
    pictures: Prefetcher<(PathBuf, PixelEncoding), Result<DecodedFile, String>>,
}

/// A decoded image file.
#[derive(Debug)]
struct DecodedFile {
    source: SourceFile,
    decoded: Result<Decoded, ImageError>,
}

/// Reason why a file cannot be used. The caller adds the location of the reference in the scene to
/// the message.
#[derive(Debug)]
pub(crate) enum Unusable {
    /// The file cannot be read, or access is not allowed.
    Missing(String),
    /// The content is invalid.
    Broken(String),
}

/// Files and diagnostics so far.
#[derive(Debug, Default)]
struct Noted {
    sources: Vec<SourceFile>,
    measurements: HashMap<PathBuf, Arc<Measurements>>,
    errors: Vec<LoadError>,
    missing: Vec<Warning>,
    /// Warnings about files.
    notes: Vec<Warning>,
    hints: Vec<Hint>,
    /// Messages of all errors and missing files.
    reported: HashSet<String>,
    /// Number of items with an error.
    failures: usize,
    /// Number of bytes of files and images.
    bytes: u64,
    /// True if a texture was requested whose image is missing.
    placeholder_used: bool,
}

impl LoadContext {
    /// Maximum number of recorded errors, and of missing files; beyond it, the rest of the scene is
    /// not read.
    pub(crate) const MAX_NOTED: usize = 1000;

    /// Creates the state of a scene file, whose folder paths must not leave.
    pub(crate) fn new(file: &Path, options: &LoadOptions) -> Arc<Self> {
        Arc::new(Self {
            options: options.clone(),
            root: resolved(&mesh_file::folder_of(file)),
            file: file.to_owned(),
            start: Instant::now(),
            noted: Mutex::default(),
            pictures: Prefetcher::default(),
        })
    }

    /// Returns the options of the read.
    pub(crate) fn options(&self) -> &LoadOptions {
        &self.options
    }

    /// Returns the resource limits.
    pub(crate) fn limits(&self) -> &Limits {
        &self.options.limits
    }

    fn noted(&self) -> MutexGuard<'_, Noted> {
        self.noted.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the scene file.
    ///
    /// # Errors
    /// Returns an error if it cannot be read, or is larger than the limits allow.
    pub(crate) fn scene_file(&self, path: &Path) -> Result<Vec<u8>, LoadError> {
        let (bytes, source) =
            source::read(path).map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
        self.spend(bytes.len() as u64)
            .map_err(|message| LoadError::Broken { at: mesh_file::place(path, 0), message })?;
        self.noted().sources.push(source);
        Ok(bytes)
    }

    /// Reads the scene file, of `length` bytes, by `read`, which does not hold all of it in memory;
    /// `None` if `read` fails, or the limits do not allow it: [`Self::scene_file`] then reports the
    /// reason.
    #[cfg(all(unix, target_pointer_width = "64"))]
    pub(crate) fn scene_in_pieces<T>(
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

    /// Reads a file to which the scene refers.
    ///
    /// # Errors
    /// Returns a message if the file is outside of the scene's folder, cannot be read, or is no
    /// regular file (devices and pipes may never end), or if a limit is exceeded. The caller adds
    /// the location of the reference in the scene.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        self.check_admissible(path)?;
        let (bytes, source) =
            source::read(path).map_err(|error| unreadable(path, &error.to_string()))?;
        self.noted().sources.push(source);
        Ok(bytes)
    }

    /// Checks that a file to which the scene refers may be read, and counts its bytes.
    fn check_admissible(&self, path: &Path) -> Result<(), String> {
        let length = self.length(path)?;
        self.check_time()?;
        self.spend(length).map_err(|why| unreadable(path, &why))
    }

    /// Returns the length of a regular file to which the scene may refer.
    fn length(&self, path: &Path) -> Result<u64, String> {
        self.check_inside(path)?;
        let failed = |error: std::io::Error| unreadable(path, &error.to_string());
        let metadata = std::fs::metadata(path).map_err(failed)?;
        if metadata.is_file() {
            Ok(metadata.len())
        } else {
            Err(unreadable(path, "not a regular file"))
        }
    }

    /// Reads an image to which the scene refers. Values that are not finite are replaced, with a
    /// warning.
    ///
    /// # Errors
    /// Returns the errors of [`Self::read`], and a message if the file is no image or larger than
    /// the limits allow.
    pub(crate) fn picture(&self, path: &Path, numbers: PixelEncoding) -> Result<Decoded, String> {
        let pixels = self.pixels(path, numbers)?;
        if pixels.frame.is_none() {
            return Ok(pixels);
        }
        let whole = pixels.framed().map_err(|why| format!("{} {why}", path.display()))?;
        self.check_picture(Ok(whole), path)
    }

    /// Reads an image as [`Self::picture`] does, but returns its data window only, independent of
    /// the display window, as Mitsuba and pbrt-v4 do.
    ///
    /// # Errors
    /// Returns the errors of [`Self::picture`].
    pub(crate) fn pixels(&self, path: &Path, numbers: PixelEncoding) -> Result<Decoded, String> {
        // An unknown extension gives the better message if the file is missing as well.
        pt_image::check_readable(path).map_err(|error| error.to_string())?;
        self.check_admissible(path)?;
        let key = (path.to_owned(), numbers);
        let ahead = self.pictures.get(&key, Clone::clone, |key| self.inspect_picture(&key))?;
        // There may be too little memory for several images at the same time.
        let alone = if ahead.decoded.is_err() { self.inspect_picture(&key)? } else { ahead };
        let DecodedFile { source, decoded } = alone;
        self.noted().sources.push(source);
        let mut decoded = self.check_picture(decoded, path)?;
        if let Some(message) = decoded.image.make_finite() {
            self.note(mesh_file::place(path, 0), message);
        }
        Ok(decoded)
    }

    /// Announces images that the scene will probably request, in this order, so that threads can
    /// decode several at once. With a memory limit, they are decoded one by one.
    pub(crate) fn expect_pictures(
        &self,
        pictures: impl IntoIterator<Item = (PathBuf, PixelEncoding)>,
    ) {
        if self.limits().memory.is_none() {
            self.pictures.expect(pictures);
        }
    }

    /// Decodes an image file, before the scene requests it.
    fn inspect_picture(
        &self,
        (path, numbers): &(PathBuf, PixelEncoding),
    ) -> Result<DecodedFile, String> {
        self.length(path)?;
        let (bytes, source) =
            source::read(path).map_err(|error| unreadable(path, &error.to_string()))?;
        let grant = |bytes| self.grant_picture(bytes);
        let decoded = pt_image::decode_in(&bytes, path, *numbers, &ImageMemory::new(&grant));
        Ok(DecodedFile { source, decoded })
    }

    /// Grants the memory to decode an image, half of which is retained, if the limits allow it.
    pub(crate) fn grant_picture(&self, bytes: u64) -> Result<Grant, String> {
        match self.limits().memory {
            Some(most) if bytes / 2 > self.room() => Err(beyond(most)),
            _ => pt_memory::ask(bytes),
        }
    }

    /// Checks the limits of an image, and counts its bytes; `path` is the name for messages.
    ///
    /// # Errors
    /// Returns a message if it could not be decoded, or is larger than the limits allow.
    pub(crate) fn check_picture(
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

    /// Reads a measured material to which the scene refers; each file is read once.
    ///
    /// # Errors
    /// Returns the errors of [`Self::read`], and an error if the content is invalid.
    pub(crate) fn measurements(&self, path: &Path) -> Result<Arc<Measurements>, Unusable> {
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

    /// Returns the number of bytes that are left of the memory limit.
    pub(crate) fn room(&self) -> u64 {
        self.limits().memory.map_or(u64::MAX, |most| most.saturating_sub(self.noted().bytes))
    }

    /// Counts bytes that are about to be allocated and retained, and requests them from the memory
    /// ledger.
    ///
    /// # Errors
    /// Returns a message if they exceed the limits, or the memory of the process.
    pub(crate) fn reserve(&self, bytes: u64) -> Result<Grant, String> {
        self.spend(bytes)?;
        pt_memory::ask(bytes)
    }

    /// Counts allocated bytes.
    ///
    /// # Errors
    /// Returns a message if they exceed the limits.
    fn spend(&self, bytes: u64) -> Result<(), String> {
        let mut noted = self.noted();
        noted.bytes = noted.bytes.saturating_add(bytes);
        let most = self.limits().memory.unwrap_or(u64::MAX);
        if noted.bytes <= most {
            return Ok(());
        }
        Err(beyond(most))
    }

    /// Checks that a path does not leave the scene's folder, unless that is allowed.
    ///
    /// # Errors
    /// Returns a message if it does, with the target and the option that allows it.
    pub(crate) fn check_inside(&self, path: &Path) -> Result<(), String> {
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
        self.suggest(Hint::AllowFolder(folder.to_owned()));
        Err(format!(
            "{} leads to {}, which is outside of the scene folder and not allowed",
            path.display(),
            target.display()
        ))
    }

    /// Adds a remedy for a problem, once.
    pub(crate) fn suggest(&self, hint: Hint) {
        let hints = &mut self.noted().hints;
        if !hints.contains(&hint) {
            hints.push(hint);
        }
    }

    fn check_time(&self) -> Result<(), String> {
        match self.limits().time() {
            Some(most) if self.start.elapsed() >= most => Err(out_of_time(most)),
            _ => Ok(()),
        }
    }

    /// Returns an item of the scene, or `None` after recording its error, so that the rest can be
    /// read.
    ///
    /// # Errors
    /// Returns an error if nothing more can be read.
    pub(crate) fn ok_or_report<T>(
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
                // Each shape with a material finds the errors of the material again.
                if noted.reported.insert(error.to_string()) {
                    noted.errors.push(error);
                }
                if noted.errors.len() < Self::MAX_NOTED && noted.failures < MAX_FAILURES {
                    return Ok(None);
                }
                drop(noted);
                ended("too many errors; the rest of the scene is not read".to_owned())
            }
        }
    }

    /// Returns an item of the scene, or `None` after recording its error as a warning that
    /// describes the replacement, which has no other consequences; with [`LoadOptions::strict`], an
    /// error.
    ///
    /// # Errors
    /// Returns errors that are not about the content of the file; with [`LoadOptions::strict`], all
    /// errors.
    pub(crate) fn forgive<T>(
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

    /// Returns true if an error was recorded.
    pub(crate) fn has_errors(&self) -> bool {
        !self.noted().errors.is_empty()
    }

    /// Returns an error that ends the read, since a limit is exceeded.
    pub(crate) fn exceeded(at: Span, message: impl Into<String>) -> LoadError {
        LoadError::Broken { at, message: message.into() }
    }

    /// Records a file to which the scene refers and that cannot be used, with its replacement.
    pub(crate) fn missing(&self, at: Span, message: impl Into<String>) {
        let mut noted = self.noted();
        let missing = Warning { at, message: message.into() };
        if noted.missing.len() < Self::MAX_NOTED && noted.reported.insert(missing.to_string()) {
            noted.missing.push(missing);
        }
    }

    /// Records a warning, without duplicates.
    pub(crate) fn note(&self, at: Span, message: String) {
        let (mut noted, note) = (self.noted(), Warning { at, message });
        if noted.notes.len() < Self::MAX_NOTED && !noted.notes.contains(&note) {
            noted.notes.push(note);
        }
    }

    /// Records that the current material has a texture whose image is missing.
    pub(crate) fn set_placeholder_used(&self) {
        self.noted().placeholder_used = true;
    }

    /// Returns true if [`Self::set_placeholder_used`] was called since the last call of this
    /// function.
    pub(crate) fn take_placeholder_used(&self) -> bool {
        std::mem::take(&mut self.noted().placeholder_used)
    }

    /// Returns the result of the read. With [`LoadOptions::strict`], missing files are errors.
    pub(crate) fn finish(&self, result: Result<Scene, LoadError>) -> LoadResult {
        let Noted { sources, mut errors, missing, notes: of_files, hints, .. } =
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
        LoadResult { scene, missing, notes, hints, sources }
    }

    /// Counts the bytes of the meshes and points of a scene, each once.
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

    /// Returns the sort key of an error: by line, with those of the scene file first.
    fn order(&self, at: Option<&Span>) -> (bool, PathBuf, u32, u32) {
        at.map_or((false, PathBuf::new(), 0, 0), |at| {
            (at.file != self.file, at.file.clone(), at.line, at.column)
        })
    }
}

/// Message about a scene that exceeds the memory limit.
fn beyond(most: u64) -> String {
    format!("the scene exceeds the memory limit of {most} bytes")
}

/// Message about a scene whose read exceeds the time limit.
pub(crate) fn out_of_time(most: Duration) -> String {
    format!("reading exceeds the time limit of {} seconds", most.as_secs())
}

/// Message about a file that cannot be read.
fn unreadable(path: &Path, why: &str) -> String {
    format!("{} cannot be read: {why}", path.display())
}

/// Folder relative to which a scene refers to files.
#[derive(Clone, Debug)]
pub(crate) struct Folder {
    pub(crate) path: PathBuf,
    pub(crate) context: Arc<LoadContext>,
}

impl Folder {
    /// Returns the path of a file in the folder.
    pub(crate) fn join(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}
