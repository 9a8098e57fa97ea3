//! `<emitter type="sunsky">`: the sun and a clear sky. In Mitsuba, +z of the emitter is up, the sun
//! of a time and place moves from −y in the morning through +x to +y, and `sun_direction` is in
//! world space. `timed_sunsky` covers a range of days, which the shutter times select.

use std::ops::RangeInclusive;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::{DateTime, Daylight, GeoLocation, Light, LightKind, TimeRange};

use super::object::{ColorRole, Parameters};
use super::turn::turn;
use crate::LoadError;

/// Parameters of time and place, with defaults (Tokyo, in the afternoon) and ranges.
const TIME_AND_PLACE: [(&str, f64, RangeInclusive<f64>); 9] = [
    ("latitude", 35.6894, -90.0..=90.0),
    ("longitude", 139.6917, -360.0..=360.0),
    ("timezone", 9.0, -24.0..=24.0),
    ("year", 2010.0, -4000.0..=9999.0),
    ("month", 7.0, 1.0..=12.0),
    ("day", 10.0, 1.0..=31.0),
    ("hour", 15.0, 0.0..=24.0),
    ("minute", 0.0, 0.0..=60.0),
    ("second", 0.0, 0.0..=60.0),
];

/// Reads the sun and the sky, and a transform from axes with +y up.
pub(super) fn sunsky(parameters: &mut Parameters<'_>) -> Result<(DAffine3, LightKind), LoadError> {
    let node = turn(parameters)?;
    let direction = parameters.vector("sun_direction")?;
    let to_sun = match direction {
        Some(direction) => {
            if let Some((name, ..)) =
                TIME_AND_PLACE.iter().find(|(name, ..)| parameters.find(name).is_some())
            {
                let message = format!("expected {name} or sun_direction, not both");
                return Err(parameters.refuse(name, message));
            }
            let unit = direction.try_normalize();
            let message = "found a sun direction that is zero or infinite, expected a finite \
                           non-zero direction";
            node.transpose() * unit.ok_or_else(|| parameters.refuse("sun_direction", message))?
        }
        None => of_time_and_place(parameters)?,
    };
    let to_sun = (up().transpose() * to_sun).to_array();
    let daylight = Daylight { to_sun, ..air(parameters)? };
    Ok((DAffine3::from_mat3(node * up()), LightKind::Daylight(daylight)))
}

/// Returns the rotation from axes with +y up to those of emitters.
fn up() -> DMat3 {
    DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y)
}

/// Reads all parameters except the position of the sun.
fn air(parameters: &mut Parameters<'_>) -> Result<Daylight, LoadError> {
    let default = Daylight::default();
    let most = f64::from(f32::MAX);
    Ok(Daylight {
        turbidity: within(parameters, "turbidity", default.turbidity, Daylight::TURBIDITIES)?,
        albedo: parameters.color("albedo", ColorRole::Share, 0.3)?,
        sky: within(parameters, "sky_scale", 1.0, 0.0..=most)? as f32,
        sun: within(parameters, "sun_scale", 1.0, 0.0..=most)? as f32,
        aperture: within(parameters, "sun_aperture", default.aperture, Daylight::APERTURES)?,
        limb_darkening: parameters.boolean("complex_sun")?,
        ..default
    })
}

/// Reads the sun and the sky over a range of days. The visible part is at first the emitter's own
/// shutter, `[open, close]` in seconds; [`see_spans`] replaces it by that of the sensor.
pub(super) fn timed_sunsky(
    parameters: &mut Parameters<'_>,
) -> Result<(DAffine3, LightKind), LoadError> {
    let node = turn(parameters)?;
    let mut number = |name, default, range| within(parameters, name, default, range);
    let place = GeoLocation {
        latitude: number("latitude", 35.6894, -90.0..=90.0)?,
        longitude: number("longitude", 139.6917, -360.0..=360.0)?,
    };
    let timezone = number("timezone", 9.0, -24.0..=24.0)?;
    let hours = [
        number("window_start_time", 7.0, 0.0..=24.0)?,
        number("window_end_time", 19.0, 0.0..=24.0)?,
    ];
    if hours[0] > hours[1] {
        let message =
            format!("found {} as the last hour, expected an hour after the first one", hours[1]);
        return Err(parameters.refuse("window_end_time", message));
    }
    let first = date(parameters, ["start_year", "start_month", "start_day"], [2025, 1, 1])?;
    let after = [first[0] + 1, first[1], first[2]];
    let last = date(parameters, ["end_year", "end_month", "end_day"], after)?;
    let days = DateTime::days_between(first, last);
    if days < 1 {
        let message = "found a last day that is not after the first day";
        return Err(parameters.refuse("end_year", message));
    }
    let any = f64::from(f32::MIN)..=f64::from(f32::MAX);
    let shutter = [
        within(parameters, "shutter_open", 0.0, any.clone())?,
        within(parameters, "shutter_close", 1.0, any)?,
    ];
    if shutter[0] >= shutter[1] {
        return Err(parameters
            .refuse("shutter_close", "found a shutter_close that is not after shutter_open"));
    }
    let days = u32::try_from(days).unwrap_or(u32::MAX).min(TimeRange::MAX_DAYS);
    let span = TimeRange { place, timezone, first, days, hours, part: shutter };
    let daylight = Daylight { span: Some(span), ..air(parameters)? };
    Ok((DAffine3::from_mat3(node * up()), LightKind::Daylight(daylight)))
}

/// Reads a year, month and day.
fn date(
    parameters: &mut Parameters<'_>,
    names: [&'static str; 3],
    defaults: [u32; 3],
) -> Result<[u32; 3], LoadError> {
    let ranges = [0.0..=9999.0, 1.0..=12.0, 1.0..=31.0];
    let mut date = defaults;
    for ((value, name), range) in date.iter_mut().zip(names).zip(ranges) {
        let given = parameters.integer(name)?.map_or(f64::from(*value), |x| x as f64);
        *value = in_range(parameters, name, given, &range)? as u32;
    }
    Ok(date)
}

/// Maps the shutter times of the sensor to the part of each `timed_sunsky` that is visible: the
/// shutter of the emitter covers all days. Times outside of it are clamped.
pub(super) fn see_spans(lights: &mut [Light], shutter: [f64; 2]) {
    for light in lights {
        let LightKind::Daylight(Daylight { span: Some(span), .. }) = &mut light.kind else {
            continue;
        };
        let [open, close] = span.part;
        span.part = shutter.map(|time| ((time - open) / (close - open)).clamp(0.0, 1.0));
    }
}

/// Computes the direction of the sun at a time and place, in the axes of the emitter.
fn of_time_and_place(parameters: &mut Parameters<'_>) -> Result<DVec3, LoadError> {
    let mut values = [0.0; TIME_AND_PLACE.len()];
    for (value, (name, default, range)) in values.iter_mut().zip(TIME_AND_PLACE) {
        *value = match name {
            "year" | "month" | "day" => {
                let given = parameters.integer(name)?.map_or(default, |x| x as f64);
                in_range(parameters, name, given, &range)?
            }
            _ => within(parameters, name, default, range)?,
        };
    }
    let [latitude, longitude, timezone, year, month, day, hour, minute, second] = values;
    let moment = DateTime {
        year: year as i32,
        month: month as i32,
        day: day as i32,
        hours: hour - timezone + (minute + second / 60.0) / 60.0,
    };
    let [zenith, azimuth] = GeoLocation { latitude, longitude }.sun(&moment);
    let (sin, cos) = libm::sincos(zenith);
    let (sin_azimuth, cos_azimuth) = libm::sincos(azimuth);
    Ok(DVec3::new(-sin * cos_azimuth, -sin * sin_azimuth, cos))
}

/// Reads a number in a range.
fn within(
    parameters: &mut Parameters<'_>,
    name: &'static str,
    default: f64,
    range: RangeInclusive<f64>,
) -> Result<f64, LoadError> {
    let value = parameters.float(name)?.unwrap_or(default);
    in_range(parameters, name, value, &range)
}

fn in_range(
    parameters: &Parameters<'_>,
    name: &'static str,
    value: f64,
    range: &RangeInclusive<f64>,
) -> Result<f64, LoadError> {
    if range.contains(&value) {
        return Ok(value);
    }
    let (least, most) = (range.start(), range.end());
    let message = if *most < f64::from(f32::MAX) {
        format!("found {name} = {value}, expected {least} to {most}")
    } else {
        format!("found {name} = {value}, expected {least} or more")
    };
    Err(parameters.refuse(name, message))
}
