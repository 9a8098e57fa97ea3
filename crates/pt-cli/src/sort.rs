//! Arguments whose meaning depends on others.

use std::path::PathBuf;

use crate::args::Cli;

/// Assigns the paths: the name of the image may be apart from `-f`, as in
/// `-f -m 5 out.png scene.dae`; the remaining path is the scene.
pub(crate) fn paths(cli: &mut Cli) -> Result<(), String> {
    if let Some(None) = cli.output {
        let named = cli.paths.iter().position(|p| pathtracer::image::is_image(p));
        let Some(named) = named else {
            return Err(
                "missing value of -f; give the name of an image file, such as -f out.png".into()
            );
        };
        cli.output = Some(Some(cli.paths.remove(named)));
    }
    if let [first, second, ..] = cli.paths.as_slice() {
        return Err(format!(
            "found two scenes, \"{}\" and \"{}\", expected one",
            first.display(),
            second.display()
        ));
    }
    Ok(())
}

/// Treats the name of a file given to `--camera` as a camera settings file, as for `-c`.
pub(crate) fn cameras(cli: &mut Cli) -> Result<(), String> {
    let named = cli.loading.camera.as_ref().filter(|_| cli.loading.placement().is_none());
    if let Some(file) = named.map(PathBuf::from).filter(|named| named.is_file()) {
        if let Some(other) = cli.camera_file.replace(file) {
            return Err(format!("found two camera files, expected one ({})", other.display()));
        }
        cli.loading.camera = None;
    } else if let (Some(name), true) = (named, cli.paths.is_empty()) {
        return Err(format!(
            "--camera {name}: the embedded scene has one camera; expected file, course or fit, or a scene"
        ));
    }
    Ok(())
}
