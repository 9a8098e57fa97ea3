//! glTF scenes: units of lights, and emission of surfaces.

use std::f64::consts::PI;
use std::path::Path;

use pathtracer::{CompileOptions, Session, Settings, Silent};

/// A diffuse square of albedo ½ that emits radiance 1/4, seen from its front, and lit by one light
/// 2 units in front of it.
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

/// Radiance of the square.
fn seen(light: &str) -> f64 {
    shown(&square(light), Settings { spp: 16, ..Settings::default() })
}

/// Mean radiance of the image of a camera.
fn shown(scene: &str, settings: Settings) -> f64 {
    let scene = pt_formats::parse(scene.as_bytes(), Path::new("square.gltf"))
        .unwrap_or_else(|error| panic!("{error}"));
    let options = CompileOptions { resolution: Some([4, 4]), ..CompileOptions::default() };
    let mut session = Session::new(&scene, options, settings).expect("it compiles");
    session.render(0, 1, &Silent).expect("it renders");
    let pixels = session.image().pixels;
    pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64
}

/// Burley's diffuse surface, seen and lit at a right angle, is Lambertian: L = ρE/π. [Burley 2012,
/// §5.3]
#[test]
fn candela_lux_and_nits_are_watts() {
    let context = |irradiance: f64| 0.25 + 0.5 * irradiance / PI;
    for (light, irradiance) in [
        (r#"{"type": "point", "intensity": 3}"#, 0.75),
        (r#"{"type": "spot", "intensity": 3, "spot": {"innerConeAngle": 0.1}}"#, 0.75),
        (
            r#"{"type": "spot", "intensity": 3, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}}"#,
            0.75,
        ),
        (r#"{"type": "directional", "intensity": 2}"#, 2.0),
        (r#"{"type": "directional", "intensity": 0}"#, 0.0),
    ] {
        let (found, wanted) = (seen(light), context(irradiance));
        assert!((found / wanted - 1.0).abs() < 1e-3, "{light}: {found} for {wanted}");
    }
}

/// A square of half side ½ at z = 2, which emits 1 towards +z if it is opaque, and a matte one of
/// half side 1 and albedo ½ at another z, seen by the camera of a node.
fn lamp(material: &str, [floor_z, camera]: [&str; 2]) -> String {
    let float = |x: f32| x.to_le_bytes().map(|byte| format!("%{byte:02X}")).concat();
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0_f32]];
    let positions: String =
        corners.iter().map(|[x, y]| [*x, *y, 0.0].map(float).concat()).collect();
    format!(
        r#"{{"asset": {{"version": "2.0"}},
        "nodes": [
            {{"mesh": 0, "scale": [0.5, 0.5, 1], "translation": [0, 0, 2]}},
            {{"mesh": 1, "translation": [0, 0, {floor_z}]}}, {camera}
        ],
        "cameras": [{{"type": "orthographic", "orthographic": {{"xmag": 0.01, "ymag": 0.01, "znear": 0, "zfar": 99}}}}],
        "buffers": [{{"uri": "data:,{positions}", "byteLength": 48}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}}],
        "meshes": [
            {{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": 6, "material": 0}}]}},
            {{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": 6, "material": 1}}]}}
        ],
        "materials": [
            {{"emissiveFactor": [1, 1, 1], {material}}},
            {{
                "pbrMetallicRoughness": {{"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0, "roughnessFactor": 0.5}},
                "extensions": {{"KHR_materials_specular": {{"specularFactor": 0}}}}
            }}
        ]}}"#
    )
}

/// A black surface with an opacity.
fn black(alpha: &str, rest: &str) -> String {
    format!(
        r#""pbrMetallicRoughness": {{"baseColorFactor": [0, 0, 0, {alpha}], "metallicFactor": 1}}{rest}"#
    )
}

/// Visible emission of a surface is proportional to its opacity, on the front, and behind if it has
/// two sides. The matte square is so far away that it adds less than 10⁻⁷.
#[test]
fn what_is_emitted_is_seen_by_coverage_and_side() {
    const BEFORE: &str = r#"{"camera": 0, "translation": [0, 0, 5]}"#;
    const BEHIND: &str = r#"{"camera": 0, "translation": [0, 0, -5], "rotation": [0, 1, 0, 0]}"#;
    for (camera, alpha, rest, wanted) in [
        (BEFORE, "0.25", "", 1.0),
        (BEFORE, "0.25", r#", "alphaMode": "BLEND""#, 0.25),
        (BEFORE, "0.25", r#", "alphaMode": "MASK""#, 0.0),
        (BEHIND, "1", "", 0.0),
        (BEHIND, "1", r#", "doubleSided": true"#, 1.0),
        (BEFORE, "1", r#", "doubleSided": true"#, 1.0),
        (BEHIND, "0.25", r#", "doubleSided": true, "alphaMode": "BLEND""#, 0.25),
        (BEFORE, "0.25", r#", "doubleSided": true, "alphaMode": "BLEND""#, 0.25),
    ] {
        let scene = lamp(&black(alpha, rest), ["2000", camera]);
        let found = shown(&scene, Settings { spp: 16, ..Settings::default() });
        assert!((found - wanted).abs() < 1e-6, "{rest} {camera}: {found} for {wanted}");
    }
}

/// The irradiance below the middle of a square of half side a at distance d, of radiance 1, is
/// 4 · a/√(a²+d²) · atan(a/√(a²+d²)), of which a Lambertian surface of albedo ½ shows ½/π. [Howell,
/// "A Catalog of Radiation Heat Transfer Configuration Factors", B-4, four times]
#[test]
fn light_is_cast_by_coverage_and_side() {
    // The camera is beside the lamp, which would otherwise hide the lower square.
    const ASIDE: &str = r#"{"camera": 0, "translation": [4, 0, 4], "rotation": [0, 0.38268343236508984, 0, 0.9238795325112867]}"#;
    let share = 0.5 / 4.25_f64.sqrt();
    let full = 0.5 / PI * 4.0 * share * share.atan();
    for (alpha, rest, wanted) in [
        ("1", r#", "doubleSided": true"#, full),
        ("1", "", 0.0),
        ("0.25", r#", "doubleSided": true, "alphaMode": "BLEND""#, 0.25 * full),
        ("0.25", r#", "doubleSided": true, "alphaMode": "MASK""#, 0.0),
    ] {
        let scene = lamp(&black(alpha, rest), ["0", ASIDE]);
        let settings = Settings { spp: 4096, max_depth: 2, ..Settings::default() };
        let found = shown(&scene, settings);
        assert!((found - wanted).abs() < 0.01 * full, "{rest}: {found} for {wanted}");
    }
}
