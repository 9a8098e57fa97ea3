//! Values of parameters, parsed from the text of attributes.

use crate::shared::names::quote;
use crate::shared::number::number;
use crate::shared::spectra::SpectrumColors;

/// Value of a parameter, with the type specified by the author.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ParameterValue {
    Float(f64),
    Integer(i64),
    Boolean(bool),
    Text(String),
    Vector([f64; 3]),
    Rgb([f64; 3]),
    Spectrum(SpectrumColors),
    Transform(pt_math::DAffine3),
    Animation(pt_scene::Motion),
}

/// Parses numbers separated by white space or commas.
pub(super) fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',');
    words.filter(|w| !w.is_empty()).map(number).collect()
}

/// Parses three numbers, or one number for all three.
pub(super) fn one_or_three(text: &str) -> Result<[f64; 3], String> {
    match numbers(text)?.as_slice() {
        [x] => Ok([*x; 3]),
        [x, y, z] => Ok([*x, *y, *z]),
        other => Err(format!("expected 1 or 3 numbers, found {}", other.len())),
    }
}

/// Parses three numbers.
pub(super) fn three(text: &str) -> Result<[f64; 3], String> {
    let numbers = numbers(text)?;
    let count = numbers.len();
    numbers.try_into().map_err(|_| format!("expected 3 numbers, found {count}"))
}

/// Parses an integer.
pub(super) fn integer(text: &str) -> Result<i64, String> {
    text.trim().parse().map_err(|_| format!("found {}, expected a whole number", quote(text)))
}

/// Parses `true` or `false`, ignoring case.
pub(super) fn boolean(text: &str) -> Result<bool, String> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" => Ok(true),
        "false" => Ok(false),
        _ => Err(format!("found {}, expected \"true\" or \"false\"", quote(text))),
    }
}

/// Parses a linear colour: one number, three numbers, or `#rrggbb` in steps of 1/255.
pub(super) fn rgb(text: &str) -> Result<[f64; 3], String> {
    let Some(digits) = text.trim().strip_prefix('#') else { return one_or_three(text) };
    let is_good = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
    let value = u32::from_str_radix(digits, 16).ok().filter(|_| is_good);
    let [_, rgb @ ..] = value
        .ok_or_else(|| format!("found {}, expected a colour such as #ff8000", quote(text)))?
        .to_be_bytes();
    Ok(rgb.map(|byte| f64::from(byte) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_in_four_spellings() {
        assert_eq!(rgb("0.25"), Ok([0.25; 3]));
        assert_eq!(rgb(" 1, 0.5,0 "), Ok([1.0, 0.5, 0.0]));
        assert_eq!(rgb("1 0.5 0"), rgb("1, 0.5, 0"));
        assert_eq!(rgb("#ff0033"), Ok([1.0, 0.0, 0.2]));
        for bad in ["", "1 2", "1 2 3 4", "#ff00", "#+f0033", "#ff00é", "red", "nan", "1e39"] {
            assert!(rgb(bad).is_err(), "{bad}");
        }
    }
}
