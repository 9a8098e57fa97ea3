//! Laws of the transfer functions.

use pt_math::color::*;

fn line() -> impl Iterator<Item = f32> {
    (0..=1 << 16).map(|i| i as f32 / 65_536.0)
}

#[test]
fn transfers_are_monotone_and_keep_their_ends() {
    for encode in [srgb_from_linear, gamma_from_linear] {
        assert_eq!((encode(0.0), encode(1.0), encode(-3.0), encode(9.0)), (0.0, 1.0, 0.0, 1.0));
        assert_eq!((encode(f32::NAN), encode(f32::INFINITY)), (0.0, 1.0));
        let values: Vec<_> = line().map(encode).collect();
        assert!(values.windows(2).all(|w| w[0] <= w[1]));
    }
    assert_eq!((encode_srgb8(f32::NAN), encode_srgb16(f32::NAN)), (0, 0));
    assert_eq!((encode_gamma8(f32::NAN), encode_gamma16(f32::INFINITY)), (0, u16::MAX));
}

#[test]
fn srgb_follows_the_standard() {
    for l in line() {
        let exact = if l <= 0.003_130_8 {
            12.92 * f64::from(l)
        } else {
            1.055 * libm::pow(f64::from(l), 1.0 / 2.4) - 0.055
        };
        assert!((f64::from(srgb_from_linear(l)) - exact).abs() < 2e-7, "{l}");
        assert!((linear_from_srgb(srgb_from_linear(l)) - l).abs() < 1e-6, "{l}");
    }
}

#[test]
fn levels_are_the_nearest() {
    for l in line() {
        let v = f64::from(srgb_from_linear(l));
        assert!((f64::from(encode_srgb8(l)) - 255.0 * v).abs() <= 0.5 + 1e-4);
        assert!((f64::from(encode_srgb16(l)) - 65_535.0 * v).abs() <= 0.5 + 2e-2);
    }
    for b in 0..=u8::MAX {
        assert_eq!(encode_srgb8(linear_from_srgb(f32::from(b) / 255.0)), b);
    }
}

#[test]
fn the_course_cuts_off_and_is_white_from_its_white_level_on() {
    // White is L = 1/√2, since (√2·L)^(1/2.2) = 1 there.
    assert_eq!(encode_gamma8(0.707_2), 255);
    assert_eq!(encode_gamma8(0.707), 254);
    for l in line() {
        let v = libm::pow((2f64.sqrt() * f64::from(l)).min(1.0), 1.0 / 2.2);
        let byte = f64::from(encode_gamma8(l));
        assert!(byte <= 255.0 * v + 1e-4 && byte > 255.0 * v - 1.0 - 1e-4, "{l}");
    }
    for b in 0..=u8::MAX {
        assert_eq!(encode_gamma8(decode_gamma8(b)), b);
    }
}
