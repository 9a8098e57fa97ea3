//! Light in parts: that of each group of lights.

use pt_math::Spectrum;
use pt_scene::image::{Channel, Samples};

use super::{ExactSum, Fault, Film};

/// Red, green and blue of a group.
pub(super) type GroupSums = [ExactSum; 3];

/// Bytes per pixel that are reckoned for each group: the sums, and its channels once apart and once in the file.
pub const BYTES_PER_PIXEL: usize = size_of::<GroupSums>() + 2 * size_of::<[f32; 3]>();

/// Before its name, a group is called so among what a film keeps.
pub(super) const PREFIX: &str = "light group ";

/// Adds samples of a pixel, of which `parts` has that of each group, one sample behind the other, each times what it counts by
/// the filter if that is given. What the film refuses as a whole it refuses in parts.
pub(super) fn add(
    sums: &mut [GroupSums],
    samples: &[Spectrum],
    parts: &[Spectrum],
    weights: Option<&[f32]>,
) {
    for (i, (&light, parts)) in samples.iter().zip(parts.chunks_exact(sums.len())).enumerate() {
        let weight = weights.map_or(1.0, |weights| weights[i]);
        if Fault::of(light, weight).is_some() {
            continue;
        }
        for (sums, &part) in sums.iter_mut().zip(parts) {
            for (sum, value) in sums.iter_mut().zip((part * weight).to_array()) {
                sum.add(value.clamp(-ExactSum::LIMIT, ExactSum::LIMIT));
            }
        }
    }
}

/// The light of each group as channels, which together are the image but for rounding.
pub fn channels(film: &Film) -> Vec<Channel> {
    let groups = film.light_groups().len();
    let channel = |group: usize, name: &str, (c, letter): (usize, &str)| {
        let sums = film.group_sums.iter().skip(group).step_by(groups).map(|sums| sums[c].value());
        let mean = |(sum, &count): (f64, &u32)| (sum / f64::from(count.max(1))) as f32;
        let samples = Samples::Real(sums.zip(&film.counts).map(mean).collect());
        Channel { name: format!("light_{name}.{letter}"), samples, half_suffices: true }
    };
    let names = film.light_groups().iter().enumerate();
    let of_group =
        |(i, name): (usize, &String)| [(0, "R"), (1, "G"), (2, "B")].map(|c| channel(i, name, c));
    names.flat_map(of_group).collect()
}
