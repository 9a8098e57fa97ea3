//! Tone mapping of scene radiance to display radiance, whose maximum is 1.
//!
//! The curves are computed in double precision: values do not overflow, and the final clamp gives
//! [0, 1].

/// Exposure and tone curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Exposure in stops: radiance is multiplied by 2 to this power.
    pub exposure: f32,
    /// Tone curve after the exposure.
    pub curve: ToneCurve,
}

impl Tone {
    /// Maps linear scene radiance to linear display radiance, both in Rec. 709. At 0 stops,
    /// [`ToneCurve::Linear`] changes no bit.
    pub fn map(self, rgb: [f32; 3]) -> [f32; 3] {
        let scale = libm::exp2f(self.exposure);
        self.curve.map(rgb.map(|v| v * scale))
    }
}

/// Tone curves from unbounded scene radiance to display radiance. Black stays black, and the curves
/// are monotonic for greys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Identity; files clamp it at 1.
    #[default]
    Linear,
    /// Filmic curve in each channel, with white at 5.6. [Hable 2010]
    Filmic,
    /// AgX without a look: bright colours desaturate to white. [Sobotka, "AgX"]
    Agx,
    /// ACES as fitted by Stephen Hill: high contrast; grey of 0.18 becomes 0.106.
    Aces,
    /// Khronos PBR Neutral: colours up to 0.8 are reduced by 0.04 and otherwise unchanged, and all
    /// colours keep their hue.
    PbrNeutral,
}

impl ToneCurve {
    /// Maps linear Rec. 709 to linear Rec. 709. All curves except the linear one return values in
    /// [0, 1]; negative values and NaN count as 0.
    pub fn map(self, rgb: [f32; 3]) -> [f32; 3] {
        let curve = match self {
            Self::Linear => return rgb,
            Self::Filmic => filmic,
            Self::Agx => agx,
            Self::Aces => aces,
            Self::PbrNeutral => pbr_neutral,
        };
        let light = rgb.map(|v| if v > 0.0 { f64::from(v.min(f32::MAX)) } else { 0.0 });
        curve(light).map(|v| v.clamp(0.0, 1.0) as f32)
    }
}

type Rgb = [f64; 3];

fn multiply(matrix: &[Rgb; 3], v: Rgb) -> Rgb {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// f(2 L) / f(W) of each channel, f(x) = (x (A x + C B) + D E) / (x (A x + B) + D F) − E / F, with
/// shoulder A, linear strength B and angle C, toe strength D, numerator E and denominator F, and
/// white W. The hue of bright colours changes, since the channels saturate one by one. [Hable 2010,
/// "Uncharted 2: HDR Lighting", GDC; "Filmic Tonemapping Operators" for the 2, its exposure bias]
fn filmic(rgb: Rgb) -> Rgb {
    const A: f64 = 0.15;
    const B: f64 = 0.50;
    const C: f64 = 0.10;
    const D: f64 = 0.20;
    const E: f64 = 0.02;
    const F: f64 = 0.30;
    const WHITE: f64 = 11.2;
    const BIAS: f64 = 2.0;
    // The terms over a common denominator, so that f(0) is exactly 0.
    let f = |x: f64| x * (A * x * (F - E) + B * (C * F - E)) / (F * (x * (A * x + B) + D * F));
    rgb.map(|l| f(BIAS * l) / f(WHITE))
}

/// From Rec. 709 to inset primaries.
const AGX_INSET: [Rgb; 3] = [
    [0.842_479_062_253_094, 0.078_433_599_999_999_2, 0.079_223_745_147_764_3],
    [0.042_328_242_261_012_3, 0.878_468_636_469_772, 0.079_166_127_460_543_4],
    [0.042_375_654_905_705_1, 0.078_433_6, 0.879_142_973_793_104],
];

/// The inverse of [`AGX_INSET`].
const AGX_OUTSET: [Rgb; 3] = [
    [1.196_879_005_120_17, -0.098_020_881_140_136_8, -0.099_029_744_079_720_5],
    [-0.052_896_851_757_456_2, 1.151_903_129_904_17, -0.098_961_176_844_843_3],
    [-0.052_971_635_514_443_8, -0.098_043_450_117_124_1, 1.151_073_672_641_16],
];

/// A sigmoid of log₂ L in each channel of inset primaries, so that bright colours of any hue
/// desaturate to white. Its output is a display signal with exponent 2.2. [Sobotka, "AgX", base
/// image; primaries in Rec. 709 as in Wrensch, "Minimal AgX Implementation"]
fn agx(rgb: Rgb) -> Rgb {
    /// log₂ of the minimum luminance, 10 stops below a grey of 0.18.
    const MIN: f64 = -12.473_93;
    /// log₂ of the maximum luminance, 6.5 stops above that grey.
    const MAX: f64 = 4.026_069;
    const EXPONENT: f64 = 2.2;
    let signal = multiply(&AGX_INSET, rgb).map(|l| {
        let stops = libm::log2(l).clamp(MIN, MAX);
        agx_sigmoid((stops - MIN) / (MAX - MIN))
    });
    multiply(&AGX_OUTSET, signal).map(|v| libm::pow(v.max(0.0), EXPONENT))
}

/// The sigmoid on [0, 1] through (10/16.5, 1/2), grey, with the slope 2 there and the powers 3 at
/// its toe and 3.25 at its shoulder: y = ½ ± k h(2 |x − x₀| / k), h(t) = t / (1 + tᵖ)^(1/p), with k
/// such that the ends are 0 and 1. [Sobotka, "AgX"; the sigmoid is Jed Smith's]
fn agx_sigmoid(x: f64) -> f64 {
    const PIVOT: [f64; 2] = [10.0 / 16.5, 0.5];
    const SLOPE: f64 = 2.0;
    const TOE: f64 = 3.0;
    const SHOULDER: f64 = 3.25;
    // Distances from the pivot to the end on the side of x.
    let (width, height, p, side) = if x < PIVOT[0] {
        (PIVOT[0], PIVOT[1], TOE, -1.0)
    } else {
        (1.0 - PIVOT[0], 1.0 - PIVOT[1], SHOULDER, 1.0)
    };
    let rise = SLOPE * width;
    let k = rise / libm::pow(libm::pow(rise / height, p) - 1.0, 1.0 / p);
    let t = SLOPE * (x - PIVOT[0]).abs() / k;
    PIVOT[1] + side * k * t / libm::pow(1.0 + libm::pow(t, p), 1.0 / p)
}

/// The reference rendering and output transforms of ACES for sRGB displays, fitted by a rational
/// function between two matrices, which desaturate bright colours to white. Grey of 0.18 becomes
/// 0.106; this is not compensated here. [Stephen Hill, "ACES.hlsl" in Pettineo's BakingLab]
fn aces(rgb: Rgb) -> Rgb {
    /// From Rec. 709 via AP1 to the less saturated channels of the curve.
    const INTO: [Rgb; 3] = [
        [0.597_19, 0.354_58, 0.048_23],
        [0.076_00, 0.908_34, 0.015_66],
        [0.028_40, 0.133_83, 0.837_77],
    ];
    /// From these channels back to Rec. 709.
    const BACK: [Rgb; 3] = [
        [1.604_75, -0.531_08, -0.073_67],
        [-0.102_08, 1.108_13, -0.006_05],
        [-0.003_27, -0.072_76, 1.076_02],
    ];
    let fit = |v: f64| {
        (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951_0) + 0.238_081)
    };
    multiply(&BACK, multiply(&INTO, rgb).map(fit))
}

/// Colours below 0.8 are reduced by 0.04, the reflectance of dielectrics at normal incidence, and
/// otherwise unchanged; brighter ones are compressed at constant hue and gradually desaturate to
/// white. [Khronos, "PBR Neutral Tone Mapper Specification"]
fn pbr_neutral(rgb: Rgb) -> Rgb {
    /// Fresnel reflectance of common dielectrics at normal incidence.
    const F90: f64 = 0.04;
    /// Start of compression.
    const START: f64 = 0.8 - F90;
    /// Rate of desaturation.
    const DESATURATION: f64 = 0.15;
    let least = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if least < 2.0 * F90 { least - least * least / (4.0 * F90) } else { F90 };
    let rgb = rgb.map(|v| v - offset);
    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    if peak < START {
        return rgb;
    }
    let room = 1.0 - START;
    let compressed = 1.0 - room * room / (peak + room - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    rgb.map(|v| {
        let v = v * compressed / peak;
        v + (compressed - v) * white
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [ToneCurve; 4] =
        [ToneCurve::Filmic, ToneCurve::Agx, ToneCurve::Aces, ToneCurve::PbrNeutral];

    /// The row sums of the published matrices of AgX are not exactly 1: those of [`AGX_OUTSET`] are
    /// from 0.99983 to 1.00006, which the exponent 2.2 amplifies to at most 5.1·10⁻⁴ (those of
    /// [`AGX_INSET`] deviate in the opposite direction).
    const AGX_GREY_ERROR: f32 = 5.1e-4;

    /// 0, and greys from 10⁻⁶ to 10³⁰.
    fn greys() -> impl Iterator<Item = f32> {
        std::iter::once(0.0).chain((0..=3600).map(|i| libm::powf(10.0, i as f32 / 100.0 - 6.0)))
    }

    fn near(a: f32, b: f32, error: f32) -> bool {
        (a - b).abs() <= error
    }

    #[test]
    fn the_default_changes_no_bit() {
        for v in [0.0, -0.0, 0.3, -2.0, 1e30, f32::INFINITY, f32::NAN, f32::from_bits(1)] {
            assert_eq!(Tone::default().map([v; 3]).map(f32::to_bits), [v.to_bits(); 3]);
        }
    }

    #[test]
    fn a_stop_doubles_light() {
        for (exposure, factor) in [(1.0, 2.0), (-3.0, 0.125), (10.0, 1024.0)] {
            let tone = Tone { exposure, curve: ToneCurve::Linear };
            assert_eq!(tone.map([0.3, 0.0, 7.0]), [0.3 * factor, 0.0, 7.0 * factor]);
        }
        for curve in CURVES {
            let brighter = Tone { exposure: 2.0, curve }.map([0.1, 0.2, 0.05]);
            assert_eq!(brighter, curve.map([0.4, 0.8, 0.2]), "{curve:?}");
        }
    }

    #[test]
    fn black_stays_black_and_what_is_no_light_too() {
        for curve in CURVES {
            for v in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
                assert_eq!(curve.map([v; 3]), [0.0; 3], "{curve:?} of {v}");
            }
        }
    }

    #[test]
    fn grey_stays_grey_rises_and_ends_at_white() {
        for curve in CURVES {
            let mut before = 0.0;
            for v in greys() {
                let [r, g, b] = curve.map([v; 3]);
                assert!((0.0..=1.0).contains(&g), "{curve:?} of {v}: {g}");
                let error = if curve == ToneCurve::Agx { AGX_GREY_ERROR } else { 3e-5 };
                assert!(near(r, g, error) && near(b, g, error), "{curve:?} of {v}: {r} {g} {b}");
                assert!(g >= before, "{curve:?} falls at {v}");
                before = g;
            }
            for v in [1e30, f32::MAX, f32::INFINITY] {
                let white = curve.map([v; 3]);
                assert!(
                    white.iter().all(|v| near(*v, 1.0, AGX_GREY_ERROR)),
                    "{curve:?}: {white:?}"
                );
            }
        }
    }

    #[test]
    fn every_colour_becomes_one_of_the_screen() {
        for curve in CURVES {
            for v in greys() {
                for rgb in [[v, 0.0, 0.0], [0.0, v, 1.0], [0.5, 0.0, v], [v, f32::MAX, f32::NAN]] {
                    let mapped = curve.map(rgb);
                    assert!(mapped.iter().all(|v| (0.0..=1.0).contains(v)), "{curve:?} {rgb:?}");
                }
            }
        }
    }

    /// Values of the published formula.
    #[test]
    fn filmic_is_the_curve_of_hable() {
        let f = |x: f32| {
            let (a, b, c, d, e, f) = (0.15, 0.50, 0.10, 0.20, 0.02, 0.30);
            ((x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f)) - e / f
        };
        for l in [0.01, 0.18, 0.5, 1.0, 3.0] {
            let wanted = f(2.0 * l) / f(11.2);
            let [mapped, ..] = ToneCurve::Filmic.map([l; 3]);
            assert!(near(mapped, wanted, 1e-6), "{mapped} is not {wanted}");
        }
        assert!(near(ToneCurve::Filmic.map([5.6; 3])[0], 1.0, 1e-6), "half of 11.2 is white");
        let [r, g, b] = ToneCurve::Filmic.map([4.0, 0.5, 0.0]);
        assert_eq!(
            [r, g, b].map(f32::to_bits),
            [4.0, 0.5, 0.0].map(|v| ToneCurve::Filmic.map([v; 3])[0].to_bits())
        );
    }

    /// The polynomial of degree 6 that Wrensch publishes as a fit of the same sigmoid, with a mean
    /// squared error of 3.7·10⁻⁶.
    #[test]
    fn the_sigmoid_of_agx_is_near_its_published_fit() {
        let fit = |x: f64| {
            let powers = [-0.002_32, 0.119_1, 0.429_8, -6.868, 31.96, -40.14, 15.5];
            powers.iter().rev().fold(0.0, |sum, c| sum * x + c)
        };
        for i in 0..=1000 {
            let x = f64::from(i) / 1000.0;
            assert!((agx_sigmoid(x) - fit(x)).abs() < 0.006, "{x}: {} {}", agx_sigmoid(x), fit(x));
        }
        assert!(agx_sigmoid(0.0).abs() < 1e-15 && (agx_sigmoid(1.0) - 1.0).abs() < 1e-15);
    }

    /// Grey of 0.18 has the signal ½; 10 stops below it is black, and 6.5 stops above it white.
    #[test]
    fn agx_has_grey_in_the_middle_of_the_signal() {
        let grey = ToneCurve::Agx.map([0.18; 3])[1];
        assert!(near(grey, libm::powf(0.5, 2.2), AGX_GREY_ERROR), "{grey}");
        assert!(ToneCurve::Agx.map([0.18 / 1024.0; 3])[1] < 1e-6);
        assert!(ToneCurve::Agx.map([0.18 * libm::exp2f(6.5); 3])[1] > 0.9999);
    }

    #[test]
    fn the_matrices_of_agx_are_inverses() {
        for (i, unit) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate()
        {
            let back = multiply(&AGX_OUTSET, multiply(&AGX_INSET, unit));
            let is_same = (0..3).all(|c| (back[c] - unit[c]).abs() < 1e-12);
            assert!(is_same, "column {i}: {back:?}");
        }
    }

    /// (1·1.0245786 − 0.000090537) / (1·1.41668 + 0.238081) = 0.61911: the fit at 1, by hand.
    #[test]
    fn aces_maps_one_to_the_value_of_its_fit() {
        let white = ToneCurve::Aces.map([1.0; 3]);
        assert!(white.iter().all(|v| near(*v, 0.619_11, 5e-5)), "{white:?}");
    }

    #[test]
    fn bright_colours_go_to_white_with_aces_agx_and_pbr_neutral() {
        for curve in [ToneCurve::Agx, ToneCurve::Aces, ToneCurve::PbrNeutral] {
            for rgb in [[1.0, 0.1, 0.1], [0.1, 1.0, 0.2], [0.1, 0.1, 1.0]] {
                let bright = curve.map(rgb.map(|v: f32| v * 4000.0));
                let least = bright.iter().copied().fold(1.0, f32::min);
                assert!(least > 0.95, "{curve:?} of {rgb:?}: {bright:?}");
            }
        }
    }

    /// From 0.08 to 0.8, values are reduced by 0.04; beyond, the hue is constant: (median −
    /// minimum) / (maximum − minimum).
    #[test]
    fn pbr_neutral_keeps_base_colours_and_every_hue() {
        let [r, g, b] = ToneCurve::PbrNeutral.map([0.79, 0.3, 0.08]);
        assert!(near(r, 0.75, 1e-6) && near(g, 0.26, 1e-6) && near(b, 0.04, 1e-6), "{r} {g} {b}");
        let (below, above) = (0.799_999, 0.800_001);
        let [below, above] = [below, above].map(|v| ToneCurve::PbrNeutral.map([v; 3])[0]);
        assert!(near(below, above, 4e-6), "{below} {above}");
        for scale in [0.01, 0.1, 1.0, 10.0, 1000.0] {
            let [r, g, b] = ToneCurve::PbrNeutral.map([0.2 * scale, 0.9 * scale, 0.5 * scale]);
            assert!(near((b - r) / (g - r), 3.0 / 7.0, 1e-4), "{scale}: {r} {g} {b}");
        }
    }
}
