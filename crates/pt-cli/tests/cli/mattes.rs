//! Cryptomatte channels in image files.

use exr::prelude::{AnyChannels, AttributeValue, FlatSamples, Layer};
use pathtracer::cryptomatte::id_of;
use pathtracer::image;

use crate::common::{Folder, SCENE};

const BOTH: &str = "--aov cryptomatte_object,albedo,cryptomatte_material";

fn layer(folder: &Folder, name: &str) -> Layer<AnyChannels<FlatSamples>> {
    let file = exr::prelude::read_all_flat_layers_from_file(folder.path(name)).expect("it is one");
    file.layer_data.into_iter().next().expect("it has a part")
}

/// Channels of all mattes of a kind: ids and coverages in turn, in 32 bits.
fn planes(layer: &Layer<AnyChannels<FlatSamples>>, kind: &str) -> Vec<Vec<f32>> {
    let names = (0..3).flat_map(|i| ["R", "G", "B", "A"].map(|c| format!("{kind}{i:02}.{c}")));
    let plane = |name: String| {
        let channel = layer.channel_data.list.iter().find(|c| c.name == *name);
        match &channel.unwrap_or_else(|| panic!("no {name}")).sample_data {
            FlatSamples::F32(values) => values.clone(),
            other => panic!("{name}: {other:?}"),
        }
    };
    names.map(plane).collect()
}

/// Returns the number of pixels that an object or material covers.
fn pixels(planes: &[Vec<f32>], name: &str) -> f64 {
    let ranks = planes.as_chunks().0;
    let share = |[ids, shares]: &[Vec<f32>; 2]| {
        let of = ids.iter().zip(shares).filter(|(id, _)| **id == id_of(name));
        of.map(|(_, share)| f64::from(*share)).sum::<f64>()
    };
    ranks.iter().map(share).sum()
}

/// Returns the manifest of the metadata, with ids by name, and checks the kind of the layer.
fn manifest(folder: &Folder, file: &str, key: &str, kind: &str) -> serde_json::Value {
    let metadata = image::metadata(&folder.path(file)).expect("it has metadata");
    let find = |what: &str| {
        let key = format!("cryptomatte/{key}/{what}");
        let found = metadata.iter().find(|(name, _)| *name == key);
        found.unwrap_or_else(|| panic!("no {key} in {metadata:?}")).1.clone()
    };
    assert_eq!(find("name"), kind);
    assert_eq!(find("hash"), "MurmurHash3_32");
    assert_eq!(find("conversion"), "uint32_to_float32");
    serde_json::from_str(&find("manifest")).expect("it is JSON")
}

/// Other channels have 16 bits; tested with each compression that keeps 32 bits.
#[test]
fn mattes_are_in_the_image_with_their_names() {
    let folder = Folder::new();
    let base = format!("-r 40 30 -s 16 {BOTH} SCENE -q");
    folder.succeed(&format!("{base} -f wanted.exr"));
    let wanted = layer(&folder, "wanted.exr");
    for kind in ["CryptoObject", "CryptoMaterial"] {
        let planes = planes(&wanted, kind);
        for compression in ["none", "rle", "zips", "zip", "piz", "b44", "b44a"] {
            let half = "--exr-type half -f half.exr";
            folder.succeed(&format!("{base} {half} --exr-compression {compression}"));
            let half = self::planes(&layer(&folder, "half.exr"), kind);
            assert_eq!(half, planes, "{compression}");
        }
    }
    // First digits of the hashes of the layer names.
    let objects = manifest(&folder, "wanted.exr", "3ae39a5", "CryptoObject");
    let materials = manifest(&folder, "wanted.exr", "be359d6", "CryptoMaterial");
    for (names, kind) in [(&objects, "CryptoObject"), (&materials, "CryptoMaterial")] {
        let planes = planes(&wanted, kind);
        let names = names.as_object().expect("names and numbers");
        let mut all = 0.0;
        for (name, digits) in names {
            assert_eq!(*digits, format!("{:08x}", id_of(name).to_bits()));
            assert!(pixels(&planes, name) > 0.0, "{name} is seen");
            all += pixels(&planes, name);
        }
        // The room is as high as the image and as wide as it is high, except for the pixels beside
        // its walls.
        assert!(all > 800.0 && all < 900.5, "{kind}: {all}");
    }
    assert!(objects.get("floor").is_some() && materials.get("white").is_some(), "{objects}");
    let texts = wanted.attributes.other.values();
    assert_eq!(texts.filter(|text| matches!(text, AttributeValue::Text(_))).count(), 10);
}

/// Names may contain any characters, also those that JSON escapes.
#[test]
fn names_may_be_anything() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(SCENE).expect("it is there");
    let named = text.replace("name=\"floor\"", "name=\"the &quot;floor&quot; \\ café\"");
    assert_ne!(named, text);
    folder.write("scene.dae", named);
    folder.succeed("-r 20 15 -s 4 --aov cryptomatte_object -f out.exr scene.dae -q");
    let objects = manifest(&folder, "out.exr", "3ae39a5", "CryptoObject");
    let name = "the \"floor\" \\ café";
    assert_eq!(objects[name], format!("{:08x}", id_of(name).to_bits()));
    assert!(pixels(&planes(&layer(&folder, "out.exr"), "CryptoObject"), name) > 10.0);
}

/// Parts in any order, a resumed render, and a second render.
#[test]
fn mattes_are_the_same_to_the_bit_however_they_come_about() {
    let folder = Folder::new();
    let all = format!("-r 30 20 -s 40 --receipt stable {BOTH} SCENE -q");
    folder.succeed(&format!("{all} -t 1 -f whole.exr"));
    let want = folder.read("whole.exr");
    folder.succeed(&format!("{all} -t 3 --tile-size 7 -f threads.exr"));
    assert!(folder.read("threads.exr") == want);
    for (name, samples) in [("a", "0..7"), ("b", "7..30"), ("c", "30..40")] {
        folder.succeed(&format!("{all} --samples {samples} -f {name}.film"));
    }
    folder.succeed("merge c.film a.film b.film -f merged.exr");
    assert!(folder.read("merged.exr") == want);
    folder.succeed("merge c.film b.film -f bc.film");
    folder.succeed("merge bc.film a.film -f again.exr");
    assert!(folder.read("again.exr") == want);
    folder.succeed(&format!("-r 30 20 -s 10 --receipt stable {BOTH} SCENE -q -f more.exr"));
    folder.succeed("resume more.exr --spp 40");
    assert!(folder.read("more.exr") == want);
    folder.succeed(&format!("-r 30 20 -s 8 {BOTH} SCENE -q -f once.exr"));
    folder.succeed("rerender once.exr");
}
