//! `<emitter type="sunsky">`: the sun and a clear sky. There +z of the emitter is up, the sun of a time
//! and place moves from −y in the morning over +x to +y, and `sun_direction` is one of the world.

use std::ops::RangeInclusive;

use pt_math::{DAffine3, DMat3, DVec3};

use super::emitter::turn;
use super::object::{Parameters, Role};
use crate::{Daylight, LightKind, LoadError, Moment, Place};

/// Parameters that say when and where, and what is meant without them: Tokyo, in the afternoon.
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

/// The sun and the sky, and the axes in which +y is up.
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
            let message = "the direction of the sun is zero or infinite";
            node.transpose() * unit.ok_or_else(|| parameters.refuse("sun_direction", message))?
        }
        None => of_time_and_place(parameters)?,
    };
    let default = Daylight::default();
    let up = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
    let most = f64::from(f32::MAX);
    let daylight = Daylight {
        to_sun: (up.transpose() * to_sun).to_array(),
        turbidity: within(parameters, "turbidity", default.turbidity, Daylight::TURBIDITIES)?,
        albedo: parameters.color("albedo", Role::Share, 0.3)?,
        sky: within(parameters, "sky_scale", 1.0, 0.0..=most)? as f32,
        sun: within(parameters, "sun_scale", 1.0, 0.0..=most)? as f32,
        aperture: within(parameters, "sun_aperture", default.aperture, Daylight::APERTURES)?,
        limb_darkening: parameters.boolean("complex_sun")?,
    };
    Ok((DAffine3::from_mat3(node * up), LightKind::Daylight(daylight)))
}

/// Where the sun stands then and there, in the axes of the emitter.
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
    let moment = Moment {
        year: year as i32,
        month: month as i32,
        day: day as i32,
        hours: hour - timezone + (minute + second / 60.0) / 60.0,
    };
    let [zenith, azimuth] = Place { latitude, longitude }.sun(&moment);
    let (sin, cos) = libm::sincos(zenith);
    let (sin_azimuth, cos_azimuth) = libm::sincos(azimuth);
    Ok(DVec3::new(-sin * cos_azimuth, -sin * sin_azimuth, cos))
}

/// A number that has to lie in a range.
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
        format!("{name} is {value}; expected {least} to {most}")
    } else {
        format!("{name} is {value}; expected {least} or more")
    };
    Err(parameters.refuse(name, message))
}
