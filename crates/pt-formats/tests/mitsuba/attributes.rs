//! Attributes of meshes, and textures that show them.

use pt_scene::Surface;
use pt_scene::texture::{Color, Pattern};

use crate::materials::texture_of;
use crate::{mesh_of, read, surface};

/// Integer colours of a file are not normalized, as in Mitsuba.
#[test]
fn meshes_show_their_colours() {
    let pattern = |inner: &str| {
        let texture =
            format!("<texture type=\"mesh_attribute\" name=\"reflectance\">{inner}</texture>");
        let surface = surface(&format!("<bsdf type=\"diffuse\">{texture}</bsdf>"));
        texture_of(surface).pattern.clone()
    };
    let vertices = "<string name=\"name\" value=\"vertex_color\"/>";
    assert_eq!(pattern(vertices), Pattern::VertexColors);
    let Pattern::Product(factors) = pattern(
        "<string name=\"name\" value=\"face_color\"/><float name=\"scale\" value=\"0.5\"/>",
    ) else {
        panic!("no product")
    };
    let [Color::Texture(faces), Color::Value([0.5, 0.5, 0.5])] = &*factors else {
        panic!("{factors:?}")
    };
    assert_eq!(faces.pattern, Pattern::FaceColors);
    let scene =
        read("<shape type=\"ply\"><string name=\"filename\" value=\"coloured.ply\"/></shape>");
    let mesh = mesh_of(&scene.objects[0]);
    let colors = &mesh.colors.as_ref().expect("colours").values;
    assert_eq!(*colors, [[255.0, 0.0, 51.0], [0.0, 102.0, 0.0], [0.0; 3]]);
    assert_eq!(mesh.face_colors, Some(vec![[0.5, 0.25, 1.0]].into()));
}

/// The PLY writer of Mitsuba numbers the channels of colours.
#[test]
fn meshes_show_colours_by_numbered_names() {
    let texture = |name: &str| {
        format!(
            "<bsdf type=\"diffuse\"><texture type=\"mesh_attribute\" name=\"reflectance\">\
             <string name=\"name\" value=\"{name}\"/></texture></bsdf>"
        )
    };
    let blend = format!(
        "<shape type=\"ply\"><string name=\"filename\" value=\"numbered_colours.ply\"/>\
         <bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.5\"/>\
         {}{}</bsdf></shape>",
        texture("vertex_color"),
        texture("face_color"),
    );
    let scene = read(&blend);
    let mesh = mesh_of(&scene.objects[0]);
    let colors = &mesh.colors.as_ref().expect("colours").values;
    assert_eq!(*colors, [[1.0, 0.0, 0.25], [0.0, 0.5, 0.0], [0.0, 0.0, 0.125]]);
    assert_eq!(mesh.face_colors, Some(vec![[0.5, 0.25, 1.0]].into()));
    assert_eq!(mesh.attributes.all().count(), 0);
}

/// Only attributes that a texture uses are read.
#[test]
fn meshes_show_values_by_their_names() {
    let shape = |name: &str, parameter: &str| {
        format!(
            "<shape type=\"ply\"><string name=\"filename\" value=\"attributes.ply\"/>\
             <bsdf type=\"principled\"><texture type=\"mesh_attribute\" name=\"{parameter}\">\
             <string name=\"name\" value=\"{name}\"/></texture></bsdf></shape>"
        )
    };
    let shapes = shape("vertex_rough", "roughness")
        + &shape("vertex_paint_color", "base_color")
        + &shape("face_step", "metallic");
    let scene = read(&shapes);
    let attributes = &mesh_of(&scene.objects[0]).attributes;
    let vertices: Vec<_> =
        attributes.vertices.iter().map(|(name, v)| (&**name, v.to_vec())).collect();
    let paint = vec![[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9], [1.0, 0.0, 0.5]];
    let rough = vec![[0.25; 3], [0.5; 3], [0.75; 3], [1.0; 3]];
    assert_eq!(vertices, [("paint_color", paint), ("rough", rough)]);
    let faces: Vec<_> = attributes.faces.iter().map(|(name, v)| (&**name, v.to_vec())).collect();
    assert_eq!(faces, [("step", vec![[0.0; 3], [2.0; 3]])]);
    let surface = |i: usize| scene.materials[i].surface.clone();
    let Surface::Principled(first) = surface(0) else { panic!("not principled") };
    let roughness = first.roughness.texture().expect("a texture").pattern.clone();
    assert_eq!(roughness, Pattern::VertexAttribute("rough".into()));
    assert!(matches!(surface(2), Surface::Principled(last)
        if last.metallic.texture().is_some_and(|t| t.pattern == Pattern::FaceAttribute("step".into()))));
}
