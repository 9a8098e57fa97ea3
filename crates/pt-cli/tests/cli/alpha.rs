//! Images with alpha.

use pathtracer::image::{Decoded, load_rgba_raw};

use crate::common::Folder;

/// A ball without a background, under an environment of radiance 1; `pixel_format` and the
/// parameters of the integrator are given.
fn ball(format: &str, integrator: &str) -> String {
    format!(
        "<scene version=\"3.0.0\"><integrator type=\"path\">{integrator}</integrator>\
         <sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/>\
         <transform name=\"to_world\"><lookat origin=\"0 0 5\" target=\"0 0 0\" up=\"0 1 0\"/></transform>\
         <film type=\"hdrfilm\"><integer name=\"width\" value=\"16\"/><integer name=\"height\" value=\"16\"/>\
         <string name=\"pixel_format\" value=\"{format}\"/><rfilter type=\"box\"/></film></sensor>\
         <emitter type=\"constant\"/><shape type=\"sphere\"><bsdf type=\"diffuse\">\
         <rgb name=\"reflectance\" value=\"0.5\"/></bsdf></shape></scene>"
    )
}

const HIDE: &str = "<boolean name=\"hide_emitters\" value=\"true\"/>";

fn stored(folder: &Folder, name: &str) -> Decoded {
    load_rgba_raw(&folder.path(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// Colour and alpha of the corner and of the middle.
fn ends(decoded: &Decoded) -> [(f32, f32); 2] {
    let alpha = decoded.alpha.as_ref().expect("the image has an opacity");
    [0, 8 * 16 + 8].map(|i| (decoded.image.pixels[i][0], alpha[i]))
}

/// Under the environment, the radiance of a ball of albedo ½ is ½; PNG images are straight, at all
/// of its edges too.
#[test]
fn images_are_cut_out_where_that_is_asked_for() {
    let folder = Folder::new();
    folder.write("plain.xml", ball("rgb", ""));
    folder.succeed("-s 64 --alpha --hide-background --png-bits 16 -f out.png plain.xml");
    folder.succeed("-s 64 --alpha --hide-background -f out.exr plain.xml");
    let (png, exr) = (stored(&folder, "out.png"), stored(&folder, "out.exr"));
    let [corner, middle] = ends(&exr);
    assert_eq!(corner, (0.0, 0.0));
    assert!((middle.0 - 0.5).abs() < 0.05 && middle.1 == 1.0, "{middle:?}");
    assert_eq!(ends(&png)[0], (0.0, 0.0));
    let pairs = png.alpha.iter().flatten().zip(exr.alpha.iter().flatten());
    assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-5));
    assert!(pairs.clone().filter(|(a, _)| **a > 0.0 && **a < 1.0).count() > 20);
    let lit = folder.image("out.png").pixels.into_iter().zip(png.alpha.unwrap());
    for ([red, ..], alpha) in lit.filter(|(_, alpha)| *alpha > 0.5) {
        assert!((red - 0.5).abs() < 0.15, "{red} where {alpha} is covered");
    }
    // A visible background is opaque; without --alpha, only the channel is missing.
    folder.succeed("-s 4 --alpha -f out.exr plain.xml");
    assert_eq!(ends(&stored(&folder, "out.exr"))[0], (1.0, 1.0));
    folder.succeed("-s 4 --hide-background -f out.exr plain.xml");
    let hidden = stored(&folder, "out.exr");
    assert!(hidden.alpha.is_none() && hidden.image.pixels[0] == [0.0; 3]);
}

/// A Mitsuba scene requests alpha and hidden emitters, unless the command line overrides that.
#[test]
fn scenes_may_ask_for_an_opacity() {
    let folder = Folder::new();
    folder.write("asks.xml", ball("rgba", HIDE));
    folder.write("same.xml", ball("rgb", ""));
    let options = "-r 16 16 -s 4 --receipt none";
    for name in ["out.png", "out.exr"] {
        let run = folder.succeed(&format!("{options} -f {name} asks.xml"));
        assert!(!run.err.contains("note"), "{run:?}");
        assert_eq!(ends(&stored(&folder, name))[0], (0.0, 0.0), "{name}");
        let asked = folder.read(name);
        folder
            .succeed(&format!("{options} --alpha=on --hide-emitters -f {name} same.xml --restart"));
        assert!(folder.read(name) == asked, "{name}");
        folder.succeed(&format!("{options} --alpha=off -f {name} asks.xml --restart"));
        assert!(stored(&folder, name).alpha.is_none(), "{name}");
        folder.succeed(&format!("{options} --aov alpha -f {name} same.xml --restart"));
        assert_eq!(ends(&stored(&folder, name))[0], (1.0, 1.0), "{name}");
    }
    let run = folder.run("--alpha=half -f out.png same.xml");
    assert!(run.code == Some(2) && run.err.contains("half"), "{run:?}");
}

/// Merged parts, other AOVs, and a resumed render.
#[test]
fn an_opacity_survives_parts_and_pauses() {
    let folder = Folder::new();
    folder.write("ball.xml", ball("rgba", HIDE));
    let options = "-s 32 --aov depth --receipt none";
    folder.succeed(&format!("{options} -f whole.exr ball.xml"));
    for (name, samples) in [("a", "0..9"), ("b", "9..32")] {
        folder.succeed(&format!("{options} --samples {samples} -f {name}.film ball.xml"));
    }
    folder.succeed("merge b.film a.film -f merged.exr");
    assert!(folder.read("merged.exr") == folder.read("whole.exr"));
    folder.succeed("-s 8 --aov depth --receipt none -f more.exr ball.xml");
    folder.succeed("resume more.exr --spp 32");
    assert!(folder.read("more.exr") == folder.read("whole.exr"));
}
