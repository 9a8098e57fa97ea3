//! Laws of denoising, if the library is installed.

use super::*;

/// Opens the library, or prints a line that it is not installed.
fn denoiser(threads: usize) -> Option<Denoiser> {
    match Denoiser::open(threads) {
        Ok(denoiser) => Some(denoiser),
        Err(DenoiseError::Missing { .. }) => {
            println!("skipped: Open Image Denoise is not found");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

const SIZE: usize = 96;

/// Pseudorandom number in [0, 1). [Knuth, "The Art of Computer Programming" 2, 3.3.4, line 26]
fn random(i: usize) -> f32 {
    let mut state = i as u64;
    for _ in 0..3 {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state ^= state >> 29;
    }
    (state >> 40) as f32 / (1 << 24) as f32
}

/// Image of two walls with different brightness and colour.
fn clean(i: usize) -> [f32; 3] {
    if i % SIZE < SIZE / 2 { [0.2, 0.3, 0.4] } else { [0.9, 0.6, 0.3] }
}

fn noisy() -> Vec<[f32; 3]> {
    let pixel = |i| clean(i).map(|v| 2.0 * v * random(i));
    (0..SIZE * SIZE).map(pixel).collect()
}

fn planes<'a>(
    color: &'a [[f32; 3]],
    albedo: &'a [[f32; 3]],
    normal: &'a [[f32; 3]],
) -> DenoiserInput<'a> {
    DenoiserInput { width: SIZE as u32, color, albedo: Some(albedo), normal: Some(normal) }
}

fn squared_error(image: &[[f32; 3]]) -> f64 {
    let pixels = image.iter().enumerate();
    let errors =
        pixels.flat_map(|(i, p)| (0..3).map(move |c| f64::from(p[c] - clean(i)[c]).powi(2)));
    errors.sum::<f64>() / (3 * image.len()) as f64
}

#[test]
fn noise_goes_and_edges_stay() {
    let Some(denoiser) = denoiser(2) else { return };
    assert!(denoiser.version().starts_with("2."), "{}", denoiser.version());
    let (color, normal) = (noisy(), vec![[0.0, 0.0, 1.0]; SIZE * SIZE]);
    let albedo: Vec<_> = (0..SIZE * SIZE).map(clean).collect();
    let denoised = denoiser.denoise(planes(&color, &albedo, &normal)).unwrap();
    let (before, after) = (squared_error(&color), squared_error(&denoised));
    assert!(after < 0.02 * before, "{before} becomes {after}");
}

/// Without albedo, normals have no effect.
#[test]
fn noise_goes_without_albedo_and_normals() {
    let Some(denoiser) = denoiser(2) else { return };
    let (color, normal) = (noisy(), vec![[0.0, 0.0, 1.0]; SIZE * SIZE]);
    let input = DenoiserInput { width: SIZE as u32, color: &color, albedo: None, normal: None };
    let denoised = denoiser.denoise(input).unwrap();
    let (before, after) = (squared_error(&color), squared_error(&denoised));
    assert!(after < 0.1 * before, "{before} becomes {after}");
    let with_normal = DenoiserInput { normal: Some(&normal), ..input };
    assert!(denoiser.denoise(with_normal).unwrap() == denoised);
}

/// Guaranteed on one machine only; other processors may use other instructions.
#[test]
fn the_same_image_has_the_same_bits_with_any_number_of_threads() {
    let (color, flat) = (noisy(), vec![[0.5; 3]; SIZE * SIZE]);
    let of = |threads| {
        let denoised = denoiser(threads)?.denoise(planes(&color, &flat, &flat)).unwrap();
        Some(denoised.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>())
    };
    let Some(once) = of(1) else { return };
    for threads in [1, 2, 3] {
        assert!(of(threads).as_ref() == Some(&once), "{threads} threads");
    }
}

#[test]
fn planes_of_other_sizes_are_refused() {
    let Some(denoiser) = denoiser(1) else { return };
    let (color, short) = (noisy(), vec![[0.5; 3]; 7]);
    let error = denoiser.denoise(planes(&color, &short, &color)).unwrap_err();
    assert_eq!(error.to_string(), "albedo has 7 pixels, and the image 9216");
    let odd = DenoiserInput { width: 97, ..planes(&color, &color, &color) };
    assert!(denoiser.denoise(odd).is_err());
}
