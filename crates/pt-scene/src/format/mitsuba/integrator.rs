//! `<integrator>`.

use super::super::xml::quote;
use super::object::{Object, Parameters, Tree, error, unsupported};
use crate::{FileSettings, LoadError, Warning};

/// What follows light.
const KINDS: [&str; 4] = ["path", "direct", "volpath", "volpathmis"];
/// What may stand in the scene itself.
const OUTERMOST: [&str; 5] = ["path", "direct", "volpath", "volpathmis", "aov (outermost)"];

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
    settings: &mut FileSettings,
    warnings: &mut Vec<Warning>,
) -> Result<(), LoadError> {
    let object = match object {
        Some(object) if object.kind == "aov" => {
            settings.aovs = channels(object)?;
            inner(tree, object)?
        }
        Some(object) if !KINDS.contains(&object.kind.as_str()) => {
            return Err(unsupported(object, &OUTERMOST));
        }
        object => object,
    };
    settings.max_depth = match object {
        Some(object) => Some(max_depth(tree, object, warnings)?),
        None => Some(u32::MAX),
    };
    let is_volumetric = |object: &Object| object.kind.starts_with("volpath");
    settings.integrator = object.is_some_and(is_volumetric).then_some("volpath");
    Ok(())
}

/// What an `aov` finds light with, if anything.
fn inner<'t>(tree: &'t Tree, aov: &Object) -> Result<Option<&'t Object>, LoadError> {
    let inner = tree.children(aov, &["integrator"])?;
    if let [_, second, ..] = inner[..] {
        let message = "an \"aov\" has a second integrator; there is one image, so give one";
        return Err(error(&tree.objects[second].at, message));
    }
    Ok(inner.first().map(|&index| &tree.objects[index]))
}

/// The channels of a list such as `dd.y:depth,nn:sh_normal`, each once. Ours have their own names.
fn channels(aov: &Object) -> Result<Vec<&'static str>, LoadError> {
    let mut parameters = Parameters::new(aov);
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

/// How many interactions an integrator allows.
fn max_depth(tree: &Tree, object: &Object, warnings: &mut Vec<Warning>) -> Result<u32, LoadError> {
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    if parameters.boolean("hide_emitters")? {
        let message = "emitters cannot be hidden; they are seen directly".to_owned();
        warnings.push(Warning { at: object.at.clone(), message });
    }
    let depth = match object.kind.as_str() {
        "path" | "volpath" | "volpathmis" => {
            parameters.pass_over(&["rr_depth"]);
            if object.kind == "volpathmis" {
                parameters.pass_over(&["use_spectral_mis"]);
            }
            match parameters.integer("max_depth")? {
                None | Some(-1) => u32::MAX,
                Some(depth) => {
                    let interactions = depth.checked_sub(1).and_then(|d| u32::try_from(d).ok());
                    interactions.ok_or_else(|| {
                        let message = format!(
                            "max_depth is {depth}; expected -1 (no limit), 1 (emitters only), 2 \
                             (direct light) or more"
                        );
                        parameters.refuse("max_depth", message)
                    })?
                }
            }
        }
        "direct" => {
            parameters.pass_over(&["shading_samples", "emitter_samples", "bsdf_samples"]);
            1
        }
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    Ok(depth)
}
