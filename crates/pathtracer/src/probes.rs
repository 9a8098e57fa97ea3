//! Evaluation of single materials, lights and phase functions, for plots and experiments.

use pt_bvh::Hit;
use pt_core::bsdf::{Bsdf, BsdfSample};
use pt_core::id::Id;
use pt_core::interaction::Interaction;
use pt_core::light::{AnyLight, LightSample, LightSampleContext};
use pt_core::phase::AnyPhase;
use pt_core::{CompileError, CompileOptions, RenderScene, compile};
use pt_cpu::Tracer;
use pt_math::{Ray, Spectrum, Vec3};
use pt_scene::Scene;

fn compiled(scene: &Scene) -> Result<RenderScene, CompileError> {
    let options = CompileOptions { texture_coordinates: true, ..CompileOptions::default() };
    Ok(compile(scene, options)?.scene)
}

fn nearest(scene: &RenderScene, ray: &Ray) -> Option<(Interaction, Hit)> {
    let mut hits = Vec::new();
    Tracer::new(scene, false).intersect(std::slice::from_ref(ray), |_| 0.0, &mut hits);
    let hit = hits.pop()??;
    Some((scene.interaction(ray, &hit, 0.0), hit))
}

/// The material of the surface of a scene that a ray hits. Directions are unit vectors of the world
/// that point away from the surface.
pub struct MaterialProbe {
    scene: RenderScene,
    at: Interaction,
    hit: Hit,
}

impl MaterialProbe {
    /// Compiles a scene and finds its surface on a ray of unit direction; `None` if there is none.
    ///
    /// # Errors
    /// If the scene is inconsistent.
    pub fn new(scene: &Scene, ray: &Ray) -> Result<Option<Self>, CompileError> {
        let scene = compiled(scene)?;
        Ok(nearest(&scene, ray).map(|(at, hit)| Self { scene, at, hit }))
    }

    /// Calls `f` with the BSDF for scattering towards `wo`. `choice`, from 0 to 1, selects a part
    /// of a mixture.
    pub fn with_bsdf<T>(&self, wo: Vec3, choice: f32, f: impl FnOnce(&Bsdf<'_>) -> T) -> T {
        let at = Interaction { wo, ..self.at };
        let evaluated = self.scene.evaluate_material(&at, &self.hit, 0.0, choice, None);
        f(&self.scene.bsdf(&at, evaluated.as_ref()))
    }

    /// Returns f(wo, wi) |cos θi| without Dirac deltas.
    pub fn eval(&self, wo: Vec3, wi: Vec3, choice: f32) -> Spectrum {
        self.with_bsdf(wo, choice, |bsdf| bsdf.eval(wi))
    }

    /// Returns the density with which [`Self::sample`] returns `wi`, without Dirac deltas.
    pub fn pdf(&self, wo: Vec3, wi: Vec3, choice: f32) -> f32 {
        self.with_bsdf(wo, choice, |bsdf| bsdf.pdf(wi).get())
    }

    /// Samples a direction; `None` if the light is absorbed.
    pub fn sample(&self, wo: Vec3, u: [f32; 3], choice: f32) -> Option<BsdfSample> {
        self.with_bsdf(wo, choice, |bsdf| bsdf.sample(u))
    }
}

/// The lights of a scene.
pub struct LightProbe {
    scene: RenderScene,
    lights: Vec<Id<AnyLight>>,
}

impl LightProbe {
    /// Compiles a scene.
    ///
    /// # Errors
    /// If the scene is inconsistent.
    pub fn new(scene: &Scene) -> Result<Self, CompileError> {
        let scene = compiled(scene)?;
        let lights = scene.lights.iter().map(|(id, _)| id).collect();
        Ok(Self { scene, lights })
    }

    /// Names of the kinds of the lights, in order.
    pub fn kinds(&self) -> Vec<&'static str> {
        self.lights.iter().map(|id| self.scene.lights[*id].name()).collect()
    }

    /// Samples the light that arrives at a point from light number `light`; occlusion is not
    /// tested. `None` if no light comes from the sampled direction.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn sample(
        &self,
        light: usize,
        receiver: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        self.scene.lights[self.lights[light]].sample(&self.scene.light_tables, receiver, u)
    }

    /// Returns the density with which [`Self::sample`] returns the unit direction `wi`; 0 if
    /// another surface is nearer.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn pdf(&self, light: usize, receiver: &LightSampleContext, wi: Vec3) -> f32 {
        let Self { scene, lights } = self;
        let id = lights[light];
        let hit = match nearest(scene, &Ray::new(receiver.p, wi)) {
            None if scene.infinite_lights.contains(&id) => None,
            Some((at, _)) if scene.surfaces[at.surface].light == Some(id) => {
                Some(scene.light_hit(&at))
            }
            _ => return 0.0,
        };
        scene.lights[id].pdf(&scene.light_tables, receiver, wi, hit).get()
    }
}

/// The phase function of the first medium of a scene at a point; `None` without a medium.
///
/// # Errors
/// If the scene is inconsistent.
pub fn phase_function(scene: &Scene, p: Vec3) -> Result<Option<AnyPhase>, CompileError> {
    let scene = compiled(scene)?;
    let medium = scene.media.table.as_slice().first();
    Ok(medium.map(|medium| medium.phase_at(p).into_owned()))
}
