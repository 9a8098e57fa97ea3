//! Initial inputs of fuzzing: files of the project, and the words in them and in the messages of
//! the readers.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::project::root;

/// Folders with files of formats, below that of the workspace.
const SOURCES: [&str; 3] = ["tests/formats", "scenes", "fuzz/seeds"];
/// Maximum size of a seed in bytes: large ones take much time for little coverage.
const MAX_BYTES: u64 = 64 << 10;
/// Lengths of the words in the dictionary.
const LETTERS: std::ops::RangeInclusive<usize> = 2..=40;

/// Seeds of a target.
pub(super) struct Seeds {
    /// Folder of the seeds.
    pub folder: PathBuf,
    /// Number of seeds.
    pub count: usize,
    /// Dictionary of words, if there are any.
    pub dictionary: Option<PathBuf>,
}

/// Copies all files with an extension, and writes a dictionary of their words. The messages beside
/// bad files contain many names that the readers accept, directly from their tables; so does the
/// schema of JSON files.
///
/// # Errors
/// If files cannot be read or written.
pub(super) fn prepare(ending: &str, folder: &Path) -> Result<Seeds> {
    let mut sources = Vec::new();
    for folder in SOURCES {
        collect(&root().join(folder), ending, &mut sources)?;
    }
    let seeds = folder.join("seeds");
    std::fs::create_dir_all(&seeds).with_context(|| seeds.display().to_string())?;
    let mut words = BTreeSet::new();
    if ending == "json" {
        add_words(&root().join("docs/scene.schema.json"), &mut words)?;
    }
    for (number, file) in sources.iter().enumerate() {
        let copy = seeds.join(format!("{number}.{ending}"));
        std::fs::copy(file, &copy).with_context(|| file.display().to_string())?;
        add_words(file, &mut words)?;
        let messages = file.with_extension("expected");
        if messages.is_file() {
            add_words(&messages, &mut words)?;
        }
    }
    let dictionary = folder.join("dictionary");
    std::fs::write(&dictionary, lines(&words)).with_context(|| dictionary.display().to_string())?;
    // libFuzzer rejects a file without words.
    let dictionary = Some(dictionary).filter(|_| !words.is_empty());
    Ok(Seeds { folder: seeds, count: sources.len(), dictionary })
}

/// Collects the small files with an extension below a folder.
fn collect(folder: &Path, ending: &str, found: &mut Vec<PathBuf>) -> Result<()> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = entries.map(|e| Ok(e?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    for path in paths {
        if path.is_dir() {
            collect(&path, ending, found)?;
        } else if path.extension().is_some_and(|e| e == ending)
            && path.metadata().with_context(|| path.display().to_string())?.len() <= MAX_BYTES
        {
            found.push(path);
        }
    }
    Ok(())
}

/// Adds the words of a text file.
fn add_words(file: &Path, words: &mut BTreeSet<String>) -> Result<()> {
    let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
    let Ok(text) = String::from_utf8(bytes) else { return Ok(()) };
    let is_part = |c: char| c.is_ascii_alphanumeric() || "_-:#.".contains(c);
    let all = text.split(|c| !is_part(c)).map(|word| word.trim_end_matches(['.', ':']));
    let is_good = |word: &&str| {
        LETTERS.contains(&word.len()) && word.bytes().any(|b| b.is_ascii_alphabetic())
    };
    words.extend(all.filter(is_good).map(str::to_owned));
    Ok(())
}

/// Words in the format of libFuzzer. They have no characters that would need an escape.
fn lines(words: &BTreeSet<String>) -> String {
    words.iter().fold(String::new(), |mut text, word| {
        // Writing to a string cannot fail.
        writeln!(text, "\"{word}\"").ok();
        text
    })
}
