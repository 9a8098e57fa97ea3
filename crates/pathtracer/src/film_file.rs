//! Film files: samples of a render, from which it resumes, and which can be merged.
//!
//! A file consists of the line `pathtracer film 7`, the length of the header (u64, little endian),
//! the header as JSON ([`FilmHeader`]), the film ([`Film::write`]), and the BLAKE3 hash of all
//! preceding bytes (32 bytes). It is written beside its final path, with the suffix `.part`,
//! synchronised with the disk, and then renamed; the previous film is kept with the suffix `.old`.
//! One of the two is complete at any instant, whatever happens.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use pt_core::Film;
use pt_core::film::FilmError;
use pt_io::{file, folder_of, sync_folder};
use serde::{Deserialize, Serialize};

use crate::cryptomatte::MatteNames;
use crate::fingerprint::FingerprintEntry;

/// First line of a file.
const MAGIC: &[u8] = b"pathtracer film 7\n";

/// Common prefix of the first line in all versions.
const KIND: &[u8] = b"pathtracer film ";

/// Message for a file whose hash does not match.
const CHECKSUM: &str = "checksum mismatch";

/// Size in bytes from which on the hash of a file is checked before the file is read into memory.
const LARGE: u64 = 1 << 26;

/// Size of a hash in bytes.
const HASH: usize = blake3::OUT_LEN;

/// Header of a film file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FilmHeader {
    /// Version of the program.
    pub version: String,
    /// Files of the scene, each with the hash of its content.
    pub files: Vec<FingerprintEntry>,
    /// Files that the scene references and that could not be used, with place and reason.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// Names and values of everything that the samples depend on besides the scene.
    pub settings: Vec<FingerprintEntry>,
    /// End of the range of sample numbers that the render takes of each pixel, exclusive.
    pub spp: u32,
    /// Number of samples per pixel for which the points of the sampler are generated.
    pub layout: u32,
    /// True if all samples have been taken.
    pub finished: bool,
    /// Arguments of the program that made the film, without its name.
    pub command: Vec<String>,
    /// Folder in which the program ran.
    pub folder: PathBuf,
    /// Seal by which the user recognises the command as their own; empty if there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub seal: String,
    /// Wall-clock seconds of rendering so far.
    pub seconds: f64,
    /// Number of rays so far.
    pub rays: u64,
    /// Names of the objects and materials that the film counts.
    #[serde(default, skip_serializing_if = "MatteNames::is_empty")]
    pub names: MatteNames,
}

/// A film with its header.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFile {
    /// Header of the file.
    pub about: FilmHeader,
    /// The film.
    pub film: Film,
}

/// Reasons for which a film cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FilmFileError {
    /// The file does not exist or cannot be opened.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// The file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// The file is not a film.
    #[error(
        "{}: is not a film; expected a file that pathtracer has written beside an image, or for -f \
         NAME.film", .0.display()
    )]
    Kind(PathBuf),
    /// Another version of the program wrote it.
    #[error(
        "{}: film of another version of pathtracer, which this one ({}) cannot read",
        .0.display(), env!("CARGO_PKG_VERSION")
    )]
    Version(PathBuf),
    /// The content is not the one that was written.
    #[error("{}: is damaged: {what}; use a copy, or render again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Description of the damage.
        what: String,
    },
}

/// Path of the film of an image.
pub fn film_of_image(image: &Path) -> PathBuf {
    with_suffix(image, ".film")
}

/// Path at which the previous film is kept.
pub fn film_before(film: &Path) -> PathBuf {
    with_suffix(film, ".old")
}

/// Path of a film while it is written.
fn part_of(film: &Path) -> PathBuf {
    with_suffix(film, ".part")
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// Replaces a film that cannot be read with the previous one, so that the next film does not
/// replace the readable one.
///
/// # Errors
/// If the film cannot be renamed.
pub fn restore(path: &Path) -> Result<(), FilmFileError> {
    let failed = |source| FilmFileError::Write { path: path.to_owned(), source };
    fs::rename(film_before(path), path).map_err(failed)?;
    sync_folder(&folder_of(path)).map_err(failed)
}

/// Removes a film, the previous one, and an incomplete one that a killed process has left.
///
/// # Errors
/// If they exist and cannot be removed.
pub fn remove(path: &Path) -> Result<(), FilmFileError> {
    for path in [path.to_owned(), film_before(path), part_of(path)] {
        match fs::remove_file(&path) {
            Err(source) if source.kind() != ErrorKind::NotFound => {
                return Err(FilmFileError::Write { path, source });
            }
            _ => {}
        }
    }
    Ok(())
}

/// A film that was written, but is not yet synchronised with the disk and renamed.
#[derive(Debug)]
pub struct Written {
    file: File,
    path: PathBuf,
}

/// Writes a film beside its final path, to which [`Written::place`] renames it.
///
/// # Errors
/// If the film cannot be written; the existing film is kept.
pub fn write(path: &Path, about: &FilmHeader, film: &Film) -> Result<Written, FilmFileError> {
    let failed = |source| FilmFileError::Write { path: path.to_owned(), source };
    let part = part_of(path);
    // An existing file, link or pipe of this name is removed, not followed.
    match fs::remove_file(&part) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(failed(error)),
        _ => {}
    }
    let file = File::create_new(&part).map_err(failed)?;
    if let Err(error) = write_to(&file, about, film) {
        // The incomplete file is of no use; if it cannot be removed either, the first error is
        // returned.
        let _ = fs::remove_file(part);
        return Err(failed(error));
    }
    Ok(Written { file, path: path.to_owned() })
}

fn write_to(file: &File, about: &FilmHeader, film: &Film) -> io::Result<()> {
    let mut out = Hashing { out: BufWriter::new(file), hash: blake3::Hasher::new() };
    let text = serde_json::to_vec(about)?;
    out.write_all(MAGIC)?;
    out.write_all(&(text.len() as u64).to_le_bytes())?;
    out.write_all(&text)?;
    film.write(&mut out)?;
    let hash = out.hash.finalize();
    out.out.write_all(hash.as_bytes())?;
    out.out.flush()
}

impl Written {
    /// Waits for the disk, and renames the film; the film that had the name becomes the previous
    /// one.
    ///
    /// # Errors
    /// If that fails; then one of the two films is unchanged.
    pub fn place(self) -> Result<(), FilmFileError> {
        let Self { file, path } = self;
        let failed = |source| FilmFileError::Write { path: path.clone(), source };
        file.sync_all().map_err(failed)?;
        match fs::rename(&path, film_before(&path)) {
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(failed(e)),
            _ => {}
        }
        fs::rename(part_of(&path), &path).map_err(failed)?;
        sync_folder(&folder_of(&path)).map_err(failed)
    }
}

/// Reads a film.
///
/// # Errors
/// If the file cannot be read, is not a film of this version, or is damaged.
pub fn read(path: &Path) -> Result<FilmFile, FilmFileError> {
    let failed = |source| FilmFileError::Read { path: path.to_owned(), source };
    let damaged = |what| FilmFileError::Damaged { path: path.to_owned(), what };
    let length = file::length(path).map_err(failed)?;
    let mut beginning = Vec::new();
    let most = MAGIC.len() as u64;
    File::open(path)
        .and_then(|file| file.take(most).read_to_end(&mut beginning))
        .map_err(failed)?;
    if !beginning.starts_with(KIND) {
        return Err(FilmFileError::Kind(path.to_owned()));
    }
    if !beginning.starts_with(MAGIC) {
        return Err(FilmFileError::Version(path.to_owned()));
    }
    // A large file is checked before memory for it is allocated.
    if length >= LARGE && !is_whole(path, length).map_err(failed)? {
        return Err(damaged(CHECKSUM.to_owned()));
    }
    let bytes = file::read(path).map_err(failed)?;
    let _grant = pt_memory::ask(length)
        .map_err(|why| failed(io::Error::new(ErrorKind::OutOfMemory, why)))?;
    parse(&bytes).map_err(damaged)
}

/// Reads the newest film at a path or, if that is damaged or missing, the previous one, together
/// with the error of the newest. Returns `None` if there is neither.
///
/// # Errors
/// If films exist and none can be read: the error of the newest one.
pub fn read_newest(
    path: &Path,
) -> Result<Option<(FilmFile, Option<FilmFileError>)>, FilmFileError> {
    let newest = read(path);
    let error = match newest {
        Ok(film) => return Ok(Some((film, None))),
        Err(error) => error,
    };
    let is_missing = |error: &FilmFileError| matches!(error, FilmFileError::Read { source, .. } if source.kind() == ErrorKind::NotFound);
    match read(&film_before(path)) {
        Ok(before) => Ok(Some((before, Some(error)))),
        Err(before) if is_missing(&before) && is_missing(&error) => Ok(None),
        Err(before) if is_missing(&error) => Err(before),
        Err(_) => Err(error),
    }
}

/// Returns true if the hash at the end of a file is that of the preceding bytes.
fn is_whole(path: &Path, length: u64) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader((&mut file).take(length - HASH as u64))?;
    let mut hash = [0; HASH];
    file.read_exact(&mut hash)?;
    Ok(hasher.finalize() == hash)
}

/// Parses a file whose first line was checked; the error is a description of the damage.
fn parse(bytes: &[u8]) -> Result<FilmFile, String> {
    let (content, hash) =
        bytes.split_last_chunk::<HASH>().ok_or_else(|| "incomplete file".to_owned())?;
    if blake3::hash(content) != *hash {
        return Err(CHECKSUM.into());
    }
    let short = || "unexpected end of the header".to_owned();
    let (length, rest) =
        content.get(MAGIC.len()..).and_then(<[u8]>::split_first_chunk).ok_or_else(short)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| short())?;
    let (about, film) = rest.split_at_checked(length).ok_or_else(short)?;
    let about = serde_json::from_slice(about).map_err(|e| format!("invalid header: {e}"))?;
    let film = Film::read(film).map_err(|e: FilmError| e.to_string())?;
    Ok(FilmFile { about, film })
}

/// Returns the BLAKE3 hash of the bytes of a film in hexadecimal digits, which is the same for
/// films of the same samples.
///
/// # Panics
/// Never: writing to a hash cannot fail.
pub fn hash_of_film(film: &Film) -> String {
    let mut out = Hashing { out: io::sink(), hash: blake3::Hasher::new() };
    film.write(&mut out).expect("a hash takes all");
    out.hash.finalize().to_hex().to_string()
}

/// Writer that hashes all bytes it writes.
struct Hashing<W> {
    out: W,
    hash: blake3::Hasher,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use pt_core::Region;

    use super::*;

    fn about(seconds: f64) -> FilmHeader {
        let settings = vec![("max depth".into(), "5".into())];
        FilmHeader { version: "1".into(), settings, seconds, ..FilmHeader::default() }
    }

    fn film() -> Film {
        Film::new(Region::full([2, 1]))
    }

    fn save(path: &Path, seconds: f64) {
        write(path, &about(seconds), &film()).and_then(Written::place).expect("there is room");
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr.film");
        assert!(read_newest(&path).expect("there is none").is_none());
        save(&path, 0.1);
        let (file, trouble) = read_newest(&path).expect("it is whole").expect("it is there");
        assert_eq!(file, FilmFile { about: about(0.1), film: film() });
        assert!(trouble.is_none());
        let names = fs::read_dir(folder.path()).expect("it is there").count();
        assert_eq!(names, 1, "nothing else is left in the folder");
    }

    /// Whatever part of a film is lost or changed, the previous one is found, and the error
    /// reported.
    #[test]
    fn the_one_before_takes_the_place_of_a_damaged_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.film");
        save(&path, 1.0);
        save(&path, 2.0);
        let whole = fs::read(&path).expect("it is there");
        let newest = || {
            let (file, trouble) = read_newest(&path).expect("one is whole").expect("one is there");
            (file.about.seconds, trouble.is_some())
        };
        assert_eq!(newest(), (2.0, false));
        for end in 0..whole.len() {
            fs::write(&path, &whole[..end]).expect("there is room");
            assert_eq!(newest(), (1.0, true), "{end} bytes");
        }
        for place in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[place] ^= 1 << (place % 8);
            fs::write(&path, &bytes).expect("there is room");
            assert_eq!(newest(), (1.0, true), "byte {place}");
        }
        fs::remove_file(&path).expect("it is there");
        assert_eq!(newest(), (1.0, true));
        fs::write(film_before(&path), b"nothing").expect("there is room");
        assert!(matches!(read_newest(&path), Err(FilmFileError::Kind(_))));
    }

    #[test]
    fn other_files_and_versions_are_distinguished() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.film");
        let error = |bytes: &[u8]| {
            fs::write(&path, bytes).expect("there is room");
            read(&path).expect_err("it is no film")
        };
        assert!(matches!(error(b"P6 640 480"), FilmFileError::Kind(_)));
        assert!(matches!(error(b"pathtracer film 1\nmore"), FilmFileError::Version(_)));
        assert!(matches!(error(MAGIC), FilmFileError::Damaged { .. }));
    }
}
