//! Time from the wheel to the first image, in a bare Debian and in a new virtual environment.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use super::names::files;
use crate::project::{step, succeed};

/// Packages of the bare Debian besides the base system.
const PACKAGES: &str = "python3,python3-venv,ca-certificates";

/// Maximum number of seconds from the wheel to the first image.
const MAX_SECONDS: f64 = 60.0;

/// Environment variables of pip's connection, which the bare system receives.
const CONNECTION: [&str; 6] =
    ["PIP_CERT", "SSL_CERT_FILE", "http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"];

/// Installs the wheel of a distribution in both, and renders.
///
/// # Errors
/// If there is no wheel, a command fails, or it takes too long.
pub(super) fn run(distribution: &Path) -> Result<()> {
    let end = format!("{}.whl", std::env::consts::ARCH);
    let wheel = files(distribution)?
        .into_iter()
        .find(|file| file.to_string_lossy().ends_with(&end))
        .with_context(|| {
            let folder = distribution.display();
            format!("{folder}: no wheel for this machine; make it by `cargo xtask dist`")
        })?;
    let folder = std::env::temp_dir().join(format!("pathtracer-bare-{}", std::process::id()));
    let folder = Removed(folder);
    fs::create_dir_all(&folder.0).with_context(|| folder.0.display().to_string())?;
    step("new virtual environment", || first_image(&wheel, &Place::Here(folder.0.join("here"))))?;
    let root = folder.0.join("root");
    step("bare Debian", || make_root(&root))?;
    step("virtual environment in the bare Debian", || first_image(&wheel, &Place::Root(root)))
}

/// Temporary folder, removed at the end.
struct Removed(PathBuf);

impl Drop for Removed {
    fn drop(&mut self) {
        // What remains is in the folder of temporary files.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Place of an installation.
enum Place {
    /// Folder of this system.
    Here(PathBuf),
    /// Root of another system.
    Root(PathBuf),
}

impl Place {
    /// The folder of the installation, seen from this system.
    fn folder(&self) -> PathBuf {
        match self {
            Self::Here(folder) => folder.clone(),
            Self::Root(root) => root.join("pathtracer"),
        }
    }

    /// Shell command in the folder of the installation.
    fn shell(&self, script: &str) -> Command {
        let mut command = match self {
            Self::Here(_) => Command::new("env"),
            Self::Root(root) => {
                let mut chroot = Command::new("chroot");
                chroot.arg(root).arg("env");
                chroot
            }
        };
        let folder = match self {
            Self::Here(folder) => folder.as_path(),
            Self::Root(_) => Path::new("/pathtracer"),
        };
        command.arg("-C").arg(folder).args(["sh", "-ec", script]).env_clear();
        command.env("PATH", "/usr/local/bin:/usr/bin:/usr/sbin:/bin:/sbin").env("HOME", folder);
        command.envs(CONNECTION.iter().filter_map(|name| Some((name, std::env::var_os(name)?))));
        command
    }
}

/// Installs a Debian of minimal size.
fn make_root(root: &Path) -> Result<()> {
    let mut debootstrap = Command::new("debootstrap");
    debootstrap.args(["--variant=minbase", &format!("--include={PACKAGES}"), "stable"]);
    succeed(debootstrap.arg(root).stdout(std::process::Stdio::null()))
        .context("expected debootstrap, run as root (Debian: apt-get install debootstrap)")?;
    let mut copied = vec![PathBuf::from("/etc/resolv.conf")];
    copied.extend(CONNECTION[..2].iter().filter_map(std::env::var_os).map(PathBuf::from));
    for file in copied.iter().filter(|file| file.is_file()) {
        let to = root.join(file.strip_prefix("/").unwrap_or(file));
        fs::create_dir_all(to.parent().unwrap_or(root))?;
        fs::copy(file, &to).with_context(|| to.display().to_string())?;
    }
    Ok(())
}

/// Installs a wheel and renders the default scene; prints the seconds of each part.
fn first_image(wheel: &Path, place: &Place) -> Result<()> {
    let folder = place.folder();
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let name = wheel.file_name().context("the wheel is no file")?.to_string_lossy();
    fs::copy(wheel, folder.join(&*name)).with_context(|| wheel.display().to_string())?;
    let timed = |what: &str, script: &str| {
        let start = Instant::now();
        succeed(&mut place.shell(script))?;
        let seconds = start.elapsed().as_secs_f64();
        println!("{seconds:6.1} s  {what}");
        Ok::<_, anyhow::Error>(seconds)
    };
    timed("virtual environment", "python3 -m venv env")?;
    let install = format!("env/bin/pip install -q --disable-pip-version-check ./{name}");
    let seconds = timed("pip install", &install)? + timed("first image", "env/bin/pathtracer -q")?;
    ensure!(folder.join("cornell.png").is_file(), "the program wrote no cornell.png");
    println!("{seconds:6.1} s  from the wheel to the first image");
    ensure!(seconds < MAX_SECONDS, "expected at most {MAX_SECONDS} s");
    Ok(())
}
