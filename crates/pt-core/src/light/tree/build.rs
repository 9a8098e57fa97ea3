//! Construction of light trees.

use pt_math::{Bounds3, Vec3};

use super::super::LightTables;
use super::bounds::{LightBounds, across};
use super::node::{LightTreeNode, WIDTH};
use super::{ChildSlot, TreeLight};

/// Number of bins along each axis.
const BINS: usize = 12;
/// Depth from which on lights are split in halves by number, which bounds the depth of trees.
const MAX_UNEVEN: u32 = 16;
/// Largest number of lights that are split in halves at any depth, so that nodes are full.
const FEW: usize = WIDTH * WIDTH;

/// A light to be inserted into the tree.
#[derive(Clone, Copy)]
struct Item {
    light: u32,
    emission: LightBounds,
}

/// A tree under construction.
pub(super) struct Built {
    /// Nodes; the root is the first.
    pub(super) nodes: Vec<LightTreeNode>,
    /// Slot of each node in its parent; unused for the root.
    pub(super) parents: Vec<ChildSlot>,
    /// Slot of each light.
    pub(super) places: Vec<ChildSlot>,
}

/// Builds the tree of lights.
pub(super) fn build(lights: &[TreeLight], tables: &LightTables) -> Built {
    let item = |(light, l): (u32, &TreeLight)| Item { light, emission: LightBounds::of(l, tables) };
    let mut items: Vec<_> = (0..).zip(lights).map(item).collect();
    let root = ChildSlot { node: 0, lane: 0 };
    let places = vec![root; lights.len()];
    let mut built = Built { nodes: Vec::new(), parents: Vec::new(), places };
    built.add(&mut items, root, 0);
    built
}

impl Built {
    /// Adds a node for lights, with its slot in the parent; returns the index of the node.
    fn add(&mut self, items: &mut [Item], parent: ChildSlot, depth: u32) -> u32 {
        let groups = groups(items, depth);
        let emissions: Vec<_> = groups.iter().map(|group| group.emission).collect();
        let node = self.nodes.len() as u32;
        self.nodes.push(LightTreeNode::new(&emissions));
        self.parents.push(parent);
        for (lane, group) in (0..).zip(groups) {
            let slot = ChildSlot { node, lane };
            let (is_node, number) = if let [item] = group.items {
                self.places[item.light as usize] = slot;
                (false, item.light)
            } else {
                (true, self.add(group.items, slot, depth + 1))
            };
            self.nodes[node as usize].set_child(lane as usize, is_node, number);
        }
        node
    }
}

/// Lights that form one child of a node.
struct ChildLights<'a> {
    items: &'a mut [Item],
    emission: LightBounds,
}

impl<'a> ChildLights<'a> {
    fn new(items: &'a mut [Item]) -> Self {
        let emission = match items {
            [item] => item.emission,
            _ => LightBounds::of_all(items.iter().map(|item| &item.emission)),
        };
        Self { items, emission }
    }

    fn cost(&self) -> f32 {
        let LightBounds { strength, axis, bounds, .. } = self.emission;
        cost(strength, axis, &bounds)
    }
}

/// Partitions lights into the children of a node. While there is room, the most expensive group
/// that is larger than a node is split; if there is none, the lights of the most expensive group
/// that fits become children.
fn groups(items: &mut [Item], depth: u32) -> Vec<ChildLights<'_>> {
    let mut groups = vec![ChildLights::new(items)];
    while groups.len() < WIDTH {
        let room = WIDTH + 1 - groups.len();
        let most = |may: &dyn Fn(usize) -> bool| {
            let those = (0..groups.len()).filter(|&i| may(groups[i].items.len()));
            those.max_by(|&a, &b| groups[a].cost().total_cmp(&groups[b].cost()))
        };
        if let Some(i) = most(&|count| count > WIDTH) {
            let ChildLights { items, emission } = groups.remove(i);
            let middle = split(items, &emission, depth);
            let (first, second) = items.split_at_mut(middle);
            groups.insert(i, ChildLights::new(second));
            groups.insert(i, ChildLights::new(first));
        } else if let Some(i) = most(&|count| count > 1 && count <= room) {
            let singles: Vec<_> =
                groups.remove(i).items.chunks_mut(1).map(ChildLights::new).collect();
            groups.splice(i..i, singles);
        } else {
            break;
        }
    }
    groups
}

/// Partitions more lights than a node holds into two groups; returns the size of the first.
fn split(items: &mut [Item], whole: &LightBounds, depth: u32) -> usize {
    let centers: Bounds3 = items.iter().map(|item| item.emission.center).collect();
    let is_open = depth < MAX_UNEVEN && items.len() > FEW;
    let best = is_open.then(|| best_plane(items, whole, &centers)).flatten();
    if let Some((axis, bin)) = best {
        return partition(items, |item| bin_of(item, &centers, axis) <= bin);
    }
    let axis = widest(&centers);
    items.sort_unstable_by(|a, b| {
        let [x, y] = [a, b].map(|item| item.emission.center[axis]);
        x.total_cmp(&y).then(a.light.cmp(&b.light))
    });
    (items.len() / 2).next_multiple_of(WIDTH)
}

/// Moves the items for which `is_near` is true to the front; returns their number.
fn partition(items: &mut [Item], is_near: impl Fn(&Item) -> bool) -> usize {
    let mut near = 0;
    for i in 0..items.len() {
        if is_near(&items[i]) {
            items.swap(i, near);
            near += 1;
        }
    }
    near
}

fn widest(bounds: &Bounds3) -> usize {
    let d = bounds.diagonal();
    (0..3).max_by(|&a, &b| d[a].total_cmp(&d[b])).unwrap_or(0)
}

fn bin_of(item: &Item, centers: &Bounds3, axis: usize) -> usize {
    let extent = centers.max[axis] - centers.min[axis];
    let share = (item.emission.center[axis] - centers.min[axis]) / extent;
    ((share * BINS as f32) as usize).min(BINS - 1)
}

/// Aggregate on which the cost of lights depends.
#[derive(Clone, Copy)]
struct LightBin {
    bounds: Bounds3,
    strength: f32,
    /// Sum of the axes, weighted by strength.
    axes: Vec3,
}

impl LightBin {
    const EMPTY: Self = Self { bounds: Bounds3::EMPTY, strength: 0.0, axes: Vec3::ZERO };

    fn add(&mut self, other: &Self) {
        self.bounds = self.bounds.union(other.bounds);
        self.strength += other.strength;
        self.axes += other.axes;
    }

    /// Returns the cost, or `None` if the bin is empty.
    fn cost(&self) -> Option<f32> {
        (self.strength > 0.0).then(|| cost(self.strength, self.axes / self.strength, &self.bounds))
    }
}

/// Returns the axis and the last bin of the near side of the cheapest split, by strength, area and
/// orientation; `None` if there is none. [Conty Estevez & Kulla 2018, §4.4]
fn best_plane(items: &[Item], whole: &LightBounds, centers: &Bounds3) -> Option<(usize, usize)> {
    let extents = whole.bounds.diagonal();
    let mut best: Option<(f32, (usize, usize))> = None;
    for axis in (0..3).filter(|&axis| centers.max[axis] > centers.min[axis]) {
        let mut bins = [LightBin::EMPTY; BINS];
        for item in items {
            let LightBounds { bounds, strength, axis: of_light, .. } = item.emission;
            let one = LightBin { bounds, strength, axes: of_light * strength };
            bins[bin_of(item, centers, axis)].add(&one);
        }
        let far = costs_from_the_end(&bins);
        let narrow = extents.max_element() / extents[axis].max(f32::MIN_POSITIVE);
        let mut near = LightBin::EMPTY;
        for (last, bin) in bins[..BINS - 1].iter().enumerate() {
            near.add(bin);
            let (Some(near), Some(far)) = (near.cost(), far[last + 1]) else { continue };
            let cost = narrow * (near + far);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, (axis, last)));
            }
        }
    }
    best.map(|(_, plane)| plane)
}

/// Returns the cost of each bin together with all following ones.
fn costs_from_the_end(bins: &[LightBin; BINS]) -> [Option<f32>; BINS] {
    let mut costs = [None; BINS];
    let mut far = LightBin::EMPTY;
    for (cost, bin) in costs.iter_mut().zip(bins).rev() {
        far.add(bin);
        *cost = far.cost();
    }
    costs
}

/// Returns the strength times the area, times the measure of the emitting directions relative to
/// that of a light of one axis: from 1 to 4. A box without area counts as a very small one, so that
/// its strength still counts.
fn cost(strength: f32, axis: Vec3, bounds: &Bounds3) -> f32 {
    let orientation = 1.0 + 12.0 * across(axis);
    strength * orientation * (bounds.half_area() + f32::MIN_POSITIVE)
}
