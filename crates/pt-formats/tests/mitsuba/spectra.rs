//! Spectra by wavelength, converted to colours as in Mitsuba.

use pt_formats::{LoadOptions, parse_with};
use pt_scene::{Color, Geometry, Scene, Surface};

use super::{emission, good, material, surface};

/// Output of `mi.traverse` in Mitsuba 3.9.1, variant `scalar_rgb`, for the spectrum as the
/// `intensity` of a point light and as the `eta` of a conductor. As the `reflectance` of a diffuse
/// bsdf it is the latter, clamped to [0, 1].
const COLORS: [(&str, [f32; 3], [f32; 3]); 8] = [
    (
        "400:0.78, 500:0.78, 600:0.78, 700:0.78",
        [0.935_761, 0.740_625_9, 0.704_685_8],
        [0.776_366_8, 0.779_81, 0.776_029_1],
    ),
    (
        "400:0, 500:8, 600:15.6, 700:18.4",
        [20.710_84, 10.854_63, 2.771_152],
        [17.714_71, 11.354_43, 3.304_508],
    ),
    (
        "400:0.1 500:0.9 600:0.4 700:0.2",
        [0.303_739_3, 0.692_219, 0.458_780_4],
        [0.213_207_1, 0.730_333_8, 0.518_207_7],
    ),
    (
        "300:0.5 900:0.5",
        [0.602_441_8, 0.474_114_1, 0.454_633_4],
        [0.499_492_6, 0.499_436_9, 0.499_400_8],
    ),
    (
        "380:0.2,780:0.7",
        [0.625_333_7, 0.383_714_8, 0.247_056],
        [0.527_480_8, 0.403_302_3, 0.275_656],
    ),
    ("600:0.5,900:0.8", [0.511_863_9, 0.0, 0.0], [0.443_377_7, 0.0, 0.0]),
    (
        "500:0, 510.5:0.9, 511:0.2, 530:0.3",
        [0.0, 0.096_534_79, 0.002_464_785],
        [0.0, 0.104_364, 0.002_753_848],
    ),
    ("550:0, 551:1, 552:0", [0.0, 0.013_670_95, 0.0], [0.0, 0.014_312_52, 0.0]),
];

/// Black bodies: the evaluation of Mitsuba 3.9.1, variant `scalar_spectral`, summed every 0.1 nm
/// over its observer, times 0.999, since its spectra by wavelength are sums over 1000 samples that
/// are a 999th of the range apart and have the weight of a 1000th of it.
const BLACK_BODIES: [(&str, [f32; 3]); 3] = [
    ("2000", [16.0303 * 0.999, 4.115_978 * 0.999, 0.130_521_7 * 0.999]),
    ("3000", [733.8449 * 0.999, 349.9184 * 0.999, 112.8222 * 0.999]),
    ("6500", [43_962.57 * 0.999, 41_448.62 * 0.999, 43_626.26 * 0.999]),
];

fn assert_near(found: [f32; 3], expected: [f32; 3], what: &str) {
    for (a, b) in found.into_iter().zip(expected) {
        assert!((a - b).abs() <= 1e-4 * b, "{what}: {found:?} is not {expected:?}");
    }
}

fn reflectance(surface: Surface) -> [f32; 3] {
    let Surface::Diffuse(matte) = surface else { panic!("{surface:?}") };
    let Color::Value(color) = matte.reflectance else { panic!("a texture") };
    color
}

#[test]
fn spectra_have_the_colours_that_mitsuba_gives_them() {
    for (text, emitted, reflected) in COLORS {
        let light = format!(
            "<emitter type=\"area\"><spectrum name=\"radiance\" value=\"{text}\"/></emitter>"
        );
        assert_near(emission(&material(&light)), emitted, text);
        let metal =
            format!("<bsdf type=\"conductor\"><spectrum name=\"eta\" value=\"{text}\"/></bsdf>");
        let Surface::Conductor(metal) = surface(&metal) else { panic!("no metal") };
        assert_near(metal.eta, reflected, text);
        if reflected[0] <= 1.0 {
            let matte = format!(
                "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"{text}\"/></bsdf>"
            );
            assert_near(reflectance(surface(&matte)), reflected, text);
        }
    }
}

/// A material that reflects only green light is brighter in the green channel than white.
#[test]
fn reflectances_are_cut_to_what_can_be_shown() {
    let green = "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" \
                 value=\"480:0, 490:1, 590:1, 600:0\"/></bsdf>";
    let [r, g, b] = reflectance(surface(green));
    assert_eq!(g, 1.0);
    assert!(r < 0.9 && b < 0.9, "{r} {b}");
}

#[test]
fn spectra_may_be_written_in_several_ways() {
    let scene = good("spectra.xml");
    let colors: Vec<_> = scene
        .objects
        .iter()
        .map(|o| &scene.materials[o.materials[0].expect("a material") as usize])
        .map(|m| (reflectance(m.surface.clone()), emission(m)))
        .collect();
    let red = COLORS[4].2;
    for ((reflected, _), wanted) in colors.iter().zip([red, red, red, [0.25; 3]]) {
        assert_near(*reflected, wanted, "reflectance");
    }
    let black_body = BLACK_BODIES[1].1;
    for ((_, emitted), wanted) in
        colors.iter().zip([black_body, COLORS[1].1, [2.0; 3], [3.0, 2.0, 1.0]])
    {
        assert_near(*emitted, wanted, "radiance");
    }
}

/// Hotter bodies are bluer, and finite at any temperature.
#[test]
fn black_bodies_of_all_temperatures_have_colours() {
    let color = |kelvin: &str| {
        emission(&material(&format!(
            "<emitter type=\"area\"><spectrum type=\"blackbody\" name=\"radiance\">\
             <float name=\"temperature\" value=\"{kelvin}\"/></spectrum></emitter>"
        )))
    };
    for (kelvin, wanted) in BLACK_BODIES {
        assert_near(color(kelvin), wanted, kelvin);
    }
    assert_eq!(color("1e-30"), [0.0; 3]);
    assert!(color("1e30").iter().all(|c| c.is_finite() && *c > 0.0));
}

// ---- names that are defined from outside -------------------------------------------------------

fn read_with(content: &str, definitions: &[(&str, &str)]) -> Result<Scene, String> {
    let text = format!("<scene version=\"3.0.0\">{content}</scene>");
    let pair = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).to_owned());
    let definitions = definitions.iter().map(pair).collect();
    let options = LoadOptions { definitions, ..LoadOptions::default() };
    parse_with(text.as_bytes(), "test.xml".as_ref(), &options).map_err(|e| e.to_string())
}

const BALL: &str = "<default name=\"radius\" value=\"1\"/><default name=\"other\" value=\"1\"/>\
                    <shape type=\"sphere\"><float name=\"radius\" value=\"$radius\"/></shape>";

#[test]
fn definitions_win_over_defaults() {
    let radius = |definitions: &[(&str, &str)]| {
        let scene = read_with(BALL, definitions).expect("a good scene");
        let Geometry::Sphere { radius } = scene.objects[0].geometry else { panic!("no sphere") };
        radius
    };
    assert_eq!(radius(&[]), 1.0);
    assert_eq!(radius(&[("radius", "2.5")]), 2.5);
}

#[test]
fn definitions_that_nothing_uses_and_second_ones_are_refused() {
    let refused = |name| read_with(BALL, &[(name, "2")]).expect_err("it is not used");
    assert_eq!(
        refused("radios"),
        "test.xml: unused definition of \"radios\" (did you mean \"radius\"?)"
    );
    for name in ["other", "", "$radius"] {
        assert!(refused(name).contains("unused definition of"), "{name}");
    }
    let twice = read_with(BALL, &[("radius", "2"), ("radius", "3")]).expect_err("two");
    assert_eq!(twice, "test.xml: duplicate definition of \"radius\"");
    let unknown = read_with("<default name=\"a\" value=\"$b\"/>", &[("", "1")]);
    assert!(unknown.expect_err("no name at all").contains("\"$b\""));
    let ply = LoadOptions { definitions: vec![("a".into(), "b".into())], ..LoadOptions::default() };
    let error = parse_with(b"ply", "ball.ply".as_ref(), &ply).expect_err("no names").to_string();
    let wanted = "ball.ply: unsupported definition \"a\": Stanford PLY has no definitions; formats \
                  with definitions: Mitsuba 3";
    assert_eq!(error, wanted);
}
