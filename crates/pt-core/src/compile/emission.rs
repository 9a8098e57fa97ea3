//! Textured emission: texture coordinates and mean radiance of emitters.

use std::collections::HashSet;
use std::f32::consts::PI;
use std::ops::Range;

use pt_math::{Mat3, Spectrum, Vec2, Vec3, trig};
use pt_scene::Notes;
use pt_scene::image::Image;
use pt_scene::texture::{Bitmap, Pattern, Texture};
use pt_scene::{Light, Scene};

use super::CompileError;
use super::shapes::Shapes;
use crate::id::Id;
use crate::light::{EmitterTriangle, ProjectedImage, SphereLight, SphereMap, TexturedTriangle};
use crate::shapes::FLAT;
use crate::texture::Textures;
use crate::texture_record::TextureRecord;

/// Maximum number of texture lookups for the mean radiances of the triangles of a mesh.
const LOOKUPS: usize = 1 << 20;
/// Maximum number of subdivisions of an edge of a triangle.
const MAX_PARTS: usize = 64;
/// Number of lookups along each side of the domain of a sphere or slide.
const PARTS: u16 = 64;
/// Lower bound of a mean radiance, relative to that of the mesh or to 1, since lookups may miss
/// bright parts.
const MIN_SHARE: f32 = 0.01;

/// Returns an error for emission textures that cannot be sampled, or whose images are not radiance.
/// Negative values count as 0, with a note.
pub(super) fn check(scene: &Scene, notes: &mut Notes) -> Result<(), CompileError> {
    let mut seen = HashSet::new();
    let mut check_texture = |texture: &Texture| {
        check_images(texture, &mut |image| {
            if seen.insert(std::ptr::from_ref(image)) {
                notes.extend(image.negative_radiance());
            }
        })
    };
    for object in &scene.objects {
        let materials = object.materials.iter().flatten();
        let materials = materials.filter_map(|m| scene.materials.get(*m as usize));
        for texture in materials.filter_map(|m| m.emission.texture()) {
            let result = if object.motion.is_some() && texture.is_in_space() {
                Err("found a texture in space on a moving object, which light sampling does not \
                     support"
                    .to_owned())
            } else {
                check_texture(texture)
            };
            result.map_err(|message| {
                let message = format!("texture of the emission: {message}");
                CompileError::Value { at: object.at.clone(), message }
            })?;
        }
    }
    for Light { kind, at, .. } in &scene.lights {
        let Some(texture) = kind.slide() else { continue };
        let result = if texture.shows_colors_of_mesh() {
            Err("found mesh colours, expected another texture for a light without a mesh"
                .to_owned())
        } else if texture.is_in_space() {
            Err("found a texture in space, expected a projected image on texture coordinates"
                .to_owned())
        } else {
            check_texture(texture)
        };
        result.map_err(|message| {
            let message = format!("texture of the light: {message}");
            CompileError::Value { at: at.clone(), message }
        })?;
    }
    Ok(())
}

fn check_images(texture: &Texture, each: &mut impl FnMut(&Image)) -> Result<(), String> {
    match &texture.pattern {
        Pattern::Bitmap(Bitmap { image, .. }) => {
            each(image);
            image.check_finite()
        }
        pattern => pattern.parts().try_for_each(|t| check_images(t, each)),
    }
}

/// Texture coordinates and mean radiance of the triangles of an emitter.
pub(super) fn textured_triangles(
    shapes: &Shapes,
    runs: &[Range<usize>],
    triangles: &[EmitterTriangle],
    texture: Id<TextureRecord>,
) -> Vec<TexturedTriangle> {
    let textures = &shapes.materials.textures;
    let per_triangle = LOOKUPS / triangles.len().max(1);
    let parts = (1..MAX_PARTS).take_while(|n| n * n < per_triangle).last().unwrap_or(1);
    let laid = |(i, triangle): (usize, &EmitterTriangle)| {
        let uvs = uvs(shapes, i);
        let primitive = (shapes.first_colored[0] + i) as u32;
        let laid = TexturedTriangle { texture, uvs, primitive, mean: 0.0 };
        TexturedTriangle { mean: mean_of_triangle(textures, &laid, triangle, parts), ..laid }
    };
    let numbers = runs.iter().flat_map(Clone::clone);
    let mut all: Vec<_> = numbers.zip(triangles).map(laid).collect();
    let (power, area) = all.iter().zip(triangles).fold((0.0, 0.0), |(power, area), (laid, t)| {
        (power + f64::from(laid.mean * t.area()), area + f64::from(t.area()))
    });
    let least = MIN_SHARE * (power / area) as f32;
    for laid in &mut all {
        laid.mean = laid.mean.max(least);
    }
    all
}

/// Texture coordinates of the corners of a triangle, as in
/// [`crate::RenderScene::texture_eval_context`].
fn uvs(shapes: &Shapes, triangle: usize) -> [Vec2; 3] {
    match shapes.triangle_uvs.get(triangle) {
        Some(corners) if *corners != FLAT => corners.map(|i| shapes.uvs[i as usize]),
        _ => [Vec2::ZERO, Vec2::X, Vec2::Y],
    }
}

/// Mean luminance over a triangle, by the centres of n² equal parts.
fn mean_of_triangle(
    textures: &Textures,
    laid: &TexturedTriangle,
    triangle: &EmitterTriangle,
    n: usize,
) -> f32 {
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n - i {
            let at = |third: f32| {
                let barycentric = [i, j].map(|k| (k as f32 + third) / n as f32);
                f64::from(laid.radiance(textures, triangle, barycentric).luminance())
            };
            sum += at(1.0 / 3.0);
            if i + j + 1 < n {
                sum += at(2.0 / 3.0);
            }
        }
    }
    (sum / (n * n) as f64) as f32
}

/// Texture mapping and mean radiance of an emissive sphere.
pub(super) fn sphere_map(
    textures: &Textures,
    axes: Mat3,
    sphere: &SphereLight,
    texture: Id<TextureRecord>,
) -> SphereMap {
    let map = SphereMap { texture, axes, mean: 0.0 };
    let mean = mean_over_square(|x, y| {
        let (sin, cos) = trig::sin_cos(2.0 * PI * x);
        let z = 2.0 * y - 1.0;
        let equator = (1.0 - z * z).sqrt();
        map.radiance(textures, sphere, axes * Vec3::new(cos * equator, sin * equator, z))
    });
    SphereMap { mean: mean.max(MIN_SHARE), ..map }
}

/// Image projected by a light with these axes, and the tangents of half of its angles of view.
pub(super) fn slide(
    textures: &Textures,
    axes: Mat3,
    tangents: [f32; 2],
    texture: Id<TextureRecord>,
) -> ProjectedImage {
    let slide = ProjectedImage { texture, axes, tangents, mean: 0.0 };
    let mean = mean_over_square(|x, y| {
        let (x, y) = (2.0 * x - 1.0, 2.0 * y - 1.0);
        let w = axes * Vec3::new(x * tangents[0], y * tangents[1], 1.0).normalize();
        slide.transmittance(textures, w)
    });
    ProjectedImage { mean: mean.max(MIN_SHARE), ..slide }
}

/// Mean luminance over the unit square.
fn mean_over_square(value: impl Fn(f32, f32) -> Spectrum) -> f32 {
    let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(PARTS);
    let cells = (0..PARTS).flat_map(|i| (0..PARTS).map(move |j| (middle(i), middle(j))));
    let sum: f64 = cells.map(|(x, y)| f64::from(value(x, y).luminance())).sum();
    (sum / f64::from(PARTS).powi(2)) as f32
}
