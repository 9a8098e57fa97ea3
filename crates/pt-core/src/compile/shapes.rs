//! Shapes, emitters and surfaces of a scene during compilation.

use std::mem::swap;
use std::sync::Arc;

use pt_bvh::{AnimatedInstance, Bvh, Sphere};
use pt_math::{Mat3, Spectrum, Vec2, Vec3};
use pt_scene::{Sides, Span};

use crate::bsdf::{Diffuse, LobeRecord, LobeTables};
use crate::id::{Id, SurfaceId, SurfaceMarker, Table};
use crate::instances::Instance;
use crate::light::{AnimatedLight, AnyLight};
use crate::material::Materials;
use crate::shapes::{FLAT, ShapeTables};
use crate::surface::{EmissiveSides, SurfaceRecord};
use crate::texture_record::TextureRecord;

/// All shapes in world space.
#[derive(Default)]
pub(super) struct Shapes {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Vec<Vec3>,
    /// Indices of the corner normals of each triangle; empty if there are none.
    pub(super) triangle_normals: Vec<[u32; 3]>,
    pub(super) uvs: Vec<Vec2>,
    /// Indices of the corner coordinates of each triangle; may be shorter than the triangles.
    pub(super) triangle_uvs: Vec<[u32; 3]>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) sphere_axes: Vec<Mat3>,
    pub(super) triangle_surface: Vec<SurfaceId>,
    pub(super) sphere_surface: Vec<SurfaceId>,
    /// See [`crate::RenderScene::object_ends`].
    pub(super) object_ends: Vec<[u32; 2]>,
    pub(super) surfaces: Table<SurfaceRecord, SurfaceMarker>,
    /// See [`crate::RenderScene::surface_materials`].
    pub(super) surface_materials: Vec<Option<u32>>,
    pub(super) lobes: Table<LobeRecord>,
    pub(super) lobe_tables: LobeTables,
    pub(super) materials: Materials,
    /// Emissive primitives.
    pub(super) emitters: Vec<Emitter>,
    /// Surfaces between media, with the location of their object in the file.
    pub(super) sides: Vec<(SurfaceId, Sides, Span)>,
    /// Texture of each light node; `None` without one.
    pub(super) slides: Vec<Option<Id<TextureRecord>>>,
    /// Instanced objects, whose shapes are not in these tables.
    pub(super) placed: InstancedShapes,
    /// Indices of the first triangle and the first sphere among the primitives with vertex colours.
    pub(super) first_colored: [usize; 2],
}

/// Primitives that form one light.
pub(super) struct Emitter {
    pub(super) surface: SurfaceId,
    pub(super) emission: SurfaceEmission,
    pub(super) primitives: ShapePrimitives,
}

/// Emission of a surface.
#[derive(Clone, Copy)]
pub(super) struct SurfaceEmission {
    /// See [`SurfaceRecord::emission`].
    pub(super) radiance: Spectrum,
    pub(super) texture: Option<Id<TextureRecord>>,
    /// True if rays do not see the emission, so that the surface does not contain it.
    pub(super) is_invisible: bool,
    /// See [`SurfaceRecord::emission_coat`].
    pub(super) coat: f32,
}

/// A run of triangles, or one sphere.
pub(super) enum ShapePrimitives {
    Triangles(Vec<std::ops::Range<usize>>),
    Sphere(usize),
}

impl Shapes {
    /// Swaps the shapes and emitters with those of another collection.
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

    /// Converts to the tables that renderers read.
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

    /// Unit normal of the front side of a triangle, oriented by its shading normals as in
    /// [`crate::RenderScene::interaction`].
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

    /// Corners of a triangle.
    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }

    /// Adds a surface, with the index of its material in the scene.
    pub(super) fn add_surface(
        &mut self,
        record: SurfaceRecord,
        material: Option<u32>,
    ) -> SurfaceId {
        self.surface_materials.push(material);
        self.surfaces.push(record)
    }

    /// Adds a black parallelogram that emits light on the side of e1 × e2.
    pub(super) fn add_emissive_square(
        &mut self,
        origin: Vec3,
        e1: Vec3,
        e2: Vec3,
        emission: Spectrum,
    ) {
        let black = Diffuse { rho: Spectrum::ZERO };
        let lobe = self.lobes.push(black.into());
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
        let primitives = ShapePrimitives::Triangles(std::iter::once(first..first + 2).collect());
        let emission =
            SurfaceEmission { radiance: emission, texture: None, is_invisible: false, coat: 0.0 };
        self.emitters.push(Emitter { surface, emission, primitives });
    }
}

impl Shapes {
    /// Records that a run of triangles emits light.
    pub(super) fn add_emitter(
        &mut self,
        surface: SurfaceId,
        emission: SurfaceEmission,
        run: std::ops::Range<usize>,
    ) {
        let known = self.emitters.iter_mut().rev().find(|e| e.surface == surface);
        if let Some(ShapePrimitives::Triangles(runs)) = known.map(|e| &mut e.primitives) {
            runs.push(run);
        } else {
            let primitives = ShapePrimitives::Triangles(vec![run]);
            self.emitters.push(Emitter { surface, emission, primitives });
        }
    }
}

/// Shapes of an instanced object during compilation.
pub(super) struct ObjectShapes {
    pub(super) shapes: Shapes,
    pub(super) bvh: Arc<Bvh>,
    /// Emitters of the object.
    pub(super) lights: Vec<(SurfaceId, AnyLight)>,
}

/// Instances during compilation.
#[derive(Default)]
pub(super) struct InstancedShapes {
    pub(super) objects: Vec<ObjectShapes>,
    pub(super) instances: Vec<Instance>,
    pub(super) moving: Vec<AnimatedInstance>,
    pub(super) lights: Vec<AnimatedLight>,
    /// Number of shapes that no ray can hit.
    pub(super) skipped: u32,
    /// Number of skipped shapes that are out of the range of coordinates.
    pub(super) out_of_range: u32,
}
