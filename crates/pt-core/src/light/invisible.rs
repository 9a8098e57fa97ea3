//! Lights with an extent that nobody sees.

use pt_math::{Pdf, SolidAngle, Vec3};

use super::tree::ManyLights;
use super::{
    AnyLight, Light, LightHit, LightSample, LightSampleContext, LightTables, MeshLight,
    SphereLight, TexturedMesh, TexturedSphere,
};

/// What lights as another light does, but emits nothing towards rays that meet it: only sampling
/// finds it.
#[derive(Clone, Copy, Debug)]
pub enum InvisibleLight {
    /// Glowing triangles.
    Mesh(MeshLight),
    /// A glowing sphere.
    Sphere(SphereLight),
    /// Triangles that glow by a texture.
    TexturedMesh(TexturedMesh),
    /// A sphere that glows by a texture.
    TexturedSphere(TexturedSphere),
    /// Many of these, one of which is chosen.
    ManyLights(ManyLights),
}

macro_rules! dispatch {
    ($hidden:expr, $light:ident => $what:expr) => {
        match $hidden {
            InvisibleLight::Mesh($light) => $what,
            InvisibleLight::Sphere($light) => $what,
            InvisibleLight::TexturedMesh($light) => $what,
            InvisibleLight::TexturedSphere($light) => $what,
            InvisibleLight::ManyLights($light) => $what,
        }
    };
}

impl InvisibleLight {
    /// A light that could be seen; `None` for those that nothing hides.
    pub(crate) fn of(light: AnyLight) -> Option<Self> {
        match light {
            AnyLight::Mesh(light) => Some(Self::Mesh(light)),
            AnyLight::Sphere(light) => Some(Self::Sphere(light)),
            AnyLight::TexturedMesh(light) => Some(Self::TexturedMesh(light)),
            AnyLight::TexturedSphere(light) => Some(Self::TexturedSphere(light)),
            AnyLight::ManyLights(light) => Some(Self::ManyLights(light)),
            _ => None,
        }
    }

    /// The light that it would be if it were seen.
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

    /// Triangles and spheres; the others are asked in the same way.
    fn examples() -> Vec<(Self, LightTables)> {
        fn of<L: Light + Into<AnyLight>>() -> impl Iterator<Item = (InvisibleLight, LightTables)> {
            let hidden =
                |(light, tables): (L, _)| Some((InvisibleLight::of(light.into())?, tables));
            L::examples().into_iter().filter_map(hidden)
        }
        of::<MeshLight>().chain(of::<SphereLight>()).collect()
    }
}

impl AnyLight {
    /// The light that it would be if it were seen: itself, unless it is hidden.
    pub(crate) fn shown(&self) -> Self {
        match self {
            Self::Hidden(hidden) => hidden.shown(),
            light => *light,
        }
    }
}
