//! Media.

use pt_math::DAffine3;
use pt_scene::medium::{
    BlackBody, Cloud, GridFilter, Heterogeneous, MediumEmission, MediumProperties, Phase,
    PhaseBlend, PlacedGrid, Sides, Volume,
};
use pt_scene::{Medium, Span};

use super::codec::{FieldCodec, Plain, json_enum, json_struct, json_unit_enum};
use super::context::{JsonReader, JsonWriter};
use super::node::JsonNode;
use super::number::{ABOVE_0, ANY, Each, FROM_0, SHARE};
use super::printer::Out;
use super::schema::Schemas;
use super::shared::{EntryName, Numbered};
use crate::LoadError;

json_struct! { Medium { name: EntryName, phase: Plain => Phase::default(), at: Here } + matter: MediumProperties }

json_enum! {
    MediumProperties {
        Homogeneous { extinction: FROM_0, albedo: SHARE => [0.0; 3], emission: FROM_0 => [0.0; 3] },
        Heterogeneous(Box<Heterogeneous>),
        Cloud(Box<Cloud>),
    }
}

json_struct! {
    Heterogeneous {
        extinction: Plain, scale: FROM_0 => 1.0, albedo: AlbedoCodec => Volume::Constant([0.0; 3]),
        emission: EmissionCodec => MediumEmission::Constant([0.0; 3]),
    }
}
json_struct! {
    Cloud {
        extinction: FROM_0, albedo: SHARE => [0.0; 3], density: FROM_0 => 1.0, wispiness: FROM_0 => 1.0,
        frequency: ABOVE_0 => 5.0, low: ANY => [0.0; 3], high: ANY => [1.0; 3], to_world: Plain => DAffine3::IDENTITY,
    }
}
json_struct! { BlackBody { temperature: Plain, scale: FROM_0 => 1.0 } }
json_struct! {
    PlacedGrid { grid: Plain, to_world: Plain => DAffine3::IDENTITY, filter: Plain => GridFilter::default() }
}
json_unit_enum! { GridFilter { Trilinear, Nearest } }
json_enum! {
    Phase {
        Isotropic(), HenyeyGreenstein { g: ANY }, Rayleigh(), Table { values: Each(FROM_0) },
        Microflakes { matrices: Plain },
        Blend(Box<PhaseBlend>),
    }
}
json_struct! { PhaseBlend { first: Plain, second: Plain, amount: SHARE => 0.5 } }
json_struct! { Sides { interior: Numbered::Medium => None, exterior: Numbered::Medium => None } }

/// Codec of a colour or a grid.
struct AlbedoCodec;

impl FieldCodec<Volume> for AlbedoCodec {
    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Volume, LoadError> {
        if node.value().as_object().is_some() {
            return Plain.read(node, cx).map(Volume::Grid);
        }
        SHARE.read(node, cx).map(Volume::Constant)
    }

    fn write(&self, value: &Volume, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        match value {
            Volume::Constant(albedo) => SHARE.write(albedo, cx),
            Volume::Grid(grid) => Plain.write(grid, cx),
        }
    }

    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value {
        let color = FieldCodec::<[f32; 3]>::schema(&SHARE, schemas);
        serde_json::json!({"anyOf": [color, FieldCodec::<PlacedGrid>::schema(&Plain, schemas)]})
    }
}

/// Codec of a colour, a grid, or temperatures.
struct EmissionCodec;

impl FieldCodec<MediumEmission> for EmissionCodec {
    fn read(
        &self,
        node: &JsonNode<'_>,
        cx: &mut JsonReader<'_>,
    ) -> Result<MediumEmission, LoadError> {
        match node.value().as_object() {
            Some(keys) if keys.get("temperature").is_some() => {
                Plain.read(node, cx).map(MediumEmission::BlackBody)
            }
            Some(_) => Plain.read(node, cx).map(MediumEmission::Grid),
            None => FROM_0.read(node, cx).map(MediumEmission::Constant),
        }
    }

    fn write(&self, value: &MediumEmission, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        match value {
            MediumEmission::Constant(radiance) => FROM_0.write(radiance, cx),
            MediumEmission::Grid(grid) => Plain.write(grid, cx),
            MediumEmission::BlackBody(heat) => Plain.write(heat, cx),
        }
    }

    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value {
        let color = FieldCodec::<[f32; 3]>::schema(&FROM_0, schemas);
        let grid = FieldCodec::<PlacedGrid>::schema(&Plain, schemas);
        serde_json::json!({"anyOf": [color, grid, FieldCodec::<BlackBody>::schema(&Plain, schemas)]})
    }
}

/// Codec of the location in the file, which has no key.
pub(super) struct Here;

impl FieldCodec<Span> for Here {
    const IS_WRITTEN: bool = false;

    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<Span, LoadError> {
        Ok(node.span())
    }

    fn write(&self, _: &Span, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::Null)
    }

    fn schema(&self, _: &mut Schemas) -> serde_json::Value {
        serde_json::Value::Null
    }

    fn missing(&self, object: &JsonNode<'_>, _: &JsonReader<'_>) -> Option<Span> {
        Some(object.span())
    }
}
