//! Error targets and time limits.

use serde_json::Value;

use crate::common::Folder;

/// Render of a fraction of a second.
const RENDER: &str = "-r 40 30 -m 4 --target-error 25% --receipt full -f out.exr SCENE";

fn summary(folder: &Folder) -> Value {
    serde_json::from_slice(&folder.read("summary.json")).expect("JSON")
}

#[test]
fn a_render_ends_when_its_error_is_small_enough_and_says_so() {
    let folder = Folder::new();
    let run = folder.succeed(&format!("{RENDER} --summary-json summary.json --strict"));
    assert!(run.err.contains("asked for: 25 % with a confidence of 95 %"), "{run:?}");
    let summary = summary(&folder);
    let number = |name: &str| summary[name].as_f64().unwrap_or_else(|| panic!("no {name}"));
    let (error, most) = (number("error"), number("error_at_most"));
    assert!(0.1 < error && error < most && most <= 0.25, "{summary}");
    let reported = folder.succeed("info out.exr").out;
    let share = format!("{:.3} % (", 100.0 * error);
    assert!(
        reported.lines().any(|l| l.starts_with("error, as measured") && l.contains(&share)),
        "{reported}"
    );
    assert!(reported.contains("error 0.25, confidence 0.95, white 1"), "{reported}");
    let again = folder.succeed("rerender out.exr -t 3");
    assert!(again.err.contains("is the same to the bit"), "{again:?}");
    // The target is met already.
    let run = folder.succeed("resume out.exr");
    assert!(run.err.contains(" 0.00 million samples/s"), "{run:?}");
}

/// Noise of each pixel; with twice the exposure, the same samples have twice the noise.
#[test]
fn what_is_asked_of_pixels_is_asked_of_what_the_screen_shows() {
    let folder = Folder::new();
    let noise = |options: &str| {
        let args = "-r 24 18 -m 3 --confidence 90% --summary-json summary.json -f out.png SCENE";
        folder.succeed(&format!("{options} {args}"));
        summary(&folder)["noise"].as_f64().expect("a number")
    };
    for options in ["", "--exposure 1"] {
        let met = noise(&format!("--target-noise 12% {options}"));
        assert!(met <= 0.12, "{options}: {met}");
    }
    let too_few = "--target-noise 0.1% --max-spp 64";
    let [plain, bright] =
        ["", "--exposure 1"].map(|options| noise(&format!("{too_few} {options}")));
    assert!(plain > 0.05 && (bright / plain - 2.0).abs() < 1e-9, "{plain}, {bright}");
}

#[test]
fn a_target_that_is_missed_is_reported() {
    let folder = Folder::new();
    let args = "-r 12 9 --target-error 0.1% --max-spp 40 -f out.png SCENE";
    let run = folder.succeed(args);
    assert!(run.err.contains("warning: the error target was missed: "), "{run:?}");
    assert!(run.err.contains("all 40 samples of --max-spp were taken"), "{run:?}");
    assert_eq!(folder.run(&format!("{args} --strict")).code, Some(3));
}

/// The samples are kept, and the resumed render gives the image of a render without time limit.
#[test]
fn a_render_whose_time_is_up_can_go_on() {
    for options in ["-s 600", "--target-error 8%"] {
        let args = format!("-r 60 45 -m 5 -t 1 {options} --receipt stable -f out.exr SCENE");
        let (all, some) = (Folder::new(), Folder::new());
        all.succeed(&args);
        let run = some.succeed(&format!("{args} --time-limit 0.3 --progress json"));
        assert!(run.out.lines().last().is_some_and(|line| line.contains("\"stopped\"")), "{run:?}");
        assert!(run.err.contains("time limit reached"), "{run:?}");
        assert!(
            run.err.contains("help: pathtracer resume out.exr continues the render"),
            "{run:?}"
        );
        some.succeed("resume out.exr -t 2");
        assert!(some.read("out.exr") == all.read("out.exr"), "{options}");
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = Folder::new();
    for (args, words) in [
        ("--target-error 0", "expected a fraction above 0 and up to 100%"),
        ("--target-error=-1%", "expected a fraction above 0 and up to 100%"),
        ("--target-noise 200%", "expected a fraction above 0 and up to 100%"),
        ("--target-error x", "as in 1% or 0.01"),
        ("--target-error 1% --confidence 40%", "from 50% up to 99.9999%"),
        ("--target-error 1% -s 64", "cannot be used with"),
        ("--target-error 1% -a 32 0.1", "cannot be used with"),
        ("--target-error 1% --samples 0..4", "cannot be used with"),
        ("--target-error 1% --cs184", "cannot be used with"),
        ("--target-error 1% --sampler zsobol", "use --sampler sobol or independent"),
        ("--target-error 1% --max-spp 1", "from 2 up to 2147483648"),
        ("--max-spp 64", "require --target-error or --target-noise"),
        ("--confidence 90%", "require --target-error or --target-noise"),
        ("--uniform", "require --target-error or --target-noise"),
        ("--time-limit 0", "expected a time above 0"),
        ("--time-limit soon", "as in 10, 90s, 10m or 1h30m"),
        ("-s 2147483649", "from 1 up to 2147483648"),
        ("--samples 0..4 --aov half_a -f a.exr", "parts of an image have no halves"),
    ] {
        let run = folder.run(&format!("{args} SCENE"));
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(words), "{run:?}");
    }
    folder.succeed("-r 8 6 -s 4 --aov half_a,half_b -f a.film SCENE");
    let run = folder.run("merge a.film -f out.exr");
    assert!(run.code == Some(2) && run.err.contains("film with two halves"), "{run:?}");
}

/// A sample of the second half buffer is selected by its number.
#[test]
fn samples_of_both_halves_are_explained() {
    let folder = Folder::new();
    let explain = "explain -r 40 30 -m 4 --target-error 25% SCENE -x 20 -y 15";
    let run = folder.succeed(explain);
    assert!(run.err.contains("these samples are the first half"), "{run:?}");
    let of = |sample: u32| folder.succeed(&format!("{explain} --sample {sample}")).out;
    assert_ne!(of(3), of(2_147_483_651));
    let run = folder.run(&format!("{explain} --sample 40000"));
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("2147483648 to 2147516415 (second half)"), "{run:?}");
}
