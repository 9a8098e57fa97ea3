//! Media.

use pt_math::DAffine3;

use super::describe::{Kind, Plain, record, tagged, words};
use super::node::Node;
use super::number::{ABOVE_0, ANY, Each, FROM_0, SHARE};
use super::out::Out;
use super::schema::Schemas;
use super::shared::{Name, Numbered, Reading, Writing};
use crate::medium::{
    BlackBody, Cloud, Emission, GridFilter, Heterogeneous, Matter, Phase, PhaseBlend, PlacedGrid,
    Sides, Volume,
};
use crate::{LoadError, Medium, Span};

record! { Medium { name: Name, phase: Plain => Phase::default(), at: Here } + matter: Matter }

tagged! {
    Matter {
        Homogeneous { extinction: FROM_0, albedo: SHARE => [0.0; 3], emission: FROM_0 => [0.0; 3] },
        Heterogeneous(Box<Heterogeneous>),
        Cloud(Box<Cloud>),
    }
}

record! {
    Heterogeneous {
        extinction: Plain, scale: FROM_0 => 1.0, albedo: Albedo => Volume::Constant([0.0; 3]),
        emission: Glow => Emission::Constant([0.0; 3]),
    }
}
record! {
    Cloud {
        extinction: FROM_0, albedo: SHARE => [0.0; 3], density: FROM_0 => 1.0, wispiness: FROM_0 => 1.0,
        frequency: ABOVE_0 => 5.0, low: ANY => [0.0; 3], high: ANY => [1.0; 3], to_world: Plain => DAffine3::IDENTITY,
    }
}
record! { BlackBody { temperature: Plain, scale: FROM_0 => 1.0 } }
record! {
    PlacedGrid { grid: Plain, to_world: Plain => DAffine3::IDENTITY, filter: Plain => GridFilter::default() }
}
words! { GridFilter { Trilinear, Nearest } }
tagged! {
    Phase {
        Isotropic(), HenyeyGreenstein { g: ANY }, Rayleigh(), Table { values: Each(FROM_0) },
        Microflakes { matrices: Plain },
        Blend(Box<PhaseBlend>),
    }
}
record! { PhaseBlend { first: Plain, second: Plain, share: SHARE => 0.5 } }
record! { Sides { interior: Numbered::Medium => None, exterior: Numbered::Medium => None } }

/// A colour, or a grid.
struct Albedo;

impl Kind<Volume> for Albedo {
    fn read(&self, node: &Node<'_>, cx: &mut Reading<'_>) -> Result<Volume, LoadError> {
        if node.value().as_object().is_some() {
            return Plain.read(node, cx).map(Volume::Grid);
        }
        SHARE.read(node, cx).map(Volume::Constant)
    }

    fn write(&self, value: &Volume, cx: &mut Writing<'_>) -> Result<Out, String> {
        match value {
            Volume::Constant(albedo) => SHARE.write(albedo, cx),
            Volume::Grid(grid) => Plain.write(grid, cx),
        }
    }

    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value {
        let color = Kind::<[f32; 3]>::schema(&SHARE, schemas);
        serde_json::json!({"anyOf": [color, Kind::<PlacedGrid>::schema(&Plain, schemas)]})
    }
}

/// A colour, a grid, or temperatures.
struct Glow;

impl Kind<Emission> for Glow {
    fn read(&self, node: &Node<'_>, cx: &mut Reading<'_>) -> Result<Emission, LoadError> {
        match node.value().as_object() {
            Some(keys) if keys.get("temperature").is_some() => {
                Plain.read(node, cx).map(Emission::BlackBody)
            }
            Some(_) => Plain.read(node, cx).map(Emission::Grid),
            None => FROM_0.read(node, cx).map(Emission::Constant),
        }
    }

    fn write(&self, value: &Emission, cx: &mut Writing<'_>) -> Result<Out, String> {
        match value {
            Emission::Constant(radiance) => FROM_0.write(radiance, cx),
            Emission::Grid(grid) => Plain.write(grid, cx),
            Emission::BlackBody(heat) => Plain.write(heat, cx),
        }
    }

    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value {
        let color = Kind::<[f32; 3]>::schema(&FROM_0, schemas);
        let grid = Kind::<PlacedGrid>::schema(&Plain, schemas);
        serde_json::json!({"anyOf": [color, grid, Kind::<BlackBody>::schema(&Plain, schemas)]})
    }
}

/// Where it was written: no key says so.
pub(super) struct Here;

impl Kind<Span> for Here {
    const IS_WRITTEN: bool = false;

    fn read(&self, node: &Node<'_>, _: &mut Reading<'_>) -> Result<Span, LoadError> {
        Ok(node.span())
    }

    fn write(&self, _: &Span, _: &mut Writing<'_>) -> Result<Out, String> {
        Ok(Out::Null)
    }

    fn schema(&self, _: &mut Schemas) -> serde_json::Value {
        serde_json::Value::Null
    }

    fn missing(&self, object: &Node<'_>, _: &Reading<'_>) -> Option<Span> {
        Some(object.span())
    }
}
