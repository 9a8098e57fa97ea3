//! `--cs184`: defaults, files and console lines of the program of the course CS184.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use pathtracer::compat::cs184::{POLICIES as SCENE, cs184_log, probability_debug};
use pathtracer::image::{self, Image, ImageError, Transfer};
use pathtracer::{Adaptive, DirectLight, Filter, RenderStatistics, Roulette, Session};

use crate::policies::{CompatPolicies, DefaultSettings, Lines};

/// Options of other programs.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct CompatArgs {
    /// Images, defaults and console output of the CS184 course's reference program (assignment 3):
    /// by default --resolution 800 600, --spp 1, --adaptive 32 0.05, --max-depth 1, --direct light,
    /// --filter box, --focal-distance 4.7, --threads 1
    #[arg(long, help_heading = "What to show")]
    #[arg(conflicts_with_all = ["alpha", "hide_background", "hide_emitters", "target_error"])]
    #[arg(conflicts_with_all = ["target_noise", "time_limit", "exposure", "tonemap", "denoise"])]
    #[arg(conflicts_with_all = ["samples", "environment_layout", "panorama", "smooth_shadows"])]
    cs184: bool,
}

impl CompatArgs {
    /// Behaviour in which programs differ.
    pub(crate) fn policies(&self) -> &'static CompatPolicies {
        if self.cs184 { &POLICIES } else { &CompatPolicies::OWN }
    }
}

/// Options that exclude the records of single paths, for messages.
pub(crate) const WITHOUT_RECORDS: &str = "--path-reuse, --path-splitting and --cs184";

/// Policies of the program.
const POLICIES: CompatPolicies = CompatPolicies {
    scene: SCENE,
    ignores_attenuation: true,
    studio: false,
    crop_of_file: false,
    settings: Some(DefaultSettings {
        spp: 1,
        max_depth: 1,
        integrator: "cs184",
        direct: DirectLight::Light,
        filter: Filter::Box,
        adaptive: Some(Adaptive { batch: 32, tolerance: 0.05 }),
        roulette: Roulette::Fixed(0.65),
        roulette_at_depth: Roulette::Fixed(1.0),
    }),
    threads: Some(1),
    transfer: Transfer::Gamma,
    transparency: false,
    films: false,
    records: Err(
        "explain does not support --cs184; use --integrator cs184 for the light of the course's \
         program",
    ),
    counts_tests: true,
    write_probabilities: Some(write_probabilities),
    rate_path: Some(rate_path),
    notes_extremes: false,
    lines: Some(Lines {
        loading_environment,
        input,
        camera_loaded,
        environment_ready,
        built,
        progress,
        rendered,
        saved,
    }),
};

fn write_probabilities(map: &Image) -> Result<(), ImageError> {
    let debug = probability_debug(map);
    image::save_rgb8(Path::new("probability_debug.png"), map.width, map.height, &debug)
}

/// Replaces the last four characters, whatever they are.
fn rate_path(image: &Path) -> PathBuf {
    let text = image.to_string_lossy();
    let keep = text.chars().count().saturating_sub(4);
    let stem: String = text.chars().take(keep).collect();
    PathBuf::from(format!("{stem}_rate.png"))
}

fn loading_environment(path: &Path) {
    print_line!("[PathTracer] Loading environment map {}", path.display());
}

fn input(path: &Path) {
    report!("[PathTracer] Input scene file: {}", path.display());
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("dae")) {
        return;
    }
    report!("[COLLADA Parser] Loading COLLADA file...");
    report!("[COLLADA Parser] Loading scene...");
    // Errors of the file are reported when the scene is loaded.
    let log = pathtracer::file::read(path).ok().and_then(|bytes| cs184_log(&bytes, path).ok());
    for line in log.into_iter().flatten() {
        report!("{line}");
    }
}

fn camera_loaded(path: &Path) {
    print_line!("[Camera] Loaded settings from {}", path.display());
}

fn environment_ready() {
    print_line!(
        "[PathTracer] Initializing environment light...Saving out probability_debug image for \
         debug."
    );
    print_line!("done.");
}

fn built(session: &Session, threads: usize) {
    let (geometry, bvh) = session.build_times();
    let primitives = session.scene().shapes.primitive_surface.len();
    report!("[PathTracer] Rendering using {threads} threads");
    print_line!("[PathTracer] Collecting primitives... Done! ({:.4} sec)", geometry.as_secs_f64());
    print_line!(
        "[PathTracer] Building BVH from {primitives} primitives... Done! ({:.4} sec)",
        bvh.as_secs_f64()
    );
}

fn progress(percent: u64) {
    let mut out = std::io::stdout();
    // Errors of a progress line are ignored.
    let _ = write!(out, "\r[PathTracer] Rendering... {percent}%").and_then(|()| out.flush());
}

fn rendered(s: &RenderStatistics) {
    let seconds = s.time.as_secs_f64();
    let rays = s.rays.max(1) as f64;
    let mut out = std::io::stdout();
    // Progress, which the next line overwrites, is shown on terminals only.
    if out.is_terminal() {
        let _ = out.write_all(b"\r");
    }
    print_line!("[PathTracer] Rendering... 100%! ({seconds:.4}s)");
    print_line!("[PathTracer] BVH traced {} rays.", s.rays);
    print_line!(
        "[PathTracer] Average speed {:.4} million rays per second.",
        s.rays as f64 / seconds.max(1e-9) * 1e-6
    );
    print_line!("[PathTracer] Averaged {:.6} intersection tests per ray.", s.tests as f64 / rays);
}

fn saved(path: &Path, cell: bool) {
    report!("[PathTracer] Saving to file: {}... Done!", path.display());
    print_line!("[PathTracer] {} completed.", if cell { "Cell job" } else { "Job" });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_image_is_named_as_by_the_program() {
        assert_eq!(rate_path(Path::new("b.exr")), Path::new("b_rate.png"));
        assert_eq!(rate_path(Path::new("outx")), Path::new("_rate.png"));
    }
}
