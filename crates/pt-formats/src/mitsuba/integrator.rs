//! `<integrator>`: light transport algorithms, and wrappers that add channels.

use pt_scene::material::{Black, Mix, ThinGlass};
use pt_scene::texture::{Color, Scalar};
use pt_scene::{Hidden, RenderHints, Scene, Warning};

use super::object::{MitsubaObject, ObjectTree, Parameters, error, unsupported};
use crate::LoadError;
use crate::shared::names::quote;

/// Supported types, for messages.
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

/// Integrators whose image is that of a path tracer: type, support for media, and default
/// `max_depth`.
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
/// Integrators for direct light only.
const DIRECT: [&str; 2] = ["direct", "direct_projective"];

/// Ignored parameters, which affect only convergence, or derivatives.
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

/// Auxiliary channels (AOVs) by Mitsuba's names, with ours.
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
/// Channels of Mitsuba without an equivalent.
const UNMATCHED: [&str; 4] = ["dp_du", "dp_dv", "duv_dx", "duv_dy"];

/// Reads the integrator, its path depth and its channels into `settings`.
pub(super) fn integrator(
    tree: &ObjectTree,
    object: Option<&MitsubaObject>,
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
        let message = "paths start at the camera, not at the lights; paths that only light tracing \
                       finds, such as caustics of point lights, are missing";
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

/// Converts opacities to specular transmission lobes, as Mitsuba's integrators without media treat
/// them: passing through counts as an interaction, and lights without an extent are not sampled
/// through them. If neither has an effect on the image, opacities are kept.
pub(super) fn fill_holes(scene: &mut Scene) {
    let is_limited = scene.settings.max_depth.is_some_and(|depth| depth != u32::MAX);
    let shows = is_limited || scene.lights.iter().any(|light| light.kind.is_delta());
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

/// Returns the light transport integrator: the first one inside of the wrappers that add channels,
/// if there is one.
fn inside_of_wrappers<'t>(
    tree: &'t ObjectTree,
    outermost: &'t MitsubaObject,
    settings: &mut RenderHints,
    warnings: &mut Vec<Warning>,
) -> Result<Option<&'t MitsubaObject>, LoadError> {
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
            let message = "the squared samples of \"moment\" are not written";
            warnings.push(Warning { at: object.at.clone(), message: message.to_owned() });
        }
        if let [_, second, ..] = inner[..] {
            let message = format!("only the first integrator of the {} is rendered", quote(kind));
            warnings.push(Warning { at: tree.objects[second].at.clone(), message });
        }
        match inner.first() {
            Some(&first) => object = &tree.objects[first],
            None if kind == "aov" => return Ok(None),
            None => {
                let message = "missing <integrator> with radiance inside of \"moment\"";
                return Err(error(&object.at, message));
            }
        }
    }
    Ok(Some(object))
}

/// Reads the channels of a list such as `dd.y:depth,nn:sh_normal`, without duplicates. The names
/// before the colons are ignored.
fn channels(aov: &MitsubaObject) -> Result<Vec<&'static str>, LoadError> {
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
        let message = "missing aovs; expected a list such as \"dd.y:depth,nn:sh_normal\"";
        return Err(parameters.refuse("aovs", message));
    }
    parameters.finish()?;
    Ok(found)
}

/// Parses an entry of the list.
fn channel(entry: &str) -> Result<&'static str, String> {
    let Some((_, kind)) = entry.split_once(':') else {
        return Err(format!(
            "found {}, expected a name and a type, as in dd.y:depth",
            quote(entry)
        ));
    };
    let found = CHANNELS.iter().find(|(theirs, _)| *theirs == kind);
    found.map(|(_, ours)| *ours).ok_or_else(|| {
        let known: Vec<_> = CHANNELS.iter().map(|(theirs, _)| *theirs).collect();
        let what = if UNMATCHED.contains(&kind) { "not supported" } else { "unknown" };
        format!("aov type {} is {what}; supported: {}", quote(kind), known.join(", "))
    })
}

/// Returns the maximum number of interactions from `max_depth`, or the default.
fn max_depth(parameters: &mut Parameters<'_>, usual: i64) -> Result<u32, LoadError> {
    let depth = parameters.integer("max_depth")?.unwrap_or(usual);
    if depth == -1 {
        return Ok(u32::MAX);
    }
    let interactions = depth.checked_sub(1).and_then(|d| u32::try_from(d).ok());
    interactions.ok_or_else(|| {
        let message = format!(
            "found max_depth = {depth}, expected -1 (no limit), 1 (emitters only), 2 (direct \
             light) or more"
        );
        parameters.refuse("max_depth", message)
    })
}
