//! Textures: the colours of meshes, and products.

use std::collections::BTreeMap;
use std::sync::Arc;

use pathtracer::{CompileOptions, Film, Scene, Session};
use pt_math::{Affine2, DAffine3, DMat3, DVec3, Vec2};
use pt_scene::image::Image;
use pt_scene::material::Diffuse;
use pt_scene::texture::{Bitmap, Color, Filter, Pattern, Texture, Wrap};
use pt_scene::{Attribute, Attributes, Mesh, Surface, shapes};

use crate::measure::{assert_uniform, render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

const FAR: DVec3 = DVec3::new(0.0, 0.0, 4.0);

fn textured(texture: Arc<Texture>) -> Surface {
    Diffuse { reflectance: Color::Texture(texture), two_sided: true }.into()
}

fn showing(pattern: Pattern) -> Surface {
    textured(Arc::new(pattern.into()))
}

/// A mesh in front of the camera under an environment of radiance 1.
fn seen(mesh: Mesh, surface: Surface, to_world: DAffine3) -> Scene {
    Builder::default().mesh(mesh, to_world, surface).sky(1.0).seen_by(camera(
        FAR,
        DVec3::ZERO,
        [20.0, 16.0],
    ))
}

fn film(scene: &Scene, spp: u32) -> Film {
    render(scene, size([10, 8]), settings(spp)).film().clone()
}

/// A colour that grows linearly over the square [−1, 1]².
fn linear(p: [f32; 3]) -> [f32; 3] {
    [0.5 + 0.25 * p[0], 0.4 - 0.1 * p[1], 0.3 + 0.2 * p[0] + 0.05 * p[1]]
}

/// A square with the colours of [`linear`]; with `own_corners`, its triangles share no vertices.
fn coloured_square(own_corners: bool) -> Mesh {
    let mut mesh = shapes::rectangle();
    let values = mesh.positions.iter().map(|&p| linear(p)).collect();
    let indices = own_corners.then(|| mesh.triangles.clone());
    mesh.colors = Some(Attribute { values, indices });
    mesh
}

/// The same colours as an image of 2 × 2 texels whose centres are the corners.
fn as_image() -> Arc<Texture> {
    let corner = |x: f32, y: f32| linear([x, y, 0.0]);
    let pixels = vec![corner(-1.0, 1.0), corner(1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
    let image = Arc::new(Image { width: 2, height: 2, pixels: pixels.into() });
    let bitmap = Bitmap { image, wrap: Wrap::CLAMP, filter: Filter::Bilinear };
    let to_middles =
        Affine2::from_scale_angle_translation(Vec2::splat(0.5), 0.0, Vec2::splat(0.25));
    let to_pattern = pt_math::Mat3::from(to_middles).as_dmat3();
    Arc::new(Texture::on_surface(Pattern::Bitmap(bitmap), to_pattern))
}

/// Asserts that films rendered with the same random numbers differ only by rounding.
fn assert_alike(a: &Film, b: &Film, what: &str) {
    for (i, (a, b)) in a.pixels().zip(b.pixels()).enumerate() {
        let (a, b) = (a.mean(), b.mean());
        let near = a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5 * b.abs().max(1.0));
        assert!(near, "{what}, pixel {i}: {a:?} {b:?}");
    }
}

/// Vertex colours equal an image that is linear over the surface; also with a mirrored mesh, after
/// another mesh without colours, and if triangles share no vertices.
#[test]
fn colours_of_vertices_are_linear_over_triangles() {
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    for to_world in [DAffine3::IDENTITY, mirror] {
        let image = film(&seen(shapes::rectangle(), textured(as_image()), to_world), 4);
        for own_corners in [false, true] {
            let shown = showing(Pattern::VertexColors);
            let scene = seen(coloured_square(own_corners), shown, to_world);
            assert_alike(&film(&scene, 4), &image, "by vertices");
        }
    }
    let behind = facing(DVec3::Z * 9.0, DVec3::Z, 0.1);
    let with_other = |surface, mesh| {
        let scene = Builder::default().quad(behind, matte([0.5; 3])).mesh(
            mesh,
            DAffine3::IDENTITY,
            surface,
        );
        scene.sky(1.0).seen_by(camera(FAR, DVec3::ZERO, [20.0, 16.0]))
    };
    let image = with_other(textured(as_image()), shapes::rectangle());
    let colors = with_other(showing(Pattern::VertexColors), coloured_square(false));
    assert_alike(&film(&colors, 4), &film(&image, 4), "behind another mesh");
}

/// A surface of one colour per triangle is one of two materials.
#[test]
fn colours_of_faces_are_those_of_their_triangles() {
    let two = [[0.2, 0.4, 0.6], [0.7, 0.1, 0.3]];
    let mesh = Mesh { face_colors: Some(two.to_vec().into()), ..shapes::rectangle() };
    let shown = seen(mesh, showing(Pattern::FaceColors), DAffine3::IDENTITY);
    let half = |i: usize| {
        let mut mesh = shapes::rectangle();
        mesh.triangles = vec![mesh.triangles[i]].into();
        mesh.submeshes = Vec::new();
        mesh
    };
    let halves = Builder::default()
        .mesh(half(0), DAffine3::IDENTITY, matte(two[0]))
        .mesh(half(1), DAffine3::IDENTITY, matte(two[1]))
        .sky(1.0)
        .seen_by(camera(FAR, DVec3::ZERO, [20.0, 16.0]));
    assert!(film(&shown, 16) == film(&halves, 16));
}

/// A product of textures and numbers is the texture of the products, to the bit; in a product of
/// textures with different mappings, each keeps its own.
#[test]
fn products_multiply_what_their_factors_show() {
    let chess = |scale: f64, colors| {
        let to_pattern = DMat3::from_diagonal(DVec3::new(scale, scale, 1.0));
        Color::Texture(Arc::new(Texture::on_surface(Pattern::Checkerboard(colors), to_pattern)))
    };
    let (light, dark) = ([0.5, 0.75, 1.0], [0.25, 0.5, 0.125]);
    let half = light.map(|c| 0.5 * c);
    let product = |a, b| showing(Pattern::Product(Box::new([a, b])));
    let of = |surface| film(&seen(shapes::rectangle(), surface, DAffine3::IDENTITY), 8);
    let Color::Texture(want) = chess(3.0, [half, dark.map(|c| 0.5 * c)]) else { unreachable!() };
    let scaled = product(chess(3.0, [light, dark]), [0.5; 3].into());
    assert!(of(scaled) == of(textured(want)));
    // A factor of constant 1 with another mapping has no effect.
    let ones = [[1.0; 3]; 2];
    let nested = product(product_of(chess(1.0, [light, dark]), chess(7.0, ones)), [1.0; 3].into());
    let Color::Texture(plain) = chess(1.0, [light, dark]) else { unreachable!() };
    assert!(of(nested) == of(textured(plain)));
}

fn product_of(a: Color, b: Color) -> Color {
    Color::Texture(Arc::new(Pattern::Product(Box::new([a, b])).into()))
}

/// Named attributes have the same effect as colours of the same values, also beside others of the
/// mesh.
#[test]
fn values_by_names_are_seen_as_colours_are() {
    let colored = coloured_square(false);
    let values = colored.colors.clone().expect("colours").values;
    let faces = [[0.2, 0.4, 0.6], [0.7, 0.1, 0.3]];
    let vertices = BTreeMap::from([
        ("other".to_owned(), vec![[0.9; 3]; values.len()].into()),
        ("paint".to_owned(), values),
    ]);
    let attributes =
        Attributes { vertices, faces: [("paint".to_owned(), faces.to_vec().into())].into() };
    let named = Mesh { colors: None, attributes, ..colored.clone() };
    let plain = Mesh { face_colors: Some(faces.to_vec().into()), ..colored };
    let product = |vertices: Pattern, faces: Pattern| {
        let [a, b] = [vertices, faces].map(|pattern| Color::Texture(Arc::new(pattern.into())));
        let Color::Texture(both) = product_of(a, b) else { unreachable!() };
        textured(both)
    };
    let paint = || "paint".to_owned();
    let by_name = product(Pattern::VertexAttribute(paint()), Pattern::FaceAttribute(paint()));
    let by_color = product(Pattern::VertexColors, Pattern::FaceColors);
    let by_name = film(&seen(named, by_name, DAffine3::IDENTITY), 4);
    let by_color = film(&seen(plain, by_color, DAffine3::IDENTITY), 4);
    assert_alike(&by_name, &by_color, "by names");
    let pixel = by_name.pixels().next().expect("a pixel").mean();
    assert!(pixel.iter().all(|c| *c > 0.0), "{pixel:?}");
}

/// Attributes that a material uses must exist in the mesh.
#[test]
fn colours_that_are_missing_are_an_error() {
    let compiled = |scene: &Scene| {
        Session::new(scene, CompileOptions::default(), settings(1)).err().map(|e| e.to_string())
    };
    let square = shapes::rectangle;
    let few = Mesh { face_colors: Some(vec![[0.5; 3]].into()), ..square() };
    let wrong = Attribute { values: vec![[0.5; 3]; 3].into(), indices: None };
    let wrong = Mesh { colors: Some(wrong), ..square() };
    let nested =
        product_of(Color::Texture(Arc::new(Pattern::VertexColors.into())), [1.0; 3].into());
    let Color::Texture(nested) = nested else { unreachable!() };
    let cases = [
        (seen(square(), showing(Pattern::VertexColors), DAffine3::IDENTITY), "colours of vertices"),
        (seen(square(), showing(Pattern::FaceColors), DAffine3::IDENTITY), "colours of faces"),
        (
            seen(square(), showing(Pattern::VertexAttribute("a".into())), DAffine3::IDENTITY),
            "values \"a\" of vertices",
        ),
        (
            seen(square(), showing(Pattern::FaceAttribute("a".into())), DAffine3::IDENTITY),
            "values \"a\" of faces",
        ),
        (seen(square(), textured(nested), DAffine3::IDENTITY), "colours of vertices"),
        (
            seen(few, showing(Pattern::FaceColors), DAffine3::IDENTITY),
            "for 1 triangles, expected 2",
        ),
        (
            seen(wrong, showing(Pattern::VertexColors), DAffine3::IDENTITY),
            "colour index 3 out of range",
        ),
        (
            Builder::default().sphere(DVec3::ZERO, 1.0, showing(Pattern::VertexColors)).0,
            "mesh colours on a sphere",
        ),
    ];
    for (scene, want) in cases {
        let message = compiled(&scene).expect("it has no colours");
        assert!(message.contains(want), "{message}");
    }
}

/// A wall with one vertex colour has that albedo.
#[test]
fn a_mesh_of_one_colour_is_a_furnace_of_it() {
    let mut mesh = shapes::rectangle();
    mesh.colors = Some(Attribute { values: vec![[0.625; 3]; 4].into(), indices: None });
    let shown = showing(Pattern::VertexColors);
    assert_uniform(&film(&seen(mesh, shown, DAffine3::IDENTITY), 1024), 0.625, 1e-4, "one colour");
}
