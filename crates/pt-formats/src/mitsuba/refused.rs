//! Plugins of Mitsuba 3.9.1 that are rejected with a specific reason.

/// Tags, types and reasons.
const REFUSED: [(&str, &str, &str); 7] = [
    ("bsdf", "measured_polarized", "polarization and wavelengths are not simulated"),
    (
        "emitter",
        "directionalarea",
        "light emitted by a surface in a single direction cannot be hit by camera paths; use \
         directional or spot",
    ),
    ("film", "specfilm", "spectra are converted to colours; use hdrfilm"),
    ("shape", "blender", "the mesh is in the memory of Blender; export it as ply"),
    ("integrator", "stokes", "polarization is not simulated; use the nested integrator alone"),
    ("integrator", "depth", "depth is an additional channel; use path and the AOV depth"),
    ("integrator", "volprim_rf_basic", "radiance fields have no surfaces that scatter light"),
];

/// Returns the reason why a plugin is rejected, if there is a specific one.
pub(super) fn reason(tag: &str, kind: &str) -> Option<&'static str> {
    let found = REFUSED.iter().find(|(t, k, _)| (*t, *k) == (tag, kind));
    found.map(|(.., reason)| *reason)
}
