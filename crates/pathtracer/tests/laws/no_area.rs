//! Triangles without area are left out, and have no effect.

use pathtracer::Session;
use pt_math::{DAffine3, DVec3};
use pt_scene::{Mesh, shapes};

use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

/// Adds triangles without area to a mesh: a corner twice or three times, and collinear corners.
/// They have corners of their own, so that the normals of the other triangles do not depend on
/// them.
fn with_needles(mesh: &Mesh, count: u32) -> Mesh {
    let mut mesh = mesh.clone();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([[0.5, 0.5, 0.5], [0.25, 0.5, 0.5], [0.0, 0.5, 0.5]]);
    if let Some(normals) = &mut mesh.normals {
        assert!(normals.indices.is_none());
        normals.values.extend([[0.0, 1.0, 0.0]; 3]);
    }
    mesh.uvs = None;
    let kinds = [[0, 0, 0], [0, 1, 1], [0, 1, 2]].map(|c| c.map(|i: u32| i + first));
    mesh.triangles.extend(kinds.into_iter().cycle().take(count as usize));
    if let Some(part) = mesh.submeshes.last_mut() {
        part.triangles.end += count;
    }
    mesh
}

fn scene(needles: u32, emission: f32) -> Builder {
    let ball = with_needles(&Mesh { uvs: None, ..shapes::sphere() }, needles);
    let lamp = with_needles(&Mesh { uvs: None, ..shapes::rectangle() }, needles);
    let place = DAffine3::from_translation(DVec3::Y);
    let lamps = (0..12).fold(Builder::default(), |scene, i| {
        let at = DVec3::new(f64::from(i % 4) - 1.5, 3.0, f64::from(i / 4) - 1.0);
        scene.emissive_mesh(lamp.clone(), facing(at, DVec3::NEG_Y, 0.2), matte([0.5; 3]), emission)
    });
    lamps
        .quad(facing(DVec3::ZERO, DVec3::Y, 4.0), matte([0.5; 3]))
        .mesh(ball.clone(), place * DAffine3::from_scale(DVec3::splat(0.7)), matte([0.6; 3]))
        .emissive_mesh(ball, DAffine3::from_scale(DVec3::splat(0.3)), matte([0.1; 3]), emission)
}

fn rendered(needles: u32) -> Session {
    let view = camera(DVec3::new(0.5, 2.0, 5.0), DVec3::Y, [40.0, 40.0]);
    render(&scene(needles, 3.0).seen_by(view), size([12, 12]), settings(64))
}

/// Both images have finite values only, which `render` asserts, and agree up to noise: lights of no
/// area take no samples and no part in the choice of lights.
#[test]
fn they_change_nothing_but_a_count() {
    let [without, with] = [0, 30].map(rendered);
    crate::measure::assert_agree(without.film(), with.film(), 1e-4, "triangles without area");
    // The mesh of a sphere may have some at its poles.
    let left_out = |session: &Session| session.scene().bvh.skipped();
    assert_eq!(left_out(&with) - left_out(&without), 14 * 30);
}
