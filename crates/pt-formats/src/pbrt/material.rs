//! `Material` and `MakeNamedMaterial`: surface scattering.

use std::rc::Rc;

use pt_scene::material::{
    Black, CoatedConductor, CoatedDiffuse, Conductor, Diffuse, DiffuseTransmission, Distribution,
    Glass, Masking, Measured, Mirror, Mix, Principled, RoughCoatedDiffuse, Roughness,
    SurfaceDetail, ThinGlass,
};
use pt_scene::metals::Metal;
use pt_scene::texture::{Color, NormalOrBump, Scalar};
use pt_scene::{Surface, Warning};

use super::color::{SpectrumType, index};
use super::entity::Entity;
use super::texture::{product, square_root};
use super::types::{MaterialName, key_of};
use super::world::PbrtWorld;
use crate::LoadError;
use crate::shared::context::{Folder, Unusable};
use crate::shared::names::quote;
use crate::shared::placeholder;
use crate::shared::reference_stack::{ReferenceError, ReferenceLimits, ReferenceStack};

const KINDS: [&str; 12] = [
    "coatedconductor",
    "coateddiffuse",
    "conductor",
    "dielectric",
    "diffuse",
    "diffusetransmission",
    "hair",
    "interface",
    "measured",
    "mix",
    "subsurface",
    "thindielectric",
];
/// Maximum nesting depth of mixtures.
const MAX_MIXES: usize = 8;
/// Roughness below which pbrt-v4 treats a surface as smooth.
const MIN_ALPHA: f32 = 1e-3;
/// Minimum roughness of pbrt-v4 along one axis if the surface is rougher along the other.
const MIN_ALPHA_OF_ONE: f32 = 1e-4;

impl PbrtWorld {
    /// Returns the surface of a material; `None` for an invisible interface between media.
    pub(super) fn surface(&mut self, name: &MaterialName) -> Result<Option<Surface>, LoadError> {
        let entity = self.material_of(name)?;
        if matches!(entity.kind.as_str(), "interface" | "") {
            return Ok(None);
        }
        if entity.kind != "subsurface" {
            let mut way =
                ReferenceStack::new(ReferenceLimits { deep: MAX_MIXES, many: 2 << MAX_MIXES });
            return self.surface_of(&entity, &mut way).map(Some);
        }
        let (boundary, medium) = self.subsurface(&entity)?;
        let surface = self.embossed(&entity, boundary.into())?;
        entity.finish()?;
        self.within.insert(key_of(name), medium);
        Ok(Some(surface))
    }

    fn material_of(&self, name: &MaterialName) -> Result<Rc<Entity>, LoadError> {
        match name {
            MaterialName::Anonymous(index) => Ok(Rc::clone(&self.materials[*index])),
            MaterialName::Named(name, at) => {
                let undefined =
                    |hint: &str| at.error(format!("undefined material {}{hint}", quote(name)));
                self.named_materials.get(name, undefined).cloned()
            }
        }
    }

    fn surface_of(
        &mut self,
        entity: &Entity,
        way: &mut ReferenceStack<String>,
    ) -> Result<Surface, LoadError> {
        let surface = match entity.kind.as_str() {
            "diffuse" => {
                let reflectance = self.textures.share(entity, "reflectance", 0.5)?;
                Diffuse { reflectance, two_sided: true }.into()
            }
            "conductor" => self.metal(entity)?,
            "dielectric" => Glass {
                reflectance: [1.0; 3].into(),
                transmittance: [1.0; 3].into(),
                ior: index(entity, "eta", 1.5, &self.textures.folder)?,
                roughness: self.roughness(entity, &ROUGHNESS, 0.0)?,
            }
            .into(),
            "diffusetransmission" => self.diffuse_transmission(entity)?.into(),
            "thindielectric" => ThinGlass {
                reflectance: [1.0; 3].into(),
                transmittance: [1.0; 3].into(),
                ior: index(entity, "eta", 1.5, &self.textures.folder)?,
            }
            .into(),
            "coateddiffuse" => self.coated_diffuse(entity)?,
            "coatedconductor" => self.coated_conductor(entity)?.into(),
            "hair" => self.hair(entity)?.into(),
            "measured" => self.measured(entity)?,
            "mix" => self.mix(entity, way)?,
            "subsurface" => {
                return Err(entity
                    .at
                    .error("a mix cannot contain a subsurface, which includes a medium"));
            }
            "interface" | "" => {
                return Err(entity
                    .at
                    .error("a mix cannot contain an interface; give shapes an alpha instead"));
            }
            _ => return Err(entity.unsupported(&KINDS)),
        };
        let surface = self.embossed(entity, surface)?;
        entity.finish()?;
        Ok(surface)
    }

    pub(super) fn warn(&mut self, entity: &Entity, message: String) {
        self.scene.warnings.push(Warning { at: entity.at.span(""), message });
    }

    /// Reads the roughness; `names` are those of the isotropic one and of those along u and v.
    /// `None` means smooth.
    pub(super) fn roughness(
        &mut self,
        entity: &Entity,
        names: &[&'static str; 3],
        default: f32,
    ) -> Result<Option<Roughness>, LoadError> {
        const RANGE: [f32; 2] = [0.0, 100.0];
        let read = |name| self.textures.number(entity, name, RANGE);
        let both = read(names[0])?.unwrap_or(default.into());
        let along = [read(names[1])?.unwrap_or(both.clone()), read(names[2])?.unwrap_or(both)];
        let is_remapped = entity.boolean("remaproughness", true)?;
        let alpha = along.map(|x| if is_remapped { square_root(&x) } else { x });
        let is_smooth = |x: &Scalar| matches!(x, Scalar::Value(x) if *x < MIN_ALPHA);
        if alpha.iter().all(is_smooth) {
            return Ok(None);
        }
        // One of the axes may be smooth.
        let alpha = alpha.map(|x| match x {
            Scalar::Value(x) => Scalar::Value(x.max(MIN_ALPHA_OF_ONE)),
            texture @ Scalar::Texture(_) => texture,
        });
        Ok(Some(Roughness {
            alpha,
            distribution: Distribution::Ggx,
            masking: Masking::Correlated,
            multiple_scattering: false,
        }))
    }

    /// Reads a metal by η and k, or by its reflectance at normal incidence.
    fn metal(&mut self, entity: &Entity) -> Result<Surface, LoadError> {
        let names = ["eta", "k", "reflectance"];
        if entity.texture_name("reflectance")?.is_none() {
            return Ok(self.conductor(entity, names, &ROUGHNESS)?.into());
        }
        for name in ["eta", "k"] {
            if entity.find(name).is_some() {
                return Err(both_given(entity, names));
            }
        }
        let base_color = self.textures.share(entity, "reflectance", 0.5)?;
        let Some(Roughness { alpha: [u, v], .. }) = self.roughness(entity, &ROUGHNESS, 0.0)? else {
            let message =
                "the reflectance of a smooth metal with a texture does not depend on the angle";
            self.warn(entity, message.to_owned());
            return Ok(Mirror { reflectance: base_color }.into());
        };
        let message = "the reflectance of a metal with a texture depends on the angle by Schlick's \
                       approximation instead of Fresnel's equations";
        self.warn(entity, message.to_owned());
        let alpha = if u == v { u } else { self.one_alpha(entity, "metal", [&u, &v]).into() };
        Ok(Principled {
            base_color,
            metallic: 1.0.into(),
            roughness: square_root(&alpha),
            two_sided: true,
            ..Principled::default()
        }
        .into())
    }

    /// Reads a metal with constant parameters. If a reflectance r is given instead of η and k,
    /// these are η = 1 and k = 2√(r / (1 − r)). [Pharr, Jakob & Humphreys 2023, §10.5.3]
    fn conductor(
        &mut self,
        entity: &Entity,
        names: [&'static str; 3],
        roughness: &[&'static str; 3],
    ) -> Result<Conductor, LoadError> {
        let [eta, k, reflectance] = names;
        let mut given = |name, role| {
            let (color, is_mean) = self.textures.mean_of(entity, name, role)?;
            if is_mean {
                let message = format!(
                    "textured \"{name}\" is not supported; the mean of the texture is used"
                );
                self.scene.warnings.push(Warning { at: entity.place(name).span(""), message });
            }
            Ok::<_, LoadError>(color)
        };
        let (given_eta, given_k) =
            (given(eta, SpectrumType::Unbounded)?, given(k, SpectrumType::Unbounded)?);
        let (eta, k) = match given(reflectance, SpectrumType::Share)? {
            Some(_) if given_eta.is_some() || given_k.is_some() => {
                return Err(both_given(entity, names));
            }
            Some(share) => {
                let k = share.map(|r| r.clamp(0.0, 0.9999)).map(|r| 2.0 * (r / (1.0 - r)).sqrt());
                ([1.0; 3], k)
            }
            None => {
                let copper = Metal::named("Cu");
                let [eta_of_copper, k_of_copper] = copper.map_or([[1.0; 3]; 2], |m| [m.eta, m.k]);
                (given_eta.unwrap_or(eta_of_copper), given_k.unwrap_or(k_of_copper))
            }
        };
        let roughness = self.roughness(entity, roughness, 0.0)?;
        Ok(Conductor { eta, k, reflectance: [1.0; 3].into(), roughness, two_sided: true })
    }

    /// Reads a diffuse base under a coat. The interreflection between the two, which pbrt-v4
    /// computes by random walks, is in closed form here; absorption in the coat is omitted.
    fn coated_diffuse(&mut self, entity: &Entity) -> Result<Surface, LoadError> {
        entity.pass_over(&["maxdepth", "nsamples", "thickness"]);
        self.leave_haze_out(entity)?;
        let diffuse = self.textures.share(entity, "reflectance", 0.5)?;
        let ior = index(entity, "eta", 1.5, &self.textures.folder)?;
        let (specular, nonlinear, two_sided) = ([1.0; 3].into(), true, true);
        let Some(Roughness { alpha: [u, v], distribution, .. }) =
            self.roughness(entity, &ROUGHNESS, 0.0)?
        else {
            return Ok(CoatedDiffuse { diffuse, specular, ior, nonlinear, two_sided }.into());
        };
        let alpha = self.one_alpha(entity, "coat", [&u, &v]);
        Ok(RoughCoatedDiffuse { diffuse, specular, ior, alpha, distribution, nonlinear, two_sided }
            .into())
    }

    /// Reads a sheet that scatters to both sides.
    fn diffuse_transmission(&mut self, entity: &Entity) -> Result<DiffuseTransmission, LoadError> {
        let scale = entity.not_negative("scale", 1.0)? as f32;
        let share = |name| {
            let share = self.textures.share(entity, name, 0.25)?;
            Ok(product([share, [scale; 3].into()]))
        };
        let (reflectance, transmittance) = (share("reflectance")?, share("transmittance")?);
        if let (Color::Value(reflected), Color::Value(transmitted)) = (&reflectance, &transmittance)
            && (0..3).any(|c| reflected[c] + transmitted[c] > 1.0 + 1e-6)
        {
            let message = "found a reflectance and a transmittance with a sum above 1, expected a \
                           sum of at most 1 including the scale";
            return Err(entity.refuse("transmittance", message));
        }
        Ok(DiffuseTransmission { reflectance, transmittance })
    }

    /// Reads a metal under a coat. The interreflection between the two, which pbrt-v4 computes by
    /// random walks, is in closed form here.
    fn coated_conductor(&mut self, entity: &Entity) -> Result<CoatedConductor, LoadError> {
        entity.pass_over(&["maxdepth", "nsamples"]);
        self.leave_haze_out(entity)?;
        let ior = index(entity, "interface.eta", 1.5, &self.textures.folder)?;
        let thickness = self.textures.number(entity, "thickness", [0.0, f32::MAX])?;
        let thickness = thickness.unwrap_or(0.01.into());
        if thickness.texture().is_some() {
            let message =
                "textured thickness of the coat is not supported; the mean of the texture is used";
            self.warn(entity, message.to_owned());
        }
        let thickness = thickness.mean().max(0.0);
        let names = ["conductor.eta", "conductor.k", "reflectance"];
        let of_coat = ["interface.roughness", "interface.uroughness", "interface.vroughness"];
        let of_metal = ["conductor.roughness", "conductor.uroughness", "conductor.vroughness"];
        let coat = self.roughness(entity, &of_coat, 0.0)?;
        let Conductor { eta, k, roughness, two_sided, .. } =
            self.conductor(entity, names, &of_metal)?;
        let mut alpha = |layer, roughness: Option<Roughness>| {
            roughness.map_or(0.0, |Roughness { alpha: [u, v], .. }| {
                self.one_alpha(entity, layer, [&u, &v])
            })
        };
        let (coat_alpha, alpha) = (alpha("coat", coat), alpha("metal", roughness));
        Ok(CoatedConductor { eta, k, alpha, ior, coat_alpha, thickness, two_sided })
    }

    /// Reads a measured material, on both sides. A missing file is replaced by a placeholder.
    fn measured(&self, entity: &Entity) -> Result<Surface, LoadError> {
        let Some(name) = entity.text("filename")? else {
            return Err(entity.at.error("missing parameter \"string filename\""));
        };
        let Folder { context, .. } = &self.textures.folder;
        match context.measurements(&self.textures.folder.join(name)) {
            Ok(measurements) => Ok(Measured { measurements, two_sided: true }.into()),
            Err(Unusable::Broken(why)) => Err(entity.refuse("filename", why)),
            Err(Unusable::Missing(why)) => {
                self.textures.miss(entity.place("filename"), &why);
                Ok(placeholder::surface())
            }
        }
    }

    /// Returns the mean roughness of a layer that supports only a constant, isotropic one.
    fn one_alpha(&mut self, entity: &Entity, layer: &str, [u, v]: [&Scalar; 2]) -> f32 {
        if u != v || u.texture().is_some() {
            let message = format!(
                "textured or anisotropic roughness of the {layer} is not supported; the mean is \
                 used"
            );
            self.warn(entity, message);
        }
        0.5 * (u.mean() + v.mean())
    }

    /// Reports that scattering in coats is omitted.
    fn leave_haze_out(&mut self, entity: &Entity) -> Result<(), LoadError> {
        entity.pass_over(&["g"]);
        let albedo = self.textures.share(entity, "albedo", 0.0)?;
        if albedo != [0.0; 3].into() {
            let message = "scattering inside of the coat is not supported; its albedo is ignored";
            self.warn(entity, message.to_owned());
        }
        Ok(())
    }

    /// Reads a mixture. `way` contains the mixtures that enclose it.
    fn mix(
        &mut self,
        entity: &Entity,
        way: &mut ReferenceStack<String>,
    ) -> Result<Surface, LoadError> {
        let names = entity.texts("materials")?.unwrap_or_default();
        let [first, second] = names else {
            let message = format!("expected the names of two materials, found {}", names.len());
            return Err(entity.refuse("materials", message));
        };
        let share = self.textures.number(entity, "amount", [0.0, 1.0])?.unwrap_or(0.5.into());
        let mut part = |name: &str| {
            let part = self.material_of(&MaterialName::Named(name.into(), entity.at.clone()))?;
            way.enter(name.to_owned()).map_err(|barred| {
                entity.at.error(match barred {
                    ReferenceError::Circle => {
                        format!("the mixture {} contains itself", quote(name))
                    }
                    ReferenceError::Deep(most) => format!("mixtures are nested deeper than {most}"),
                    ReferenceError::Many(most) => {
                        format!(
                            "more than {most} nested materials, each counted as often as it is used"
                        )
                    }
                })
            })?;
            let surface = self.surface_of(&part, way);
            way.leave();
            surface
        };
        let (first, second) = (Box::new(part(first)?), Box::new(part(second)?));
        Ok(Mix { first, second, amount: share }.into())
    }

    /// Adds the displacement or normal map of a material to its surface, if it has one.
    fn embossed(&mut self, entity: &Entity, surface: Surface) -> Result<Surface, LoadError> {
        const HEIGHTS: [f32; 2] = [f32::MIN, f32::MAX];
        let mut relief = None;
        if let Some(Scalar::Texture(heights)) =
            self.textures.number(entity, "displacement", HEIGHTS)?
        {
            relief = Some(NormalOrBump::Heights(heights, 1.0));
        }
        if let Some(name) = entity.text("normalmap")? {
            if relief.is_some() {
                return Err(entity.refuse(
                    "normalmap",
                    "found a displacement and a normalmap, expected one of the two",
                ));
            }
            match self.textures.raw(name) {
                Ok(map) => relief = Some(NormalOrBump::Normals(map)),
                Err(why) => self.textures.miss(entity.place("normalmap"), &why),
            }
        }
        Ok(match relief {
            Some(relief) => SurfaceDetail::new(surface, relief).into(),
            None => surface,
        })
    }

    /// An invisible surface.
    pub(super) fn nothing() -> Surface {
        Black.into()
    }
}

/// Returns an error about a metal that is specified in two ways.
fn both_given(entity: &Entity, [eta, k, reflectance]: [&'static str; 3]) -> LoadError {
    let message =
        format!("found \"{reflectance}\" and \"{eta}\" or \"{k}\", expected one of the two");
    entity.refuse(reflectance, message)
}

/// Names of the isotropic roughness, and of those along u and v.
pub(super) const ROUGHNESS: [&str; 3] = ["roughness", "uroughness", "vroughness"];
