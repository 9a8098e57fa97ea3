//! Lights.

use pt_math::DAffine3;
use pt_scene::light::{Daylight, GeoLocation, Portal, Rows, TimeRange};
use pt_scene::{Light, LightKind};
use serde_json::Value;

use super::codec::{FieldCodec, Plain, json_enum, json_struct, json_unit_enum};
use super::context::{JsonReader, JsonWriter};
use super::medium::Here;
use super::node::JsonNode;
use super::number::{ANGLE, ANY, Each, FROM_0, HALF_ANGLE, SHARE, numbers, vector, vector_schema};
use super::printer::Out;
use super::schema::Schemas;
use crate::LoadError;

json_struct! { Light { name: Plain => String::new(), to_world: Plain => DAffine3::IDENTITY, at: Here } + kind: LightKind }

json_enum! {
    LightKind {
        Hemisphere { radiance: FROM_0 },
        Constant { radiance: FROM_0, portal: PortalCorners },
        Environment { image: Plain, scale: FROM_0 => 1.0, rows: Plain => Rows::default(), portal: PortalCorners },
        Directional { irradiance: FROM_0 },
        DistantDisk { irradiance: FROM_0, angular_radius: HALF_ANGLE => 0.2679 },
        Point { intensity: FROM_0 },
        Spot { intensity: FROM_0, falloff_angle: FROM_0 => 180.0, falloff_exponent: FROM_0 => 0.0 },
        LinearSpot {
            intensity: FROM_0, beam_angle: HALF_ANGLE => 0.0, cutoff_angle: ANGLE => 45.0, texture: Plain => None,
        },
        PunctualSpot { intensity: FROM_0, inner_angle: HALF_ANGLE => 0.0, outer_angle: HALF_ANGLE => 45.0 },
        Projector { intensity: FROM_0, x_fov: ANGLE => 45.0, y_fov: ANGLE => 45.0, texture: Plain },
        Ies { profile: Plain, scale: FROM_0 => [1.0; 3] },
        Daylight(Daylight),
        Area { radiance: FROM_0 },
    }
}
json_unit_enum! { Rows { PixelCenters, EndpointsAtPoles } }

/// Codec of the corners of a portal, which are omitted if there is none.
struct PortalCorners;

impl FieldCodec<Option<Portal>> for PortalCorners {
    const IS_NEEDED: bool = false;

    fn read(
        &self,
        node: &JsonNode<'_>,
        _: &mut JsonReader<'_>,
    ) -> Result<Option<Portal>, LoadError> {
        const EXPECTED: &str = "the four corners of a rectangle, each a list of 3 numbers";
        let corners = node.list(EXPECTED)?;
        let corners = corners.iter().map(|corner| vector(corner, &ANY, "a list of 3 numbers"));
        let corners = corners.collect::<Result<Vec<_>, _>>()?;
        let corners = corners.try_into().map_err(|_| node.unexpected(EXPECTED))?;
        let portal = Portal { corners };
        portal.edges().map_err(|message| node.error(message))?;
        Ok(Some(portal))
    }

    fn write(&self, value: &Option<Portal>, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        let corners = value.iter().flat_map(|portal| &portal.corners);
        corners.map(|corner| numbers(corner)).collect::<Result<_, _>>().map(Out::List)
    }

    fn schema(&self, schemas: &mut Schemas) -> Value {
        vector_schema(&FieldCodec::<[f64; 3]>::schema(&Each(ANY), schemas), 4)
    }

    fn missing(&self, _: &JsonNode<'_>, _: &JsonReader<'_>) -> Option<Option<Portal>> {
        Some(None)
    }

    fn is_understood(&self, value: &Option<Portal>, _: &JsonWriter<'_>) -> bool {
        value.is_none()
    }
}

json_struct! {
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
json_struct! {
    TimeRange {
        place: Plain, timezone: ANY => 0.0, first: Plain, days: Plain => 1, hours: Each(FROM_0) => [0.0, 24.0],
        part: Each(SHARE) => [0.0, 1.0],
    }
}
json_struct! { GeoLocation { latitude: ANY, longitude: ANY } }
