//! Division of the film of a session into rectangles.

use pt_core::Region;
use pt_core::film::HalfBuffer;

use crate::session::Session;

/// A rectangle of the film with the samples that it has and lacks. Numbers are those of each half
/// buffer if there are two; samples that a pixel does not need by a tolerance count as missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The rectangle.
    pub region: Region,
    /// Smallest number of samples of a pixel that lacks some; `wanted` if none does.
    pub taken: u32,
    /// Largest number of samples of a pixel.
    pub most: u32,
    /// Largest number of samples that a pixel is to have, by the plan if there is one.
    pub wanted: u32,
    /// Number of samples that are missing, of all pixels and half buffers.
    pub missing: u64,
}

impl Session {
    /// Divides the pixels of the film into squares of `size`² pixels, row by row, with the samples
    /// that they have and lack.
    pub fn parts(&self, size: u32) -> Vec<Part> {
        let (film, settings) = (self.film(), self.settings());
        let spp = settings.spp;
        let Region { x, y, width, height } = film.region();
        let starts = |from: u32, len: u32| (from..from + len).step_by(size.max(1) as usize);
        let side = |start: u32, end: u32| size.max(1).min(end - start);
        let ends = match (film.has_half_buffers(), settings.target) {
            (false, _) => vec![spp.saturating_sub(film.first())],
            (true, Some(_)) => vec![spp / 2; 2],
            (true, None) => vec![spp.div_ceil(2), spp / 2],
        };
        let halves: Vec<(Vec<u32>, u32)> = HalfBuffer::BOTH
            .into_iter()
            .zip(ends)
            .map(|(half, end)| (film.counts_of(half).collect(), end))
            .collect();
        let planned = |i: usize, end: u32| match (film.plan(), settings.target) {
            (Some(plan), _) => plan.wanted(i).min(end),
            (None, Some(_)) => 0,
            (None, None) => end,
        };
        let part = |[left, top]: [u32; 2]| {
            let (width_of, height_of) = (side(left, x + width), side(top, y + height));
            let (mut taken, mut wanted, mut samples) = (u32::MAX, 0, 0);
            let mut most = 0;
            for row in top - y..top - y + height_of {
                let start = row as usize * width as usize + (left - x) as usize;
                for i in start..start + width_of as usize {
                    for (counts, end) in &halves {
                        let planned = planned(i, *end);
                        wanted = wanted.max(planned);
                        most = most.max(counts[i]);
                        if counts[i] < planned {
                            taken = taken.min(counts[i]);
                            samples += u64::from(planned - counts[i]);
                        }
                    }
                }
            }
            let region = Region { x: left, y: top, width: width_of, height: height_of };
            Part { region, taken: taken.min(wanted), most, wanted, missing: samples }
        };
        let tops = starts(y, height);
        tops.flat_map(|top| starts(x, width).map(move |left| [left, top])).map(part).collect()
    }
}
