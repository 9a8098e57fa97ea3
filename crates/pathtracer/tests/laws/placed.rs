//! Instances, which may be animated, are hit like copies of their objects.

use std::sync::Arc;

use pathtracer::{CompileOptions, Scene, Session, Settings};
use pt_core::RenderScene;
use pt_cpu::Tracer;
use pt_math::{DAffine3, DMat3, DQuat, DVec3, Ray, Vec2, Vec3};
use pt_scene::texture::Pattern;
use pt_scene::{Attribute, Geometry, Key, Material, Mesh, Motion, Object, Texture, shapes};
use pt_testing::Random;

use crate::measure::{assert_agree, render, settings};
use crate::scenes::{Builder, camera, facing, gloss, matte, size};

/// A cube with vertex colours, and normals between those of its faces and the directions from its
/// centre, so that all properties of a mesh depend on the transform.
fn colored_cube() -> Mesh {
    let cube = shapes::cube();
    let colors = cube.positions.iter().map(|p| p.map(|x| 0.5 + 0.4 * x)).collect();
    let bent = |p: &[f32; 3]| {
        let p = Vec3::from_array(*p);
        (p + p.signum() * p.abs().max_element() * Vec3::new(0.4, 0.1, 0.2)).normalize().to_array()
    };
    let normals = cube.positions.iter().map(bent).collect();
    Mesh {
        normals: Some(Attribute { values: normals, indices: None }),
        colors: Some(Attribute { values: colors, indices: None }),
        ..cube
    }
}

/// Transforms that rotate, stretch, shear and mirror.
fn places() -> Vec<DAffine3> {
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::new(0.2, -0.3, 1.0));
    let turn = |angle| DMat3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle);
    [
        (DMat3::IDENTITY * 0.4, [-1.2, 0.8, 0.0]),
        (turn(1.0) * DMat3::from_diagonal(DVec3::new(0.2, 0.6, 0.3)), [0.0, 0.9, 0.3]),
        (shear * DMat3::from_diagonal(DVec3::new(-0.4, 0.3, 0.3)), [1.2, 0.6, -0.2]),
        (turn(2.0) * shear * 0.25, [0.3, 0.3, 1.2]),
    ]
    .map(|(m, t)| DAffine3::from_mat3_translation(m, t.into()))
    .to_vec()
}

/// A floor, one mesh in four places, and a ball.
fn scene() -> Scene {
    let Builder(mut scene) = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.5; 3]))
        .sphere(DVec3::new(-0.4, 0.3, 1.0), 0.3, gloss())
        .emissive_quad(facing(DVec3::new(0.5, 2.6, 0.5), DVec3::NEG_Y, 0.4), 9.0)
        .sky(0.3);
    let texture: Arc<Texture> = Arc::new(Pattern::VertexColors.into());
    let surface =
        pt_scene::material::Diffuse { reflectance: texture_color(&texture), two_sided: true };
    scene.materials.push(Material {
        name: String::new(),
        surface: surface.into(),
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    });
    let material = Some(scene.materials.len() as u32 - 1);
    let mesh = Arc::new(colored_cube());
    for to_world in places() {
        scene.objects.push(Object {
            name: String::new(),
            to_world,
            motion: None,
            geometry: Geometry::Mesh(Arc::clone(&mesh)),
            materials: vec![material],
            media: None,
            at: pt_scene::Span::default(),
        });
    }
    let view = camera(DVec3::new(0.4, 2.2, 4.0), DVec3::new(0.0, 0.4, 0.0), [50.0, 44.0]);
    Builder(scene).seen_by(view)
}

fn texture_color(texture: &Arc<Texture>) -> pt_scene::Color {
    pt_scene::Color::Texture(Arc::clone(texture))
}

fn kept_once() -> CompileOptions {
    CompileOptions { most_copied_triangles: Some(0), ..size([12, 10]) }
}

fn compiled(scene: &Scene, options: CompileOptions) -> Session {
    Session::new(scene, options, Settings::default()).expect("the scene makes sense")
}

/// Asserts that rays at a time have the same hits in a scene with instances and in one without;
/// returns the number of hits on instances. Numbers of primitives and barycentric coordinates
/// differ.
fn assert_alike(placed: &RenderScene, flat: &RenderScene, time: f32, seed: u64) -> u32 {
    const TOLERANCE: f32 = 3e-4;
    assert!(placed.instances.is_some() && flat.instances.is_none());
    let mut random = Random::new(seed);
    let rays: Vec<Ray> = (0..3000)
        .map(|_| {
            let origin = random.direction() * 5.0;
            let target = random.in_cube() * Vec3::new(1.6, 0.6, 1.2) + Vec3::Y * 0.6;
            Ray::new(origin, (target - origin).normalize())
        })
        .collect();
    let (mut there, mut here) = (Vec::new(), Vec::new());
    Tracer::new(placed, false).intersect(&rays, |_| time, &mut there);
    Tracer::new(flat, false).intersect(&rays, |_| 0.0, &mut here);
    let (mut on_placed, mut elsewhere) = (0, 0);
    for (ray, hits) in rays.iter().zip(there.iter().zip(&here)) {
        let (Some(a), Some(b)) = hits else {
            elsewhere += u32::from(hits.0.is_some() != hits.1.is_some());
            continue;
        };
        let [at, want] = [placed.interaction(ray, a, time), flat.interaction(ray, b, 0.0)];
        if placed.object(a.primitive) != flat.object(b.primitive)
            || at.point.normal.dot(want.point.normal) < 0.999
        {
            elsewhere += 1; // within rounding of an edge
            continue;
        }
        let near = |a: Vec3, b: Vec3| (a - b).length() < TOLERANCE;
        assert!(near(at.point.p, want.point.p), "{ray:?}: {at:?} {want:?}");
        assert!(near(at.normal, want.normal), "{ray:?}: {at:?} {want:?}");
        assert!(near(at.point.normal, want.point.normal), "{ray:?}: {at:?} {want:?}");
        assert!((at.distance - want.distance).abs() < TOLERANCE && at.wo == want.wo);
        assert!(at.point.offsets.iter().all(|o| (0.0..1e-4).contains(o) && *o > 0.0), "{at:?}");
        assert_eq!(placed.is_flat(a.primitive), flat.is_flat(b.primitive));
        let [place, wanted] =
            [placed.texture_eval_context(&at, a, time), flat.texture_eval_context(&want, b, 0.0)];
        let shared = placed.surfaces[at.surface].material.is_some();
        assert_eq!(shared, flat.surfaces[want.surface].material.is_some());
        if shared && place.along_u.is_some() {
            assert!((place.uv - wanted.uv).length() < 10.0 * TOLERANCE, "{place:?} {wanted:?}");
            for [a, b] in [[place.along_u, wanted.along_u], [place.along_v, wanted.along_v]] {
                let (a, b) = a.zip(b).expect("it has coordinates");
                assert!((a - b).length() < TOLERANCE * (1.0 + b.length()), "{a} {b}");
            }
        }
        let [seen, want_seen] =
            [(placed, &at, a, time), (flat, &want, b, 0.0)].map(|(scene, at, hit, time)| {
                scene
                    .evaluate_material(at, hit, time, 0.5, None)
                    .map(|r| scene.bsdf(at, Some(&r)).eval(at.normal))
            });
        if let (Some(a), Some(b)) = (seen, want_seen) {
            assert!(near(a.0, b.0), "{a:?} {b:?}");
        }
        on_placed += u32::from(placed.object(a.primitive) >= 3);
    }
    assert!(elsewhere < 30, "{elsewhere} of 3000 rays find something else");
    on_placed
}

#[test]
fn a_mesh_that_is_kept_once_is_found_where_its_copies_are() {
    let [once, copied] = [kept_once(), size([12, 10])].map(|options| compiled(&scene(), options));
    let placed = once.scene().instances.as_ref().expect("it is placed");
    assert_eq!((placed.objects().len(), placed.instances().len()), (1, 4));
    assert!(!placed.moves() && !once.scene().is_animated());
    let hits = assert_alike(once.scene(), copied.scene(), 0.0, 5);
    assert!(hits > 400, "{hits}");
}

#[test]
fn pictures_of_what_is_kept_once_and_of_copies_agree() {
    let film = |options, seed| {
        let settings = Settings { max_depth: 4, seed, ..settings(4096) };
        render(&scene(), options, settings).film().clone()
    };
    assert_agree(&film(kept_once(), 1), &film(size([12, 10]), 2), 1e-4, "once and copied");
}

/// At any time, an animated object has its place in a static scene.
#[test]
fn what_moves_is_found_where_it_is_at_the_time() {
    let mut moving = scene();
    let motion = |stretch: f64| {
        let turn = |angle: f64, x| {
            let turn = DQuat::from_axis_angle(DVec3::new(0.36, 0.8, 0.48), angle);
            let size = DVec3::new(1.0, 1.0 + stretch * angle, 1.0);
            DAffine3::from_scale_rotation_translation(size, turn, DVec3::new(x, 0.1, 0.0))
        };
        let keys = [(2.0, turn(-0.5, -0.2)), (2.6, turn(0.4, 0.1)), (3.5, turn(0.9, 0.4))];
        let keys = keys.map(|(time, to_world)| Key { time, to_world });
        Arc::new(Motion::new(keys.to_vec()).expect("the keys make sense"))
    };
    let stretching = motion(0.2);
    for object in moving.objects.iter_mut().skip(3) {
        object.motion = Some(Arc::clone(&stretching));
    }
    // In the static scene, a stretched ball is converted to triangles.
    moving.objects[1].motion = Some(motion(0.0));
    moving.cameras[0].shutter = [2.25, 3.25];
    let blurred = compiled(&moving, size([12, 10]));
    assert!(blurred.scene().is_animated());
    for share in [0.0, 0.1, 0.35, 0.77, 0.999] {
        let mut still = moving.clone();
        still.cameras[0].shutter = [2.25 + share; 2];
        let still = compiled(&still, size([12, 10]));
        let hits = assert_alike(blurred.scene(), still.scene(), share as f32, 6);
        assert!(hits > 400, "{share}: {hits}");
    }
}

/// A ray that leaves a convex shape does not meet it again, wherever it is and however large.
#[test]
fn rays_that_leave_what_is_placed_do_not_meet_it() {
    let mut random = Random::new(8);
    let mut rays = 0;
    for (size, far) in [(1.0, 0.0), (1e-3, 1.0), (1.0, 1e3), (1e3, 1e2), (0.01, 1e4)] {
        let at = |angle: f64, x: f64| {
            let turn = DQuat::from_axis_angle(DVec3::new(0.36, 0.8, 0.48), angle);
            let stretch = DVec3::new(1.0, 0.5, 2.0) * size;
            DAffine3::from_scale_rotation_translation(
                stretch,
                turn,
                DVec3::new(far, x * size, -far),
            )
        };
        let keys = vec![
            Key { time: 0.0, to_world: at(0.0, 0.0) },
            Key { time: 1.0, to_world: at(2.0, 1.0) },
        ];
        let motion = Arc::new(Motion::new(keys).expect("the keys make sense"));
        let view = camera(DVec3::Z, DVec3::ZERO, [40.0, 40.0]);
        let mut scene = Builder::default()
            .mesh(shapes::cube(), DAffine3::IDENTITY, matte([0.5; 3]))
            .sphere(DVec3::X * 4.0, 1.0, matte([0.5; 3]))
            .sky(1.0)
            .seen_by(pathtracer::Camera { shutter: [0.0, 1.0], ..view });
        scene.objects.iter_mut().for_each(|object| object.motion = Some(Arc::clone(&motion)));
        let session = compiled(&scene, crate::scenes::size([4, 4]));
        let scene = session.scene();
        let placed = scene.instances.as_ref().expect("it moves");
        for _ in 0..3000 {
            let time = random.unit();
            let local = [random.in_cube(), random.in_cube() + Vec3::X * 4.0][random.below(2)];
            let target = motion.at(f64::from(time)).transform_point3(local.as_dvec3()).as_vec3();
            let origin = target + random.direction() * (8.0 * size as f32);
            let ray = Ray::new(origin, (target - origin).normalize());
            let Some(hit) = placed.intersect(&ray, time) else { continue };
            let at = scene.interaction(&ray, &hit, time);
            let w = random.direction();
            let outwards = w * w.dot(at.point.normal).signum();
            if w.dot(at.point.normal).abs() < 1e-3 {
                continue;
            }
            let leaving = at.point.spawn(outwards);
            if let Some(again) = placed.intersect(&leaving, time) {
                assert_ne!(
                    scene.object(again.primitive),
                    scene.object(hit.primitive),
                    "{size} {far} {hit:?} {again:?}"
                );
            }
            rays += 1;
        }
    }
    assert!(rays > 5000, "{rays}");
}

/// Texture coordinates of a sphere turn with it.
#[test]
fn a_turning_sphere_carries_its_coordinates() {
    let at = |angle| DAffine3::from_rotation_z(angle);
    let keys = vec![Key { time: 0.0, to_world: at(0.0) }, Key { time: 1.0, to_world: at(1.0) }];
    let motion = Arc::new(Motion::new(keys).expect("the keys make sense"));
    let view = camera(DVec3::new(0.0, -4.0, 0.0), DVec3::ZERO, [40.0, 40.0]);
    let mut scene = Builder::default()
        .sphere(DVec3::ZERO, 1.0, matte([0.5; 3]))
        .seen_by(pathtracer::Camera { shutter: [0.0, 1.0], ..view });
    scene.objects[0].motion = Some(motion);
    let session = compiled(&scene, size([4, 4]));
    let scene = session.scene();
    let ray = Ray::new(Vec3::new(5.0, 0.0, 0.5), Vec3::NEG_X);
    for time in [0.0, 0.3, 0.8] {
        let hit = scene.instances.as_ref().and_then(|placed| placed.intersect(&ray, time));
        let hit = hit.expect("it is in the way");
        let at = scene.interaction(&ray, &hit, time);
        let place = scene.texture_eval_context(&at, &hit, time);
        // Longitude runs from +x to +y, and the sphere has turned the same way.
        let longitude = (1.0 - f64::from(time) / std::f64::consts::TAU).fract() as f32;
        let latitude = (0.5f64).acos() / std::f64::consts::PI;
        let want = Vec2::new(longitude, latitude as f32);
        assert!((place.uv - want).length() < 1e-4, "{time}: {place:?} {want}");
        let along_u = place.along_u.expect("it is not a pole");
        assert!(along_u.normalize().dot(Vec3::Y) > 0.999, "{along_u}");
    }
}
