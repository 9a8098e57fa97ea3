//! Building trees of lights.

use pt_math::{Bounds3, Vec3};

use super::super::LightTables;
use super::emission::Emission;
use super::{Content, Node, TreeLight};

/// Number of bins along each axis.
const BINS: usize = 12;
/// From this depth on, lights are halved by their number, so that no tree is deep.
const MOST_UNEVEN: u32 = 40;

/// A light that is not yet in the tree.
#[derive(Clone, Copy)]
struct Item {
    light: u32,
    emission: Emission,
}

impl Item {
    fn center(&self) -> Vec3 {
        self.emission.bounds.center()
    }
}

/// The nodes of a tree, the root first, each before its children.
pub(super) fn nodes(lights: &[TreeLight], tables: &LightTables) -> Vec<Node> {
    let item = |(light, l): (u32, &TreeLight)| Item { light, emission: Emission::of(l, tables) };
    let mut items: Vec<_> = (0..).zip(lights).map(item).collect();
    let mut nodes = Vec::with_capacity(2 * items.len());
    add(&mut nodes, &mut items, 0);
    nodes
}

/// Adds a node for some lights; returns its number.
fn add(nodes: &mut Vec<Node>, items: &mut [Item], depth: u32) -> u32 {
    let index = nodes.len() as u32;
    let emission = all(items);
    if let [item] = items {
        nodes.push(Node { emission, content: Content::Light(item.light) });
        return index;
    }
    nodes.push(Node { emission, content: Content::Children([0; 2]) });
    let middle = split(items, &emission, depth);
    let (first, second) = items.split_at_mut(middle);
    let children = [add(nodes, first, depth + 1), add(nodes, second, depth + 1)];
    nodes[index as usize].content = Content::Children(children);
    index
}

fn all(items: &[Item]) -> Emission {
    let [first, others @ ..] = items else { unreachable!("nodes have lights") };
    others.iter().fold(first.emission, |sum, item| sum.union(&item.emission))
}

/// Orders lights so that the first ones, whose number is returned, go into one child.
fn split(items: &mut [Item], whole: &Emission, depth: u32) -> usize {
    let centers: Bounds3 = items.iter().map(Item::center).collect();
    let best = (depth < MOST_UNEVEN).then(|| best_plane(items, whole, &centers)).flatten();
    if let Some((axis, bin)) = best {
        let bin_of = |item: &Item| bin_of(item, &centers, axis);
        // Stable, so that the tree depends on the order of the lights alone.
        items.sort_by_key(|item| bin_of(item) > bin);
        return items.partition_point(|item| bin_of(item) <= bin);
    }
    let axis = widest(&centers);
    items.sort_by(|a, b| a.center()[axis].total_cmp(&b.center()[axis]));
    items.len() / 2
}

fn widest(bounds: &Bounds3) -> usize {
    let d = bounds.diagonal();
    (0..3).max_by(|&a, &b| d[a].total_cmp(&d[b])).unwrap_or(0)
}

fn bin_of(item: &Item, centers: &Bounds3, axis: usize) -> usize {
    let extent = centers.max[axis] - centers.min[axis];
    let share = (item.center()[axis] - centers.min[axis]) / extent;
    ((share * BINS as f32) as usize).min(BINS - 1)
}

/// The axis and the last bin on the near side where strength, area and orientation say so.
/// [Conty Estevez & Kulla 2018, §4.4]
fn best_plane(items: &[Item], whole: &Emission, centers: &Bounds3) -> Option<(usize, usize)> {
    let extents = whole.bounds.diagonal();
    let mut best: Option<(f32, (usize, usize))> = None;
    for axis in (0..3).filter(|&axis| centers.max[axis] > centers.min[axis]) {
        let mut bins: [Option<Emission>; BINS] = [None; BINS];
        for item in items {
            let bin = &mut bins[bin_of(item, centers, axis)];
            *bin = joined(*bin, Some(item.emission));
        }
        let narrow = extents.max_element() / extents[axis].max(f32::MIN_POSITIVE);
        for last in 0..BINS - 1 {
            let [near, far] = [&bins[..=last], &bins[last + 1..]]
                .map(|side| side.iter().copied().fold(None, joined));
            let (Some(near), Some(far)) = (near, far) else { continue };
            let cost = narrow * (cost(&near) + cost(&far));
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, (axis, last)));
            }
        }
    }
    best.map(|(_, plane)| plane)
}

fn joined(a: Option<Emission>, b: Option<Emission>) -> Option<Emission> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(&b)),
        (one, None) | (None, one) => one,
    }
}

/// A box without area costs as much as a very small one: its strength still counts.
fn cost(emission: &Emission) -> f32 {
    let area = emission.bounds.half_area() + f32::MIN_POSITIVE;
    emission.strength * emission.orientation_cost() * area
}
