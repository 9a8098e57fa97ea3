//! Smoothing groups, for surfaces whose corners have no normals. [Wavefront Technologies, "Object
//! Files (.obj)", Advanced Visualizer manual, app. B1, `s`]

use std::collections::HashMap;

use pt_scene::shapes::smooth_normals;
use pt_scene::{Attribute, Mesh};

use crate::shared::line::Line;

/// Smoothing groups by their first triangle; 0 is none.
#[derive(Default)]
pub(super) struct Groups {
    switches: Vec<(usize, u32)>,
}

/// Returns the group of a statement. Numbers are groups, `off` and 0 are none, and anything else is
/// group 1.
pub(super) fn group(line: Line) -> u32 {
    match line.text.split_ascii_whitespace().nth(1) {
        None => 0,
        Some(word) if word.eq_ignore_ascii_case("off") => 0,
        Some(word) => word.parse().unwrap_or(1),
    }
}

impl Groups {
    /// Sets the group from a triangle on.
    pub(super) fn switch(&mut self, triangle: usize, group: u32) {
        self.switches.push((triangle, group));
    }

    /// Appends the groups of the lines that follow, after this number of triangles.
    pub(super) fn append(&mut self, triangles: usize, more: Self) {
        let moved = more.switches.into_iter().map(|(first, group)| (triangles + first, group));
        self.switches.extend(moved);
    }

    /// Returns normals that are smooth within each group, and those of the triangles elsewhere;
    /// `None` if no triangle is in a group.
    pub(super) fn normals(&self, mesh: &Mesh) -> Option<Attribute<[f32; 3]>> {
        let count = mesh.triangles.len();
        let ends = self.switches.iter().skip(1).map(|(first, _)| *first).chain([count]);
        let runs = self.switches.iter().zip(ends).map(|(&(first, group), end)| (first..end, group));
        let runs: Vec<_> = runs.filter(|(run, group)| *group > 0 && !run.is_empty()).collect();
        if runs.is_empty() {
            return None;
        }
        // Triangles of a group have its number at their corners, and all others a number of their
        // own.
        let mut numbers: Vec<u32> = (0..count as u32).collect();
        let mut firsts = HashMap::new();
        for (run, group) in runs {
            let number = *firsts.entry(group).or_insert(run.start as u32);
            numbers[run].fill(number);
        }
        let of_corners = numbers.into_iter().map(|number| [number; 3]).collect();
        Some(smooth_normals(&Mesh {
            positions: mesh.positions.clone(),
            triangles: mesh.triangles.clone(),
            uvs: Some(Attribute { values: Vec::new().into(), indices: Some(of_corners) }),
            ..Mesh::default()
        }))
    }
}
