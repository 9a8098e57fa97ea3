//! Bodies of the fuzz targets, which tests also run on random bytes. Compiled with the feature
//! `fuzzing` and in tests.

use pt_math::{Ray, Vec3};

use crate::codec::{VERSION, checksum};
use crate::serial::MARK;
use crate::{BuildOptions, Builder, Bvh, Geometry, Hit, Quality, Sphere};

/// Options of builds that give bytes of different kinds.
const WAYS: [(Builder, Quality); 4] = [
    (Builder::Sah, Quality::Balanced),
    (Builder::Sah, Quality::High),
    (Builder::Mean, Quality::Balanced),
    (Builder::None, Quality::Balanced),
];
/// Bytes of an edit: operation, position and value.
const EDIT_BYTES: usize = 7;

/// Reads `data` as a tree: unchanged, and as the content between the version and the checksum. An
/// accepted tree must handle queries, and can be written and read again.
///
/// # Panics
/// If any of this fails.
pub fn bytes(data: &[u8]) {
    read(data);
    read(&with_checksum([&MARK[..], &VERSION.to_le_bytes(), data].concat()));
}

/// Serializes a tree, applies the edits in `data`, and reads the result with a matching checksum.
/// An accepted tree must handle queries, and can be written, read and refitted.
///
/// The first byte of `data` selects the tree; edits of seven bytes each follow. Returns true if the
/// bytes were accepted.
///
/// # Panics
/// If any of this fails.
pub fn mutated(data: &[u8]) -> bool {
    let Some((&first, edits)) = data.split_first() else { return false };
    let (builder, quality) = WAYS[usize::from(first) % WAYS.len()];
    let soup = FuzzGeometry::new(usize::from(first) / WAYS.len());
    let options = BuildOptions { builder, quality, ..BuildOptions::default() };
    let bvh = Bvh::build(soup.geometry(), &options).expect("indices are in range");
    let mut bytes = bvh.to_bytes();
    bytes.truncate(bytes.len() - 8);
    for edit in edits.as_chunks::<EDIT_BYTES>().0 {
        apply(*edit, &mut bytes);
    }
    let Some(mut read) = read(&with_checksum(bytes)) else { return false };
    if read.refit(soup.geometry()).is_ok() {
        ask(&read, &rays());
    }
    true
}

/// Strip of triangles, and spheres.
struct FuzzGeometry {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    spheres: Vec<Sphere>,
}

impl FuzzGeometry {
    /// A strip with `n` vertices, and half as many spheres.
    fn new(n: usize) -> Self {
        let at = |i: usize| {
            let (i, turn) = (i as f32, (i % 8) as f32 - 3.5);
            Vec3::new(turn * 0.2, (i * 0.37).fract() - 0.5, i * 0.03 - 0.5)
        };
        let positions = (0..n).map(at).collect();
        let triangles = (2..n as u32).map(|i| [i - 2, i - 1, i]).collect();
        let sphere = |i| Sphere { center: at(i * 2), radius: 0.01 * (1 + i) as f32 };
        Self { positions, triangles, spheres: (0..n / 2).map(sphere).collect() }
    }

    fn geometry(&self) -> Geometry<'_> {
        Geometry { positions: &self.positions, triangles: &self.triangles, spheres: &self.spheres }
    }
}

/// Changes one number of four bytes, or the length.
fn apply([what, low, high, value @ ..]: [u8; EDIT_BYTES], bytes: &mut Vec<u8>) {
    let (place, value) = (usize::from(u16::from_le_bytes([low, high])), u32::from_le_bytes(value));
    let words = bytes.as_chunks_mut::<4>().0;
    if words.is_empty() {
        return;
    }
    let word = &mut words[place % words.len()];
    let old = u32::from_le_bytes(*word);
    let new = match what % 8 {
        0 => value,
        1 => old ^ value,
        2 => old.wrapping_add(value),
        3 => old.wrapping_sub(value),
        4 => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0][value as usize % 4].to_bits(),
        5 => f32::from_bits(old).next_up().to_bits(),
        6 => return bytes.truncate(place),
        _ => return bytes.extend(value.to_le_bytes()),
    };
    *word = new.to_le_bytes();
}

fn with_checksum(mut content: Vec<u8>) -> Vec<u8> {
    let sum = checksum(&content);
    content.extend(sum.to_le_bytes());
    content
}

/// Parses a tree and checks that it handles queries and round-trips; `None` if the bytes are
/// rejected.
fn read(bytes: &[u8]) -> Option<Bvh> {
    let bvh = Bvh::from_bytes(bytes).ok()?;
    let exists = |hit: &Hit| (hit.primitive as usize) < bvh.primitives();
    assert!(ask(&bvh, &rays()).iter().flatten().all(exists), "a hit on nothing");
    let written = bvh.to_bytes();
    let again = Bvh::from_bytes(&written).expect("what was accepted is accepted again");
    assert!(again.to_bytes() == written, "what was read is not what was written");
    Some(bvh)
}

/// Rays through the whole unit cube, some of them coherent, some in the planes of axes.
fn rays() -> Vec<Ray> {
    let spread = |i: u8| {
        let along = |step: f32| (f32::from(i) * step).fract() - 0.5;
        Vec3::new(along(0.618), along(0.755), along(0.57))
    };
    let across = (0..12).map(|i| Ray::new(spread(i) * 3.0, spread(i + 1)));
    let beside = (0..20).map(|i| Ray::new(Vec3::Z * -3.0, Vec3::Z + spread(i) * 0.1));
    let straight = [Vec3::X, Vec3::NEG_Y, Vec3::Z].map(|d| Ray::to(-d, d, 2.0));
    across.chain(beside).chain(straight).collect()
}

/// Runs all queries, single and batched, and returns the hits.
pub(crate) fn ask(bvh: &Bvh, rays: &[Ray]) -> Vec<Option<Hit>> {
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    bvh.intersect_batch(rays, &mut hits);
    bvh.occluded_batch(rays, &mut occluded);
    for ray in rays {
        std::hint::black_box(bvh.occluded(ray));
        hits.push(bvh.intersect(ray));
    }
    hits
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn trees_that_are_not_changed_are_accepted() {
        for first in 0..=u8::MAX {
            assert!(mutated(&[first]), "{first}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn no_bytes_do_harm(data in prop::collection::vec(any::<u8>(), 0..200)) {
            bytes(&data);
        }

        #[test]
        fn no_change_does_harm(data in prop::collection::vec(any::<u8>(), 0..40)) {
            mutated(&data);
        }
    }
}
