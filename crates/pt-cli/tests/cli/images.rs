//! Images: their paths and formats, and the options that change them.

use pathtracer::Image;
use pathtracer::image::{self, BitDepth, SaveOptions, Tone, ToneCurve};

use crate::common::{Folder, SCENE, TINY};

#[test]
fn without_a_name_the_image_is_called_like_the_scene_and_lies_here() {
    let folder = Folder::new();
    let run = folder.succeed(&format!("{TINY} SCENE"));
    assert_eq!(folder.files(), ["cornell.png"]);
    assert_eq!(run.out, "");
    assert!(run.err.contains("saved cornell.png"), "{run:?}");
    std::fs::copy(SCENE, folder.path("a room.v2.dae")).unwrap();
    let args: Vec<&str> = TINY.split(' ').chain(["a room.v2.dae"]).collect();
    assert!(folder.command(&args).output().unwrap().status.success());
    assert!(folder.path("a room.v2.png").is_file(), "{:?}", folder.files());
}

#[test]
fn without_a_scene_a_room_of_ours_is_rendered_and_the_next_steps_are_reported() {
    let folder = Folder::new();
    let run = folder.succeed(TINY);
    assert_eq!(folder.files(), ["cornell.png"]);
    assert!(run.err.contains("saved cornell.png") && run.err.contains("Try next:"), "{run:?}");
    let with_file = folder.exr(&format!("{TINY} SCENE"));
    assert_eq!(folder.exr(TINY), with_file);
}

#[test]
fn quiet_is_quiet() {
    for mode in ["", "--cs184"] {
        let run = Folder::new().succeed(&format!("{TINY} -q {mode} SCENE"));
        assert_eq!((run.out.as_str(), run.err.as_str()), ("", ""));
    }
}

#[test]
fn png_files_have_the_bits_asked_for_and_exr_files_the_same_light() {
    let folder = Folder::new();
    for (args, bits) in [("", 8), ("--png-bits 8", 8), ("--png-bits 16", 16)] {
        folder.succeed(&format!("{TINY} {args} -f out.png SCENE"));
        // Byte after width and height in the header. [PNG specification, section 11.2.2]
        assert_eq!(folder.read("out.png")[24], bits, "{args}");
    }
    folder.succeed(&format!("{TINY} -f out.exr SCENE"));
    let (png, exr) = (folder.image("out.png"), folder.image("out.exr"));
    for (p, e) in png.pixels.iter().flatten().zip(exr.pixels.iter().flatten()) {
        // A level of 16 bits is at most 2.3/65535 wide where the slope of the curve is largest in
        // linear light.
        assert!((p - e.min(1.0)).abs() < 4e-5, "{p} is not {e}");
    }
}

/// Each tone curve with its exposure gives the result of the library, and changes nothing else.
#[test]
fn exposure_and_tonemap_change_png_images_by_their_laws() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} -f light.exr SCENE"));
    let light = folder.image("light.exr");
    for (args, exposure, curve) in [
        ("--exposure 0", 0.0, ToneCurve::Linear),
        ("--exposure -1.5 --tonemap linear", -1.5, ToneCurve::Linear),
        ("--tonemap filmic", 0.0, ToneCurve::Filmic),
        ("--exposure 3 --tonemap agx", 3.0, ToneCurve::Agx),
        ("--exposure 3 --tonemap aces", 3.0, ToneCurve::Aces),
        ("--exposure 3 --tonemap pbr-neutral", 3.0, ToneCurve::PbrNeutral),
    ] {
        for png_bits in [BitDepth::Eight, BitDepth::Sixteen] {
            let bits = if png_bits == BitDepth::Eight { 8 } else { 16 };
            folder.succeed(&format!("{TINY} --png-bits {bits} {args} -f out.png SCENE"));
            let tone = Tone { exposure, curve };
            let options = SaveOptions { png_bits, tone, ..SaveOptions::default() };
            image::save(&light, &folder.path("wanted.png"), &options).unwrap();
            assert_eq!(folder.image("out.png"), folder.image("wanted.png"), "{args}");
        }
    }
    let base = format!("{TINY} --receipt none");
    folder.succeed(&format!("{base} -f plain.png SCENE"));
    folder.succeed(&format!("{base} --exposure 0 --tonemap linear -f out.png SCENE"));
    assert_eq!(folder.read("out.png"), folder.read("plain.png"));
}

/// --exposure auto is the exposure that the library computes, whatever the number of threads. An
/// image that is nearly all black or white has a note with the option and the stops.
#[test]
fn exposure_fits_the_image_where_it_is_asked_to() {
    let folder = Folder::new();
    let scene = |name: &str, radiance: &str, intensity: &str| {
        let text = format!(
            r#"{{"pathtracer": 1, "cameras": [{{"type": "perspective", "x_fov": 40, "to_world": {{"translate": [0, 0, 4]}}}}],
            "objects": [{{"type": "sphere"}}], "lights": [{{"type": "constant", "radiance": {radiance}}},
            {{"type": "point", "intensity": {intensity}, "to_world": {{"translate": [0, 3, 4]}}}}]}}"#
        );
        std::fs::write(folder.path(name), text).unwrap();
    };
    scene("dim.json", "1e-7", "0.001");
    scene("bright.json", "50", "9");
    scene("plain.json", "0.25", "9");
    scene("black.json", "0", "0.001");
    let note = |scene: &str, more: &str| {
        let run = folder.succeed(&format!("-s 4 -r 16 12 {more} -f out.png {scene}"));
        let notes = run.err.lines().filter(|line| line.contains("image is")).collect::<Vec<_>>();
        notes.join("\n")
    };
    for (name, words) in [
        ("dim.json", "nearly all of the image is black"),
        ("bright.json", "nearly all of the image is brighter than white"),
        ("plain.json", ""),
    ] {
        let said = note(name, "");
        assert!(said.contains(words) && said.is_empty() == words.is_empty(), "{name}: {said}");
        assert_eq!(said.contains("--exposure auto"), !words.is_empty(), "{said}");
        assert_eq!(note(name, "--exposure auto"), "");
        folder.succeed(&format!("-s 4 -r 16 12 -f light.exr {name}"));
        let light = folder.image("light.exr");
        let tone = Tone { exposure: image::auto_exposure(&light), ..Tone::default() };
        let options = SaveOptions { tone, ..SaveOptions::default() };
        image::save(&light, &folder.path("wanted.png"), &options).unwrap();
        assert_eq!(folder.image("out.png"), folder.image("wanted.png"), "{name}");
    }
    assert_eq!(note("dim.json", "-q"), "");
    // The camera is inside a shape that hides the light.
    let inside = std::fs::read_to_string(folder.path("black.json")).unwrap();
    let inside = inside.replace("[0, 0, 4]", "[0, 0, 0]");
    std::fs::write(folder.path("black.json"), inside).unwrap();
    assert!(
        note("black.json", "")
            .contains("the image is black: no light reaches the visible surfaces")
    );
}

/// Ids, depth and positions keep 32 bits; values beyond 65504 are counted.
#[test]
fn exr_images_have_the_type_and_compression_asked_for() {
    let folder = Folder::new();
    let base = format!("{TINY} --aov albedo,depth,object SCENE");
    folder.succeed(&format!("{base} -f wanted.exr"));
    let wanted = folder.image("wanted.exr");
    for compression in ["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a"] {
        folder.succeed(&format!("{base} --exr-compression {compression} -f out.exr"));
        let error = if compression == "pxr24" { 2e-5 } else { 0.0 };
        for (a, b) in folder.image("out.exr").pixels.iter().zip(&wanted.pixels) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= error * b), "{compression}");
        }
    }
    let run = folder.succeed(&format!("{base} --exr-type half -f out.exr"));
    assert!(!run.err.contains("65504"), "{run:?}");
    let text = String::from_utf8_lossy(&folder.read("out.exr")).into_owned();
    // Names of channels, followed by their types: 0 is an integer, 1 half, 2 float.
    // [OpenEXR File Layout]
    for channel in ["albedo.R\0\u{1}", "depth.Z\0\u{2}", "object.id\0\0", "\0B\0\u{1}"] {
        assert!(text.contains(channel), "{channel:?}");
    }
    for (a, b) in folder.image("out.exr").pixels.iter().zip(&wanted.pixels) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= b / 2048.0 + 3e-8), "{a:?} {b:?}");
    }
    let bright = Image { width: 4, height: 2, pixels: vec![[1e9; 3]; 8].into() };
    image::save(&bright, &folder.path("bright.exr"), &SaveOptions::default()).unwrap();
    let run = folder.succeed("-r 4 3 -s 1 -m 0 -e bright.exr --exr-type half -f half.exr SCENE");
    let image = folder.image("half.exr");
    let greatest = image.pixels.as_flattened().iter().filter(|v| **v == 65_504.0).count();
    assert!(greatest > 0, "the camera sees some of that");
    assert!(run.err.contains(&format!("half.exr: {greatest} numbers exceed")), "{run:?}");
    assert!(image.pixels.iter().flatten().all(|v| *v <= 65_504.0));
}

#[test]
fn an_image_that_exists_is_replaced() {
    let folder = Folder::new();
    folder.write("out.png", "old");
    folder.succeed(&format!("{TINY} -f out.png SCENE"));
    assert_eq!(folder.image("out.png").width, 12);
    assert_eq!(folder.files(), ["out.png"]);
}

#[test]
fn threads_and_tiles_change_no_bit() {
    let folder = Folder::new();
    let base = "-r 40 30 -s 20 -a 4 0.3 SCENE";
    let wanted = folder.exr(&format!("{base} -t 1"));
    for args in ["-t 2", "-t 3", "-t 7", "-t 0", "-t 7 --tile-size 5", "-t 1 --tile-size 64"] {
        assert_eq!(folder.exr(&format!("{base} {args}")), wanted, "{args}");
    }
}

#[test]
fn the_builder_of_the_tree_changes_nothing_but_rounding() {
    let folder = Folder::new();
    folder.succeed("-r 24 18 -s 4 -f sah.exr SCENE");
    let sah = folder.image("sah.exr");
    for args in [
        "--bvh mean",
        "--bvh none",
        "--max-leaf-size 1",
        "--quality fast",
        "--quality balanced",
        "--quality high",
        "--quality high --bvh none",
    ] {
        folder.succeed(&format!("-r 24 18 -s 4 {args} -f other.exr SCENE"));
        let other = folder.image("other.exr");
        assert_eq!(other.pixels, sah.pixels, "{args}");
    }
}

/// Short and long names of options, with the other options that they need to have an effect.
const PAIRS: &[(&str, &str)] = &[
    ("-s 3", "--spp 3"),
    ("-l 3", "--light-samples 3"),
    ("-m 1", "--max-depth 1"),
    ("-o 0 -m 1", "--accumulate 0 --max-depth 1"),
    ("-H", "--hemisphere"),
    ("-H", "--direct hemisphere"),
    ("-r 9 12", "--resolution 9 12"),
    ("-p 2 1 5 4", "--cell 2 1 5 4"),
    ("-a 2 0.5 -s 8", "--adaptive 2 0.5 --spp 8"),
    ("-b 20 -d 900", "--lens-radius 20 --focal-distance 900"),
    ("-c camera.txt", "--camera camera.txt"),
    ("-e map.exr", "--environment map.exr"),
];

#[test]
fn short_and_long_names_mean_the_same_and_something_in_any_order() {
    let folder = Folder::new();
    folder.write("camera.txt", CAMERA);
    write_map(&folder);
    let without = |flags: &str| {
        let spp = if flags.contains("-s") { "" } else { "-s 2" };
        let size = if flags.contains("-r") { "" } else { "-r 12 9" };
        format!("{spp} {size}")
    };
    let plain = folder.exr("-r 12 9 -s 2 SCENE");
    for (short, long) in PAIRS {
        let rest = without(short);
        let wanted = folder.exr(&format!("{short} {rest} SCENE"));
        assert_ne!(wanted, plain, "{short} changes nothing");
        assert_eq!(folder.exr(&format!("{long} {rest} SCENE")), wanted, "{long}");
        assert_eq!(folder.exr(&format!("SCENE {rest} {short}")), wanted, "{short} behind");
        assert_eq!(folder.exr(&format!("{rest} SCENE {long}")), wanted, "{long} behind");
    }
    assert_eq!(folder.exr("-r 12 9 -s 2 -t 2 SCENE"), folder.exr("-r 12 9 -s 2 --threads 2 SCENE"));
}

#[test]
fn seeds_and_samplers_are_others() {
    let folder = Folder::new();
    let images: Vec<_> =
        ["", "--seed 1", "--sampler independent", "--seed 1 --sampler independent"]
            .iter()
            .map(|args| folder.exr(&format!("{TINY} {args} SCENE")))
            .collect();
    for (i, a) in images.iter().enumerate() {
        assert!(images[..i].iter().all(|b| a != b), "{i}");
    }
}

/// Means over the image, whose error is less than one percent at this number of samples.
#[test]
fn views_of_the_light_add_up() {
    let folder = Folder::new();
    let mean = |args: &str| {
        folder.succeed(&format!("-r 16 12 -s 512 {args} -f out.exr SCENE"));
        let pixels = folder.image("out.exr").pixels;
        pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * pixels.len()) as f64
    };
    let all = mean("-m 4");
    let near = |parts: &[f64], whole: f64| {
        let sum: f64 = parts.iter().sum();
        assert!((sum - whole).abs() < 0.02 * all, "{parts:?} are not {whole}");
    };
    let (direct, indirect) = (mean("-m 4 --show direct"), mean("-m 4 --show indirect"));
    let (emission, once) = (mean("-m 4 --show emission"), mean("-m 1 -o 0"));
    near(&[mean("-m 4 --show global")], all);
    near(&[direct, indirect], all);
    near(&[emission, once], direct);
    assert!([emission, once, indirect].iter().all(|part| *part > 0.05 * all), "nothing is shown");
}

#[test]
fn filters_change_the_image_and_the_box_is_the_default() {
    let folder = Folder::new();
    let plain = folder.exr(&format!("{TINY} SCENE"));
    assert_eq!(folder.exr(&format!("{TINY} --filter box SCENE")), plain);
    let mut seen = vec![plain];
    for filter in ["tent", "gaussian", "mitchell", "blackman-harris", "catmull-rom", "lanczos"] {
        let image = folder.exr(&format!("{TINY} --filter {filter} SCENE"));
        assert!(!seen.contains(&image), "{filter}");
        seen.push(image);
    }
}

/// A lit ball, with the given elements in its film.
fn small_mitsuba(film: &str) -> String {
    format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><transform name=\"to_world\">\
         <lookat origin=\"0 0 4\" target=\"0 0 0\" up=\"0 1 0\"/></transform><film \
         type=\"hdrfilm\"><integer name=\"width\" value=\"12\"/><integer name=\"height\" \
         value=\"8\"/>{film}</film></sensor><shape type=\"sphere\"/><emitter type=\"point\">\
         <point name=\"position\" value=\"3 3 3\"/></emitter></scene>"
    )
}

#[test]
fn the_filter_of_a_file_is_followed_unless_another_is_asked_for() {
    let folder = Folder::new();
    folder.write("silent.xml", small_mitsuba(""));
    folder.write("box.xml", small_mitsuba("<rfilter type=\"box\"/>"));
    let silent = folder.exr("-s 4 silent.xml");
    let boxed = folder.exr("-s 4 box.xml");
    assert_ne!(silent, boxed);
    assert_eq!(folder.exr("-s 4 --filter gaussian box.xml"), silent);
    assert_eq!(folder.exr("-s 4 --filter box silent.xml"), boxed);
    assert_eq!(folder.exr("-s 4 --cs184 silent.xml"), folder.exr("-s 4 --cs184 box.xml"));
}

#[test]
fn the_crop_window_of_a_file_is_its_image_at_any_size() {
    let folder = Folder::new();
    let crop = [("crop_offset_x", 3), ("crop_offset_y", 2), ("crop_width", 6), ("crop_height", 4)];
    let crop = crop.map(|(name, n)| format!("<integer name=\"{name}\" value=\"{n}\"/>")).concat();
    folder.write("all.xml", small_mitsuba(""));
    folder.write("crop.xml", small_mitsuba(&crop));
    for (resolution, [x, y, w, h]) in [("", [3, 2, 6, 4]), ("-r 24 16", [6, 4, 12, 8])] {
        folder.succeed(&format!("-s 2 {resolution} -f all.exr all.xml"));
        folder.succeed(&format!("-s 2 {resolution} -f crop.exr crop.xml"));
        let (all, crop) = (folder.image("all.exr"), folder.image("crop.exr"));
        assert_eq!((crop.width, crop.height), (w, h));
        let rows = (y..y + h).flat_map(|y| (x..x + w).map(move |x| (y, x)));
        let wanted: Vec<_> = rows.map(|(y, x)| all.pixels[(y * all.width + x) as usize]).collect();
        assert_eq!(crop.pixels, wanted, "{resolution}");
    }
    folder.succeed("-s 2 -p 0 0 2 3 -f cell.exr crop.xml");
    assert_eq!((folder.image("cell.exr").width, folder.image("cell.exr").height), (2, 3));
}

#[test]
fn blades_shape_the_lens_and_a_panorama_is_twice_as_wide_as_high() {
    let folder = Folder::new();
    let lens = format!("{TINY} -b 60 -d 700 SCENE");
    let round = folder.exr(&lens);
    let polygon = folder.exr(&format!("--aperture-blades 5 {lens}"));
    let turned = folder.exr(&format!("--aperture-blades 5 --aperture-rotation -30 {lens}"));
    assert!(polygon != round && turned != polygon);
    folder.succeed("-s 1 --integrator normals --panorama -f out.exr SCENE");
    let image = folder.image("out.exr");
    assert_eq!((image.width, image.height), (1200, 600));
}

#[test]
fn cells_are_cut_from_the_image_and_counted_from_below() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} -f all.exr SCENE"));
    folder.succeed(&format!("{TINY} -p 3 1 5 4 -f cell.exr SCENE"));
    let (all, cell) = (folder.image("all.exr"), folder.image("cell.exr"));
    assert_eq!((cell.width, cell.height), (5, 4));
    for y in 0..4 {
        for x in 0..5 {
            // Row 0 of the cell is row 1 + 3 of the image, counted from the bottom.
            let row = 9 - 1 - (1 + 3 - y);
            assert_eq!(cell.pixels[y * 5 + x], all.pixels[row * 12 + 3 + x], "({x}, {y})");
        }
    }
}

#[test]
fn adaptive_sampling_writes_its_rates() {
    let folder = Folder::new();
    folder.succeed("-r 12 9 -s 64 -a 8 0.2 -f out.exr SCENE");
    assert_eq!(folder.files(), ["out.exr", "out.exr.film", "out_rate.png"]);
    let rates = folder.image("out_rate.png");
    assert_eq!((rates.width, rates.height), (12, 9));
    assert!(rates.pixels.iter().any(|p| *p != rates.pixels[0]), "all pixels took the same samples");
}

/// Additional channels do not change the colours of an image.
#[test]
fn more_channels_leave_the_colours_alone() {
    let folder = Folder::new();
    let args = "-r 12 9 -s 2 SCENE";
    folder.succeed(&format!("{args} -f plain.exr"));
    folder.succeed(&format!("{args} --aov albedo,depth,object -f more.exr"));
    assert_eq!(folder.image("more.exr"), folder.image("plain.exr"));
    let (plain, more) = (folder.read("plain.exr"), folder.read("more.exr"));
    for name in ["albedo.R", "albedo.G", "albedo.B", "depth.Z", "object.id"] {
        let has = |file: &[u8]| file.windows(name.len()).any(|w| w == name.as_bytes());
        assert!(has(&more) && !has(&plain), "{name}");
    }
}

/// A Mitsuba scene may request the supported AOVs; without room for them, they are left out with a
/// note.
#[test]
fn scenes_may_ask_for_more_channels() {
    let folder = Folder::new();
    let types = "albedo depth geo_normal position prim_index sh_normal shape_index uv";
    let list: Vec<_> = types.split(' ').map(|kind| format!("a:{kind}")).collect();
    let list = list.join(",");
    let scene = format!(
        "<scene version=\"3.0.0\"><integrator type=\"aov\"><string name=\"aovs\" value=\"{list}\"/>\
         <integrator type=\"path\"/></integrator><sensor type=\"perspective\"/>\
         <shape type=\"sphere\"/></scene>"
    );
    folder.write("scene.xml", scene);
    let asked = folder.succeed("-r 12 9 -s 2 -f out.exr scene.xml").err;
    assert!(!asked.contains("left out"), "{asked}");
    let file = folder.read("out.exr");
    let names = [
        "albedo.R",
        "depth.Z",
        "geometric_normal.X",
        "position.X",
        "primitive.id",
        "normal.X",
        "object.id",
        "uv.V",
    ];
    for name in names {
        assert!(file.windows(name.len()).any(|w| w == name.as_bytes()), "{name}");
    }
    let reported = folder.succeed("-r 12 9 -s 2 -f out.png scene.xml").err;
    assert!(reported.contains("omitted without -f out.exr"), "{reported}");
}

#[test]
fn the_summary_as_json_counts_samples_and_rays() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} -t 1 --summary-json out.json -f out.png SCENE"));
    let text = String::from_utf8(folder.read("out.json")).unwrap();
    for wanted in ["\"samples\": 216,", "\"threads\": 1,", "\"spheres\": 2,", "\"rays\": "] {
        assert!(text.contains(wanted), "{wanted} is missing in {text}");
    }
}

/// The reported fraction of clamped light is the difference of the images.
#[test]
fn clamping_reports_what_it_costs() {
    let folder = Folder::new();
    let args = "-r 24 18 -s 8 --summary-json out.json SCENE";
    let light = |name: &str| -> f64 {
        let image = folder.image(name);
        image.pixels.iter().flatten().map(|&v| f64::from(v)).sum()
    };
    let percent = || -> f64 {
        let text = String::from_utf8(folder.read("out.json")).unwrap();
        let line = text.lines().find_map(|l| l.trim().strip_prefix("\"clamped_percent\": "));
        line.unwrap().trim_end_matches(',').parse().unwrap()
    };
    let run = folder.succeed(&format!("{args} -f all.exr"));
    assert!(percent() == 0.0 && !run.err.contains("clamped"), "{run:?}");
    let run = folder.succeed(&format!("{args} -f less.exr --clamp 0.2"));
    assert!(run.err.contains("% of the light was cut off"), "{run:?}");
    assert!((1.0..99.0).contains(&percent()), "{} %", percent());
    // The channels have equal weights here, and luminance weights in the report.
    let lost = 100.0 * (1.0 - light("less.exr") / light("all.exr"));
    assert!((lost - percent()).abs() < 0.2 * percent(), "{lost} % and {} %", percent());
}

/// A square under an environment of one radiance reflects albedo times that radiance.
#[test]
fn an_environment_lights_the_scene() {
    let folder = Folder::new();
    folder.write(
        "square.obj",
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\n",
    );
    write_map(&folder);
    folder.succeed("-r 8 8 -s 64 -m 1 -e map.exr -f out.exr square.obj");
    let image = folder.image("out.exr");
    let center = image.pixels[4 * 8 + 4];
    for (value, radiance) in center.iter().zip(MAP) {
        // The default material has albedo 0.5.
        assert!((value - 0.5 * radiance).abs() < 0.02 * radiance, "{center:?}");
    }
    assert_eq!(image.pixels[0], MAP, "the corner shows the map itself");
}

/// A scene without lights and camera is shown with studio lighting, unless an environment or
/// --cs184 is given.
#[test]
fn a_bare_mesh_is_shown_in_the_light_of_a_studio() {
    let folder = Folder::new();
    let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";
    folder.write("square.obj", square);
    write_map(&folder);
    let notes = ["studio lighting is used", "the view is from the front, the right and above"];
    let run = folder.succeed("-r 16 12 -s 64 -f out.exr square.obj");
    assert!(notes.iter().all(|note| run.err.contains(note)), "{run:?}");
    let image = folder.image("out.exr");
    let (corner, center) = (image.pixels[0], image.pixels[6 * 16 + 8]);
    assert!(corner.iter().all(|x| *x == corner[0] && (0.1..0.3).contains(x)), "{corner:?}");
    assert!(center.iter().all(|x| (0.2..0.8).contains(x)), "{center:?}");
    let run = folder.succeed("-r 16 12 -s 4 -f out.exr -e map.exr square.obj");
    assert!(!run.err.contains(notes[0]) && run.err.contains(notes[1]), "{run:?}");
    assert_eq!(folder.image("out.exr").pixels[0], MAP);
    let run = folder.succeed("--cs184 -r 16 12 -s 4 -f out.exr square.obj");
    assert!(!notes.iter().any(|note| run.err.contains(note)), "{run:?}");
    assert!(folder.image("out.exr").pixels.iter().all(|pixel| *pixel == [0.0; 3]));
}

/// Radiance of the environment map of the tests.
const MAP: [f32; 3] = [1.0, 2.0, 0.5];

fn write_map(folder: &Folder) {
    let map = Image { width: 8, height: 4, pixels: vec![MAP; 32].into() };
    image::save(&map, &folder.path("map.exr"), &SaveOptions::default()).unwrap();
}

/// Camera settings file of the course's program: in front of the room, in its millimetres.
const CAMERA: &str = "40 30 1.333 1 10000\n278 273 -900 278 273 0\n1.57 3.14 900 1 9000\n\
                      -1 0 0 0 1 0 0 0 -1\n800 600 1000\n4.7 0\n";

#[test]
fn what_names_stand_for_is_what_the_file_or_the_command_line_says() {
    let folder = Folder::new();
    let scene = |power: &str| {
        format!(
            "<scene version=\"3.0.0\"><default name=\"power\" value=\"{power}\"/>\
             <emitter type=\"constant\"><rgb name=\"radiance\" value=\"$power\"/></emitter></scene>"
        )
    };
    folder.write("one.xml", scene("1"));
    folder.write("two.xml", scene("2"));
    let two = folder.exr(&format!("{TINY} two.xml"));
    assert_eq!(folder.exr(&format!("{TINY} -D power=2 one.xml")), two);
    assert_eq!(folder.exr(&format!("{TINY} one.xml --define power=2")), two);
    assert_ne!(folder.exr(&format!("{TINY} one.xml")), two);
}

#[test]
fn a_camera_file_moves_the_camera() {
    let folder = Folder::new();
    folder.write("camera.txt", CAMERA);
    folder.succeed(&format!("{TINY} --integrator normals -c camera.txt -f out.exr SCENE"));
    // The middle shows the back wall, whose normal is −z: (n + 1)/2 = (½, ½, 0).
    let middle = folder.image("out.exr").pixels[4 * 12 + 6];
    let wanted = [0.5, 0.5, 0.0];
    assert!(middle.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-3), "{middle:?}");
}
