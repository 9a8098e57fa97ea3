//! Names of the images of a sequence.

use std::path::{Path, PathBuf};

use crate::sequence_args::SequenceArgs;

/// Maximum number of digits of a number in a name.
const MAX_DIGITS: usize = 32;

/// Replaces `%d`, or `%04d` for at least four digits, in a name; `None` if it has neither.
pub(crate) fn numbered(pattern: &Path, number: u32) -> Option<PathBuf> {
    let text = pattern.to_str()?;
    let place = |(at, _): (usize, &str)| {
        let digits = text[at + 1..].find(|c: char| !c.is_ascii_digit())?;
        let (width, after) = text[at + 1..].split_at(digits);
        let width = if width.is_empty() { 0 } else { width.parse().ok()? };
        let after = after.strip_prefix('d').filter(|_| width <= MAX_DIGITS)?;
        Some(format!("{}{number:0width$}{after}", &text[..at]).into())
    };
    text.match_indices('%').find_map(place)
}

/// Arguments without the options of a sequence, and with the name of an image in place of the
/// pattern.
pub(crate) fn without_options(words: &[String], pattern: &Path, image: &Path) -> Vec<String> {
    let mut kept = Vec::new();
    let mut rest = words.iter();
    let pattern = pattern.to_string_lossy();
    let is_option = |word: &str| SequenceArgs::OPTIONS.contains(&word);
    while let Some(word) = rest.next() {
        if is_option(word) {
            rest.next();
        } else if word.split_once('=').is_none_or(|(name, _)| !is_option(name)) {
            let before = word.strip_suffix(pattern.as_ref()).filter(|_| pattern.contains('%'));
            kept.push(match before {
                Some(before) => format!("{before}{}", image.display()),
                None => word.clone(),
            });
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_of_the_pattern() {
        for (pattern, expected) in [
            ("a/%04d.png", Some("a/0007.png")),
            ("%d_b.exr", Some("7_b.exr")),
            ("a%2d.png", Some("a07.png")),
            ("50%_%03d.png", Some("50%_007.png")),
            ("a.png", None),
            ("a%s.png", None),
            ("a%999d.png", None),
            ("a%", None),
        ] {
            assert_eq!(numbered(Path::new(pattern), 7), expected.map(PathBuf::from), "{pattern}");
        }
        assert_eq!(numbered(Path::new("%03d.png"), 12345), Some("12345.png".into()));
    }

    #[test]
    fn commands_of_images_stand_alone() {
        let of = |command: &str| {
            let words: Vec<_> = command.split(' ').map(str::to_owned).collect();
            without_options(&words, Path::new("o%d.png"), Path::new("o3.png")).join(" ")
        };
        assert_eq!(of("-s 4 --cameras all -f o%d.png a.glb"), "-s 4 -f o3.png a.glb");
        assert_eq!(of("--frames=1..4 --fps 12 -fo%d.png a.glb"), "-fo3.png a.glb");
        assert_eq!(of("--output=o%d.png --cameras=a,b"), "--output=o3.png");
    }
}
