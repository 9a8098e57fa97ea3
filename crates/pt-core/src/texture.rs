//! Textures as renderers read them.

use std::ops::{Add, Mul, Sub};

use pt_math::{Affine2, Spectrum, Vec2, Vec3};
use pt_scene::texture::{Filter, Wrap};

use crate::id::{Id, Table};
use crate::levels::{LEVELS, SRGB};
use crate::parametrization::{OnTriangle, Parametrization};
use crate::pyramid;
use crate::shapes::FLAT;

/// What a texture shows, and how the surface is laid out on it.
#[derive(Clone, Copy, Debug)]
pub struct TextureRecord {
    /// What it shows.
    pub pattern: PatternRecord,
    /// From (u, v) of the surface to those of the pattern.
    pub to_pattern: Affine2,
}

/// What a texture shows; see [`pt_scene::texture::Pattern`].
#[derive(Clone, Copy, Debug)]
pub enum PatternRecord {
    /// An image.
    Bitmap(Id<Texels>, Wrap, Filter),
    /// Squares of side ½.
    Checkerboard([Spectrum; 2]),
    /// Colours at the corners of triangles, linear between them.
    VertexColors,
    /// Colours of triangles.
    FaceColors,
    /// One times the other.
    Product([Factor; 2]),
    /// What is between two, by the share of the second.
    Blend([Factor; 2], Varying),
}

/// A colour that is put together with another.
#[derive(Clone, Copy, Debug)]
pub enum Factor {
    /// The same everywhere.
    Value(Spectrum),
    /// That of a texture, which has coordinates of its own.
    Texture(Id<TextureRecord>),
}

/// A parameter that one number or a texture gives.
#[derive(Clone, Copy, Debug)]
pub enum Varying {
    /// The same everywhere.
    Value(f32),
    /// The luminance of a texture.
    Texture(Id<TextureRecord>),
}

/// All textures; images that several of them show are there once.
#[derive(Default)]
pub struct Textures {
    /// The textures.
    pub records: Table<TextureRecord>,
    /// Their images.
    pub texels: Table<Texels>,
    /// The colours of meshes that some of them show.
    pub mesh_colors: MeshColors,
    /// Whether some of them show more or less of an image by how much of it is seen at once.
    pub uses_footprints: bool,
}

/// Colours of meshes.
#[derive(Default)]
pub struct MeshColors {
    /// Those of vertices.
    pub vertices: Vec<Spectrum>,
    /// The corners of each triangle among them, or [`FLAT`]; may end early.
    pub triangles: Vec<[u32; 3]>,
    /// Those of triangles; may end early.
    pub faces: Vec<Spectrum>,
}

impl MeshColors {
    /// The colours at the corners of a triangle; black without any.
    #[inline]
    fn corners(&self, triangle: u32) -> [Spectrum; 3] {
        match self.triangles.get(triangle as usize) {
            Some(corners) if *corners != FLAT => corners.map(|i| self.vertices[i as usize]),
            _ => [Spectrum::ZERO; 3],
        }
    }

    /// That of a point on a triangle.
    #[inline]
    fn at_vertices(&self, at: &OnTriangle) -> Spectrum {
        let [c0, c1, c2] = self.corners(at.triangle);
        let Vec2 { x: b1, y: b2 } = at.barycentric;
        c0 * (1.0 - b1 - b2) + c1 * b1 + c2 * b2
    }

    #[inline]
    fn of_face(&self, triangle: u32) -> Spectrum {
        self.faces.get(triangle as usize).copied().unwrap_or_default()
    }

    /// How [`Self::at_vertices`] grows with u and v, by the inverse of what these grow by along the edges.
    fn gradient(&self, at: &OnTriangle) -> [Spectrum; 2] {
        let [c0, c1, c2] = self.corners(at.triangle);
        let [d1, d2] = at.uv_edges;
        let per_determinant = 1.0 / d1.perp_dot(d2);
        if !per_determinant.is_finite() {
            return [Spectrum::ZERO; 2];
        }
        let along_edges = |a: f32, b: f32| ((c1 - c0) * a + (c2 - c0) * b) * per_determinant;
        [along_edges(d2.y, -d1.y), along_edges(-d2.x, d1.x)]
    }

    fn bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.faces.as_slice())
    }
}

/// An image, in the smallest form that keeps its values.
pub struct Texels {
    size: [u32; 2],
    values: Values,
    /// The same in half of the width and height, again and again, down to one texel; empty if no texture
    /// asks for it.
    coarser: Vec<Texels>,
}

enum Values {
    /// Levels of sRGB in 8 bits.
    Srgb(Vec<[u8; 3]>),
    /// Levels of 1/255.
    Levels(Vec<[u8; 3]>),
    Floats(Vec<[f32; 3]>),
}

impl Texels {
    /// `width` × `height` values, the upper row first.
    pub(crate) fn new(width: u32, height: u32, pixels: &[[f32; 3]]) -> Self {
        let values = SRGB
            .coded(pixels)
            .map(Values::Srgb)
            .or_else(|| LEVELS.coded(pixels).map(Values::Levels))
            .unwrap_or_else(|| Values::Floats(pixels.to_vec()));
        Self { size: [width, height], values, coarser: Vec::new() }
    }

    /// Makes the coarser levels, if there are none. [Williams 1983, "Pyramidal Parametrics"]
    pub(crate) fn build_pyramid(&mut self, pixels: &[[f32; 3]]) {
        if self.coarser.is_empty() {
            self.coarser = pyramid::coarser(self.size, pixels)
                .map(|([width, height], pixels)| Self::new(width, height, &pixels))
                .collect();
        }
    }

    /// A level, the finest for 0.
    #[inline]
    fn level(&self, i: usize) -> &Self {
        let coarser = i.checked_sub(1).and_then(|i| self.coarser.get(i).or(self.coarser.last()));
        coarser.unwrap_or(self)
    }

    /// What is seen where the footprint has these axes, in coordinates of the image: between the two levels
    /// whose texels are about as wide as its shorter axis, so that nothing is blurred by more than it covers.
    fn trilinear(&self, uv: Vec2, wrap: Wrap, axes: [Vec2; 2]) -> Spectrum {
        let width = pyramid::shorter_axis(axes.map(|a| self.scaled(a)));
        if width <= 1.0 {
            return self.bilinear(uv, wrap);
        }
        let level = libm::log2f(width).min(self.coarser.len() as f32);
        let share = level - level.floor();
        let [finer, coarser] = [0, 1].map(|i| self.level(level as usize + i).bilinear(uv, wrap));
        finer * (1.0 - share) + coarser * share
    }

    /// How much memory the values take.
    pub fn bytes(&self) -> usize {
        let own = match &self.values {
            Values::Srgb(v) | Values::Levels(v) => size_of_val(v.as_slice()),
            Values::Floats(v) => size_of_val(v.as_slice()),
        };
        own + self.coarser.iter().map(Self::bytes).sum::<usize>()
    }

    #[inline]
    fn texel(&self, i: usize) -> Spectrum {
        match &self.values {
            Values::Srgb(v) => Spectrum::from(v[i].map(|b| SRGB.light(b))),
            Values::Levels(v) => Spectrum::from(v[i].map(|b| LEVELS.light(b))),
            Values::Floats(v) => v[i].into(),
        }
    }

    /// The texel of column `x` and row `y` from below, which may be beyond the image.
    #[inline]
    fn at(&self, x: i64, y: i64, wrap: Wrap) -> Spectrum {
        let [w, h] = self.size.map(i64::from);
        let (x, y) = (wrapped(x, w, wrap), wrapped(y, h, wrap));
        self.texel(((h - 1 - y) * w + x) as usize)
    }

    /// The four texels around a point of the unit square, those below first, and how far it is from the
    /// first, in texels.
    #[inline]
    fn around(&self, uv: Vec2, wrap: Wrap) -> ([Spectrum; 4], Vec2) {
        let p = self.scaled(uv) - 0.5;
        let corner = p.floor();
        // What is beyond 32 bits stays there, so that there is always a next one.
        let (x, y) = (i64::from(corner.x as i32), i64::from(corner.y as i32));
        let texels = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| self.at(x + i, y + j, wrap));
        (texels, p - corner)
    }

    /// In texels.
    #[inline]
    fn scaled(&self, uv: Vec2) -> Vec2 {
        uv * Vec2::from(self.size.map(|n| n as f32))
    }

    #[inline]
    fn bilinear(&self, uv: Vec2, wrap: Wrap) -> Spectrum {
        let ([a, b, c, d], t) = self.around(uv, wrap);
        let (below, above) = (a * (1.0 - t.x) + b * t.x, c * (1.0 - t.x) + d * t.x);
        below * (1.0 - t.y) + above * t.y
    }

    #[inline]
    fn nearest(&self, uv: Vec2, wrap: Wrap) -> Spectrum {
        let p = self.scaled(uv).floor();
        self.at(p.x as i64, p.y as i64, wrap)
    }

    /// How what `value` makes of [`Self::bilinear`] grows with u and v, for what is linear.
    #[inline]
    fn gradient<T>(&self, uv: Vec2, wrap: Wrap, value: impl Fn(Spectrum) -> T) -> [T; 2]
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
    {
        let (texels, t) = self.around(uv, wrap);
        let [a, b, c, d] = texels.map(value);
        let along_u = (b - a) * (1.0 - t.y) + (d - c) * t.y;
        let along_v = (c - a) * (1.0 - t.x) + (d - b) * t.x;
        let [w, h] = self.size.map(|n| n as f32);
        [along_u * w, along_v * h]
    }
}

/// The texel among `n` that stands for number `i` of an endless row.
#[inline]
fn wrapped(i: i64, n: i64, wrap: Wrap) -> i64 {
    match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            if i < n { i } else { 2 * n - 1 - i }
        }
    }
}

impl Textures {
    /// What a texture shows at a point of a surface.
    #[inline]
    pub fn color(&self, id: Id<TextureRecord>, at: &Parametrization) -> Spectrum {
        let TextureRecord { pattern, to_pattern } = self.records[id];
        let uv = to_pattern.transform_point2(at.uv);
        match pattern {
            PatternRecord::Bitmap(texels, wrap, Filter::Bilinear) => {
                self.texels[texels].bilinear(uv, wrap)
            }
            PatternRecord::Bitmap(texels, wrap, Filter::Nearest) => {
                self.texels[texels].nearest(uv, wrap)
            }
            PatternRecord::Bitmap(texels, wrap, Filter::Trilinear) => {
                let axes = at.footprint.map(|axis| to_pattern.transform_vector2(axis));
                self.texels[texels].trilinear(uv, wrap, axes)
            }
            PatternRecord::Checkerboard([same, other]) => {
                let high = (uv - uv.floor()).cmpgt(Vec2::splat(0.5));
                if high.test(0) == high.test(1) { same } else { other }
            }
            PatternRecord::VertexColors | PatternRecord::FaceColors => {
                self.color_of_mesh(pattern, at)
            }
            PatternRecord::Product(factors) => self.product(factors, at),
            PatternRecord::Blend(parts, share) => self.blend(parts, share, at),
        }
    }

    /// The colour of a mesh; black where there is no triangle.
    fn color_of_mesh(&self, pattern: PatternRecord, at: &Parametrization) -> Spectrum {
        let Some(at) = &at.on_triangle else { return Spectrum::ZERO };
        match pattern {
            PatternRecord::VertexColors => self.mesh_colors.at_vertices(at),
            _ => self.mesh_colors.of_face(at.triangle),
        }
    }

    #[inline(never)]
    fn product(&self, factors: [Factor; 2], at: &Parametrization) -> Spectrum {
        let [a, b] = factors.map(|factor| self.factor(factor, at));
        a * b
    }

    /// Where all is one of the two, the other is not looked at.
    #[inline(never)]
    fn blend(
        &self,
        [first, second]: [Factor; 2],
        share: Varying,
        at: &Parametrization,
    ) -> Spectrum {
        let t = self.number(share, at).clamp(0.0, 1.0);
        if t == 0.0 {
            self.factor(first, at)
        } else if t == 1.0 {
            self.factor(second, at)
        } else {
            self.factor(first, at) * (1.0 - t) + self.factor(second, at) * t
        }
    }

    fn factor(&self, factor: Factor, at: &Parametrization) -> Spectrum {
        match factor {
            Factor::Value(value) => value,
            Factor::Texture(id) => self.color(id, at),
        }
    }

    /// Radiance at a point of a surface that glows; nothing is less than black.
    pub fn radiance(&self, id: Id<TextureRecord>, at: &Parametrization) -> Spectrum {
        Spectrum(self.color(id, at).0.max(Vec3::ZERO))
    }

    /// A number at a point of a surface.
    #[inline]
    pub fn number(&self, varying: Varying, at: &Parametrization) -> f32 {
        match varying {
            Varying::Value(v) => v,
            Varying::Texture(id) => self.color(id, at).luminance(),
        }
    }

    /// How the luminance grows with u and v of the surface, between jumps.
    #[inline]
    pub fn gradient(&self, id: Id<TextureRecord>, at: &Parametrization) -> Vec2 {
        let TextureRecord { pattern, to_pattern } = self.records[id];
        match pattern {
            PatternRecord::Bitmap(texels, wrap, Filter::Bilinear | Filter::Trilinear) => {
                let uv = to_pattern.transform_point2(at.uv);
                let inner = self.texels[texels].gradient(uv, wrap, Spectrum::luminance);
                to_pattern.matrix2.transpose() * Vec2::from(inner)
            }
            _ => self.color_gradient(id, at).map(Spectrum::luminance).into(),
        }
    }

    /// The same for each channel.
    fn color_gradient(&self, id: Id<TextureRecord>, at: &Parametrization) -> [Spectrum; 2] {
        let TextureRecord { pattern, to_pattern } = self.records[id];
        match (pattern, &at.on_triangle) {
            (PatternRecord::Bitmap(texels, wrap, Filter::Bilinear | Filter::Trilinear), _) => {
                let uv = to_pattern.transform_point2(at.uv);
                let [u, v] = self.texels[texels].gradient(uv, wrap, |color| color);
                let [s, t] = [to_pattern.matrix2.x_axis, to_pattern.matrix2.y_axis];
                [u * s.x + v * s.y, u * t.x + v * t.y]
            }
            (PatternRecord::VertexColors, Some(at)) => self.mesh_colors.gradient(at),
            (PatternRecord::Product([a, b]), _) => {
                let (da, db) = (self.factor_gradient(a, at), self.factor_gradient(b, at));
                let (a, b) = (self.factor(a, at), self.factor(b, at));
                [da[0] * b + a * db[0], da[1] * b + a * db[1]]
            }
            (PatternRecord::Blend([a, b], share), _) => {
                let (da, db) = (self.factor_gradient(a, at), self.factor_gradient(b, at));
                let difference = self.factor(b, at) + self.factor(a, at) * -1.0;
                let t = self.number(share, at);
                let dt = match share {
                    Varying::Texture(id) if (0.0..=1.0).contains(&t) => self.gradient(id, at),
                    _ => Vec2::ZERO,
                };
                let t = t.clamp(0.0, 1.0);
                let along = |i: usize| da[i] * (1.0 - t) + db[i] * t + difference * dt[i];
                [along(0), along(1)]
            }
            _ => [Spectrum::ZERO; 2],
        }
    }

    fn factor_gradient(&self, factor: Factor, at: &Parametrization) -> [Spectrum; 2] {
        match factor {
            Factor::Value(_) => [Spectrum::ZERO; 2],
            Factor::Texture(id) => self.color_gradient(id, at),
        }
    }

    /// How much memory all images and colours of meshes take.
    pub fn bytes(&self) -> usize {
        let images: usize = self.texels.as_slice().iter().map(Texels::bytes).sum();
        images + self.mesh_colors.bytes()
    }
}

/// Of one texture, for the examples of lights.
impl Textures {
    fn of_one(mut self, pattern: PatternRecord) -> (Id<TextureRecord>, Self) {
        let record = TextureRecord { pattern, to_pattern: Affine2::IDENTITY };
        (self.records.push(record), self)
    }

    pub(crate) fn of_vertices(
        vertices: Vec<Spectrum>,
        triangles: Vec<[u32; 3]>,
    ) -> (Id<TextureRecord>, Self) {
        let mesh_colors = MeshColors { vertices, triangles, faces: Vec::new() };
        Self { mesh_colors, ..Self::default() }.of_one(PatternRecord::VertexColors)
    }

    pub(crate) fn of_image(
        width: u32,
        height: u32,
        pixels: &[[f32; 3]],
    ) -> (Id<TextureRecord>, Self) {
        let mut textures = Self::default();
        let texels = textures.texels.push(Texels::new(width, height, pixels));
        textures.of_one(PatternRecord::Bitmap(texels, Wrap::Repeat, Filter::Bilinear))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: &[f32], width: u32) -> Texels {
        let pixels: Vec<_> = pixels.iter().map(|&v| [v; 3]).collect();
        Texels::new(width, pixels.len() as u32 / width, &pixels)
    }

    #[test]
    fn values_take_no_more_bytes_than_they_need_and_come_back() {
        let srgb: Vec<f32> = SRGB.values.to_vec();
        let floats = [0.1, 0.123_456_7, -1.0, 7e9];
        for (values, bytes) in [(&srgb[..], 3), (&LEVELS.values[..], 3), (&floats, 12)] {
            let texels = image(values, values.len() as u32);
            assert_eq!(texels.bytes(), bytes * values.len());
            for (i, &v) in values.iter().enumerate() {
                assert_eq!(texels.texel(i), Spectrum::splat(v));
            }
        }
    }

    /// However far from the image they are.
    #[test]
    fn all_coordinates_show_texels() {
        let t = image(&[1.0; 6], 3);
        for far in [1e9, 1e18, 1e30, -1e9, -1e18, -1e30, f32::MAX / 3.0] {
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                for uv in [Vec2::new(far, 0.5), Vec2::new(0.5, far), Vec2::splat(far)] {
                    assert_eq!((t.bilinear(uv, wrap).0.x, t.nearest(uv, wrap).0.x), (1.0, 1.0));
                }
            }
        }
    }

    /// Rows from above in memory, v from below; values at the middles of texels, and linear
    /// between them.
    #[test]
    fn an_image_lies_on_the_unit_square() {
        let t = image(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 3);
        let at = |u, v, wrap| t.bilinear(Vec2::new(u, v), wrap).0.x;
        for (i, want) in [3.0, 4.0, 5.0].into_iter().enumerate() {
            let u = (i as f32 + 0.5) / 3.0;
            assert!((at(u, 0.25, Wrap::Clamp) - want).abs() < 1e-5);
            assert!((at(u, 0.75, Wrap::Clamp) - want + 3.0).abs() < 1e-5);
            assert!((at(u, 0.5, Wrap::Clamp) - want + 1.5).abs() < 1e-5);
        }
        assert!((at(1.0 / 3.0, 0.25, Wrap::Clamp) - 3.5).abs() < 1e-5);
        assert!((at(0.0, 0.0, Wrap::Clamp) - 3.0).abs() < 1e-5);
        assert!((at(0.0, 0.0, Wrap::Repeat) - 2.5).abs() < 1e-5);
        assert!((at(0.0, 0.0, Wrap::Mirror) - 3.0).abs() < 1e-5);
        assert!((at(-1.0 / 6.0, 0.25, Wrap::Repeat) - 5.0).abs() < 1e-5);
        assert!((at(-1.5 / 3.0, 0.25, Wrap::Mirror) - 4.0).abs() < 1e-5);
        assert_eq!(t.nearest(Vec2::new(0.34, 0.1), Wrap::Clamp).0.x, 4.0);
    }

    /// One triangle with colours, at coordinates that stretch and turn it; the product of these with an
    /// image; and what is between these and another colour, by themselves.
    fn textures_of_a_triangle() -> (Textures, [Id<TextureRecord>; 3]) {
        let mut textures = Textures::default();
        textures.mesh_colors.vertices =
            [[0.1, 0.5, 0.9], [0.7, 0.2, 0.4], [0.3, 0.8, 0.6]].map(Spectrum::from).into();
        textures.mesh_colors.triangles = vec![FLAT, [0, 1, 2]];
        let texels = textures.texels.push(image(&[0.3, 1.0, 0.5, 2.0], 2));
        let bitmap = PatternRecord::Bitmap(texels, Wrap::Repeat, Filter::Bilinear);
        let to_pattern =
            Affine2::from_cols(Vec2::new(0.4, 0.3), Vec2::new(-0.2, 0.5), Vec2::new(0.1, 0.2));
        let colors =
            TextureRecord { pattern: PatternRecord::VertexColors, to_pattern: Affine2::IDENTITY };
        let colors = textures.records.push(colors);
        let image = textures.records.push(TextureRecord { pattern: bitmap, to_pattern });
        let factors = [colors, image].map(Factor::Texture);
        let pattern = PatternRecord::Product(factors);
        let product = TextureRecord { pattern, to_pattern: Affine2::IDENTITY };
        let product = textures.records.push(product);
        let parts = [Factor::Texture(colors), Factor::Value(Spectrum::rgb(0.2, 3.0, 0.5))];
        let pattern = PatternRecord::Blend(parts, Varying::Texture(colors));
        let blend = TextureRecord { pattern, to_pattern: Affine2::IDENTITY };
        let blend = textures.records.push(blend);
        (textures, [colors, product, blend])
    }

    /// The point of that triangle with these coordinates.
    fn on_triangle(uv: Vec2) -> Parametrization {
        let corner = Vec2::new(0.1, 0.05);
        let uv_edges = [Vec2::new(0.5, 0.2), Vec2::new(-0.1, 0.6)];
        let determinant = uv_edges[0].perp_dot(uv_edges[1]);
        let d = uv - corner;
        let barycentric = Vec2::new(d.perp_dot(uv_edges[1]), uv_edges[0].perp_dot(d)) / determinant;
        let on_triangle = Some(OnTriangle { triangle: 1, barycentric, uv_edges });
        Parametrization { on_triangle, ..Parametrization::of(uv) }
    }

    /// Of colours at vertices, of their product with an image, and of what is between them and another colour, by themselves.
    #[test]
    fn gradients_on_triangles_are_differences() {
        const STEP: f32 = 1e-3;
        let (textures, ids) = textures_of_a_triangle();
        for id in ids {
            for (u, v) in [(0.2, 0.2), (0.3, 0.4), (0.25, 0.33)] {
                let at = |du: f32, dv: f32| {
                    textures.color(id, &on_triangle(Vec2::new(u + du, v + dv))).luminance()
                };
                let along_u = (at(STEP, 0.0) - at(-STEP, 0.0)) / (2.0 * STEP);
                let along_v = (at(0.0, STEP) - at(0.0, -STEP)) / (2.0 * STEP);
                let g = textures.gradient(id, &on_triangle(Vec2::new(u, v)));
                assert!(g.length() > 0.1, "{g}");
                assert!((g - Vec2::new(along_u, along_v)).length() < 0.01, "{u} {v}: {g}");
            }
        }
    }

    /// By a texture, the share is one or the other or between, and what is beyond 1 is 1.
    #[test]
    fn blends_are_between_what_their_parts_show() {
        let (white, dark) = (Spectrum::ONE, Spectrum::rgb(0.5, 0.25, 0.125));
        let mut textures = Textures::default();
        let mut add = |pattern| {
            textures.records.push(TextureRecord { pattern, to_pattern: Affine2::IDENTITY })
        };
        let squares = add(PatternRecord::Checkerboard([Spectrum::ZERO, white * 2.0]));
        let parts = [Factor::Value(white), Factor::Value(dark)];
        let by_squares = add(PatternRecord::Blend(parts, Varying::Texture(squares)));
        let half = add(PatternRecord::Blend(parts, Varying::Value(0.5)));
        let at = |id, u: f32| textures.color(id, &Parametrization::of(Vec2::new(u, 0.25)));
        assert_eq!([at(by_squares, 0.25), at(by_squares, 0.75)], [white, dark]);
        assert_eq!(at(half, 0.25), Spectrum::rgb(0.75, 0.625, 0.5625));
    }

    #[test]
    fn gradients_are_differences() {
        const STEP: f32 = 1e-3;
        let t = image(&[0.3, 1.0, 2.5, 3.0, -4.0, 5.0, 0.5, 0.25, 1.0], 3);
        for (u, v) in [(0.2, 0.3), (0.45, 0.8), (0.7, 0.55), (0.02, 0.97)] {
            let at =
                |du: f32, dv: f32| t.bilinear(Vec2::new(u + du, v + dv), Wrap::Repeat).luminance();
            let g = t.gradient(Vec2::new(u, v), Wrap::Repeat, Spectrum::luminance);
            let g = Vec2::from(g);
            let along_u = (at(STEP, 0.0) - at(-STEP, 0.0)) / (2.0 * STEP);
            let along_v = (at(0.0, STEP) - at(0.0, -STEP)) / (2.0 * STEP);
            assert!((g - Vec2::new(along_u, along_v)).length() < 0.02, "{u} {v}: {g}");
        }
    }
}
