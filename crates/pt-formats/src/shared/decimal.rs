//! Parsing of decimal numbers, with a fast path for short ones, which most are.
//!
//! m · 10ⁿ with integers m < 2⁵³ and |n| ≤ 22 is one product or quotient of two numbers that are
//! exact in double precision, so it is rounded correctly. [Clinger 1990, "How to Read Floating
//! Point Numbers Accurately", §6] Other numbers, and invalid ones, are left to [`str::parse`].

use std::str::FromStr;

/// Powers of ten that are exact in double precision.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];
/// Number of digits that always fit into 64 bits.
const DIGITS: usize = 19;

/// Reads the next number of a text and returns the rest: by `quick` or, if that fails, the next
/// word by the standard library. `None` if that is no number.
pub(crate) fn next<T: FromStr>(
    text: &[u8],
    quick: impl Fn(&[u8]) -> Option<(T, &[u8])>,
) -> Option<(T, &[u8])> {
    let text = text.trim_ascii_start();
    quick(text).or_else(|| {
        let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        Some((std::str::from_utf8(word).ok()?.parse().ok()?, rest))
    })
}

/// Reads the number in single precision at the start of a text, and returns the rest, which is a
/// space or nothing. `None` if the fast path does not apply.
pub(crate) fn leading_f32(text: &[u8]) -> Option<(f32, &[u8])> {
    let (number, rest) = leading_f64(text)?;
    // Double rounding equals single rounding, unless the first result is halfway between two
    // numbers of single precision: the side of the exact value is then unknown. (Numbers too small
    // for this test to be right are below all except 0 here: 10⁻²² is above 2⁻¹²⁶.)
    let is_in_the_middle = number.to_bits() & 0x1FFF_FFFF == 0x1000_0000;
    (!is_in_the_middle).then_some((number as f32, rest))
}

/// Reads a number as [`leading_f32`] does, in double precision.
pub(crate) fn leading_f64(text: &[u8]) -> Option<(f64, &[u8])> {
    let (is_negative, unsigned) = match text {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, text),
    };
    let (whole, rest) = digits(unsigned, 0);
    let mut count = unsigned.len() - rest.len();
    let (mut mantissa, mut power, mut rest) = (whole, 0, rest);
    if let [b'.', behind @ ..] = rest {
        (mantissa, rest) = digits(behind, whole);
        let decimals = behind.len() - rest.len();
        count += decimals;
        power = -(decimals as i64);
    }
    if !(1..=DIGITS).contains(&count) || mantissa >= 1 << f64::MANTISSA_DIGITS {
        return None;
    }
    if let [b'e' | b'E', behind @ ..] = rest {
        let exponent;
        (exponent, rest) = signed(behind)?;
        power += exponent;
    }
    let scale = *POWERS.get(power.unsigned_abs() as usize)?;
    let size = if power < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
    ends_word(rest).then_some((if is_negative { -size } else { size }, rest))
}

/// Reads the unsigned integer at the start of a text, and returns the rest, which is a space or
/// nothing. `None` if the fast path does not apply.
pub(crate) fn leading_whole(text: &[u8]) -> Option<(u64, &[u8])> {
    let (number, rest) = digits(text, 0);
    let is_short = (1..=DIGITS).contains(&(text.len() - rest.len()));
    (is_short && ends_word(rest)).then_some((number, rest))
}

/// Reads an exponent, which has a few digits.
fn signed(text: &[u8]) -> Option<(i64, &[u8])> {
    let (is_negative, unsigned) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    };
    let (size, rest) = digits(unsigned, 0);
    let is_short = (1..=4).contains(&(unsigned.len() - rest.len()));
    is_short.then_some((if is_negative { -(size as i64) } else { size as i64 }, rest))
}

/// Appends the digits at the start of a text to a number, which wraps around, and returns the rest.
fn digits(text: &[u8], mut number: u64) -> (u64, &[u8]) {
    let mut rest = text;
    while let [digit @ b'0'..=b'9', others @ ..] = rest {
        number = number.wrapping_mul(10).wrapping_add(u64::from(digit - b'0'));
        rest = others;
    }
    (number, rest)
}

fn ends_word(rest: &[u8]) -> bool {
    rest.first().is_none_or(u8::is_ascii_whitespace)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns pseudo-random numbers (xorshift64*).
    fn random(mut state: u64) -> impl FnMut() -> u64 {
        move || {
            state ^= state >> 12;
            state ^= state << 25;
            state ^= state >> 27;
            state.wrapping_mul(0x2545_F491_4F6C_DD1D)
        }
    }

    /// Checks that results equal those of the standard library; returns true if the fast path
    /// applied.
    fn check(text: &str) -> bool {
        let (single, double) = (leading_f32(text.as_bytes()), leading_f64(text.as_bytes()));
        if let Some((number, rest)) = single {
            let expected: f32 = text.parse().unwrap_or_else(|_| panic!("{text} is a number"));
            assert_eq!((number.to_bits(), rest), (expected.to_bits(), &b""[..]), "{text}");
        }
        if let Some((number, _)) = double {
            let expected: f64 = text.parse().unwrap_or_else(|_| panic!("{text} is a number"));
            assert_eq!(number.to_bits(), expected.to_bits(), "{text}");
        }
        single.is_some()
    }

    #[test]
    fn numbers_of_single_precision_come_back_from_their_shortest_texts() {
        let mut next = random(1);
        let mut quick = 0;
        for _ in 0..1_000_000 {
            let exponent = 90 + next() % 60;
            let bits = (next() as u32 & 0x807F_FFFF) | (exponent as u32) << 23;
            let number = f32::from_bits(bits);
            quick += usize::from(check(&number.to_string()));
            check(&format!("{number:e}"));
        }
        assert!(quick > 700_000, "{quick}");
    }

    #[test]
    fn texts_of_any_digits_are_rounded_as_the_standard_library_does() {
        let mut next = random(2);
        let mut quick = 0;
        for _ in 0..1_000_000 {
            let digits = next() >> (next() % 60);
            let (point, exponent) = (next() % 23, next() as i64 % 40);
            let sign = if next().is_multiple_of(2) { "-" } else { "" };
            let mut text = format!("{digits:0width$}", width = point as usize + 1);
            text.insert(text.len() - point as usize, '.');
            quick += usize::from(check(&format!("{sign}{text}")));
            check(&format!("{sign}{text}e{exponent}"));
            check(&format!("{sign}{digits}E+{}", exponent.abs()));
        }
        assert!(quick > 600_000, "{quick}");
    }

    /// Midpoints of neighbours in single precision, and nearby texts, where double rounding would
    /// be wrong.
    #[test]
    fn middles_between_numbers_are_rounded_once() {
        let mut next = random(3);
        for _ in 0..200_000 {
            let low = f32::from_bits(next() as u32 % (1 << 24) + (120 << 23));
            let middle = f64::midpoint(f64::from(low), f64::from(low.next_up()));
            for decimals in 8..18 {
                check(&format!("{middle:.decimals$}"));
            }
        }
        // 1 + 2⁻²⁴ is a midpoint; in double precision this text is rounded to it.
        assert_eq!(leading_f32(b"1.000000059604644775"), None);
    }

    #[test]
    fn words_are_read_one_after_the_other_however_they_are_written() {
        let mut rest = &b" \t1.5 +2 12345678901234567890.5e-3\r"[..];
        for expected in [1.5, 2.0, 1.234_567_8e16] {
            let number;
            (number, rest) = next(rest, leading_f32).expect("a number");
            assert_eq!(number, expected);
        }
        assert_eq!(
            (rest, next(rest, leading_f32), next(b" 1,5 2", leading_f32)),
            (&b"\r"[..], None, None)
        );
    }

    #[test]
    fn what_takes_longer_is_left() {
        for text in [
            "",
            "-",
            ".",
            "-.",
            "+1",
            "e5",
            "1e",
            "1e+",
            "nan",
            "inf",
            "1.2.3",
            "1,5",
            "0x10",
            "1_0",
            "--1",
            "1e5.",
            "12345678901234567890",
            "9007199254740993",
            "1e23",
            "1e-23",
            "1e99999",
            "\u{661}",
        ] {
            assert_eq!(leading_f64(text.as_bytes()), None, "{text}");
        }
        for text in ["", "-1", "+1", "1.", "a", "1/2", "12345678901234567890"] {
            assert_eq!(leading_whole(text.as_bytes()), None, "{text}");
        }
        assert_eq!(leading_f64(b"-.5\t7"), Some((-0.5, &b"\t7"[..])));
        assert_eq!(leading_f64(b"5.\r"), Some((5.0, &b"\r"[..])));
        assert_eq!(
            leading_whole(b"1234567890123456789 1"),
            Some((1_234_567_890_123_456_789, &b" 1"[..]))
        );
        assert!(leading_f32(b"-0").is_some_and(|(zero, _)| zero.is_sign_negative() && zero == 0.0));
    }
}
