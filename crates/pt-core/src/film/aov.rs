//! Arbitrary output variables (AOVs) that a film keeps besides radiance.

use std::borrow::Cow;

use pt_math::{Spectrum, Vec2, Vec3};
use pt_scene::image::{Channel, Samples};

use super::id_coverage::THINGS_BYTES;
use super::{ExactSum, Film, HalfBuffer, PixelSums};

/// A quantity that is written as an image besides radiance.
///
/// Surface quantities are means over the samples of the pixel that hit a surface, taken at the
/// first surface, and 0 if no sample hits one. Ids are those at the first surface of sample 0, from
/// 1 on, and 0 for none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Directional albedo: fraction of uniform incident light that is scattered towards the camera.
    Albedo,
    /// Shading normal.
    Normal,
    /// Geometric normal, on the side of the shading normal.
    GeometricNormal,
    /// Distance in metres from the origin of the ray.
    Depth,
    /// World-space position in metres.
    Position,
    /// Texture coordinates; barycentric coordinates on each triangle if a mesh has none.
    Uv,
    /// Id of the triangle or sphere.
    Primitive,
    /// Id of the object in the scene; the geometry of light nodes has the last id.
    Object,
    /// Id of the material among those of the compiled scene.
    Material,
    /// Number of samples.
    Samples,
    /// Square of the standard error of the luminance; infinite below two samples.
    Variance,
    /// Number of rejected samples: see [`super::InvalidReason`].
    Refused,
    /// Radiance of the first half buffer.
    HalfA,
    /// Radiance of the second half buffer, which is independent of the first: the image is the mean
    /// of both.
    HalfB,
    /// Ids of the objects that the samples of a pixel hit, with the number of samples of each: see
    /// [`super::IdCoverage`].
    CryptomatteObject,
    /// Ids of the materials of the scene that the samples of a pixel hit, with the number of
    /// samples of each.
    CryptomatteMaterial,
    /// Coverage: see [`Film::alpha`].
    Alpha,
    /// Motion of the surface in the image while the shutter is open, in pixels to the right and
    /// down: see [`crate::RenderScene::image_motion`].
    Motion,
}

/// First surface that a sample hits.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// See [`Aov::Albedo`].
    pub albedo: Spectrum,
    /// Shading normal.
    pub normal: Vec3,
    /// Geometric normal.
    pub geometric_normal: Vec3,
    /// Distance along the ray.
    pub depth: f32,
    /// World-space position.
    pub position: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// See [`Aov::Motion`].
    pub motion: Vec2,
    /// Index of the primitive.
    pub primitive: u32,
    /// Index of the object.
    pub object: u32,
    /// Index of the material in the compiled scene.
    pub material: u32,
    /// Index of the material in the source scene; `None` for objects without a material.
    pub scene_material: Option<u32>,
}

/// Source of the values of a channel.
enum ChannelSource {
    /// Means over samples; the channels are the first elements.
    Mean(fn(&FirstHit) -> [f32; 3]),
    /// Id at the first surface of sample 0.
    Id(fn(&FirstHit) -> u32),
    /// Real number computed from the sums that every film has.
    Film(fn(PixelSums) -> f32),
    /// Mean radiance of one half buffer.
    Half(HalfBuffer),
    /// Integer computed from the sums that every film has.
    Count(fn(PixelSums) -> u32),
    /// Number of rejected samples.
    Refused,
    /// Ids of all samples, counted by [`super::IdCoverage`].
    Thing(fn(&FirstHit) -> u32),
    /// Coverage of all samples.
    Coverage,
}

const RGB: &[&str] = &["R", "G", "B"];
const XYZ: &[&str] = &["X", "Y", "Z"];

impl Aov {
    /// Names of all quantities, in the order of the variants.
    pub const NAMES: [(&'static str, Self); 18] = [
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
        ("motion", Self::Motion),
    ];

    /// Returns the quantity with this name, or `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|&(_, aov)| aov)
    }

    /// Returns the name of the quantity. Its channels are named `NAME.SUFFIX`, with a letter or a
    /// word as the suffix.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }

    /// Returns the suffixes of its channels and the source of their values.
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
            Self::Motion => {
                (&["X", "Y"], ChannelSource::Mean(|hit| [hit.motion.x, hit.motion.y, 0.0]))
            }
        }
    }

    /// Returns true if half precision suffices for its values: for colours and directions.
    fn half_suffices(self) -> bool {
        matches!(self, Self::Albedo | Self::Normal | Self::GeometricNormal)
    }

    /// Returns true if it requires a film with half buffers.
    pub fn is_of_half(self) -> bool {
        matches!(self.source().1, ChannelSource::Half(_))
    }

    /// Returns the number of sums per pixel that a film keeps for it.
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

    /// Returns the id that it counts, or `None` if it counts no ids.
    fn id(self) -> Option<fn(&FirstHit) -> u32> {
        match self.source().1 {
            ChannelSource::Thing(number) => Some(number),
            _ => None,
        }
    }
}

/// Returns the number of sums per pixel that a film keeps for these quantities. If there are any,
/// one more sum holds the number of samples that hit a surface.
pub(super) fn sums_per_pixel(aovs: &[Aov]) -> usize {
    let sums: usize = aovs.iter().map(|aov| aov.sums()).sum();
    if sums == 0 { 0 } else { sums + 1 }
}

/// Returns true if one of the quantities is sampled at surfaces.
pub(super) fn keeps_surfaces(aovs: &[Aov]) -> bool {
    let of_surfaces = |aov: &Aov| {
        matches!(
            aov.source().1,
            ChannelSource::Mean(_) | ChannelSource::Id(_) | ChannelSource::Thing(_)
        )
    };
    aovs.iter().any(of_surfaces)
}

/// Returns, for each of the quantities that count ids, the id of a hit.
pub(super) fn ids(aovs: &[Aov]) -> impl Iterator<Item = fn(&FirstHit) -> u32> {
    aovs.iter().filter_map(|aov| aov.id())
}

/// Returns the index of `aov` among the quantities that count ids, or `None` if it is none of them.
pub(super) fn id_index(aovs: &[Aov], aov: Aov) -> Option<usize> {
    aovs.iter().filter(|aov| aov.id().is_some()).position(|other| *other == aov)
}

/// Returns the index of the first sum of `aov` among the sums of a pixel, or `None` if it is not
/// kept.
pub(super) fn sum_index(aovs: &[Aov], aov: Aov) -> Option<usize> {
    let before = &aovs[..aovs.iter().position(|other| *other == aov)?];
    Some(1 + before.iter().map(|aov| aov.sums()).sum::<usize>())
}

/// Counts a rejected sample, if [`Aov::Refused`] is kept.
pub(super) fn refuse(aovs: &[Aov], sums: &mut [ExactSum]) {
    if let Some(place) = sum_index(aovs, Aov::Refused) {
        sums[place].add(1.0);
    }
}

/// Returns the number of bytes per pixel that a film needs for these quantities, including images
/// that are large while they are written.
pub fn bytes_per_pixel(aovs: &[Aov]) -> usize {
    sums_per_pixel(aovs) * size_of::<ExactSum>() + ids(aovs).count() * THINGS_BYTES
}

/// Adds the first surface of a sample to the sums of its pixel. Returns true if all values are
/// finite and within [`ExactSum::LIMIT`]; others count as 0.
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

/// Returns the sums of a film, added over its half buffers.
fn sums_of_halves(film: &Film) -> Cow<'_, [ExactSum]> {
    let Some(second) = &film.second else { return Cow::Borrowed(&film.aov_sums) };
    let both = film.aov_sums.iter().zip(&second.aov_sums).map(|(&a, &b)| {
        let mut sum = a;
        sum.merge(b);
        sum
    });
    Cow::Owned(both.collect())
}

/// Returns the channels of a film's quantities, in their order, except those that count ids and
/// [`Aov::Alpha`], which belongs to the colour channels.
pub fn channels(film: &Film) -> Vec<Channel> {
    let per_pixel = sums_per_pixel(&film.aovs);
    // Without quantities there are no sums.
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
                // Cryptomatte channels need the names of objects, which a film does not have;
                // coverage belongs to the colour channels.
                ChannelSource::Thing(_) | ChannelSource::Coverage => continue,
            };
            let name = format!("{}.{name}", aov.name());
            channels.push(Channel { name, samples, half_suffices: aov.half_suffices() });
        }
        first += aov.sums();
    }
    channels
}

/// Returns means of a quantity with three real channels over all samples of each pixel, or `None`
/// if the film does not keep it. Samples that hit no surface count as 0, so pixels at the edge of a
/// shape are antialiased.
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
            motion: Vec2::new(i as f32, -1.5),
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

    /// Pixel 0 has three surface hits in four samples, pixel 1 none in the first of two, pixel 2
    /// none at all.
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
        // Three hits over two counted samples; then one over two, and none.
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
        real("motion.X", [4.0 / 3.0, 1.0, 0.0]);
        real("motion.Y", [-1.5, -1.5, 0.0]);
        whole("primitive.id", [101, 0, 0]);
        whole("object.id", [u32::MAX, 0, 0]);
        whole("material.id", [1, 0, 0]);
        whole("samples.count", [2; 3]);
        whole("refused.count", [3, 1, 0]);
        // 3 and 1: the variance of each is 2, that of the mean 1.
        let Samples::Real(variance) = channel(&film, "variance.Y") else { panic!("no numbers") };
        assert!(variance.iter().all(|v| (v - 1.0).abs() < 1e-6), "{variance:?}");
        // Without half buffers, all samples are in the first half.
        real("half_a.R", [2.0; 3]);
        assert_eq!(channels(&film).len(), 3 + 3 + 3 + 1 + 3 + 2 + 2 + 3 + 2 + 1 + 6);
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
