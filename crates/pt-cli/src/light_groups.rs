//! Option `--light-groups`.

use pathtracer::light_groups::{REST, as_layer};
use pathtracer::{INTEGRATORS, LightGroup, LightGroups, Registration, Scene, light_groups};

use crate::arg_values::Direct;
use crate::args::Cli;
use crate::resolve::has_room_for_channels;

/// Parses the groups of `--light-groups`.
///
/// # Errors
/// A message with the expected syntax, or with the name of a repeated group.
pub(crate) fn parse(text: &str) -> Result<LightGroups, String> {
    let mut groups = LightGroups::default();
    for entry in text.split(',') {
        let (name, lights) = entry.split_once('=').unwrap_or((entry, entry));
        let is_name = entry == name || as_layer(name) == name;
        if entry == "each" {
            groups.each = true;
            continue;
        }
        if name.is_empty() || !is_name || lights.split('+').any(str::is_empty) {
            return Err("expected each, or groups with the names of their lights, as in sky,key=lamp+window; names of groups \
                        are of letters, digits and _"
                .into());
        }
        let name = as_layer(name);
        if name == REST || groups.named.iter().any(|group| group.name == name) {
            return Err(format!(
                "the group of lights \"{name}\" is there twice; \"rest\" is that of all other lights"
            ));
        }
        let lights = lights.split('+').map(str::to_owned).collect();
        groups.named.push(LightGroup { name, lights });
    }
    Ok(groups)
}

/// Rejects integrators and options that do not support light groups, and image formats without room
/// for their channels.
///
/// # Errors
/// A message with the options that light groups require.
pub(crate) fn check(cli: &Cli) -> Result<(), String> {
    if cli.light_groups.is_none() {
        return Ok(());
    }
    if !has_room_for_channels(cli) {
        return Err(
            "--light-groups needs an image with room for more channels, as in -f out.exr".into()
        );
    }
    let name = cli.integrator.as_deref();
    let recorded = |known: &&Registration| known.new_traced.is_some();
    let by_paths =
        name.is_none_or(|name| INTEGRATORS.iter().filter(recorded).any(|r| r.name == name));
    let by_hemisphere =
        cli.hemisphere || matches!(cli.direct, Some(Direct::Hemisphere | Direct::Cosine));
    if cli.cs184 || !by_paths || by_hemisphere || cli.path_reuse > 1 || cli.split > 1 {
        let known: Vec<_> = INTEGRATORS.iter().filter(recorded).map(|r| r.name).collect();
        return Err(format!(
            "--light-groups needs --integrator {}, with --direct mis or light and without \
             --path-reuse, --path-splitting and --cs184",
            known.join(", ")
        ));
    }
    Ok(())
}

/// Minimum number of light groups, with the group of the remaining lights.
pub(crate) fn least(cli: &Cli) -> usize {
    cli.light_groups.as_ref().map_or(0, |wanted| wanted.named.len() + 1)
}

/// Maximum number of light groups of a scene.
pub(crate) fn most(cli: &Cli, scene: &Scene) -> usize {
    cli.light_groups.as_ref().map_or(0, |wanted| light_groups::most(wanted, scene))
}
