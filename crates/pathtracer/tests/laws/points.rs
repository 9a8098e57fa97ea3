//! Points are spheres, and segments are cylinders.

use std::sync::Arc;

use pathtracer::{CompileOptions, Film, Scene, Session, Settings};
use pt_math::{DAffine3, DMat3, DQuat, DVec3};
use pt_scene::material::Diffuse;
use pt_scene::texture::{Color, Pattern, Texture};
use pt_scene::{Geometry, Material, Object, Points, Span, Surface};

use crate::measure::{assert_agree, render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

const RADIUS: f64 = 0.25;

fn positions() -> Vec<[f32; 3]> {
    vec![[-0.8, 0.4, 0.1], [0.0, 0.5, 0.0], [0.8, 0.3, -0.1], [0.1, -0.5, 0.2], [-0.7, -0.4, 0.3]]
}

fn colors() -> Vec<[f32; 3]> {
    vec![[0.8, 0.1, 0.2], [0.1, 0.7, 0.3], [0.2, 0.3, 0.9], [0.6, 0.6, 0.1], [0.4, 0.4, 0.4]]
}

fn cloud() -> Points {
    Points { positions: positions(), colors: Some(colors()), ..Points::default() }
}

fn showing(pattern: Pattern) -> Surface {
    let reflectance = Color::Texture(Arc::new(Texture::from(pattern)));
    Diffuse { reflectance, two_sided: true }.into()
}

fn with_points(
    mut scene: Scene,
    points: &Arc<Points>,
    to_world: DAffine3,
    surface: Surface,
) -> Scene {
    let material = scene.materials.len() as u32;
    scene.materials.push(Material {
        name: String::new(),
        surface,
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    });
    scene.objects.push(Object {
        name: String::new(),
        to_world,
        motion: None,
        geometry: Geometry::Points { points: Arc::clone(points), radius: Some(RADIUS) },
        materials: vec![Some(material)],
        media: None,
        at: Span::default(),
    });
    scene
}

/// A wall as background.
fn wall() -> Scene {
    Builder::default().quad(facing(DVec3::NEG_Z, DVec3::Z, 3.0), matte([0.5; 3])).sky(1.0).0
}

fn seen(scene: Scene) -> Scene {
    Builder(scene).seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [34.0, 28.0]))
}

fn film(scene: &Scene, spp: u32) -> Film {
    let settings = Settings { max_depth: 3, ..settings(spp) };
    render(scene, size([24, 20]), settings).film().clone()
}

/// The same scene with a separate sphere for each point.
fn with_spheres(scene: Scene, place: &DAffine3, scale: f64) -> Scene {
    let mut builder = Builder(scene);
    for (position, color) in positions().into_iter().zip(colors()) {
        let center = place.transform_point3(DVec3::from(position.map(f64::from)));
        builder = builder.sphere(center, RADIUS * scale, matte(color));
    }
    builder.0
}

/// The spheres have the same numbers, so that the films differ only by rounding; also for points
/// that are rotated and enlarged.
#[test]
fn points_are_spheres_of_their_colours() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.36, 0.8, 0.48), 0.7);
    let places = [
        (DAffine3::IDENTITY, 1.0),
        (DAffine3::from_scale_rotation_translation(DVec3::splat(1.25), turn, DVec3::X * 0.1), 1.25),
    ];
    for (place, scale) in places {
        let points = with_points(wall(), &Arc::new(cloud()), place, showing(Pattern::VertexColors));
        let spheres = with_spheres(wall(), &place, scale);
        let [points, spheres] = [points, spheres].map(|scene| film(&seen(scene), 16));
        for (i, (a, b)) in points.pixels().zip(spheres.pixels()).enumerate() {
            let near = a.mean().iter().zip(b.mean()).all(|(a, b)| (a - b).abs() < 2e-3);
            assert!(near, "pixel {i}: {:?} {:?}", a.mean(), b.mean());
        }
    }
}

/// Stretched points are still spheres, of the volume after stretching.
#[test]
fn points_stay_round() {
    let stretch = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(2.0, 0.5, 1.0)));
    let points = with_points(wall(), &Arc::new(cloud()), stretch, showing(Pattern::VertexColors));
    let session = Session::new(&seen(points), CompileOptions::default(), Settings::default());
    let session = session.expect("the scene makes sense");
    let shapes = &session.scene().shapes;
    assert_eq!(shapes.spheres.len(), positions().len());
    for (sphere, [x, y, z]) in shapes.spheres.iter().zip(positions()) {
        assert_eq!(sphere.center.to_array(), [2.0 * x, 0.5 * y, z]);
        assert!((f64::from(sphere.radius) - RADIUS).abs() < 1e-6);
    }
}

/// Instanced points, after other points, have the colours of copies.
#[test]
fn points_that_are_placed_keep_their_colours() {
    let shared = Arc::new(cloud());
    let other = Arc::new(Points { colors: Some(vec![[1.0; 3]; 5]), ..cloud() });
    let at = |x: f64, y: f64| {
        DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.5),
            DQuat::IDENTITY,
            DVec3::new(x, y, 0.0),
        )
    };
    let mut scene = wall();
    for (points, place) in
        [(&other, at(0.0, 0.0)), (&shared, at(-0.6, 0.4)), (&shared, at(0.6, -0.4))]
    {
        scene = with_points(scene, points, place, showing(Pattern::VertexColors));
    }
    // One material, so that the objects are alike.
    let last = scene.materials.len() as u32 - 1;
    for object in scene.objects.iter_mut().skip(2) {
        object.materials = vec![Some(last)];
    }
    let scene = seen(scene);
    let once = CompileOptions { most_copied_triangles: Some(0), ..size([24, 20]) };
    let render = |options, seed| {
        let settings = Settings { max_depth: 3, seed, ..settings(2048) };
        render(&scene, options, settings)
    };
    let (placed, copied) = (render(once, 1), render(size([24, 20]), 2));
    let objects = placed.scene().instances.as_ref().expect("they are placed");
    assert_eq!((objects.objects().len(), objects.instances().len()), (1, 2));
    assert!(copied.scene().instances.is_none());
    assert_agree(placed.film(), copied.film(), 1e-4, "once and copied");
}

/// A textured sphere after points keeps its axes, which points do not have.
#[test]
fn spheres_behind_points_keep_their_axes() {
    let checkers = || showing(Pattern::Checkerboard([[0.1; 3], [0.9; 3]]));
    let textured = |scene| {
        let Builder(mut scene) = Builder(scene).sphere(DVec3::Y * 0.1, 0.4, checkers());
        let turn = DQuat::from_axis_angle(DVec3::X, 0.9);
        scene.objects.last_mut().expect("the sphere").to_world.matrix3 *= DMat3::from_quat(turn);
        seen(scene)
    };
    let points =
        with_points(wall(), &Arc::new(cloud()), DAffine3::IDENTITY, showing(Pattern::VertexColors));
    let spheres = with_spheres(wall(), &DAffine3::IDENTITY, 1.0);
    let [points, spheres] = [points, spheres].map(|scene| film(&textured(scene), 16));
    for (i, (a, b)) in points.pixels().zip(spheres.pixels()).enumerate() {
        let near = a.mean().iter().zip(b.mean()).all(|(a, b)| (a - b).abs() < 2e-3);
        assert!(near, "pixel {i}: {:?} {:?}", a.mean(), b.mean());
    }
}

/// Points that emit their colours have this radiance, spheres as well as cylinders between two
/// points of one colour.
#[test]
fn points_that_emit_show_their_colours() {
    let points =
        Points { colors: Some(vec![[0.25, 0.5, 2.0]; 5]), segments: vec![[0, 2]], ..cloud() };
    let black = with_points(
        Scene::default(),
        &Arc::new(points),
        DAffine3::from_scale(DVec3::splat(4.0)),
        pt_scene::material::Black.into(),
    );
    let Builder(scene) = Builder(black).emitting(Arc::new(Pattern::VertexColors.into()));
    let film = film(&seen(scene), 4);
    let mut context = 0;
    for pixel in film.pixels() {
        let [r, g, b] = pixel.mean();
        // Pixels on edges have a fraction.
        assert!((r * 2.0 - g).abs() < 1e-5 && (r * 8.0 - b).abs() < 1e-4, "{r} {g} {b}");
        context += u32::from((r - 0.25).abs() < 1e-5);
    }
    assert!(context > 40, "{context}");
}

#[test]
fn points_that_make_no_sense_are_refused() {
    let refusal = |points: Points, surface: Surface, radius: f64| {
        let mut scene = with_points(wall(), &Arc::new(points), DAffine3::IDENTITY, surface);
        if let Some(Geometry::Points { radius: own, .. }) =
            scene.objects.last_mut().map(|o| &mut o.geometry)
        {
            *own = Some(radius);
        }
        let session = Session::new(&seen(scene), CompileOptions::default(), Settings::default());
        session.err().expect("it makes no sense").to_string()
    };
    let cases = [
        (refusal(cloud(), matte([0.5; 3]), 0.0), "found a point radius of 0"),
        (refusal(cloud(), matte([0.5; 3]), f64::NAN), "found a point radius of NaN"),
        (refusal(cloud(), showing(Pattern::FaceColors), 0.1), "colours of faces"),
        (
            refusal(Points { colors: None, ..cloud() }, showing(Pattern::VertexColors), 0.1),
            "colours of vertices",
        ),
        (
            refusal(Points { segments: vec![[0, 5]], ..cloud() }, matte([0.5; 3]), 0.1),
            "found a segment that ends at point 5, expected an index below 5",
        ),
    ];
    for (message, want) in cases {
        assert!(message.contains(want), "{message}");
    }
}
