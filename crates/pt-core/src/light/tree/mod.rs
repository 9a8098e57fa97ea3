//! Light trees: hierarchies by which one of many lights is chosen for each receiving point, by its
//! estimated contribution. [Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting"; without their splitting, as Pharr, Jakob & Humphreys, Physically Based
//! Rendering, 4th ed., §12.6.3]

mod bounds;
mod build;
mod lights;
mod node;

pub use bounds::LightBounds;
use node::{LightTreeNode, ReceiverLanes};
use pt_math::sampler::{LANES, Lanes};
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::emitter_triangle::EmitterTriangle;
use super::triangle_point::{
    LitTriangle, LitTriangles, NEAR, TrianglePoint, TrianglePoints, seen_area_pdf, seen_sample,
};
use super::{AnyLight, LightHit, LightSample, LightSampleContext, LightTables};

/// Light tree of emitters: lights with an extent, which rays hit.
#[derive(Clone, Copy, Debug)]
pub struct EmitterTree {
    /// Index into [`LightTables::trees`].
    pub tree: u32,
}

/// Light tree of lights without extent, which rays never hit.
#[derive(Clone, Copy, Debug)]
pub struct PointLightTree {
    /// Index into [`LightTables::trees`].
    pub tree: u32,
}

/// A light in a tree.
#[derive(Clone, Copy, Debug)]
pub enum TreeLight {
    /// A triangle of constant radiance.
    Triangle(EmitterTriangle, Spectrum),
    /// A triangle with an emission texture, and its index in [`LightTables::textured_triangles`].
    Textured(EmitterTriangle, u32),
    /// A sphere, or a light without extent, at a finite distance.
    Other(AnyLight),
}

/// A tree of lights, whose nodes have up to eight children.
#[derive(Debug)]
pub struct LightTree {
    /// Nodes; the root is the first.
    nodes: Vec<LightTreeNode>,
    /// Slot of each node in its parent; unused for the root.
    parents: Vec<ChildSlot>,
    lights: Vec<TreeLight>,
    /// Slot of each light.
    places: Vec<ChildSlot>,
    /// First primitive that is one of the lights.
    first_primitive: u32,
    /// Lights of the primitives from there on; `u32::MAX` for primitives that are no lights.
    light_of: Vec<u32>,
}

/// A child of a node.
#[derive(Clone, Copy, Debug)]
struct ChildSlot {
    node: u32,
    lane: u32,
}

impl LightTree {
    /// Builds a tree of lights, with the primitives of those that have one. `tables` contains the
    /// intensity profiles of luminaires.
    ///
    /// # Panics
    /// If there are no lights.
    pub fn new(lights: Vec<(TreeLight, Option<u32>)>, tables: &LightTables) -> Self {
        assert!(!lights.is_empty(), "a tree has lights");
        let primitives = || lights.iter().filter_map(|(_, primitive)| *primitive);
        let first_primitive = primitives().min().unwrap_or(0);
        let count = primitives().max().map_or(0, |last| (last - first_primitive) as usize + 1);
        let mut light_of = vec![u32::MAX; count];
        for (i, (_, primitive)) in lights.iter().enumerate() {
            if let Some(primitive) = primitive {
                light_of[(primitive - first_primitive) as usize] = i as u32;
            }
        }
        let lights: Vec<_> = lights.into_iter().map(|(light, _)| light).collect();
        let build::Built { nodes, parents, places } = build::build(&lights, tables);
        Self { nodes, parents, lights, places, first_primitive, light_of }
    }

    /// Chooses a light for each of up to [`BLOCK`] points, by the first of two random numbers in
    /// [0, 1).
    ///
    /// The points descend side by side, so that none waits for the cache misses of another, neither
    /// for nodes nor for lights.
    #[inline]
    fn choose(&self, points: &[(LightSampleContext, [f32; 2])]) -> [Option<Choice>; BLOCK] {
        let mut choices = [None; BLOCK];
        let mut under_way = [Descent::default(); BLOCK];
        for (i, (start, (_, u))) in under_way.iter_mut().zip(points).enumerate() {
            *start = Descent { point: i, node: 0, choice: Choice::start(u[0]) };
        }
        let mut count = points.len();
        while count > 0 {
            let mut going = 0;
            for i in 0..count {
                let Descent { point, node, choice } = under_way[i];
                let node = &self.nodes[node as usize];
                let lane = node.choose(&ReceiverLanes::new(&points[point].0), choice.rest);
                choices[point] = lane.map(|(lane, share, rest)| {
                    let (is_node, number) = node.child(lane);
                    let choice =
                        Choice { light: number, probability: choice.probability * share, rest };
                    under_way[going] = Descent { point, node: number, choice };
                    going += usize::from(is_node);
                    choice
                });
            }
            count = going;
            under_way[..count]
                .iter()
                .for_each(|on| pt_bvh::prefetch(&self.nodes, on.node as usize));
        }
        let chosen = choices.iter().flatten();
        chosen.for_each(|choice| pt_bvh::prefetch(&self.lights, choice.light as usize));
        choices
    }

    /// Probability with which [`Self::choose`] chooses a light.
    fn probability(&self, light: usize, context: &LightSampleContext) -> f32 {
        let receiver = ReceiverLanes::new(context);
        let mut slot = self.places[light];
        let mut probability = 1.0;
        loop {
            let node = slot.node as usize;
            probability *= self.nodes[node].share(&receiver, slot.lane as usize);
            if node == 0 {
                return probability;
            }
            slot = self.parents[node];
        }
    }

    /// Samples the chosen light with the numbers `u`; `on_triangle` samples a point of a triangle.
    #[inline(always)]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
        choice: &Choice,
        on_triangle: impl FnOnce(&EmitterTriangle) -> TrianglePoint,
    ) -> Option<LightSample> {
        let &Choice { light, probability, .. } = choice;
        let sample = match &self.lights[light as usize] {
            TreeLight::Triangle(triangle, radiance) => {
                seen_sample(&on_triangle(triangle), triangle, |_| *radiance)
            }
            TreeLight::Textured(triangle, laid) => {
                let laid = &tables.textured_triangles[*laid as usize];
                let radiance = |b| laid.radiance(&tables.textures, triangle, b);
                seen_sample(&on_triangle(triangle), triangle, radiance)
            }
            TreeLight::Other(light) => light.sample(tables, context, u),
        }?;
        Some(match sample.pdf {
            Some(pdf) => LightSample { pdf: Some(pdf.scaled_by(probability)), ..sample },
            None => LightSample { radiance: sample.radiance / probability, ..sample },
        })
    }

    /// Computes samples for many points.
    fn sample_each(
        &self,
        tables: &LightTables,
        mut points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        let mut block = [(LightSampleContext::in_space(Vec3::ZERO), [0.0; 2]); BLOCK];
        loop {
            let places = block.iter_mut().zip(&mut points);
            let count = places.map(|(place, point)| *place = point).count();
            if count == 0 {
                return;
            }
            let choices = self.choose(&block[..count]);
            let mut numbers = [[0.0; BLOCK]; 2];
            for (lane, ((_, u), choice)) in block[..count].iter().zip(&choices).enumerate() {
                let Some(choice) = choice else { continue };
                [numbers[0][lane], numbers[1][lane]] = choice.numbers(*u);
            }
            let found = self.on_triangles(&block[..count], &choices, &numbers);
            let chosen = block[..count].iter().zip(&choices).enumerate();
            samples.extend(chosen.map(|(lane, ((context, _), choice))| {
                let u = [numbers[0][lane], numbers[1][lane]];
                self.sample(tables, context, u, choice.as_ref()?, |_| found.get(lane))
            }));
        }
    }

    /// Samples a point of each chosen light that is a triangle.
    #[inline(always)]
    fn on_triangles(
        &self,
        points: &[(LightSampleContext, [f32; 2])],
        choices: &[Option<Choice>],
        numbers: &[Lanes<f32>; 2],
    ) -> TrianglePoints {
        let (mut lit, mut any) = (LitTriangles::ZERO, false);
        for (lane, ((context, _), choice)) in points.iter().zip(choices).enumerate() {
            let light = choice.map(|choice| &self.lights[choice.light as usize]);
            if let Some(TreeLight::Triangle(t, _) | TreeLight::Textured(t, _)) = light {
                lit.set(lane, LitTriangle::new(t, context.p));
                any = true;
            }
        }
        let mut found = TrianglePoints::ZERO;
        if any {
            lit.sample(NEAR, numbers, &mut found);
        }
        found
    }

    /// Computes a sample for one point.
    fn sample_one(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let [choice, ..] = self.choose(&[(*context, u)]);
        let choice = choice?;
        let u = choice.numbers(u);
        let on_triangle = |t: &EmitterTriangle| LitTriangle::new(t, context.p).sample(NEAR, u);
        self.sample(tables, context, u, &choice, on_triangle)
    }

    fn pdf(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        wi: Vec3,
        hit: LightHit,
    ) -> Pdf<SolidAngle> {
        let index = hit.primitive.wrapping_sub(self.first_primitive) as usize;
        let Some(&light) = self.light_of.get(index).filter(|&&light| light != u32::MAX) else {
            return Pdf::ZERO;
        };
        let of_light = match &self.lights[light as usize] {
            TreeLight::Triangle(..) | TreeLight::Textured(..) => seen_area_pdf(context.p, hit),
            TreeLight::Other(light) => light.pdf(tables, context, wi, Some(hit)),
        };
        of_light.scaled_by(self.probability(light as usize, context))
    }
}

/// A light chosen from a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// Index of the light in the tree.
    pub number: u32,
    /// Probability of the choice.
    pub probability: f32,
}

impl LightTree {
    /// Returns the light that [`sample`](super::Light::sample) chooses for these random numbers.
    pub fn chosen(&self, context: &LightSampleContext, u: [f32; 2]) -> Option<Chosen> {
        let [choice, ..] = self.choose(&[(*context, u)]);
        choice.map(|Choice { light, probability, .. }| Chosen { number: light, probability })
    }

    /// Returns the primitive of a light, or `None` if it has none.
    pub fn primitive(&self, number: u32) -> Option<u32> {
        let index = self.light_of.iter().position(|&light| light == number)?;
        Some(self.first_primitive + index as u32)
    }

    /// Returns, for each light, its primitive, if it has one.
    pub fn primitive_of_each(&self) -> Vec<Option<u32>> {
        let mut primitives = vec![None; self.lights.len()];
        for (primitive, &light) in (self.first_primitive..).zip(&self.light_of) {
            if let Some(of_light) = primitives.get_mut(light as usize) {
                *of_light = Some(primitive);
            }
        }
        primitives
    }

    /// Returns the number of lights.
    pub fn count(&self) -> usize {
        self.lights.len()
    }
}

/// Number of points that descend a tree side by side.
const BLOCK: usize = LANES;

/// A chosen light and its probability.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Choice {
    light: u32,
    probability: f32,
    /// Remapped random number in [0, 1).
    rest: f32,
}

/// A point that descends the tree.
#[derive(Clone, Copy, Default)]
struct Descent {
    point: usize,
    node: u32,
    choice: Choice,
}

impl Choice {
    /// Returns the initial choice with this random number.
    fn start(rest: f32) -> Self {
        Self { light: 0, probability: 1.0, rest }
    }

    /// Returns the random numbers for a point of the chosen light.
    #[inline(always)]
    fn numbers(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        [refined(self.rest, self.probability, [u, v]), v]
    }
}

/// Restores the digits of a random number that were used for a choice of this probability, by a
/// hash.
#[inline]
fn refined(rest: f32, probability: f32, [u, v]: [f32; 2]) -> f32 {
    const MAX: f32 = 1.0f32.next_down();
    const STEP: f32 = 1.0 / 16_777_216.0;
    let mut hash = u.to_bits().wrapping_mul(0x9E37_79B9) ^ v.to_bits();
    hash = (hash ^ (hash >> 16)).wrapping_mul(0x7FEB_352D);
    hash = (hash ^ (hash >> 15)).wrapping_mul(0x846C_A68B);
    let fraction = ((hash ^ (hash >> 16)) >> 8) as f32 * STEP;
    (rest + fraction * (STEP / probability)).min(MAX)
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::super::{PointLight, ReceiverSides, SphereLight, Spot};
    use super::*;

    /// Creates a point on a reflecting surface, on a transmitting one, or on none.
    fn random_lit(random: &mut Random, p: Vec3) -> LightSampleContext {
        match (3.0 * random.unit()) as u32 {
            0 => LightSampleContext::in_space(p),
            kind => LightSampleContext::on_surface(p, random.direction(), kind == 1),
        }
    }

    fn random_lights(random: &mut Random, n: usize) -> Vec<(TreeLight, Option<u32>)> {
        let light = |i: usize| {
            let position = random.in_cube() * 5.0;
            let intensity = Spectrum::splat(random.unit() + 0.01);
            let light = match i % 4 {
                0 => PointLight { position, intensity }.into(),
                1 => SphereLight {
                    center: position,
                    radius: 0.1 + random.unit(),
                    radiance: intensity,
                    inward: i % 8 == 1,
                    coat: 0.0,
                }
                .into(),
                2 => {
                    let falloff = super::super::Falloff::Linear { beam: 0.2, cutoff: 0.5 };
                    Spot { position, axis: random.direction(), intensity, falloff }.into()
                }
                _ => {
                    let (e1, e2) = (random.in_cube(), random.in_cube());
                    let normal = e1.cross(e2).normalize();
                    let triangle = EmitterTriangle { p0: position, e1, e2, normal, coat: 0.0 };
                    return (TreeLight::Triangle(triangle, intensity), None);
                }
            };
            (TreeLight::Other(light), None)
        };
        (0..n).map(light).collect()
    }

    /// Probabilities of all lights add up to 1, or to less if parts of the tree turn out to be
    /// dark. They are those with which lights are chosen, and not 0 for a light that illuminates
    /// the point.
    #[test]
    fn every_light_that_shines_is_chosen_as_often_as_it_says() {
        let mut random = Random::new(11);
        for n in [1, 2, 3, 17, 100] {
            let tree = LightTree::new(random_lights(&mut random, n), &LightTables::default());
            for _ in 0..20 {
                let p = random.in_cube() * 6.0;
                let context = random_lit(&mut random, p);
                let probabilities: Vec<_> = (0..n).map(|i| tree.probability(i, &context)).collect();
                let sum: f32 = probabilities.iter().sum();
                assert!(sum < 1.0 + 1e-4, "{n} {context:?}: {sum}");
                for (light, &probability) in tree.lights.iter().zip(&probabilities) {
                    let tables = LightTables::default();
                    let shines = (0..20).any(|_| {
                        let u = random.unit_2d();
                        let sample = match light {
                            TreeLight::Triangle(t, l) => {
                                let point = LitTriangle::new(t, p).sample(NEAR, u);
                                seen_sample(&point, t, |_| *l)
                            }
                            TreeLight::Textured(..) => unreachable!("there is no texture"),
                            TreeLight::Other(light) => light.sample(&tables, &context, u),
                        };
                        let cos = |wi: Vec3| match context.sides {
                            ReceiverSides::Front => context.normal.dot(wi),
                            ReceiverSides::Both | ReceiverSides::All => 1.0,
                        };
                        sample.is_some_and(|s| !s.radiance.is_black() && cos(s.wi) > 0.0)
                    });
                    assert!(probability > 0.0 || !shines, "{light:?} does not light {context:?}");
                }
                for _ in 0..50 {
                    let [choice, ..] = tree.choose(&[(context, random.unit_2d())]);
                    let Some(Choice { light, probability, rest }) = choice else {
                        assert!(sum < 1.0 - 1e-6, "nothing is chosen at {context:?}");
                        continue;
                    };
                    assert!((0.0..1.0).contains(&rest));
                    let want = probabilities[light as usize];
                    assert!((probability - want).abs() <= 1e-4 * want, "{probability} {want}");
                }
            }
        }
    }

    /// The choice for a point does not depend on the other points.
    #[test]
    fn points_go_down_by_themselves() {
        let mut random = Random::new(13);
        let tree = LightTree::new(random_lights(&mut random, 500), &LightTables::default());
        for count in [0, 1, 5, BLOCK] {
            let point = |_| {
                let p = random.in_cube() * 6.0;
                (random_lit(&mut random, p), random.unit_2d())
            };
            let points: Vec<_> = (0..count).map(point).collect();
            for (point, choice) in points.iter().zip(tree.choose(&points)) {
                assert_eq!(tree.choose(&[*point])[0], choice, "{point:?}");
            }
        }
    }

    /// Every light is in its slot, and every node but the root is, too.
    #[test]
    fn places_are_those_of_the_tree() {
        let mut random = Random::new(12);
        for n in [1, 8, 9, 64, 65, 1000] {
            let lights = random_lights(&mut random, n);
            let tree = LightTree::new(lights, &LightTables::default());
            let at = |slot: &ChildSlot| tree.nodes[slot.node as usize].child(slot.lane as usize);
            for (i, place) in (0..).zip(&tree.places) {
                assert_eq!(at(place), (false, i), "light of {n}");
            }
            for (i, parent) in (0..).zip(&tree.parents).skip(1) {
                assert_eq!(at(parent), (true, i), "node of {n}");
            }
        }
    }

    /// Lights that are all in one place, or accumulate at a point, do not make a deep tree.
    #[test]
    fn trees_of_equal_lights_are_flat() {
        let intensity = Spectrum::ONE;
        let light = |i: u32| {
            let position =
                if i < 5000 { Vec3::ONE } else { Vec3::X * 0.9f32.powi(i as i32 - 5000) };
            (TreeLight::Other(PointLight { position, intensity }.into()), None)
        };
        let tree = LightTree::new((0..5200).map(light).collect(), &LightTables::default());
        let depth = |mut place: ChildSlot| {
            let up = || {
                let node = place.node as usize;
                place = tree.parents[node];
                (node != 0).then_some(())
            };
            std::iter::from_fn(up).count()
        };
        let deepest = tree.places.iter().map(|&place| depth(place)).max();
        assert!(deepest < Some(30), "{deepest:?}");
    }

    #[test]
    fn lost_digits_are_replaced_evenly() {
        let mut sum = 0.0;
        for i in 0..4096u32 {
            let v = i as f32 / 4096.0;
            let x = refined(0.5, 1.0 / 65536.0, [0.3, v]);
            assert!((0.5..0.5 + 1.0 / 256.0).contains(&x));
            sum += f64::from(x - 0.5) * 256.0 / 4096.0;
        }
        assert!((sum - 0.5).abs() < 0.02, "{sum}");
    }
}
