//! The command lines of the commands other than `render`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Parser;

use crate::arg_values::Switch;
use crate::args::Cli;
use crate::crop::CropOption;
use crate::image_options::{ExrOptions, PngOptions};
use crate::loading::{Folders, Loading};
use crate::parse;

/// A command.
#[derive(Parser, Debug, Clone)]
#[command(name = "pathtracer", version, max_term_width = 100)]
pub(crate) enum Command {
    /// Continue a render from its samples
    ///
    /// The image equals that of an uninterrupted render, to the bit. A scene or a program that has
    /// changed since is refused.
    Resume(Resume),
    /// Merge the samples of several films, and write their image
    ///
    /// The image equals that of a single render of all samples, to the bit. Duplicate samples, gaps
    /// between samples, and films of other images are refused.
    Merge(Merge),
    /// Show how an image or a film was made, or the contents of a scene
    Info(Info),
    /// Report all problems of a scene, and which features are approximated
    ///
    /// Each problem has its file and line, or its path in the file. The exit status is 0 without
    /// problems, 1 with notes only, such as those on approximated features, 4 with missing files,
    /// and 2 with errors, for which renders refuse the scene.
    Check(Check),
    /// Render an image again by its metadata, and compare
    ///
    /// The exit status is 0 if the second image, IMAGE_again, is the same, to the bit. A scene or a
    /// program that has changed since is refused.
    Rerender(Rerender),
    /// Show the light paths of a pixel, their contributions, and the causes of its noise
    ///
    /// The samples of the pixel are taken again; they equal, to the bit, those of a render with the
    /// same options. Put explain before the arguments of a render, and the pixel after them; no
    /// file is written.
    #[command(override_usage = "pathtracer explain [OPTIONS] [SCENE] -x X -y Y", after_help = "")]
    Explain(Box<Explain>),
    /// Write a scene in pathtracer's own format, or as glTF
    ///
    /// A scene in pathtracer's own format (.json) renders to the same image, to the bit; meshes,
    /// images and grids are in a folder beside it, NAME_files. A binary glTF file (.glb) is for
    /// other programs: features that glTF lacks are approximated or left out, with notes. Existing
    /// files are overwritten only with --force. A scene with missing files is refused.
    Convert(Convert),
    /// Develop rendered images: exposure, tone curve, alpha, crop and size
    ///
    /// Reads OpenEXR images, also those of other programs, and all other formats of textures. A PNG
    /// image has the pixels that a render with the same options writes, to the bit. An image that
    /// cannot be read does not prevent the others; the exit status is then 2.
    Develop(Develop),
    /// Denoise rendered images with Intel Open Image Denoise
    ///
    /// The layers albedo and normal (--aov albedo,normal of a render) preserve detail, if the image
    /// has them. An EXR image keeps all layers, and the noisy image as the layer "noisy"; an image
    /// with that layer is denoised again from it.
    Denoise(Denoise),
    /// Join images of parts, rendered with --crop, into the whole image
    ///
    /// All channels equal those of a single render, to the bit. Missing pixels, different values of
    /// the same pixel, and parts of other images are refused. The position of a part is in its
    /// metadata; for images of other programs, it is that of the data window.
    Join(Join),
}

/// `pathtracer develop`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Develop {
    /// The images
    #[arg(value_name = "IMAGE", required = true)]
    pub(crate) images: Vec<PathBuf>,

    /// Output: an image, .png or .exr, or a folder, in which each image becomes NAME.png
    /// [default: IMAGE.png, beside it]
    #[arg(short = 'f', long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Print nothing but errors and warnings
    #[arg(short, long)]
    pub(crate) quiet: bool,

    /// Layer to develop, such as albedo or noisy [default: the colours of the image]
    #[arg(long, value_name = "NAME", help_heading = "Image")]
    pub(crate) layer: Option<String>,

    #[command(flatten)]
    pub(crate) crop: CropOption,

    /// Width and height after --crop, in pixels; the filter is a tent over linear light [default:
    /// those of the image]
    #[arg(long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, allow_negative_numbers = true)]
    #[arg(value_parser = parse::pixels, help_heading = "Image")]
    resize: Option<Vec<u32>>,

    #[command(flatten)]
    pub(crate) png: PngOptions,

    #[command(flatten)]
    pub(crate) exr: ExrOptions,

    /// Write alpha: straight in PNG images, premultiplied in EXR images [default: on if the image
    /// has alpha]
    #[arg(long, value_name = "SWITCH", num_args = 0..=1, require_equals = true)]
    #[arg(default_missing_value = "on", help_heading = "Image")]
    pub(crate) alpha: Option<Switch>,
}

impl Develop {
    /// Width and height after the crop.
    pub(crate) fn size(&self) -> Option<[u32; 2]> {
        self.resize.as_deref().and_then(|size| size.try_into().ok())
    }
}

/// `pathtracer denoise`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Denoise {
    /// The images
    #[arg(value_name = "IMAGE", required = true)]
    pub(crate) images: Vec<PathBuf>,

    /// Output: an image, .exr or .png, or a folder, in which each image becomes NAME_denoised.exr
    /// [default: IMAGE_denoised.exr, beside it]
    #[arg(short = 'f', long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Threads; 0 is one per core [default: 0]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = parse::threads)]
    pub(crate) threads: Option<usize>,

    /// Print nothing but errors and warnings
    #[arg(short, long)]
    pub(crate) quiet: bool,

    #[command(flatten)]
    pub(crate) png: PngOptions,
}

/// `pathtracer join`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Join {
    /// The images of the parts, .exr
    #[arg(value_name = "PART", required = true)]
    pub(crate) parts: Vec<PathBuf>,

    /// Output, .exr or .png
    #[arg(short = 'f', long, value_name = "FILE")]
    pub(crate) output: PathBuf,

    /// Leave missing pixels black and transparent
    #[arg(long)]
    pub(crate) allow_gaps: bool,

    /// Print nothing but errors and warnings
    #[arg(short, long)]
    pub(crate) quiet: bool,

    #[command(flatten)]
    pub(crate) png: PngOptions,
}

/// `pathtracer resume`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Resume {
    /// The image, or its film (IMAGE.film)
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Samples per pixel that the image will have [default: the number requested before]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = parse::positive)]
    pub(crate) spp: Option<u32>,

    /// Threads; 0 is one per core [default: as before]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = parse::threads)]
    pub(crate) threads: Option<usize>,

    /// Stop after this time, as in 90s, 10m or 1h30m [default: never]
    #[arg(long, value_name = "TIME", value_parser = parse::time_limit)]
    pub(crate) time_limit: Option<Duration>,

    /// Interval between checkpoints, such as 90s or 10m; 0 is never [default: as before]
    #[arg(long, value_name = "TIME", allow_negative_numbers = true, value_parser = parse::duration)]
    pub(crate) checkpoint_every: Option<Duration>,

    #[command(flatten)]
    pub(crate) folders: Folders,

    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// `pathtracer merge`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Merge {
    /// The films
    #[arg(value_name = "FILM", required = true)]
    pub(crate) films: Vec<PathBuf>,

    /// Output: an image, .png or .exr, or a film, .film
    #[arg(short = 'f', long, value_name = "FILE")]
    pub(crate) output: PathBuf,

    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// `pathtracer info`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Info {
    /// An image, .png or .exr, a film, or a scene
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Print JSON: the provenance of an image, or the contents of a scene
    #[arg(long)]
    pub(crate) json: bool,

    #[command(flatten)]
    pub(crate) loading: Loading,
}

/// `pathtracer check`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Check {
    /// The scene
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,

    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,

    /// Missing files are errors
    #[arg(long)]
    pub(crate) strict: bool,

    #[command(flatten)]
    pub(crate) loading: Loading,
}

/// `pathtracer rerender`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Rerender {
    /// The image, .png or .exr
    #[arg(value_name = "IMAGE")]
    pub(crate) image: PathBuf,

    /// The second image [default: IMAGE_again, beside it]
    #[arg(short = 'f', long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Overwrite an existing second image
    #[arg(long)]
    pub(crate) force: bool,

    #[command(flatten)]
    pub(crate) folders: Folders,

    /// Threads; 0 is one per core [default: as before]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = parse::threads)]
    pub(crate) threads: Option<usize>,

    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// `pathtracer convert`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Convert {
    /// The scene
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,

    /// Output, .json or .glb
    #[arg(value_name = "OUTPUT")]
    pub(crate) output: PathBuf,

    #[command(flatten)]
    pub(crate) loading: Loading,

    /// Overwrite existing files
    #[arg(long)]
    pub(crate) force: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// `pathtracer explain`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Explain {
    #[command(flatten)]
    pub(crate) cli: Cli,
    #[command(flatten)]
    pub(crate) of: OfPixel,
}

/// Pixel or sample to explain, and format of the explanation.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct OfPixel {
    /// Column of the pixel, from the left; the first is 0
    #[arg(short = 'x', value_name = "X", allow_negative_numbers = true, value_parser = parse::count)]
    #[arg(help_heading = "Explain")]
    pub(crate) column: u32,

    /// Row of the pixel, from the top; the first is 0
    #[arg(short = 'y', value_name = "Y", allow_negative_numbers = true, value_parser = parse::count)]
    #[arg(help_heading = "Explain")]
    pub(crate) row: u32,

    /// Explain only the sample with this number, in full; the first is 0
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = parse::count)]
    #[arg(conflicts_with = "top", help_heading = "Explain")]
    pub(crate) sample: Option<u32>,

    /// Number of the brightest paths to show
    #[arg(long, value_name = "N", default_value = "5", allow_negative_numbers = true)]
    #[arg(value_parser = parse::count, help_heading = "Explain")]
    pub(crate) top: u32,

    /// Print JSON, with all details
    #[arg(long, help_heading = "Explain")]
    pub(crate) json: bool,
}

impl Command {
    /// Returns true if there is a command of this name.
    pub(crate) fn is_one(name: &str) -> bool {
        [
            "resume", "merge", "info", "check", "rerender", "explain", "convert", "develop",
            "denoise", "join",
        ]
        .contains(&name)
    }
}
