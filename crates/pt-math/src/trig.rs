//! Transcendental functions in `f32` that give the same bits on every machine.
//!
//! Sine, cosine, arc tangent, exponential and logarithm are custom polynomials, fitted by the Remez
//! exchange (minimax, in the relative error unless a comment says otherwise), because they are
//! performance-critical. The rarer functions are those of the `libm` crate, which is portable as
//! well.

use std::f64::consts::{LN_2, LOG2_E};

/// 1.5 · 2²³: adding it rounds an `f32` below 2²² to an integer, stored in the lowest bits of the
/// sum.
const ROUND_F32: f32 = 12_582_912.0;
/// 1.5 · 2⁵², the same constant for `f64`.
const ROUND_F64: f64 = 6_755_399_441_055_744.0;

/// (sin 2πr, cos 2πr) for |r| ≤ ⅛.
///
/// Minimax in t = r²: sin 2πr = r·S(t) with relative error below 4·10⁻⁹, and
/// cos 2πr = 1 + t·C(t) with absolute error below 6·10⁻¹¹, before rounding.
#[inline]
pub(crate) fn sin_cos_eighth(r: f32) -> (f32, f32) {
    const S: [f32; 4] = [std::f32::consts::TAU, -41.341_66, 81.592_354, -75.393_56];
    const C: [f32; 4] = [-19.739_21, 64.939_32, -85.443_74, 59.245_964];
    let t = r * r;
    let s = r * (((S[3] * t + S[2]) * t + S[1]) * t + S[0]);
    let c = 1.0 + t * (((C[3] * t + C[2]) * t + C[1]) * t + C[0]);
    (s, c)
}

/// Rotates (sin, cos) by `quarters` quarter turns; only the two lowest bits count.
#[inline]
fn turn((s, c): (f32, f32), quarters: u32) -> (f32, f32) {
    const SIGN: u32 = 1 << 31;
    let (s, c) = swap_where((quarters & 1).wrapping_neg(), s, c);
    // The sine is negative in the third and fourth quarter, the cosine in the second and third.
    let flip = |x: f32, bit: u32| f32::from_bits(x.to_bits() ^ (bit & SIGN));
    (flip(s, quarters << 30), flip(c, quarters.wrapping_add(1) << 30))
}

/// Returns (b, a) if all bits of `mask` are set, (a, b) if none is.
///
/// Masks come from arithmetic and not from comparisons, since compilers turn those into branches,
/// which are unpredictable for random numbers.
#[inline]
pub(crate) fn swap_where(mask: u32, a: f32, b: f32) -> (f32, f32) {
    let (a, b) = (a.to_bits(), b.to_bits());
    let difference = (a ^ b) & mask;
    (f32::from_bits(a ^ difference), f32::from_bits(b ^ difference))
}

/// (sin 2πu, cos 2πu) for u in [0, 1], with absolute errors below 1.2·10⁻⁷ (one unit in the last
/// place of 1).
#[inline]
pub fn sin_cos_tau(u: f32) -> (f32, f32) {
    let rounded = 4.0 * u + ROUND_F32;
    let r = u - 0.25 * (rounded - ROUND_F32);
    turn(sin_cos_eighth(r), rounded.to_bits())
}

/// √(x² + y²), rounded as f64 and then as f32: squares of f32 are exact in f64, and none overflows.
///
/// `f32::hypot` is a function of the C library, whose roundings differ between libraries.
#[inline]
pub fn hypot(x: f32, y: f32) -> f32 {
    let [x, y] = [x, y].map(f64::from);
    (x * x + y * y).sqrt() as f32
}

/// (sin x, cos x), with absolute errors below 1.2·10⁻⁷.
#[inline]
pub fn sin_cos(x: f32) -> (f32, f32) {
    // Up to this value the f64 product below has 2⁻²⁸ to spare.
    const LARGEST_REDUCED: f32 = 65_536.0;
    if x.abs() <= LARGEST_REDUCED {
        let turns = f64::from(x) * (0.5 * std::f64::consts::FRAC_1_PI);
        let rounded = 4.0 * turns + ROUND_F64;
        let r = turns - 0.25 * (rounded - ROUND_F64);
        turn(sin_cos_eighth(r as f32), rounded.to_bits() as u32)
    } else {
        libm::sincosf(x)
    }
}

/// eˣ, with a relative error below 6.2·10⁻⁸ (0.52 units in the last place); ∞ on overflow.
#[inline]
pub fn exp(x: f32) -> f32 {
    exp_f64(f64::from(x)) as f32
}

/// eˣ with a relative error below 2·10⁻⁹, for results in the range of `f32`.
///
/// eˣ = 2ᵏ·eʳ with |r| ≤ ½ ln 2.
#[inline]
fn exp_f64(x: f64) -> f64 {
    const P: [f64; 7] = [
        1.000_000_000_554_164_8,
        1.000_000_036_323_094_4,
        0.499_999_920_798_404,
        0.166_664_201_702_696_5,
        0.041_668_225_566_092_76,
        0.008_374_815_778_155_631,
        0.001_383_684_613_689_565,
    ];
    // e⁹⁰ is above and e⁻¹¹⁰ below every positive f32.
    let x = x.clamp(-110.0, 90.0);
    let rounded = x * LOG2_E + ROUND_F64;
    let r = x - (rounded - ROUND_F64) * LN_2;
    let r2 = r * r;
    let low = (P[0] + P[1] * r) + (P[2] + P[3] * r) * r2;
    let high = (P[4] + P[5] * r) + P[6] * r2;
    let power = (rounded.to_bits() << 52).wrapping_add(1f64.to_bits());
    (low + high * (r2 * r2)) * f64::from_bits(power)
}

/// Natural logarithm, with a relative error below 6.2·10⁻⁸; −∞ at 0 and NaN below.
#[inline]
pub fn ln(x: f32) -> f32 {
    ln_f64(x) as f32
}

/// Natural logarithm of an `f32` with a relative error below 10⁻¹¹.
///
/// x = 2ᵉ·m with m in [√½, √2), and ln m = 2 artanh s = s·P(s²) with s = (m − 1)/(m + 1).
#[inline]
fn ln_f64(x: f32) -> f64 {
    const P: [f64; 5] = [
        2.000_000_000_008_424,
        0.666_666_652_404_524_5,
        0.400_003_858_691_528_9,
        0.285_349_859_238_511_3,
        0.236_174_658_758_325_1,
    ];
    const SQRT_HALF: i64 = std::f64::consts::FRAC_1_SQRT_2.to_bits().cast_signed();
    if !(x > 0.0 && x < f32::INFINITY) {
        return match x {
            0.0 => f64::NEG_INFINITY,
            f32::INFINITY => f64::INFINITY,
            _ => f64::NAN,
        };
    }
    let bits = f64::from(x).to_bits().cast_signed();
    let e = (bits - SQRT_HALF) >> 52;
    let m = f64::from_bits((bits - (e << 52)).cast_unsigned());
    let s = (m - 1.0) / (m + 1.0);
    let t = s * s;
    let t2 = t * t;
    let p = (P[0] + P[1] * t) + ((P[2] + P[3] * t) + P[4] * t2) * t2;
    e as f64 * LN_2 + s * p
}

/// xʸ for x ≥ 0 (NaN below), with a relative error below 6.5·10⁻⁸; x⁰ = 1 for every such x.
#[inline]
pub fn powf(x: f32, y: f32) -> f32 {
    if y == 0.0 && x >= 0.0 {
        return 1.0;
    }
    exp_f64(f64::from(y) * ln_f64(x)) as f32
}

/// Angle of (x, y) to the x axis, in [−π, π], with a relative error below 4·10⁻⁷.
///
/// arctan t = t·P(t²) for the ratio t in [0, 1] of the smaller coordinate to the greater one,
/// without branches.
#[inline]
pub fn atan2(y: f32, x: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, PI};
    const P: [f32; 9] = [
        1.0,
        -0.333_330_72,
        0.199_926_2,
        -0.142_036_44,
        0.106_409_34,
        -0.075_042_95,
        0.042_691_52,
        -0.016_068_63,
        0.002_849_889_7,
    ];
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = if ax < ay { (ax, ay) } else { (ay, ax) };
    // Also of two infinities.
    let ratio = if small == large { 1.0 } else { small / large };
    let t = if large == 0.0 { 0.0 } else { ratio };
    let s = t * t;
    let (s2, s4) = (s * s, s * s * (s * s));
    let low = (P[0] + P[1] * s) + (P[2] + P[3] * s) * s2;
    let high = (P[4] + P[5] * s) + (P[6] + P[7] * s) * s2;
    let angle = t * (low + (high + P[8] * s4) * s4);
    let angle = if ax < ay { FRAC_PI_2 - angle } else { angle };
    let angle = if x.is_sign_negative() { PI - angle } else { angle };
    let angle = angle.copysign(y);
    if x.is_nan() || y.is_nan() { f32::NAN } else { angle }
}

/// Arc tangent, in [−π/2, π/2].
#[inline]
pub fn atan(x: f32) -> f32 {
    libm::atanf(x)
}

/// Arc cosine, in [0, π], of `x` clamped to [−1, 1].
#[inline]
pub fn acos(x: f32) -> f32 {
    libm::acosf(x.clamp(-1.0, 1.0))
}

/// Tangent of `x`.
#[inline]
pub fn tan(x: f32) -> f32 {
    libm::tanf(x)
}

/// Error function erf x = 2/√π ∫₀ˣ exp(−t²) dt.
#[inline]
pub fn erf(x: f32) -> f32 {
    libm::erff(x)
}

/// Inverse error function: the x with erf x = `y`, with a relative error below 5·10⁻⁷; ±3.83, the
/// value at the last `f32` below 1, at ±1 and beyond.
///
/// x/y is smooth in w = −ln(1 − y²). [Giles 2012, "Approximating the erfinv function"; coefficients
/// by weighted least squares, relative error 10⁻⁷]
#[inline]
pub fn erf_inv(y: f32) -> f32 {
    const NEAR: [f32; 9] = [
        1.501_409_4,
        0.246_640_73,
        -4.177_707_8e-3,
        -1.253_707_5e-3,
        2.186_022e-4,
        -4.396_785e-6,
        -3.528_862_6e-6,
        3.437_274e-7,
        2.853_504_4e-8,
    ];
    const FAR: [f32; 9] = [
        2.832_977,
        1.001_674_3,
        9.434_04e-3,
        -7.628_063e-3,
        5.771_808e-3,
        -3.649_808_3e-3,
        1.278_984e-3,
        7.594_385e-5,
        -1.503_515_8e-4,
    ];
    const LARGEST: f32 = 1.0 - 0.5 * f32::EPSILON;
    let y = y.clamp(-LARGEST, LARGEST);
    let w = -ln((1.0 - y) * (1.0 + y));
    let polynomial = |p: &[f32; 9], x: f32| p.iter().rev().fold(0.0, |sum, c| sum * x + c);
    y * if w < 5.0 { polynomial(&NEAR, w - 2.5) } else { polynomial(&FAR, w.sqrt() - 3.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of `f` against `exact` over the inputs, divided by `scale` of the exact value.
    fn worst(
        inputs: impl Iterator<Item = f32>,
        f: impl Fn(f32) -> f32,
        exact: impl Fn(f64) -> f64,
        scale: impl Fn(f64) -> f64,
    ) -> f64 {
        inputs.fold(0.0, |worst, x| {
            let (y, e) = (f64::from(f(x)), exact(f64::from(x)));
            worst.max((y - e).abs() / scale(e))
        })
    }

    /// Positive normal numbers spread evenly over their bit patterns.
    fn positive_normals() -> impl Iterator<Item = f32> {
        (f32::MIN_POSITIVE.to_bits()..f32::INFINITY.to_bits()).step_by(4093).map(f32::from_bits)
    }

    /// `count` points from a to b.
    fn line(a: f64, b: f64, count: u32) -> impl Iterator<Item = f32> {
        (0..=count).map(move |i| (a + (b - a) * f64::from(i) / f64::from(count)) as f32)
    }

    #[test]
    fn sines_stay_within_their_stated_errors() {
        let tau = std::f64::consts::TAU;
        let unit = |_| 1.0;
        let u = || line(0.0, 1.0, 1 << 20);
        assert!(worst(u(), |u| sin_cos_tau(u).0, |u| libm::sin(tau * u), unit) < 1.2e-7);
        assert!(worst(u(), |u| sin_cos_tau(u).1, |u| libm::cos(tau * u), unit) < 1.2e-7);
        for limit in [1.0, 100.0, 65_536.0, 1e7] {
            let x = || line(-limit, limit, 1 << 18);
            assert!(worst(x(), |x| sin_cos(x).0, libm::sin, unit) < 1.2e-7);
            assert!(worst(x(), |x| sin_cos(x).1, libm::cos, unit) < 1.2e-7);
        }
    }

    #[test]
    fn hypotenuses_are_exact_where_they_are_numbers_and_do_not_overflow() {
        for scale in [f32::MIN_POSITIVE, 1.0, 1e38] {
            assert_eq!(hypot(-2.0 * scale, 0.0), 2.0 * scale);
            assert_eq!(hypot(0.75 * scale, -scale), 1.25 * scale);
        }
        let exact = |x: f64| (x * x + 1.0).sqrt();
        assert!(worst(line(0.0, 9.0, 1 << 18), |x| hypot(x, 1.0), exact, exact) < 6e-8);
    }

    #[test]
    fn quarter_turns_are_exact() {
        let turns = [(0.0, 0.0, 1.0), (0.25, 1.0, 0.0), (0.5, 0.0, -1.0), (0.75, -1.0, 0.0)];
        for (u, s, c) in turns {
            assert_eq!(sin_cos_tau(u), (s, c));
        }
        assert_eq!(sin_cos_tau(1.0), (0.0, 1.0));
        assert!(sin_cos(f32::NAN).0.is_nan() && sin_cos(f32::INFINITY).1.is_nan());
    }

    #[test]
    fn exponential_and_logarithm_stay_within_their_stated_errors() {
        assert!(worst(line(-87.3, 88.7, 1 << 20), exp, libm::exp, |e| e) < 6.2e-8);
        assert!(worst(positive_normals(), ln, libm::log, f64::abs) < 6.2e-8);
        let near_one = (0..100_000).map(|i| f32::from_bits(1f32.to_bits() - 50_000 + i));
        let scale = |e: f64| if e == 0.0 { 1.0 } else { e.abs() };
        assert!(worst(near_one, ln, libm::log, scale) < 6.2e-8);
    }

    #[test]
    fn exponential_and_logarithm_keep_their_limits() {
        assert_eq!((exp(0.0), exp(-200.0), exp(89.0)), (1.0, 0.0, f32::INFINITY));
        assert_eq!((exp(f32::NEG_INFINITY), exp(f32::INFINITY)), (0.0, f32::INFINITY));
        assert_eq!((ln(1.0), ln(0.0), ln(f32::INFINITY)), (0.0, f32::NEG_INFINITY, f32::INFINITY));
        assert!(exp(f32::NAN).is_nan() && ln(f32::NAN).is_nan() && ln(-1.0).is_nan());
        let least = f32::from_bits(1);
        assert!((f64::from(ln(least)) - libm::log(f64::from(least))).abs() < 1e-5);
    }

    #[test]
    fn powers_stay_within_their_stated_errors() {
        for y in [0.5f32, 1.0 / 2.2, 2.2, 2.4, 7.0, -1.5, 100.0] {
            let fits = |x: &f32| (libm::log(f64::from(*x)) * f64::from(y)).abs() < 87.0;
            let inputs = positive_normals().filter(fits);
            let exact = |x| libm::pow(x, f64::from(y));
            assert!(worst(inputs, |x| powf(x, y), exact, |e| e) < 6.5e-8, "{y}");
        }
        assert_eq!((powf(0.0, 2.0), powf(0.0, 0.0), powf(0.0, -1.0)), (0.0, 1.0, f32::INFINITY));
        assert_eq!((powf(1.0, 9.0), powf(f32::INFINITY, 0.0)), (1.0, 1.0));
        assert!(powf(-2.0, 2.0).is_nan() && powf(f32::NAN, 0.0).is_nan());
    }

    #[test]
    fn angles_stay_within_their_stated_errors() {
        for y in [1.0f32, -0.3, 1e-3, -40.0] {
            for reach in [1e-2, 1.0, 30.0] {
                let exact = |x| libm::atan2(f64::from(y), x);
                assert!(
                    worst(line(-reach, reach, 1 << 18), |x| atan2(y, x), exact, f64::abs) < 4e-7
                );
            }
        }
        let tiny = f32::from_bits(1);
        for x in [0.0, -0.0, 1.0, -1.0, tiny, f32::MAX, f32::INFINITY, f32::NEG_INFINITY] {
            for y in [0.0, -0.0, 1.0, -1.0, -tiny, f32::MAX, f32::INFINITY, f32::NEG_INFINITY] {
                let want = libm::atan2f(y, x);
                let found = atan2(y, x);
                assert!((found - want).abs() <= 4e-7 * want.abs(), "{y} {x}: {found} {want}");
                assert_eq!(found.is_sign_negative(), want.is_sign_negative(), "{y} {x}");
            }
        }
        assert!(atan2(f32::NAN, 1.0).is_nan() && atan2(1.0, f32::NAN).is_nan());
    }

    #[test]
    fn rare_functions_agree_with_double_precision() {
        let unit = |e: f64| e.abs().max(1.0);
        assert!(worst(line(-1.0, 1.0, 10_000), acos, libm::acos, unit) < 1e-6);
        assert!(worst(line(-4.0, 4.0, 10_000), erf, libm::erf, unit) < 1e-6);
        assert!(worst(line(-1.5, 1.5, 10_000), tan, libm::tan, unit) < 1e-6);
        assert!(worst(line(-9.0, 9.0, 10_000), atan, libm::atan, unit) < 1e-6);
        assert_eq!((acos(1.5), acos(-1.5)), (acos(1.0), acos(-1.0)));
    }

    #[test]
    fn the_inverse_of_the_error_function_inverts_it() {
        // Error of x: the error of y divided by the slope of erf.
        let error = |y: f32| {
            let x = f64::from(erf_inv(y));
            let slope = std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp();
            ((libm::erf(x) - f64::from(y)) / slope / x).abs()
        };
        let tails = (1..=24).flat_map(|n| [1.0 - 2f32.powi(-n), 2f32.powi(-n) - 1.0]);
        let small = (1..100).map(|n| 2f32.powi(-n));
        let all = line(-0.999, 0.999, 10_001).filter(|y| *y != 0.0).chain(tails).chain(small);
        let worst = all.map(error).fold(0.0, f64::max);
        assert!(worst < 5e-7, "{worst}");
        assert_eq!((erf_inv(0.0), erf_inv(2.0)), (0.0, erf_inv(1.0)));
    }
}
