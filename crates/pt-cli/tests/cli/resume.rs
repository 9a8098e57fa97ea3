//! Renders that are stopped, killed, or split into parts give the same image as others.

#![cfg(unix)]

use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::common::{Folder, Run, SCENE};

/// Render of about half a second on one thread.
const RENDER: &str = "-r 60 45 -s 400 -m 5 -t 1 --checkpoint-every 0.02 --receipt stable --aov cryptomatte_object -f out.exr SCENE";

/// A similar render with half buffers and light groups.
const IN_HALVES: &str = "-r 60 45 -m 5 -t 1 --target-error 8% --light-groups each --checkpoint-every 0.02 --receipt stable -f out.exr SCENE";

/// Returns the bytes of the image of an uninterrupted render.
fn uninterrupted(args: &str) -> Vec<u8> {
    let folder = Folder::new();
    folder.succeed(args);
    folder.read("out.exr")
}

/// Starts the program, and sends it a signal after a while.
fn signal(folder: &Folder, args: &str, signal: &str, after: Duration) -> Run {
    let args: Vec<_> = args.split_whitespace().map(|a| a.replace("SCENE", SCENE)).collect();
    let mut command = folder.command(&args);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    sleep(after);
    // The process may have ended by then.
    let kill = Command::new("kill").args([signal, &child.id().to_string()]).output();
    kill.expect("there is a program to send signals");
    Run::of(&child.wait_with_output().expect("it ends"), &args.join(" "))
}

/// The render is killed at many instants, some of them during a write.
#[test]
fn a_render_that_is_killed_again_and_again_comes_to_the_same_image() {
    for render in [RENDER, IN_HALVES] {
        let want = uninterrupted(render);
        let folder = Folder::new();
        let mut killed = 0;
        for i in 0..60 {
            let run = signal(&folder, render, "-KILL", Duration::from_millis(20 + 7 * (i % 13)));
            if run.code.is_some() {
                break;
            }
            killed += 1;
        }
        assert!(killed >= 3, "it was killed {killed} times only");
        folder.succeed(render);
        assert!(folder.read("out.exr") == want, "{render}");
        // A render that is killed while it writes an image leaves a temporary file, which does no
        // harm.
        let files = folder.files().into_iter().filter(|name| !name.starts_with(".pathtracer-"));
        assert!(files.eq(["out.exr", "out.exr.film", "out.exr.film.old"]));
    }
}

#[test]
fn a_render_that_is_asked_to_stop_says_how_to_go_on() {
    let want = uninterrupted(RENDER);
    for name in ["-INT", "-TERM"] {
        let folder = Folder::new();
        let run = signal(&folder, RENDER, name, Duration::from_millis(250));
        assert_eq!(run.code, Some(130), "{run:?}");
        assert!(run.err.contains("pathtracer resume out.exr"), "{run:?}");
        assert!(folder.read("out.exr") != want, "{name}: the image is finished");
        let run = folder.succeed("resume out.exr -t 2");
        assert!(run.err.contains("resumes at"), "{run:?}");
        assert!(folder.read("out.exr") == want, "{name}");
    }
}

/// A truncated, changed or empty film is reported, and the previous one is used.
#[test]
fn damaged_samples_are_reported_and_not_used() {
    let want = uninterrupted(RENDER);
    let folder = Folder::new();
    signal(&folder, RENDER, "-INT", Duration::from_millis(300));
    let whole = folder.read("out.exr.film");
    let mut changed = whole.clone();
    changed[whole.len() / 2] ^= 4;
    for bytes in [&whole[..whole.len() / 3], &changed, &[]] {
        folder.write("out.exr.film", bytes);
        let run = folder.succeed("resume out.exr");
        assert!(run.err.contains("the previous film is used"), "{run:?}");
        assert!(folder.read("out.exr") == want);
    }
    folder.write("out.exr.film", &changed);
    folder.write("out.exr.film.old", &changed);
    let run = folder.run("resume out.exr");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("out.exr.film: is damaged"), "{run:?}");
}

/// Differences are listed; a finished film is replaced, an unfinished one is kept.
#[test]
fn samples_of_another_image_are_never_mixed_nor_lost() {
    let folder = Folder::new();
    let scene = std::fs::read(SCENE).expect("the scene of ours is there");
    folder.write("scene.dae", &scene);
    let render = RENDER.replace("SCENE", "scene.dae");
    signal(&folder, &render, "-INT", Duration::from_millis(200));
    let film = folder.read("out.exr.film");
    let run = folder.run(&render.replace("-m 5", "-m 4 --seed 7"));
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("max depth: 5 before, 4 now"), "{run:?}");
    assert!(run.err.contains("seed: 0 before, 7 now"), "{run:?}");
    folder.write("scene.dae", [scene.as_slice(), b"\n"].concat());
    for run in [folder.run(&render), folder.run("resume out.exr")] {
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains("scene.dae: "), "{run:?}");
    }
    assert!(folder.read("out.exr.film") == film, "it is as it was");
    folder.succeed(&format!("{render} --restart"));
    let run = folder.succeed(&render.replace("-m 5", "-m 3"));
    assert!(run.err.contains("max depth: 5 before, 3 now"), "{run:?}");
}

#[test]
fn more_samples_are_added_to_a_finished_image() {
    for sampler in ["sobol", "independent"] {
        let args = |spp: u32| {
            format!("-r 20 15 -s {spp} --sampler {sampler} --receipt stable -f out.exr SCENE")
        };
        let folder = Folder::new();
        folder.succeed(&args(20));
        folder.succeed("resume out.exr --spp 70");
        assert!(folder.read("out.exr") == uninterrupted(&args(70)), "{sampler}");
        let run = folder.run("resume out.exr --spp 69");
        assert!(run.code == Some(2) && run.err.contains("found 70 samples per pixel"), "{run:?}");
        folder.succeed(&args(90));
        assert!(folder.read("out.exr") == uninterrupted(&args(90)), "{sampler}");
    }
}

/// Sampler points that depend on the number of samples do not change when samples are added.
#[test]
fn more_samples_of_a_layout_leave_those_that_are_there() {
    for sampler in ["zsobol", "stratified"] {
        let folder = Folder::new();
        folder.succeed(&format!(
            "-r 20 15 -s 20 --sampler {sampler} --receipt stable -f out.exr SCENE"
        ));
        let run = folder.succeed("resume out.exr --spp 50");
        assert!(run.err.contains("resumes at 20.0 samples"), "{run:?}");
        let of =
            |to| format!("-r 20 15 -s 20 --sampler {sampler} --receipt stable --samples 0..{to}");
        folder.succeed(&format!("{} -f part.film SCENE", of(20)));
        folder.succeed("resume part.film --spp 50");
        folder.succeed("merge part.film -f part.exr");
        assert!(folder.read("part.exr") == folder.read("out.exr"), "{sampler}");
        let run = folder.succeed("info part.film");
        assert!(run.out.contains("0 to 50, 15000 in all, 50.0 per pixel"), "{run:?}");
    }
}

/// Parts of any size, in any order.
#[test]
fn parts_come_together_to_the_image_of_one_render() {
    let all = "-r 30 20 -s 64 --receipt stable --aov albedo,primitive --path-reuse 2";
    for sampler in ["", "--sampler zsobol"] {
        let want = uninterrupted(&format!("{all} {sampler} -f out.exr SCENE"));
        let folder = Folder::new();
        for (name, samples) in [("a", "0..7"), ("b", "7..40"), ("c", "40..64")] {
            folder.succeed(&format!("{all} {sampler} --samples {samples} -f {name}.film SCENE -q"));
        }
        folder.succeed("merge c.film a.film b.film -f out.exr");
        assert!(folder.read("out.exr") == want);
        folder.succeed("merge c.film b.film -f bc.film");
        folder.succeed("merge bc.film a.film -f again.exr");
        assert!(folder.read("again.exr") == want);
        let run = folder.succeed("info bc.film");
        assert!(run.out.contains("7 to 64, 34200 in all, 57.0 per pixel"), "{run:?}");
        // A sum of films that this user made is resumed without further options; one of a moved
        // film is not.
        folder.succeed("resume bc.film -s 66");
        let run = folder.succeed("info bc.film");
        assert!(run.out.contains("7 to 66, 35400 in all"), "{run:?}");
        std::fs::rename(folder.path("a.film"), folder.path("moved.film")).expect("a film");
        folder.succeed("merge moved.film -f a.film");
        assert_eq!(folder.run("resume a.film -s 9").code, Some(2));
    }
}

#[test]
fn parts_that_do_not_fit_are_named() {
    let folder = Folder::new();
    let part = |name: &str, samples: &str, more: &str| {
        let size = "-r 12 9 -q";
        folder.succeed(&format!("{size} --samples {samples} {more} -f {name}.film SCENE"));
    };
    part("a", "0..8", "");
    part("b", "6..16", "");
    part("c", "12..16", "");
    part("seed", "8..16", "--seed 2");
    for (films, why) in [
        ("a b", "found samples 6 to 8 in both a.film and b.film"),
        ("a a", "found samples 0 to 8 in both a.film and a.film"),
        ("a c", "missing samples 8 to 12 between a.film and c.film"),
        ("c", "missing samples 0 to 12"),
        ("a seed", "seed: 0 before, 2 now"),
        ("a none", "none.film: cannot be read"),
    ] {
        let names = films.replace(' ', ".film ");
        let run = folder.run(&format!("merge {names}.film -f out.exr"));
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(why), "{why}: {run:?}");
    }
    assert!(!folder.files().contains(&"out.exr".into()));
    let run = folder.succeed("-r 12 9 --samples 5..8 -f a.film SCENE");
    assert!(run.err.contains("from sample 0") && run.err.contains("from sample 5"), "{run:?}");
    assert!(folder.succeed("info a.film").out.contains("5 to 8, 324 in all, 3.0 per pixel"));
}

/// The course's program writes images to files of any name, and keeps no samples.
#[test]
fn the_course_s_renders_keep_no_samples() {
    let folder = Folder::new();
    folder.succeed("--cs184 -r 12 9 -f out.film SCENE");
    assert!(folder.read("out.film").starts_with(b"\x89PNG"));
    assert!(folder.files().iter().all(|name| !name.ends_with(".film.film")));
}

/// A full disk does not end a render, and keeps earlier samples.
#[test]
fn a_film_that_cannot_be_written_is_reported() {
    let folder = Folder::new();
    let args = RENDER.replace("SCENE", SCENE);
    // No file may be larger than 64 KiB: the film is larger, the image is not.
    let limited =
        format!("trap '' XFSZ; ulimit -f 128; exec {} {args}", env!("CARGO_BIN_EXE_pathtracer"));
    let mut shell = Command::new("sh");
    shell.args(["-c", &limited]).current_dir(folder.path(""));
    let run = Run::of(&shell.output().expect("there is a shell"), &limited);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("out.exr.film: cannot be written"), "{run:?}");
    assert!(run.err.contains("the image is written, but not its samples"), "{run:?}");
    assert!(folder.read("out.exr") == uninterrupted(RENDER));
    assert_eq!(folder.files(), ["out.exr"]);
}
