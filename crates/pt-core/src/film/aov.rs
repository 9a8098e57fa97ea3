//! What a film keeps of surfaces, besides light ("arbitrary output variables").

use std::borrow::Cow;

use pt_math::{Spectrum, Vec2, Vec3};
use pt_scene::image::{Channel, Samples};

use super::id_coverage::THINGS_BYTES;
use super::{ExactSum, Film, HalfBuffer, PixelSums};

/// A quantity of which an image is written beside that of the light.
///
/// Those of surfaces are means over the samples of the pixel that see one, at the first surface,
/// and 0 where none does; numbers of things are those of what sample 0 sees, from 1 on, and 0 for
/// nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Share of the light from all around that is scattered towards the camera.
    Albedo,
    /// Shading normal.
    Normal,
    /// Normal of the true surface, on the side of the shading normal.
    GeometricNormal,
    /// Distance in metres from where the ray starts.
    Depth,
    /// Place in the world, in metres.
    Position,
    /// Texture coordinates; where a mesh has none, the place on each of its triangles.
    Uv,
    /// Number of the triangle or sphere.
    Primitive,
    /// Number of the object in the scene; what lights bring with them is the last one.
    Object,
    /// Number of the material among those of the compiled scene.
    Material,
    /// Samples that were taken.
    Samples,
    /// Square of the standard error of the luminance; infinite below two samples.
    Variance,
    /// Samples that were refused: see [`super::InvalidReason`].
    Refused,
    /// Light of the first half of the samples …
    HalfA,
    /// … and of the second, which knows nothing of it: the image is the mean of both.
    HalfB,
    /// Which objects the samples see, and how many see each: see [`super::IdCoverage`].
    CryptomatteObject,
    /// Likewise which materials of the scene.
    CryptomatteMaterial,
    /// Coverage: see [`Film::alpha`].
    Alpha,
}

/// The first surface that a sample sees.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// See [`Aov::Albedo`].
    pub albedo: Spectrum,
    /// Shading normal.
    pub normal: Vec3,
    /// Normal of the true surface.
    pub geometric_normal: Vec3,
    /// Distance along the ray.
    pub depth: f32,
    /// Place in the world.
    pub position: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Number of the primitive, from 0 on.
    pub primitive: u32,
    /// Number of the object, from 0 on.
    pub object: u32,
    /// Number of the material, from 0 on.
    pub material: u32,
    /// Number of the material in the scene, from 0 on; `None` is the one of objects without any.
    pub scene_material: Option<u32>,
}

/// How an image gets its values.
enum ChannelSource {
    /// Means of numbers, the first ones of which are the channels.
    Mean(fn(&FirstHit) -> [f32; 3]),
    /// A number of sample 0.
    Id(fn(&FirstHit) -> u32),
    /// From what the film knows in any case.
    Film(fn(PixelSums) -> f32),
    /// The mean light of one of its halves.
    Half(HalfBuffer),
    /// Likewise, a whole number.
    Count(fn(PixelSums) -> u32),
    /// The number of samples that were refused.
    Refused,
    /// Numbers of all samples, which [`super::IdCoverage`] counts.
    Thing(fn(&FirstHit) -> u32),
    /// The coverage of all samples.
    Coverage,
}

const RGB: &[&str] = &["R", "G", "B"];
const XYZ: &[&str] = &["X", "Y", "Z"];

impl Aov {
    /// Each with its name for users.
    pub const NAMES: [(&'static str, Self); 17] = [
        ("albedo", Self::Albedo),
        ("normal", Self::Normal),
        ("geometric_normal", Self::GeometricNormal),
        ("depth", Self::Depth),
        ("position", Self::Position),
        ("uv", Self::Uv),
        ("primitive", Self::Primitive),
        ("object", Self::Object),
        ("material", Self::Material),
        ("samples", Self::Samples),
        ("variance", Self::Variance),
        ("refused", Self::Refused),
        ("half_a", Self::HalfA),
        ("half_b", Self::HalfB),
        ("cryptomatte_object", Self::CryptomatteObject),
        ("cryptomatte_material", Self::CryptomatteMaterial),
        ("alpha", Self::Alpha),
    ];

    /// The one of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|&(_, aov)| aov)
    }

    /// Its name for users; its channels are called so, with a dot and a letter or word behind.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }

    /// The names of its channels behind the dot, and where their values come from.
    fn source(self) -> (&'static [&'static str], ChannelSource) {
        match self {
            Self::Albedo => (RGB, ChannelSource::Mean(|hit| hit.albedo.to_array())),
            Self::Normal => (XYZ, ChannelSource::Mean(|hit| hit.normal.to_array())),
            Self::GeometricNormal => {
                (XYZ, ChannelSource::Mean(|hit| hit.geometric_normal.to_array()))
            }
            Self::Depth => (&["Z"], ChannelSource::Mean(|hit| [hit.depth; 3])),
            Self::Position => (XYZ, ChannelSource::Mean(|hit| hit.position.to_array())),
            Self::Uv => (&["U", "V"], ChannelSource::Mean(|hit| [hit.uv.x, hit.uv.y, 0.0])),
            Self::Primitive => (&["id"], ChannelSource::Id(|hit| hit.primitive)),
            Self::Object => (&["id"], ChannelSource::Id(|hit| hit.object)),
            Self::Material => (&["id"], ChannelSource::Id(|hit| hit.material)),
            Self::Samples => (&["count"], ChannelSource::Count(|pixel| pixel.count())),
            Self::Variance => {
                (&["Y"], ChannelSource::Film(|pixel| pixel.luminance().1.powi(2) as f32))
            }
            Self::Refused => (&["count"], ChannelSource::Refused),
            Self::HalfA => (RGB, ChannelSource::Half(HalfBuffer::First)),
            Self::HalfB => (RGB, ChannelSource::Half(HalfBuffer::Second)),
            Self::CryptomatteObject => (&[], ChannelSource::Thing(|hit| hit.object)),
            Self::CryptomatteMaterial => {
                (&[], ChannelSource::Thing(|hit| hit.scene_material.map_or(0, |number| number + 1)))
            }
            Self::Alpha => (&[], ChannelSource::Coverage),
        }
    }

    /// Returns true if 16 bits hold its values well: those of colours and directions.
    fn half_suffices(self) -> bool {
        matches!(self, Self::Albedo | Self::Normal | Self::GeometricNormal)
    }

    /// Returns true if a film needs two halves for it.
    pub fn is_of_half(self) -> bool {
        matches!(self.source().1, ChannelSource::Half(_))
    }

    /// Sums that a film keeps of it per pixel.
    fn sums(self) -> usize {
        match self.source() {
            (channels, ChannelSource::Mean(_)) => channels.len(),
            (_, ChannelSource::Id(_) | ChannelSource::Refused | ChannelSource::Coverage) => 1,
            (
                _,
                ChannelSource::Film(_)
                | ChannelSource::Count(_)
                | ChannelSource::Half(_)
                | ChannelSource::Thing(_),
            ) => 0,
        }
    }

    /// Which thing it counts, if it counts things.
    fn id(self) -> Option<fn(&FirstHit) -> u32> {
        match self.source().1 {
            ChannelSource::Thing(number) => Some(number),
            _ => None,
        }
    }
}

/// Returns the number of sums that a film keeps per pixel: if any, one more for the number of
/// samples that see a surface.
pub(super) fn sums_per_pixel(aovs: &[Aov]) -> usize {
    let sums: usize = aovs.iter().map(|aov| aov.sums()).sum();
    if sums == 0 { 0 } else { sums + 1 }
}

/// Returns true if some are of surfaces, and not all of samples.
pub(super) fn keeps_surfaces(aovs: &[Aov]) -> bool {
    let of_surfaces = |aov: &Aov| {
        matches!(
            aov.source().1,
            ChannelSource::Mean(_) | ChannelSource::Id(_) | ChannelSource::Thing(_)
        )
    };
    aovs.iter().any(of_surfaces)
}

/// For each of them that counts things, which one it counts where a surface is seen.
pub(super) fn ids(aovs: &[Aov]) -> impl Iterator<Item = fn(&FirstHit) -> u32> {
    aovs.iter().filter_map(|aov| aov.id())
}

/// The place of one among those that count things, if it is one of them.
pub(super) fn id_index(aovs: &[Aov], aov: Aov) -> Option<usize> {
    aovs.iter().filter(|aov| aov.id().is_some()).position(|other| *other == aov)
}

/// The place of the first sum of one among those of a pixel, if it is kept.
pub(super) fn sum_index(aovs: &[Aov], aov: Aov) -> Option<usize> {
    let before = &aovs[..aovs.iter().position(|other| *other == aov)?];
    Some(1 + before.iter().map(|aov| aov.sums()).sum::<usize>())
}

/// Counts a sample that is refused.
pub(super) fn refuse(aovs: &[Aov], sums: &mut [ExactSum]) {
    if let Some(place) = sum_index(aovs, Aov::Refused) {
        sums[place].add(1.0);
    }
}

/// Bytes that a film needs per pixel for these, and their images while they are written where those
/// are large.
pub fn bytes_per_pixel(aovs: &[Aov]) -> usize {
    sums_per_pixel(aovs) * size_of::<ExactSum>() + ids(aovs).count() * THINGS_BYTES
}

/// Adds the surface that a sample sees to the sums of its pixel. What is no number counts as 0;
/// returns whether all are numbers.
pub(super) fn add(aovs: &[Aov], sums: &mut [ExactSum], sample: u32, hit: &FirstHit) -> bool {
    let Some((hits, mut rest)) = sums.split_first_mut() else { return true };
    hits.add(1.0);
    let mut are_numbers = true;
    for aov in aovs {
        let (own, others) = rest.split_at_mut(aov.sums());
        match aov.source().1 {
            ChannelSource::Mean(values) => {
                for (sum, value) in own.iter_mut().zip(values(hit)) {
                    if value.abs() <= ExactSum::LIMIT {
                        sum.add(value);
                    } else {
                        are_numbers = false;
                    }
                }
            }
            ChannelSource::Id(id) if sample == 0 => own[0].add_f64(f64::from(id(hit)) + 1.0),
            _ => {}
        }
        rest = others;
    }
    are_numbers
}

/// The sums of a film, or those of its two halves together.
fn sums_of_halves(film: &Film) -> Cow<'_, [ExactSum]> {
    let Some(second) = &film.second else { return Cow::Borrowed(&film.aov_sums) };
    let both = film.aov_sums.iter().zip(&second.aov_sums).map(|(&a, &b)| {
        let mut sum = a;
        sum.merge(b);
        sum
    });
    Cow::Owned(both.collect())
}

/// The images of a film's quantities, in its order, without those that count things and without
/// [`Aov::Alpha`], which belongs to the colours.
pub fn channels(film: &Film) -> Vec<Channel> {
    let per_pixel = sums_per_pixel(&film.aovs);
    // Where nothing is kept, there is nothing to find.
    let all_sums = sums_of_halves(film);
    let sums = |i: usize| all_sums.get(i * per_pixel..).unwrap_or_default();
    let pixels = || film.pixels().enumerate();
    let mut channels = Vec::new();
    let mut first = 1;
    for aov in &film.aovs {
        let (names, source) = aov.source();
        for (channel, name) in names.iter().enumerate() {
            let at = first + channel;
            let mean = |i: usize| {
                let hits = sums(i)[0].value().max(1.0);
                (sums(i)[at].value() / hits) as f32
            };
            let samples = match source {
                ChannelSource::Mean(_) => Samples::Real(pixels().map(|(i, _)| mean(i)).collect()),
                ChannelSource::Id(_) | ChannelSource::Refused => {
                    Samples::Whole(pixels().map(|(i, _)| sums(i)[at].value() as u32).collect())
                }
                ChannelSource::Film(of) => Samples::Real(pixels().map(|(_, p)| of(p)).collect()),
                ChannelSource::Count(of) => Samples::Whole(pixels().map(|(_, p)| of(p)).collect()),
                ChannelSource::Half(half) => Samples::Real(
                    film.moments(half).map(|moments| moments.mean()[channel] as f32).collect(),
                ),
                // Their images are of names, which a film does not know,
                // and coverage belongs to the colours.
                ChannelSource::Thing(_) | ChannelSource::Coverage => continue,
            };
            let name = format!("{}.{name}", aov.name());
            channels.push(Channel { name, samples, half_suffices: aov.half_suffices() });
        }
        first += aov.sums();
    }
    channels
}

/// Means of a quantity with three real channels over all samples of each pixel, in which those that
/// see no surface are 0, as is their light: at the edge of a shape, what is seen of it. `None` if
/// the film does not keep it.
pub fn means_of_all_samples(film: &Film, aov: Aov) -> Option<Vec<[f32; 3]>> {
    let first = sum_index(&film.aovs, aov)?;
    let (channels, ChannelSource::Mean(_)) = aov.source() else { return None };
    if channels.len() != 3 {
        return None;
    }
    let all_sums = sums_of_halves(film);
    let pixels = all_sums.chunks_exact(sums_per_pixel(&film.aovs)).zip(film.pixels());
    let mean = |sums: &[ExactSum], count: u32| {
        [0, 1, 2].map(|c| (sums[first + c].value() / f64::from(count.max(1))) as f32)
    };
    Some(pixels.map(|(sums, pixel)| mean(sums, pixel.count())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{InvalidSamples, Region};

    fn hit(i: u32) -> FirstHit {
        let v = Vec3::splat(i as f32);
        FirstHit {
            albedo: Spectrum::rgb(0.25, 0.5, i as f32),
            normal: -v,
            geometric_normal: Vec3::X,
            depth: 2.0 * i as f32,
            position: Vec3::new(f32::NAN, f32::INFINITY, 1.0),
            uv: Vec2::new(0.5, i as f32),
            primitive: 100 + i,
            object: u32::MAX - 1,
            material: 0,
            scene_material: None,
        }
    }

    fn channel(film: &Film, name: &str) -> Samples {
        let all = channels(film);
        all.into_iter().find(|c| c.name == name).unwrap_or_else(|| panic!("no {name}")).samples
    }

    fn of_names() -> Vec<Aov> {
        Aov::NAMES.into_iter().map(|(_, aov)| aov).collect()
    }

    #[test]
    fn names_are_those_of_their_quantities() {
        for (name, aov) in Aov::NAMES {
            assert_eq!((Aov::from_name(name), aov.name()), (Some(aov), name));
        }
        assert_eq!(Aov::from_name("shadow"), None);
    }

    /// Pixel 0 sees three surfaces in four samples, pixel 1 none in the first of two, pixel 2
    /// nothing.
    #[test]
    fn means_are_of_the_samples_that_see_a_surface_and_numbers_of_sample_0() {
        let mut film = Film::with_aovs(Region::full([3, 1]), &of_names());
        let mut invalid_samples = InvalidSamples::default();
        for tile in &mut film.tiles(2, [0; 2]) {
            let r = tile.region();
            for x in r.x..r.x + r.width {
                tile.add([x, 0], 0, &[Spectrum::splat(3.0), Spectrum::splat(1.0)], None);
                match x {
                    0 => [0, 1, 3].map(|i| tile.add_aovs([0, 0], i, &hit(i))).len(),
                    1 => [1].map(|i| tile.add_aovs([1, 0], i, &hit(i))).len(),
                    _ => 0,
                };
            }
            invalid_samples.merge(tile.invalid_samples());
        }
        let places: Vec<_> = invalid_samples.first.iter().map(|r| [r.x, r.sample]).collect();
        assert_eq!(places, [[0, 0], [0, 1], [0, 3], [1, 1]], "positions are no numbers");
        let real = |name: &str, values: [f32; 3]| {
            assert_eq!(channel(&film, name), Samples::Real(values.to_vec()), "{name}");
        };
        let whole = |name: &str, values: [u32; 3]| {
            assert_eq!(channel(&film, name), Samples::Whole(values.to_vec()), "{name}");
        };
        real("albedo.R", [0.25, 0.25, 0.0]);
        let of_all = |aov| means_of_all_samples(&film, aov);
        let albedo = of_all(Aov::Albedo).expect("it is kept");
        // Three samples see a surface of the two that bring light; then one of two, and none.
        assert_eq!(albedo, [[0.375, 0.75, 2.0], [0.125, 0.25, 0.5], [0.0; 3]]);
        assert_eq!(of_all(Aov::Normal).map(|n| n[1]), Some([-0.5; 3]));
        assert_eq!([of_all(Aov::Depth), of_all(Aov::Samples)], [None, None]);
        assert_eq!(means_of_all_samples(&Film::new(Region::full([3, 1])), Aov::Normal), None);
        real("albedo.B", [4.0 / 3.0, 1.0, 0.0]);
        real("normal.Z", [-4.0 / 3.0, -1.0, 0.0]);
        real("geometric_normal.X", [1.0, 1.0, 0.0]);
        real("depth.Z", [8.0 / 3.0, 2.0, 0.0]);
        real("position.X", [0.0; 3]);
        real("position.Z", [1.0, 1.0, 0.0]);
        real("uv.U", [0.5, 0.5, 0.0]);
        real("uv.V", [4.0 / 3.0, 1.0, 0.0]);
        whole("primitive.id", [101, 0, 0]);
        whole("object.id", [u32::MAX, 0, 0]);
        whole("material.id", [1, 0, 0]);
        whole("samples.count", [2; 3]);
        whole("refused.count", [3, 1, 0]);
        // 3 and 1: the variance of each is 2, that of the mean 1.
        let Samples::Real(variance) = channel(&film, "variance.Y") else { panic!("no numbers") };
        assert!(variance.iter().all(|v| (v - 1.0).abs() < 1e-6), "{variance:?}");
        // Without halves, all is the first.
        real("half_a.R", [2.0; 3]);
        assert_eq!(channels(&film).len(), 3 + 3 + 3 + 1 + 3 + 2 + 3 + 2 + 1 + 6);
        assert!(channels(&Film::new(Region::full([3, 1]))).is_empty());
    }

    #[test]
    fn what_the_film_knows_in_any_case_costs_nothing() {
        assert_eq!(bytes_per_pixel(&[Aov::Samples, Aov::Variance]), 0);
        let film = Film::with_aovs(Region::full([2, 1]), &[Aov::Samples]);
        assert_eq!(channel(&film, "samples.count"), Samples::Whole(vec![0; 2]));
        assert_eq!(bytes_per_pixel(&[Aov::Depth, Aov::Normal]), 24 * (1 + 1 + 3));
    }
}
