//! Our images of the course's scenes, compared with those of its program.
//!
//! Blocks of 16 × 16 pixels must agree to 3 % and noise, and the whole image to 1 %. Both images
//! are compared after the same transfer: values above white are clipped and quantised to 8 bits.
//!
//! The noise of a block is estimated from eight renders with different seeds, by Tukey's jackknife,
//! which accounts for the clipping at white: pixels are computed from seven of the eight renders in
//! eight ways, and the variance of a pixel is 7/8 of the sum of the squared deviations of these
//! from their mean. That of the mean of a block is the sum over its pixels. The other image has
//! independent samples like ours, so it has the same variance per sample.
//!
//! Noise makes pixels near white darker, the more the fewer samples they have; so blocks that do
//! not agree at first are rendered with as many samples as the other image.

use std::path::Path;

use pathtracer::compat::cs184;
use pathtracer::image::{self, Image, Transfer};
use pathtracer::{CompileOptions, DirectLight, Film, Region, Session, Settings, Silent};
use pt_math::color;
use pt_testing::{Block, BlockReport, compare_blocks};

use crate::course::course;

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared");
const BLOCK: u32 = 16;
const TOLERANCE: f64 = 0.03;
/// Tolerance of the whole image.
const WHOLE_TOLERANCE: f64 = 0.01;
const STANDARD_ERRORS: f64 = 4.0;
/// A thousandth of white: in dark blocks, light comes from rare samples, of which one image may
/// have one and the other none, which then underestimates its variance.
const UNSEEN: f64 = 1e-3 * std::f64::consts::FRAC_1_SQRT_2;
const RENDERS: u32 = 8;

struct Picture {
    file: &'static str,
    scene: &'static str,
    /// Samples per pixel of the course's image.
    its_spp: u32,
    /// Samples per pixel of our image, a multiple of [`RENDERS`].
    our_spp: u32,
    settings: Settings,
}

/// Renders of a region with different seeds.
struct Renders {
    region: Region,
    films: Vec<Film>,
}

/// Radiance after encoding with the 8 bits of the course's file, and decoding.
fn through_file(l: f32) -> f32 {
    color::decode_gamma8(color::encode_gamma8(l))
}

impl Renders {
    fn new(session: &Session, picture: &Picture, region: Region, spp: u32) -> Self {
        let film = |n: u32| {
            // The second render of a block has other seeds than the first.
            let seed = if region == session.film().region() { n } else { n + RENDERS };
            let settings = Settings { spp: spp / RENDERS, seed, ..picture.settings.clone() };
            let renderer = pt_cpu::Renderer::new(session.scene(), &settings, 0, BLOCK, false);
            let mut film = Film::new(region);
            renderer.expect("the settings make sense").render(&mut film, &Silent);
            assert_eq!(film.invalid_samples().count(), 0, "{}", picture.file);
            film
        };
        Self { region, films: (0..RENDERS).map(film).collect() }
    }

    /// Pixels after the encoding of the file, and the variance of each.
    fn pixels(&self) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let n = f64::from(RENDERS);
        let width = self.region.width as usize;
        let at =
            |i: usize| [self.region.x + (i % width) as u32, self.region.y + (i / width) as u32];
        let pixel = |i: usize| {
            let [x, y] = at(i);
            let parts: Vec<_> = self.films.iter().map(|f| f.pixel(x, y).mean()).collect();
            let sum = [0, 1, 2].map(|c| parts.iter().map(|p| p[c]).sum::<f64>());
            let without =
                |p: &[f64; 3], c: usize| through_file(((sum[c] - p[c]) / (n - 1.0)) as f32);
            let variance = |c: usize| {
                let values: Vec<f64> = parts.iter().map(|p| f64::from(without(p, c))).collect();
                let mean = values.iter().sum::<f64>() / n;
                values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() * (n - 1.0) / n
            };
            let value = sum.map(|s| through_file((s / n) as f32));
            (value, [0, 1, 2].map(|c| variance(c) as f32))
        };
        (0..self.region.area()).map(pixel).unzip()
    }

    /// Compares the renders with the course's image, which has `noise` times the variance.
    fn compare(&self, theirs: &Image, noise: f32) -> BlockReport {
        let (ours, variance) = self.pixels();
        let r = self.region;
        let rows = (r.y..r.y + r.height).flat_map(|y| {
            let start = (y * theirs.width + r.x) as usize;
            theirs.pixels[start..start + r.width as usize].iter().copied()
        });
        let theirs: Vec<_> = rows.collect();
        let their_variance: Vec<_> = variance.iter().map(|v| v.map(|v| v * noise)).collect();
        compare_blocks(&ours, &theirs, &variance, &their_variance, r.width, r.height, BLOCK)
    }
}

/// Returns true if a block differs by no more than the given fraction of its brightness,
/// [`UNSEEN`], and noise.
fn agrees(block: &Block, share: f64) -> bool {
    let level = block.a.iter().chain(&block.b).sum::<f64>() / 6.0;
    let noise = if block.relative == 0.0 { 0.0 } else { block.relative / block.standard_errors };
    block.relative * level <= share * level + UNSEEN + STANDARD_ERRORS * noise * level
}

/// Pixels of a block, whose corner is relative to that of the whole image.
fn region([x, y]: [u32; 2], theirs: &Image) -> Region {
    let (width, height) = (BLOCK.min(theirs.width - x), BLOCK.min(theirs.height - y));
    Region { x, y, width, height }
}

fn check(picture: &Picture) {
    let scene_path = format!("{SHARED}/scenes/dae/{}", picture.scene);
    let path = format!("{SHARED}/reference/cs184/{}", picture.file);
    let scene = pathtracer::load(Path::new(&scene_path)).expect("the scene can be read");
    let theirs = image::load_as(Path::new(&path), Transfer::Gamma).expect("it can be read");
    let resolution = [theirs.width, theirs.height];
    let options = CompileOptions {
        resolution: Some(resolution),
        policies: cs184::POLICIES,
        ..CompileOptions::default()
    };
    let session = Session::new(&scene, options, picture.settings.clone()).expect("it compiles");
    let full = Region::full(resolution);
    let first = Renders::new(&session, picture, full, picture.our_spp);
    let noise = picture.our_spp as f32 / picture.its_spp as f32;
    let report = first.compare(&theirs, noise);
    let doubtful: Vec<_> = report.blocks.iter().filter(|b| !agrees(b, TOLERANCE)).collect();
    println!("{}: {report}; {} blocks are rendered again", picture.file, doubtful.len());
    assert!(agrees(&report.whole, WHOLE_TOLERANCE), "{}: {report}", picture.file);
    assert!(doubtful.len() < report.blocks.len() / 20, "{}: {report}", picture.file);
    for block in doubtful {
        let region = region(block.corner, &theirs);
        let spp = picture.its_spp.max(picture.our_spp);
        let again = Renders::new(&session, picture, region, spp);
        let again = again.compare(&theirs, spp as f32 / picture.its_spp as f32).whole;
        let what = format!("{} at {:?}: {again:?}", picture.file, block.corner);
        assert!(agrees(&again, TOLERANCE), "{what}");
    }
}

fn settings(max_depth: u32) -> Settings {
    Settings { max_depth, ..course(0) }
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn diffuse_spheres() {
    check(&Picture {
        file: "spheres_lambertian_m5.png",
        scene: "sky/CBspheres_lambertian.dae",
        its_spp: 256,
        our_spp: 32,
        settings: settings(5),
    });
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn glass_and_mirror_spheres() {
    check(&Picture {
        file: "spheres_glass_m5.png",
        scene: "sky/CBspheres.dae",
        its_spp: 256,
        our_spp: 64,
        settings: settings(5),
    });
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn bunny_in_direct_light() {
    check(&Picture {
        file: "bunny_m1.png",
        scene: "sky/CBbunny.dae",
        its_spp: 256,
        our_spp: 32,
        settings: settings(1),
    });
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn bunny_in_indirect_light() {
    check(&Picture {
        file: "bunny_m5.png",
        scene: "sky/CBbunny.dae",
        its_spp: 128,
        our_spp: 32,
        settings: settings(5),
    });
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn diffuse_spheres_by_hemisphere_sampling() {
    let direct = DirectLight::UniformHemisphere;
    check(&Picture {
        file: "spheres_lambertian_H_m1.png",
        scene: "sky/CBspheres_lambertian.dae",
        its_spp: 256,
        our_spp: 32,
        settings: Settings { direct, light_samples: 4, ..settings(1) },
    });
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn normals_as_colours() {
    for (file, scene) in [
        ("cow_normals.png", "meshedit/cow.dae"),
        ("maxplanck_normals.png", "meshedit/maxplanck.dae"),
    ] {
        let integrator = "normals".into();
        let settings = Settings { integrator, ..settings(0) };
        check(&Picture { file, scene, its_spp: 4, our_spp: 32, settings });
    }
}
