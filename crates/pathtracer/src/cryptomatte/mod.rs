//! Cryptomatte: mattes of all objects and of all materials of an image, for compositing programs.
//!
//! A matte is the coverage of each pixel by an object or a material. Each of these has an id, the
//! hash of its name. An image contains, for each pixel, the ids and coverages of the six with the
//! largest coverage, in three layers of four channels: `CryptoObject00.R` is the id of the first,
//! `.G` its coverage, `.B` and `.A` those of the second, and so on. The metadata contain the names.
//!
//! [Friedman & Jones 2015, "Fully Automatic ID Mattes with Support for Motion Blur and
//! Transparency"; Psyop, "Cryptomatte Specification", version 1.2.0]

mod murmur3;
mod names;

use std::cmp::Reverse;
use std::collections::BTreeMap;

pub use names::MatteNames;
pub(crate) use names::{distinct, objects};
use pt_core::Film;
use pt_core::film::{Aov, IdCount};
use pt_scene::image::{Channel, Samples};

/// AOVs with mattes, and the names of their layers.
const LAYERS: [(Aov, &str); 2] =
    [(Aov::CryptomatteObject, "CryptoObject"), (Aov::CryptomatteMaterial, "CryptoMaterial")];

/// Number of ids per pixel, as the specification suggests.
const RANKS: usize = 6;

/// Returns the id of a name: its hash, as the bits of a number that is neither NaN nor infinite, 0
/// or denormal. If the exponent would make it one of these, the last bit of the exponent is
/// inverted. [Cryptomatte Specification, "uint32_to_float32"]
pub fn id_of(name: &str) -> f32 {
    f32::from_bits(finite(murmur3::hash(name.as_bytes(), 0)))
}

fn finite(hash: u32) -> u32 {
    match hash >> 23 & 0xff {
        0 | 0xff => hash ^ 1 << 23,
        _ => hash,
    }
}

/// Returns true if one of these AOVs has mattes.
pub fn is_among(aovs: &[Aov]) -> bool {
    LAYERS.iter().any(|(aov, _)| aovs.contains(aov))
}

/// Returns the channels of all mattes of a film; `names` are those of the objects and materials it
/// counts.
pub fn channels(film: &Film, names: &MatteNames) -> Vec<Channel> {
    kept(film).flat_map(|(aov, layer)| channels_of(film, aov, layer, names)).collect()
}

/// Returns the metadata of an image with these channels: for each kind of mattes the name of its
/// layer, the conversion of names to ids, and the names of all objects or materials that are
/// visible in some pixel.
///
/// # Panics
/// Never: names and ids can be written as JSON.
pub fn metadata(film: &Film, names: &MatteNames) -> Vec<(String, String)> {
    let mut metadata = Vec::new();
    for (aov, layer) in kept(film) {
        let key = &digits(id_of(layer))[..7];
        let manifest = serde_json::to_string(&manifest(film, aov, names));
        for (what, value) in [
            ("name", layer.to_owned()),
            ("hash", "MurmurHash3_32".to_owned()),
            ("conversion", "uint32_to_float32".to_owned()),
            ("manifest", manifest.expect("texts are JSON")),
        ] {
            metadata.push((format!("cryptomatte/{key}/{what}"), value));
        }
    }
    metadata
}

/// Adds to the names of visible objects and materials in the metadata of an image those of another
/// part of it. Other metadata do not change.
///
/// # Panics
/// Never: names and ids can be written as JSON.
pub fn add_names(metadata: &mut [(String, String)], part: &[(String, String)]) {
    let is_manifest = |key: &str| key.starts_with("cryptomatte/") && key.ends_with("/manifest");
    let names = |text: &str| serde_json::from_str::<BTreeMap<String, String>>(text).ok();
    for (key, text) in metadata.iter_mut().filter(|(key, _)| is_manifest(key)) {
        let other = part.iter().find(|(other, _)| other == key);
        if let (Some(mut all), Some(more)) = (names(text), other.and_then(|(_, text)| names(text)))
        {
            all.extend(more);
            *text = serde_json::to_string(&all).expect("texts are JSON");
        }
    }
}

/// Mattes that a film contains.
fn kept(film: &Film) -> impl Iterator<Item = (Aov, &'static str)> {
    LAYERS.into_iter().filter(|(aov, _)| film.aovs().contains(aov))
}

/// Bits of an id in hexadecimal digits.
fn digits(id: f32) -> String {
    format!("{:08x}", id.to_bits())
}

/// Names and ids of all objects or materials that are visible.
fn manifest<'a>(film: &Film, aov: Aov, names: &'a MatteNames) -> BTreeMap<&'a str, String> {
    let names = names.counted_by(aov);
    let mut is_seen = vec![false; names.len()];
    for things in film.id_coverage(aov).into_iter().flatten() {
        for IdCount { number, .. } in things.iter() {
            if let Some(is_seen) = is_seen.get_mut(number as usize) {
                *is_seen = true;
            }
        }
    }
    let seen = names.iter().zip(is_seen).filter(|(_, is_seen)| *is_seen);
    seen.map(|(name, _)| (name.as_str(), digits(id_of(name)))).collect()
}

/// Channels of one kind of mattes: ids and coverages in turn.
fn channels_of(film: &Film, aov: Aov, layer: &str, names: &MatteNames) -> Vec<Channel> {
    let ids: Vec<_> = names.counted_by(aov).iter().map(|name| id_of(name)).collect();
    let plane = |_| Vec::with_capacity(film.region().area());
    let mut planes: Vec<Vec<f32>> = (0..2 * RANKS).map(plane).collect();
    for (things, pixel) in film.id_coverage(aov).into_iter().flatten().zip(film.pixels()) {
        let ranked = ranked(things.iter(), &ids);
        let share = |samples: u64| (samples as f64 / f64::from(pixel.count().max(1))) as f32;
        let ranked = ranked.into_iter().map(|(id, samples)| [id, share(samples)]);
        let values = ranked.chain(std::iter::repeat([0.0; 2])).take(RANKS).flatten();
        planes.iter_mut().zip(values).for_each(|(plane, value)| plane.push(value));
    }
    let channel = |(i, plane): (usize, Vec<f32>)| Channel {
        name: format!("{layer}{:02}.{}", i / 4, ["R", "G", "B", "A"][i % 4]),
        samples: Samples::Real(plane),
        half_suffices: false,
    };
    planes.into_iter().enumerate().map(channel).collect()
}

/// Ids of a pixel with their numbers of samples, in descending order of these and, among equals, by
/// the bits of the id. Equal ids are merged.
fn ranked(things: impl Iterator<Item = IdCount>, ids: &[f32]) -> Vec<(f32, u64)> {
    let of = |seen: IdCount| Some((*ids.get(seen.number as usize)?, u64::from(seen.samples)));
    let mut ranked: Vec<_> = things.filter_map(of).collect();
    ranked.sort_unstable_by_key(|(id, _)| id.to_bits());
    ranked.dedup_by(|next, first| {
        let is_same = next.0 == first.0;
        first.1 += if is_same { next.1 } else { 0 };
        is_same
    });
    ranked.sort_by_key(|(_, samples)| Reverse(*samples));
    ranked
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hashes of all exponents and signs, with a few fractions each, and of many names.
    #[test]
    fn no_number_of_a_thing_is_zero_denormal_infinite_or_none() {
        let exponents = 0..512_u32;
        let hashes = exponents.flat_map(|e| [0, 1, 0x40_0000, 0x7f_ffff].map(|f| e << 23 | f));
        let names = (0..10_000).map(|i| murmur3::hash(format!("thing {i}").as_bytes(), 0));
        for hash in hashes.chain(names) {
            assert!(f32::from_bits(finite(hash)).is_normal(), "{hash:08x}");
            let is_number = f32::from_bits(hash).is_normal();
            assert_eq!(finite(hash) ^ hash, u32::from(!is_number) << 23, "{hash:08x}");
        }
        assert_eq!(id_of("").to_bits(), 1 << 23);
    }

    /// Ids that other programs compute; without the inversion, the second one would be NaN.
    #[test]
    fn names_have_the_numbers_that_others_give_them() {
        assert_eq!(digits(id_of("bunny")), "13851a76");
        assert_eq!(digits(id_of("flowerB.flowerB_petal16.:3106")), "7f2e176b");
    }

    #[test]
    fn things_are_ranked_by_samples_and_then_by_their_numbers() {
        let ids = [3.0, 1.0, 3.0, 0.5, 7.0];
        let seen = [5, 4, 1, 4, 9, 100].into_iter().zip(0..);
        let seen = seen.map(|(samples, number)| IdCount { number, samples });
        // Two names have the same id, and the last number has none.
        assert_eq!(ranked(seen, &ids), [(7.0, 9), (3.0, 6), (0.5, 4), (1.0, 4)]);
    }
}
