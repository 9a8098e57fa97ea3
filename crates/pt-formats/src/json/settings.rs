//! Render settings.

use std::sync::LazyLock;

use pt_scene::{Filter, Hidden, RenderHints};
use serde_json::json;

use super::codec::{FieldCodec, Plain, json_enum, json_struct, json_unit_enum};
use super::context::{JsonReader, JsonWriter};
use super::node::JsonNode;
use super::number::{ABOVE_0, SHARE};
use super::printer::Out;
use super::schema::Schemas;
use crate::LoadError;

/// Names of integrators; a test of the program compares them with the registrations.
static INTEGRATORS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| include_str!("integrators.txt").lines().collect());
/// Names of AOVs, compared in the same way.
static AOVS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| include_str!("aovs.txt").lines().collect());

json_struct! {
    RenderHints {
        resolution: Plain => None,
        crop: Plain => None,
        spp: Plain => None,
        max_depth: Plain => None,
        straight_is_free: Plain => false,
        sides_by_shading_normal: Plain => false,
        integrator: OneOf("integrator", &INTEGRATORS) => None,
        aovs: OneOf("channel", &AOVS) => Vec::new(),
        filter: Plain => None,
        hidden: Plain => Hidden::Nothing,
    }; check
}

fn check(settings: &RenderHints) -> Result<(), String> {
    const MAX_PIXELS: u64 = 1 << 32;
    let refuse = |message: &str| Err(message.to_owned());
    let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    if settings.resolution.is_some_and(|size| !(1..=MAX_PIXELS).contains(&area(size))) {
        return refuse(
            "expected a \"resolution\" with a width and a height above 0, of up to 2^32 pixels",
        );
    }
    let ends = |start: u32, length: u32, size: u32| {
        length > 0 && u64::from(start) + u64::from(length) <= u64::from(size)
    };
    let fits = |[x, y, width, height]: [u32; 4]| {
        let inside = |[w, h]: [u32; 2]| ends(x, width, w) && ends(y, height, h);
        settings.resolution.is_some_and(inside)
    };
    if !settings.crop.is_none_or(fits) {
        return refuse(
            "expected a \"crop\" [x, y, width, height] inside of the image of the \"resolution\"",
        );
    }
    if settings.spp == Some(0) {
        return refuse("expected an \"spp\" of 1 or more");
    }
    settings.filter.map_or(Ok(()), |filter| filter.check())
}

json_unit_enum! { Hidden { Nothing, Background, Emitters } }

json_enum! {
    Filter {
        Box(),
        Tent { radius: ABOVE_0 => 1.0 },
        Gaussian { stddev: ABOVE_0 => 0.5, radius: ABOVE_0 => 2.0 },
        Mitchell { b: SHARE => 1.0 / 3.0, c: SHARE => 1.0 / 3.0 },
        BlackmanHarris { radius: ABOVE_0 => 1.5 },
        Lanczos { lobes: ABOVE_0 => 3.0 },
    }
}

/// Codec of a name: the term for it, and the allowed names.
struct OneOf(&'static str, &'static [&'static str]);

impl OneOf {
    fn name(&self, node: &JsonNode<'_>) -> Result<&'static str, LoadError> {
        let Self(what, names) = self;
        let name = node.text().ok_or_else(|| node.unexpected(&format!("the name of a {what}")))?;
        let found = names.iter().copied().find(|known| *known == name);
        found.ok_or_else(|| node.unknown(what, name, names.iter().copied()))
    }
}

#[expect(clippy::ref_option_ref, reason = "kinds write what they are lent")]
impl FieldCodec<Option<&'static str>> for OneOf {
    fn read(
        &self,
        node: &JsonNode<'_>,
        _: &mut JsonReader<'_>,
    ) -> Result<Option<&'static str>, LoadError> {
        self.name(node).map(Some)
    }

    fn write(&self, value: &Option<&'static str>, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(value.map_or(Out::Null, Out::text))
    }

    fn schema(&self, _: &mut Schemas) -> serde_json::Value {
        json!({"enum": self.1})
    }
}

impl FieldCodec<Vec<&'static str>> for OneOf {
    fn read(
        &self,
        node: &JsonNode<'_>,
        _: &mut JsonReader<'_>,
    ) -> Result<Vec<&'static str>, LoadError> {
        node.list("a list of names")?.iter().map(|name| self.name(name)).collect()
    }

    fn write(&self, value: &Vec<&'static str>, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::List(value.iter().map(|name| Out::text(*name)).collect()))
    }

    fn schema(&self, _: &mut Schemas) -> serde_json::Value {
        json!({"type": "array", "items": {"enum": self.1}})
    }
}
