//! Options for renders that stop at an error target or a time limit.

use std::time::Duration;

use clap::Args;
use pathtracer::Target;

use crate::parse::{confidence, share, time_limit, two_or_more};

/// Default of `--max-spp`.
const MAX_SAMPLES: u32 = 65_536;

/// Default of `--confidence`.
const CONFIDENCE: f64 = 0.95;

/// Options for renders that stop at an error target or a time limit.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Sampling")]
pub(crate) struct StopOptions {
    /// Render until the relative root mean square error of the displayed image is below this, such
    /// as 1%; samples go where they reduce it most
    #[arg(long, value_name = "ERROR", allow_negative_numbers = true, value_parser = share)]
    #[arg(conflicts_with_all = ["adaptive", "samples", "spp"])]
    pub(crate) target_error: Option<f64>,

    /// Render until, in each square of 8 x 8 pixels, the error of most pixels (by --confidence) is
    /// below this fraction of white, such as 2%
    #[arg(long, value_name = "NOISE", allow_negative_numbers = true, value_parser = share)]
    #[arg(conflicts_with_all = ["adaptive", "samples", "spp"])]
    pub(crate) target_noise: Option<f64>,

    /// Same number of samples for all pixels, with --target-error or --target-noise
    #[arg(long = "uniform-sampling", visible_alias = "uniform")]
    pub(crate) uniform: bool,

    /// Confidence level of --target-error and --target-noise [default: 95%]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = confidence)]
    pub(crate) confidence: Option<f64>,

    /// Maximum samples per pixel, with --target-error or --target-noise [default: 65536]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = two_or_more)]
    pub(crate) max_spp: Option<u32>,

    /// Stop after this time since the start of the program, such as 90s, 10m or 1h30m; the render
    /// can be resumed
    #[arg(long, value_name = "TIME", value_parser = time_limit)]
    pub(crate) time_limit: Option<Duration>,
}

impl StopOptions {
    /// Returns true if an error target is given.
    pub(crate) fn has_target(&self) -> bool {
        self.target_error.is_some() || self.target_noise.is_some()
    }

    /// Maximum number of samples per pixel.
    pub(crate) fn most_samples(&self) -> u32 {
        self.max_spp.unwrap_or(MAX_SAMPLES)
    }

    /// Error target of an image displayed with `exposure` stops, or `None` if none is given.
    pub(crate) fn target(&self, exposure: f32) -> Option<Target> {
        self.has_target().then(|| Target {
            error: self.target_error,
            noise: self.target_noise,
            uniform: self.uniform,
            confidence: self.confidence.unwrap_or(CONFIDENCE),
            white: libm::exp2(-f64::from(exposure)),
        })
    }
}
