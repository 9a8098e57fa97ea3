//! White balance: light of a colour temperature becomes white. pbrt-v4 applies it to the sensor
//! response, this reader to all light.

use std::sync::Arc;

use pt_math::{DMat3, DVec3, cie};
use pt_scene::image::Image;
use pt_scene::medium::{MediumEmission, MediumProperties};
use pt_scene::texture::{Color, Input, Pattern, Texture};
use pt_scene::{LightKind, Scene};

use super::color_space::{D65, xyz_of};

/// Matrix from CIE XYZ to cone responses, by columns. [Lam 1985, the Bradford transform;
/// ICC.1:2010, annex E]
const CONES: [[f64; 3]; 3] =
    [[0.8951, -0.7502, 0.0389], [0.2664, 1.7135, -0.0685], [-0.1614, 0.0367, 1.0296]];

/// Returns the matrix of linear Rec. 709 that maps daylight of a temperature to white. [von Kries
/// 1905]
pub(super) fn of_daylight(kelvin: f64) -> DMat3 {
    let cones = DMat3::from_cols_array_2d(&CONES);
    let [from, to] = [daylight(kelvin), D65].map(|white| cones * xyz_of(white));
    let adapted = cones.inverse() * DMat3::from_diagonal(to / from) * cones;
    let to_rec709 = [DVec3::X, DVec3::Y, DVec3::Z]
        .map(|xyz| DVec3::from_array(cie::rec709_from_xyz(xyz.to_array())));
    let to_rec709 = DMat3::from_cols_slice(to_rec709.map(|v| v.to_array()).as_flattened());
    to_rec709 * adapted * to_rec709.inverse()
}

/// Returns the chromaticity of daylight. [CIE 015:2004, §3.1; temperatures are those of the scale
/// before 1968]
fn daylight(kelvin: f64) -> [f64; 2] {
    let t = 1e3 / (kelvin * 1.4388 / 1.4380);
    let x = if kelvin <= 7000.0 {
        0.244_063 + t * (0.099_11 + t * (2.9678 - t * 4.607))
    } else {
        0.237_04 + t * (0.247_48 + t * (1.9018 - t * 2.0064))
    };
    [x, -3.0 * x * x + 2.87 * x - 0.275]
}

/// Applies the matrix to all light of a scene except thermal emission.
pub(super) fn balance(scene: &mut Scene, matrix: DMat3) {
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::LinearSpot { texture: Some(texture), .. } => tint_texture(texture, matrix),
            LightKind::Environment { image, .. } => *image = picture(image, matrix),
            kind => {
                if let Some(light) = kind.strength_mut() {
                    *light = seen(matrix, *light);
                }
            }
        }
    }
    for material in &mut scene.materials {
        tint(&mut material.emission, matrix);
    }
    for medium in &mut scene.media {
        match &mut medium.matter {
            MediumProperties::Homogeneous { emission, .. } => *emission = seen(matrix, *emission),
            MediumProperties::Heterogeneous(matter) => match &mut matter.emission {
                MediumEmission::Constant(light) => *light = seen(matrix, *light),
                MediumEmission::Grid(placed) if placed.grid.channels == 3 => {
                    let cells = Arc::make_mut(&mut placed.grid).values.as_chunks_mut::<3>().0;
                    for cell in cells {
                        *cell = seen(matrix, *cell);
                    }
                }
                MediumEmission::Grid(_) | MediumEmission::BlackBody(_) => {}
            },
            MediumProperties::Cloud(_) => {}
        }
    }
}

/// Applies the matrix to a colour; negative channels become 0.
fn seen(matrix: DMat3, color: [f32; 3]) -> [f32; 3] {
    let color = matrix * DVec3::from_array(color.map(f64::from));
    color.to_array().map(|c| c.max(0.0) as f32)
}

fn picture(image: &Image, matrix: DMat3) -> Arc<Image> {
    let pixels = image.pixels.iter().map(|pixel| seen(matrix, *pixel)).collect();
    Arc::new(Image { pixels, ..*image })
}

/// Applies the matrix to an emission. In products, only the first factor is light.
fn tint(color: &mut Color, matrix: DMat3) {
    match color {
        Input::Value(value) => *value = seen(matrix, *value),
        Input::Texture(texture) => tint_texture(texture, matrix),
    }
}

fn tint_texture(texture: &mut Arc<Texture>, matrix: DMat3) {
    let mut tinted = Texture::clone(texture);
    match &mut tinted.pattern {
        Pattern::Bitmap(bitmap) => bitmap.image = picture(&bitmap.image, matrix),
        Pattern::Product(factors) => tint(&mut factors[0], matrix),
        _ => {}
    }
    *texture = Arc::new(tinted);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Daylight of a temperature becomes white with the same luminance, and bluer light stays
    /// bluer.
    #[test]
    fn daylight_becomes_white() {
        for kelvin in [5000.0, 6500.0, 9000.0] {
            let light = cie::rec709_from_xyz(xyz_of(daylight(kelvin)).to_array());
            let white = of_daylight(kelvin) * DVec3::from_array(light);
            assert!((white - DVec3::ONE).abs().max_element() < 3e-3, "{kelvin}: {white}");
        }
        let grey = seen(of_daylight(6504.0), [0.5; 3]);
        assert!(grey.iter().all(|c| (c - 0.5).abs() < 2e-3), "{grey:?}");
        let [r, _, b] = seen(of_daylight(9000.0), [1.0; 3]);
        assert!(r > 1.05 && b < 0.9, "{r} {b}");
    }

    /// D50 and D65 have the tabulated chromaticities.
    #[test]
    fn daylight_has_its_chromaticity() {
        for (kelvin, [x, y]) in [(5000.0, [0.3457, 0.3585]), (6500.0, [0.3127, 0.3291])] {
            let [got_x, got_y] = daylight(kelvin);
            assert!((got_x - x).abs() < 3e-4 && (got_y - y).abs() < 3e-4, "{got_x} {got_y}");
        }
    }

    #[test]
    fn products_are_tinted_once() {
        let image = Arc::new(Image { width: 1, height: 1, pixels: vec![[2.0; 3]].into() });
        let bitmap = pt_scene::texture::Bitmap {
            image,
            wrap: pt_scene::texture::Wrap::CLAMP,
            filter: pt_scene::texture::Filter::Nearest,
        };
        let shown: Color = Input::Texture(Arc::new(Pattern::Bitmap(bitmap).into()));
        let factors = Box::new([shown, Input::Value([0.5; 3])]);
        let mut light = Input::Texture(Arc::new(Texture::from(Pattern::Product(factors))));
        tint(&mut light, DMat3::from_diagonal(DVec3::new(3.0, 1.0, 0.5)));
        let Pattern::Product(factors) = &light.texture().expect("a texture").pattern else {
            panic!("no product")
        };
        assert_eq!(factors[1], Input::Value([0.5; 3]));
        let Pattern::Bitmap(bitmap) = &factors[0].texture().expect("a texture").pattern else {
            panic!("no image")
        };
        assert_eq!(bitmap.image.pixels, [[6.0, 2.0, 1.0]]);
    }
}
