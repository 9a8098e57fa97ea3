//! `--cs184`: the names, defaults and lines of the university course's program.

use crate::common::{Folder, SMALL, TINY};

/// Returns true if a line matches a pattern: `{i}` is a whole number, `{f}` a number with `digits`
/// decimals written as `{f4}` or `{f6}`, and `*` anything up to the end.
fn is_like(line: &str, pattern: &str) -> bool {
    let Some(at) = pattern.find(['{', '*']) else { return line == pattern };
    let (literal, rest) = pattern.split_at(at);
    let Some(line) = line.strip_prefix(literal) else { return false };
    let Some(field) = rest.strip_prefix('{') else { return true };
    let Some((kind, pattern)) = field.split_once('}') else { return false };
    let end = line.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(line.len());
    let (number, line) = line.split_at(end);
    let decimals = number.split_once('.').map_or(0, |(_, fraction)| fraction.len());
    let wanted = kind.strip_prefix('f').map_or(0, |n| n.parse().expect("digits"));
    number.parse::<f64>().is_ok() && decimals == wanted && is_like(line, pattern)
}

#[test]
fn patterns_are_distinguished() {
    assert!(is_like("a 12 b 0.5000 c", "a {i} b {f4} c"));
    assert!(!is_like("a 12 b 0.500 c", "a {i} b {f4} c"));
    assert!(!is_like("a x b", "a {i} b") && !is_like("ab", "a") && is_like("abc", "a*"));
}

fn assert_lines(text: &str, patterns: &[&str]) {
    let lines: Vec<_> = text.lines().map(|l| l.rsplit('\r').next().unwrap_or(l)).collect();
    assert_eq!(lines.len(), patterns.len(), "{text}");
    for (line, pattern) in lines.iter().zip(patterns) {
        assert!(is_like(line, pattern), "\"{line}\" is not \"{pattern}\"");
    }
}

const OUT: [&str; 7] = [
    "[PathTracer] Collecting primitives... Done! ({f4} sec)",
    "[PathTracer] Building BVH from 5 primitives... Done! ({f4} sec)",
    "[PathTracer] Rendering... 100%! ({f4}s)",
    "[PathTracer] BVH traced {i} rays.",
    "[PathTracer] Average speed {f4} million rays per second.",
    "[PathTracer] Averaged {f6} intersection tests per ray.",
    "[PathTracer] Job completed.",
];

const MESH: &str = "[COLLADA Parser]   |- PolymeshInfo: floor (id:floor-mesh) [ num_polygons=2 \
                    num_vertices=4 num_normals=0 num_texcoords=0 ]";

const ERR: [&str; 13] = [
    "[PathTracer] Input scene file: small.dae",
    "[COLLADA Parser] Loading COLLADA file...",
    "[COLLADA Parser] Loading scene...",
    "[COLLADA Parser]  |- Node: Lamp (id:lamp)",
    "[COLLADA Parser]   |- LightInfo: Light (id:light) [ type=area spectrum=(10,10,10) \
     direction=(0,0,-1) ]",
    "[COLLADA Parser]  |- Node: Ball (id:ball)",
    "[COLLADA Parser]   |- Sphere: Ball (id:ball-data) [ radius=0.3 ]",
    "[COLLADA Parser]   |- MaterialInfo: clear (id:clear) [ BSDF=0x*",
    "[COLLADA Parser]  |- Node: Floor (id:floor)",
    MESH,
    "[COLLADA Parser]  |- Node: Ceiling (id:ceiling)",
    MESH,
    "[PathTracer] Rendering using 1 threads",
];

#[test]
fn the_console_shows_the_lines_of_the_course() {
    let folder = Folder::new();
    folder.write("small.dae", SMALL);
    let run = folder.succeed("--cs184 -r 12 9 -s 2 -f out.png small.dae");
    assert_lines(&run.out, &OUT);
    let notes = |l: &&str| l.starts_with("note: ");
    let err: Vec<_> = run.err.lines().filter(|l| !notes(l)).collect();
    let saved = "[PathTracer] Saving to file: out.png... Done!";
    assert_lines(&err.join("\n"), &[&ERR[..], &[saved]].concat());
}

#[test]
fn an_environment_and_a_camera_add_their_lines() {
    let folder = Folder::new();
    folder.write("small.dae", SMALL);
    let camera = "50 38.5 1.333 0.1 100\n0 0 4 0 0 0\n1.57 0 4 0.1 10\n1 0 0 0 1 0 0 0 1\n\
                  800 600 875\n4.7 0\n";
    folder.write("camera.txt", camera);
    let map = pathtracer::Image { width: 4, height: 2, pixels: vec![[1.0; 3]; 8].into() };
    let options = pathtracer::image::SaveOptions::default();
    pathtracer::image::save(&map, &folder.path("map.exr"), &options).unwrap();
    let run = folder.succeed("--cs184 -e map.exr -c camera.txt -r 12 9 -f out.png small.dae");
    let more = [
        "[PathTracer] Loading environment map map.exr",
        "[PathTracer] Initializing environment light...Saving out probability_debug image for \
         debug.",
        "done.",
        "[Camera] Loaded settings from camera.txt",
    ];
    assert_lines(&run.out, &[&more[..], &OUT].concat());
    assert!(folder.path("probability_debug.png").is_file());
}

#[test]
fn a_cell_is_called_a_cell_job() {
    let folder = Folder::new();
    let run = folder.succeed("--cs184 -r 12 9 -p 2 2 4 3 -f out.png SCENE");
    assert_eq!(run.out.lines().last(), Some("[PathTracer] Cell job completed."));
    let (cell, rate) = (folder.image("out.png"), folder.image("out_rate.png"));
    assert_eq!((cell.width, cell.height), (4, 3));
    assert_eq!((rate.width, rate.height), (12, 9), "rates are of the whole frame");
}

#[test]
fn rates_go_beside_the_image_with_four_characters_cut_off() {
    let folder = Folder::new();
    for (image, rate) in [("a.png", "a_rate.png"), ("outx", "_rate.png"), ("b.exr", "b_rate.png")] {
        folder.succeed(&format!("--cs184 {TINY} -f {image} SCENE"));
        assert!(folder.path(image).is_file() && folder.path(rate).is_file(), "{image}");
    }
    assert_eq!(&folder.read("outx")[1..4], b"PNG");
}

/// Defaults that differ: one sample, one interaction, adaptive sampling, 800×600.
#[test]
fn defaults_are_those_of_the_course() {
    let folder = Folder::new();
    folder.write("small.dae", SMALL);
    let exr = |args: &str| folder.exr(&format!("--cs184 {args} small.dae"));
    assert_eq!(exr("-r 12 9"), exr("-r 12 9 -s 1 -m 1 -l 1 -t 1 -a 32 0.05 -d 4.7 -b 0 -o 1"));
    let is_adaptive = exr("-r 12 9 -s 512") != exr("-r 12 9 -s 512 -a 512 0");
    assert!(is_adaptive, "all samples are taken");
    folder.succeed("--cs184 --integrator normals -f size.png SCENE");
    let image = folder.image("size.png");
    assert_eq!((image.width, image.height), (800, 600));
}

/// The same pixel shows the same point, whatever the resolution: `-r` crops.
#[test]
fn resolution_crops_the_window() {
    let folder = Folder::new();
    let render = |size: &str, name: &str| {
        folder.succeed(&format!("--cs184 --integrator normals -s 16 -r {size} -f {name} SCENE"));
        folder.image(name)
    };
    let (large, small) = (render("80 60", "large.exr"), render("40 30", "small.exr"));
    let mut differences = 0;
    for y in 0..30 {
        for x in 0..40 {
            let (a, b) = (small.pixels[y * 40 + x], large.pixels[(y + 15) * 80 + x + 20]);
            let far = a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.05);
            differences += usize::from(far);
        }
    }
    // At edges of shapes, pixels have different sample positions.
    assert!(differences < 120, "{differences} of 1200 pixels differ");
}

/// The sum of the images of single depths is the whole image: `-o 0` for 0, 1, 2 and 3 is `-o 1`
/// for 3. The lamp faces away from the ceiling, which reflects light of the slope back to the
/// slope.
#[test]
fn single_depths_add_up() {
    let folder = Folder::new();
    folder.write("small.dae", SMALL);
    let mean = |args: &str| {
        let args = format!("--cs184 --sampler independent -r 24 18 -s 400 -a 400 0 {args}");
        folder.succeed(&format!("{args} -f out.exr small.dae"));
        let image = folder.image("out.exr");
        image.pixels.iter().flatten().sum::<f32>() / (3 * image.pixels.len()) as f32
    };
    let parts: Vec<f32> = (0..4).map(|m| mean(&format!("-o 0 -m {m} --seed {m}"))).collect();
    let all = mean("-m 3 --seed 9");
    assert!((parts.iter().sum::<f32>() - all).abs() < 0.03 * all, "{parts:?} is not {all}");
    assert!(parts[1] > 0.0 && parts[3] > 0.0, "{parts:?}");
}
