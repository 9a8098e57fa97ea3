//! Node transforms and meshes.

use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::{Geometry, Mesh, Scene};

use crate::{good, good_text, read};

/// Returns a transform from the images of the axes and of the origin.
fn map(x: [f64; 3], y: [f64; 3], z: [f64; 3], origin: [f64; 3]) -> DAffine3 {
    DAffine3::from_cols(x.into(), y.into(), z.into(), origin.into())
}

/// Images of the axes and the origin under each kind of transform, derived by hand.
#[test]
fn transforms_are_what_they_say_and_apply_from_the_last_to_the_first() {
    let (x, y, z, o) = ([1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0., 0., 0.]);
    let expected = [
        ("none", map(x, y, z, o)),
        ("matrix", map([1., 5., 9.], [2., 6., 10.], [3., 7., 12.], [4., 8., 13.])),
        ("matrix over 2", map(x, y, z, [3., 4., 5.])),
        ("translate", map(x, y, z, [1., 2., 3.])),
        ("scale", map([2., 0., 0.], [0., 3., 0.], [0., 0., 4.], o)),
        ("rotate", map(y, [-1., 0., 0.], z, o)),
        ("rotate 120", map(y, z, x, o)),
        // −450° about y is −90°: x goes to z, z to −x.
        ("rotate back", map(z, y, [-1., 0., 0.], o)),
        // From (1, 2, 3) along +x: −z becomes x, so z becomes −x, and x becomes y × z = z.
        ("lookat", map(z, y, [-1., 0., 0.], [1., 2., 3.])),
        // y is rotated by 45° towards x, along x.
        ("skew", map(x, [1., 1., 0.], z, o)),
        // First scaled, then rotated, then translated.
        ("order", map([0., 2., 0.], [-1., 0., 0.], z, [10., 0., 0.])),
        ("late", map(x, y, z, [7., 0., 0.])),
        ("nested", map(y, [-1., 0., 0.], z, [10., 1., 0.])),
        ("nested", map(y, [-1., 0., 0.], z, [10., 1., 0.])),
        ("pair", map(x, y, z, [0., 4., 5.])),
        ("second of pair", map(x, y, z, [1., 4., 5.])),
        ("ball", map(x, y, z, o)),
    ];
    let scene = good("transforms.dae");
    let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, expected.map(|(name, _)| name));
    for (object, (name, to_world)) in scene.objects.iter().zip(expected) {
        assert!(object.to_world.abs_diff_eq(to_world, 1e-15), "{name}: {:?}", object.to_world);
    }
}

/// A skew makes the first axis parallel to its own rotation towards the second.
#[test]
fn skew_turns_its_first_axis() {
    let text = good_text("transforms.dae");
    for (degrees, a, b) in [
        (20.0, DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 0.2)),
        (-35.0, DVec3::new(0.3, 1.0, 0.0), DVec3::new(1.0, 0.2, 0.0)),
    ] {
        let skew =
            format!("<skew>{degrees} {} {} {} {} {} {}</skew>", a.x, a.y, a.z, b.x, b.y, b.z);
        let scene = read(&text.replace("<skew>45  0 1 0  1 0 0</skew>", &skew)).expect("good");
        let object = scene.objects.iter().find(|o| o.name == "skew").expect("the skewed object");
        let turned = object.to_world.transform_vector3(a);
        let found = turned.angle_between(a).to_degrees();
        assert!((found - f64::abs(degrees)).abs() < 1e-9, "{found}");
        assert_eq!(turned.dot(b) > a.dot(b), degrees > 0.0);
        let normal = a.cross(b);
        assert!(turned.dot(normal).abs() < 1e-12 * normal.length() * turned.length());
        assert!(object.to_world.transform_vector3(b).abs_diff_eq(b, 1e-15));
        assert!((object.to_world.matrix3.determinant() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn the_axis_that_is_up_becomes_y() {
    let text = good_text("up_axis.dae");
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (name, columns) in [
        ("X_UP", DMat3::from_cols(y, x, -z)),
        ("Y_UP", DMat3::IDENTITY),
        ("Z_UP", DMat3::from_cols(-x, z, y)),
    ] {
        let scene = read(&text.replace("Z_UP", name)).expect("a good file");
        let to_world = DAffine3 { matrix3: columns, translation: columns * DVec3::new(1., 2., 3.) };
        assert_eq!(scene.objects[0].to_world, to_world, "{name}");
        assert_eq!(scene.lights[0].to_world, to_world, "{name}");
        assert_eq!(scene.cameras[0].to_world, to_world, "{name}");
        assert_eq!(scene.objects[0].geometry, Geometry::Sphere { radius: 2.5 });
        assert_eq!(scene.metres_per_unit, 0.0254);
        assert!((columns.determinant() - 1.0).abs() < 1e-15, "{name} would mirror the scene");
    }
}

#[test]
fn skins_and_morphs_show_the_mesh_as_it_was_bound() {
    let scene = good("skin.dae");
    let object = &scene.objects[0];
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(2.0)),
        translation: DVec3::new(1.0, 0.0, 0.0),
    };
    assert_eq!((object.name.as_str(), object.to_world), ("hero", to_world));
    assert_eq!(object.materials, [Some(0)]);
}

#[test]
fn all_kinds_of_primitives_become_triangles() {
    let scene = good("primitives.dae");
    let mesh = mesh(&scene, "Kinds 1");
    let expected: &[&[[u32; 3]]] = &[
        &[[0, 1, 5], [1, 2, 5], [2, 3, 5]],
        &[[0, 1, 3], [3, 1, 2], [0, 1, 4], [4, 2, 3]],
        &[[4, 0, 1], [4, 1, 2], [4, 2, 3]],
        // The last polygon, 0 1 2 4, is concave at 4, so it is cut from 4 to 1.
        &[[0, 1, 2], [0, 1, 2], [0, 2, 3], [4, 0, 1], [4, 1, 2]],
    ];
    let start: Vec<_> = expected.iter().flat_map(|part| part.iter().copied()).collect();
    assert_eq!(mesh.triangles[..start.len()], start);
    let slots: Vec<_> = mesh.submeshes.iter().map(|p| (p.triangles.clone(), p.slot)).collect();
    assert_eq!(slots, [(0..3, 0), (3..7, 1), (7..10, 2), (10..15, 0), (15..19, 3)]);
    assert_eq!(mesh.name, "Kinds");
    assert_eq!((&mesh.normals, &mesh.uvs), (&None, &None));
}

#[test]
fn strips_fans_and_polygons_face_the_same_way() {
    let scene = good("primitives.dae");
    let mesh = mesh(&scene, "Kinds 1");
    for (i, triangle) in mesh.triangles.iter().enumerate().skip(3) {
        let [a, b, c] = triangle.map(|i| DVec3::from(mesh.positions[i as usize].map(f64::from)));
        assert!((b - a).cross(c - a).z > 0.0, "triangle {i} {triangle:?}");
    }
}

#[test]
fn materials_go_to_the_slots_of_their_symbols_and_meshes_are_shared() {
    let scene = good("primitives.dae");
    let names = |object: usize| {
        let materials = scene.objects[object].materials.iter();
        let name = |m: Option<u32>| m.map(|m| scene.materials[m as usize].name.as_str());
        materials.map(|m| name(*m)).collect::<Vec<_>>()
    };
    // The slots are a, b, c and none; c is not bound, and none takes the first binding.
    assert_eq!(names(0), [Some("Red"), Some("Blue"), None, Some("Blue")]);
    assert_eq!(names(1), [None; 4]);
    let [first, second] = ["Kinds 1", "Kinds 2"].map(|name| mesh(&scene, name));
    assert!(Arc::ptr_eq(first, second));
}

#[test]
fn inputs_may_share_offsets_and_accessors_may_skip_numbers() {
    let scene = good("primitives.dae");
    let mesh = mesh(&scene, "Inputs");
    assert_eq!(mesh.positions, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 1]]);
    let normals = mesh.normals.as_ref().expect("normals");
    // The second triangle has no normals; it gets that of its plane, which faces −z.
    assert_eq!(normals.values, [[0., 0., 1.], [0., 0., 2.], [0., 0., -1.]]);
    assert_eq!(normals.indices.as_deref(), Some(&[[1, 0, 1], [2, 2, 2]][..]));
    let uvs = mesh.uvs.as_ref().expect("texture coordinates");
    assert_eq!(uvs.values, [[0., 0.], [1., 0.], [0., 1.], [0., 0.]]);
    assert_eq!(uvs.indices.as_deref(), Some(&[[0, 1, 2], [3, 3, 3]][..]));
}

#[test]
fn normals_of_vertices_need_no_indices() {
    let scene = good("primitives.dae");
    let normals = mesh(&scene, "Smooth").normals.clone().expect("normals");
    assert_eq!(normals.values, [[0., 0., 1.], [0., 0., 1.], [0., 0., 0.]]);
    assert_eq!(normals.indices, None);
}

fn mesh<'s>(scene: &'s Scene, name: &str) -> &'s Arc<Mesh> {
    let object = scene.objects.iter().find(|o| o.name == name).expect("an object of that name");
    match &object.geometry {
        Geometry::Mesh(mesh) => mesh,
        _ => panic!("{name} is a sphere"),
    }
}
