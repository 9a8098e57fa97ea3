//! Sequences: each image is that of a command of its own.

use crate::common::{Folder, SCENE};

/// A ball and a floor, three cameras, and a ball that rolls.
const BALLS: &str = r#"{"pathtracer": 1,
    "cameras": [
        {"name": "front", "type": "perspective", "x_fov": 40, "fit": "width", "to_world": {"translate": [0, 0.3, 6]}},
        {"name": "near", "type": "perspective", "x_fov": 50, "fit": "width", "to_world": {"translate": [0.2, 0, 4]}},
        {"name": "2", "type": "orthographic", "half_width": 2, "half_height": 1.5, "shutter": [0, 0.5],
         "to_world": {"translate": [0, 0, 5]}}],
    "motions": {"roll": [{"time": 0}, {"time": 2, "to_world": {"translate": [1.5, 0, 0]}}]},
    "objects": [{"type": "sphere"}, {"type": "sphere", "radius": 0.3, "motion": "roll"}],
    "lights": [{"type": "constant", "radiance": 0.7}]}"#;

const BASE: &str = "--metadata stable -r 16 12 -s 4";

fn with_balls() -> Folder {
    let folder = Folder::new();
    folder.write("balls.json", BALLS);
    folder
}

/// Asserts that images are those of these commands, to the byte of the files.
fn assert_alone(sequence: &Folder, images: &[(&str, &str)]) {
    let alone = with_balls();
    for name in sequence.files() {
        if name.ends_with("json") || name.ends_with("txt") {
            alone.write(&name, sequence.read(&name));
        }
    }
    for (image, options) in images {
        alone.succeed(&format!("{BASE} balls.json -f {image} {options}"));
        assert!(sequence.read(image) == alone.read(image), "{image}");
    }
}

#[test]
fn cameras_of_the_scene_are_rendered_as_alone() {
    let folder = with_balls();
    let run = folder.succeed(&format!("{BASE} balls.json -f a_%d.exr --cameras all"));
    assert!(run.err.contains("saved 3 images, a_0.exr to a_2.exr"), "{run:?}");
    // The third camera has another shutter, so that the scene is compiled again.
    assert_alone(
        &folder,
        &[("a_0.exr", "--camera=0"), ("a_1.exr", "--camera=1"), ("a_2.exr", "--camera=2")],
    );
    folder.succeed(&format!("{BASE} balls.json --cameras 2,front -f b%02d.png"));
    assert_alone(&folder, &[("b00.png", "--camera=2"), ("b01.png", "--camera=front")]);
}

#[test]
fn frames_are_rendered_as_alone() {
    let folder = with_balls();
    folder.succeed(&format!("{BASE} balls.json -f %d.exr --frames 0..24/12"));
    assert_alone(
        &folder,
        &[("0.exr", "--time=0"), ("12.exr", "--time=0.5"), ("24.exr", "--time=1")],
    );
    assert!(folder.read("0.exr") != folder.read("24.exr"));
    folder.succeed(&format!("{BASE} balls.json -f f%d.exr --fps 50 --frames 100..100"));
    assert_alone(&folder, &[("f100.exr", "--time=2")]);
}

/// The views have the position and the angle of the first two cameras of the scene.
const VIEWS: &str = r#"{"camera_angle_x": 0.6981317007977318, "frames": [
    {"file_path": "a", "transform_matrix": [[1,0,0,0], [0,1,0,0.3], [0,0,1,6], [0,0,0,1]]},
    {"file_path": "b", "camera_angle_x": 0.8726646259971648, "w": 20, "h": 10,
     "transform_matrix": [[1,0,0,0.2], [0,1,0,0], [0,0,1,4], [0,0,0,1]]}]}"#;

#[test]
fn views_of_a_file_are_rendered_as_alone() {
    let folder = with_balls();
    folder.write("views.json", VIEWS);
    folder.succeed(&format!("{BASE} balls.json -f v%d.exr --cameras views.json"));
    assert_alone(
        &folder,
        &[("v0.exr", "--camera-file=views.json#0"), ("v1.exr", "--camera-file=views.json#1")],
    );
    folder.succeed(&format!("{BASE} balls.json --camera front -f front.exr"));
    folder.succeed(&format!("{BASE} balls.json --camera near -f near.exr"));
    assert_eq!(folder.image("v0.exr"), folder.image("front.exr"));
    assert_eq!(folder.image("v1.exr"), folder.image("near.exr"));
    // The size is that of the view without another one.
    folder.succeed("-s 1 balls.json --camera-file views.json#1 -f size.png");
    let image = folder.image("size.png");
    assert_eq!((image.width, image.height), (20, 10));
    folder.succeed("-s 2 balls.json -f r%d.exr --cameras views.json -r 16 12");
    folder.succeed("rerender r1.exr -f again.exr");
}

#[test]
fn views_of_colmap_are_those_of_nerf() {
    let folder = with_balls();
    folder.write("views.json", VIEWS);
    folder.write("cameras.txt", "# cameras\n1 SIMPLE_PINHOLE 20 10 21.445069205095589 10 5\n");
    // Camera coordinates are right, down and forward: half a turn around x.
    folder.write("images.txt", "# images\n1 0 1 0 0 -0.2 0 4 1 b.png\n\n");
    folder.succeed("-s 4 balls.json --cameras views.json#1..1 -f v.exr");
    folder.succeed("-s 4 balls.json --cameras images.txt -f c.exr");
    let [a, b] = ["v.exr", "c.exr"].map(|name| folder.image(name));
    assert_eq!((a.width, a.height), (b.width, b.height));
    let difference =
        |(x, y): (&[f32; 3], &[f32; 3])| (0..3).map(|i| (x[i] - y[i]).abs()).sum::<f32>();
    let sum: f32 = a.pixels.iter().zip(&b.pixels).map(difference).sum();
    assert!(sum < 0.01 * a.pixels.iter().flatten().sum::<f32>(), "{sum}");
}

#[test]
fn the_same_command_continues_a_sequence() {
    let folder = with_balls();
    let command = "-r 16 12 -s 4 balls.json -f %d.exr --cameras all";
    folder.succeed(command);
    let all = ["0.exr", "1.exr", "2.exr"];
    let before = all.map(|name| folder.read(name));
    for name in ["1.exr", "1.exr.film"] {
        std::fs::remove_file(folder.path(name)).unwrap();
    }
    let run = folder.succeed(command);
    assert!(run.err.contains("2 were finished before"), "{run:?}");
    assert!(folder.read("0.exr") == before[0] && folder.read("2.exr") == before[2]);
    let hash = |name: &str| {
        let run = folder.succeed(&format!("info {name}"));
        run.out.lines().find(|line| line.starts_with("hash of the film")).map(str::to_owned)
    };
    let middle = hash("1.exr");
    assert!(middle.is_some());
    // With other settings or a changed scene, all are rendered.
    let run = folder.succeed("-r 16 12 -s 5 balls.json -f %d.exr --cameras all");
    assert!(!run.err.contains("finished before"), "{run:?}");
    assert!(hash("1.exr") != middle);
    folder.write("balls.json", BALLS.replace("0.7", "0.6"));
    let run = folder.succeed("-r 16 12 -s 5 balls.json -f %d.exr --cameras all --restart");
    assert!(!run.err.contains("finished before"), "{run:?}");
}

/// Each frame reads the scene again, but the warning is one.
#[test]
fn missing_files_are_listed_once() {
    let folder = Folder::new();
    folder.write(
        "a.xml",
        r#"<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere">
            <bsdf type="diffuse"><texture type="bitmap" name="reflectance">
            <string name="filename" value="lost.png"/></texture></bsdf></shape></scene>"#,
    );
    for options in ["--frames 0..2", "--cameras all"] {
        let run = folder.run(&format!("-r 4 3 -s 1 a.xml {options} -f %d.png"));
        assert_eq!(run.code, Some(4), "{run:?}");
        let named = run.err.lines().filter(|line| line.contains("lost.png")).count();
        assert_eq!(named, 1, "{run:?}");
    }
}

#[test]
fn impossible_sequences_are_refused() {
    let folder = with_balls();
    folder.write("views.json", VIEWS);
    folder.write("empty.json", r#"{"frames": []}"#);
    folder.write(
        "bent.json",
        VIEWS.replace("\"camera_angle_x\": 0.69", "\"k1\": 0.1, \"camera_angle_x\": 0.69"),
    );
    folder.write("still.stl", "solid a\nendsolid a\n");
    for (args, wanted) in [
        ("balls.json --cameras all -f a.png", "-f a.png: expected a place for the number"),
        (
            "balls.json --cameras fornt -f %d.png",
            "--cameras fornt: unknown camera \"fornt\"; did you mean \"front\"?",
        ),
        (
            "balls.json --cameras views.json#2 -f %d.png",
            "found no view number 2, expected one of 0..1",
        ),
        ("balls.json --cameras views.json#1..0 -f %d.png", "views.json: found #1..0"),
        ("balls.json --camera-file views.json#9 -f a.png", "found no view number 9"),
        ("balls.json --camera-file views.json -f a.png", "views.json"),
        ("balls.json --cameras empty.json -f %d.png", "empty.json: found no views"),
        ("balls.json --cameras bent.json -f %d.png", "frames[0]: found lens distortion (k1 = 0.1)"),
        ("--cameras all -f %d.png", "the embedded scene has one camera"),
        ("balls.json --frames 5..1 -f %d.png", "--frames"),
        ("balls.json --frames 0..4/0 -f %d.png", "--frames"),
        ("balls.json --fps 24 -f a.png", "--frames"),
        ("balls.json --frames 0..4 --time 1 -f %d.png", "--time"),
        ("balls.json --frames 0..4 --summary-json a.json -f %d.png", "--summary-json"),
        ("still.stl --frames 0..4 -f %d.png", "animations of STL are not read"),
        ("explain balls.json --cameras all -x 1 -y 1", "choose one with --camera"),
    ] {
        let before = folder.files();
        let run = folder.run(args);
        assert_eq!(run.code, Some(2), "{args}: {run:?}");
        assert!(run.err.contains(wanted) && !run.err.contains("panicked"), "{args}: {run:?}");
        assert_eq!(folder.files(), before, "{args}");
    }
}

#[test]
fn the_embedded_scene_and_single_cameras_are_sequences() {
    let folder = with_balls();
    folder.write("views.json", VIEWS);
    folder.succeed("-r 16 12 -s 1 --cameras views.json");
    assert!(folder.files().contains(&"cornell_0001.png".to_owned()));
    folder.succeed(&format!("-r 16 12 -s 1 {SCENE} --cameras 0"));
}
