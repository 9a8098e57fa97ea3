//! Threads, tiles, pauses and regions do not change a bit of an image.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use pathtracer::image::{self, SaveOptions};
use pathtracer::{
    Adaptive, Aov, Clamp, Film, INTEGRATORS, Observer, Outcome, ProgressUpdate, Region,
    SamplerKind, Session, Settings, Silent, Target, default_scene,
};

use crate::aovs;
use crate::scenes::size;

/// Not a multiple of any tile size.
const SIZE: [u32; 2] = [45, 31];

/// Not a multiple of the samples of a pass.
fn base() -> Settings {
    Settings { spp: 21, max_depth: 5, aovs: aovs::all(), ..Settings::default() }
}

fn session(settings: Settings) -> Session {
    Session::new(&default_scene(), size(SIZE), settings).expect("the scene makes sense")
}

fn rendered(settings: &Settings, threads: usize, tile_size: u32) -> Session {
    let mut session = session(settings.clone());
    let (progress, statistics) = session.render(threads, tile_size, &Silent).expect("it renders");
    assert_eq!(progress, Outcome::Finished);
    assert_eq!(statistics.samples, session.film().samples());
    assert_eq!(session.film().invalid_samples().count(), 0);
    session
}

/// Returns the bytes of the EXR file of an image.
fn exr(session: &Session) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join("image.exr");
    image::save(&session.image(), &path, &SaveOptions::default()).expect("the folder is writable");
    std::fs::read(&path).expect("it was written")
}

fn adaptive() -> Settings {
    Settings { adaptive: Some(Adaptive { batch: 8, tolerance: 0.2 }), spp: 50, ..base() }
}

/// Settings with path reuse, in groups that cross the borders of tiles and regions.
fn reusing(reuse: u32) -> Settings {
    Settings { reuse, ..adaptive() }
}

/// Settings with path splitting, and with shadow rays that fill their queue during a bounce.
fn splitting() -> Settings {
    Settings { split: 4, light_samples: 4, ..base() }
}

/// Settings with an error target.
fn to_target(reuse: u32) -> Settings {
    let target = Target { error: Some(0.35), ..Target::NONE };
    Settings { target: Some(target), spp: 1 << 16, reuse, ..base() }
}

/// Settings with half buffers, of which the first has one sample more.
fn in_halves() -> Settings {
    let halves = [Aov::HalfA, Aov::HalfB];
    Settings { aovs: aovs::all().into_iter().chain(halves).collect(), ..base() }
}

#[test]
fn threads_and_tiles_do_not_change_a_bit() {
    let clamp = Clamp { direct: 0.7, indirect: 0.2 };
    let splitting = Settings { split: 4, ..adaptive() };
    let clamping = Settings { clamp, ..base() };
    let in_two = [to_target(1), to_target(4), in_halves()];
    for settings in
        [base(), adaptive(), clamping, splitting, reusing(2), reusing(4)].into_iter().chain(in_two)
    {
        let reference = rendered(&settings, 1, 32);
        let bytes = exr(&reference);
        for threads in [1, 2, 3, 7] {
            for tile_size in [7, 16, 32, 1000] {
                let other = rendered(&settings, threads, tile_size);
                let what = format!("{threads} threads, tiles of {tile_size}");
                assert!(other.film() == reference.film(), "{what}");
                assert!(exr(&other) == bytes, "{what}: the files differ");
            }
        }
    }
}

#[test]
fn every_integrator_gives_the_same_bits_on_several_threads() {
    for registration in INTEGRATORS {
        let settings = Settings { integrator: registration.name.to_owned(), spp: 5, ..base() };
        let (one, three) = (rendered(&settings, 1, 32), rendered(&settings, 3, 8));
        assert!(one.film() == three.film(), "{}", registration.name);
    }
}

/// Parts of the samples, each rendered separately, merge to the whole in any order and grouping.
#[test]
fn parts_of_the_samples_add_up_to_the_whole() {
    let of = |integrator: &str| Settings { integrator: integrator.into(), ..base() };
    let zsobol = Settings { sampler: SamplerKind::ZSobol, layout: Some(21), ..base() };
    let reusing = Settings { reuse: 4, ..base() };
    for settings in [base(), zsobol, reusing, splitting(), of("volpath"), of("cs184")] {
        let part = |from: u32, to: u32| {
            let mut session = session(Settings { spp: to, ..settings.clone() });
            let empty = Film::with_aovs(Region::full(SIZE), &settings.aovs);
            session.go_on_from(empty.starting_at(from));
            session.render(2, 16, &Silent).expect("it renders");
            session.film().clone()
        };
        let whole = part(0, 21);
        assert!(&whole == rendered(&settings, 1, 32).film(), "{settings:?}");
        let parts = [part(0, 1), part(1, 17), part(17, 21)];
        let sum = |films: [&Film; 2]| {
            let mut sum = films[0].clone();
            sum.merge(films[1]);
            sum
        };
        let [a, b, c] = &parts;
        for all in [sum([&sum([a, b]), c]), sum([c, &sum([b, a])]), sum([&sum([c, a]), b])] {
            assert!(all == whole, "{settings:?}");
        }
    }
}

/// Another seed gives another image.
#[test]
fn another_seed_is_another_image() {
    let other = Settings { seed: 1, ..base() };
    assert!(rendered(&base(), 1, 32).film() != rendered(&other, 1, 32).film());
}

/// Stops a render once `after` samples are taken.
struct StopAfter {
    after: u64,
    stopped: AtomicBool,
}

impl Observer for StopAfter {
    fn progress(&self, advance: &ProgressUpdate) {
        if advance.done >= self.after {
            self.stopped.store(true, Ordering::Relaxed);
        }
    }

    fn cancelled(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}

/// A render that is stopped several times, at any point, and continued equals the uninterrupted
/// one.
#[test]
fn a_pause_does_not_change_a_bit() {
    for settings in [base(), adaptive(), reusing(4), to_target(1), in_halves()] {
        let whole = rendered(&settings, 2, 16);
        let mut paused = session(settings);
        let mut film = Film::new(Region::full(SIZE));
        for (threads, after) in [(1, 1), (2, 3000), (3, 500), (2, 9000)] {
            let observer = StopAfter { after, stopped: AtomicBool::new(false) };
            let (progress, _) = paused.render(threads, 7, &observer).expect("it renders");
            assert_eq!(progress, Outcome::Cancelled, "after {after} samples");
            assert!(paused.film().samples() >= film.samples(), "nothing is lost");
            film.clone_from(paused.film());
        }
        assert!((1..whole.film().samples()).contains(&film.samples()));
        paused.render(2, 32, &Silent).expect("it renders");
        assert!(paused.film() == whole.film());
    }
}

/// Largest number of completed samples that an observer received, and the total.
#[derive(Default)]
struct Listener(Mutex<(u64, u64)>);

impl Observer for Listener {
    fn progress(&self, advance: &ProgressUpdate) {
        let mut most = self.0.lock().expect("no thread panics");
        *most = (most.0.max(advance.done), advance.total());
    }
}

/// Progress ends at the total, whatever the film contained before and however many samples adaptive
/// sampling saved.
#[test]
fn progress_ends_at_the_whole() {
    for settings in [base(), adaptive(), to_target(1)] {
        let mut session = session(settings);
        let observer = StopAfter { after: 2000, stopped: AtomicBool::new(false) };
        session.render(2, 7, &observer).expect("it renders");
        for _ in 0..2 {
            let listener = Listener::default();
            session.render(2, 7, &listener).expect("it renders");
            let (done, total) = *listener.0.lock().expect("no thread panics");
            assert!(done == total && total > 0, "{done} of {total}");
        }
    }
}

/// A complete film does not change.
#[test]
fn rendering_again_adds_nothing() {
    let mut session = rendered(&base(), 2, 16);
    let film = session.film().clone();
    let (_, statistics) = session.render(2, 16, &Silent).expect("it renders");
    assert!(statistics.samples == 0 && *session.film() == film);
}

/// A part of the image is that part of the whole image, and parts merge to the whole.
#[test]
fn regions_are_parts_of_the_image() {
    for settings in [base(), reusing(4), splitting()] {
        let whole = rendered(&settings, 2, 16);
        let mut merged = Film::with_aovs(Region::full(SIZE), &aovs::all());
        for tile in Region::full(SIZE).tiles(19, [0; 2]) {
            let part = rendered(&Settings { region: Some(tile), ..settings.clone() }, 2, 7);
            let is_part = |[x, y]: [u32; 2]| part.film().pixel(x, y) == whole.film().pixel(x, y);
            assert!(tile.pixels().all(is_part), "{tile:?}");
            merged.merge(part.film());
        }
        assert!(merged == *whole.film());
    }
}
