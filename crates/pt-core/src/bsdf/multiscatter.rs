//! Multiple scattering between facets, which microfacet lobes lose.
//!
//! The energy lost by single scattering, 1 − E, is added as f = (1 − E(o)) (1 − E(i)) / (π (1 −
//! mean of E)). This is reciprocal, and conserves energy for facets that reflect all light. [Kulla
//! & Conty 2017, "Revisiting Physically Based Shading at Imageworks"; the losses are tabulated for
//! the lobes of this program, on first use]

mod schlick;

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};
use std::sync::OnceLock;

use pt_math::{FloatExt, Spectrum, Vec3, trig};
use pt_scene::material::{Distribution, Masking};
pub(super) use schlick::SchlickGloss;

use super::fresnel;
use super::microfacet::{MicrofacetDistribution, stretched};
use super::rough_dielectric::refract;

/// Number of ratios of the two roughnesses in the tables of mirrors: uniform in √, from 0 to 1.
const RATIOS: usize = 9;
/// Number of indices of refraction in the tables of dielectrics: uniform in (η − 1) / (η + 1), for
/// η from ⅓ to 3.
const INDICES: usize = 129;
/// Number of roughnesses of a table, the greater of two: uniform in √α, up to 1. Rougher facets
/// lose more than tabulated.
const ALPHAS: usize = 64;
/// Number of cosines of a table, by [`place`].
const COSINES: usize = 40;
/// Minimum roughness of a table; smoother facets use it.
const MIN_ALPHA: f32 = 1e-3;

/// 1 − E of facets of one kind, and its mean over diffuse illumination. Each row is computed on
/// first use.
struct EnergyLossTable<const ROWS: usize> {
    distribution: MicrofacetDistribution,
    /// Computes an entry for facets of a roughness, from the position of its row between 0 and 1.
    make: fn(MicrofacetDistribution, f32) -> LossEntry,
    rows: [OnceLock<Box<LossRow>>; ROWS],
}

/// Entries by the greater roughness.
type LossRow = [LossEntry; ALPHAS];

/// Losses of a pair of roughnesses.
#[derive(Clone, Copy)]
struct LossEntry {
    /// 1 − E for directions along the greater roughness, and across it; interpolated by
    /// [`across`].
    lost: [[f32; COSINES]; 2],
    /// Mean of 1 − E; divided by the square of the greater roughness if it grows with that.
    mean: f32,
}

/// Position of a cosine in a table: from 0 at the normal to 1 at grazing angles, and denser there,
/// where the roughness matters most.
#[inline]
fn place(cos: f32, alpha: f32) -> f32 {
    1.0 - (1.0 - stretched(cos, alpha)).max(0.0).sqrt()
}

/// Cosine at a [`place`], its inverse.
fn cosine(place: f32, alpha: f32) -> f32 {
    stretched(1.0 - (1.0 - place) * (1.0 - place), alpha)
}

/// Interpolation parameter between the losses along and across the greater of two roughnesses, from
/// 0 to 1, by the cosine to the normal and the squared sine of the azimuth to the greater
/// roughness. It follows the interpolation of Smith's masking between both, reduced by a fit to
/// integrals for roughnesses of ratios from 2 to 16 (they differ by at most 0.017).
#[inline]
fn across([greater, lesser]: [f32; 2], cos: f32, sin2: f32) -> f32 {
    if greater == lesser {
        return 0.5;
    }
    let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos).max(f32::MIN_POSITIVE);
    // Smith's 1 + 2 Λ along a roughness. [Heitz 2014, "Understanding the Masking-Shadowing
    // Function", eq. 72, 86]
    let spread = |alpha2: f32| (1.0 + alpha2 * tan2).sqrt();
    let [x2, y2] = [greater * greater, lesser * lesser];
    let [x, y, seen] = [spread(x2), spread(y2), spread(x2.lerp(y2, sin2))];
    let share = sin2 * ((x + y) * (1.0 + y)) / ((x + seen) * (1.0 + seen));
    share * 0.55.lerp(1.0, share)
}

/// Position of a number from 0 to 1 among `n` nodes: index of the lower node, and the fraction of
/// the way to the next.
#[inline]
fn locate(x: f32, n: usize) -> (usize, f32) {
    let scaled = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let lower = (scaled as usize).min(n - 2);
    (lower, scaled - lower as f32)
}

/// Number of a node.
fn node(i: usize, n: usize) -> f32 {
    i as f32 / (n - 1) as f32
}

impl LossEntry {
    /// Tabulates 1 − E, where `scattered` is E of facets at a cosine in the plane of x and z.
    /// `stretch` determines the positions; it is their roughness, unless there are other reasons
    /// for a change with angles.
    fn new(
        distribution: MicrofacetDistribution,
        stretch: f32,
        scattered: impl Fn(&MicrofacetDistribution, f32) -> f32,
    ) -> Self {
        let [greater, lesser] = distribution.alpha;
        let seen = |alpha| {
            std::array::from_fn(|j| {
                let cos = cosine(node(j, COSINES), stretch);
                (1.0 - scattered(&MicrofacetDistribution { alpha, ..distribution }, cos)).max(0.0)
            })
        };
        let seen_along = seen([greater, lesser]);
        let seen_across = if greater == lesser { seen_along } else { seen([lesser, greater]) };
        let mut entry = Self { lost: [seen_along, seen_across], mean: 0.0 };
        entry.mean = entry.mean_of(stretch, distribution.alpha);
        entry
    }

    /// Divides the mean, which grows with the square of the roughness, by that.
    fn growing(self, alpha: f32) -> Self {
        Self { mean: self.mean / (alpha * alpha), ..self }
    }

    /// 1/π ∫ (1 − E) cos θ dω, by midpoints in √cos θ and the azimuth.
    fn mean_of(&self, stretch: f32, alpha: [f32; 2]) -> f32 {
        const STEPS: u16 = 512;
        const AZIMUTHS: u16 = 32;
        let middle = |i: u16, n: u16| (f32::from(i) + 0.5) / f32::from(n);
        let lost = |t: f32| {
            let (cos, x) = (t * t, place(t * t, stretch));
            let at = |i| {
                let (sin, _) = trig::sin_cos(FRAC_PI_2 * middle(i, AZIMUTHS));
                self.at(x, across(alpha, cos, sin * sin))
            };
            let around = if alpha[0] == alpha[1] { 1 } else { AZIMUTHS };
            4.0 * t * t * t * (0..around).map(at).sum::<f32>() / f32::from(around)
        };
        (0..STEPS).map(|i| lost(middle(i, STEPS))).sum::<f32>() / f32::from(STEPS)
    }

    /// Minimum of the nearest entries of 1 − E at a [`place`].
    fn least_at(&self, x: f32) -> f32 {
        let (j, _) = locate(x, COSINES);
        let [along, across] = &self.lost;
        [along[j], along[j + 1], across[j], across[j + 1]].into_iter().fold(1.0, f32::min)
    }

    /// 1 − E at a [`place`], interpolated by `across` the greater roughness.
    #[inline]
    fn at(&self, x: f32, across: f32) -> f32 {
        let (j, t) = locate(x, COSINES);
        let [a, b] = self.lost.map(|lost| lost[j].lerp(lost[j + 1], t));
        a.lerp(b, across)
    }
}

impl<const ROWS: usize> EnergyLossTable<ROWS> {
    const fn new(
        distribution: Distribution,
        masking: Masking,
        make: fn(MicrofacetDistribution, f32) -> LossEntry,
    ) -> Self {
        let distribution = MicrofacetDistribution { distribution, masking, alpha: [1.0; 2] };
        Self { distribution, make, rows: [const { OnceLock::new() }; ROWS] }
    }

    #[inline]
    fn row(&self, k: usize) -> &LossRow {
        self.rows[k].get_or_init(|| {
            let entry = |i: usize| {
                let alpha = node(i, ALPHAS).powi(2).max(MIN_ALPHA);
                (self.make)(
                    MicrofacetDistribution { alpha: [alpha; 2], ..self.distribution },
                    node(k, ROWS),
                )
            };
            Box::new(std::array::from_fn(entry))
        })
    }

    /// Minimum of a value of the entries around a roughness and a position between 0 and 1 among
    /// the rows.
    fn least_around(&self, alpha: f32, place: f32, of: impl Fn(&LossEntry) -> f32) -> f32 {
        let ((i, _), (k, s)) = (locate(alpha.sqrt(), ALPHAS), locate(place, ROWS));
        // At the index of a row, only that row is used.
        let rows = if s < 1e-3 { k..=k } else { k..=k + 1 };
        let entries = rows.flat_map(|k| [i, i + 1].map(|i| &self.row(k)[i]));
        entries.map(of).fold(f32::INFINITY, f32::min)
    }

    /// Interpolated value of the entries around a roughness and a position between 0 and 1 among
    /// the rows.
    #[inline]
    fn between(&self, alpha: f32, place: f32, of: impl Fn(&LossEntry) -> f32) -> f32 {
        let (i, t) = locate(alpha.sqrt(), ALPHAS);
        let in_row = |k: usize| {
            let row = self.row(k);
            of(&row[i]).lerp(of(&row[i + 1]), t)
        };
        let (k, s) = locate(place, ROWS);
        // The last row, that of isotropic facets, has no neighbour.
        if s == 1.0 { in_row(k + 1) } else { in_row(k).lerp(in_row(k + 1), s) }
    }
}

/// Losses of facets that reflect all light, by [`MicrofacetDistribution::kind`].
static MIRRORS: [EnergyLossTable<RATIOS>; 4] = [
    EnergyLossTable::new(Distribution::Beckmann, Masking::Correlated, mirrors),
    EnergyLossTable::new(Distribution::Ggx, Masking::Correlated, mirrors),
    EnergyLossTable::new(Distribution::Beckmann, Masking::Separable, mirrors),
    EnergyLossTable::new(Distribution::Ggx, Masking::Separable, mirrors),
];

/// Losses of facets of dielectrics, by [`MicrofacetDistribution::kind`].
static DIELECTRICS: [EnergyLossTable<INDICES>; 4] = [
    EnergyLossTable::new(Distribution::Beckmann, Masking::Correlated, dielectrics),
    EnergyLossTable::new(Distribution::Ggx, Masking::Correlated, dielectrics),
    EnergyLossTable::new(Distribution::Beckmann, Masking::Separable, dielectrics),
    EnergyLossTable::new(Distribution::Ggx, Masking::Separable, dielectrics),
];

/// Light that the facets of a dielectric do not reflect by single scattering, for GGX with
/// separable masking.
static GLOSSES: EnergyLossTable<INDICES> =
    EnergyLossTable::new(Distribution::Ggx, Masking::Separable, glosses);

/// Losses of the facets of white metal under a smooth coat.
static BENEATH: EnergyLossTable<INDICES> =
    EnergyLossTable::new(Distribution::Ggx, Masking::Correlated, beneath);

/// Facets that reflect all light, whose lesser roughness is the greater one times the square of
/// `place`.
fn mirrors(distribution: MicrofacetDistribution, place: f32) -> LossEntry {
    let [greater, _] = distribution.alpha;
    let lesser = (greater * place * place).max(MIN_ALPHA);
    LossEntry::new(
        MicrofacetDistribution { alpha: [greater, lesser], ..distribution },
        greater,
        |distribution, cos| {
            distribution.mean_of_visible(cos, 32, |wo, h| {
                let wi = h * (2.0 * wo.dot(h)) - wo;
                if wi.z > 0.0 { distribution.shadowing(wo, wi) } else { 0.0 }
            })
        },
    )
    .growing(greater)
}

/// Index of refraction at a position among the rows of dielectrics; inverse of [`place_of_index`].
fn index_at(place: f32) -> f32 {
    (0.5 + place) / (1.5 - place)
}

/// Inverse of [`index_at`].
#[inline]
fn place_of_index(eta: f32) -> f32 {
    0.5 + (eta - 1.0) / (eta + 1.0)
}

/// Facets of a dielectric, whose index is at a `place`.
fn dielectrics(distribution: MicrofacetDistribution, place: f32) -> LossEntry {
    let eta = index_at(place);
    LossEntry::new(distribution, distribution.alpha[0], |distribution, cos| {
        distribution.mean_of_visible(cos, 24, |wo, h| {
            let cos = wo.dot(h);
            let (f, cos_t) = fresnel::dielectric(cos, eta).unwrap_or((1.0, 0.0));
            let (up, down) = (h * (2.0 * cos) - wo, refract(wo, h, [cos, cos_t], eta));
            let reflected = if up.z > 0.0 { f * distribution.shadowing(wo, up) } else { 0.0 };
            let refracted =
                if down.z < 0.0 { (1.0 - f) * distribution.shadowing(wo, -down) } else { 0.0 };
            reflected + refracted
        })
    })
    .growing(distribution.alpha[0])
}

/// Stretch of positions in the tables of [`Gloss`]: even smooth dielectrics reflect more at grazing
/// angles.
#[inline]
fn stretch_of_gloss(alpha: f32) -> f32 {
    alpha.max(0.12)
}

/// Facets of a dielectric, whose index is at a `place`: all light that they do not reflect counts
/// as loss.
fn glosses(distribution: MicrofacetDistribution, place: f32) -> LossEntry {
    let eta = index_at(place);
    LossEntry::new(distribution, stretch_of_gloss(distribution.alpha[0]), |distribution, cos| {
        distribution.mean_of_visible(cos, 24, |wo, h| {
            let cos = wo.dot(h);
            let (f, wi) =
                (fresnel::dielectric(cos, eta).map_or(1.0, |(f, _)| f), h * (2.0 * cos) - wo);
            if wi.z > 0.0 { f * distribution.shadowing(wo, wi) } else { 0.0 }
        })
    })
}

/// Facets of white metal under a smooth coat, whose index is at a `place`. Of the light that is
/// transmitted into the coat, seen from outside, all is lost that does not leave after reflection
/// by a single facet, or by repeated reflection between it and the coat as in
/// [`CoatedConductor`](super::CoatedConductor).
fn beneath(distribution: MicrofacetDistribution, place: f32) -> LossEntry {
    let eta = index_at(place);
    let reflected = |cos: f32| fresnel::dielectric(cos, eta).map_or(1.0, |(f, _)| f);
    LossEntry::new(distribution, stretch_of_gloss(distribution.alpha[0]), |distribution, cos| {
        let bent = |cos: f32| (1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0).sqrt();
        let thrown_back = reflected(cos);
        distribution.mean_of_visible(bent(cos), 24, |wo, h| {
            let wi = h * (2.0 * wo.dot(h)) - wo;
            let cos2 = 1.0 - eta * eta * (1.0 - wi.z * wi.z);
            if wi.z <= 0.0 || cos2 <= 0.0 {
                return 0.0;
            }
            let f = reflected(cos2.sqrt());
            distribution.shadowing(wo, wi) * (1.0 - f) / (1.0 - f.min(thrown_back))
        })
    })
}

/// Multiple scattering between facets that reflect all light.
#[derive(Clone, Copy)]
pub(super) struct Reflected {
    losses: &'static EnergyLossTable<RATIOS>,
    greater: f32,
    /// √ of the lesser roughness over the greater one.
    place: f32,
    /// True if the greater roughness is along y.
    along_y: bool,
    /// Mean of 1 − E.
    mean: f32,
}

impl Reflected {
    #[inline]
    pub(super) fn new(distribution: &MicrofacetDistribution) -> Self {
        let [ax, ay] = distribution.alpha;
        let (greater, place) = (ax.max(ay), (ax.min(ay) / ax.max(ay)).sqrt());
        let losses = &MIRRORS[distribution.kind()];
        let alpha = greater.clamp(MIN_ALPHA, 1.0);
        let mean = losses.between(greater, place, |entry| entry.mean) * alpha * alpha;
        Self { losses, greater, place, along_y: ay > ax, mean }
    }

    /// 1 − E for a direction above the surface.
    #[inline]
    pub(super) fn lost(&self, w: Vec3) -> f32 {
        let (x2, y2) = (w.x * w.x, w.y * w.y);
        let along = if self.along_y { y2 } else { x2 };
        let sin2 = if x2 + y2 > 0.0 { 1.0 - along / (x2 + y2) } else { 0.5 };
        let lesser = self.greater * self.place * self.place;
        let across = across([self.greater, lesser], w.z, sin2);
        let x = place(w.z, self.greater);
        self.losses.between(self.greater, self.place, |entry| entry.at(x, across))
    }

    /// f cos θi of two directions above the surface.
    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.mean > 0.0 {
            self.lost(wo) * self.lost(wi) * (FRAC_1_PI * wi.z) / self.mean
        } else {
            0.0
        }
    }

    /// Factor of [`Self::eval`] for facets of mean reflectance `f`: F² Ē / (1 − F (1 − Ē)), the sum
    /// over numbers of facets. [Kulla & Conty 2017]
    #[inline]
    pub(super) fn colored(&self, f: Spectrum) -> Spectrum {
        f.map(|f| f * f * (1.0 - self.mean) / (1.0 - f * self.mean))
    }
}

/// Fraction of light that the facets of a dielectric do not reflect.
#[derive(Clone, Copy)]
pub(super) struct Gloss {
    alpha: f32,
    place: f32,
}

impl Gloss {
    /// Creates the terms for GGX facets, with the geometric mean of the two roughnesses, and the
    /// index `eta` of the other side over that of this one.
    #[inline]
    pub(super) fn new(distribution: &MicrofacetDistribution, eta: f32) -> Self {
        let [ax, ay] = distribution.alpha;
        let alpha = (ax * ay).sqrt().clamp(MIN_ALPHA, 1.0);
        let place = place_of_index(eta);
        Self { alpha, place }
    }

    /// 1 − E for a direction above the surface.
    #[inline]
    pub(super) fn left(self, w: Vec3) -> f32 {
        let x = place(w.z, stretch_of_gloss(self.alpha));
        let left = if self.place < place_of_index(1.0) {
            // Beyond the critical angle all light is reflected; between nodes on both sides of it,
            // the minimum is used.
            GLOSSES.least_around(self.alpha, self.place, |entry| entry.least_at(x))
        } else {
            GLOSSES.between(self.alpha, self.place, |entry| entry.at(x, 0.5))
        };
        left.max(0.0)
    }
}

/// Single scattering by the facets of white metal under a smooth coat.
#[derive(Clone, Copy)]
pub(super) struct Beneath {
    alpha: f32,
    place: f32,
}

impl Beneath {
    /// Creates the terms for GGX facets of equal roughness in all directions, under a coat with the
    /// index `eta` over that above it.
    #[inline]
    pub(super) fn new(distribution: &MicrofacetDistribution, eta: f32) -> Self {
        Self { alpha: distribution.alpha[0].clamp(MIN_ALPHA, 1.0), place: place_of_index(eta) }
    }

    /// Fraction that leaves, of light transmitted through the coat from a cosine above it.
    #[inline]
    pub(super) fn reached(self, cos: f32) -> f32 {
        let x = place(cos, stretch_of_gloss(self.alpha));
        1.0 - BENEATH.between(self.alpha, self.place, |entry| entry.at(x, 0.5))
    }
}

/// Multiple scattering between the facets of a dielectric, for light from one of its sides. The
/// roughness is equal in all directions.
#[derive(Clone, Copy)]
pub(super) struct DielectricLosses {
    losses: &'static EnergyLossTable<INDICES>,
    alpha: f32,
    /// Position among the rows of the index of the other side over that of this one, and of its
    /// inverse.
    places: [f32; 2],
    /// Mean of 1 − E on this side, and on the other.
    means: [f32; 2],
    /// Fraction of the loss that leaves on this side.
    pub(super) reflected: f32,
}

impl DielectricLosses {
    /// Creates the terms for light from one side; `eta` is the index of the other side over that of
    /// this one.
    #[inline]
    pub(super) fn new(distribution: &MicrofacetDistribution, eta: f32) -> Self {
        let losses = &DIELECTRICS[distribution.kind()];
        let alpha = distribution.alpha[0].clamp(MIN_ALPHA, 1.0);
        let places = [eta, 1.0 / eta].map(place_of_index);
        let means = places.map(|place| losses.between(alpha, place, |e| e.mean) * alpha * alpha);
        // The transmitted fraction is that of smooth surfaces, or less, for reciprocity: the
        // fractions of both sides, times the means of the losses, have the ratio 1 to η².
        let [here, there] = means;
        let less = if here > there { there / here } else { 1.0 };
        let through = (1.0 - fresnel::mean_dielectric(eta)) * less;
        Self { losses, alpha, places, means, reflected: 1.0 - through }
    }

    /// 1 − E at a cosine on this side (0), or on the other (1).
    #[inline]
    fn lost_on(&self, side: usize, cos: f32) -> f32 {
        let x = place(cos, self.alpha);
        self.losses.between(self.alpha, self.places[side], |entry| entry.at(x, 0.5))
    }

    /// 1 − E at a cosine on this side.
    #[inline]
    pub(super) fn lost(&self, cos: f32) -> f32 {
        self.lost_on(0, cos)
    }

    /// f cos θi of power, from the cosine `cos_o` on this side to a direction with wi.z = `z`,
    /// whose sign is that of the side.
    #[inline]
    pub(super) fn eval(&self, cos_o: f32, z: f32) -> f32 {
        let (side, share) = if z > 0.0 { (0, self.reflected) } else { (1, 1.0 - self.reflected) };
        let mean = self.means[side];
        if mean > 0.0 {
            let cos_i = z.abs();
            share * self.lost(cos_o) * self.lost_on(side, cos_i) * (FRAC_1_PI * cos_i) / mean
        } else {
            0.0
        }
    }
}

/// Mean of a reflectance over diffuse illumination: 2 ∫ F(cos θ) cos θ d cos θ, by midpoints.
pub(super) fn mean_reflectance(at: impl Fn(f32) -> Spectrum) -> Spectrum {
    const STEPS: u16 = 128;
    let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(STEPS);
    let sum: Spectrum = (0..STEPS).map(middle).map(|cos| at(cos) * (2.0 * cos)).sum();
    sum / f32::from(STEPS)
}
