//! Light groups, by the names of lights.

use std::collections::HashMap;

use pt_core::RenderScene;
use pt_core::light::{AnyLight, LightSourceId};
use pt_core::settings::LightGroups as Wanted;
use pt_cpu::LightGroups;
use pt_formats::suggestions;
use pt_scene::texture::Input;
use pt_scene::{Light, LightKind, Object, Scene};

use crate::cryptomatte::{distinct, objects};

/// Name of visible infinite lights other than disks: constant, clear sky or environment map.
pub const SKY: &str = "sky";

/// Name of visible disks at infinity: the sun of a day and distant disks.
pub const SUN: &str = "sun";

/// Group of all lights that are in no other group.
pub const REST: &str = "rest";

/// Maximum number of groups, since each is a layer of the image.
pub const MAX: usize = 128;

/// Returns the lights of a compiled scene with their names. Emissive objects have the names of
/// [`crate::explain`], lights without a shape and emissive media have their own names, and visible
/// infinite lights are [`SKY`] or [`SUN`]. A name that is already taken gets a number as a suffix.
pub fn lights(scene: &Scene, compiled: &RenderScene) -> Vec<(String, LightSourceId)> {
    let names = objects(scene).zip(0..).zip(&scene.objects);
    let emissive = names.filter(|(_, object)| emits(scene, object));
    let emissive = emissive.map(|((name, number), _)| (name, LightSourceId::Object(number)));
    let nodes = compiled.light_nodes().into_iter().map(|number| {
        let name = &scene.lights[number as usize].name;
        let name = if name.is_empty() { format!("light {number}") } else { name.clone() };
        (name, LightSourceId::Node(number))
    });
    let infinite_lights = (0..).zip(&compiled.infinite_lights).map(|(number, id)| {
        let is_disk = matches!(compiled.lights[*id], AnyLight::Sun(_) | AnyLight::DistantDisk(_));
        (if is_disk { SUN } else { SKY }.to_owned(), LightSourceId::Sky(number))
    });
    let media = (0..).zip(&scene.media).filter(|(_, medium)| medium.matter.emits());
    let media = media.map(|(number, medium)| {
        let name = if medium.name.is_empty() { "medium" } else { &medium.name };
        (name.to_owned(), LightSourceId::Medium(number))
    });
    let all = infinite_lights.chain(nodes).chain(emissive).chain(media);
    let (names, origins): (Vec<_>, Vec<_>) = all.unzip();
    distinct(names.into_iter(), " ").into_iter().zip(origins).collect()
}

/// Returns true if a part of an object is emissive.
fn emits(scene: &Scene, object: &Object) -> bool {
    let materials = object.materials.iter().flatten();
    let emission = |number: &u32| scene.materials.get(*number as usize).map(|m| &m.emission);
    materials.filter_map(emission).any(|emission| *emission != Input::Value([0.0; 3]))
}

/// Upper bound of the number of groups of a scene, before it is compiled.
pub fn most(wanted: &Wanted, scene: &Scene) -> usize {
    let emissive = scene.objects.iter().filter(|object| emits(scene, object)).count();
    let daylight = |light: &&Light| matches!(light.kind, LightKind::Daylight(_));
    let suns = scene.lights.iter().filter(daylight).count();
    let media = scene.media.iter().filter(|medium| medium.matter.emits()).count();
    let each = if wanted.each { scene.lights.len() + suns + emissive + media + 1 } else { 0 };
    (wanted.named.len() + each + 1).min(MAX)
}

/// Resolves the requested groups of a scene.
///
/// # Errors
/// A message, if a name is unknown, if a light is named twice, or if there are too many groups.
pub(crate) fn resolve(
    wanted: &Wanted,
    scene: &Scene,
    compiled: &RenderScene,
) -> Result<LightGroups, String> {
    let lights = lights(scene, compiled);
    let (mut names, mut groups) = (Vec::new(), HashMap::new());
    for group in &wanted.named {
        for name in &group.lights {
            let found = lights.iter().find(|(light, _)| light == name);
            let (_, origin) = found.ok_or_else(|| unknown(name, &lights))?;
            if groups.insert(*origin, names.len() as u32).is_some() {
                return Err(format!(
                    "found the light \"{name}\" in two groups, expected at most one"
                ));
            }
        }
        names.push(group.name.clone());
    }
    if wanted.each {
        for (name, origin) in lights {
            groups.entry(origin).or_insert_with(|| {
                names.push(name);
                names.len() as u32 - 1
            });
        }
    }
    let count = names.len() + 1;
    if count > MAX {
        return Err(format!(
            "found {count} groups of lights, expected at most {MAX}; name only the lights of \
             interest"
        ));
    }
    // The name `REST` stays with the group of all other lights.
    let names = [REST.to_owned()].into_iter().chain(names.iter().map(|name| as_layer(name)));
    let mut names = distinct(names, "_");
    names.rotate_left(1);
    Ok(LightGroups::new(compiled, names, groups))
}

/// Replaces the characters of a name that layers of images cannot contain by `_`.
pub fn as_layer(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// Message for an unknown name, with similar names and with the lights of the scene.
fn unknown(name: &str, lights: &[(String, LightSourceId)]) -> String {
    const SHOWN: usize = 20;
    const MAX_MEANT: usize = 3;
    let quote = |name: &str| format!("\"{name}\"");
    let names = || lights.iter().map(|(name, _)| name.as_str());
    let meant = suggestions(name, names()).into_iter().take(MAX_MEANT).map(quote);
    let meant = match meant.collect::<Vec<_>>().join(" or ") {
        none if none.is_empty() => none,
        meant => format!(" (did you mean {meant}?)"),
    };
    let mut known: Vec<_> = names().take(SHOWN).map(quote).collect();
    if lights.len() > SHOWN {
        known.push(format!("and {} more", lights.len() - SHOWN));
    }
    let known = if known.is_empty() {
        "the scene has no lights".to_owned()
    } else {
        format!("the lights of the scene are {}", known.join(", "))
    };
    format!("unknown light {}{meant}; {known}", quote(name))
}
