//! Compiled textures.

use std::sync::Arc;

use pt_math::{Affine2, Spectrum, Vec2, Vec3};
use pt_scene::Points;
use pt_scene::texture::{Filter, Wrap};

use crate::id::{Id, Table};
use crate::image_texture::Texels;
use crate::medium::WorldGrid;
use crate::shapes::FLAT;
use crate::texture_eval_context::{OnTriangle, TextureEvalContext};
use crate::texture_record::{
    Factor, FloatTexture, MappedPattern, MappedTexture, PatternRecord, TextureMappingRecord,
    TextureRecord,
};

/// All textures, without duplicates of images.
#[derive(Default)]
pub struct Textures {
    /// The textures.
    pub records: Table<TextureRecord>,
    /// Patterns with another mapping, or procedural ones.
    pub laid: Table<MappedTexture>,
    /// Images of the textures.
    pub texels: Table<Arc<Texels>, Texels>,
    /// Grids of the textures.
    pub grids: Vec<WorldGrid>,
    /// Colours and named values of meshes that the textures use.
    pub mesh_colors: Vec<MeshColors>,
    /// True if any texture is filtered by the footprint.
    pub uses_footprints: bool,
}

/// Colours of meshes, or other values of them.
#[derive(Default)]
pub struct MeshColors {
    /// Colours of vertices.
    pub vertices: Vec<Spectrum>,
    /// Indices of the corners of each triangle into the vertices, or [`FLAT`]; may be shorter than
    /// the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Colours of triangles; may be shorter than the triangles.
    pub faces: Vec<Spectrum>,
    /// Points with the index of their first sphere, in the order of these.
    pub points: Vec<(u32, Arc<Points>)>,
}

impl MeshColors {
    /// Colours at the corners of a triangle; black without any.
    #[inline]
    fn corners(&self, triangle: u32) -> [Spectrum; 3] {
        match self.triangles.get(triangle as usize) {
            Some(corners) if *corners != FLAT => corners.map(|i| self.vertices[i as usize]),
            _ => [Spectrum::ZERO; 3],
        }
    }

    /// Interpolated colour of a point on a triangle.
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

    /// Colour of a sphere; black without any.
    fn of_sphere(&self, sphere: u32) -> Spectrum {
        let run = self.points.partition_point(|(first, _)| *first <= sphere);
        let color = || {
            let (first, points) = self.points.get(run.checked_sub(1)?)?;
            points.colors.as_ref()?.get((sphere - first) as usize).copied()
        };
        color().map_or(Spectrum::ZERO, Spectrum::from)
    }

    /// Derivatives of [`Self::at_vertices`] by u and v, by the inverse of the derivatives of these
    /// along the edges.
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
            + self.points.iter().map(|(_, points)| 12 * points.positions.len()).sum::<usize>()
    }
}

impl Textures {
    /// Colour of a texture at a point of a surface.
    #[inline]
    pub fn color(&self, id: Id<TextureRecord>, at: &TextureEvalContext) -> Spectrum {
        let TextureRecord { pattern, to_pattern } = self.records[id];
        let uv = to_pattern.transform_point2(at.uv);
        match pattern {
            PatternRecord::VertexColors(_) | PatternRecord::FaceColors(_) => {
                self.color_of_mesh(pattern, at)
            }
            PatternRecord::Product(factors) => self.product(factors, at),
            PatternRecord::Blend(parts, share) => self.blend(parts, share, at),
            PatternRecord::Root(square) => self.root(square, at),
            PatternRecord::Laid(laid) => self.laid(laid, at),
            PatternRecord::Facing(along) => Spectrum::ONE * at.normal.dot(along).abs().min(1.0),
            flat => self.flat(flat, uv, || {
                at.footprint_on_surface().map(|axis| to_pattern.transform_vector2(axis))
            }),
        }
    }

    /// Colour of an image or checkerboard; `axes` returns the axes of the footprint.
    #[inline(always)]
    fn flat(&self, pattern: PatternRecord, uv: Vec2, axes: impl FnOnce() -> [Vec2; 2]) -> Spectrum {
        match pattern {
            PatternRecord::Bitmap(texels, wrap, Filter::Bilinear) => {
                self.texels[texels].bilinear(uv, wrap)
            }
            PatternRecord::Bitmap(texels, wrap, Filter::Nearest) => {
                self.texels[texels].nearest(uv, wrap)
            }
            PatternRecord::Bitmap(texels, wrap, Filter::Trilinear) => {
                self.texels[texels].trilinear(uv, wrap, axes())
            }
            PatternRecord::Checkerboard([same, other]) => {
                let high = (uv - uv.floor()).cmpgt(Vec2::splat(0.5));
                if high.test(0) == high.test(1) { same } else { other }
            }
            _ => Spectrum::ZERO,
        }
    }

    /// Mapping of a texture at a point. A mapping by values of the mesh is converted to surface
    /// coordinates with a transform, which is constant on each triangle.
    fn laid_at(&self, id: Id<MappedTexture>, at: &TextureEvalContext) -> MappedTexture {
        let laid = self.laid[id];
        let TextureMappingRecord::Values(values) = laid.layout else { return laid };
        let Some(triangle) = &at.on_triangle else { return laid };
        let values = &self.mesh_colors[values as usize];
        let [u, v] = values.gradient(triangle).map(|value| value.0.truncate());
        let there = values.at_vertices(triangle).0.truncate();
        let to_values = Affine2::from_cols(u, v, there - u * at.uv.x - v * at.uv.y);
        let to_pattern = laid.to_pattern * to_values;
        MappedTexture { layout: TextureMappingRecord::Surface, to_pattern, ..laid }
    }

    #[inline(never)]
    fn laid(&self, id: Id<MappedTexture>, at: &TextureEvalContext) -> Spectrum {
        let laid = self.laid_at(id, at);
        match laid.pattern {
            MappedPattern::Procedural(pattern) => laid.computed(pattern, at),
            MappedPattern::Grid(grid) => self.grids[grid as usize].color(laid.at(at)),
            MappedPattern::Flat(flat) => {
                self.flat(flat, laid.at(at).truncate(), || laid.footprint(at).map(Vec3::truncate))
            }
        }
    }

    #[inline(never)]
    fn root(&self, square: Factor, at: &TextureEvalContext) -> Spectrum {
        self.factor(square, at).map(|c| c.max(0.0).sqrt())
    }

    /// Colour of a mesh or of points; black without any.
    fn color_of_mesh(&self, pattern: PatternRecord, at: &TextureEvalContext) -> Spectrum {
        if let (PatternRecord::VertexColors(i), Some(sphere)) = (pattern, at.sphere) {
            return self.mesh_colors[i as usize].of_sphere(sphere);
        }
        let Some(at) = &at.on_triangle else { return Spectrum::ZERO };
        match pattern {
            PatternRecord::VertexColors(i) => self.mesh_colors[i as usize].at_vertices(at),
            PatternRecord::FaceColors(i) => self.mesh_colors[i as usize].of_face(at.triangle),
            _ => Spectrum::ZERO,
        }
    }

    #[inline(never)]
    fn product(&self, factors: [Factor; 2], at: &TextureEvalContext) -> Spectrum {
        let [a, b] = factors.map(|factor| self.factor(factor, at));
        a * b
    }

    /// At a weight of 0 or 1, only one of the two colours is evaluated.
    #[inline(never)]
    fn blend(
        &self,
        [first, second]: [Factor; 2],
        share: FloatTexture,
        at: &TextureEvalContext,
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

    fn factor(&self, factor: Factor, at: &TextureEvalContext) -> Spectrum {
        match factor {
            Factor::Value(value) => value,
            Factor::Texture(id) => self.color(id, at),
        }
    }

    /// Emitted radiance at a point of a surface; negative values become 0.
    pub fn radiance(&self, id: Id<TextureRecord>, at: &TextureEvalContext) -> Spectrum {
        Spectrum(self.color(id, at).0.max(Vec3::ZERO))
    }

    /// Value of a parameter at a point of a surface.
    #[inline]
    pub fn number(&self, varying: FloatTexture, at: &TextureEvalContext) -> f32 {
        match varying {
            FloatTexture::Value(v) => v,
            FloatTexture::Texture(id) => self.color(id, at).luminance(),
        }
    }

    /// Derivatives of the luminance by u and v of the surface, ignoring discontinuities. Patterns
    /// that depend on the normal of the shape count as constant, as they are on flat triangles.
    #[inline]
    pub fn gradient(&self, id: Id<TextureRecord>, at: &TextureEvalContext) -> Vec2 {
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

    /// Derivatives of each channel by u and v of the surface.
    fn color_gradient(&self, id: Id<TextureRecord>, at: &TextureEvalContext) -> [Spectrum; 2] {
        let TextureRecord { pattern, to_pattern } = self.records[id];
        match (pattern, &at.on_triangle) {
            (PatternRecord::Bitmap(texels, wrap, Filter::Bilinear | Filter::Trilinear), _) => {
                let uv = to_pattern.transform_point2(at.uv);
                let [u, v] = self.texels[texels].gradient(uv, wrap, |color| color);
                let [s, t] = [to_pattern.matrix2.x_axis, to_pattern.matrix2.y_axis];
                [u * s.x + v * s.y, u * t.x + v * t.y]
            }
            (PatternRecord::VertexColors(i), Some(at)) => self.mesh_colors[i as usize].gradient(at),
            (PatternRecord::Laid(laid), _) => self.laid_gradient(laid, at),
            (PatternRecord::Root(square), _) => {
                let root = self.root(square, at);
                let per_square = root.map(|c| if c > 0.0 { 0.5 / c } else { 0.0 });
                self.factor_gradient(square, at).map(|grows| grows * per_square)
            }
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
                    FloatTexture::Texture(id) if (0.0..=1.0).contains(&t) => self.gradient(id, at),
                    _ => Vec2::ZERO,
                };
                let t = t.clamp(0.0, 1.0);
                let along = |i: usize| da[i] * (1.0 - t) + db[i] * t + difference * dt[i];
                [along(0), along(1)]
            }
            _ => [Spectrum::ZERO; 2],
        }
    }

    fn laid_gradient(&self, id: Id<MappedTexture>, at: &TextureEvalContext) -> [Spectrum; 2] {
        let laid = self.laid_at(id, at);
        match laid.pattern {
            MappedPattern::Procedural(pattern) => laid.slopes(pattern, at),
            MappedPattern::Grid(grid) => {
                let slopes = self.grids[grid as usize].slopes(laid.at(at));
                laid.along_surface(at).map(|step| {
                    let along = |axis: usize| slopes[axis] * step[axis];
                    along(0) + along(1) + along(2)
                })
            }
            MappedPattern::Flat(PatternRecord::Bitmap(
                texels,
                wrap,
                Filter::Bilinear | Filter::Trilinear,
            )) => {
                let uv = laid.at(at).truncate();
                let [u, v] = self.texels[texels].gradient(uv, wrap, |color| color);
                laid.along_surface(at).map(|step| u * step.x + v * step.y)
            }
            MappedPattern::Flat(_) => [Spectrum::ZERO; 2],
        }
    }

    /// Returns true if a texture and all of its parts are mapped in world space, so that surfaces
    /// need no coordinates.
    pub fn is_in_space(&self, id: Id<TextureRecord>) -> bool {
        let factor = |factor: Factor| match factor {
            Factor::Value(_) => true,
            Factor::Texture(id) => self.is_in_space(id),
        };
        match self.records[id].pattern {
            PatternRecord::Laid(laid) => {
                let layout = self.laid[laid].layout;
                !matches!(layout, TextureMappingRecord::Surface | TextureMappingRecord::Values(_))
            }
            PatternRecord::Facing(_) => true,
            PatternRecord::Product(factors) => factors.into_iter().all(factor),
            PatternRecord::Blend(parts, share) => {
                let share = match share {
                    FloatTexture::Value(_) => true,
                    FloatTexture::Texture(id) => self.is_in_space(id),
                };
                share && parts.into_iter().all(factor)
            }
            PatternRecord::Root(square) => factor(square),
            _ => false,
        }
    }

    fn factor_gradient(&self, factor: Factor, at: &TextureEvalContext) -> [Spectrum; 2] {
        match factor {
            Factor::Value(_) => [Spectrum::ZERO; 2],
            Factor::Texture(id) => self.color_gradient(id, at),
        }
    }

    /// Memory of all images and colours of meshes, in bytes.
    pub fn bytes(&self) -> usize {
        let images: usize = self.texels.as_slice().iter().map(|texels| texels.bytes()).sum();
        images + self.mesh_colors.iter().map(MeshColors::bytes).sum::<usize>()
    }
}

/// Collections of one texture, for the examples of lights.
impl Textures {
    fn of_one(mut self, pattern: PatternRecord) -> (Id<TextureRecord>, Self) {
        let record = TextureRecord { pattern, to_pattern: Affine2::IDENTITY };
        (self.records.push(record), self)
    }

    pub(crate) fn of_vertices(
        vertices: Vec<Spectrum>,
        triangles: Vec<[u32; 3]>,
    ) -> (Id<TextureRecord>, Self) {
        let mesh_colors = vec![MeshColors { vertices, triangles, ..MeshColors::default() }];
        Self { mesh_colors, ..Self::default() }.of_one(PatternRecord::VertexColors(0))
    }

    pub(crate) fn of_image(
        width: u32,
        height: u32,
        pixels: &[[f32; 3]],
    ) -> (Id<TextureRecord>, Self) {
        let mut textures = Self::default();
        let texels = textures.texels.push(Arc::new(Texels::new(width, height, pixels)));
        textures.of_one(PatternRecord::Bitmap(texels, Wrap::REPEAT, Filter::Bilinear))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One triangle with vertex colours, and a sheared mapping: the colours, their product with an
    /// image, and a blend of them with another colour, weighted by themselves.
    fn textures_of_a_triangle() -> (Textures, [Id<TextureRecord>; 3]) {
        let corners = [[0.1, 0.5, 0.9], [0.7, 0.2, 0.4], [0.3, 0.8, 0.6]].map(Spectrum::from);
        let triangles = vec![FLAT, [0, 1, 2]];
        let colors = MeshColors { vertices: corners.into(), triangles, ..MeshColors::default() };
        let mut textures = Textures { mesh_colors: vec![colors], ..Textures::default() };
        let texels = Texels::new(2, 2, &[0.3, 1.0, 0.5, 2.0].map(|v| [v; 3]));
        let texels = textures.texels.push(Arc::new(texels));
        let bitmap = PatternRecord::Bitmap(texels, Wrap::REPEAT, Filter::Bilinear);
        let to_pattern =
            Affine2::from_cols(Vec2::new(0.4, 0.3), Vec2::new(-0.2, 0.5), Vec2::new(0.1, 0.2));
        let colors = TextureRecord {
            pattern: PatternRecord::VertexColors(0),
            to_pattern: Affine2::IDENTITY,
        };
        let colors = textures.records.push(colors);
        let image = textures.records.push(TextureRecord { pattern: bitmap, to_pattern });
        let factors = [colors, image].map(Factor::Texture);
        let pattern = PatternRecord::Product(factors);
        let product = TextureRecord { pattern, to_pattern: Affine2::IDENTITY };
        let product = textures.records.push(product);
        let parts = [Factor::Texture(colors), Factor::Value(Spectrum::rgb(0.2, 3.0, 0.5))];
        let pattern = PatternRecord::Blend(parts, FloatTexture::Texture(colors));
        let blend = TextureRecord { pattern, to_pattern: Affine2::IDENTITY };
        let blend = textures.records.push(blend);
        (textures, [colors, product, blend])
    }

    /// Context of a point of that triangle with these coordinates.
    fn on_triangle(uv: Vec2) -> TextureEvalContext {
        let corner = Vec2::new(0.1, 0.05);
        let uv_edges = [Vec2::new(0.5, 0.2), Vec2::new(-0.1, 0.6)];
        let determinant = uv_edges[0].perp_dot(uv_edges[1]);
        let d = uv - corner;
        let barycentric = Vec2::new(d.perp_dot(uv_edges[1]), uv_edges[0].perp_dot(d)) / determinant;
        let on_triangle = Some(OnTriangle { triangle: 1, barycentric, uv_edges });
        TextureEvalContext { on_triangle, ..TextureEvalContext::of(uv) }
    }

    /// Tests vertex colours, their product with an image, and their blend with another colour,
    /// weighted by themselves.
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

    /// A textured weight is clamped to [0, 1], and a weight in between interpolates.
    #[test]
    fn blends_are_between_what_their_parts_show() {
        let (white, dark) = (Spectrum::ONE, Spectrum::rgb(0.5, 0.25, 0.125));
        let mut textures = Textures::default();
        let mut add = |pattern| {
            textures.records.push(TextureRecord { pattern, to_pattern: Affine2::IDENTITY })
        };
        let squares = add(PatternRecord::Checkerboard([Spectrum::ZERO, white * 2.0]));
        let parts = [Factor::Value(white), Factor::Value(dark)];
        let by_squares = add(PatternRecord::Blend(parts, FloatTexture::Texture(squares)));
        let half = add(PatternRecord::Blend(parts, FloatTexture::Value(0.5)));
        let at = |id, u: f32| textures.color(id, &TextureEvalContext::of(Vec2::new(u, 0.25)));
        assert_eq!([at(by_squares, 0.25), at(by_squares, 0.75)], [white, dark]);
        assert_eq!(at(half, 0.25), Spectrum::rgb(0.75, 0.625, 0.5625));
    }
}
