//! Daylight averaged over time: maps of the mean sky and of the trace of the sun.

use std::f32::consts::{PI, TAU};

use pt_math::{DVec3, Frame, Spectrum, Vec3, trig};
use pt_scene::image::Image;
use pt_scene::{Daylight, TimeRange};

use super::environment::{to_direction, to_image};
use super::hosek_sky::HosekWilkieModel;
use super::sun::Sun;
use super::{EscapedRay, Light, LightTables};

/// Columns and rows of the map of the sky, which is smooth.
const SKY: [u32; 2] = [128, 192];
/// Number of times at which the sky is evaluated.
const SKIES: u32 = 256;
/// Columns and rows of the map of the sun, with texels of a third of its diameter.
const SUN: [u32; 2] = [2048, 1024];
/// Number of times at which the sun is evaluated: on a single day, less than a texel of the map
/// apart.
const SUNS: u32 = 1 << 15;
/// Number of points that represent the sun's disk.
const POINTS: u32 = 12;
/// The golden ratio minus 1.
const GOLDEN: f32 = 0.618_034;

/// Returns the mean radiance of the sky over a time range. At times at which the sun is below the
/// horizon, the sky is black.
pub(crate) fn sky(light: &Daylight, span: &TimeRange) -> Image {
    let models: Vec<_> = (0..SKIES)
        .filter_map(|i| {
            let to_sun = span.to_sun((f64::from(i) + 0.5) / f64::from(SKIES));
            let is_up = to_sun.y >= 0.0;
            is_up.then(|| {
                HosekWilkieModel::without_density(
                    to_sun.as_vec3(),
                    light.turbidity,
                    light.albedo,
                    light.sky,
                )
            })
        })
        .collect();
    let [width, height] = SKY;
    let texel = |i: u32| {
        let place = |i: u32, count: u32| (i as f32 + 0.5) / count as f32;
        let (d, _) = to_direction([place(i % width, width), place(i / width, height)]);
        let sum = models.iter().fold(Spectrum::ZERO, |sum, model| sum + model.radiance(d));
        (sum * (1.0 / SKIES as f32)).to_array()
    };
    Image { width, height, pixels: (0..width * height).map(texel).collect() }
}

/// Returns the mean radiance of the sun over a time range. `sun_at` returns the sun in a unit
/// direction.
pub(crate) fn sun(span: &TimeRange, tables: &LightTables, sun_at: impl Fn(DVec3) -> Sun) -> Image {
    let [width, height] = SUN;
    let mut pixels = vec![[0.0; 3]; (width * height) as usize];
    let mut add = |d: Vec3, irradiance: Spectrum| {
        let [x, y] = to_image(d);
        let [column, row] =
            [(x, width), (y, height)].map(|(x, count)| ((x * count as f32) as u32).min(count - 1));
        // The solid angle is the width times the height along the axis.
        let heights = [row, row + 1].map(|row| trig::sin_cos(PI * row as f32 / height as f32).1);
        let solid_angle = TAU / width as f32 * (heights[0] - heights[1]);
        let pixel = &mut pixels[(row * width + column) as usize];
        *pixel = (Spectrum::from(*pixel) + irradiance * (1.0 / solid_angle)).to_array();
    };
    for i in 0..SUNS {
        let sun = sun_at(span.to_sun((f64::from(i) + 0.5) / f64::from(SUNS)));
        let frame = Frame::from_normal(sun.disk.to_light);
        let share = TAU * sun.disk.one_minus_cos / (POINTS * SUNS) as f32;
        for j in 0..POINTS {
            // Uniform in 1 − cos, with azimuths by the golden ratio: even enough over the disk for
            // limb darkening.
            let one_minus_cos = sun.disk.one_minus_cos * (j as f32 + 0.5) / POINTS as f32;
            let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
            let (sin_phi, cos_phi) = trig::sin_cos_tau((j as f32 * GOLDEN).fract());
            let local = Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - one_minus_cos);
            let d = frame.to_world(local);
            let radiance = sun.le_infinite(tables, EscapedRay::new(Vec3::ZERO, d));
            if !radiance.is_black() {
                add(d, radiance * share);
            }
        }
    }
    Image { width, height, pixels: pixels.into() }
}

#[cfg(test)]
mod tests {
    use pt_scene::{DateTime, GeoLocation};

    use super::*;

    fn span(hours: [f64; 2]) -> TimeRange {
        TimeRange {
            place: GeoLocation { latitude: 35.0, longitude: 139.0 },
            timezone: 9.0,
            first: [2025, 6, 1],
            days: 3,
            hours,
            part: [0.0, 1.0],
        }
    }

    /// Returns the irradiance of a map of the sky on the ground, ∫ L cos θ dω, by the midpoint rule
    /// over its texels.
    fn irradiance(image: &Image) -> f64 {
        let Image { width, height, pixels } = image;
        let texel = |i: u32| {
            let place = |i: u32, count: u32| (i as f32 + 0.5) / count as f32;
            let (d, sin) = to_direction([place(i % width, *width), place(i / width, *height)]);
            let weight = f64::from(d.y.max(0.0)) * f64::from(sin);
            weight * f64::from(Spectrum::from(pixels[i as usize]).luminance())
        };
        let sum = (0..width * height).map(texel).sum::<f64>();
        sum * std::f64::consts::TAU * std::f64::consts::PI / f64::from(width * height)
    }

    /// The irradiance is the mean over many suns of E = π L sin² θ cos.
    #[test]
    fn the_trace_of_the_sun_has_its_light() {
        let span = span([8.0, 16.0]);
        let disk = |to_sun: DVec3| {
            let radiance = Spectrum::splat(1.0 + to_sun.x as f32);
            let disk = super::super::DistantDisk::of_radiance(
                to_sun.as_vec3().normalize(),
                0.01,
                radiance,
            );
            Sun { disk, up: Vec3::Y, limb: None }
        };
        let got = irradiance(&sun(&span, &LightTables::default(), disk));
        let sin = libm::sin(0.01);
        let of = |i: u32| {
            let d = span.to_sun((f64::from(i) + 0.5) / 5000.0);
            std::f64::consts::PI * sin * sin * (1.0 + d.x) * d.y
        };
        let want = (0..5000).map(of).sum::<f64>() / 5000.0;
        assert!((got / want - 1.0).abs() < 1e-3, "{got} {want}");
    }

    /// The same with limb darkening, to the precision to which each sun is represented by its
    /// points.
    #[test]
    fn rims_are_as_dark_as_they_are() {
        const TIMES: u32 = 200;
        let span = span([5.0, 9.0]);
        let tables = LightTables {
            limbs: vec![super::super::LimbDarkening::new(4.0)],
            ..LightTables::default()
        };
        let disk = |to_sun: DVec3| {
            let to_light = to_sun.as_vec3().normalize();
            let disk = super::super::DistantDisk::of_radiance(to_light, 0.0047, Spectrum::ONE);
            Sun { disk, up: Vec3::Y, limb: Some(0) }
        };
        let got = irradiance(&sun(&span, &tables, disk));
        let mut want = 0.0;
        for i in 0..TIMES {
            let sun = disk(span.to_sun((f64::from(i) + 0.5) / f64::from(TIMES)));
            let frame = Frame::from_normal(sun.disk.to_light);
            for j in 0..64 * 64 {
                let u = [j % 64, j / 64].map(|k| (k as f32 + 0.5) / 64.0);
                let d = frame.to_world(pt_math::warp::uniform_cone(u, sun.disk.one_minus_cos));
                let radiance =
                    f64::from(sun.le_infinite(&tables, EscapedRay::new(Vec3::ZERO, d)).luminance());
                let share = std::f64::consts::TAU * f64::from(sun.disk.one_minus_cos);
                want += radiance * f64::from(d.y.max(0.0)) * share / f64::from(TIMES * 64 * 64);
            }
        }
        assert!((got / want - 1.0).abs() < 4e-3, "{got} {want}");
    }

    /// The sun is below the horizon for half of the time, when the sky is black: the mean is half
    /// of that of the other half.
    #[test]
    fn nights_are_dark() {
        let light = Daylight::default();
        let [day, with_night] = [[7.0, 17.0], [7.0, 27.0]].map(|hours| {
            // Hours beyond 24 are those of the next morning, before sunrise.
            irradiance(&sky(&light, &span(hours)))
        });
        assert!(day > 0.0 && (with_night / (0.5 * day) - 1.0).abs() < 0.1, "{day} {with_night}");
        let moment = DateTime { year: 2025, month: 6, day: 1, hours: 3.0 };
        let [zenith, _] = span([0.0, 1.0]).place.sun(&moment);
        let still = TimeRange { part: [0.5; 2], days: 1, ..span([12.0, 12.0]) };
        assert!((libm::cos(zenith) - still.to_sun(0.0).y).abs() < 1e-12);
        // With a single time, the mean is the sky of the model.
        let image = sky(&light, &still);
        let model =
            HosekWilkieModel::without_density(still.to_sun(0.0).as_vec3(), 3.0, [0.3; 3], 1.0);
        for (column, row) in [(3, 10), (60, 60), (127, 94)] {
            let place = [(column as f32 + 0.5) / 128.0, (row as f32 + 0.5) / 192.0];
            let want = model.radiance(to_direction(place).0).luminance();
            let got = Spectrum::from(image.pixels[(row * 128 + column) as usize]).luminance();
            assert!((got / want - 1.0).abs() < 1e-4, "{got} {want}");
        }
    }
}
