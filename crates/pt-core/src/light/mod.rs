//! Light sources: the [`Light`] contract and the closed set of lights.
//!
//! To add a light, write `my_light.rs` with its [`Light`] and, for tests, its `LightLaws`, and add
//! one line to `lights!` below. The laws of `laws.rs` then test it against its contract.

mod animated;
mod directional;
mod distant_disk;
pub mod emitter_triangle;
mod environment;
mod escaped_ray;
mod hemisphere;
mod hosek_sky;
pub(crate) mod hosek_wilkie;
mod ies;
mod invisible;
#[cfg(test)]
mod laws;
mod light_sample_context;
pub(crate) mod mean_daylight;
mod mesh;
mod point;
mod portal_sky;
mod projector;
mod sample_block;
mod source_id;
mod sphere;
mod spherical_triangle;
mod spot;
mod sun;
mod textured_mesh;
mod textured_sphere;
pub mod tree;
mod triangle_choice;
mod triangle_point;

use std::sync::Arc;

pub use animated::AnimatedLight;
pub use emitter_triangle::EmitterTriangle;
pub use environment::{EnvironmentMap, PlacedMap};
pub use escaped_ray::EscapedRay;
pub use hosek_sky::HosekWilkieModel;
pub use light_sample_context::{LightSampleContext, ReceiverSides};
pub use portal_sky::Portal;
pub use projector::ProjectedImage;
use pt_math::distribution::AliasTable;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3};
use pt_scene::IesProfile;
pub use source_id::{LightSourceId, LightSourceIds};
pub use spot::Falloff;
pub use sun::LimbDarkening;
pub use textured_mesh::TexturedTriangle;
pub use textured_sphere::SphereMap;

use crate::interaction::{SHADOW_EPSILON, SurfacePoint};
use crate::light::tree::{LightBounds, LightTree};
use crate::texture::Textures;

/// A sample of the light that arrives at a point, if it is not occluded.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub wi: Vec3,
    /// Distance to the light; infinite for lights that are not in the scene.
    pub distance: f32,
    /// End of the shadow ray: the point of the light, moved off it towards the receiving point by
    /// the error of its coordinates. `None` for lights at infinity.
    pub end: Option<Vec3>,
    /// Incident radiance; for delta lights the irradiance on a surface that faces the light.
    pub radiance: Spectrum,
    /// Density of `wi`, or `None` for delta lights, which only light sampling finds.
    pub pdf: Option<Pdf<SolidAngle>>,
}

/// Hit of a ray on a light that is part of the scene's geometry.
#[derive(Clone, Copy, Debug)]
pub struct LightHit {
    /// Squared distance from the reference point.
    pub distance_squared: f32,
    /// |cos| of the angle between the ray and the light's geometric normal.
    pub cos: f32,
    /// Corners of the triangle, or `None` if it is another shape.
    pub triangle: Option<[Vec3; 3]>,
    /// Number of the primitive in the scene.
    pub primitive: u32,
}

/// Contract of light sources.
pub trait Light {
    /// True if all light comes from a single direction, so that hitting it has probability 0.
    const DELTA: bool;
    /// True for area lights that are invisible to rays and can only be sampled.
    const INVISIBLE: bool = false;
    /// Samples a direction from which light comes, by a map from the unit square. `None` if no
    /// light comes from the sampled direction.
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample>;
    /// Computes [`Self::sample`] for each of many points and appends the results to `samples`.
    #[inline(always)]
    fn sample_each(
        &self,
        tables: &LightTables,
        points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        samples.extend(points.map(|(context, u)| self.sample(tables, &context, u)));
    }
    /// Density with which [`Self::sample`] returns `wi`. `hit` is the point that was hit, if the
    /// light has geometry. Zero for a delta light, whose direction has no density.
    #[inline(always)]
    fn pdf(
        &self,
        _tables: &LightTables,
        _lit: &LightSampleContext,
        _wi: Vec3,
        _hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        Pdf::ZERO
    }
    /// Radiance along a ray that leaves the scene.
    fn le_infinite(&self, _tables: &LightTables, _ray: EscapedRay) -> Spectrum {
        Spectrum::ZERO
    }
    /// Bounds by which a light tree chooses the light; `None` for lights that are in no tree.
    fn bounds(&self, tables: &LightTables) -> Option<LightBounds>;
    /// Returns true if [`Self::le_infinite`] is the same for all rays.
    fn is_constant(&self) -> bool {
        false
    }
    /// Lights worth testing, with the tables that they refer to. The laws are tested on each.
    fn examples() -> Vec<(Self, LightTables)>
    where
        Self: Sized;
}

/// Operation on a light of static type, which moves dispatch out of loops.
pub trait LightVisitor {
    /// Result of the operation.
    type Output;
    /// Performs the operation on a light.
    fn visit<L: Light>(self, light: &L) -> Self::Output;
}

/// Large data referenced by lights.
#[derive(Default)]
pub struct LightTables {
    /// Triangles of all emissive meshes.
    pub triangles: Vec<EmitterTriangle>,
    /// Texture mapping of emissive triangles with textures, mesh by mesh.
    pub textured_triangles: Vec<TexturedTriangle>,
    /// Texture mapping of emissive spheres with textures.
    pub sphere_maps: Vec<SphereMap>,
    /// Images of projectors.
    pub slides: Vec<ProjectedImage>,
    /// The textures of the scene.
    pub textures: Arc<Textures>,
    /// Sampling tables of triangles by area, or by their contribution; one for each mesh light.
    pub triangle_choice: Vec<AliasTable>,
    /// Light trees.
    pub trees: Vec<tree::LightTree>,
    /// Intensity profiles of luminaires.
    pub profiles: Vec<Arc<IesProfile>>,
    /// Environment maps.
    pub environments: Vec<Arc<EnvironmentMap>>,
    /// True if environment maps leave directions to BSDF sampling; see
    /// [`EnvironmentMap::compensate`].
    pub compensated: bool,
    /// Portals of skies.
    pub portals: Vec<Portal>,
    /// Clear skies.
    pub clear_skies: Vec<HosekWilkieModel>,
    /// Limb darkening of suns.
    pub limbs: Vec<LimbDarkening>,
}

/// Makes the closed set of lights, `AnyLight`, from lines of a name and a type. The module
/// `expansion` has what the macro makes of two lines, written out.
macro_rules! lights {
    ($($(#[$doc:meta])* $name:ident = $module:ident::$ty:ident),* $(,)?) => {
        $(pub use $module::$ty;)*

        /// Any light: the closed set that backends match on.
        #[derive(Clone, Copy, Debug)]
        pub enum AnyLight { $($(#[$doc])* $name($ty)),* }

        $(impl From<$ty> for AnyLight {
            fn from(light: $ty) -> Self { Self::$name(light) }
        })*

        impl AnyLight {
            /// See [`Light::DELTA`].
            #[inline(always)]
            pub fn is_delta(&self) -> bool {
                match self { $(Self::$name(_) => <$ty as Light>::DELTA),* }
            }
            /// See [`Light::INVISIBLE`].
            #[inline(always)]
            pub fn is_invisible(&self) -> bool {
                match self { $(Self::$name(_) => <$ty as Light>::INVISIBLE),* }
            }
            /// Name of the light in `lights!`.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$name(_) => stringify!($name)),* }
            }
            /// Applies the visitor to the light.
            #[inline(always)]
            pub fn visit<V: LightVisitor>(&self, visitor: V) -> V::Output {
                match self { $(Self::$name(l) => visitor.visit(l)),* }
            }
            /// See [`Light::sample`].
            #[inline(always)]
            pub fn sample(&self, t: &LightTables, context: &LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
                match self { $(Self::$name(l) => l.sample(t, context, u)),* }
            }
            /// See [`Light::pdf`].
            #[inline(always)]
            pub fn pdf(
                &self,
                t: &LightTables,
                context: &LightSampleContext,
                wi: Vec3,
                hit: Option<LightHit>,
            ) -> Pdf<SolidAngle> {
                match self { $(Self::$name(l) => l.pdf(t, context, wi, hit)),* }
            }
            /// See [`Light::le_infinite`].
            #[inline(always)]
            pub fn le_infinite(&self, t: &LightTables, ray: EscapedRay) -> Spectrum {
                match self { $(Self::$name(l) => l.le_infinite(t, ray)),* }
            }
            /// See [`Light::bounds`].
            pub fn bounds(&self, t: &LightTables) -> Option<LightBounds> {
                match self { $(Self::$name(l) => l.bounds(t)),* }
            }
            /// See [`Light::is_constant`].
            pub fn is_constant(&self) -> bool {
                match self { $(Self::$name(l) => l.is_constant()),* }
            }
            /// Properties of the light, for the laws.
            #[cfg(test)]
            fn laws(&self) -> &dyn laws::LightLaws {
                match self { $(Self::$name(l) => l),* }
            }
            /// Examples of all lights, for the laws.
            pub fn examples() -> Vec<(Self, LightTables)> {
                let mut all = Vec::new();
                $(all.extend($ty::examples().into_iter().map(|(l, t)| (Self::$name(l), t)));)*
                all
            }
        }
    };
}

#[cfg(test)]
mod expansion;

lights! {
    /// A point light.
    Point = point::PointLight,
    /// A spot light.
    Spot = spot::Spot,
    /// A point light with the intensity profile of a luminaire.
    Ies = ies::Ies,
    /// Parallel light.
    Directional = directional::Directional,
    /// A disk at infinity.
    DistantDisk = distant_disk::DistantDisk,
    /// The sun through the atmosphere.
    Sun = sun::Sun,
    /// Emissive triangles.
    Mesh = mesh::MeshLight,
    /// An emissive sphere.
    Sphere = sphere::SphereLight,
    /// Triangles with an emission texture.
    TexturedMesh = textured_mesh::TexturedMesh,
    /// A sphere with an emission texture.
    TexturedSphere = textured_sphere::TexturedSphere,
    /// A spot light that projects an image.
    Projector = projector::Projector,
    /// A light tree of emitters, one of which is chosen.
    EmitterTree = tree::EmitterTree,
    /// A light tree of lights without extent, one of which is chosen.
    PointLightTree = tree::PointLightTree,
    /// A light with an extent that is invisible to rays.
    Hidden = invisible::InvisibleLight,
    /// A constant hemispherical sky.
    Hemisphere = hemisphere::HemisphereLight,
    /// An environment light.
    Environment = environment::Environment,
    /// A sky behind a portal.
    PortalSky = portal_sky::PortalSky,
    /// A clear daylight sky.
    ClearSky = hosek_sky::HosekWilkieSky,
}

impl SurfacePoint {
    /// Returns the shadow ray to a light sample. It hits neither this surface nor the light.
    ///
    /// It ends slightly before the light: where coordinates of the light are 0, so is the error by
    /// which `end` is moved off it, but not the error of the depth that a query computes. That is
    /// 14ε of the most distant vertex, so the margin suffices for triangles 70 times as large as
    /// they are far away.
    #[inline(always)]
    pub fn spawn_to(&self, light: &LightSample) -> Ray {
        let origin = self.origin(light.wi);
        match light.end {
            None => Ray::new(origin, light.wi),
            Some(end) => Ray::to(origin, end - origin, SHADOW_EPSILON),
        }
    }
}

impl AnyLight {
    /// Returns the tree of the light, or `None` if it is a single light.
    pub fn tree<'t>(&self, tables: &'t LightTables) -> Option<&'t LightTree> {
        match self {
            Self::EmitterTree(EmitterTree { tree })
            | Self::Hidden(InvisibleLight::EmitterTree(EmitterTree { tree }))
            | Self::PointLightTree(PointLightTree { tree }) => Some(&tables.trees[*tree as usize]),
            _ => None,
        }
    }
}
