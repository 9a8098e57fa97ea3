//! Header of the film of a render: files, settings and command on which its samples depend.

use std::path::Path;
use std::time::SystemTime;

use pathtracer::film_file::FilmHeader;
use pathtracer::provenance::RunStatistics;
use pathtracer::{LoadOptions, Session, SourceFile, Warning};

use crate::job::InputFiles;
use crate::{machine, seal, views};

/// Header of a film, without a seal.
pub(crate) fn film_header(
    input: &InputFiles,
    session: &Session,
    sources: &[SourceFile],
    missing: &[Warning],
    command: Vec<String>,
) -> FilmHeader {
    let mut settings = session.identity();
    settings.extend(settings_of_loading(&input.load));
    let folder = input.folder.clone();
    FilmHeader {
        version: env!("CARGO_PKG_VERSION").into(),
        files: files(input, sources),
        settings,
        spp: session.settings().spp,
        layout: session.settings().points().spp,
        command,
        folder: folder.unwrap_or_else(|| std::env::current_dir().unwrap_or_default()),
        names: session.names().clone(),
        missing: missing.iter().map(ToString::to_string).collect(),
        ..FilmHeader::default()
    }
}

/// The header with the seal of the output at `path`.
pub(crate) fn sealed(about: FilmHeader, path: &Path) -> FilmHeader {
    let seal = seal::of(path, &about.folder, &about.command);
    FilmHeader { seal, ..about }
}

/// Names of the files relative to the folder of the scene, or as they were given, with their
/// hashes, each once.
fn files(input: &InputFiles, sources: &[SourceFile]) -> Vec<(String, String)> {
    let scene = input.scene.as_deref().map(|scene| input.place(scene));
    let folder = scene.as_deref().and_then(Path::parent);
    let environment = input.environment.as_ref().map(|file| file.path.as_path());
    let camera = input.camera_file.as_deref();
    let camera = camera.map(|path| views::split(path, input.folder.as_deref()).0);
    let given = [environment, camera.as_deref()];
    let name = |path: &Path| {
        let inside = folder.and_then(|folder| path.strip_prefix(folder).ok());
        let as_given = || given.into_iter().flatten().find(|given| input.place(given) == path);
        inside.or_else(as_given).unwrap_or(path).display().to_string()
    };
    let mut files: Vec<_> = sources.iter().map(|s| (name(&s.path), s.hash.clone())).collect();
    let mut seen = std::collections::HashSet::new();
    files.retain(|file| seen.insert(file.clone()));
    files
}

/// Options of the readers that change the scene.
fn settings_of_loading(load: &LoadOptions) -> Vec<(String, String)> {
    let definitions = load.definitions.iter();
    let mut settings: Vec<_> =
        definitions.map(|(name, value)| (format!("${name}"), value.clone())).collect();
    let camera = load.camera.clone();
    settings.extend(camera.map(|camera| ("camera of the scene".into(), camera)));
    settings.extend(load.time.map(|time| ("time of animations".into(), time.to_string())));
    let radius = load.point_radius;
    settings.extend(radius.map(|radius| ("radius of points".into(), radius.to_string())));
    settings
}

/// Statistics of the run whose image is written now.
pub(crate) fn run_of(about: &FilmHeader, threads: Option<usize>) -> RunStatistics {
    RunStatistics {
        command: about.command.clone(),
        folder: about.folder.clone(),
        seal: about.seal.clone(),
        layout: about.layout,
        seconds: about.seconds,
        rays: about.rays,
        threads,
        machine: Some(machine::describe()),
        date: Some(humantime::format_rfc3339_seconds(SystemTime::now()).to_string()),
    }
}
