//! Denoising with Open Image Denoise, and behaviour without the library.

use crate::common::{Folder, TINY};

/// Returns true if the library is found; otherwise prints that a test is skipped.
fn is_there(folder: &Folder) -> bool {
    let run = folder.succeed(&format!("{TINY} --denoise -f probe.png SCENE"));
    let is_missing = run.err.contains("Open Image Denoise is not found");
    if is_missing {
        println!("skipped: Open Image Denoise is not found");
    }
    !is_missing
}

#[test]
fn without_the_library_the_image_is_written_as_it_was_rendered() {
    for (name, base) in [("out.png", ""), ("out.exr", "--aov albedo,normal")] {
        let folder = Folder::new();
        let base = format!("{TINY} {base} --receipt none");
        folder.succeed(&format!("{base} -f {name} SCENE"));
        let wanted = folder.read(name);
        let args = format!("{base} --denoise --restart -f {name} {}", crate::common::SCENE);
        let args: Vec<_> = args.split_whitespace().collect();
        let mut command = folder.command(&args);
        command.env("PATHTRACER_OIDN", folder.path("nowhere"));
        let run = crate::common::Run::of(&command.output().unwrap(), name);
        assert_eq!(run.code, Some(0), "{run:?}");
        assert_eq!(run.err.matches("warning: --denoise").count(), 1, "{run:?}");
        for wanted in ["nowhere", "expected the library", "written without denoising"] {
            assert!(run.err.contains(wanted), "{run:?}");
        }
        assert_eq!(folder.read(name), wanted);
        assert!(!folder.path("out_noisy.png").exists());
    }
}

/// `--strict` fails before the scene is read: this scene does not exist.
#[test]
fn strict_refuses_a_missing_library() {
    let folder = Folder::new();
    let args = ["--denoise", "--strict", "-f", "out.png", "no_such_scene.dae"];
    let mut command = folder.command(&args);
    command.env("PATHTRACER_OIDN", folder.path("nowhere"));
    let run = crate::common::Run::of(&command.output().unwrap(), "out.png");
    assert_eq!(run.code, Some(2), "{run:?}");
    for wanted in ["--denoise", "nowhere", "expected the library"] {
        assert!(run.err.contains(wanted), "{run:?}");
    }
    assert!(!run.err.contains("no_such_scene"), "{run:?}");
    assert!(!folder.path("out.png").exists());
}

#[test]
fn what_was_rendered_is_kept_to_the_bit() {
    let folder = Folder::new();
    if !is_there(&folder) {
        return;
    }
    let base = "-r 40 30 -s 4 --receipt none SCENE";
    folder.succeed(&format!("{base} --png-bits 16 -f plain.png"));
    folder.succeed(&format!("{base} -f plain.exr"));
    let run = folder.succeed(&format!("{base} --png-bits 16 --denoise -f out.png"));
    assert!(run.err.contains("saved out.png and out_noisy.png"), "{run:?}");
    assert_eq!(folder.read("out_noisy.png"), folder.read("plain.png"));
    assert_ne!(folder.image("out.png"), folder.image("plain.png"));
    folder.succeed(&format!("{base} --denoise -f out.exr"));
    let plain = folder.image("plain.exr");
    assert_ne!(folder.image("out.exr"), plain);
    let file = exr_channels(&folder, "out.exr");
    for (c, letter) in ["R", "G", "B"].into_iter().enumerate() {
        let noisy = file.iter().find(|(name, _)| *name == format!("noisy.{letter}"));
        let wanted: Vec<_> = plain.pixels.iter().map(|p| p[c]).collect();
        assert_eq!(noisy.map(|(_, values)| values), Some(&wanted));
    }
    for (name, file) in [("layer noisy", "out.exr"), ("out_noisy.png", "out.png")] {
        let bytes = folder.read(file);
        let text = String::from_utf8_lossy(&bytes);
        assert!(
            text.contains("Denoiser") && text.contains(&format!("as rendered: {name}")),
            "{file}"
        );
    }
}

/// Number of threads, resuming and merging change no bit on one machine.
#[test]
fn denoised_images_are_the_same_however_they_come_about() {
    let folder = Folder::new();
    if !is_there(&folder) {
        return;
    }
    let base = "-r 40 30 -s 6 --denoise SCENE";
    let wanted = folder.exr(&format!("{base} -t 1"));
    assert!(folder.exr(&format!("{base} -t 2 --restart")) == wanted, "two threads");
    folder.succeed(&format!("{base} --receipt none --samples 0..2 -f a.film"));
    folder.succeed(&format!("{base} --receipt none --samples 2..6 -f b.film"));
    folder.succeed("merge a.film b.film -f merged.exr");
    assert!(folder.read("merged.exr") == wanted, "two parts");
    folder.succeed("-r 40 30 -s 2 --denoise --receipt none SCENE -f later.exr");
    folder.succeed("resume later.exr -s 6");
    assert!(folder.read("later.exr") == wanted, "taken up again");
}

/// Names and values of the floating-point channels of a file.
fn exr_channels(folder: &Folder, name: &str) -> Vec<(String, Vec<f32>)> {
    let file =
        exr::prelude::read_all_flat_layers_from_file(folder.path(name)).expect("an EXR file");
    let list = &file.layer_data[0].channel_data.list;
    list.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}
