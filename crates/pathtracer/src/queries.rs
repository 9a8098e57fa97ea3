//! Ray queries on the surfaces of a scene.

use pt_bvh::Hit;
use pt_core::scene::HitPoint;
use pt_core::{CompileError, CompileOptions, RenderScene, compile, compile_edited};
use pt_cpu::Tracer;
use pt_math::{Bounds3, Ray, Vec3};
use pt_scene::Scene;

use crate::session::CompiledScene;

/// The surfaces of a scene at the beginning of its shutter interval, for ray queries. Surfaces of
/// any opacity are hit.
///
/// ```
/// use pathtracer::queries::SceneQueries;
/// use pt_math::{Ray, Vec3};
///
/// let queries = SceneQueries::new(&pathtracer::default_scene())?;
/// let mut hits = Vec::new();
/// queries.intersect(&[Ray::new(Vec3::Y, Vec3::NEG_Y)], &mut hits);
/// let hit = hits[0].unwrap();
/// assert_eq!(hit.object, 1);
/// assert!((hit.position.y + hit.t - 1.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SceneQueries {
    scene: RenderScene,
}

/// Nearest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// Distance from the origin of the ray.
    pub t: f32,
    /// Index of the object in [`Scene::objects`]; their number for shapes that belong to lights.
    pub object: u32,
    /// Index among the triangles of the object, or among its spheres.
    pub primitive: u32,
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// World-space position.
    pub position: Vec3,
    /// Unit geometric normal.
    pub normal: Vec3,
}

impl SceneQueries {
    /// Compiles a scene for queries.
    ///
    /// # Errors
    /// If the scene is inconsistent.
    pub fn new(scene: &Scene) -> Result<Self, CompileError> {
        let options = CompileOptions { texture_coordinates: true, ..CompileOptions::default() };
        Ok(Self { scene: compile(scene, options)?.scene })
    }

    /// Compiles a scene as [`Self::new`] does, and takes over from an earlier compilation what has
    /// not changed.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn edited(earlier: CompiledScene, scene: &Scene) -> Result<Self, CompileError> {
        let options = CompileOptions { texture_coordinates: true, ..CompileOptions::default() };
        Ok(Self { scene: compile_edited(scene, options, earlier.0)?.scene })
    }

    /// Replaces the contents of `hits` by the nearest hit of each ray, in order. Rays have unit
    /// directions.
    pub fn intersect(&self, rays: &[Ray], hits: &mut Vec<Option<SurfaceHit>>) {
        let mut found = Vec::new();
        Tracer::new(&self.scene, false).intersect(rays, |_| 0.0, &mut found);
        hits.clear();
        let pairs = rays.iter().zip(&found);
        hits.extend(pairs.map(|(ray, hit)| hit.as_ref().map(|hit| self.surface_hit(ray, hit))));
    }

    /// Replaces the contents of `occluded` by true for each ray that hits anything, in order.
    pub fn occluded(&self, rays: &[Ray], occluded: &mut Vec<bool>) {
        Tracer::new(&self.scene, false).occluded(rays, |_| 0.0, occluded);
    }

    /// Box around all surfaces.
    pub fn bounds(&self) -> Bounds3 {
        self.scene.bounds()
    }

    fn surface_hit(&self, ray: &Ray, hit: &Hit) -> SurfaceHit {
        let HitPoint { p, normal, uv } = self.scene.hit_point(ray, hit, 0.0);
        let element = self.scene.locate_primitive(hit.primitive);
        SurfaceHit {
            t: hit.t,
            object: element.object,
            primitive: element.index,
            uv: uv.to_array(),
            position: p,
            normal,
        }
    }
}
