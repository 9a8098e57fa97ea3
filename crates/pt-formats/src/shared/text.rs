//! Encoding of text files: byte-order marks, line breaks, and continued lines.

use std::borrow::Cow;
use std::path::Path;

use super::mesh_file;
use crate::LoadError;

/// Byte-order mark of UTF-8, which some editors write. [The Unicode Standard 15.0, §23.8]
const MARK: &[u8] = b"\xEF\xBB\xBF";

/// Removes the byte-order mark of UTF-8, and converts text in UTF-16 or UTF-32 to UTF-8: files that
/// begin with a mark, or whose first two characters are ASCII.
///
/// # Errors
/// Returns an error if such a text ends within a character, or has invalid code points.
pub(crate) fn unmarked<'a>(bytes: &'a [u8], path: &Path) -> Result<Cow<'a, [u8]>, LoadError> {
    let (rest, unit): (_, Unit) = match bytes {
        [0xFF, 0xFE, 0, 0, rest @ ..] => (rest, Unit::Four(u32::from_le_bytes)),
        [0, 0, 0xFE, 0xFF, rest @ ..] => (rest, Unit::Four(u32::from_be_bytes)),
        [0xFF, 0xFE, rest @ ..] => (rest, Unit::Two(u16::from_le_bytes)),
        [0xFE, 0xFF, rest @ ..] => (rest, Unit::Two(u16::from_be_bytes)),
        [1..=0x7F, 0, 1..=0x7F, 0, ..] => (bytes, Unit::Two(u16::from_le_bytes)),
        [0, 1..=0x7F, 0, 1..=0x7F, ..] => (bytes, Unit::Two(u16::from_be_bytes)),
        _ => return Ok(Cow::Borrowed(bytes.strip_prefix(MARK).unwrap_or(bytes))),
    };
    let text = unit.text(rest).ok_or_else(|| {
        let message = format!(
            "found invalid {} text; save it as UTF-8",
            if matches!(unit, Unit::Two(_)) { "UTF-16" } else { "UTF-32" }
        );
        mesh_file::error(path, 0, message)
    })?;
    Ok(Cow::Owned(text.into_bytes()))
}

/// Decoder of the code units of a text.
#[derive(Clone, Copy)]
enum Unit {
    Two(fn([u8; 2]) -> u16),
    Four(fn([u8; 4]) -> u32),
}

impl Unit {
    /// Decodes a text; `None` if it is invalid.
    fn text(self, bytes: &[u8]) -> Option<String> {
        match self {
            Self::Two(of) => {
                let (units, rest) = bytes.as_chunks();
                let text = char::decode_utf16(units.iter().map(|unit| of(*unit)));
                rest.is_empty().then(|| text.collect::<Result<_, _>>().ok())?
            }
            Self::Four(of) => {
                let (units, rest) = bytes.as_chunks();
                let text = units.iter().map(|unit| char::from_u32(of(*unit)));
                rest.is_empty().then(|| text.collect())?
            }
        }
    }
}

/// Removes the byte-order mark of a text, and converts line ends to line feeds, including carriage
/// returns without a line feed.
///
/// # Errors
/// Returns the errors of [`unmarked`].
pub(crate) fn lines<'a>(bytes: &'a [u8], path: &Path) -> Result<Cow<'a, [u8]>, LoadError> {
    Ok(match unmarked(bytes, path)? {
        Cow::Borrowed(bytes) => with_line_feeds(bytes),
        Cow::Owned(bytes) => Cow::Owned(with_line_feeds(&bytes).into_owned()),
    })
}

/// Converts a text as [`lines`] does, to characters: invalid UTF-8 becomes U+FFFD.
///
/// # Errors
/// Returns the errors of [`unmarked`].
pub(crate) fn characters<'a>(bytes: &'a [u8], path: &Path) -> Result<Cow<'a, str>, LoadError> {
    Ok(match lines(bytes, path)? {
        Cow::Borrowed(bytes) => String::from_utf8_lossy(bytes),
        Cow::Owned(bytes) => Cow::Owned(String::from_utf8_lossy(&bytes).into_owned()),
    })
}

/// Converts a text as [`lines`] does, and joins lines that end with a backslash to the following
/// ones. Empty lines are inserted after joined lines to keep the numbers of all others. Comments
/// (from a `#` that begins a word) are not continued, since they may end with the path of a folder.
///
/// # Errors
/// Returns the errors of [`unmarked`].
pub(crate) fn joined_lines<'a>(bytes: &'a [u8], path: &Path) -> Result<Cow<'a, [u8]>, LoadError> {
    let text = lines(bytes, path)?;
    if !memchr::memchr_iter(b'\\', &text).any(|at| ends_line(&text[at + 1..])) {
        return Ok(text);
    }
    let (mut joined, mut pending) = (Vec::with_capacity(text.len()), 0);
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        if let Some(start) = continued(line) {
            joined.extend_from_slice(start);
            joined.push(b' ');
            pending += 1;
        } else {
            joined.extend_from_slice(line);
            joined.extend(std::iter::repeat_n(b'\n', std::mem::take(&mut pending)));
        }
    }
    Ok(Cow::Owned(joined))
}

/// Returns the text before the backslash of a continued line; `None` for other lines.
fn continued(line: &[u8]) -> Option<&[u8]> {
    let start = line.strip_suffix(b"\n")?.trim_ascii_end().strip_suffix(b"\\")?;
    let begins_word = |at: usize| at == 0 || start[at - 1].is_ascii_whitespace();
    let is_comment = memchr::memchr_iter(b'#', start).any(begins_word);
    (!is_comment).then_some(start)
}

/// Returns true if only blanks follow on the line.
fn ends_line(rest: &[u8]) -> bool {
    rest.iter().find(|byte| !matches!(byte, b' ' | b'\t' | b'\r')) == Some(&b'\n')
}

/// Replaces carriage returns without a line feed by line feeds.
pub(crate) fn with_line_feeds(bytes: &[u8]) -> Cow<'_, [u8]> {
    let is_alone = |at: &usize| bytes.get(at + 1) != Some(&b'\n');
    let Some(first) = memchr::memchr_iter(b'\r', bytes).find(is_alone) else {
        return Cow::Borrowed(bytes);
    };
    let mut text = bytes.to_vec();
    for at in memchr::memchr_iter(b'\r', &bytes[first..]).map(|at| first + at).filter(is_alone) {
        text[at] = b'\n';
    }
    Cow::Owned(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_all_encodings_become_utf_8() {
        let read = |bytes: &'static [u8]| {
            let text = unmarked(bytes, Path::new("a")).map(Cow::into_owned);
            text.map(|text| String::from_utf8(text).expect("UTF-8")).map_err(|e| e.to_string())
        };
        for bytes in [
            &b"v 1\xC3\xA9"[..],
            b"\xEF\xBB\xBFv 1\xC3\xA9",
            b"\xFF\xFEv\0 \x001\0\xE9\0",
            b"\xFE\xFF\0v\0 \x001\0\xE9",
            b"v\0 \x001\0\xE9\0",
            b"\0v\0 \x001\0\xE9",
            b"\xFF\xFE\0\0v\0\0\0 \0\0\x001\0\0\0\xE9\0\0\0",
            b"\0\0\xFE\xFF\0\0\0v\0\0\0 \0\0\x001\0\0\0\xE9",
        ] {
            assert_eq!(read(bytes).as_deref(), Ok("v 1\u{e9}"), "{bytes:?}");
        }
        // Half of a surrogate pair, an incomplete character, and an invalid code point.
        for (bytes, named) in [
            (&b"\xFF\xFEv\0\x00\xD8"[..], "UTF-16"),
            (b"v\0 \x001", "UTF-16"),
            (b"\xFF\xFE\0\0\0\0\x11\0", "UTF-32"),
        ] {
            let message = read(bytes).expect_err("no text");
            assert!(message.contains(named), "{message}");
        }
    }

    /// A carriage return without a line feed ends a line; before a line feed, it is part of the
    /// line end.
    #[test]
    fn each_line_ends_in_a_line_feed() {
        for (text, expected) in
            [("a\nb\r\nc", "a\nb\r\nc"), ("a\rb\r\rc\r", "a\nb\n\nc\n"), ("a\r\nb\rc", "a\r\nb\nc")]
        {
            assert_eq!(&*with_line_feeds(text.as_bytes()), expected.as_bytes());
        }
    }

    /// Lines of a text, joined where continued; the others keep their line numbers.
    #[test]
    fn lines_that_are_continued_keep_the_numbers_of_others() {
        let join = |text: &str| {
            let joined = joined_lines(text.as_bytes(), Path::new("a")).expect("UTF-8").into_owned();
            String::from_utf8(joined).expect("UTF-8")
        };
        assert_eq!(join("v 0 \\\n 1\\\r\n2\nf"), "v 0   1 2\n\n\nf");
        assert_eq!(join("v 0 \\ \n1"), "v 0  1\n");
        assert_eq!(join("v 0 \\\r1\rf"), "v 0  1\n\nf");
        for text in ["# C:\\models\\\nv 1", "v 1 # a \\\nv", "map_Kd a\\b\n", "v \\"] {
            assert_eq!(join(text), text);
        }
        assert_eq!(join("usemtl a#\\\nb"), "usemtl a# b\n");
    }
}
