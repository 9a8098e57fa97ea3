//! Finds numbers from which a reader computes exact values in spite of rounding.

/// Number of neighbouring floating-point numbers that are tried on either side.
const STEPS: usize = 8;

/// Returns the single-precision number nearest to a guess that satisfies a condition, or the guess
/// if no neighbour does.
pub(super) fn near_f32(guess: f32, is_right: impl Fn(f32) -> bool) -> f32 {
    near(guess, f32::next_up, f32::next_down, is_right)
}

/// Like [`near_f32`], for double precision.
pub(super) fn near_f64(guess: f64, is_right: impl Fn(f64) -> bool) -> f64 {
    near(guess, f64::next_up, f64::next_down, is_right)
}

fn near<T: Copy>(guess: T, up: fn(T) -> T, down: fn(T) -> T, is_right: impl Fn(T) -> bool) -> T {
    let (mut above, mut below) = (guess, guess);
    for _ in 0..=STEPS {
        if let Some(found) = [above, below].into_iter().find(|x| is_right(*x)) {
            return found;
        }
        (above, below) = (up(above), down(below));
    }
    guess
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_found_that_become_the_same_degrees() {
        for i in 1..1800 {
            let degrees = f64::from(i) * 0.1;
            let found = near_f64(degrees.to_radians(), |x| x.to_degrees() == degrees);
            assert!((found.to_degrees() - degrees).abs() <= 1e-13, "{degrees}");
            let known = degrees.to_radians().to_degrees();
            assert_eq!(
                near_f64(known.to_radians(), |x| x.to_degrees() == known).to_degrees(),
                known
            );
        }
    }

    #[test]
    fn a_guess_without_a_better_one_stays() {
        assert_eq!(near_f32(1.0, |_| false), 1.0);
    }
}
