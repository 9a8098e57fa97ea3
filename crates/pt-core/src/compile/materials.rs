//! Converts the author's materials to lobes.
//!
//! To add a material: its struct goes into `pt_scene::material` with its name in `surfaces!`, and
//! its [`Lower`] here; the compiler reports a missing implementation.

use pt_math::{DMat3, DVec2, DVec3, Spectrum, Vec2};
use pt_scene::hair;
use pt_scene::material::{
    Black, CoatNormals, CoatedConductor, CoatedDiffuse, Conductor, Diffuse, DiffuseTransmission,
    Distribution, FresnelPlastic, Glass, Hair, Measured, MetallicRoughness, Mirror, Mix, Pigment,
    Plastic, Principled, PrincipledThin, Refraction, RoughCoatedDiffuse, RoughDiffuse, Roughness,
    Surface, SurfaceDetail, ThinGlass, TwoSided,
};
use pt_scene::texture::{NormalOrBump, Scalar};

use super::textures::{Lowering, MIN_ALPHA};
use crate::bsdf::microfacet::MicrofacetDistribution;
use crate::bsdf::{
    self, CoatedDiffuse as Coated, Dielectric, RoughCoatedDiffuse as RoughCoated, RoughConductor,
    RoughDielectric, RoughPlastic, SmoothConductor, ThinDielectric,
};
use crate::id::Id;
use crate::material::{CoatRecord, Material, NormalOrBumpRecord};

/// Minimum difference of an index of refraction from 1.
const MIN_CONTRAST: f32 = 1e-3;

/// Conversion of a material to lobes.
trait Lower {
    fn lower(&self, cx: &mut Lowering) -> Material;
}

macro_rules! lower_surface {
    ($($name:ident),* $(,)?) => {
        pub(super) fn lower(surface: &Surface, cx: &mut Lowering) -> Material {
            if let Some(material) = (cx.conversion)(surface, cx) {
                return material;
            }
            match surface { $(Surface::$name(s) => s.lower(cx)),* }
        }
    };
}
pt_scene::surfaces!(lower_surface);

/// Material of a shape without one.
pub(super) fn default_material(cx: &mut Lowering) -> Material {
    let grey = Diffuse { reflectance: [0.5; 3].into(), two_sided: true };
    lower(&grey.into(), cx)
}

/// Adds a part of a material to the table.
fn part(surface: &Surface, cx: &mut Lowering) -> Id<Material> {
    let material = lower(surface, cx);
    cx.materials.table.push(material)
}

/// Facet distribution, whose two roughnesses are packed as parameters `first` and `first + 1`.
fn microfacets(roughness: &Roughness, first: usize, cx: &mut Lowering) -> MicrofacetDistribution {
    let Roughness { alpha: [u, v], distribution, masking, .. } = roughness;
    let alpha = [cx.alpha(u, first), cx.alpha(v, first + 1)];
    if u != v {
        cx.orient();
    }
    MicrofacetDistribution { distribution: *distribution, masking: *masking, alpha }
}

impl Lower for Diffuse {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let rho = cx.share(&self.reflectance, bsdf::Diffuse::RHO);
        cx.lobe(bsdf::Diffuse { rho }, self.two_sided)
    }
}

impl Lower for RoughDiffuse {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let rho = cx.share(&self.reflectance, bsdf::Eon::RHO);
        let roughness = cx.number(&self.roughness, bsdf::Eon::ROUGHNESS, [0.0, 1.0]);
        cx.lobe(bsdf::Eon { rho, roughness }, self.two_sided)
    }
}

impl Lower for Mirror {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let reflectance = cx.share(&self.reflectance, bsdf::Mirror::REFLECTANCE);
        cx.lobe(bsdf::Mirror { reflectance }, true)
    }
}

impl Lower for Glass {
    fn lower(&self, cx: &mut Lowering) -> Material {
        // All dielectrics have these parameters at the same indices.
        let reflectance = cx.share(&self.reflectance, Dielectric::REFLECTANCE);
        let transmittance = cx.share(&self.transmittance, Dielectric::TRANSMITTANCE);
        let eta = self.ior;
        // With equal indices, facets do not refract, and half vectors do not exist.
        match self.roughness.as_ref().filter(|_| (eta - 1.0).abs() > MIN_CONTRAST) {
            Some(roughness) => {
                let distribution = microfacets(roughness, RoughDielectric::ALPHA, cx);
                let once = RoughDielectric { reflectance, transmittance, eta, distribution };
                let [u, v] = &roughness.alpha;
                if roughness.multiple_scattering && u == v {
                    cx.lobe(bsdf::CompensatedDielectric { once }, false)
                } else {
                    cx.lobe(once, false)
                }
            }
            None => cx.lobe(Dielectric { reflectance, transmittance, eta }, false),
        }
    }
}

impl Lower for ThinGlass {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let reflectance = cx.share(&self.reflectance, ThinDielectric::REFLECTANCE);
        let transmittance = cx.share(&self.transmittance, ThinDielectric::TRANSMITTANCE);
        cx.lobe(ThinDielectric { reflectance, transmittance, eta: self.ior }, true)
    }
}

impl Lower for Refraction {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let transmittance = cx.share(&self.transmittance, bsdf::Refraction::TRANSMITTANCE);
        cx.lobe(bsdf::Refraction { transmittance, eta: self.ior }, false)
    }
}

impl Lower for Conductor {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let (eta, k) = (self.eta.into(), self.k.into());
        let reflectance = cx.share(&self.reflectance, SmoothConductor::REFLECTANCE);
        let metal = SmoothConductor { eta, k, reflectance };
        match &self.roughness {
            Some(roughness) => {
                let distribution = microfacets(roughness, RoughConductor::ALPHA, cx);
                let rough = RoughConductor { metal, distribution };
                if roughness.multiple_scattering {
                    cx.lobe(bsdf::CompensatedConductor::new(rough), self.two_sided)
                } else {
                    cx.lobe(rough, self.two_sided)
                }
            }
            None => cx.lobe(metal, self.two_sided),
        }
    }
}

impl Lower for CoatedDiffuse {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let rho = cx.share(&self.diffuse, Coated::RHO);
        let specular = cx.share(&self.specular, Coated::SPECULAR);
        cx.lobe(Coated::new(rho, specular, self.ior, self.nonlinear), self.two_sided)
    }
}

impl Lower for RoughCoatedDiffuse {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let rho = cx.share(&self.diffuse, RoughCoated::RHO);
        let specular = cx.share(&self.specular, RoughCoated::SPECULAR);
        let (eta, alpha) = (self.ior.max(1.0), self.alpha.max(MIN_ALPHA));
        let Self { distribution, nonlinear, two_sided, .. } = *self;
        let lobe = RoughCoated::new(rho, specular, eta, distribution, alpha, nonlinear);
        cx.lobe(lobe, two_sided)
    }
}

impl Lower for FresnelPlastic {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let lobe = bsdf::FresnelPlastic {
            rho: cx.share(&self.diffuse, bsdf::FresnelPlastic::RHO),
            specular: cx.share(&self.specular, bsdf::FresnelPlastic::SPECULAR),
            eta: self.ior.max(1.0),
            distribution: microfacets(&self.roughness, bsdf::FresnelPlastic::ALPHA, cx),
        };
        cx.lobe(lobe, self.two_sided)
    }
}

impl Lower for CoatedConductor {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let layers = bsdf::Layers {
            eta: self.ior.max(1.0),
            coat: self.coat_alpha.max(MIN_ALPHA),
            thickness: self.thickness,
            metal_eta: self.eta.into(),
            metal_k: self.k.into(),
            metal: self.alpha.max(MIN_ALPHA),
        };
        cx.lobe(bsdf::CoatedConductor::new(&layers), self.two_sided)
    }
}

impl Lower for Plastic {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let rho = cx.share(&self.diffuse, RoughPlastic::RHO);
        let f0 = cx.share(&self.specular, RoughPlastic::F0);
        let distribution = MicrofacetDistribution::isotropic(Distribution::Beckmann, self.alpha);
        cx.lobe(RoughPlastic { rho, f0, distribution }, self.two_sided)
    }
}

impl Lower for Principled {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let mut number = |scalar: &Scalar, first| cx.number(scalar, first, [0.0, 1.0]);
        let ior = self.ior;
        let lobe = bsdf::Principled {
            roughness: number(&self.roughness, bsdf::Principled::ROUGHNESS),
            anisotropic: number(&self.anisotropic, bsdf::Principled::ANISOTROPIC),
            metallic: number(&self.metallic, bsdf::Principled::METALLIC),
            spec_trans: number(&self.spec_trans, bsdf::Principled::SPEC_TRANS),
            spec_tint: number(&self.spec_tint, bsdf::Principled::SPEC_TINT),
            sheen: number(&self.sheen, bsdf::Principled::SHEEN),
            sheen_tint: number(&self.sheen_tint, bsdf::Principled::SHEEN_TINT),
            flatness: number(&self.flatness, bsdf::Principled::FLATNESS),
            clearcoat: number(&self.clearcoat, bsdf::Principled::CLEARCOAT),
            clearcoat_gloss: number(&self.clearcoat_gloss, bsdf::Principled::CLEARCOAT_GLOSS),
            base_color: cx.share(&self.base_color, bsdf::Principled::BASE_COLOR),
            // With equal indices, transmission has no half vectors.
            eta: if self.transmits() && (ior - 1.0).abs() < MIN_CONTRAST {
                1.0 + MIN_CONTRAST.copysign(ior - 1.0)
            } else {
                ior
            },
        };
        if self.anisotropic != Scalar::Value(0.0) {
            cx.orient();
        }
        cx.lobe(lobe, self.two_sided)
    }
}

impl Lower for PrincipledThin {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let mut number = |scalar: &Scalar, first| cx.number(scalar, first, [0.0, 1.0]);
        let lobe = bsdf::PrincipledThin {
            roughness: number(&self.roughness, bsdf::PrincipledThin::ROUGHNESS),
            anisotropic: number(&self.anisotropic, bsdf::PrincipledThin::ANISOTROPIC),
            spec_trans: number(&self.spec_trans, bsdf::PrincipledThin::SPEC_TRANS),
            spec_tint: number(&self.spec_tint, bsdf::PrincipledThin::SPEC_TINT),
            sheen: number(&self.sheen, bsdf::PrincipledThin::SHEEN),
            sheen_tint: number(&self.sheen_tint, bsdf::PrincipledThin::SHEEN_TINT),
            flatness: number(&self.flatness, bsdf::PrincipledThin::FLATNESS),
            diff_trans: cx.number(&self.diff_trans, bsdf::PrincipledThin::DIFF_TRANS, [0.0, 2.0]),
            base_color: cx.share(&self.base_color, bsdf::PrincipledThin::BASE_COLOR),
            eta: self.ior,
        };
        if self.anisotropic != Scalar::Value(0.0) {
            cx.orient();
        }
        cx.lobe(lobe, true)
    }
}

impl Lower for MetallicRoughness {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let mut number = |scalar: &Scalar, first| cx.number(scalar, first, [0.0, 1.0]);
        let [x, y] = &self.anisotropy_direction;
        let lobe = bsdf::MetallicRoughness {
            metallic: number(&self.metallic, bsdf::MetallicRoughness::METALLIC),
            roughness: number(&self.roughness, bsdf::MetallicRoughness::ROUGHNESS),
            specular: number(&self.specular, bsdf::MetallicRoughness::SPECULAR),
            transmission: number(&self.transmission, bsdf::MetallicRoughness::TRANSMISSION),
            diffuse_transmission: number(
                &self.diffuse_transmission,
                bsdf::MetallicRoughness::DIFFUSE_TRANSMISSION,
            ),
            anisotropy: number(&self.anisotropy, bsdf::MetallicRoughness::ANISOTROPY),
            direction: [
                number(x, bsdf::MetallicRoughness::DIRECTION),
                number(y, bsdf::MetallicRoughness::DIRECTION + 1),
            ],
            iridescence: number(&self.iridescence, bsdf::MetallicRoughness::IRIDESCENCE),
            sheen_roughness: number(
                &self.sheen_roughness,
                bsdf::MetallicRoughness::SHEEN_ROUGHNESS,
            ),
            clearcoat: number(&self.clearcoat, bsdf::MetallicRoughness::CLEARCOAT),
            clearcoat_roughness: number(
                &self.clearcoat_roughness,
                bsdf::MetallicRoughness::CLEARCOAT_ROUGHNESS,
            ),
            film_thickness: cx.number(
                &self.film_thickness,
                bsdf::MetallicRoughness::FILM_THICKNESS,
                [0.0, f32::MAX],
            ),
            base_color: cx.share(&self.base_color, bsdf::MetallicRoughness::BASE_COLOR),
            specular_color: cx.color(&self.specular_color, bsdf::MetallicRoughness::SPECULAR_COLOR),
            diffuse_transmission_color: cx.share(
                &self.diffuse_transmission_color,
                bsdf::MetallicRoughness::DIFFUSE_TRANSMISSION_COLOR,
            ),
            sheen_color: cx.share(&self.sheen_color, bsdf::MetallicRoughness::SHEEN_COLOR),
            rotation: self.anisotropy_rotation,
            film_ior: self.film_ior,
            // With equal indices, transmission has no half vectors.
            eta: if self.thin { self.ior } else { self.ior.max(1.0 + MIN_CONTRAST) },
            coat_normal: [0.0; 2],
            thin: self.thin,
        };
        if self.anisotropy != Scalar::Value(0.0) {
            cx.orient();
            if let Some(along) = &self.anisotropy_along {
                cx.orient_along(along);
            }
        }
        if self.clearcoat != Scalar::Value(0.0) {
            match &self.clearcoat_normals {
                CoatNormals::Base => {}
                CoatNormals::Shape => cx.coat(CoatRecord::Shape),
                CoatNormals::Relief(normals) => {
                    let normals = relief(normals, cx);
                    cx.coat(CoatRecord::Relief(normals));
                }
            }
        }
        cx.lobe(lobe, self.two_sided)
    }
}

impl Lower for DiffuseTransmission {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let rho = cx.share(&self.reflectance, bsdf::DiffuseTransmission::RHO);
        let tau = cx.share(&self.transmittance, bsdf::DiffuseTransmission::TAU);
        cx.lobe(bsdf::DiffuseTransmission { rho, tau }, true)
    }
}

impl Lower for Hair {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let around = self.azimuthal_roughness;
        let absorption = match &self.pigment {
            Pigment::Reflectance(color) => {
                cx.absorption(color, bsdf::Hair::ABSORPTION, hair::slope(around))
            }
            Pigment::Absorption(absorption) => (*absorption).into(),
            Pigment::Melanin(concentrations) => hair::melanin(*concentrations).into(),
        };
        cx.orient();
        let roughnesses = [self.roughness, around];
        let lobe = bsdf::Hair::new(absorption, self.ior, roughnesses, self.scale_angle);
        cx.lobe(lobe, self.two_sided)
    }
}

impl Lower for Measured {
    fn lower(&self, cx: &mut Lowering) -> Material {
        cx.measured(&self.measurements, self.two_sided)
    }
}

impl Lower for Black {
    fn lower(&self, cx: &mut Lowering) -> Material {
        cx.lobe(bsdf::Diffuse { rho: Spectrum::ZERO }, false)
    }
}

impl Lower for Mix {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let (first, second) = (part(&self.first, cx), part(&self.second, cx));
        Material::Mix { first, second, amount: cx.varying(&self.amount) }
    }
}

/// The back is a surface that is turned around, with its front to the viewer.
impl Lower for TwoSided {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let (front, back) = (part(&self.front, cx), part(&self.back, cx));
        cx.show_both_sides(back);
        Material::TwoSided { front, back }
    }
}

/// Direction in (u, v) of a surface in which u of an image increases at constant v; that of u if
/// the transform to the image is singular.
fn growth_of_u(to_pattern: DMat3) -> Vec2 {
    let [x, y] = [to_pattern.x_axis, to_pattern.y_axis].map(DVec3::truncate);
    let along = DVec2::new(y.y, -x.y) * x.perp_dot(y).signum();
    along.try_normalize().unwrap_or(DVec2::X).as_vec2()
}

fn relief(relief: &NormalOrBump, cx: &mut Lowering) -> NormalOrBumpRecord {
    match relief {
        NormalOrBump::Normals(texture) => NormalOrBumpRecord::Normals(cx.texture(texture), Vec2::X),
        NormalOrBump::TurnedNormals(texture) => {
            let along_u = growth_of_u(texture.to_pattern);
            NormalOrBumpRecord::Normals(cx.texture(texture), along_u)
        }
        NormalOrBump::NormalsAlong(texture, along) => {
            NormalOrBumpRecord::NormalsAlong(cx.texture(texture), cx.texture(along))
        }
        NormalOrBump::Heights(texture, scale) => {
            NormalOrBumpRecord::Heights(cx.texture(texture), scale * cx.metres)
        }
    }
}

impl Lower for SurfaceDetail {
    fn lower(&self, cx: &mut Lowering) -> Material {
        let surface = part(&self.surface, cx);
        let relief = relief(&self.relief, cx);
        let Self { shadowing, averted, mirrored, .. } = *self;
        Material::SurfaceDetail { surface, relief, shadowing, averted, mirrored }
    }
}
