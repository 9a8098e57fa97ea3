//! Coverage (alpha) of pixels.

use super::{Aov, Film, aov};

impl Film {
    /// Returns the coverage of each pixel, in rows from the top, or `None` if the film does not
    /// keep it.
    ///
    /// A sample has coverage 1 where its path is scattered or absorbed, or reaches a visible
    /// background, and 0 where it leaves the scene undeflected through transparent surfaces and
    /// there is no background. Samples are weighted by the filter and half buffers are averaged as
    /// for radiance, so the image is premultiplied by the coverage. With filters that have negative
    /// lobes, the coverage may leave [0, 1].
    pub fn alpha(&self) -> Option<Vec<f32>> {
        Some(self.coverage()?.map(|pixel| pixel.mean() as f32).collect())
    }

    /// Returns the mean coverage of each pixel, or `None` if the film does not keep it.
    pub(super) fn coverage(&self) -> Option<impl Iterator<Item = Coverage>> {
        let place = aov::sum_index(&self.aovs, Aov::Alpha)?;
        let per_pixel = aov::sums_per_pixel(&self.aovs);
        let mean = move |film: &Self, i: usize| {
            let count = film.counts[i];
            (count > 0).then(|| film.aov_sums[i * per_pixel + place].value() / f64::from(count))
        };
        let second = move |i| self.second.as_deref().and_then(|half| mean(half, i));
        Some((0..self.region.area()).map(move |i| Coverage([mean(self, i), second(i)])))
    }
}

/// Mean coverage of a pixel in each half buffer; `None` for a half without samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coverage([Option<f64>; 2]);

impl Coverage {
    /// Mean over the half buffers, as in [`super::PixelSums::mean`].
    pub(super) fn mean(self) -> f64 {
        match self.0 {
            [Some(a), Some(b)] => 0.5 * (a + b),
            [Some(mean), None] | [None, Some(mean)] => mean,
            [None, None] => 0.0,
        }
    }

    /// Square of the difference between a half and the mean; 0 if a half has no samples.
    pub(super) fn square_error(self) -> f64 {
        match self.0 {
            [Some(a), Some(b)] => (0.5 * (a - b)).powi(2),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use pt_math::Spectrum;

    use super::*;
    use crate::film::{HalfBuffer, Region};

    /// Adds samples with these transparencies to a pixel of a film of one row.
    fn add(film: &mut Film, x: u32, transparencies: &[f32], weights: Option<&[f32]>) {
        for tile in &mut film.tiles(9, [0; 2]) {
            let black = vec![Spectrum::ZERO; transparencies.len()];
            tile.add([x, 0], 0, &black, weights);
            tile.add_coverage([x, 0], transparencies, weights);
        }
    }

    fn empty() -> Film {
        Film::with_aovs(Region::full([3, 1]), &[Aov::Depth, Aov::Alpha])
    }

    #[test]
    fn coverage_is_the_mean_of_what_is_not_seen_through() {
        let mut film = empty();
        add(&mut film, 0, &[0.0, 1.0, 1.0, 0.5], None);
        add(&mut film, 1, &[0.0, 1.0, 0.0], Some(&[1.25, -0.25, 1.0]));
        assert_eq!(film.alpha(), Some(vec![0.375, 0.75, 0.0]));
        assert_eq!(Film::new(Region::full([3, 1])).alpha(), None);
        let channels: Vec<_> = aov::channels(&film).into_iter().map(|c| c.name).collect();
        assert_eq!(channels, ["depth.Z"], "coverage is a channel of the colours");
    }

    /// Pixel 0 has coverage ½ and 1 in its halves, with different numbers of samples; pixel 1 has
    /// one half.
    #[test]
    fn halves_count_the_same_as_in_the_light() {
        let mut film = empty().with_half_buffers();
        add(film.half_mut(HalfBuffer::First), 0, &[0.0, 1.0], None);
        add(film.half_mut(HalfBuffer::Second), 0, &[0.0, 0.0, 0.0], None);
        add(film.half_mut(HalfBuffer::Second), 1, &[0.0, 1.0, 1.0, 1.0], None);
        assert_eq!(film.alpha(), Some(vec![0.75, 0.25, 0.0]));
    }

    /// With 8 samples, 2 of which are covered: σ²/n = 8/7 · ¼ · ¾ / 8.
    #[test]
    fn its_error_is_that_of_samples_that_are_covered_or_not() {
        let mut film = empty();
        add(&mut film, 0, &[0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0], None);
        let tiles = film.tiles(9, [0; 2]);
        let (alpha, error) = tiles[0].alpha([0, 0]).expect("it is kept");
        assert!((alpha, error) == (0.25, (0.1875f64 / 7.0).sqrt()), "{alpha} {error}");
        assert_eq!(Film::new(Region::full([1, 1])).tiles(1, [0; 2])[0].alpha([0, 0]), None);
    }
}
