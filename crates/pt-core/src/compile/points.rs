//! Compiles points to spheres, and segments between them to cylinders.

use std::sync::Arc;

use pt_bvh::Sphere;
use pt_math::{DAffine3, Vec3};
use pt_scene::points::scale;
use pt_scene::texture::Pattern;
use pt_scene::{Geometry, Object, Points, framing};
use pt_scene::{Hint, Notes};

use super::CompileError;
use super::collector::Collector;
use crate::texture::MeshColors;

/// Radius of points that are all in one place, in diagonals of the scene.
const ALONE: f64 = 1.0 / 20.0;

impl Collector<'_> {
    /// Adds points and segments. The spheres stay round under any transform. Emission is sampled as
    /// lights only for the cylinders; paths find emissive spheres by chance.
    pub(super) fn add_points(
        &mut self,
        object: &Object,
        points: &Arc<Points>,
        radius: Option<f64>,
        to_world: DAffine3,
    ) -> Result<(), CompileError> {
        let refuse = |message| CompileError::Value { at: object.at.clone(), message };
        let scale = scale(to_world.matrix3);
        let radius = radius.unwrap_or_else(|| self.radius_of(points, scale));
        let radius = (radius * scale) as f32;
        if !(radius.is_finite() && radius > 0.0) {
            return Err(refuse(format!(
                "found a point radius of {radius}, expected a finite number above 0"
            )));
        }
        let has_colors = points.colors.is_some();
        let is_shown = |shown: &u32| {
            has_colors && matches!(self.mesh_values[*shown as usize], Pattern::VertexColors)
        };
        let shown = self.shown_values(object);
        if let Some(other) = shown.iter().find(|shown| !is_shown(shown)) {
            let what = super::mesh_values::missing_values(&self.mesh_values[*other as usize]);
            return Err(refuse(what));
        }
        let count = points.positions.len();
        let is_end = |i: &&u32| **i as usize >= count;
        if let Some(end) = points.segments.as_flattened().iter().find(is_end) {
            return Err(refuse(format!(
                "found a segment that ends at point {end}, expected an index below {count}"
            )));
        }
        self.add_spheres(object, points, radius, to_world);
        for shown in shown {
            self.mesh_colors.resize_with(self.mesh_values.len(), MeshColors::default);
            let first = self.shapes.first_colored[1] + self.shapes.sphere_surface.len() - count;
            self.mesh_colors[shown as usize].points.push((first as u32, Arc::clone(points)));
        }
        if points.segments.is_empty() {
            return Ok(());
        }
        // Cylinders are created in world space, where they are not deformed.
        let place = |p: &[f32; 3]| {
            to_world.transform_point3(Vec3::from_array(*p).as_dvec3()).as_vec3().to_array()
        };
        let placed = Points {
            positions: points.positions.iter().map(place).collect(),
            ..Points::clone(points)
        };
        self.add_mesh(object, &placed.cylinders(radius.into()), DAffine3::IDENTITY)
    }

    fn add_spheres(&mut self, object: &Object, points: &Points, radius: f32, to_world: DAffine3) {
        let surface = self.surface(object, 0).0;
        let sphere = |p: &[f32; 3]| {
            let center = to_world.transform_point3(Vec3::from_array(*p).as_dvec3()).as_vec3();
            Sphere { center, radius }
        };
        let count = points.positions.len();
        if !self.shapes.are_kept {
            let spheres = &mut self.shapes.arrays_mut().spheres;
            spheres.reserve_exact(count);
            spheres.extend(points.positions.iter().map(sphere));
        }
        let surfaces = &mut self.shapes.sphere_surface;
        surfaces.resize(surfaces.len() + count, surface);
    }

    /// Default radius of points in their own coordinates, which the transform scales by `scale`.
    fn radius_of(&mut self, points: &Arc<Points>, scale: f64) -> f64 {
        let radii = &mut self.radii;
        let radius = *radii.entry(Arc::as_ptr(points).addr()).or_insert_with(|| points.radius());
        if radius > 0.0 {
            return radius;
        }
        let extent = framing::surface_extent(self.scene, None);
        let diagonal = extent.map_or(0.0, |[low, high]| (high - low).length());
        ALONE * if diagonal > 0.0 { diagonal / scale } else { 1.0 }
    }

    /// Notes the number and the default radii of points, in units of the scene.
    pub(super) fn note_points(&mut self, notes: &mut Notes) {
        let (mut points, mut segments) = (0, 0);
        let mut radii = [f64::INFINITY, 0.0_f64];
        for object in &self.scene.objects {
            let Geometry::Points { points: some, radius: None } = &object.geometry else {
                continue;
            };
            points += some.positions.len();
            segments += some.segments.len();
            let scale = scale(object.to_world.matrix3);
            let radius = self.radius_of(some, scale) * scale;
            radii = [radii[0].min(radius), radii[1].max(radius)];
        }
        if points == 0 {
            return;
        }
        let [least, most] = radii.map(three_digits);
        let range = if least == most { least } else { format!("{least} to {most}") };
        let cylinders = match segments {
            0 => String::new(),
            _ => format!(", and {segments} segments between them as cylinders,"),
        };
        notes.push(format!(
            "{points} points are rendered as spheres{cylinders} with a radius of {range}"
        ));
        notes.suggest(Hint::SetPointRadius);
    }
}

/// Formats a positive number with three significant digits.
fn three_digits(number: f64) -> String {
    let digits = (2.0 - number.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{number:.digits$}")
}
