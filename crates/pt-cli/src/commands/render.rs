//! `pathtracer render`, the default command: renders a scene to an image.

use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use pathtracer::image::{self, Image, Transfer};
use pathtracer::provenance::Provenance;
use pathtracer::{
    CompileOptions, EnvironmentMap, INTEGRATORS, Observer, Outcome, Registration, Scene, Session,
    Settings, SourceFile, Warning, camera_file,
};

use crate::checkpointing::Checkpointer;
use crate::console::Console;
use crate::denoise::Denoising;
use crate::limits::Limit;
use crate::lock::Lock;
use crate::resolve::{RenderJob, check_estimator};
use crate::summary::{Summary, cpu_seconds};
use crate::tev::Viewer;
use crate::{course, limits, output, stop_options};

/// Exit status of a render that Ctrl-C ended, by the convention of shells: 128 + SIGINT.
const INTERRUPTED: u8 = 130;

/// Exit status of a render with `--strict` that had invalid samples, or missed its error target.
const NOT_AS_ASKED: u8 = 3;

/// Exit status of a render of a scene with missing files.
pub(crate) const MISSING: u8 = 4;

/// Maximum number of missing files that are listed.
const MAX_NAMED: usize = 100;

/// Result of a render.
pub(crate) struct Done {
    pub(crate) status: ExitCode,
    pub(crate) progress: Outcome,
    /// Provenance metadata of the image, if one was written.
    pub(crate) receipt: Option<Provenance>,
}

/// Renders the image of the command line, writes it, and returns the exit status.
///
/// # Errors
/// As [`render`].
pub(crate) fn run(request: &RenderJob) -> Result<ExitCode> {
    Ok(render(request)?.status)
}

/// Renders the image of the command line, and writes it.
///
/// # Errors
/// If a file cannot be read or written, or a scene is invalid.
pub(crate) fn render(request: &RenderJob) -> Result<Done> {
    let path = request.output();
    for file in std::iter::once(&path).chain(&request.cli.summary_json) {
        output::check_writable(file)?;
    }
    let _lock = Lock::take(&path)?;
    let start = Instant::now();
    let limit = Limit::of(request);
    limit.check_files(request)?;
    let denoising = Denoising::begin(request, threads(request))?;
    let Prepared { scene, mut session, sources, load } = prepare(request, &limit, start)?;
    warn_missing(&scene.missing);
    report_notes(request, &scene, &session);
    let threads = threads(request);
    let mut checkpointing =
        Checkpointer::begin(request, &mut session, (&sources, &scene.missing), (threads, start))?;
    if request.cli.cs184 && !request.cli.quiet {
        course::built(&session, threads);
    }
    limits::begin_rendering();
    let console = Console::new(&request.cli, session.film().samples(), total(&session));
    let cpu = cpu_seconds();
    let mut viewer = connect(request);
    let (progress, statistics) =
        checkpointing.render(&mut session, request, &console, &mut viewer)?;
    let cpu = cpu_seconds().zip(cpu).map(|(after, before)| after - before);
    console.finish(progress);
    report_invalid_samples(request, &session);
    if request.cli.cs184 && !request.cli.quiet {
        course::rendered(&statistics);
    }
    let (files, receipt) = checkpointing.finish(&session, request, progress, &denoising)?;
    if let Some(warning) = viewer.and_then(|viewer| viewer.finish(session.image())) {
        report!("warning: {warning}");
    }
    let missing = scene.missing.len();
    let summary = Summary { session: &session, statistics, progress, threads, missing, load, cpu };
    if let Some(path) = &request.cli.summary_json {
        summary.write_json(path)?;
    }
    if request.cli.cs184 && !request.cli.quiet {
        course::saved(&path, request.cli.cell.is_some());
    } else if !request.cli.quiet {
        summary.print();
        let names: Vec<_> = files.iter().map(|f| f.display().to_string()).collect();
        report!("saved {}", names.join(" and "));
        if request.scene().is_none() {
            next_steps();
        }
    }
    warn_incomplete(&scene);
    if !request.cli.quiet {
        output::report_extremes(&session, request);
    }
    let status = match progress {
        Outcome::Cancelled if console.cancelled() => {
            report!("stopped early: the image holds the samples taken so far");
            if checkpointing.keeps() {
                report!("to go on: pathtracer resume {}", path.display());
            }
            ExitCode::from(INTERRUPTED)
        }
        ended => {
            let out_of_time = ended == Outcome::Cancelled;
            let is_missed = report_missed_target(&session, out_of_time);
            if out_of_time && !request.cli.quiet {
                report!("time is up: the image holds the samples taken so far");
                if checkpointing.keeps() {
                    report!("to go on: pathtracer resume {}", path.display());
                }
            }
            if request.cli.strict && (is_missed || session.film().invalid_samples().count() > 0) {
                ExitCode::from(NOT_AS_ASKED)
            } else if scene.missing.is_empty() {
                ExitCode::SUCCESS
            } else {
                ExitCode::from(MISSING)
            }
        }
    };
    Ok(Done { status, progress, receipt })
}

/// Prints a warning if the error target was missed, and returns true if it was.
fn report_missed_target(session: &Session, out_of_time: bool) -> bool {
    let is_missed = stop_options::is_missed(session);
    if is_missed {
        let found =
            stop_options::summary(session).unwrap_or("it has not enough samples to tell".into());
        let cause = if out_of_time {
            "time was up before".to_owned()
        } else {
            format!("it has all of the {} samples that --max-spp allows", session.settings().spp)
        };
        report!("warning: the image is not as good as it was to be: {found}; {cause}");
    }
    is_missed
}

/// Connects to the viewer, if one is requested; prints a warning if that fails.
fn connect(request: &RenderJob) -> Option<Viewer> {
    let address = request.cli.tev.as_deref()?;
    let connected = Viewer::connect(address, &request.output().display().to_string());
    connected.map_err(|warning| report!("warning: {warning}")).ok()
}

/// A scene that is ready to be rendered.
pub(crate) struct Prepared {
    pub(crate) scene: Scene,
    pub(crate) session: Session,
    /// The files that were read.
    sources: Vec<SourceFile>,
    /// Wall-clock time of reading files.
    load: Duration,
}

/// Reads and compiles the scene of the command line.
///
/// # Errors
/// If a file cannot be read, or a scene is invalid.
pub(crate) fn prepare(request: &RenderJob, limit: &Limit, start: Instant) -> Result<Prepared> {
    let mut sources = Vec::new();
    let environment = load_environment(request, &mut sources)?;
    let scene = load_scene(request, &mut sources)?;
    limit.check_scene(request, &scene)?;
    let load = start.elapsed();
    let session = compile(request, &scene, environment, &mut sources)?;
    Ok(Prepared { scene, session, sources, load })
}

fn threads(request: &RenderJob) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    match request.cli.threads {
        None if request.cli.cs184 => 1,
        None | Some(0) => cores(),
        Some(n) => n,
    }
}

fn total(session: &Session) -> u64 {
    let film = session.film();
    if session.settings().target.is_some() {
        return film.samples().max(1); // not known in advance
    }
    film.region().area() as u64 * u64::from(session.settings().spp.saturating_sub(film.first()))
}

fn load_scene(request: &RenderJob, sources: &mut Vec<SourceFile>) -> Result<Scene> {
    let Some(path) = request.scene() else { return Ok(pathtracer::default_scene()) };
    if request.cli.cs184 && !request.cli.quiet {
        course::input(path);
    }
    let reading = pathtracer::read_with(path, &request.load_options());
    sources.extend(reading.sources);
    if reading.scene.is_err() && !request.cli.strict {
        warn_missing(&reading.missing);
    }
    Ok(reading.scene?)
}

/// Reads the environment map; under `--cs184`, also writes the image of its sampling probabilities.
fn load_environment(
    request: &RenderJob,
    sources: &mut Vec<SourceFile>,
) -> Result<Option<EnvironmentMap>> {
    let Some(path) = &request.cli.environment else { return Ok(None) };
    let course = request.cli.cs184;
    if course && !request.cli.quiet {
        course::loading_environment(path);
    }
    image::check_readable(path)?;
    let bytes = pathtracer::file::read(path)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    sources.push(pathtracer::source_file(path, &bytes));
    let mut map: Image = image::decode(&bytes, path, Transfer::Srgb)?;
    if course {
        let debug = pathtracer::course::probability_debug(&map);
        image::save_rgb8(Path::new("probability_debug.png"), map.width, map.height, &debug)?;
        if !request.cli.quiet {
            course::environment_ready();
        }
    }
    let mut notes = Vec::from_iter(map.make_radiance());
    match request.cli.environment_layout.square() {
        None => notes.extend(map.doubt_as_sky()),
        Some(layout) => {
            let turned = layout.in_latitude_and_longitude(&map);
            map = turned.map_err(|message| anyhow!("{}: {message}", path.display()))?;
        }
    }
    for note in notes {
        if !request.cli.quiet {
            report!("note: {}: {note}", path.display());
        }
    }
    Ok(Some(EnvironmentMap::new(map.width, map.height, map.pixels)))
}

fn compile(
    request: &RenderJob,
    scene: &Scene,
    environment: Option<EnvironmentMap>,
    sources: &mut Vec<SourceFile>,
) -> Result<Session> {
    let cli = &request.cli;
    let read = cli.camera_file.as_deref().map(camera_file::load).transpose()?;
    let (mut camera, source) = read.unzip();
    sources.extend(source);
    if let (Some(camera), Some(of_scene)) = (&mut camera, scene.camera()) {
        // Camera settings files contain neither.
        (camera.medium, camera.shutter) = (of_scene.medium, of_scene.shutter);
    }
    if let (true, false, Some(path)) = (cli.cs184, cli.quiet, &cli.camera_file) {
        course::camera_loaded(path);
    }
    let options = CompileOptions {
        resolution: request.resolution,
        course: cli.cs184,
        bvh: request.bvh(),
        most_single_lights: None,
        most_copied_triangles: None,
        environment,
        studio: !cli.cs184,
        compensated: false,         // set by the session
        texture_coordinates: false, // set by the session
        camera,
        placement: cli.loading.placement(),
        lens_radius: cli.lens_radius,
        aperture: request.aperture(),
        focal_distance: cli.focal_distance,
        panorama: cli.panorama,
        smooth_shadows: cli.smooth_shadows,
    };
    let region =
        |resolution| request.region(&scene.settings, resolution).map_err(anyhow::Error::msg);
    let settings: Settings = request.settings(scene);
    check_estimator(&settings).map_err(anyhow::Error::msg)?;
    let name = request.scene().map_or("the scene".into(), |p| p.display().to_string());
    let mut session = Session::new(scene, options, settings)
        .with_context(|| format!("{name} cannot be rendered"))?;
    if let Some(region) = region(session.scene().camera.resolution)? {
        session.restrict(region)?;
    }
    if cli.cs184 {
        session.count_tests();
    }
    Ok(session)
}

/// Lists the missing files, even with `-q`, since the image differs without them.
pub(crate) fn warn_missing(missing: &[Warning]) {
    for file in missing.iter().take(MAX_NAMED) {
        report!("missing: {file}");
    }
    if let Some(more) = missing.len().checked_sub(MAX_NAMED).filter(|more| *more > 0) {
        report!("missing: … and {more} more");
    }
}

/// Prints a warning if files are missing. It follows the summary, where it is noticed.
fn warn_incomplete(scene: &Scene) {
    let files = match scene.missing.len() {
        0 => return,
        1 => "a file of the scene is".to_owned(),
        n => format!("{n} files of the scene are"),
    };
    report!(
        "warning: {files} missing; the image shows something else in their place (--strict refuses that)"
    );
}

/// Prints the warnings and notes of a scene.
pub(crate) fn report_notes(request: &RenderJob, scene: &Scene, session: &Session) {
    if request.cli.quiet {
        return;
    }
    for warning in &scene.warnings {
        report!("note: {warning}");
    }
    if request.leaves_channels_out(&scene.settings) {
        let channels = scene.settings.aovs.join(", ");
        report!("note: the scene asks for {channels} too; they are left out without -f out.exr");
    }
    for note in session.notes() {
        report!("note: {note}");
    }
}

/// Reports invalid samples, even with `-q`, since they indicate errors.
fn report_invalid_samples(request: &RenderJob, session: &Session) {
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
    if can_be_explained(request, session) {
        let words = request.command.iter().map(String::as_str);
        // Arguments contain no NUL.
        let again = shlex::try_join(words).unwrap_or_default();
        report!(
            "for the path of the first: pathtracer explain {again} -x {x} -y {y} --sample {sample}"
        );
    } else {
        report!(
            "explain needs an integrator that records single paths, without --path-reuse, \
             --path-splitting and --cs184"
        );
    }
}

/// Returns true if `pathtracer explain` supports the command line of this render.
fn can_be_explained(request: &RenderJob, session: &Session) -> bool {
    let Settings { integrator, reuse, split, .. } = session.settings();
    let records = |known: &Registration| known.name == integrator && known.new_traced.is_some();
    *reuse == 1 && *split == 1 && !request.cli.cs184 && INTEGRATORS.iter().any(records)
}

fn next_steps() {
    report!("");
    report!("Try next:");
    report!("  pathtracer -s 1024 -f clean.exr          less noise, as linear floating point");
    report!(
        "  pathtracer --light-component indirect               only light that was scattered twice"
    );
    report!("  pathtracer -r 1280 720 my_scene.dae      a scene of yours (also .glb .xml .pbrt)");
    report!("  pathtracer --help                        everything else");
    report!("(in the source tree: cargo run --release -- OPTIONS)");
}
