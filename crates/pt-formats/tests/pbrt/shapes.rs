//! Shapes, transforms and instances.

use pt_math::DVec3;
use pt_scene::{Geometry, Mesh, Object};

use super::read;

fn mesh_of(object: &Object) -> &Mesh {
    let Geometry::Mesh(mesh) = &object.geometry else { panic!("{} is no mesh", object.name) };
    mesh
}

/// Returns the normal of the first triangle of a mesh, by the order of its vertices.
fn front(mesh: &Mesh) -> DVec3 {
    let [a, b, c] =
        mesh.triangles[0].map(|i| DVec3::from_array(mesh.positions[i as usize].map(f64::from)));
    (b - a).cross(c - a).normalize()
}

#[test]
fn later_steps_act_before_earlier_ones() {
    let scene = read("", "Translate 1 0 0 Rotate 90 0 0 1 Scale 2 2 2 Shape \"sphere\"");
    let map = scene.objects[0].to_world;
    assert!(map.transform_point3(DVec3::X).distance(DVec3::new(1.0, 2.0, 0.0)) < 1e-12);
}

#[test]
fn attributes_end_where_they_are_closed() {
    let scene = read(
        "",
        "AttributeBegin Translate 1 0 0 Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" AttributeEnd \
         Shape \"sphere\" TransformBegin Translate 0 1 0 ReverseOrientation TransformEnd Shape \"disk\"",
    );
    let radius = |i: usize| match scene.objects[i].geometry {
        Geometry::Sphere { radius } => radius,
        _ => panic!("a mesh"),
    };
    assert_eq!((radius(0), radius(1)), (3.0, 1.0));
    assert_eq!(scene.objects[1].to_world.translation, DVec3::ZERO);
    // TransformEnd restores only the transform.
    assert_eq!(scene.objects[2].to_world.translation, DVec3::ZERO);
    assert_eq!(front(mesh_of(&scene.objects[2])), DVec3::NEG_Z);
}

#[test]
fn the_front_of_a_triangle_is_where_its_normals_look() {
    let points = "\"point3 P\" [0 0 0 1 0 0 0 1 0]";
    let scene = read(
        "",
        &format!(
            "Shape \"trianglemesh\" {points} Shape \"trianglemesh\" {points} \"normal N\" [0 0 -1 0 0 -1 0 0 -1] \
             ReverseOrientation Shape \"trianglemesh\" {points} \
             Shape \"trianglemesh\" {points} \"normal N\" [0 0 -1 0 0 -1 0 0 -1]"
        ),
    );
    let fronts: Vec<_> = scene.objects.iter().map(|o| front(mesh_of(o)).z).collect();
    assert_eq!(fronts, [1.0, -1.0, -1.0, 1.0]);
}

#[test]
fn mirrored_round_shapes_are_inside_out_unless_they_shine() {
    let scene = read(
        "",
        "Scale -1 1 1 Shape \"disk\" AreaLightSource \"diffuse\" Shape \"disk\" ReverseOrientation Shape \"disk\"",
    );
    let fronts: Vec<_> = scene.objects.iter().map(|o| front(mesh_of(o)).z).collect();
    assert_eq!(fronts, [-1.0, 1.0, -1.0]);
}

#[test]
fn instances_are_placed_on_top_of_their_objects_transform() {
    let scene = read(
        "",
        "Translate 0 1 0 ObjectBegin \"a\" Translate 0 0 1 Shape \"sphere\" ObjectEnd \
         Identity Translate 5 0 0 ObjectInstance \"a\" Scale 2 2 2 ObjectInstance \"a\"",
    );
    let places: Vec<_> = scene.objects.iter().map(|o| o.to_world.translation).collect();
    assert_eq!(places, [DVec3::new(5.0, 1.0, 1.0), DVec3::new(5.0, 2.0, 2.0)]);
}

#[test]
fn what_has_two_transforms_moves() {
    let scene =
        read("TransformTimes 1 3", "ActiveTransform EndTime Translate 2 0 0 Shape \"sphere\"");
    let motion = scene.objects[0].motion.as_ref().expect("it moves");
    assert_eq!(motion.at(2.0).translation, DVec3::X);
    assert_eq!(scene.cameras[0].shutter, [0.0, 1.0]);
    assert_eq!(read("", "Shape \"sphere\"").cameras[0].shutter, [0.0; 2]);
}

#[test]
fn meshes_without_coordinates_get_those_of_pbrt_where_a_texture_asks() {
    let mesh = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]";
    let scene = read(
        "",
        &format!(
            "{mesh} Texture \"t\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"t\" {mesh} \
             Shape \"sphere\""
        ),
    );
    assert_eq!(mesh_of(&scene.objects[0]).uvs, None);
    let uvs = mesh_of(&scene.objects[1]).uvs.as_ref().expect("coordinates");
    assert_eq!(
        uvs.corners(0, [0, 1, 2]).map(|i| uvs.values[i as usize]),
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
    );
    // v increases upwards on a sphere.
    let ball = mesh_of(&scene.objects[2]);
    let top = ball.positions.iter().position(|p| p[2] == 1.0).expect("a pole");
    assert_eq!(ball.uvs.as_ref().expect("coordinates").values[top][1], 1.0);
}

/// v is 0 at −z for analytic spheres as well: +z of our sphere, where its v is 0, is mapped there.
/// x and y are unchanged.
#[test]
fn v_grows_upwards_on_spheres_without_textures() {
    for (text, scale) in [("", 1.0), ("Scale 2 2 2 ", 2.0), ("Scale -1 1 1 ", 1.0)] {
        let scene = read("", &format!("{text}AreaLightSource \"diffuse\" Shape \"sphere\""));
        let to_world = scene.objects[0].to_world;
        assert!(matches!(scene.objects[0].geometry, Geometry::Sphere { .. }), "{text}");
        assert_eq!(to_world.transform_vector3(DVec3::Z), DVec3::NEG_Z * scale);
        let x = if text.contains('-') { -1.0 } else { scale };
        assert_eq!(to_world.transform_vector3(DVec3::X), DVec3::X * x);
        assert_eq!(to_world.transform_vector3(DVec3::Y), DVec3::Y * scale);
    }
}

#[test]
fn a_light_of_two_sides_is_two_sheets() {
    let scene = read(
        "",
        "AreaLightSource \"diffuse\" \"bool twosided\" true Shape \"bilinearmesh\" \
         \"point3 P\" [-1 -1 0 1 -1 0 -1 1 0 1 1 0] Shape \"sphere\"",
    );
    assert_eq!(scene.objects.len(), 3);
    let [back, face] = [0, 1].map(|i| mesh_of(&scene.objects[i]));
    assert_eq!((front(back), front(face)), (DVec3::NEG_Z, DVec3::Z));
    let behind = back.positions[0][2];
    assert!((-2e-5..-5e-6).contains(&behind), "{behind}");
}

#[test]
fn a_flat_patch_is_two_triangles_and_a_bent_one_is_many() {
    let patch = |z: u32| format!("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 {z}]");
    let scene = read("", &(patch(0) + &patch(1)));
    let count = |i: usize| mesh_of(&scene.objects[i]).triangles.len();
    assert_eq!((count(0), count(1)), (2, 512));
    assert_eq!(front(mesh_of(&scene.objects[0])), DVec3::Z);
}

/// A tube around a straight line: its vertices are at half its width from the line, and it faces
/// outwards.
#[test]
fn a_curve_is_a_tube_or_a_ribbon() {
    let line = "Shape \"curve\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3] \"float width0\" .4 \"float width1\" .1";
    let ribbon = "\"string type\" \"ribbon\" \"normal N\" [1 0 0 0 1 0]";
    let scene = read("", &format!("{line} Material \"diffuse\" {line} {ribbon}"));
    let tube = mesh_of(&scene.objects[0]);
    // The outline of twelve sides is as wide on average as the curve.
    let half_a_side = std::f32::consts::PI / 12.0;
    for [x, y, z] in &tube.positions {
        let expected = 0.5 * (0.4 - 0.1 * z) * half_a_side / half_a_side.sin();
        assert!((x.hypot(*y) - expected).abs() < 1e-6, "{x} {y} {z}");
    }
    for corners in &tube.triangles {
        let [a, b, c] =
            corners.map(|i| DVec3::from_array(tube.positions[i as usize].map(f64::from)));
        let middle = (a + b + c) / 3.0;
        assert!((b - a).cross(c - a).dot(DVec3::new(middle.x, middle.y, 0.0)) > 0.0);
    }
    let ribbon = mesh_of(&scene.objects[1]);
    assert_eq!(ribbon.triangles.len(), 4);
    assert!(front(ribbon).dot(DVec3::X) > 0.7 && front(ribbon).y > 0.0);
    let last = ribbon.normals.as_ref().expect("normals").values.last().expect("a normal");
    assert!((last[1] - 1.0).abs() < 1e-6);
}

/// Consecutive curves are one shape, unless they differ in some attribute.
#[test]
fn curves_in_a_row_are_joined() {
    let curve = |x: f64| format!("Shape \"curve\" \"point3 P\" [{x} 0 0 {x} 0 1 {x} 0 2 {x} 0 3] ");
    let count = |world: &str| {
        let scene = read("", world);
        let of = |object: &pt_scene::Object| match &object.geometry {
            Geometry::Mesh(mesh) => mesh.triangles.len(),
            _ => 0,
        };
        scene.objects.iter().map(of).collect::<Vec<_>>()
    };
    let [a, b, c] = [0.0, 2.0, 4.0].map(curve);
    assert_eq!(count(&format!("{a}{b}{c}")), [144]);
    assert_eq!(count(&format!("{a} Material \"conductor\" {b}{c}")), [48, 96]);
    assert_eq!(count(&format!("{a} Translate 1 0 0 {b}")), [48, 48]);
    assert_eq!(count(&format!("{a} Shape \"sphere\" {b}")), [48, 0, 48]);
    let of_object = format!(
        "ObjectBegin \"tuft\" {a}{b} ObjectEnd {c} ObjectInstance \"tuft\" ObjectInstance \"tuft\""
    );
    assert_eq!(count(&of_object), [48, 96, 96]);
}

/// The triangles of a prism are subdivided until their edges are short, and its sides are displaced
/// inwards where the image is bright.
#[test]
fn meshes_of_files_may_be_displaced() {
    let prism = |more: &str| {
        let texture = "Texture \"low\" \"float\" \"imagemap\" \"string filename\" \"parts/dots.png\" \"float scale\" -.01";
        let scene = read(
            "",
            &format!(
                "{texture} Shape \"plymesh\" \"string filename\" \"parts/prism.ply.gz\" {more}"
            ),
        );
        mesh_of(&scene.objects[0]).clone()
    };
    let (plain, raised) =
        (prism(""), prism("\"texture displacement\" \"low\" \"float edgelength\" .2"));
    assert!(raised.triangles.len() > 4 * plain.triangles.len(), "{}", raised.triangles.len());
    assert_eq!(
        prism("\"texture displacement\" \"low\" \"float edgelength\" 1000").triangles.len(),
        plain.triangles.len()
    );
}
