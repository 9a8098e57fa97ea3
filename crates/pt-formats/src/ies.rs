//! Luminous intensity distributions of luminaires (`.ies`).
//!
//! The format is that of the Illuminating Engineering Society. [IES LM-63-1986, -1991, -1995 and
//! ANSI/IESNA LM-63-2002] Lines of keywords end with `TILT=NONE`; then follow numbers, independent
//! of line breaks:
//!
//! ```text
//! lamps  lumens per lamp  multiplier  vertical angles  horizontal angles
//! photometric type  units  width  length  height
//! ballast factor  ballast-lamp factor  watts
//! the vertical angles, the horizontal angles, and candela: all vertical angles of the first
//! horizontal angle, then of the next …
//! ```

use std::path::Path;

use pt_scene::{IesProfile, Span};

use crate::LoadError;

/// Maximum number of values of a file.
const MAX_VALUES: usize = 1 << 24;

/// Maximum candela, more than any lamp has, so that the sum over a file is finite: searchlights
/// have 10⁹.
const MAX_CANDELA: f32 = 1e15;

/// Reads a file.
///
/// # Errors
/// Returns an error if the file cannot be read, and the errors of [`parse`].
pub fn load(path: &Path) -> Result<IesProfile, LoadError> {
    let bytes = pt_io::file::read(path)
        .map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
    parse(&bytes, path)
}

/// Reads the content of a file; `path` is used for messages.
///
/// # Errors
/// Returns an error if the format is another one, the lamps have a tilt that changes the
/// intensities, the angles are not of type C or do not cover all directions around the axis, or
/// numbers are missing or out of range.
pub fn parse(bytes: &[u8], path: &Path) -> Result<IesProfile, LoadError> {
    let text = crate::shared::text::characters(bytes, path)?;
    let mut numbers = IesNumbers::new(&text, path)?;
    let header = IesHeader::read(&mut numbers)?;
    let (vertical, _) = numbers.angles("vertical", header.vertical)?;
    let (horizontal, line) = numbers.angles("horizontal", header.horizontal)?;
    let last = |angles: &[f32]| angles.last().copied().unwrap_or_default();
    if vertical[0] < 0.0 || last(&vertical) > 180.0 {
        let message = "found vertical angles outside of 0° to 180°, the range of type C";
        return Err(numbers.error(line, message));
    }
    let mut candela = Vec::with_capacity(header.vertical * header.horizontal);
    for _ in 0..header.vertical * header.horizontal {
        let (value, line) = numbers.next("candela")?;
        let value = (value * header.factor) as f32;
        if !(0.0..=MAX_CANDELA).contains(&value) {
            let message = format!("found {value} candela, expected 0 to {MAX_CANDELA:e}");
            return Err(numbers.error(line, message));
        }
        candela.push(value);
    }
    all_around(vertical, &horizontal, &candela).ok_or_else(|| {
        let message =
            "found other ranges of horizontal angles, expected 0 to 0, 90, 180 or 360, or 90 to \
             270";
        numbers.error(line, message)
    })
}

/// Completes the horizontal angles by symmetry; `None` if they match no symmetry of the format.
fn all_around(vertical: Vec<f32>, horizontal: &[f32], candela: &[f32]) -> Option<IesProfile> {
    let (first, last) = (*horizontal.first()?, *horizontal.last()?);
    // Angles of the full turn, each with the index of the given angle of which it is the mirror
    // image.
    let n = horizontal.len();
    let reflect = |planes: &[f32]| {
        let mut all: Vec<(f32, usize)> = horizontal.iter().copied().zip(0..).collect();
        for &plane in planes {
            let mirrored: Vec<_> = all.iter().map(|&(a, i)| (2.0 * plane - a, i)).collect();
            all.extend(mirrored);
        }
        all
    };
    let mut all = match (first, last) {
        (0.0, 0.0) => vec![(0.0, 0), (360.0, 0)],
        (0.0, 90.0) => reflect(&[90.0, 180.0]),
        (0.0, 180.0) => reflect(&[180.0]),
        (0.0, 360.0) => (0..n).map(|i| (horizontal[i], i)).collect(),
        (90.0, 270.0) => {
            let mut all = reflect(&[90.0]);
            for (angle, _) in &mut all {
                *angle = if *angle < 0.0 { *angle + 360.0 } else { *angle };
            }
            all.extend(all.clone().iter().filter(|(a, _)| *a == 0.0).map(|&(_, i)| (360.0, i)));
            all
        }
        _ => return None,
    };
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by_key(|entry| entry.0);
    let turn = vertical.len();
    let angles = all.iter().map(|entry| entry.0).collect();
    let turns = all.iter().flat_map(|&(_, i)| candela[i * turn..(i + 1) * turn].iter().copied());
    let values = turns.collect();
    Some(IesProfile::of_table(vertical, angles, values))
}

/// Numbers before the angles.
struct IesHeader {
    vertical: usize,
    horizontal: usize,
    /// Factor of all candela.
    factor: f64,
}

impl IesHeader {
    fn read(numbers: &mut IesNumbers<'_>) -> Result<Self, LoadError> {
        numbers.next("the number of lamps")?;
        numbers.next("the lumens per lamp")?;
        let (multiplier, _) = numbers.next("the multiplier of candela")?;
        let vertical = numbers.count("vertical angles")?;
        let horizontal = numbers.count("horizontal angles")?;
        let (kind, line) = numbers.next("the photometric type")?;
        if kind != 1.0 {
            let message = format!("found photometric type {kind}, expected 1 (type C)");
            return Err(numbers.error(line, message));
        }
        for what in ["the units", "the width", "the length", "the height"] {
            numbers.next(what)?;
        }
        let (ballast, _) = numbers.next("the ballast factor")?;
        let (ballast_lamp, line) = numbers.next("the ballast-lamp factor")?;
        numbers.next("the watts")?;
        if vertical.saturating_mul(horizontal) > MAX_VALUES {
            let message = format!(
                "found {vertical} × {horizontal} angles, which is more than the supported number"
            );
            return Err(numbers.error(line, message));
        }
        Ok(Self { vertical, horizontal, factor: multiplier * ballast * ballast_lamp })
    }
}

/// The numbers after the keywords, with their lines.
struct IesNumbers<'a> {
    words: std::vec::IntoIter<(&'a str, u32)>,
    path: &'a Path,
    /// The last line of the file.
    last: u32,
}

impl<'a> IesNumbers<'a> {
    fn new(text: &'a str, path: &'a Path) -> Result<Self, LoadError> {
        let mut lines = text.lines().zip(1u32..);
        let error = |line, message: String| {
            let at = Span { file: path.to_owned(), line, ..Span::default() };
            LoadError::Content { at, message }
        };
        let tilt = lines.by_ref().find_map(|(line, at)| {
            let value = line.trim().strip_prefix("TILT=")?;
            Some((value.trim(), at))
        });
        match tilt {
            Some(("NONE", _)) => {}
            Some((other, at)) => {
                let message = format!("found TILT={other}, expected TILT=NONE");
                return Err(error(at, message));
            }
            None => {
                let message = "missing line TILT=NONE; expected a photometric file of LM-63";
                return Err(error(0, message.to_owned()));
            }
        }
        let words: Vec<_> = lines
            .flat_map(|(line, at)| {
                let words = line.split(|c: char| c.is_ascii_whitespace() || c == ',');
                words.filter(|w| !w.is_empty()).map(move |w| (w, at))
            })
            .collect();
        Ok(Self { words: words.into_iter(), path, last: text.lines().count() as u32 })
    }

    fn error(&self, line: u32, message: impl Into<String>) -> LoadError {
        let at = Span { file: self.path.to_owned(), line, ..Span::default() };
        LoadError::Content { at, message: message.into() }
    }

    /// Reads a finite number, and returns its line as well.
    fn next(&mut self, what: &str) -> Result<(f64, u32), LoadError> {
        let Some((word, line)) = self.words.next() else {
            return Err(
                self.error(self.last, format!("found the end of the file, expected {what}"))
            );
        };
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok((number, line)),
            _ => Err(self.error(line, format!("found \"{word}\", expected {what}"))),
        }
    }

    /// Reads an integer from 1.
    fn count(&mut self, what: &str) -> Result<usize, LoadError> {
        let (number, line) = self.next(&format!("the number of {what}"))?;
        let is_count = number >= 1.0 && number.fract() == 0.0 && number <= MAX_VALUES as f64;
        if is_count {
            return Ok(number as usize);
        }
        let message =
            format!("found {number} {what}, expected a whole number from 1 to {MAX_VALUES}");
        Err(self.error(line, message))
    }

    /// Reads increasing angles, and returns the line of the last one as well.
    fn angles(&mut self, what: &str, count: usize) -> Result<(Vec<f32>, u32), LoadError> {
        let mut angles: Vec<f32> = Vec::new();
        let mut last_line = 0;
        for _ in 0..count {
            let (angle, line) = self.next(&format!("a {what} angle"))?;
            let angle = angle as f32;
            if angles.last().is_some_and(|&before| angle <= before) {
                let message = format!(
                    "found {what} angles that do not increase at {angle}, expected increasing \
                     angles"
                );
                return Err(self.error(line, message));
            }
            angles.push(angle);
            last_line = line;
        }
        Ok((angles, last_line))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a file with vertical angles 0, 45 and 90, and these horizontal angles; 100 h + v
    /// candela at the h-th and v-th angle, times a multiplier of 2, 0.5 and 3.
    fn file(horizontal: &str) -> String {
        let count = horizontal.split_whitespace().count();
        let candela: Vec<_> =
            (0..count).map(|h| format!("{} {} {}", 100 * h, 100 * h + 1, 100 * h + 2)).collect();
        format!(
            "IESNA:LM-63-2002\r\n[TEST] ours\r\nTILT=NONE\r\n1 -1 2 3 {count} 1 2\r\n0 0, 0\r\n\
             0.5 3 60\r\n0 45 90\r\n{horizontal}\r\n{}\r\n",
            candela.join("\r\n")
        )
    }

    fn parse(text: &str) -> Result<IesProfile, String> {
        super::parse(text.as_bytes(), Path::new("a.ies")).map_err(|e| e.to_string())
    }

    #[test]
    fn intensities_are_linear_between_angles_and_multiplied() {
        let profile = parse(&file("0 90 180 270 360")).unwrap();
        let cases = [
            (0.0, 0.0, 0.0),
            (45.0, 90.0, 101.0),
            (22.5, 90.0, 100.5),
            (90.0, 315.0, 352.0),
            (90.1, 0.0, 0.0),
        ];
        for (vertical, horizontal, want) in cases {
            let got = profile.candela(vertical, horizontal);
            assert!((got - 3.0 * want).abs() < 1e-3, "{vertical} {horizontal}: {got}");
        }
    }

    /// Byte-order marks and line ends of some editors and old machines.
    #[test]
    fn marks_of_byte_order_and_ends_of_lines_do_not_matter() {
        let plain = parse(&file("0 90 180")).expect("a good file");
        for text in [
            format!("\u{feff}{}", file("0 90 180")),
            file("0 90 180").replace("\r\n", "\r"),
            file("0 90 180").replace("\r\n", "\n"),
        ] {
            assert_eq!(parse(&text), Ok(plain.clone()), "{text:?}");
        }
    }

    #[test]
    fn symmetries_go_all_around() {
        // Given angles, and pairs of an angle and its intensity over 100.
        let cases: [(&str, &[(f32, f32)]); 4] = [
            ("0", &[(0.0, 0.0), (77.0, 0.0), (360.0, 0.0)]),
            ("0 45 90", &[(45.0, 1.0), (135.0, 1.0), (225.0, 1.0), (270.0, 2.0), (360.0, 0.0)]),
            ("0 60 180", &[(60.0, 1.0), (300.0, 1.0), (360.0, 0.0), (180.0, 2.0)]),
            ("90 180 270", &[(90.0, 0.0), (180.0, 1.0), (0.0, 1.0), (360.0, 1.0), (270.0, 2.0)]),
        ];
        for (horizontal, pairs) in cases {
            let profile = parse(&file(horizontal)).unwrap();
            for &(angle, want) in pairs {
                let got = profile.candela(0.0, angle);
                assert!((got - 300.0 * want).abs() < 1e-3, "{horizontal} at {angle}: {got}");
            }
        }
    }

    #[test]
    fn bad_files_are_refused_with_their_line() {
        let good = file("0 90");
        let change = |from: &str, to: &str| good.replacen(from, to, 1);
        let cases = [
            (change("TILT=NONE", "TILT=INCLUDE"), "a.ies:3: found TILT=INCLUDE"),
            (change("TILT=NONE", "LAMP"), "missing line TILT=NONE"),
            (change(" 1 2\r\n", " 2 2\r\n"), "a.ies:4: found photometric type 2"),
            (
                change("0 45 90", "0 45 45"),
                "a.ies:7: found vertical angles that do not increase at 45",
            ),
            (change("0 45 90", "0 45 190"), "vertical angles outside of 0° to 180°"),
            (change("0 90", "0 80"), "a.ies:8: found other ranges of horizontal angles"),
            (change("100 101", "100 x"), "a.ies:10: found \"x\", expected candela"),
            (change("100 101", "100 -1"), "-3 candela"),
            // The sum of such a table would be infinite.
            (change("100 101", "100 1e38"), "candela, expected 0 to 1e15"),
            (change("100 101 102", ""), "found the end of the file, expected candela"),
            (change("1 -1 2 3 2", "1 -1 2 3.5 2"), "3.5 vertical angles"),
            (change("1 -1 2 3 2", "1 -1 2 9999999 9999999"), "more than the supported number"),
            (String::new(), "missing line TILT=NONE"),
        ];
        for (text, want) in cases {
            let message = parse(&text).unwrap_err();
            assert!(message.contains(want), "{message} lacks {want}");
        }
    }

    /// No truncated file causes a panic; except for the line end, only the complete file is
    /// accepted.
    #[test]
    fn beginnings_of_a_file_are_refused() {
        let good = file("0 45 90");
        for end in 0..good.trim_end().len() - 1 {
            assert!(parse(&good[..end]).is_err() || good[end..].trim().len() < 3, "{end}");
        }
        assert!(parse(&good).is_ok());
    }
}
