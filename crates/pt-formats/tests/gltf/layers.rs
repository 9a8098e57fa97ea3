//! Layers of materials.

use pt_math::color::linear_from_srgb;
use pt_scene::material::MetallicRoughness;
use pt_scene::texture::{Filter, Pattern};
use pt_scene::{Color, Scalar, Surface};
use serde_json::{Value, json};

use super::materials::{bitmap, factors, look, scene, texels};

/// A material with an extension.
fn with(extension: &str, fields: &Value) -> MetallicRoughness {
    look(&json!({"extensions": {extension: fields}}))
}

/// The strength is in the alpha of its image, the colour in the colours of another one.
#[test]
fn reflections_have_a_strength_and_a_colour() {
    let plain = with(
        "KHR_materials_specular",
        &json!({"specularFactor": 0.25, "specularColorFactor": [2, 0.5, 0]}),
    );
    assert_eq!(plain.specular, Scalar::Value(0.25));
    assert_eq!(plain.specular_color, Color::Value([2.0, 0.5, 0.0]));
    let image = json!({"index": 0});
    let textured = with(
        "KHR_materials_specular",
        &json!({"specularTexture": image, "specularColorTexture": image}),
    );
    assert_eq!(texels(&textured.specular), [[0.0; 3], [128.0 / 255.0; 3]]);
    let red = linear_from_srgb(188.0 / 255.0);
    assert_eq!(bitmap(&textured.specular_color).image.pixels[0][0], red);
    let index = |ior: f64| with("KHR_materials_ior", &json!({"ior": ior})).ior;
    assert_eq!((index(1.25), index(0.0)), (1.25, 100.0));
}

/// The direction is in the first two channels of its image, a factor of the strength in the third.
#[test]
fn highlights_have_a_direction() {
    let fields = json!({"anisotropyStrength": 0.5, "anisotropyRotation": 0.75});
    let plain = with("KHR_materials_anisotropy", &fields);
    assert_eq!((plain.anisotropy, plain.anisotropy_rotation), (Scalar::Value(0.5), 0.75));
    assert_eq!(plain.anisotropy_direction, [Scalar::Value(1.0), Scalar::Value(0.5)]);
    let fields = json!({"anisotropyStrength": 1, "anisotropyTexture": {"index": 0}});
    let textured = with("KHR_materials_anisotropy", &fields);
    assert_eq!(texels(&textured.anisotropy), [[51.0 / 255.0; 3]; 2]);
    let [x, y] = &textured.anisotropy_direction;
    assert_eq!(texels(x), [[188.0 / 255.0; 3]; 2]);
    assert_eq!(texels(y), [[0.0; 3], [100.0 / 255.0; 3]]);
}

/// A film has its maximum thickness, or one between two numbers, by an image.
#[test]
fn films_have_a_thickness() {
    let plain = with("KHR_materials_iridescence", &json!({"iridescenceFactor": 0.5}));
    assert_eq!((plain.iridescence, plain.film_ior), (Scalar::Value(0.5), 1.3));
    assert_eq!(plain.film_thickness, Scalar::Value(400.0));
    let fields = json!({
        "iridescenceFactor": 1, "iridescenceTexture": {"index": 0}, "iridescenceIor": 1.75,
        "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 500,
        "iridescenceThicknessTexture": {"index": 0}
    });
    let textured = with("KHR_materials_iridescence", &fields);
    assert_eq!(texels(&textured.iridescence), [[188.0 / 255.0; 3]; 2]);
    assert_eq!(textured.film_ior, 1.75);
    let thickness = textured.film_thickness.texture().expect("a texture");
    let Pattern::Blend(blend) = &thickness.pattern else { panic!("{thickness:?}") };
    let ends = [&blend.first, &blend.second];
    assert_eq!(ends, [&Color::Value([200.0; 3]), &Color::Value([500.0; 3])]);
    assert_eq!(texels(&blend.amount), [[0.0; 3], [100.0 / 255.0; 3]]);
    let none = with("KHR_materials_iridescence", &json!({"iridescenceIor": 1.75}));
    assert_eq!(none, look(&json!({})));
}

/// Sheets transmit light diffusely; solids do not, with a note.
#[test]
fn light_goes_through_sheets_diffusely() {
    let fields = json!({
        "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": [1, 0.5, 0.25],
        "diffuseTransmissionTexture": {"index": 0}
    });
    let leaf = with("KHR_materials_diffuse_transmission", &fields);
    assert!(leaf.thin && leaf.transmits() && !leaf.two_sided);
    assert_eq!(leaf.diffuse_transmission_color, Color::Value([1.0, 0.5, 0.25]));
    let share = Color::Texture(leaf.diffuse_transmission.texture().expect("a texture").clone());
    let [image, factor] = factors(&share);
    assert_eq!(bitmap(image).image.pixels, [[0.0; 3], [128.0 / 255.0; 3]]);
    assert_eq!(*factor, Color::Value([0.5; 3]));
    let solid = scene(&json!({"extensions": {
        "KHR_materials_diffuse_transmission": fields,
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": 1}
    }}));
    let Surface::MetallicRoughness(look) = &solid.materials[0].surface else { panic!("another") };
    assert!(!look.thin && look.diffuse_transmission == Scalar::Value(0.0));
    assert!(
        solid.warnings.iter().any(|note| note.message.contains("diffuse transmission is ignored"))
    );
}

/// The roughness of the coat is in the second channel of its image, that of the sheen in alpha.
#[test]
fn layers_have_a_roughness() {
    let coat = with(
        "KHR_materials_clearcoat",
        &json!({"clearcoatFactor": 1, "clearcoatRoughnessFactor": 1, "clearcoatRoughnessTexture": {"index": 0}}),
    );
    assert_eq!(texels(&coat.clearcoat_roughness), [[0.0; 3], [100.0 / 255.0; 3]]);
    let sheen = with(
        "KHR_materials_sheen",
        &json!({"sheenColorFactor": [1, 0, 0.5], "sheenRoughnessFactor": 1, "sheenRoughnessTexture": {"index": 0}}),
    );
    assert_eq!(sheen.sheen_color, Color::Value([1.0, 0.0, 0.5]));
    assert_eq!(texels(&sheen.sheen_roughness), [[0.0; 3], [128.0 / 255.0; 3]]);
}

#[test]
fn sheen_may_have_a_texture() {
    let sheen = |factor: [f32; 3]| {
        let fields = json!({"sheenColorFactor": factor, "sheenColorTexture": {"index": 0}});
        with("KHR_materials_sheen", &fields).sheen_color
    };
    let [r, g, b] = [188.0, 100.0, 51.0].map(|level| linear_from_srgb(level / 255.0));
    assert_eq!(bitmap(&sheen([1.0; 3])).image.pixels, [[r, 0.0, b], [r, g, b]]);
    let [image, factor] = factors(&sheen([0.5, 0.25, 0.0])).clone();
    assert_eq!((bitmap(&image).filter, factor), (Filter::Nearest, [0.5, 0.25, 0.0].into()));
    assert_eq!(sheen([0.0; 3]), [0.0; 3].into());
}
