//! The clear coat, and its transmittance to the layers below.

use std::sync::LazyLock;

use pt_math::{FloatExt, Frame, Vec3};
use pt_scene::material::{Distribution, Masking};

use crate::bsdf::fresnel::schlick_weight;
use crate::bsdf::microfacet::MicrofacetDistribution;

/// Cosines of a table, uniform in their square roots: albedos change most at grazing angles.
const COSINES: usize = 48;
/// Roughnesses of the table, uniform from 0 to 1.
const ROUGHNESSES: usize = 17;
/// Side of the grid of integration points of albedos.
const GRID: u16 = 96;

/// Albedos by the cosine to the normal.
type Albedos = [f32; COSINES];

static COATS: LazyLock<Box<[Albedos; ROUGHNESSES]>> = LazyLock::new(|| {
    let coat = |i: usize| {
        let Coat(distribution) = Coat::new(i as f32 / (ROUGHNESSES - 1) as f32);
        std::array::from_fn(|i| {
            distribution.mean_of_visible(cosine(i), GRID, |wo, h| {
                let wi = h * (2.0 * wo.dot(h)) - wo;
                if wi.z > 0.0 { fresnel(wo.dot(h)) * distribution.shadowing(wo, wi) } else { 0.0 }
            })
        })
    };
    Box::new(std::array::from_fn(coat))
});

/// A coat of index 1.5 with GGX facets, whose roughness is √α. [glTF 2.0,
/// KHR_materials_clearcoat, "Clearcoat BRDF"]
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat(MicrofacetDistribution);

/// Fresnel reflectance of a facet of the coat. [Schlick 1994]
#[inline]
fn fresnel(cos: f32) -> f32 {
    0.04.lerp(1.0, schlick_weight(cos))
}

/// Transmittance of a coat of amount `coat` for light that the surface below emits at this cosine
/// to the normal: 1 − c F. [glTF 2.0, KHR_materials_clearcoat, "Emission"]
#[inline]
pub fn emitted_through(coat: f32, cos: f32) -> f32 {
    1.0 - coat * fresnel(cos)
}

impl Coat {
    #[inline]
    pub(super) fn new(roughness: f32) -> Self {
        const MIN_ALPHA: f32 = 1e-3;
        let alpha = (roughness * roughness).max(MIN_ALPHA);
        let distribution = Distribution::Ggx;
        Self(MicrofacetDistribution {
            distribution,
            masking: Masking::Correlated,
            alpha: [alpha; 2],
        })
    }

    /// Roughness α of the facets.
    #[inline]
    pub(super) fn alpha(self) -> f32 {
        self.0.alpha[0]
    }

    /// f cos θi for two directions above the surface with half vector `h`.
    #[inline]
    pub(super) fn eval(self, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
        fresnel(wo.dot(h)) * self.pdf(wo, h) * self.0.shadowing(wo, wi)
    }

    /// Density of the reflected direction of half vector `h`, by [`Self::sample`].
    #[inline]
    pub(super) fn pdf(self, wo: Vec3, h: Vec3) -> f32 {
        let pdf = 0.25 * self.0.visible_pdf(wo, h) / wo.dot(h);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Samples a facet that is visible from `wo`.
    #[inline]
    pub(super) fn sample(self, wo: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        self.0.sample_visible(wo, [u, v])
    }
}

/// Frame of the coat, whose normal may differ from that of the base; `None` if they are equal.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoatFrame(pub(super) Option<Frame>);

impl CoatFrame {
    #[inline]
    pub(super) fn to_local(self, w: Vec3) -> Vec3 {
        self.0.map_or(w, |frame| frame.to_local(w))
    }

    #[inline]
    pub(super) fn to_base(self, w: Vec3) -> Vec3 {
        self.0.map_or(w, |frame| frame.to_world(w))
    }

    /// Cosine between a direction and the normal of the coat, positive above the base and negative
    /// below; its absolute value is at least 10⁻⁶ if the coat's normal differs.
    #[inline]
    pub(super) fn cosine(self, w: Vec3) -> f32 {
        const MIN: f32 = 1e-6;
        if self.0.is_none() {
            return w.z;
        }
        let above = self.to_local(Vec3::new(w.x, w.y, w.z.abs())).z.max(MIN);
        above.copysign(w.z)
    }
}

/// Cosine of an entry of a table.
fn cosine(i: usize) -> f32 {
    (i as f32 / (COSINES - 1) as f32).powi(2).max(1e-6)
}

/// Albedo at a cosine, interpolated between the entries.
#[inline]
fn at(albedos: &Albedos, cos: f32) -> f32 {
    let x = cos.max(0.0).sqrt() * (COSINES - 1) as f32;
    let lower = (x as usize).min(COSINES - 2);
    albedos[lower].lerp(albedos[lower + 1], (x - lower as f32).min(1.0))
}

/// Directional albedo of a coat of amount 1.
#[inline]
pub(super) fn coat_albedo(roughness: f32, cos: f32) -> f32 {
    let x = roughness.clamp(0.0, 1.0) * (ROUGHNESSES - 1) as f32;
    let lower = (x as usize).min(ROUGHNESSES - 2);
    let [a, b] = [lower, lower + 1].map(|i| at(&COATS[i], cos));
    a.lerp(b, x - lower as f32)
}

/// Transmittance of a layer for light from the cosine `wi` to `wo`, where `left` is the
/// transmittance for a direction above the surface.
///
/// Light reflected below the layer is attenuated by the lesser of the two transmittances: this is
/// reciprocal, and the layer and its base together scatter no more than arrives. [as for sheen in
/// glTF 2.0, KHR_materials_sheen, "Albedo scaling technique"]
#[inline]
pub(super) fn through(wo: f32, wi: f32, left: impl Fn(f32) -> f32) -> f32 {
    let transmittance = |cos: f32| if cos > 0.0 { left(cos) } else { 1.0 };
    transmittance(wo).min(transmittance(wi))
}
