//! Radiance of each light group.

use pt_math::Spectrum;
use pt_scene::image::{Channel, Samples};

use super::{ExactSum, Film, InvalidReason, Moments, PixelSums, RadianceSums};

/// Red, green and blue of a light group.
pub(super) type GroupSums = [ExactSum; 3];

/// Bytes per pixel that are estimated for each light group: its sums, and its channels, once in
/// memory and once in the file.
pub const BYTES_PER_PIXEL: usize = size_of::<GroupSums>() + 2 * size_of::<[f32; 3]>();

/// Prefix of the name of a light group among the quantities of a film.
pub(super) const PREFIX: &str = "light group ";

/// Adds samples of a pixel. `parts` contains the radiance of each group, sample by sample;
/// `weights` are the filter weights, 1 if `None`. Samples that the film rejects are rejected in all
/// groups.
pub(super) fn add(
    sums: &mut [GroupSums],
    samples: &[Spectrum],
    parts: &[Spectrum],
    weights: Option<&[f32]>,
) {
    for (i, (&light, parts)) in samples.iter().zip(parts.chunks_exact(sums.len())).enumerate() {
        let weight = weights.map_or(1.0, |weights| weights[i]);
        if InvalidReason::of(light, weight).is_some() {
            continue;
        }
        let context = sums.iter_mut().zip(parts).filter(|(_, part)| **part != Spectrum::ZERO);
        for (sums, &part) in context {
            for (sum, value) in sums.iter_mut().zip((part * weight).to_array()) {
                sum.add(value.clamp(-ExactSum::LIMIT, ExactSum::LIMIT));
            }
        }
    }
}

impl Film {
    /// Returns the sums of a light group in each pixel, in rows from the top. Their mean is that of
    /// [`PixelSums`], as for the image.
    fn pixels_of_group(&self, group: usize) -> impl Iterator<Item = PixelSums> {
        let moments = move |film: &Self, i: usize| {
            let light = film.group_sums[i * film.light_groups.len() + group];
            Moments {
                sums: RadianceSums { light, ..RadianceSums::default() },
                count: film.counts[i],
            }
        };
        (0..self.region.area()).map(move |i| {
            let second = self.second.as_deref().map(|second| moments(second, i));
            PixelSums::new(moments(self, i), second)
        })
    }
}

/// Returns the radiance of each light group as channels, whose sum is the image up to rounding.
pub fn channels(film: &Film) -> Vec<Channel> {
    let channel = |group: usize, name: &str, (c, letter): (usize, &str)| {
        let means = film.pixels_of_group(group).map(|pixel| pixel.mean()[c] as f32);
        let samples = Samples::Real(means.collect());
        Channel { name: format!("light_{name}.{letter}"), samples, half_suffices: true }
    };
    let names = film.light_groups().iter().enumerate();
    let of_group =
        |(i, name): (usize, &String)| [(0, "R"), (1, "G"), (2, "B")].map(|c| channel(i, name, c));
    names.flat_map(of_group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{HalfBuffer, Region};

    /// Adds samples with the radiance of two groups to a pixel of a film of one row.
    fn add(film: &mut Film, x: u32, parts: &[[f32; 2]]) {
        let parts = parts.iter().flatten().map(|&v| Spectrum::rgb(v, 2.0 * v, 0.0));
        let parts: Vec<_> = parts.collect();
        let samples: Vec<_> = parts.chunks(2).map(|of| of[0] + of[1]).collect();
        for tile in &mut film.tiles(9, [0; 2]) {
            tile.add([x, 0], 0, &samples, None);
            tile.add_light_groups([x, 0], &samples, &parts, None);
        }
    }

    fn real(film: &Film, name: &str) -> Vec<f32> {
        let channels = channels(film);
        let found = channels.iter().find(|channel| channel.name == name).expect("it is there");
        let Samples::Real(values) = &found.samples else { panic!("no numbers") };
        values.clone()
    }

    /// Pixel 0 has two samples in the first half and three in the second, pixel 1 some in one half
    /// only, pixel 2 none. Groups are averaged like the image: over two halves, the mean of their
    /// means.
    #[test]
    fn groups_of_halves_are_together_the_mean_of_the_halves() {
        let film = Film::new(Region::full([3, 1]));
        let mut film = film.with_half_buffers().with_light_groups(&["key".into(), "rest".into()]);
        add(film.half_mut(HalfBuffer::First), 0, &[[1.0, 0.0], [3.0, 4.0]]);
        add(film.half_mut(HalfBuffer::Second), 0, &[[3.0, 6.0], [6.0, 0.0], [6.0, 0.0]]);
        add(film.half_mut(HalfBuffer::Second), 1, &[[1.0, 5.0]]);
        assert_eq!(real(&film, "light_key.R"), [3.5, 1.0, 0.0]);
        assert_eq!(real(&film, "light_key.G"), [7.0, 2.0, 0.0]);
        assert_eq!(real(&film, "light_rest.R"), [2.0, 5.0, 0.0]);
        let image: Vec<_> = film.pixels().map(|pixel| pixel.mean()[0]).collect();
        assert_eq!(image, [5.5, 6.0, 0.0]);
    }

    /// An invalid sample is rejected in all its parts, and a weight applies to the sample and to
    /// its parts.
    #[test]
    fn parts_are_refused_and_weighed_as_their_whole_is() {
        let mut sums = [GroupSums::default(); 2];
        let one = Spectrum::ONE;
        let parts = [one, Spectrum::splat(f32::NAN), one, one * 3.0, one * 2.0, one * -1.0];
        let samples = [Spectrum::splat(f32::NAN), one * 4.0, one];
        super::add(&mut sums, &samples, &parts, Some(&[1.0, 0.5, -1.0]));
        assert_eq!(sums.map(|[r, ..]| r.value()), [0.5 - 2.0, 1.5 + 1.0]);
    }
}
