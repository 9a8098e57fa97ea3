//! The film: exact sums of samples, so that neither threads nor tiles nor the order in which
//! partial films are merged can change a bit of the image.

mod alpha;
pub mod aov;
mod bytes;
mod display;
mod error_estimate;
mod exact;
pub mod groups;
mod half_buffers;
mod id_coverage;
mod invalid_samples;
mod missing_mass;
mod parts;
mod pixel;
mod region;
mod sums;
mod tile;

pub use self::aov::{Aov, FirstHit};
pub use self::bytes::FilmError;
pub use self::error_estimate::ErrorEstimate;
pub(crate) use self::error_estimate::SquaredErrors;
pub use self::exact::ExactSum;
use self::groups::GroupSums;
pub use self::half_buffers::{HalfBuffer, SamplePlan};
pub use self::id_coverage::{IdCount, IdCoverage};
pub use self::invalid_samples::{InvalidReason, InvalidSample, InvalidSamples};
pub(crate) use self::missing_mass::{ErrorBudget, deviations};
use self::pixel::Moments;
pub use self::pixel::PixelSums;
pub use self::region::Region;
use self::sums::RadianceSums;
pub use self::tile::Tile;

/// Sums of the samples of a rectangle of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    region: Region,
    /// Index of the first sample of each pixel.
    first: u32,
    /// Number of samples of each pixel. Separate from the sums, so that the memory of sums of
    /// black pixels is never touched.
    counts: Vec<u32>,
    sums: Vec<RadianceSums>,
    /// Quantities kept besides radiance, and their sums for each pixel.
    aovs: Vec<Aov>,
    aov_sums: Vec<ExactSum>,
    /// Ids for each pixel and each quantity that counts ids.
    ids: Vec<IdCoverage>,
    /// Names of the light groups, and the radiance of each for each pixel.
    light_groups: Vec<String>,
    group_sums: Vec<GroupSums>,
    invalid_samples: InvalidSamples,
    /// Luminance removed by clamping.
    removed: ExactSum,
    /// See [`Self::with_half_buffers`].
    second: Option<Box<Film>>,
    /// Target number of samples of each pixel, with an error target.
    plan: Option<SamplePlan>,
}

impl Film {
    /// Creates a film without samples.
    pub fn new(region: Region) -> Self {
        Self::with_aovs(region, &[])
    }

    /// Creates a film without samples that also keeps these quantities.
    pub fn with_aovs(region: Region, aovs: &[Aov]) -> Self {
        let aov_sums = region.area() * aov::sums_per_pixel(aovs);
        Self {
            region,
            first: 0,
            counts: vec![0; region.area()],
            sums: bytemuck::zeroed_vec(region.area()),
            aovs: aovs.to_vec(),
            aov_sums: bytemuck::zeroed_vec(aov_sums),
            ids: vec![IdCoverage::default(); region.area() * aov::ids(aovs).count()],
            light_groups: Vec::new(),
            group_sums: Vec::new(),
            invalid_samples: InvalidSamples::default(),
            removed: ExactSum::default(),
            second: None,
            plan: None,
        }
    }

    /// Adds light groups with these names.
    ///
    /// # Panics
    /// If the film has samples.
    pub fn with_light_groups(self, names: &[String]) -> Self {
        assert_eq!(self.samples(), 0, "all samples of a film are in parts, or none");
        let group_sums = bytemuck::zeroed_vec(self.region.area() * names.len());
        let second = self.second.map(|second| Box::new(second.with_light_groups(names)));
        Self { light_groups: names.to_vec(), group_sums, second, ..self }
    }

    /// Returns true if both films have the same channels and number of half buffers.
    pub fn has_same_layout(&self, other: &Self) -> bool {
        (&self.aovs, &self.light_groups, self.has_half_buffers())
            == (&other.aovs, &other.light_groups, other.has_half_buffers())
    }

    /// Names of the light groups.
    pub fn light_groups(&self) -> &[String] {
        &self.light_groups
    }

    /// Sets the index of the first sample; earlier samples belong to another film.
    ///
    /// # Panics
    /// If the film has samples.
    pub fn starting_at(self, first: u32) -> Self {
        assert_eq!(self.samples(), 0, "samples of a film follow one another");
        Self { first, ..self }
    }

    /// Index of the first sample of each pixel.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Pixels of the film.
    pub fn region(&self) -> Region {
        self.region
    }

    /// Quantities kept besides radiance.
    pub fn aovs(&self) -> &[Aov] {
        &self.aovs
    }

    /// Returns the largest number of samples of a pixel.
    pub fn max_samples(&self) -> u32 {
        self.pixels().map(|pixel| pixel.count()).max().unwrap_or(0)
    }

    /// Returns the number of samples per pixel, or `None` if pixels differ.
    pub fn uniform_spp(&self) -> Option<u32> {
        let mut counts = self.pixels().map(|pixel| pixel.count());
        let first = counts.next()?;
        counts.all(|n| n == first).then_some(first)
    }

    #[inline]
    fn index(&self, x: u32, y: u32) -> usize {
        (y - self.region.y) as usize * self.region.width as usize + (x - self.region.x) as usize
    }

    /// Returns the sums of a pixel, which must be inside of the region.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> PixelSums {
        self.pixel_at(self.index(x, y))
    }

    /// Returns the sums of a pixel by its index.
    #[inline]
    fn pixel_at(&self, i: usize) -> PixelSums {
        let own = |film: &Self| Moments { sums: film.sums[i], count: film.counts[i] };
        PixelSums::new(own(self), self.second.as_deref().map(own))
    }

    /// Returns the sums of all pixels, in rows from the top.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = PixelSums> {
        (0..self.region.area()).map(|i| self.pixel_at(i))
    }

    /// Returns the rejected samples of all half buffers.
    pub fn invalid_samples(&self) -> InvalidSamples {
        let mut all = self.invalid_samples.clone();
        if let Some(second) = &self.second {
            all.merge(&second.invalid_samples);
        }
        all
    }

    /// Adds rejected samples.
    pub fn add_invalid_samples(&mut self, invalid_samples: &InvalidSamples) {
        self.invalid_samples.merge(invalid_samples);
    }

    /// Adds luminance removed by clamping.
    pub fn add_clamped(&mut self, luminance: ExactSum) {
        self.removed.merge(luminance);
    }

    /// Returns the total luminance of all samples, and the luminance removed from them by clamping.
    pub fn luminance(&self) -> (f64, f64) {
        let sum = |p: PixelSums| p.luminance().0 * f64::from(p.count());
        let mut removed = self.removed;
        removed.merge(self.second.as_ref().map(|half| half.removed).unwrap_or_default());
        (self.pixels().map(sum).sum(), removed.value())
    }

    /// Returns an estimate of the relative root mean square error of the luminance:
    /// √(Σσ²/n) / √(Σy²) over all pixels, with the luminance y of a pixel and the variance σ² of
    /// its n samples. Samples are taken as independent, so the error of low-discrepancy samplers is
    /// overestimated. `None` if a pixel has fewer than two samples, or the image is black.
    pub fn relative_error(&self) -> Option<f64> {
        let add = |(signal, noise): (f64, f64), (mean, error): (f64, f64)| {
            (signal + mean * mean, noise + error * error)
        };
        let (signal, noise) = self.pixels().map(|pixel| pixel.luminance()).fold((0.0, 0.0), add);
        Some((noise / signal).sqrt()).filter(|error| error.is_finite())
    }

    /// Divides the film into the tiles of [`Region::tiles`], to which different threads can add
    /// samples. The rejected samples of tiles must be passed to [`Self::add_invalid_samples`], and
    /// luminance removed by clamping to [`Self::add_clamped`].
    pub fn tiles(&mut self, size: u32, shift: [u32; 2]) -> Vec<Tile<'_>> {
        let groups = self.light_groups.len();
        let Self { region, first, counts, sums, aovs, aov_sums, ids, group_sums, .. } = self;
        let per_pixel = aov::sums_per_pixel(aovs);
        let things_per_pixel = aov::ids(aovs).count();
        let tile = |region| Tile::new(region, *first, aovs);
        let mut tiles: Vec<_> = region.tiles(size, shift).into_iter().map(tile).collect();
        let (mut counts, mut sums, mut aov_sums, mut ids) =
            (&mut counts[..], &mut sums[..], &mut aov_sums[..], &mut ids[..]);
        let mut group_sums = &mut group_sums[..];
        for side_by_side in tiles.chunk_by_mut(|a, b| a.region().y == b.region().y) {
            let height = side_by_side.first().map_or(0, |tile| tile.region().height);
            for _ in 0..height {
                for tile in &mut *side_by_side {
                    let width = tile.region().width as usize;
                    let counts = counts.split_off_mut(..width).unwrap_or_default();
                    let sums = sums.split_off_mut(..width).unwrap_or_default();
                    let own = aov_sums.split_off_mut(..per_pixel * width).unwrap_or_default();
                    let seen = ids.split_off_mut(..things_per_pixel * width).unwrap_or_default();
                    let parts = group_sums.split_off_mut(..groups * width).unwrap_or_default();
                    tile.push_row(counts, sums, own, seen, parts);
                }
            }
        }
        tiles
    }

    /// Adds the samples of a film with the same channels, whose region lies inside of this one's.
    /// The sums are the same to the bit in whatever order, and however grouped, partial films are
    /// merged.
    ///
    /// # Panics
    /// If the channels differ, a film has half buffers, or a pixel would have 2³² samples or more.
    pub fn merge(&mut self, other: &Self) {
        assert!(self.has_same_layout(other), "films that are merged keep the same");
        assert!(self.second.is_none() && other.second.is_none(), "halves are not merged");
        let per_pixel = aov::sums_per_pixel(&self.aovs);
        let (ids, groups) = (aov::ids(&self.aovs).count(), self.light_groups.len());
        for (n, [x, y]) in other.region.rows().enumerate() {
            let i = self.index(x, y);
            let own = self.aov_sums[i * per_pixel..].iter_mut().take(per_pixel);
            own.zip(&other.aov_sums[n * per_pixel..]).for_each(|(a, b)| a.merge(*b));
            let own = self.ids[i * ids..].iter_mut().take(ids);
            own.zip(&other.ids[n * ids..]).for_each(|(a, b)| a.merge(b));
            let own = self.group_sums[i * groups..].iter_mut().take(groups).flatten();
            let parts = other.group_sums[n * groups..].iter().flatten();
            own.zip(parts).for_each(|(a, b)| a.merge(*b));
            let count = self.counts[i].checked_add(other.counts[n]);
            self.counts[i] = count.expect("all samples of a pixel are counted by 32 bits");
            self.sums[i].merge(&other.sums[n]);
        }
        self.first = self.first.min(other.first);
        self.invalid_samples.merge(&other.invalid_samples);
        self.removed.merge(other.removed);
    }

    /// Returns the ids that `aov` counts for each pixel, in rows from the top and over all half
    /// buffers. `None` if the film does not keep `aov`, or it does not count ids.
    pub fn id_coverage(&self, aov: Aov) -> Option<impl ExactSizeIterator<Item = IdCoverage>> {
        let place = aov::id_index(&self.aovs, aov)?;
        let per_pixel = aov::ids(&self.aovs).count();
        let of_pixel = move |i: usize| {
            let mut ids = self.ids[i * per_pixel + place].clone();
            if let Some(second) = &self.second {
                ids.merge(&second.ids[i * per_pixel + place]);
            }
            ids
        };
        Some((0..self.region.area()).map(of_pixel))
    }

    /// Total number of samples.
    pub fn samples(&self) -> u64 {
        self.pixels().map(|pixel| u64::from(pixel.count())).sum()
    }
}

#[cfg(test)]
mod tests {
    use pt_math::Spectrum;

    use super::*;

    /// Creates a film of one row from the samples of its pixels.
    fn film(pixels: &[&[Spectrum]]) -> Film {
        let mut film = Film::new(Region::full([pixels.len() as u32, 1]));
        let mut invalid_samples = InvalidSamples::default();
        for tile in &mut film.tiles(2, [0; 2]) {
            let columns = tile.region().x..tile.region().x + tile.region().width;
            columns.for_each(|x| tile.add([x, 0], 3, pixels[x as usize], None));
            invalid_samples.merge(tile.invalid_samples());
        }
        film.add_invalid_samples(&invalid_samples);
        film
    }

    #[test]
    fn mean_and_error_are_those_of_the_textbook() {
        let film = film(&[&[1.0, 2.0, 3.0, 6.0].map(Spectrum::splat)]);
        let (mean, error) = film.pixel(0, 0).luminance();
        assert!((mean - 3.0).abs() < 1e-6);
        assert!((error - (14.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-6, "{error}");
    }

    /// Two pixels with means 3 and 1 and standard errors 1 and 0.
    #[test]
    fn the_error_of_an_image_is_that_of_its_pixels() {
        let grey = |samples: [f32; 2]| samples.map(Spectrum::splat);
        let error = film(&[&grey([2.0, 4.0]), &grey([1.0, 1.0])]).relative_error();
        assert!((error.expect("there are samples") - 0.1f64.sqrt()).abs() < 1e-6, "{error:?}");
        assert_eq!(film(&[&grey([2.0, 4.0]), &[Spectrum::ONE]]).relative_error(), None);
        assert_eq!(film(&[&grey([0.0; 2])]).relative_error(), None);
    }

    /// For samples of the largest radiance, of both signs by filter weights, merged until a pixel
    /// has nearly the largest number of samples: sums and errors match the closed form.
    #[test]
    fn films_hold_the_largest_light_of_all_samples_of_a_pixel() {
        let bright = Spectrum::splat(ExactSum::LIMIT);
        for weights in [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
            let mut film = Film::new(Region::full([1, 1]));
            film.tiles(1, [0; 2])[0].add([0, 0], 0, &[bright; 2], Some(&weights));
            for _ in 0..30 {
                film.merge(&film.clone());
            }
            let n = 2f64.powi(31);
            assert_eq!(film.samples() as f64, n);
            let limit = f64::from(ExactSum::LIMIT);
            let wanted = 0.5 * limit * f64::from(weights[0] + weights[1]);
            assert_eq!(film.pixel(0, 0).mean(), [wanted; 3]);
            let deviation = (limit * limit - wanted * wanted).sqrt();
            let error = film.pixel(0, 0).luminance().1 / limit;
            let wanted = deviation / limit / (n - 1.0).sqrt();
            assert!((error - wanted).abs() < 1e-3 * n.sqrt().recip(), "{error} {wanted}");
        }
    }

    #[test]
    #[should_panic(expected = "32 bits")]
    fn more_samples_than_are_counted_are_not_merged() {
        let mut film = film(&[&[Spectrum::ONE]]);
        for _ in 0..32 {
            film.merge(&film.clone());
        }
    }

    /// The relative error of an image is the same, to the bit, for light that is 2ᵏ times as
    /// bright, as long as all digits of its samples are above 2⁻⁶⁴; below, as far as the image
    /// itself has digits.
    #[test]
    fn relative_errors_do_not_depend_on_how_bright_a_scene_is() {
        let mut random = pt_testing::Random::new(4);
        let sky = |u: f32| if u < 0.5 { 0.0 } else { 0.5 };
        let pixels: Vec<Vec<f32>> = (0..32)
            .map(|i| (0..512).map(|_| sky(random.unit()) + 0.1 * (i % 4) as f32).collect())
            .collect();
        let of = |power: i32| {
            let scaled = |v: &f32| Spectrum::splat(v * 2f32.powi(power));
            let pixels: Vec<Vec<Spectrum>> =
                pixels.iter().map(|samples| samples.iter().map(scaled).collect()).collect();
            let pixels: Vec<&[Spectrum]> = pixels.iter().map(Vec::as_slice).collect();
            film(&pixels).relative_error().expect("there is light")
        };
        let one = of(0);
        assert!(one > 0.02 && one < 0.05, "{one}");
        for power in -62..=48 {
            let off = (of(power) / one - 1.0).abs();
            // A sample has digits down to 2⁻⁶⁴; the least one that is not 0 is 0.1.
            let digits = power - 4 + 64;
            let allowed = if power >= -36 { 0.0 } else { 4.0 * 2f64.powi(-digits) };
            assert!(off <= allowed, "2^{power}: off by {off}, {allowed} are allowed");
        }
    }

    #[test]
    fn what_is_no_number_is_refused_and_located() {
        let one = Spectrum::ONE;
        let film = film(&[
            &[Spectrum::splat(f32::INFINITY), one],
            &[one, one],
            &[],
            &[one, one, Spectrum::rgb(1.0, f32::NAN, 0.0)],
        ]);
        assert_eq!(film.invalid_samples().count(), 2);
        assert_eq!(
            film.invalid_samples().first[1],
            InvalidSample { y: 0, x: 3, sample: 5, reason: InvalidReason::NotANumber }
        );
        let means = [[0.5; 3], [1.0; 3], [0.0; 3], [2.0 / 3.0; 3]];
        assert!(film.pixels().map(|p| p.mean()).eq(means));
        assert_eq!(film.samples(), 7);
    }

    /// Adds samples that are all different.
    fn add(tile: &mut Tile, first: u32) {
        for [x, y] in tile.region().pixels() {
            let sample = |i| Spectrum::rgb(x as f32 * 0.1, y as f32 * 0.3, (first + i) as f32);
            tile.add([x, y], first, &[sample(0), sample(1)], None);
        }
    }

    #[test]
    fn neither_tiles_nor_order_nor_parts_change_the_sums() {
        let whole = Region { x: 3, y: 1, width: 5, height: 3 };
        let [mut all, mut in_tiles, mut merged] = [0; 3].map(|_| Film::new(whole));
        for first in [0, 2] {
            all.tiles(u32::MAX, [0; 2]).iter_mut().for_each(|tile| add(tile, first));
            in_tiles.tiles(2, [1, 0]).iter_mut().rev().for_each(|tile| add(tile, first));
            for region in whole.tiles(2, [0; 2]) {
                let mut part = Film::new(region);
                part.tiles(3, [0; 2]).iter_mut().for_each(|tile| add(tile, first));
                merged.merge(&part);
            }
        }
        assert_eq!(in_tiles, all);
        assert_eq!(merged, all);
        assert_eq!(all.samples(), 4 * 15);
    }

    #[test]
    fn tiles_are_those_of_the_region() {
        let region = Region { x: 7, y: 2, width: 33, height: 9 };
        for size in [1, 4, 8, 33, 40, u32::MAX] {
            let mut film = Film::new(region);
            let tiles = film.tiles(size, [3, 1]);
            assert!(tiles.iter().map(Tile::region).eq(region.tiles(size, [3, 1])), "{size}");
        }
    }
}
