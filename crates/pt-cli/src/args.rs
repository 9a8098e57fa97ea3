//! The command line. One table gives the parser, the help, the man page and the completions.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::ExitCode;

use bytesize::ByteSize;
use clap::{CommandFactory, FromArgMatches, Parser, ValueEnum};
use pathtracer::{Aov, Builder, DirectLight, LightGroups, SamplerKind};

use crate::commands::Command;
use crate::environment::EnvironmentLayout;
use crate::image_options::{self, Exposure, ExrCompression, ExrType, Tonemap};
use crate::loading::Loading;
use crate::opacity::Opacity;
use crate::resolve::{self, RenderJob};
use crate::stop_options::StopOptions;
use crate::{light_groups, message, sort};

/// Physically based path tracer: renders a scene to a PNG or OpenEXR image.
///
/// Without a scene it renders a Cornell box to cornell.png. Scenes are pathtracer's own (.json),
/// COLLADA (.dae), glTF 2.0 (.gltf, .glb), Mitsuba 3 (.xml), pbrt-v4 (.pbrt), PLY, OBJ and STL
/// files. The image depends on the scene and the options alone: neither the number of threads nor
/// the machine changes a bit of it.
#[derive(Parser, Debug, Clone)]
#[command(name = "pathtracer", version, max_term_width = 100, arg_required_else_help = false)]
#[command(
    override_usage = "pathtracer [render] [OPTIONS] [SCENE]\n       pathtracer resume | merge | info | check | rerender | explain | convert …"
)]
#[command(after_help = crate::commands::HELP)]
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

    /// Width and height in pixels [default: the file's, or 600 rows; 800 600
    /// with --cs184]
    #[arg(short, long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, allow_negative_numbers = true)]
    #[arg(value_parser = resolve::pixels, help_heading = "Image")]
    pub(crate) resolution: Option<Vec<u32>>,

    /// Render only this cell: X, Y of its lower left corner from the lower left, and its size
    #[arg(short = 'p', long, value_names = ["X", "Y", "DX", "DY"], num_args = 4, allow_negative_numbers = true)]
    #[arg(value_parser = resolve::count, help_heading = "Image")]
    pub(crate) cell: Option<Vec<u32>>,

    /// Bits per channel of a PNG file
    #[arg(long, value_name = "BITS", default_value = "8", help_heading = "Image")]
    pub(crate) png_bits: PngBits,

    /// Stops by which a PNG image is made brighter, or darker below 0; with --tonemap before the
    /// curve. auto takes those with which it fits a screen [default: 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, conflicts_with = "cs184")]
    #[arg(value_parser = image_options::exposure, help_heading = "Image")]
    pub(crate) exposure: Option<Exposure>,

    /// Curve that brings light beyond the screen's white into a PNG image [default: linear]
    #[arg(long, value_name = "CURVE", conflicts_with = "cs184", help_heading = "Image")]
    pub(crate) tonemap: Option<Tonemap>,

    /// Numbers of an EXR image [default: float]
    #[arg(long, value_name = "TYPE", help_heading = "Image")]
    pub(crate) exr_type: Option<ExrType>,

    /// Compression of an EXR image (DWAA and DWAB cannot be written) [default: zip]
    #[arg(long, value_name = "METHOD", help_heading = "Image")]
    pub(crate) exr_compression: Option<ExrCompression>,

    #[command(flatten)]
    pub(crate) opacity: Opacity,

    /// Remove the noise by Intel Open Image Denoise, which is a library apart (a message gives the
    /// command that installs it): an EXR image keeps what was rendered in the layer "noisy",
    /// beside a PNG image NAME_noisy.png has it
    #[arg(long, conflicts_with = "cs184", help_heading = "Image")]
    pub(crate) denoise: bool,

    /// Show the image in the viewer tev while it is rendered; tev listens at 127.0.0.1:14158
    #[arg(long, value_name = "HOST:PORT", value_parser = image_options::address, help_heading = "Image")]
    pub(crate) tev: Option<String>,

    /// Samples per pixel; the maximum with --adaptive [default: the file's, or 64; 1 with --cs184]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = resolve::positive)]
    #[arg(help_heading = "Sampling")]
    pub(crate) spp: Option<u32>,

    /// Only the samples of these numbers, as 0..256, to be merged with others
    #[arg(long, value_name = "FROM..TO", allow_negative_numbers = true, value_parser = resolve::samples)]
    #[arg(conflicts_with_all = ["cs184", "adaptive"], help_heading = "Sampling")]
    pub(crate) samples: Option<(u32, u32)>,

    /// Samples of each area light at each surface point; of all together where they are many
    #[arg(short, long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::light_samples, help_heading = "Sampling")]
    pub(crate) light_samples: u32,

    /// Most surface interactions of a path: 0 shows lights only, 1 direct light [default: the
    /// file's, or 16; 1 with --cs184]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = resolve::count)]
    #[arg(help_heading = "Sampling")]
    pub(crate) max_depth: Option<u32>,

    /// 0 shows only light of exactly --max-depth interactions; more than 0 all up to it
    #[arg(short = 'o', long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::count, help_heading = "Sampling")]
    pub(crate) accumulate: u32,

    /// Direct light by uniform directions of the hemisphere (same as --direct hemisphere)
    #[arg(short = 'H', long, conflicts_with = "direct", help_heading = "Sampling")]
    pub(crate) hemisphere: bool,

    /// Estimator of direct light [default: mis; light with --cs184]
    #[arg(long, value_name = "ESTIMATOR", help_heading = "Sampling")]
    pub(crate) direct: Option<Direct>,

    /// Stop a pixel when, checked every BATCH samples, the 95 % confidence interval of its mean is
    /// narrower than TOLERANCE times the mean; also writes FILE_rate.png [with --cs184: 32 0.05]
    #[arg(short, long, value_names = ["BATCH", "TOLERANCE"], num_args = 2, allow_negative_numbers = true)]
    #[arg(help_heading = "Sampling")]
    pub(crate) adaptive: Option<Vec<String>>,

    #[command(flatten)]
    pub(crate) stop: StopOptions,

    /// Cut off single contributions to a sample (of a light, a surface or the sky) at this
    /// luminance: less noise, but less light; the summary says how much
    #[arg(long, value_name = "LUMINANCE", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::above_zero, help_heading = "Sampling")]
    pub(crate) clamp: Option<f32>,

    /// Likewise, only those of light scattered at least twice, which have most of the noise
    #[arg(long, value_name = "LUMINANCE", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::above_zero, help_heading = "Sampling")]
    pub(crate) clamp_indirect: Option<f32>,

    /// Let the paths of squares of N × N pixels (1, 2 or 4) bring their light to each other: less
    /// noise in each for 1.2 to 2.3 times the time, but the noise of neighbours is alike
    #[arg(long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::reuse, help_heading = "Sampling")]
    pub(crate) path_reuse: u32,

    /// Let each path go on N ways (a power of two up to 64) from the first surface where it
    /// scatters
    #[arg(long, value_name = "N", default_value = "1", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::split, help_heading = "Sampling")]
    pub(crate) split: u32,

    /// Where random numbers come from
    #[arg(long, value_name = "SAMPLER", default_value = "sobol", help_heading = "Sampling")]
    pub(crate) sampler: Sampler,

    /// Reconstruction filter: how much the light around its middle counts for a pixel [default:
    /// the file's, or box; box with --cs184]
    #[arg(long, value_name = "FILTER", help_heading = "Sampling")]
    pub(crate) filter: Option<Filter>,

    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value = "0", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::count, help_heading = "Sampling")]
    pub(crate) seed: u32,

    /// What to compute: path, volpath (with media), direct, ao, normals or cs184 [default: the
    /// file's, or path]
    #[arg(long, value_name = "NAME", help_heading = "What to show")]
    pub(crate) integrator: Option<String>,

    /// Distance beyond which nothing occludes, for --integrator ao; 0 is unlimited [default: 0]
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::not_negative, help_heading = "What to show")]
    pub(crate) ao_distance: Option<f32>,

    /// Show only light of some numbers of interactions: emission 0, direct 0 and 1, indirect 2 and
    /// more, global all
    #[arg(long, value_name = "LIGHT", default_value = "global", help_heading = "What to show")]
    pub(crate) show: Show,

    /// Also write these channels of the first surfaces into the image, an .exr file; those named
    /// cryptomatte are mattes of all objects or materials
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = resolve::aovs())]
    #[arg(help_heading = "What to show")]
    pub(crate) aov: Vec<Aov>,

    /// Also write the light of groups of lights, by names: sky,key=lamp+window; each makes one of
    /// each light, and what is left is the group rest
    #[arg(long, value_name = "GROUPS", value_parser = light_groups::parse)]
    #[arg(help_heading = "What to show")]
    pub(crate) light_groups: Option<LightGroups>,

    /// The university course's pictures, defaults and console lines (CS184 assignment 3)
    #[arg(long, help_heading = "What to show")]
    pub(crate) cs184: bool,

    #[command(flatten)]
    pub(crate) loading: Loading,

    /// Environment map: light from all around, an image in latitude and longitude (.exr, .hdr,
    /// .png, .jpg …)
    #[arg(short, long, value_name = "FILE", help_heading = "Scene")]
    pub(crate) environment: Option<PathBuf>,

    /// How the image of --environment shows all directions
    #[arg(
        long,
        value_name = "LAYOUT",
        value_enum,
        default_value = "latlong",
        requires = "environment"
    )]
    #[arg(conflicts_with = "cs184", help_heading = "Scene")]
    pub(crate) environment_layout: EnvironmentLayout,

    /// Camera settings file, as the course's program writes them
    #[arg(short = 'c', long, value_name = "FILE", help_heading = "Scene")]
    pub(crate) camera_file: Option<PathBuf>,

    /// Radius of the lens; 0 is a pinhole [default: the camera's, or 0]
    #[arg(short = 'b', long, value_name = "LENGTH", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::not_negative, help_heading = "Scene")]
    pub(crate) lens_radius: Option<f32>,

    /// Blades of the lens, which leave a regular polygon open whose corners lie on its rim
    /// [default: the camera's, or a round opening]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = resolve::blades)]
    #[arg(help_heading = "Scene")]
    pub(crate) aperture_blades: Option<u32>,

    /// Turn of that polygon in degrees, counter-clockwise; at 0 a corner is at the right
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::degrees, help_heading = "Scene")]
    pub(crate) aperture_rotation: f64,

    /// Show all directions around the camera, in latitude and longitude
    #[arg(long, conflicts_with = "cs184", help_heading = "Scene")]
    pub(crate) panorama: bool,

    /// Light meshes with smooth normals as the round shapes that they stand for: no shadows with
    /// the corners of the mesh
    #[arg(long, conflicts_with = "cs184", help_heading = "Scene")]
    pub(crate) smooth_shadows: bool,

    /// Distance of the plane in focus [default: the camera's; 4.7 with --cs184]
    #[arg(short = 'd', long, value_name = "LENGTH", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::above_zero, help_heading = "Scene")]
    pub(crate) focal_distance: Option<f32>,

    /// Threads; 0 is one per core [default: 0; 1 with --cs184]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = resolve::threads)]
    #[arg(help_heading = "Machine")]
    pub(crate) threads: Option<usize>,

    /// How to find what a ray hits: sah and mean build a tree, none tests every shape
    #[arg(long, value_name = "BUILDER", default_value = "sah", help_heading = "Machine")]
    pub(crate) bvh: Bvh,

    /// How carefully --bvh sah builds its tree: with more care it takes longer, and rays may be
    /// faster; the image is the same
    #[arg(long, value_name = "QUALITY", default_value = "balanced", help_heading = "Machine")]
    pub(crate) quality: Quality,

    /// Most shapes in a leaf of the tree
    #[arg(long, value_name = "N", default_value = "8", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::leaf_size, help_heading = "Machine")]
    pub(crate) max_leaf_size: u32,

    /// Refuse what needs more memory, by an estimate [default: what the system and control groups
    /// have left]
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true, value_parser = resolve::bytes)]
    #[arg(help_heading = "Machine")]
    pub(crate) max_memory: Option<ByteSize>,

    /// Side of the tiles that threads share, in pixels
    #[arg(long, value_name = "PIXELS", default_value = "32", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::positive, help_heading = "Machine")]
    pub(crate) tile_size: u32,

    /// Seconds after which the samples so far are written beside the image, to go on from; 0 is
    /// never
    #[arg(long, value_name = "SECONDS", default_value = "60", allow_negative_numbers = true)]
    #[arg(value_parser = resolve::seconds, help_heading = "Machine")]
    pub(crate) checkpoint_every: f64,

    /// Forget the samples that are there, instead of going on from them
    #[arg(long, help_heading = "Machine")]
    pub(crate) restart: bool,

    /// How progress is shown: by a bar on a terminal and else by lines (auto), by one of them, as
    /// lines of JSON on standard output, or not at all
    #[arg(long, value_name = "KIND", default_value = "auto", help_heading = "Machine")]
    pub(crate) progress: ProgressKind,

    /// Refuse a scene that names missing files, instead of putting magenta and black in their
    /// place (status 4), and --denoise without its library; and
    /// end with status 3 if samples were refused because they are no light (NaN, infinite,
    /// negative, too large), or an error target was missed: the image is written nonetheless
    #[arg(long, help_heading = "Machine")]
    pub(crate) strict: bool,

    /// What an image says about how it was made
    #[arg(long, value_name = "RECEIPT", default_value = "full", help_heading = "Machine")]
    pub(crate) receipt: ReceiptKind,

    /// Print nothing but errors
    #[arg(short, long, help_heading = "Machine")]
    pub(crate) quiet: bool,

    /// Also write what the summary says to this file, as JSON
    #[arg(long, value_name = "FILE", help_heading = "Machine")]
    pub(crate) summary_json: Option<PathBuf>,

    /// Print completions for a shell
    #[arg(long, value_name = "SHELL", help_heading = "Machine")]
    pub(crate) completions: Option<clap_complete::Shell>,

    /// Print the man page
    #[arg(long, help_heading = "Machine")]
    pub(crate) man: bool,
}

/// Estimators of direct light.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Direct {
    /// Light and BSDF sampling, weighted
    Mis,
    /// Light sampling
    Light,
    /// Uniform directions of the hemisphere
    Hemisphere,
    /// Directions of the hemisphere by the cosine
    Cosine,
}

impl From<Direct> for DirectLight {
    fn from(d: Direct) -> Self {
        match d {
            Direct::Mis => Self::Mis,
            Direct::Light => Self::Light,
            Direct::Hemisphere => Self::UniformHemisphere,
            Direct::Cosine => Self::CosineHemisphere,
        }
    }
}

/// Views of the light.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum Show {
    /// Light that comes straight from where it is emitted
    Emission,
    /// That, and light scattered once
    Direct,
    /// Light scattered at least twice
    Indirect,
    /// All light
    Global,
}

impl Show {
    /// Least and greatest number of interactions.
    pub(crate) fn bounces(self) -> (u32, u32) {
        match self {
            Self::Emission => (0, 0),
            Self::Direct => (0, 1),
            Self::Indirect => (2, u32::MAX),
            Self::Global => (0, u32::MAX),
        }
    }
}

/// Builders of the hierarchy.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Bvh {
    /// Surface area heuristic
    Sah,
    /// Split at the mean centroid along the longest axis, as in the course
    Mean,
    /// No tree
    None,
}

impl From<Bvh> for Builder {
    fn from(b: Bvh) -> Self {
        match b {
            Bvh::Sah => Self::Sah,
            Bvh::Mean => Self::Mean,
            Bvh::None => Self::None,
        }
    }
}

/// Care with which the hierarchy is built.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Quality {
    /// Soon there
    Fast,
    /// Long thin triangles are cut where there are many
    Balanced,
    /// More ways to part shapes are tried, and triangles are cut finer
    High,
}

impl From<Quality> for pathtracer::Quality {
    fn from(q: Quality) -> Self {
        match q {
            Quality::Fast => Self::Fast,
            Quality::Balanced => Self::Balanced,
            Quality::High => Self::High,
        }
    }
}

/// Bits of a PNG file.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum PngBits {
    /// 256 levels
    #[value(name = "8")]
    Eight,
    /// 65,536 levels
    #[value(name = "16")]
    Sixteen,
}

/// Ways to show progress.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum ProgressKind {
    /// As it suits
    Auto,
    /// A bar
    Bar,
    /// A line every ten seconds
    Lines,
    /// An object of JSON twice a second
    Json,
    /// Nothing
    None,
}

/// What an image says about itself.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum ReceiptKind {
    /// All of it
    Full,
    /// Nothing that differs between two renders of the same image, so that their files are equal
    Stable,
    /// Nothing
    None,
}

/// Sources of random numbers.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Sampler {
    /// Owen-scrambled Sobol' points
    Sobol,
    /// The same, with the error of a pixel made up for by its neighbours
    Zsobol,
    /// One point in each cell of a grid (correlated multi-jittered)
    Stratified,
    /// Independent numbers
    Independent,
}

impl From<Sampler> for SamplerKind {
    fn from(s: Sampler) -> Self {
        match s {
            Sampler::Sobol => Self::Sobol,
            Sampler::Zsobol => Self::ZSobol,
            Sampler::Stratified => Self::Stratified,
            Sampler::Independent => Self::Independent,
        }
    }
}

/// Reconstruction filters.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Filter {
    /// The pixel's square alike
    Box,
    /// A pyramid, 2 pixels wide
    Tent,
    /// A Gaussian of standard deviation 0.5 that ends at 2 pixels
    Gaussian,
    /// The cubic of Mitchell and Netravali with B = C = 1/3
    Mitchell,
    /// The 4-term window, 3 pixels wide
    BlackmanHarris,
    /// The interpolating cubic
    CatmullRom,
    /// A sinc with 3 lobes
    Lanczos,
}

impl From<Filter> for pathtracer::Filter {
    fn from(f: Filter) -> Self {
        match f {
            Filter::Box => Self::Box,
            Filter::Tent => Self::TENT,
            Filter::Gaussian => Self::GAUSSIAN,
            Filter::Mitchell => Self::MITCHELL,
            Filter::BlackmanHarris => Self::BLACKMAN_HARRIS,
            Filter::CatmullRom => Self::CATMULL_ROM,
            Filter::Lanczos => Self::LANCZOS,
        }
    }
}

/// What the command line asks for.
pub(crate) enum Action {
    /// To print a text.
    Print(Vec<u8>),
    /// To render.
    Render(Box<RenderJob>),
    /// To do something with samples.
    Command(Command),
}

/// Why a command line is refused.
pub(crate) enum ArgsError {
    /// By the parser; also help and version, which are no errors.
    Clap(clap::Error),
    /// By us.
    Message(String),
}

impl ArgsError {
    /// Prints it, and tells the exit status.
    pub(crate) fn report(&self) -> ExitCode {
        match self {
            Self::Clap(error) if !error.use_stderr() => {
                return match error.print() {
                    Err(e) if e.kind() != ErrorKind::BrokenPipe => {
                        report!("pathtracer: cannot print: {e}");
                        ExitCode::from(crate::FAILURE)
                    }
                    _ => ExitCode::SUCCESS,
                };
            }
            Self::Clap(error) => report!("pathtracer: {}", message::of_parser(error)),
            Self::Message(message) => report!("pathtracer: {message}"),
        }
        report!("For all options, try 'pathtracer --help'.");
        ExitCode::from(crate::FAILURE)
    }
}

/// Reads the command line.
///
/// # Errors
/// If it cannot be understood; also if it asks for help.
pub(crate) fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Action, ArgsError> {
    let mut args: Vec<_> = args.into_iter().collect();
    match args.get(1).and_then(|first| first.to_str()) {
        Some("render") => drop(args.remove(1)),
        Some(name) if Command::is_one(name) => {
            let command = Command::try_parse_from(args).map_err(ArgsError::Clap)?;
            return Ok(Action::Command(command));
        }
        _ => {}
    }
    let command = args.iter().skip(1).map(|arg| arg.to_string_lossy().into_owned()).collect();
    let matches = Cli::command().try_get_matches_from(args).map_err(ArgsError::Clap)?;
    let cli = Cli::from_arg_matches(&matches).map_err(ArgsError::Clap)?;
    if let Some(shell) = cli.completions {
        return Ok(Action::Print(completions(shell)));
    }
    if cli.man {
        return man_page().map(Action::Print).map_err(ArgsError::Message);
    }
    checked(cli, command).map(|c| Action::Render(Box::new(c))).map_err(ArgsError::Message)
}

/// What the options of a render mean; `command` is the arguments.
///
/// # Errors
/// A message if they make no sense.
pub(crate) fn checked(mut cli: Cli, command: Vec<String>) -> Result<RenderJob, String> {
    sort::paths(&mut cli)?;
    sort::cameras(&mut cli)?;
    resolve::check(cli, command)
}

fn completions(shell: clap_complete::Shell) -> Vec<u8> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "pathtracer", &mut text);
    text
}

fn man_page() -> Result<Vec<u8>, String> {
    let mut text = Vec::new();
    let written = clap_mangen::Man::new(Cli::command()).render(&mut text);
    written.map(|()| text).map_err(|e| format!("the man page cannot be made: {e}"))
}
