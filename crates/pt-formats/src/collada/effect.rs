//! Conversion of effects of the common profile to the nearest physical material.

use pt_math::Spectrum;
use pt_scene::material::{Black, Diffuse, Glass, Mirror};
use pt_scene::texture::Wrap;
use pt_scene::{Color, Surface};

use super::reader::{ColladaReader, child, children, elements};
use super::texture;
use crate::LoadError;
use crate::shared::legacy_specular::amount;
use crate::shared::names::quote;
use crate::shared::xml::XmlNode;
use crate::shared::{legacy_specular, placeholder};

/// Default index of refraction of transparent materials: window glass.
const DEFAULT_IOR: f32 = 1.5;
/// Default diffuse colour (as in the program of the profile `CGL`), also in place of a texture.
const DEFAULT_DIFFUSE: [f32; 3] = [0.5; 3];

/// An effect, its instance, which may set parameters, and its technique.
struct Scope<'a> {
    effect: XmlNode<'a>,
    instance: XmlNode<'a>,
    profile: XmlNode<'a>,
    technique: XmlNode<'a>,
    /// `<lambert>`, `<phong>`, `<blinn>` or `<constant>`.
    shader: XmlNode<'a>,
}

/// A colour or a texture.
enum Paint {
    Color([f32; 4]),
    Texture(Painting),
}

/// A reference to an image.
struct Painting {
    /// File name, or the last name of the chain of references if that does not lead to a file.
    file: String,
    wrap: Wrap,
}

/// Returns the surface and the emission of an effect.
///
/// | in the file | becomes |
/// |---|---|
/// | transmits at least half of the light | [`Glass`] |
/// | reflective, and not diffuse | [`Mirror`] |
/// | phong or blinn with a specular colour, without the profile `CGL` | [`Plastic`] |
/// | constant | [`Black`], with its emission |
/// | others | [`Diffuse`] |
///
/// [`Plastic`]: pt_scene::material::Plastic
pub(super) fn read<'a>(
    reader: &mut ColladaReader<'a>,
    effect: XmlNode<'a>,
    instance: XmlNode<'a>,
) -> Result<(Surface, Color), LoadError> {
    let Some(scope) = scope(effect, instance) else {
        let message = "missing <lambert>, <phong>, <blinn> or <constant> in a <profile_COMMON>; \
                       grey (0.5) is used";
        reader.warn(effect, message);
        return Ok((
            Diffuse { reflectance: DEFAULT_DIFFUSE.into(), two_sided: true }.into(),
            [0.0; 3].into(),
        ));
    };
    let emission = painted_or(reader, &scope, "emission", [0.0; 3])?;
    if let Some(glass) = glass(reader, &scope)? {
        return Ok((glass.into(), emission));
    }
    let surface = match scope.shader.tag_name().name() {
        "constant" => Black.into(),
        kind => opaque(reader, &scope, kind)?,
    };
    Ok((surface, emission))
}

/// Finds the technique of the common profile.
fn scope<'a>(effect: XmlNode<'a>, instance: XmlNode<'a>) -> Option<Scope<'a>> {
    let profile = child(effect, "profile_COMMON")?;
    let (technique, shader) = children(profile, "technique").find_map(|technique| {
        let is_shader = |n: &XmlNode<'a>| {
            matches!(n.tag_name().name(), "lambert" | "phong" | "blinn" | "constant")
        };
        Some((technique, elements(technique).find(is_shader)?))
    })?;
    Some(Scope { effect, instance, profile, technique, shader })
}

/// Returns an opaque surface.
fn opaque<'a>(
    reader: &mut ColladaReader<'a>,
    scope: &Scope<'a>,
    kind: &str,
) -> Result<Surface, LoadError> {
    let diffuse = share_or(reader, scope, "diffuse", DEFAULT_DIFFUSE)?;
    let is_diffuse = amount(&diffuse) > legacy_specular::MIN;
    let reflectivity = float_or(reader, scope, "reflectivity", 1.0)?.min(1.0);
    let reflective = plain_or(reader, scope, "reflective", [0.0; 3])?.map(|c| c * reflectivity);
    if Spectrum::from(reflective).luminance() > legacy_specular::MIN {
        if !is_diffuse {
            return Ok(Mirror { reflectance: reflective.into() }.into());
        }
        let message = "mirrors that are also diffuse are not supported; <reflective> is ignored";
        reader.warn(scope.shader, message);
    }
    if kind == "lambert" || reader.has_cgl_shading {
        return Ok(Diffuse { reflectance: diffuse, two_sided: true }.into());
    }
    let specular = share_or(reader, scope, "specular", [0.0; 3])?;
    let shininess = float_or(reader, scope, "shininess", legacy_specular::DEFAULT_EXPONENT)?;
    Ok(legacy_specular::phong(diffuse, specular, shininess))
}

/// Returns a glass if the effect transmits at least half of the light. Partial transparency is not
/// supported.
fn glass<'a>(
    reader: &mut ColladaReader<'a>,
    scope: &Scope<'a>,
) -> Result<Option<Glass>, LoadError> {
    /// Tolerance of rounding near 0 and 1.
    const TOLERANCE: f32 = 0.01;
    let alone = child(scope.shader, "transparency");
    let Some(transparent) = child(scope.shader, "transparent").or(alone) else { return Ok(None) };
    let color = match transparent.tag_name().name() {
        "transparency" => Some(Paint::Color([1.0; 4])),
        _ => paint(reader, scope, transparent)?,
    };
    let transmitted = match color {
        Some(Paint::Color(color)) => transmittance(reader, scope, transparent, color)?,
        Some(Paint::Texture(Painting { file, .. })) => {
            let message =
                format!("the texture {} is ignored; the material is opaque", quote(&file));
            reader.warn(transparent, message);
            return Ok(None);
        }
        None => return Ok(None),
    };
    let is_glass = Spectrum::from(transmitted).luminance() >= 0.5;
    // A tinted glass transmits at least one channel.
    let largest = transmitted.into_iter().fold(0.0, f32::max);
    if largest > TOLERANCE && largest < 1.0 - TOLERANCE {
        let taken = if is_glass { "clear" } else { "opaque" };
        let message = format!("partial transparency is not supported; the material is {taken}");
        reader.warn(transparent, message);
    }
    if !is_glass {
        return Ok(None);
    }
    let ior = float_or(reader, scope, "index_of_refraction", DEFAULT_IOR)?;
    let ior = if ior > 0.0 { ior } else { DEFAULT_IOR };
    let (reflectance, transmittance) = ([1.0; 3].into(), transmitted.into());
    Ok(Some(Glass { reflectance, transmittance, ior, roughness: None }))
}

/// Returns the transmittance, by the colour of `<transparent>`, its `opaque` mode and
/// `<transparency>`, which alone scales an opaque colour (COLLADA 1.5.0, "Determining
/// Transparency").
fn transmittance<'a>(
    reader: &mut ColladaReader<'a>,
    scope: &Scope<'a>,
    transparent: XmlNode<'a>,
    [r, g, b, a]: [f32; 4],
) -> Result<[f32; 3], LoadError> {
    let transparency = float_or(reader, scope, "transparency", 1.0)?;
    let scaled = |color: [f32; 3]| color.map(|c| (c * transparency).min(1.0));
    Ok(match transparent.attribute("opaque").unwrap_or("A_ONE") {
        "A_ONE" => scaled([a; 3]).map(|c| 1.0 - c),
        "A_ZERO" => scaled([a; 3]),
        "RGB_ONE" => scaled([r, g, b]).map(|c| 1.0 - c),
        "RGB_ZERO" => scaled([r, g, b]),
        other => {
            let message = format!(
                "unknown value opaque={}; expected A_ONE, A_ZERO, RGB_ONE or RGB_ZERO; the \
                 material is opaque",
                quote(other)
            );
            reader.warn(transparent, message);
            [0.0; 3]
        }
    })
}

/// Returns [`painted_or`], clamped to at most 1.
fn share_or<'a>(
    reader: &mut ColladaReader<'a>,
    scope: &Scope<'a>,
    tag: &str,
    default: [f32; 3],
) -> Result<Color, LoadError> {
    let color = painted_or(reader, scope, tag, default)?;
    Ok(match (child(scope.shader, tag), color) {
        (Some(element), Color::Value(color)) => clamped(reader, element, color).into(),
        (_, color) => color,
    })
}

/// Returns a constant reflectance: the default, with a warning, in place of a texture.
fn plain_or<'a>(
    reader: &mut ColladaReader<'a>,
    scope: &Scope<'a>,
    tag: &str,
    default: [f32; 3],
) -> Result<[f32; 3], LoadError> {
    let Some(element) = child(scope.shader, tag) else { return Ok(default) };
    Ok(match paint(reader, scope, element)? {
        Some(Paint::Color([r, g, b, _])) => clamped(reader, element, [r, g, b]),
        Some(Paint::Texture(Painting { file, .. })) => {
            let message = format!("the texture {} is ignored", quote(&file));
            instead(reader, element, &message, default)
        }
        None => default,
    })
}

/// Returns the colour or the texture of an element of the shader, or a default if it is missing.
/// The default also replaces images that cannot be read, with a warning, and images in files of the
/// the profile `CGL`, whose program ignores them.
fn painted_or<'a>(
    reader: &mut ColladaReader<'a>,
    scope: &Scope<'a>,
    tag: &str,
    default: [f32; 3],
) -> Result<Color, LoadError> {
    let Some(element) = child(scope.shader, tag) else { return Ok(default.into()) };
    Ok(match paint(reader, scope, element)? {
        Some(Paint::Color([r, g, b, _])) => [r, g, b].into(),
        Some(Paint::Texture(Painting { file, .. })) if reader.has_cgl_shading => {
            let message = format!("the texture {} is ignored", quote(&file));
            instead(reader, element, &message, default).into()
        }
        Some(Paint::Texture(Painting { file, wrap })) => match texture::read(reader, &file, wrap) {
            Ok(texture) => Color::Texture(texture),
            Err(why) => {
                let message = format!(
                    "the texture {} is not shown: {why}; {}",
                    quote(&file),
                    placeholder::INSTEAD
                );
                reader.context.missing(reader.document.span(element), message);
                reader.context.set_placeholder_used();
                Color::Texture(placeholder::texture())
            }
        },
        None => default.into(),
    })
}

/// Returns a colour in place of a texture, with a warning.
fn instead<'a>(
    reader: &mut ColladaReader<'a>,
    element: XmlNode<'a>,
    message: &str,
    color: [f32; 3],
) -> [f32; 3] {
    let [r, g, b] = color;
    reader.warn(element, format!("{message}; the colour {r} {g} {b} is used"));
    color
}

/// Reads the content of an element such as `<diffuse>`.
fn paint<'a>(
    reader: &mut ColladaReader<'a>,
    scope: &Scope<'a>,
    element: XmlNode<'a>,
) -> Result<Option<Paint>, LoadError> {
    if let Some(color) = child(element, "color") {
        return reader.rgba(color).map(|c| Some(Paint::Color(c)));
    }
    if let Some(param) = child(element, "param") {
        let value = parameter(reader, scope, param)?;
        return reader.rgba(value).map(|c| Some(Paint::Color(c)));
    }
    let Some(name) = child(element, "texture").and_then(|t| t.attribute("texture")) else {
        return Ok(None);
    };
    let wrap = texture::wrap(reader, definition(scope, name));
    Ok(Some(Paint::Texture(Painting { file: image_name(reader, scope, name), wrap })))
}

/// Returns the number of an element of the shader, or a default if it is missing.
fn float_or<'a>(
    reader: &ColladaReader<'a>,
    scope: &Scope<'a>,
    tag: &str,
    default: f32,
) -> Result<f32, LoadError> {
    let Some(element) = child(scope.shader, tag) else { return Ok(default) };
    let value = match (child(element, "float"), child(element, "param")) {
        (Some(float), _) => float,
        (None, Some(param)) => parameter(reader, scope, param)?,
        (None, None) => return Ok(default),
    };
    match reader.scalar(value)? as f32 {
        number if number >= 0.0 && number.is_finite() => Ok(number),
        bad => Err(reader.error(value, format!("expected a number from 0 up, found {bad}"))),
    }
}

/// Returns the element with the value to which a `<param ref="…">` refers: that set by the instance
/// of the effect, otherwise that of the innermost `<newparam>`.
fn parameter<'a>(
    reader: &ColladaReader<'a>,
    scope: &Scope<'a>,
    param: XmlNode<'a>,
) -> Result<XmlNode<'a>, LoadError> {
    let name = param.attribute("ref").unwrap_or_default();
    definition(scope, name).and_then(|definition| elements(definition).find(is_value)).ok_or_else(
        || {
            let message =
                format!("found ref={}, expected the sid of a <newparam> with a value", quote(name));
            reader.error(param, message)
        },
    )
}

fn is_value(element: &XmlNode<'_>) -> bool {
    matches!(element.tag_name().name(), "float" | "float3" | "float4" | "color")
}

fn definition<'a>(scope: &Scope<'a>, name: &str) -> Option<XmlNode<'a>> {
    let set = children(scope.instance, "setparam").find(|n| n.attribute("ref") == Some(name));
    let scopes = [scope.technique, scope.profile, scope.effect];
    let mut new = scopes.into_iter().flat_map(|n| children(n, "newparam"));
    set.or_else(|| new.find(|n| n.attribute("sid") == Some(name)))
}

/// Returns the file name of a texture, or its name in the shader if there is none.
///
/// A texture names a sampler, which names a surface (or, from 1.5, an image), which names an image,
/// which names a file; some exporters omit steps.
fn image_name<'a>(reader: &ColladaReader<'a>, scope: &Scope<'a>, texture: &str) -> String {
    const MAX_STEPS: usize = 4;
    let mut name = texture;
    for _ in 0..MAX_STEPS {
        let Some(next) = definition(scope, name).or_else(|| reader.find(name, &["image"])) else {
            break;
        };
        let link = next.descendants().find(|n| {
            matches!(n.tag_name().name(), "source" | "init_from" | "instance_image" | "ref")
                && !n.children().any(|inner| inner.is_element())
        });
        let text = link.and_then(|n| n.attribute("url").or(n.text())).unwrap_or_default().trim();
        if text.is_empty() {
            break;
        }
        name = text.strip_prefix('#').unwrap_or(text);
    }
    name.to_owned()
}

/// Clamps a reflectance to at most 1, with a warning.
pub(super) fn clamped<'a>(
    reader: &mut ColladaReader<'a>,
    element: XmlNode<'a>,
    color: [f32; 3],
) -> [f32; 3] {
    if color.iter().any(|c| *c > 1.0) {
        let message = "found a reflectance above 1; its components are clamped to 1";
        reader.warn(element, message);
    }
    color.map(|c| c.min(1.0))
}
