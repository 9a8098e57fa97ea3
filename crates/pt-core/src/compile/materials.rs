//! From the author's materials to lobes.
//!
//! To add a material: its struct goes into `pt_scene::material` with its name in `surfaces!`, and
//! its [`Lower`] here; the compiler asks for the second when the first is there.

use pt_math::Spectrum;
use pt_scene::material::{
    Black, CoatedDiffuse, Conductor, Distribution, Glass, Matte, Mirror, Plastic, Refraction,
    Roughness, Surface, ThinGlass,
};

use crate::bsdf::microfacet::Facets;
use crate::bsdf::{self, AnyLobe};

/// A material as renderers see it.
pub(super) struct Lowered {
    pub(super) lobe: AnyLobe,
    pub(super) two_sided: bool,
}

impl Lowered {
    fn new(lobe: impl Into<AnyLobe>, two_sided: bool) -> Self {
        Self { lobe: lobe.into(), two_sided }
    }
}

/// Indices of refraction that differ by less from each other are the same.
const LEAST_CONTRAST: f32 = 1e-3;
/// Surfaces with less roughness are as smooth to the eye, but not to single precision.
const LEAST_ALPHA: f32 = 1e-3;

fn facets(roughness: Roughness) -> Facets {
    let Roughness { alpha, distribution, masking } = roughness;
    Facets { distribution, masking, alpha: [alpha.max(LEAST_ALPHA); 2] }
}

/// How a material becomes a lobe; `course` asks for the lobe of the university course's program.
trait Lower {
    fn lower(&self, course: bool) -> Lowered;
}

macro_rules! lower_surface {
    ($($name:ident),*) => {
        pub(super) fn lower(surface: &Surface, course: bool) -> Lowered {
            match surface { $(Surface::$name(s) => s.lower(course)),* }
        }
    };
}
pt_scene::surfaces!(lower_surface);

/// What a shape without a material is made of.
pub(super) fn default_material(course: bool) -> Lowered {
    Matte { reflectance: [0.5; 3], two_sided: true }.lower(course)
}

/// The course's program does not know sides: a surface seen from behind is lit from its front.
/// No closed scene shows it; a back side is black here, as light from below the front is there.
impl Lower for Matte {
    fn lower(&self, course: bool) -> Lowered {
        let rho = Spectrum::from(self.reflectance);
        Lowered::new(bsdf::Diffuse { rho }, self.two_sided && !course)
    }
}

impl Lower for Mirror {
    fn lower(&self, _: bool) -> Lowered {
        Lowered::new(bsdf::Mirror { reflectance: self.reflectance.into() }, true)
    }
}

impl Lower for Glass {
    fn lower(&self, course: bool) -> Lowered {
        let (reflectance, transmittance) = (self.reflectance.into(), self.transmittance.into());
        if course {
            return Lowered::new(
                bsdf::CourseGlass { reflectance, transmittance, ior: self.ior },
                false,
            );
        }
        let eta = self.ior;
        // Without a difference of indices, facets bend nothing, and half vectors do not exist.
        match self.roughness.filter(|_| (eta - 1.0).abs() > LEAST_CONTRAST) {
            Some(roughness) => {
                let facets = facets(roughness);
                let lobe = bsdf::RoughDielectric { reflectance, transmittance, eta, facets };
                Lowered::new(lobe, false)
            }
            None => Lowered::new(bsdf::Dielectric { reflectance, transmittance, eta }, false),
        }
    }
}

impl Lower for ThinGlass {
    fn lower(&self, _: bool) -> Lowered {
        let (reflectance, transmittance) = (self.reflectance.into(), self.transmittance.into());
        Lowered::new(bsdf::ThinDielectric { reflectance, transmittance, eta: self.ior }, true)
    }
}

impl Lower for Refraction {
    fn lower(&self, course: bool) -> Lowered {
        let transmittance = self.transmittance.into();
        if course {
            Lowered::new(bsdf::CourseRefraction { transmittance, ior: self.ior }, false)
        } else {
            Lowered::new(bsdf::Refraction { transmittance, eta: self.ior }, false)
        }
    }
}

impl Lower for Conductor {
    fn lower(&self, course: bool) -> Lowered {
        let (eta, k) = (self.eta.into(), self.k.into());
        let metal = bsdf::SmoothConductor { eta, k, reflectance: self.reflectance.into() };
        match self.roughness {
            Some(Roughness { alpha, .. }) if course => {
                Lowered::new(bsdf::CourseMicrofacet { eta, k, alpha }, false)
            }
            Some(roughness) => {
                let facets = facets(roughness);
                Lowered::new(bsdf::RoughConductor { metal, facets }, self.two_sided)
            }
            None => Lowered::new(metal, self.two_sided),
        }
    }
}

impl Lower for CoatedDiffuse {
    fn lower(&self, _: bool) -> Lowered {
        let (rho, specular) = (self.diffuse.into(), self.specular.into());
        let lobe = bsdf::CoatedDiffuse::new(rho, specular, self.ior, self.saturates);
        Lowered::new(lobe, self.two_sided)
    }
}

/// The course's program reads only the diffuse colour of common materials.
impl Lower for Plastic {
    fn lower(&self, course: bool) -> Lowered {
        let rho = Spectrum::from(self.diffuse);
        if course {
            return Lowered::new(bsdf::Diffuse { rho }, false);
        }
        let facets = Facets::isotropic(Distribution::Beckmann, self.alpha);
        Lowered::new(bsdf::Glossy { rho, f0: self.specular.into(), facets }, self.two_sided)
    }
}

impl Lower for Black {
    fn lower(&self, _: bool) -> Lowered {
        Lowered::new(bsdf::Diffuse { rho: Spectrum::ZERO }, false)
    }
}
