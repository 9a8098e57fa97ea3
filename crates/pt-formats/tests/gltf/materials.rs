//! Materials and textures.

use pt_math::color::linear_from_srgb;
use pt_scene::material::{Black, MetallicRoughness, SurfaceDetail};
use pt_scene::medium::MediumProperties;
use pt_scene::texture::{Bitmap, Edge, Filter, NormalOrBump, Pattern, TextureMapping, Wrap};
use pt_scene::{Color, Geometry, Material, Scalar, Scene, Sides, Surface};
use serde_json::{Value, json};

use super::read;
use super::text::Text;

/// Two texels side by side: (188, 0, 51) with an alpha of 0, and (188, 100, 51) with an alpha of
/// 128.
pub(super) const PNG: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAYAAAD0In+KAAAAEUlEQVR42mPYw2DMsCfFuAEADB0Cw5g8Xu0AAAAASUVORK5CYII=";

/// A scene of one triangle with a material, and with the texture 0.
pub(super) fn scene(material: &Value) -> Scene {
    let mut text = Text::default();
    let attributes = text.triangle();
    read(&text.with(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
        "materials": [material],
        "textures": [{"source": 0, "sampler": 0}],
        "images": [{"uri": PNG}],
        "samplers": [{"wrapS": 33648, "wrapT": 33071, "magFilter": 9728}]
    })))
}

fn made(material: &Value) -> Material {
    scene(material).materials.to_mut().remove(0)
}

pub(super) fn look(material: &Value) -> MetallicRoughness {
    match made(material).surface {
        Surface::MetallicRoughness(look) => look,
        other => panic!("{other:?}"),
    }
}

pub(super) fn bitmap(color: &Color) -> &Bitmap {
    match color.texture().map(|texture| &texture.pattern) {
        Some(Pattern::Bitmap(bitmap)) => bitmap,
        other => panic!("{other:?}"),
    }
}

/// The factors of a product.
pub(super) fn factors(color: &Color) -> &[Color; 2] {
    match color.texture().map(|texture| &texture.pattern) {
        Some(Pattern::Product(factors)) => factors,
        other => panic!("{other:?}"),
    }
}

/// The texels of a number.
pub(super) fn texels(number: &Scalar) -> Vec<[f32; 3]> {
    match number.texture().map(|texture| &texture.pattern) {
        Some(Pattern::Bitmap(bitmap)) => bitmap.image.pixels.to_vec(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn without_a_word_it_is_a_rough_white_metal() {
    let plain = look(&json!({}));
    assert_eq!(plain.base_color, Color::Value([1.0; 3]));
    assert!(plain.two_sided && !plain.transmits());
    assert_eq!((plain.metallic, plain.roughness), (Scalar::Value(1.0), Scalar::Value(1.0)));
    let mut text = Text::default();
    let primitive = json!({"attributes": text.triangle()});
    let nodes = json!({"nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}]});
    let without = read(&text.with(nodes)).materials.to_mut().remove(0);
    assert_eq!(without.surface, made(&json!({})).surface);
}

#[test]
fn numbers_are_those_of_the_file() {
    let found = look(&json!({"pbrMetallicRoughness": {
        "baseColorFactor": [0.25, 0.5, 0.75, 1], "metallicFactor": 0.25, "roughnessFactor": 0.5
    }}));
    assert_eq!(found.base_color, Color::Value([0.25, 0.5, 0.75]));
    assert_eq!((found.metallic, found.roughness), (Scalar::Value(0.25), Scalar::Value(0.5)));
    assert_eq!(found.ior, 1.5);
}

#[test]
fn colours_are_decoded_and_numbers_are_not() {
    let found = look(&json!({"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}, "roughnessFactor": 0.5
    }}));
    let base = bitmap(&found.base_color);
    let light = |level: f32| linear_from_srgb(level / 255.0);
    let of = |green| [light(188.0), light(green), light(51.0)];
    assert_eq!(base.image.pixels, [of(0.0), of(100.0)]);
    assert_eq!(
        (base.wrap, base.filter),
        (Wrap { u: Edge::Mirror, v: Edge::Clamp }, Filter::Nearest)
    );
    assert_eq!(texels(&found.metallic), [[51.0 / 255.0; 3]; 2]);
    let Scalar::Texture(roughness) = &found.roughness else { panic!("{:?}", found.roughness) };
    let roughness = Color::Texture(roughness.clone());
    let [texture, factor] = factors(&roughness);
    assert_eq!(bitmap(texture).image.pixels, [[0.0; 3], [100.0 / 255.0; 3]]);
    assert_eq!(*factor, Color::Value([0.5; 3]));
}

#[test]
fn opacity_counts_where_the_alpha_mode_says_so() {
    let of = |mode: &str, factor: f64, cutoff: f64| {
        made(&json!({"alphaMode": mode, "alphaCutoff": cutoff, "pbrMetallicRoughness": {
            "baseColorFactor": [1, 1, 1, factor], "baseColorTexture": {"index": 0}
        }}))
        .opacity
    };
    assert_eq!(of("OPAQUE", 0.5, 0.5), Scalar::Value(1.0));
    assert_eq!(texels(&of("BLEND", 1.0, 0.5)), [[0.0; 3], [128.0 / 255.0; 3]]);
    assert_eq!(texels(&of("MASK", 1.0, 0.5)), [[0.0; 3], [1.0; 3]]);
    assert_eq!(texels(&of("MASK", 1.0, 0.6)), [[0.0; 3]; 2]);
    assert_eq!(texels(&of("MASK", 0.5, 0.2)), [[0.0; 3], [1.0; 3]]);
    assert_eq!(texels(&of("MASK", 0.5, 0.3)), [[0.0; 3]; 2]);
    let plain = |factor: f64| {
        made(&json!({"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, factor]}}))
            .opacity
    };
    assert_eq!((plain(0.4), plain(0.5)), (Scalar::Value(0.0), Scalar::Value(1.0)));
}

#[test]
fn what_is_left_of_light_is_the_colour_of_attenuation() {
    let colour = [0.9_f32, 0.5, 0.1];
    let scene = scene(&json!({"extensions": {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0.4, "attenuationColor": colour}
    }}));
    assert_eq!(scene.objects[0].media, Some(Sides { interior: Some(0), exterior: None }));
    assert_eq!(scene.settings.integrator, Some("volpath"));
    let MediumProperties::Homogeneous { extinction, albedo, .. } = scene.media[0].matter else {
        panic!("{:?}", scene.media[0])
    };
    assert_eq!(albedo, [0.0; 3]);
    for (left, sigma) in colour.into_iter().zip(extinction) {
        assert!((left - (-0.4 * sigma).exp()).abs() < 1e-6);
    }
}

#[test]
fn without_a_thickness_light_goes_through_a_sheet() {
    let sheet = |metallic: f64| {
        made(&json!({"pbrMetallicRoughness": {"metallicFactor": metallic, "roughnessFactor": 0.25}, "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 0.75}, "KHR_materials_ior": {"ior": 1.25}
        }}))
        .surface
    };
    for metallic in [0.0, 0.5] {
        let Surface::MetallicRoughness(sheet) = sheet(metallic) else { panic!("another surface") };
        assert!(sheet.thin && !sheet.two_sided);
        assert_eq!((sheet.transmission, sheet.ior), (Scalar::Value(0.75), 1.25));
        assert_eq!(sheet.roughness, Scalar::Value(0.25));
        assert_eq!(sheet.metallic, Scalar::Value(metallic as f32));
    }
}

#[test]
fn emission_has_its_strength() {
    let emission = |fields: Value| made(&fields).emission;
    let strength = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 8}});
    let plain = emission(json!({"emissiveFactor": [1, 0.5, 0], "extensions": strength}));
    assert_eq!(plain, Color::Value([8.0, 4.0, 0.0]));
    let textured = emission(json!({
        "emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0}, "extensions": strength
    }));
    assert_eq!(factors(&textured)[1], Color::Value([8.0, 4.0, 0.0]));
    assert_eq!(emission(json!({"emissiveTexture": {"index": 0}})), Color::Value([0.0; 3]));
}

/// The opacity of a surface multiplies its emission, by numbers, images and masks. [glTF 2.0,
/// §3.9.4]
#[test]
fn emission_is_that_of_the_share_that_is_there() {
    let of = |mode: &str, base: Value| {
        made(&json!({"alphaMode": mode, "emissiveFactor": [1, 0.5, 0], "pbrMetallicRoughness": base}))
            .emission
    };
    let half = json!({"baseColorFactor": [1, 1, 1, 0.5]});
    assert_eq!(of("OPAQUE", half.clone()), Color::Value([1.0, 0.5, 0.0]));
    assert_eq!(of("BLEND", half.clone()), Color::Value([0.5, 0.25, 0.0]));
    assert_eq!(of("MASK", half), Color::Value([1.0, 0.5, 0.0]));
    assert_eq!(of("MASK", json!({"baseColorFactor": [1, 1, 1, 0.4]})), Color::Value([0.0; 3]));
    let image = json!({"baseColorTexture": {"index": 0}});
    for (mode, shares) in [("BLEND", [0.0, 128.0 / 255.0]), ("MASK", [0.0, 1.0])] {
        let emission = of(mode, image.clone());
        let [color, share] = factors(&emission);
        assert_eq!(*color, Color::Value([1.0, 0.5, 0.0]));
        assert_eq!(bitmap(share).image.pixels, shares.map(|share: f32| [share; 3]));
    }
}

/// A copy just behind the surface has the same emission, faces the other way, and transmits all
/// light.
#[test]
fn double_sided_surfaces_emit_on_both_sides() {
    let of = |is_double: bool, emissive: [f32; 3]| {
        scene(&json!({"doubleSided": is_double, "emissiveFactor": emissive}))
    };
    for single in [of(false, [1.0, 0.5, 0.0]), of(true, [0.0; 3])] {
        assert_eq!((single.objects.len(), single.materials.len()), (1, 1));
    }
    let double = of(true, [1.0, 0.5, 0.0]);
    assert_eq!(double.warnings, []);
    let [front, back] = [0, 1].map(|i| match &double.objects[i].geometry {
        Geometry::Mesh(mesh) => mesh.triangles[0],
        other => panic!("{other:?}"),
    });
    assert_eq!(back, [front[0], front[2], front[1]]);
    let behind = double.objects[1].materials[0].expect("a material") as usize;
    let Material { surface, emission, opacity, .. } = &double.materials[behind];
    assert_eq!(*emission, Color::Value([1.0, 0.5, 0.0]));
    assert_eq!((surface, opacity), (&Black.into(), &Scalar::Value(0.0)));
}

#[test]
fn normals_keep_the_numbers_of_their_image() {
    let surface = made(&json!({"normalTexture": {"index": 0}})).surface;
    let Surface::SurfaceDetail(SurfaceDetail { relief: NormalOrBump::Normals(map), .. }) = surface
    else {
        panic!("{surface:?}")
    };
    let found = bitmap(&Color::Texture(map)).image.pixels[1];
    let stored = [188.0, 100.0, 51.0].map(|level: f32| 2.0 * level / 255.0 - 1.0);
    let length = stored.iter().map(|x| x * x).sum::<f32>().sqrt();
    for (found, stored) in found.into_iter().zip(stored) {
        assert!((2.0 * found - 1.0 - stored / length).abs() < 1e-6);
    }
}

/// Rotated or reversed images transform their normals as well. If an image is mirrored, its normals
/// are reversed along v, as on triangles with mirrored coordinates.
#[test]
fn normals_turn_with_the_transform_of_their_image() {
    let relief = |transform: Value| {
        let extensions = json!({"KHR_texture_transform": transform});
        match made(&json!({"normalTexture": {"index": 0, "extensions": extensions}})).surface {
            Surface::SurfaceDetail(embossed) => embossed.relief,
            other => panic!("{other:?}"),
        }
    };
    let y_of = |relief: &NormalOrBump| match relief {
        NormalOrBump::Normals(map) | NormalOrBump::TurnedNormals(map) => {
            2.0 * bitmap(&Color::Texture(map.clone())).image.pixels[1][1] - 1.0
        }
        NormalOrBump::NormalsAlong(..) | NormalOrBump::Heights(..) => panic!("{relief:?}"),
    };
    let upright = y_of(&relief(json!({})));
    assert!(upright < 0.0, "100 of 255 is below the middle");
    for (transform, is_turned, is_mirrored) in [
        (json!({"offset": [0.5, 0.5], "scale": [2, 3]}), false, false),
        (json!({"rotation": 0.5}), true, false),
        (json!({"scale": [-1, 1]}), true, true),
        (json!({"scale": [1, -1]}), false, true),
        (json!({"scale": [-1, -1]}), true, false),
    ] {
        let found = relief(transform.clone());
        assert_eq!(matches!(found, NormalOrBump::TurnedNormals(_)), is_turned, "{transform}");
        let wanted = if is_mirrored { -upright } else { upright };
        assert!((y_of(&found) - wanted).abs() < 1e-6, "{transform}");
    }
}

/// The opacity of COLOR_0 is a factor of the opacity of a blended material. It has no effect
/// otherwise, which is reported for masked ones.
#[test]
fn vertices_have_opacities() {
    for (mode, factor) in [("BLEND", 0.5), ("BLEND", 1.0), ("OPAQUE", 0.5), ("MASK", 1.0)] {
        let mut text = Text::default();
        let mut attributes = text.triangle();
        attributes["COLOR_0"] = text.vectors(&[[1.0, 1.0, 1.0, 0.25]; 3]).into();
        let scene = read(&text.with(json!({
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
            "materials": [{"alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, factor]}}]
        })));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        let opacity = &scene.materials[0].opacity;
        let noted = scene.warnings.iter().any(|note| note.message.contains("COLOR_0"));
        assert_eq!(noted, mode == "MASK", "{:?}", scene.warnings);
        if mode != "BLEND" {
            assert_eq!((opacity, &mesh.attributes.vertices.len()), (&Scalar::Value(1.0), &0));
            continue;
        }
        let name = "opacity of COLOR_0";
        assert_eq!(mesh.attributes.vertices[name], [[0.25; 3]; 3]);
        let of_vertices = Pattern::VertexAttribute(name.into());
        let found = opacity.texture().expect("a texture");
        if factor == 1.0 {
            assert_eq!(found.pattern, of_vertices);
        } else {
            let [vertices, share] = factors(&Color::Texture(found.clone())).clone();
            assert_eq!(vertices.texture().map(|t| &t.pattern), Some(&of_vertices));
            assert_eq!(share, Color::Value([factor as f32; 3]));
        }
    }
}

/// A triangle with ∂p/∂u = +x and ∂p/∂v = −y, as v increases downwards in glTF: a tangent along +y
/// is −1 times ∂p/∂v. With w = −1, +y of the image is on the opposite side.
#[test]
fn normals_lie_along_tangents() {
    for w in [1.0, -1.0] {
        let mut text = Text::default();
        let mut attributes = text.triangle();
        attributes["TEXCOORD_0"] = text.vectors(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]).into();
        attributes["TANGENT"] = text.vectors(&[[0.0, 1.0, 0.0, w]; 3]).into();
        let scene = read(&text.with(json!({
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
            "materials": [{"normalTexture": {"index": 0}}],
            "textures": [{"source": 0}],
            "images": [{"uri": PNG}]
        })));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        assert_eq!(mesh.attributes.faces["TANGENT"], [[0.0, -1.0, 0.0]]);
        let slot = mesh.submeshes[0].slot as usize;
        assert_eq!(slot, usize::from(w < 0.0));
        let material = scene.objects[0].materials[slot].expect("a material") as usize;
        let Surface::SurfaceDetail(SurfaceDetail {
            relief: NormalOrBump::NormalsAlong(map, along),
            ..
        }) = &scene.materials[material].surface
        else {
            panic!("{:?}", scene.materials[material].surface)
        };
        assert_eq!(along.pattern, Pattern::FaceAttribute("TANGENT".into()));
        let y = 2.0 * bitmap(&Color::Texture(map.clone())).image.pixels[1][1] - 1.0;
        assert!(y * w < 0.0, "100 of 255 is below the middle");
    }
}

/// Tangents are the direction of anisotropy, also after morphing and skinning. If their handedness
/// is −1, the rotation is reversed, and so is the second channel of the image.
#[test]
fn anisotropy_is_along_tangents() {
    for (w, is_bent) in [(1.0, false), (-1.0, false), (1.0, true), (-1.0, true)] {
        let mut text = Text::default();
        let mut attributes = text.triangle();
        attributes["TEXCOORD_0"] = text.vectors(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]).into();
        let before = if is_bent { [0.0, 0.0, 1.0, w] } else { [0.0, 1.0, 0.0, w] };
        attributes["TANGENT"] = text.vectors(&[before; 3]).into();
        // From z to x by a target, and from there to y by a joint.
        let to_x = text.vectors(&[[1.0, 0.0, -1.0]; 3]);
        let mut primitive = json!({"attributes": attributes, "material": 0});
        let mut node = json!({"mesh": 0});
        if is_bent {
            primitive["targets"] = json!([{"TANGENT": to_x}]);
            primitive["attributes"]["JOINTS_0"] = text.accessor(&[0; 12], "VEC4", 5121, 3).into();
            primitive["attributes"]["WEIGHTS_0"] = text.vectors(&[[1.0, 0.0, 0.0, 0.0]; 3]).into();
            node = json!({"mesh": 0, "skin": 0, "weights": [1]});
        }
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let quarter_turn = json!([0, 0, half, half]);
        let anisotropy = json!({
            "anisotropyStrength": 0.5, "anisotropyRotation": 0.25, "anisotropyTexture": {"index": 0}
        });
        let scene = read(&text.with(json!({
            "scene": 0,
            "scenes": [{"nodes": [0, 1]}],
            "nodes": [node, {"rotation": quarter_turn}],
            "skins": [{"joints": [1]}],
            "meshes": [{"primitives": [primitive]}],
            "materials": [{"extensions": {"KHR_materials_anisotropy": anisotropy}}],
            "textures": [{"source": 0}],
            "images": [{"uri": PNG}]
        })));
        assert_eq!(scene.warnings, []);
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        let [[a, b, _]] = mesh.attributes.faces["TANGENT"][..] else { panic!("a triangle") };
        // The joint rotates ∂p/∂u = x to y, and ∂p/∂v = −y to x.
        let wanted = if is_bent { [1.0, 0.0] } else { [0.0, -1.0] };
        assert!((a - wanted[0]).abs() < 1e-6 && (b - wanted[1]).abs() < 1e-6, "{a} {b}");
        let slot = mesh.submeshes[0].slot as usize;
        assert_eq!(slot, usize::from(w < 0.0));
        let material = scene.objects[0].materials[slot].expect("a material") as usize;
        let Surface::MetallicRoughness(look) = &scene.materials[material].surface else {
            panic!("{:?}", scene.materials[material].surface)
        };
        let along = look.anisotropy_along.as_ref().expect("tangents");
        assert_eq!(along.pattern, Pattern::FaceAttribute("TANGENT".into()));
        assert_eq!(look.anisotropy_rotation, 0.25 * w);
        let [x, y] = look.anisotropy_direction.each_ref().map(|number| {
            let texture = number.texture().expect("a texture").clone();
            bitmap(&Color::Texture(texture)).image.pixels[1][0]
        });
        let green = if w > 0.0 { 100.0 / 255.0 } else { 155.0 / 255.0 };
        assert!((x - 188.0 / 255.0).abs() < 1e-6 && (y - green).abs() < 1e-6, "{x} {y}");
    }
}

/// The mesh has the coordinates of the normal map, or of the first texture without one; other sets
/// are referenced by number.
#[test]
fn textures_lie_on_several_sets_of_coordinates() {
    let file = |material: Value| {
        let mut text = Text::default();
        let mut attributes = text.triangle();
        attributes["TEXCOORD_0"] = text.vectors(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]).into();
        attributes["TEXCOORD_1"] = text.vectors(&[[0.5, 0.25], [1.0, 0.0], [0.0, 0.75]]).into();
        read(&text.with(json!({
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
            "materials": [material],
            "textures": [{"source": 0}],
            "images": [{"uri": PNG}]
        })))
    };
    let painted = |normal_set: usize| {
        let extensions = json!({"KHR_texture_transform": {"texCoord": 1, "scale": [2, 2]}});
        file(json!({
            "normalTexture": {"index": 0, "texCoord": normal_set},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0, "extensions": extensions}
        }))
    };
    for normal_set in [0, 1] {
        let scene = painted(normal_set);
        assert_eq!(scene.warnings, []);
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        let sets = [[0.0, 1.0], [0.5, 0.75]];
        let uvs = mesh.uvs.as_ref().expect("coordinates");
        assert_eq!(uvs.values[0], sets[normal_set], "v runs up");
        let other = 1 - normal_set;
        let [u, v] = sets[other];
        assert_eq!(mesh.attributes.vertices[&format!("uv_{other}")][0], [u, v, 0.0]);
        let Material { surface, emission, .. } = &scene.materials[0];
        let Surface::SurfaceDetail(SurfaceDetail {
            surface,
            relief: NormalOrBump::Normals(map),
            ..
        }) = surface
        else {
            panic!("{surface:?}")
        };
        let Surface::MetallicRoughness(look) = &**surface else { panic!("{surface:?}") };
        let layout = |color: &Color| color.texture().expect("a texture").layout;
        let of_set = |set: usize| {
            if set == normal_set {
                TextureMapping::Surface
            } else {
                TextureMapping::Coordinates { set: set as u32 }
            }
        };
        assert_eq!(map.layout, TextureMapping::Surface);
        assert_eq!(layout(&look.base_color), of_set(0));
        assert_eq!(layout(emission), of_set(1));
    }
    let scene = file(json!({"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0, "texCoord": 3}
    }}));
    assert!(scene.warnings.iter().any(|note| note.message.contains("missing TEXCOORD_3")));
}

/// Two triangles, of which the first one has mirrored coordinates.
#[test]
fn normals_lean_to_the_other_side_where_coordinates_lie_mirrored() {
    let mut text = Text::default();
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let positions = text.vectors(&[square.as_slice(), &square].concat());
    let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let mirrored = uvs.map(|[u, v]: [f32; 2]| [1.0 - u, v]);
    let uvs = text.vectors(&[mirrored, uvs].concat());
    let indices = text.accessor(&[0, 1, 2, 4, 5, 6], "SCALAR", 5121, 6);
    let scene = read(&text.with(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices, "material": 0
        }]}],
        "materials": [{"normalTexture": {"index": 0}}],
        "textures": [{"source": 0}],
        "images": [{"uri": PNG}]
    })));
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("a mesh") };
    assert_eq!(mesh.triangles, [[4, 5, 6], [0, 1, 2]]);
    assert_eq!(scene.objects[0].materials, [Some(0), Some(1)]);
    let [upright, mirrored] = [0, 1].map(|slot: usize| match &scene.materials[slot].surface {
        Surface::SurfaceDetail(SurfaceDetail { relief: NormalOrBump::Normals(map), .. }) => {
            bitmap(&Color::Texture(map.clone())).image.pixels[0].map(|x| 2.0 * x - 1.0)
        }
        other => panic!("{other:?}"),
    });
    assert!(upright[1] != 0.0);
    for (upright, mirrored) in upright.into_iter().zip([mirrored[0], -mirrored[1], mirrored[2]]) {
        assert!((upright - mirrored).abs() < 1e-6);
    }
}

#[test]
fn colours_of_vertices_multiply_the_base() {
    let mut text = Text::default();
    let mut attributes = text.triangle();
    let levels = [[255, 0, 51, 9], [0, 255, 0, 9], [0, 0, 255, 9_u8]];
    let colors = text.accessor(levels.as_flattened(), "VEC4", 5121, 3);
    attributes["COLOR_0"] = colors.into();
    let mut file: Value = serde_json::from_str(&text.with(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 1, 1]}}]
    })))
    .expect("it was written");
    file["accessors"][colors]["normalized"] = true.into();
    let scene = read(&file.to_string());
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("a mesh") };
    assert_eq!(mesh.colors.as_ref().map(|colors| colors.values[0]), Some([1.0, 0.0, 0.2]));
    let Surface::MetallicRoughness(found) = &scene.materials[0].surface else { panic!("another") };
    let [colors, factor] = factors(&found.base_color);
    assert!(colors.texture().is_some_and(|texture| texture.shows_colors_of_mesh()));
    assert_eq!(*factor, Color::Value([0.5, 0.5, 1.0]));
}

#[test]
fn images_are_made_once() {
    let mut text = Text::default();
    let attributes = text.triangle();
    let material = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    let scene = read(&text.with(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [
            {"attributes": attributes, "material": 0}, {"attributes": attributes, "material": 1}
        ]}],
        "materials": [material, material],
        "textures": [{"source": 0}],
        "images": [{"uri": PNG}]
    })));
    let images: Vec<_> = scene
        .materials
        .iter()
        .map(|material| match &material.surface {
            Surface::MetallicRoughness(found) => bitmap(&found.base_color).image.clone(),
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(images.len() == 2 && std::sync::Arc::ptr_eq(&images[0], &images[1]));
}

/// An unlit surface base colour is emitted.
#[test]
fn unlit_surfaces_emit_in_their_base_colour() {
    let unlit = |base: Value| json!({"pbrMetallicRoughness": base, "extensions": {"KHR_materials_unlit": {}}});
    let read = scene(&unlit(json!({"baseColorFactor": [0.5, 0.25, 1, 1]})));
    let Material { surface, emission, .. } = &read.materials[0];
    assert_eq!((surface, emission), (&Black.into(), &[0.5, 0.25, 1.0].into()));
    assert!(read.warnings.iter().any(|note| note.message.contains("base colour is emitted")));
    let textured = made(&unlit(json!({"baseColorTexture": {"index": 0}})));
    assert_eq!(bitmap(&textured.emission).image.width, 2);
}

/// Integer colours are normalized even if they are not marked as such, with a note.
#[test]
fn colours_of_whole_numbers_are_levels() {
    for is_marked in [true, false] {
        let mut text = Text::default();
        let mut attributes = text.triangle();
        attributes["COLOR_0"] = text.levels(&[[255, 51, 0]; 3], is_marked).into();
        let scene = read(&text.with(json!({
            "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": attributes}]}]
        })));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        let colors = mesh.colors.as_ref().expect("colours").values[0];
        assert_eq!(colors, [1.0, 0.2, 0.0], "{is_marked}");
        let noted = scene.warnings.iter().any(|note| note.message.contains("normalized"));
        assert_eq!(noted, !is_marked);
    }
}
