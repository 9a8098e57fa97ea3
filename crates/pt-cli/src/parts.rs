//! Renders in parts, on several machines: their film at the head, and their command line.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches};
use pathtracer::checkpoint::{Checkpoint, ExistingFilm, in_lines};
use pathtracer::{LoadOptions, Placement, image};

use crate::args::Cli;
use crate::commands::sequence;
use crate::film_commands::CommandError;
use crate::lock::Lock;
use crate::origin::argument;
use crate::output::is_film;
use crate::request::{PreparedRender, Purpose};
use crate::{command_line, config, film_header, message};

/// The film file of a render in parts, which no other process writes.
pub struct FilmKeeper {
    checkpoint: Checkpoint,
    _lock: Lock,
}

impl PreparedRender {
    /// Reads the samples of a film file, if it exists, and keeps the film there. The film is one of
    /// the program: it is beside its image if it is named so (`image.exr.film`), and otherwise
    /// without an image.
    ///
    /// # Errors
    /// If the file has samples of another image, cannot be read, or is locked by another process.
    pub fn keep(&mut self, film: &Path) -> Result<FilmKeeper, CommandError> {
        self.kept(film).map_err(CommandError::from)
    }

    fn kept(&mut self, film: &Path) -> anyhow::Result<FilmKeeper> {
        anyhow::ensure!(
            is_film(film),
            "checkpoint: found {}, expected a file name that ends in .film",
            film.display()
        );
        let image = film.with_extension("");
        let output = if image::is_image(&image) { image.as_path() } else { film };
        let lock = Lock::take(output)?;
        let name = argument(&std::path::absolute(output)?).to_string_lossy().into_owned();
        self.header.command.extend(["-f".to_owned(), name]);
        self.header = film_header::sealed(std::mem::take(&mut self.header), output);
        let checkpoint = Checkpoint::new(film.to_owned());
        match checkpoint.find(&self.header, self.session.film())? {
            ExistingFilm::Nothing => {}
            ExistingFilm::Another(differences) => anyhow::bail!(
                "{}: is the film of another image:{}\nremove it, or choose another name",
                film.display(),
                in_lines(&differences)
            ),
            ExistingFilm::Samples { film, .. } => {
                (self.header.seconds, self.header.rays) = (film.about.seconds, film.about.rays);
                self.header.finished = film.about.finished;
                self.session.go_on_from(film.film);
            }
        }
        Ok(FilmKeeper { checkpoint, _lock: lock })
    }
}

impl FilmKeeper {
    /// Writes the film, and waits for the disk. The previous film is kept beside it until the new
    /// one is complete.
    ///
    /// # Errors
    /// If the film cannot be written; the film on disk is then kept.
    pub fn save(&mut self, render: &PreparedRender) -> Result<(), CommandError> {
        let saved = self.checkpoint.save(&render.header, render.session.film());
        saved
            .and_then(|()| self.checkpoint.wait())
            .map_err(|error| anyhow::Error::new(error).into())
    }
}

/// A command line of the program whose samples are taken on several machines.
pub struct ClusterCommand {
    /// Scene, or `None` for the one of the program.
    pub scene: Option<PathBuf>,
    /// Options of reading it.
    pub load: LoadOptions,
    /// Placement of its camera.
    pub placement: Option<Placement>,
    /// Keywords of [`Purpose::Render`].
    pub keywords: Vec<(String, Vec<String>)>,
    /// The image, or its film alone.
    pub output: PathBuf,
    /// The film, beside the image.
    pub film: PathBuf,
    /// Time between two writes of the film.
    pub checkpoint_every: Duration,
    /// True if existing samples are discarded.
    pub restart: bool,
    /// True if only errors are printed.
    pub quiet: bool,
    /// Arguments without those of time and restart, with which the program writes the image of the
    /// film.
    pub arguments: Vec<String>,
}

/// Resolves the arguments of a render, without the name of the program: the command of one image,
/// or those of all images of a sequence.
///
/// # Errors
/// A message if the arguments are invalid, or have no meaning for several machines.
pub fn cluster_commands(arguments: &[OsString]) -> Result<Vec<ClusterCommand>, String> {
    config::read().map_err(|error| format!("{error:#}"))?;
    let words: Vec<_> = arguments.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    let (_, cli) = parsed(&words)?;
    if !cli.sequence.is_requested() {
        return Ok(vec![command(&words)?]);
    }
    let images = sequence::commands(&cli, &words).map_err(|error| message::of_error(&error))?;
    images.iter().map(|words| command(words)).collect()
}

fn parsed(words: &[String]) -> Result<(ArgMatches, Cli), String> {
    let words = std::iter::once("pathtracer").chain(words.iter().map(String::as_str));
    let parsed = Cli::command().try_get_matches_from(words).and_then(|matches| {
        let cli = Cli::from_arg_matches(&matches)?;
        Ok((matches, cli))
    });
    parsed.map_err(|error| message::of_parser(&error))
}

/// Command of an image.
fn command(words: &[String]) -> Result<ClusterCommand, String> {
    let (matches, cli) = parsed(words)?;
    let command = Cli::command();
    let given = |id: &str| {
        matches!(matches.value_source(id), Some(ValueSource::CommandLine))
            .then(|| matches.get_raw(id).into_iter().flatten().collect::<Vec<_>>())
    };
    for (id, option) in
        [("samples", "--samples"), ("cs184", "--cs184"), ("max_memory", "--max-memory")]
    {
        if given(id).is_some() {
            return Err(format!("{option} is not supported on several machines"));
        }
    }
    if cli.completions.is_some() || cli.man {
        return Err("--completions and --man belong to the program on one machine".into());
    }
    let mut keywords = Vec::new();
    for arg in command.get_arguments().filter(|arg| Purpose::Render.applies(arg)) {
        let Some(values) = given(arg.get_id().as_str()) else { continue };
        let name = arg.get_long().unwrap_or_default().replace('-', "_");
        let is_flag = !arg.get_action().takes_values();
        let values = values.into_iter().filter(|_| !is_flag);
        keywords.push((name, values.map(|v| v.to_string_lossy().into_owned()).collect()));
    }
    let (restart, placement) = (cli.restart, cli.loading.placement());
    let mut job = command_line::resolved(cli, Vec::new())?;
    if job.input.camera_file.is_some() && !keywords.iter().any(|(name, _)| name == "camera_file") {
        return Err("--camera FILE is written -c FILE on several machines".into());
    }
    let Some(checkpoint_every) = job.schedule.checkpoint_every else {
        return Err("--checkpoint-every: found 0, expected a time above 0: the image is written \
                    from the film"
            .into());
    };
    let output = job.output.path;
    let film = if is_film(&output) {
        output.clone()
    } else {
        pathtracer::film_file::film_of_image(&output)
    };
    let load = std::mem::take(&mut job.input.load);
    Ok(ClusterCommand {
        scene: job.input.scene,
        load,
        placement,
        keywords,
        output,
        film,
        checkpoint_every,
        restart,
        quiet: job.mode.quiet,
        arguments: without_time(words),
    })
}

/// The arguments without a time limit and without a restart.
fn without_time(words: &[String]) -> Vec<String> {
    let mut all = Vec::new();
    let mut words = words.iter().cloned();
    while let Some(word) = words.next() {
        if word == "--time-limit" {
            words.next();
        } else if word != "--restart" && !word.starts_with("--time-limit=") {
            all.push(word);
        }
    }
    all
}
