//! Lights.

use pt_math::DAffine3;

use super::describe::{Plain, record, tagged, words};
use super::medium::Here;
use super::number::{ANGLE, ANY, Each, FROM_0, HALF_ANGLE, SHARE};
use crate::light::{DaySpan, Daylight, Place, Rows};
use crate::{Light, LightKind};

record! { Light { name: Plain => String::new(), to_world: Plain => DAffine3::IDENTITY, at: Here } + kind: LightKind }

tagged! {
    LightKind {
        Hemisphere { radiance: FROM_0 },
        Constant { radiance: FROM_0 },
        Environment { image: Plain, scale: FROM_0 => 1.0, rows: Plain => Rows::default() },
        Directional { irradiance: FROM_0 },
        DistantDisk { irradiance: FROM_0, angular_radius: HALF_ANGLE => 0.2679 },
        Point { intensity: FROM_0 },
        Spot { intensity: FROM_0, falloff_angle: FROM_0 => 180.0, falloff_exponent: FROM_0 => 0.0 },
        LinearSpot {
            intensity: FROM_0, beam_angle: HALF_ANGLE => 0.0, cutoff_angle: ANGLE => 45.0, texture: Plain => None,
        },
        Ies { profile: Plain, scale: FROM_0 => [1.0; 3] },
        Daylight(Daylight),
        Area { radiance: FROM_0 },
    }
}
words! { Rows { Between, FromPoleToPole } }

record! {
    Daylight {
        to_sun: Each(ANY) => Self::default().to_sun,
        turbidity: FROM_0 => Self::default().turbidity,
        albedo: SHARE => Self::default().albedo,
        sky: FROM_0 => Self::default().sky,
        sun: FROM_0 => Self::default().sun,
        aperture: ANGLE => Self::default().aperture,
        limb_darkening: Plain => Self::default().limb_darkening,
        span: Plain => None,
    }
}
record! {
    DaySpan {
        place: Plain, timezone: ANY => 0.0, first: Plain, days: Plain => 1, hours: Each(FROM_0) => [0.0, 24.0],
        part: Each(SHARE) => [0.0, 1.0],
    }
}
record! { Place { latitude: ANY, longitude: ANY } }
