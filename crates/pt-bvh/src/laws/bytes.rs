//! Trees survive serialization; modified bytes are rejected or harmless.

use proptest::prelude::*;
use pt_math::{Ray, Vec3};
use pt_testing::Random;
use rayon::ThreadPoolBuilder;

use super::Soup;
use super::pieces::needles;
use crate::codec::{VERSION, checksum};
use crate::fuzz::ask;
use crate::{BuildOptions, Builder, Bvh, Quality, ReadError, Sphere};

/// Needles, a small ball, and some spheres.
fn soup(needle_count: u32) -> Soup {
    let mut r = Random::new(41);
    let mut soup = needles(&mut r, needle_count, 1e-2);
    soup.spheres = (0..20).map(|_| Sphere { center: r.in_cube(), radius: 0.1 }).collect();
    soup
}

fn all_options() -> impl Iterator<Item = BuildOptions> {
    let qualities = [Quality::Fast, Quality::Balanced, Quality::High].into_iter();
    let by_quality = qualities.map(|quality| BuildOptions { quality, ..BuildOptions::default() });
    let others = [Builder::Mean, Builder::None].into_iter();
    by_quality.chain(others.map(|builder| BuildOptions { builder, ..BuildOptions::default() }))
}

fn rays(n: usize) -> Vec<Ray> {
    let mut r = Random::new(43);
    let any = (0..n).map(|_| Ray::new(r.in_cube() * 2.0, r.in_cube()));
    let mut rays: Vec<Ray> = any.collect();
    // Coherent rays.
    let window = |r: &mut Random| Ray::new(Vec3::Z * 4.0, r.in_cube() * 0.1 - Vec3::Z);
    rays.extend((0..n).map(|_| window(&mut r)));
    rays
}

#[test]
fn a_tree_that_is_read_is_the_one_that_was_written() {
    let rays = rays(300);
    for soup in [soup(300), Soup::default()] {
        for options in all_options() {
            let bvh = Bvh::build(soup.geometry(), &options).expect("indices are in range");
            let bytes = bvh.to_bytes();
            let read = Bvh::from_bytes(&bytes).expect("nothing was changed");
            assert_eq!(read.to_bytes(), bytes);
            assert_eq!(read.statistics(), bvh.statistics());
            assert_eq!((read.bounds(), read.primitives()), (bvh.bounds(), bvh.primitives()));
            assert_eq!(ask(&read, &rays), ask(&bvh, &rays));
        }
    }
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let soup = soup(20_000);
    for options in all_options() {
        let with_threads = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("they start");
            let bvh = pool.install(|| Bvh::build(soup.geometry(), &options));
            bvh.expect("indices are in range").to_bytes()
        };
        let one = with_threads(1);
        for threads in [2, 3, 7] {
            assert!(with_threads(threads) == one, "{options:?}, {threads} threads");
        }
    }
}

#[test]
fn every_part_of_the_bytes_is_guarded() {
    let bytes = Bvh::build(soup(10).geometry(), &BuildOptions::default()).expect("ok").to_bytes();
    let read = |bytes: &[u8]| Bvh::from_bytes(bytes).map(|_| ());
    for len in 0..bytes.len() {
        assert!(read(&bytes[..len]).is_err(), "{len} of {} bytes", bytes.len());
    }
    for i in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[i] ^= 1 << (i % 8);
        let expected = match i {
            0..8 => ReadError::Mark,
            8..12 => ReadError::Version { found: VERSION ^ (1 << (i % 8) << (8 * (i - 8))) },
            _ => ReadError::Checksum,
        };
        assert_eq!(read(&changed), Err(expected), "byte {i}");
    }
}

/// Modifies some of the bytes, and updates the checksum.
fn mutant(bytes: &[u8], r: &mut Random) -> Vec<u8> {
    let mut changed = bytes[..bytes.len() - 8].to_vec();
    for _ in 0..=r.below(3) {
        // Numbers of four bytes, often at the front.
        let words = if r.below(3) == 0 { 40 } else { changed.len() / 4 };
        let at = 4 * r.below(words);
        let word = match r.below(6) {
            0 => r.bits() as u32,
            1 => r.below(20) as u32,
            2 => u32::MAX - r.below(3) as u32,
            3 => [f32::NAN, f32::INFINITY, -1e30, 0.0][r.below(4)].to_bits(),
            4 => [1u32 << 31, 1 << 30][r.below(2)] | r.below(20) as u32,
            _ => u32::from_le_bytes([0, 1, 2, 3].map(|k| changed[at + k])) ^ 1 << r.below(32),
        };
        changed[at..at + 4].copy_from_slice(&word.to_le_bytes());
    }
    if r.below(8) == 0 {
        changed.truncate(r.below(changed.len()));
    }
    if r.below(8) == 0 {
        changed.extend((0..r.below(40)).map(|_| 0));
    }
    let sum = checksum(&changed);
    changed.extend(sum.to_le_bytes());
    changed
}

#[test]
fn twenty_thousand_mutants_do_no_harm() {
    let soup = soup(20);
    let rays = rays(24);
    let mut r = Random::new(47);
    let mut accepted = 0;
    for options in all_options() {
        let bvh = Bvh::build(soup.geometry(), &options).expect("indices are in range");
        let bytes = bvh.to_bytes();
        for _ in 0..4000 {
            let Ok(mut mutant) = Bvh::from_bytes(&mutant(&bytes, &mut r)) else { continue };
            accepted += 1;
            let exists = |hit: &crate::Hit| (hit.primitive as usize) < mutant.primitives();
            assert!(ask(&mutant, &rays).iter().flatten().all(exists));
            // An error if the counts differ.
            if mutant.refit(soup.geometry()).is_ok() {
                ask(&mutant, &rays);
            }
        }
    }
    // Most changes are to coordinates, and leave a valid tree.
    assert!((5000..19_000).contains(&accepted), "{accepted}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Bvh::from_bytes(&bytes).is_err());
        // With correct mark, version and checksum.
        let mut dressed = b"pt-bvh\r\n\x01\0\0\0".to_vec();
        dressed.extend(bytes);
        let sum = checksum(&dressed);
        dressed.extend(sum.to_le_bytes());
        prop_assert!(Bvh::from_bytes(&dressed).is_err());
    }
}
