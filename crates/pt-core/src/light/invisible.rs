//! Lights with an extent that are invisible to rays.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Pdf, SolidAngle, Vec3};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws};
use super::tree::{EmitterTree, LightBounds};
use super::{
    AnyLight, Light, LightHit, LightSample, LightSampleContext, LightTables, MeshLight,
    SphereLight, TexturedMesh, TexturedSphere,
};

/// A light that illuminates the scene like the wrapped one, but emits nothing towards rays that hit
/// it: only light sampling finds it.
#[derive(Clone, Copy, Debug)]
pub enum InvisibleLight {
    /// Emissive triangles.
    Mesh(MeshLight),
    /// An emissive sphere.
    Sphere(SphereLight),
    /// Triangles with an emission texture.
    TexturedMesh(TexturedMesh),
    /// A sphere with an emission texture.
    TexturedSphere(TexturedSphere),
    /// A tree of such lights, one of which is chosen.
    EmitterTree(EmitterTree),
}

macro_rules! dispatch {
    ($hidden:expr, $light:ident => $what:expr) => {
        match $hidden {
            InvisibleLight::Mesh($light) => $what,
            InvisibleLight::Sphere($light) => $what,
            InvisibleLight::TexturedMesh($light) => $what,
            InvisibleLight::TexturedSphere($light) => $what,
            InvisibleLight::EmitterTree($light) => $what,
        }
    };
}

impl InvisibleLight {
    /// Hides a light, or returns `None` for lights that rays cannot hit or that are at infinity.
    pub(crate) fn of(light: AnyLight) -> Option<Self> {
        match light {
            AnyLight::Mesh(light) => Some(Self::Mesh(light)),
            AnyLight::Sphere(light) => Some(Self::Sphere(light)),
            AnyLight::TexturedMesh(light) => Some(Self::TexturedMesh(light)),
            AnyLight::TexturedSphere(light) => Some(Self::TexturedSphere(light)),
            AnyLight::EmitterTree(light) => Some(Self::EmitterTree(light)),
            _ => None,
        }
    }

    /// Returns the visible form of the light.
    pub(crate) fn shown(&self) -> AnyLight {
        dispatch!(*self, light => light.into())
    }
}

impl Light for InvisibleLight {
    const DELTA: bool = false;
    const INVISIBLE: bool = true;

    #[inline(never)]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        dispatch!(self, light => light.sample(tables, context, u))
    }

    #[inline(never)]
    fn sample_each(
        &self,
        tables: &LightTables,
        points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        dispatch!(self, light => light.sample_each(tables, points, samples));
    }

    fn pdf(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        wi: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        dispatch!(self, light => light.pdf(tables, context, wi, hit))
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// Triangles and spheres; the other variants are dispatched in the same way.
    fn examples() -> Vec<(Self, LightTables)> {
        fn of<L: Light + Into<AnyLight>>() -> impl Iterator<Item = (InvisibleLight, LightTables)> {
            let hidden =
                |(light, tables): (L, _)| Some((InvisibleLight::of(light.into())?, tables));
            L::examples().into_iter().filter_map(hidden)
        }
        of::<MeshLight>().chain(of::<SphereLight>()).collect()
    }
}

#[cfg(test)]
impl LightLaws for InvisibleLight {
    fn depends_on_surface(&self) -> bool {
        dispatch!(self, light => light.depends_on_surface())
    }

    fn geometry(&self, tables: &LightTables) -> LightGeometry {
        dispatch!(self, light => light.geometry(tables))
    }

    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        dispatch!(self, light => light.irradiance(tables, p, n))
    }
}

impl AnyLight {
    /// Returns the visible form of the light, which is the light itself unless it is hidden.
    pub(crate) fn shown(&self) -> Self {
        match self {
            Self::Hidden(hidden) => hidden.shown(),
            light => *light,
        }
    }
}
