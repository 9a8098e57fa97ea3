//! Images without noise, by Intel Open Image Denoise.

use pt_core::film::{Aov, Film, aov};
use pt_scene::image::Image;

pub use pt_denoise::{DenoiseError, Denoiser, Planes, VARIABLE};

/// What a film has to keep, so that its image can be denoised.
pub const NEEDED: [Aov; 2] = [Aov::Albedo, Aov::Normal];

/// The image of a film without its noise. The library sees albedo and normals as it sees light, as
/// means over all samples of a pixel, in which those that see nothing are 0.
///
/// # Errors
/// If the library fails.
///
/// # Panics
/// If the film does not keep what is [`NEEDED`].
pub fn denoised(denoiser: &Denoiser, film: &Film) -> Result<Image, DenoiseError> {
    let planes = NEEDED.map(|aov| {
        let means = aov::means_of_all_samples(film, aov);
        means.expect("a film that keeps what is needed")
    });
    let [albedo, normal] = planes;
    let color = pt_core::develop::radiance(film);
    let (width, height) = (film.region().width, film.region().height);
    let planes = Planes { width, color: &color, albedo: &albedo, normal: &normal };
    Ok(Image { width, height, pixels: denoiser.denoise(planes)? })
}
