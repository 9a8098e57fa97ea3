//! Refitting of the wide tree to primitives that have moved.

use pt_math::Bounds3;
use rayon::prelude::*;
use wide::f32x8;

use super::collapse::{relative_bounds, sphere_block, triangle_block};
use super::{BLOCK, ChildRef, NO_PRIMITIVE, WIDTH, WideBvh, WideNode};
use crate::geometry::Geometry;
use crate::ray::SceneExtent;

impl WideBvh {
    /// Flags of the primitives, of which there are `primitives`, that are in the tree.
    pub(crate) fn present(&self, primitives: usize) -> Vec<bool> {
        let mut present = vec![false; primitives];
        let triangles = self.triangles.iter().flat_map(|block| block.ids);
        let ids = triangles.chain(self.spheres.iter().flat_map(|block| block.ids));
        for id in ids.filter(|&id| id != NO_PRIMITIVE) {
            present[id as usize] = true;
        }
        present
    }

    /// Replaces all primitives and boxes by those of `geometry`, with an unchanged topology;
    /// returns the box of the scene. Primitives that have become unusable keep an empty lane.
    pub(crate) fn refit(&mut self, geometry: &Geometry<'_>) -> Bounds3 {
        let triangles = blocks(
            &mut self.triangles,
            |b| &mut b.ids,
            |ids| triangle_block(geometry, ids),
            geometry,
        );
        let spheres =
            blocks(&mut self.spheres, |b| &mut b.ids, |ids| sphere_block(geometry, ids), geometry);
        let boxes = triangles.iter().chain(&spheres).copied();
        let scene = boxes.fold(Bounds3::EMPTY, Bounds3::union);
        if !scene.is_empty() {
            self.scene = SceneExtent::new(&scene);
            self.refit_nodes(&triangles, &spheres);
            self.sort_children();
        }
        scene
    }

    /// Sum of the areas of all boxes.
    pub(crate) fn area_of_boxes(&self) -> f32 {
        let all: f64 = self.nodes.iter().map(|node| f64::from(area_of_children(node))).sum();
        all as f32
    }

    /// Computes boxes from the leaves up: children come after their parents.
    fn refit_nodes(&mut self, triangles: &[Bounds3], spheres: &[Bounds3]) {
        let mut all = vec![Bounds3::EMPTY; self.nodes.len()];
        for (i, node) in self.nodes.iter_mut().enumerate().rev() {
            let mut planes = [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3];
            for (slot, child) in node.children.iter().enumerate() {
                if *child == ChildRef::VACANT {
                    continue;
                }
                let index = ChildRef::index(child.0);
                let bounds = match child.0 & (ChildRef::TRIANGLES | ChildRef::SPHERES) {
                    ChildRef::TRIANGLES => triangles[index],
                    ChildRef::SPHERES => spheres[index],
                    _ => all[index],
                };
                all[i] = all[i].union(bounds);
                let (low, high) = relative_bounds(&bounds, &self.scene);
                for axis in 0..3 {
                    planes[axis][0][slot] = low[axis];
                    planes[axis][1][slot] = high[axis];
                }
            }
            node.planes = planes.map(|rows| rows.map(f32x8::new));
        }
    }
}

/// Sum of the areas of the boxes of the children of a node.
fn area_of_children(node: &WideNode) -> f32 {
    let edges = node.planes.map(|[low, high]| (high - low).to_array());
    let is_child = |slot: &usize| node.children[*slot] != ChildRef::VACANT;
    let area = |slot: usize| {
        let [x, y, z] = edges.map(|edge| edge[slot]);
        2.0 * (x * y + y * z + z * x)
    };
    (0..WIDTH).filter(is_child).map(area).sum()
}

/// Rebuilds each block from those of its primitives that are usable, and returns their boxes.
fn blocks<B: Send>(
    blocks: &mut [B],
    ids: impl Fn(&mut B) -> &mut [u32; BLOCK] + Sync,
    make: impl Fn([u32; BLOCK]) -> B + Sync,
    geometry: &Geometry<'_>,
) -> Vec<Bounds3> {
    let refit = |block: &mut B| {
        let all = *ids(block);
        let (usable, bounds) = usable(geometry, all);
        *block = make(usable);
        *ids(block) = all;
        bounds
    };
    blocks.par_iter_mut().map(refit).collect()
}

/// Usable primitives of a block, and the box around them.
fn usable(geometry: &Geometry<'_>, ids: [u32; BLOCK]) -> ([u32; BLOCK], Bounds3) {
    let mut all = Bounds3::EMPTY;
    let usable = ids.map(|id| {
        let bounds = (id != NO_PRIMITIVE).then(|| geometry.primitive(id).bounds()).flatten();
        all = all.union(bounds.unwrap_or(Bounds3::EMPTY));
        if bounds.is_some() { id } else { NO_PRIMITIVE }
    });
    (usable, all)
}
