//! `Material "subsurface"`: a dielectric boundary around a medium.
//!
//! pbrt-v4 computes the transport between two points of the surface as for a flat half space, by
//! diffusion. Here, paths pass the boundary and are scattered in the medium until they leave it.

use pt_scene::material::Glass;
use pt_scene::medium::MediumProperties;
use pt_scene::{Color, RenderHints};

use super::color::index;
use super::entity::Entity;
use super::measured_media::MeasuredMedium;
use super::medium::{DEFAULT_ABSORBED, DEFAULT_SCATTERED, extinction_and_albedo, mean_cosine};
use super::world::PbrtWorld;
use crate::LoadError;
use crate::shared::names::quote;

/// Minimum path depth in scenes with subsurface scattering.
const STEPS: u32 = 1000;

/// Alternative sets of parameters of the medium, of which at most one is given.
const WAYS: [(&str, [&str; 2]); 3] = [
    ("name", ["name"; 2]),
    ("sigma_a", ["sigma_a", "sigma_s"]),
    ("reflectance", ["reflectance", "mfp"]),
];

/// Selects an integrator that supports media, and the path depth that subsurface scattering needs.
pub(super) fn prepare(settings: &mut RenderHints) {
    settings.integrator = Some("volpath");
    settings.max_depth = settings.max_depth.map(|depth| depth.max(STEPS));
}

impl PbrtWorld {
    /// Reads the boundary, and the index of the medium behind it.
    pub(super) fn subsurface(&mut self, entity: &Entity) -> Result<(Glass, u32), LoadError> {
        let ior = index(entity, "eta", 1.33, &self.textures.folder)?;
        let roughness = self.roughness(entity, &super::material::ROUGHNESS, 0.0)?;
        let g = mean_cosine(entity)?;
        let (extinction, albedo, g) = self.matter(entity, ior, g)?;
        let matter = MediumProperties::Homogeneous { extinction, albedo, emission: [0.0; 3] };
        let number = self.media.add("subsurface", entity, matter, g);
        let message = format!(
            "light below the surface is simulated by volpath from collision to collision, up to \
             {STEPS} interactions of a path; the shape has to be closed, and \
             lights without extent do not light a smooth one from inside"
        );
        self.warn(entity, message);
        let [reflectance, transmittance] = [[1.0; 3].into(), [1.0; 3].into()];
        Ok((Glass { reflectance, transmittance, ior, roughness }, number))
    }

    /// Returns the extinction coefficient, the single-scattering albedo and the mean cosine.
    fn matter(
        &mut self,
        entity: &Entity,
        ior: f32,
        g: f32,
    ) -> Result<([f32; 3], [f32; 3], f32), LoadError> {
        let way = the_way(entity)?;
        let scale = entity.not_negative("scale", 1.0)? as f32;
        if let Some(name) = entity.text("name")? {
            let MeasuredMedium { absorbed, scattered, .. } =
                MeasuredMedium::named(name).map_err(|message| entity.refuse("name", message))?;
            let [extinction, albedo] = extinction_and_albedo(entity, absorbed, scattered, scale)?;
            return Ok((extinction, albedo, 0.0));
        }
        if way == Some("reflectance") {
            if entity.find("reflectance").is_none() {
                return Err(entity.refuse("mfp", "found mfp without reflectance, expected both"));
            }
            let reflectance = self.textures.share(entity, "reflectance", 0.5)?;
            let mfp = self.textures.unbounded(entity, "mfp")?.unwrap_or([1.0; 3].into());
            let reflectance = self.everywhere(entity, "reflectance", &reflectance);
            let extinction = self.everywhere(entity, "mfp", &mfp).map(|mfp| 1.0 / (mfp * scale));
            if !extinction.iter().all(|sigma| sigma.is_finite()) {
                let message =
                    "found a mean free path of 0 after scaling, expected a length above 0";
                return Err(entity.refuse("mfp", message));
            }
            let inner = internal_reflectance(f64::from(ior));
            let albedo = |a: f32| scattering_albedo(f64::from(a), inner, f64::from(g)) as f32;
            return Ok((extinction, reflectance.map(albedo), g));
        }
        let given = [
            self.textures.unbounded(entity, "sigma_a")?,
            self.textures.unbounded(entity, "sigma_s")?,
        ];
        let [absorbed, scattered] = match &given {
            [None, None] => [DEFAULT_ABSORBED, DEFAULT_SCATTERED],
            [Some(absorbed), Some(scattered)] => [
                self.everywhere(entity, "sigma_a", absorbed),
                self.everywhere(entity, "sigma_s", scattered),
            ],
            [Some(_), None] | [None, Some(_)] => {
                let message = "found only one of sigma_a and sigma_s, expected both";
                return Err(
                    entity.refuse(if given[0].is_some() { "sigma_a" } else { "sigma_s" }, message)
                );
            }
        };
        let [extinction, albedo] = extinction_and_albedo(entity, absorbed, scattered, scale)?;
        Ok((extinction, albedo, g))
    }

    /// Returns a colour that is constant in a medium; the mean of a texture.
    fn everywhere(&mut self, entity: &Entity, name: &str, color: &Color) -> [f32; 3] {
        if color.texture().is_some() {
            self.warn(
                entity,
                format!(
                    "the medium below the surface is homogeneous; the mean of {} is used",
                    quote(name)
                ),
            );
        }
        color.mean()
    }
}

/// Returns which of [`WAYS`] specifies the medium.
fn the_way(entity: &Entity) -> Result<Option<&'static str>, LoadError> {
    let mut given = WAYS.iter().filter_map(|(way, names)| {
        names.iter().find(|name| entity.find(name).is_some()).map(|name| (*way, *name))
    });
    let (first, second) = (given.next(), given.next());
    if let (Some((_, first)), Some((_, second))) = (first, second) {
        let message = format!("found \"{first}\" and \"{second}\", expected one of the two");
        return Err(entity.refuse(second, message));
    }
    Ok(first.map(|(way, _)| way))
}

/// Fraction of diffuse light in a medium that its boundary reflects: F_i = ∫ 2 μ F(μ) dμ, with the
/// Fresnel reflectance F for light from the side whose index of refraction is `eta` times that of
/// the other.
fn internal_reflectance(eta: f64) -> f64 {
    const PARTS: u32 = 1024;
    let at = |i: u32| {
        let cos = (f64::from(i) + 0.5) / f64::from(PARTS);
        2.0 * cos * fresnel(cos, eta)
    };
    (0..PARTS).map(at).sum::<f64>() / f64::from(PARTS)
}

/// Fresnel reflectance for light from the side whose index of refraction is `eta` times that of the
/// other.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let square = 1.0 - eta * eta * (1.0 - cos * cos);
    if square <= 0.0 {
        return 1.0;
    }
    let beyond = square.sqrt();
    let across = (eta * cos - beyond) / (eta * cos + beyond);
    let along = (cos - eta * beyond) / (cos + eta * beyond);
    0.5 * (across * across + along * along)
}

/// Single-scattering albedo of a deep medium with a given `reflectance`, the fraction of entering
/// light that leaves again, where the boundary reflects the fraction `inner` of light from below.
///
/// Let A be the reflectance without a boundary. Light that enters leaves with A (1 − F), or is
/// reflected and enters the medium again, so that R = A (1 − F) / (1 − A F). With s² = (1 − ϖ) / (1
/// − ϖ g), A = (1 − s) (1 − 0.139 s) / (1 + 1.17 s), which is solved for s. [van de Hulst 1980,
/// "Multiple Light Scattering"; Kulla & Conty 2017, "Revisiting Physically Based Shading at
/// Imageworks"]
fn scattering_albedo(reflectance: f64, inner: f64, g: f64) -> f64 {
    let a = reflectance / (1.0 - inner + inner * reflectance);
    let b = 1.139 + 1.17 * a;
    let s = (b - (b * b - 4.0 * 0.139 * (1.0 - a)).max(0.0).sqrt()) / (2.0 * 0.139);
    ((1.0 - s * s) / (1.0 - g * s * s)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use pt_math::sampler::{RngStream, Sampler, SamplerConfig, SamplerKind};

    use super::*;

    /// Samples the cosine of the scattering angle. [Henyey & Greenstein 1941]
    fn turned(u: f64, g: f64) -> f64 {
        if g == 0.0 {
            return 1.0 - 2.0 * u;
        }
        let x = (1.0 - g * g) / (1.0 + g - 2.0 * g * u);
        (1.0 + g * g - x * x) / (2.0 * g)
    }

    /// Returns the weight of diffuse light that enters a half space below a smooth boundary, when
    /// it leaves. Depths are in mean free paths, and cosines μ are relative to the downward
    /// direction.
    fn walk(mut stream: RngStream, albedo: f64, eta: f64, g: f64) -> f64 {
        let mut next = || stream.next_2d().map(f64::from);
        let mut mu = loop {
            let [u, v] = next();
            if v >= fresnel(u.sqrt(), 1.0 / eta) {
                break (1.0 - (1.0 - u) / (eta * eta)).sqrt();
            }
        };
        let (mut depth, mut weight) = (0.0, 1.0);
        while weight > 1e-4 {
            let [u, v] = next();
            depth -= mu * (1.0 - u).ln();
            if depth < 0.0 {
                if v >= fresnel(-mu, eta) {
                    return weight;
                }
                (depth, mu) = (0.0, -mu);
                continue;
            }
            weight *= albedo;
            let [u, v] = next();
            let cos = turned(u, g);
            mu = mu * cos + ((1.0 - mu * mu) * (1.0 - cos * cos)).max(0.0).sqrt() * (TAU * v).cos();
            mu = mu.clamp(-1.0, 1.0);
        }
        0.0
    }

    /// Refraction confines entering light to a cone of directions, which the formula ignores: it is
    /// less accurate with an index of refraction, and least with strong forward scattering.
    #[test]
    fn random_walks_in_the_medium_leave_with_the_reflectance_that_was_asked_for() {
        const WALKS: u32 = 5_000;
        let set = SamplerConfig { kind: SamplerKind::Independent, ..SamplerConfig::default() };
        for eta in [1.0, 1.33, 1.5] {
            for g in [0.0, 0.8, -0.5] {
                for reflectance in [0.1, 0.3, 0.5, 0.7, 0.9] {
                    let albedo = scattering_albedo(reflectance, internal_reflectance(eta), g);
                    let stream = |i: u32| Sampler::new(set, [i, 7], 0).stream([0; 2]);
                    let sum: f64 = (0..WALKS).map(|i| walk(stream(i), albedo, eta, g)).sum();
                    let found = sum / f64::from(WALKS);
                    let bound = if eta == 1.0 { 0.02 } else { 0.05 };
                    assert!(
                        (found - reflectance).abs() < bound,
                        "{eta} {g} {reflectance}: {found}"
                    );
                }
            }
        }
    }

    #[test]
    fn all_light_comes_back_from_what_absorbs_nothing_and_none_from_what_only_absorbs() {
        for (eta, g) in [(1.0, 0.0), (1.33, 0.8), (0.75, -0.5)] {
            let inner = internal_reflectance(eta);
            assert!(scattering_albedo(1.0, inner, g) > 1.0 - 1e-12);
            assert!(scattering_albedo(0.0, inner, g) < 5e-3);
        }
    }

    /// The transmission from both sides of a boundary is equal, except for η².
    #[test]
    fn a_boundary_reflects_as_its_other_side_asks() {
        for eta in [1.2, 1.33, 1.8] {
            let [dense, thin] = [internal_reflectance(eta), internal_reflectance(1.0 / eta)];
            assert!(((1.0 - dense) * eta * eta - (1.0 - thin)).abs() < 1e-3, "{eta}");
        }
        assert!(internal_reflectance(1.0) < 1e-12);
    }
}
