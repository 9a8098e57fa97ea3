//! Coefficients of the Hosek-Wilkie sky and sun, for an elevation of the sun and a turbidity.
//! [Hosek & Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance"; 2013, "Adding a
//! Solar-Radiance Function to the Hosek-Wilkie Skylight Model"]
//!
//! Radiances are in W m⁻² sr⁻¹ nm⁻¹ of linear Rec. 709, angles in radians. The coefficients are in
//! `data/hosek_wilkie.bin`: little-endian single precision, with a licence of their own beside it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::RangeInclusive;

use pt_scene::Daylight;

/// Turbidities for which the model was fitted.
pub(crate) const TURBIDITIES: RangeInclusive<f64> = Daylight::TURBIDITIES;

/// Angular radius of the sun.
pub(crate) const SUN_RADIUS: f64 = 0.5 * 0.5358 * PI / 180.0;

/// Parameters A to I of a channel, and its mean radiance.
pub(crate) type SkyChannel = [f32; 10];

/// Number of elevation intervals, each with its polynomial of the sun's radiance: interval i of n
/// begins at π/2 (i/n)³.
pub(super) const PARTS: usize = 45;
/// Number of coefficients of such a polynomial: by channel, power of the elevation above the
/// beginning of the interval, and power of the cosine on the sun.
pub(super) const COEFFICIENTS: usize = CHANNELS * HEIGHT_POWERS * LIMB_POWERS;
pub(super) const HEIGHT_POWERS: usize = 4;
pub(super) const LIMB_POWERS: usize = 6;

static DATA: &[u8] = include_bytes!("../../data/hosek_wilkie.bin");

const LEVELS: usize = 10;
const ALBEDOS: usize = 2;
const POINTS: usize = 6;
const CHANNELS: usize = 3;
const ELEVATIONS: usize = 30;
const OF_CHANNEL: usize = 10;

const SKY: usize = ALBEDOS * POINTS * CHANNELS * OF_CHANNEL;
const IRRADIANCE: usize = ELEVATIONS * CHANNELS;
const LIMB: usize = PARTS * COEFFICIENTS;
const _: () = assert!(DATA.len() == 4 * LEVELS * (SKY + IRRADIANCE + LIMB));

/// Luminous efficacy by which Mitsuba divides colours, in nanometres: ∫ȳ of its observer.
const EFFICACY: f64 = 106.750_259_399_414_06;
/// Additional factor of the radiance of the sun in Mitsuba.
const SUN_TO_RGB: f64 = 467.069_280_386;

fn figure(i: usize) -> f64 {
    let bytes: [u8; 4] = std::array::from_fn(|k| DATA[4 * i + k]);
    f64::from(f32::from_le_bytes(bytes))
}

/// Returns entry `i` of one of the tables by turbidity, with `size` entries per turbidity; linear
/// in between.
fn at_turbidity(table: usize, size: usize, turbidity: f64, i: usize) -> f64 {
    let position = turbidity - TURBIDITIES.start();
    let level = (position as usize).min(LEVELS - 2);
    let t = position - level as f64;
    let entry = |level| figure(table + level * size + i);
    entry(level) * (1.0 - t) + entry(level + 1) * t
}

/// Returns the parameters of the sky for each channel, with the sun at an elevation in [0, π/2], a
/// turbidity in [`TURBIDITIES`], and a ground albedo in [0, 1].
///
/// Each is a Bézier curve of degree 5 over ∛(2η/π) of the elevation η. [Hosek & Wilkie 2012]
pub(crate) fn sky(elevation: f64, turbidity: f64, albedo: [f32; 3]) -> [SkyChannel; 3] {
    let x = libm::cbrt(elevation / FRAC_PI_2);
    let y = 1.0 - x;
    let bernstein = [
        y * y * y * y * y,
        5.0 * x * y * y * y * y,
        10.0 * x * x * y * y * y,
        10.0 * x * x * x * y * y,
        5.0 * x * x * x * x * y,
        x * x * x * x * x,
    ];
    let curve = |ground: usize, channel: usize, parameter: usize| -> f64 {
        let entry = |point: usize| {
            let i = ((ground * POINTS + point) * CHANNELS + channel) * OF_CHANNEL + parameter;
            at_turbidity(0, SKY, turbidity, i)
        };
        bernstein.iter().enumerate().map(|(point, b)| b * entry(point)).sum()
    };
    std::array::from_fn(|channel| {
        let albedo = f64::from(albedo[channel]);
        std::array::from_fn(|parameter| {
            let [dark, bright] = [0, 1].map(|ground| curve(ground, channel, parameter));
            let value = dark * (1.0 - albedo) + bright * albedo;
            // The last one is the radiance.
            (if parameter + 1 == OF_CHANNEL { value / EFFICACY } else { value }) as f32
        })
    })
}

/// Mean radiance of the sun at an elevation in [0, π/2]: its irradiance over its solid angle.
///
/// The irradiances are tabulated at 2°, 5° … 89°; linear in between, and constant outside. Deep red
/// is outside of Rec. 709; negative channels are set to 0.
pub(crate) fn sun(elevation: f64, turbidity: f64) -> [f64; 3] {
    let position = ((elevation.to_degrees() - 2.0) / 3.0).clamp(0.0, (ELEVATIONS - 1) as f64);
    let row = (position as usize).min(ELEVATIONS - 2);
    let t = position - row as f64;
    let solid_angle = TAU * (1.0 - libm::cos(SUN_RADIUS));
    std::array::from_fn(|channel| {
        let entry = |row: usize| {
            at_turbidity(LEVELS * SKY, IRRADIANCE, turbidity, row * CHANNELS + channel)
        };
        let irradiance = entry(row) * (1.0 - t) + entry(row + 1) * t;
        (irradiance / solid_angle * (SUN_TO_RGB / EFFICACY)).max(0.0)
    })
}

/// Returns the polynomials of the radiance of the sun with limb darkening: [`COEFFICIENTS`] for
/// each of the [`PARTS`].
pub(crate) fn limb(turbidity: f64) -> Vec<f32> {
    let table = LEVELS * (SKY + IRRADIANCE);
    let entry = |i| at_turbidity(table, LIMB, turbidity, i) * (SUN_TO_RGB / EFFICACY);
    (0..LIMB).map(|i| entry(i) as f32).collect()
}
