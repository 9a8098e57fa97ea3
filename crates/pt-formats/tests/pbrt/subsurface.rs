//! Subsurface scattering.

use pt_scene::material::Glass;
use pt_scene::medium::{MediumProperties, Phase};
use pt_scene::{Medium, Scene, Sides, Surface};

use super::read;

fn scene(material: &str) -> Scene {
    read("", &format!("Material \"subsurface\" {material} Shape \"sphere\" Shape \"sphere\""))
}

fn coefficients(medium: &Medium) -> ([f32; 3], [f32; 3]) {
    match medium.matter {
        MediumProperties::Homogeneous { extinction, albedo, .. } => (extinction, albedo),
        _ => panic!("no homogeneous medium"),
    }
}

#[test]
fn it_is_glass_around_one_medium_for_all_shapes_and_needs_long_paths() {
    let scene = scene(
        "\"rgb sigma_a\" [1 2 3] \"rgb sigma_s\" [3 2 1] \"float scale\" 2 \"float g\" .5 \"float eta\" 1.4",
    );
    let [medium] = scene.media.as_slice() else { panic!("{} media", scene.media.len()) };
    assert_eq!(coefficients(medium), ([8.0; 3], [0.75, 0.5, 0.25]));
    assert_eq!(medium.phase, Phase::HenyeyGreenstein { g: 0.5 });
    for object in &scene.objects {
        assert_eq!(object.media, Some(Sides { interior: Some(0), exterior: None }));
    }
    let Surface::Glass(Glass { ior, roughness, .. }) = &scene.materials[0].surface else {
        panic!("no glass")
    };
    assert_eq!((*ior, roughness), (1.4, &None));
    assert_eq!(
        (scene.settings.integrator, scene.settings.max_depth),
        (Some("volpath"), Some(1000))
    );
}

#[test]
fn without_parameters_it_is_milk() {
    let milk = coefficients(&scene("").media[0]);
    assert_eq!(milk, coefficients(&scene("\"string name\" \"Wholemilk\"").media[0]));
}

/// The coefficients of named media are reduced, so scattering is isotropic.
#[test]
fn a_name_goes_before_the_mean_cosine() {
    let skin = &scene("\"string name\" \"Skin1\" \"float g\" .5 \"float scale\" 10").media[0];
    let (extinction, albedo) = coefficients(skin);
    assert!((extinction[0] - 7.72).abs() < 1e-5 && (albedo[0] - 0.74 / 0.772).abs() < 1e-6);
    assert_eq!(skin.phase, Phase::Isotropic);
}

#[test]
fn a_medium_with_a_preset_is_as_dense_as_it_was_measured() {
    let scene = read(
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"Marble\" \"float g\" .5",
        "MediumInterface \"m\" \"\" Shape \"sphere\"",
    );
    let (extinction, albedo) = coefficients(&scene.media[0]);
    assert_eq!(extinction, [2.19 + 0.0021, 2.62 + 0.0041, 3.0 + 0.0071]);
    assert_eq!(albedo[2], 3.0 / (3.0 + 0.0071));
    assert_eq!(scene.media[0].phase, Phase::HenyeyGreenstein { g: 0.5 });
}

/// By the means of textures: reflectances of 0.25 to 0.5 are 0.375 on average.
#[test]
fn a_texture_counts_by_its_mean() {
    let textured = read(
        "",
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.5 .25 .125] \"rgb tex2\" [.25 .5 .125] \
         Material \"subsurface\" \"texture reflectance\" \"t\" Shape \"sphere\"",
    );
    let plain = scene("\"rgb reflectance\" [.375 .375 .125]");
    assert_eq!(coefficients(&textured.media[0]), coefficients(&plain.media[0]));
    assert_eq!(coefficients(&plain.media[0]).0, [1.0; 3]);
}
