//! Shapes, emitters and surfaces of a scene during compilation.

use std::mem::swap;
use std::ops::Deref;
use std::sync::Arc;

use pt_bvh::{AnimatedInstance, Bvh};
use pt_math::{Spectrum, Vec3};
use pt_scene::{Sides, Span};

use super::reuse::KeptShapes;
use crate::bsdf::{Diffuse, LobeRecord, LobeTables};
use crate::id::{Id, SurfaceId, SurfaceMarker, Table};
use crate::instances::Instance;
use crate::light::{AnimatedLight, AnyLight};
use crate::material::Materials;
use crate::shapes::{FLAT, ShapeArrays, ShapeTables};
use crate::surface::{EmissiveSides, SurfaceRecord};
use crate::texture_record::TextureRecord;

/// Shapes in a common coordinate system.
#[derive(Default)]
pub(super) struct Shapes {
    /// The shapes. Those without a surface yet are from an earlier compilation.
    pub(super) arrays: Arc<ShapeArrays>,
    /// True if the arrays are those of an earlier compilation, to which nothing is added.
    pub(super) are_kept: bool,
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
    /// Record for the next compilation.
    pub(super) kept: KeptShapes,
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
        swap(&mut self.arrays, &mut other.arrays);
        swap(&mut self.are_kept, &mut other.are_kept);
        swap(&mut self.triangle_surface, &mut other.triangle_surface);
        swap(&mut self.sphere_surface, &mut other.sphere_surface);
        swap(&mut self.emitters, &mut other.emitters);
        swap(&mut self.first_colored, &mut other.first_colored);
    }

    /// Converts to the tables that renderers read.
    pub(super) fn into_tables(self) -> ShapeTables {
        let mut primitive_surface = self.triangle_surface;
        primitive_surface.extend(self.sphere_surface);
        ShapeTables { arrays: self.arrays, primitive_surface: primitive_surface.into() }
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
        let first = self.triangle_surface.len();
        self.place_square(first, [origin, origin + e1, origin + e1 + e2, origin + e2]);
        self.triangle_surface.extend([surface; 2]);
        let primitives = ShapePrimitives::Triangles(std::iter::once(first..first + 2).collect());
        let emission =
            SurfaceEmission { radiance: emission, texture: None, is_invisible: false, coat: 0.0 };
        self.emitters.push(Emitter { surface, emission, primitives });
    }

    /// Places the next square, whose first triangle has the number `first`. An equal one of an
    /// earlier compilation is kept.
    fn place_square(&mut self, first: usize, corners: [Vec3; 4]) {
        let bits = |corners: &[Vec3]| -> Vec<_> {
            corners.iter().map(|p| p.to_array().map(f32::to_bits)).collect()
        };
        let known = self.arrays.triangles.get(first).map(|t| t[0] as usize);
        let Some(base) = known else {
            let arrays = self.arrays_mut();
            let base = arrays.positions.len() as u32;
            arrays.positions.extend(corners);
            arrays.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
            if !arrays.triangle_normals.is_empty() {
                arrays.triangle_normals.extend([FLAT; 2]);
            }
            return;
        };
        if bits(&self.arrays.positions[base..base + 4]) != bits(&corners) {
            self.arrays_mut().positions[base..base + 4].copy_from_slice(&corners);
        }
    }

    /// Numbers of triangles and spheres so far.
    pub(super) fn counts(&self) -> [usize; 2] {
        [self.triangle_surface.len(), self.sphere_surface.len()]
    }

    /// Removes squares of an earlier compilation that have not been placed again.
    pub(super) fn remove_old_squares(&mut self) {
        let left = self.arrays.triangles.len() - self.triangle_surface.len();
        if left > 0 {
            let count = self.triangle_surface.len();
            let arrays = self.arrays_mut();
            arrays.triangles.truncate(count);
            arrays.triangle_normals.truncate(count);
            arrays.positions.truncate(arrays.positions.len() - 2 * left);
        }
    }

    /// The arrays, to be changed; those that an earlier compilation shares are copied first.
    pub(super) fn arrays_mut(&mut self) -> &mut ShapeArrays {
        Arc::make_mut(&mut self.arrays)
    }
}

impl Deref for Shapes {
    type Target = ShapeArrays;

    fn deref(&self) -> &ShapeArrays {
        &self.arrays
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
    /// Number of an object of the scene for each object.
    pub(super) numbers: Vec<usize>,
}
