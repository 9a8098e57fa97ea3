//! The film that a render keeps beside its image, so that it can go on wherever it was stopped.

use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};

use pt_core::Film;

use crate::film_file::{self, FilmFile, FilmFileError, FilmHeader};
use crate::fingerprint::{self, Difference};

/// What there was when a render began.
#[derive(Debug)]
pub enum ExistingFilm {
    /// Nothing: it begins with its first sample.
    Nothing,
    /// Samples of the same image.
    Samples {
        /// They.
        film: Box<FilmFile>,
        /// Why they are not the newest, if a newer film cannot be read.
        trouble: Option<FilmFileError>,
    },
    /// A finished film of another image, which this render takes the place of.
    Another(Vec<Difference>),
}

/// Why a render cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// There are samples of another image, which would be lost.
    #[error(
        "{}: contains an unfinished render that cannot be resumed because the following changed:{}\n\
         render to another file, or discard the samples with --restart",
        path.display(),
        in_lines(differences)
    )]
    Changed {
        /// The film.
        path: PathBuf,
        /// What has changed.
        differences: Vec<Difference>,
    },
    /// There are some that cannot be read.
    #[error("{0}\nrender to another file, or discard the samples with --restart")]
    Film(FilmFileError),
}

/// Differences, each in a line of its own: "name: before, after now".
pub fn in_lines(differences: &[Difference]) -> String {
    let word = |value: &Option<String>| value.clone().unwrap_or("none".into());
    let line = |(name, before, now): &Difference| {
        format!("\n  {name}: {} before, {} now", word(before), word(now))
    };
    differences.iter().map(line).collect()
}

/// What differs between two films: version, scene and settings. Of files that are missing, their
/// number counts: how they are named depends on where the program runs.
pub fn differences(before: &FilmHeader, now: &FilmHeader) -> Vec<Difference> {
    let version = (before.version != now.version)
        .then(|| ("version".into(), Some(before.version.clone()), Some(now.version.clone())));
    let files = fingerprint::differences(&before.files, &now.files);
    let settings = fingerprint::differences(&before.settings, &now.settings);
    let count = |about: &FilmHeader| Some(about.missing.len().to_string());
    let missing = (before.missing.len() != now.missing.len())
        .then(|| ("missing files".into(), count(before), count(now)));
    version.into_iter().chain(files).chain(settings).chain(missing).collect()
}

/// What keeps samples of a film from being added to another one.
fn of_films(before: &Film, now: &Film) -> Option<Difference> {
    let words = |film: &Film| {
        let groups = film.light_groups().iter().map(String::as_str);
        let kept: Vec<_> = film.aovs().iter().map(|aov| aov.name()).chain(groups).collect();
        let (region, first) = (film.region(), film.first());
        Some(format!("from sample {first}, {region:?}, with {}", kept.join(", ")))
    };
    let (before, now) = (words(before), words(now));
    (before != now).then(|| ("samples".into(), before, now))
}

/// Keeps the film of a render in a file.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    /// The film that is on its way to the disk.
    placing: Option<JoinHandle<Result<(), FilmFileError>>>,
}

impl Checkpoint {
    /// A keeper of this file.
    pub fn new(path: PathBuf) -> Self {
        Self { path, placing: None }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What is there of the image that `about` describes and of which `empty` is a film without
    /// samples. A film that cannot be read makes way for the one before.
    ///
    /// # Errors
    /// If what is there is another image that is not finished, or cannot be read.
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

    /// Writes the film; that the disk has it is waited for in the background.
    ///
    /// # Errors
    /// If it cannot be written, or the one before could not. What was there before is there still.
    pub fn save(&mut self, about: &FilmHeader, film: &Film) -> Result<(), FilmFileError> {
        self.wait()?;
        let written = film_file::write(&self.path, about, film)?;
        self.placing = Some(thread::spawn(|| written.place()));
        Ok(())
    }

    /// Waits until the film that was saved last is on the disk.
    ///
    /// # Errors
    /// If it cannot get there.
    pub fn wait(&mut self) -> Result<(), FilmFileError> {
        let Some(placing) = self.placing.take() else { return Ok(()) };
        placing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }

    /// Removes the film and the one before, which are no longer needed.
    ///
    /// # Errors
    /// If they are there and cannot be removed.
    pub fn forget(&mut self) -> Result<(), FilmFileError> {
        self.wait()?;
        film_file::remove(&self.path)
    }
}
