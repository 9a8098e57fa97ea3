//! What stands in for files that are missing: squares in magenta and black, which nobody takes for
//! a picture of the scene.

use std::sync::Arc;

use pt_math::{DMat3, DVec3};

use crate::Surface;
use crate::image::Image;
use crate::material::Diffuse;
use crate::measured::Measurements;
use crate::texture::{Input, Pattern, Texture};

const MAGENTA: [f32; 3] = [1.0, 0.0, 1.0];
const BLACK: [f32; 3] = [0.0; 3];
/// Squares along the side of the unit square of texture coordinates.
const SQUARES: f64 = 8.0;

/// The texture in place of one whose image is missing.
pub(super) fn texture() -> Arc<Texture> {
    let to_pattern = DMat3::from_diagonal(DVec3::new(0.5 * SQUARES, 0.5 * SQUARES, 1.0));
    Arc::new(Texture::on_surface(Pattern::Checkerboard([MAGENTA, BLACK]), to_pattern))
}

/// What messages say of it.
pub(super) const INSTEAD: &str = "squares in magenta and black stand in for it";

/// The surface in place of one that shows such a texture, whatever it does with it.
pub(super) fn surface() -> Surface {
    Diffuse { reflectance: Input::Texture(texture()), two_sided: true }.into()
}

/// The picture in place of the one that a light throws, or a map of the sky, that is missing.
pub(super) fn light() -> Image {
    let side = 16;
    let color = |i: u32| if (i % side + i / side).is_multiple_of(2) { MAGENTA } else { BLACK };
    Image { width: side, height: side, pixels: (0..side * side).map(color).collect() }
}

/// The measurements in place of those that are missing: magenta however they are lit and seen, as
/// bright as they can be.
pub(super) fn measurements() -> Measurements {
    const SHARE: f32 = 0.5 * std::f32::consts::FRAC_1_PI;
    Measurements::even(MAGENTA.map(|channel| channel * SHARE))
}
