//! Numbers in text files.

use crate::shared::names::quote;

/// Largest number; larger ones are infinite in single precision.
const LARGEST: f64 = f32::MAX as f64;

/// Parses a finite number.
///
/// # Errors
/// A message that quotes the text.
pub(crate) fn number(text: &str) -> Result<f64, String> {
    let parsed: Result<f64, _> = text.trim().parse();
    match parsed {
        Ok(x) if x.abs() <= LARGEST => Ok(x),
        Ok(_) => Err(format!("found {}, expected a finite number within ±3.4e38", quote(text))),
        Err(_) => Err(format!("found {}, expected a number such as 0.5 or 1e-3", quote(text))),
    }
}
