//! Search for the library.

use std::env;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::DenoiseError;
use crate::library::OidnFunctions;

/// Environment variable with the path of the library, or of a folder that contains it.
pub const VARIABLE: &str = "PATHTRACER_OIDN";

/// File name of the library.
const NAME: &str = if cfg!(windows) {
    "OpenImageDenoise.dll"
} else if cfg!(target_os = "macos") {
    "libOpenImageDenoise.2.dylib"
} else {
    "libOpenImageDenoise.so.2"
};

/// Locations of the library relative to a folder: the folder itself, a release of Intel, the
/// package pyoidn, and a folder of packages.
const BELOW: [&str; 4] = ["", "lib", "oidn/lib", "pyoidn/oidn/lib"];

/// True if the C library of the program cannot open others.
const IS_STATIC: bool = cfg!(all(target_env = "musl", target_feature = "crt-static"));

/// Opens the library, which is searched for in further folders first, and also returns its path.
///
/// # Errors
/// If it is not found, or the program is static.
pub(crate) fn open(further: &[PathBuf]) -> Result<(OidnFunctions, PathBuf), DenoiseError> {
    if IS_STATIC {
        return Err(DenoiseError::Static);
    }
    match env::var_os(VARIABLE).filter(|place| !place.is_empty()) {
        Some(place) => open_given(place.into()),
        None => open_usual(further),
    }
}

fn open_given(place: PathBuf) -> Result<(OidnFunctions, PathBuf), DenoiseError> {
    let files = if place.is_dir() { in_folder(&place) } else { vec![place.clone()] };
    first(&files).map_err(|tried| DenoiseError::NotThere { place, tried })
}

fn open_usual(further: &[PathBuf]) -> Result<(OidnFunctions, PathBuf), DenoiseError> {
    let program = env::current_exe().ok();
    let above = |levels| Some(program.as_deref()?.ancestors().nth(levels)?.to_owned());
    // The tests of the project install it two folders above a program that was built there.
    let by_tests = above(2).into_iter().flat_map(|target| in_root(&target.join("oidn-venv")));
    let folders = further
        .iter()
        .cloned()
        .chain(above(1))
        .chain(installed())
        .chain(by_tests)
        .chain(packages());
    let mut files: Vec<_> = folders.flat_map(|folder| in_folder(&folder)).collect();
    // A name without a folder is searched for on the system's library path.
    let by_system = Path::new(NAME);
    files.push(by_system.to_owned());
    first(&files).map_err(|mut tried| {
        // The library's absence on this path is not reported.
        tried.pop();
        DenoiseError::Missing { tried }
    })
}

/// Folder into which [`install_command`] installs the package: `pathtracer/oidn` in the data folder
/// of the user.
fn installed() -> Option<PathBuf> {
    Some(dirs::data_local_dir()?.join("pathtracer").join("oidn"))
}

/// Shell command that installs the library where [`open`] finds it.
pub(crate) fn install_command() -> String {
    let python = if cfg!(windows) { "py" } else { "python3" };
    let mut command = format!("{python} -m pip install --no-deps ");
    if let Some(folder) = installed() {
        // Writing to a string succeeds.
        let _ = write!(command, "--target \"{}\" ", folder.display());
    }
    command + "pyoidn"
}

/// Opens the first library that can be opened; the error lists the problem of each.
fn first(files: &[PathBuf]) -> Result<(OidnFunctions, PathBuf), Vec<String>> {
    let mut tried = Vec::new();
    for file in files {
        match OidnFunctions::load(file) {
            Ok(functions) => return Ok((functions, file.clone())),
            Err(message) => tried.push(format!("{}: {message}", file.display())),
        }
    }
    Err(tried)
}

/// Libraries in a folder.
fn in_folder(folder: &Path) -> Vec<PathBuf> {
    let files = BELOW.iter().map(|below| folder.join(below).join(NAME));
    files.filter(|file| file.is_file()).collect()
}

/// Package folders of Python: those of the active virtual environment, of the user, and of the
/// system.
fn packages() -> Vec<PathBuf> {
    let variable = |name| env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let of_user = variable("HOME").map(|home| home.join(".local"));
    let of_system = ["/usr/local", "/usr"].map(PathBuf::from);
    let roots = [variable("VIRTUAL_ENV"), variable("CONDA_PREFIX"), of_user];
    let roots = roots.into_iter().flatten().chain(of_system);
    roots.flat_map(|root| in_root(&root)).collect()
}

/// Package folders below a root, those of later versions of Python first.
fn in_root(root: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root.join("lib")).into_iter().flatten();
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut pythons: Vec<_> =
        paths.filter_map(|path| Some((minor_version(&path)?, path))).collect();
    pythons.sort_by(|a, b| b.cmp(a));
    // Windows has a single folder, without a version.
    let folders = pythons.into_iter().map(|(_, path)| path).chain([root.join("Lib")]);
    folders.flat_map(|lib| ["site-packages", "dist-packages"].map(|kind| lib.join(kind))).collect()
}

/// The 11 of python3.11, and 0 of python3.
fn minor_version(python: &Path) -> Option<u32> {
    match python.file_name()?.to_str()?.strip_prefix("python3")? {
        "" => Some(0),
        minor => minor.strip_prefix('.')?.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_of_later_pythons_come_first() {
        let root = tempfile::tempdir().expect("a temporary folder");
        for name in ["python3.9", "python3.11", "python3", "python2.7", "cmake"] {
            std::fs::create_dir_all(root.path().join("lib").join(name)).expect("it takes folders");
        }
        let found = in_root(root.path());
        let names = ["lib/python3.11", "lib/python3.9", "lib/python3", "Lib"];
        let kinds = ["site-packages", "dist-packages"];
        let wanted: Vec<_> =
            names.iter().flat_map(|n| kinds.map(|kind| root.path().join(n).join(kind))).collect();
        assert_eq!(found, wanted);
    }

    #[test]
    fn the_command_installs_where_the_library_is_looked_for() {
        let command = install_command();
        let folder = installed().expect("the system has a folder for data of users");
        assert!(
            command.contains(&format!("--target \"{}\" pyoidn", folder.display())),
            "{command}"
        );
        let message = DenoiseError::Missing { tried: Vec::new() }.to_string();
        assert!(message.contains(&command), "{message}");
    }

    #[test]
    fn the_library_is_found_in_itself_in_a_release_and_in_packages() {
        for below in BELOW {
            let root = tempfile::tempdir().expect("a temporary folder");
            assert!(in_folder(root.path()).is_empty());
            let folder = root.path().join(below);
            std::fs::create_dir_all(&folder).expect("it takes folders");
            std::fs::write(folder.join(NAME), "no library").expect("it takes files");
            assert_eq!(in_folder(root.path()), [folder.join(NAME)]);
            let tried = first(&in_folder(root.path())).err().expect("that is none");
            assert_eq!(tried.len(), 1, "{tried:?}");
        }
    }
}
