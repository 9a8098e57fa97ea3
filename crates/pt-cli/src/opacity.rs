//! Options of alpha and of hidden lights.

use clap::Args;
use pathtracer::{Aov, Hidden, RenderHints};

use crate::arg_values::Switch;

/// Options of alpha and of hidden lights.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Image")]
pub(crate) struct Opacity {
    /// Also write alpha: straight in PNG images, premultiplied in EXR images. A visible background
    /// is opaque; see --hide-background [default: the file's, or off]
    #[arg(long, value_name = "SWITCH", num_args = 0..=1, require_equals = true)]
    #[arg(default_missing_value = "on")]
    pub(crate) alpha: Option<Switch>,

    /// Do not show environment, sky and sun directly or through transparent surfaces; they light
    /// the scene nonetheless
    #[arg(long)]
    pub(crate) hide_background: bool,

    /// Do not show emissive surfaces directly; the camera sees what is behind them
    #[arg(long)]
    pub(crate) hide_emitters: bool,
}

impl Opacity {
    /// Alpha channel, or `None` if it is not requested: by `--alpha`, or else by the listed AOVs or
    /// by the file.
    pub(crate) fn channel(
        &self,
        aov: &[Aov],
        file: &RenderHints,
        transparency: bool,
    ) -> Option<Aov> {
        let named = aov.contains(&Aov::Alpha) || file.aovs.contains(&Aov::Alpha.name());
        let is_wanted = self.alpha.map_or(named, |switch| switch == Switch::On);
        (is_wanted && transparency).then_some(Aov::Alpha)
    }

    /// Lights that are not seen directly: the greater of the values of the command line and of the
    /// file.
    pub(crate) fn hidden(&self, file: Hidden, transparency: bool) -> Hidden {
        match self {
            _ if !transparency => Hidden::Nothing,
            Self { hide_emitters: true, .. } => Hidden::Emitters,
            Self { hide_background: true, .. } => file.max(Hidden::Background),
            _ => file,
        }
    }
}
