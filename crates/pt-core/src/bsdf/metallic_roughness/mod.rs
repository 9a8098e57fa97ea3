//! The metallic-roughness material of glTF, with its extensions.

mod coat;
mod examples;
mod film;
mod sampling;
mod sheen;
#[cfg(test)]
mod tests;

pub use coat::emitted_through;
use coat::{Coat, CoatFrame, coat_albedo, through as through_layer};
use film::ThinFilm;
use pt_math::{FloatExt, Frame, Pdf, SolidAngle, Spectrum, Vec3, trig};
use pt_scene::material::{Distribution, Masking};
use sheen::Sheen;

use super::microfacet::MicrofacetDistribution;
use super::multiscatter::{Reflected, SchlickGloss};
use super::rough_dielectric::{DirectionPair, eta_from};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// A mixture of a metal and a dielectric with a diffuse or transmissive base, under sheen and clear
/// coat. See [`pt_scene::material::MetallicRoughness`] for its parameters.
///
/// The parts are those of the Khronos group. Its text weights a lower layer by the reflection of
/// one facet above, which gains energy at grazing angles. Here, the weight is by the directional
/// albedo of the layer above, so that the whole scatters no more than arrives. [glTF 2.0, app. B,
/// and the extensions KHR_materials_anisotropy, _clearcoat, _diffuse_transmission, _ior,
/// _iridescence, _sheen, _specular, _transmission, _volume]
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness {
    /// Colour of the base, of the metal, and of transmitted light: once for sheets, otherwise its
    /// square root at each surface.
    pub base_color: Spectrum,
    /// Weight of the metal, from 0 to 1.
    pub metallic: f32,
    /// √α of the facets, from 0 to 1.
    pub roughness: f32,
    /// Index of refraction below the surface over that above it, at least 1; above 1 for
    /// transmission without `thin`.
    pub eta: f32,
    /// Amount of specular reflection of the dielectric, from 0 to 1.
    pub specular: f32,
    /// Colour of the specular reflection of the dielectric at normal incidence, not negative.
    pub specular_color: Spectrum,
    /// Weight of transmission in the dielectric, from 0 to 1.
    pub transmission: f32,
    /// Fraction of the diffuse base that scatters light to the other side, from 0 to 1; for
    /// sheets.
    pub diffuse_transmission: f32,
    /// Colour of diffuse transmission.
    pub diffuse_transmission_color: Spectrum,
    /// Strength of anisotropy, from 0 to 1: its square interpolates α along its direction between
    /// α across it and 1.
    pub anisotropy: f32,
    /// Direction of anisotropy along x and y, each mapped from −1…1 to 0…1.
    pub direction: [f32; 2],
    /// Angle in radians by which the direction of anisotropy is rotated.
    pub rotation: f32,
    /// Weight of the thin film, from 0 to 1.
    pub iridescence: f32,
    /// Index of refraction of the film, at least 1.
    pub film_ior: f32,
    /// Thickness of the film in nanometres.
    pub film_thickness: f32,
    /// Colour of the sheen.
    pub sheen_color: Spectrum,
    /// √α of the sheen, from 0 to 1.
    pub sheen_roughness: f32,
    /// Amount of clear coat, from 0 to 1.
    pub clearcoat: f32,
    /// √α of the clear coat, from 0 to 1.
    pub clearcoat_roughness: f32,
    /// The x and y of the unit normal of the clear coat, which is above the surface; 0 and 0 is
    /// that of the base.
    pub coat_normal: [f32; 2],
    /// True if the material is a sheet without an interior, which is equal on both sides.
    pub thin: bool,
}

/// Two directions in the frame of the facets, with the front up.
struct FacetDirections {
    wo: Vec3,
    wi: Vec3,
}

impl MetallicRoughness {
    /// Index of the base colour among the packed parameters; like the following ones, it may be
    /// given by a texture.
    pub(crate) const BASE_COLOR: usize = 0;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const METALLIC: usize = 3;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const ROUGHNESS: usize = 4;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SPECULAR: usize = 6;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SPECULAR_COLOR: usize = 7;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const TRANSMISSION: usize = 10;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const DIFFUSE_TRANSMISSION: usize = 11;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const DIFFUSE_TRANSMISSION_COLOR: usize = 12;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const ANISOTROPY: usize = 15;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const DIRECTION: usize = 16;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const IRIDESCENCE: usize = 19;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const FILM_THICKNESS: usize = 21;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SHEEN_COLOR: usize = 22;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SHEEN_ROUGHNESS: usize = 25;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const CLEARCOAT: usize = 26;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const CLEARCOAT_ROUGHNESS: usize = 27;
    /// Index of the normal of the coat among the packed parameters.
    pub(crate) const COAT_NORMAL: usize = 29;

    /// Facet distribution, whose first roughness is along the direction of anisotropy.
    /// [KHR_materials_anisotropy, "Anisotropy roughness"]
    #[inline]
    fn distribution(&self) -> MicrofacetDistribution {
        const MIN_ALPHA: f32 = 1e-3;
        let alpha = self.roughness * self.roughness;
        let along = alpha.lerp(1.0, self.anisotropy * self.anisotropy);
        MicrofacetDistribution {
            distribution: Distribution::Ggx,
            masking: Masking::Correlated,
            alpha: [along, alpha].map(|alpha| alpha.max(MIN_ALPHA)),
        }
    }

    /// Cosine and sine of the angle from +x to the direction of anisotropy.
    #[inline]
    fn turn(&self) -> [f32; 2] {
        if self.anisotropy == 0.0 {
            return [1.0, 0.0];
        }
        let [x, y] = self.direction.map(|c| 2.0 * c - 1.0);
        let length = (x * x + y * y).sqrt();
        let [x, y] = if length > 0.0 { [x / length, y / length] } else { [1.0, 0.0] };
        let (sin, cos) = trig::sin_cos(self.rotation);
        [x * cos - y * sin, x * sin + y * cos]
    }

    /// Returns true if directions are flipped: the viewed side of a sheet is its front.
    #[inline]
    fn flips(&self, wo: Vec3) -> bool {
        self.thin && wo.z < 0.0
    }

    #[inline]
    fn view(&self, wo: Vec3, wi: Vec3) -> FacetDirections {
        let ([cos, sin], flips) = (self.turn(), self.flips(wo));
        let seen = |w: Vec3| {
            let z = if flips { -w.z } else { w.z };
            Vec3::new(w.x * cos + w.y * sin, w.y * cos - w.x * sin, z)
        };
        FacetDirections { wo: seen(wo), wi: seen(wi) }
    }

    /// Inverse of [`Self::view`], for the direction `w` in a [`FacetDirections`] from `wo`.
    #[inline]
    fn back(&self, wo: Vec3, w: Vec3) -> Vec3 {
        let [cos, sin] = self.turn();
        let z = if self.flips(wo) { -w.z } else { w.z };
        Vec3::new(w.x * cos - w.y * sin, w.x * sin + w.y * cos, z)
    }

    /// The frame of the coat in a [`FacetDirections`].
    #[inline]
    fn coat_frame(&self) -> CoatFrame {
        let [x, y] = self.coat_normal;
        if x == 0.0 && y == 0.0 {
            return CoatFrame(None);
        }
        let [cos, sin] = self.turn();
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        let normal = Vec3::new(x * cos + y * sin, y * cos - x * sin, z);
        CoatFrame(Some(Frame::from_normal(normal)))
    }

    /// Weight of the diffuse base.
    #[inline]
    fn opaque(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.transmission)
    }

    /// Weight of transmission.
    #[inline]
    fn transparent(&self) -> f32 {
        (1.0 - self.metallic) * self.transmission
    }

    #[inline]
    fn film(&self) -> ThinFilm {
        ThinFilm { ior: self.film_ior, thickness: self.film_thickness }
    }

    /// Reflectance of the dielectric at normal incidence, and at 90°.
    #[inline]
    fn dielectric(&self) -> (Spectrum, f32) {
        let root = (self.eta - 1.0) / (self.eta + 1.0);
        let f0 = self.specular_color * (root * root);
        (f0.map(|c| c.min(1.0)) * self.specular, self.specular)
    }

    /// Blends a reflectance `plain` with that of the film, by the weight of the film.
    #[inline]
    fn filmed(&self, plain: Spectrum, cos: f32, f0: Spectrum) -> Spectrum {
        if self.iridescence == 0.0 || self.film_thickness == 0.0 {
            return plain;
        }
        let film = self.film().reflectance(cos, f0);
        plain * (1.0 - self.iridescence) + film * self.iridescence
    }

    /// Fresnel reflectance of a facet of the dielectric at the cosine of the greater of the two
    /// angles.
    #[inline]
    fn dielectric_at(&self, cos: f32) -> Spectrum {
        let (f0, f90) = self.dielectric();
        let weight = fresnel::schlick_weight(cos);
        self.filmed(f0 + (Spectrum::splat(f90) - f0) * weight, cos, f0)
    }

    /// Fresnel reflectance of the dielectric for a pair of directions. The known refracted
    /// direction is more accurate than a computed one.
    #[inline]
    fn reflected_by_pair(&self, pair: &DirectionPair) -> Option<Spectrum> {
        let cos = pair.wo.dot(pair.h);
        if pair.is_reflected || self.thin {
            return self.reflected_by_dielectric(cos, pair.eta);
        }
        Some(self.dielectric_at(cos.min(-pair.wi.dot(pair.h))))
    }

    /// Fresnel reflectance of a facet of the dielectric that is seen at a cosine; `None` for total
    /// internal reflection.
    #[inline]
    fn reflected_by_dielectric(&self, cos: f32, eta: f32) -> Option<Spectrum> {
        // Schlick's formula uses the greater of the two angles.
        let cos = if eta < 1.0 && self.transmission > 0.0 && !self.thin {
            let sin2 = (1.0 - cos * cos) / (eta * eta);
            if sin2 >= 1.0 {
                return None;
            }
            (1.0 - sin2).sqrt()
        } else {
            cos
        };
        Some(self.dielectric_at(cos))
    }

    /// Reflectance of a facet that is seen at a cosine from the front or, with transmission, from
    /// the back.
    #[inline]
    fn reflectance(&self, front: bool, cos: f32, dielectric: Option<Spectrum>) -> Spectrum {
        let dielectric = dielectric.unwrap_or(Spectrum::ONE);
        if !front {
            return dielectric * self.transparent();
        }
        let plain = fresnel::schlick(cos, self.base_color);
        let metal = self.filmed(plain, cos, self.base_color);
        metal * self.metallic + dielectric * (1.0 - self.metallic)
    }

    /// Transmittance of a facet.
    #[inline]
    fn transmittance(&self, dielectric: Option<Spectrum>) -> Spectrum {
        let Some(reflected) = dielectric else { return Spectrum::ZERO };
        let left = (1.0 - reflected.max_channel()).max(0.0) * self.transparent();
        if self.thin { self.base_color * left } else { self.base_color.map(f32::sqrt) * left }
    }

    /// Probability with which a facet reflects instead of transmitting.
    #[inline]
    fn reflection_probability(reflected: Spectrum, transmitted: Spectrum) -> f32 {
        let [reflected, transmitted] = [reflected, transmitted].map(Spectrum::luminance);
        if transmitted > 0.0 { reflected / (reflected + transmitted) } else { 1.0 }
    }

    /// Approximate mean reflectance of the metal and of the dielectric for diffuse illumination.
    #[inline]
    fn mean_reflectances(&self) -> [Spectrum; 2] {
        let (f0, f90) = self.dielectric();
        let metal = self.filmed(self.base_color, 1.0, self.base_color);
        let f0 = self.filmed(f0, 1.0, f0);
        [fresnel::mean_schlick(metal), f0 + (Spectrum::splat(f90) - f0) * (1.0 / 21.0)]
    }

    /// Coupling between the facets of the dielectric and its base.
    #[inline]
    fn gloss(&self, distribution: &MicrofacetDistribution, again: Reflected) -> SchlickGloss {
        let (f0, f90) = self.dielectric();
        let f0 = f0.max_channel();
        let [_, mean] = self.mean_reflectances();
        let share = again.colored(mean).max_channel();
        SchlickGloss::new(distribution, again, [f0, f90], share)
    }

    /// Upper bound of the reflectance of the dielectric with the film at a cosine; 0 without film.
    #[inline]
    fn most_of_film(&self, cos: f32) -> f32 {
        if self.iridescence == 0.0 {
            return 0.0;
        }
        let (f0, f90) = self.dielectric();
        let plain = f0.max_channel().lerp(f90, fresnel::schlick_weight(cos));
        plain.lerp(self.film().most(cos, f0.max_channel()), self.iridescence)
    }

    #[inline]
    fn has_sheen(&self) -> bool {
        self.sheen_color.max_channel() > 0.0
    }

    /// The facet that connects two directions; transmission through a sheet is treated as
    /// reflection to the other side.
    #[inline]
    fn pair(&self, wo: Vec3, wi: Vec3) -> Option<DirectionPair> {
        if self.thin && wi.z < 0.0 {
            let mirrored = Vec3::new(wi.x, wi.y, -wi.z);
            let pair = DirectionPair::new(1.5, wo, mirrored)?;
            return Some(DirectionPair { eta: 1.0, is_reflected: false, ..pair });
        }
        DirectionPair::new(if self.eta == 1.0 { 1.5 } else { self.eta }, wo, wi)
    }

    /// Multiple scattering between facets, and scattering by the base, above the front or, for a
    /// sheet, below it.
    #[inline]
    fn again_and_base(
        &self,
        distribution: &MicrofacetDistribution,
        again: Reflected,
        [wo, wi]: [Vec3; 2],
    ) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        if wi.z > 0.0 {
            let [metal, dielectric] = self.mean_reflectances().map(|mean| again.colored(mean));
            let colored = metal * self.metallic + dielectric * self.opaque();
            sum += colored * again.eval(wo, wi);
        }
        let opaque = self.opaque();
        if opaque > 0.0 {
            let (share, color) = if wi.z > 0.0 {
                (1.0 - self.diffuse_transmission, self.base_color)
            } else {
                (self.diffuse_transmission, self.diffuse_transmission_color)
            };
            if share > 0.0 {
                let wi = Vec3::new(wi.x, wi.y, wi.z.abs());
                let gloss = self.gloss(distribution, again);
                let white = gloss.eval_base(wo, wi, |cos| self.most_of_film(cos));
                sum += color * (opaque * share * white);
            }
        }
        sum
    }

    /// Adds sheen and clear coat over `below`, for two directions, with their half vector if both
    /// are above the front.
    #[inline]
    fn under_layers(&self, below: Spectrum, [wo, wi]: [Vec3; 2], h: Option<Vec3>) -> Spectrum {
        let mut sum = below;
        // Both sides of a sheet have the same layers.
        let through = |[wo, wi]: [f32; 2], left: &dyn Fn(f32) -> f32| {
            if self.thin { left(wo.abs()).min(left(wi.abs())) } else { through_layer(wo, wi, left) }
        };
        if self.has_sheen() {
            let sheen = Sheen::new(self.sheen_roughness);
            let most = self.sheen_color.max_channel();
            sum *= through([wo.z, wi.z], &|cos| 1.0 - most * sheen.albedo(cos));
            if h.is_some() {
                sum += self.sheen_color * sheen.eval(wo, wi);
            }
        }
        if self.clearcoat > 0.0 {
            let (roughness, coat) = (self.clearcoat_roughness, self.coat_frame());
            let cosines = [wo, wi].map(|w| coat.cosine(w));
            sum *= through(cosines, &|cos| 1.0 - self.clearcoat * coat_albedo(roughness, cos));
            let [wo, wi] = [wo, wi].map(|w| coat.to_local(w));
            if let Some(h) = h
                && wo.z > 0.0
                && wi.z > 0.0
            {
                let h = coat.to_local(h);
                sum += Spectrum::splat(self.clearcoat * Coat::new(roughness).eval(wo, wi, h));
            }
        }
        sum
    }

    /// Returns true if light can be scattered from one direction of a [`FacetDirections`] into the
    /// other.
    #[inline]
    fn connects(&self, wo: Vec3, wi: Vec3) -> bool {
        let above = wo.z > 0.0 && wi.z > 0.0;
        wo.z != 0.0 && wi.z != 0.0 && (above || self.thin || self.transparent() > 0.0)
    }

    /// f cos θi for the directions of a [`FacetDirections`].
    fn scattered(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if !self.connects(wo, wi) {
            return Spectrum::ZERO;
        }
        let (distribution, front) = (self.distribution(), wo.z > 0.0);
        let (mut f, above) = (Spectrum::ZERO, front && wi.z > 0.0);
        let pair = self.pair(wo, wi);
        if let Some(pair) = &pair {
            let dielectric = self.reflected_by_pair(pair);
            let part = if pair.is_reflected {
                self.reflectance(front, pair.wo.dot(pair.h), dielectric)
            } else {
                self.transmittance(dielectric) / (pair.eta * pair.eta)
            };
            f += part * (self.density(pair, &distribution) * pair.shadowing(&distribution));
        }
        if above || (self.thin && front) {
            f += self.again_and_base(&distribution, Reflected::new(&distribution), [wo, wi]);
        }
        let half = pair.filter(|_| above).map(|pair| pair.h);
        self.under_layers(f, [wo, wi], half)
    }

    /// Density of scattering from one direction of a pair into the other by its facet, if visible
    /// facets are sampled.
    #[inline]
    fn density(&self, pair: &DirectionPair, distribution: &MicrofacetDistribution) -> f32 {
        if self.thin && !pair.is_reflected {
            // Treated as reflection.
            let pdf = distribution.visible_pdf(pair.wo, pair.h) * 0.25 / pair.wo.dot(pair.h);
            return if pdf.is_finite() { pdf } else { 0.0 };
        }
        pair.density(1.0, distribution)
    }
}

impl Lobe<'_> for MetallicRoughness {
    const DELTA: bool = false;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let [a, b, c] = self.base_color.to_array();
        let [d, e, f] = self.specular_color.to_array();
        let [g, h, i] = self.diffuse_transmission_color.to_array();
        let [j, k, l] = self.sheen_color.to_array();
        let [x, y] = self.direction;
        padded([
            a,
            b,
            c,
            self.metallic,
            self.roughness,
            self.eta,
            self.specular,
            d,
            e,
            f,
            self.transmission,
            self.diffuse_transmission,
            g,
            h,
            i,
            self.anisotropy,
            x,
            y,
            self.rotation,
            self.iridescence,
            self.film_ior,
            self.film_thickness,
            j,
            k,
            l,
            self.sheen_roughness,
            self.clearcoat,
            self.clearcoat_roughness,
            f32::from(u8::from(self.thin)),
            self.coat_normal[0],
            self.coat_normal[1],
        ])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            base_color: color(p, Self::BASE_COLOR),
            metallic: p[Self::METALLIC],
            roughness: p[Self::ROUGHNESS],
            eta: p[5],
            specular: p[Self::SPECULAR],
            specular_color: color(p, Self::SPECULAR_COLOR),
            transmission: p[Self::TRANSMISSION],
            diffuse_transmission: p[Self::DIFFUSE_TRANSMISSION],
            diffuse_transmission_color: color(p, Self::DIFFUSE_TRANSMISSION_COLOR),
            anisotropy: p[Self::ANISOTROPY],
            direction: [p[Self::DIRECTION], p[Self::DIRECTION + 1]],
            rotation: p[18],
            iridescence: p[Self::IRIDESCENCE],
            film_ior: p[20],
            film_thickness: p[Self::FILM_THICKNESS],
            sheen_color: color(p, Self::SHEEN_COLOR),
            sheen_roughness: p[Self::SHEEN_ROUGHNESS],
            clearcoat: p[Self::CLEARCOAT],
            clearcoat_roughness: p[Self::CLEARCOAT_ROUGHNESS],
            coat_normal: [p[Self::COAT_NORMAL], p[Self::COAT_NORMAL + 1]],
            thin: p[28] != 0.0,
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let FacetDirections { wo, wi } = self.view(wo, wi);
        self.scattered(wo, wi)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let FacetDirections { wo, wi } = self.view(wo, wi);
        Pdf::new(self.density_of(wo, wi))
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let FacetDirections { wo: seen, .. } = self.view(wo, wo);
        if seen.z == 0.0 || (seen.z < 0.0 && self.transparent() <= 0.0) {
            return None;
        }
        let wi = self.back(wo, self.draw(seen, u)?);
        let (f, pdf) = (self.eval(wo, wi), self.pdf(wo, wi));
        let goes_through = !self.thin && wo.z * wi.z < 0.0;
        let eta = if goes_through { eta_from(wo, self.eta) } else { 1.0 };
        let sample = || BsdfSample::new(wi, f / pdf.get(), Some(pdf)).with_eta_scale(eta * eta);
        pdf.is_positive().then(sample)
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        if self.transparent() > 0.0 || self.diffuse_transmission > 0.0 {
            return 0.0;
        }
        let distribution = self.distribution().spread();
        if self.clearcoat > 0.0 {
            distribution.min(Coat::new(self.clearcoat_roughness).alpha())
        } else {
            distribution
        }
    }

    fn examples() -> Vec<Self> {
        examples::all()
    }
}
