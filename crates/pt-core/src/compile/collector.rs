//! From placed shapes to triangles and spheres in the world.

use std::collections::HashMap;
use std::mem::swap;

use pt_bvh::{MotionKey, Sphere};
use pt_math::{DAffine3, DMat3, DVec3, Mat3, Spectrum, Vec2, Vec3};
use pt_scene::texture::Pattern;
use pt_scene::{Geometry, LightKind, Mesh, Object, Scene, Sides, Span, Submesh};

use super::checks::{check_attribute, check_indices, check_values};
use super::ellipsoid::unit_sphere_mesh;
use super::instances::{InstancedShapes, Tracks, choose_instances};
use super::mesh_values::{missing_values, values_of_faces, values_of_vertices};
use super::surface::CompiledSurface;
use super::textures::{Lowering, ShownValues};
use super::{CompileError, CompileOptions, motion, normals};
use crate::bsdf::{AnyLobe, Diffuse, LobeRecord, LobeTables};
use crate::id::{Id, Table};
use crate::material::Materials;
use crate::scene::{EmissiveSides, SurfaceRecord};
use crate::shapes::{FLAT, ShapeTables};
use crate::texture::{MeshColors, TextureRecord};

/// All shapes in the world.
#[derive(Default)]
pub(super) struct Shapes {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Vec<Vec3>,
    /// As many as triangles, or none.
    pub(super) triangle_normals: Vec<[u32; 3]>,
    pub(super) uvs: Vec<Vec2>,
    /// As many as triangles, or fewer.
    pub(super) triangle_uvs: Vec<[u32; 3]>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) sphere_axes: Vec<Mat3>,
    pub(super) triangle_surface: Vec<Id<SurfaceRecord>>,
    pub(super) sphere_surface: Vec<Id<SurfaceRecord>>,
    /// See [`crate::RenderScene::object_ends`].
    pub(super) object_ends: Vec<[u32; 2]>,
    pub(super) surfaces: Table<SurfaceRecord>,
    /// See [`crate::RenderScene::surface_materials`].
    pub(super) surface_materials: Vec<Option<u32>>,
    pub(super) lobes: Table<LobeRecord>,
    pub(super) lobe_tables: LobeTables,
    pub(super) materials: Materials,
    /// Runs of primitives that glow.
    pub(super) emitters: Vec<Emitter>,
    /// Surfaces between media, and the object of each.
    pub(super) sides: Vec<(Id<SurfaceRecord>, Sides, Span)>,
    /// The texture of each light node that has one.
    pub(super) slides: Vec<Option<Id<TextureRecord>>>,
    /// What is not in these tables.
    pub(super) placed: InstancedShapes,
    /// The numbers that the first triangle and the first sphere have among those with colours.
    pub(super) first_colored: [usize; 2],
}

/// Primitives that glow together.
pub(super) struct Emitter {
    pub(super) surface: Id<SurfaceRecord>,
    pub(super) emission: SurfaceEmission,
    pub(super) primitives: Primitives,
}

/// Emission of a surface.
#[derive(Clone, Copy)]
pub(super) struct SurfaceEmission {
    /// See [`SurfaceRecord::emission`].
    pub(super) radiance: Spectrum,
    pub(super) texture: Option<Id<TextureRecord>>,
    /// True if rays find nothing of it, so that the surface says nothing of it either.
    pub(super) is_invisible: bool,
    /// See [`SurfaceRecord::emission_coat`].
    pub(super) coat: f32,
}

/// A run of triangles, or one sphere.
pub(super) enum Primitives {
    Triangles(Vec<std::ops::Range<usize>>),
    Sphere(usize),
}

impl Shapes {
    /// Exchanges the shapes, and which of them glow, with those of another.
    pub(super) fn exchange(&mut self, other: &mut Self) {
        swap(&mut self.positions, &mut other.positions);
        swap(&mut self.triangles, &mut other.triangles);
        swap(&mut self.normals, &mut other.normals);
        swap(&mut self.triangle_normals, &mut other.triangle_normals);
        swap(&mut self.uvs, &mut other.uvs);
        swap(&mut self.triangle_uvs, &mut other.triangle_uvs);
        swap(&mut self.spheres, &mut other.spheres);
        swap(&mut self.sphere_axes, &mut other.sphere_axes);
        swap(&mut self.triangle_surface, &mut other.triangle_surface);
        swap(&mut self.sphere_surface, &mut other.sphere_surface);
        swap(&mut self.emitters, &mut other.emitters);
        swap(&mut self.first_colored, &mut other.first_colored);
    }

    /// The tables that renderers read.
    pub(super) fn into_tables(self) -> ShapeTables {
        let mut primitive_surface = self.triangle_surface;
        primitive_surface.extend(self.sphere_surface);
        ShapeTables {
            positions: self.positions,
            triangles: self.triangles,
            normals: self.normals,
            triangle_normals: self.triangle_normals,
            uvs: self.uvs,
            triangle_uvs: self.triangle_uvs,
            spheres: self.spheres,
            sphere_axes: self.sphere_axes,
            primitive_surface,
        }
    }

    /// The unit normal of the front side of a triangle, turned to the side of its shading normals
    /// as [`crate::RenderScene::interaction`] does.
    pub(super) fn front(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        let flat = (b - a).cross(c - a).normalize_or_zero();
        let corners = self.triangle_normals.get(triangle).copied().unwrap_or(FLAT);
        if corners == FLAT {
            return flat;
        }
        let sum: Vec3 = corners.iter().map(|&i| self.normals[i as usize]).sum();
        if flat.dot(sum) < 0.0 { -flat } else { flat }
    }

    /// The corners of a triangle.
    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }

    /// Adds a surface, and the number of its material in the scene.
    fn add_surface(&mut self, record: SurfaceRecord, material: Option<u32>) -> Id<SurfaceRecord> {
        self.surface_materials.push(material);
        self.surfaces.push(record)
    }

    /// Adds a black parallelogram that glows on the side of e1 × e2.
    pub(super) fn add_glowing(&mut self, origin: Vec3, e1: Vec3, e2: Vec3, emission: Spectrum) {
        let black = Diffuse { rho: Spectrum::ZERO };
        let lobe = self.lobes.push(AnyLobe::from(black).record());
        let record = SurfaceRecord {
            lobe,
            two_sided: false,
            material: None,
            opacity: None,
            cull_backfaces: false,
            emissive_sides: EmissiveSides::Front,
            emission,
            emission_texture: None,
            emission_coat: 0.0,
            light: None,
        };
        let surface = self.add_surface(record, None);
        let first = self.triangles.len();
        let base = self.positions.len() as u32;
        self.positions.extend([origin, origin + e1, origin + e1 + e2, origin + e2]);
        self.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        self.triangle_surface.extend([surface; 2]);
        if !self.triangle_normals.is_empty() {
            self.triangle_normals.extend([FLAT; 2]);
        }
        let primitives = Primitives::Triangles(std::iter::once(first..first + 2).collect());
        let emission =
            SurfaceEmission { radiance: emission, texture: None, is_invisible: false, coat: 0.0 };
        self.emitters.push(Emitter { surface, emission, primitives });
    }
}

/// Collects the shapes of a scene, in metres.
pub(super) fn collect(
    scene: &Scene,
    metres: f64,
    shutter: [f64; 2],
    options: &CompileOptions,
    notes: &mut Vec<String>,
) -> Result<Shapes, CompileError> {
    let course = options.course;
    let mut lowering = Lowering::new(course, metres as f32);
    let looks = scene.materials.iter().map(|m| CompiledSurface::of(m, &mut lowering)).collect();
    let mut collector = Collector {
        scene,
        course,
        shapes: Shapes::default(),
        plain: vec![None; scene.materials.len() + 1],
        looks,
        default: CompiledSurface::default_one(&mut lowering),
        uses_coordinates: options.texture_coordinates || lowering.uses_coordinates(),
        mesh_colors: Vec::new(),
        mesh_values: lowering.mesh_values.clone(),
        radii: HashMap::new(),
    };
    collector.note_points(notes);
    let track = |object| motion::track(object, metres, shutter);
    let tracks: Vec<_> = scene.objects.iter().map(track).collect();
    let shared = collector.shared(&tracks, options.most_copied_triangles);
    let mut placed = Tracks::new();
    for (number, (object, track)) in scene.objects.iter().zip(tracks).enumerate() {
        match track.as_slice() {
            [place] if !shared[number] => collector.add(object, place.to_world, notes)?,
            _ => {
                if track.len() > 1 {
                    motion::check_media(scene, object)?;
                }
                placed.push((number, track));
            }
        }
        let Shapes { triangles, spheres, object_ends, .. } = &mut collector.shapes;
        object_ends.push([triangles.len() as u32, spheres.len() as u32]);
    }
    collector.shapes.placed = InstancedShapes::collect(&mut collector, placed, options.bvh, notes)?;
    let Collector { shapes, mesh_colors, .. } = collector;
    let slide = |light: &pt_scene::Light| match &light.kind {
        LightKind::LinearSpot { texture, .. } => texture.as_ref().map(|t| lowering.texture(t)),
        LightKind::Projector { texture, .. } => Some(lowering.texture(texture)),
        _ => None,
    };
    let slides = scene.lights.iter().map(slide).collect();
    let (lobes, lobe_tables, materials) = lowering.finish(mesh_colors);
    Ok(Shapes { lobes, lobe_tables, materials, slides, ..shapes })
}

pub(super) struct Collector<'a> {
    pub(super) scene: &'a Scene,
    course: bool,
    pub(super) shapes: Shapes,
    /// Surface of each material that does not glow; the default material last.
    plain: Vec<Option<Id<SurfaceRecord>>>,
    looks: Vec<CompiledSurface>,
    /// What shapes without a material look like.
    default: CompiledSurface,
    /// True if any material asks for texture coordinates.
    uses_coordinates: bool,
    pub(super) mesh_colors: Vec<MeshColors>,
    /// See [`Lowering::mesh_values`].
    pub(super) mesh_values: Vec<Pattern>,
    /// The radii that were chosen for points, by their addresses.
    pub(super) radii: HashMap<usize, f64>,
}

impl Collector<'_> {
    /// Which objects that stand still are kept once, however often they are placed; the course's
    /// program has no such ones.
    fn shared(&self, tracks: &[Vec<MotionKey>], most: Option<usize>) -> Vec<bool> {
        if self.course {
            return vec![false; self.scene.objects.len()];
        }
        choose_instances(self.scene, most, |number, object| {
            let mut looks =
                object.materials.iter().flatten().filter_map(|m| self.looks.get(*m as usize));
            // Where they are placed, spheres of points would be stretched.
            let is_stretched = matches!(object.geometry, Geometry::Points { .. })
                && !is_similarity(object.to_world.matrix3);
            tracks[number].len() == 1 && !is_stretched && looks.all(|look| look.emission.is_black())
        })
    }

    /// Adds an object at a place.
    pub(super) fn add(
        &mut self,
        object: &Object,
        to_world: DAffine3,
        notes: &mut Vec<String>,
    ) -> Result<(), CompileError> {
        if !to_world.is_finite() {
            return Err(CompileError::Value {
                at: object.at.clone(),
                message: "the transformation has entries that are not finite numbers".into(),
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

    /// The surface of a material slot, and what it emits, if it glows. Glowing surfaces are made
    /// anew for each object, because each is a light of its own, and so are those between
    /// media.
    pub(super) fn surface(
        &mut self,
        object: &Object,
        slot: u32,
    ) -> (Id<SurfaceRecord>, Option<SurfaceEmission>) {
        let known = self.scene.materials.len();
        let material = object.materials.get(slot as usize).copied().flatten();
        let material = material.filter(|&m| (m as usize) < known);
        let look = material.map_or(&self.default, |m| &self.looks[m as usize]).clone();
        let glows = !look.emission.is_black();
        let plain = material.map_or(known, |m| m as usize);
        let is_shared = !glows && object.media.is_none();
        if let (true, Some(surface)) = (is_shared, self.plain[plain]) {
            return (surface, None);
        }
        let number = material;
        let CompiledSurface { lobe, two_sided, material, opacity, has_no_back, .. } = look;
        let emission = glows.then_some(SurfaceEmission {
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
            cull_backfaces: has_no_back,
            emissive_sides: if self.course { EmissiveSides::Both } else { EmissiveSides::Front },
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
        check_indices(object, "vertex", &mesh.triangles, mesh.positions.len())?;
        // A mirrored mesh keeps its front; the course's program turns it inside out.
        let mirrored = to_world.matrix3.determinant() < 0.0 && !self.course;
        let first = self.shapes.triangles.len();
        let base = self.shapes.positions.len() as u32;
        self.shapes.positions.extend(mesh.positions.iter().map(|&p| world_point(to_world, p)));
        self.shapes.triangles.extend(mesh.triangles.iter().map(|t| place(*t, base, mirrored)));
        self.add_normals(object, mesh, to_world, base, mirrored)?;
        self.add_coordinates(object, mesh, mirrored)?;
        self.add_values(object, mesh, mirrored)?;
        self.add_parts(object, mesh, first);
        Ok(())
    }

    /// Surfaces of the triangles of a mesh, of which the first is number `first`.
    fn add_parts(&mut self, object: &Object, mesh: &Mesh, first: usize) {
        let whole = [Submesh { triangles: 0..mesh.triangles.len() as u32, slot: 0 }];
        let parts = if mesh.submeshes.is_empty() { &whole[..] } else { &mesh.submeshes };
        let mut by_slot = HashMap::new();
        for part in parts {
            let (surface, emission) =
                *by_slot.entry(part.slot).or_insert_with(|| self.surface(object, part.slot));
            let start = self.shapes.triangle_surface.len();
            let end = (first + part.triangles.end as usize).min(self.shapes.triangles.len());
            self.shapes.triangle_surface.resize(end.max(start), surface);
            if let Some(emission) = emission {
                self.shapes.glow(surface, emission, start..end.max(start));
            }
        }
        let fallback = self.surface(object, u32::MAX).0;
        self.shapes.triangle_surface.resize(self.shapes.triangles.len(), fallback);
    }

    fn add_normals(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        to_world: DAffine3,
        base: u32,
        mirrored: bool,
    ) -> Result<(), CompileError> {
        let shapes = &mut self.shapes;
        let first = shapes.triangles.len() - mesh.triangles.len();
        let normal_base = shapes.normals.len() as u32;
        if self.course {
            let positions = &shapes.positions[base as usize..];
            let smooth = normals::course(positions, &mesh.triangles);
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

    /// Texture coordinates, if some material asks for them.
    fn add_coordinates(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        mirrored: bool,
    ) -> Result<(), CompileError> {
        let Some(uvs) = mesh.uvs.as_ref().filter(|_| self.uses_coordinates) else { return Ok(()) };
        check_attribute(object, "texture coordinate", mesh, uvs)?;
        let shapes = &mut self.shapes;
        let base = shapes.uvs.len() as u32;
        shapes.uvs.extend(uvs.values.iter().map(|&uv| Vec2::from(uv)));
        pad(&mut shapes.triangle_uvs, shapes.triangles.len() - mesh.triangles.len());
        let corners = |(i, &t)| place(uvs.corners(i, t), base, mirrored);
        shapes.triangle_uvs.extend(mesh.triangles.iter().enumerate().map(corners));
        Ok(())
    }

    /// What the materials of an object show of meshes.
    pub(super) fn shown_values(&self, object: &Object) -> ShownValues {
        let looks = object.materials.iter().flatten().filter_map(|m| self.looks.get(*m as usize));
        looks.flat_map(|look| &look.shown).copied().collect()
    }

    /// Colours and other values, if some material of the object shows them.
    fn add_values(
        &mut self,
        object: &Object,
        mesh: &Mesh,
        mirrored: bool,
    ) -> Result<(), CompileError> {
        let first =
            self.shapes.first_colored[0] + self.shapes.triangles.len() - mesh.triangles.len();
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
                        "there are colours for {} triangles, but {} triangles",
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
        notes: &mut Vec<String>,
    ) -> Result<(), CompileError> {
        let scale = to_world.matrix3.x_axis.length();
        if !self.course && !is_similarity(to_world.matrix3) {
            notes.push(format!(
                "{}: the sphere is stretched; it is rendered as an ellipsoid of triangles",
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
                message: format!("the radius of a sphere must not be {}", sphere.radius),
            });
        }
        if !self.shown_values(object).is_empty() {
            return Err(CompileError::Value {
                at: object.at.clone(),
                message: "a material shows the colours of a mesh, but a sphere is none; expected a mesh, \
                          or another material"
                    .into(),
            });
        }
        let (surface, emission) = self.surface(object, 0);
        let index = self.shapes.spheres.len();
        self.shapes.sphere_axes.resize(index, Mat3::IDENTITY);
        self.shapes.spheres.push(sphere);
        self.shapes.sphere_axes.push((to_world.matrix3 * scale.recip()).as_mat3());
        self.shapes.sphere_surface.push(surface);
        if let Some(emission) = emission {
            let primitives = Primitives::Sphere(index);
            self.shapes.emitters.push(Emitter { surface, emission, primitives });
        }
        Ok(())
    }
}

impl Shapes {
    /// Notes that triangles glow.
    fn glow(
        &mut self,
        surface: Id<SurfaceRecord>,
        emission: SurfaceEmission,
        run: std::ops::Range<usize>,
    ) {
        let known = self.emitters.iter_mut().rev().find(|e| e.surface == surface);
        if let Some(Primitives::Triangles(runs)) = known.map(|e| &mut e.primitives) {
            runs.push(run);
        } else {
            let primitives = Primitives::Triangles(vec![run]);
            self.emitters.push(Emitter { surface, emission, primitives });
        }
    }
}

/// Fills up with flat triangles.
fn pad(corners: &mut Vec<[u32; 3]>, len: usize) {
    corners.resize(len, FLAT);
}

/// Indices into a table to which `base` entries belong before; mirrored ones turn around.
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

/// Returns true if a matrix scales all directions alike (to one part in ten thousand).
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
    fn similarities_are_told_from_stretches() {
        let turn = DMat3::from_rotation_y(0.3) * 2.5;
        assert!(is_similarity(turn));
        assert!(!is_similarity(turn * DMat3::from_diagonal(DVec3::new(1.0, 1.1, 1.0))));
    }
}
