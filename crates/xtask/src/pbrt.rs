//! `cargo xtask pbrt`: comparison of pbrt-v4 scenes with reference images by pbrt-v4.
//!
//! Our image is the mean of several images with independent samples and seeds, so that the variance
//! of its pixels is known. The variance of pbrt's image is assumed to be the same: it has as many
//! samples per pixel, of the same kind of paths (docs/formats.md states the differences).

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use pt_image::SaveOptions;
use pt_math::Spectrum;
use pt_scene::image::Image;
use pt_testing::{BlockReport, compare_blocks};

use crate::project::{build_program, output_folder, shared};

/// Scenes of `shared/scenes/pbrt`, and the samples per pixel of their images.
const SCENES: [(&str, u32); 2] = [("spheres", 1024), ("cornell-knot", 256)];
/// Number of images of a scene among which the samples are divided.
const IMAGES: u32 = 8;
/// Width of blocks in pixels.
const BLOCK: u32 = 16;
/// Maximum relative difference of the means over the image.
const MAX_MEAN: f64 = 0.02;
/// Maximum relative difference at which a block agrees regardless of noise.
const MAX_BLOCK: f64 = 0.05;
/// Maximum difference that noise explains, in standard errors of the difference.
const STANDARD_ERRORS: f64 = 3.0;
/// Minimum fraction of blocks that agree, by luminance.
const MIN_BLOCKS: f64 = 0.97;

/// Options of the comparison.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only the scene of this name
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
}

/// Renders all scenes and compares.
///
/// # Errors
/// If an image differs by more than is allowed, or cannot be rendered or read.
pub(crate) fn run(args: &Args) -> Result<()> {
    let wanted = |name: &str| args.scene.as_deref().is_none_or(|only| only == name);
    let scenes: Vec<_> = SCENES.into_iter().filter(|(name, _)| wanted(name)).collect();
    if scenes.is_empty() {
        bail!("there is no such scene; there are {}", SCENES.map(|(name, _)| name).join(", "));
    }
    let Some(folder) = shared().map(|s| s.join("scenes/pbrt")).filter(|f| f.is_dir()) else {
        println!("skipped: there is no folder ../shared/scenes/pbrt");
        return Ok(());
    };
    let program = build_program()?;
    println!(
        "pbrt-v4 against pathtracer: samples of each, the difference of means, and blocks of {BLOCK} x {BLOCK}"
    );
    println!(
        "pixels that differ by at most {} %, and with those within {STANDARD_ERRORS} standard errors",
        100.0 * MAX_BLOCK
    );
    println!(
        "{:<14}{:>6}  {:<10}{:>9}{:>14}{:>14}",
        "scene", "spp", "", "mean, %", "blocks, %", "or noise, %"
    );
    let mut failed = Vec::new();
    for (name, spp) in scenes {
        let theirs = pt_image::load_raw(&folder.join(name).with_extension("exr"))?;
        let ours = RenderedImage::new(&program, &folder.join(name).with_extension("pbrt"), spp)?;
        let comparison = Comparison::new(&theirs, &ours)?;
        comparison.print(name, spp);
        if !comparison.is_good() {
            failed.push(name);
        }
    }
    ensure!(
        failed.is_empty(),
        "FAILED: {}; images are in {}",
        failed.join(", "),
        output_folder("pbrt")?.display()
    );
    Ok(())
}

/// Image of a scene, and the variance of its pixels.
struct RenderedImage {
    image: Image,
    variance: Vec<[f32; 3]>,
    /// Variance of luminance.
    variance_of_luminance: Vec<f32>,
}

impl RenderedImage {
    /// Renders a scene with `spp` samples of each pixel, and saves its image.
    fn new(program: &Path, scene: &Path, spp: u32) -> Result<Self> {
        let name = scene.file_stem().context("a scene without a name")?.to_string_lossy();
        let path = output_folder("pbrt")?.join(format!("{name}.exr"));
        let render = |seed| render(program, scene, spp / IMAGES, seed, &path);
        let images = (0..IMAGES).map(render).collect::<Result<Vec<_>>>()?;
        let rendered = Self::of(&images);
        pt_image::save(&rendered.image, &path, &SaveOptions::default())?;
        Ok(rendered)
    }

    /// Mean of images of the same size.
    fn of(images: &[Image]) -> Self {
        let Image { width, height, .. } = images[0];
        let pixels = 0..images[0].pixels.len();
        let channel = |c: usize| -> Vec<[f64; 2]> {
            pixels.clone().map(|i| estimate(images.iter().map(|m| m.pixels[i][c].into()))).collect()
        };
        let channels = [0, 1, 2].map(channel);
        let rgb = |k: usize| -> Vec<[f32; 3]> {
            pixels.clone().map(|i| [0, 1, 2].map(|c| channels[c][i][k] as f32)).collect()
        };
        let luminance = |i: usize| estimate(images.iter().map(|m| luminance(m.pixels[i]).into()));
        Self {
            image: Image { width, height, pixels: rgb(0).into() },
            variance: rgb(1),
            variance_of_luminance: pixels.clone().map(|i| luminance(i)[1] as f32).collect(),
        }
    }
}

/// Renders once, to a file at `path`.
fn render(program: &Path, scene: &Path, spp: u32, seed: u32, path: &PathBuf) -> Result<Image> {
    let mut command = Command::new(program);
    command.args([
        "-q",
        "--sampler",
        "independent",
        "--checkpoint-every",
        "0",
        "--metadata",
        "none",
    ]);
    command.args(["-s", &spp.to_string(), "--seed", &seed.to_string()]);
    let status = command.arg("-f").arg(path).arg(scene).status()?;
    ensure!(status.success(), "{}: the render fails", scene.display());
    Ok(pt_image::load_raw(path)?)
}

/// Mean of numbers, and the variance of the mean.
fn estimate(numbers: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let n = numbers.clone().count() as f64;
    let mean = numbers.clone().sum::<f64>() / n;
    let squares = numbers.map(|x| (x - mean).powi(2)).sum::<f64>();
    [mean, squares / (n * (n - 1.0))]
}

fn luminance(rgb: [f32; 3]) -> f32 {
    Spectrum::from(rgb).luminance()
}

/// Differences of two images, by red, green, blue and luminance separately.
struct Comparison([BlockReport; 4]);

impl Comparison {
    const NAMES: [&str; 4] = ["red", "green", "blue", "luminance"];

    /// Compares an image with ours.
    ///
    /// # Errors
    /// If the images differ in size.
    fn new(theirs: &Image, ours: &RenderedImage) -> Result<Self> {
        let Image { width, height, .. } = ours.image;
        let sizes = [[theirs.width, theirs.height], [width, height]];
        ensure!(
            sizes[0] == sizes[1],
            "the images have the sizes {:?} and {:?}",
            sizes[0],
            sizes[1]
        );
        let gray =
            |values: &mut dyn Iterator<Item = f32>| values.map(|x| [x; 3]).collect::<Vec<_>>();
        let compare = |value: &dyn Fn([f32; 3]) -> f32, variance: &mut dyn Iterator<Item = f32>| {
            let [theirs, ours] = [&theirs.pixels, &ours.image.pixels]
                .map(|pixels| gray(&mut pixels.iter().map(|p| value(*p))));
            let variance = gray(variance);
            compare_blocks(&theirs, &ours, &variance, &variance, width, height, BLOCK)
        };
        let channel =
            |c: usize| compare(&move |p| p[c], &mut ours.variance.iter().map(move |v| v[c]));
        let luminance = compare(&luminance, &mut ours.variance_of_luminance.iter().copied());
        Ok(Self([channel(0), channel(1), channel(2), luminance]))
    }

    /// Returns true if all means agree, and the luminance of enough blocks.
    fn is_good(&self) -> bool {
        let Self(reports) = self;
        reports.iter().all(|r| difference_of_means(r).abs() <= MAX_MEAN)
            && share_within(&reports[3], STANDARD_ERRORS) >= MIN_BLOCKS
    }

    fn print(&self, scene: &str, spp: u32) {
        for (report, name) in self.0.iter().zip(Self::NAMES) {
            let [near, noise] =
                [0.0, STANDARD_ERRORS].map(|errors| 100.0 * share_within(report, errors));
            let mean = 100.0 * difference_of_means(report);
            println!("{scene:<14}{spp:>6}  {name:<10}{mean:>9.2}{near:>14.1}{noise:>14.1}");
        }
        if !self.is_good() {
            println!("{scene}: FAILED");
        }
    }
}

/// Relative difference of our mean from theirs.
fn difference_of_means(report: &BlockReport) -> f64 {
    report.whole.b[0] / report.whole.a[0] - 1.0
}

/// Fraction of blocks that agree to within [`MAX_BLOCK`], or within this number of standard errors.
fn share_within(report: &BlockReport, standard_errors: f64) -> f64 {
    1.0 - report.beyond(MAX_BLOCK, standard_errors).len() as f64 / report.blocks.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(rgb: [f32; 3]) -> Image {
        Image { width: 64, height: 32, pixels: vec![rgb; 64 * 32].into() }
    }

    fn is_good(theirs: &Image, ours: [[f32; 3]; 2]) -> bool {
        Comparison::new(theirs, &RenderedImage::of(&ours.map(plain))).unwrap().is_good()
    }

    #[test]
    fn the_mean_and_its_variance_are_those_of_the_images() {
        let rendered = RenderedImage::of(&[plain([1.0, 2.0, 0.0]), plain([3.0, 2.0, 0.0])]);
        assert_eq!(rendered.image.pixels[7], [2.0, 2.0, 0.0]);
        // (1 + 1) / (2 · 1), and for luminance times the square of the weight of red.
        assert_eq!(rendered.variance[7], [1.0, 0.0, 0.0]);
        let weight = luminance([1.0, 0.0, 0.0]);
        assert!((rendered.variance_of_luminance[7] - weight * weight).abs() < 1e-6);
    }

    #[test]
    fn each_channel_has_a_mean_that_counts() {
        let theirs = plain([1.0, 0.5, 0.1]);
        assert!(is_good(&theirs, [[1.0, 0.5, 0.1]; 2]));
        assert!(is_good(&theirs, [[1.0, 0.5, 0.1015]; 2]));
        assert!(!is_good(&theirs, [[1.0, 0.5, 0.1025]; 2]));
        assert!(!is_good(&theirs, [[0.97, 0.5, 0.1]; 2]));
    }

    #[test]
    fn blocks_that_differ_count_unless_noise_explains_it() {
        // One of eight blocks differs, so little that the mean agrees.
        let mut theirs = plain([1.0; 3]);
        for y in 0..16 {
            theirs.pixels[y * 64..y * 64 + 16].fill([1.1; 3]);
        }
        assert!(!is_good(&theirs, [[1.01; 3]; 2]));
        // The variance of pixels is 0.25; that of the difference of a block's mean is 2 · 0.25 /
        // 256.
        assert!(is_good(&theirs, [[0.51; 3], [1.51; 3]]));
    }
}
