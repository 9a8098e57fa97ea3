//! Placeholders of missing files: squares in magenta and black, which are not mistaken for a
//! texture of the scene.

use std::sync::Arc;

use pt_math::{DMat3, DVec3};
use pt_scene::Surface;
use pt_scene::image::Image;
use pt_scene::material::Diffuse;
use pt_scene::measured::Measurements;
use pt_scene::texture::{Input, Pattern, Texture};

const MAGENTA: [f32; 3] = [1.0, 0.0, 1.0];
const BLACK: [f32; 3] = [0.0; 3];
/// Number of squares along a side of the unit square of texture coordinates.
const SQUARES: f64 = 8.0;

/// Returns the placeholder of a texture whose image is missing.
pub(crate) fn texture() -> Arc<Texture> {
    let to_pattern = DMat3::from_diagonal(DVec3::new(0.5 * SQUARES, 0.5 * SQUARES, 1.0));
    Arc::new(Texture::on_surface(Pattern::Checkerboard([MAGENTA, BLACK]), to_pattern))
}

/// Description of the placeholder in messages.
pub(crate) const INSTEAD: &str = "a magenta and black checkerboard is shown instead";

/// Returns the placeholder of a surface with such a texture, whatever the texture controls.
pub(crate) fn surface() -> Surface {
    Diffuse { reflectance: Input::Texture(texture()), two_sided: true }.into()
}

/// Returns the placeholder of the missing image of a projector or an environment map.
pub(crate) fn light() -> Image {
    let side = 16;
    let color = |i: u32| if (i % side + i / side).is_multiple_of(2) { MAGENTA } else { BLACK };
    Image { width: side, height: side, pixels: (0..side * side).map(color).collect() }
}

/// Returns the placeholder of missing measurements: magenta for all directions, as bright as
/// possible.
pub(crate) fn measurements() -> Measurements {
    const SHARE: f32 = 0.5 * std::f32::consts::FRAC_1_PI;
    Measurements::even(MAGENTA.map(|channel| channel * SHARE))
}
