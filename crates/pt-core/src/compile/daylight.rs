//! The sun and a clear sky. [Preetham, Shirley & Smits 1999, "A Practical Analytic Model for
//! Daylight"]
//!
//! Angles in radians, wavelengths in nanometres, luminances in kcd/m².

use std::f64::consts::PI;

use pt_math::DVec3;
use pt_scene::image::Image;

/// Half of the angle under which the sun is seen, in radians: 0.533° / 2.
pub(super) const SUN_RADIUS: f64 = 0.004_651;

/// Turbidities for which the model was fitted.
pub(super) const TURBIDITIES: std::ops::RangeInclusive<f64> = 2.0..=10.0;

/// The sky around a node whose +y is up.
pub(super) struct Sky {
    to_sun: DVec3,
    /// Angle of the sun to the zenith.
    theta: f64,
    turbidity: f64,
    /// Of x, y and Y: the five parameters of Perez' formula, and the value at the zenith over that
    /// of the formula.
    channels: [([f64; 5], f64); 3],
}

/// Parameters A to E of x, y and Y: slope and intercept by turbidity. [ibid., appendix A.2]
const PEREZ: [[[f64; 2]; 5]; 3] = [
    [
        [-0.0193, -0.2592],
        [-0.0665, 0.0008],
        [-0.0004, 0.2125],
        [-0.0641, -0.8989],
        [-0.0033, 0.0452],
    ],
    [
        [-0.0167, -0.2608],
        [-0.0950, 0.0092],
        [-0.0079, 0.2102],
        [-0.0441, -1.6537],
        [-0.0109, 0.0529],
    ],
    [[0.1787, -1.4630], [-0.3554, 0.4275], [-0.0227, 5.3251], [0.1206, -2.5771], [-0.0670, 0.3703]],
];

/// Chromaticities x and y at the zenith: by T², T and 1, each by θ³, θ², θ and 1. [ibid.]
const ZENITH: [[[f64; 4]; 3]; 2] = [
    [
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ],
    [
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ],
];

impl Sky {
    /// With the sun in a unit direction that is not below the horizon.
    pub(super) fn new(to_sun: DVec3, turbidity: f64) -> Self {
        let theta = libm::acos(to_sun.y.clamp(0.0, 1.0));
        let powers = [theta * theta * theta, theta * theta, theta, 1.0];
        let by_theta = |row: [f64; 4]| row.iter().zip(powers).map(|(a, p)| a * p).sum::<f64>();
        let chromaticity = |[a, b, c]: [[f64; 4]; 3]| {
            (by_theta(a) * turbidity + by_theta(b)) * turbidity + by_theta(c)
        };
        let [x, y] = ZENITH.map(chromaticity);
        let at_zenith = [x, y, zenith_luminance(theta, turbidity)];
        let channel = |i: usize| {
            let parameters = PEREZ[i].map(|[slope, intercept]| slope * turbidity + intercept);
            (parameters, at_zenith[i] / perez(parameters, 1.0, theta))
        };
        Self { to_sun, theta, turbidity, channels: [0, 1, 2].map(channel) }
    }

    /// Chromaticities x and y, and luminance Y, in a unit direction above the horizon.
    fn chromaticity_and_luminance(&self, d: DVec3) -> [f64; 3] {
        let gamma = libm::acos(d.dot(self.to_sun).clamp(-1.0, 1.0));
        self.channels.map(|(parameters, scale)| scale * perez(parameters, d.y, gamma))
    }

    /// Linear Rec. 709 in a unit direction; black below the horizon.
    pub(super) fn radiance(&self, d: DVec3) -> [f64; 3] {
        if d.y <= 0.0 {
            return [0.0; 3];
        }
        let [x, y, luminance] = self.chromaticity_and_luminance(d);
        rgb([x / y * luminance, luminance, (1.0 - x - y) / y * luminance])
    }

    /// The sky as an image of the convention of [`pt_scene::LightKind::Environment`].
    pub(super) fn image(&self, scale: f64) -> Image {
        const HEIGHT: u32 = 128;
        let step = PI / f64::from(HEIGHT);
        let pixel = |i: u32| {
            let (column, row) = (i % (2 * HEIGHT), i / (2 * HEIGHT));
            let (sin, cos) = libm::sincos((f64::from(row) + 0.5) * step);
            let (sin_phi, cos_phi) = libm::sincos((f64::from(column) + 0.5) * step);
            let d = DVec3::new(-sin * cos_phi, cos, sin * sin_phi);
            self.radiance(d).map(|c| (c * scale) as f32)
        };
        let pixels = (0..2 * HEIGHT * HEIGHT).map(pixel).collect();
        Image { width: 2 * HEIGHT, height: HEIGHT, pixels }
    }

    /// Radiance of the sun, linear Rec. 709.
    pub(super) fn sun(&self) -> [f64; 3] {
        rgb(SUN.iter().enumerate().fold([0.0; 3], |sum, (i, &l)| {
            let wavelength = FIRST + STEP * i as f64;
            let l = l * transmittance(wavelength, self.theta, self.turbidity);
            let matching = color_matching(wavelength);
            // Lumens per watt, and kcd.
            [0, 1, 2].map(|c| sum[c] + 0.683 * l * STEP * matching[c])
        }))
    }
}

/// [ibid., appendix A.2]
fn zenith_luminance(theta: f64, turbidity: f64) -> f64 {
    let chi = (4.0 / 9.0 - turbidity / 120.0) * (PI - 2.0 * theta);
    (4.0453 * turbidity - 4.9710) * libm::tan(chi) - 0.2155 * turbidity + 2.4192
}

/// F = (1 + A exp(B / cos θ)) (1 + C exp(D γ) + E cos² γ) at the angles θ to the zenith and γ to the
/// sun. [Perez, Seals & Michalsky 1993]
fn perez([a, b, c, d, e]: [f64; 5], cos: f64, gamma: f64) -> f64 {
    let cos_gamma = libm::cos(gamma);
    (1.0 + a * libm::exp(b / cos)) * (1.0 + c * libm::exp(d * gamma) + e * cos_gamma * cos_gamma)
}

/// Wavelength of the first entry of the tables below, and from one to the next.
const FIRST: f64 = 380.0;
const STEP: f64 = 10.0;

/// Radiance of the sun above the air, in W m⁻² nm⁻¹ sr⁻¹. [ibid., table 2]
const SUN: [f64; 38] = [
    16559.0, 16233.7, 21127.5, 25888.2, 25829.1, 24232.3, 26760.5, 29658.3, 30545.4, 30057.5,
    30663.7, 28830.4, 28712.1, 27825.0, 27100.6, 27233.6, 26361.3, 25503.8, 25060.2, 25311.6,
    25355.9, 25134.2, 24631.5, 24173.2, 23685.3, 23212.1, 22827.7, 22339.8, 21970.2, 21526.7,
    21097.9, 20728.3, 20240.4, 19870.8, 19427.2, 19072.4, 18628.9, 18259.2,
];

/// Absorption by ozone, in cm⁻¹. [ibid.] Between 380 and 440 nm it is interpolated from 355 to 445.
const OZONE: [f64; 38] = [
    0.000_8, 0.001_2, 0.001_5, 0.001_8, 0.002_2, 0.002_5, 0.002_8, 0.003, 0.006, 0.009, 0.014,
    0.021, 0.03, 0.04, 0.048, 0.063, 0.075, 0.085, 0.103, 0.12, 0.12, 0.115, 0.125, 0.12, 0.105,
    0.09, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023, 0.018, 0.014, 0.011, 0.010, 0.009,
];

/// Absorption by water vapour from 690 nm on, in cm⁻¹; none before. [ibid.]
const WATER: [f64; 7] = [0.016, 0.024, 0.0125, 1.0, 0.87, 0.061, 0.001];

/// Share of the light of the sun that comes through the air: by Rayleigh scattering, aerosols, ozone
/// and water vapour. Mixed gases absorb nothing in this range. [ibid., appendix A.1]
fn transmittance(wavelength: f64, theta: f64, turbidity: f64) -> f64 {
    const OZONE_CM: f64 = 0.35;
    const WATER_CM: f64 = 2.0;
    let i = ((wavelength - FIRST) / STEP) as usize;
    let mass = 1.0 / (libm::cos(theta) + 0.15 * libm::pow(93.885 - theta.to_degrees(), -1.253));
    let microns = 1e-3 * wavelength;
    let rayleigh = 0.008_735 * libm::pow(microns, -4.08);
    let beta = 0.046_083_658 * turbidity - 0.045_860_259;
    let aerosol = beta * libm::pow(microns, -1.3);
    let ozone = OZONE.get(i).map_or(0.0, |k| k * OZONE_CM);
    let k = i.checked_sub(31).and_then(|i| WATER.get(i)).copied().unwrap_or(0.0) * WATER_CM;
    let water = 0.2385 * k / libm::pow(1.0 + 20.07 * k * mass, 0.45);
    libm::exp(-mass * (rayleigh + aerosol + ozone + water))
}

/// The CIE 1931 colour matching functions. [Wyman, Sloan & Shirley 2013, "Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions", §2.2]
fn color_matching(wavelength: f64) -> [f64; 3] {
    let lobe = |height: f64, middle: f64, below: f64, above: f64| {
        let x = (wavelength - middle) / if wavelength < middle { below } else { above };
        height * libm::exp(-0.5 * x * x)
    };
    [
        lobe(1.056, 599.8, 37.9, 31.0)
            + lobe(0.362, 442.0, 16.0, 26.7)
            + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    ]
}

/// XYZ to linear Rec. 709; colours outside of it come to its rim. [ITU-R BT.709, primaries and white
/// point]
fn rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_970 * x - 1.537_383 * y - 0.498_611 * z,
        -0.969_244 * x + 1.875_968 * y + 0.041_555 * z,
        0.055_630 * x - 0.203_977 * y + 1.056_972 * z,
    ]
    .map(|c| c.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(degrees: f64, turbidity: f64) -> Sky {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Sky::new(DVec3::new(sin, cos, 0.0), turbidity)
    }

    fn luminance([r, g, b]: [f64; 3]) -> f64 {
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    /// By the formula for the zenith, by hand: T = 2 and the sun at the zenith make
    /// χ = (4/9 − 1/60) π, 3.1196 tan χ + 1.9882.
    #[test]
    fn the_zenith_has_its_luminance() {
        for (degrees, turbidity, want) in
            [(0.0, 2.0, 15.501), (60.0, 3.0, 5.1402), (90.0, 4.0, 1.5572)]
        {
            let [_, _, y] = sky(degrees, turbidity).chromaticity_and_luminance(DVec3::Y);
            assert!((y / want - 1.0).abs() < 1e-3, "{degrees} {turbidity}: {y}");
        }
    }

    #[test]
    fn the_sky_is_bright_everywhere_above_the_horizon_and_brightest_near_the_sun() {
        for turbidity in [2.0, 3.0, 6.0, 10.0] {
            for degrees in [0.0, 30.0, 60.0, 85.0, 90.0] {
                let sky = sky(degrees, turbidity);
                let image = sky.image(1.0);
                let (w, above) = (image.width as usize, image.height as usize / 2);
                for (i, pixel) in image.pixels.iter().enumerate() {
                    let lit =
                        pixel.iter().all(|c| c.is_finite()) && pixel.iter().sum::<f32>() > 0.0;
                    assert_eq!(lit, i / w < above, "{degrees} {turbidity} {i}: {pixel:?}");
                }
                let other = DVec3::new(-sky.to_sun.x, sky.to_sun.y.max(0.02), 0.0).normalize();
                let near = DVec3::new(sky.to_sun.x, sky.to_sun.y.max(0.02), 0.0).normalize();
                let [near, other] = [near, other].map(|d| luminance(sky.radiance(d)));
                assert!(near >= other, "{degrees} {turbidity}: {near} {other}");
            }
        }
    }

    /// Above the air the sun has about 1.9·10⁶ kcd/m², 128 klx of illuminance; through clear air and
    /// from the zenith about 100 klx, and less and redder towards the horizon.
    #[test]
    fn the_sun_has_its_illuminance() {
        let klx = |rgb: [f64; 3]| luminance(rgb) * PI * SUN_RADIUS.sin().powi(2);
        let above: f64 = SUN
            .iter()
            .enumerate()
            .map(|(i, l)| 0.683 * l * STEP * color_matching(FIRST + STEP * i as f64)[1])
            .sum();
        let above = above * PI * SUN_RADIUS.sin().powi(2);
        assert!((120.0..135.0).contains(&above), "{above}");
        let zenith = klx(sky(0.0, 2.5).sun());
        assert!((85.0..115.0).contains(&zenith), "{zenith}");
        let all = [0.0, 40.0, 70.0, 85.0].map(|degrees| sky(degrees, 2.5).sun());
        for pair in all.windows(2) {
            assert!(luminance(pair[1]) < luminance(pair[0]));
            assert!(pair[1][2] / pair[1][0] < pair[0][2] / pair[0][0]);
        }
    }
}
