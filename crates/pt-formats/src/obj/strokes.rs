//! Points (`p 1 2`) and lines (`l 1 2 3`).

use std::collections::HashMap;

use pt_scene::Points;

use super::slots::{LocatedName, Slots};

/// Points and lines by vertex index.
#[derive(Default)]
pub(super) struct Strokes {
    /// End points of the segments of lines; both are equal for a point.
    ends: Vec<[u32; 2]>,
    /// Materials of the segments.
    slots: Slots,
}

impl Strokes {
    /// Returns the segments of lines, by vertex index.
    pub(super) fn into_segments(mut self) -> Vec<[u32; 2]> {
        self.ends.retain(|[a, b]| a != b);
        self.ends
    }

    /// Sets the material of the following segments.
    pub(super) fn switch(&mut self, named: LocatedName) {
        self.slots.switch(self.ends.len(), named);
    }

    /// Adds a line through vertices, or each of them as a point.
    pub(super) fn add(&mut self, vertices: impl Iterator<Item = u32> + Clone, is_line: bool) {
        let next = vertices.clone().skip(usize::from(is_line));
        self.ends.extend(vertices.zip(next).map(|(a, b)| [a, b]));
    }

    /// Appends the points and lines of the part of the file that follows.
    pub(super) fn append(&mut self, mut more: Self) {
        self.slots.append(self.ends.len(), more.slots);
        self.ends.append(&mut more.ends);
    }

    /// Returns the points and segments of each material, with its name.
    pub(super) fn finish(
        self,
        positions: &[[f32; 3]],
        colors: Option<&[[f32; 3]]>,
    ) -> Vec<(Points, Option<LocatedName>)> {
        let (parts, slots) = self.slots.finish(self.ends.len());
        let mut all: Vec<_> = slots.into_iter().map(|named| (Picked::default(), named)).collect();
        for part in parts {
            let picked = &mut all[part.slot as usize].0;
            let range = part.triangles.start as usize..part.triangles.end as usize;
            for ends in &self.ends[range] {
                picked.add(*ends);
            }
        }
        all.into_iter().map(|(picked, named)| (picked.finish(positions, colors), named)).collect()
    }
}

/// Some vertices of a file, without duplicates, and segments between them.
#[derive(Default)]
struct Picked {
    vertices: Vec<u32>,
    numbers: HashMap<u32, u32>,
    segments: Vec<[u32; 2]>,
}

impl Picked {
    fn add(&mut self, ends: [u32; 2]) {
        let [a, b] = ends.map(|vertex| {
            let next = self.vertices.len() as u32;
            let number = *self.numbers.entry(vertex).or_insert(next);
            if number == next {
                self.vertices.push(vertex);
            }
            number
        });
        if a != b {
            self.segments.push([a, b]);
        }
    }

    fn finish(self, positions: &[[f32; 3]], colors: Option<&[[f32; 3]]>) -> Points {
        let pick = |all: &[[f32; 3]]| self.vertices.iter().map(|i| all[*i as usize]).collect();
        Points {
            name: String::new(),
            positions: pick(positions),
            colors: colors.map(pick),
            segments: self.segments,
        }
    }
}
