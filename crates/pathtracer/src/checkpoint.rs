//! Checkpoints: the film that is written beside an image, and from which a stopped render resumes.

use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};

use pt_core::Film;

use crate::film_file::{self, FilmFile, FilmFileError, FilmHeader};
use crate::fingerprint::{self, FingerprintDifference};

/// Film found when a render begins.
#[derive(Debug)]
pub enum ExistingFilm {
    /// No film: the render begins with its first sample.
    Nothing,
    /// Samples of the same image.
    Samples {
        /// The film with the samples.
        film: Box<FilmFile>,
        /// Error of the newest film, if it cannot be read and this is the previous one.
        trouble: Option<FilmFileError>,
    },
    /// A finished film of another image, which this render replaces; with the differences.
    Another(Vec<FingerprintDifference>),
}

/// Reasons for which a render cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Samples of another image exist, and would be lost.
    #[error(
        "{}: contains an unfinished render that cannot be resumed because the following changed:{}",
        path.display(),
        in_lines(differences)
    )]
    Changed {
        /// The film.
        path: PathBuf,
        /// Differences between the film and the render.
        differences: Vec<FingerprintDifference>,
    },
    /// Samples exist that cannot be read.
    #[error(transparent)]
    Film(FilmFileError),
}

/// Formats differences, one per line: `NAME: BEFORE before, NOW now`.
pub fn in_lines(differences: &[FingerprintDifference]) -> String {
    let word = |value: &Option<String>| value.clone().unwrap_or("none".into());
    let line = |(name, before, now): &FingerprintDifference| {
        format!("\n  {name}: {} before, {} now", word(before), word(now))
    };
    differences.iter().map(line).collect()
}

/// Compares two films: version, scene and settings. Missing files are compared by their number,
/// since their messages depend on the folder in which the program runs.
pub fn differences(before: &FilmHeader, now: &FilmHeader) -> Vec<FingerprintDifference> {
    let version = (before.version != now.version)
        .then(|| ("version".into(), Some(before.version.clone()), Some(now.version.clone())));
    let files = fingerprint::differences(&before.files, &now.files);
    let settings = fingerprint::differences(&before.settings, &now.settings);
    let count = |about: &FilmHeader| Some(about.missing.len().to_string());
    let missing = (before.missing.len() != now.missing.len())
        .then(|| ("missing files".into(), count(before), count(now)));
    version.into_iter().chain(files).chain(settings).chain(missing).collect()
}

/// Difference of first sample, region and channels, which prevents adding the samples of one film
/// to another.
fn of_films(before: &Film, now: &Film) -> Option<FingerprintDifference> {
    let words = |film: &Film| {
        let groups = film.light_groups().iter().map(String::as_str);
        let kept: Vec<_> = film.aovs().iter().map(|aov| aov.name()).chain(groups).collect();
        let (region, first) = (film.region(), film.first());
        Some(format!("from sample {first}, {region:?}, with {}", kept.join(", ")))
    };
    let (before, now) = (words(before), words(now));
    (before != now).then(|| ("samples".into(), before, now))
}

/// Writer of the film of a render.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    /// Thread that waits for the disk and then renames the last film.
    placing: Option<JoinHandle<Result<(), FilmFileError>>>,
}

impl Checkpoint {
    /// Creates a writer of this file.
    pub fn new(path: PathBuf) -> Self {
        Self { path, placing: None }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Finds existing samples of the image that `about` describes; `empty` is a film of this image
    /// without samples. If the newest film cannot be read, the previous one takes its place.
    ///
    /// # Errors
    /// If the existing film is an unfinished one of another image, or cannot be read.
    pub fn find(&self, about: &FilmHeader, empty: &Film) -> Result<ExistingFilm, CheckpointError> {
        let Some((film, trouble)) =
            film_file::read_newest(&self.path).map_err(CheckpointError::Film)?
        else {
            return Ok(ExistingFilm::Nothing);
        };
        if trouble.is_some() {
            film_file::restore(&self.path).map_err(CheckpointError::Film)?;
        }
        let mut differences = differences(&film.about, about);
        differences.extend(of_films(&film.film, empty));
        let (most, wanted) = (film.film.first() + film.film.max_samples(), about.spp);
        if most > wanted {
            let samples = |n: u32| Some(n.to_string());
            differences.push(("samples per pixel".into(), samples(most), samples(wanted)));
        }
        if differences.is_empty() {
            return Ok(ExistingFilm::Samples { film: Box::new(film), trouble });
        }
        if film.about.finished {
            return Ok(ExistingFilm::Another(differences));
        }
        Err(CheckpointError::Changed { path: self.path.clone(), differences })
    }

    /// Writes the film; a thread in the background waits for the disk.
    ///
    /// # Errors
    /// If this film or the previous one cannot be written; the film on disk is then kept.
    pub fn save(&mut self, about: &FilmHeader, film: &Film) -> Result<(), FilmFileError> {
        self.wait()?;
        let written = film_file::write(&self.path, about, film)?;
        self.placing = Some(thread::spawn(|| written.place()));
        Ok(())
    }

    /// Waits until the film that was saved last is on the disk.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn wait(&mut self) -> Result<(), FilmFileError> {
        let Some(placing) = self.placing.take() else { return Ok(()) };
        placing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }

    /// Removes the film and the previous one.
    ///
    /// # Errors
    /// If they exist and cannot be removed.
    pub fn forget(&mut self) -> Result<(), FilmFileError> {
        self.wait()?;
        film_file::remove(&self.path)
    }
}
