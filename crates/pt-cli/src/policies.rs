//! Policies of the program: its own by default, and those of programs whose images and console
//! output are reproduced ([`crate::compat`]).

use std::path::{Path, PathBuf};

use pathtracer::image::{Image, ImageError, Transfer};
use pathtracer::{
    Adaptive, DirectLight, Filter, RenderHints, RenderStatistics, Roulette, Session, Settings,
    compat,
};

/// Behaviour in which programs differ.
#[expect(clippy::struct_excessive_bools, reason = "they have nothing to do with each other")]
pub(crate) struct CompatPolicies {
    /// Interpretation of the scene.
    pub(crate) scene: compat::Policies,
    /// True if the attenuation of the lights of COLLADA files is ignored.
    pub(crate) ignores_attenuation: bool,
    /// True if scenes without light or camera get the studio's.
    pub(crate) studio: bool,
    /// True if the crop window of the scene file applies.
    pub(crate) crop_of_file: bool,
    /// Settings that the command line does not give; `None` are those of the scene file.
    pub(crate) settings: Option<DefaultSettings>,
    /// Number of threads without a request; `None` is one for each core.
    pub(crate) threads: Option<usize>,
    /// Transfer function of images of integers.
    pub(crate) transfer: Transfer,
    /// True if images may have an alpha channel, and lights may be hidden from the camera.
    pub(crate) transparency: bool,
    /// True if there are checkpoints and films, and the ending of the image says its format.
    pub(crate) films: bool,
    /// True if single paths can be recorded; otherwise the reason why they cannot.
    pub(crate) records: Result<(), &'static str>,
    /// True if the intersection tests of rays are counted.
    pub(crate) counts_tests: bool,
    /// Writes an image of the sampling probabilities of the environment map.
    pub(crate) write_probabilities: Option<WriteImage>,
    /// Path of the image of sampling rates beside an image, which is always written; `None` if it
    /// is written for adaptive renders, with `_rate.png` for the ending.
    pub(crate) rate_path: Option<fn(&Path) -> PathBuf>,
    /// True if a note reports images that are nearly all black or white.
    pub(crate) notes_extremes: bool,
    /// Lines that replace the summary.
    pub(crate) lines: Option<Lines>,
}

impl CompatPolicies {
    /// Policies of this program.
    pub(crate) const OWN: Self = Self {
        scene: compat::Policies::PHYSICAL,
        ignores_attenuation: false,
        studio: true,
        crop_of_file: true,
        settings: None,
        threads: None,
        transfer: Transfer::Srgb,
        transparency: true,
        films: true,
        records: Ok(()),
        counts_tests: false,
        write_probabilities: None,
        rate_path: None,
        notes_extremes: true,
        lines: None,
    };
}

/// Writes an image that describes another one.
pub(crate) type WriteImage = fn(&Image) -> Result<(), ImageError>;

/// Settings that the command line does not give.
#[derive(Clone)]
pub(crate) struct DefaultSettings {
    pub(crate) spp: u32,
    pub(crate) max_depth: u32,
    pub(crate) integrator: &'static str,
    pub(crate) direct: DirectLight,
    pub(crate) filter: Filter,
    pub(crate) adaptive: Option<Adaptive>,
    /// Russian roulette, if all path lengths are shown.
    pub(crate) roulette: Roulette,
    /// Russian roulette, if only the maximum path length is shown.
    pub(crate) roulette_at_depth: Roulette,
}

impl DefaultSettings {
    /// Settings of a scene file, completed by the defaults.
    pub(crate) fn of_file(file: &RenderHints) -> Self {
        let Settings { spp, max_depth, direct, filter, roulette, .. } = Settings::default();
        Self {
            spp: file.spp.unwrap_or(spp),
            max_depth: file.max_depth.unwrap_or(max_depth),
            integrator: file.integrator.unwrap_or("path"),
            direct,
            filter: file.filter.unwrap_or(filter),
            adaptive: None,
            roulette,
            roulette_at_depth: roulette,
        }
    }
}

/// Lines of a program, printed at the stages of a render.
pub(crate) struct Lines {
    /// Before the environment map is read.
    pub(crate) loading_environment: fn(&Path),
    /// Before the scene is read.
    pub(crate) input: fn(&Path),
    /// After a camera file was read.
    pub(crate) camera_loaded: fn(&Path),
    /// After the environment map is prepared.
    pub(crate) environment_ready: fn(),
    /// Before rendering, with the number of threads.
    pub(crate) built: fn(&Session, usize),
    /// While rendering, on a terminal, with the percentage.
    pub(crate) progress: fn(u64),
    /// After rendering.
    pub(crate) rendered: fn(&RenderStatistics),
    /// After the image is written; true for a rectangle of it.
    pub(crate) saved: fn(&Path, bool),
}
