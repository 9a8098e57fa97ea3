//! A simulated gonioreflectometer that measures lobes by the method of the paper, so that tests and
//! examples have tables of known lobes.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use pt_math::{Spectrum, Vec2, Vec3, trig};
use pt_scene::material::{Distribution, Masking};
use pt_scene::measured::{Measurements, Planes, Tables};

use super::super::microfacet::MicrofacetDistribution;
use super::super::{Lobe, RoughConductor, RoughPlastic, SmoothConductor};
use super::planes::{TableWeights, Warp};
use super::stretch;

/// A specimen: the reflection of a lobe, and the facet distribution of its tables.
pub struct TabulatedLobe<'a> {
    /// Description of the material.
    pub description: &'a str,
    /// f(wo, wi) · |cos θi| of the lobe to measure.
    pub eval: &'a dyn Fn(Vec3, Vec3) -> Spectrum,
    /// D(m) of the facets. The distribution of the lobe itself makes the tables smoothest; other
    /// reflection is represented accurately as well, unless D is too small for interpolation.
    pub distribution: &'a dyn Fn(Vec3) -> f32,
    /// True if the lobe is isotropic; otherwise, half of the azimuths are measured, and the other
    /// half has to be equal.
    pub is_isotropic: bool,
    /// True if reflection is stored relative to D / 4σ.
    pub is_relative: bool,
}

/// Resolution of the tables; each number is at least 2.
pub struct Gonioreflectometer {
    /// Number of polar angles.
    pub theta: usize,
    /// Number of azimuths, over half of the circle; at least 3.
    pub phi: usize,
    /// Columns and rows of the tables of D and σ.
    pub distribution: [usize; 2],
    /// Columns and rows of the tables of visible normals.
    pub visible: [usize; 2],
    /// Columns and rows of the tables of reflection.
    pub reflected: usize,
}

/// Maximum polar angle of the measurement.
const MAX_THETA: f32 = 1.5;

/// Direction of a point of the unit square.
fn direction(p: Vec2) -> Vec3 {
    let (sin, cos) = trig::sin_cos(FRAC_PI_2 * p.x * p.x);
    let (sin_phi, cos_phi) = trig::sin_cos(p.y * TAU - PI);
    Vec3::new(sin * cos_phi, sin * sin_phi, cos)
}

/// The points of a table, row by row.
fn points([columns, rows]: [usize; 2]) -> impl Iterator<Item = Vec2> {
    let step = |i: usize, n: usize| i as f32 / (n - 1) as f32;
    (0..rows).flat_map(move |row| {
        (0..columns).map(move |column| Vec2::new(step(column, columns), step(row, rows)))
    })
}

fn plane(size: [usize; 2], number: impl Fn(Vec2) -> f32) -> Planes {
    Planes { columns: size[0], rows: size[1], values: points(size).map(number).collect() }
}

impl Gonioreflectometer {
    /// Measures the tables of a specimen.
    ///
    /// # Panics
    /// If its facets are not a valid distribution.
    pub fn measure(&self, specimen: &TabulatedLobe<'_>) -> Measurements {
        let distribution = specimen.distribution;
        let theta: Vec<f32> = steps(self.theta).map(|t| t * MAX_THETA).collect();
        let phi: Vec<f32> = if specimen.is_isotropic {
            vec![0.0]
        } else {
            steps(self.phi).map(|t| PI * (t - 1.0)).collect()
        };
        let views = phi.iter().flat_map(|phi| theta.iter().map(move |theta| [*phi, *theta]));
        let views: Vec<Vec3> = views
            .map(|[phi, theta]| {
                let ((sin, cos), (s, c)) = (trig::sin_cos(theta), trig::sin_cos(phi));
                Vec3::new(sin * c, sin * s, cos)
            })
            .collect();
        let mut vndf =
            Planes { columns: self.visible[0], rows: self.visible[1], values: Vec::new() };
        for wo in &views {
            let visible = |p: Vec2| {
                let m = direction(p);
                distribution(m) * m.dot(*wo).max(0.0) * stretch(p.x, trig::hypot(m.x, m.y))
            };
            vndf.values.extend(points(self.visible).map(visible));
        }
        let mut tables = Tables {
            description: specimen.description.to_owned(),
            theta,
            phi,
            ndf: plane(self.distribution, |p| distribution(direction(p))),
            sigma: plane(self.distribution, |p| projected(distribution, direction(p))),
            vndf,
            is_relative: specimen.is_relative,
            ..Tables::default()
        };
        self.light(specimen, &views, &mut tables);
        Measurements::new(tables).expect("tables of the instrument fit together")
    }

    /// Measures the reflection at the points that the tables so far determine.
    fn light(&self, specimen: &TabulatedLobe<'_>, views: &[Vec3], tables: &mut Tables) {
        let size = [self.reflected; 2];
        let warp = Warp::new(&tables.vndf);
        let [ndf, sigma] = [&tables.ndf, &tables.sigma].map(super::UnitSquareTables::from);
        let mut luminance = Vec::new();
        for (view, wo) in views.iter().enumerate() {
            let blend = TableWeights::only(view);
            let [theta, phi] = super::angles(*wo);
            let area =
                sigma.at(&TableWeights::ONE, Vec2::new(super::column(theta), super::row(phi)));
            for point in points(size) {
                let normal = warp.sample(&blend, point);
                let m = direction(normal);
                let wi = m * (2.0 * wo.dot(m)) - *wo;
                let f =
                    if wi.z > 0.0 { (specimen.eval)(*wo, wi.normalize()) } else { Spectrum::ZERO };
                let seen = warp.pdf(&blend, normal);
                let apart = stretch(normal.x, trig::hypot(m.x, m.y)) * 4.0 * wo.dot(m);
                luminance.push(if seen > 0.0 {
                    (f.luminance() * apart / seen).max(0.0)
                } else {
                    0.0
                });
                let over = if specimen.is_relative {
                    ndf.at(&TableWeights::ONE, normal) / (4.0 * area)
                } else {
                    1.0
                };
                tables.colors.push(if over > 0.0 {
                    (f * (1.0 / over)).to_array()
                } else {
                    [0.0; 3]
                });
            }
        }
        let [columns, rows] = size;
        tables.luminance = Planes { columns, rows, values: luminance };
    }
}

/// Equidistant numbers from 0 to 1.
fn steps(count: usize) -> impl Iterator<Item = f32> {
    (0..count).map(move |i| i as f32 / (count - 1) as f32)
}

/// σ, the integral of D(m) (m · ω) over the normals that are visible from ω.
fn projected(distribution: &dyn Fn(Vec3) -> f32, w: Vec3) -> f32 {
    const SIDE: u16 = 128;
    let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(SIDE);
    let seen = |i: u16, j: u16| {
        let p = Vec2::new(middle(i), middle(j));
        let m = direction(p);
        f64::from(distribution(m) * m.dot(w).max(0.0) * stretch(p.x, trig::hypot(m.x, m.y)))
    };
    let sum: f64 = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| seen(i, j))).sum();
    (sum / f64::from(SIDE).powi(2)) as f32
}

/// A glossy isotropic surface, an anisotropic metal, and the former with absolute instead of
/// relative reflection.
pub(super) fn examples() -> [Measurements; 3] {
    let instrument = Gonioreflectometer {
        theta: 6,
        phi: 5,
        distribution: [16, 8],
        visible: [24, 16],
        reflected: 16,
    };
    let gloss = MicrofacetDistribution::isotropic(Distribution::Ggx, 0.4);
    let glossy = RoughPlastic {
        rho: Spectrum::rgb(0.1, 0.3, 0.5),
        f0: Spectrum::splat(0.2),
        distribution: gloss,
    };
    let brushed = MicrofacetDistribution {
        distribution: Distribution::Ggx,
        masking: Masking::Correlated,
        alpha: [0.5, 0.25],
    };
    let metal = RoughConductor { metal: SmoothConductor::gold(), distribution: brushed };
    // A uniform distribution of facets is added for the diffuse part.
    let mixed = |m: Vec3| 0.5 * gloss.d(m) + 0.5 * FRAC_1_PI;
    let eval = |wo, wi| glossy.eval(wo, wi);
    let of_glossy = |description, is_relative| TabulatedLobe {
        description,
        eval: &eval,
        distribution: &mixed,
        is_isotropic: true,
        is_relative,
    };
    let brushed = TabulatedLobe {
        description: "brushed gold",
        eval: &|wo, wi| metal.eval(wo, wi),
        distribution: &|m| brushed.d(m),
        is_isotropic: false,
        is_relative: true,
    };
    [
        instrument.measure(&of_glossy("glossy", true)),
        instrument.measure(&brushed),
        instrument.measure(&of_glossy("glossy as it is", false)),
    ]
}
