//! Files that scenes may read, and their amount.

use std::path::Path;

use pt_formats::{Limits, LoadError, LoadOptions, load_with, parse_with, read_with};
use pt_image::{SaveOptions, save};
use pt_scene::image::Image;
use pt_scene::material::Diffuse;
use pt_scene::texture::Pattern;
use pt_scene::{Color, Hint, Scene, Surface};

/// Returns a scene of each format with this image, which may be in the same folder.
fn scenes(picture: &str) -> [(&'static str, String); 4] {
    let gltf = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "material": 0}}]}}],
        "materials": [{{"pbrMetallicRoughness":
            {{"baseColorFactor": [0, 1, 0, 1], "baseColorTexture": {{"index": 0}}}}}}],
        "textures": [{{"source": 0}}], "images": [{{"uri": "{picture}"}}],
        "accessors": [{{"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}], "buffers": [{{"byteLength": 36, "uri":
        "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}]}}"#
    );
    let mitsuba = format!(
        "<scene version=\"3.0.0\"><shape type=\"cube\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" \
         name=\"reflectance\"><string name=\"filename\" value=\"{picture}\"/></texture></bsdf></shape></scene>"
    );
    let pbrt = format!(
        "Camera \"perspective\" WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \
         \"{picture}\" Texture \"u\" \"spectrum\" \"scale\" \"texture tex\" \"t\" \"float scale\" 0.1 Material \
         \"diffuse\" \"texture reflectance\" \"u\" Shape \"sphere\""
    );
    let collada = include_str!("../../../tests/formats/collada/good/textured.dae");
    [("gltf", gltf), ("xml", mitsuba), ("pbrt", pbrt), ("dae", collada.replace("PICTURE", picture))]
}

fn picture(path: &Path) {
    let image = Image { width: 4, height: 2, pixels: vec![[0.5; 3]; 8].into() };
    save(&image, path, &SaveOptions::default()).expect("a writable folder");
}

/// Returns true if the only material is the placeholder of squares in magenta and black.
fn is_loud(scene: &Scene) -> bool {
    let Surface::Diffuse(Diffuse { reflectance: Color::Texture(texture), .. }) =
        &scene.materials[0].surface
    else {
        return false;
    };
    texture.pattern == Pattern::Checkerboard([[1.0, 0.0, 1.0], [0.0; 3]])
}

#[test]
fn missing_pictures_are_loud_in_all_formats_and_errors_if_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    for (ending, text) in scenes("lost.png") {
        let path = folder.path().join("scene").with_extension(ending);
        let load = |strict| {
            let options = LoadOptions { strict, ..LoadOptions::default() };
            parse_with(text.as_bytes(), &path, &options)
        };
        let scene = load(false).unwrap_or_else(|error| panic!("{error}"));
        assert!(is_loud(&scene), "{ending}: {:?}", scene.materials);
        let [missing] = scene.missing.as_slice() else { panic!("{:?}", scene.missing) };
        let message = missing.to_string();
        assert!(message.contains("lost.png"), "{message}");
        assert!(message.contains("a magenta and black checkerboard is shown instead"), "{message}");
        assert_eq!(load(true).expect_err("it is missing").to_string(), message);
    }
    picture(&folder.path().join("lost.png"));
    for (ending, text) in scenes("lost.png") {
        let path = folder.path().join("scene").with_extension(ending);
        let scene = parse_with(text.as_bytes(), &path, &LoadOptions::default()).expect("a scene");
        assert!(!is_loud(&scene) && scene.missing.is_empty(), "{ending}: {:?}", scene.missing);
    }
}

/// Paths with `..`, absolute paths, and symbolic links.
#[test]
fn paths_leave_the_folder_of_the_scene_only_if_that_is_allowed() {
    let folder = tempfile::tempdir().expect("a folder");
    let inside = folder.path().join("inside");
    std::fs::create_dir_all(inside.join("parts")).expect("a writable folder");
    let secret = folder.path().join("secret.png");
    picture(&secret);
    picture(&inside.join("open.png"));
    let mut outside = vec!["../secret.png".to_owned(), secret.display().to_string()];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&secret, inside.join("link.png")).expect("a link");
        outside.push("link.png".to_owned());
    }
    let load = |ending: &str, text: &str, allow_outside| {
        let options = LoadOptions { allow_outside, ..LoadOptions::default() };
        let path = inside.join("scene").with_extension(ending);
        parse_with(text.as_bytes(), &path, &options).unwrap_or_else(|error| panic!("{error}"))
    };
    let real = folder.path().canonicalize().expect("it is there").join("secret.png");
    for name in &outside {
        for (ending, text) in scenes(name) {
            let scene = load(ending, &text, false);
            let [missing] = scene.missing.as_slice() else { panic!("{:?}", scene.missing) };
            let message = &missing.message;
            assert!(is_loud(&scene), "{ending}");
            assert!(message.contains(&format!("leads to {}", real.display())), "{message}");
            assert!(message.contains("outside of the scene folder"), "{message}");
            let path = inside.join("scene").with_extension(ending);
            std::fs::write(&path, &text).expect("a writable folder");
            let reading = read_with(&path, &LoadOptions::default());
            let allowed = real.parent().expect("a folder").to_owned();
            assert_eq!(reading.hints, [Hint::AllowFolder(allowed)], "{ending}");
            assert!(load(ending, &text, true).missing.is_empty(), "{ending} {name}");
        }
    }
    for name in ["open.png", "parts/../open.png", "./open.png"] {
        for (ending, text) in scenes(name) {
            assert!(load(ending, &text, false).missing.is_empty(), "{ending} {name}");
        }
    }
}

#[test]
fn folders_of_mitsuba_scenes_are_inside_as_well() {
    let folder = tempfile::tempdir().expect("a folder");
    let inside = folder.path().join("inside");
    std::fs::create_dir_all(&inside).expect("a writable folder");
    let text = "<scene version=\"3.0.0\"><path value=\"..\"/><shape type=\"ply\"><string name=\"filename\" \
                value=\"a.ply\"/></shape></scene>";
    let path = inside.join("scene.xml");
    let error = parse_with(text.as_bytes(), &path, &LoadOptions::default()).expect_err("outside");
    let message = error.to_string();
    assert!(message.contains("outside of the scene folder"), "{message}");
    assert_eq!(error.each().len(), 1, "what is not found there is no other error: {message}");
    let options = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    assert!(parse_with(text.as_bytes(), &path, &options).is_ok());
}

/// Returns the error with a limit.
fn errors(path: &Path, name: &str, value: u64) -> Option<LoadError> {
    let mut limits = Limits::default();
    limits.set(name, value).expect("a name");
    let options = LoadOptions { limits, strict: true, ..LoadOptions::default() };
    load_with(path, &options).err()
}

#[test]
fn limits_hold_where_they_are_exceeded_and_nowhere_else() {
    let folder = tempfile::tempdir().expect("a folder");
    picture(&folder.path().join("wide.png"));
    for (ending, text) in scenes("wide.png") {
        let path = folder.path().join("scene").with_extension(ending);
        std::fs::write(&path, &text).expect("a writable folder");
        let bytes = text.len() as u64;
        for (name, too_low, enough) in [
            ("texture-side", 3, 4),
            ("texture-pixels", 7, 8),
            ("memory", bytes, bytes + 20_000_000),
            ("shapes", 0, 10),
            ("seconds", 0, 1000),
        ] {
            // A single shape of a Mitsuba scene does not count as an instance.
            if (ending, name) != ("xml", "shapes") {
                let error = errors(&path, name, too_low);
                assert!(error.is_some(), "{ending}: {name}={too_low} is enough");
            }
            let error = errors(&path, name, enough);
            assert!(error.is_none(), "{ending}: {name}={enough} is too low: {error:?}");
        }
    }
    let path = folder.path().join("scene.xml");
    for (name, too_low, enough) in [("depth", 1, 4), ("elements", 3, 20)] {
        assert!(errors(&path, name, too_low).is_some(), "{name}={too_low} is enough");
        assert!(errors(&path, name, enough).is_none(), "{name}={enough} is too low");
    }
    let path = folder.path().join("scene.pbrt");
    let text = "Camera \"perspective\" WorldBegin Include \"a.inc\" Include \"a.inc\"";
    std::fs::write(&path, text).expect("a writable folder");
    std::fs::write(folder.path().join("a.inc"), "Include \"b.inc\"").expect("a writable folder");
    std::fs::write(folder.path().join("b.inc"), "").expect("a writable folder");
    for (name, too_low, enough) in [("include-depth", 1, 2), ("files", 3, 4)] {
        assert!(errors(&path, name, too_low).is_some(), "{name}={too_low} is enough");
        assert!(errors(&path, name, enough).is_none(), "{name}={enough} is too low");
    }
}

#[test]
fn the_files_that_were_read_are_reported_in_their_order() {
    let folder = tempfile::tempdir().expect("a folder");
    picture(&folder.path().join("a.png"));
    for (ending, text) in scenes("a.png") {
        let path = folder.path().join("scene").with_extension(ending);
        std::fs::write(&path, &text).expect("a writable folder");
        let sources = read_with(&path, &LoadOptions::default()).sources;
        let paths: Vec<_> = sources.iter().map(|source| &source.path).collect();
        assert_eq!(paths, [&path, &folder.path().join("a.png")]);
        assert_eq!(sources[0].hash, blake3::hash(text.as_bytes()).to_hex().as_str());
    }
}

#[test]
fn a_list_of_errors_ends() {
    let count = LoadError::MAX_SHOWN + 37;
    let shapes = "<shape type=\"cone\"/>\n".repeat(count);
    let text = format!("<scene version=\"3.0.0\">\n{shapes}</scene>");
    let error = parse_with(text.as_bytes(), Path::new("a.xml"), &LoadOptions::default())
        .expect_err("there are no cones");
    assert_eq!(error.each().len(), count);
    let message = error.to_string();
    assert_eq!(message.lines().count(), LoadError::MAX_SHOWN + 1);
    assert!(message.ends_with("… and 37 more"), "{message}");
    let endless = "<shape type=\"cone\"/>\n".repeat(3000);
    let text = format!("<scene version=\"3.0.0\">\n{endless}</scene>");
    let error = parse_with(text.as_bytes(), Path::new("a.xml"), &LoadOptions::default())
        .expect_err("there are no cones");
    assert_eq!(error.each().len(), 1001, "and that there are too many");
}
