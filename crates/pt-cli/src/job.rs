//! A render as plain data: the command line, resolved once. Each part goes to the module that uses
//! it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pathtracer::image::SaveOptions;
use pathtracer::provenance::Provenance;
use pathtracer::{CompileOptions, LightGroups, LoadOptions, SkyLayout};

use crate::arg_values::{ProgressKind, ReceiptKind};
use crate::policies::{CompatPolicies, Lines};
use crate::settings::SettingsRequest;

/// A render.
pub(crate) struct RenderJob {
    pub(crate) mode: Mode,
    pub(crate) input: InputFiles,
    pub(crate) compile: CompileJob,
    pub(crate) memory: MemoryPlan,
    pub(crate) schedule: Schedule,
    pub(crate) output: OutputJob,
    pub(crate) display: DisplayJob,
    /// Arguments, without the name of the program.
    pub(crate) command: Vec<String>,
}

/// Flags that all stages of a render obey.
#[derive(Clone, Copy)]
pub(crate) struct Mode {
    /// True if only errors are printed.
    pub(crate) quiet: bool,
    /// True if missing files are errors, and invalid samples and missed targets have a status.
    pub(crate) strict: bool,
    pub(crate) policies: &'static CompatPolicies,
}

impl Mode {
    /// Lines that replace the summary, unless the program is quiet.
    pub(crate) fn lines(self) -> Option<&'static Lines> {
        self.policies.lines.as_ref().filter(|_| !self.quiet)
    }
}

/// Files to be read.
pub(crate) struct InputFiles {
    /// Folder of relative paths; `None` for the current one.
    pub(crate) folder: Option<PathBuf>,
    /// Scene, or `None` for the embedded one.
    pub(crate) scene: Option<PathBuf>,
    pub(crate) load: LoadOptions,
    pub(crate) environment: Option<EnvironmentFile>,
    pub(crate) camera_file: Option<PathBuf>,
}

impl InputFiles {
    /// Path from the current folder.
    pub(crate) fn place(&self, path: &Path) -> PathBuf {
        self.folder.as_ref().map_or_else(|| path.to_owned(), |folder| folder.join(path))
    }
}

/// An environment map that replaces the one of the scene.
pub(crate) struct EnvironmentFile {
    pub(crate) path: PathBuf,
    /// Layout, or `None` for latitude and longitude.
    pub(crate) layout: Option<SkyLayout>,
}

/// Compilation of the scene, and settings of the render.
pub(crate) struct CompileJob {
    /// Options, without the environment and the camera, which are read from files.
    pub(crate) options: CompileOptions,
    /// Rectangle to be rendered: X, Y of its lower left corner, counted from the lower left, and
    /// its width and height; `None` for the crop window of the scene file or the whole image.
    pub(crate) crop: Option<[u32; 4]>,
    pub(crate) settings: SettingsRequest,
}

/// Quantities from which the memory of a render is estimated.
pub(crate) struct MemoryPlan {
    /// Limit in bytes; `None` for the memory that is available.
    pub(crate) limit: Option<u64>,
    /// Files whose sizes count.
    pub(crate) files: Vec<PathBuf>,
    /// Size of the image, if it is given.
    pub(crate) resolution: Option<[u32; 2]>,
    /// Size of the rectangle to be rendered, if it is given.
    pub(crate) crop: Option<[u32; 2]>,
    pub(crate) pixel: PixelBytes,
    pub(crate) light_groups: Option<LightGroups>,
}

/// Maximum number of pixels of an image, by the memory of ordinary machines.
const MAX_PIXELS: u64 = 1 << 28;

/// Bytes per pixel, without additional channels.
pub(crate) const PIXEL_BYTES: u64 = 125;

impl MemoryPlan {
    /// Rejects images with too many pixels for their channels.
    ///
    /// # Errors
    /// A message with the maximum number.
    pub(crate) fn check_pixels(&self) -> Result<(), String> {
        let groups = self.light_groups.as_ref().map_or(0, |wanted| wanted.named.len() + 1);
        let most = MAX_PIXELS * PIXEL_BYTES / self.pixel.with_groups(groups);
        match self.resolution {
            Some([w, h]) if u64::from(w) * u64::from(h) > most => {
                Err(format!("-r {w} {h}: found too many pixels, expected at most {most}"))
            }
            _ => Ok(()),
        }
    }
}

/// Bytes of the film and of its development per pixel.
#[derive(Clone, Copy)]
pub(crate) struct PixelBytes {
    /// Bytes without light groups.
    pub(crate) base: u64,
    /// Bytes of each light group.
    pub(crate) per_group: u64,
}

impl PixelBytes {
    /// Bytes per pixel with this number of light groups.
    pub(crate) fn with_groups(self, groups: usize) -> u64 {
        self.base + self.per_group * groups as u64
    }
}

/// Samples of the render, their order, and checkpoints.
pub(crate) struct Schedule {
    pub(crate) threads: usize,
    /// Width and height of a tile in pixels.
    pub(crate) tile_size: u32,
    /// Number of the first sample.
    pub(crate) first: u32,
    /// Time after which the render stops, since the start of the program.
    pub(crate) time_limit: Option<Duration>,
    /// Interval between checkpoints; `None` if there are none.
    pub(crate) checkpoint_every: Option<Duration>,
    /// True if existing samples are discarded.
    pub(crate) restart: bool,
    /// True if existing samples must belong to this image, as for `resume`.
    pub(crate) resumes: bool,
    /// Provenance of the image that is rendered again and must be identical.
    pub(crate) expected: Option<Box<Provenance>>,
}

/// Files to be written.
pub(crate) struct OutputJob {
    pub(crate) path: PathBuf,
    /// Options of image files, without metadata.
    pub(crate) save: SaveOptions,
    /// True if the exposure is chosen from the image.
    pub(crate) auto_exposure: bool,
    pub(crate) metadata: ReceiptKind,
    pub(crate) denoise: bool,
    pub(crate) summary_json: Option<PathBuf>,
    /// Host and port of the viewer.
    pub(crate) tev: Option<String>,
}

/// Progress display.
pub(crate) struct DisplayJob {
    pub(crate) kind: ProgressKind,
    /// True if pixels may stop before their maximum number of samples.
    pub(crate) is_adaptive: bool,
}
