//! Validation of the command line, and its conversion to settings.

use std::path::{Path, PathBuf};

use bytesize::ByteSize;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use pathtracer::image::{self, BitDepth, SaveOptions, Transfer};
use pathtracer::provenance::{self, Provenance};
use pathtracer::{
    Adaptive, Aov, Aperture, BuildOptions, Clamp, DirectLight, Feature, Filter, HALF_B_OFFSET,
    INTEGRATORS, LoadOptions, MAX_REUSE, MAX_SPLIT, Region, RenderHints, Roulette, SamplerKind,
    Scene, Settings, aov, denoise, groups, integrator,
};

use crate::arg_values::{PngBits, ReceiptKind};
use crate::args::Cli;
use crate::image_options::{self, Exposure};
use crate::{light_groups, stop_options};

/// Maximum number of pixels of an image, by the memory of ordinary machines.
const MAX_PIXELS: u64 = 1 << 28;
/// Bytes per pixel, without additional channels.
const PIXEL_BYTES: u64 = 125;
/// Probability with which Russian roulette of the course's program continues a path.
const COURSE_ROULETTE: f32 = 0.65;

/// A validated command line.
pub(crate) struct RenderJob {
    pub(crate) cli: Cli,
    pub(crate) adaptive: Option<Adaptive>,
    pub(crate) resolution: Option<[u32; 2]>,
    /// Arguments, without the name of the program.
    pub(crate) command: Vec<String>,
    /// Number of samples for which the points of the sampler are generated, if given by an earlier
    /// run.
    pub(crate) layout: Option<u32>,
    /// Provenance of the image that is rendered again and must be identical.
    pub(crate) of: Option<Box<Provenance>>,
    /// True if existing samples must belong to this image, as for `resume`.
    pub(crate) goes_on: bool,
}

fn whole(text: &str, least: u32, what: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(n) if n >= least => Ok(n),
        _ => Err(format!("expected {what}")),
    }
}

/// Parses a whole number ≥ 0.
pub(crate) fn count(text: &str) -> Result<u32, String> {
    whole(text, 0, "a whole number from 0 up to 4294967295")
}

/// Parses a whole number from 1 up to [`HALF_B_OFFSET`].
pub(crate) fn positive(text: &str) -> Result<u32, String> {
    let expected = "expected a whole number from 1 up to 2147483648";
    whole(text, 1, "").ok().filter(|n| *n <= HALF_B_OFFSET).ok_or_else(|| expected.into())
}

/// Parses the width or height of an image.
pub(crate) fn pixels(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n <= 1 << 20 => Ok(n),
        _ => Err("expected a number of pixels from 1 up to 1048576, as in -r 480 360".into()),
    }
}

/// Parses a number of threads.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n) if n <= 4096 => Ok(n),
        _ => Err("expected a number of threads from 1 up to 4096, or 0 for one per core".into()),
    }
}

/// Parses the maximum number of shapes in a leaf.
pub(crate) fn leaf_size(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n <= 255 => Ok(n),
        _ => Err("expected a number of shapes from 1 up to 255".into()),
    }
}

fn number(text: &str, fits: impl Fn(f32) -> bool, what: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(v) if v.is_finite() && fits(v) => Ok(v),
        _ => Err(format!("expected {what}")),
    }
}

/// Parses a number of samples of each light.
pub(crate) fn light_samples(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n <= 1 << 16 => Ok(n),
        _ => {
            Err("expected a number from 1 up to 65536; more samples per pixel (-s) do the rest"
                .into())
        }
    }
}

/// Parses the side of the tiles of path reuse in pixels.
pub(crate) fn reuse(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if MAX_REUSE.is_multiple_of(n) => Ok(n),
        _ => Err("expected the side of a square in pixels: 1 (none), 2 or 4".into()),
    }
}

/// Parses a range of sample numbers, whose end is exclusive.
pub(crate) fn samples(text: &str) -> Result<(u32, u32), String> {
    let range = text
        .split_once("..")
        .and_then(|(from, to)| Some((from.parse::<u32>().ok()?, to.parse::<u32>().ok()?)));
    match range {
        Some((from, to)) if from < to && to <= HALF_B_OFFSET => Ok((from, to)),
        _ => Err(
            "expected the first number and the one behind the last, up to 2147483648, as in 0..256"
                .into(),
        ),
    }
}

/// Parses a time in seconds ≥ 0.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v >= 0.0 && v.is_finite() => Ok(v),
        _ => Err("expected a number of seconds from 0 up".into()),
    }
}

/// Parses a length > 0.
pub(crate) fn radius(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v),
        _ => Err("expected a length above 0".into()),
    }
}

/// Parses an amount of memory.
pub(crate) fn bytes(text: &str) -> Result<ByteSize, String> {
    match text.parse::<ByteSize>() {
        Ok(size) if size.as_u64() > 0 => Ok(size),
        _ => Err("expected an amount of memory, as in 500MB, 8GB or 8GiB".into()),
    }
}

/// Parses a number of paths for path splitting.
pub(crate) fn split(text: &str) -> Result<u32, String> {
    match whole(text, 1, "") {
        Ok(n) if n.is_power_of_two() && n <= MAX_SPLIT => Ok(n),
        _ => Err("expected a power of two from 1 (none) up to 64".into()),
    }
}

/// Parses a number of aperture blades.
pub(crate) fn blades(text: &str) -> Result<u32, String> {
    match whole(text, 3, "") {
        Ok(n) if n <= 1000 => Ok(n),
        _ => Err("expected a number of blades from 3 up to 1000".into()),
    }
}

/// Parses an angle in degrees.
pub(crate) fn degrees(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err("expected a number of degrees".into()),
    }
}

/// Parses a number ≥ 0.
pub(crate) fn not_negative(text: &str) -> Result<f32, String> {
    number(text, |v| v >= 0.0, "a number from 0 up")
}

/// Parses a number > 0.
pub(crate) fn above_zero(text: &str) -> Result<f32, String> {
    number(text, |v| v > 0.0, "a number above 0")
}

/// Parser of the names of AOVs.
pub(crate) fn aovs() -> impl TypedValueParser<Value = Aov> {
    PossibleValuesParser::new(Aov::NAMES.map(|(name, _)| name))
        .try_map(|name| Aov::from_name(&name).ok_or("there is no such quantity"))
}

/// Parses a name and its value.
pub(crate) fn definition(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.into(), value.into())),
        _ => Err("expected NAME=VALUE, as in -D radius=0.5".into()),
    }
}

/// Checks the combinations of options, which the parser of single values cannot.
///
/// # Errors
/// A message with the conflicting options and the remedy.
pub(crate) fn check(cli: Cli, command: Vec<String>) -> Result<RenderJob, String> {
    let adaptive = adaptive(&cli)?;
    let resolution = match cli.resolution.as_deref() {
        Some(&[w, h]) => Some([w, h]),
        _ => None,
    };
    let most = MAX_PIXELS * PIXEL_BYTES / bytes_per_pixel(&cli, light_groups::least(&cli));
    if let Some([w, h]) = resolution.filter(|&[w, h]| u64::from(w) * u64::from(h) > most) {
        return Err(format!("-r {w} {h}: an image may have at most {most} pixels"));
    }
    if let Some(name) = &cli.integrator
        && !INTEGRATORS.iter().any(|r| r.name == name)
    {
        let all: Vec<_> = INTEGRATORS.iter().map(|r| format!("  {}: {}", r.name, r.help)).collect();
        return Err(format!("there is no integrator \"{name}\"; there are\n{}", all.join("\n")));
    }
    check_aovs(&cli)?;
    image_options::check(&cli)?;
    check_features(&cli)?;
    if cli.split > 1 && cli.path_reuse > 1 {
        return Err("--path-splitting and --path-reuse exclude each other; give one of them".into());
    }
    if let Some(Some(path)) = &cli.output
        && !cli.cs184
        && !image::is_image(path)
        && !is_film(path)
    {
        return Err(format!(
            "-f {}: the ending of the file says its format; expected .png, .exr or .film",
            path.display()
        ));
    }
    if let (Some((from, _)), false) = (cli.samples, output_is_film(&cli))
        && from > 0
    {
        return Err(
            "--samples makes a part of an image; it needs a file for it, as in -f part.film".into(),
        );
    }
    if cli.samples.is_some() && cli.spp.is_none() && SamplerKind::from(cli.sampler).depends_on_spp()
    {
        return Err(
            "--samples: the points of this --sampler depend on the number of all samples; give \
                    that with -s, as in -s 512 --samples 0..256"
                .into(),
        );
    }
    if let (Some((_, to)), Some(spp)) = (cli.samples, cli.spp)
        && to > spp
    {
        return Err(format!(
            "--samples ends at {to}, behind the {spp} samples that -s says there are"
        ));
    }
    if let (Some((name, _)), true) = (cli.loading.define.first(), cli.paths.is_empty()) {
        return Err(format!("-D {name}: the embedded scene has no names; give a Mitsuba scene"));
    }
    if cli.loading.time.is_some() && cli.paths.is_empty() {
        return Err("--time: the embedded scene has no animations; give a glTF scene".into());
    }
    if cli.loading.point_radius.is_some() && cli.paths.is_empty() {
        return Err("--point-radius: the embedded scene has no points; give a scene".into());
    }
    if cli.samples.is_some() && cli.aov.iter().any(|aov| aov.is_of_half()) {
        return Err(
            "--samples: parts of an image have no halves; leave out half_a and half_b".into()
        );
    }
    light_groups::check(&cli)?;
    stop_options::check(&cli)?;
    Ok(RenderJob { cli, adaptive, resolution, command, layout: None, of: None, goes_on: false })
}

/// Bytes per pixel of a sample plan and of its computation.
const PLAN_BYTES: u64 = 64;

/// Bytes per pixel, with the requested channels, `groups` light groups and half buffers.
pub(crate) fn bytes_per_pixel(cli: &Cli, groups: usize) -> u64 {
    let mut kept = with_denoising(cli.aov.clone(), cli.denoise);
    kept.extend(cli.opacity.channel(&cli.aov, &RenderHints::default(), cli.cs184));
    kept.dedup();
    let besides = aov::bytes_per_pixel(&kept) + groups * groups::BYTES_PER_PIXEL;
    let of_film = PIXEL_BYTES + besides as u64;
    let halves = cli.stop.has_target() || kept.iter().any(|aov| aov.is_of_half());
    if halves { 2 * of_film + PLAN_BYTES } else { of_film }
}

/// Adds the AOVs that denoising needs, if it is requested.
fn with_denoising(mut aovs: Vec<Aov>, denoise: bool) -> Vec<Aov> {
    let missing = denoise::NEEDED.into_iter().filter(|_| denoise);
    let missing: Vec<_> = missing.filter(|aov| !aovs.contains(aov)).collect();
    aovs.extend(missing);
    aovs
}

/// Returns true if the extension is that of a film.
pub(crate) fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("film"))
}

fn output_is_film(cli: &Cli) -> bool {
    cli.output.as_ref().and_then(Option::as_ref).is_some_and(|path| is_film(path))
}

/// Checks that no AOV is repeated, and that the image has room for them.
fn check_aovs(cli: &Cli) -> Result<(), String> {
    if let Some((_, twice)) = cli.aov.iter().enumerate().find(|(i, a)| cli.aov[..*i].contains(a)) {
        return Err(format!("--aov names \"{}\" twice; once is enough", twice.name()));
    }
    if cli.aov.iter().all(|aov| *aov == Aov::Alpha) || has_room_for_channels(cli) {
        return Ok(());
    }
    Err("--aov needs an image with room for more channels, as in -f out.exr".into())
}

/// Returns true if the output format has channels besides colours.
pub(crate) fn has_room_for_channels(cli: &Cli) -> bool {
    let has_room = |path: &PathBuf| {
        is_film(path) || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    };
    cli.output.as_ref().and_then(Option::as_ref).is_some_and(has_room)
}

/// Rejects options that the chosen integrator does not support.
///
/// # Errors
/// A message that names the option and the integrators that support it.
fn check_features(cli: &Cli) -> Result<(), String> {
    let name = cli.integrator.as_deref().unwrap_or("path");
    let name = if cli.cs184 { "cs184" } else { name };
    let Some(integrator) = integrator::by_name(name) else { return Ok(()) };
    let clamps = cli.clamp.is_some() || cli.clamp_indirect.is_some();
    let needs = [
        (clamps, Feature::Clamp, "--clamp and --clamp-indirect need"),
        (cli.path_reuse > 1, Feature::Reuse, "--path-reuse needs"),
        (cli.split > 1, Feature::Split, "--path-splitting needs"),
        (cli.ao_distance.is_some(), Feature::OcclusionDistance, "--ao-distance needs"),
    ];
    for (is_given, feature, option) in needs {
        if is_given && !integrator.supports(feature) {
            let known = integrator::names_with(feature).join(", ");
            let name = integrator.name;
            return Err(format!("{option} --integrator {known}; {name} does not support it"));
        }
    }
    Ok(())
}

/// Rejects estimators of direct light that the integrator does not support.
///
/// # Errors
/// A message with the supported estimators.
pub(crate) fn check_estimator(settings: &Settings) -> Result<(), String> {
    let by_hemisphere =
        matches!(settings.direct, DirectLight::UniformHemisphere | DirectLight::CosineHemisphere);
    let Some(integrator) = integrator::by_name(&settings.integrator) else { return Ok(()) };
    let samples_lights = integrator.supports(Feature::SkyMis);
    if by_hemisphere && samples_lights && !integrator.supports(Feature::HemisphereSampling) {
        return Err(format!(
            "--integrator {} supports --direct mis and --direct light only",
            integrator.name
        ));
    }
    Ok(())
}

fn adaptive(cli: &Cli) -> Result<Option<Adaptive>, String> {
    let Some([batch, tolerance]) = cli.adaptive.as_deref() else {
        return Ok(cli.cs184.then_some(Adaptive { batch: 32, tolerance: 0.05 }));
    };
    let batch = positive(batch).map_err(|e| format!("-a {batch} {tolerance}: BATCH: {e}"))?;
    let tolerance =
        not_negative(tolerance).map_err(|e| format!("-a {batch} {tolerance}: TOLERANCE: {e}"))?;
    Ok(Some(Adaptive { batch, tolerance }))
}

impl RenderJob {
    /// File of the scene, or `None` for the embedded one.
    pub(crate) fn scene(&self) -> Option<&PathBuf> {
        self.cli.paths.first()
    }

    /// Options for reading the scene.
    pub(crate) fn load_options(&self) -> LoadOptions {
        LoadOptions { course: self.cli.cs184, ..self.cli.loading.options(self.cli.strict) }
    }

    /// Path of the image: as given, or the name of the scene with `.png`.
    pub(crate) fn output(&self) -> PathBuf {
        if let Some(Some(path)) = &self.cli.output {
            return path.clone();
        }
        let stem = self.scene().and_then(|s| s.file_stem()).unwrap_or("cornell".as_ref());
        let mut name = stem.to_owned();
        name.push(".png");
        name.into()
    }

    /// Options for writing images, with their metadata.
    pub(crate) fn save_options(&self, receipt: &Provenance) -> SaveOptions {
        let receipt = match self.cli.receipt {
            ReceiptKind::Full => Some(receipt.to_text()),
            ReceiptKind::Stable => Some(Provenance { run: None, ..receipt.clone() }.to_text()),
            ReceiptKind::None => None,
        };
        let software = ("Software", concat!("pathtracer ", env!("CARGO_PKG_VERSION")).to_owned());
        let metadata = std::iter::once(software).chain(receipt.map(|text| (provenance::KEY, text)));
        SaveOptions {
            png_bits: match self.cli.png_bits {
                PngBits::Eight => BitDepth::Eight,
                PngBits::Sixteen => BitDepth::Sixteen,
            },
            transfer: if self.cli.cs184 { Transfer::Course } else { Transfer::Srgb },
            tone: image_options::tone(&self.cli),
            exr_type: self.cli.exr_type.map(Into::into).unwrap_or_default(),
            exr_compression: self.cli.exr_compression.map(Into::into).unwrap_or_default(),
            metadata: metadata.map(|(key, text)| (key.to_owned(), text)).collect(),
            alpha: None,
            channels: Vec::new(),
        }
    }

    /// Options for building the hierarchy.
    pub(crate) fn bvh(&self) -> BuildOptions {
        BuildOptions {
            builder: self.cli.bvh.into(),
            quality: self.cli.quality.into(),
            max_leaf_size: self.cli.max_leaf_size,
        }
    }

    /// Settings of the render: from the command line, else from the scene file, else the defaults.
    pub(crate) fn settings(&self, scene: &Scene) -> Settings {
        let file = &scene.settings;
        let cli = &self.cli;
        let defaults = Settings::default();
        let course = cli.cs184;
        let metres = if course { 1.0 } else { scene.metres_per_unit };
        let fallback =
            |file: Option<u32>, default| if course { 1 } else { file.unwrap_or(default) };
        let max_depth =
            cli.max_depth.unwrap_or_else(|| fallback(file.max_depth, defaults.max_depth));
        let only_last = cli.accumulate == 0 || cli.exact_depth;
        let (min_bounce, max_bounce) =
            if only_last { (max_depth, max_depth) } else { cli.show.bounces() };
        let direct = match cli.direct {
            Some(d) => d.into(),
            None if cli.hemisphere => DirectLight::UniformHemisphere,
            None if course => DirectLight::Light,
            None => defaults.direct,
        };
        let usual = if course { "cs184" } else { file.integrator.unwrap_or("path") };
        let integrator = cli.integrator.as_deref().unwrap_or(usual);
        Settings {
            spp: match cli.samples {
                _ if cli.stop.has_target() => cli.stop.most_samples(),
                Some((_, to)) => to,
                None => cli.spp.unwrap_or_else(|| fallback(file.spp, defaults.spp)),
            },
            layout: self.layout.or(cli.samples.and(cli.spp)),
            light_samples: cli.light_samples,
            max_depth,
            straight_is_free: file.straight_is_free,
            min_bounce,
            max_bounce,
            integrator: integrator.into(),
            ao_distance: match cli.ao_distance {
                Some(units) if units > 0.0 => units * metres as f32,
                _ => f32::INFINITY,
            },
            direct,
            roulette: match (course, only_last) {
                (false, _) => Roulette::Throughput,
                (true, false) => Roulette::Fixed(COURSE_ROULETTE),
                (true, true) => Roulette::Fixed(1.0),
            },
            clamp: Clamp {
                direct: cli.clamp.unwrap_or(f32::INFINITY),
                indirect: cli.clamp_indirect.or(cli.clamp).unwrap_or(f32::INFINITY),
            },
            reuse: cli.path_reuse,
            split: cli.split,
            adaptive: self.adaptive,
            target: cli.stop.target(cli.exposure.and_then(Exposure::stops).unwrap_or(0.0)),
            sampler: cli.sampler.into(),
            seed: cli.seed,
            filter: match cli.filter {
                Some(filter) => filter.into(),
                None if course => Filter::Box,
                None => file.filter.unwrap_or(defaults.filter),
            },
            region: None,
            aovs: self.aovs(file),
            hidden: cli.opacity.hidden(file.hidden, course),
            light_groups: cli.light_groups.clone(),
        }
    }

    /// AOVs: those of the command line, or else of the scene file if the image has room for them;
    /// with --denoise, also those that denoising needs.
    fn aovs(&self, file: &RenderHints) -> Vec<Aov> {
        let of_file = || file.aovs.iter().filter_map(|name| Aov::from_name(name));
        let asked = if self.leaves_channels_out(file) {
            Vec::new()
        } else if self.cli.aov.is_empty() {
            of_file().collect()
        } else {
            self.cli.aov.clone()
        };
        let of_colors = self.cli.opacity.channel(&self.cli.aov, file, self.cli.cs184);
        let besides = asked.into_iter().filter(|aov| *aov != Aov::Alpha);
        with_denoising(of_colors.into_iter().chain(besides).collect(), self.cli.denoise)
    }

    /// Returns true if the scene file requests AOVs for which the image has no room.
    pub(crate) fn leaves_channels_out(&self, file: &RenderHints) -> bool {
        file.aovs.iter().any(|name| *name != Aov::Alpha.name()) && !has_room_for_channels(&self.cli)
    }

    /// Aperture with blades, or `None` if not requested.
    pub(crate) fn aperture(&self) -> Option<Aperture> {
        let rotation = self.cli.aperture_rotation;
        self.cli.aperture_blades.map(|blades| Aperture { blades, rotation })
    }

    /// Pixels of `--crop`, whose rows are counted from the bottom on the command line, or else of
    /// the crop window of the scene file, which is relative to the size of the image.
    ///
    /// # Errors
    /// If the region is not inside an image of this size.
    pub(crate) fn region(
        &self,
        file: &RenderHints,
        [width, height]: [u32; 2],
    ) -> Result<Option<Region>, String> {
        let Some(&[x, y, dx, dy]) = self.cli.cell.as_deref() else {
            let crop = file.crop_of([width, height]).filter(|_| !self.cli.cs184);
            return Ok(crop.map(|[x, y, width, height]| Region { x, y, width, height }));
        };
        let top = u64::from(y) + u64::from(dy);
        let row = u64::from(height).checked_sub(top).map(|row| row as u32);
        let region = row.map(|row| Region { x, y: row, width: dx, height: dy });
        match region.filter(|r| r.is_inside([width, height])) {
            Some(region) => Ok(Some(region)),
            None => Err(format!(
                "-p {x} {y} {dx} {dy}: the cell must have pixels and lie in the image of {width} x \
                 {height}"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use pathtracer::{Builder, Quality};

    use super::*;

    #[test]
    fn the_tree_is_built_as_asked() {
        for (args, builder, quality, max_leaf_size) in [
            ("", Builder::Sah, Quality::Balanced, 8),
            ("--bvh-quality fast", Builder::Sah, Quality::Fast, 8),
            ("--bvh-quality balanced --max-leaf-size 1", Builder::Sah, Quality::Balanced, 1),
            ("--bvh-quality high", Builder::Sah, Quality::High, 8),
            ("--bvh-quality high --bvh mean", Builder::Mean, Quality::High, 8),
            ("--bvh-quality fast --bvh none", Builder::None, Quality::Fast, 8),
        ] {
            let words = std::iter::once("pathtracer").chain(args.split_whitespace());
            let checked = check(Cli::try_parse_from(words).unwrap(), Vec::new()).unwrap();
            assert_eq!(checked.bvh(), BuildOptions { builder, quality, max_leaf_size }, "{args}");
        }
    }
}
