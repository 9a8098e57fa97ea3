//! Scenes with many images, which several threads decode.

use std::fmt::Write as _;
use std::path::Path;

use pt_formats::{Limits, LoadOptions, LoadResult, read_with};
use pt_image::{SaveOptions, save};
use pt_scene::image::Image;

/// Number of images of a scene. Number 7 is missing, and number 11 is invalid.
const COUNT: u32 = 40;

/// Returns a scene of a format with one material per image, and further ones that share images.
fn scene(ending: &str) -> String {
    let each = |item: &dyn Fn(u32) -> String, between: &str| {
        let numbers = (0..COUNT).chain([3, 7, 39]);
        numbers.map(item).collect::<Vec<_>>().join(between)
    };
    let all = |item: &dyn Fn(u32) -> String| (0..COUNT).map(item).collect::<Vec<_>>().join(", ");
    match ending {
        "xml" => {
            let shape = |i| {
                format!(
                    "<shape type=\"cube\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\"><string \
                     name=\"filename\" value=\"{i}.png\"/><boolean name=\"raw\" value=\"{}\"/></texture></bsdf></shape>",
                    i % 2 == 0
                )
            };
            format!("<scene version=\"3.0.0\">{}</scene>", each(&shape, "\n"))
        }
        "pbrt" => {
            let texture = |i| {
                format!(
                    "Texture \"{i}\" \"spectrum\" \"imagemap\" \"string filename\" \"{i}.png\"\n"
                )
            };
            let shape = |i| {
                format!("Material \"diffuse\" \"texture reflectance\" \"{i}\" Shape \"sphere\"")
            };
            let textures: String = (0..COUNT).map(texture).collect();
            format!("Camera \"perspective\" WorldBegin\n{textures}{}", each(&shape, "\n"))
        }
        "gltf" => {
            let material = |i| {
                format!(r#"{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": {i}}}}}}}"#)
            };
            let part = |i| format!(r#"{{"attributes": {{"POSITION": 0}}, "material": {i}}}"#);
            format!(
                r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{}]}}],
                "materials": [{}], "textures": [{}], "images": [{}],
                "accessors": [{{"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0}}],
                "bufferViews": [{{"buffer": 0, "byteLength": 36}}], "buffers": [{{"byteLength": 36, "uri":
                "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}]}}"#,
                each(&part, ", "),
                all(&material),
                all(&|i| format!(r#"{{"source": {i}}}"#)),
                all(&|i| format!(r#"{{"uri": "{i}.png"}}"#)),
            )
        }
        "json" => {
            let material = |i| {
                format!(
                    r#""{i}": {{"type": "matte", "reflectance": {{"type": "bitmap", "image": "{i}"}}}}"#
                )
            };
            format!(
                r#"{{"pathtracer": 1, "images": {{{}}}, "materials": {{{}}}}}"#,
                all(&|i| format!(r#""{i}": {{"file": "{i}.png", "raw": {}}}"#, i % 2 == 0)),
                all(&material)
            )
        }
        _ => {
            let mut text = "mtllib all.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
            for i in 0..COUNT {
                writeln!(text, "usemtl {i}\nf 1 2 3").expect("memory");
            }
            text
        }
    }
}

fn read(path: &Path, memory: Option<u64>) -> LoadResult {
    let limits = Limits { memory, ..Limits::default() };
    read_with(path, &LoadOptions { limits, ..LoadOptions::default() })
}

#[test]
fn pictures_are_the_same_whether_threads_decode_them_or_one_after_the_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    for i in (0..COUNT).filter(|i| *i != 7) {
        let size = 1 + i % 5 * 16;
        let pixel = |p: u32| [i as f32 / 64.0, p as f32 / 8192.0, 0.5];
        let pixels = (0..size * size).map(pixel).collect();
        let image = Image { width: size, height: size, pixels };
        save(&image, &file(&format!("{i}.png")), &SaveOptions::default()).expect("a writable file");
    }
    std::fs::write(file("11.png"), b"\x89PNG and nothing more").expect("a writable file");
    let library: String = (0..COUNT).fold(String::new(), |text, i| {
        text + &format!("newmtl {i}\nmap_Kd {i}.png\nmap_d -imfchan r {}.png\n", (i + 1) % COUNT)
    });
    std::fs::write(file("all.mtl"), library).expect("a writable file");
    for ending in ["xml", "pbrt", "gltf", "json", "obj"] {
        let path = file("scene").with_extension(ending);
        std::fs::write(&path, scene(ending)).expect("a writable file");
        let [alone, ahead] = [Some(1 << 40), None].map(|memory| read(&path, memory));
        assert_eq!(alone.sources, ahead.sources, "{ending}");
        assert_eq!(alone.missing, ahead.missing, "{ending}");
        assert_eq!(alone.notes, ahead.notes, "{ending}");
        assert!(ahead.sources.len() > 38 && ahead.missing.len() >= 2, "{ending}: {ahead:?}");
        let [alone, ahead] = [alone, ahead].map(|reading| reading.scene.expect("a good scene"));
        assert!(alone == ahead, "{ending}");
    }
}
