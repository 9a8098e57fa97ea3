//! Parsers of the values of options: pure functions from text to value, whose errors name the
//! expected form.

use std::time::Duration;

use bytesize::ByteSize;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use pathtracer::light_groups::{REST, as_layer};
use pathtracer::{Aov, HALF_B_OFFSET, LightGroup, LightGroups, Limits, MAX_REUSE, MAX_SPLIT};

fn whole(text: &str, least: u32, what: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(n) if n >= least => Ok(n),
        _ => Err(format!("expected {what}")),
    }
}

/// Parses a whole number ≥ 0.
pub(crate) fn count(text: &str) -> Result<u32, String> {
    whole(text, 0, "a whole number from 0 up to 4294967295")
}

/// Parses a whole number from 1 up to [`HALF_B_OFFSET`].
pub(crate) fn positive(text: &str) -> Result<u32, String> {
    let expected = "expected a whole number from 1 up to 2147483648";
    whole(text, 1, "").ok().filter(|n| *n <= HALF_B_OFFSET).ok_or_else(|| expected.into())
}

/// Parses the width or height of an image.
pub(crate) fn pixels(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n <= 1 << 20 => Ok(n),
        _ => Err("expected a number of pixels from 1 up to 1048576, as in -r 480 360".into()),
    }
}

/// Parses a number of threads.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n) if n <= 4096 => Ok(n),
        _ => Err("expected a number of threads from 1 up to 4096, or 0 for one per core".into()),
    }
}

/// Parses the maximum number of shapes in a leaf.
pub(crate) fn leaf_size(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n <= 255 => Ok(n),
        _ => Err("expected a number of shapes from 1 up to 255".into()),
    }
}

fn number(text: &str, fits: impl Fn(f32) -> bool, what: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(v) if v.is_finite() && fits(v) => Ok(v),
        _ => Err(format!("expected {what}")),
    }
}

/// Parses a number of samples of each light.
pub(crate) fn light_samples(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n <= 1 << 16 => Ok(n),
        _ => {
            Err("expected a number from 1 up to 65536; use more samples per pixel (-s) for more"
                .into())
        }
    }
}

/// Parses the side of the tiles of path reuse in pixels.
pub(crate) fn reuse(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if MAX_REUSE.is_multiple_of(n) => Ok(n),
        _ => Err("expected the side of a square in pixels: 1 (none), 2 or 4".into()),
    }
}

/// Parses a range of sample numbers, whose end is exclusive.
pub(crate) fn samples(text: &str) -> Result<(u32, u32), String> {
    let range = text
        .split_once("..")
        .and_then(|(from, to)| Some((from.parse::<u32>().ok()?, to.parse::<u32>().ok()?)));
    match range {
        Some((from, to)) if from < to && to <= HALF_B_OFFSET => Ok((from, to)),
        _ => Err(
            "expected the first number and the one after the last, up to 2147483648, as in 0..256"
                .into(),
        ),
    }
}

/// Numbers from the first to the last, by steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Steps {
    pub(crate) first: u32,
    pub(crate) last: u32,
    pub(crate) step: u32,
}

impl Steps {
    /// The numbers.
    pub(crate) fn numbers(self) -> impl Iterator<Item = u32> {
        (self.first..=self.last).step_by(self.step as usize)
    }
}

/// Parses the first and the last number, optionally with a step, or a single number.
pub(crate) fn steps(text: &str) -> Result<Steps, String> {
    let parse = |text: &str| {
        let (range, step) = text.split_once('/').unwrap_or((text, "1"));
        let (first, last) = range.split_once("..").unwrap_or((range, range));
        let number = |text: &str| text.parse::<u32>().ok();
        Some(Steps { first: number(first)?, last: number(last)?, step: number(step)? })
    };
    parse(text).filter(|steps| steps.first <= steps.last && steps.step > 0).ok_or_else(|| {
        "expected the first and the last number, as in 1..240, 1..240/2 for each second one, or \
         one number"
            .into()
    })
}

/// Parses a number of frames per second.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse::<f64>().ok().filter(|rate| rate.is_finite() && *rate > 0.0);
    rate.ok_or_else(|| "expected a number of frames per second, as in 24 or 29.97".into())
}

/// Parses a time: a number of seconds from 0 up, or with units, such as 90s, 10m or 1h30m.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|v| *v >= 0.0 && v.is_finite());
    let seconds = number.or_else(|| Some(humantime::parse_duration(text).ok()?.as_secs_f64()));
    seconds.ok_or_else(|| "expected a time from 0 up, as in 10, 90s, 10m or 1h30m".into())
}

/// Parses a duration as [`seconds`] does.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let too_long = |_| "expected a shorter time, as in 90s, 10m or 1h30m".to_owned();
    Duration::try_from_secs_f64(seconds(text)?).map_err(too_long)
}

/// Parses a duration above 0.
pub(crate) fn time_limit(text: &str) -> Result<Duration, String> {
    let expected = "expected a time above 0, as in 10, 90s, 10m or 1h30m";
    duration(text).ok().filter(|limit| !limit.is_zero()).ok_or_else(|| expected.into())
}

/// Parses a length > 0.
pub(crate) fn radius(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v),
        _ => Err("expected a length above 0".into()),
    }
}

/// Parses an amount of memory.
pub(crate) fn size(text: &str) -> Result<ByteSize, String> {
    match text.parse::<ByteSize>() {
        Ok(size) if size.as_u64() > 0 => Ok(size),
        _ => Err("expected an amount of memory, as in 500MB, 8GB or 8GiB".into()),
    }
}

/// Parses a number of paths for path splitting.
pub(crate) fn split(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n.is_power_of_two() && n <= MAX_SPLIT => Ok(n),
        _ => Err("expected a power of two from 1 (none) up to 64".into()),
    }
}

/// Parses a number of aperture blades.
pub(crate) fn blades(text: &str) -> Result<u32, String> {
    match whole(text, 3, "") {
        Ok(n) if n <= 1000 => Ok(n),
        _ => Err("expected a number of blades from 3 up to 1000".into()),
    }
}

/// Parses an angle in degrees.
pub(crate) fn degrees(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err("expected a number of degrees".into()),
    }
}

/// Parses a number ≥ 0.
pub(crate) fn not_negative(text: &str) -> Result<f32, String> {
    number(text, |v| v >= 0.0, "a number from 0 up")
}

/// Parses a number > 0.
pub(crate) fn above_zero(text: &str) -> Result<f32, String> {
    number(text, |v| v > 0.0, "a number above 0")
}

/// Parser of the names of AOVs.
pub(crate) fn aovs() -> impl TypedValueParser<Value = Aov> {
    PossibleValuesParser::new(Aov::NAMES.map(|(name, _)| name))
        .try_map(|name| Aov::from_name(&name).ok_or("unknown quantity"))
}

/// Parses a name and its value.
pub(crate) fn definition(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.into(), value.into())),
        _ => Err("expected NAME=VALUE, as in -D radius=0.5".into()),
    }
}

/// Parses a fraction above 0 and up to 1, as 1% or 0.01.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|v| v / 100.0),
        None => text.parse(),
    };
    match value {
        Ok(v) if v > 0.0 && v <= 1.0 => Ok(v),
        _ => Err("expected a fraction above 0 and up to 100%, as in 1% or 0.01".into()),
    }
}

pub(crate) fn confidence(text: &str) -> Result<f64, String> {
    share(text)
        .ok()
        .filter(|v| (0.5..=0.999_999).contains(v))
        .ok_or("expected a fraction from 50% up to 99.9999%, as in 95% or 0.95".into())
}

pub(crate) fn two_or_more(text: &str) -> Result<u32, String> {
    positive(text)
        .ok()
        .filter(|n| *n >= 2)
        .ok_or("expected a whole number from 2 up to 2147483648".into())
}

/// Exposure of PNG images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Exposure {
    /// Exposure in stops.
    Stops(f32),
    /// Exposure computed from the image.
    Auto,
}

impl Exposure {
    /// Exposure in stops, or `None` if it depends on the image.
    pub(crate) fn stops(self) -> Option<f32> {
        match self {
            Self::Stops(stops) => Some(stops),
            Self::Auto => None,
        }
    }
}

/// Parses a number of stops, or `auto`.
pub(crate) fn exposure(text: &str) -> Result<Exposure, String> {
    match text.parse::<f32>() {
        Ok(v) if v.abs() <= 100.0 => Ok(Exposure::Stops(v)),
        _ if text == "auto" => Ok(Exposure::Auto),
        _ => {
            Err("expected a number of stops from -100 up to 100, as in --exposure -1.5, or auto"
                .into())
        }
    }
}

/// Parses HOST:PORT.
pub(crate) fn address(text: &str) -> Result<String, String> {
    match text.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok_and(|p| p > 0) => {
            Ok(text.into())
        }
        _ => Err("expected the host and port of tev, as in 127.0.0.1:14158".into()),
    }
}

/// Parses the groups of `--light-groups`.
///
/// # Errors
/// A message with the expected syntax, or with the name of a repeated group.
pub(crate) fn light_groups(text: &str) -> Result<LightGroups, String> {
    let mut groups = LightGroups::default();
    for entry in text.split(',') {
        let (name, lights) = entry.split_once('=').unwrap_or((entry, entry));
        let is_name = entry == name || as_layer(name) == name;
        if entry == "each" {
            groups.each = true;
            continue;
        }
        if name.is_empty() || !is_name || lights.split('+').any(str::is_empty) {
            return Err("expected each, or groups with the names of their lights, as in \
                        sky,key=lamp+window; names of groups consist of letters, digits and _"
                .into());
        }
        let name = as_layer(name);
        if name == REST || groups.named.iter().any(|group| group.name == name) {
            return Err(format!(
                "duplicate group of lights \"{name}\"; \"rest\" is the group of all other lights"
            ));
        }
        let lights = lights.split('+').map(str::to_owned).collect();
        groups.named.push(LightGroup { name, lights });
    }
    Ok(groups)
}

/// Parses the name and the value of a limit: an amount of memory, a time, or a number.
pub(crate) fn limit(text: &str) -> Result<(String, u64), String> {
    let Some((name, value)) = text.split_once('=') else {
        let names = Limits::NAMES.join(", ");
        return Err(format!("expected NAME=VALUE, with one of the names {names}"));
    };
    let value = match name {
        "seconds" => seconds(value)?.ceil() as u64,
        "memory" => size(value)?.as_u64(),
        _ => value.parse::<ByteSize>().map_or(0, |number| number.as_u64()),
    };
    if value == 0 {
        return Err("expected a whole number from 1 up, an amount as in memory=2GB, or a time as in seconds=2m".into());
    }
    Limits::default().set(name, value)?;
    Ok((name.to_owned(), value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_numbers_of_seconds_or_have_units() {
        for (text, expected) in [
            ("10", 10.0),
            ("0", 0.0),
            ("1.5", 1.5),
            ("90s", 90.0),
            ("10m", 600.0),
            ("1h30m", 5400.0),
        ] {
            assert_eq!(seconds(text), Ok(expected), "{text}");
            assert_eq!(duration(text), Ok(Duration::from_secs_f64(expected)), "{text}");
        }
        for text in ["", "-1", "nan", "inf", "soon", "10 minutos"] {
            assert!(seconds(text).unwrap_err().contains("as in 10, 90s"), "{text}");
        }
        assert!(duration("1e30").is_err());
        assert!(time_limit("0").is_err() && time_limit("0s").is_err() && time_limit("1").is_ok());
    }

    #[test]
    fn limits_are_sizes_times_or_numbers() {
        let parsed = |text| limit(text).map(|(_, value)| value);
        assert_eq!(parsed("memory=2GB"), Ok(2_000_000_000));
        assert_eq!(parsed("memory=2m"), Ok(2_000_000));
        assert_eq!(parsed("seconds=2m"), Ok(120));
        assert_eq!(parsed("depth=40"), Ok(40));
        for text in ["memory", "memory=0", "memory=2 hours", "seconds=0", "depth=x", "colour=1"] {
            assert!(limit(text).is_err(), "{text}");
        }
    }
}
