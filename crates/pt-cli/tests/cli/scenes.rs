//! Invalid scenes and missing files: messages, placeholders and exit status.

use serde_json::Value;

use crate::common::{Folder, Run};

/// A textured box in a lit room, with optional elements.
fn scene(more: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 0, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/></film>
    </sensor>
    <emitter type="constant"/>
    <shape type="cube"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
        <string name="filename" value="wood.png"/></texture></bsdf></shape>
    {more}
</scene>"#
    )
}

const ERRORS: &str = r#"<shape type="cone"/>
    <shape type="sphere"><float name="radios" value="1"/></shape>"#;

#[test]
fn a_render_without_a_file_says_so_and_shows_magenta() {
    let folder = Folder::new();
    folder.write("box.xml", scene(""));
    let run = folder.run("box.xml -s 16 -f out.exr -q --summary-json summary.json");
    assert_eq!(run.code, Some(4), "{run:?}");
    let place = "warning: box.xml:8:9: <string> \"filename\": \"wood.png\" not found";
    assert!(run.err.contains(place), "even with -q: {run:?}");
    assert!(run.err.contains("warning: a file of the scene is missing"), "{run:?}");
    let summary: Value = serde_json::from_slice(&folder.read("summary.json")).expect("JSON");
    assert_eq!(summary["missing_files"], 1);
    let image = folder.image("out.exr");
    let is_magenta = |p: &&[f32; 3]| p[0] > 0.3 && p[1] < 0.1 && p[2] > 0.3;
    assert!(image.pixels.iter().filter(is_magenta).count() > 5, "the squares are seen");

    let receipt = folder.succeed("info out.exr");
    assert!(receipt.out.contains("missing") && receipt.out.contains("wood.png"), "{receipt:?}");
    let again = folder.run("rerender out.exr -f again.exr");
    assert_eq!(again.code, Some(4), "{again:?}");
    assert_eq!(folder.image("again.exr"), image);
}

#[test]
fn strict_renders_refuse_what_is_missing_before_they_begin() {
    let folder = Folder::new();
    folder.write("box.xml", scene(""));
    let run = folder.run("box.xml -s 2 --strict");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("\"wood.png\" not found"), "{run:?}");
    assert_eq!(run.err.matches("wood.png").count(), 1, "reported once: {run:?}");
    assert_eq!(folder.files(), ["box.xml"]);
}

/// Samples taken with a placeholder are not used for the image with the file.
#[test]
fn a_render_does_not_go_on_when_a_file_has_come() {
    let folder = Folder::new();
    folder.write("box.xml", scene(""));
    assert_eq!(folder.run("box.xml -s 2 -f out.exr").code, Some(4));
    assert_eq!(folder.run("resume out.exr -s 4").code, Some(4));
    folder.run("-r 4 4 -s 1 -f wood.png");
    let run = folder.run("rerender out.exr");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("wood.png"), "{run:?}");
    let film = folder.read("out.exr.film");
    let run = folder.run("resume out.exr -s 8");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("the following changed") && run.err.contains("wood.png"), "{run:?}");
    assert!(folder.read("out.exr.film") == film, "it is as it was");
    let run = folder.succeed("box.xml -s 8 -f out.exr");
    assert!(run.err.contains("replaces the finished samples of another image"), "{run:?}");
    assert!(run.err.contains("wood.png"), "{run:?}");
    let run = folder.run("box.xml -s 2 -f out.exr --restart --limit texture-side=3");
    assert_eq!(run.code, Some(4), "{run:?}");
    assert!(run.err.contains("4 pixels along a side, more than the limit of 3"), "{run:?}");
    // The image was read in the earlier render too.
    let run = folder.succeed("box.xml -s 4 -f out.exr");
    assert!(run.err.contains("missing files: 1 before, 0 now"), "{run:?}");
}

#[test]
fn check_lists_all_that_is_wrong() {
    let folder = Folder::new();
    folder.write("box.xml", scene(ERRORS));
    let run = folder.run("check box.xml");
    assert_eq!(run.code, Some(2), "{run:?}");
    let lines: Vec<_> = run.out.lines().collect();
    let [cone, radios, wood, sum] = lines.as_slice() else { panic!("{run:?}") };
    assert!(
        cone.starts_with("error: box.xml:9:5: <shape>: unsupported shape type \"cone\""),
        "{cone}"
    );
    assert!(radios.starts_with("error: box.xml:10:26: <float> \"radios\":"), "{radios}");
    assert!(wood.starts_with("warning: box.xml:8:9:"), "{wood}");
    assert_eq!(*sum, "box.xml: 2 errors, 1 missing file, 0 notes");

    let run = folder.run("check --json box.xml");
    assert_eq!(run.code, Some(2), "{run:?}");
    let found: Value = serde_json::from_str(&run.out).expect("JSON");
    assert_eq!(found["counts"], serde_json::json!({"errors": 2, "missing": 1, "notes": 0}));
    assert_eq!(found["errors"][1]["line"], 10);
    assert_eq!(found["errors"][1]["element"], "<float> \"radios\"");

    let run = folder.run("box.xml");
    assert_eq!(run.code, Some(2), "{run:?}");
    for reported in ["cone", "radios", "wood.png"] {
        assert!(run.err.contains(reported), "a render reports all, too: {run:?}");
    }
}

#[test]
fn the_status_of_check_says_what_a_render_would_do() {
    let folder = Folder::new();
    folder.write("box.xml", scene(""));
    assert_eq!(folder.run("check box.xml").code, Some(4));
    assert_eq!(folder.run("check --strict box.xml").code, Some(2));
    folder.run("-r 4 4 -s 1 -f wood.png");
    let run = folder.succeed("check box.xml");
    assert_eq!(run.out, "box.xml: 0 errors, 0 missing files, 0 notes\n");
    folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
    let run = folder.run("check a.obj");
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.out.contains("note: a.obj:4:"), "{run:?}");
    let run = folder.run("check none.xml");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.out.contains("none.xml: cannot be read"), "{run:?}");
}

#[test]
fn paths_out_of_the_folder_need_an_option() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("inner")).expect("a folder");
    folder.run("-r 4 4 -s 1 -f wood.png");
    folder.write("inner/box.xml", scene("").replace("wood.png", "../wood.png"));
    let run = folder.run("inner/box.xml -s 2 -f out.png");
    assert_eq!(run.code, Some(4), "{run:?}");
    assert!(run.err.contains("--allow-outside"), "{run:?}");
    folder.succeed("inner/box.xml -s 2 -f out.png --allow-outside");
}

/// A folder is allowed by name, with its subfolders: on the command line, or in the configuration
/// file of the user.
#[test]
fn a_folder_beside_the_scene_may_be_allowed() {
    let folder = Folder::new();
    for name in ["scenes", "common", "common/wood", "other"] {
        std::fs::create_dir(folder.path(name)).expect("a folder");
    }
    folder.run("-r 4 4 -s 1 -f common/wood/wood.png");
    folder.run("-r 4 4 -s 1 -f other/wood.png");
    folder.write("scenes/a.xml", scene("").replace("wood.png", "../common/wood/wood.png"));
    folder.write("scenes/b.xml", scene("").replace("wood.png", "../other/wood.png"));
    assert_eq!(folder.run("check scenes/a.xml").code, Some(4));
    folder.succeed("check scenes/a.xml --allow-folder common");
    folder.succeed("scenes/a.xml -s 2 -f out.png --allow-folder other --allow-folder common/wood");
    assert_eq!(folder.run("check scenes/b.xml --allow-folder common").code, Some(4));
    let run = folder.run("check scenes/a.xml --allow-folder nowhere");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("found no folder \"nowhere\""), "{run:?}");
    let common = folder.path("common");
    folder.write("config", format!("# of all projects\n--allow-folder {}\n", common.display()));
    let with = |args: &str, config: &str| {
        let args: Vec<_> = args.split(' ').collect();
        let mut command = folder.command(&args);
        command.env("PATHTRACER_CONFIG", folder.path(config));
        Run::of(&command.output().expect("the program can be started"), &args.join(" "))
    };
    let run = with("check scenes/a.xml", "config");
    assert_eq!(run.code, Some(0), "{run:?}");
    let run = with("check scenes/b.xml", "config");
    assert_eq!(run.code, Some(4), "{run:?}");
    folder.write("config", "allow everything\n");
    let run = with("check scenes/a.xml", "config");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("config:1: expected a line \"--allow-folder DIR\""), "{run:?}");
    let run = with("check scenes/a.xml", "lost");
    assert_eq!(run.code, Some(2), "{run:?}");
}

#[test]
fn limits_have_names() {
    let folder = Folder::new();
    folder.write("box.xml", scene(""));
    let run = folder.run("box.xml --limit shape=3");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("did you mean \"shapes\""), "{run:?}");
    for wrong in ["shapes", "shapes=many", "shapes=0"] {
        let run = folder.run(&format!("box.xml --limit {wrong}"));
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains("--limit"), "{run:?}");
    }
    let run = folder.run("box.xml --limit memory=1kB --limit depth=2");
    assert!(run.err.contains("deeper than 2"), "{run:?}");
    let run = folder.run("box.xml --limit memory=100B");
    assert!(run.err.contains("exceeds the memory limit of 100 bytes"), "{run:?}");
}

#[test]
fn info_reports_what_a_scene_is_made_of() {
    let folder = Folder::new();
    folder.run("-r 4 4 -s 1 -f wood.png");
    folder.write("box.xml", scene("<shape type=\"cube\"/><shape type=\"sphere\"/>"));
    let run = folder.succeed("info box.xml");
    for line in [
        "objects             3: 2 of meshes, 1 of them instances, 1 spheres, 0 of points; 0 move",
        "bounds              -1.000000 -1.000000 -1.000000 to 1.000000 1.000000 1.000000",
        "1 Constant",
        "1 perspective",
        "resolution          16 x 12",
        "wood.png ",
    ] {
        assert!(run.out.contains(line), "{line}: {run:?}");
    }
    let run = folder.succeed("info --json box.xml");
    let found: Value = serde_json::from_str(&run.out).expect("JSON");
    assert_eq!(found["counts"]["triangles"], 12);
    assert_eq!(found["counts"]["triangles_placed"], 24);
    assert_eq!(found["materials"].as_array().map(Vec::len), Some(2));
    assert!(found["memory"]["textures"].as_u64() >= Some(4 * 4 * 3), "{found}");
    assert_eq!(found["files"].as_array().map(Vec::len), Some(2));
}
