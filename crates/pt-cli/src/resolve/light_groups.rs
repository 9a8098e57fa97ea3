//! Checks of `--light-groups`.

use pathtracer::{INTEGRATORS, Registration};

use super::has_room_for_channels;
use crate::arg_values::Direct;
use crate::args::Cli;
use crate::compat::WITHOUT_RECORDS;

/// Rejects integrators and options that do not support light groups, and image formats without room
/// for their channels.
///
/// # Errors
/// A message with the options that light groups require.
pub(super) fn check(cli: &Cli) -> Result<(), String> {
    if cli.light_groups.is_none() {
        return Ok(());
    }
    if !has_room_for_channels(cli) {
        return Err(
            "--light-groups requires an image with additional channels, as in -f out.exr".into()
        );
    }
    let name = cli.integrator.as_deref();
    let recorded = |known: &&Registration| known.new_traced.is_some();
    let by_paths =
        name.is_none_or(|name| INTEGRATORS.iter().filter(recorded).any(|r| r.name == name));
    let by_hemisphere =
        cli.hemisphere || matches!(cli.direct, Some(Direct::Hemisphere | Direct::Cosine));
    if cli.policies().records.is_err()
        || !by_paths
        || by_hemisphere
        || cli.path_reuse > 1
        || cli.split > 1
    {
        let known: Vec<_> = INTEGRATORS.iter().filter(recorded).map(|r| r.name).collect();
        return Err(format!(
            "--light-groups requires --integrator {}, with --direct mis or light and without \
             {WITHOUT_RECORDS}",
            known.join(", ")
        ));
    }
    Ok(())
}
