//! Rendering with checkpoints: resumes from stored samples, and writes the samples periodically.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use pathtracer::checkpoint::{Checkpoint, ExistingFilm, differences, in_lines};
use pathtracer::film_file::{FilmHeader, film_of_image};
use pathtracer::provenance::Provenance;
use pathtracer::{Film, Observer, Outcome, ProgressUpdate, RenderStatistics, Session};

use crate::console::Monitor;
use crate::job::{Mode, Schedule};
use crate::output::{Output, is_film};
use crate::provenance::provenance;
use crate::tev::{self, Viewer};

/// A render and its checkpoint.
pub(crate) struct Checkpointer {
    /// `None` if no film is written.
    keeper: Option<Checkpoint>,
    /// Metadata of the film and the image.
    about: FilmHeader,
    threads: usize,
    tile_size: u32,
    /// Time between two checkpoints; `None` if none are written periodically.
    every: Option<Duration>,
    /// Time at which the render stops, if that is limited.
    deadline: Option<Instant>,
    /// Rays and time of earlier runs.
    earlier: RenderStatistics,
}

impl Checkpointer {
    /// Reads existing samples into the session, if there are any, and prepares the checkpoints.
    ///
    /// # Errors
    /// If existing samples of another image would be lost, or existing samples cannot be read.
    pub(crate) fn begin(
        schedule: &Schedule,
        mode: Mode,
        session: &mut Session,
        about: FilmHeader,
        image: &Path,
        start: Instant,
    ) -> Result<Self> {
        if schedule.first > 0 {
            session.start_at(schedule.first);
        }
        let mut this = Self {
            keeper: None,
            about,
            threads: schedule.threads,
            tile_size: schedule.tile_size,
            every: schedule.checkpoint_every,
            deadline: schedule.time_limit.and_then(|limit| start.checked_add(limit)),
            earlier: RenderStatistics::default(),
        };
        this.check_same(schedule.expected.as_deref())?;
        if !mode.policies.films {
            return Ok(this);
        }
        let path = if is_film(image) {
            Some(image.to_owned())
        } else {
            this.every.map(|_| film_of_image(image))
        };
        let Some(path) = path else { return Ok(this) };
        let keeper = Checkpoint::new(path);
        let found = if schedule.restart {
            ExistingFilm::Nothing
        } else {
            keeper.find(&this.about, session.film())?
        };
        let say = |text: String| {
            if !mode.quiet {
                report!("note: {text}");
            }
        };
        match found {
            ExistingFilm::Nothing => {}
            ExistingFilm::Another(differences) if schedule.resumes => bail!(
                "{}: cannot be resumed because the following changed:{}\nrestore that, or render \
                 to another file",
                keeper.path().display(),
                in_lines(&differences)
            ),
            ExistingFilm::Another(differences) => say(format!(
                "{}: replaces the finished samples of another image:{}",
                keeper.path().display(),
                in_lines(&differences)
            )),
            ExistingFilm::Samples { film, trouble } => {
                if let Some(trouble) = trouble {
                    report!("warning: {trouble}\n  the previous film is used");
                }
                let taken = film.film.samples() as f64 / film.film.region().area() as f64;
                say(format!(
                    "{}: resumes at {taken:.1} samples per pixel",
                    keeper.path().display()
                ));
                this.earlier.rays = film.about.rays;
                this.earlier.time = Duration::from_secs_f64(film.about.seconds);
                session.go_on_from(film.film);
            }
        }
        this.keeper = Some(keeper);
        Ok(this)
    }

    /// Returns an error if this render differs from the image that is to be rendered again.
    fn check_same(&self, expected: Option<&Provenance>) -> Result<()> {
        let Some(receipt) = expected else { return Ok(()) };
        let differences = differences(&receipt.about(), &self.about);
        ensure!(
            differences.is_empty(),
            "cannot reproduce the image because the following changed:{}",
            in_lines(&differences)
        );
        Ok(())
    }

    /// Returns true if a film is written from which the render can be resumed.
    pub(crate) fn keeps(&self) -> bool {
        self.keeper.is_some()
    }

    /// Takes the missing samples, writes the film at intervals, and sends the image to the viewer.
    /// An interval is at least [`MIN_WORK`] times as long as its write. A film that cannot be
    /// written is reported as a warning, and the render continues.
    ///
    /// # Errors
    /// As [`Session::render`].
    pub(crate) fn render(
        &mut self,
        session: &mut Session,
        console: &dyn Monitor,
        viewer: &mut Option<Viewer>,
    ) -> Result<(Outcome, RenderStatistics)> {
        let mut all = RenderStatistics::default();
        let mut film = self.every.filter(|_| self.keeper.is_some()).map(Interval::new);
        let mut view = viewer.is_some().then(|| Interval::new(tev::EVERY));
        if let Some(warning) = viewer.as_mut().and_then(|viewer| viewer.show(session.image())) {
            console.say(&format!("warning: {warning}"));
        }
        loop {
            let turns = [&film, &view].into_iter().flatten();
            let pause = turns.map(|turn| turn.next).chain(self.deadline).min();
            let observer = Deadline { console, pause, rays: all.rays };
            let (progress, part) = session.render(self.threads, self.tile_size, &observer)?;
            all.samples += part.samples;
            all.rays += part.rays;
            all.tests += part.tests;
            all.time += part.time;
            let is_over = self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
            if progress == Outcome::Finished || is_over || console.cancelled() {
                self.show(&all, progress == Outcome::Finished);
                return Ok((progress, all));
            }
            self.show(&all, false);
            if let Some(turn) = film.as_mut().filter(|turn| turn.is_due()) {
                let saved = turn.take(|| self.save(session.film()));
                if let Err(error) = saved {
                    console.say(&format!("warning: {error:#}; the render continues"));
                }
            }
            if let (Some(turn), Some(viewer)) =
                (view.as_mut().filter(|turn| turn.is_due()), &mut *viewer)
            {
                let warning = turn.take(|| viewer.show(session.image()));
                if let Some(warning) = warning {
                    console.say(&format!("warning: {warning}"));
                    view = None;
                }
            }
        }
    }

    fn show(&mut self, all: &RenderStatistics, finished: bool) {
        self.about.finished = finished;
        self.about.rays = self.earlier.rays + all.rays;
        self.about.seconds = (self.earlier.time + all.time).as_secs_f64();
    }

    fn save(&mut self, film: &Film) -> Result<()> {
        match &mut self.keeper {
            Some(keeper) => Ok(keeper.save(&self.about, film)?),
            None => Ok(()),
        }
    }

    /// Writes the film and the image. The film of a finished image is kept if the image is an EXR
    /// file. Returns the files, and the provenance of the image.
    ///
    /// # Errors
    /// If a file cannot be written; the others are written nonetheless.
    pub(crate) fn finish(
        &mut self,
        session: &Session,
        output: &Output,
        progress: Outcome,
    ) -> Result<(Vec<PathBuf>, Provenance)> {
        let is_part = output.is_film();
        let keeps = progress == Outcome::Cancelled || is_kept(output.path());
        if let Some(Err(error)) = self.keeper.as_mut().map(Checkpoint::wait) {
            report!("warning: {error}");
        }
        let saved = if keeps {
            let saved = self.save(session.film());
            saved.and_then(|()| self.keeper.as_mut().map_or(Ok(()), |keeper| Ok(keeper.wait()?)))
        } else {
            Ok(())
        };
        let receipt = provenance(&self.about, session, self.threads);
        let mut files = if is_part { Vec::new() } else { output.write(session, &receipt)? };
        saved.context(if is_part {
            "the samples are lost"
        } else {
            "the image is written, but not its samples"
        })?;
        match &mut self.keeper {
            Some(keeper) if keeps => files.push(keeper.path().to_owned()),
            Some(keeper) => keeper.forget()?,
            None => {}
        }
        Ok((files, receipt))
    }
}

/// Minimum time between two writes of a film, as a multiple of the duration of a write.
const MIN_WORK: u32 = 100;

/// A periodic task.
struct Interval {
    every: Duration,
    next: Instant,
}

impl Interval {
    fn new(every: Duration) -> Self {
        Self { every, next: Instant::now() + every }
    }

    fn is_due(&self) -> bool {
        Instant::now() >= self.next
    }

    /// Runs the task; a slow task is run less often.
    fn take<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        self.next = Instant::now() + self.every.max(MIN_WORK * start.elapsed());
        done
    }
}

/// Returns true if the film of a finished image is kept.
fn is_kept(image: &Path) -> bool {
    let ending = image.extension().unwrap_or_default();
    ending.eq_ignore_ascii_case("exr") || is_film(image)
}

/// Observer that cancels the render at Ctrl-C or at a point in time.
struct Deadline<'a> {
    console: &'a dyn Monitor,
    pause: Option<Instant>,
    /// Rays of the earlier parts of the render.
    rays: u64,
}

impl Observer for Deadline<'_> {
    fn progress(&self, advance: &ProgressUpdate) {
        self.console.progress(&ProgressUpdate { rays: self.rays + advance.rays, ..*advance });
    }

    fn cancelled(&self) -> bool {
        self.console.cancelled() || self.pause.is_some_and(|pause| Instant::now() >= pause)
    }
}
