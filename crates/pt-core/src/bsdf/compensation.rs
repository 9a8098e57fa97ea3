//! Light that facets scatter more than once, which microfacet lobes lose.
//!
//! What is lost of light from a direction, 1 − E, leaves in another one as if it were light from there that was
//! lost: f = (1 − E(o)) (1 − E(i)) / (π (1 − mean of E)). That is reciprocal, and nothing is lost of what reflects
//! all. [Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks"; the shares lost are tables of the
//! lobes of this program, made when they are first asked for]

use std::f32::consts::FRAC_1_PI;
use std::sync::OnceLock;

use pt_math::{Spectrum, Vec3};
use pt_scene::material::{Distribution, Masking};

use super::microfacet::{Facets, stretched};

/// Ratios of the two roughnesses in a table: even in √, from 0 to 1.
const RATIOS: usize = 5;
/// Roughnesses of a table, the greater of two: even in √α, up to 1. Rougher facets lose more than it says.
const ALPHAS: usize = 64;
/// Cosines of a table, by [`place`].
const COSINES: usize = 40;
/// What is smoother is as the smoothest of a table.
const LEAST_ALPHA: f32 = 1e-3;

/// 1 − E of facets of one kind, and its mean over evenly spread light; by ratios of roughnesses, of which each is
/// made when it is asked for.
struct Losses {
    facets: Facets,
    /// E of facets at a cosine in the plane of x and z.
    scattered: fn(&Facets, f32) -> f32,
    rows: [OnceLock<Box<Row>>; RATIOS],
}

/// By the greater roughness.
type Row = [Entry; ALPHAS];

/// Those of two roughnesses.
#[derive(Clone, Copy)]
struct Entry {
    /// Seen along the greater roughness, and across it; in between, by the square of the cosine.
    lost: [[f32; COSINES]; 2],
    /// The mean over the square of the greater roughness, with which it grows.
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

#[inline]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

impl Entry {
    fn new(facets: Facets, scattered: fn(&Facets, f32) -> f32) -> Self {
        let [greater, lesser] = facets.alpha;
        let seen = |alpha| {
            std::array::from_fn(|j| {
                let cos = cosine(node(j, COSINES), greater);
                (1.0 - scattered(&Facets { alpha, ..facets }, cos)).max(0.0)
            })
        };
        let along = seen([greater, lesser]);
        let across = if greater == lesser { along } else { seen([lesser, greater]) };
        let mut entry = Self { lost: [along, across], mean: 0.0 };
        entry.mean = entry.mean_of(greater) / (greater * greater);
        entry
    }

    /// 2 ∫ (1 − E) cos θ d cos θ, by midpoints in √cos θ, of all directions around.
    fn mean_of(&self, alpha: f32) -> f32 {
        const STEPS: u16 = 512;
        let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(STEPS);
        let lost = |t: f32| 4.0 * t * t * t * self.at(place(t * t, alpha), 0.5);
        (0..STEPS).map(middle).map(lost).sum::<f32>() / f32::from(STEPS)
    }

    /// 1 − E at a [`place`], so far across the greater roughness.
    #[inline]
    fn at(&self, x: f32, across: f32) -> f32 {
        let (j, t) = locate(x, COSINES);
        let [a, b] = self.lost.map(|lost| lerp(lost[j], lost[j + 1], t));
        lerp(a, b, across)
    }
}

impl Losses {
    const fn new(
        distribution: Distribution,
        masking: Masking,
        scattered: fn(&Facets, f32) -> f32,
    ) -> Self {
        let facets = Facets { distribution, masking, alpha: [1.0; 2] };
        Self { facets, scattered, rows: [const { OnceLock::new() }; RATIOS] }
    }

    #[inline]
    fn row(&self, k: usize) -> &Row {
        self.rows[k].get_or_init(|| {
            let ratio = node(k, RATIOS).powi(2);
            let entry = |i: usize| {
                let greater = node(i, ALPHAS).powi(2).max(LEAST_ALPHA);
                let lesser = (greater * ratio).max(LEAST_ALPHA);
                Entry::new(Facets { alpha: [greater, lesser], ..self.facets }, self.scattered)
            };
            Box::new(std::array::from_fn(entry))
        })
    }

    /// A number of the entries around two roughnesses.
    #[inline]
    fn between(&self, greater: f32, ratio: f32, of: impl Fn(&Entry) -> f32) -> f32 {
        let (i, t) = locate(greater.sqrt(), ALPHAS);
        let in_row = |k: usize| {
            let row = self.row(k);
            lerp(of(&row[i]), of(&row[i + 1]), t)
        };
        let (k, s) = locate(ratio.sqrt(), RATIOS);
        // Without a direction, there is no other row.
        if s == 1.0 { in_row(k + 1) } else { lerp(in_row(k), in_row(k + 1), s) }
    }
}

/// The losses of facets that reflect all light, by [`Facets::kind`].
static MIRRORS: [Losses; 4] = [
    Losses::new(Distribution::Beckmann, Masking::Correlated, mirrored),
    Losses::new(Distribution::Ggx, Masking::Correlated, mirrored),
    Losses::new(Distribution::Beckmann, Masking::Separable, mirrored),
    Losses::new(Distribution::Ggx, Masking::Separable, mirrored),
];

/// What facets scatter that reflect all light.
fn mirrored(facets: &Facets, cos: f32) -> f32 {
    facets.mean_of_visible(cos, 32, |wo, h| {
        let wi = h * (2.0 * wo.dot(h)) - wo;
        if wi.z > 0.0 { facets.shadowing(wo, wi) } else { 0.0 }
    })
}

/// What facets that reflect all light scatter more than once.
#[derive(Clone, Copy)]
pub(super) struct Reflected {
    losses: &'static Losses,
    greater: f32,
    /// The lesser roughness over the greater one.
    ratio: f32,
    /// Whether the greater one is along y.
    along_y: bool,
    /// The mean of 1 − E.
    mean: f32,
}

impl Reflected {
    #[inline]
    pub(super) fn new(facets: &Facets) -> Self {
        let [ax, ay] = facets.alpha;
        let (greater, ratio) = (ax.max(ay), ax.min(ay) / ax.max(ay));
        let losses = &MIRRORS[facets.kind()];
        let alpha = greater.clamp(LEAST_ALPHA, 1.0);
        let mean = losses.between(greater, ratio, |entry| entry.mean) * alpha * alpha;
        Self { losses, greater, ratio, along_y: ay > ax, mean }
    }

    /// 1 − E for a direction above the surface.
    #[inline]
    pub(super) fn lost(&self, w: Vec3) -> f32 {
        let (x2, y2) = (w.x * w.x, w.y * w.y);
        let along = if self.along_y { y2 } else { x2 };
        let across = if x2 + y2 > 0.0 { 1.0 - along / (x2 + y2) } else { 0.5 };
        let x = place(w.z, self.greater);
        self.losses.between(self.greater, self.ratio, |entry| entry.at(x, across))
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

    /// How much of [`Self::eval`] there is where facets reflect `f` of evenly spread light: F² Ē / (1 − F (1 − Ē)),
    /// the sum over numbers of facets. [Kulla & Conty 2017]
    #[inline]
    pub(super) fn colored(&self, f: Spectrum) -> Spectrum {
        f.map(|f| f * f * (1.0 - self.mean) / (1.0 - f * self.mean))
    }
}

/// The mean of a reflectance over evenly spread light: 2 ∫ F(cos θ) cos θ d cos θ, by midpoints.
pub(super) fn mean_reflectance(at: impl Fn(f32) -> Spectrum) -> Spectrum {
    const STEPS: u16 = 128;
    let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(STEPS);
    let sum: Spectrum = (0..STEPS).map(middle).map(|cos| at(cos) * (2.0 * cos)).sum();
    sum / f32::from(STEPS)
}
