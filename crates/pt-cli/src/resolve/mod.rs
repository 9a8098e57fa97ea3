//! Resolution of the command line: checks of combinations of options, and conversion to a
//! [`RenderJob`].

mod image;
mod light_groups;

use std::path::{Path, PathBuf};

use pathtracer::provenance::Provenance;
use pathtracer::{
    Adaptive, Aov, Aperture, BuildOptions, Clamp, CompileOptions, DirectLight, Feature,
    INTEGRATORS, LoadOptions, SamplerKind, Settings, aov, groups, integrator,
};

use crate::args::Cli;
use crate::job::{
    CompileJob, DisplayJob, EnvironmentFile, InputFiles, MemoryPlan, Mode, PIXEL_BYTES, PixelBytes,
    RenderJob, Schedule,
};
use crate::output::is_film;
use crate::parse;
use crate::settings::{ChannelRequest, SettingsRequest};

/// Bytes per pixel of a sample plan and of its computation.
const PLAN_BYTES: u64 = 64;

/// Earlier run that a render continues or repeats.
#[derive(Default)]
pub(crate) struct EarlierRun {
    /// Folder of the relative paths of its command; `None` for the current one.
    pub(crate) folder: Option<PathBuf>,
    /// Number of samples for which the points of the sampler were generated.
    pub(crate) layout: Option<u32>,
    /// True if existing samples must belong to this image, as for `resume`.
    pub(crate) resumes: bool,
    /// Provenance of the image that is rendered again and must be identical.
    pub(crate) expected: Option<Box<Provenance>>,
}

/// Resolves the options of a render; `command` contains the arguments.
///
/// # Errors
/// A message with the conflicting options and the remedy.
pub(crate) fn resolve(
    cli: Cli,
    command: Vec<String>,
    earlier: EarlierRun,
) -> Result<RenderJob, String> {
    check(&cli, &earlier)?;
    let policies = cli.policies();
    let adaptive = adaptive(&cli)?;
    let channels = ChannelRequest {
        has_room: has_room_for_channels(&cli),
        listed: cli.aov.clone(),
        opacity: cli.opacity.clone(),
        denoise: cli.denoise,
        transparency: policies.transparency,
    };
    let memory = memory(&cli, &channels, earlier.folder.as_deref());
    memory.check_pixels()?;
    let mode = Mode { quiet: cli.quiet, strict: cli.strict, policies };
    let scene = cli.paths.first().cloned();
    let compile = CompileJob {
        options: compile_options(&cli, memory.resolution),
        crop: cli.crop.rectangle(),
        settings: settings(&cli, earlier.layout, adaptive, channels),
    };
    Ok(RenderJob {
        mode,
        compile,
        memory,
        schedule: schedule(&cli, earlier.resumes, earlier.expected),
        output: image::output(&cli, scene.as_deref()),
        display: DisplayJob { kind: cli.progress, is_adaptive: adaptive.is_some() },
        input: InputFiles {
            folder: earlier.folder,
            load: LoadOptions {
                ignore_attenuation: policies.ignores_attenuation,
                ..cli.loading.options(cli.strict)
            },
            environment: cli
                .environment
                .map(|path| EnvironmentFile { path, layout: cli.environment_layout.square() }),
            camera_file: cli.camera_file,
            scene,
        },
        command,
    })
}

fn memory(cli: &Cli, channels: &ChannelRequest, folder: Option<&Path>) -> MemoryPlan {
    let kept = channels.of_command_line();
    let factor =
        if cli.stop.has_target() || kept.iter().any(|aov| aov.is_of_half()) { 2 } else { 1 };
    let files = cli.paths.first().into_iter().chain(&cli.environment);
    let base = factor * (PIXEL_BYTES + aov::bytes_per_pixel(&kept) as u64);
    MemoryPlan {
        limit: cli.max_memory.map(|size| size.as_u64()),
        files: files.map(|file| folder.map_or_else(|| file.clone(), |f| f.join(file))).collect(),
        resolution: cli.resolution.as_deref().and_then(|size| size.try_into().ok()),
        crop: cli.crop.rectangle().map(|[_, _, width, height]| [width, height]),
        pixel: PixelBytes {
            base: base + if factor == 2 { PLAN_BYTES } else { 0 },
            per_group: factor * groups::BYTES_PER_PIXEL as u64,
        },
        light_groups: cli.light_groups.clone(),
    }
}

fn compile_options(cli: &Cli, resolution: Option<[u32; 2]>) -> CompileOptions {
    CompileOptions {
        resolution,
        policies: cli.policies().scene,
        bvh: BuildOptions {
            builder: cli.bvh.into(),
            quality: cli.quality.into(),
            max_leaf_size: cli.max_leaf_size,
        },
        studio: cli.policies().studio,
        placement: cli.loading.placement(),
        lens_radius: cli.lens_radius,
        aperture: cli
            .aperture_blades
            .map(|blades| Aperture { blades, rotation: cli.aperture_rotation }),
        focal_distance: cli.focal_distance,
        panorama: cli.panorama,
        smooth_shadows: cli.smooth_shadows,
        ..CompileOptions::default()
    }
}

fn schedule(cli: &Cli, resumes: bool, expected: Option<Box<Provenance>>) -> Schedule {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    Schedule {
        threads: match cli.threads {
            None => cli.policies().threads.unwrap_or_else(cores),
            Some(0) => cores(),
            Some(n) => n,
        },
        tile_size: cli.tile_size,
        first: cli.samples.map_or(0, |(from, _)| from),
        time_limit: cli.stop.time_limit,
        checkpoint_every: Some(cli.checkpoint_every)
            .filter(|every| !every.is_zero() && cli.policies().films),
        restart: cli.restart,
        resumes,
        expected,
    }
}

fn settings(
    cli: &Cli,
    layout: Option<u32>,
    adaptive: Option<Adaptive>,
    channels: ChannelRequest,
) -> SettingsRequest {
    let is_only_last = cli.accumulate == 0 || cli.exact_depth;
    SettingsRequest {
        policies: cli.policies(),
        spp: match cli.samples {
            _ if cli.stop.has_target() => Some(cli.stop.most_samples()),
            Some((_, to)) => Some(to),
            None => cli.spp,
        },
        layout: layout.or(cli.samples.and(cli.spp)),
        light_samples: cli.light_samples,
        max_depth: cli.max_depth,
        bounces: (!is_only_last).then(|| cli.show.bounces()),
        integrator: cli.integrator.clone(),
        ao_distance: cli.ao_distance.filter(|units| *units > 0.0).unwrap_or(f32::INFINITY),
        direct: match cli.direct {
            Some(direct) => Some(direct.into()),
            None => cli.hemisphere.then_some(DirectLight::UniformHemisphere),
        },
        clamp: Clamp {
            direct: cli.clamp.unwrap_or(f32::INFINITY),
            indirect: cli.clamp_indirect.or(cli.clamp).unwrap_or(f32::INFINITY),
        },
        reuse: cli.path_reuse,
        split: cli.split,
        adaptive,
        target: cli.stop.target(cli.png.tone().exposure),
        sampler: cli.sampler.into(),
        seed: cli.seed,
        filter: cli.filter.map(Into::into),
        channels,
        light_groups: cli.light_groups.clone(),
    }
}

/// Checks the combinations of options, which the parser of single values cannot.
fn check(cli: &Cli, earlier: &EarlierRun) -> Result<(), String> {
    if let Some(name) = &cli.integrator
        && !INTEGRATORS.iter().any(|r| r.name == name)
    {
        let all: Vec<_> = INTEGRATORS.iter().map(|r| format!("  {}: {}", r.name, r.help)).collect();
        return Err(format!("unknown integrator \"{name}\"; known:\n{}", all.join("\n")));
    }
    if cli.sequence.is_requested() {
        return Err("--cameras and --frames render several images; choose one with --camera, \
                    --camera-file or --time"
            .into());
    }
    check_aovs(cli)?;
    image::check(cli)?;
    check_features(cli)?;
    if cli.split > 1 && cli.path_reuse > 1 {
        return Err("--path-splitting and --path-reuse are mutually exclusive".into());
    }
    if let Some(Some(path)) = &cli.output
        && cli.policies().films
        && !pathtracer::image::is_image(path)
        && !is_film(path)
    {
        return Err(format!(
            "-f {}: unknown extension; expected .png, .exr or .film",
            path.display()
        ));
    }
    if let (Some((from, _)), false) = (cli.samples, output_is_film(cli))
        && from > 0
    {
        return Err(
            "--samples renders a part of an image and requires a file for it, as in -f part.film"
                .into(),
        );
    }
    if cli.samples.is_some() && cli.spp.is_none() && SamplerKind::from(cli.sampler).depends_on_spp()
    {
        return Err(
            "--samples: this --sampler depends on the number of all samples; set it with -s, as in \
             -s 512 --samples 0..256"
                .into(),
        );
    }
    if let (Some((_, to)), Some(spp)) = (cli.samples, cli.spp)
        && to > spp
        && earlier.layout.is_none()
    {
        return Err(format!(
            "--samples ends at {to}, expected at most {spp}, the number of samples (-s)"
        ));
    }
    if let (Some((name, _)), true) = (cli.loading.define.first(), cli.paths.is_empty()) {
        return Err(format!(
            "-D {name}: the embedded scene has no definitions; use a Mitsuba scene"
        ));
    }
    if cli.loading.time.is_some() && cli.paths.is_empty() {
        return Err("--time: the embedded scene has no animations; use a glTF scene".into());
    }
    if cli.loading.point_radius.is_some() && cli.paths.is_empty() {
        return Err("--point-radius: the embedded scene has no points; use another scene".into());
    }
    if cli.samples.is_some() && cli.aov.iter().any(|aov| aov.is_of_half()) {
        return Err("--samples: parts of an image have no halves; omit half_a and half_b".into());
    }
    light_groups::check(cli)?;
    check_stop(cli)
}

/// Rejects options of error targets that exclude each other.
fn check_stop(cli: &Cli) -> Result<(), String> {
    let stop = &cli.stop;
    let without_target = stop.confidence.is_some() || stop.max_spp.is_some() || stop.uniform;
    if !stop.has_target() && without_target {
        return Err("--confidence, --max-spp and --uniform-sampling require --target-error or \
                    --target-noise; give one of them, or the number of samples with -s"
            .into());
    }
    if stop.has_target() && SamplerKind::from(cli.sampler).depends_on_spp() {
        return Err(
            "this --sampler needs the number of samples in advance, which --target-error and \
             --target-noise do not have; use --sampler sobol or independent"
                .into(),
        );
    }
    Ok(())
}

fn output_is_film(cli: &Cli) -> bool {
    cli.output.as_ref().and_then(Option::as_ref).is_some_and(|path| is_film(path))
}

/// Checks that no AOV is repeated, and that the image has room for them.
fn check_aovs(cli: &Cli) -> Result<(), String> {
    if let Some((_, twice)) = cli.aov.iter().enumerate().find(|(i, a)| cli.aov[..*i].contains(a)) {
        return Err(format!("duplicate --aov \"{}\"", twice.name()));
    }
    if cli.aov.iter().all(|aov| *aov == Aov::Alpha) || has_room_for_channels(cli) {
        return Ok(());
    }
    Err("--aov requires an image with additional channels, as in -f out.exr".into())
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
    let usual = cli.policies().settings.as_ref().map_or("path", |settings| settings.integrator);
    let name = cli.integrator.as_deref().unwrap_or(usual);
    let Some(integrator) = integrator::by_name(name) else { return Ok(()) };
    let clamps = cli.clamp.is_some() || cli.clamp_indirect.is_some();
    let needs = [
        (clamps, Feature::Clamp, "--clamp and --clamp-indirect require"),
        (cli.path_reuse > 1, Feature::Reuse, "--path-reuse requires"),
        (cli.split > 1, Feature::Split, "--path-splitting requires"),
        (cli.ao_distance.is_some(), Feature::OcclusionDistance, "--ao-distance requires"),
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
        return Ok(cli.policies().settings.as_ref().and_then(|settings| settings.adaptive));
    };
    let batch =
        parse::positive(batch).map_err(|e| format!("-a {batch} {tolerance}: BATCH: {e}"))?;
    let tolerance = parse::not_negative(tolerance)
        .map_err(|e| format!("-a {batch} {tolerance}: TOLERANCE: {e}"))?;
    Ok(Some(Adaptive { batch, tolerance }))
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
            let cli = Cli::try_parse_from(words).unwrap();
            let job = resolve(cli, Vec::new(), EarlierRun::default()).unwrap();
            let expected = BuildOptions { builder, quality, max_leaf_size };
            assert_eq!(job.compile.options.bvh, expected, "{args}");
        }
    }
}
