//! Triangles with an emission texture.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::distribution::AliasTable;
use pt_math::{Area, Pdf, SolidAngle, Spectrum, Vec2, Vec3};

use super::emitter_triangle::EmitterTriangle;
#[cfg(test)]
use super::emitter_triangle::of_triangle;
#[cfg(test)]
use super::laws::{LightGeometry, LightLaws};
use super::tree::LightBounds;
use super::triangle_choice::{ChosenPoint, TriangleChoice};
use super::triangle_point::{LitTriangle, NEAR};
use super::{Light, LightHit, LightSample, LightSampleContext, LightTables};
use crate::id::Id;
use crate::texture::Textures;
use crate::texture_eval_context::{OnTriangle, TextureEvalContext};
use crate::texture_record::TextureRecord;

/// Texture mapping of an emissive triangle.
#[derive(Clone, Copy, Debug)]
pub struct TexturedTriangle {
    /// Texture of the radiance of the emitting side.
    pub texture: Id<TextureRecord>,
    /// Texture coordinates of the corners.
    pub uvs: [Vec2; 3],
    /// Number of the primitive in the scene.
    pub primitive: u32,
    /// Approximate mean luminance, by which the triangle is chosen; positive unless the whole
    /// light is black.
    pub mean: f32,
}

impl TexturedTriangle {
    /// Radiance at the point p₀ + b₁ e₁ + b₂ e₂ of this triangle.
    pub fn radiance(
        &self,
        textures: &Textures,
        triangle: &EmitterTriangle,
        [b1, b2]: [f32; 2],
    ) -> Spectrum {
        let [c0, c1, c2] = self.uvs;
        let on_triangle = OnTriangle {
            triangle: self.primitive,
            barycentric: Vec2::new(b1, b2),
            uv_edges: [c1 - c0, c2 - c0],
        };
        let uv = c0 * (1.0 - b1 - b2) + c1 * b1 + c2 * b2;
        let point = triangle.p0 + triangle.e1 * b1 + triangle.e2 * b2;
        let on_triangle = Some(on_triangle);
        let normal = triangle.normal;
        let at = TextureEvalContext { point, normal, on_triangle, ..TextureEvalContext::of(uv) };
        textures.radiance(self.texture, &at)
    }
}

/// Triangles with an emission texture. One of them is chosen by its area times its mean luminance,
/// and a point of it as for [`super::MeshLight`].
#[derive(Clone, Copy, Debug)]
pub struct TexturedMesh {
    /// First of its triangles in [`LightTables::triangles`].
    pub first: u32,
    /// First of its triangles in [`LightTables::textured_triangles`], where they are in the order
    /// of their primitives.
    pub textured: u32,
    /// Number of triangles.
    pub count: u32,
    /// Index of its sampling table of triangles in [`LightTables::triangle_choice`].
    pub choice: u32,
}

impl TexturedMesh {
    /// Adds triangles and their texture mappings to the tables; `None` if they have no area, or no
    /// light was found on them.
    pub fn new(
        tables: &mut LightTables,
        triangles: &[EmitterTriangle],
        textured: &[TexturedTriangle],
    ) -> Option<Self> {
        let pairs = triangles.iter().zip(textured);
        let powers: Vec<f32> = pairs.map(|(t, laid)| t.area() * laid.mean).collect();
        let choice = AliasTable::new(&powers)?;
        let light = Self {
            first: tables.triangles.len() as u32,
            textured: tables.textured_triangles.len() as u32,
            count: textured.len() as u32,
            choice: tables.triangle_choice.len() as u32,
        };
        tables.triangles.extend_from_slice(triangles);
        tables.textured_triangles.extend_from_slice(textured);
        tables.triangle_choice.push(choice);
        Some(light)
    }

    fn triangles<'t>(&self, tables: &'t LightTables) -> TriangleChoice<'t> {
        TriangleChoice {
            table: &tables.triangle_choice[self.choice as usize],
            triangles: &tables.triangles[self.first as usize..],
            near: NEAR,
        }
    }

    /// Returns the light sample of a point.
    fn of_point(&self, tables: &LightTables, chosen: &ChosenPoint) -> Option<LightSample> {
        let &ChosenPoint { ref point, triangle, index, probability } = chosen;
        let laid = &tables.textured_triangles[self.textured as usize + index];
        point.light_sample(
            triangle,
            |barycentric| laid.radiance(&tables.textures, triangle, barycentric),
            probability,
            || Pdf::new(probability / triangle.area()),
        )
    }

    /// Returns the index among its triangles of a primitive, or `None` if it is none of them.
    fn number(&self, tables: &LightTables, primitive: u32) -> Option<usize> {
        let first = self.textured as usize;
        let own = &tables.textured_triangles[first..first + self.count as usize];
        own.binary_search_by_key(&primitive, |t| t.primitive).ok()
    }
}

impl Light for TexturedMesh {
    const DELTA: bool = false;

    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        self.of_point(tables, &self.triangles(tables).sample(context.p, u))
    }

    fn sample_each(
        &self,
        tables: &LightTables,
        points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        let finish = |chosen: &ChosenPoint| self.of_point(tables, chosen);
        self.triangles(tables).sample_each(points, samples, finish);
    }

    fn pdf(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        _: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        let Some(hit) = hit else { return Pdf::ZERO };
        let Some(i) = self.number(tables, hit.primitive) else { return Pdf::ZERO };
        let probability = tables.triangle_choice[self.choice as usize].probability(i);
        let triangle = &tables.triangles[self.first as usize + i];
        let solid_angle = LitTriangle::new(triangle, context.p).solid_angle(NEAR);
        if solid_angle > 0.0 {
            return Pdf::new(probability / solid_angle);
        }
        Pdf::<Area>::new(probability / triangle.area())
            .to_solid_angle(hit.distance_squared, hit.cos)
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// A square of side 2 at height 2 that faces down, of four triangles with colours at their
    /// corners, one of which is nearly black.
    fn examples() -> Vec<(Self, LightTables)> {
        let corner = |x, z| Vec3::new(x, 2.0, z);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let inner = corner(0.5, 0.2);
        let triangles = [0, 1, 2, 3].map(|i: usize| EmitterTriangle {
            p0: inner,
            e1: corners[i] - inner,
            e2: corners[(i + 1) % 4] - inner,
            normal: Vec3::NEG_Y,
            coat: 0.0,
        });
        let colors = [[0.0; 3], [0.0; 3], [3.0, 2.0, 1.0], [1.0, 4.0, 0.5], [0.05; 3]];
        let (texture, textures) = Textures::of_vertices(
            colors.map(Spectrum::from).into(),
            vec![[4, 0, 1], [4, 1, 2], [4, 2, 3], [4, 3, 0]],
        );
        let laid: Vec<_> = [0.02, 0.9, 2.0, 0.5]
            .into_iter()
            .zip(0..)
            .map(|(mean, primitive)| TexturedTriangle {
                texture,
                uvs: [Vec2::ZERO, Vec2::X, Vec2::Y],
                primitive,
                mean,
            })
            .collect();
        let mut tables = LightTables { textures: textures.into(), ..LightTables::default() };
        let light = Self::new(&mut tables, &triangles, &laid);
        light.map(|light| (light, tables)).into_iter().collect()
    }
}

#[cfg(test)]
impl LightLaws for TexturedMesh {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, tables: &LightTables) -> LightGeometry {
        let triangles = tables.triangles.iter().zip(&tables.textured_triangles);
        LightGeometry::Triangles(triangles.map(|(t, of)| (*t, of.primitive)).collect())
    }

    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        let triangles = tables.triangles.iter().zip(&tables.textured_triangles);
        triangles.map(|(t, of)| of_textured_triangle(tables, t, of, p, n)).sum()
    }
}

/// Midpoint rule over many parts; radiance is linear over the triangles of the example.
#[cfg(test)]
fn of_textured_triangle(
    tables: &LightTables,
    t: &EmitterTriangle,
    laid: &TexturedTriangle,
    p: DVec3,
    n: DVec3,
) -> f64 {
    const PARTS: u16 = 64;
    let h = 1.0 / f32::from(PARTS);
    let part = |i: u16, j: u16, sign: f32| {
        let [b1, b2] = [i, j].map(|k| f32::from(k) * h);
        let p0 = t.p0 + t.e1 * b1 + t.e2 * b2;
        let small = EmitterTriangle { p0, e1: t.e1 * (h * sign), e2: t.e2 * (h * sign), ..*t };
        let middle = [b1 + sign * h / 3.0, b2 + sign * h / 3.0];
        let radiance = laid.radiance(&tables.textures, t, middle).luminance();
        f64::from(radiance) * of_triangle(&small, p, n)
    };
    let upright = (0..PARTS).flat_map(|i| (0..PARTS - i).map(move |j| (i, j, 1.0)));
    let turned = (1..PARTS).flat_map(|i| (1..=PARTS - i).map(move |j| (i, j, -1.0)));
    upright.chain(turned).map(|(i, j, sign)| part(i, j, sign)).sum()
}
