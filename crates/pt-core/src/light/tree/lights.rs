//! Light trees as lights of a scene.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::{EmitterTree, LightBounds, LightTree, PointLightTree, TreeLight};
use crate::light::emitter_triangle::EmitterTriangle;
#[cfg(test)]
use crate::light::emitter_triangle::of_triangle;
#[cfg(test)]
use crate::light::laws::{LightGeometry, LightLaws, inverse_square, level};
use crate::light::{Light, LightHit, LightSample, LightSampleContext, LightTables};

/// Methods of [`Light`] that are the same for both kinds of trees, which are in no tree themselves.
macro_rules! sampled_by_tree {
    () => {
        fn sample(
            &self,
            tables: &LightTables,
            context: &LightSampleContext,
            u: [f32; 2],
        ) -> Option<LightSample> {
            tables.trees[self.tree as usize].sample_one(tables, context, u)
        }

        fn sample_each(
            &self,
            tables: &LightTables,
            points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
            samples: &mut Vec<Option<LightSample>>,
        ) {
            tables.trees[self.tree as usize].sample_each(tables, points, samples);
        }

        fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
            None
        }
    };
}

impl Light for EmitterTree {
    const DELTA: bool = false;

    sampled_by_tree!();

    fn pdf(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        wi: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        let tree = &tables.trees[self.tree as usize];
        hit.map_or(Pdf::ZERO, |hit| tree.pdf(tables, context, wi, hit))
    }

    fn examples() -> Vec<(Self, LightTables)> {
        let trees = vec![LightTree::new(example_of_squares(), &LightTables::default())];
        vec![(Self { tree: 0 }, LightTables { trees, ..LightTables::default() })]
    }
}

#[cfg(test)]
impl LightLaws for EmitterTree {
    fn depends_on_surface(&self) -> bool {
        true
    }

    fn geometry(&self, tables: &LightTables) -> LightGeometry {
        let triangles = tables.trees[self.tree as usize].primitives();
        LightGeometry::Triangles(triangles.map(|(t, _, primitive)| (*t, primitive)).collect())
    }

    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        let triangles = tables.trees[self.tree as usize].primitives();
        triangles.map(|(t, radiance, _)| level(radiance) * of_triangle(t, p, n)).sum()
    }
}

impl Light for PointLightTree {
    const DELTA: bool = true;

    sampled_by_tree!();

    fn examples() -> Vec<(Self, LightTables)> {
        let trees = vec![LightTree::new(example_of_points(), &LightTables::default())];
        vec![(Self { tree: 0 }, LightTables { trees, ..LightTables::default() })]
    }
}

#[cfg(test)]
impl LightLaws for PointLightTree {
    fn depends_on_surface(&self) -> bool {
        true
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    /// The point light of the example.
    fn irradiance(&self, _: &LightTables, p: DVec3, n: DVec3) -> f64 {
        3.0 * inverse_square(Vec3::new(0.1, 2.5, 0.3), p, n)
    }
}

/// Two squares at height 2, one of them brighter, each of four triangles that face down.
fn example_of_squares() -> Vec<(TreeLight, Option<u32>)> {
    let square = |x: f32, half: f32, radiance: f32| {
        let corner = move |i: f32, j: f32| Vec3::new(x + i * half, 2.0, j * half);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let inner = corner(0.5, 0.2);
        (0..4).map(move |i| {
            let triangle = EmitterTriangle {
                p0: inner,
                e1: corners[i] - inner,
                e2: corners[(i + 1) % 4] - inner,
                normal: Vec3::NEG_Y,
                coat: 0.0,
            };
            TreeLight::Triangle(triangle, Spectrum::splat(radiance))
        })
    };
    let lights = square(0.0, 1.0, 2.0).chain(square(3.0, 0.5, 5.0));
    lights.zip(7..).map(|(light, primitive)| (light, Some(primitive))).collect()
}

/// One point light: the laws of lights without extent hold for a single light.
fn example_of_points() -> Vec<(TreeLight, Option<u32>)> {
    let position = Vec3::new(0.1, 2.5, 0.3);
    let point = crate::light::PointLight { position, intensity: Spectrum::splat(3.0) };
    vec![(TreeLight::Other(point.into()), None)]
}

#[cfg(test)]
impl LightTree {
    /// Returns the triangles of constant radiance, with their primitives.
    fn primitives(&self) -> impl Iterator<Item = (&EmitterTriangle, Spectrum, u32)> {
        self.light_of.iter().zip(self.first_primitive..).filter_map(
            |(&light, primitive)| match self.lights.get(light as usize)? {
                TreeLight::Triangle(t, radiance) => Some((t, *radiance, primitive)),
                TreeLight::Textured(..) | TreeLight::Other(_) => None,
            },
        )
    }
}
