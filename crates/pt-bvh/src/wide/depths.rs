//! Depths compared as integers, with a latency of one cycle instead of four.
//!
//! Bits of positive numbers have the order of the numbers. Those of negative numbers are less than
//! all of them, in the opposite order. A ray looks for hits between two positive depths; so
//! negative depths, whose order would be wrong, never matter.

use wide::{f32x8, i32x8};

/// Maximum of two depths; if both are negative, either of them.
#[inline(always)]
pub(super) fn later(a: f32x8, b: f32x8) -> f32x8 {
    from_bits(bits(a).max(bits(b)))
}

/// Minimum of two depths; if both are negative, either of them.
#[inline(always)]
pub(super) fn earlier(a: f32x8, b: f32x8) -> f32x8 {
    from_bits(bits(a).min(bits(b)))
}

/// Lanes in which `a` is greater than `b`; at least one of the two must be positive.
#[inline(always)]
pub(super) fn after(a: f32x8, b: f32x8) -> f32x8 {
    from_bits(bits(a).simd_gt(bits(b)))
}

#[inline(always)]
fn bits(x: f32x8) -> i32x8 {
    bytemuck::cast(x)
}

#[inline(always)]
fn from_bits(x: i32x8) -> f32x8 {
    bytemuck::cast(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_compare_as_numbers() {
        let numbers = [-f32::INFINITY, -2.0, -1e-40, -0.0, 0.0, 1e-40, 0.5, 2.0, f32::INFINITY];
        let splat = f32x8::splat;
        let limits = numbers.into_iter().filter(|&x| x > 0.0);
        for limit in limits {
            for a in numbers {
                for b in numbers {
                    let far = after(later(splat(a), splat(b)), splat(limit)).all();
                    assert_eq!(far, a.max(b) > limit, "{a} {b} {limit}");
                    let near = after(splat(limit), earlier(splat(a), splat(b))).all();
                    assert_eq!(near, limit > a.min(b), "{a} {b} {limit}");
                }
            }
        }
    }
}
