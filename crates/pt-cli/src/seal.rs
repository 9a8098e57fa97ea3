//! Seals of films and images, which identify those that the program made for this user in this
//! place. A seal is the BLAKE3 hash of the place, the command and its folder, with a key that only
//! the user can read.

use std::ffi::OsStr;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use pathtracer::file::resolved;

/// Bytes of a key.
const KEY: usize = blake3::KEY_LEN;

/// Returns the seal of a command that writes an output, or an empty string if no key can be stored.
pub(crate) fn of(output: &Path, folder: &Path, command: &[String]) -> String {
    key().map_or(String::new(), |key| hash(&key, output, folder, command).to_hex().to_string())
}

/// Returns true if a seal is that of this user for this output and command.
pub(crate) fn is_ours(seal: &str, output: &Path, folder: &Path, command: &[String]) -> bool {
    let (Ok(found), Some(key)) = (blake3::Hash::from_hex(seal), key()) else { return false };
    hash(&key, output, folder, command) == found
}

fn hash(key: &[u8; KEY], output: &Path, folder: &Path, command: &[String]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new_keyed(key);
    let output = resolved(output);
    let words = command.iter().map(String::as_bytes);
    let parts = [output.as_os_str(), folder.as_os_str()].map(OsStr::as_encoded_bytes);
    for part in parts.into_iter().chain(words) {
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
    }
    hasher.finalize()
}

/// Returns the key of the user, which is created at first use, or `None` if it cannot be stored.
fn key() -> Option<[u8; KEY]> {
    let folder = dirs::data_local_dir()?.join("pathtracer");
    let path = folder.join("key");
    let read = || <[u8; KEY]>::try_from(pathtracer::file::read(&path).ok()?).ok();
    read().or_else(|| {
        let mut key = [0; KEY];
        getrandom::fill(&mut key).ok()?;
        fs::create_dir_all(&folder).and_then(|()| write(&path, &key)).ok()?;
        // Another process may have written its key first.
        read()
    })
}

fn write(path: &Path, key: &[u8]) -> io::Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)?.write_all(key)
}
