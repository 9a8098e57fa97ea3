//! Serialisation of films: all data needed to resume a render or to merge films.
//!
//! Integers are little endian. In order:
//!
//! * column, row, width, height and the first sample (u32 each);
//! * the number of quantities besides radiance (u32), and for each the length of its name (u32) and
//!   the name. Light groups are quantities too, after all others, with the name `light group NAME`;
//! * the sample count (u32) of each pixel;
//! * the four sums of each pixel;
//! * the sums of the other quantities, pixel by pixel;
//! * for each pixel and each quantity that counts ids: the number of ids (u32), and for each id, in
//!   ascending order, the id and its number of samples (u32 each);
//! * for each pixel and each light group: three sums;
//! * the luminance removed by clamping (a sum);
//! * the number of rejected samples for each reason (u64 each, in the order of
//!   [`InvalidReason::ALL`]), the number of those that are listed (u32), and for each of these its
//!   row, column, sample index and the number of the reason (u32 each).
//!
//! Then 1 if there is a second half buffer, followed by all of the above for it, or else 0 (u32).
//! Sums are three words of 64 bits in units of 2⁻⁶⁴, sums of squares four words in units of 2⁻¹²⁷.
//!
//! Then 0, or 1 and the plan: its goal, rounds and least (u32 each), the expected totals (three
//! u64), the error (f64, NaN for none); 0, or 1 and the densities of the pixels (f32), or 2 if
//! these are equal; and 0, or 1 and a byte for each pixel, 1 if it is vacant and 0 if not. Nothing
//! follows.

use std::io::{self, Write};

use pt_math::sampler::HALF_B_OFFSET;

use super::exact::SquareSum;
use super::groups::PREFIX;
use super::{
    Aov, ExactSum, Film, IdCount, IdCoverage, InvalidReason, InvalidSample, InvalidSamples,
    RadianceSums, Region, SamplePlan, aov,
};

/// Reason why bytes are not a valid film.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum FilmError {
    /// The bytes end too early. Contains their number.
    #[error("{0} bytes are too few for what they say they hold")]
    Short(usize),
    /// The film is followed by this number of bytes.
    #[error("behind the film there are {0} more bytes")]
    Long(usize),
    /// A quantity with this name is not supported.
    #[error("it keeps \"{0}\", which this version does not know")]
    Quantity(String),
    /// The ids of a pixel are not in strictly ascending order.
    #[error("what a pixel sees is not in order")]
    Things,
    /// The sample indices of a pixel exceed 32 bits.
    #[error("a pixel has samples beyond number 4294967295")]
    Samples,
    /// A sum is larger than the number of samples permits.
    #[error("a sum is greater than that of as many samples as there are can be")]
    Sums,
    /// Columns or rows of the region exceed 32 bits.
    #[error("its pixels lie beyond column or row 4294967295")]
    Region,
    /// The second half buffer does not match the first.
    #[error("its halves are not of the same pixels, or keep not the same")]
    Halves,
}

impl Film {
    /// Writes the film as bytes.
    ///
    /// # Errors
    /// Returns the errors of the writer.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        self.write_half(out)?;
        match &self.second {
            Some(second) => {
                put(out, &[1], u32::to_le_bytes)?;
                second.write_half(out)?;
            }
            None => put(out, &[0], u32::to_le_bytes)?,
        }
        let Some(plan) = &self.plan else { return put(out, &[0], u32::to_le_bytes) };
        let SamplePlan { goal, rounds, least, densities, vacant, error, expected } = plan;
        put(out, &[1, *goal, *rounds, *least], u32::to_le_bytes)?;
        put(out, expected, u64::to_le_bytes)?;
        put(out, &[error.unwrap_or(f64::NAN)], f64::to_le_bytes)?;
        let kind = match densities.as_deref() {
            None => 0,
            Some([]) => 2,
            Some(_) => 1,
        };
        put(out, &[kind], u32::to_le_bytes)?;
        put(out, densities.as_deref().unwrap_or_default(), f32::to_le_bytes)?;
        put(out, &[u32::from(!vacant.is_empty())], u32::to_le_bytes)?;
        put(out, vacant, |vacant| [u8::from(vacant)])
    }

    /// Writes one half buffer, without the data common to both.
    fn write_half(&self, out: &mut impl Write) -> io::Result<()> {
        let Self {
            region,
            first,
            counts,
            sums,
            aovs,
            aov_sums,
            ids,
            light_groups,
            group_sums,
            invalid_samples,
            removed,
            second: _,
            plan: _,
        } = self;
        let Region { x, y, width, height } = *region;
        let groups = light_groups.iter().map(|name| format!("{PREFIX}{name}"));
        let names: Vec<_> = aovs.iter().map(|aov| aov.name().to_owned()).chain(groups).collect();
        put(out, &[x, y, width, height, *first, names.len() as u32], u32::to_le_bytes)?;
        for name in names {
            put(out, &[name.len() as u32], u32::to_le_bytes)?;
            out.write_all(name.as_bytes())?;
        }
        put(out, counts, u32::to_le_bytes)?;
        put(out, sums, bytes_of_pixel)?;
        put(out, aov_sums, bytes_of_sum)?;
        for ids in ids.chunks(AT_ONCE) {
            let words: Vec<_> = ids.iter().flat_map(words_of).collect();
            put(out, &words, u32::to_le_bytes)?;
        }
        put(out, group_sums.as_flattened(), bytes_of_sum)?;
        put(out, &[*removed], bytes_of_sum)?;
        put(out, &invalid_samples.counts, u64::to_le_bytes)?;
        put(out, &[invalid_samples.first.len() as u32], u32::to_le_bytes)?;
        let words = |r: &InvalidSample| [r.y, r.x, r.sample, r.reason as u32];
        let words: Vec<_> = invalid_samples.first.iter().flat_map(words).collect();
        put(out, &words, u32::to_le_bytes)
    }

    /// Reads a film written by [`Self::write`].
    ///
    /// # Errors
    /// If the bytes are not a valid film. No more memory is allocated than the bytes can fill.
    pub fn read(bytes: &[u8]) -> Result<Self, FilmError> {
        let mut rest = bytes;
        let short = || FilmError::Short(bytes.len());
        let mut film = take_half(&mut rest).ok_or_else(short)??;
        if take_word(&mut rest).ok_or_else(short)? != 0 {
            let second = take_half(&mut rest).ok_or_else(short)??;
            let is_second = (second.region, second.first) == (film.region, HALF_B_OFFSET);
            let is_first = film.counts.iter().all(|count| film.first + count <= HALF_B_OFFSET);
            if !is_first || !is_second || !second.has_same_layout(&film) {
                return Err(FilmError::Halves);
            }
            film.second = Some(Box::new(second));
        }
        if take_word(&mut rest).ok_or_else(short)? != 0 {
            film.plan = Some(take_plan(&mut rest, film.region).ok_or_else(short)?);
        }
        if rest.is_empty() { Ok(film) } else { Err(FilmError::Long(rest.len())) }
    }
}

/// Writes all items, in blocks of [`AT_ONCE`].
fn put<T: Copy, const N: usize>(
    out: &mut impl Write,
    items: &[T],
    bytes: fn(T) -> [u8; N],
) -> io::Result<()> {
    let mut buffer = Vec::with_capacity(N * items.len().min(AT_ONCE));
    for items in items.chunks(AT_ONCE) {
        buffer.clear();
        for &item in items {
            buffer.extend_from_slice(&bytes(item));
        }
        out.write_all(&buffer)?;
    }
    Ok(())
}

/// Bytes of an [`ExactSum`].
const SUM: usize = size_of::<ExactSum>();
/// Bytes of the sums that every pixel has.
const PIXEL: usize = size_of::<RadianceSums>();

fn bytes_of_sum(sum: ExactSum) -> [u8; SUM] {
    bytemuck::cast(sum.words().map(u64::to_le_bytes))
}

fn sum_of_bytes(bytes: [u8; SUM]) -> ExactSum {
    ExactSum::from_words(bytemuck::cast::<_, [[u8; 8]; _]>(bytes).map(u64::from_le_bytes))
}

fn bytes_of_pixel(sums: RadianceSums) -> [u8; PIXEL] {
    let mut bytes = [0; PIXEL];
    let (light, squares) = bytes.split_at_mut(3 * SUM);
    light.copy_from_slice(sums.light.map(bytes_of_sum).as_flattened());
    squares.copy_from_slice(sums.squares.words().map(u64::to_le_bytes).as_flattened());
    bytes
}

fn pixel_of_bytes(bytes: [u8; PIXEL]) -> RadianceSums {
    let words: [[u8; 8]; PIXEL / 8] = bytemuck::cast(bytes);
    let [r0, r1, r2, g0, g1, g2, b0, b1, b2, squares @ ..] = words.map(u64::from_le_bytes);
    let light = [[r0, r1, r2], [g0, g1, g2], [b0, b1, b2]].map(ExactSum::from_words);
    RadianceSums { light, squares: SquareSum::from_words(squares) }
}

/// Returns the error of a film whose sums exceed what its samples permit, or `None` if there is
/// none. Adding to such sums could overflow.
fn fault_of_sums(film: &Film) -> Option<FilmError> {
    let Film { first, counts, sums, aov_sums, group_sums, .. } = film;
    let (per_pixel, groups) = (aov::sums_per_pixel(&film.aovs), film.light_groups.len());
    for (i, (&count, sums)) in counts.iter().zip(sums).enumerate() {
        if first.checked_add(count).is_none() {
            return Some(FilmError::Samples);
        }
        let most = f64::from(count) * f64::from(ExactSum::LIMIT);
        let aovs = &aov_sums[i * per_pixel..][..per_pixel];
        let parts = group_sums[i * groups..][..groups].as_flattened();
        let mut all = sums.light.iter().chain(aovs).chain(parts);
        let most_of_squares = most * f64::from(ExactSum::LIMIT);
        if !all.all(|sum| sum.value().abs() <= most)
            || !(0.0..=most_of_squares).contains(&sums.squares.value())
        {
            return Some(FilmError::Sums);
        }
    }
    None
}

/// Returns the words written for the ids of a pixel.
fn words_of(ids: &IdCoverage) -> impl Iterator<Item = u32> {
    let count = ids.iter().len() as u32;
    std::iter::once(count).chain(ids.iter().flat_map(|seen| [seen.number, seen.samples]))
}

/// Number of items that are written at a time: enough to be fast, few enough for the cache.
const AT_ONCE: usize = 4096;

/// Takes `count` items from the front of the remaining bytes; `None` if there are too few.
fn take<T, const N: usize>(rest: &mut &[u8], count: u64, item: fn([u8; N]) -> T) -> Option<Vec<T>> {
    let count = usize::try_from(count).ok()?;
    let bytes = rest.split_off(..count.checked_mul(N)?)?;
    Some(bytes.as_chunks().0.iter().map(|&bytes| item(bytes)).collect())
}

fn take_word(rest: &mut &[u8]) -> Option<u32> {
    take(rest, 1, u32::from_le_bytes)?.pop()
}

/// Takes a plan for the pixels of `region`; `None` if there are too few bytes.
fn take_plan(rest: &mut &[u8], region: Region) -> Option<SamplePlan> {
    let [goal, rounds, least] = take(rest, 3, u32::from_le_bytes)?.try_into().ok()?;
    let expected = take(rest, 3, u64::from_le_bytes)?.try_into().ok()?;
    let error = take(rest, 1, f64::from_le_bytes)?.pop().filter(|error| !error.is_nan());
    let densities = match take_word(rest)? {
        0 => None,
        2 => Some(Vec::new()),
        _ => Some(take(rest, region.area() as u64, f32::from_le_bytes)?),
    };
    let vacant = match take_word(rest)? {
        0 => Vec::new(),
        _ => take(rest, region.area() as u64, |[vacant]| vacant != 0)?,
    };
    Some(SamplePlan { goal, rounds, least, densities, vacant, error, expected })
}

/// Takes the ids of a pixel; `None` if there are too few bytes.
fn take_things(rest: &mut &[u8]) -> Option<Result<IdCoverage, FilmError>> {
    let count = take_word(rest)?;
    let seen = |bytes: [u8; 8]| {
        let [number, samples] = bytemuck::cast::<_, [[u8; 4]; 2]>(bytes).map(u32::from_le_bytes);
        IdCount { number, samples }
    };
    let all = take(rest, u64::from(count), seen)?;
    if !all.is_sorted_by(|a, b| a.number < b.number) {
        return Some(Err(FilmError::Things));
    }
    let mut ids = IdCoverage::default();
    for seen in all {
        ids.add(seen);
    }
    Some(Ok(ids))
}

/// Takes a half buffer; `None` if there are too few bytes.
fn take_half(rest: &mut &[u8]) -> Option<Result<Film, FilmError>> {
    let [x, y, width, height, first, quantities] =
        take(rest, 6, u32::from_le_bytes)?.try_into().ok()?;
    let (mut aovs, mut light_groups) = (Vec::new(), Vec::new());
    for _ in 0..quantities {
        let length = take_word(rest)?;
        let name = String::from_utf8_lossy(rest.split_off(..length as usize)?);
        match (Aov::from_name(&name), name.strip_prefix(PREFIX)) {
            (Some(aov), _) => aovs.push(aov),
            (None, Some(group)) => light_groups.push(group.to_owned()),
            (None, None) => return Some(Err(FilmError::Quantity(name.into()))),
        }
    }
    if x.checked_add(width).is_none() || y.checked_add(height).is_none() {
        return Some(Err(FilmError::Region));
    }
    let pixels = u64::from(width) * u64::from(height);
    let per_pixel = aov::sums_per_pixel(&aovs) as u64;
    let counts = take(rest, pixels, u32::from_le_bytes)?;
    let sums = take(rest, pixels, pixel_of_bytes)?;
    let aov_sums = take(rest, pixels.checked_mul(per_pixel)?, sum_of_bytes)?;
    let ids = pixels.checked_mul(aov::ids(&aovs).count() as u64)?;
    let ids = match (0..ids).map(|_| take_things(rest)).collect::<Option<Result<_, _>>>()? {
        Ok(ids) => ids,
        Err(error) => return Some(Err(error)),
    };
    let groups = pixels.checked_mul(light_groups.len() as u64)?;
    let group_sums = take(rest, groups, |bytes: [u8; 3 * SUM]| {
        bytemuck::cast::<_, [[u8; SUM]; 3]>(bytes).map(sum_of_bytes)
    })?;
    let removed = take(rest, 1, sum_of_bytes)?.pop()?;
    let counts_refused = take(rest, InvalidReason::ALL.len() as u64, u64::from_le_bytes)?;
    let named = take_word(rest)?;
    let rejected = |bytes: [u8; 16]| {
        let [y, x, sample, reason] =
            bytemuck::cast::<_, [[u8; 4]; 4]>(bytes).map(u32::from_le_bytes);
        InvalidReason::from_number(reason).map(|reason| InvalidSample { y, x, sample, reason })
    };
    let first_refused =
        take(rest, u64::from(named), rejected)?.into_iter().collect::<Option<_>>()?;
    let invalid_samples =
        InvalidSamples { counts: counts_refused.try_into().ok()?, first: first_refused };
    let region = Region { x, y, width, height };
    let (second, plan) = (None, None);
    let film = Film {
        region,
        first,
        counts,
        sums,
        aovs,
        aov_sums,
        ids,
        light_groups,
        group_sums,
        invalid_samples,
        removed,
        second,
        plan,
    };
    Some(fault_of_sums(&film).map_or(Ok(film), Err))
}

#[cfg(test)]
mod tests {
    use pt_math::{Spectrum, Vec2, Vec3};

    use super::*;
    use crate::film::{FirstHit, HalfBuffer};

    /// A film with all optional parts, except half buffers and a plan.
    fn film() -> Film {
        let region = Region { x: 3, y: 1, width: 5, height: 4 };
        let aovs =
            [Aov::Albedo, Aov::Primitive, Aov::CryptomatteMaterial, Aov::Variance, Aov::Refused];
        let film = Film::with_aovs(region, &aovs).starting_at(7);
        let mut film = film.with_light_groups(&["key".into(), "rest".into()]);
        let hit = FirstHit {
            albedo: Spectrum::splat(0.3),
            normal: Vec3::X,
            geometric_normal: Vec3::Y,
            depth: 2.0,
            position: Vec3::ONE,
            uv: Vec2::ZERO,
            motion: Vec2::ZERO,
            primitive: 5,
            object: 1,
            material: 2,
            scene_material: Some(4),
        };
        let mut invalid_samples = InvalidSamples::default();
        let mut removed = ExactSum::default();
        removed.add(0.7);
        for tile in &mut film.tiles(3, [0; 2]) {
            for [x, y] in tile.region().pixels() {
                let bright = Spectrum::rgb(x as f32 * 0.1, -0.5, 1e9 * y as f32);
                tile.add([x, y], 7, &[bright, Spectrum::splat(f32::NAN)], None);
                let parts = [bright, Spectrum::ONE, Spectrum::ONE, Spectrum::ZERO];
                tile.add_light_groups([x, y], &[Spectrum::ONE; 2], &parts, None);
                tile.add_aovs([x, y], 7, &hit);
            }
            invalid_samples.merge(tile.invalid_samples());
        }
        film.add_invalid_samples(&invalid_samples);
        film.add_clamped(removed);
        film
    }

    /// A film with half buffers and a plan.
    fn planned(densities: Option<Vec<f32>>) -> Film {
        let region = Region::full([3, 2]);
        let groups = ["sky".into(), "rest".into()];
        let mut film =
            Film::with_aovs(region, &[Aov::Depth]).with_light_groups(&groups).with_half_buffers();
        for (half, light) in HalfBuffer::BOTH.into_iter().zip([1.0, 4.0]) {
            for tile in &mut film.half_mut(half).tiles(9, [0; 2]) {
                let samples = [Spectrum::splat(light); 2];
                tile.add([1, 1], 0, &samples, None);
                tile.add_light_groups([1, 1], &samples, &[samples, samples].concat(), None);
            }
        }
        let error = densities.is_some().then_some(0.5);
        let vacant = if densities.is_some() { [true, false].repeat(3) } else { Vec::new() };
        let expected = [1, 2, 3];
        film.set_plan(SamplePlan {
            goal: 9,
            rounds: 2,
            least: 4,
            densities,
            vacant,
            error,
            expected,
        });
        film
    }

    fn bytes(film: &Film) -> Vec<u8> {
        let mut bytes = Vec::new();
        film.write(&mut bytes).expect("memory takes all");
        bytes
    }

    #[test]
    fn films_are_read_as_they_were_written() {
        let empty = [[0, 3], [2, 2]].map(|size| Film::new(Region::full(size)));
        let planned = [None, Some(Vec::new()), Some(vec![0.5; 6])].map(planned);
        for film in [film()].into_iter().chain(empty).chain(planned) {
            assert_eq!(Film::read(&bytes(&film)).as_ref(), Ok(&film));
        }
    }

    /// Otherwise the samples of a repeated id would be added, and their count could overflow.
    #[test]
    fn things_of_a_pixel_are_in_order_and_each_once() {
        let mut film = Film::with_aovs(Region::full([1, 1]), &[Aov::CryptomatteObject]);
        let [two, three] = [2, 3].map(|number| IdCount { number, samples: u32::MAX });
        film.ids[0].add(two);
        film.ids[0].add(three);
        let good = bytes(&film);
        assert_eq!(Film::read(&good).as_ref(), Ok(&film));
        for numbers in [[2, 2], [3, 2]] {
            let words = |numbers: [u32; 2]| numbers.map(|n| [n, u32::MAX]).concat();
            let bytes_of =
                |words: Vec<u32>| words.into_iter().flat_map(u32::to_le_bytes).collect::<Vec<_>>();
            let (old, new) = (bytes_of(words([2, 3])), bytes_of(words(numbers)));
            let at = good.windows(old.len()).position(|part| part == old).expect("both are there");
            let mut bad = good.clone();
            bad[at..at + new.len()].copy_from_slice(&new);
            assert_eq!(Film::read(&bad), Err(FilmError::Things));
        }
    }

    /// A pixel of one sample with sums at their limit and beyond it, and one whose sample indices
    /// overflow.
    #[test]
    fn sums_and_counts_are_those_of_samples_that_can_be() {
        let mut film = Film::new(Region::full([1, 1]));
        let light = Spectrum::splat(ExactSum::LIMIT);
        film.tiles(1, [0; 2])[0].add([0, 0], 0, &[light], None);
        assert_eq!(Film::read(&bytes(&film)).as_ref(), Ok(&film));
        let mut few = film.clone();
        few.counts[0] = 0;
        assert_eq!(Film::read(&bytes(&few)), Err(FilmError::Sums));
        for (word, bit) in [(2, 1 << 62), (2, 1 << 63)] {
            let mut large = film.clone();
            let mut words = large.sums[0].light[1].words();
            words[word] ^= bit;
            large.sums[0].light[1] = ExactSum::from_words(words);
            assert_eq!(Film::read(&bytes(&large)), Err(FilmError::Sums));
        }
        let late = Film { first: u32::MAX, ..film };
        assert_eq!(Film::read(&bytes(&late)), Err(FilmError::Samples));
    }

    #[test]
    fn no_part_of_a_film_is_a_film() {
        for film in [film(), planned(Some(vec![0.5; 6]))] {
            let whole = bytes(&film);
            for end in 0..whole.len() {
                assert_eq!(Film::read(&whole[..end]), Err(FilmError::Short(end)));
            }
            assert_eq!(Film::read(&[whole, vec![0; 3]].concat()), Err(FilmError::Long(3)));
        }
    }

    /// A film that claims more pixels than memory can hold, and one with an unknown quantity.
    #[test]
    fn claims_are_not_believed() {
        let mut huge = bytes(&film());
        huge[8..16].fill(0xff);
        assert_eq!(Film::read(&huge), Err(FilmError::Region));
        huge[..8].fill(0);
        assert_eq!(Film::read(&huge), Err(FilmError::Short(huge.len())));
        let mut many = planned(None);
        many.counts[0] = HALF_B_OFFSET + 1;
        assert_eq!(Film::read(&bytes(&many)), Err(FilmError::Halves));
        let mut unknown = bytes(&film());
        unknown[28] = b'x';
        assert_eq!(Film::read(&unknown), Err(FilmError::Quantity("xlbedo".into())));
        let mut strange = planned(Some(vec![0.5; 6]));
        strange.half_mut(HalfBuffer::Second).first = 7;
        assert_eq!(Film::read(&bytes(&strange)), Err(FilmError::Halves));
        let mut strange = planned(Some(vec![0.5; 6]));
        strange.half_mut(HalfBuffer::Second).light_groups[0] = "sun".into();
        assert_eq!(Film::read(&bytes(&strange)), Err(FilmError::Halves));
    }
}
