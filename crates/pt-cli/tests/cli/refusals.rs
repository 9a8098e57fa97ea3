//! Invalid command lines are rejected: exit status 2, one message, and no files left behind.

use crate::common::{Folder, SCENE, TINY};

/// Asserts that the program fails with one message that contains `wanted`.
fn refuses(folder: &Folder, args: &str, wanted: &str) {
    let before = folder.files();
    let run = folder.run(args);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert_eq!(run.out, "", "{run:?}");
    let messages = run.err.lines().filter(|l| l.starts_with("error: ")).count();
    assert_eq!(messages, 1, "{run:?}");
    let first = run.err.lines().next().unwrap_or_default();
    assert!(first.starts_with("error: ") && run.err.contains(wanted), "{wanted}: {run:?}");
    assert!(!run.err.contains("panicked"), "{run:?}");
    assert_eq!(folder.files(), before, "{run:?}");
}

#[test]
fn numbers_that_make_no_sense() {
    let folder = Folder::new();
    let whole = "a whole number from 1 up";
    for (args, wanted) in [
        ("-s 0 SCENE", whole),
        ("-s -1 SCENE", whole),
        ("-s 1.5 SCENE", whole),
        ("-s 4294967296 SCENE", whole),
        ("-s many SCENE", whole),
        ("-l 0 SCENE", "a number from 1 up to 65536"),
        ("-l 4000000000 SCENE", "a number from 1 up to 65536"),
        ("-m -1 SCENE", "a whole number from 0 up"),
        ("-o -1 SCENE", "a whole number from 0 up"),
        ("-t -1 SCENE", "a number of threads"),
        ("-t 5000 SCENE", "a number of threads"),
        ("-r -1 5 SCENE", "a number of pixels"),
        ("-r 0 5 SCENE", "a number of pixels"),
        ("-r 32x24 SCENE", "a number of pixels"),
        ("-r 32x24", "2 values required"),
        ("-r 10", "2 values required"),
        ("-r 10 SCENE", "a number of pixels"),
        ("-r 1000000 1000000 SCENE", "at most"),
        ("-a 0 -1 SCENE", "BATCH: expected a whole number from 1 up"),
        ("-a 64 -0.1 SCENE", "TOLERANCE: expected a number from 0 up"),
        ("-a 64 NaN SCENE", "TOLERANCE: expected a number from 0 up"),
        ("-a 64 inf SCENE", "TOLERANCE: expected a number from 0 up"),
        ("-a 64 SCENE", "TOLERANCE: expected a number from 0 up"),
        ("-a 64", "2 values required"),
        ("--max-memory 8X SCENE", "an amount of memory, as in 500MB"),
        ("--max-memory 0 SCENE", "an amount of memory, as in 500MB"),
        ("--max-memory -1 SCENE", "an amount of memory, as in 500MB"),
        ("-b -1 SCENE", "a number from 0 up"),
        ("-b NaN SCENE", "a number from 0 up"),
        ("-d 0 SCENE", "a number above 0"),
        ("--clamp 0 SCENE", "a number above 0"),
        ("--path-reuse 3 SCENE", "1 (none), 2 or 4"),
        ("--split 3 SCENE", "power of two from 1 (none) up to 64"),
        ("--clamp-indirect NaN SCENE", "a number above 0"),
        ("--integrator ao --ao-distance -1 SCENE", "a number from 0 up"),
        ("--integrator ao --ao-distance inf SCENE", "a number from 0 up"),
        ("-p 1 1 5 SCENE", "a whole number from 0 up"),
        ("--seed -1 SCENE", "a whole number from 0 up"),
        ("--filter sinc SCENE", "mitchell"),
        ("--aperture-blades 2 SCENE", "a number of blades from 3 up to 1000"),
        ("--aperture-blades -5 SCENE", "a number of blades"),
        ("--aperture-rotation NaN SCENE", "a number of degrees"),
        ("--exposure 101 SCENE", "a number of stops from -100 up to 100"),
        ("--exposure NaN SCENE", "a number of stops"),
        ("--exposure bright SCENE", "or auto"),
        ("--exposure auto --target-error 0.1 SCENE", "requires a fixed exposure"),
        ("--exposure 1 --cs184 SCENE", "cannot be used with"),
        ("--denoise --cs184 SCENE", "cannot be used with"),
        ("--exposure 1 -f out.exr SCENE", "give -f out.png, or omit them"),
        ("--tonemap agx -f out.exr SCENE", "require a PNG image"),
        ("--tonemap reinhard SCENE", "pbr-neutral"),
        ("--exr-type half SCENE", "require an OpenEXR image, as in -f out.exr"),
        ("--exr-compression piz -f out.png SCENE", "require an OpenEXR image"),
        ("--exr-compression dwaa -f out.exr SCENE", "b44a"),
        ("--tev 127.0.0.1 SCENE", "as in 127.0.0.1:14158"),
        ("--tev :14158 SCENE", "the host and port of tev"),
        ("--tev host:0 SCENE", "the host and port of tev"),
        ("--panorama --cs184 SCENE", "cannot be used with"),
        ("--panorama -b 5 SCENE", "lens of a camera that is not perspective"),
        ("--max-leaf-size 0 SCENE", "a number of shapes"),
        ("--tile-size 0 SCENE", whole),
        ("-s SCENE", whole),
        ("SCENE -s", "a value is required"),
    ] {
        refuses(&folder, args, wanted);
    }
}

#[test]
fn words_that_mean_nothing() {
    let folder = Folder::new();
    for (args, wanted) in [
        ("--frobnicate SCENE", "'--frobnicate'"),
        ("-HX SCENE", "'-X'"),
        ("-Z SCENE", "'-Z'"),
        ("--resolutoin 12 9 SCENE", "'--resolution'"),
        ("--bvh quick SCENE", "sah, mean, none"),
        ("--quality best SCENE", "fast, balanced, high"),
        ("--show all SCENE", "emission, direct, indirect, global"),
        ("--direct sideways SCENE", "mis, light, hemisphere, cosine"),
        ("--sampler dice SCENE", "sobol, zsobol, stratified, independent"),
        ("--png-bits 12 SCENE", "8, 16"),
        ("--integrator bdpt SCENE", "  normals: "),
        ("-H --direct light SCENE", "cannot be used with"),
        (
            "--path-reuse 2 --integrator ao SCENE",
            "--path-reuse requires --integrator path; ao does",
        ),
        ("--split 2 --integrator ao SCENE", "--path-splitting requires --integrator path, direct;"),
        ("--split 2 --path-reuse 2 SCENE", "mutually exclusive"),
        ("--path-reuse 4 --cs184 SCENE", "--path-reuse requires --integrator path; cs184 does"),
        (
            "--clamp 1 --integrator ao SCENE",
            "require --integrator path, reference, volpath, direct; ao",
        ),
        (
            "--clamp-indirect 1 --cs184 SCENE",
            "require --integrator path, reference, volpath, direct;",
        ),
        ("--ao-distance 1 SCENE", "--ao-distance requires --integrator ao; path does"),
        ("--aov shadow -f out.exr SCENE", "albedo, normal, geometric_normal, depth"),
        ("--aov depth,depth -f out.exr SCENE", "duplicate --aov \"depth\""),
        ("--aov depth SCENE", "as in -f out.exr"),
        ("--light-groups each SCENE", "as in -f out.exr"),
        ("--light-groups , -f out.exr SCENE", "as in sky,key=lamp+window"),
        ("--light-groups a.b=light -f out.exr SCENE", "letters, digits and _"),
        ("--light-groups a=light,a=sky -f out.exr SCENE", "duplicate group of lights \"a\""),
        (
            "--light-groups lamp -f out.exr SCENE",
            "unknown light \"lamp\"; the lights of the scene are \"light\"",
        ),
        (
            "--light-groups lihgt -f out.exr SCENE",
            "unknown light \"lihgt\" (did you mean \"light\"?); the lights",
        ),
        (
            "--light-groups each --path-reuse 2 -f out.exr SCENE",
            "without --path-reuse, --path-splitting and --cs184",
        ),
        (
            "--light-groups each --split 2 -f out.exr SCENE",
            "--light-groups requires --integrator path",
        ),
        ("--light-groups each --integrator ao -f out.exr SCENE", "--light-groups requires"),
        ("--light-groups each --direct cosine -f out.exr SCENE", "with --direct mis or light"),
        (
            "--aov cryptomatte_object --exr-compression pxr24 -f out.exr SCENE",
            "keeps 24 of 32 bits",
        ),
        ("--aov depth -f out.png SCENE", "as in -f out.exr"),
        ("-s 1 -s 2 SCENE", "multiple times"),
        ("SCENE SCENE", "found two scenes"),
        ("a.dae b.dae c.dae", "found two scenes"),
        ("-f -s 1 SCENE", "missing value of -f; give the name of an image file"),
        ("-f out.gif SCENE", ".png, .exr or .film"),
        ("-f out SCENE", ".png, .exr or .film"),
        ("-D radius SCENE", "expected NAME=VALUE"),
        ("-D =1 SCENE", "expected NAME=VALUE"),
        ("-D r=1", "-D r: the embedded scene has no definitions"),
        ("--define r=1 SCENE", "unsupported definition \"r\": COLLADA has no definitions"),
        ("--time 1", "--time: the embedded scene has no animations; use a glTF scene"),
        ("--time 1 SCENE", "unsupported time 1: animations of COLLADA are not read"),
        ("--time -1 SCENE", "expected a time from 0 up"),
        ("--completions tcsh", "bash, elvish, fish, powershell, zsh"),
    ] {
        refuses(&folder, args, wanted);
    }
}

#[test]
fn cells_outside_of_the_image() {
    let folder = Folder::new();
    for cell in ["8 0 5 5", "0 5 5 5", "0 0 0 5", "0 0 5 0", "4294967295 0 1 1"] {
        let args = format!("{TINY} -p {cell} SCENE");
        refuses(&folder, &args, "expected a cell with pixels inside of the image of 12 x 9");
    }
}

#[test]
fn scenes_that_cannot_be_read() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("folder.dae")).unwrap();
    folder.write("broken.dae", "<COLLADA>\n<asset>\n</COLLADA>\n");
    folder.write("other.xml", "<scene version=\"3.0.0\">\n  <shape type=\"torus\"/>\n</scene>\n");
    folder.write("empty.ply", "");
    folder.write("text.obj", "v 1 2\n");
    folder.write("notes.txt", "no scene");
    for (scene, wanted) in [
        ("missing.dae", "missing.dae: cannot be read: No such file"),
        ("folder.dae", "folder.dae: cannot be read: it is a folder, and no regular file"),
        ("broken.dae", "broken.dae:3:1: "),
        ("other.xml", "other.xml:2:"),
        ("empty.ply", "empty.ply"),
        ("text.obj", "text.obj:1"),
        ("notes.txt", "known extensions: .dae, .gltf, .glb, .xml, .pbrt, .json, .ply, .stl, .obj"),
        ("noending", "known extensions:"),
    ] {
        refuses(&folder, &format!("{TINY} {scene}"), wanted);
        refuses(&folder, &format!("{TINY} -f out.exr {scene}"), wanted);
    }
}

#[test]
fn definitions_that_a_scene_has_no_use_for() {
    let folder = Folder::new();
    let content = "<default name=\"light\" value=\"1\"/><emitter type=\"constant\">\
                   <rgb name=\"radiance\" value=\"$light\"/></emitter>";
    folder.write("sky.xml", format!("<scene version=\"3.0.0\">{content}</scene>"));
    for (args, wanted) in [
        ("-D lihgt=2", "sky.xml: unused definition of \"lihgt\" (did you mean \"light\"?)"),
        ("-D light=2 -D light=2", "sky.xml: duplicate definition of \"light\""),
        ("-D light=much", "found \"much\", expected a number"),
    ] {
        refuses(&folder, &format!("{TINY} {args} sky.xml"), wanted);
    }
}

#[test]
fn a_missing_scene_is_reported_once() {
    let run = Folder::new().run("missing.dae");
    assert_eq!(run.err.matches("No such file").count(), 1, "{run:?}");
}

#[test]
fn places_that_take_no_image() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("folder.png")).unwrap();
    folder.write("file", "");
    refuses(&folder, &format!("{TINY} -f no/where.png SCENE"), "found no folder no;");
    refuses(&folder, &format!("{TINY} -f file/out.png SCENE"), "found no folder file;");
    refuses(&folder, &format!("{TINY} -f folder.png SCENE"), "folder.png: found a folder");
    refuses(&folder, &format!("{TINY} --summary-json no/a.json SCENE"), "found no folder no;");
}

/// Even the administrator cannot create a file there.
#[cfg(target_os = "linux")]
#[test]
fn folders_that_cannot_be_written() {
    let folder = Folder::new();
    refuses(
        &folder,
        &format!("{TINY} -f /proc/out.png SCENE"),
        "/proc/out.png: cannot create a file",
    );
}

/// The limit is checked before memory is allocated: for the film, for the hierarchy of a mesh, and
/// for a file.
#[test]
fn renders_that_need_too_much_memory() {
    let folder = Folder::new();
    let needs = |args: &str, want: &str| {
        refuses(&folder, args, want);
        refuses(&folder, args, "more than --max-memory allows");
    };
    // 125 bytes per pixel; 24 more for each of the three numbers and their count; 96 for each
    // group.
    needs("-r 2000 1000 --max-memory 100MB SCENE", "250.0 MB for the film");
    needs(
        "-r 2000 1000 --aov position --max-memory 250MB -f out.exr SCENE",
        "442.0 MB for the film",
    );
    // Before the scene is read, one group of all lights is counted; then also one for its light and
    // one for a background.
    let groups = "-r 2000 1000 --light-groups each -f out.exr SCENE --max-memory";
    needs(&format!("{groups} 300MB"), "442.0 MB for the film");
    needs(&format!("{groups} 500MB"), "826.0 MB for the film");
    needs(&format!("{groups} 1200MB --target-noise 5%"), "1.8 GB for the film");
    folder.succeed("-r 2000 1000 -p 0 0 9 9 -s 1 --max-memory 100MB SCENE");
    folder.write("many.obj", "v 0 0 0\nv 0 1 0\nv 0 0 1\nf -3 -2 -1\n".repeat(100_000));
    needs("-r 12 9 --max-memory 3MB many.obj", "3.5 MB for the files of the scene");
    needs("-r 12 9 --max-memory 20MB many.obj", "12.5 MB for its tables and tree");
    folder.succeed("-r 12 9 -s 1 --max-memory 200MB many.obj");
}

#[test]
fn files_beside_the_scene_that_cannot_be_read() {
    let folder = Folder::new();
    folder.write("camera.txt", "50 38 wide");
    folder.write("broken.exr", "no image");
    for (args, wanted) in [
        ("-e missing.exr", "missing.exr: cannot be read: No such file"),
        ("-e broken.exr", "broken.exr: "),
        ("-e map.svg", ".png, .exr, .hdr, .rgbe, .jpg, .jpeg, .tga"),
        ("-c missing.txt", "missing.txt: cannot be read: No such file"),
        ("-c camera.txt", "camera.txt:1: camera settings: found \"wide\" for aspect"),
    ] {
        refuses(&folder, &format!("{TINY} {args} SCENE"), wanted);
    }
}

#[test]
fn an_old_image_survives_a_refusal() {
    let folder = Folder::new();
    folder.write("out.png", "old");
    refuses(&folder, "-f out.png missing.dae", "missing.dae");
    assert_eq!(folder.read("out.png"), b"old");
    assert!(std::path::Path::new(SCENE).is_file());
}
