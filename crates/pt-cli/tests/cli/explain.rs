//! `pathtracer explain`.

use serde_json::Value;

use crate::common::{Folder, SMALL};

fn json(folder: &Folder, args: &str) -> Value {
    let run = folder.succeed(&format!("explain --json {args}"));
    serde_json::from_str(&run.out).unwrap_or_else(|e| panic!("{e}: {}", run.out))
}

/// Converts a list to numbers of single precision.
fn numbers(value: &Value) -> Vec<f32> {
    let list = value.as_array().expect("a list");
    list.iter().map(|x| x.as_f64().expect("a number") as f32).collect()
}

/// Returns the sum of the contributions, in their order and in single precision.
fn sum(contributions: &Value) -> Vec<f32> {
    let mut sum = vec![0.0; 3];
    for contribution in contributions.as_array().expect("a list") {
        for (sum, x) in sum.iter_mut().zip(numbers(&contribution["value"])) {
            *sum += x;
        }
    }
    sum
}

#[test]
fn the_mean_is_the_pixel_of_the_image() {
    let folder = Folder::new();
    let options = "-r 40 30 -s 16 --filter gaussian SCENE";
    folder.succeed(&format!("{options} -f out.exr"));
    let image = folder.image("out.exr");
    for [x, y] in [[20, 15], [9, 22], [31, 24]] {
        let reported = json(&folder, &format!("{options} -x {x} -y {y}"));
        assert_eq!(numbers(&reported["mean"]), image.pixels[y * 40 + x], "{x} {y}");
        let types = reported["types"].as_array().expect("a list");
        let share = |name: &str| -> f64 { types.iter().filter_map(|t| t[name].as_f64()).sum() };
        assert!((share("share_of_mean") - 1.0).abs() < 1e-9);
        let together = reported["together"].as_f64().expect("a number");
        assert!((share("share_of_variance") + together - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_parts_of_a_sample_are_the_sample() {
    let folder = Folder::new();
    for number in 0..8 {
        let reported = json(&folder, &format!("-r 40 30 -s 8 SCENE -x 9 -y 22 --sample {number}"));
        assert_eq!(sum(&reported["contributions"]), numbers(&reported["radiance"]));
        let wall = &reported["vertices"][0]["place"]["surface"];
        assert_eq!(wall["object"], "left", "{reported}");
        assert_eq!(wall["material"], "red", "{reported}");
    }
}

#[test]
fn help_reports_its_own_usage() {
    let help = Folder::new().succeed("explain --help").out;
    assert!(help.contains("Usage: pathtracer explain [OPTIONS] [SCENE] -x X -y Y"), "{help}");
    assert!(help.contains("--sample <N>") && !help.contains("pathtracer merge"), "{help}");
}

/// An adaptive render takes fewer samples of a pixel, and so does its explanation.
#[test]
fn an_adaptive_render_is_explained_as_it_is() {
    let folder = Folder::new();
    let options = "-r 40 30 -s 4096 -a 16 0.2 SCENE -x 20 -y 28";
    let reported = json(&folder, options);
    let count = reported["samples"]["count"].as_u64().expect("a number");
    assert!((16..4096).contains(&count), "{count}");
}

#[test]
fn text_has_at_most_a_hundred_columns_and_no_file_is_written() {
    let folder = Folder::new();
    let options = "-r 40 30 -s 64 SCENE -f out.png -x 9 -y 22";
    let run = folder.succeed(&format!("explain {options}"));
    for words in ["of variance", "L D E", "Path types", "Brightest paths", "Fireflies: "] {
        assert!(run.out.contains(words), "{words} is missing in\n{}", run.out);
    }
    let sample = folder.succeed(&format!("explain {options} --sample 3"));
    assert!(sample.out.contains("sample 3 of column 9, row 22"), "{}", sample.out);
    for line in run.out.lines().chain(sample.out.lines()) {
        assert!(line.chars().count() <= 100, "{line}");
    }
    assert_eq!(folder.files(), [""; 0]);
}

#[test]
fn what_cannot_be_explained_is_refused() {
    let folder = Folder::new();
    folder.write("small.dae", SMALL);
    for (args, message) in [
        ("-r 40 30 SCENE -x 40 -y 3", "outside of the image of 40 x 30"),
        ("-r 40 30 SCENE -x 3 -y 30", "a row, from the top, from 0 to 29"),
        ("-r 40 30 -p 0 0 10 10 SCENE -x 3 -y 3", "only columns 0 to 9 and rows 20 to 29"),
        ("-r 40 30 -s 8 SCENE -x 3 -y 3 --sample 8", "expected 0 to 7"),
        ("-r 40 30 SCENE -x 3", "-y <Y>"),
        ("-r 40 30 SCENE -x three -y 3", "expected a whole number"),
        ("-r 40 30 --path-reuse 2 SCENE -x 3 -y 3", "omit --path-splitting and --path-reuse"),
        ("-r 40 30 --split 2 SCENE -x 3 -y 3", "omit --path-splitting and --path-reuse"),
        ("-r 40 30 --integrator ao SCENE -x 3 -y 3", "samples of the integrator ao cannot be"),
        ("--cs184 small.dae -x 3 -y 3", "--integrator cs184"),
        ("SCENE small.dae -x 3 -y 3", "found two scenes"),
        ("SCENE --man -x 3 -y 3", "use them without a command"),
        ("missing.dae -x 3 -y 3", "missing.dae"),
        ("SCENE -x 3 -y 3 --sample 1 --top 3", "--top"),
    ] {
        let run = folder.run(&format!("explain {args}"));
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(message) && run.out.is_empty(), "{message}: {run:?}");
    }
    assert_eq!(folder.files(), ["small.dae"]);
}

#[test]
fn lights_are_called_by_their_own_names() {
    let folder = Folder::new();
    folder.write(
        "lights.xml",
        r#"<scene version="3.0.0">
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 3, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
    </sensor>
    <shape type="sphere"><float name="radius" value="1"/><bsdf type="diffuse"/></shape>
    <emitter type="point" id="key"><point name="position" value="-2, 4, 3"/></emitter>
    <emitter type="spot" id="fill">
        <transform name="to_world"><lookat origin="3, 4, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
    </emitter>
</scene>"#,
    );
    let options = "lights.xml -r 16 16 -x 8 -y 7 --sample 0";
    let reported = folder.succeed(&format!("explain {options} --integrator path")).out;
    assert!(reported.contains("Point \"key\"") && reported.contains("Spot \"fill\""), "{reported}");
    let reported = json(&folder, options);
    let sources = reported["contributions"].as_array().into_iter().flatten();
    let names: Vec<_> = sources.map(|part| &part["source"]["light"]["object"]).collect();
    assert_eq!(names[..2], ["key", "fill"], "{reported}");
}
