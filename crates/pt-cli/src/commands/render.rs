//! `pathtracer render`, the default command: renders a scene to an image.

use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use pathtracer::film_file::FilmHeader;
use pathtracer::image::{self, Image, Transfer};
use pathtracer::provenance::Provenance;
use pathtracer::{
    CompileOptions, CompiledScene, EnvironmentMap, Hint, INTEGRATORS, Observer, Outcome, Region,
    Registration, RenderHints, Scene, Session, Settings, SourceFile, Warning, camera_file,
};

use crate::checkpointing::Checkpointer;
use crate::compat::WITHOUT_RECORDS;
use crate::console::{Console, Monitor, Unseen};
use crate::film_header::{self, film_header};
use crate::job::{CompileJob, EnvironmentFile, InputFiles, Mode, RenderJob, Schedule};
use crate::limits::Limit;
use crate::lock::Lock;
use crate::message::WithHints;
use crate::output::Output;
use crate::resolve::check_estimator;
use crate::summary::{Summary, cpu_seconds};
use crate::{crop, hints, limits, summary, views};

/// Exit status of a render that Ctrl-C ended, by the convention of shells: 128 + SIGINT.
const INTERRUPTED: u8 = 130;

/// Exit status of a render with `--strict` that had invalid samples, or missed its error target.
const NOT_AS_ASKED: u8 = 3;

/// Exit status of a render of a scene with missing files.
pub(crate) const MISSING: u8 = 4;

/// Maximum number of missing files that are listed.
const MAX_NAMED: usize = 100;

/// Result of a render.
pub(crate) struct RenderResult {
    /// Exit status.
    pub(crate) status: u8,
    pub(crate) progress: Outcome,
    pub(crate) session: Session,
    /// Provenance metadata of the image.
    pub(crate) provenance: Provenance,
}

/// Renders an image, writes it, and returns the exit status.
///
/// # Errors
/// As [`render`].
pub(crate) fn run(job: RenderJob) -> Result<ExitCode> {
    Ok(render(job, None)?.status.into())
}

/// Renders an image, and writes it. With an observer, progress is not shown, and Ctrl-C is not
/// handled.
///
/// # Errors
/// If a file cannot be read or written, or a scene is invalid.
pub(crate) fn render(job: RenderJob, observer: Option<&dyn Observer>) -> Result<RenderResult> {
    let RenderJob { mode, input, compile, memory, schedule, output, display, command } = job;
    let output = Output::new(output, mode, schedule.threads)?;
    let _lock = Lock::take(output.path())?;
    let start = Instant::now();
    let limit = Limit::new(memory);
    limit.check_files()?;
    let is_crop = compile.crop.is_some();
    let mut prepared = prepare(&input, compile, &limit, mode, start)?;
    warn_missing(&prepared.scene.missing);
    prepared.report_notes(mode);
    let header = prepared.film_header(&input, output.path(), command);
    let console: Box<dyn Monitor> = match observer {
        Some(observer) => Box::new(Unseen(observer)),
        None => Box::new(Console::new(&display, mode)),
    };
    let image =
        ImageJob { mode, schedule: &schedule, output: &output, header, is_crop, is_alone: true };
    let ImageResult { status, progress, provenance } =
        render_image(image, &mut prepared, &*console, start)?;
    if mode.lines().is_none() && !mode.quiet && input.scene.is_none() {
        next_steps();
    }
    Ok(RenderResult { status, progress, session: prepared.session, provenance })
}

/// Result of the render of one image of a compiled scene.
pub(crate) struct ImageResult {
    /// Exit status.
    pub(crate) status: u8,
    pub(crate) progress: Outcome,
    provenance: Provenance,
}

/// An image of a scene that is compiled.
pub(crate) struct ImageJob<'a> {
    pub(crate) mode: Mode,
    pub(crate) schedule: &'a Schedule,
    pub(crate) output: &'a Output,
    pub(crate) header: FilmHeader,
    /// True if only a rectangle of the image is rendered by request.
    pub(crate) is_crop: bool,
    /// False for an image of a sequence, which reports the end of the render itself.
    pub(crate) is_alone: bool,
}

/// Renders an image of a compiled scene, and writes it. The time limit is counted from `start`.
///
/// # Errors
/// If a file cannot be read or written.
pub(crate) fn render_image(
    ImageJob { mode, schedule, output, header, is_crop, is_alone }: ImageJob<'_>,
    prepared: &mut PreparedScene,
    console: &dyn Monitor,
    start: Instant,
) -> Result<ImageResult> {
    let PreparedScene { scene, session, load, .. } = prepared;
    let words = header.command.clone();
    let mut checkpointing =
        Checkpointer::begin(schedule, mode, session, header, output.path(), start)?;
    if let Some(lines) = mode.lines() {
        (lines.built)(session, schedule.threads);
    }
    limits::begin_rendering();
    console.begin_image(session.film().samples(), total(session));
    let cpu = cpu_seconds();
    let mut viewer = output.connect();
    let (progress, statistics) = checkpointing.render(session, console, &mut viewer)?;
    let cpu = cpu_seconds().zip(cpu).map(|(after, before)| after - before);
    if is_alone {
        console.finish(progress);
    } else {
        console.end_image(session.film().samples());
    }
    report_invalid_samples(&words, mode, session);
    if let Some(lines) = mode.lines() {
        (lines.rendered)(&statistics);
    }
    let (files, provenance) = checkpointing.finish(session, output, progress)?;
    if let Some(warning) = viewer.and_then(|viewer| viewer.finish(session.image())) {
        report!("warning: {warning}");
    }
    let summary = Summary {
        session,
        statistics,
        progress,
        threads: schedule.threads,
        missing: scene.missing.len(),
        load: *load,
        cpu,
    };
    if let Some(path) = output.summary_json() {
        summary.write_json(path)?;
    }
    if let Some(lines) = mode.lines() {
        (lines.saved)(output.path(), is_crop);
    } else if !mode.quiet {
        summary.print();
        let names: Vec<_> = files.iter().map(|f| f.display().to_string()).collect();
        report!("saved {}", names.join(" and "));
    }
    if is_alone {
        warn_incomplete(scene);
    }
    if !mode.quiet {
        output.report_extremes(session);
    }
    let is_interrupted = progress == Outcome::Cancelled && console.cancelled();
    let resumable = checkpointing.keeps().then(|| output.path());
    if is_interrupted && is_alone {
        report_stop("stopped early", resumable);
    }
    let status =
        if is_interrupted { INTERRUPTED } else { ended(scene, session, progress, mode, resumable) };
    Ok(ImageResult { status, progress, provenance })
}

/// Exit status of a render that was not interrupted, after warnings about what it misses.
fn ended(
    scene: &Scene,
    session: &Session,
    progress: Outcome,
    mode: Mode,
    resumable: Option<&Path>,
) -> u8 {
    let out_of_time = progress == Outcome::Cancelled;
    let is_missed = report_missed_target(session, out_of_time);
    if out_of_time && !mode.quiet {
        report_stop("time limit reached", resumable);
    }
    if mode.strict && (is_missed || session.film().invalid_samples().count() > 0) {
        NOT_AS_ASKED
    } else if scene.missing.is_empty() {
        0
    } else {
        MISSING
    }
}

/// Reports that the image lacks samples, and the command that continues the render.
fn report_stop(cause: &str, resumable: Option<&Path>) {
    report!("{cause}: the image contains the samples taken so far");
    if let Some(path) = resumable {
        report!("help: pathtracer resume {} continues the render", path.display());
    }
}

/// Prints a warning if the error target was missed, and returns true if it was.
fn report_missed_target(session: &Session, out_of_time: bool) -> bool {
    let is_missed = summary::is_missed(session);
    if is_missed {
        let found = summary::error(session).unwrap_or("too few samples for an estimate".into());
        let cause = if out_of_time {
            "time limit reached".to_owned()
        } else {
            format!("all {} samples of --max-spp were taken", session.settings().spp)
        };
        report!("warning: the error target was missed: {found}; {cause}");
    }
    is_missed
}

/// A scene that is ready to be rendered.
pub(crate) struct PreparedScene {
    pub(crate) scene: Scene,
    pub(crate) session: Session,
    /// The files that were read, besides those of the camera.
    sources: Vec<SourceFile>,
    /// The files of the camera.
    camera_sources: Vec<SourceFile>,
    /// True if the scene file requests channels for which the image has no room.
    leaves_channels_out: bool,
    /// Remedies for what the reader found.
    hints: Vec<Hint>,
    /// Wall-clock time of reading files.
    load: Duration,
}

impl PreparedScene {
    /// Header of the film of the image at `path`.
    pub(crate) fn film_header(
        &self,
        input: &InputFiles,
        path: &Path,
        command: Vec<String>,
    ) -> FilmHeader {
        let Self { scene, session, sources, camera_sources, .. } = self;
        let sources: Vec<_> = sources.iter().chain(camera_sources).cloned().collect();
        let header = film_header(input, session, &sources, &scene.missing, command);
        film_header::sealed(header, path)
    }

    /// Prints the warnings and notes of a scene.
    pub(crate) fn report_notes(&self, mode: Mode) {
        if mode.quiet {
            return;
        }
        for warning in &self.scene.warnings {
            report!("note: {warning}");
        }
        if self.leaves_channels_out {
            let channels = self.scene.settings.aovs.join(", ");
            report!(
                "note: the additional channels {channels} of the scene are omitted without -f \
                 out.exr"
            );
        }
        for note in self.session.notes() {
            report!("note: {note}");
        }
        hints::report(self.hints.iter().chain(self.session.hints()));
        hints::report_memory();
    }
}

/// Reads and compiles a scene.
///
/// # Errors
/// If a file cannot be read, or a scene is invalid.
pub(crate) fn prepare(
    input: &InputFiles,
    CompileJob { options, crop, settings }: CompileJob,
    limit: &Limit,
    mode: Mode,
    start: Instant,
) -> Result<PreparedScene> {
    let mut sources = Vec::new();
    let environment = load_environment(input, mode, &mut sources)?;
    let (scene, hints) = load_scene(input, mode, &mut sources)?;
    limit.check_scene(&scene)?;
    let load = start.elapsed();
    let leaves_channels_out = settings.channels.leaves_out(&scene.settings);
    let files = sources.len();
    let options = CompileOptions { environment, ..options };
    let options = with_camera_file(input, &scene, options, mode, &mut sources)?;
    let name = name_of(input);
    let job = CompileJob { options, crop, settings };
    let session = compile(&name, (&scene, None), job, mode)?;
    let camera_sources = sources.split_off(files);
    Ok(PreparedScene { scene, session, sources, camera_sources, leaves_channels_out, hints, load })
}

/// Name of the scene in messages.
fn name_of(input: &InputFiles) -> String {
    input.scene.as_ref().map_or("the scene".into(), |path| path.display().to_string())
}

/// Replaces the camera of a scene that was prepared with the same files and options, besides those
/// of the camera. Returns `None` if the scene has to be prepared anew, as for a camera whose image
/// has its own settings in the file.
///
/// # Errors
/// If the file of the camera cannot be read, or the camera is unknown or invalid.
pub(crate) fn with_camera(
    mut prepared: PreparedScene,
    input: &InputFiles,
    compile: &CompileJob,
    mode: Mode,
) -> Result<Option<PreparedScene>> {
    let PreparedScene { scene, session, camera_sources, .. } = &mut prepared;
    if scene.settings_of_camera || input.load.time.is_some() {
        return Ok(None);
    }
    let name = name_of(input);
    if let Some(wanted) = &input.load.camera {
        let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let index = pathtracer::camera_index(wanted, &names)
            .map_err(|message| anyhow!("{name}: camera: {message}"))?;
        scene.used_camera = (scene.cameras.len() > 1).then_some(index as u32);
    }
    camera_sources.clear();
    let options = compile.options.without_environment();
    let options = with_camera_file(input, scene, options, mode, camera_sources)?;
    let settings = compile.settings.for_scene(scene);
    let is_set = session
        .set_camera(scene, &options, settings)
        .with_context(|| format!("{name} cannot be rendered"))?;
    if !is_set {
        return Ok(None);
    }
    restrict(session, compile.crop, scene, mode)?;
    Ok(Some(prepared))
}

/// Compiles a scene that was read from some sources, with the environment and the camera files of
/// `input`, once `complete` has completed the options; also returns the files that were read. What
/// has not changed since an earlier compilation is taken over.
///
/// # Errors
/// If a file cannot be read, or the scene is invalid.
pub(crate) fn compile_in_memory(
    (scene, of_scene, earlier): (&Scene, &[SourceFile], Option<CompiledScene>),
    input: &InputFiles,
    CompileJob { options, crop, settings }: CompileJob,
    mode: Mode,
    complete: impl FnOnce(&mut CompileOptions) -> Result<()>,
) -> Result<(Session, Vec<SourceFile>)> {
    let mut sources = Vec::new();
    let environment = load_environment(input, mode, &mut sources)?;
    sources.extend_from_slice(of_scene);
    let options = CompileOptions { environment, ..options };
    let mut options = with_camera_file(input, scene, options, mode, &mut sources)?;
    complete(&mut options)?;
    let job = CompileJob { options, crop, settings };
    let session = compile("the scene", (scene, earlier), job, mode)?;
    Ok((session, sources))
}

/// Compiles a scene with this name in messages, after an earlier one if there is one.
fn compile(
    name: &str,
    (scene, earlier): (&Scene, Option<CompiledScene>),
    CompileJob { options, crop, settings }: CompileJob,
    mode: Mode,
) -> Result<Session> {
    let settings = settings.for_scene(scene);
    check_estimator(&settings).map_err(anyhow::Error::msg)?;
    let compiled = match earlier {
        Some(earlier) => Session::edited(earlier, scene, options, settings),
        None => Session::new(scene, options, settings),
    };
    let mut session = compiled.with_context(|| format!("{name} cannot be rendered"))?;
    restrict(&mut session, crop, scene, mode)?;
    if mode.policies.counts_tests {
        session.count_tests();
    }
    Ok(session)
}

/// Restricts a render to the rectangle of the command line or of the scene file, if there is one.
fn restrict(
    session: &mut Session,
    crop: Option<[u32; 4]>,
    scene: &Scene,
    mode: Mode,
) -> Result<()> {
    let resolution = session.scene().camera.resolution;
    if let Some(region) = region(crop, &scene.settings, resolution, mode)? {
        session.restrict(region)?;
    }
    Ok(())
}

/// Pixels of `--crop`, whose rows are counted from the bottom on the command line, or else of the
/// crop window of the scene file, which is relative to the size of the image.
///
/// # Errors
/// If the region is not inside an image of this size.
fn region(
    crop: Option<[u32; 4]>,
    file: &RenderHints,
    resolution: [u32; 2],
    mode: Mode,
) -> Result<Option<Region>> {
    let Some(cell) = crop else {
        let crop = file.crop_of(resolution).filter(|_| mode.policies.crop_of_file);
        return Ok(crop.map(|[x, y, width, height]| Region { x, y, width, height }));
    };
    crop::region(cell, resolution).map(Some)
}

fn total(session: &Session) -> u64 {
    let film = session.film();
    if session.settings().target.is_some() {
        return film.samples().max(1); // not known in advance
    }
    film.region().area() as u64 * u64::from(session.settings().spp.saturating_sub(film.first()))
}

fn load_scene(
    input: &InputFiles,
    mode: Mode,
    sources: &mut Vec<SourceFile>,
) -> Result<(Scene, Vec<Hint>)> {
    let Some(path) = &input.scene else { return Ok((pathtracer::default_scene(), Vec::new())) };
    if let Some(lines) = mode.lines() {
        (lines.input)(path);
    }
    let reading = pathtracer::read_with(&input.place(path), &input.load);
    sources.extend(reading.sources);
    if reading.scene.is_err() && !mode.strict {
        warn_missing(&reading.missing);
    }
    let scene = reading.scene.map_err(|error| WithHints { error, hints: reading.hints.clone() })?;
    Ok((scene, reading.hints))
}

/// Reads the environment map; by some policies, also writes the image of its sampling
/// probabilities.
fn load_environment(
    input: &InputFiles,
    mode: Mode,
    sources: &mut Vec<SourceFile>,
) -> Result<Option<EnvironmentMap>> {
    let Some(EnvironmentFile { path, layout }) = &input.environment else { return Ok(None) };
    let path = &input.place(path);
    if let Some(lines) = mode.lines() {
        (lines.loading_environment)(path);
    }
    image::check_readable(path)?;
    let bytes = pathtracer::file::read(path)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    sources.push(pathtracer::source_file(path, &bytes));
    let mut map: Image = image::decode(&bytes, path, Transfer::Srgb)?;
    if let Some(write) = mode.policies.write_probabilities {
        write(&map)?;
        if let Some(lines) = mode.lines() {
            (lines.environment_ready)();
        }
    }
    let mut notes = Vec::from_iter(map.make_radiance());
    match layout {
        None => notes.extend(map.doubt_as_sky()),
        Some(layout) => {
            let turned = layout.in_latitude_and_longitude(&map);
            map = turned.map_err(|message| anyhow!("{}: {message}", path.display()))?;
        }
    }
    for note in notes.into_iter().filter(|_| !mode.quiet) {
        report!("note: {}: {note}", path.display());
    }
    Ok(Some(EnvironmentMap::new(map.width, map.height, map.pixels.into_vec())))
}

/// Completes options by the camera of a file, if there is one.
fn with_camera_file(
    input: &InputFiles,
    scene: &Scene,
    options: CompileOptions,
    mode: Mode,
    sources: &mut Vec<SourceFile>,
) -> Result<CompileOptions> {
    let Some(path) = &input.camera_file else { return Ok(options) };
    let (mut camera, resolution) =
        if let Some((view, files)) = views::single(path, input.folder.as_deref())? {
            sources.extend(files);
            (view.camera, view.resolution)
        } else {
            let (camera, source) = camera_file::load(&input.place(path))?;
            sources.push(source);
            (camera, None)
        };
    if let Some(of_scene) = scene.camera() {
        // Files of cameras contain neither.
        (camera.medium, camera.shutter) = (of_scene.medium, of_scene.shutter);
    }
    if let Some(lines) = mode.lines() {
        (lines.camera_loaded)(&input.place(path));
    }
    let resolution = options.resolution.or(resolution);
    Ok(CompileOptions { camera: Some(camera), resolution, ..options })
}

/// Lists the missing files, even with `-q`, since the image differs without them.
pub(crate) fn warn_missing(missing: &[Warning]) {
    for file in missing.iter().take(MAX_NAMED) {
        report!("warning: {file}");
    }
    if let Some(more) = missing.len().checked_sub(MAX_NAMED).filter(|more| *more > 0) {
        report!("warning: … and {more} more missing files");
    }
}

/// Prints a warning if files are missing. It follows the summary, where it is noticed.
pub(crate) fn warn_incomplete(scene: &Scene) {
    let files = match scene.missing.len() {
        0 => return,
        1 => "a file of the scene is".to_owned(),
        n => format!("{n} files of the scene are"),
    };
    report!(
        "warning: {files} missing; placeholders are shown instead (--strict rejects missing files)"
    );
}

/// Reports invalid samples, even with `-q`, since they indicate errors.
fn report_invalid_samples(command: &[String], mode: Mode, session: &Session) {
    let rejections = session.film().invalid_samples();
    let Some(first) = rejections.first.first() else { return };
    report!(
        "warning: {} samples were refused and count as black: {rejections}",
        rejections.count()
    );
    for r in &rejections.first {
        report!("  column {}, row {}, sample {}: {}", r.x, r.y, r.sample, r.reason);
    }
    let (x, y, sample) = (first.x, first.y, first.sample);
    if can_be_explained(mode, session) {
        let words = command.iter().map(String::as_str);
        // Arguments contain no NUL.
        let again = shlex::try_join(words).unwrap_or_default();
        report!(
            "path of the first one: pathtracer explain {again} -x {x} -y {y} --sample {sample}"
        );
    } else {
        report!("explain needs an integrator that records single paths, without {WITHOUT_RECORDS}");
    }
}

/// Returns true if `pathtracer explain` supports the command line of this render.
fn can_be_explained(mode: Mode, session: &Session) -> bool {
    let Settings { integrator, reuse, split, .. } = session.settings();
    let records = |known: &Registration| known.name == integrator && known.new_traced.is_some();
    *reuse == 1 && *split == 1 && mode.policies.records.is_ok() && INTEGRATORS.iter().any(records)
}

fn next_steps() {
    report!("");
    report!("Try next:");
    report!("  pathtracer -s 1024 -f clean.exr              less noise, as linear floating point");
    report!("  pathtracer --light-component indirect        only light scattered at least twice");
    report!(
        "  pathtracer -r 1280 720 my_scene.dae          a scene of yours (also .glb .xml .pbrt)"
    );
    report!("  pathtracer --help                            everything else");
    report!("(in the source tree: cargo run --release -- OPTIONS)");
}
