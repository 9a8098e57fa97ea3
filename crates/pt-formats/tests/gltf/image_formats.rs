//! Images of materials in formats other than PNG and JPEG.

use serde_json::json;

use super::materials::{PNG, bitmap, look};
use super::read;
use super::text::Text;

/// A WebP image, with or without its extension, replaces the fallback image.
#[test]
fn images_may_be_of_webp() {
    const WEBP: &str =
        "data:image/webp;base64,UklGRiAAAABXRUJQVlA4TBQAAAAvAQAAAA8wZO/9n5n5Dy1UIKL/AQ==";
    for texture in [
        json!({"source": 1, "extensions": {"EXT_texture_webp": {"source": 0}}}),
        json!({"extensions": {"EXT_texture_webp": {"source": 0}}}),
        json!({"source": 0}),
    ] {
        let mut text = Text::default();
        let attributes = text.triangle();
        let scene = read(&text.with(json!({
            "extensionsRequired": ["EXT_texture_webp"],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
            "materials": [{"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}],
            "textures": [texture],
            "images": [{"uri": WEBP}, {"uri": PNG}]
        })));
        assert!(scene.missing.is_empty(), "{:?}", scene.missing);
        assert_eq!(bitmap(&scene.materials[0].emission).image.pixels[0], [1.0, 0.0, 0.0]);
    }
}

/// KTX 2.0 and DDS images, with or without their extensions, replace the fallback image.
#[test]
fn images_may_be_textures_of_graphics_processors() {
    const KTX2: &[u8] = include_bytes!("../../../../tests/formats/images/blocks/uastc.ktx2");
    const DDS: &[u8] = include_bytes!("../../../../tests/formats/images/blocks/rgba.dds");
    for (texture, bytes) in [
        (json!({"source": 1, "extensions": {"KHR_texture_basisu": {"source": 0}}}), KTX2),
        (json!({"source": 1, "extensions": {"MSFT_texture_dds": {"source": 0}}}), DDS),
        (json!({"source": 0}), DDS),
    ] {
        let mut text = Text::default();
        let attributes = text.triangle();
        let scene = read(&text.with(json!({
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
            "materials": [{"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}],
            "textures": [texture],
            "images": [{"uri": super::text::data(bytes)}, {"uri": PNG}]
        })));
        assert!(scene.missing.is_empty(), "{:?}", scene.missing);
        assert_eq!(bitmap(&scene.materials[0].emission).image.width, 8);
    }
}

/// The normal map of a coat uses the texture coordinates of the mesh, even if it is the only image.
#[test]
fn a_coat_may_have_the_only_image() {
    for set in [0, 1] {
        let coat =
            json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": 0, "texCoord": set}});
        let material = json!({"extensions": {"KHR_materials_clearcoat": coat}});
        let look = look(&material);
        let normals = format!("{:?}", look.clearcoat_normals);
        assert!(normals.starts_with("Relief") && !normals.contains("Coordinates"), "{normals}");
    }
}
