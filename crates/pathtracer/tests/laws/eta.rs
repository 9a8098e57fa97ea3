//! Accuracy of the estimated end of a render. The clock counts rays, so that the estimate is tested
//! and not the machine.

use std::sync::Mutex;

use pathtracer::eta::{Eta, TimeRemaining};
use pathtracer::{
    Adaptive, CompileOptions, Observer, ProgressUpdate, Scene, Session, Settings, default_scene,
};

use crate::media::fog;
use crate::scenes::{cornell, size, under_a_sky};

const MILLION: f64 = 1e6;

/// Observer that records the estimates and their times, from a tenth of the samples on.
struct Prophet(Mutex<(Eta, Vec<(f64, TimeRemaining)>)>);

impl Observer for Prophet {
    fn progress(&self, advance: &ProgressUpdate) {
        let (eta, reported) = &mut *self.0.lock().expect("no thread panics");
        let time = advance.rays as f64 / MILLION;
        eta.expect(advance.estimated_totals);
        eta.mark(time, advance.done);
        if advance.done * 10 >= advance.total() {
            reported.extend(eta.left().map(|left| (time, left)));
        }
    }
}

/// Number of estimates whose interval contains the end, number of all estimates, and mean width of
/// the intervals as a fraction of the whole time.
fn foresight(scene: &Scene, settings: &Settings) -> (usize, usize, f64) {
    let options: CompileOptions = size([120, 90]);
    let mut session = Session::new(scene, options, settings.clone()).expect("it makes sense");
    let total = 120 * 90 * u64::from(settings.spp);
    let prophet =
        Prophet(Mutex::new((Eta::new(0, total, settings.adaptive.is_some()), Vec::new())));
    let (_, statistics) = session.render(1, 12, &prophet).expect("it renders");
    let end = statistics.rays as f64 / MILLION;
    let (_, reported) = prophet.0.into_inner().expect("no thread panics");
    let inside =
        |&&(at, left): &&(f64, TimeRemaining)| (at + left.least..=at + left.most).contains(&end);
    let width: f64 = reported.iter().map(|(_, left)| (left.most - left.least) / end).sum();
    (reported.iter().filter(inside).count(), reported.len(), width / reported.len() as f64)
}

#[test]
fn from_a_tenth_on_the_end_is_foreseen_nine_times_of_ten() {
    let plain = Settings { spp: 80, max_depth: 6, ..Settings::default() };
    let adaptive = Adaptive { batch: 16, tolerance: 0.1 };
    let adaptive = Settings { adaptive: Some(adaptive), spp: 200, ..plain.clone() };
    let in_fog = Settings { integrator: "volpath".into(), spp: 40, ..plain.clone() };
    let few = Settings { spp: 12, ..plain.clone() };
    let (mut inside, mut all) = (0, 0);
    for (name, scene, settings) in [
        ("a Cornell box", default_scene(), plain.clone()),
        ("few samples", default_scene(), few),
        ("adaptive", default_scene(), adaptive),
        ("a room", cornell(), plain.clone()),
        ("sky", under_a_sky(), plain),
        ("fog", fog(), in_fog),
    ] {
        let (right, reported, width) = foresight(&scene, &settings);
        println!("{name}: {right} of {reported}, {width:.3} of the time wide");
        assert!(reported > 20, "{name}");
        (inside, all) = (inside + right, all + reported);
    }
    assert!(inside * 10 >= all * 9, "{inside} of {all}");
}
