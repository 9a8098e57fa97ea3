//! Images in memory, in linear light.

use crate::Shared;

/// An image in linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Number of pixels in a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Red, green and blue of each pixel, row by row from the top, from left to right.
    pub pixels: Shared<[f32; 3]>,
}

impl Image {
    /// Replaces NaN by 0, and infinite values by the largest finite magnitude of the image, of the
    /// same sign. Returns a message with the number of affected pixels and the first of them, or
    /// `None` if all are finite.
    pub fn make_finite(&mut self) -> Option<String> {
        self.mend(f32::NEG_INFINITY, "that are not finite")
    }

    /// Does the same as [`Self::make_finite`], and replaces negative values by 0.
    pub fn make_radiance(&mut self) -> Option<String> {
        self.mend(0.0, "that are not radiance (finite numbers from 0 up)")
    }

    fn mend(&mut self, least: f32, what: &str) -> Option<String> {
        let is_good = |v: &f32| v.is_finite() && *v >= least;
        let is_bad = |p: &[f32; 3]| !p.iter().all(is_good);
        let first = self.pixels.iter().position(is_bad)?;
        let value = self.pixels[first];
        let finite = self.pixels.as_flattened().iter().filter(|v| v.is_finite());
        let greatest = finite.fold(0.0_f32, |most, v| most.max(v.abs()));
        let mut count = 0_usize;
        for pixel in self.pixels.to_mut()[first..].iter_mut().filter(|p| is_bad(p)) {
            count += 1;
            *pixel = pixel.map(|v| {
                let v = if v.is_nan() { 0.0 } else { v.clamp(-greatest, greatest) };
                v.max(least)
            });
        }
        let (x, y) = (first % self.width as usize, first / self.width as usize);
        let (all, s) = (self.pixels.len(), if count == 1 { "" } else { "s" });
        Some(format!(
            "{count} pixel{s} of {all} with values {what}; the first one is ({x}, {y}), {value:?}, \
             counted from the upper left. NaN and negative values become 0, infinite values the \
             maximum of the image"
        ))
    }

    /// Returns a warning if an environment image in latitude and longitude is square, since it is
    /// then probably in another layout.
    pub fn doubt_as_sky(&self) -> Option<String> {
        (self.width == self.height && self.width > 1).then(|| {
            format!(
                "the environment image is square ({} × {}) and interpreted as latitude and \
                 longitude, expected twice as wide as high; convert light probes (angular maps, \
                 mirrored balls) and octahedral maps first",
                self.width, self.height
            )
        })
    }

    /// Checks that the pixels are radiance.
    ///
    /// # Errors
    /// Returns a message if the number of pixels is not width × height, or with the first pixel
    /// that is not finite or is negative.
    pub fn check_radiance(&self) -> Result<(), String> {
        self.check(0.0, "radiance must be a finite number from 0 up")
    }

    /// Checks that the pixels are finite.
    ///
    /// # Errors
    /// Returns a message if the number of pixels is not width × height, or with the first pixel
    /// that is not finite.
    pub fn check_finite(&self) -> Result<(), String> {
        self.check(f32::NEG_INFINITY, "radiance must be a finite number")
    }

    fn check(&self, least: f32, rule: &str) -> Result<(), String> {
        Self::check_size(self.width, self.height, self.pixels.len())?;
        let is_good = |p: &[f32; 3]| p.iter().all(|v| v.is_finite() && *v >= least);
        let Some(i) = self.pixels.iter().position(|p| !is_good(p)) else { return Ok(()) };
        let (x, y) = (i % self.width as usize, i / self.width as usize);
        Err(format!("pixel ({x}, {y}) is {:?}; {rule}", self.pixels[i]))
    }

    /// Returns a warning with the number of negative pixels and the first of them, for an image of
    /// emission, where they count as 0; `None` if there are none.
    pub fn negative_radiance(&self) -> Option<String> {
        let is_negative = |p: &[f32; 3]| p.iter().any(|v| *v < 0.0);
        let first = self.pixels.iter().position(is_negative)?;
        let count = self.pixels.iter().filter(|p| is_negative(p)).count();
        let (x, y) = (first % self.width as usize, first / self.width as usize);
        let (all, s) = (self.pixels.len(), if count == 1 { "" } else { "s" });
        Some(format!(
            "{count} pixel{s} of {all} of an emission image with negative radiance, replaced by 0; \
             the first one is ({x}, {y}), {:?}, counted from the upper left",
            self.pixels[first]
        ))
    }

    /// Checks that `count` is the number of pixels, and above 0.
    ///
    /// # Errors
    /// Returns a message with the three numbers otherwise.
    pub fn check_size(width: u32, height: u32, count: usize) -> Result<(), String> {
        let expected = u64::from(width) * u64::from(height);
        if expected == 0 || expected != count as u64 {
            return Err(format!("found {count} pixels, expected {width} × {height}"));
        }
        Ok(())
    }
}

/// A channel of an image besides its colours.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Unique name of letters, digits and dots, such as "depth.Z".
    pub name: String,
    /// Sample of each pixel, in the order of [`Image::pixels`].
    pub samples: Samples,
    /// True if half precision is sufficient for real samples, as for colours and directions.
    pub half_suffices: bool,
}

/// Samples of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Real numbers.
    Real(Vec<f32>),
    /// Integers.
    Whole(Vec<u32>),
}

impl Samples {
    /// Number of samples.
    pub fn count(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Whole(values) => values.len(),
        }
    }
}
