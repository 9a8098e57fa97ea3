//! Named spectra of pbrt-v4.

use pt_scene::metals::Metal;

use crate::shared::names::{did_you_mean, quote};

/// A named spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NamedSpectrum {
    /// Illuminant, by its chromaticity.
    Illuminant([f64; 2]),
    /// Real or imaginary part of an index of refraction, for red, green and blue.
    Optical([f32; 3]),
}

/// Chromaticities of standard illuminants. [CIE 015:2004, tables T.3 and T.8; the white of ACES:
/// SMPTE ST 2065-1]
const ILLUMINANTS: [(&str, [f64; 2]); 16] = [
    ("stdillum-A", [0.447_58, 0.407_45]),
    ("stdillum-D50", [0.345_67, 0.358_50]),
    ("stdillum-D65", [0.312_72, 0.329_03]),
    ("stdillum-F1", [0.3131, 0.3371]),
    ("stdillum-F2", [0.3721, 0.3751]),
    ("stdillum-F3", [0.4091, 0.3941]),
    ("stdillum-F4", [0.4402, 0.4031]),
    ("stdillum-F5", [0.3138, 0.3452]),
    ("stdillum-F6", [0.3779, 0.3882]),
    ("stdillum-F7", [0.3129, 0.3292]),
    ("stdillum-F8", [0.3458, 0.3586]),
    ("stdillum-F9", [0.3741, 0.3727]),
    ("stdillum-F10", [0.3458, 0.3588]),
    ("stdillum-F11", [0.3805, 0.3769]),
    ("stdillum-F12", [0.4370, 0.4042]),
    ("illum-acesD60", [0.321_68, 0.337_67]),
];

/// Indices of refraction of optical glasses at 587.6 nm; in pbrt-v4, `F` denotes the dense flints
/// SF. [catalogue of Schott AG]
const GLASSES: [(&str, f64); 7] = [
    ("glass-BK7", 1.516_80),
    ("glass-BAF10", 1.670_03),
    ("glass-FK51A", 1.486_56),
    ("glass-LASF9", 1.850_25),
    ("glass-F5", 1.672_71),
    ("glass-F10", 1.728_28),
    ("glass-F11", 1.784_72),
];

/// Symbols of metals of pbrt-v4, which are in [`pt_scene::metals::METALS`].
const METALS: [&str; 7] = ["Ag", "Al", "Au", "Cu", "CuZn", "MgO", "TiO2"];

/// Returns the spectrum of a name; `None` if it is a file name.
///
/// # Errors
/// If the prefix is that of a kind of spectrum, but there is none with this name.
pub(super) fn named(name: &str) -> Result<Option<NamedSpectrum>, String> {
    if let Some(metal) = name.strip_prefix("metal-") {
        return optical(metal).map(|color| Some(NamedSpectrum::Optical(color))).ok_or_else(|| {
            let names =
                METALS.iter().flat_map(|m| [format!("metal-{m}-eta"), format!("metal-{m}-k")]);
            let names: Vec<_> = names.collect();
            let hint = did_you_mean(name, names.iter().map(String::as_str));
            format!(
                "unknown metal {}{hint}; otherwise give eta and k as rgb or by wavelengths",
                quote(name)
            )
        });
    }
    if let Some(index) = glass(name) {
        return Ok(Some(NamedSpectrum::Optical([index as f32; 3])));
    }
    if name.starts_with("glass-") {
        let hint = did_you_mean(name, GLASSES.iter().map(|(known, _)| *known));
        return Err(format!("unknown glass {}{hint}; otherwise give eta as a number", quote(name)));
    }
    let found = ILLUMINANTS.iter().find(|(known, _)| *known == name);
    if found.is_none() && (name.starts_with("stdillum-") || name.starts_with("illum-")) {
        let hint = did_you_mean(name, ILLUMINANTS.iter().map(|(known, _)| *known));
        return Err(format!("unknown illuminant {}{hint}", quote(name)));
    }
    Ok(found.map(|(_, chromaticity)| NamedSpectrum::Illuminant(*chromaticity)))
}

/// Returns the index of refraction of a glass by name.
pub(super) fn glass(name: &str) -> Option<f64> {
    GLASSES.iter().find(|(known, _)| *known == name).map(|(_, index)| *index)
}

/// Returns a part of the index of a metal, such as `Cu-eta`.
fn optical(name: &str) -> Option<[f32; 3]> {
    let (symbol, part) = name.rsplit_once('-')?;
    let metal = METALS.contains(&symbol).then(|| Metal::named(symbol)).flatten()?;
    match part {
        "eta" => Some(metal.eta),
        "k" => Some(metal.k),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_metals_are_known_and_others_are_named() {
        for metal in METALS {
            for part in ["eta", "k"] {
                assert!(matches!(
                    named(&format!("metal-{metal}-{part}")),
                    Ok(Some(NamedSpectrum::Optical(_)))
                ));
            }
        }
        assert_eq!(named("light.spd"), Ok(None));
        let message = named("metal-Cu-et").expect_err("no metal");
        assert!(message.contains("did you mean \"metal-Cu-eta\""), "{message}");
        assert!(named("glass-BK8").is_err() && named("stdillum-D70").is_err());
    }
}
