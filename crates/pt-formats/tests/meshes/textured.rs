//! PLY files with images on their faces.

use std::path::Path;

use pt_formats::load;
use pt_image::{SaveOptions, save};
use pt_scene::image::Image;
use pt_scene::texture::Pattern;
use pt_scene::{Color, Geometry, Scene, Surface};

/// Returns a file of a square of two triangles and a triangle beside it.
fn text(comments: &str, face: &str, faces: [&str; 2]) -> String {
    let [square, triangle] = faces;
    format!(
        "ply\nformat ascii 1.0\n{comments}element vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
         element face 2\nproperty list uchar int vertex_indices\n{face}end_header\n\
         0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n4 0 1 2 3 {square}\n3 1 4 2 {triangle}\n"
    )
}

fn read(folder: &Path, text: &str) -> Scene {
    let file = folder.join("a.ply");
    std::fs::write(&file, text).expect("it is written");
    load(&file).unwrap_or_else(|error| panic!("{error}"))
}

/// Creates a folder with the images `red.png` and `my green.png`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, color) in [("red.png", [1.0, 0.0, 0.0]), ("my green.png", [0.0, 1.0, 0.0])] {
        let image = Image { width: 1, height: 1, pixels: vec![color].into() };
        save(&image, &folder.path().join(name), &SaveOptions::default()).expect("it is written");
    }
    folder
}

/// Returns the colour of the image of each triangle, and its texture coordinates.
fn shown(scene: &Scene) -> Vec<([f32; 3], [[f32; 2]; 3])> {
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
    let uvs = mesh.uvs.as_ref().expect("coordinates");
    let of_triangle = |i: usize| {
        let part =
            mesh.submeshes.iter().find(|p| p.triangles.contains(&(i as u32))).expect("a part");
        let material = scene.objects[0].materials[part.slot as usize].expect("a material");
        let Surface::Diffuse(matte) = &scene.materials[material as usize].surface else {
            panic!("not matte")
        };
        let Color::Texture(texture) = &matte.reflectance else { panic!("no texture") };
        let Pattern::Bitmap(bitmap) = &texture.pattern else { panic!("no image") };
        (bitmap.image.pixels[0], uvs.corners(i, mesh.triangles[i]).map(|c| uvs.values[c as usize]))
    };
    (0..mesh.triangles.len()).map(of_triangle).collect()
}

/// Two numbers per corner, in the order of the corners; each triangle of a polygon has those of its
/// own corners.
#[test]
fn faces_show_their_images_by_coordinates_of_their_own() {
    let folder = folder();
    let comments =
        "comment made by hand\ncomment TextureFile red.png\ncomment texturefile my green.png\n";
    let face = "property list uchar float texcoord\nproperty int texnumber\n";
    let faces = ["8 0 0 .5 0 .5 .5 0 .5 1", "6 .1 .2 .3 .4 .5 .6 0"];
    let scene = read(folder.path(), &text(comments, face, faces));
    let shown = shown(&scene);
    assert_eq!(shown.len(), 3);
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
    for (i, (color, uvs)) in shown[..2].iter().enumerate() {
        assert_eq!(*color, [0.0, 1.0, 0.0]);
        for (corner, uv) in mesh.triangles[i].into_iter().zip(uvs) {
            let [x, y, _] = mesh.positions[corner as usize];
            assert_eq!(*uv, [0.5 * x, 0.5 * y]);
        }
    }
    assert_eq!(shown[2], ([1.0, 0.0, 0.0], [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]));
    assert!(scene.warnings.is_empty() && scene.missing.is_empty());
}

#[test]
fn one_image_lies_on_all_faces_and_missing_ones_are_reported() {
    let folder = folder();
    let face = "property list uchar float texcoord\n";
    let faces = ["8 0 0 1 0 1 1 0 1", "6 0 0 1 0 1 1"];
    let one = |name: &str| text(&format!("comment TextureFile {name}\n"), face, faces);
    let scene = read(folder.path(), &one("C:\\scans\\red.png"));
    assert!(shown(&scene).iter().all(|(color, _)| *color == [1.0, 0.0, 0.0]));
    let scene = read(folder.path(), &one("blue.png"));
    assert!(scene.missing[0].to_string().contains("the image is not shown"), "{:?}", scene.missing);
    let scene = read(folder.path(), &text("comment TextureFile red.png\n", "", ["", ""]));
    assert!(
        scene.warnings[0].to_string().contains("missing texture coordinates"),
        "{:?}",
        scene.warnings
    );
    let file = folder.path().join("a.ply");
    std::fs::write(&file, text("", face, ["6 0 0 1 0 1 1", "6 0 0 1 0 1 1"]))
        .expect("it is written");
    let error = load(&file).expect_err("too few").to_string();
    assert!(
        error.contains("face 0: found 6 numbers in \"texcoord\", expected two for each corner, 8"),
        "{error}"
    );
}
