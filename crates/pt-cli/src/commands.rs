//! What can be done with images that were rendered, and their samples: go on, add up, look, make again.

use std::path::PathBuf;

use clap::Parser;

use crate::check;

/// What the help of the program says about them.
pub(crate) const HELP: &str = "\
Commands:
  pathtracer resume out.exr [-s N]           go on with a stopped render, or take more samples
  pathtracer merge a.film b.film -f out.exr  the image of all samples together
  pathtracer info out.exr                    how an image or a film was made
  pathtracer rerender out.exr                makes it again, and compares
Each has --help. A scene that is called like one of them is ./resume.";

/// A command on films.
#[derive(Parser, Debug, Clone)]
#[command(name = "pathtracer", version, max_term_width = 100)]
pub(crate) enum Command {
    /// Goes on with a render from the samples that it has kept
    ///
    /// The image will be the one that it would have been without a stop, to the bit. A scene or a
    /// program that has changed since is refused.
    Resume(Resume),
    /// Adds up the samples of several films, and writes their image
    ///
    /// The image is the one of a single render of all samples, to the bit. What is there twice, what
    /// is missing in between, and what belongs to another image is refused.
    Merge(Merge),
    /// Tells how an image or a film was made
    Info(Info),
    /// Makes an image again by what it says about itself, and compares
    ///
    /// Status 0 says that the second one, IMAGE_again, is the same to the bit. A scene or a program that
    /// has changed since is refused.
    Rerender(Rerender),
}

/// `pathtracer resume`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Resume {
    /// The image, or its film (IMAGE.film)
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Samples per pixel that the image will have [default: as many as were asked for]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = check::positive)]
    pub(crate) spp: Option<u32>,

    /// Threads; 0 is one per core [default: as before]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = check::threads)]
    pub(crate) threads: Option<usize>,

    /// Seconds after which the samples so far are written; 0 is never [default: as before]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = check::seconds)]
    pub(crate) checkpoint_every: Option<f64>,

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

    /// What is written: an image, .png or .exr, or again a film, .film
    #[arg(short = 'f', long, value_name = "FILE")]
    pub(crate) output: PathBuf,

    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// `pathtracer info`.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Info {
    /// An image, .png or .exr, or a film
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Print the receipt as JSON
    #[arg(long)]
    pub(crate) json: bool,
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

    /// Threads; 0 is one per core [default: as before]
    #[arg(short, long, value_name = "N", allow_negative_numbers = true, value_parser = check::threads)]
    pub(crate) threads: Option<usize>,

    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

impl Command {
    /// Whether there is a command of this name.
    pub(crate) fn is_one(name: &str) -> bool {
        ["resume", "merge", "info", "rerender"].contains(&name)
    }
}
