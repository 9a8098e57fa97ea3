//! The command line. One table gives the parser, the help, the man page and the completions.

use std::path::PathBuf;
use std::time::Duration;

use bytesize::ByteSize;
use clap::Parser;
use pathtracer::{Aov, INTEGRATORS, LightGroups};

use crate::arg_values::{
    BvhBuilder, BvhQuality, Direct, PixelFilter, ProgressKind, ReceiptKind, SampleGenerator, Show,
};
use crate::compat::CompatArgs;
use crate::crop::CropOption;
use crate::environment::EnvironmentLayout;
use crate::image_options::{ExrOptions, PngOptions};
use crate::loading::Loading;
use crate::opacity::Opacity;
use crate::parse;
use crate::policies::CompatPolicies;
use crate::sequence_args::SequenceArgs;
use crate::stop_options::StopOptions;

/// Physically based path tracer: renders a scene to a PNG or OpenEXR image.
///
/// Without a scene it renders a Cornell box to cornell.png. Scenes are pathtracer's own (.json),
/// COLLADA (.dae), glTF 2.0 (.gltf, .glb), Mitsuba 3 (.xml), pbrt-v4 (.pbrt), PLY, OBJ and STL
/// files. The image depends on the scene and the options alone: neither the number of threads nor
/// the machine changes a bit of it.
#[derive(Parser, Debug, Clone)]
#[command(name = "pathtracer", version, max_term_width = 100, arg_required_else_help = false)]
#[command(
    override_usage = "pathtracer [render] [OPTIONS] [SCENE]\n       pathtracer resume | merge | info | check | rerender | explain | convert |\n                  develop | denoise | join …"
)]
#[command(after_help = HELP)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command line are bools")]
pub(crate) struct Cli {
    /// Scene file; the embedded Cornell box if there is none
    #[arg(value_name = "SCENE")]
    pub(crate) paths: Vec<PathBuf>,

    /// Image file, .png or .exr, or .film for samples to be merged [default: SCENE.png, in this
    /// folder]
    #[arg(short = 'f', long, value_name = "FILE", num_args = 0..=1, help_heading = "Image")]
    #[expect(clippy::option_option, reason = "-f may stand without its value; see sort_paths")]
    pub(crate) output: Option<Option<PathBuf>>,

    /// Width and height in pixels [default: the file's, or 600 rows]
    #[arg(short, long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, allow_negative_numbers = true)]
    #[arg(value_parser = parse::pixels, help_heading = "Image")]
    pub(crate) resolution: Option<Vec<u32>>,

    #[command(flatten)]
    pub(crate) crop: CropOption,

    #[command(flatten)]
    pub(crate) png: PngOptions,

    #[command(flatten)]
    pub(crate) exr: ExrOptions,

    #[command(flatten)]
    pub(crate) opacity: Opacity,

    /// Denoise with Intel Open Image Denoise, a separate library (a message gives the command that
    /// installs it). The noisy image is kept: in the layer "noisy" of an EXR image, in
    /// NAME_noisy.png beside a PNG image
    #[arg(long, help_heading = "Image")]
    pub(crate) denoise: bool,

    /// Show the image in the viewer tev while it is rendered; tev listens at 127.0.0.1:14158
    #[arg(long, value_name = "HOST:PORT", value_parser = parse::address, help_heading = "Image")]
    pub(crate) tev: Option<String>,

    /// Samples per pixel; the maximum with --adaptive [default: the file's, or 64]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = parse::positive)]
    #[arg(help_heading = "Sampling")]
    pub(crate) spp: Option<u32>,

    /// Render only the samples with these numbers, such as 0..256, to be merged with others
    #[arg(long, value_name = "FROM..TO", allow_negative_numbers = true, value_parser = parse::samples)]
    #[arg(conflicts_with = "adaptive", help_heading = "Sampling")]
    pub(crate) samples: Option<(u32, u32)>,

    /// Samples of each area light at each surface point; of all lights together if there are many
    #[arg(short, long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    #[arg(value_parser = parse::light_samples, help_heading = "Sampling")]
    pub(crate) light_samples: u32,

    /// Maximum number of surface interactions of a path: 0 shows emission only, 1 direct light
    /// [default: the file's, or 16]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = parse::count)]
    #[arg(help_heading = "Sampling")]
    pub(crate) max_depth: Option<u32>,

    /// With 0, show only light of exactly --max-depth interactions, as --exact-depth does; with
    /// more, light of up to --max-depth interactions
    #[arg(short = 'o', long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    #[arg(value_parser = parse::count, help_heading = "Sampling")]
    pub(crate) accumulate: u32,

    /// Show only light of exactly --max-depth interactions
    #[arg(long, conflicts_with = "accumulate", help_heading = "Sampling")]
    pub(crate) exact_depth: bool,

    /// Direct light by uniform directions of the hemisphere (same as --direct hemisphere)
    #[arg(short = 'H', long, conflicts_with = "direct", help_heading = "Sampling")]
    pub(crate) hemisphere: bool,

    /// Estimator of direct light [default: mis]
    #[arg(long, value_name = "ESTIMATOR", help_heading = "Sampling")]
    pub(crate) direct: Option<Direct>,

    /// Stop a pixel when, checked every BATCH samples, the 95 % confidence interval of its mean is
    /// narrower than TOLERANCE times the mean; also writes FILE_rate.png
    #[arg(short, long, value_names = ["BATCH", "TOLERANCE"], num_args = 2, allow_negative_numbers = true)]
    #[arg(help_heading = "Sampling")]
    pub(crate) adaptive: Option<Vec<String>>,

    #[command(flatten)]
    pub(crate) stop: StopOptions,

    /// Clamp single contributions to a sample (from a light, a surface or the environment) to this
    /// luminance. Reduces fireflies, but removes light; the summary reports how much
    #[arg(long, value_name = "LUMINANCE", allow_negative_numbers = true)]
    #[arg(value_parser = parse::above_zero, help_heading = "Sampling")]
    pub(crate) clamp: Option<f32>,

    /// Clamp only contributions of light scattered at least twice, which have most of the noise
    #[arg(long, value_name = "LUMINANCE", allow_negative_numbers = true)]
    #[arg(value_parser = parse::above_zero, help_heading = "Sampling")]
    pub(crate) clamp_indirect: Option<f32>,

    /// Reuse paths within squares of N × N pixels (1, 2 or 4): less noise per pixel in 1.2 to 2.3
    /// times the time, with noise that is correlated between neighbours
    #[arg(long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    #[arg(value_parser = parse::reuse, help_heading = "Sampling")]
    pub(crate) path_reuse: u32,

    /// Split each path into N paths (a power of two up to 64) at the first surface where it
    /// scatters
    #[arg(
        long = "path-splitting",
        visible_alias = "split",
        value_name = "N",
        default_value = "1",
        allow_negative_numbers = true
    )]
    #[arg(value_parser = parse::split, help_heading = "Sampling")]
    pub(crate) split: u32,

    /// Sample generator
    #[arg(long, value_name = "SAMPLER", default_value = "sobol", help_heading = "Sampling")]
    pub(crate) sampler: SampleGenerator,

    /// Pixel reconstruction filter [default: the file's, or box]
    #[arg(long, value_name = "FILTER", help_heading = "Sampling")]
    pub(crate) filter: Option<PixelFilter>,

    /// Seed of the sample generator
    #[arg(long, value_name = "N", default_value = "0", allow_negative_numbers = true)]
    #[arg(value_parser = parse::count, help_heading = "Sampling")]
    pub(crate) seed: u32,

    #[arg(long, value_name = "NAME", help = integrator_help(), help_heading = "What to show")]
    pub(crate) integrator: Option<String>,

    /// Maximum distance of occluders for --integrator ao; 0 is unlimited [default: 0]
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    #[arg(value_parser = parse::not_negative, help_heading = "What to show")]
    pub(crate) ao_distance: Option<f32>,

    /// Show only some components of the light, by its number of interactions: emission 0, direct 0
    /// and 1, indirect 2 and more, global all
    #[arg(
        long = "light-component",
        visible_alias = "show",
        value_name = "LIGHT",
        default_value = "global",
        help_heading = "What to show"
    )]
    pub(crate) show: Show,

    /// Also write these arbitrary output variables (AOVs) of the first hits into the image, an
    /// .exr file; cryptomatte_* are mattes of all objects or materials
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parse::aovs())]
    #[arg(help_heading = "What to show")]
    pub(crate) aov: Vec<Aov>,

    /// Also write light groups, by the names of lights: sky,key=lamp+window; each makes a group of
    /// every light, and the other lights are the group rest
    #[arg(long, value_name = "GROUPS", value_parser = parse::light_groups)]
    #[arg(help_heading = "What to show")]
    pub(crate) light_groups: Option<LightGroups>,

    #[command(flatten)]
    pub(crate) compat: CompatArgs,

    #[command(flatten)]
    pub(crate) loading: Loading,

    /// Environment map, an image in latitude and longitude (.exr, .hdr, .png, .jpg …)
    #[arg(short, long, value_name = "FILE", help_heading = "Scene")]
    pub(crate) environment: Option<PathBuf>,

    /// Mapping of directions to pixels of --environment
    #[arg(
        long,
        value_name = "LAYOUT",
        value_enum,
        default_value = "latlong",
        requires = "environment"
    )]
    #[arg(help_heading = "Scene")]
    pub(crate) environment_layout: EnvironmentLayout,

    /// Camera settings file of the course's program, or a view of a file of views (see --cameras)
    /// by its number from 0, such as transforms.json#17
    #[arg(short = 'c', long, value_name = "FILE", help_heading = "Scene")]
    pub(crate) camera_file: Option<PathBuf>,

    /// Radius of the lens; 0 is a pinhole [default: the camera's, or 0]
    #[arg(short = 'b', long, value_name = "LENGTH", allow_negative_numbers = true)]
    #[arg(value_parser = parse::not_negative, help_heading = "Scene")]
    pub(crate) lens_radius: Option<f32>,

    /// Number of aperture blades, which make the aperture a regular polygon [default: the
    /// camera's, or a round aperture]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = parse::blades)]
    #[arg(help_heading = "Scene")]
    pub(crate) aperture_blades: Option<u32>,

    /// Rotation of that polygon in degrees, counter-clockwise; at 0 a corner is at the right
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_negative_numbers = true)]
    #[arg(value_parser = parse::degrees, help_heading = "Scene")]
    pub(crate) aperture_rotation: f64,

    /// Panorama: show all directions around the camera, in latitude and longitude
    #[arg(long, help_heading = "Scene")]
    pub(crate) panorama: bool,

    /// Smooth the shadow terminator of meshes with shading normals
    #[arg(long, help_heading = "Scene")]
    pub(crate) smooth_shadows: bool,

    /// Distance of the plane in focus [default: the camera's]
    #[arg(short = 'd', long, value_name = "LENGTH", allow_negative_numbers = true)]
    #[arg(value_parser = parse::above_zero, help_heading = "Scene")]
    pub(crate) focal_distance: Option<f32>,

    #[command(flatten)]
    pub(crate) sequence: SequenceArgs,

    /// Threads; 0 is one per core [default: 0]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = parse::threads)]
    #[arg(help_heading = "Machine")]
    pub(crate) threads: Option<usize>,

    /// Builder of the bounding volume hierarchy; none tests every shape
    #[arg(long, value_name = "BUILDER", default_value = "sah", help_heading = "Machine")]
    pub(crate) bvh: BvhBuilder,

    /// Build quality of --bvh sah: higher quality takes longer to build and may be faster to
    /// traverse; the image is the same
    #[arg(
        long = "bvh-quality",
        visible_alias = "quality",
        value_name = "QUALITY",
        default_value = "balanced",
        help_heading = "Machine"
    )]
    pub(crate) quality: BvhQuality,

    /// Maximum number of shapes in a leaf of the hierarchy
    #[arg(long, value_name = "N", default_value = "8", allow_negative_numbers = true)]
    #[arg(value_parser = parse::leaf_size, help_heading = "Machine")]
    pub(crate) max_leaf_size: u32,

    /// Abort if the estimated memory exceeds SIZE [default: what the system and control groups
    /// have left]
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true, value_parser = parse::size)]
    #[arg(help_heading = "Machine")]
    pub(crate) max_memory: Option<ByteSize>,

    /// Tile size in pixels
    #[arg(long, value_name = "PIXELS", default_value = "32", allow_negative_numbers = true)]
    #[arg(value_parser = parse::positive, help_heading = "Machine")]
    pub(crate) tile_size: u32,

    /// Interval between checkpoints, such as 90s, 10m or 1h30m: the samples so far are written
    /// beside the image; 0 is never
    #[arg(long, value_name = "TIME", default_value = "1m", allow_negative_numbers = true)]
    #[arg(value_parser = parse::duration, help_heading = "Machine")]
    pub(crate) checkpoint_every: Duration,

    /// Discard existing samples and start over
    #[arg(long, help_heading = "Machine")]
    pub(crate) restart: bool,

    /// Progress display: a bar on a terminal and lines elsewhere (auto), one of them, JSON lines
    /// on standard output, or none
    #[arg(long, value_name = "KIND", default_value = "auto", help_heading = "Machine")]
    pub(crate) progress: ProgressKind,

    /// Refuse scenes with missing files, instead of using a magenta and black placeholder (status
    /// 4), and --denoise without its library. Exit with status 3 if there were invalid samples
    /// (NaN, infinite, negative, too large) or an error target was missed; the image is written
    /// nonetheless
    #[arg(long, help_heading = "Machine")]
    pub(crate) strict: bool,

    /// Provenance metadata of images
    #[arg(
        long = "metadata",
        visible_alias = "receipt",
        value_name = "KIND",
        default_value = "full",
        help_heading = "Machine"
    )]
    pub(crate) receipt: ReceiptKind,

    /// Print errors only
    #[arg(short, long, help_heading = "Machine")]
    pub(crate) quiet: bool,

    /// Also write the summary to this file, as JSON
    #[arg(long, value_name = "FILE", help_heading = "Machine")]
    pub(crate) summary_json: Option<PathBuf>,

    /// Print completions for a shell
    #[arg(long, value_name = "SHELL", help_heading = "Machine")]
    pub(crate) completions: Option<clap_complete::Shell>,

    /// Print the man page
    #[arg(long, help_heading = "Machine")]
    pub(crate) man: bool,
}

/// Text about the commands in the help of the program.
const HELP: &str = "\
Commands:
  pathtracer resume out.exr [-s N]           continue a stopped render, or add samples
  pathtracer merge a.film b.film -f out.exr  merge the samples of several films
  pathtracer info out.exr                    show how an image or a film was made
  pathtracer info scene.dae                  show the contents of a scene
  pathtracer check scene.dae                 report all problems of a scene
  pathtracer rerender out.exr                render it again, and compare
  pathtracer explain scene.dae -x 9 -y 5     show the light paths of a pixel
  pathtracer convert scene.dae scene.json    write a scene as .json or .glb
  pathtracer develop out.exr -f out.png      develop an image: exposure, tone curve, crop, size
  pathtracer denoise out.exr                 denoise an image
  pathtracer join a.exr b.exr -f out.exr     join images of parts that were rendered with --crop
Each has --help. A scene with the name of a command is written ./resume.";

/// Help on `--integrator`.
fn integrator_help() -> String {
    let names: Vec<_> = INTEGRATORS.iter().map(|integrator| integrator.name).collect();
    format!("Integrator: {} [default: the file's, or path]", names.join(", "))
}

impl Cli {
    /// Behaviour in which programs differ.
    pub(crate) fn policies(&self) -> &'static CompatPolicies {
        self.compat.policies()
    }
}
