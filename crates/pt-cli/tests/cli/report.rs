//! Command lines of a report on the university course's program, as they are printed there.

use pathtracer::image::is_image;

use crate::common::{Folder, course_scene};

/// Scene of this repository with the profile of the course, whose camera is at the height of the
/// floor.
const OURS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/course/matte_balls.dae");

/// Figure, arguments, values of `X`, and the scene.
const COMMANDS: &[(&str, &str, &[&str], &str)] = &[
    (
        "5",
        "-t 8 -s 1 -l X -H -f CBbunny_H_1_X.png -r 480 360",
        &["1", "4", "16", "64"],
        "sky/CBbunny.dae",
    ),
    ("6", "-t 8 -s 16 -l 8 -H -f CBbunny_H_16_8.png -r 480 360", &["8"], "sky/CBbunny.dae"),
    ("7", "-t 8 -s 64 -l 16 -m 5 -r 480 360 -f X.png", &["global"], "sky/CBspheres_lambertian.dae"),
    (
        "8",
        "-t 8 -s 16 -l 8 -H -f -m X CBbunny_mX_.png -r 480 360",
        &["0", "1", "2", "3", "100"],
        "sky/CBbunny.dae",
    ),
    (
        "9",
        "-t 8 -s X -l 4 -m 5 -r 480 360 -f spheresX.png",
        &["1", "2", "4", "16"],
        "sky/CBspheres_lambertian.dae",
    ),
    (
        "10",
        "-t 8 -s 2048 -a 64 0.05 -l 1 -m 5 -r 480 360 -f bunny.png",
        &["2048"],
        "sky/CBbunny.dae",
    ),
];

/// Returns the arguments with fewer pixels and samples.
fn reduced(args: &str) -> String {
    let mut words: Vec<_> = args.split_whitespace().map(str::to_owned).collect();
    for i in 1..words.len() {
        match words[i - 1].as_str() {
            "-s" => words[i] = "2".into(),
            "-l" => words[i] = "3".into(),
            "-r" => (words[i], words[i + 1]) = ("16".into(), "12".into()),
            _ => {}
        }
    }
    words.join(" ")
}

fn runs(figure: &str, args: &str, x: &str, scene: &str) {
    for mode in ["", "--cs184 "] {
        let folder = Folder::new();
        let args = args.replace('X', x);
        let name = args.split(' ').find(|w| is_image(w.as_ref())).expect("an image is named");
        let run = folder.succeed(&format!("{mode}{} {scene}", reduced(&args)));
        let image = folder.image(name);
        assert_eq!((image.width, image.height), (16, 12), "figure {figure}: {run:?}");
        let mut wanted = vec![name.to_owned()];
        if !mode.is_empty() || args.contains("-a ") {
            wanted.push(name.replace(".png", "_rate.png"));
        }
        assert_eq!(folder.files(), wanted, "figure {figure}: {run:?}");
    }
}

#[test]
fn all_run_on_a_scene_of_ours() {
    for (figure, args, values, _) in COMMANDS {
        for x in *values {
            runs(figure, args, x, OURS);
        }
    }
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn all_run_on_their_scenes() {
    for (figure, args, values, scene) in COMMANDS {
        let path = course_scene(scene);
        for x in *values {
            runs(figure, args, x, &path.display().to_string());
        }
    }
}

/// At any size, the view of the box is that of the course's program at the size of the report. From
/// the camera of the file, the lower half of the image is black. A note names the option that
/// selects the camera.
#[test]
fn the_box_is_seen_as_in_the_report() {
    let folder = Folder::new();
    // Fractions of the upper and of the lower half that show a surface.
    let covered = |args: &str| {
        let line = format!("-s 4 --integrator normals -f a.png {args} {OURS}");
        let run = folder.succeed(&line);
        let image = folder.image("a.png");
        let half = (image.pixels.len() / 2, image.pixels.len());
        let share = |pixels: &[[f32; 3]]| {
            pixels.iter().filter(|pixel| **pixel != [0.0; 3]).count() as f64 / half.0 as f64
        };
        ([share(&image.pixels[..half.0]), share(&image.pixels[half.0..])], format!("{run:?}"))
    };
    let (wanted, _) = covered("--cs184 -r 480 360");
    for size in ["-r 48 36", "-r 24 18"] {
        let (found, run) = covered(size);
        // Pixels that an edge of the box crosses count completely: of 24 x 9, one row and two
        // columns.
        let most = 1.0 / 9.0 + 2.0 / 24.0;
        let is_near = |i: usize| (found[i] - wanted[i]).abs() <= most;
        assert!(is_near(0) && is_near(1), "{size}: {found:?} for {wanted:?}");
        assert_eq!(run.matches("--camera file").count(), 1, "{run}");
    }
    let ([_, lower], run) = covered("-r 48 36 --camera file");
    assert!(lower < 0.05 && run.contains("--camera fit"), "{lower}: {run}");
}

/// In figure 8, `-f` and its value are separated by the scene.
#[test]
fn the_name_of_the_image_may_stand_apart() {
    let folder = Folder::new();
    let wanted = folder.exr("-r 12 9 -s 2 -m 5 SCENE");
    for args in ["-f -m 5 out.exr -r 12 9 -s 2 SCENE", "-r 12 9 -s 2 -f -m 5 SCENE out.exr"] {
        folder.succeed(&format!("{args} --receipt none"));
        assert!(folder.read("out.exr") == wanted, "{args}");
        std::fs::remove_file(folder.path("out.exr")).unwrap();
    }
}
