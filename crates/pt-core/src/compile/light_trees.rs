//! Trees for many lights.

use pt_bvh::Sphere;
use pt_math::Spectrum;

use super::geometry::{Emitter, Primitives, Shapes};
use super::lights::{Lights, emitter_triangles};
use crate::id::{Id, Table};
use crate::light::tree::{LightTree, TreeLight, is_bounded};
use crate::light::{AnyLight, InvisibleLight, ManyLights, ManyPoints, SphereLight};

/// Beyond how many triangles of lights, for each that lights may be single, a tree chooses among
/// them.
const TRIANGLES_PER_LIGHT: usize = 8;

/// What becomes of the lights.
struct Plan {
    extended: Vec<(TreeLight, Option<u32>)>,
    hidden: Vec<(TreeLight, Option<u32>)>,
    points: Vec<(TreeLight, Option<u32>)>,
}

impl Lights {
    /// Where lights in the scene are more than `most`, or the triangles of one of them are many,
    /// puts them into trees, from which one is chosen at a time: one tree of those that have an
    /// extent, one of those of them that nobody sees, and one of those that have none.
    pub(super) fn plant_trees(&mut self, shapes: &mut Shapes, most: usize) {
        let Plan { extended, hidden, points } = self.plan(shapes, most);
        if extended.is_empty() && hidden.is_empty() && points.is_empty() {
            return;
        }
        let plants_points = !points.is_empty();
        let mut emits = vec![false; self.table.as_slice().len()];
        let of_shapes = shapes.surfaces.as_slice().iter().filter_map(|surface| surface.light);
        of_shapes.for_each(|id| emits[id.index()] = true);
        let goes = |id: Id<AnyLight>, light: &AnyLight| {
            if is_point(light) {
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
            |lights: Vec<_>| (!lights.is_empty()).then(|| ManyLights { tree: self.plant(lights) });
        let all = plant(extended).map(|many| table.push(many.into()));
        let all_hidden =
            plant(hidden).map(|many| table.push(InvisibleLight::ManyLights(many).into()));
        if !points.is_empty() {
            table.push(ManyPoints { tree: self.plant(points) }.into());
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

    /// Keeps what lights were made of, where they moved to in a table of `count`, or, if points
    /// went into a tree, there.
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
                None if plants_points && is_point(light) => self.origins.points.extend(node),
                None => {}
            }
        }
    }

    /// Which lights go into trees.
    fn plan(&self, shapes: &Shapes, most: usize) -> Plan {
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
        let all = self.table.as_slice().iter().filter(|light| is_point(light));
        let mut points: Vec<_> = all.map(|light| (TreeLight::Other(*light), None)).collect();
        if points.len() <= most {
            points.clear();
        }
        Plan { extended, hidden, points }
    }

    /// The number of a new tree.
    fn plant(&mut self, lights: Vec<(TreeLight, Option<u32>)>) -> u32 {
        let tree = LightTree::new(lights, &self.tables);
        self.tables.trees.push(tree);
        self.tables.trees.len() as u32 - 1
    }

    /// The lights of an emitter and the primitives that they are.
    fn tree_lights(&self, shapes: &Shapes, emitter: &Emitter) -> Vec<(TreeLight, Option<u32>)> {
        let light = shapes.surfaces[emitter.surface].light;
        let Some(light) = light.map(|id| self.table[id].shown()) else { return Vec::new() };
        let radiance = emitter.emission.radiance;
        match &emitter.primitives {
            Primitives::Triangles(runs) => {
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
            &Primitives::Sphere(s) => {
                let number = (shapes.triangles.len() + s) as u32;
                vec![(TreeLight::Other(light), Some(number))]
            }
        }
    }
}

fn is_point(light: &AnyLight) -> bool {
    light.is_delta() && is_bounded(light)
}

/// The light of a glowing sphere.
pub(super) fn sphere_light(
    shapes: &Shapes,
    sphere: usize,
    radiance: Spectrum,
    coat: f32,
) -> SphereLight {
    let Sphere { center, radius } = shapes.spheres[sphere];
    SphereLight { center, radius: radius.abs(), radiance, inward: radius < 0.0, coat }
}
