//! Converts the shapes of objects to triangles and spheres.

use std::collections::HashMap;

use pt_bvh::{MotionKey, Sphere};
use pt_math::{DAffine3, DMat3, DVec3, Mat3, Spectrum, Vec2, Vec3};
use pt_scene::texture::Pattern;
use pt_scene::{Geometry, Mesh, Notes, Object, Scene, Submesh};

use super::CompileError;
use super::checks::{check_attribute, check_indices, check_values};
use super::ellipsoid::unit_sphere_mesh;
use super::instance_choice::choose_instances;
use super::mesh_values::{missing_values, values_of_faces, values_of_vertices};
use super::policies::ShapePolicies;
use super::surface::CompiledSurface;
use super::textures::ShownValues;
use crate::compile::shapes::{Emitter, ShapePrimitives, Shapes, SurfaceEmission};
use crate::id::SurfaceId;
use crate::shapes::FLAT;
use crate::surface::SurfaceRecord;
use crate::texture::MeshColors;

pub(super) struct Collector<'a> {
    pub(super) scene: &'a Scene,
    pub(super) policies: ShapePolicies,
    pub(super) shapes: Shapes,
    /// Surface of each material without emission; the default material is last.
    pub(super) plain: Vec<Option<SurfaceId>>,
    pub(super) looks: Vec<CompiledSurface>,
    /// Surface of shapes without a material.
    pub(super) default: CompiledSurface,
    /// True if any material uses texture coordinates.
    pub(super) uses_coordinates: bool,
    pub(super) mesh_colors: Vec<MeshColors>,
    /// Values of meshes that textures show.
    pub(super) mesh_values: Vec<Pattern>,
    /// Default radii of points, by the addresses of these.
    pub(super) radii: HashMap<usize, f64>,
}

impl Collector<'_> {
    /// Returns, for each object, true if it becomes a static instance.
    pub(super) fn shared(&self, tracks: &[Vec<MotionKey>], most: Option<usize>) -> Vec<bool> {
        if !self.policies.instancing {
            return vec![false; self.scene.objects.len()];
        }
        choose_instances(self.scene, most, |number, object| {
            let mut looks =
                object.materials.iter().flatten().filter_map(|m| self.looks.get(*m as usize));
            // Instancing would stretch the spheres of points.
            let is_stretched = matches!(object.geometry, Geometry::Points { .. })
                && !is_similarity(object.to_world.matrix3);
            tracks[number].len() == 1 && !is_stretched && looks.all(|look| look.emission.is_black())
        })
    }

    /// Adds an object with a transform.
    pub(super) fn add(
        &mut self,
        object: &Object,
        to_world: DAffine3,
        notes: &mut Notes,
    ) -> Result<(), CompileError> {
        if !to_world.is_finite() {
            return Err(CompileError::Value {
                at: object.at.clone(),
                message: "found a transform with entries that are not finite".into(),
            });
        }
        match &object.geometry {
            Geometry::Mesh(mesh) => self.add_mesh(object, mesh, to_world),
            Geometry::Sphere { radius } => self.add_sphere(object, *radius, to_world, notes),
            Geometry::Points { points, radius } => {
                self.add_points(object, points, *radius, to_world)
            }
        }
    }

    /// Returns the surface of a material slot, and its emission, if any. Each object gets its own
    /// emissive surfaces, because each is a separate light, and its own surfaces between media.
    pub(super) fn surface(
        &mut self,
        object: &Object,
        slot: u32,
    ) -> (SurfaceId, Option<SurfaceEmission>) {
        let known = self.scene.materials.len();
        let material = object.materials.get(slot as usize).copied().flatten();
        let material = material.filter(|&m| (m as usize) < known);
        let look = material.map_or(&self.default, |m| &self.looks[m as usize]).clone();
        let emits = !look.emission.is_black();
        let plain = material.map_or(known, |m| m as usize);
        let is_shared = !emits && object.media.is_none();
        if let (true, Some(surface)) = (is_shared, self.plain[plain]) {
            return (surface, None);
        }
        let number = material;
        let CompiledSurface { lobe, two_sided, material, opacity, cull_backfaces, .. } = look;
        let emission = emits.then_some(SurfaceEmission {
            radiance: look.emission,
            texture: look.emission_texture,
            is_invisible: look.hidden_emission,
            coat: look.emission_coat,
        });
        let seen = emission.filter(|emission| !emission.is_invisible);
        let record = SurfaceRecord {
            lobe,
            two_sided,
            material,
            opacity,
            cull_backfaces,
            emissive_sides: self.policies.emissive_sides,
            emission: seen.map_or(Spectrum::ZERO, |emission| emission.radiance),
            emission_texture: seen.and_then(|emission| emission.texture),
            emission_coat: look.emission_coat,
            light: None,
        };
        let surface = self.shapes.add_surface(record, number);
        if is_shared {
            self.plain[plain] = Some(surface);
        }
        if let Some(sides) = object.media {
            self.shapes.sides.push((surface, sides, object.at.clone()));
        }
        (surface, emission)
    }

    pub(super) fn add_mesh(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        to_world: DAffine3,
    ) -> Result<(), CompileError> {
        let mirrored = to_world.matrix3.determinant() < 0.0 && self.policies.exact_transforms;
        if !self.shapes.are_kept {
            self.add_triangles(object, mesh, to_world, mirrored)?;
        }
        self.add_values(object, mesh, mirrored)?;
        self.add_parts(object, mesh);
        Ok(())
    }

    /// Adds the triangles of a mesh, without their surfaces.
    fn add_triangles(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        to_world: DAffine3,
        mirrored: bool,
    ) -> Result<(), CompileError> {
        check_indices(object, "vertex", &mesh.triangles, mesh.positions.len())?;
        let arrays = self.shapes.arrays_mut();
        let base = arrays.positions.len() as u32;
        arrays.positions.extend(mesh.positions.iter().map(|&p| world_point(to_world, p)));
        arrays.triangles.extend(mesh.triangles.iter().map(|t| place(*t, base, mirrored)));
        self.add_normals(object, mesh, to_world, base, mirrored)?;
        self.add_coordinates(object, mesh, mirrored)
    }

    /// Adds the surfaces of the triangles of a mesh.
    fn add_parts(&mut self, object: &Object, mesh: &Mesh) {
        let first = self.shapes.triangle_surface.len();
        let count = first + mesh.triangles.len();
        let whole = [Submesh { triangles: 0..mesh.triangles.len() as u32, slot: 0 }];
        let parts = if mesh.submeshes.is_empty() { &whole[..] } else { &mesh.submeshes };
        let mut by_slot = HashMap::new();
        for part in parts {
            let (surface, emission) =
                *by_slot.entry(part.slot).or_insert_with(|| self.surface(object, part.slot));
            let start = self.shapes.triangle_surface.len();
            let end = (first + part.triangles.end as usize).min(count);
            self.shapes.triangle_surface.resize(end.max(start), surface);
            if let Some(emission) = emission {
                self.shapes.add_emitter(surface, emission, start..end.max(start));
            }
        }
        let fallback = self.surface(object, u32::MAX).0;
        self.shapes.triangle_surface.resize(count, fallback);
    }

    fn add_normals(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        to_world: DAffine3,
        base: u32,
        mirrored: bool,
    ) -> Result<(), CompileError> {
        let shapes = self.shapes.arrays_mut();
        let first = shapes.triangles.len() - mesh.triangles.len();
        let normal_base = shapes.normals.len() as u32;
        if let Some(vertex_normals) = self.policies.vertex_normals {
            let positions = &shapes.positions[base as usize..];
            let smooth = vertex_normals(positions, &mesh.triangles);
            shapes.normals.extend(smooth);
            pad(&mut shapes.triangle_normals, first);
            let placed = mesh.triangles.iter().map(|t| place(*t, normal_base, false));
            shapes.triangle_normals.extend(placed);
            return Ok(());
        }
        let Some(normals) = &mesh.normals else {
            if !shapes.triangle_normals.is_empty() {
                pad(&mut shapes.triangle_normals, shapes.triangles.len());
            }
            return Ok(());
        };
        check_attribute(object, "normal", mesh, normals)?;
        let to_normal = to_world.matrix3.inverse().transpose();
        shapes.normals.extend(normals.values.iter().map(|&n| world_normal(to_normal, n)));
        pad(&mut shapes.triangle_normals, first);
        shapes.triangle_normals.extend(
            mesh.triangles
                .iter()
                .enumerate()
                .map(|(i, &t)| place(normals.corners(i, t), normal_base, mirrored)),
        );
        Ok(())
    }

    /// Adds texture coordinates, if any material uses them.
    fn add_coordinates(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        mirrored: bool,
    ) -> Result<(), CompileError> {
        let Some(uvs) = mesh.uvs.as_ref().filter(|_| self.uses_coordinates) else { return Ok(()) };
        check_attribute(object, "texture coordinate", mesh, uvs)?;
        let shapes = self.shapes.arrays_mut();
        let base = shapes.uvs.len() as u32;
        shapes.uvs.extend(uvs.values.iter().map(|&uv| Vec2::from(uv)));
        pad(&mut shapes.triangle_uvs, shapes.triangles.len() - mesh.triangles.len());
        let corners = |(i, &t)| place(uvs.corners(i, t), base, mirrored);
        shapes.triangle_uvs.extend(mesh.triangles.iter().enumerate().map(corners));
        Ok(())
    }

    /// Mesh values that the materials of an object use.
    pub(super) fn shown_values(&self, object: &Object) -> ShownValues {
        let looks = object.materials.iter().flatten().filter_map(|m| self.looks.get(*m as usize));
        looks.flat_map(|look| &look.shown).copied().collect()
    }

    /// Adds colours and other values, if any material of the object uses them.
    fn add_values(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        mirrored: bool,
    ) -> Result<(), CompileError> {
        let first = self.shapes.first_colored[0] + self.shapes.triangle_surface.len();
        self.mesh_colors.resize_with(self.mesh_values.len(), MeshColors::default);
        for shown in self.shown_values(object) {
            let pattern = &self.mesh_values[shown as usize];
            let MeshColors { vertices, triangles, faces, .. } =
                &mut self.mesh_colors[shown as usize];
            if let Some((values, indices)) = values_of_vertices(mesh, pattern) {
                check_values(object, "colour", mesh, values.len(), indices)?;
                let base = vertices.len() as u32;
                vertices.extend(values.iter().map(|&value| Spectrum::from(value)));
                pad(triangles, first);
                let corners = |(i, t)| indices.map_or(t, |indices| indices[i]);
                let all = mesh.triangles.iter().copied().enumerate();
                triangles.extend(all.map(|at| place(corners(at), base, mirrored)));
            } else if let Some(values) = values_of_faces(mesh, pattern) {
                if values.len() != mesh.triangles.len() {
                    let message = format!(
                        "found colours for {} triangles, expected {} triangles",
                        values.len(),
                        mesh.triangles.len()
                    );
                    return Err(CompileError::Value { at: object.at.clone(), message });
                }
                faces.resize(first, Spectrum::ZERO);
                faces.extend(values.iter().map(|&value| Spectrum::from(value)));
            } else {
                let message = missing_values(pattern);
                return Err(CompileError::Value { at: object.at.clone(), message });
            }
        }
        Ok(())
    }

    fn add_sphere(
        &mut self,
        object: &Object,
        radius: f64,
        to_world: DAffine3,
        notes: &mut Notes,
    ) -> Result<(), CompileError> {
        let scale = to_world.matrix3.x_axis.length();
        if self.policies.exact_transforms && !is_similarity(to_world.matrix3) {
            notes.push(format!(
                "{}: the scaled sphere is rendered as an ellipsoid of triangles",
                object.at
            ));
            let mut mesh = unit_sphere_mesh();
            if radius < 0.0 {
                pt_scene::shapes::flip(&mut mesh);
            }
            let to_world = to_world * DAffine3::from_scale(DVec3::splat(radius.abs()));
            return self.add_mesh(object, &mesh, to_world);
        }
        let sphere =
            Sphere { center: to_world.translation.as_vec3(), radius: (radius * scale) as f32 };
        if !(sphere.radius.is_finite() && sphere.radius != 0.0) {
            return Err(CompileError::Value {
                at: object.at.clone(),
                message: format!(
                    "found a sphere of radius {}, expected a finite non-zero radius",
                    sphere.radius
                ),
            });
        }
        if !self.shown_values(object).is_empty() {
            return Err(CompileError::Value {
                at: object.at.clone(),
                message:
                    "found a material with mesh colours on a sphere, expected a mesh or another \
                     material"
                        .into(),
            });
        }
        let (surface, emission) = self.surface(object, 0);
        let index = self.shapes.sphere_surface.len();
        if !self.shapes.are_kept {
            let arrays = self.shapes.arrays_mut();
            arrays.sphere_axes.resize(index, Mat3::IDENTITY);
            arrays.spheres.push(sphere);
            arrays.sphere_axes.push((to_world.matrix3 * scale.recip()).as_mat3());
        }
        self.shapes.sphere_surface.push(surface);
        if let Some(emission) = emission {
            let primitives = ShapePrimitives::Sphere(index);
            self.shapes.emitters.push(Emitter { surface, emission, primitives });
        }
        Ok(())
    }
}

/// Pads to `len` with triangles without values.
fn pad(corners: &mut Vec<[u32; 3]>, len: usize) {
    corners.resize(len, FLAT);
}

/// Adds `base` to the indices of a triangle, and reverses its orientation if mirrored.
fn place([a, b, c]: [u32; 3], base: u32, mirrored: bool) -> [u32; 3] {
    let [b, c] = if mirrored { [c, b] } else { [b, c] };
    [a, b, c].map(|i| i.wrapping_add(base))
}

fn world_point(to_world: DAffine3, p: [f32; 3]) -> Vec3 {
    to_world.transform_point3(Vec3::from_array(p).as_dvec3()).as_vec3()
}

fn world_normal(to_normal: DMat3, n: [f32; 3]) -> Vec3 {
    (to_normal * Vec3::from_array(n).as_dvec3()).normalize_or_zero().as_vec3()
}

/// Returns true if a matrix scales all directions equally (to one part in ten thousand).
pub(super) fn is_similarity(m: DMat3) -> bool {
    let gram = m.transpose() * m;
    let scale = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let identity = DMat3::from_diagonal(DVec3::splat(scale));
    (gram - identity).to_cols_array().iter().all(|e| e.abs() <= 1e-4 * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn similarities_are_distinguished_from_stretches() {
        let turn = DMat3::from_rotation_y(0.3) * 2.5;
        assert!(is_similarity(turn));
        assert!(!is_similarity(turn * DMat3::from_diagonal(DVec3::new(1.0, 1.1, 1.0))));
    }
}
