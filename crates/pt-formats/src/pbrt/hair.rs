//! `hair`: hair fibres, and the treatment of closed tubes.

use pt_scene::Surface;
use pt_scene::material::{Hair, Mix, Pigment, SurfaceDetail};

use super::entity::Entity;
use super::world::PbrtWorld;
use crate::LoadError;

impl PbrtWorld {
    /// Reads a hair material, for shapes that may be open.
    pub(super) fn hair(&mut self, entity: &Entity) -> Result<Hair, LoadError> {
        const INDICES: [f32; 2] = [1.0, 100.0];
        const SHARE: [f32; 2] = [0.0, 1.0];
        const TILTS: [f32; 2] = [-45.0, 45.0];
        const CONCENTRATIONS: [f32; 2] = [0.0, 1e6];
        let default = Hair::default();
        let ior = self.hair_number(entity, "eta", INDICES)?.unwrap_or(default.ior);
        let roughness = self.hair_number(entity, "beta_m", SHARE)?.unwrap_or(default.roughness);
        let azimuthal_roughness =
            self.hair_number(entity, "beta_n", SHARE)?.unwrap_or(default.azimuthal_roughness);
        let scale_angle = self.hair_number(entity, "alpha", TILTS)?.unwrap_or(default.scale_angle);
        let absorption = self.textures.unbounded(entity, "sigma_a")?;
        let melanin =
            ["eumelanin", "pheomelanin"].map(|name| self.hair_number(entity, name, CONCENTRATIONS));
        let [eumelanin, pheomelanin] = melanin;
        let melanin = [eumelanin?, pheomelanin?];
        // Published scenes use the older name.
        let color = ["reflectance", "color"].into_iter().find(|name| entity.find(name).is_some());
        if let Some(name) = color
            && (absorption.is_some() || melanin != [None; 2])
        {
            let message = "found a reflectance and an absorption of hair, expected one of the two";
            return Err(entity.refuse(name, message));
        }
        let pigment = if let Some(name) = color {
            Pigment::Reflectance(self.textures.share(entity, name, 0.5)?)
        } else if let Some(absorption) = absorption {
            if absorption.texture().is_some() {
                self.tell_of_mean(entity, "sigma_a");
            }
            Pigment::Absorption(absorption.mean())
        } else if melanin == [None; 2] {
            default.pigment
        } else {
            Pigment::Melanin(melanin.map(Option::unwrap_or_default))
        };
        Ok(Hair { pigment, ior, roughness, azimuthal_roughness, scale_angle, two_sided: true })
    }

    /// Reads a number of a hair material, which is constant: the mean of a texture is used.
    fn hair_number(
        &mut self,
        entity: &Entity,
        name: &'static str,
        range: [f32; 2],
    ) -> Result<Option<f32>, LoadError> {
        let Some(number) = self.textures.number(entity, name, range)? else { return Ok(None) };
        if number.texture().is_some() {
            self.tell_of_mean(entity, name);
        }
        Ok(Some(number.mean().clamp(range[0], range[1])))
    }

    fn tell_of_mean(&mut self, entity: &Entity, name: &str) {
        let message = format!(
            "textured \"{name}\" of hair is not supported; the mean of the texture is used"
        );
        self.warn(entity, message);
    }
}

/// Returns a surface with hair for a closed tube, which has no back; `None` if it contains no hair.
pub(super) fn of_tube(surface: &Surface) -> Option<Surface> {
    match surface {
        Surface::Hair(hair) => Some(Hair { two_sided: false, ..hair.clone() }.into()),
        Surface::Mix(Mix { first, second, amount: share }) => {
            let parts = [of_tube(first), of_tube(second)];
            if parts == [None, None] {
                return None;
            }
            let [a, b] = parts;
            let first = a.map_or_else(|| first.clone(), Box::new);
            let second = b.map_or_else(|| second.clone(), Box::new);
            Some(Mix { first, second, amount: share.clone() }.into())
        }
        Surface::SurfaceDetail(embossed) => {
            let surface = Box::new(of_tube(&embossed.surface)?);
            Some(SurfaceDetail { surface, ..embossed.clone() }.into())
        }
        _ => None,
    }
}
