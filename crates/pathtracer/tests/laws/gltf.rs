//! Scenes of glTF: the units of their lights.

use std::f64::consts::PI;
use std::path::Path;

use pathtracer::{CompileOptions, Session, Settings, Silent};
use pt_scene::format;

/// A square of albedo ½ that reflects diffusely and glows with 1/4, seen from its front, and lit by one light 2 units
/// before it.
fn square(light: &str) -> String {
    let float = |x: f32| x.to_le_bytes().map(|byte| format!("%{byte:02X}")).concat();
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0_f32]];
    let positions: String =
        corners.iter().map(|[x, y]| [*x, *y, 0.0].map(float).concat()).collect();
    format!(
        r#"{{"asset": {{"version": "2.0"}},
        "extensions": {{"KHR_lights_punctual": {{"lights": [{light}]}}}},
        "nodes": [
            {{"mesh": 0}}, {{"camera": 0, "translation": [0, 0, 5]}},
            {{"extensions": {{"KHR_lights_punctual": {{"light": 0}}}}, "translation": [0, 0, 2]}}
        ],
        "cameras": [{{"type": "orthographic", "orthographic": {{"xmag": 0.01, "ymag": 0.01, "znear": 0, "zfar": 9}}}}],
        "buffers": [{{"uri": "data:,{positions}", "byteLength": 48}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": 6, "material": 0}}]}}],
        "materials": [{{
            "pbrMetallicRoughness": {{"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0, "roughnessFactor": 0.5}},
            "emissiveFactor": [0.125, 0.125, 0.125],
            "extensions": {{
                "KHR_materials_specular": {{"specularFactor": 0}}, "KHR_materials_emissive_strength": {{"emissiveStrength": 2}}
            }}
        }}]}}"#
    )
}

/// The radiance of the square.
fn seen(light: &str) -> f64 {
    let scene = format::parse(square(light).as_bytes(), Path::new("square.gltf"))
        .unwrap_or_else(|error| panic!("{error}"));
    let options = CompileOptions { resolution: Some([4, 4]), ..CompileOptions::default() };
    let settings = Settings { spp: 16, ..Settings::default() };
    let mut session = Session::new(&scene, options, settings).expect("it compiles");
    session.render(0, 1, &Silent).expect("it renders");
    let pixels = session.image().pixels;
    pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64
}

/// Burley's diffuse surface, seen and lit at a right angle, is Lambertian: L = ρE/π. [Burley 2012, §5.3]
#[test]
fn candela_lux_and_nits_are_watts() {
    let lit = |irradiance: f64| 0.25 + 0.5 * irradiance / PI;
    for (light, irradiance) in [
        (r#"{"type": "point", "intensity": 3}"#, 0.75),
        (r#"{"type": "spot", "intensity": 3, "spot": {"innerConeAngle": 0.1}}"#, 0.75),
        (r#"{"type": "directional", "intensity": 2}"#, 2.0),
        (r#"{"type": "directional", "intensity": 0}"#, 0.0),
    ] {
        let (found, wanted) = (seen(light), lit(irradiance));
        assert!((found / wanted - 1.0).abs() < 1e-3, "{light}: {found} for {wanted}");
    }
}
