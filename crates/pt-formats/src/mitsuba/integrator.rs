//! `<integrator>`: those that find light, and those around them.

use super::super::xml::quote;
use super::object::{Object, Parameters, Tree, error, unsupported};
use crate::material::{Black, Mix, ThinGlass};
use crate::texture::{Color, Scalar};
use crate::{Hidden, Light, LightKind, LoadError, RenderHints, Scene, Warning};

/// What is supported, for messages.
const KINDS: [&str; 12] = [
    "path",
    "direct",
    "volpath",
    "volpathmis",
    "aov",
    "moment",
    "ptracer",
    "prb",
    "prb_basic",
    "prb_projective",
    "prbvolpath",
    "direct_projective",
];

/// Integrators whose picture is that of a path tracer: their names, whether they know media, and
/// the `max_depth` that they have by default.
const PATHS: [(&str, bool, i64); 8] = [
    ("path", false, -1),
    ("ptracer", false, -1),
    ("prb", false, 6),
    ("prb_basic", false, 6),
    ("prb_projective", false, 6),
    ("prbvolpath", true, 6),
    ("volpath", true, -1),
    ("volpathmis", true, -1),
];
/// Those that see lights and what these light.
const DIRECT: [&str; 2] = ["direct", "direct_projective"];

/// Parameters that change how fast an image converges, or how its derivatives do.
const PASSED_OVER: [&str; 15] = [
    "block_size",
    "bsdf_samples",
    "emitter_samples",
    "guiding",
    "guiding_proj",
    "guiding_rounds",
    "project_seed",
    "rr_depth",
    "samples_per_pass",
    "shading_samples",
    "sppc",
    "sppi",
    "sppp",
    "timeout",
    "use_spectral_mis",
];

/// Channels besides light by the names of Mitsuba, and by ours.
const CHANNELS: [(&str, &str); 8] = [
    ("albedo", "albedo"),
    ("depth", "depth"),
    ("geo_normal", "geometric_normal"),
    ("position", "position"),
    ("prim_index", "primitive"),
    ("sh_normal", "normal"),
    ("shape_index", "object"),
    ("uv", "uv"),
];
/// Those that nothing here matches.
const UNMATCHED: [&str; 4] = ["dp_du", "dp_dv", "duv_dx", "duv_dy"];

/// What an integrator is, how many interactions it allows, and which channels it asks for.
pub(super) fn integrator(
    tree: &Tree,
    object: Option<&Object>,
    settings: &mut RenderHints,
    warnings: &mut Vec<Warning>,
) -> Result<(), LoadError> {
    let Some(outermost) = object else {
        settings.max_depth = Some(u32::MAX);
        return Ok(());
    };
    let Some(object) = inside_of_wrappers(tree, outermost, settings, warnings)? else {
        settings.max_depth = Some(u32::MAX);
        return Ok(());
    };
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    if parameters.boolean("hide_emitters")? {
        settings.hidden = Hidden::Emitters;
    }
    if object.kind == "ptracer" {
        let message = "light is followed from the camera, not from the lights: the picture is the same \
                       but for what only paths from lights find, such as caustics of point lights";
        warnings.push(Warning { at: object.at.clone(), message: message.to_owned() });
    }
    parameters.pass_over(&PASSED_OVER);
    let path = PATHS.iter().find(|(kind, ..)| *kind == object.kind);
    settings.max_depth = Some(match path {
        Some((_, _, usual)) => max_depth(&mut parameters, *usual)?,
        None if DIRECT.contains(&object.kind.as_str()) => 1,
        None => return Err(unsupported(object, &KINDS)),
    });
    settings.straight_is_free = path.is_some_and(|(_, media, _)| *media);
    settings.integrator = settings.straight_is_free.then_some("volpath");
    parameters.finish()
}

/// Makes holes ways in which their surfaces scatter light, as they are to Mitsuba's integrators
/// without media: interactions that are counted, through which lights that have no extent are not
/// found. Where neither can be seen, they stay holes.
pub(super) fn fill_holes(scene: &mut Scene) {
    use LightKind::{Directional, Ies, LinearSpot, Point, Projector, PunctualSpot, Spot};
    let is_limited = scene.settings.max_depth.is_some_and(|depth| depth != u32::MAX);
    let is_point = |light: &Light| {
        matches!(
            light.kind,
            Point { .. }
                | Spot { .. }
                | LinearSpot { .. }
                | PunctualSpot { .. }
                | Projector { .. }
                | Ies { .. }
                | Directional { .. }
        )
    };
    let shows = is_limited || scene.lights.iter().any(is_point);
    if scene.settings.straight_is_free || !shows {
        return;
    }
    for material in &mut scene.materials {
        let share = std::mem::replace(&mut material.opacity, 1.0.into());
        let tint = || Color::Value([1.0; 3]);
        let hole = ThinGlass { reflectance: tint(), transmittance: tint(), ior: 1.0 };
        material.surface = match share {
            Scalar::Value(1.0) => continue,
            Scalar::Value(0.0) => hole.into(),
            share => {
                let surface = std::mem::replace(&mut material.surface, Black.into());
                Mix { first: Box::new(hole.into()), second: surface.into(), amount: share }.into()
            }
        };
    }
}

/// The integrator that finds light: the first one inside of those that only add channels, if any.
fn inside_of_wrappers<'t>(
    tree: &'t Tree,
    outermost: &'t Object,
    settings: &mut RenderHints,
    warnings: &mut Vec<Warning>,
) -> Result<Option<&'t Object>, LoadError> {
    let mut object = outermost;
    while let kind @ ("aov" | "moment") = object.kind.as_str() {
        let inner = tree.children(object, &["integrator"])?;
        if kind == "aov" {
            for channel in channels(object)? {
                if !settings.aovs.contains(&channel) {
                    settings.aovs.push(channel);
                }
            }
        } else {
            let mut parameters = Parameters::new(object);
            parameters.pass_over(&PASSED_OVER);
            parameters.finish()?;
            let message = "the squares of samples that a \"moment\" adds are not written";
            warnings.push(Warning { at: object.at.clone(), message: message.to_owned() });
        }
        if let [_, second, ..] = inner[..] {
            let message =
                format!("the image is that of the first integrator of the {}", quote(kind));
            warnings.push(Warning { at: tree.objects[second].at.clone(), message });
        }
        match inner.first() {
            Some(&first) => object = &tree.objects[first],
            None if kind == "aov" => return Ok(None),
            None => {
                let message = "a \"moment\" needs an <integrator> inside that finds light";
                return Err(error(&object.at, message));
            }
        }
    }
    Ok(Some(object))
}

/// The channels of a list such as `dd.y:depth,nn:sh_normal`, each once. Ours have their own names.
fn channels(aov: &Object) -> Result<Vec<&'static str>, LoadError> {
    let mut parameters = Parameters::new(aov);
    parameters.pass_over(&PASSED_OVER);
    let mut found = Vec::new();
    for entry in parameters.text("aovs")?.unwrap_or_default().split(',').map(str::trim) {
        if entry.is_empty() {
            continue;
        }
        let channel = channel(entry).map_err(|message| parameters.refuse("aovs", message))?;
        if !found.contains(&channel) {
            found.push(channel);
        }
    }
    if found.is_empty() {
        let message = "the aovs are missing; expected a list such as \"dd.y:depth,nn:sh_normal\"";
        return Err(parameters.refuse("aovs", message));
    }
    parameters.finish()?;
    Ok(found)
}

/// The channel of an entry of the list.
fn channel(entry: &str) -> Result<&'static str, String> {
    let Some((_, kind)) = entry.split_once(':') else {
        return Err(format!(
            "{} is no aov; expected a name and a type, as in dd.y:depth",
            quote(entry)
        ));
    };
    let found = CHANNELS.iter().find(|(theirs, _)| *theirs == kind);
    found.map(|(_, ours)| *ours).ok_or_else(|| {
        let known: Vec<_> = CHANNELS.iter().map(|(theirs, _)| *theirs).collect();
        let what = if UNMATCHED.contains(&kind) { "not supported" } else { "unknown" };
        format!("the aov type {} is {what}; supported: {}", quote(kind), known.join(", "))
    })
}

/// Returns the number of interactions that an integrator allows, by its `max_depth` or the usual
/// one.
fn max_depth(parameters: &mut Parameters<'_>, usual: i64) -> Result<u32, LoadError> {
    let depth = parameters.integer("max_depth")?.unwrap_or(usual);
    if depth == -1 {
        return Ok(u32::MAX);
    }
    let interactions = depth.checked_sub(1).and_then(|d| u32::try_from(d).ok());
    interactions.ok_or_else(|| {
        let message = format!(
            "max_depth is {depth}; expected -1 (no limit), 1 (emitters only), 2 (direct light) or more"
        );
        parameters.refuse("max_depth", message)
    })
}
