//! Materials and textures.

use std::collections::HashMap;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3};
use pt_scene::Material;
use pt_scene::material::{
    Averted, Black, CoatNormals, CoatedConductor, CoatedDiffuse, Conductor, Diffuse,
    DiffuseTransmission, Distribution, FresnelPlastic, Glass, Hair, Masking, Measured,
    MetallicRoughness, Mirror, Mix, Pigment, Plastic, Principled, PrincipledThin, Refraction,
    RoughCoatedDiffuse, RoughDiffuse, Roughness, Surface, SurfaceDetail, ThinGlass, TwoSided,
};
use pt_scene::medium::GridFilter;
use pt_scene::texture::{
    Bitmap, Blend, Color, Edge, Filter, Marble, Noise, NormalOrBump, Pattern, Procedural, Scalar,
    Texture, TextureMapping, Wrap,
};
use serde_json::{Value, json};

use super::codec::{
    FieldCodec, JsonCodec, Plain, StructCodec, json_enum, json_struct, json_unit_enum, put,
};
use super::context::{EntryTables, JsonReader, JsonWriter};
use super::node::{JsonNode, ObjectKeys};
use super::number::{ABOVE_0, ANY, Each, FROM_0, FROM_1, Pair, SHARE, TILT, TO_2, UpTo};
use super::printer::{Entries, Out};
use super::schema::{Properties, Schemas};
use super::shared::{EntryName, TableEntry};
use super::transform::{OfTexture, ToTexture};
use crate::LoadError;

json_struct! {
    Material {
        name: EntryName,
        emission: FROM_0 => [0.0; 3].into(),
        hidden_emission: Plain => false,
        opacity: SHARE => 1.0.into(),
    } + surface: Surface
}

/// Maximum number of a set of texture coordinates.
const MAX_SETS: u32 = 1000;

/// The variants of surfaces are the structs of the same name.
macro_rules! surface_fields {
    ($($name:ident),* $(,)?) => {
        json_enum! { Surface { $($name ($name)),* } }
    };
}
pt_scene::surfaces!(surface_fields);

json_struct! { Diffuse { reflectance: FROM_0 => [0.5; 3].into(), two_sided: Plain => true } }
json_struct! {
    RoughDiffuse {
        reflectance: FROM_0 => [0.5; 3].into(),
        roughness: SHARE => 0.5.into(),
        two_sided: Plain => true,
    }
}
json_struct! { Mirror { reflectance: FROM_0 => [1.0; 3].into() } }
json_struct! {
    Glass {
        reflectance: FROM_0 => [1.0; 3].into(),
        transmittance: FROM_0 => [1.0; 3].into(),
        ior: ABOVE_0 => 1.5,
        roughness: Plain => None,
    }
}
json_struct! {
    ThinGlass {
        reflectance: FROM_0 => [1.0; 3].into(),
        transmittance: FROM_0 => [1.0; 3].into(),
        ior: ABOVE_0 => 1.5,
    }
}
json_struct! { Refraction { transmittance: FROM_0 => [1.0; 3].into(), ior: ABOVE_0 => 1.5 } }
json_struct! {
    Conductor {
        eta: FROM_0,
        k: FROM_0,
        reflectance: FROM_0 => [1.0; 3].into(),
        roughness: Plain => None,
        two_sided: Plain => true,
    }
}
json_struct! {
    CoatedDiffuse {
        diffuse: FROM_0 => [0.5; 3].into(),
        specular: FROM_0 => [1.0; 3].into(),
        ior: ABOVE_0 => 1.5,
        nonlinear: Plain => false,
        two_sided: Plain => true,
    }
}
json_struct! {
    RoughCoatedDiffuse {
        diffuse: FROM_0 => [0.5; 3].into(),
        specular: FROM_0 => [1.0; 3].into(),
        ior: ABOVE_0 => 1.5,
        alpha: ABOVE_0 => 0.1,
        distribution: Plain => Distribution::Ggx,
        nonlinear: Plain => false,
        two_sided: Plain => true,
    }
}
json_struct! {
    FresnelPlastic {
        diffuse: FROM_0 => [0.5; 3].into(),
        specular: FROM_0 => [1.0; 3].into(),
        ior: ABOVE_0 => 1.5,
        roughness: Plain,
        two_sided: Plain => true,
    }
}
json_struct! {
    CoatedConductor {
        eta: FROM_0,
        k: FROM_0,
        alpha: FROM_0 => 0.0,
        ior: ABOVE_0 => 1.5,
        coat_alpha: FROM_0 => 0.0,
        thickness: FROM_0 => 0.0,
        two_sided: Plain => true,
    }
}
json_struct! {
    Plastic {
        diffuse: FROM_0 => [0.5; 3].into(),
        specular: FROM_0 => [0.04; 3].into(),
        alpha: ABOVE_0 => 0.1,
        two_sided: Plain => true,
    }
}
json_struct! {
    Principled {
        base_color: FROM_0 => Self::default().base_color,
        roughness: SHARE => Self::default().roughness,
        anisotropic: SHARE => 0.0.into(),
        metallic: SHARE => 0.0.into(),
        spec_trans: SHARE => 0.0.into(),
        ior: ABOVE_0 => Self::default().ior,
        spec_tint: SHARE => 0.0.into(),
        sheen: SHARE => 0.0.into(),
        sheen_tint: SHARE => 0.0.into(),
        flatness: SHARE => 0.0.into(),
        clearcoat: SHARE => 0.0.into(),
        clearcoat_gloss: SHARE => 0.0.into(),
        two_sided: Plain => false,
    }
}
json_struct! {
    PrincipledThin {
        base_color: FROM_0 => Self::default().base_color,
        roughness: SHARE => Self::default().roughness,
        anisotropic: SHARE => 0.0.into(),
        spec_trans: SHARE => 0.0.into(),
        ior: ABOVE_0 => Self::default().ior,
        spec_tint: SHARE => 0.0.into(),
        sheen: SHARE => 0.0.into(),
        sheen_tint: SHARE => 0.0.into(),
        flatness: SHARE => 0.0.into(),
        diff_trans: TO_2 => 0.0.into(),
    }
}
json_struct! {
    MetallicRoughness {
        base_color: FROM_0 => Self::default().base_color,
        metallic: SHARE => 0.0.into(),
        roughness: SHARE => Self::default().roughness,
        ior: FROM_1 => Self::default().ior,
        specular: SHARE => Self::default().specular,
        specular_color: FROM_0 => Self::default().specular_color,
        transmission: SHARE => 0.0.into(),
        diffuse_transmission: SHARE => 0.0.into(),
        diffuse_transmission_color: FROM_0 => Self::default().diffuse_transmission_color,
        anisotropy: SHARE => 0.0.into(),
        anisotropy_direction: Pair(SHARE) => Self::default().anisotropy_direction,
        anisotropy_rotation: ANY => 0.0,
        anisotropy_along: Plain => None,
        iridescence: SHARE => 0.0.into(),
        film_ior: FROM_1 => Self::default().film_ior,
        film_thickness: FROM_0 => Self::default().film_thickness,
        sheen_color: FROM_0 => Self::default().sheen_color,
        sheen_roughness: SHARE => 0.0.into(),
        clearcoat: SHARE => 0.0.into(),
        clearcoat_roughness: SHARE => 0.0.into(),
        clearcoat_normals: Plain => CoatNormals::Base,
        thin: Plain => false,
        two_sided: Plain => false,
    }
}
json_enum! { CoatNormals { Base(), Shape(), Relief(NormalOrBump) } }
json_struct! {
    DiffuseTransmission {
        reflectance: FROM_0 => [0.5; 3].into(),
        transmittance: FROM_0 => [0.5; 3].into(),
    }
}
json_struct! {
    Hair {
        ior: FROM_1 => Self::default().ior,
        roughness: SHARE => Self::default().roughness,
        azimuthal_roughness: SHARE => Self::default().azimuthal_roughness,
        scale_angle: TILT => Self::default().scale_angle,
        two_sided: Plain => false,
    } + pigment: Pigment
}
json_struct! { Measured { measurements: Plain, two_sided: Plain => true } }
json_struct! { Mix { first: Plain, second: Plain, amount: SHARE => 0.5.into() } }
json_struct! { TwoSided { front: Plain, back: Plain } }
json_struct! {
    SurfaceDetail {
        surface: Plain,
        shadowing: Plain => false,
        averted: Plain => Averted::Bent,
        mirrored: Plain => false,
    } + relief: NormalOrBump
}
json_unit_enum! { Averted { Bent, Turned, Black } }

impl StructCodec for Black {
    fn read_fields(_: &mut ObjectKeys<'_>, _: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        Ok(Self)
    }

    fn write_fields(&self, _: &mut Entries, _: &mut JsonWriter<'_>) -> Result<(), String> {
        Ok(())
    }

    fn properties(_: &mut Schemas) -> Vec<Properties> {
        vec![Properties::default()]
    }
}

json_unit_enum! { Distribution { Beckmann, Ggx } }
json_unit_enum! { Masking { Correlated, Separable } }

/// `{"alpha": 0.1}`, or a list of two numbers, along u and along v.
impl StructCodec for Roughness {
    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let one = keys.take("alpha").map(|node| ABOVE_0.read(&node, cx)).transpose()?;
        let alpha: [Scalar; 2] = match one {
            Some(alpha) => [Scalar::clone(&alpha), alpha],
            None => [
                keys.read("alpha_u", &ABOVE_0, None, cx)?,
                keys.read("alpha_v", &ABOVE_0, None, cx)?,
            ],
        };
        Ok(Self {
            alpha,
            distribution: keys.read("distribution", &Plain, Some(Distribution::Ggx), cx)?,
            masking: keys.read("masking", &Plain, Some(Masking::Correlated), cx)?,
            multiple_scattering: keys.read("multiple_scattering", &Plain, Some(false), cx)?,
        })
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        let [u, v] = &self.alpha;
        if u == v {
            put(out, "alpha", &ABOVE_0, u, None, cx)?;
        } else {
            put(out, "alpha_u", &ABOVE_0, u, None, cx)?;
            put(out, "alpha_v", &ABOVE_0, v, None, cx)?;
        }
        put(out, "distribution", &Plain, &self.distribution, Some(Distribution::Ggx), cx)?;
        put(out, "masking", &Plain, &self.masking, Some(Masking::Correlated), cx)?;
        put(out, "multiple_scattering", &Plain, &self.multiple_scattering, Some(false), cx)
    }

    fn properties(schemas: &mut Schemas) -> Vec<Properties> {
        let common = Properties::default()
            .with(
                "distribution",
                &Plain,
                |r: &Self| &r.distribution,
                Some(Distribution::Ggx),
                schemas,
            )
            .with("masking", &Plain, |r: &Self| &r.masking, Some(Masking::Correlated), schemas)
            .with(
                "multiple_scattering",
                &Plain,
                |r: &Self| &r.multiple_scattering,
                Some(false),
                schemas,
            );
        let alpha = |all: Properties, name, schemas: &mut Schemas| {
            all.with(name, &ABOVE_0, |r: &Self| &r.alpha[0], None, schemas)
        };
        let one = alpha(common.clone(), "alpha", schemas);
        let two = alpha(alpha(common, "alpha_u", schemas), "alpha_v", schemas);
        vec![one, two]
    }
}

/// A colour as `reflectance`, an absorption as `absorption`, or concentrations as `eumelanin` and
/// `pheomelanin`; by default, that of brown hair.
impl StructCodec for Pigment {
    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let [reflectance, absorption, eumelanin, pheomelanin] = PIGMENTS.map(|key| keys.take(key));
        let melanin = eumelanin.is_some() || pheomelanin.is_some();
        let given = [reflectance.is_some(), absorption.is_some(), melanin];
        if given.into_iter().filter(|is_given| *is_given).count() > 1 {
            let message = "expected one of \"reflectance\", \"absorption\", or \"eumelanin\" and \
                           \"pheomelanin\", found several";
            return Err(keys.node.error(message));
        }
        if let Some(reflectance) = reflectance {
            return SHARE.read(&reflectance, cx).map(Self::Reflectance);
        }
        if let Some(absorption) = absorption {
            return FROM_0.read(&absorption, cx).map(Self::Absorption);
        }
        if !melanin {
            return Ok(Hair::default().pigment);
        }
        let number = |node: Option<JsonNode<'_>>| node.map_or(Ok(0.0), |node| FROM_0.number(&node));
        Ok(Self::Melanin([number(eumelanin)?, number(pheomelanin)?]))
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        let [reflectance, absorption, eumelanin, pheomelanin] = PIGMENTS;
        match self {
            Self::Reflectance(color) => put(out, reflectance, &SHARE, color, None, cx),
            Self::Absorption(absorbed) => put(out, absorption, &FROM_0, absorbed, None, cx),
            Self::Melanin([brown, red]) => {
                put(out, eumelanin, &FROM_0, brown, None, cx)?;
                put(out, pheomelanin, &FROM_0, red, Some(0.0), cx)
            }
        }
    }

    fn properties(schemas: &mut Schemas) -> Vec<Properties> {
        let [reflectance, absorption, eumelanin, pheomelanin] = PIGMENTS;
        let color = FieldCodec::<Color>::schema(&SHARE, schemas);
        let absorbed = FieldCodec::<[f32; 3]>::schema(&FROM_0, schemas);
        let concentration = FieldCodec::<f32>::schema(&FROM_0, schemas);
        let one = |key, schema| Properties::default().with_schema(key, schema, true);
        let melanin = Properties::default()
            .with_schema(eumelanin, concentration.clone(), false)
            .with_schema(pheomelanin, concentration, false);
        vec![one(reflectance, color), one(absorption, absorbed), melanin]
    }
}

/// Keys of pigments.
const PIGMENTS: [&str; 4] = ["reflectance", "absorption", "eumelanin", "pheomelanin"];

/// A texture as a `normal_map`, perhaps with the directions `along` of its frame, as a
/// `turned_normal_map`, or as a `height_map` with its `height`.
impl StructCodec for NormalOrBump {
    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        if let Some(normals) = keys.take("normal_map") {
            let normals = Arc::read(&normals, cx)?;
            return Ok(match keys.take("along") {
                Some(along) => Self::NormalsAlong(normals, Arc::read(&along, cx)?),
                None => Self::Normals(normals),
            });
        }
        if let Some(normals) = keys.take("turned_normal_map") {
            return Arc::read(&normals, cx).map(Self::TurnedNormals);
        }
        let Some(heights) = keys.take("height_map") else {
            return Err(keys.node.error("missing \"normal_map\" or \"height_map\""));
        };
        Ok(Self::Heights(Arc::read(&heights, cx)?, keys.read("height", &ANY, Some(1.0), cx)?))
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        match self {
            Self::Normals(texture) => put(out, "normal_map", &Plain, texture, None, cx),
            Self::TurnedNormals(texture) => {
                put(out, "turned_normal_map", &Plain, texture, None, cx)
            }
            Self::NormalsAlong(texture, along) => {
                put(out, "normal_map", &Plain, texture, None, cx)?;
                put(out, "along", &Plain, along, None, cx)
            }
            Self::Heights(texture, height) => {
                put(out, "height_map", &Plain, texture, None, cx)?;
                put(out, "height", &ANY, height, Some(1.0), cx)
            }
        }
    }

    fn properties(schemas: &mut Schemas) -> Vec<Properties> {
        let map = Arc::<Texture>::schema(schemas);
        let normals = Properties::default()
            .with_schema("normal_map", map.clone(), true)
            .with_schema("along", map.clone(), false);
        let turned = Properties::default().with_schema("turned_normal_map", map.clone(), true);
        let height = serde_json::json!({"type": "number", "default": 1});
        let heights = Properties::default().with_schema("height_map", map, true);
        vec![normals, turned, heights.with_schema("height", height, false)]
    }
}

json_struct! {
    Texture { layout: Plain => TextureMapping::default(), to_pattern: OfTexture => DMat3::IDENTITY } + pattern: Pattern
}

json_enum! {
    TextureMapping {
        Surface(),
        Space { to_texture: ToTexture => DAffine3::IDENTITY },
        Sphere { to_texture: ToTexture => DAffine3::IDENTITY },
        Coordinates { set: UpTo(MAX_SETS) => 1 },
        Cylinder { to_texture: ToTexture => DAffine3::IDENTITY },
    }
}

json_enum! {
    Pattern {
        Bitmap(Bitmap),
        Checkerboard[colors: Pair(FROM_0)],
        VertexColors(),
        FaceColors(),
        VertexAttribute[name: Plain],
        FaceAttribute[name: Plain],
        Procedural(..Procedural),
        Grid { grid: Plain, filter: Plain => GridFilter::default() },
        AbsNormalDot[direction: Each(ANY)],
        Product[factors: Pair(FROM_0)],
        Blend(Box<Blend>),
        Sqrt[square: FROM_0],
    }
}

json_enum! {
    Procedural {
        Checkerboard3d[colors: Pair(FROM_0)],
        Dots[colors: Pair(FROM_0)],
        Fbm(Noise),
        Wrinkled(Noise),
        Windy(),
        Marble(Marble),
    }
}

json_struct! { Noise { octaves: UpTo(Noise::MAX_OCTAVES) => 8, roughness: TO_2 => 0.5 } }
json_struct! { Marble { variation: ANY => 0.2 } + noise: Noise }

json_struct! { Blend { first: FROM_0, second: FROM_0, amount: SHARE => 0.5.into() } }

json_struct! {
    Bitmap { image: Plain, wrap: Plain => Wrap::default(), filter: Plain => Filter::default() }
}
json_unit_enum! { Edge { Repeat, Mirror, Clamp, Black } }

/// A name for both directions, or a list of one for u and one for v.
impl JsonCodec for Wrap {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        if node.text().is_some() {
            return Edge::read(node, cx).map(Self::both);
        }
        match node.list("a name, or a list of 2 names").as_deref() {
            Ok([u, v]) => Ok(Self { u: Edge::read(u, cx)?, v: Edge::read(v, cx)? }),
            _ => Err(node.unexpected("a name, or a list of 2 names")),
        }
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        if self.u == self.v { self.u.write(cx) } else { [self.u, self.v].write(cx) }
    }

    fn schema(schemas: &mut Schemas) -> Value {
        let both = <[Edge; 2]>::schema(schemas);
        json!({"anyOf": [Edge::schema(schemas), both]})
    }
}
json_unit_enum! { Filter { Bilinear, Nearest, Trilinear } }

impl TableEntry for Texture {
    const TABLE: (&'static str, &'static str) = ("textures", "texture");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.textures
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        const MAX_PARTS: usize = 1000;
        let texture = Self::read(node, cx)?;
        // Nested products of the same texture would grow without bound.
        if parts(&texture) > MAX_PARTS {
            return Err(node.error(format!(
                "the texture has more than {MAX_PARTS} parts, including nested ones"
            )));
        }
        Ok(Arc::new(texture))
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        self.write(cx)
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        Self::schema(schemas)
    }
}

/// Returns the number of textures that a texture consists of, including itself.
fn parts(texture: &Texture) -> usize {
    1 + texture.pattern.parts().map(|t| parts(t)).sum::<usize>()
}
