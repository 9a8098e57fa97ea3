//! The Python module: its wheel is built, installed outside of the source tree, and tested there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, anyhow, bail, ensure};

use crate::project::{root, succeed, target};
use crate::venv::{self, Installation};

/// Packages that build wheels.
const BUILD: &[&str] = &["maturin>=1.16,<2"];
/// Packages that test the installed module; pyright brings its own Node.js.
const TEST: &[&str] = &[
    "hypothesis",
    "ipykernel",
    "mypy",
    "nbclient",
    "pyoidn",
    "pyright[nodejs]",
    "pytest",
    "tqdm",
    "trimesh",
    "typing_extensions",
];

/// Requirements of the tests of `pathtracer.ray`.
pub(crate) fn requirements() -> PathBuf {
    root().join("crates/python/requirements-ray.txt")
}

/// Tools that build the wheel and test it.
pub(crate) struct Environment {
    /// Python with maturin, in the target folder.
    maturin: PathBuf,
    /// Fresh environment outside of the source tree.
    folder: Folder,
    /// Its Python, with the packages that test the module.
    python: PathBuf,
}

/// Installs maturin and the packages of the tests, or returns the reason why that is impossible.
///
/// # Errors
/// If the target folder or that of temporary files cannot be found.
pub(crate) fn prepare() -> Result<Result<Environment, String>> {
    let maturin = match maturin()? {
        Installation::Python(maturin) => maturin,
        Installation::Missing(reason) => return Ok(Err(reason)),
    };
    let folder = Folder::new()?;
    let environment = folder.path.join("environment");
    let python = venv::python_of(&environment);
    let mut install = pip(&python);
    install.args(TEST).arg("-r").arg(requirements());
    let made = venv::try_to(Command::new("python3").args(["-m", "venv"]).arg(&environment));
    let installed = made.and_then(|()| venv::try_to(&mut install));
    Ok(installed.map(|()| Environment { maturin, folder, python }))
}

/// Installs maturin into an environment of the target folder.
fn maturin() -> Result<Installation> {
    venv::prepare("python-build", BUILD, "import maturin")
}

/// The command that installs packages for a Python.
fn pip(python: &Path) -> Command {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip
}

/// Installs the packages, and does what [`check`] does.
///
/// # Errors
/// If a package cannot be installed, or as [`check`].
pub(crate) fn run() -> Result<()> {
    match prepare()? {
        Ok(environment) => check(&environment),
        Err(reason) => bail!("packages cannot be installed: {reason}"),
    }
}

/// Builds the wheel with overflow checks, reusing the crates of the tests, and tests it in its
/// environment.
///
/// # Errors
/// If the wheel cannot be built or installed, or a test fails.
pub(crate) fn check(Environment { maturin, folder, python }: &Environment) -> Result<()> {
    let wheel = build(maturin, &["--profile", "dev", "--features", "as-in-tests"])?;
    succeed(pip(python).arg(wheel))?;
    let tests = folder.path.join("tests");
    copy(&root().join("crates/python/tests"), &tests)?;
    copy(&root().join("crates/python/examples"), &tests.join("examples"))?;
    let page = "mitsuba-tutorials.md";
    fs::copy(root().join("docs").join(page), tests.join(page)).context(page)?;
    let scenes = root().join("scenes");
    let run = |arguments: &[&str]| {
        let mut command = Command::new(python);
        command.arg("-m").args(arguments).current_dir(&folder.path);
        command
    };
    let mut tests = run(&["pytest", "-q", "-p", "no:cacheprovider", "tests", "--scenes"]);
    tests.arg(scenes);
    let mut checks = [
        run(&["mypy", "--strict", "tests"]),
        run(&["mypy.stubtest", "pathtracer"]),
        run(&["pyright", "--pythonpath"]),
    ];
    checks[2].arg(python).arg("tests");
    // The tests wait for clusters and signals for most of their time.
    std::thread::scope(|scope| {
        let checked = scope.spawn(|| checks.iter_mut().try_for_each(succeed));
        let tested = succeed(&mut tests);
        let checked = checked.join().map_err(|_| anyhow!("the checks of types panicked"))?;
        tested.and(checked)
    })
}

/// Installs packages and the wheel of a release into an environment of the target folder, and
/// returns its Python. The packages are there if `probe` runs.
///
/// # Errors
/// If something cannot be built or installed.
pub(crate) fn with_release(name: &str, packages: &[&str], probe: &str) -> Result<PathBuf> {
    let (maturin, environment) = (maturin()?, venv::prepare(name, packages, probe)?);
    let (Installation::Python(maturin), Installation::Python(python)) = (&maturin, &environment)
    else {
        let reasons = [&maturin, &environment].map(Installation::missing);
        let reasons: Vec<_> = reasons.into_iter().flatten().cloned().collect();
        bail!("packages cannot be installed: {}", reasons.join("; "));
    };
    let wheel = build(maturin, &["--release"])?;
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--no-deps", "--force-reinstall"]).arg(wheel);
    succeed(&mut pip)?;
    Ok(python.clone())
}

/// Builds the wheel with these options and returns its path.
///
/// # Errors
/// If it cannot be built.
pub(crate) fn build(python: &Path, options: &[&str]) -> Result<PathBuf> {
    let folder = target()?.join("wheels");
    // Earlier versions would be found, too.
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let mut maturin = Command::new(python);
    maturin.args(["-m", "maturin", "build", "--quiet"]).args(options).arg("--out").arg(&folder);
    succeed(maturin.current_dir(root()))?;
    let files = fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
    let mut wheels: Vec<_> = files.map(|file| Ok(file?.path())).collect::<Result<_>>()?;
    match (wheels.pop(), wheels.is_empty()) {
        (Some(wheel), true) => Ok(wheel),
        _ => bail!("{}: expected one wheel", folder.display()),
    }
}

/// Temporary folder outside of the source tree, removed at the end.
struct Folder {
    path: PathBuf,
}

impl Folder {
    fn new() -> Result<Self> {
        let path = std::env::temp_dir().join(format!("pathtracer-python-{}", std::process::id()));
        ensure!(!path.starts_with(root()), "{} is in the source tree", path.display());
        fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        Ok(Self { path })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What remains is in the folder of temporary files.
        let _ = fs::remove_dir_all(&self.path);
    }
}

/// Copies the files of a folder.
fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to).with_context(|| to.display().to_string())?;
    for file in fs::read_dir(from).with_context(|| from.display().to_string())? {
        let path = file?.path();
        if let Some(name) = path.file_name().filter(|_| path.is_file()) {
            fs::copy(&path, to.join(name)).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}
