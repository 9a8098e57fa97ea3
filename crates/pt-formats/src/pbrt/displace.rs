//! Displaced meshes: subdivided into small triangles, whose vertices are moved along their normals.
//! [Pharr, Jakob & Humphreys 2023, "plymesh" of the file format]

use std::collections::HashMap;

use pt_math::{DAffine3, DVec3};
use pt_scene::image::Image;
use pt_scene::shapes::{single_part, smooth_normals};
use pt_scene::texture::{Bitmap, Filter, Input, Pattern, Scalar, Texture, TextureMapping};
use pt_scene::{Attribute, Mesh, Shared};

/// Maximum number of triangles of a displaced mesh.
const MAX_TRIANGLES: usize = 1 << 22;

/// Subdivides a mesh until no edge is longer than `edge` in the world, and displaces it by
/// `heights` in its own coordinates. The result has texture coordinates.
///
/// # Errors
/// If it would have too many triangles, or the texture is not supported for displacement.
pub(super) fn displaced(
    mesh: &Mesh,
    heights: &Scalar,
    edge: f64,
    to_world: &DAffine3,
) -> Result<Mesh, String> {
    let mut cut = indexed(mesh);
    while split(&mut cut, edge, to_world) {
        if cut.triangles.len() > MAX_TRIANGLES {
            return Err(format!(
                "the displaced mesh exceeds {MAX_TRIANGLES} triangles; give a larger edgelength"
            ));
        }
    }
    let uvs = cut.uvs.as_ref().map_or(&[][..], |uvs| &uvs.values);
    let normals = cut.normals.as_ref().map_or(&[][..], |normals| &normals.values);
    for ((position, normal), uv) in cut.positions.iter_mut().zip(normals).zip(uvs) {
        let normal = vector(*normal).normalize_or_zero();
        let height = f64::from(number_at(heights, *uv)?);
        *position = (vector(*position) + normal * height).as_vec3().to_array();
    }
    cut.submeshes = single_part(cut.triangles.len());
    // By positions alone: vertices at the same position but with different texture coordinates may
    // have moved apart.
    cut.normals = Some(smooth_normals(&Mesh { uvs: None, ..cut.clone() }));
    Ok(cut)
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// Returns the mesh with one normal and one texture coordinate per vertex.
fn indexed(mesh: &Mesh) -> Mesh {
    let normals = mesh.normals.clone().unwrap_or_else(|| smooth_normals(mesh));
    let at = |indices: &Option<Shared<[u32; 3]>>, i: usize| {
        indices.as_ref().map_or(mesh.triangles[i], |indices| indices[i])
    };
    let mut numbers = HashMap::new();
    let mut made = Mesh { name: mesh.name.clone(), ..Mesh::default() };
    let (mut made_normals, mut made_uvs) = (Vec::new(), Vec::new());
    for (i, corners) in mesh.triangles.iter().enumerate() {
        let of_normals = at(&normals.indices, i);
        let of_uvs = mesh.uvs.as_ref().map_or(*corners, |uvs| at(&uvs.indices, i));
        let triangle = [0, 1, 2].map(|c| {
            *numbers.entry((corners[c], of_normals[c], of_uvs[c])).or_insert_with(|| {
                made.positions.push(mesh.positions[corners[c] as usize]);
                made_normals.push(normals.values[of_normals[c] as usize]);
                let uv = mesh.uvs.as_ref().map(|uvs| uvs.values[of_uvs[c] as usize]);
                made_uvs.push(uv.unwrap_or_default());
                made.positions.len() as u32 - 1
            })
        });
        made.triangles.push(triangle);
    }
    made.normals = Some(Attribute { values: made_normals.into(), indices: None });
    made.uvs = Some(Attribute { values: made_uvs.into(), indices: None });
    made
}

/// Bisects all edges that are too long, consistently for the triangles that share them. Returns
/// false if there were none.
fn split(mesh: &mut Mesh, edge: f64, to_world: &DAffine3) -> bool {
    let (Some(normals), Some(uvs)) = (&mut mesh.normals, &mut mesh.uvs) else { return false };
    let mut middles: HashMap<[u32; 2], Option<u32>> = HashMap::new();
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for &[a, b, c] in &mesh.triangles {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
            let ends = [p.min(q), p.max(q)];
            *middles.entry(ends).or_insert_with(|| {
                let ends = ends.map(|i| i as usize);
                let [start, end] = ends.map(|i| vector(mesh.positions[i]));
                let is_long = to_world.transform_vector3(end - start).length() > edge;
                if !is_long {
                    return None;
                }
                mesh.positions.push((0.5 * (start + end)).as_vec3().to_array());
                let [n, m] = ends.map(|i| vector(normals.values[i]).normalize_or_zero());
                normals.values.push((n + m).normalize_or_zero().as_vec3().to_array());
                let [s, t] = ends.map(|i| uvs.values[i]);
                uvs.values.push([0, 1].map(|i| 0.5 * (s[i] + t[i])));
                Some(mesh.positions.len() as u32 - 1)
            })
        });
        match (ab, bc, ca) {
            (None, None, None) => triangles.push([a, b, c]),
            (Some(d), None, None) => triangles.extend([[a, d, c], [d, b, c]]),
            (None, Some(e), None) => triangles.extend([[a, b, e], [a, e, c]]),
            (None, None, Some(f)) => triangles.extend([[a, b, f], [b, c, f]]),
            (Some(d), Some(e), None) => triangles.extend([[a, d, c], [d, e, c], [d, b, e]]),
            (None, Some(e), Some(f)) => triangles.extend([[a, b, e], [a, e, f], [f, e, c]]),
            (Some(d), None, Some(f)) => triangles.extend([[a, d, f], [d, b, f], [b, c, f]]),
            (Some(d), Some(e), Some(f)) => {
                triangles.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
            }
        }
    }
    let is_cut = triangles.len() > mesh.triangles.len();
    mesh.triangles = triangles.into();
    is_cut
}

/// Evaluates a number at texture coordinates.
fn number_at(number: &Scalar, uv: [f32; 2]) -> Result<f32, String> {
    match number {
        Input::Value(value) => Ok(*value),
        Input::Texture(texture) => texture_at(texture, uv),
    }
}

/// Evaluates a texture whose channels are equal.
fn texture_at(texture: &Texture, [u, v]: [f32; 2]) -> Result<f32, String> {
    const EXPECTED: &str = "unsupported displacement; supported: images, checkerboards and their \
                            combinations on texture coordinates";
    if texture.layout != TextureMapping::Surface {
        return Err(EXPECTED.to_owned());
    }
    let p = texture.to_pattern * DVec3::new(f64::from(u), f64::from(v), 1.0);
    let uv = [p.x, p.y];
    let of_color = |color: &pt_scene::Color| match color {
        Input::Value([value, ..]) => Ok(*value),
        Input::Texture(texture) => texture_at(texture, [uv[0] as f32, uv[1] as f32]),
    };
    match &texture.pattern {
        Pattern::Bitmap(bitmap) => Ok(bitmap_at(bitmap, uv)),
        Pattern::Checkerboard(colors) => {
            let is_high = uv.map(|x| x - x.floor() > 0.5);
            Ok(colors[usize::from(is_high[0] != is_high[1])][0])
        }
        Pattern::Product(factors) => Ok(of_color(&factors[0])? * of_color(&factors[1])?),
        Pattern::Blend(blend) => {
            let share = number_at(&blend.amount, [uv[0] as f32, uv[1] as f32])?.clamp(0.0, 1.0);
            let (first, second) = (of_color(&blend.first)?, of_color(&blend.second)?);
            Ok(first * (1.0 - share) + second * share)
        }
        _ => Err(EXPECTED.to_owned()),
    }
}

fn bitmap_at(Bitmap { image, wrap, filter }: &Bitmap, uv: [f64; 2]) -> f32 {
    let Image { width, height, pixels } = &**image;
    let size = [*width, *height].map(i64::from);
    let texel = |x: i64, y: i64| -> Option<f32> {
        let (x, y) = (wrap.u.texel(x, size[0])?, size[1] - 1 - wrap.v.texel(y, size[1])?);
        Some(pixels[(y * size[0] + x) as usize][0])
    };
    let texel = |x: i64, y: i64| texel(x, y).unwrap_or(0.0);
    let [x, y] = [0, 1].map(|axis| uv[axis] * size[axis] as f64);
    if *filter == Filter::Nearest {
        return texel(x.floor() as i32 as i64, y.floor() as i32 as i64);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let ([s, t], [i, j]) =
        ([x, y].map(|x| (x - x.floor()) as f32), [x, y].map(|x| i64::from(x.floor() as i32)));
    let row = |j: i64| texel(i, j) * (1.0 - s) + texel(i + 1, j) * s;
    row(j) * (1.0 - t) + row(j + 1) * t
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use pt_math::DMat3;
    use pt_scene::texture::Wrap;

    use super::*;

    /// A square in z = 0 whose texture coordinates equal its positions.
    fn square() -> Mesh {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        Mesh {
            positions: corners.map(|[x, y]| [x, y, 0.0]).to_vec().into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]].into(),
            uvs: Some(Attribute { values: corners.to_vec().into(), indices: None }),
            submeshes: single_part(2),
            ..Mesh::default()
        }
    }

    fn texture(pattern: Pattern) -> Scalar {
        Input::Texture(Arc::new(pattern.into()))
    }

    /// Heights proportional to u tilt the square: all vertices lie in one plane, and no edge is
    /// longer than requested.
    #[test]
    fn a_slope_tilts_a_square() {
        let pixels = [[0.25; 3], [0.75; 3]].to_vec();
        let image = Arc::new(Image { width: 2, height: 1, pixels: pixels.into() });
        let bitmap = Bitmap { image, wrap: Wrap::CLAMP, filter: Filter::Bilinear };
        // Between the centres of its two texels, the image is u.
        let to_pattern = DMat3::from_cols(DVec3::X * 0.5, DVec3::Y, DVec3::new(0.25, 0.0, 1.0));
        let slope = Texture::on_surface(Pattern::Bitmap(bitmap), to_pattern);
        let heights = Input::Texture(Arc::new(slope));
        let to_world = DAffine3::from_scale(DVec3::splat(2.0));
        let made = displaced(&square(), &heights, 0.3, &to_world).expect("a mesh");
        for [x, _, z] in &made.positions {
            assert!((z - (0.25 + 0.5 * x)).abs() < 1e-6, "{x} {z}");
        }
        let normal = DVec3::new(-0.5, 0.0, 1.0).normalize();
        for n in &made.normals.as_ref().expect("normals").values {
            assert!((vector(*n) - normal).length() < 1e-5);
        }
        // Before displacement, edges were at most 0.15 long.
        for corners in &made.triangles {
            let p = corners.map(|i| made.positions[i as usize]);
            for i in 0..3 {
                let [a, b] = [p[i], p[(i + 1) % 3]];
                assert!((a[0] - b[0]).hypot(a[1] - b[1]) <= 0.150_01);
            }
        }
        let area = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| vector(made.positions[i as usize]));
            0.5 * (b - a).cross(c - a).length()
        };
        let sum: f64 = made.triangles.iter().map(|t| area(*t)).sum();
        assert!((sum - 1.25_f64.sqrt()).abs() < 1e-5, "{sum}");
    }

    /// There are no gaps even if only some edges of a triangle are too long.
    #[test]
    fn cuts_fit_together() {
        let mut mesh = indexed(&square());
        mesh.positions[2] = [3.0, 1.5, 0.0];
        while split(&mut mesh, 0.4, &DAffine3::IDENTITY) {}
        let mut edges = HashMap::new();
        for &[a, b, c] in &mesh.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *edges.entry([p.min(q), p.max(q)]).or_insert(0) += if p < q { 1 } else { -1 };
            }
        }
        // Edges without a counterpart are at the border of the square, on the lines between its
        // corners.
        let border = edges.iter().filter(|(_, count)| **count != 0);
        let corners =
            [[0.0, 0.0], [1.0, 0.0], [3.0, 1.5], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        for (ends, _) in border {
            let is_on = |i: usize, p: DVec3| {
                let [a, b] = [corners[i], corners[(i + 1) % 4]];
                (b - a).cross(p - a).length() < 1e-6
            };
            let [p, q] = ends.map(|i| vector(mesh.positions[i as usize]));
            assert!((0..4).any(|i| is_on(i, p) && is_on(i, q)), "{p} {q}");
        }
    }

    #[test]
    fn too_many_triangles_are_refused() {
        let flat = texture(Pattern::Checkerboard([[0.0; 3]; 2]));
        let refused = displaced(&square(), &flat, 1e-4, &DAffine3::IDENTITY);
        assert!(refused.is_err_and(|why| why.contains("larger edgelength")));
        let other = displaced(&square(), &texture(Pattern::VertexColors), 0.5, &DAffine3::IDENTITY);
        assert!(other.is_err_and(|why| why.contains("images")));
    }
}
