//! Reconstruction filters.

/// A pixel reconstruction filter, separable: f(x, y) = g(x) g(y), with distances in pixels from the
/// centre of the pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Filter {
    /// Constant over the square of the pixel.
    #[default]
    Box,
    /// g(x) = 1 − |x|/`radius`.
    Tent {
        /// Radius of the support.
        radius: f64,
    },
    /// g(x) = exp(−x²/2σ²) − exp(−r²/2σ²), which is 0 at the radius.
    Gaussian {
        /// Standard deviation σ.
        stddev: f64,
        /// Radius r of the support.
        radius: f64,
    },
    /// The cubic filters of radius 2. [Mitchell & Netravali 1988, "Reconstruction Filters in
    /// Computer Graphics", eq. 8]
    Mitchell {
        /// Parameter B, in [0, 1].
        b: f64,
        /// Parameter C, in [0, 1].
        c: f64,
    },
    /// The 4-term Blackman–Harris window. [Harris 1978, "On the Use of Windows for Harmonic
    /// Analysis with the Discrete Fourier Transform"]
    BlackmanHarris {
        /// Radius of the support.
        radius: f64,
    },
    /// g(x) = sinc(x) sinc(x/n), with sinc(x) = sin(πx)/(πx).
    Lanczos {
        /// Number n of lobes on each side, which is also the radius.
        lobes: f64,
    },
}

impl Filter {
    /// Tent filter with a width of two pixels.
    pub const TENT: Self = Self::Tent { radius: 1.0 };
    /// Default filter of Mitsuba.
    pub const GAUSSIAN: Self = Self::gaussian(0.5);
    /// Parameters that the authors recommend as a compromise between ringing, blur and anisotropy.
    pub const MITCHELL: Self = Self::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 };
    /// Blackman–Harris filter of Cycles.
    pub const BLACKMAN_HARRIS: Self = Self::BlackmanHarris { radius: 1.5 };
    /// The interpolating spline, which is the cubic filter with B = 0 and C = 1/2.
    pub const CATMULL_ROM: Self = Self::Mitchell { b: 0.0, c: 0.5 };
    /// Lanczos filter with three lobes.
    pub const LANCZOS: Self = Self::Lanczos { lobes: 3.0 };

    /// Each kind of filter with its usual parameters.
    pub const USUAL: [Self; 7] = [
        Self::Box,
        Self::TENT,
        Self::GAUSSIAN,
        Self::MITCHELL,
        Self::BLACKMAN_HARRIS,
        Self::CATMULL_ROM,
        Self::LANCZOS,
    ];

    /// Largest radius, in pixels.
    pub const MAX_RADIUS: f64 = 16.0;

    /// Returns a Gaussian that is truncated at four standard deviations.
    pub const fn gaussian(stddev: f64) -> Self {
        Self::Gaussian { stddev, radius: 4.0 * stddev }
    }

    /// Returns the radius of the support, in pixels.
    pub fn radius(&self) -> f64 {
        match *self {
            Self::Box => 0.5,
            Self::Tent { radius }
            | Self::Gaussian { radius, .. }
            | Self::BlackmanHarris { radius } => radius,
            Self::Mitchell { .. } => 2.0,
            Self::Lanczos { lobes } => lobes,
        }
    }

    /// Checks that the parameters are in range.
    ///
    /// # Errors
    /// Returns a message with the invalid parameter and the expected range.
    pub fn check(&self) -> Result<(), String> {
        /// Minimum radius and standard deviation; smaller filters degenerate to a point.
        const MIN: f64 = 1e-3;
        let radius = self.radius();
        if !(MIN..=Self::MAX_RADIUS).contains(&radius) {
            return Err(format!(
                "found a filter radius of {radius} pixels, expected {MIN} to {}",
                Self::MAX_RADIUS
            ));
        }
        let share = |x: f64| (0.0..=1.0).contains(&x);
        match *self {
            Self::Gaussian { stddev, .. } if !(MIN..f64::INFINITY).contains(&stddev) => {
                Err(format!("found a filter stddev of {stddev}, expected at least {MIN}"))
            }
            Self::Mitchell { b, c } if !share(b) || !share(c) => Err(format!(
                "found filter parameters B = {b} and C = {c}, expected numbers from 0 to 1"
            )),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_make_no_sense_are_refused() {
        let cut = Filter::Gaussian { stddev: 100.0, radius: 1.5 };
        for good in Filter::USUAL.into_iter().chain([cut]) {
            assert_eq!(good.check(), Ok(()), "{good:?}");
        }
        for bad in [
            Filter::Tent { radius: 0.0 },
            Filter::Tent { radius: -1.0 },
            Filter::Tent { radius: 17.0 },
            Filter::gaussian(f64::NAN),
            Filter::gaussian(4.1),
            Filter::Gaussian { stddev: 0.0, radius: 1.0 },
            Filter::Gaussian { stddev: f64::INFINITY, radius: 1.0 },
            Filter::BlackmanHarris { radius: f64::INFINITY },
            Filter::Lanczos { lobes: f64::NAN },
            Filter::Mitchell { b: -0.1, c: 0.3 },
            Filter::Mitchell { b: 0.3, c: 1.5 },
            Filter::Mitchell { b: f64::NAN, c: 0.3 },
        ] {
            let message = bad.check().expect_err("it makes no sense");
            assert!(message.contains("expected"), "{message}");
        }
    }
}
