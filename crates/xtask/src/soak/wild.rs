//! Third-party files: the meshes and scenes in packages of Python and npm are rendered, each as a
//! small image. None may crash or hang; the outcomes are printed as a table.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use rayon::prelude::*;

use crate::project::{output_folder, succeed};
use crate::venv::{self, Installation};

/// Packages of Python, whose wheels are unpacked but not run, and their versions.
const PYTHON: [(&str, &str); 4] = [
    ("robosuite", "1.5.2"),
    ("dm_control", "1.0.50"),
    ("gymnasium-robotics", "1.4.2"),
    ("pyvista", "0.49.1"),
];
/// Packages of npm and their versions.
const NPM: [(&str, &str); 1] = [("@webxr-input-profiles/assets", "1.0.20")];
/// Extensions of files that are rendered.
const ENDINGS: [&str; 8] = ["dae", "glb", "gltf", "obj", "ply", "stl", "zae", "pbrt"];
/// Maximum time for one file.
const LIMIT: Duration = Duration::from_mins(2);

/// Outcome of a file.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum FileOutcome {
    Shown,
    Missing,
    Refused,
    Crashed,
    Hung,
}

impl FileOutcome {
    const ALL: [(Self, &str); 5] = [
        (Self::Shown, "shown"),
        (Self::Missing, "with something missing"),
        (Self::Refused, "refused"),
        (Self::Crashed, "crashed"),
        (Self::Hung, "hung"),
    ];

    /// Converts the documented exit status.
    fn of_status(status: Option<i32>) -> Self {
        match status {
            Some(0) => Self::Shown,
            Some(4) => Self::Missing,
            Some(2) => Self::Refused,
            _ => Self::Crashed,
        }
    }
}

/// File with its outcome.
struct Tried {
    package: String,
    file: PathBuf,
    outcome: FileOutcome,
    /// Last line of the messages.
    message: String,
}

/// Renders all files of the packages.
///
/// # Errors
/// If a package is not available, or a file crashes the program or hangs.
pub(super) fn run(program: &Path) -> Result<()> {
    let folder = output_folder("soak/wild")?;
    let mut files = Vec::new();
    for (package, unpacked) in unpack(&folder)? {
        let mut found = Vec::new();
        collect(&unpacked, &mut found)?;
        found.sort();
        println!("{package}: {} files", found.len());
        files.extend(found.into_iter().map(|file| (package.clone(), file)));
    }
    let tried = files
        .into_par_iter()
        .map(|(package, file)| {
            let image = folder.join(format!("{}.png", rayon::current_thread_index().unwrap_or(0)));
            let (outcome, message) = render(program, &file, &image)?;
            Ok(Tried { package, file, outcome, message })
        })
        .collect::<Result<Vec<_>>>()?;
    let report = report(&tried, &folder);
    let place = folder.join("report.md");
    fs::write(&place, &report).with_context(|| place.display().to_string())?;
    println!("{report}\nwritten to {}", place.display());
    let is_broken =
        |tried: &&Tried| matches!(tried.outcome, FileOutcome::Crashed | FileOutcome::Hung);
    let broken: Vec<_> =
        tried.iter().filter(is_broken).map(|tried| tried.file.display().to_string()).collect();
    ensure!(broken.is_empty(), "files that crash or hang the program:\n{}", broken.join("\n"));
    Ok(())
}

/// Downloads and unpacks the packages; returns their names and folders.
fn unpack(folder: &Path) -> Result<Vec<(String, PathBuf)>> {
    let Installation::Python(python) = venv::prepare("wild-venv", &["pip"], "import pip")? else {
        bail!("there is no Python with pip");
    };
    let mut all = Vec::new();
    for (name, version) in PYTHON {
        let place = folder.join(format!("{name}-{version}"));
        if !place.is_dir() {
            let wheels = folder.join("wheels").join(name);
            let mut download = Command::new(&python);
            download.args(["-m", "pip", "download", "--quiet", "--disable-pip-version-check"]);
            download.args(["--no-deps", "--only-binary", ":all:", "--dest"]).arg(&wheels);
            succeed(download.arg(format!("{name}=={version}")))?;
            let mut extract = Command::new(&python);
            extract.args(["-m", "zipfile", "-e"]).arg(only_file(&wheels)?).arg(&place);
            succeed(&mut extract)?;
        }
        all.push((format!("{name} {version}"), place));
    }
    for (name, version) in NPM {
        let plain = name.trim_start_matches('@').replace('/', "-");
        let place = folder.join(format!("{plain}-{version}"));
        if !place.is_dir() {
            let packed = folder.join("packed").join(&plain);
            fs::create_dir_all(&packed)?;
            let mut pack = Command::new("npm");
            pack.args(["pack", "--silent", "--pack-destination"]).arg(&packed);
            succeed(pack.arg(format!("{name}@{version}")))?;
            fs::create_dir_all(&place)?;
            let mut extract = Command::new("tar");
            succeed(extract.arg("xzf").arg(only_file(&packed)?).arg("-C").arg(&place))?;
        }
        all.push((format!("{name} {version}"), place));
    }
    Ok(all)
}

/// The only file of a folder.
fn only_file(folder: &Path) -> Result<PathBuf> {
    let first = fs::read_dir(folder)?.next().context("nothing was downloaded")??;
    Ok(first.path())
}

/// Collects the files with known extensions below a folder.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if path.is_dir() {
            collect(&path, files)?;
        } else if ENDINGS.contains(&ending.as_str()) {
            files.push(path);
        }
    }
    Ok(())
}

/// Renders a file as a small image.
fn render(program: &Path, file: &Path, image: &Path) -> Result<(FileOutcome, String)> {
    let messages = image.with_extension("txt");
    let mut command = Command::new(program);
    command.args(["-t", "1", "-s", "1", "-r", "32", "24", "--restart", "-f"]);
    command.arg(image).arg(file).stdin(Stdio::null()).stdout(Stdio::null());
    command.stderr(fs::File::create(&messages)?);
    let mut child = command.spawn().with_context(|| program.display().to_string())?;
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break Some(status);
        }
        if start.elapsed() > LIMIT {
            child.kill()?;
            child.wait()?;
            break None;
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let text = fs::read(&messages)?;
    let text = String::from_utf8_lossy(&text);
    let is_message = |line: &&str| line.starts_with("pathtracer:") || line.starts_with("missing:");
    let message = text.lines().find(is_message).unwrap_or_default().to_owned();
    Ok((status.map_or(FileOutcome::Hung, |status| FileOutcome::of_status(status.code())), message))
}

/// Table of the outcomes of all files.
fn report(tried: &[Tried], folder: &Path) -> String {
    let mut rows: BTreeMap<(&str, String), BTreeMap<FileOutcome, usize>> = BTreeMap::new();
    for Tried { package, file, outcome, .. } in tried {
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let row = rows.entry((package.as_str(), ending)).or_default();
        *row.entry(*outcome).or_default() += 1;
    }
    let heads = FileOutcome::ALL.map(|(_, name)| name).join(" | ");
    let mut text = format!("| package | files | {heads} |\n|---|---|---|---|---|---|---|\n");
    for ((package, ending), row) in &rows {
        let all: usize = row.values().sum();
        let counts =
            FileOutcome::ALL.map(|(outcome, _)| row.get(&outcome).unwrap_or(&0).to_string());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| {package} | {all} `.{ending}` | {} |", counts.join(" | "));
    }
    for Tried { file, outcome, message, .. } in
        tried.iter().filter(|t| t.outcome != FileOutcome::Shown)
    {
        let name = file.strip_prefix(folder).unwrap_or(file).display();
        let words =
            FileOutcome::ALL.iter().find(|(which, _)| which == outcome).map_or("", |(_, n)| n);
        let message = message.replace(&folder.display().to_string(), "");
        let _ = writeln!(text, "\n{words}: {name}\n  {message}");
    }
    text
}
