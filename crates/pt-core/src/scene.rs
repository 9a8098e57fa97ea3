//! The compiled scene: flat, immutable tables that backends read.

use pt_bvh::{Bvh, Hit, Sphere};
use pt_math::interval::gamma;
use pt_math::{Bounds3, Mat3, Ray, Spectrum, Vec2, Vec3, ray};

use crate::bsdf::{Bsdf, LobeRecord};
use crate::camera::Camera;
use crate::footprint::footprint;
use crate::id::{Id, Table};
use crate::light::{AnyLight, LightHit, LightSample, LightTables};
use crate::material::{Material, Materials, Resolved};
use crate::medium::{Media, MediumRecord};
use crate::texture::{TextureRecord, Varying};

/// How a part of a shape scatters and glows.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceRecord {
    /// Its scattering, unless `material` says it.
    pub lobe: Id<LobeRecord>,
    /// Whether the back side scatters as the front side does.
    pub two_sided: bool,
    /// What makes its scattering differ from point to point, if something does.
    pub material: Option<Id<Material>>,
    /// Share of it that is there; `None` is all.
    pub opacity: Option<Varying>,
    /// Which sides glow.
    pub glow: Glow,
    /// Radiance emitted; 1 where a texture says it.
    pub emission: Spectrum,
    /// The texture that says it.
    pub emission_texture: Option<Id<TextureRecord>>,
    /// The light by which the emission is sampled; `None` if it is only found by chance.
    pub light: Option<Id<AnyLight>>,
}

/// Which sides of a surface emit light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Glow {
    /// The side of the normal.
    Front,
    /// The other side.
    Back,
    /// Both sides.
    Both,
}

/// Three indices that mark a triangle without normals, or texture coordinates.
pub const FLAT: [u32; 3] = [u32::MAX; 3];

/// Everything a renderer reads. Made by [`crate::compile()`], never edited.
pub struct RenderScene {
    /// Vertex positions of all meshes, in world coordinates.
    pub positions: Vec<Vec3>,
    /// Corners of all triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals of all meshes, in world coordinates.
    pub normals: Vec<Vec3>,
    /// Normals at the corners of each triangle, or [`FLAT`]; empty if all are flat.
    pub triangle_normals: Vec<[u32; 3]>,
    /// Texture coordinates of all meshes whose triangles have some that are needed.
    pub uvs: Vec<Vec2>,
    /// Texture coordinates at the corners of each triangle, or [`FLAT`]; may end early.
    pub triangle_uvs: Vec<[u32; 3]>,
    /// Whether [`Interaction::normal`] is the plain interpolation of normals at corners, which is
    /// shorter than 1 between different ones: what the university course's program shows.
    pub plain_normals: bool,
    /// Spheres; their primitive numbers follow those of the triangles.
    pub spheres: Vec<Sphere>,
    /// The axes of each sphere in the world.
    pub sphere_axes: Vec<Mat3>,
    /// Surface of each primitive.
    pub primitive_surface: Vec<Id<SurfaceRecord>>,
    /// Numbers of triangles and of spheres of all objects up to each.
    pub object_ends: Vec<[u32; 2]>,
    /// Surfaces.
    pub surfaces: Table<SurfaceRecord>,
    /// Scattering lobes.
    pub lobes: Table<LobeRecord>,
    /// Materials that vary, with their textures.
    pub materials: Materials,
    /// Whether light goes through some surfaces as if they were not there.
    pub has_holes: bool,
    /// Lights.
    pub lights: Table<AnyLight>,
    /// How many lights there were before some of them became one of many; a glowing mesh is one.
    pub light_count: usize,
    /// Lights that are seen by rays that leave the scene.
    pub skies: Vec<Id<AnyLight>>,
    /// What lights refer to.
    pub light_tables: LightTables,
    /// What fills the space between surfaces.
    pub media: Media,
    /// The camera.
    pub camera: Camera,
    /// The ray queries.
    pub bvh: Bvh,
}

/// A point on a surface that rays leave.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Where.
    pub p: Vec3,
    /// Unit normal of the true surface.
    pub normal: Vec3,
    /// How far along the normal rays start from `p`, which is not exact: see
    /// [`pt_math::ray::offset`].
    pub offset: f32,
}

/// Where rays end that ask whether something is in the way.
const BEFORE: f32 = 1.0 - 1.0 / 16384.0;

impl SurfacePoint {
    /// A point that is on no surface: rays leave it where it is.
    #[inline]
    pub fn in_space(p: Vec3) -> Self {
        Self { p, normal: Vec3::Z, offset: 0.0 }
    }

    /// The origin of a ray from here in direction `w`.
    #[inline(always)]
    fn origin(&self, w: Vec3) -> Vec3 {
        ray::offset_by(self.p, self.offset, self.normal, w)
    }

    /// A ray from here in the unit direction `w`.
    #[inline(always)]
    pub fn spawn(&self, w: Vec3) -> Ray {
        Ray::new(self.origin(w), w)
    }

    /// The ray that asks whether something is in the way of a light, and hits neither this
    /// surface nor the light.
    ///
    /// It ends a little before the light: where coordinates of the light vanish, so does the error by
    /// which `end` is moved off it, but not that of the depth in which a query finds it. That is 14ε of
    /// the most distant vertex, so it suffices for triangles 70 times as large as they are far away.
    #[inline(always)]
    pub fn spawn_to(&self, light: &LightSample) -> Ray {
        let origin = self.origin(light.wi);
        match light.end {
            None => Ray::new(origin, light.wi),
            Some(end) => Ray::to(origin, end - origin, BEFORE),
        }
    }

    /// The ray that asks whether something is between this point and another one, which is in the unit
    /// direction `w`, and hits neither surface.
    #[inline(always)]
    pub fn spawn_at(&self, other: &Self, w: Vec3) -> Ray {
        let origin = self.origin(w);
        Ray::to(origin, other.origin(-w) - origin, BEFORE)
    }
}

/// A point on a surface, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Where; its normal is on the side of `normal`.
    pub point: SurfacePoint,
    /// Shading normal; of unit length unless [`RenderScene::plain_normals`].
    pub normal: Vec3,
    /// Unit direction towards where it is seen from.
    pub wo: Vec3,
    /// Distance from there.
    pub distance: f32,
    /// The surface.
    pub surface: Id<SurfaceRecord>,
    /// The primitive.
    pub primitive: u32,
}

impl RenderScene {
    /// The medium beyond a surface that a ray, which came through `current`, hits and goes through.
    pub fn medium_beyond(
        &self,
        ray: &Ray,
        hit: &Hit,
        current: Option<Id<MediumRecord>>,
    ) -> Option<Id<MediumRecord>> {
        if self.media.is_empty() {
            return None;
        }
        let at = self.interaction(ray, hit);
        let outwards = ray.direction.dot(at.point.normal) > 0.0;
        self.media.beyond(at.surface, outwards, current)
    }

    /// The box around all shapes.
    pub fn bounds(&self) -> Bounds3 {
        self.bvh.bounds()
    }

    /// The number of the object that a primitive belongs to; that of primitives that lights bring with
    /// them is the number of objects.
    pub fn object(&self, primitive: u32) -> u32 {
        let triangles = self.triangles.len() as u32;
        let number = match primitive.checked_sub(triangles) {
            None => self.object_ends.partition_point(|end| end[0] <= primitive),
            Some(sphere) => self.object_ends.partition_point(|end| end[1] <= sphere),
        };
        number as u32
    }

    /// The surface point where a ray of unit direction met a primitive.
    #[inline(always)]
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction {
        let primitive = hit.primitive as usize;
        let (p, error, geometric_normal, normal) = match primitive.checked_sub(self.triangles.len())
        {
            None => self.triangle_point(primitive, hit),
            Some(sphere) => self.sphere_point(sphere, ray.at(hit.t)),
        };
        Interaction {
            point: SurfacePoint {
                p,
                normal: geometric_normal,
                offset: ray::offset(p, error, geometric_normal),
            },
            normal,
            wo: -ray.direction,
            distance: hit.t,
            surface: self.primitive_surface[primitive],
            primitive: hit.primitive,
        }
    }

    /// What the lights need to know of a light that was hit.
    #[inline(always)]
    pub fn light_hit(&self, at: &Interaction) -> LightHit {
        let corners = self.triangles.get(at.primitive as usize);
        LightHit {
            distance_squared: at.distance * at.distance,
            cos: at.point.normal.dot(at.wo).abs(),
            triangle: corners.map(|t| t.map(|v| self.positions[v as usize])),
            primitive: at.primitive,
        }
    }

    /// p = Σ bᵢ pᵢ, with |error| ≤ γ₇ Σ |bᵢ pᵢ|. [Pharr, Jakob & Humphreys, Physically Based
    /// Rendering, 3rd ed., §3.9.4]
    #[inline(always)]
    fn triangle_point(&self, i: usize, hit: &Hit) -> (Vec3, Vec3, Vec3, Vec3) {
        let [p0, p1, p2] = self.triangles[i].map(|v| self.positions[v as usize]);
        let b0 = 1.0 - hit.b1 - hit.b2;
        let (q0, q1, q2) = (p0 * b0, p1 * hit.b1, p2 * hit.b2);
        let p = q0 + q1 + q2;
        let error = (q0.abs() + q1.abs() + q2.abs()) * gamma(7);
        let flat = (p1 - p0).cross(p2 - p0).normalize();
        let corners = self.triangle_normals.get(i).copied().unwrap_or(FLAT);
        if corners == FLAT {
            return (p, error, flat, flat);
        }
        let [n0, n1, n2] = corners.map(|v| self.normals[v as usize]);
        let sum = n0 * b0 + n1 * hit.b1 + n2 * hit.b2;
        let length_squared = sum.length_squared();
        if length_squared < 1e-12 {
            return (p, error, flat, flat);
        }
        let normal = if self.plain_normals { sum } else { sum / length_squared.sqrt() };
        let geometric = if flat.dot(normal) < 0.0 { -flat } else { flat };
        (p, error, geometric, normal)
    }

    /// The point moved onto the sphere, with an error of γ₅ of its coordinates. [ibid., §3.9.4]
    #[inline(always)]
    fn sphere_point(&self, i: usize, p: Vec3) -> (Vec3, Vec3, Vec3, Vec3) {
        let Sphere { center, radius } = self.spheres[i];
        let n = (p - center).normalize();
        let offset = n * radius.abs();
        let p = center + offset;
        let error = (center.abs() + offset.abs()) * gamma(5);
        let n = if radius < 0.0 { -n } else { n };
        (p, error, n, n)
    }

    /// The scattering at a point of a surface that is the same everywhere.
    #[inline(always)]
    pub fn bsdf(&self, at: &Interaction) -> Bsdf<'_> {
        let surface = &self.surfaces[at.surface];
        let lobe = &self.lobes[surface.lobe];
        Bsdf::new(lobe, surface.two_sided, self.unit_normal(at), at.point.normal, at.wo)
    }

    /// What there is at a point of a surface that varies; `choice` from [0, 1) makes the choices of
    /// mixtures, and `width` is how wide the cone of the ray is there, in metres, if that is followed.
    /// `None` if the surface is the same everywhere.
    #[inline(always)]
    pub fn resolve(
        &self,
        at: &Interaction,
        hit: &Hit,
        choice: f32,
        width: Option<f32>,
    ) -> Option<Resolved> {
        let material = self.surfaces[at.surface].material?;
        let mut parametrization = self.parametrization(at, hit);
        if let Some(width) = width {
            parametrization.footprint = footprint(at, &parametrization, width);
        }
        let normal = self.unit_normal(at);
        let Self { lobes, materials, .. } = self;
        Some(materials.resolve(lobes, material, at, normal, &parametrization, choice))
    }

    /// The share of the surface that is there, where a ray met it.
    #[inline]
    pub fn opacity(&self, ray: &Ray, hit: &Hit) -> f32 {
        let surface = self.primitive_surface[hit.primitive as usize];
        match self.surfaces[surface].opacity {
            None => 1.0,
            Some(Varying::Value(opacity)) => opacity,
            Some(texture) => {
                let at = self.interaction(ray, hit);
                let place = self.parametrization(&at, hit);
                self.materials.textures.number(texture, &place).clamp(0.0, 1.0)
            }
        }
    }

    #[inline(always)]
    fn unit_normal(&self, at: &Interaction) -> Vec3 {
        if self.plain_normals { at.normal.normalize() } else { at.normal }
    }

    /// Whether the primitive that was hit emits light on a side of it.
    #[inline(always)]
    pub fn glows(&self, hit: &Hit) -> bool {
        let surface = self.primitive_surface[hit.primitive as usize];
        !self.surfaces[surface].emission.is_black()
    }

    /// Radiance that the surface emits towards `at.wo`, where it was hit.
    #[inline(always)]
    pub fn emitted(&self, at: &Interaction, hit: &Hit) -> Spectrum {
        let surface = &self.surfaces[at.surface];
        if surface.emission.is_black() {
            return Spectrum::ZERO;
        }
        let front = at.wo.dot(at.point.normal) > 0.0;
        let glows = match surface.glow {
            Glow::Front => front,
            Glow::Back => !front,
            Glow::Both => true,
        };
        match surface.emission_texture {
            _ if !glows => Spectrum::ZERO,
            None => surface.emission,
            Some(texture) => self.radiance(texture, at, hit),
        }
    }

    /// That of a texture.
    #[inline(never)]
    fn radiance(&self, texture: Id<TextureRecord>, at: &Interaction, hit: &Hit) -> Spectrum {
        self.materials.textures.radiance(texture, &self.parametrization(at, hit))
    }

    /// Radiance from the sky along a ray that leaves the scene in direction `d`.
    #[inline(always)]
    pub fn sky(&self, d: Vec3) -> Spectrum {
        let radiance = |&id| self.lights[id].escaped(&self.light_tables, d);
        self.skies.iter().map(radiance).sum()
    }
}
