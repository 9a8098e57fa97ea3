//! Fingerprint: everything that the samples of an image depend on, as text, so that samples of
//! different images are not merged.

use pt_core::light::EnvironmentMap;
use pt_core::settings::{DirectLight, Hidden, LightGroup, LightGroups, Roulette, Settings};
use pt_core::{CompileOptions, Region};

/// Name of the entry with the resolution of the image.
const RESOLUTION: &str = "resolution";

/// Name of the entry with the region of the film.
pub(crate) const PART: &str = "part of the image";

/// Name and value as text.
pub type FingerprintEntry = (String, String);

/// Difference between two lists: name, value in the first, value in the second; `None` if the name
/// is missing.
pub type FingerprintDifference = (String, Option<String>, Option<String>);

/// Name of the entry of the environment map.
const ENVIRONMENT: &str = "environment map";

/// Returns everything that the samples depend on besides the scene and the version: the options
/// with which the scene is compiled, and the settings except for the number of samples. Equal lists
/// give the same samples.
pub fn entries(options: &CompileOptions, settings: &Settings) -> Vec<FingerprintEntry> {
    let mut list = Vec::new();
    let mut say = |name: &str, value: String| list.push((name.to_owned(), value));
    let CompileOptions {
        resolution: _, // part of the compiled scene
        policies,
        bvh,
        most_single_lights,
        most_copied_triangles,
        environment,
        studio,
        compensated: _,         // follows from the settings
        texture_coordinates: _, // follows from the settings
        camera,
        placement,
        lens_radius,
        aperture,
        focal_distance,
        panorama,
        smooth_shadows,
        hierarchies: _, // change no sample
    } = options;
    say("course's reading of the scene", (!policies.is_physical()).to_string());
    say("tree", format!("{:?}, {:?}, leaves of {}", bvh.builder, bvh.quality, bvh.max_leaf_size));
    say("most single lights", or_default(most_single_lights.as_ref()));
    say("most copied triangles", or_default(most_copied_triangles.as_ref()));
    say(ENVIRONMENT, environment.as_ref().map_or("none".into(), hash_of_map));
    say("studio for what has no light or camera", studio.to_string());
    say("camera in place of the scene's", or_none(camera.as_ref()));
    if let Some(placement) = placement {
        say("place of the camera", format!("{placement:?}"));
    }
    say("lens radius", or_default(lens_radius.as_ref()));
    say("aperture", or_none(aperture.as_ref()));
    say("focal distance", or_default(focal_distance.as_ref()));
    say("panorama", panorama.to_string());
    say("smooth shadows", smooth_shadows.to_string());
    let Settings {
        spp: _,    // stored in the film
        layout: _, // part of the sampler's points
        light_samples,
        max_depth,
        straight_is_free,
        min_bounce,
        max_bounce,
        integrator,
        ao_distance,
        direct,
        roulette,
        clamp,
        reuse,
        split,
        adaptive,
        target,
        sampler,
        seed,
        filter,
        region: _, // stored in the film
        aovs,
        hidden,
        light_groups,
    } = settings;
    say("integrator", integrator.clone());
    say("light samples", light_samples.to_string());
    say("max depth", max_depth.to_string());
    if *straight_is_free {
        say("what goes straight on", "is not counted".into());
    }
    say("bounces shown", format!("{min_bounce} to {max_bounce}"));
    say("ambient occlusion distance", ao_distance.to_string());
    say("direct light", name_of_direct(*direct).into());
    say("Russian roulette", name_of_roulette(*roulette));
    say("clamp", format!("{} direct, {} indirect", clamp.direct, clamp.indirect));
    say("path reuse", reuse.to_string());
    say("split", split.to_string());
    let adaptive = adaptive.map(|a| format!("every {}, {}", a.batch, a.tolerance));
    say("adaptive sampling", adaptive.unwrap_or("no".into()));
    if let Some(target) = target {
        say("error target", target.to_string());
    }
    say("sampler", sampler.name().into());
    if sampler.depends_on_spp() {
        say("samples the sampler is laid out for", settings.points().spp.to_string());
    }
    say("seed", seed.to_string());
    say("filter", format!("{filter:?}"));
    let aovs: Vec<_> = aovs.iter().map(|aov| aov.name()).collect();
    say("other channels", if aovs.is_empty() { "none".into() } else { aovs.join(", ") });
    if *hidden != Hidden::Nothing {
        say("not seen directly", format!("{hidden:?}"));
    }
    if let Some(groups) = light_groups {
        say("light groups", in_words(groups));
    }
    list
}

/// Replaces the entry of the environment map by the one of an earlier list.
pub(crate) fn with_environment_of(
    mut entries: Vec<FingerprintEntry>,
    earlier: Vec<FingerprintEntry>,
) -> Vec<FingerprintEntry> {
    let kept = earlier.into_iter().find(|(name, _)| name == ENVIRONMENT);
    let place = entries.iter_mut().find(|(name, _)| name == ENVIRONMENT);
    if let (Some(place), Some(kept)) = (place, kept) {
        *place = kept;
    }
    entries
}

/// Formats light groups, as in "key: lamp, spot; each other light".
fn in_words(LightGroups { named, each }: &LightGroups) -> String {
    let group = |group: &LightGroup| format!("{}: {}", group.name, group.lights.join(", "));
    let others = each.then(|| "each other light".to_owned());
    named.iter().map(group).chain(others).collect::<Vec<_>>().join("; ")
}

/// Entries of the resolution of an image and of the region of its film.
pub(crate) fn of_pixels([width, height]: [u32; 2], region: Region) -> [FingerprintEntry; 2] {
    let Region { x, y, width: w, height: h } = region;
    let part = format!("{w} x {h} pixels from column {x}, row {y}");
    [(RESOLUTION.into(), format!("{width} x {height}")), (PART.into(), part)]
}

/// Returns the resolution of an image and the region of its film from the entries of its
/// provenance; `None` if they are missing or invalid.
pub fn pixels(list: &[FingerprintEntry]) -> Option<([u32; 2], Region)> {
    let value = |name: &str| list.iter().find(|entry| entry.0 == name).map(|entry| &entry.1);
    let size = |text: &str| -> Option<[u32; 2]> {
        let (width, height) = text.split_once(" x ")?;
        Some([width.parse().ok()?, height.parse().ok()?])
    };
    let resolution = size(value(RESOLUTION)?)?;
    let (part, place) = value(PART)?.split_once(" pixels from column ")?;
    let ([width, height], (x, y)) = (size(part)?, place.split_once(", row ")?);
    let region = Region { x: x.parse().ok()?, y: y.parse().ok()?, width, height };
    region.is_inside(resolution).then_some((resolution, region))
}

/// Returns the differences between two lists, in the order of the first.
pub fn differences(
    first: &[FingerprintEntry],
    second: &[FingerprintEntry],
) -> Vec<FingerprintDifference> {
    let value = |list: &[FingerprintEntry], name: &str| {
        list.iter().find(|entry| entry.0 == name).map(|entry| entry.1.clone())
    };
    let mut names: Vec<_> = first.iter().chain(second).map(|entry| entry.0.clone()).collect();
    let mut seen = std::collections::HashSet::new();
    names.retain(|name| seen.insert(name.clone()));
    let difference = |name: String| {
        let (a, b) = (value(first, &name), value(second, &name));
        (a != b).then_some((name, a, b))
    };
    names.into_iter().filter_map(difference).collect()
}

/// BLAKE3 hash of an environment map in hexadecimal digits.
fn hash_of_map(map: &EnvironmentMap) -> String {
    let (image, rows) = (map.image(), map.rows());
    let mut hash = blake3::Hasher::new();
    hash.update(format!("{} x {}, {rows:?}\n", image.width, image.height).as_bytes());
    for value in image.pixels.as_flattened() {
        hash.update(&value.to_le_bytes());
    }
    hash.finalize().to_hex().to_string()
}

fn or_default(value: Option<&impl ToString>) -> String {
    value.map_or("default".into(), ToString::to_string)
}

fn or_none(value: Option<&impl std::fmt::Debug>) -> String {
    value.map_or("none".into(), |value| format!("{value:?}"))
}

fn name_of_direct(direct: DirectLight) -> &'static str {
    match direct {
        DirectLight::Mis => "light and BSDF samples",
        DirectLight::Light => "light samples",
        DirectLight::UniformHemisphere => "uniform directions",
        DirectLight::CosineHemisphere => "directions by the cosine",
    }
}

fn name_of_roulette(roulette: Roulette) -> String {
    match roulette {
        Roulette::Throughput => "by throughput".into(),
        Roulette::Fixed(q) => format!("goes on with {q}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_read_as_they_were_written() {
        let region = Region { x: 3, y: 0, width: 5, height: 7 };
        let list = of_pixels([8, 9], region);
        assert_eq!(pixels(&list), Some(([8, 9], region)));
        assert_eq!(pixels(&list[..1]), None);
        assert_eq!(pixels(&of_pixels([7, 9], region)), None, "beyond the edge");
        let [resolution, mut part] = list;
        part.1 = "5 x -7 pixels from column 3, row 0".into();
        assert_eq!(pixels(&[resolution, part]), None);
    }
}
