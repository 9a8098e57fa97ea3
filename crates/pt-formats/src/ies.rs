//! Luminous intensities of luminaires, from the files of their makers.
//!
//! The format is that of the Illuminating Engineering Society. [IES LM-63-1986, -1991, -1995 and
//! ANSI/IESNA LM-63-2002] Lines of keywords end with `TILT=NONE`; then come numbers, wherever lines
//! break:
//!
//! ```text
//! lamps  lumens per lamp  multiplier  vertical angles  horizontal angles
//! photometric type  units  width  length  height
//! ballast factor  ballast-lamp factor  watts
//! the vertical angles, the horizontal angles, and candela: all vertical angles of the first
//! horizontal angle, then of the next …
//! ```

use std::path::Path;

use crate::{LoadError, Span};

/// Intensity by direction: type C, where vertical angles are counted from straight down, and
/// horizontal angles around the vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct IesProfile {
    /// Degrees from straight down, increasing.
    vertical: Vec<f32>,
    /// Degrees, increasing from 0 to 360.
    horizontal: Vec<f32>,
    /// Candela, all vertical angles of one horizontal angle after the other.
    candela: Vec<f32>,
}

/// Files of more numbers than this are no luminaires.
const MAX_VALUES: usize = 1 << 24;

/// More candela than any lamp has, of which all intensities of a file may be added up: searchlights
/// have 10⁹.
const MAX_CANDELA: f32 = 1e15;

impl IesProfile {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or as [`Self::parse`].
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        let bytes = crate::file::read(path)
            .map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
        Self::parse(&bytes, path)
    }

    /// Reads the content of a file; `path` is for messages.
    ///
    /// # Errors
    /// If it is no such file, lamps that are tilted change its intensities, its angles are not of
    /// type C or do not go all around, or its numbers are too few or make no sense.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self, LoadError> {
        let text = crate::format::characters(bytes, path)?;
        let mut numbers = Numbers::new(&text, path)?;
        let header = Header::read(&mut numbers)?;
        let (vertical, _) = numbers.angles("vertical", header.vertical)?;
        let (horizontal, line) = numbers.angles("horizontal", header.horizontal)?;
        let last = |angles: &[f32]| angles.last().copied().unwrap_or_default();
        if vertical[0] < 0.0 || last(&vertical) > 180.0 {
            let message = "the vertical angles leave 0 to 180, the range of type C";
            return Err(numbers.error(line, message));
        }
        let mut candela = Vec::with_capacity(header.vertical * header.horizontal);
        for _ in 0..header.vertical * header.horizontal {
            let (value, line) = numbers.next("candela")?;
            let value = (value * header.factor) as f32;
            if !(0.0..=MAX_CANDELA).contains(&value) {
                let message = format!("{value} candela; expected 0 to {MAX_CANDELA:e}");
                return Err(numbers.error(line, message));
            }
            candela.push(value);
        }
        let profile = Self { vertical, horizontal, candela };
        profile.all_around().ok_or_else(|| {
            let message = "the horizontal angles go neither from 0 to 0, 90, 180 or 360, nor from 90 \
                           to 270";
            numbers.error(line, message)
        })
    }

    /// A table of all horizontal angles: degrees that increase, from 0 to 360 around the axis, and
    /// the intensities of all vertical angles of one horizontal angle after the other.
    pub(crate) fn of_table(vertical: Vec<f32>, horizontal: Vec<f32>, candela: Vec<f32>) -> Self {
        debug_assert_eq!(candela.len(), vertical.len() * horizontal.len());
        Self { vertical, horizontal, candela }
    }

    /// The vertical and the horizontal angles, and the intensities, as [`Self::of_table`] takes
    /// them.
    pub(crate) fn table(&self) -> (&[f32], &[f32], &[f32]) {
        (&self.vertical, &self.horizontal, &self.candela)
    }

    /// The same intensities all around the axis, by degrees that increase.
    pub(crate) fn around_axis(vertical: Vec<f32>, candela: Vec<f32>) -> Self {
        let candela = [candela.clone(), candela].concat();
        Self::of_table(vertical, vec![0.0, 360.0], candela)
    }

    /// The intensities of all horizontal angles, where some follow from others by symmetry.
    fn all_around(self) -> Option<Self> {
        let (first, last) = (*self.horizontal.first()?, *self.horizontal.last()?);
        // Angles that make a full turn, and of which given angle each is the mirror image.
        let n = self.horizontal.len();
        let reflect = |planes: &[f32]| {
            let mut all: Vec<(f32, usize)> = self.horizontal.iter().copied().zip(0..).collect();
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
            (0.0, 360.0) => (0..n).map(|i| (self.horizontal[i], i)).collect(),
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
        let turn = self.vertical.len();
        Some(Self {
            horizontal: all.iter().map(|entry| entry.0).collect(),
            candela: all
                .iter()
                .flat_map(|&(_, i)| self.candela[i * turn..(i + 1) * turn].iter().copied())
                .collect(),
            vertical: self.vertical,
        })
    }

    /// The mean of the entries of the table, in candela: about how bright it is.
    pub fn mean_candela(&self) -> f32 {
        self.candela.iter().sum::<f32>() / self.candela.len() as f32
    }

    /// Candela at a vertical angle in [0, 180] and a horizontal angle in [0, 360], in degrees:
    /// linear between the angles of the file, and 0 above and below them.
    pub fn candela(&self, vertical: f32, horizontal: f32) -> f32 {
        let (Some((v, a)), Some((h, b))) =
            (between(&self.vertical, vertical), between(&self.horizontal, horizontal))
        else {
            return 0.0;
        };
        let n = self.vertical.len();
        let value = |h: usize, v: usize| self.candela[h * n + v.min(n - 1)];
        let along = |h: usize| value(h, v) * (1.0 - a) + value(h, v + 1) * a;
        along(h) * (1.0 - b) + along((h + 1).min(self.horizontal.len() - 1)) * b
    }
}

/// The number of the last angle that is not above `x`, and how far `x` is on the way to the next;
/// `None` outside.
fn between(angles: &[f32], x: f32) -> Option<(usize, f32)> {
    let i = angles.partition_point(|&a| a <= x).checked_sub(1)?;
    match angles.get(i + 1) {
        Some(next) => Some((i, (x - angles[i]) / (next - angles[i]))),
        None => (x <= angles[i]).then_some((i, 0.0)),
    }
}

/// What the numbers before the angles say.
struct Header {
    vertical: usize,
    horizontal: usize,
    /// Of all candela.
    factor: f64,
}

impl Header {
    fn read(numbers: &mut Numbers<'_>) -> Result<Self, LoadError> {
        numbers.next("the number of lamps")?;
        numbers.next("the lumens per lamp")?;
        let (multiplier, _) = numbers.next("the multiplier of candela")?;
        let vertical = numbers.count("vertical angles")?;
        let horizontal = numbers.count("horizontal angles")?;
        let (kind, line) = numbers.next("the photometric type")?;
        if kind != 1.0 {
            let message =
                format!("photometric type {kind} is not read; expected 1, which is type C");
            return Err(numbers.error(line, message));
        }
        for what in ["the units", "the width", "the length", "the height"] {
            numbers.next(what)?;
        }
        let (ballast, _) = numbers.next("the ballast factor")?;
        let (ballast_lamp, line) = numbers.next("the ballast-lamp factor")?;
        numbers.next("the watts")?;
        if vertical.saturating_mul(horizontal) > MAX_VALUES {
            let message =
                format!("{vertical} × {horizontal} angles are more than any luminaire has");
            return Err(numbers.error(line, message));
        }
        Ok(Self { vertical, horizontal, factor: multiplier * ballast * ballast_lamp })
    }
}

/// The numbers behind the keywords, with their lines.
struct Numbers<'a> {
    words: std::vec::IntoIter<(&'a str, u32)>,
    path: &'a Path,
    /// The last line of the file.
    last: u32,
}

impl<'a> Numbers<'a> {
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
                let message = format!("TILT={other} is not read; expected TILT=NONE");
                return Err(error(at, message));
            }
            None => {
                let message = "there is no line TILT=NONE; expected a photometric file of LM-63";
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

    /// A finite number, and its line.
    fn next(&mut self, what: &str) -> Result<(f64, u32), LoadError> {
        let Some((word, line)) = self.words.next() else {
            return Err(self.error(self.last, format!("the file ends where {what} should be")));
        };
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok((number, line)),
            _ => Err(self.error(line, format!("\"{word}\" is no number; expected {what}"))),
        }
    }

    /// A whole number from 1 up.
    fn count(&mut self, what: &str) -> Result<usize, LoadError> {
        let (number, line) = self.next(&format!("the number of {what}"))?;
        let is_count = number >= 1.0 && number.fract() == 0.0 && number <= MAX_VALUES as f64;
        if is_count {
            return Ok(number as usize);
        }
        let message = format!("{number} {what}; expected a whole number from 1 to {MAX_VALUES}");
        Err(self.error(line, message))
    }

    /// Increasing angles, and the line of the last.
    fn angles(&mut self, what: &str, count: usize) -> Result<(Vec<f32>, u32), LoadError> {
        let mut angles: Vec<f32> = Vec::new();
        let mut last_line = 0;
        for _ in 0..count {
            let (angle, line) = self.next(&format!("a {what} angle"))?;
            let angle = angle as f32;
            if angles.last().is_some_and(|&before| angle <= before) {
                let message = format!("the {what} angle {angle} is not above the one before it");
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

    /// Vertical angles 0, 45 and 90, and these horizontal angles; candela 100 h + v at the h-th
    /// and v-th angle, times a multiplier of 2, 0.5 and 3.
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
        IesProfile::parse(text.as_bytes(), Path::new("a.ies")).map_err(|e| e.to_string())
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

    /// As some editors and old machines write them.
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
        // Given angles, and pairs of angles of the same intensity: 100 times the second.
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
            (change("TILT=NONE", "TILT=INCLUDE"), "a.ies:3: TILT=INCLUDE"),
            (change("TILT=NONE", "LAMP"), "there is no line TILT=NONE"),
            (change(" 1 2\r\n", " 2 2\r\n"), "a.ies:4: photometric type 2"),
            (change("0 45 90", "0 45 45"), "a.ies:7: the vertical angle 45 is not above"),
            (change("0 45 90", "0 45 190"), "the vertical angles leave 0 to 180"),
            (change("0 90", "0 80"), "a.ies:8: the horizontal angles go neither"),
            (change("100 101", "100 x"), "a.ies:10: \"x\" is no number; expected candela"),
            (change("100 101", "100 -1"), "-3 candela"),
            // The sum of such a table would be infinite.
            (change("100 101", "100 1e38"), "candela; expected 0 to 1e15"),
            (change("100 101 102", ""), "the file ends where candela should be"),
            (change("1 -1 2 3 2", "1 -1 2 3.5 2"), "3.5 vertical angles"),
            (change("1 -1 2 3 2", "1 -1 2 9999999 9999999"), "more than any luminaire has"),
            (String::new(), "there is no line TILT=NONE"),
        ];
        for (text, want) in cases {
            let message = parse(&text).unwrap_err();
            assert!(message.contains(want), "{message} lacks {want}");
        }
    }

    /// No beginning of a file makes a panic; but for the line end, only all of it is read.
    #[test]
    fn beginnings_of_a_file_are_refused() {
        let good = file("0 45 90");
        for end in 0..good.trim_end().len() - 1 {
            assert!(parse(&good[..end]).is_err() || good[end..].trim().len() < 3, "{end}");
        }
        assert!(parse(&good).is_ok());
    }
}
