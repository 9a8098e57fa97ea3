//! Light that facets scatter more than once, which microfacet lobes lose.
//!
//! What is lost of light from a direction, 1 − E, leaves in another one as if it were light from
//! there that was lost: f = (1 − E(o)) (1 − E(i)) / (π (1 − mean of E)). That is reciprocal, and
//! nothing is lost of what reflects all. [Kulla & Conty 2017, "Revisiting Physically Based Shading
//! at Imageworks"; the shares lost are tables of the lobes of this program, made when they are
//! first asked for]

mod schlick;

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};
use std::sync::OnceLock;

use pt_math::{FloatExt, Spectrum, Vec3, trig};
use pt_scene::material::{Distribution, Masking};

use super::fresnel;
use super::microfacet::{MicrofacetDistribution, stretched};
use super::rough_dielectric::refract;
pub(super) use schlick::SchlickGloss;

/// Ratios of the two roughnesses in the tables of mirrors: even in √, from 0 to 1.
const RATIOS: usize = 9;
/// Indices of refraction in the tables of dielectrics: even in (η − 1) / (η + 1), from ⅓ to 3.
const INDICES: usize = 129;
/// Roughnesses of a table, the greater of two: even in √α, up to 1. Rougher facets lose more than
/// it says.
const ALPHAS: usize = 64;
/// Cosines of a table, by [`place`].
const COSINES: usize = 40;
/// What is smoother is as the smoothest of a table.
const MIN_ALPHA: f32 = 1e-3;

/// 1 − E of facets of one kind, and its mean over evenly spread light; in rows of which each is
/// made when it is asked for.
struct EnergyLossTable<const ROWS: usize> {
    distribution: MicrofacetDistribution,
    /// Makes an entry for facets of a roughness, from where its row is between 0 and 1.
    make: fn(MicrofacetDistribution, f32) -> Entry,
    rows: [OnceLock<Box<Row>>; ROWS],
}

/// By the greater roughness.
type Row = [Entry; ALPHAS];

/// Those of two roughnesses.
#[derive(Clone, Copy)]
struct Entry {
    /// Seen along the greater roughness, and across it; in between, by the square of the cosine.
    lost: [[f32; COSINES]; 2],
    /// The mean; of what grows with the square of the greater roughness, over that.
    mean: f32,
}

/// From 0 at the normal to 1 along the surface, denser there, where a roughness matters most.
#[inline]
fn place(cos: f32, alpha: f32) -> f32 {
    1.0 - (1.0 - stretched(cos, alpha)).max(0.0).sqrt()
}

/// The cosine at a [`place`].
fn cosine(place: f32, alpha: f32) -> f32 {
    stretched(1.0 - (1.0 - place) * (1.0 - place), alpha)
}

/// How far a direction is across the greater of two roughnesses, from 0 to 1, by the cosine to the
/// normal and the square of the sine of its azimuth to the greater one: as the masking of Smith's
/// facets changes between both, or a little less far, as was fitted to integrals for roughnesses of
/// ratios from 2 to 16 (they differ by at most 0.017).
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

/// Where a number from 0 to 1 is among `n` nodes: the lower one, and how far it is to the next.
#[inline]
fn locate(x: f32, n: usize) -> (usize, f32) {
    let scaled = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let lower = (scaled as usize).min(n - 2);
    (lower, scaled - lower as f32)
}

/// The number of a node.
fn node(i: usize, n: usize) -> f32 {
    i as f32 / (n - 1) as f32
}

impl Entry {
    /// `scattered` says E of facets at a cosine in the plane of x and z, at places by a `stretch`,
    /// which is their roughness but of what changes with angles by other reasons, too.
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

    /// The same with a mean that grows with the square of the roughness.
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

    /// The lesser of the two nearest 1 − E at a [`place`].
    fn least_at(&self, x: f32) -> f32 {
        let (j, _) = locate(x, COSINES);
        let [along, across] = &self.lost;
        [along[j], along[j + 1], across[j], across[j + 1]].into_iter().fold(1.0, f32::min)
    }

    /// 1 − E at a [`place`], so far across the greater roughness.
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
        make: fn(MicrofacetDistribution, f32) -> Entry,
    ) -> Self {
        let distribution = MicrofacetDistribution { distribution, masking, alpha: [1.0; 2] };
        Self { distribution, make, rows: [const { OnceLock::new() }; ROWS] }
    }

    #[inline]
    fn row(&self, k: usize) -> &Row {
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

    /// The least number of the entries around a roughness and a place between 0 and 1 among the
    /// rows.
    fn least_around(&self, alpha: f32, place: f32, of: impl Fn(&Entry) -> f32) -> f32 {
        let ((i, _), (k, s)) = (locate(alpha.sqrt(), ALPHAS), locate(place, ROWS));
        // Rows at whose place the index is are alone.
        let rows = if s < 1e-3 { k..=k } else { k..=k + 1 };
        let entries = rows.flat_map(|k| [i, i + 1].map(|i| &self.row(k)[i]));
        entries.map(of).fold(f32::INFINITY, f32::min)
    }

    /// A number of the entries around a roughness and a place between 0 and 1 among the rows.
    #[inline]
    fn between(&self, alpha: f32, place: f32, of: impl Fn(&Entry) -> f32) -> f32 {
        let (i, t) = locate(alpha.sqrt(), ALPHAS);
        let in_row = |k: usize| {
            let row = self.row(k);
            of(&row[i]).lerp(of(&row[i + 1]), t)
        };
        let (k, s) = locate(place, ROWS);
        // The last row, that of facets without a direction, has no other beside it.
        if s == 1.0 { in_row(k + 1) } else { in_row(k).lerp(in_row(k + 1), s) }
    }
}

/// The losses of facets that reflect all light, by [`MicrofacetDistribution::kind`].
static MIRRORS: [EnergyLossTable<RATIOS>; 4] = [
    EnergyLossTable::new(Distribution::Beckmann, Masking::Correlated, mirrors),
    EnergyLossTable::new(Distribution::Ggx, Masking::Correlated, mirrors),
    EnergyLossTable::new(Distribution::Beckmann, Masking::Separable, mirrors),
    EnergyLossTable::new(Distribution::Ggx, Masking::Separable, mirrors),
];

/// The losses of facets of dielectrics, likewise.
static DIELECTRICS: [EnergyLossTable<INDICES>; 4] = [
    EnergyLossTable::new(Distribution::Beckmann, Masking::Correlated, dielectrics),
    EnergyLossTable::new(Distribution::Ggx, Masking::Correlated, dielectrics),
    EnergyLossTable::new(Distribution::Beckmann, Masking::Separable, dielectrics),
    EnergyLossTable::new(Distribution::Ggx, Masking::Separable, dielectrics),
];

/// What facets of dielectrics do not reflect at once: separable ones of GGX.
static GLOSSES: EnergyLossTable<INDICES> =
    EnergyLossTable::new(Distribution::Ggx, Masking::Separable, glosses);

/// What facets of white metal lose under a smooth coat.
static BENEATH: EnergyLossTable<INDICES> =
    EnergyLossTable::new(Distribution::Ggx, Masking::Correlated, beneath);

/// Facets that reflect all light, of which the lesser roughness is less by the square of `place`.
fn mirrors(distribution: MicrofacetDistribution, place: f32) -> Entry {
    let [greater, _] = distribution.alpha;
    let lesser = (greater * place * place).max(MIN_ALPHA);
    Entry::new(
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

/// The index at a place among the rows of dielectrics, and the other way round.
fn index_at(place: f32) -> f32 {
    (0.5 + place) / (1.5 - place)
}

/// See [`index_at`].
#[inline]
fn place_of_index(eta: f32) -> f32 {
    0.5 + (eta - 1.0) / (eta + 1.0)
}

/// Facets of a dielectric, of which the index is at a `place`.
fn dielectrics(distribution: MicrofacetDistribution, place: f32) -> Entry {
    let eta = index_at(place);
    Entry::new(distribution, distribution.alpha[0], |distribution, cos| {
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

/// By which stretch places are, of what a gloss leaves: even smooth ones reflect more along the
/// surface.
#[inline]
fn stretch_of_gloss(alpha: f32) -> f32 {
    alpha.max(0.12)
}

/// Facets of a dielectric of which the index is at a `place`: light that they reflect is not lost,
/// all other is.
fn glosses(distribution: MicrofacetDistribution, place: f32) -> Entry {
    let eta = index_at(place);
    Entry::new(distribution, stretch_of_gloss(distribution.alpha[0]), |distribution, cos| {
        distribution.mean_of_visible(cos, 24, |wo, h| {
            let cos = wo.dot(h);
            let (f, wi) =
                (fresnel::dielectric(cos, eta).map_or(1.0, |(f, _)| f), h * (2.0 * cos) - wo);
            if wi.z > 0.0 { f * distribution.shadowing(wo, wi) } else { 0.0 }
        })
    })
}

/// Facets of white metal under a smooth coat, of which the index is at a `place`: of light that
/// gets through the coat, seen from outside, all is lost that does not leave after it was reflected
/// by one facet, by it and the coat again and again as [`CoatedConductor`](super::CoatedConductor)
/// has it.
fn beneath(distribution: MicrofacetDistribution, place: f32) -> Entry {
    let eta = index_at(place);
    let reflected = |cos: f32| fresnel::dielectric(cos, eta).map_or(1.0, |(f, _)| f);
    Entry::new(distribution, stretch_of_gloss(distribution.alpha[0]), |distribution, cos| {
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

/// What facets that reflect all light scatter more than once.
#[derive(Clone, Copy)]
pub(super) struct Reflected {
    losses: &'static EnergyLossTable<RATIOS>,
    greater: f32,
    /// √ of the lesser roughness over the greater one.
    place: f32,
    /// True if the greater one is along y.
    along_y: bool,
    /// The mean of 1 − E.
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

    /// How much of [`Self::eval`] there is where facets reflect `f` of evenly spread light: F² Ē /
    /// (1 − F (1 − Ē)), the sum over numbers of facets. [Kulla & Conty 2017]
    #[inline]
    pub(super) fn colored(&self, f: Spectrum) -> Spectrum {
        f.map(|f| f * f * (1.0 - self.mean) / (1.0 - f * self.mean))
    }
}

/// What a gloss of facets leaves to what lies under it.
#[derive(Clone, Copy)]
pub(super) struct Gloss {
    alpha: f32,
    place: f32,
}

impl Gloss {
    /// Of facets of GGX, whose roughness is taken as the same in all directions, with the index
    /// `eta` of the other side over that of this one.
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
            // Beyond the critical angle nothing is left, and between nodes on both sides of it no
            // more than on one.
            GLOSSES.least_around(self.alpha, self.place, |entry| entry.least_at(x))
        } else {
            GLOSSES.between(self.alpha, self.place, |entry| entry.at(x, 0.5))
        };
        left.max(0.0)
    }
}

/// What facets of white metal reflect at once under a smooth coat.
#[derive(Clone, Copy)]
pub(super) struct Beneath {
    alpha: f32,
    place: f32,
}

impl Beneath {
    /// Of facets of GGX whose roughness is the same in all directions, under a coat with the index
    /// `eta` over that above it.
    #[inline]
    pub(super) fn new(distribution: &MicrofacetDistribution, eta: f32) -> Self {
        Self { alpha: distribution.alpha[0].clamp(MIN_ALPHA, 1.0), place: place_of_index(eta) }
    }

    /// The share that leaves of light that gets through the coat from a cosine above it.
    #[inline]
    pub(super) fn reached(self, cos: f32) -> f32 {
        let x = place(cos, stretch_of_gloss(self.alpha));
        1.0 - BENEATH.between(self.alpha, self.place, |entry| entry.at(x, 0.5))
    }
}

/// What facets of a dielectric scatter more than once, as seen from one of its sides. Their
/// roughness is the same in all directions.
#[derive(Clone, Copy)]
pub(super) struct Interface {
    losses: &'static EnergyLossTable<INDICES>,
    alpha: f32,
    /// Where the index of the other side over that of this one is among the rows, and its inverse.
    places: [f32; 2],
    /// The mean of 1 − E on this side, and on the other.
    means: [f32; 2],
    /// Share of what is lost that leaves on this side.
    pub(super) reflected: f32,
}

impl Interface {
    /// `eta` is the index of the other side over that of this one.
    #[inline]
    pub(super) fn new(distribution: &MicrofacetDistribution, eta: f32) -> Self {
        let losses = &DIELECTRICS[distribution.kind()];
        let alpha = distribution.alpha[0].clamp(MIN_ALPHA, 1.0);
        let places = [eta, 1.0 / eta].map(place_of_index);
        let means = places.map(|place| losses.between(alpha, place, |e| e.mean) * alpha * alpha);
        // What goes through is as much as smooth surfaces let through, or less, so that it is
        // reciprocal: its shares of both sides, times means of losses, are as 1 to η².
        let [here, there] = means;
        let less = if here > there { there / here } else { 1.0 };
        let through = (1.0 - fresnel::mean_dielectric(eta)) * less;
        Self { losses, alpha, places, means, reflected: 1.0 - through }
    }

    /// 1 − E at a cosine on this side, or on the other.
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

    /// f cos θi of power, from this side with the cosine of `cos_o` to where wi.z is `z`: the side
    /// of its sign.
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

/// The mean of a reflectance over evenly spread light: 2 ∫ F(cos θ) cos θ d cos θ, by midpoints.
pub(super) fn mean_reflectance(at: impl Fn(f32) -> Spectrum) -> Spectrum {
    const STEPS: u16 = 128;
    let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(STEPS);
    let sum: Spectrum = (0..STEPS).map(middle).map(|cos| at(cos) * (2.0 * cos)).sum();
    sum / f32::from(STEPS)
}
