//! Films in files: what a render has so far, from which it can go on, and which can be added up.
//!
//! A file is the line `pathtracer film 7`, the length of what it says about itself (u64, little
//! endian), that as JSON ([`FilmHeader`]), the film ([`Film::write`]), and the BLAKE3 hash of all
//! before it (32 bytes). It is written beside its place, with `.part` behind its name, synchronised
//! with the disk, and then takes the name, while the one that had it before is kept with `.old`
//! behind it: whatever happens at whatever instant, one of the two is whole.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use pt_core::Film;
use pt_core::film::FilmError;
use pt_scene::file;
use pt_scene::image::{folder_of, sync_folder};
use serde::{Deserialize, Serialize};

use crate::cryptomatte::Names;
use crate::fingerprint::Entry;

/// The first line of a file.
const MAGIC: &[u8] = b"pathtracer film 7\n";

/// What all versions of it begin with.
const KIND: &[u8] = b"pathtracer film ";

/// What is wrong with a file whose hash is another.
const CHECKSUM: &str = "its checksum is another than that of what it holds";

/// Bytes from which on a file is checked before it is read.
const LARGE: u64 = 1 << 26;

/// Bytes of a hash.
const HASH: usize = blake3::OUT_LEN;

/// What a film says about itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FilmHeader {
    /// Version of the program.
    pub version: String,
    /// The files of which the scene was read, each with the hash of what it held.
    pub files: Vec<Entry>,
    /// Files that the scene names and that could not be used, where and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// All that the samples depend on besides the scene: names and values.
    pub settings: Vec<Entry>,
    /// The number behind that of the last sample that the render takes of each pixel.
    pub spp: u32,
    /// Samples of each pixel for which random numbers are laid out.
    pub layout: u32,
    /// True if it has all that it takes.
    pub finished: bool,
    /// Arguments of the program that made it, without its name.
    pub command: Vec<String>,
    /// The folder in which it ran.
    pub folder: PathBuf,
    /// What shows its user that the command is theirs; empty if nothing does.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub seal: String,
    /// Wall-clock seconds of rendering so far.
    pub seconds: f64,
    /// Rays so far.
    pub rays: u64,
    /// The names of what it counts.
    #[serde(default, skip_serializing_if = "Names::is_empty")]
    pub names: Names,
}

/// A film with what it says about itself.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFile {
    /// What it says.
    pub about: FilmHeader,
    /// The film.
    pub film: Film,
}

/// Why a film cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FilmFileError {
    /// There is no such file, or it cannot be opened.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is something else.
    #[error("{}: is no film; expected a file that pathtracer has written beside an image, or for -f NAME.film", .0.display())]
    Kind(PathBuf),
    /// Another version of the program wrote it.
    #[error("{}: is a film of another version of pathtracer, which this one ({}) cannot read", .0.display(), env!("CARGO_PKG_VERSION"))]
    Version(PathBuf),
    /// It is not what was written.
    #[error("{}: is damaged: {what}; take a copy of it, or render again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// How that is known.
        what: String,
    },
}

/// The film that belongs to an image.
pub fn film_of_image(image: &Path) -> PathBuf {
    with_suffix(image, ".film")
}

/// The one before it, which is kept.
pub fn film_before(film: &Path) -> PathBuf {
    with_suffix(film, ".old")
}

/// Where a film is while it is written.
fn part_of(film: &Path) -> PathBuf {
    with_suffix(film, ".part")
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// Puts the film before in the place of one that cannot be read, so that the next one does not take
/// the place of the one that can.
///
/// # Errors
/// If that cannot be done.
pub fn restore(path: &Path) -> Result<(), FilmFileError> {
    let failed = |source| FilmFileError::Write { path: path.to_owned(), source };
    fs::rename(film_before(path), path).map_err(failed)?;
    sync_folder(&folder_of(path)).map_err(failed)
}

/// Removes a film, the one before, and what a program that was killed left of another.
///
/// # Errors
/// If they are there and cannot be removed.
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

/// A film that is written, and waits for the disk.
#[derive(Debug)]
pub struct Written {
    file: File,
    path: PathBuf,
}

/// Writes a film beside its place, where it will be once [`Written::place`] is done.
///
/// # Errors
/// If that cannot be done; what was there stays.
pub fn write(path: &Path, about: &FilmHeader, film: &Film) -> Result<Written, FilmFileError> {
    let failed = |source| FilmFileError::Write { path: path.to_owned(), source };
    let part = part_of(path);
    // What has this name is no link or pipe that would be followed.
    match fs::remove_file(&part) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(failed(error)),
        _ => {}
    }
    let file = File::create_new(&part).map_err(failed)?;
    if let Err(error) = write_to(&file, about, film) {
        // What is left of it is of no use; if it cannot even be removed, the first error says why.
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
    /// Waits until the disk has it, and gives it its name; the film that had it is the one before
    /// now.
    ///
    /// # Errors
    /// If that cannot be done; then one of the two is as it was.
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
/// If it cannot be read, or is not what was written.
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
    // What nobody wrote is found out without the memory that it would take.
    if length >= LARGE && !is_whole(path, length).map_err(failed)? {
        return Err(damaged(CHECKSUM.to_owned()));
    }
    let bytes = file::read(path).map_err(failed)?;
    let _grant = pt_memory::ask(length)
        .map_err(|why| failed(io::Error::new(ErrorKind::OutOfMemory, why)))?;
    parse(&bytes).map_err(damaged)
}

/// The newest film of a place: the one that is there or, if that is damaged or lost, the one
/// before, and then the reason as well. `None` if there is neither.
///
/// # Errors
/// If there are some, of which none can be read: that of the newest one.
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

/// Returns true if the hash at the end of a file is that of what is before it.
fn is_whole(path: &Path, length: u64) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader((&mut file).take(length - HASH as u64))?;
    let mut hash = [0; HASH];
    file.read_exact(&mut hash)?;
    Ok(hasher.finalize() == hash)
}

/// A file that begins as one does; else what is wrong.
fn parse(bytes: &[u8]) -> Result<FilmFile, String> {
    let (content, hash) =
        bytes.split_last_chunk::<HASH>().ok_or_else(|| "it is not whole".to_owned())?;
    if blake3::hash(content) != *hash {
        return Err(CHECKSUM.into());
    }
    let short = || "it ends within what it says about itself".to_owned();
    let (length, rest) =
        content.get(MAGIC.len()..).and_then(<[u8]>::split_first_chunk).ok_or_else(short)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| short())?;
    let (about, film) = rest.split_at_checked(length).ok_or_else(short)?;
    let about =
        serde_json::from_slice(about).map_err(|e| format!("what it says about itself: {e}"))?;
    let film = Film::read(film).map_err(|e: FilmError| e.to_string())?;
    Ok(FilmFile { about, film })
}

/// The BLAKE3 hash of a film's bytes, in hexadecimal digits: the same for films of the same
/// samples.
///
/// # Panics
/// Never: nothing is written anywhere.
pub fn hash_of_film(film: &Film) -> String {
    let mut out = Hashing { out: io::sink(), hash: blake3::Hasher::new() };
    film.write(&mut out).expect("a hash takes all");
    out.hash.finalize().to_hex().to_string()
}

/// Hashes all that it writes.
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
    use super::*;
    use pt_core::Region;

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

    /// Whatever part of a film a disk lost or changed, the one before is found, and why.
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
    fn other_files_and_versions_are_told_apart() {
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
