//! Lights with an extent that nobody sees.

use pt_math::{Pdf, SolidAngle, Vec3};

use super::tree::ManyLights;
use super::{
    AnyLight, Light, LightHit, LightSample, LightTables, Lit, MeshLight, SphereLight, TexturedMesh,
    TexturedSphere,
};

/// What lights as another light does, but emits nothing towards rays that meet it: only sampling finds it.
#[derive(Clone, Copy, Debug)]
pub enum Hidden {
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

macro_rules! of_shown {
    ($hidden:expr, $light:ident => $what:expr) => {
        match $hidden {
            Hidden::Mesh($light) => $what,
            Hidden::Sphere($light) => $what,
            Hidden::TexturedMesh($light) => $what,
            Hidden::TexturedSphere($light) => $what,
            Hidden::ManyLights($light) => $what,
        }
    };
}

impl Hidden {
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
        of_shown!(*self, light => light.into())
    }
}

impl Light for Hidden {
    const DELTA: bool = false;
    const HIDDEN: bool = true;

    #[inline(never)]
    fn sample(&self, tables: &LightTables, lit: &Lit, u: [f32; 2]) -> Option<LightSample> {
        of_shown!(self, light => light.sample(tables, lit, u))
    }

    #[inline(never)]
    fn sample_each(
        &self,
        tables: &LightTables,
        points: impl Iterator<Item = (Lit, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
    ) {
        of_shown!(self, light => light.sample_each(tables, points, samples));
    }

    fn pdf(
        &self,
        tables: &LightTables,
        lit: &Lit,
        wi: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        of_shown!(self, light => light.pdf(tables, lit, wi, hit))
    }

    /// Triangles and spheres; the others are asked in the same way.
    fn examples() -> Vec<(Self, LightTables)> {
        fn of<L: Light + Into<AnyLight>>() -> impl Iterator<Item = (Hidden, LightTables)> {
            let hidden = |(light, tables): (L, _)| Some((Hidden::of(light.into())?, tables));
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
