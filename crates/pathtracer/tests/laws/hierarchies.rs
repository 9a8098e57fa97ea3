//! Scenes that are compiled with hierarchies of another compilation are those that are compiled
//! without.

use std::sync::Arc;

use pathtracer::{CompileOptions, Hierarchies, Quality, Scene, Session, Settings, Silent};

use crate::scenes::{load, size};

/// Options with a hierarchy for each object that has several instances.
fn options() -> CompileOptions {
    CompileOptions { most_copied_triangles: Some(0), ..size([12, 9]) }
}

fn session(scene: &Scene, options: CompileOptions) -> Session {
    let settings = Settings { spp: 1, ..Settings::default() };
    let mut session = Session::new(scene, options, settings).expect("the scene makes sense");
    session.render(2, 8, &Silent).expect("it is rendered");
    session
}

/// Number of hierarchies of a session, and of those that something else has, too.
fn shared(session: &Session) -> [usize; 2] {
    let scene = session.scene();
    let placed = scene.instances.iter().flat_map(|table| table.objects());
    let all: Vec<_> = std::iter::once(&scene.bvh).chain(placed.map(|o| &o.bvh)).collect();
    // Instances count as users of the hierarchy of their object.
    let is_shared = |bvh: &&&Arc<_>| {
        let instances = scene.instances.iter().flat_map(|table| table.instances());
        let objects = scene.instances.iter().flat_map(|table| table.objects());
        let index = objects.enumerate().find(|(_, o)| Arc::ptr_eq(&o.bvh, bvh)).map(|(i, _)| i);
        let own = index.map_or(0, |i| instances.filter(|at| at.object as usize == i).count());
        Arc::strong_count(bvh) > 1 + own
    };
    [all.len(), all.iter().filter(is_shared).count()]
}

#[test]
fn they_are_used_and_change_nothing() {
    for name in ["cornell.dae", "gltf/instances.glb", "motion.xml", "mitsuba/inward_spheres.xml"] {
        let scene = load(name);
        let new = session(&scene, options());
        let bytes = new.compiled().hierarchies().to_bytes();
        let known = Hierarchies::from_bytes(&bytes).expect("they can be read");
        assert!(known.to_bytes() == bytes, "{name}");
        let again = session(&scene, CompileOptions { hierarchies: known.clone(), ..options() });
        let [all, taken] = shared(&again);
        assert_eq!(taken, all, "{name}");
        assert_eq!(shared(&new)[1], 0, "{name}");
        assert!(again.film() == new.film(), "{name}");
        assert_eq!(again.identity(), new.identity(), "{name}");
    }
}

#[test]
fn those_of_others_are_not_used() {
    let scene = load("cornell.dae");
    let of = |options| session(&scene, options).compiled().hierarchies();
    let fast = pathtracer::BuildOptions { quality: Quality::Fast, ..Default::default() };
    let mut moved = scene.clone();
    moved.objects[3].to_world.translation.x += 1e-3;
    let others = [
        of(CompileOptions { bvh: fast, ..options() }),
        session(&moved, options()).compiled().hierarchies(),
        session(&load("motion.xml"), options()).compiled().hierarchies(),
    ];
    let new = session(&scene, options());
    for hierarchies in others {
        let again = session(&scene, CompileOptions { hierarchies, ..options() });
        assert_eq!(shared(&again)[1], 0);
        assert!(again.film() == new.film());
    }
}

#[test]
fn bytes_that_are_cut_off_or_changed_are_refused() {
    let bytes = session(&load("cornell.dae"), options()).compiled().hierarchies().to_bytes();
    for end in [1, 20, 35, 45, bytes.len() / 2, bytes.len() - 1] {
        assert!(Hierarchies::from_bytes(&bytes[..end]).is_err(), "{end}");
    }
    for at in (32..bytes.len()).step_by(97) {
        let mut changed = bytes.clone();
        changed[at] ^= 1;
        assert!(Hierarchies::from_bytes(&changed).is_err(), "{at}");
    }
}
