//! `hair`: its colour, as there is no lobe of fibres here.

use super::color::{Role, color};
use super::entity::Entity;
use super::scene::World;
use crate::LoadError;
use crate::material::Matte;
use crate::texture::Color;

/// What eumelanin and pheomelanin absorb in a fibre of radius 1, for each unit of their concentrations. [d'Eon et al. 2011,
/// "An Energy-Conserving Hair Reflectance Model", §6.1]
const EUMELANIN: [f64; 3] = [0.419, 0.697, 1.37];
const PHEOMELANIN: [f64; 3] = [0.187, 0.4, 1.05];

impl World {
    /// A matte surface of the colour that many fibres have together.
    pub(super) fn hair(&mut self, entity: &Entity) -> Result<Matte, LoadError> {
        entity.pass_over(&["eta", "beta_m", "alpha"]);
        let roughness = entity.positive("beta_n", 0.3)?;
        let absorption = color(entity, "sigma_a", Role::Unbounded, &self.textures.folder)?;
        let melanin = [entity.given_float("eumelanin")?, entity.given_float("pheomelanin")?];
        let of_fibres = absorption.is_some() || melanin != [None; 2];
        let has_color = entity.find("reflectance").is_some();
        if has_color && of_fibres {
            let message =
                "both a reflectance and what fibres absorb are given; give one of the two";
            return Err(entity.refuse("reflectance", message));
        }
        let reflectance = if has_color {
            self.textures.share(entity, "reflectance", 0.5)?
        } else {
            let [eumelanin, pheomelanin] = if of_fibres { melanin } else { [Some(1.3), None] };
            let pigments = |c: usize| {
                eumelanin.unwrap_or(0.0) * EUMELANIN[c]
                    + pheomelanin.unwrap_or(0.0) * PHEOMELANIN[c]
            };
            let absorbed = |c: usize| absorption.map_or_else(|| pigments(c), |a| f64::from(a[c]));
            Color::Value([0, 1, 2].map(|c| scattered(absorbed(c), roughness) as f32))
        };
        let message = "hair is taken as matte fibres of the colour that it has as a whole: it has no gloss, and light does \
                       not go through it";
        self.warn(entity, message.to_owned());
        Ok(Matte { reflectance, two_sided: true })
    }
}

/// The share of light that hair sends back, of fibres that absorb so much and have this azimuthal roughness. [Chiang et al.
/// 2016, "A Practical and Controllable Hair and Fur Model for Production Path Tracing", §4.2]
fn scattered(absorbed: f64, roughness: f64) -> f64 {
    let b = roughness.min(1.0);
    let slope = [0.245, 5.574, -10.73, 2.532, -0.215, 5.969].iter().fold(0.0, |sum, c| sum * b + c);
    libm::exp(-absorbed.max(0.0).sqrt() * slope)
}
