//! Provenance metadata of images, from which they are rendered again.

use crate::common::{Folder, SCENE};

#[test]
fn images_say_how_they_were_made() {
    let folder = Folder::new();
    let args = "-r 20 15 -s 8 --seed 3 -t 1";
    folder.succeed(&format!("{args} -f a.exr SCENE"));
    folder.succeed(&format!("{args} -f a.png --png-bits 16 SCENE"));
    let of = |name: &str| folder.succeed(&format!("info {name}")).out;
    for (name, words) in
        [("a.exr", "-f a.exr"), ("a.png", "-f a.png --png-bits 16"), ("a.exr.film", "-f a.exr")]
    {
        let reported = of(name);
        for want in [
            format!("version                                 {}", env!("CARGO_PKG_VERSION")),
            "0 to 8, 2400 in all, 8.0 per pixel".into(),
            "samples refused                         none".into(),
            format!("pathtracer {args} {words} {SCENE}"),
            "seed                                    3".into(),
            "file cornell.dae".into(),
        ] {
            assert!(reported.contains(&want), "{name} does not say {want}: {reported}");
        }
    }
    let hash = |name: &str| {
        let reported = of(name);
        reported.lines().find_map(|line| line.strip_prefix("hash of the film ").map(str::to_owned))
    };
    assert_eq!(hash("a.exr"), hash("a.png"), "of the same samples");
    assert_eq!(hash("a.exr"), hash("a.exr.film"));
    folder.succeed("-r 20 15 -s 8 --seed 4 -f b.png SCENE");
    assert_ne!(hash("b.png"), hash("a.png"));
    let json = folder.succeed("info a.png --json").out;
    assert!(json.starts_with("{\"version\":"), "{json}");
}

#[test]
fn receipts_can_be_short() {
    let folder = Folder::new();
    let render =
        |name: &str, more: &str| folder.succeed(&format!("-r 20 15 -s 8 -f {name} {more} SCENE"));
    render("a.png", "--receipt stable");
    render("b.png", "--receipt stable -t 3 --tile-size 5");
    assert!(folder.read("a.png") == folder.read("b.png"), "files of the same image are equal");
    let reported = folder.succeed("info a.png").out;
    assert!(reported.contains("seed") && !reported.contains("seconds"), "{reported}");
    render("none.png", "--receipt none");
    for command in ["info none.png", "rerender none.png", "rerender a.png", "info missing.png"] {
        let run = folder.run(command);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(command.split(' ').nth(1).unwrap()), "{run:?}");
    }
}

/// Renders with many kinds of options are reproduced from their metadata.
#[test]
fn images_are_made_again_to_the_bit() {
    let folder = Folder::new();
    std::fs::copy(SCENE, folder.path("scene.dae")).expect("there is room");
    for (name, args) in [
        ("a.png", "-s 5 --png-bits 16"),
        ("b.exr", "-s 40 -a 8 0.2 --aov depth,object --filter mitchell"),
        ("c.exr", "-s 9 --sampler zsobol --path-reuse 2"),
        ("d.png", "--cs184 -l 2 -m 3"),
    ] {
        folder.succeed(&format!("-r 20 15 {args} -f {name} scene.dae"));
        let run = folder.succeed(&format!("rerender {name} -t 3"));
        assert!(run.err.contains(&format!("{name} is the same to the bit")), "{run:?}");
        let again = name.replace('.', "_again.");
        assert_eq!(folder.image(&again), folder.image(name), "{args}");
        folder.succeed(&format!("rerender {again} -q --force -f third{}", &name[1..]));
    }
    for (part, samples) in [("a", "0..7"), ("b", "7..16")] {
        folder.succeed(&format!("-r 20 15 --samples {samples} -f {part}.film scene.dae"));
    }
    folder.succeed("merge a.film b.film -f merged.exr");
    folder.succeed("rerender merged.exr");
}

#[test]
fn what_has_changed_is_not_made_again() {
    let folder = Folder::new();
    std::fs::copy(SCENE, folder.path("scene.dae")).expect("there is room");
    folder.succeed("-r 20 15 -s 5 -f a.png scene.dae");
    folder.succeed("-r 20 15 -s 5 --seed 1 -f b.png scene.dae");
    for (args, why) in [
        ("rerender a.png -f a.png", "found the image itself"),
        ("rerender a.png -f b.exr", "expected that of a.png"),
        ("rerender a.film", "a.film"),
    ] {
        let run = folder.run(args);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(why), "{run:?}");
    }
    // Changes the pixels but not the metadata.
    let changed = changed_pixel(&folder);
    folder.write("a.png", changed);
    folder.write("a_again.png", "of the user");
    let run = folder.run("rerender a.png");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("a_again.png: exists already"), "{run:?}");
    assert_eq!(folder.read("a_again.png"), b"of the user");
    let run = folder.run("rerender a.png --force");
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("which were changed or denoised"), "{run:?}");
    let scene = folder.read("scene.dae");
    folder.write("scene.dae", [scene.as_slice(), b"\n"].concat());
    let run = folder.run("rerender b.png");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("scene.dae: "), "{run:?}");
    assert!(!folder.files().contains(&"b_again.png".into()));
}

/// Returns the image file with a changed pixel and its own metadata.
fn changed_pixel(folder: &Folder) -> Vec<u8> {
    use pathtracer::image::{self, SaveOptions};
    let mut image = folder.image("a.png");
    image.pixels[0] = [1.0, 0.0, 1.0];
    let metadata = image::metadata(&folder.path("a.png")).expect("it has some");
    let options = SaveOptions { metadata, ..SaveOptions::default() };
    image::save(&image, &folder.path("changed.png"), &options).expect("there is room");
    folder.read("changed.png")
}

/// Images at different times differ, and are rendered again at their own times.
#[test]
fn the_time_of_animations_is_a_part_of_the_image() {
    let folder = Folder::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/gltf/animated.gltf");
    let at = |time: &str, samples: &str, name: &str| {
        folder.succeed(&format!("-r 20 15 {samples} {time} -f {name} {scene}"));
    };
    at("--time 0.5", "-s 4", "half.exr");
    at("--time 1", "-s 4", "one.exr");
    at("", "-s 4", "rest.exr");
    assert!(folder.image("half.exr") != folder.image("one.exr"));
    assert!(folder.image("half.exr") != folder.image("rest.exr"));
    let run = folder.succeed("rerender half.exr -t 3");
    assert!(run.err.contains("half.exr is the same to the bit"), "{run:?}");
    at("--time 0.5", "--samples 0..2", "a.film");
    at("--time 1", "--samples 2..4", "b.film");
    let run = folder.run("merge a.film b.film -f wrong.exr");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("time of animations: 0.5 before"), "{run:?}");
}
