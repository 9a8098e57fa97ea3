//! The sun and a clear sky, and the position of the sun.

use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

use pt_math::DVec3;

/// The sun and a clear sky by the model of Hosek & Wilkie, in W m⁻² sr⁻¹ nm⁻¹. It is black below
/// the horizon, and black everywhere if the sun is below the horizon. [Hosek & Wilkie 2012, "An
/// Analytic Model for Full Spectral Sky-Dome Radiance"; 2013, "Adding a Solar-Radiance Function to
/// the Hosek-Wilkie Skylight Model"]
#[derive(Clone, Debug, PartialEq)]
pub struct Daylight {
    /// Direction to the sun, of any length. +y is up.
    pub to_sun: [f64; 3],
    /// Turbidity of the air, from 1 (arctic) to 10 (hazy).
    pub turbidity: f64,
    /// Albedo of the ground, from 0 to 1, which illuminates the sky from below.
    pub albedo: [f32; 3],
    /// Factor of the sky; not negative.
    pub sky: f32,
    /// Factor of the sun; not negative.
    pub sun: f32,
    /// Apparent diameter of the sun in degrees, from 0.0116 to 180. Without limb darkening, the
    /// irradiance does not depend on it.
    pub aperture: f64,
    /// True if the sun is darker at its rim, and in its lower part than in its upper part.
    pub limb_darkening: bool,
    /// Period over which the light is averaged, in place of [`Self::to_sun`].
    pub span: Option<TimeRange>,
}

/// A range of days and of hours of each day, in local time. In the axes of the light, north is −x,
/// and east is +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeRange {
    /// Geographic location.
    pub place: GeoLocation,
    /// Offset of local time from universal time, in hours.
    pub timezone: f64,
    /// Year, month and day of the first day.
    pub first: [u32; 3],
    /// Number of days; at least 1.
    pub days: u32,
    /// Start and end of the hours of each day, from 0 to 24.
    pub hours: [f64; 2],
    /// Start and end of the averaged part of the range, as fractions from 0 to 1. If they are
    /// equal, the sun does not move.
    pub part: [f64; 2],
}

impl TimeRange {
    /// Maximum number of days.
    pub const MAX_DAYS: u32 = 1_000_000;

    /// Checks that all numbers are in range.
    fn check(&self) -> Result<(), String> {
        let Self { place, timezone, first, days, hours, part } = self;
        let is_rising = |[from, to]: [f64; 2], most: f64| 0.0 <= from && from <= to && to <= most;
        let is_place = place.latitude.abs() <= 90.0 && place.longitude.abs() <= 360.0;
        let is_date =
            first[0] <= 9999 && (1..=12).contains(&first[1]) && (1..=31).contains(&first[2]);
        let what = if !(is_place && timezone.abs() <= 24.0) {
            "latitudes of at most 90°, longitudes of at most 360° and time zones of at most 24 hours"
        } else if !is_date {
            "a year of at most four digits, a month from 1 to 12 and a day from 1 to 31"
        } else if !(1..=Self::MAX_DAYS).contains(days) {
            "1 to 1,000,000 days"
        } else if !is_rising(*hours, 24.0) {
            "hours from 0 to 24, the first before the last"
        } else if !is_rising(*part, 1.0) {
            "a fraction of the time from 0 to 1, the first number before the last"
        } else {
            return Ok(());
        };
        Err(format!("found the time range {self:?}, expected {what}"))
    }

    /// Returns the unit vector towards the sun at a fraction from 0 to 1 of [`Self::part`]; the
    /// hours of successive days are concatenated.
    pub fn to_sun(&self, share: f64) -> DVec3 {
        let [from, to] = self.part;
        let days = f64::from(self.days);
        let time = (from + (to - from) * share) * days;
        let whole = time.floor().min(days - 1.0);
        let [begin, end] = self.hours;
        let hour = begin + (end - begin) * (time - whole);
        let [year, month, day] = self.first.map(|n| n as i32);
        let moment = DateTime { year, month, day: day + whole as i32, hours: hour - self.timezone };
        let [zenith, azimuth] = self.place.sun(&moment);
        let ((sin, cos), (east, north)) = (libm::sincos(zenith), libm::sincos(azimuth));
        DVec3::new(-sin * north, cos, sin * east)
    }
}

impl Default for Daylight {
    /// The sun at the zenith, in clear air.
    fn default() -> Self {
        Self {
            to_sun: [0.0, 1.0, 0.0],
            turbidity: 3.0,
            albedo: [0.3; 3],
            sky: 1.0,
            sun: 1.0,
            aperture: 0.5358,
            limb_darkening: false,
            span: None,
        }
    }
}

impl Daylight {
    /// Turbidities to which the model was fitted.
    pub const TURBIDITIES: RangeInclusive<f64> = 1.0..=10.0;
    /// Range of apparent diameters of the sun, in degrees. The minimum exceeds the resolution of
    /// single precision.
    pub const APERTURES: RangeInclusive<f64> = 0.0116..=180.0;

    /// Checks all parameters, and returns the unit vector towards the sun.
    ///
    /// # Errors
    /// Returns a message if a number is out of range.
    pub fn check(&self) -> Result<DVec3, String> {
        if !Self::TURBIDITIES.contains(&self.turbidity) {
            return Err(format!("found a turbidity of {}, expected 1 to 10", self.turbidity));
        }
        if !Self::APERTURES.contains(&self.aperture) {
            let (aperture, least) = (self.aperture, Self::APERTURES.start());
            return Err(format!("found a sun {aperture}° wide, expected {least} to 180"));
        }
        let is_scale = |scale: f32| scale >= 0.0 && scale.is_finite();
        if !(is_scale(self.sky) && is_scale(self.sun)) {
            let (sky, sun) = (self.sky, self.sun);
            return Err(format!(
                "found a sky scale of {sky} and a sun scale of {sun}, expected 0 or more"
            ));
        }
        if self.albedo.iter().any(|a| !(0.0..=1.0).contains(a)) {
            return Err(format!("found a ground albedo of {:?}, expected 0 to 1", self.albedo));
        }
        self.span.as_ref().map_or(Ok(()), TimeRange::check)?;
        let unit = DVec3::from(self.to_sun).try_normalize();
        unit.ok_or_else(|| {
            "found a sun direction that is zero or infinite, expected a finite non-zero direction"
                .into()
        })
    }
}

/// A geographic location.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeoLocation {
    /// Degrees north of the equator.
    pub latitude: f64,
    /// Degrees east of Greenwich.
    pub longitude: f64,
}

/// A time in the Gregorian calendar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DateTime {
    /// Year.
    pub year: i32,
    /// Month, from 1.
    pub month: i32,
    /// Day of the month, from 1.
    pub day: i32,
    /// Hours since the beginning of the day in universal time.
    pub hours: f64,
}

impl DateTime {
    /// Returns the number of days between two dates, each given as year, month and day.
    pub fn days_between(first: [u32; 3], last: [u32; 3]) -> i64 {
        let noon = |date: [u32; 3]| {
            let [year, month, day] = date.map(|n| n as i32);
            Self { year, month, day, hours: 12.0 }.days_since_2000()
        };
        (noon(last) - noon(first)).round() as i64
    }

    /// Returns the days since noon of 1 January 2000, universal time.
    /// [Fliegel & Van Flandern 1968, "A Machine Algorithm for Processing Calendar Dates"]
    fn days_since_2000(&self) -> f64 {
        let [year, month, day] = [self.year, self.month, self.day].map(i64::from);
        let january = (month - 14) / 12;
        let julian = (1461 * (year + 4800 + january)) / 4 + (367 * (month - 2 - 12 * january)) / 12
            - (3 * ((year + 4900 + january) / 100)) / 4
            + day
            - 32_075;
        julian as f64 - 0.5 + self.hours / 24.0 - 2_451_545.0
    }
}

impl GeoLocation {
    /// Returns the zenith angle of the sun, and its azimuth from north over east, both in radians,
    /// within 0.5 minutes of arc for the years 1999 to 2015. [Blanco-Muriel et al. 2001, "Computing
    /// the Solar Vector"]
    pub fn sun(&self, moment: &DateTime) -> [f64; 2] {
        const EARTH_RADIUS_KM: f64 = 6371.01;
        const ASTRONOMICAL_UNIT_KM: f64 = 149_597_890.0;
        let days = moment.days_since_2000();
        let omega = 2.1429 - 0.001_039_459_4 * days;
        let mean_longitude = 4.895_063 + 0.017_202_791_698 * days;
        let anomaly = 6.24006 + 0.017_201_969_9 * days;
        let longitude = mean_longitude
            + 0.033_416_07 * libm::sin(anomaly)
            + 0.000_348_94 * libm::sin(2.0 * anomaly)
            - 0.000_113_4
            - 0.000_020_3 * libm::sin(omega);
        let obliquity = 0.409_092_8 - 6.214e-9 * days + 0.000_039_6 * libm::cos(omega);
        let (sin_longitude, cos_longitude) = libm::sincos(longitude);
        let right_ascension = libm::atan2(libm::cos(obliquity) * sin_longitude, cos_longitude);
        let declination = libm::asin(libm::sin(obliquity) * sin_longitude);

        let greenwich_hours = 6.697_424_324_2 + 0.065_709_828_3 * days + moment.hours;
        let sidereal = (greenwich_hours * 15.0 + self.longitude).to_radians();
        let (sin_hour, cos_hour) = libm::sincos(sidereal - right_ascension);
        let (sin_latitude, cos_latitude) = libm::sincos(self.latitude.to_radians());
        let (sin_declination, cos_declination) = libm::sincos(declination);
        let cos_zenith = cos_latitude * cos_hour * cos_declination + sin_declination * sin_latitude;
        let zenith = libm::acos(cos_zenith.clamp(-1.0, 1.0));
        let east = -sin_hour;
        let north = sin_declination / cos_declination * cos_latitude - sin_latitude * cos_hour;
        let azimuth = libm::atan2(east, north);
        let azimuth = if azimuth < 0.0 { azimuth + TAU } else { azimuth };
        let parallax = EARTH_RADIUS_KM / ASTRONOMICAL_UNIT_KM * libm::sin(zenith);
        [(zenith + parallax).min(PI), azimuth]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Golden, Colorado, on 17 October 2003 at 12:30:30 standard time: the zenith angle is
    /// 50.11162° (with refraction, which raises the sun by 0.016332° there), and the azimuth
    /// 194.34024°. [Reda & Andreas 2004, "Solar Position Algorithm for Solar Radiation
    /// Applications", table A5.1]
    #[test]
    fn the_sun_stands_where_the_ephemeris_says() {
        let place = GeoLocation { latitude: 39.742_476, longitude: -105.1786 };
        let moment = DateTime { year: 2003, month: 10, day: 17, hours: 19.0 + 30.5 / 60.0 };
        let [zenith, azimuth] = place.sun(&moment).map(f64::to_degrees);
        let half_a_minute = 0.5 / 60.0;
        assert!((zenith - (50.111_62 + 0.016_332)).abs() < half_a_minute, "{zenith}");
        assert!(
            (azimuth - 194.340_24).abs() < half_a_minute / zenith.to_radians().sin(),
            "{azimuth}"
        );
    }

    /// In Tokyo on 10 July 2010, the sun rises in the north-east and culminates in the south. The
    /// hours of the two days are concatenated.
    #[test]
    fn spans_of_days_go_from_morning_to_evening() {
        let span = TimeRange {
            place: GeoLocation { latitude: 35.6894, longitude: 139.6917 },
            timezone: 9.0,
            first: [2010, 7, 10],
            days: 2,
            hours: [5.0, 19.0],
            part: [0.0, 1.0],
        };
        assert_eq!(span.check(), Ok(()));
        let morning = span.to_sun(0.0);
        assert!(morning.z > 0.8 && morning.x < 0.0 && morning.y > 0.0, "{morning}");
        let noon = span.to_sun((11.75 - 5.0) / 14.0 / 2.0);
        assert!(noon.x > 0.2 && noon.y > 0.95 && noon.z.abs() < 0.05, "{noon}");
        let [evening, next] = [0.4999, 0.5001].map(|share| span.to_sun(share));
        assert!(evening.z < -0.8 && next.z > 0.8, "{evening} {next}");
        assert!((next - morning).length() < 0.01);
        let still = TimeRange { part: [0.5; 2], ..span };
        assert_eq!(still.to_sun(0.0), still.to_sun(1.0));
        let last = span.to_sun(1.0);
        assert!((last - evening).length() < 0.01, "{last}");
        for bad in [
            TimeRange { days: 0, ..span },
            TimeRange { hours: [7.0, 6.0], ..span },
            TimeRange { part: [0.0, f64::NAN], ..span },
            TimeRange { first: [2010, 13, 1], ..span },
            TimeRange { timezone: 25.0, ..span },
        ] {
            assert!(bad.check().is_err_and(|message| message.contains("expected")), "{bad:?}");
        }
    }

    #[test]
    fn days_are_counted_from_noon_of_the_year_2000() {
        let days = |year, month, day, hours| DateTime { year, month, day, hours }.days_since_2000();
        assert_eq!(days(2000, 1, 1, 12.0), 0.0);
        assert_eq!(days(2000, 3, 1, 12.0), 60.0);
        assert_eq!(days(2001, 1, 1, 0.0), 365.5);
        assert_eq!(days(1999, 12, 31, 0.0), -1.5);
        assert_eq!(DateTime::days_between([2024, 2, 28], [2024, 3, 1]), 2);
        assert_eq!(DateTime::days_between([2025, 1, 1], [2024, 1, 1]), -366);
    }
}
