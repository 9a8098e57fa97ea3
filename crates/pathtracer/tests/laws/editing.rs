//! A session of an edited scene, made from that of an earlier version, is the one of a compilation
//! from scratch.

use std::sync::Arc;

use pathtracer::compat::cs184;
use pathtracer::{
    Aov, CompileError, CompileOptions, CompiledScene, DirectLight, EnvironmentMap, Scene, Session,
    Settings, Silent,
};
use pt_math::{DAffine3, DQuat, DVec3};
use pt_scene::medium::Phase;
use pt_scene::{Attribute, Color, Geometry, Key, Light, LightKind, Mesh, Motion, Span, shapes};

use crate::scenes::{Builder, camera, facing, gloss, load, matte, metal, size};

const SIZE: [u32; 2] = [12, 9];

/// Scenes with mesh lights, instances, media, textures, environments, points and motion.
const FILES: [&str; 12] = [
    "cornell.dae",
    "gltf/glass.glb",
    "gltf/instances.glb",
    "gltf/lights.gltf",
    "gltf/textures.gltf",
    "json/mist.json",
    "mitsuba/envmap.xml",
    "mitsuba/mesh_colors.xml",
    "mitsuba/points.xml",
    "mitsuba/measured.xml",
    "mitsuba/textured_lights.xml",
    "motion.xml",
];

/// Name of an edit, and what it does.
type Edit = (&'static str, fn(&mut Scene));

const EDITS: [Edit; 15] = [
    ("nothing", |_| ()),
    ("a camera", |scene| {
        scene.cameras.iter_mut().for_each(|camera| camera.to_world.translation.x += 0.1);
    }),
    ("a shutter", |scene| {
        scene.cameras.iter_mut().for_each(|camera| camera.shutter[1] += 0.1);
    }),
    ("each second material", |scene| {
        for material in scene.materials.iter_mut().step_by(2) {
            material.surface = matte([0.2, 0.5, 0.3]);
        }
    }),
    ("a lamp that is out", |scene| {
        let black = Color::from([0.0; 3]);
        let lit = scene.materials.iter().position(|material| material.emission != black);
        if let Some(lit) = lit {
            scene.materials[lit].emission = [0.0; 3].into();
        }
    }),
    ("an emissive surface", |scene| {
        scene.materials.iter_mut().take(1).for_each(|m| m.emission = [0.5, 0.3, 0.1].into());
    }),
    ("a turned object", |scene| {
        if let Some(object) = scene.objects.last_mut() {
            let turn = DAffine3::from_quat(DQuat::from_rotation_y(0.3));
            object.to_world = DAffine3::from_translation(DVec3::Y * 0.1) * object.to_world * turn;
        }
    }),
    ("a mirrored object", |scene| {
        scene.objects.iter_mut().take(1).for_each(|object| {
            object.to_world *= DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        });
    }),
    ("all objects", |scene| {
        scene.objects.iter_mut().for_each(|object| object.to_world.translation.z -= 0.05);
    }),
    ("the media", |scene| {
        scene.media.iter_mut().for_each(|medium| medium.phase = Phase::HenyeyGreenstein { g: 0.5 });
    }),
    ("a square light", |scene| {
        scene.lights.push(square(DVec3::new(0.2, 1.4, 0.3), 2.0));
    }),
    ("a moved square light", |scene| {
        scene.lights.to_mut().pop();
        scene.lights.push(square(DVec3::new(0.1, 1.3, 0.3), 3.0));
    }),
    ("the last light", |scene| drop(scene.lights.to_mut().pop())),
    ("the last object", |scene| drop(scene.objects.to_mut().pop())),
    ("the unit", |scene| scene.metres_per_unit *= 0.5),
];

fn square(at: DVec3, radiance: f32) -> Light {
    Light {
        name: "square".to_owned(),
        to_world: facing(at, DVec3::NEG_Y, 0.3),
        kind: LightKind::Area { radiance: [radiance; 3] },
        at: Span::default(),
    }
}

fn settings(scene: &Scene) -> Settings {
    let integrator = if scene.media.is_empty() { "path" } else { "volpath" };
    Settings { spp: 1, integrator: integrator.into(), ..Settings::default() }
}

/// Asserts that the session of an edited scene is that of a new compilation, and returns it.
fn edited(
    earlier: CompiledScene,
    scene: &Scene,
    options: &dyn Fn() -> CompileOptions,
    name: &str,
) -> Option<Session> {
    let edited = Session::edited(earlier, scene, options(), settings(scene));
    let new = Session::new(scene, options(), settings(scene));
    let (mut edited, mut new) = match (edited, new) {
        (Ok(edited), Ok(new)) => (edited, new),
        (edited, new) => {
            let [edited, new] = [edited, new].map(|r| r.err().map(|error| error.to_string()));
            assert_eq!(edited, new, "{name}");
            return None;
        }
    };
    for session in [&mut edited, &mut new] {
        session.render(2, 8, &Silent).expect("it is rendered");
    }
    assert!(edited.film() == new.film(), "{name}");
    assert_eq!(edited.identity(), new.identity(), "{name}");
    assert_eq!(edited.notes(), new.notes(), "{name}");
    assert_eq!(edited.hints(), new.hints(), "{name}");
    let counts = |session: &Session| (session.scene().shape_counts(), session.scene().light_count);
    assert_eq!(counts(&edited), counts(&new), "{name}");
    Some(edited)
}

/// Asserts it for each edit after the ones before, and for all of them undone. Each second one uses
/// up the earlier compilation; the others leave it as it was.
fn assert_edits(scene: &Scene, options: &dyn Fn() -> CompileOptions, name: &str) {
    let new = |scene: &Scene| {
        let session = Session::new(scene, options(), settings(scene));
        session.expect("the scene makes sense").compiled()
    };
    let (mut last, mut current) = (new(scene), scene.clone());
    for (number, (edit, change)) in EDITS.into_iter().enumerate() {
        let mut next = current.clone();
        change(&mut next);
        let kept = (number % 2 == 0).then(|| last.clone());
        let session = edited(last, &next, options, &format!("{name}: {edit}"));
        if let Some(kept) = kept {
            assert!(edited(kept, &current, options, &format!("{name}: before {edit}")).is_some());
        }
        if session.is_some() {
            current = next;
        }
        last = session.map_or_else(|| new(&current), |session| session.compiled());
    }
    assert!(edited(last, scene, options, &format!("{name}: undone")).is_some());
}

#[test]
fn edited_scenes_are_those_of_new_compilations() {
    for name in FILES {
        assert_edits(&load(name), &|| size(SIZE), name);
    }
}

#[test]
fn edited_scenes_of_instances_are_those_of_new_compilations() {
    let options = || CompileOptions { most_copied_triangles: Some(0), ..size(SIZE) };
    for name in ["gltf/instances.glb", "mitsuba/many_instances.xml", "gltf/animated.gltf"] {
        assert_edits(&load(name), &options, name);
    }
}

/// Maps that are not part of the scene are compiled anew, and maps of the scene are kept.
#[test]
fn environments_are_those_of_new_compilations() {
    let with_sky = || {
        let sky = EnvironmentMap::new(2, 1, vec![[0.5, 0.7, 1.0], [2.0, 1.0, 0.5]]);
        CompileOptions { environment: Some(sky), ..size(SIZE) }
    };
    assert_edits(&load("mitsuba/envmap.xml"), &with_sky, "a second map");
    let scene = load("mitsuba/envmap.xml");
    let plain = || size(SIZE);
    let session = Session::new(&scene, with_sky(), settings(&scene)).expect("it makes sense");
    assert!(edited(session.compiled(), &scene, &plain, "without the second map").is_some());
}

/// Options and settings may differ, too.
#[test]
fn other_options_are_those_of_new_compilations() {
    let textured = load("gltf/textures.gltf");
    let under_a_map = load("mitsuba/envmap.xml");
    let Builder(pair) = Builder::default()
        .mesh(bent_rectangle(), facing(DVec3::ZERO, DVec3::Z, 1.0), gloss())
        .sky(1.0);
    let mut pair = Builder(pair).seen_by(camera(DVec3::Z * 3.0, DVec3::ZERO, [40.0, 30.0]));
    let mut other = pair.objects[0].clone();
    other.to_world.translation.x += 0.5;
    pair.objects.push(other);
    let film = |session: Result<Session, CompileError>| {
        let mut session = session.expect("it makes sense");
        session.render(2, 8, &Silent).expect("it is rendered");
        session.into_film()
    };
    for (scene, most_copied_triangles) in
        [(&textured, None), (&under_a_map, None), (&pair, None), (&pair, Some(0))]
    {
        let plain = || CompileOptions { most_copied_triangles, ..size(SIZE) };
        let session = Session::new(scene, plain(), settings(scene)).expect("it makes sense");
        let plain_settings = settings(scene);
        for other in [
            Settings { direct: DirectLight::Light, ..plain_settings.clone() },
            Settings { aovs: vec![Aov::Uv], ..plain_settings.clone() },
            Settings { seed: 3, max_depth: 2, ..plain_settings.clone() },
        ] {
            let edited = Session::edited(session.compiled(), scene, plain(), other.clone());
            assert!(film(edited) == film(Session::new(scene, plain(), other)));
        }
        let smooth = || CompileOptions { smooth_shadows: true, ..plain() };
        assert!(edited(session.compiled(), scene, &smooth, "smooth shadows").is_some());
        let studio = || CompileOptions { studio: true, ..plain() };
        assert!(edited(session.compiled(), scene, &studio, "studio").is_some());
        let course = || CompileOptions { policies: cs184::POLICIES, ..plain() };
        assert!(edited(session.compiled(), scene, &course, "other policies").is_some());
    }
}

/// A rectangle with texture coordinates and normals that lean outwards.
fn bent_rectangle() -> Mesh {
    let rectangle = shapes::rectangle();
    let lean = |p: &[f32; 3]| [0.4 * p[0], 0.4 * p[1], 1.0];
    let uv = |p: &[f32; 3]| [0.5 * p[0], 0.3 * p[1]];
    let (normals, uvs) = (&rectangle.positions, &rectangle.positions);
    Mesh {
        normals: Some(Attribute { values: normals.iter().map(lean).collect(), indices: None }),
        uvs: Some(Attribute { values: uvs.iter().map(uv).collect(), indices: None }),
        ..rectangle
    }
}

/// Objects that stand still while the shutter is open are elsewhere at other times.
#[test]
fn other_times_are_those_of_new_compilations() {
    let view = camera(DVec3::new(0.4, 2.2, 4.0), DVec3::ZERO, [50.0, 44.0]);
    let builder = Builder::default().mesh(shapes::cube(), DAffine3::IDENTITY, metal()).sky(1.0);
    let mut scene = builder.seen_by(view);
    let key = |time, x| Key { time, to_world: DAffine3::from_translation(DVec3::X * x) };
    let motion = Motion::new(vec![key(0.0, 0.0), key(2.0, 1.0)]).expect("the keys make sense");
    scene.objects[0].motion = Some(Arc::new(motion));
    let first = Session::new(&scene, size(SIZE), settings(&scene)).expect("it makes sense");
    scene.cameras[0].shutter = [1.0; 2];
    assert!(edited(first.compiled(), &scene, &|| size(SIZE), "later").is_some());
}

/// Hierarchies and arrays that do not change are those of the earlier scene.
#[test]
fn what_does_not_change_is_shared() {
    let new = |scene: &Scene| {
        Session::new(scene, size(SIZE), Settings::default()).expect("the scene makes sense")
    };
    let scene = load("gltf/textures.gltf");
    let first = new(&scene);
    let mut other = scene.clone();
    other.cameras.push(camera(DVec3::splat(3.0), DVec3::ZERO, [30.0, 30.0]));
    other.materials[0].surface = metal();
    other.lights.to_mut().clear();
    let after = Session::edited(first.compiled(), &other, size(SIZE), Settings::default());
    let after = after.expect("the scene makes sense");
    let [first, after] = [&first, &after].map(Session::scene);
    assert!(Arc::ptr_eq(&first.shapes.arrays, &after.shapes.arrays));
    assert!(Arc::ptr_eq(&first.bvh, &after.bvh));
    let of_first = first.materials.textures.texels.as_slice();
    let of_after = after.materials.textures.texels.as_slice();
    let is_known = |image| of_first.iter().any(|known| Arc::ptr_eq(known, image));
    assert!(!of_after.is_empty() && of_after.iter().all(is_known));
}

/// Objects of instances that move keep their own hierarchies.
#[test]
fn moved_instances_keep_their_hierarchies() {
    let options = || CompileOptions { most_copied_triangles: Some(0), ..size(SIZE) };
    let scene = load("gltf/instances.glb");
    let first = Session::new(&scene, options(), Settings::default()).expect("it makes sense");
    let mut other = scene.clone();
    other.objects.iter_mut().for_each(|object| object.to_world.translation.y += 0.2);
    let after = Session::edited(first.compiled(), &other, options(), Settings::default());
    let after = after.expect("the scene makes sense");
    let of = |session: &Session| {
        let instances = session.scene().instances.clone().expect("instances");
        instances.objects().iter().map(|object| Arc::clone(&object.bvh)).collect::<Vec<_>>()
    };
    let (first, after) = (of(&first), of(&after));
    assert!(first.iter().zip(&after).all(|(a, b)| Arc::ptr_eq(a, b)));
}

/// Coincident triangles: which one is hit does not depend on the topology of a refitted hierarchy.
#[test]
fn ties_are_decided_by_numbers_of_primitives() {
    let mut builder = Builder::default().sky(1.0);
    for i in 0..60 {
        let x = f64::from(i % 10) * 0.4 - 1.8;
        let place = facing(DVec3::new(x, 0.0, 0.0), DVec3::Z, 1.0);
        builder = builder.quad(place, matte([f32::from(i as u8) / 60.0, 0.5, 0.1]));
    }
    let view = camera(DVec3::new(0.0, 0.3, 5.0), DVec3::ZERO, [50.0, 44.0]);
    let scene = builder.seen_by(view);
    let first = Session::new(&scene, size(SIZE), settings(&scene)).expect("it makes sense");
    let mut other = scene.clone();
    for (number, object) in (0_u32..).zip(&mut other.objects) {
        object.to_world.translation.x = f64::from(number * 7 % 10) * 0.4 - 1.8;
    }
    assert!(edited(first.compiled(), &other, &|| size(SIZE), "ties").is_some());
}

/// A mesh at the place of another one in memory is not taken for it.
#[test]
fn meshes_are_told_apart() {
    let of = |mesh: Mesh| {
        let view = camera(DVec3::new(0.4, 2.2, 4.0), DVec3::ZERO, [50.0, 44.0]);
        let builder = Builder::default().mesh(mesh, DAffine3::IDENTITY, metal()).sky(1.0);
        builder.seen_by(view)
    };
    let mut scene = of(shapes::cube());
    let mut session = Session::new(&scene, size(SIZE), settings(&scene)).expect("it makes sense");
    for radius in [0.3_f32, 0.6, 0.9] {
        let mut mesh = shapes::cube();
        mesh.positions.iter_mut().for_each(|p| *p = p.map(|x| x * radius));
        scene.objects[0].geometry = Geometry::Mesh(Arc::new(mesh));
        session =
            edited(session.compiled(), &scene, &|| size(SIZE), "meshes").expect("it makes sense");
    }
}
