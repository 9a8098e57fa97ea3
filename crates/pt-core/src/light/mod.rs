//! Light sources: the [`Light`] contract and the closed set of lights.
//!
//! To add a light: write `my_light.rs`, add one line to `lights!` below. The laws of `laws.rs`
//! then hold it to its contract.

mod animated;
mod directional;
mod distant_disk;
pub mod environment;
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
mod source_id;
mod sphere;
mod spherical_triangle;
mod spot;
mod sun;
mod textured_mesh;
mod textured_sphere;
pub mod tree;

use std::sync::Arc;

use pt_math::distribution::AliasTable;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
use pt_scene::IesProfile;

pub use animated::AnimatedLight;
pub use environment::{EnvironmentMap, PlacedMap};
pub use hosek_sky::HosekWilkieModel;
pub use light_sample_context::{LightSampleContext, ReceiverSides};
pub use mesh::EmitterTriangle;
pub use portal_sky::Portal;
pub use projector::ProjectedImage;
pub use source_id::{LightSourceId, LightSourceIds};
pub use spot::Falloff;
pub use sun::LimbDarkening;
pub use textured_mesh::TexturedTriangle;
pub use textured_sphere::SphereMap;

use crate::texture::Textures;

/// Light that arrives at a point, if nothing is in its way.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub wi: Vec3,
    /// Distance to the light; infinite for lights that are not in the scene.
    pub distance: f32,
    /// Where a ray that asks for what is in the way must end: the point of the light, moved off
    /// it by the error of its coordinates towards the lit point. `None` is infinitely far.
    pub end: Option<Vec3>,
    /// Incident radiance; for delta lights the irradiance on a surface that faces the light.
    pub radiance: Spectrum,
    /// Density of `wi`, or `None` for delta lights, which nothing but sampling finds.
    pub pdf: Option<Pdf<SolidAngle>>,
}

/// Where a ray met a light that is part of the scene's geometry.
#[derive(Clone, Copy, Debug)]
pub struct LightHit {
    /// Distance from the reference point, squared.
    pub distance_squared: f32,
    /// |cos| of the angle between the ray and the light's geometric normal.
    pub cos: f32,
    /// Corners of the triangle, if it is one.
    pub triangle: Option<[Vec3; 3]>,
    /// Number of the primitive in the scene.
    pub primitive: u32,
}

/// A source of light.
pub trait Light {
    /// True if all light comes from a single direction, so that hitting it has probability 0.
    const DELTA: bool;
    /// True if rays that meet it see nothing of it, so that only sampling finds it, though it has
    /// an extent.
    const INVISIBLE: bool = false;
    /// Chooses a direction from which light comes, by a map from the unit square. `None` where
    /// the choice is one from which no light comes.
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample>;
    /// [`Self::sample`] for each of many points, added to `samples`.
    #[inline(always)]
    fn sample_each(
        &self,
        tables: &LightTables,
        points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        samples.extend(points.map(|(context, u)| self.sample(tables, &context, u)));
    }
    /// Density with which [`Self::sample`] returns `wi`; `hit` says where on the light, if the
    /// light has geometry. Zero for a delta light, whose direction has none.
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
    /// Radiance along a ray that leaves `p` in direction `d`, and the scene.
    fn le_infinite(&self, _tables: &LightTables, _p: Vec3, _d: Vec3) -> Spectrum {
        Spectrum::ZERO
    }
    /// Returns true if [`Self::le_infinite`] is the same everywhere in all directions.
    fn is_constant(&self) -> bool {
        false
    }
    /// Settings worth testing, with the tables they refer to; the laws run on each.
    fn examples() -> Vec<(Self, LightTables)>
    where
        Self: Sized;
}

/// What is done to a light whose kind is known, for loops that ask for it once.
pub trait LightVisitor {
    /// What comes of it.
    type Output;
    /// Does it.
    fn visit<L: Light>(self, light: &L) -> Self::Output;
}

/// Large data that lights refer to.
#[derive(Default)]
pub struct LightTables {
    /// Triangles of all emissive meshes.
    pub triangles: Vec<EmitterTriangle>,
    /// How those that glow by textures lie on them, mesh by mesh.
    pub textured_triangles: Vec<TexturedTriangle>,
    /// How spheres that glow by textures lie on them.
    pub sphere_maps: Vec<SphereMap>,
    /// What projectors throw.
    pub slides: Vec<ProjectedImage>,
    /// The textures of the scene.
    pub textures: Arc<Textures>,
    /// Choice of a triangle by area, or by its share of the light, one table a mesh light.
    pub triangle_choice: Vec<AliasTable>,
    /// Trees of many lights.
    pub trees: Vec<tree::LightTree>,
    /// Intensities of luminaires.
    pub profiles: Vec<Arc<IesProfile>>,
    /// Environment maps.
    pub environments: Vec<EnvironmentMap>,
    /// True if these leave directions to BSDF sampling; see [`EnvironmentMap::compensate`].
    pub compensated: bool,
    /// Windows before skies.
    pub portals: Vec<Portal>,
    /// Clear skies.
    pub clear_skies: Vec<HosekWilkieModel>,
    /// How suns darken to their rims.
    pub limbs: Vec<LimbDarkening>,
}

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
            /// Name of the light, as in `lights!`.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$name(_) => stringify!($name)),* }
            }
            /// What the visitor makes of the light.
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
            pub fn le_infinite(&self, t: &LightTables, p: Vec3, d: Vec3) -> Spectrum {
                match self { $(Self::$name(l) => l.le_infinite(t, p, d)),* }
            }
            /// See [`Light::is_constant`].
            pub fn is_constant(&self) -> bool {
                match self { $(Self::$name(l) => l.is_constant()),* }
            }
            /// Settings of all lights, for the laws.
            pub fn examples() -> Vec<(Self, LightTables)> {
                let mut all = Vec::new();
                $(all.extend($ty::examples().into_iter().map(|(l, t)| (Self::$name(l), t)));)*
                all
            }
        }
    };
}

lights! {
    /// A point.
    Point = point::Point,
    /// A point that shines into a cone.
    Spot = spot::Spot,
    /// A point with the intensities of a luminaire.
    Ies = ies::Ies,
    /// Parallel light.
    Directional = directional::Directional,
    /// A disk, infinitely far away.
    DistantDisk = distant_disk::DistantDisk,
    /// The sun through the air.
    Sun = sun::Sun,
    /// Glowing triangles.
    Mesh = mesh::MeshLight,
    /// A glowing sphere.
    Sphere = sphere::SphereLight,
    /// Triangles that glow by a texture.
    TexturedMesh = textured_mesh::TexturedMesh,
    /// A sphere that glows by a texture.
    TexturedSphere = textured_sphere::TexturedSphere,
    /// A point that throws a picture.
    Projector = projector::Projector,
    /// Many of these, one of which is chosen.
    ManyLights = tree::ManyLights,
    /// Many lights without extent, one of which is chosen.
    ManyPoints = tree::ManyPoints,
    /// One with an extent that nobody sees.
    Hidden = invisible::InvisibleLight,
    /// The upper half of the sky.
    Hemisphere = hemisphere::Hemisphere,
    /// All of the sky.
    Environment = environment::Environment,
    /// The sky behind a window.
    PortalSky = portal_sky::PortalSky,
    /// The clear sky by day.
    ClearSky = hosek_sky::HosekWilkieSky,
}
