//! Plugins of Mitsuba 3.9.1 that are rejected with a specific reason.

/// Tags, types and reasons.
const REFUSED: [(&str, &str, &str); 7] = [
    ("bsdf", "measured_polarized", "light has no polarization here, and no wavelengths"),
    (
        "emitter",
        "directionalarea",
        "no path from the camera finds what shines into a single direction from a surface; take directional, or spot",
    ),
    ("film", "specfilm", "spectra are colours here; take hdrfilm"),
    ("shape", "blender", "its mesh is in the memory of Blender; export it as ply"),
    ("integrator", "stokes", "light has no polarization here; take the integrator inside of it"),
    ("integrator", "depth", "distances are a channel beside light; take path, and the AOV depth"),
    ("integrator", "volprim_rf_basic", "radiance fields are no light that surfaces scatter"),
];

/// Returns the reason why a plugin is rejected, if there is a specific one.
pub(super) fn reason(tag: &str, kind: &str) -> Option<&'static str> {
    let found = REFUSED.iter().find(|(t, k, _)| (*t, *k) == (tag, kind));
    found.map(|(.., reason)| *reason)
}
