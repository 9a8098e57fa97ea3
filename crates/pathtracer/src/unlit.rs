//! Note about scenes whose lights emit nothing.

use pt_scene::{LightKind, Scene};

/// Text of the note; scenes without lights get studio lighting, or have another note.
const NOTE: &str = "no light of the scene has an emission above 0: the image will be black";

/// Returns the note if the scene has lights, but all lights and materials are black and there are
/// no media.
pub(crate) fn note(scene: &Scene) -> Option<String> {
    let is_unlit = !scene.lights.is_empty()
        && scene.lights.iter().all(|light| is_black(&light.kind))
        && scene.materials.iter().all(|material| material.emission == [0.0; 3].into())
        && scene.media.is_empty();
    is_unlit.then(|| NOTE.to_owned())
}

/// Returns true if a light is known to emit nothing; images and daylight are not examined.
fn is_black(light: &LightKind) -> bool {
    match light {
        LightKind::Environment { scale, .. } => *scale == 0.0,
        other => other.strength() == Some(&[0.0; 3]),
    }
}
