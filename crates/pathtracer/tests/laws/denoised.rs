//! Denoised images, if Open Image Denoise is found.

use std::path::Path;

use pathtracer::denoise::{DenoiseError, Denoiser, NEEDED, denoised};
use pathtracer::{Film, Region, Scene, Settings};
use pt_scene::material::Surface;

use crate::measure::render;
use crate::scenes::{matte, size};

/// Two matte spheres in a box.
const OF_THE_COURSE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/dae/sky/CBspheres_lambertian.dae");

/// The embedded Cornell box with two matte spheres.
fn spheres() -> Scene {
    let mut scene = pathtracer::default_scene();
    for material in &mut scene.materials {
        if matches!(material.surface, Surface::Mirror(_) | Surface::Glass(_)) {
            material.surface = matte([0.6; 3]);
        }
    }
    scene
}

/// Film of a region of a scene with 16 samples per pixel, and its image with so many that little
/// noise is left.
fn films(scene: &Scene, resolution: [u32; 2], region: Region) -> (Film, Vec<[f32; 3]>) {
    let film = |spp, seed| {
        let aovs = NEEDED.to_vec();
        let settings = Settings { spp, seed, aovs, region: Some(region), ..Settings::default() };
        render(scene, size(resolution), settings).film().clone()
    };
    (film(16, 0), pathtracer::radiance(&film(512, 1)))
}

/// Mean of (x − r)² / (r² + 0.01) over pixels and channels. [Rousselle, Knaus & Zwicker 2011]
fn relative_mse(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let pairs = image.as_flattened().iter().zip(reference.as_flattened());
    let errors = pairs.map(|(x, r)| f64::from((x - r).powi(2) / (r * r + 0.01)));
    errors.sum::<f64>() / (3 * image.len()) as f64
}

fn takes_to_a_fifth(denoiser: &Denoiser, (noisy, reference): &(Film, Vec<[f32; 3]>)) {
    let before = relative_mse(&pathtracer::radiance(noisy), reference);
    let after = relative_mse(&denoised(denoiser, noisy).unwrap().pixels, reference);
    println!("relMSE {before:.5} becomes {after:.5}, {:.1} times less", before / after);
    assert!(after < before / 5.0, "{before} becomes {after}");
}

/// The denoiser; if it is not found, prints that a test is skipped.
fn denoiser() -> Option<Denoiser> {
    match Denoiser::open(0) {
        Ok(denoiser) => Some(denoiser),
        Err(DenoiseError::Missing { .. }) => {
            println!("skipped: Open Image Denoise is not found");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// The part of our box below its lamp: along the edges of the lamp, the noise of 16 samples is that
/// of its coverage, which a denoiser does not take for noise, and which is far brighter than the
/// rest.
#[test]
fn denoising_16_samples_of_cornell_boxes_takes_relative_mse_to_a_fifth() {
    let Some(denoiser) = denoiser() else { return };
    let below_the_lamp = Region { x: 0, y: 32, width: 128, height: 96 };
    takes_to_a_fifth(&denoiser, &films(&spheres(), [128, 128], below_the_lamp));
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn denoising_takes_the_error_of_a_scene_of_the_course_to_a_fifth() {
    let Some(denoiser) = denoiser() else { return };
    let scene = pathtracer::load(Path::new(OF_THE_COURSE)).expect("it can be read");
    takes_to_a_fifth(&denoiser, &films(&scene, [160, 120], Region::full([160, 120])));
}
