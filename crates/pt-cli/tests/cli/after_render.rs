//! Commands on rendered images: development, denoising, and images of parts that become a whole.

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Layer, LayerAttributes,
    WritableImage, read_all_flat_layers_from_file,
};
use pathtracer::image::{self, Image, SaveOptions};

use crate::common::{Folder, Run, SCENE, TINY};

/// A ball in front of a hidden background.
const BALL: &str = r#"{"pathtracer": 1, "cameras": [{"type": "perspective", "x_fov": 40, "to_world": {"translate": [0, 0, 5]}}],
    "objects": [{"type": "sphere"}], "lights": [{"type": "constant", "radiance": 0.7}]}"#;

/// Rectangle in which all samples hit a surface of the Cornell box, at 40 × 30 pixels.
const INSIDE: &str = "-r 40 30 -s 4 -p 10 5 20 20";

fn with_ball() -> Folder {
    let folder = Folder::new();
    folder.write("ball.json", BALL);
    folder
}

/// Asserts that the program fails with one message that contains `wanted`, and leaves no file.
fn refuses(folder: &Folder, args: &str, wanted: &str) {
    let before = folder.files();
    let run = folder.run(args);
    assert_eq!(run.code, Some(2), "{run:?}");
    let messages = run.err.lines().filter(|line| line.starts_with("error: ")).count();
    assert!(messages == 1 && run.err.contains(wanted), "{wanted}: {run:?}");
    assert!(!run.err.contains("panicked"), "{run:?}");
    assert_eq!(folder.files(), before, "{run:?}");
}

/// The files are equal to the byte, except that metadata mention the alpha that is left out.
#[test]
fn developed_images_are_those_of_a_render() {
    let folder = with_ball();
    let base = "--metadata stable -r 16 12 -s 4";
    for (scene, options) in [
        (SCENE, ""),
        (SCENE, "--exposure 1.5 --tonemap agx"),
        (SCENE, "--exposure auto --tonemap filmic --png-bits 16"),
        ("ball.json", "--exposure -1 --png-bits 16 --alpha"),
        ("ball.json", "--tonemap aces --alpha"),
        ("ball.json", "--alpha=off"),
    ] {
        let of_scene = format!("{base} --hide-background {scene}");
        let of_file = if scene == SCENE { "" } else { "--alpha" };
        folder.succeed(&format!("{of_scene} {of_file} -f light.exr"));
        folder.succeed(&format!("{of_scene} {options} -f wanted.png"));
        folder.succeed(&format!("develop light.exr {options} -f out.png"));
        let stored = |name| image::load_rgba_raw(&folder.path(name)).unwrap();
        assert!(stored("out.png") == stored("wanted.png"), "{scene} {options}");
        let is_same_file = folder.read("out.png") == folder.read("wanted.png");
        assert!(is_same_file || options.contains("off"), "{scene} {options}");
    }
    // Without a switch, alpha is as in the image.
    folder.succeed("develop light.exr -f out.png");
    folder.succeed(&format!("{base} --hide-background ball.json --alpha -f wanted.png"));
    assert!(folder.read("out.png") == folder.read("wanted.png"));
}

/// The exposure is that of the pixels that are left, as in a render of these.
#[test]
fn crops_are_those_of_a_render() {
    let folder = Folder::new();
    let base = "--metadata none -r 16 12 -s 4 SCENE";
    for crop in ["-p 3 2 9 5", "--crop 0 0 16 1 --exposure auto"] {
        folder.succeed(&format!("{base} -f light.exr"));
        folder.succeed(&format!("{base} {crop} -f wanted.png"));
        folder.succeed(&format!("develop light.exr {crop} -f out.png"));
        assert_eq!(folder.image("out.png"), folder.image("wanted.png"), "{crop}");
    }
    folder.succeed("develop light.exr -p 3 2 9 5 -f out.exr");
    folder.succeed(&format!("{base} -p 3 2 9 5 -f wanted.exr"));
    assert_eq!(folder.image("out.exr"), folder.image("wanted.exr"));
}

/// The mean of light is kept, and no value is beyond those of the image.
#[test]
fn sizes_change_in_linear_light() {
    let folder = Folder::new();
    folder.succeed(&format!("-r 32 24 -s 4 -f light.exr {SCENE}"));
    folder.succeed("develop light.exr --resize 8 6 -f small.exr");
    folder.succeed("develop light.exr --resize 64 30 -f large.png");
    let [light, small] = ["light.exr", "small.exr"].map(|name| folder.image(name));
    let large = folder.image("large.png");
    assert_eq!([small.width, small.height, large.width, large.height], [8, 6, 64, 30]);
    let mean = |image: &Image| {
        let values = image.pixels.iter().flatten().map(|v| f64::from(*v));
        values.sum::<f64>() / image.pixels.len() as f64
    };
    // Only pixels at the edges have other weights.
    assert!((mean(&small) / mean(&light) - 1.0).abs() < 0.1, "{} {}", mean(&small), mean(&light));
    let most = light.pixels.as_flattened().iter().fold(0.0_f32, |most, v| most.max(*v));
    assert!(small.pixels.iter().flatten().all(|v| (0.0..=most).contains(v)));
}

#[test]
fn layers_are_developed_by_their_names() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} --aov albedo,depth,object --metadata none -f all.exr SCENE"));
    folder.succeed("develop all.exr --layer albedo -f albedo.exr");
    folder.succeed("develop all.exr --layer object -f object.exr");
    let file = layer(&folder, "all.exr");
    let values = |name: &str| -> Vec<f32> {
        let channel = file.channel_data.list.iter().find(|channel| channel.name == *name);
        channel.expect("it was written").sample_data.values_as_f32().collect()
    };
    for (file, [r, g, b]) in [
        ("albedo.exr", ["albedo.R", "albedo.G", "albedo.B"].map(values)),
        ("object.exr", ["object.id"; 3].map(values)),
    ] {
        let pixels = folder.image(file).pixels;
        let wanted = r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]);
        assert!(pixels.into_iter().eq(wanted), "{file}");
    }
    refuses(&folder, "develop all.exr --layer colour -f out.png", "albedo, depth, object");
}

#[test]
fn many_images_are_developed_at_once() {
    let folder = Folder::new();
    for name in ["a.exr", "b.exr"] {
        folder.succeed(&format!("{TINY} --metadata none -f {name} SCENE"));
        std::fs::remove_file(folder.path(&format!("{name}.film"))).expect("a film beside it");
    }
    folder.succeed("develop a.exr b.exr");
    assert_eq!(folder.files(), ["a.exr", "a.png", "b.exr", "b.png"]);
    std::fs::create_dir(folder.path("out")).unwrap();
    std::fs::write(folder.path("c.exr"), "no image").unwrap();
    let run = folder.run("develop a.exr c.exr b.exr -f out");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("error: c.exr: is not a valid EXR file"), "{run:?}");
    let entries = std::fs::read_dir(folder.path("out")).unwrap();
    let mut written: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
    written.sort();
    assert_eq!(written, ["a.png", "b.png"]);
    assert_eq!(folder.read("out/b.png"), folder.read("b.png"));
}

#[test]
fn images_of_other_programs_are_developed() {
    let folder = Folder::new();
    // Radiance: 2^(129 − 128) · 128/256 = 1, and half of it in green. [Ward 1991]
    folder.write("sky.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x40\x00\x81");
    folder.succeed("develop sky.hdr -f sky.exr");
    assert_eq!(folder.image("sky.exr").pixels, [[1.0, 0.5, 0.0]]);
    // Values that are no numbers become black, with one warning.
    let pixels = vec![[f32::NAN; 3], [0.5; 3], [0.5; 3], [f32::INFINITY; 3]];
    let odd = Image { width: 2, height: 2, pixels: pixels.into() };
    image::save(&odd, &folder.path("odd.exr"), &SaveOptions::default()).unwrap();
    let run = folder.succeed("develop odd.exr --resize 4 4 -f odd4.exr");
    assert_eq!(run.err.matches("warning: odd.exr: 2 pixels of 4").count(), 1, "{run:?}");
    assert!(folder.image("odd4.exr").pixels.iter().flatten().all(|v| (0.0..=0.5).contains(v)));
}

#[test]
fn development_refuses_what_it_cannot_do() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} --metadata none -f a.exr SCENE"));
    let whole = folder.read("a.exr");
    folder.write("half.exr", &whole[..whole.len() / 2]);
    folder.write("empty.exr", "");
    folder.write("text.exr", "text");
    std::fs::create_dir(folder.path("folder")).unwrap();
    std::fs::create_dir(folder.path("other")).unwrap();
    folder.write("other/a.exr", &whole);
    for (args, wanted) in [
        ("develop", "<IMAGE>"),
        ("develop none.exr", "none.exr: cannot be read"),
        ("develop folder", "folder: found a folder, expected an image"),
        ("develop ..", "found a folder, expected an image"),
        ("develop half.exr", "half.exr: "),
        ("develop empty.exr", "empty.exr: is not a valid EXR file"),
        ("develop text.exr", "text.exr: is not a valid EXR file"),
        ("develop a.exr -f a.exr", "found the output a.exr, which is an input"),
        ("develop a.exr -f ./folder/../a.exr", "which is an input"),
        ("develop a.exr -f a.jpg", "unknown extension; expected .png or .exr"),
        ("develop a.exr -f none/a.png", "found no folder none"),
        ("develop a.exr -f none/", "found no folder none"),
        ("develop a.exr other/a.exr -f a.png", "expected a folder"),
        ("develop a.exr other/a.exr -f folder", "found the same output for a.exr and other/a.exr"),
        (
            "develop a.exr --crop 0 0 0 4",
            "expected a cell with pixels inside of the image of 12 x 9",
        ),
        ("develop a.exr --crop 9 0 4 4", "expected a cell with pixels inside"),
        ("develop a.exr --crop 0 0 4", "4 values required"),
        ("develop a.exr --resize 0 4", "a number of pixels from 1"),
        ("develop a.exr --resize 1048576 1048576", "--resize 1048576 1048576: exceeds 1 GiB"),
        ("develop a.exr --alpha", "found no alpha"),
        ("develop a.exr --exposure bright", "a number of stops"),
        ("develop a.exr -f b.exr --tonemap agx", "require a PNG image"),
        ("develop a.exr --exr-type half", "require an OpenEXR image"),
    ] {
        refuses(&folder, args, wanted);
    }
    assert_eq!(folder.read("a.exr"), whole);
}

/// If all samples hit a surface, the layers contain the input of the network in a render.
#[test]
fn denoising_after_the_render_is_that_of_the_render() {
    let folder = Folder::new();
    let base = format!("{INSIDE} --metadata stable --aov albedo,normal SCENE");
    let probe = folder.succeed(&format!("{base} --denoise -f wanted.exr"));
    if probe.err.contains("Open Image Denoise is not found") {
        println!("skipped: Open Image Denoise is not found");
        return;
    }
    folder.succeed(&format!("{base} -f plain.exr"));
    folder.succeed("denoise plain.exr");
    assert!(folder.read("plain_denoised.exr") == folder.read("wanted.exr"));
    // Again, from the layer with the noisy image.
    folder.succeed("denoise plain_denoised.exr -f again.exr -t 2");
    assert!(folder.read("again.exr") == folder.read("wanted.exr"));
    // The exposure is that of the noisy image, as in a render.
    let tone = "--exposure auto --tonemap agx";
    folder.succeed(
        &format!("{base} --denoise {tone} -f wanted.png").replace("--aov albedo,normal", ""),
    );
    folder.succeed(&format!("denoise plain.exr {tone} -f out.png"));
    assert_eq!(folder.image("out.png"), folder.image("wanted.png"));
    folder.succeed(&format!("develop plain_denoised.exr {tone} --layer noisy -f out.png"));
    assert_eq!(folder.image("out.png"), folder.image("wanted_noisy.png"));
    // Without layers, with a note; other pixels, but no other size.
    folder.succeed(&format!("{INSIDE} -f bare.exr SCENE"));
    let run = folder.succeed("denoise bare.exr plain.exr -f ./");
    assert_eq!(run.err.matches("note: bare.exr: found no layers albedo and normal").count(), 1);
    let (bare, denoised) = (folder.image("bare_denoised.exr"), folder.image("wanted.exr"));
    assert!(bare != denoised && bare.width == denoised.width, "{run:?}");
}

#[test]
fn denoising_without_the_library_is_an_error() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} --metadata none -f a.exr SCENE"));
    let before = folder.files();
    let mut command = folder.command(&["denoise", "a.exr"]);
    command.env("PATHTRACER_OIDN", folder.path("nowhere"));
    let run = Run::of(&command.output().unwrap(), "denoise a.exr");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("nowhere") && run.err.contains("expected the library"), "{run:?}");
    assert_eq!(folder.files(), before);
}

fn layer(folder: &Folder, name: &str) -> Layer<AnyChannels<FlatSamples>> {
    let file = read_all_flat_layers_from_file(folder.path(name)).expect("an EXR file");
    file.layer_data.into_iter().next().expect("it has a part")
}

/// Texts of an image by their names, without those that depend on the part.
fn mattes(layer: &Layer<AnyChannels<FlatSamples>>) -> Vec<(String, String)> {
    let texts = layer.attributes.other.iter().filter_map(|(key, value)| match value {
        AttributeValue::Text(text) => Some((key.to_string(), text.to_string())),
        _ => None,
    });
    let mut texts: Vec<_> = texts.filter(|(key, _)| key.starts_with("cryptomatte/")).collect();
    texts.sort();
    texts
}

const CELLS: [&str; 4] = ["0 0 11 5", "11 0 9 5", "0 5 3 10", "3 5 17 10"];

/// Renders the cells of an image, and returns their names.
fn render_cells(folder: &Folder, base: &str) -> String {
    let names = CELLS.map(|cell| {
        let name = format!("cell_{}.exr", cell.replace(' ', "_"));
        folder.succeed(&format!("{base} -p {cell} -f {name}"));
        name
    });
    names.join(" ")
}

#[test]
fn joined_cells_are_the_whole_image() {
    let folder = Folder::new();
    let aovs = "albedo,depth,object,samples,variance,cryptomatte_object,cryptomatte_material";
    for more in ["", "--exr-type half --exr-compression piz --alpha"] {
        let base = format!("-r 20 15 -s 4 --aov {aovs} {more} --filter gaussian SCENE");
        let cells = render_cells(&folder, &base);
        folder.succeed(&format!("{base} -f whole.exr"));
        // Equal pixels may occur twice.
        folder.succeed(&format!("{base} -p 2 2 5 6 -f twice.exr"));
        folder.succeed(&format!("join {cells} twice.exr -f joined.exr"));
        let [joined, whole] = ["joined.exr", "whole.exr"].map(|name| layer(&folder, name));
        assert!(joined.channel_data == whole.channel_data, "{more}");
        assert_eq!(joined.encoding.compression, whole.encoding.compression);
        assert_eq!(mattes(&joined), mattes(&whole));
        assert!(mattes(&whole).len() == 8);
        let info = folder.succeed("info joined.exr").out;
        assert!(info.contains("20 x 15 pixels from column 0, row 0"), "{info}");
        assert!(info.contains("not known (joined images)"), "{info}");
        refuses(&folder, "rerender joined.exr", "found an image that was joined from parts");
        let tone = "--tonemap agx --exposure auto --png-bits 16";
        folder.succeed(&format!("join {cells} {tone} -f joined.png"));
        folder.succeed(&format!("develop whole.exr {tone} -f whole.png"));
        assert_eq!(folder.image("joined.png"), folder.image("whole.png"));
    }
}

#[test]
fn joining_refuses_parts_that_do_not_fit() {
    let folder = Folder::new();
    let base = "-r 20 15 -s 2 SCENE";
    let cells = render_cells(&folder, base);
    folder.succeed(&format!("{base} --seed 1 -p 0 0 11 5 -f seed.exr"));
    folder.succeed("-r 20 15 -s 3 SCENE -p 0 0 11 5 -f more.exr");
    folder.succeed(&format!("{base} --aov depth -p 0 0 11 5 -f depth.exr"));
    folder.succeed(&format!("{base} --metadata none -p 0 0 11 5 -f none.exr"));
    folder.succeed(&format!("{base} -p 0 0 11 5 -f part.png"));
    folder.succeed("develop cell_0_0_11_5.exr --resize 5 5 -f small.exr");
    let first = "cell_0_0_11_5.exr";
    let mut changed = image::load_file(&folder.path(first)).unwrap();
    changed.image.pixels[12][1] += 1.0;
    image::save(&changed.image, &folder.path("changed.exr"), &changed.options).unwrap();
    let three = cells.replace(first, "");
    for (args, wanted) in [
        (format!("{three} seed.exr -f out.exr"), "seed: 0 before, 1 now"),
        (format!("{three} more.exr -f out.exr"), "samples: 0 to 2 before, 0 to 3 now"),
        (format!("{three} depth.exr -f out.exr"), "other channels: none before, depth now"),
        (format!("{three} none.exr -f out.exr"), "provenance metadata in one of them only"),
        ("none.exr -f out.exr".into(), "found no position in the whole image"),
        (format!("{three} part.png -f out.exr"), "part.png: found another format"),
        (format!("{three} small.exr -f out.exr"), "found 5 x 5 pixels that are not those"),
        (format!("{cells} changed.exr -f out.exr"), "pixel in column 1, row 11"),
        (format!("{three} -f out.exr"), "render them with --crop 0 0 11 5"),
        (format!("{cells} -f cell_0_0_11_5.exr"), "which is an input"),
        (format!("{cells} -f out.exr --tonemap agx"), "require a PNG image"),
        (format!("{cells} -f out.film"), "unknown extension"),
        ("-f out.exr".into(), "<PART>"),
    ] {
        refuses(&folder, &format!("join {args}"), wanted);
    }
    folder.succeed(&format!("join {three} --allow-gaps -f out.exr"));
    let out = folder.image("out.exr");
    assert_eq!((out.width, out.height, out.pixels[14 * 20]), (20, 15, [0.0; 3]));
    assert_ne!(out.pixels[14 * 20 + 11], [0.0; 3]);
}

/// Images of other programs have their positions in data windows.
#[test]
fn data_windows_are_joined() {
    let folder = Folder::new();
    for (name, x, value) in [("a.exr", 0, 1.0), ("b.exr", 2, 2.0)] {
        let plane = |letter| AnyChannel::new(letter, FlatSamples::F32(vec![value; 4]));
        let channels = AnyChannels::sort(["R", "G", "B"].map(plane).into_iter().collect());
        let mut layer =
            Layer::new((2, 2), LayerAttributes::default(), Encoding::default(), channels);
        layer.attributes.layer_position = exr::math::Vec2(x, 0);
        let mut file = exr::image::Image::from_layer(layer);
        file.attributes.display_window =
            exr::meta::attribute::IntegerBounds::from_dimensions((4, 2));
        file.write().to_file(folder.path(name)).unwrap();
    }
    folder.succeed("join b.exr a.exr -f out.exr");
    let values = [1.0, 1.0, 2.0, 2.0, 1.0, 1.0, 2.0, 2.0];
    assert_eq!(folder.image("out.exr").pixels, values.map(|v| [v; 3]));
}
