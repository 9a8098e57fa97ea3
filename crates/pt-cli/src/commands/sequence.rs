//! Renders of several images of a scene, with other cameras or at other frames. Each image is that
//! of a command of its own, which is stored with it; the scene is compiled once for all cameras.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, anyhow, bail, ensure};
use pathtracer::checkpoint::differences;
use pathtracer::film_file::FilmHeader;
use pathtracer::provenance::Provenance;
use pathtracer::{Observer, Outcome, camera_index, image};

use super::render::{self, ImageJob, ImageResult, PreparedScene};
use crate::args::Cli;
use crate::command_line;
use crate::console::{Console, Monitor};
use crate::job::{Mode, RenderJob};
use crate::limits::Limit;
use crate::lock::Lock;
use crate::output::Output;
use crate::sequence_args::SequenceArgs;
use crate::{output_pattern, views};

/// Choice by which an image differs from the others.
enum Choice {
    /// Camera of the scene, by name or number.
    Camera(String),
    /// View of a file.
    View(PathBuf),
    /// Time in seconds.
    Time(f64),
}

/// An image of a sequence, as the command line of its own.
struct SequenceImage {
    cli: Cli,
    command: Vec<String>,
}

/// Arguments of the command of each image of a sequence.
///
/// # Errors
/// If a file cannot be read, or a scene or an option is invalid.
pub(crate) fn commands(cli: &Cli, words: &[String]) -> Result<Vec<Vec<String>>> {
    let choices = choices(cli, &mut None, Instant::now())?;
    Ok(images(cli, words, choices)?.into_iter().map(|image| image.command).collect())
}

/// Renders the images of a command line; those that are finished are kept.
///
/// # Errors
/// If a file cannot be read or written, or a scene or an option is invalid.
pub(crate) fn run(cli: &Cli, words: &[String]) -> Result<ExitCode> {
    let start = Instant::now();
    let mut prepared = None;
    let choices = choices(cli, &mut prepared, start)?;
    let count = choices.len();
    let images = images(cli, words, choices)?;
    let (mut console, mut kept, mut status) = (None, 0, 0);
    let [first, last] = [images.first(), images.last()].map(path_of);
    for (number, image) in images.into_iter().enumerate() {
        let mut job =
            command_line::resolved(image.cli, image.command).map_err(anyhow::Error::msg)?;
        let quiet = std::mem::replace(&mut job.mode.quiet, true);
        let of_image = Sequence { start, quiet, rest: count - number - 1 };
        let done = of_image.render(job, &mut prepared, &mut console)?;
        match done {
            None => kept += 1,
            Some(result) if result.progress == Outcome::Cancelled => {
                if let Some(console) = &console {
                    console.finish(result.progress);
                }
                let is_interrupted = console.as_ref().is_some_and(Observer::cancelled);
                let cause = if is_interrupted { "stopped early" } else { "time limit reached" };
                report!(
                    "{cause}, at image {} of {count}\nhelp: the same command continues the sequence",
                    number + 1
                );
                return Ok(result.status.into());
            }
            Some(result) => status = status.max(result.status),
        }
    }
    if let Some(console) = &console {
        console.finish(Outcome::Finished);
    }
    if !cli.quiet {
        let skipped = match kept {
            0 => String::new(),
            1 => "; one was finished before".into(),
            n => format!("; {n} were finished before"),
        };
        report!("saved {count} images, {} to {}{skipped}", first.display(), last.display());
    }
    if let Some(prepared) = &prepared {
        render::warn_incomplete(&prepared.scene);
    }
    Ok(status.into())
}

fn path_of(image: Option<&SequenceImage>) -> PathBuf {
    image.and_then(|image| image.cli.output.clone().flatten()).unwrap_or_default()
}

/// State of a sequence.
struct Sequence {
    start: Instant,
    quiet: bool,
    /// Number of images after this one.
    rest: usize,
}

impl Sequence {
    /// Renders an image; `None` if it is finished already.
    fn render(
        &self,
        job: RenderJob,
        prepared: &mut Option<PreparedScene>,
        console: &mut Option<Console>,
    ) -> Result<Option<ImageResult>> {
        let RenderJob { mode, input, compile, memory, schedule, output, display, command } = job;
        let output = Output::new(output, mode, schedule.threads)?;
        let _lock = Lock::take(output.path())?;
        let (limit, is_crop) = (Limit::new(memory), compile.crop.is_some());
        let is_first = console.is_none();
        let reused = match prepared.take() {
            Some(earlier) => render::with_camera(earlier, &input, &compile, mode)?,
            None => None,
        };
        let mut scene = if let Some(scene) = reused {
            scene
        } else {
            limit.check_files()?;
            render::prepare(&input, compile, &limit, mode, self.start)?
        };
        if is_first {
            render::warn_missing(&scene.scene.missing);
            scene.report_notes(Mode { quiet: self.quiet, ..mode });
        }
        let header = scene.film_header(&input, output.path(), command);
        let is_kept = !schedule.restart && is_finished(output.path(), &header);
        let mode_of_all = Mode { quiet: self.quiet, ..mode };
        let console = console.get_or_insert_with(|| Console::new(&display, mode_of_all));
        console.set_rest(self.rest);
        let result = if is_kept {
            None
        } else {
            let schedule = &schedule;
            let image =
                ImageJob { mode, schedule, output: &output, header, is_crop, is_alone: false };
            Some(render::render_image(image, &mut scene, console, self.start)?)
        };
        *prepared = Some(scene);
        Ok(result)
    }
}

/// Returns true if a file is a finished image of the same command, files and settings.
fn is_finished(path: &Path, header: &FilmHeader) -> bool {
    let metadata = path.is_file().then(|| image::metadata(path).ok()).flatten();
    let found = metadata.and_then(|metadata| Provenance::find(&metadata).ok()).flatten();
    found.is_some_and(|found| {
        let is_same_command = found.run.as_ref().is_some_and(|run| run.command == header.command);
        is_same_command
            && found.finished
            && found.spp == header.spp
            && differences(&found.about(), header).is_empty()
    })
}

/// Choices of the images, with their numbers. The cameras of a scene are known once it is read.
fn choices(
    cli: &Cli,
    prepared: &mut Option<PreparedScene>,
    start: Instant,
) -> Result<Vec<(u32, Choice)>> {
    if let Some(frames) = cli.sequence.frames {
        let at = |frame| (frame, Choice::Time(cli.sequence.time_of(frame)));
        return Ok(frames.numbers().map(at).collect());
    }
    let Some(cameras) = &cli.sequence.cameras else { return Ok(Vec::new()) };
    let path = Path::new(cameras);
    if views::split(path, None).0.is_file() {
        let (file, numbers) = views::numbers(path)?;
        let view = |number| {
            let mut path = file.clone().into_os_string();
            path.push(format!("#{number}"));
            (number, Choice::View(path.into()))
        };
        return Ok(numbers.into_iter().map(view).collect());
    }
    ensure!(
        !cli.paths.is_empty(),
        "--cameras {cameras}: the embedded scene has one camera; expected a file of views, or a \
         scene"
    );
    let scene = first_camera(cli, start)?;
    let names: Vec<_> = scene.scene.cameras.iter().map(|camera| camera.name.clone()).collect();
    *prepared = Some(scene);
    let number_of = |i: usize| {
        let number = i.to_string();
        let other = names.iter().position(|name| *name == number).filter(|other| *other != i);
        if other.is_some() { names[i].clone() } else { number }
    };
    let wanted: Vec<_> = match cameras.as_str() {
        "all" => (0..names.len()).map(number_of).collect(),
        list => list.split(',').map(|name| name.trim().to_owned()).collect(),
    };
    let listed: Vec<_> = names.iter().map(String::as_str).collect();
    for name in &wanted {
        camera_index(name, &listed).map_err(|message| anyhow!("--cameras {cameras}: {message}"))?;
    }
    Ok((0..).zip(wanted.into_iter().map(Choice::Camera)).collect())
}

/// Compiles the scene with its first camera.
fn first_camera(cli: &Cli, start: Instant) -> Result<PreparedScene> {
    let mut cli = cli.clone();
    cli.sequence = SequenceArgs::default();
    cli.loading.camera = Some("0".into());
    let job = command_line::resolved(cli, Vec::new()).map_err(anyhow::Error::msg)?;
    let limit = Limit::new(job.memory);
    limit.check_files()?;
    let mode = Mode { quiet: true, ..job.mode };
    render::prepare(&job.input, job.compile, &limit, mode, start)
}

/// Command lines of the images.
fn images(cli: &Cli, words: &[String], choices: Vec<(u32, Choice)>) -> Result<Vec<SequenceImage>> {
    let pattern = match &cli.output {
        Some(Some(path)) => path.clone(),
        Some(None) => bail!("missing value of -f; give a name such as -f out_%04d.png"),
        None => {
            let stem = cli.paths.first().and_then(|path| path.file_stem());
            let stem = stem.unwrap_or("cornell".as_ref()).to_string_lossy();
            format!("{stem}_%04d.png").into()
        }
    };
    let is_single = choices.len() == 1;
    let image = |(number, choice): (u32, Choice)| {
        let path = match output_pattern::numbered(&pattern, number) {
            Some(path) => path,
            None if is_single => pattern.clone(),
            None => bail!(
                "-f {}: expected a place for the number of the image, as in out_%04d.png",
                pattern.display()
            ),
        };
        let mut one = cli.clone();
        one.sequence = SequenceArgs::default();
        one.output = Some(Some(path.clone()));
        let mut command = output_pattern::without_options(words, &pattern, &path);
        command.push(match choice {
            Choice::Camera(name) => {
                let word = format!("--camera={name}");
                one.loading.camera = Some(name);
                word
            }
            Choice::View(file) => {
                let word = format!("--camera-file={}", file.display());
                one.camera_file = Some(file);
                word
            }
            Choice::Time(time) => {
                one.loading.time = Some(time);
                format!("--time={time}")
            }
        });
        Ok(SequenceImage { cli: one, command })
    };
    choices.into_iter().map(image).collect()
}
