//! Materials, textures, spectra and media.

use pt_math::DMat3;
use pt_scene::material::{
    CoatedConductor, Conductor, Diffuse, Glass, Hair, Mix, Pigment, RoughCoatedDiffuse,
};
use pt_scene::medium::{MediumProperties, Phase, Volume};
use pt_scene::texture::{Input, Pattern, Texture};
use pt_scene::{Color, Geometry, Scalar, Surface};

use super::{read, refusal};

fn surface(material: &str) -> Surface {
    let mut scene = read("", &format!("{material} Shape \"disk\""));
    scene.materials.to_mut().swap_remove(0).surface
}

fn reflectance(material: &str) -> Color {
    let Surface::Diffuse(Diffuse { reflectance, two_sided: true }) = surface(material) else {
        panic!("not diffuse")
    };
    reflectance
}

fn texture(color: &Color) -> &Texture {
    color.texture().expect("a texture")
}

#[test]
fn the_default_material_is_grey_on_both_sides() {
    assert_eq!(reflectance(""), Input::Value([0.5; 3]));
}

#[test]
fn alpha_is_the_square_root_of_roughness_unless_that_is_switched_off() {
    let alpha = |more: &str| {
        let Surface::Conductor(Conductor { roughness, .. }) =
            surface(&format!("Material \"conductor\" {more}"))
        else {
            panic!("no metal")
        };
        roughness.map(|r| r.alpha)
    };
    let both = |x: f32| Some([Scalar::Value(x), Scalar::Value(x)]);
    assert_eq!(alpha("\"float roughness\" .25"), both(0.5));
    assert_eq!(alpha("\"float roughness\" .25 \"bool remaproughness\" false"), both(0.25));
    assert_eq!(alpha(""), None);
    assert_eq!(alpha("\"float vroughness\" .04"), Some([Scalar::Value(1e-4), Scalar::Value(0.2)]));
}

/// A metal with reflectance r at normal incidence: |(η − 1 + ik) / (η + 1 + ik)|² = r.
#[test]
fn a_metal_reflects_what_it_is_said_to() {
    let metal = surface("Material \"conductor\" \"rgb reflectance\" [.9 .5 .2]");
    let Surface::Conductor(Conductor { eta, k, .. }) = metal else { panic!("no metal") };
    for (c, expected) in [0.9, 0.5, 0.2].into_iter().enumerate() {
        let [below, above] = [eta[c] - 1.0, eta[c] + 1.0].map(|x| x * x + k[c] * k[c]);
        assert!((below / above - expected).abs() < 1e-5);
    }
}

#[test]
fn glass_is_known_by_name_and_number() {
    let index = |more: &str| match surface(&format!("Material \"dielectric\" {more}")) {
        Surface::Glass(Glass { ior, .. }) => ior,
        _ => panic!("no glass"),
    };
    assert_eq!(index(""), 1.5);
    assert_eq!(index("\"float eta\" 1.33"), 1.33);
    assert_eq!(index("\"spectrum eta\" \"glass-F11\""), 1.784_72);
    let table = index("\"spectrum eta\" [360 1.6 830 1.6]");
    assert!((table - 1.6).abs() < 2e-3, "{table}");
}

#[test]
fn mixtures_find_materials_that_come_later() {
    let mixed = surface(
        "MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" .3 \
         MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [1 0 0] \
         MakeNamedMaterial \"b\" \"string type\" \"diffuse\" NamedMaterial \"m\"",
    );
    let Surface::Mix(Mix { first, second, amount: share }) = mixed else { panic!("no mix") };
    assert_eq!(share, Scalar::Value(0.3));
    let grey: Surface = Diffuse { reflectance: [0.5; 3].into(), two_sided: true }.into();
    assert!(*first != grey && *second == grey);
}

#[test]
fn a_coat_is_rough_if_it_is_said_to_be() {
    assert!(matches!(surface("Material \"coateddiffuse\""), Surface::CoatedDiffuse(_)));
    let coat = surface("Material \"coateddiffuse\" \"float roughness\" .04");
    let Surface::RoughCoatedDiffuse(RoughCoatedDiffuse { alpha, nonlinear: true, .. }) = coat
    else {
        panic!("no rough coat")
    };
    assert!((alpha - 0.2).abs() < 1e-7);
}

/// The index of the metal is relative to air, regardless of the coat.
#[test]
fn a_metal_has_its_coat() {
    let coated = |more: &str| match surface(&format!("Material \"coatedconductor\" {more}")) {
        Surface::CoatedConductor(coated) => coated,
        _ => panic!("no coat"),
    };
    let Surface::Conductor(copper) = surface("Material \"conductor\"") else { panic!("no metal") };
    let (eta, k) = (copper.eta, copper.k);
    let plain = CoatedConductor {
        eta,
        k,
        alpha: 0.0,
        ior: 1.5,
        coat_alpha: 0.0,
        thickness: 0.01,
        two_sided: true,
    };
    assert_eq!(coated(""), plain);
    let rough = coated(
        "\"float interface.roughness\" .04 \"float conductor.roughness\" .25 \"float interface.eta\" 1.7 \"float thickness\" .5",
    );
    let wanted = CoatedConductor { alpha: 0.5, ior: 1.7, coat_alpha: 0.2, thickness: 0.5, ..plain };
    assert_eq!(rough, wanted);
}

#[test]
fn one_material_serves_all_shapes_that_have_it() {
    let world = "Shape \"sphere\" Shape \"sphere\" \"float alpha\" .5 Shape \"sphere\" Material \"interface\" \
                 Shape \"sphere\"";
    let scene = read("", world);
    let numbers: Vec<_> = scene.objects.iter().map(|o| o.materials[0]).collect();
    assert_eq!(numbers, [Some(0), Some(1), Some(0), Some(2)]);
    let opacities: Vec<_> = scene.materials.iter().map(|m| m.opacity.clone()).collect();
    assert_eq!(opacities, [Scalar::Value(1.0), Scalar::Value(0.5), Scalar::Value(0.0)]);
}

#[test]
fn squares_have_a_side_of_one() {
    let color = reflectance(
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" 8 \"rgb tex2\" [.25 0 0] \
         Material \"diffuse\" \"texture reflectance\" \"t\"",
    );
    let Texture { pattern, to_pattern, .. } = texture(&color);
    assert_eq!(*pattern, Pattern::Checkerboard([[1.0; 3], [0.25, 0.0, 0.0]]));
    assert_eq!(to_pattern.to_cols_array(), [4.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0]);
}

/// Weights of the second texture; for checkerboards they are 0 and 1.
#[test]
fn textures_are_mixed_and_put_on_squares() {
    let blend = |class: &str, more: &str| {
        let color = reflectance(&format!(
            "Texture \"dots\" \"spectrum\" \"imagemap\" \"string filename\" \"parts/dots.png\" \
             Texture \"much\" \"float\" \"checkerboard\" \"float tex1\" .5 \
             Texture \"t\" \"spectrum\" \"{class}\" \"texture tex1\" \"dots\" \"rgb tex2\" [.25 0 0] {more} \
             Material \"diffuse\" \"texture reflectance\" \"t\""
        ));
        let Texture { pattern: Pattern::Blend(blend), to_pattern, .. } = texture(&color) else {
            panic!("no blend")
        };
        assert!(
            *to_pattern == DMat3::IDENTITY && texture(&blend.first).pattern.parts().count() == 0
        );
        assert_eq!(blend.second, Input::Value([0.25, 0.0, 0.0]));
        blend.amount.clone()
    };
    assert_eq!(blend("mix", ""), Input::Value(0.5));
    assert_eq!(blend("mix", "\"float amount\" .3"), Input::Value(0.3));
    let squares = |share: &Scalar| share.texture().expect("a texture").pattern.clone();
    let much = blend("mix", "\"texture amount\" \"much\"");
    assert_eq!(squares(&much), Pattern::Checkerboard([[0.5; 3], [0.0; 3]]));
    let share = blend("checkerboard", "\"float uscale\" 8");
    assert_eq!(squares(&share), Pattern::Checkerboard([[0.0; 3], [1.0; 3]]));
    assert_eq!(share.texture().expect("a texture").to_pattern.x_axis.x, 4.0);
}

/// Coloured light changes the colour of a material equally if it is blended with a texture.
#[test]
fn colours_that_are_mixed_are_seen_in_the_light_of_the_scene() {
    let red = [0.63, 0.065, 0.05];
    let seen = |material: &str| {
        let world = format!("LightSource \"point\" \"rgb I\" [17 12 6] {material} Shape \"disk\"");
        match read("", &world).materials.to_mut().swap_remove(0).surface {
            Surface::Diffuse(matte) => matte.reflectance,
            _ => panic!("not diffuse"),
        }
    };
    let plain = seen("Material \"diffuse\" \"rgb reflectance\" [.63 .065 .05]");
    assert_ne!(plain, Input::Value(red));
    let mixed = seen(
        "Texture \"dots\" \"spectrum\" \"imagemap\" \"string filename\" \"parts/dots.png\" \
         Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"dots\" \"rgb tex2\" [.63 .065 .05] \
         Material \"diffuse\" \"texture reflectance\" \"t\"",
    );
    let Pattern::Blend(blend) = &texture(&mixed).pattern else { panic!("no blend") };
    assert_eq!(blend.second, plain);
}

/// Roughness is blended as α, whose root it is.
#[test]
fn roots_of_what_is_mixed_are_those_of_its_parts() {
    let metal = surface(
        "Texture \"much\" \"float\" \"checkerboard\" \
         Texture \"t\" \"float\" \"mix\" \"float tex1\" .25 \"float tex2\" .09 \"texture amount\" \"much\" \
         Material \"conductor\" \"texture roughness\" \"t\"",
    );
    let Surface::Conductor(Conductor { roughness: Some(roughness), .. }) = metal else {
        panic!("no rough metal")
    };
    let Some(Pattern::Blend(blend)) = roughness.alpha[0].texture().map(|t| &t.pattern) else {
        panic!("no blend")
    };
    assert_eq!([&blend.first, &blend.second], [&Input::Value([0.5; 3]), &Input::Value([0.3; 3])]);
}

#[test]
fn images_are_scaled_inverted_and_averaged() {
    let pixels = |more: &str, what: &str| {
        let color = reflectance(&format!(
            "Texture \"t\" \"{what}\" \"imagemap\" \"string filename\" \"parts/dots.png\" {more} \
             Texture \"one\" \"spectrum\" \"constant\" \
             Texture \"s\" \"spectrum\" \"scale\" \"texture tex\" \"{}\" {} \
             Material \"diffuse\" \"texture reflectance\" \"s\"",
            if what == "float" { "one" } else { "t" },
            if what == "float" { "\"texture scale\" \"t\"" } else { "" },
        ));
        let Pattern::Bitmap(bitmap) = &texture(&color).pattern else { panic!("no image") };
        bitmap.image.pixels.clone()
    };
    let linear = pixels("\"string encoding\" \"linear\"", "spectrum");
    let srgb = pixels("", "spectrum");
    let inverted = pixels(
        "\"string encoding\" \"linear\" \"bool invert\" true \"float scale\" .5",
        "spectrum",
    );
    let number = pixels("\"string encoding\" \"gamma 1\"", "float");
    for i in 0..linear.len() {
        for c in 0..3 {
            assert!((inverted[i][c] - (1.0 - 0.5 * linear[i][c])).abs() < 1e-6);
            assert!((srgb[i][c] - pt_math::color::linear_from_srgb(linear[i][c])).abs() < 1e-6);
            assert!((number[i][c] - linear[i].iter().sum::<f32>() / 3.0).abs() < 1e-6);
        }
    }
}

#[test]
fn spectra_that_reflect_are_seen_under_daylight() {
    let grey = reflectance("Material \"diffuse\" \"spectrum reflectance\" [360 .5 830 .5]");
    let Input::Value(grey) = grey else { panic!("a texture") };
    assert!(grey.iter().all(|c| (c - 0.5).abs() < 1e-3), "{grey:?}");
    let message =
        refusal("Material \"diffuse\" \"spectrum reflectance\" [360 .5 830] Shape \"sphere\"");
    assert!(message.contains("expected pairs"), "{message}");
}

#[test]
fn media_are_what_they_absorb_and_scatter() {
    let scene = read(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 2 3] \"rgb sigma_s\" [3 2 1] \
         \"float scale\" 2 \"float g\" .5 MediumInterface \"\" \"fog\"",
        "MediumInterface \"fog\" \"\" Shape \"sphere\" MediumInterface \"fog\" Shape \"sphere\"",
    );
    let fog = &scene.media[0];
    let MediumProperties::Homogeneous { extinction, albedo, .. } = fog.matter else {
        panic!("a grid")
    };
    assert_eq!((extinction, albedo), ([8.0; 3], [0.75, 0.5, 0.25]));
    assert_eq!(fog.phase, Phase::HenyeyGreenstein { g: 0.5 });
    assert_eq!(scene.cameras[0].medium, Some(0));
    let inside = scene.objects[0].media.expect("two media");
    assert_eq!((inside.interior, inside.exterior), (Some(0), None));
    assert_eq!(scene.objects[1].media, None);
    assert_eq!(scene.settings.integrator, Some("volpath"));
}

#[test]
fn grids_fill_their_box() {
    let scene = read(
        "",
        "Translate 1 0 0 MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"integer nz\" 1 \
         \"float density\" [1 2] \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [2 2 2] \"point3 p1\" [2 2 2]",
    );
    let MediumProperties::Heterogeneous(smoke) = &scene.media[0].matter else { panic!("no grid") };
    assert_eq!(smoke.extinction.grid.values, [2.0, 4.0]);
    let corner = smoke.extinction.to_world.transform_point3(pt_math::DVec3::ONE);
    assert_eq!(corner, pt_math::DVec3::new(3.0, 2.0, 2.0));
}

/// Each cell has an absorption and a scattering coefficient; a missing one is 1.
#[test]
fn grids_of_colours_have_their_colours() {
    let grid = |more: &str| {
        let smoke = format!(
            "MakeNamedMedium \"smoke\" \"string type\" \"rgbgrid\" \"integer nx\" 2 {more}"
        );
        let mut scene = read("", &smoke);
        let MediumProperties::Heterogeneous(smoke) = scene.media.to_mut().swap_remove(0).matter
        else {
            panic!("no grid")
        };
        let Volume::Grid(albedo) = smoke.albedo else { panic!("no grid") };
        let corner = smoke.extinction.to_world.transform_point3(pt_math::DVec3::ONE);
        assert_eq!(smoke.extinction.to_world, albedo.to_world);
        (smoke.extinction.grid.values.clone(), albedo.grid.values.clone(), corner.to_array())
    };
    let both = grid(
        "\"rgb sigma_a\" [0 1 3 0 0 0] \"rgb sigma_s\" [1 1 1 4 0 2] \"float scale\" 2 \"point3 p1\" [2 1 1]",
    );
    let extinction = vec![2.0, 4.0, 8.0, 8.0, 0.0, 4.0];
    assert_eq!(both, (extinction, vec![1.0, 0.5, 0.25, 1.0, 0.0, 1.0], [2.0, 1.0, 1.0]));
    let (extinction, albedo, _) = grid("\"rgb sigma_a\" [0 1 3 0 0 0]");
    assert_eq!(
        (extinction, albedo),
        (vec![1.0, 2.0, 4.0, 1.0, 1.0, 1.0], vec![1.0, 0.5, 0.25, 1.0, 1.0, 1.0])
    );
    let refused = |more: &str| {
        refusal(&format!("MakeNamedMedium \"smoke\" \"string type\" \"rgbgrid\" {more}"))
    };
    let cases = [
        (
            "\"integer nx\" 60000 \"integer ny\" 60000 \"rgb sigma_a\" [1 1 1]",
            "60000 · 60000 · 1 colours",
        ),
        ("\"integer nx\" 60000", "without cells"),
        ("\"rgb sigma_s\" [1 -1 1]", "below 0"),
        ("\"rgb sigma_s\" [1 1]", "2 numbers"),
        ("\"rgb sigma_s\" [1 1 1] \"rgb Le\" [1 1 1]", "emits light"),
    ];
    for (more, why) in cases {
        assert!(refused(more).contains(why), "{}", refused(more));
    }
}

fn hair(text: &str, shape: &str) -> Hair {
    let scene = read("", &format!("Material \"hair\" {text} {shape}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    match &scene.materials[0].surface {
        Surface::Hair(hair) => hair.clone(),
        other => panic!("{other:?} is no hair"),
    }
}

const SPHERE: &str = "Shape \"sphere\"";

#[test]
fn hair_has_the_pigment_that_is_given() {
    let pigment = |text: &str| hair(text, SPHERE).pigment;
    assert_eq!(pigment(""), Pigment::Melanin([1.3, 0.0]));
    assert_eq!(pigment("\"float eumelanin\" .3"), Pigment::Melanin([0.3, 0.0]));
    assert_eq!(pigment("\"float pheomelanin\" .5"), Pigment::Melanin([0.0, 0.5]));
    let absorption = Pigment::Absorption([0.04, 0.04, 0.09]);
    assert_eq!(pigment("\"rgb sigma_a\" [.04 .04 .09]"), absorption);
    let color = Pigment::Reflectance(Input::Value([0.5, 0.3, 0.1]));
    assert_eq!(pigment("\"rgb reflectance\" [.5 .3 .1]"), color);
    let fur = read(
        "",
        "Texture \"spots\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.8 .8 .8] \"rgb tex2\" [.1 .1 .1]
        Material \"hair\" \"texture reflectance\" \"spots\" Shape \"sphere\"",
    );
    let Surface::Hair(Hair { pigment: Pigment::Reflectance(color), .. }) =
        &fur.materials[0].surface
    else {
        panic!("{:?}", fur.materials[0])
    };
    assert!(color.texture().is_some());
    for other in ["\"float eumelanin\" 1", "\"rgb sigma_a\" [1 1 1]"] {
        let both =
            refusal(&format!("Material \"hair\" \"rgb reflectance\" [.5 .3 .1] {other} {SPHERE}"));
        assert!(both.contains("expected one of the two"), "{both}");
    }
}

#[test]
fn hair_has_the_roughness_the_index_and_the_scales_that_are_given() {
    let plain = hair("", SPHERE);
    assert_eq!(plain, Hair { two_sided: true, ..Hair::default() });
    let given =
        hair("\"float beta_m\" .2 \"float beta_n\" .6 \"float alpha\" 3 \"float eta\" 1.4", SPHERE);
    let Hair { roughness, azimuthal_roughness, scale_angle, ior, .. } = given;
    assert_eq!([roughness, azimuthal_roughness, scale_angle, ior], [0.2, 0.6, 3.0, 1.4]);
    for (parameter, expected) in [
        ("\"float beta_m\" 1.5", "found \"beta_m\" = 1.5, expected a number from 0 to 1"),
        ("\"float eta\" .5", "found \"eta\" = 0.5, expected a number from 1 to 100"),
        ("\"float alpha\" 50", "found \"alpha\" = 50, expected a number from -45 to 45"),
    ] {
        let refused = refusal(&format!("Material \"hair\" {parameter} {SPHERE}"));
        assert!(refused.contains(expected), "{refused}");
    }
    let scene = read(
        "",
        "Texture \"rough\" \"float\" \"checkerboard\" \"float tex1\" .2 \"float tex2\" .4
        Material \"hair\" \"texture beta_m\" \"rough\" Shape \"sphere\"",
    );
    let Surface::Hair(mean) = &scene.materials[0].surface else { panic!("no hair") };
    assert!((mean.roughness - 0.3).abs() < 1e-6 && scene.warnings.len() == 1, "{mean:?}");
}

/// Tubes are closed and have no back, regardless of their orientation; ribbons and other shapes are
/// two-sided.
#[test]
fn only_tubes_of_hair_have_no_back() {
    const CURVE: &str =
        "Shape \"curve\" \"point3 P\" [0 0 0  0 1 0  0 2 0  0 3 0] \"float width\" .1";
    assert!(!hair("", CURVE).two_sided);
    assert!(
        hair("", &format!("{CURVE} \"string type\" \"ribbon\" \"normal N\" [0 0 1  0 0 1]"))
            .two_sided
    );
    assert!(hair("", SPHERE).two_sided);
    let outward = |more: &str| {
        let scene = read("", &format!("Material \"hair\" {more} {CURVE}"));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        let mesh = std::sync::Arc::clone(mesh);
        let normals = mesh.normals.as_ref().expect("normals");
        let out = |(p, n): (&[f32; 3], &[f32; 3])| p[0] * n[0] + p[2] * n[2] > 0.0;
        mesh.positions.iter().zip(&normals.values).all(out)
    };
    assert!(outward("") && outward("ReverseOrientation"));
    // One material on both kinds of shapes becomes two.
    let both = read("", &format!("Material \"hair\" {CURVE} {SPHERE} {CURVE}"));
    let sides: Vec<_> = both.materials.iter().map(|m| m.surface.culls_backfaces()).collect();
    assert_eq!(sides, [true, false]);
    assert_eq!(
        both.objects.iter().map(|o| o.materials[0]).collect::<Vec<_>>(),
        [Some(0), Some(1), Some(0)]
    );
}

/// Metals with textures use Schlick's formula, or, if they are smooth, a constant reflectance.
#[test]
fn metals_may_have_textures() {
    const SQUARES: &str = "Texture \"s\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.2 .4 .8] \"rgb tex2\" [.8 .4 .2] ";
    let metal = |more: &str| {
        surface(&format!("{SQUARES} Material \"conductor\" \"texture reflectance\" \"s\" {more}"))
    };
    let Surface::Principled(rough) = metal("\"float roughness\" .0016") else { panic!("no metal") };
    assert!(rough.two_sided && rough.metallic == 1.0.into());
    let Scalar::Value(roughness) = rough.roughness else { panic!("a texture") };
    // α = √0.0016 in pbrt-v4, and the square of the roughness here.
    assert!((roughness * roughness - 0.04).abs() < 1e-6, "{roughness}");
    assert!(matches!(texture(&rough.base_color).pattern, Pattern::Checkerboard(_)));
    let Surface::Mirror(smooth) = metal("") else { panic!("no mirror") };
    assert_eq!(smooth.reflectance, rough.base_color);
    let of_mean = surface(&format!(
        "{SQUARES} Material \"conductor\" \"texture eta\" \"s\" \"rgb k\" [3 3 3] \"float roughness\" .1"
    ));
    let Surface::Conductor(Conductor { eta, .. }) = of_mean else { panic!("no metal") };
    assert!((eta[0] - 0.5).abs() < 1e-6 && (eta[1] - 0.4).abs() < 1e-6, "{eta:?}");
    let both = format!(
        "{SQUARES} Material \"conductor\" \"texture reflectance\" \"s\" \"rgb k\" [3 3 3] Shape \"sphere\""
    );
    assert!(refusal(&both).contains("expected one of the two"));
    let lost = "Texture \"s\" \"spectrum\" \"constant\" Material \"dielectric\" \"texture eta\" \"s\" Shape \"sphere\"";
    assert!(refusal(lost).contains("found a texture for \"eta\""), "{}", refusal(lost));
}

/// The last directive of an included file continues after the directive that includes it.
#[test]
fn parameters_go_on_behind_included_files() {
    let world = "Include \"parts/density.inc\" \"rgb sigma_a\" [1 2 3] \"rgb sigma_s\" [3 2 1] \
                 MediumInterface \"smoke\" \"\" Material \"interface\" Shape \"sphere\"";
    let scene = read("", world);
    let MediumProperties::Heterogeneous(smoke) = &scene.media[0].matter else { panic!("no grid") };
    assert_eq!(smoke.extinction.grid.values, [4.0, 2.0]);
    assert_eq!(smoke.albedo, Volume::Constant([0.75, 0.5, 0.25]));
}
