//! Shapes that no ray can hit.

use pt_bvh::{LARGEST_COORDINATE, Sphere};
use pt_math::Vec3;
use pt_scene::Notes;

use super::shapes::Shapes;

impl Shapes {
    /// Returns the number of shapes with coordinates that are not finite, or beyond the largest
    /// that hierarchies support.
    pub(super) fn out_of_range(&self) -> u32 {
        let is_in = |p: Vec3| p.abs().cmple(Vec3::splat(LARGEST_COORDINATE)).all();
        let is_triangle_in =
            |t: &&[u32; 3]| t.iter().all(|corner| is_in(self.positions[*corner as usize]));
        let is_sphere_in = |s: &&Sphere| is_in(s.center) && s.radius <= LARGEST_COORDINATE;
        let triangles = self.triangles.iter().filter(|t| !is_triangle_in(t)).count();
        (triangles + self.spheres.iter().filter(|s| !is_sphere_in(s)).count()) as u32
    }
}

/// Notes the number of skipped shapes: those out of range, and flat ones.
pub(super) fn note(left_out: u32, out_of_range: u32, notes: &mut Notes) {
    let words = |count: u32| if count == 1 { ("", "has", "is") } else { ("s", "have", "are") };
    if out_of_range > 0 {
        let (s, have, are) = words(out_of_range);
        notes.push(format!(
            "{out_of_range} shape{s} {have} coordinates that are not finite or beyond \
             ±{LARGEST_COORDINATE:.2e} metres, and {are} omitted"
        ));
    }
    let flat = left_out.saturating_sub(out_of_range);
    if flat > 0 {
        let (s, have, are) = words(flat);
        notes.push(format!(
            "{flat} triangle{s} {have} zero area, with corners in one point or on one line, and \
             {are} omitted"
        ));
    }
}
