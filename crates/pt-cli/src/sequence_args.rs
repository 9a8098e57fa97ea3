//! Options for several images of a scene.

use clap::Args;

use crate::parse;

/// Default of `--fps`, the frame rate of films.
const FRAMES_PER_SECOND: f64 = 24.0;

/// Options for several images of a scene.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Sequences")]
pub(crate) struct SequenceArgs {
    /// Render an image with each of these cameras: all of the scene, their names or numbers
    /// separated by commas, or those of a file of views, transforms.json of NeRF or images.txt of
    /// COLMAP, of which transforms.json#0..99/10 selects some. The images are numbered from 0, in
    /// place of %04d in the name of --output
    #[arg(long, value_name = "CAMERAS")]
    #[arg(conflicts_with_all = ["camera", "camera_file", "frames", "summary_json"])]
    pub(crate) cameras: Option<String>,

    /// Render an image at each of these frames of the animations (see --time), such as 1..240 or
    /// 1..240/2; their numbers replace %04d in the name of --output
    #[arg(long, value_name = "FRAMES", value_parser = parse::steps)]
    #[arg(conflicts_with_all = ["time", "summary_json"])]
    pub(crate) frames: Option<parse::Steps>,

    /// Frames per second of --frames [default: 24]
    #[arg(long, value_name = "RATE", value_parser = parse::rate, requires = "frames")]
    pub(crate) fps: Option<f64>,
}

impl SequenceArgs {
    /// Long options, each with a value.
    pub(crate) const OPTIONS: [&str; 3] = ["--cameras", "--frames", "--fps"];

    /// Returns true if several images are requested.
    pub(crate) fn is_requested(&self) -> bool {
        self.cameras.is_some() || self.frames.is_some()
    }

    /// Time of a frame in seconds.
    pub(crate) fn time_of(&self, frame: u32) -> f64 {
        f64::from(frame) / self.fps.unwrap_or(FRAMES_PER_SECOND)
    }
}
