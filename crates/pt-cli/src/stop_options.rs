//! Options for renders that stop at an error target or a time limit, and their summary.

use std::time::Duration;

use clap::Args;
use pathtracer::{Evaluation, SamplerKind, Session, Target};

use crate::args::Cli;
use crate::resolve;

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
    #[arg(conflicts_with_all = ["cs184", "adaptive", "samples", "spp"])]
    pub(crate) target_error: Option<f64>,

    /// Render until, in each square of 8 x 8 pixels, the error of most pixels (by --confidence) is
    /// below this fraction of white, such as 2%
    #[arg(long, value_name = "NOISE", allow_negative_numbers = true, value_parser = share)]
    #[arg(conflicts_with_all = ["cs184", "adaptive", "samples", "spp"])]
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
    #[arg(long, value_name = "TIME", value_parser = time, conflicts_with = "cs184")]
    pub(crate) time_limit: Option<Duration>,
}

/// Parses a fraction above 0 and up to 1, as 1% or 0.01.
fn share(text: &str) -> Result<f64, String> {
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|v| v / 100.0),
        None => text.parse(),
    };
    match value {
        Ok(v) if v > 0.0 && v <= 1.0 => Ok(v),
        _ => Err("expected a share above 0 and up to 100%, as in 1% or 0.01".into()),
    }
}

fn confidence(text: &str) -> Result<f64, String> {
    share(text)
        .ok()
        .filter(|v| (0.5..=0.999_999).contains(v))
        .ok_or("expected a share from 50% up to 99.9999%, as in 95% or 0.95".into())
}

fn two_or_more(text: &str) -> Result<u32, String> {
    resolve::positive(text)
        .ok()
        .filter(|n| *n >= 2)
        .ok_or("expected a whole number from 2 up to 2147483648".into())
}

pub(crate) fn time(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().and_then(|v| Duration::try_from_secs_f64(v).ok());
    let duration = seconds.or_else(|| humantime::parse_duration(text).ok());
    duration
        .filter(|duration| !duration.is_zero())
        .ok_or("expected a time above 0, as in 90s, 10m or 1h30m".into())
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

/// Rejects options that exclude each other.
///
/// # Errors
/// A message with the options and the remedy.
pub(crate) fn check(cli: &Cli) -> Result<(), String> {
    let stop = &cli.stop;
    let without_target = stop.confidence.is_some() || stop.max_spp.is_some() || stop.uniform;
    if !stop.has_target() && without_target {
        return Err("--confidence, --max-spp and --uniform-sampling are for --target-error and --target-noise; give one of them, \
                    or the number of samples with -s"
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

/// Formats the measured error, as in "0.960 % of the displayed image (0.930 to 0.990)".
fn words(look: &Evaluation) -> String {
    let [error, least, most] = look.measured.to_array().map(|share| 100.0 * share);
    format!("{error:.3} % of the displayed image ({least:.3} to {most:.3})")
}

/// Line of the summary with the measured and the requested error, or `None` without half buffers.
pub(crate) fn summary(session: &Session) -> Option<String> {
    let look = session.look()?;
    let Some(target) = &session.settings().target else { return Some(words(&look)) };
    let asked = [("", target.error), ("noise ", target.noise)]
        .into_iter()
        .filter_map(|(name, share)| Some(format!("{name}{} %", 100.0 * share?)))
        .collect::<Vec<_>>();
    let noise = target.noise.map(|_| format!(", noise {:.3} % of white", 100.0 * look.noise));
    Some(format!(
        "{}{}; asked for: {} with a confidence of {} %",
        words(&look),
        noise.unwrap_or_default(),
        asked.join(" and "),
        100.0 * target.confidence
    ))
}

/// Returns true if an error target was missed.
pub(crate) fn is_missed(session: &Session) -> bool {
    session.settings().target.is_some() && !session.look().is_some_and(|look| look.is_met())
}
