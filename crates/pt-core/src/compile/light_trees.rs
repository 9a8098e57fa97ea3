//! Trees for many lights.

use super::emitters::emitter_triangles;
use super::lights::Lights;
use super::shapes::{Emitter, ShapePrimitives, Shapes};
use crate::id::{Id, Table};
use crate::light::tree::{LightTree, TreeLight};
use crate::light::{AnyLight, EmitterTree, InvisibleLight, LightTables, PointLightTree};

/// Number of emissive triangles per individually sampled light, above which a tree chooses among
/// them.
const TRIANGLES_PER_LIGHT: usize = 8;

/// Lights that move into trees, each with its primitive.
struct LightTreePlan {
    extended: Vec<(TreeLight, Option<u32>)>,
    hidden: Vec<(TreeLight, Option<u32>)>,
    points: Vec<(TreeLight, Option<u32>)>,
}

impl Lights {
    /// Moves lights into trees if there are more than `most`, or if they have many triangles. A
    /// tree selects one light per sample: there is one tree of lights with an extent, one of
    /// invisible lights, and one of lights without extent.
    pub(super) fn plant_trees(&mut self, shapes: &mut Shapes, most: usize) {
        let LightTreePlan { extended, hidden, points } = self.plan(shapes, most);
        if extended.is_empty() && hidden.is_empty() && points.is_empty() {
            return;
        }
        let plants_points = !points.is_empty();
        let mut emits = vec![false; self.table.as_slice().len()];
        let of_shapes = shapes.surfaces.as_slice().iter().filter_map(|surface| surface.light);
        of_shapes.for_each(|id| emits[id.index()] = true);
        let tables = &self.tables;
        let goes = |id: Id<AnyLight>, light: &AnyLight| {
            if is_point(light, tables) {
                !points.is_empty()
            } else {
                let tree = if light.is_invisible() { &hidden } else { &extended };
                !tree.is_empty() && emits[id.index()]
            }
        };
        let mut table = Table::default();
        let stays = self.table.iter().map(|(id, light)| (!goes(id, light)).then_some(*light));
        let moved: Vec<_> = stays.map(|light| light.map(|light| table.push(light))).collect();
        for sky in &mut self.infinite {
            *sky = moved[sky.index()].expect("skies are in no tree");
        }
        if !extended.is_empty() || !hidden.is_empty() {
            self.tables.triangles.clear();
            self.tables.triangle_choice.clear();
        }
        let mut plant =
            |lights: Vec<_>| (!lights.is_empty()).then(|| EmitterTree { tree: self.plant(lights) });
        let all = plant(extended).map(|many| table.push(many.into()));
        let all_hidden =
            plant(hidden).map(|many| table.push(InvisibleLight::EmitterTree(many).into()));
        if !points.is_empty() {
            table.push(PointLightTree { tree: self.plant(points) }.into());
        }
        for emitter in &shapes.emitters {
            let light = &mut shapes.surfaces[emitter.surface].light;
            let all = if emitter.emission.is_invisible { all_hidden } else { all };
            *light = light.and_then(|old| moved[old.index()].or(all));
        }
        self.follow_origins(&moved, table.as_slice().len(), plants_points);
        self.hidden = moved.len() - table.as_slice().len();
        self.table = table;
    }

    /// Updates the nodes from which lights come: moves each to the new place of its light in a
    /// table of `count`, or to the points if its light went into their tree.
    fn follow_origins(
        &mut self,
        moved: &[Option<Id<AnyLight>>],
        count: usize,
        plants_points: bool,
    ) {
        let before = std::mem::replace(&mut self.origins.lights, vec![None; count]);
        let before = before.into_iter().chain(std::iter::repeat(None));
        for ((node, light), moved) in before.zip(self.table.as_slice()).zip(moved) {
            match moved {
                Some(moved) => self.origins.lights[moved.index()] = node,
                None if plants_points && is_point(light, &self.tables) => {
                    self.origins.points.extend(node);
                }
                None => {}
            }
        }
    }

    /// Selects the lights that go into trees.
    fn plan(&self, shapes: &Shapes, most: usize) -> LightTreePlan {
        let of = |is_invisible: bool| {
            let emitters =
                shapes.emitters.iter().filter(|e| e.emission.is_invisible == is_invisible);
            emitters.flat_map(|e| self.tree_lights(shapes, e)).collect()
        };
        let [mut extended, mut hidden]: [Vec<_>; 2] = [false, true].map(of);
        let triangles = extended.len() + hidden.len();
        let many_triangles = triangles > most.saturating_mul(TRIANGLES_PER_LIGHT);
        if shapes.emitters.len() <= most && !many_triangles {
            extended.clear();
            hidden.clear();
        }
        let all = self.table.as_slice().iter().filter(|light| is_point(light, &self.tables));
        let mut points: Vec<_> = all.map(|light| (TreeLight::Other(*light), None)).collect();
        if points.len() <= most {
            points.clear();
        }
        LightTreePlan { extended, hidden, points }
    }

    /// Adds a tree, and returns its index.
    fn plant(&mut self, lights: Vec<(TreeLight, Option<u32>)>) -> u32 {
        let tree = LightTree::new(lights, &self.tables);
        self.tables.trees.push(tree);
        self.tables.trees.len() as u32 - 1
    }

    /// Lights of an emitter, and their primitives.
    fn tree_lights(&self, shapes: &Shapes, emitter: &Emitter) -> Vec<(TreeLight, Option<u32>)> {
        let light = shapes.surfaces[emitter.surface].light;
        let Some(light) = light.map(|id| self.table[id].shown()) else { return Vec::new() };
        let radiance = emitter.emission.radiance;
        match &emitter.primitives {
            ShapePrimitives::Triangles(runs) => {
                let numbers = runs.iter().flat_map(Clone::clone).map(|i| Some(i as u32));
                let triangles = emitter_triangles(shapes, runs, emitter.emission.coat);
                let triangles = triangles.into_iter().zip(0..);
                let tree_light = |(t, i)| match light {
                    AnyLight::TexturedMesh(mesh) => TreeLight::Textured(t, mesh.textured + i),
                    _ => TreeLight::Triangle(t, radiance),
                };
                let lights = triangles.zip(numbers).filter(|((t, _), _)| t.area() > 0.0);
                lights.map(|(triangle, number)| (tree_light(triangle), number)).collect()
            }
            &ShapePrimitives::Sphere(s) => {
                let number = (shapes.counts()[0] + s) as u32;
                vec![(TreeLight::Other(light), Some(number))]
            }
        }
    }
}

fn is_point(light: &AnyLight, tables: &LightTables) -> bool {
    light.is_delta() && light.bounds(tables).is_some()
}
