//! Denoising of films by Intel Open Image Denoise.

use pt_core::film::{Aov, Film, aov};
pub use pt_denoise::{DenoiseError, Denoiser, DenoiserInput, VARIABLE};
use pt_image::ImageFile;
use pt_scene::image::Image;

/// AOVs that a film must contain to be denoised.
pub const NEEDED: [Aov; 2] = [Aov::Albedo, Aov::Normal];

/// Returns the denoised image of a film. Albedo and normals are passed to the library as means over
/// all samples of a pixel, like radiance; samples without a hit count as 0.
///
/// # Errors
/// If the library fails.
///
/// # Panics
/// If the film does not contain the AOVs [`NEEDED`].
pub fn denoised(denoiser: &Denoiser, film: &Film) -> Result<Image, DenoiseError> {
    let planes = NEEDED.map(|aov| {
        let means = aov::means_of_all_samples(film, aov);
        means.expect("a film that keeps what is needed")
    });
    let [albedo, normal] = planes;
    let color = pt_core::develop::radiance(film);
    let (width, height) = (film.region().width, film.region().height);
    let planes =
        DenoiserInput { width, color: &color, albedo: Some(&albedo), normal: Some(&normal) };
    Ok(Image { width, height, pixels: denoiser.denoise(planes)?.into() })
}

/// Returns the denoised image of a file. The network receives its layers `albedo` and `normal`, if
/// they are there: means over the samples of a pixel that hit a surface. The image equals that of
/// [`denoised`] where all samples of all pixels hit one.
///
/// # Errors
/// If the library fails.
pub fn denoised_file(denoiser: &Denoiser, file: &ImageFile) -> Result<Image, DenoiseError> {
    let albedo = file.plane(Aov::Albedo.name(), ["R", "G", "B"]);
    let normal = file.plane(Aov::Normal.name(), ["X", "Y", "Z"]);
    let Image { width, height, ref pixels } = file.image;
    let planes = DenoiserInput {
        width,
        color: pixels,
        albedo: albedo.as_deref(),
        normal: normal.as_deref(),
    };
    Ok(Image { width, height, pixels: denoiser.denoise(planes)?.into() })
}
