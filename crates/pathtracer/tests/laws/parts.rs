//! Renders in parts: rectangles and ranges of samples, in any order, make the film of one render.

use pathtracer::{
    Adaptive, Aov, Film, LightGroups, Outcome, Part, Region, Session, Settings, Silent, Target,
};
use pt_testing::Random;

use crate::scenes::{cornell, size};

const SIZE: [u32; 2] = [19, 14];

fn session(settings: &Settings) -> Session {
    Session::new(&cornell(), size(SIZE), settings.clone()).expect("the scene makes sense")
}

fn whole(settings: &Settings) -> Film {
    let mut session = session(settings);
    let (outcome, _) = session.render(2, 8, &Silent).expect("it starts");
    assert_eq!(outcome, Outcome::Finished);
    session.into_film()
}

/// The film as another process would read it.
fn sent(film: &Film) -> Film {
    let mut bytes = Vec::new();
    film.write(&mut bytes).expect("there is memory");
    Film::read(&bytes).expect("they are those of a film")
}

/// Renders ranges of samples of squares, squares in random order, and merges them.
fn merged(settings: &Settings) -> Film {
    let mut head = session(settings);
    let worker = session(settings);
    assert!(!head.is_continued());
    let mut parts = head.parts(5);
    let mut random = Random::new(1);
    parts.sort_by_cached_key(|_| random.bits());
    for (start, end) in [(0, 3), (3, 16), (16, settings.spp)] {
        for Part { region, wanted, .. } in &parts {
            assert_eq!(*wanted, settings.spp);
            let mut film = worker.film_from(*region, start);
            worker.advance(&mut film, end, (1, 4), &Silent).expect("it starts");
            let film = sent(&film);
            assert!(head.film().is_continued_by(&film));
            head.film_mut().merge(&film);
            assert!(!head.film().is_continued_by(&film), "it is counted once");
        }
    }
    assert!(head.parts(5).iter().all(|part| part.missing == 0 && part.taken == part.wanted));
    head.into_film()
}

/// Continues squares of the film, a few samples at a time, and puts them back.
fn continued(settings: &Settings) -> Film {
    let mut head = session(settings);
    let worker = session(settings);
    assert!(head.is_continued());
    let has_target = settings.target.is_some();
    while !has_target || head.plan_round(2).expect("it starts") {
        let mut parts = head.parts(5);
        parts.reverse();
        for Part { region, mut taken, wanted, .. } in parts {
            while taken < wanted {
                taken = (taken + 7).min(wanted);
                let mut part = sent(&head.film().part(region));
                worker.advance(&mut part, taken, (1, 4), &Silent).expect("it starts");
                let part = sent(&part);
                if head.film().is_extended_by(&part) {
                    head.film_mut().put_back(&part);
                    assert!(!head.film().is_extended_by(&part), "it is counted once");
                }
            }
        }
        if !has_target {
            break;
        }
    }
    head.into_film()
}

#[test]
fn ranges_of_samples_of_rectangles_make_the_film_of_one_render() {
    let all = Settings { spp: 21, seed: 3, ..Settings::default() };
    let clamp = pathtracer::Clamp { direct: 1.0, indirect: 0.5 };
    let aovs = vec![Aov::Alpha, Aov::Depth, Aov::from_name("cryptomatte_object").expect("one")];
    let light_groups = Some(LightGroups { each: true, ..LightGroups::default() });
    let region = Some(Region { x: 3, y: 2, width: 12, height: 11 });
    for settings in [
        Settings { aovs, light_groups, ..all.clone() },
        Settings { reuse: 2, clamp, ..all.clone() },
        Settings { region, sampler: pathtracer::SamplerKind::Stratified, ..all },
    ] {
        assert!(merged(&settings) == whole(&settings), "{settings:?}");
    }
}

#[test]
fn continued_rectangles_make_the_film_of_one_render() {
    let all = Settings { spp: 200, ..Settings::default() };
    let target = |error, uniform| Some(Target { error: Some(error), uniform, ..Target::NONE });
    let half = Aov::from_name("half_a").expect("it is one");
    for settings in [
        Settings { target: target(0.3, false), reuse: 2, ..all.clone() },
        Settings { target: target(0.1, true), ..all.clone() },
        Settings { spp: 21, aovs: vec![half], ..all.clone() },
        Settings { adaptive: Some(Adaptive { batch: 8, tolerance: 0.3 }), ..all },
    ] {
        let (parts, whole) = (continued(&settings), whole(&settings));
        assert!(whole.samples() > 0 && parts == whole, "{settings:?}");
    }
}
