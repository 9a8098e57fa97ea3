//! How far a film of two halves is from the image of infinitely many samples, as it is displayed.
//!
//! A screen shows light between 0 and a white W: f(x) = min(max(x/W, 0), 1). With the means A and B of the halves of a pixel
//! and the image M = (A + B)/2, the square of (A − B)/2 has the variance of M as its mean, whatever points the
//! samples of a half are, since the halves know nothing of each other. Where light is beyond the screen's range, the larger one
//! of (f(A) − f(M))² and (f(B) − f(M))² takes its place, which is the same within the range: a pixel of which one half
//! is far too bright, and so the image, is not told to be half as far away as it is.

use super::Film;

/// The root mean square error of a displayed image, as a share of the root of its mean square:
/// √(Σ(f(M) − f(μ))² / Σf(μ)²) over all pixels and channels, with the image M and that of infinitely many samples, μ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The best guess.
    pub error: f64,
    /// The error of this image is hardly less,
    pub least: f64,
    /// and hardly more.
    pub most: f64,
}

impl Measured {
    /// The best guess, hardly less, hardly more.
    pub fn to_array(self) -> [f64; 3] {
        [self.error, self.least, self.most]
    }
}

/// What the screen shows of light, if this is its white.
fn displayed(light: f64, white: f64) -> f64 {
    (light / white).clamp(0.0, 1.0)
}

/// The squares of the differences of pixels between halves and image, and the squares of what is displayed: each summed up over
/// the channels.
fn squares([a, b]: [[f64; 3]; 2], white: f64) -> (f64, f64) {
    let of_channel = |c: usize| {
        let mean = displayed(0.5 * (a[c] + b[c]), white);
        let [off_a, off_b] = [a[c], b[c]].map(|half| (displayed(half, white) - mean).powi(2));
        (off_a.max(off_b), mean * mean)
    };
    (0..3).map(of_channel).fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

impl Film {
    /// The error of the image of a film in halves, if light of `white` is the brightest that the screen shows. The
    /// interval spans `deviations` standard deviations to each side, in which the error of this image lies, and not only that of
    /// images like it: both are sums over pixels whose halves differ by chance, the one of (M − μ)², the other
    /// of (A − B)²/4, so that their difference has twice the variance of the latter, which is less than the sum
    /// of the squares of its terms. Errors of as many pixels as `alike` are taken to be the same.
    ///
    /// `None` if a pixel lacks samples.
    pub fn measured(&self, white: f64, deviations: f64, alike: u32) -> Option<Measured> {
        let (mut noise, mut spread, mut signal) = (0.0, 0.0, 0.0);
        for pixel in self.pixels() {
            let (difference, square) = squares(pixel.means_of_halves()?, white);
            noise += difference;
            spread += difference * difference;
            signal += square;
        }
        let deviation = deviations * (2.0 * f64::from(alike) * spread).sqrt();
        // The mean square of a mean with an error is greater by the error's.
        let share = |noise: f64| match noise.max(0.0) {
            0.0 => 0.0,
            noise => (noise / (signal - noise).max(0.0)).sqrt(),
        };
        let [error, least, most] = [noise, noise - deviation, noise + deviation].map(share);
        Some(Measured { error, least, most })
    }

    /// The square error of each displayed pixel, as [`Self::measured`] tells it: summed up over the channels, as a
    /// share of the square of white. `None` if a pixel lacks samples.
    pub(crate) fn square_errors(&self, white: f64) -> Option<Vec<f64>> {
        self.pixels().map(|pixel| Some(squares(pixel.means_of_halves()?, white).0)).collect()
    }
}
