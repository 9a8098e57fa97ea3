//! Progress display, as text and as JSON.

use serde_json::Value;

use crate::common::{Folder, TINY};

#[test]
fn progress_for_programs_is_lines_of_json() {
    let folder = Folder::new();
    let run = folder.succeed("-r 60 45 -s 900 -m 6 -t 1 --progress json -f out.exr SCENE");
    let lines: Vec<Value> =
        run.out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let (last, before) = lines.split_last().expect("there is a line at least");
    assert_eq!(last["state"], "finished");
    assert_eq!(
        (&last["samples"], &last["samples_in_all"]),
        (&(60 * 45 * 900).into(), &(60 * 45 * 900).into())
    );
    assert!(last["rays"].as_u64() > Some(60 * 45 * 900), "{last}");
    assert!(last["seconds"].as_f64() > Some(0.0), "{last}");
    for line in before {
        assert_eq!(line["state"], "rendering");
        let left = &line["seconds_left"];
        let [least, likely, most] = ["least", "likely", "most"].map(|name| left[name].as_f64());
        assert!(left.is_null() || least <= likely && likely <= most, "{line}");
    }
    folder.succeed("resume out.exr -s 901 -q");
}

#[test]
fn progress_is_shown_as_it_was_asked_for() {
    let folder = Folder::new();
    for (kind, output) in [("auto", ""), ("lines", ""), ("bar", ""), ("none", "")] {
        let run = folder.succeed(&format!("{TINY} --progress {kind} -f out.png SCENE"));
        assert_eq!(run.out, output, "{run:?}");
        assert!(run.err.contains("saved out.png"), "{run:?}");
    }
    let run = folder.run(&format!("{TINY} --progress much -f out.png SCENE"));
    assert_eq!(run.code, Some(2), "{run:?}");
}
