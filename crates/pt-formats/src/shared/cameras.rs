//! Choice of the active camera of a file.

use std::path::Path;

use pt_scene::{Camera, Hint, Scene, Warning};

use super::context::LoadContext;
use super::mesh_file;
use super::names::quote;
use crate::LoadError;
use crate::shared::names;

/// Maximum number of cameras in a message.
const MAX_LISTED: usize = 30;

/// Returns the index of a requested camera: by name or, if no camera has that name, by its index in
/// file order, from 0.
///
/// # Errors
/// Returns a message with the list of cameras, if none or several match.
pub fn find(wanted: &str, names: &[&str]) -> Result<usize, String> {
    let named: Vec<_> = (0..names.len()).filter(|i| names[*i] == wanted).collect();
    let number = wanted.parse::<usize>().ok().filter(|i| *i < names.len());
    let problem = match (named.as_slice(), number) {
        ([one], _) => return Ok(*one),
        ([], Some(number)) => return Ok(number),
        ([], None) if names.is_empty() => return Err("the scene has no camera".to_owned()),
        ([], None) => format!("unknown camera {}", quote(wanted)),
        _ => format!("found {} cameras named {}, expected one", named.len(), quote(wanted)),
    };
    let hint = match names::suggestions(wanted, names.iter().copied()).first() {
        Some(name) if named.is_empty() => format!("; did you mean {}?", quote(name)),
        _ => String::new(),
    };
    Err(format!("{problem}{hint}; cameras of the scene: {}", list(names)))
}

/// Opens the shutters at a time, if one is given; exposure times stay.
pub(crate) fn open_shutters(cameras: &mut [Camera], time: Option<f64>) {
    let Some(time) = time else { return };
    for camera in cameras {
        let [open, close] = camera.shutter;
        camera.shutter = [time, time + (close - open)];
    }
}

/// Formats a list as in `0 "front", 1 "back"`.
fn list(names: &[&str]) -> String {
    let listed = names.iter().enumerate().take(MAX_LISTED);
    let mut all: Vec<_> = listed.map(|(i, name)| format!("{i} {}", quote(name))).collect();
    if let Some(more) = names.len().checked_sub(MAX_LISTED).filter(|more| *more > 0) {
        all.push(format!("{more} more"));
    }
    all.join(", ")
}

/// Sets the active camera of a scene if one is requested; otherwise, if the scene has several, adds
/// a warning that lists them.
///
/// # Errors
/// Returns an error if the scene does not have the camera.
pub(crate) fn choose(
    scene: &mut Scene,
    path: &Path,
    context: &LoadContext,
) -> Result<(), LoadError> {
    let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    if let Some(wanted) = &context.options().camera {
        let message = |message: String| mesh_file::error(path, 0, format!("camera: {message}"));
        let index = find(wanted, &names).map_err(message)?;
        scene.used_camera = (names.len() > 1).then_some(index as u32);
    } else if let (Some(used), true) = (scene.camera(), names.len() > 1) {
        let message = format!(
            "the scene has {} cameras: {}; {} is used",
            names.len(),
            list(&names),
            quote(&used.name),
        );
        scene.warnings.push(Warning { at: mesh_file::place(path, 0), message });
        context.suggest(Hint::SelectCamera);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_have_names_and_numbers() {
        let names = ["front", "1", "side", "side"];
        assert_eq!(find("front", &names), Ok(0));
        assert_eq!(find("1", &names), Ok(1), "a name before a number");
        assert_eq!(find("3", &names), Ok(3));
        let message = find("frnt", &names).expect_err("no such camera");
        assert_eq!(
            message,
            "unknown camera \"frnt\"; did you mean \"front\"?; cameras of the scene: \
             0 \"front\", 1 \"1\", 2 \"side\", 3 \"side\""
        );
        assert!(find("4", &names).is_err() && find("-1", &names).is_err());
        assert!(
            find("side", &names)
                .expect_err("two")
                .starts_with("found 2 cameras named \"side\", expected one")
        );
        assert_eq!(find("0", &[]), Err("the scene has no camera".to_owned()));
    }

    #[test]
    fn long_lists_are_cut_off() {
        let names = ["c"; MAX_LISTED + 12];
        assert!(list(&names).ends_with("29 \"c\", 12 more"));
    }
}
