//! Measured reflection.

mod gonioreflectometer;
mod planes;
#[cfg(test)]
mod tests;

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, PI, TAU};
use std::fmt;
use std::sync::{Arc, LazyLock};

pub use gonioreflectometer::{Gonioreflectometer, TabulatedLobe};
use planes::{TableWeights, UnitSquareTables, Warp};
use pt_math::{Pdf, SolidAngle, Spectrum, Vec2, Vec3, trig};
use pt_scene::measured::{self, Measurements};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::{BsdfSample, Lobe, LobeContext, LobeTables, PARAMETERS, padded};

/// Minimum density of a sample; below it, single precision is not sufficient for the quotient.
const MIN_DENSITY: f32 = 1e-9;
/// Minimum of the projected area of facets.
const MIN_AREA: f32 = 1e-6;
/// Minimum of u sin θ; closer to the normal, single precision cannot distinguish facet normals.
const MIN_SINE: f32 = 1e-7;

/// f cos θi = C(s) · D(m) / 4σ(ωo), by the tables of a material. [Dupuy & Jakob 2018, "An Adaptive
/// Parameterization for Efficient Material Acquisition and Rendering", §4]
///
/// The normal m of the facets that mirror `wi` to `wo` is a point u of the unit square, by √(2θ/π)
/// and φ; the visible normals of `wo`, whose density on the square is tabulated, map s to u, and C
/// is a table over s. `wo` is the incident direction in the terms of the files. Measured values are
/// reciprocal up to measurement errors, interpolated ones are not. Directions are sampled by the
/// table of the luminance over s, and the same map.
#[derive(Clone, Copy)]
pub struct Measured<'t> {
    /// Index among the measured tables of the scene.
    number: u32,
    mirrored: bool,
    tables: &'t MeasuredTables,
}

/// Tables of a measured material, in the form in which they are evaluated.
pub struct MeasuredTables {
    description: String,
    theta: Vec<f32>,
    phi: Vec<f32>,
    is_isotropic: bool,
    repeats: u32,
    is_relative: bool,
    spread: f32,
    ndf: UnitSquareTables<f32>,
    sigma: UnitSquareTables<f32>,
    vndf: Warp,
    luminance: Warp,
    colors: UnitSquareTables<Vec3>,
}

impl MeasuredTables {
    /// Creates the tables of measurements.
    pub fn new(measurements: &Measurements) -> Self {
        let tables = measurements.tables();
        let measured::Planes { columns, rows, .. } = tables.luminance;
        Self {
            description: tables.description.clone(),
            theta: tables.theta.clone(),
            phi: tables.phi.clone(),
            is_isotropic: measurements.is_isotropic(),
            repeats: measurements.repeats(),
            is_relative: tables.is_relative,
            spread: measurements.roughness(),
            ndf: UnitSquareTables::from(&tables.ndf),
            sigma: UnitSquareTables::from(&tables.sigma),
            vndf: Warp::new(&tables.vndf),
            luminance: Warp::new(&tables.luminance),
            colors: UnitSquareTables {
                columns,
                rows,
                values: tables.colors.iter().map(|color| Vec3::from(*color)).collect(),
            },
        }
    }

    /// Returns true if the material is isotropic.
    pub fn is_isotropic(&self) -> bool {
        self.is_isotropic
    }

    /// Signs that reflect a direction into the tabulated range, or back from it.
    fn turn(&self, wo: Vec3) -> Vec3 {
        let towards_least = |x: f32| if x > 0.0 { -1.0 } else { 1.0 };
        match self.repeats {
            1 => Vec3::ONE,
            2 => Vec3::new(towards_least(wo.y), towards_least(wo.y), 1.0),
            _ => Vec3::new(towards_least(wo.x), towards_least(wo.y), 1.0),
        }
    }
}

impl fmt::Debug for MeasuredTables {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MeasuredTables")
            .field("description", &self.description)
            .finish_non_exhaustive()
    }
}

/// Terms of a viewing direction.
struct Viewed {
    /// The viewing direction, reflected into the tabulated range.
    wo: Vec3,
    turn: Vec3,
    blend: TableWeights,
    /// Azimuth that is subtracted from that of the facet normals.
    from_phi: f32,
    /// Divisor of D(m).
    area: f32,
}

/// Polar angle and azimuth of a direction.
fn angles(w: Vec3) -> [f32; 2] {
    [trig::atan2(trig::hypot(w.x, w.y), w.z), trig::atan2(w.y, w.x)]
}

/// Coordinate of a polar angle in the unit square.
fn column(theta: f32) -> f32 {
    (theta * FRAC_2_PI).sqrt()
}

/// Coordinate of an azimuth in the unit square.
fn row(phi: f32) -> f32 {
    let turns = (phi + PI) / TAU;
    turns - turns.floor()
}

/// Solid angle of facet normals per area of the unit square, 2π² u sin θ: θ is π/2 u², and φ covers
/// the full circle.
fn stretch(column: f32, sin: f32) -> f32 {
    2.0 * PI * PI * (column * sin).max(MIN_SINE)
}

impl<'t> Measured<'t> {
    /// Creates a lobe by the tables of index `number` in the scene.
    pub fn new(number: u32, tables: &'t MeasuredTables) -> Self {
        Self { number, mirrored: false, tables }
    }

    /// The mirror image of the lobe, with y replaced by −y: the lobe of a back side whose frame has
    /// the same x and the opposite normal, if the surface is to look as if its front was seen from
    /// behind.
    pub fn mirrored(self) -> Self {
        Self { mirrored: !self.mirrored, ..self }
    }

    /// Computes the terms of a viewing direction; `None` below the surface.
    fn viewed(&self, wo: Vec3) -> Option<Viewed> {
        if wo.z <= 0.0 {
            return None;
        }
        let tables = self.tables;
        let mirror = if self.mirrored { Vec3::new(1.0, -1.0, 1.0) } else { Vec3::ONE };
        let turn = mirror * tables.turn(wo * mirror);
        let wo = wo * turn;
        let [theta, phi] = angles(wo);
        let area = if tables.is_relative {
            let area = tables.sigma.at(&TableWeights::ONE, Vec2::new(column(theta), row(phi)));
            4.0 * area.max(MIN_AREA)
        } else {
            1.0
        };
        let blend = TableWeights::new(&tables.phi, &tables.theta, [phi, theta]);
        let from_phi = if tables.is_isotropic { phi } else { 0.0 };
        Some(Viewed { wo, turn, blend, from_phi, area })
    }

    /// f cos θi, and the density with which [`Lobe::sample`] returns `wi`; `None` if the density is
    /// nearly 0, so that sampling covers all directions of non-zero f.
    fn look(&self, viewed: &Viewed, wi: Vec3) -> Option<(Spectrum, f32)> {
        if wi.z <= 0.0 {
            return None;
        }
        let Viewed { wo, turn, blend, from_phi, area } = viewed;
        let m = (*wo + wi * *turn).try_normalize()?;
        let [theta, phi] = angles(m);
        let normal = Vec2::new(column(theta), row(phi - from_phi));
        let (point, seen) = self.tables.vndf.invert(blend, normal);
        let context = self.tables.luminance.pdf(blend, point);
        // Mirrored directions are 4 (ωo · m) times as far apart as the normals m.
        let pdf = seen * context / (stretch(normal.x, trig::hypot(m.x, m.y)) * 4.0 * wo.dot(m));
        if !pdf.is_finite() || pdf < MIN_DENSITY {
            return None;
        }
        let color = self.tables.colors.at(blend, point);
        let distribution = if self.tables.is_relative {
            self.tables.ndf.at(&TableWeights::ONE, normal)
        } else {
            1.0
        };
        Some((Spectrum(color * (distribution / area)), pdf))
    }
}

impl fmt::Debug for Measured<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Measured({}, {}, {:?})", self.number, self.mirrored, self.tables.description)
    }
}

impl<'t> Lobe<'t> for Measured<'t> {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        padded([self.number as f32, f32::from(u8::from(self.mirrored))])
    }

    fn unpack(p: &[f32; PARAMETERS], context: LobeContext<'t>) -> Self {
        let number = p[0] as u32;
        Self { number, mirrored: p[1] > 0.5, tables: &context.tables.measured[number as usize] }
    }

    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let viewed = self.viewed(wo);
        viewed.and_then(|viewed| self.look(&viewed, wi)).map_or(Spectrum::ZERO, |(f, _)| f)
    }

    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let viewed = self.viewed(wo);
        let found = viewed.and_then(|viewed| self.look(&viewed, wi));
        found.map_or(Pdf::ZERO, |(_, pdf)| Pdf::new(pdf))
    }

    /// Samples a point by luminance, maps it to a visible normal, and reflects `wo` about it.
    fn sample(&self, wo: Vec3, [u, v, _]: [f32; 3]) -> Option<BsdfSample> {
        let viewed = self.viewed(wo)?;
        let point = self.tables.luminance.sample(&viewed.blend, Vec2::new(u, v));
        let normal = self.tables.vndf.sample(&viewed.blend, point);
        let theta = FRAC_PI_2 * normal.x * normal.x;
        let (sin, cos) = trig::sin_cos(theta);
        let (sin_phi, cos_phi) = trig::sin_cos(normal.y * TAU - PI + viewed.from_phi);
        let m = Vec3::new(sin * cos_phi, sin * sin_phi, cos);
        let wi = ((m * (2.0 * viewed.wo.dot(m)) - viewed.wo) * viewed.turn).try_normalize()?;
        let (f, pdf) = self.look(&viewed, wi)?;
        Some(BsdfSample::new(wi, f * (1.0 / pdf), Some(Pdf::new(pdf))))
    }

    fn lobe_width(&self) -> f32 {
        self.tables.spread
    }

    fn examples() -> Vec<Self> {
        let tables = &LobeTables::examples().measured;
        let plain: Vec<_> = (0..).zip(tables).map(|(i, tables)| Self::new(i, tables)).collect();
        let mirrored = plain.iter().filter(|lobe| !lobe.tables.is_isotropic);
        let mirrored: Vec<_> = mirrored.map(|lobe| lobe.mirrored()).collect();
        [plain, mirrored].concat()
    }
}

#[cfg(test)]
impl LobeLaws for Measured<'_> {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: false,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: CONSERVING,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }
}

impl LobeTables {
    /// Tables to which the examples of lobes refer.
    pub fn examples() -> &'static Self {
        static EXAMPLES: LazyLock<LobeTables> = LazyLock::new(|| {
            let examples = gonioreflectometer::examples();
            LobeTables {
                measured: examples.iter().map(MeasuredTables::new).map(Arc::new).collect(),
            }
        });
        &EXAMPLES
    }
}

#[cfg(test)]
impl LobeContext<'static> {
    /// Context of the examples of lobes.
    pub(super) fn examples() -> Self {
        Self { tables: LobeTables::examples() }
    }
}
