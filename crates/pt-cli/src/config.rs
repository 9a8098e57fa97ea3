//! Configuration file of the user: folders whose files all scenes may reference.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::{Context, Result, bail};

/// Environment variable with the path of the file, if it is not at the default place.
const VARIABLE: &str = "PATHTRACER_CONFIG";
/// The only option that the file may contain.
const OPTION: &str = "--allow-folder";

static FOLDERS: OnceLock<Vec<PathBuf>> = OnceLock::new();

/// Reads the configuration file, if there is one.
///
/// # Errors
/// If it cannot be read, is missing at the path given by the environment, or contains an invalid
/// line.
pub(crate) fn read() -> Result<()> {
    let named = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from);
    let usual = || dirs::config_dir().map(|folder| folder.join("pathtracer").join("config"));
    let Some(path) = named.clone().or_else(usual) else { return Ok(()) };
    if named.is_none() && !path.exists() {
        return Ok(());
    }
    let text = pathtracer::file::read(&path).and_then(text_of).with_context(|| {
        let by = if named.is_some() { format!(" (named by {VARIABLE})") } else { String::new() };
        format!("{}{by}: cannot read the configuration", path.display())
    })?;
    let folders = parse(&text, &path)?;
    FOLDERS.get_or_init(|| folders);
    Ok(())
}

fn text_of(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}

/// The folders that the configuration file allows.
pub(crate) fn allowed_folders() -> &'static Vec<PathBuf> {
    static NONE: Vec<PathBuf> = Vec::new();
    FOLDERS.get().unwrap_or(&NONE)
}

/// Parses the path of an existing folder.
///
/// # Errors
/// A message if the folder does not exist.
pub(crate) fn folder(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.is_dir() { Ok(path) } else { Err(format!("found no folder {text:?}")) }
}

/// Parses one option per line; empty lines and lines that begin with `#` are skipped.
fn parse(text: &str, path: &Path) -> Result<Vec<PathBuf>> {
    let mut folders = Vec::new();
    for (line, number) in text.lines().map(str::trim).zip(1..) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let place = format!("{}:{number}", path.display());
        let value = line.strip_prefix(OPTION).and_then(|rest| {
            let is_apart = rest.starts_with('=') || rest.starts_with(char::is_whitespace);
            is_apart.then(|| rest.trim_start_matches('=').trim().trim_matches('"'))
        });
        let Some(value) = value.filter(|value| !value.is_empty()) else {
            bail!("{place}: expected a line \"{OPTION} DIR\", found {line:?}");
        };
        let folder = PathBuf::from(value);
        if !folder.is_absolute() {
            bail!("{place}: expected the absolute path of a folder, found {value:?}");
        }
        folders.push(folder);
    }
    Ok(folders)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<PathBuf>, String> {
        parse(text, Path::new("config")).map_err(|error| error.to_string())
    }

    #[cfg(unix)]
    #[test]
    fn each_line_allows_a_folder() {
        let text = "# shared\n\n--allow-folder /a/b\n  --allow-folder=\"/c d\"\r\n";
        let folders = ["/a/b", "/c d"].map(PathBuf::from).to_vec();
        assert_eq!(read(text), Ok(folders));
    }

    #[test]
    fn other_lines_are_refused_with_their_number() {
        let refusal = |text| read(text).expect_err("a bad line");
        assert_eq!(
            refusal("# one\n--allow-outside"),
            "config:2: expected a line \"--allow-folder DIR\", found \"--allow-outside\""
        );
        assert!(refusal("--allow-folders /a").starts_with("config:1: expected"));
        assert!(refusal("--allow-folder").starts_with("config:1: expected"));
        assert!(
            refusal("--allow-folder a/b")
                .contains("expected the absolute path of a folder, found \"a/b\"")
        );
    }
}
