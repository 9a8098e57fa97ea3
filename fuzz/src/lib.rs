//! Bodies of the fuzz targets: each reads its input as a file of a format, and processes the
//! result. Nothing may panic, abort, hang or exhaust memory; each error has a message.
//!
//! `cargo xtask soak fuzz` runs the targets; each is named after the extension of its seeds.

#![cfg(feature = "libfuzzer")]
#![expect(clippy::missing_panics_doc, reason = "a panic is what the fuzzer looks for")]

mod references;

use std::path::{Path, PathBuf};
use std::sync::{Once, OnceLock};

use pt_core::film::Aov;
use pt_core::{CompileOptions, Film, Region, compile};
use pt_formats::{Limits, LoadError, LoadOptions, camera_file, ies};
use pt_image::{ImageMemory, PixelEncoding, Transfer};
use pt_scene::{Geometry, Scene};
pub use references::{mutate, mutate_glb};
use tempfile::TempDir;

/// Maximum number of triangles and spheres, counting instances, of a scene that is compiled: larger
/// scenes are only read.
const MAX_SHAPES: usize = 20_000;
/// Maximum number of objects of such a scene.
const MAX_OBJECTS: usize = 1000;

/// Reads the bytes as a scene with this file extension, in an otherwise empty folder, and compiles
/// it.
pub fn scene(bytes: &[u8], ending: &str) {
    static EMPTY: OnceLock<TempDir> = OnceLock::new();
    read(bytes, &folder(&EMPTY).join("scene").with_extension(ending));
}

/// Reads the bytes as a file with this extension that a scene refers to, and compiles that scene.
///
/// # Panics
/// If no scene is known that refers to a file with this extension, or the file cannot be written.
pub fn named(bytes: &[u8], ending: &str) {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let (scene_ending, text) = scene_with(ending);
    let folder = folder(&FOLDER);
    std::fs::write(folder.join("named").with_extension(ending), bytes).expect("a writable folder");
    read(text.as_bytes(), &folder.join("scene").with_extension(scene_ending));
}

/// Extension and text of a scene that refers to the file `named` with this extension.
fn scene_with(ending: &str) -> (&'static str, String) {
    let json = |rest: &str| ("json", format!("{{\"pathtracer\": 1, {rest}}}"));
    match ending {
        "serialized" | "safetensors" => json(&format!(
            r#""meshes": {{"m": {{"file": "named.{ending}"}}}}, "objects": [{{"type": "mesh", "mesh": "m"}}]"#
        )),
        "vol" => json(
            r#""grids": {"g": {"file": "named.vol"}},
               "media": {"m": {"type": "heterogeneous", "albedo": 0.8, "extinction": {"grid": "g"}}},
               "materials": {"bounds": {"type": "black", "opacity": 0}},
               "objects": [{"type": "cube", "material": "bounds", "media": {"interior": "m"}}]"#,
        ),
        "nvdb" => {
            let medium = r#""m" "string type" "nanovdb" "string filename" "named.nvdb""#;
            let text = format!(
                "Camera \"perspective\" WorldBegin MakeNamedMedium {medium} MediumInterface \"m\" \"\" \
                 Material \"interface\" Shape \"sphere\""
            );
            ("pbrt", text)
        }
        "bsdf" => json(
            r#""materials": {"m": {"type": "measured", "measurements": {"file": "named.bsdf"}}},
               "objects": [{"type": "sphere", "material": "m"}]"#,
        ),
        "spd" => {
            let spectrum = r#"<spectrum name="reflectance" filename="named.spd"/>"#;
            let bsdf = format!(r#"<bsdf type="diffuse">{spectrum}</bsdf>"#);
            let shape = format!(r#"<shape type="cube">{bsdf}</shape>"#);
            ("xml", format!(r#"<scene version="3.0.0">{shape}</scene>"#))
        }
        "txt" => {
            let curves = ["linearcurve", "bsplinecurve"].map(|kind| {
                let file = r#"<string name="filename" value="named.txt"/>"#;
                format!(r#"<shape type="{kind}">{file}<bsdf type="hair"/></shape>"#)
            });
            ("xml", format!(r#"<scene version="3.0.0">{}</scene>"#, curves.concat()))
        }
        _ => panic!("no scene names a file with the ending {ending}"),
    }
}

/// Reads the bytes as an image with this extension, once as light and once as stored values.
pub fn image(bytes: &[u8], ending: &str) {
    static SILENT: Once = Once::new();
    // The decoder of Basis Universal panics on damaged files, and its reader converts that to
    // errors. All other panics end the process, by the hook of the fuzzer.
    if matches!(ending, "basis" | "ktx2") {
        SILENT.call_once(|| {
            let usual = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |info| {
                if !info.location().is_some_and(|at| at.file().contains("/basisu-")) {
                    usual(info);
                }
            }));
        });
    }
    let path = Path::new("image").with_extension(ending);
    for numbers in [PixelEncoding::Light(Transfer::Srgb), PixelEncoding::Stored] {
        match pt_image::decode_in(bytes, &path, numbers, &ImageMemory::new(&little)) {
            Ok(decoded) => {
                let image = decoded.image;
                assert_eq!(
                    image.pixels.len() as u64,
                    u64::from(image.width) * u64::from(image.height)
                );
            }
            Err(error) => has_text(&error.to_string()),
        }
    }
}

/// Grants memory only for images that are decoded quickly.
fn little(bytes: u64) -> Result<pt_memory::Grant, String> {
    const MAX_BYTES: u64 = 64 << 20;
    if bytes > MAX_BYTES { Err("too large".to_owned()) } else { pt_memory::ask(bytes) }
}

/// Reads the bytes as a photometric file.
pub fn photometric(bytes: &[u8]) {
    match ies::parse(bytes, Path::new("lamp.ies")) {
        Ok(profile) => assert!(profile.mean_candela().is_finite()),
        Err(error) => has_text(&error.to_string()),
    }
}

/// Reads the bytes as camera settings.
pub fn camera(bytes: &[u8]) {
    if let Err(error) = camera_file::parse(&String::from_utf8_lossy(bytes), Path::new("camera.txt"))
    {
        has_text(&error.to_string());
    }
}

/// Reads the bytes as a film; and then a valid film in which they replace the bytes at the position
/// given by the first two.
pub fn film(bytes: &[u8]) {
    read_film(bytes);
    let Some((place, new)) = bytes.split_first_chunk() else { return };
    let mut film = small_film();
    let at = usize::from(u16::from_le_bytes(*place)) % film.len();
    let end = (at + new.len()).min(film.len());
    film.splice(at..end, new.iter().copied());
    read_film(&film);
}

/// Bytes of a film of six pixels with all optional contents.
fn small_film() -> Vec<u8> {
    let aovs = Aov::NAMES.map(|(_, aov)| aov);
    let film = Film::with_aovs(Region { x: 0, y: 0, width: 3, height: 2 }, &aovs);
    bytes_of(&film.with_light_groups(&["lamp".to_owned()]))
}

/// Reads a film; an accepted film must be unchanged by writing and reading.
fn read_film(bytes: &[u8]) {
    match Film::read(bytes) {
        Ok(film) => {
            let written = bytes_of(&film);
            let again = Film::read(&written).expect("what was accepted is accepted again");
            assert!(bytes_of(&again) == written, "what was read is not what was written");
        }
        Err(error) => has_text(&error.to_string()),
    }
}

fn bytes_of(film: &Film) -> Vec<u8> {
    let mut bytes = Vec::new();
    film.write(&mut bytes).expect("memory takes all");
    bytes
}

/// Reads and compiles a scene.
fn read(bytes: &[u8], path: &Path) {
    match pt_formats::parse_with(bytes, path, &options()) {
        Ok(scene) => {
            for note in scene.warnings.iter().chain(&scene.missing) {
                has_text(&note.to_string());
            }
            if is_small(&scene) {
                compile_small(&scene);
            }
        }
        Err(error @ LoadError::Io { .. }) => panic!("nothing is to be read: {error}"),
        Err(error) => has_text(&error.to_string()),
    }
}

fn compile_small(scene: &Scene) {
    // Studio lighting is the same for all scenes, and takes longer than everything else.
    let studio = !scene.lights.is_empty();
    let options = CompileOptions { resolution: Some([8, 6]), studio, ..CompileOptions::default() };
    if let Err(error) = compile(scene, options) {
        has_text(&error.to_string());
    }
}

/// Returns true if the scene compiles quickly.
fn is_small(scene: &Scene) -> bool {
    let shapes = |geometry: &Geometry| match geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len(),
        Geometry::Points { points, .. } => points.positions.len() + points.triangles(),
        Geometry::Sphere { .. } => 1,
    };
    let all: usize = scene.objects.iter().map(|object| shapes(&object.geometry)).sum();
    scene.objects.len() <= MAX_OBJECTS && all <= MAX_SHAPES
}

fn options() -> LoadOptions {
    let limits = Limits {
        memory: Some(256 << 20),
        shapes: Some(10_000),
        elements: Some(100_000),
        texture_side: Some(4096),
        texture_pixels: Some(1 << 22),
        include_depth: Some(4),
        files: Some(16),
        seconds: Some(5),
        ..Limits::default()
    };
    LoadOptions { limits, ..LoadOptions::default() }
}

fn folder(cell: &OnceLock<TempDir>) -> PathBuf {
    cell.get_or_init(|| tempfile::tempdir().expect("a folder")).path().to_owned()
}

fn has_text(message: &str) {
    assert!(!message.is_empty(), "an error without a text");
}
