//! Output files of failing tests.

use std::path::PathBuf;
use std::{env, fs, io};

/// Writes `content` to `test-output/<name>` in cargo's target folder, and returns the path.
///
/// # Errors
/// If the folder or the file cannot be written.
pub fn write(name: &str, content: &[u8]) -> io::Result<PathBuf> {
    let folder = target_folder().join("test-output");
    fs::create_dir_all(&folder)?;
    let path = folder.join(name);
    fs::write(&path, content)?;
    Ok(path)
}

/// Target folder: a test runs from `<target>/<profile>/deps/<test>`. Otherwise, the folder for
/// temporary files.
fn target_folder() -> PathBuf {
    let executable = env::current_exe().unwrap_or_default();
    match executable.parent() {
        Some(deps) if deps.ends_with("deps") => {
            deps.ancestors().nth(2).map_or_else(env::temp_dir, PathBuf::from)
        }
        _ => env::temp_dir(),
    }
}
