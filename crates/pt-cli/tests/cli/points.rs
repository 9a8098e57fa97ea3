//! Point clouds and lines.

use std::io::Write as _;

use crate::common::{Folder, TINY};

/// PLY file of a ball of coloured points at distinct positions.
fn ball(count: u32) -> Vec<u8> {
    let mut file = Vec::new();
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
    )
    .expect("there is room");
    // Spiral from pole to pole, with equal areas.
    for i in 0..count {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        file.extend([r * cos, z, r * sin].into_iter().flat_map(|x| (x as f32).to_le_bytes()));
        file.extend([200, (i % 200) as u8, 40]);
    }
    file
}

/// Peak memory of a render of `count` points.
fn peak(folder: &Folder, count: u32) -> f64 {
    folder.write("ball.ply", ball(count));
    folder.succeed(&format!("{TINY} -t 2 --summary-json out.json -f out.png ball.ply"));
    let summary: serde_json::Value =
        serde_json::from_slice(&folder.read("out.json")).expect("JSON");
    assert_eq!(summary["spheres"], count);
    summary["peak_bytes"].as_f64().expect("a number on Linux")
}

/// Memory of the whole render: file, tables and hierarchy, and temporary data.
#[test]
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn a_million_points_take_a_hundred_bytes_each() {
    let folder = Folder::new();
    let (few, many) = (peak(&folder, 1000), peak(&folder, 1_000_000));
    let each = (many - few) / 999_000.0;
    assert!(each < 100.0, "{each} bytes for each point");
}

#[test]
fn the_radius_of_points_is_noted_and_may_be_given() {
    let folder = Folder::new();
    folder.write("ball.ply", ball(2000));
    let covered = |args: &str| {
        let run = folder.succeed(&format!("-r 48 48 -s 4 -f out.exr {args} ball.ply"));
        let image = folder.image("out.exr");
        (run.err, image.pixels.iter().filter(|p| p[0] > 2.0 * p[2]).count())
    };
    let (reported, usual) = covered("");
    let wanted = "2000 points are rendered as spheres with a radius of 0.04";
    assert!(reported.contains(wanted) && reported.contains("--point-radius"), "{reported}");
    let (reported, small) = covered("--point-radius 0.004");
    assert!(!reported.contains("rendered as spheres"), "{reported}");
    assert!(5 * small < usual && usual > 200, "{small} {usual}");

    for radius in ["0", "-1", "nan", "a"] {
        let run = folder.run(&format!("--point-radius={radius} ball.ply"));
        assert_eq!(run.code, Some(2));
        assert!(run.err.contains("expected a length above 0"), "{run:?}");
    }
    let run = folder.run("--point-radius 1");
    assert!(run.code == Some(2) && run.err.contains("no points"), "{run:?}");
}

/// The commands on scenes support points, and converted scenes can be read again.
#[test]
fn points_are_described_converted_and_explained() {
    let folder = Folder::new();
    folder.write("ball.ply", ball(2000));
    let reported = folder.succeed("info ball.ply").out;
    assert!(
        reported.contains("1 of points") && reported.contains("2000, and 0 segments"),
        "{reported}"
    );
    folder.succeed("-r 24 24 -s 4 -f a.exr ball.ply");
    let image = folder.image("a.exr");
    let through = |name: &str| {
        folder.succeed(&format!("convert ball.ply {name}"));
        folder.succeed(&format!("-r 24 24 -s 4 -f b.exr {name}"));
        folder.image("b.exr")
    };
    assert_eq!(through("b.json"), image);
    // Materials of glTF have a specular lobe.
    let other = through("b.glb");
    let differs =
        |(a, b): (&[f32; 3], &[f32; 3])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.15);
    assert!(image.pixels.iter().zip(&other.pixels).filter(|pair| differs(*pair)).count() < 20);
    let reported = folder.succeed("explain -x 12 -y 12 -r 24 24 -s 16 ball.ply").out;
    assert!(reported.contains("ball"), "{reported}");
}

#[test]
fn lines_are_shown() {
    let folder = Folder::new();
    folder.write("cross.obj", "v -1 0 0\nv 1 0 0\nv 0 -1 0\nv 0 1 0\nl 1 2\nl 3 4\n");
    let run = folder.succeed("-r 64 48 -s 4 --point-radius 0.05 -f out.exr cross.obj");
    assert!(!run.err.contains("warning"), "{run:?}");
    let run = folder.succeed("-r 64 48 -s 4 -f thin.exr cross.obj");
    let wanted = "4 points are rendered as spheres, and 2 segments between them as cylinders, with \
                  a radius of 0.0113";
    assert!(run.err.contains(wanted), "{run:?}");
    let light = |name: &str| folder.image(name).pixels.iter().map(|p| f64::from(p[0])).sum::<f64>();
    assert!(light("out.exr") > 1.02 * light("thin.exr"));
}
