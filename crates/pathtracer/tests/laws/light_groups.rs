//! Light groups: their sum is the image, and each group has the light of its lights.

use std::sync::atomic::{AtomicU32, Ordering};

use pathtracer::image::Samples;
use pathtracer::{
    Adaptive, Aov, Clamp, DirectLight, Film, Filter, INTEGRATORS, LightGroup, LightGroups,
    Observer, Outcome, Region, RenderError, Scene, Session, Settings, Silent, Target, groups,
    light_groups,
};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::{Plastic, Surface};
use pt_scene::{Daylight, LightKind, shapes};
use pt_testing::{Estimates, z_test};

use crate::hidden::hidden;
use crate::media::foggy_room;
use crate::motion::under_flying_lamps;
use crate::portal::behind_a_window;
use crate::reuse::everything;
use crate::scenes::{Builder, camera, cornell, facing, looking, matte, size, under_a_sky};

const SIZE: [u32; 2] = [16, 12];

const EACH: LightGroups = LightGroups { named: Vec::new(), each: true };

/// Light groups with the lights of these names.
fn named(groups: &[(&str, &[&str])]) -> LightGroups {
    let group = |&(name, lights): &(&str, &[&str])| {
        let lights = lights.iter().map(|&light| light.to_owned()).collect();
        LightGroup { name: name.to_owned(), lights }
    };
    LightGroups { named: groups.iter().map(group).collect(), each: false }
}

fn rendered(scene: &Scene, settings: Settings) -> Session {
    let mut session = Session::new(scene, size(SIZE), settings).expect("the scene makes sense");
    session.render(2, 8, &Silent).expect("the settings make sense");
    session
}

/// Radiance of each group with its name: red, green and blue of all pixels.
fn parts(film: &Film) -> Vec<(String, Vec<[f32; 3]>)> {
    let channels = groups::channels(film);
    let values = |samples: &Samples| match samples {
        Samples::Real(values) => values.clone(),
        Samples::Whole(_) => panic!("light is real"),
    };
    let part = |name: &String, channels: &[pathtracer::image::Channel]| {
        let [r, g, b] = [0, 1, 2].map(|c| values(&channels[c].samples));
        let names = ["R", "G", "B"].map(|c| format!("light_{name}.{c}"));
        assert!(channels.iter().map(|channel| &channel.name).eq(&names));
        (name.clone(), (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect())
    };
    film.light_groups().iter().zip(channels.chunks(3)).map(|(n, c)| part(n, c)).collect()
}

/// Asserts that the sum of all groups is the image, and that the image is that without groups.
fn assert_parts_are_the_whole(scene: &Scene, settings: &Settings, what: &str) {
    let whole = rendered(scene, settings.clone());
    let split = rendered(scene, Settings { light_groups: Some(EACH), ..settings.clone() });
    assert!(whole.film().pixels().eq(split.film().pixels()), "{what}: {settings:?}");
    let image = split.image();
    let parts = parts(split.film());
    for (i, pixel) in image.pixels.iter().enumerate() {
        for c in 0..3 {
            let sum: f64 = parts.iter().map(|(_, part)| f64::from(part[i][c])).sum();
            let most: f64 = parts.iter().map(|(_, part)| f64::from(part[i][c].abs())).sum();
            let error = (sum - f64::from(pixel[c])).abs();
            assert!(error <= 1e-5 * most + 1e-9, "{what}, pixel {i}: {sum} and {}", pixel[c]);
        }
    }
    let (name, rest) = parts.last().expect("there is a rest");
    assert_eq!(name, light_groups::REST);
    assert!(rest.iter().all(|pixel| *pixel == [0.0; 3]), "{what}: each light is in its group");
}

fn integrators() -> impl Iterator<Item = &'static str> {
    INTEGRATORS.iter().filter(|known| known.new_traced.is_some()).map(|known| known.name)
}

#[test]
fn groups_are_together_the_image() {
    let scenes = [
        ("a box", cornell()),
        ("a sky", under_a_sky()),
        ("fog", foggy_room()),
        ("lamps that fly", under_flying_lamps()),
        ("holes and many materials", everything()),
        ("lights of all kinds", colored()),
        ("many lights", many(30)),
        ("sun and sky", under_the_sun()),
        ("lights that nobody sees", hidden(colored())),
        ("many lights that nobody sees", hidden(many(30))),
        ("skies behind a window", behind_a_window()),
    ];
    for (what, scene) in &scenes {
        for integrator in integrators() {
            for (direct, light_samples) in [(DirectLight::Mis, 1), (DirectLight::Light, 2)] {
                let integrator = integrator.to_owned();
                let base = Settings { spp: 5, max_depth: 5, ..Settings::default() };
                let settings = Settings { integrator, direct, light_samples, ..base };
                assert_parts_are_the_whole(scene, &settings, what);
            }
        }
    }
    let base = Settings { spp: 9, max_depth: 4, ..Settings::default() };
    let clamp = Clamp { direct: 0.3, indirect: 0.1 };
    for settings in [
        Settings { clamp, ..base.clone() },
        Settings { filter: Filter::MITCHELL, ..base.clone() },
        Settings { min_bounce: 2, max_bounce: 3, ..base },
    ] {
        assert_parts_are_the_whole(&colored(), &settings, "lights of all kinds");
    }
}

/// Settings with different numbers of samples per pixel, or half buffers, or both.
fn uneven() -> [Settings; 4] {
    let base = Settings { spp: 60, max_depth: 4, ..Settings::default() };
    let target = Target { error: Some(0.01), white: 30.0, ..Target::NONE };
    let noise = Target { noise: Some(0.01), white: 30.0, ..Target::NONE };
    [
        Settings { adaptive: Some(Adaptive { batch: 4, tolerance: 0.3 }), ..base.clone() },
        Settings { aovs: vec![Aov::HalfA, Aov::HalfB], spp: 5, ..base.clone() },
        Settings { target: Some(target), spp: 1 << 12, ..base.clone() },
        Settings { target: Some(noise), spp: 1 << 12, filter: Filter::MITCHELL, ..base },
    ]
}

#[test]
fn groups_are_together_the_image_however_many_samples_pixels_have() {
    for settings in uneven() {
        for integrator in integrators() {
            let settings = Settings { integrator: integrator.to_owned(), ..settings.clone() };
            assert_parts_are_the_whole(&colored(), &settings, "lights of all kinds");
            assert_parts_are_the_whole(&many(30), &settings, "many lights");
        }
    }
    for settings in uneven().iter().filter(|settings| settings.aovs.is_empty()) {
        let film = rendered(&colored(), settings.clone()).film().clone();
        assert_eq!(film.uniform_spp(), None, "pixels have different numbers: {settings:?}");
    }
}

/// Neither threads nor tiles nor batches nor stops change a bit of the groups of a film.
#[test]
fn groups_are_the_same_to_the_bit_however_work_is_shared_out() {
    let scene = colored();
    let even = Settings { spp: 21, max_depth: 4, ..Settings::default() };
    for settings in [even].into_iter().chain(uneven()) {
        let settings = Settings { light_groups: Some(EACH), ..settings };
        let new = || Session::new(&scene, size(SIZE), settings.clone()).expect("it compiles");
        let mut one = new();
        one.render(1, 32, &Silent).expect("it renders");
        let mut stopped = new();
        let mut stops = 0;
        let render = |session: &mut Session, stops: u32| {
            let seen = AtomicU32::new(0);
            let (progress, _) = session.render(3, 5, &Stop { seen, after: 20 * stops })?;
            Ok::<_, RenderError>(progress)
        };
        while render(&mut stopped, stops).expect("it renders") == Outcome::Cancelled {
            let mut bytes = Vec::new();
            stopped.film().write(&mut bytes).expect("memory takes all");
            stopped = new();
            stopped.go_on_from(Film::read(&bytes).expect("it is one"));
            stops += 1;
        }
        assert!(stops > 2 && stopped.film() == one.film(), "{stops} stops: {settings:?}");
    }
}

/// Stops a render after a number of calls.
struct Stop {
    seen: AtomicU32,
    after: u32,
}

impl Observer for Stop {
    fn cancelled(&self) -> bool {
        self.seen.fetch_add(1, Ordering::Relaxed) >= self.after
    }
}

/// Films of parts of the samples and of the pixels merge to the whole, including the groups.
#[test]
fn groups_of_parts_add_up_to_those_of_the_whole() {
    let scene = colored();
    let settings =
        Settings { spp: 9, max_depth: 4, light_groups: Some(EACH), ..Settings::default() };
    let whole = rendered(&scene, settings.clone());
    let part = |region: Region, from: u32, to: u32| {
        let settings = Settings { spp: to, region: Some(region), ..settings.clone() };
        let settings = Settings { layout: Some(9), ..settings };
        let mut session = Session::new(&scene, size(SIZE), settings).expect("it compiles");
        session.start_at(from);
        session.render(2, 4, &Silent).expect("it renders");
        session.film().clone()
    };
    let all = Region::full(SIZE);
    let empty = Film::new(all).with_light_groups(whole.film().light_groups());
    let mut sum = empty.starting_at(9);
    for (from, to) in [(5, 9), (0, 2), (2, 5)] {
        for region in all.tiles(7, [2, 0]).into_iter().rev() {
            sum.merge(&part(region, from, to));
        }
    }
    assert!(sum == *whole.film());
}

/// A clear sky with its sun, and a second sun.
fn under_the_sun() -> Scene {
    let sun = LightKind::DistantDisk { irradiance: [0.5, 0.2, 0.0], angular_radius: 9.0 };
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), matte([0.5; 3]))
        .sphere(DVec3::new(0.3, 0.4, 0.0), 0.4, grey())
        .light(LightKind::Daylight(Daylight::default()), DAffine3::IDENTITY)
        .light(sun, looking(DVec3::ZERO, DVec3::new(0.3, -1.0, 0.4)))
        .seen_by(camera(DVec3::new(0.0, 1.5, 4.0), DVec3::ZERO, [40.0; 2]))
}

const COLORS: [[f32; 3]; 3] = [[9.0, 0.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 9.0]];

/// A glossy surface.
fn grey() -> Surface {
    let (diffuse, specular) = ([0.4; 3].into(), [0.05; 3].into());
    Plastic { diffuse, specular, alpha: 0.3, two_sided: false }.into()
}

/// A grey room without a ceiling, with lights of all kinds, in turn red, green and blue: emissive
/// shapes, squares, point lights, spot lights, and directional lights; the environment is white.
fn colored() -> Scene {
    let place = |i: usize| DVec3::new(i as f64 * 0.3 - 1.2, 1.8, 0.4 * (i % 3) as f64 - 0.5);
    let down = |i: usize| looking(place(i), place(i) - DVec3::Y);
    let square = |i: usize| LightKind::Area { radiance: COLORS[i % 3] };
    let scale = DAffine3::from_scale(DVec3::splat(0.2));
    let aside = DAffine3::from_translation(DVec3::X * 0.2);
    let mut builder = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), matte([0.5; 3]))
        .sphere(DVec3::new(0.3, 0.4, 0.0), 0.4, grey())
        .sky(0.1);
    for (i, intensity) in COLORS.into_iter().enumerate() {
        let spot = LightKind::Spot { intensity, falloff_angle: 90.0, falloff_exponent: 0.5 };
        builder = builder
            .emissive_sphere(place(i), 0.05, 1.0)
            .emissive_mesh(shapes::cube(), down(i + 3) * scale * scale, grey(), 1.0)
            .light(square(i), down(i + 6) * scale)
            .light(LightKind::Point { intensity }, down(i + 1))
            .light(spot, aside * down(i + 4))
            .light(LightKind::Directional { irradiance: intensity }, down(i));
    }
    let mut scene = builder.seen_by(camera(DVec3::new(0.0, 1.5, 4.0), DVec3::ZERO, [40.0; 2]));
    let mut emissive = scene.materials.iter_mut().skip(2);
    for color in COLORS {
        emissive.next().expect("a sphere").emission = color.into();
        emissive.next().expect("a cube").emission = color.into();
    }
    scene
}

/// `count` point lights, emissive squares and balls, enough for a light tree.
fn many(count: u32) -> Scene {
    let mut builder = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), matte([0.5; 3]))
        .sphere(DVec3::new(0.3, 0.4, 0.0), 0.4, grey());
    for i in 0..count {
        let place = DVec3::new(f64::from(i % 10) * 0.3 - 1.4, 1.5, f64::from(i / 10) * 0.3 - 1.4);
        let intensity = COLORS[i as usize % 3].map(|x| 0.02 * x);
        builder = builder
            .emissive_quad(facing(place, DVec3::NEG_Y, 0.02), 1.0)
            .emissive_sphere(place + DVec3::Y * 0.2, 0.02, 1.0)
            .light(LightKind::Point { intensity }, looking(place + 0.1, place));
    }
    let mut scene = builder.seen_by(camera(DVec3::new(0.0, 1.5, 4.0), DVec3::ZERO, [40.0; 2]));
    for (i, material) in scene.materials.iter_mut().skip(2).enumerate() {
        material.emission = COLORS[i / 2 % 3].into();
    }
    scene
}

/// Names all lights of a scene by their colours, and the groups of these names.
fn by_color(scene: &mut Scene) -> LightGroups {
    let name = |[r, g, b]: [f32; 3], n: usize| match (r > 0.0, g > 0.0, b > 0.0) {
        (true, false, false) => format!("red {n}"),
        (false, true, false) => format!("green {n}"),
        (false, false, true) => format!("blue {n}"),
        _ => format!("other {n}"),
    };
    let mut names = Vec::new();
    for (n, object) in scene.objects.iter_mut().enumerate() {
        let material = object.materials[0].expect("it has one");
        let emission = &scene.materials[material as usize].emission;
        let pt_scene::texture::Input::Value(emission) = emission else { panic!("{emission:?}") };
        object.name = name(*emission, n);
        names.push(object.name.clone());
    }
    for (n, light) in scene.lights.iter_mut().enumerate() {
        light.name = match light.kind {
            LightKind::Point { intensity } | LightKind::Spot { intensity, .. } => {
                name(intensity, 1000 + n)
            }
            LightKind::Area { radiance: color } | LightKind::Directional { irradiance: color } => {
                name(color, 1000 + n)
            }
            _ => String::new(),
        };
        names.push(light.name.clone());
    }
    let of = |color: &str| -> Vec<&str> {
        names.iter().filter(|name| name.starts_with(color)).map(String::as_str).collect()
    };
    named(&[("red", &of("red")), ("green", &of("green")), ("blue", &of("blue"))])
}

/// All surfaces are grey, so that the light of red lights is red.
#[test]
fn each_group_has_the_light_of_its_lights_alone() {
    for (scene, has_sky) in [(colored(), true), (many(30), false)] {
        let mut scene = scene;
        let light_groups = by_color(&mut scene);
        for integrator in integrators() {
            let settings = Settings {
                spp: 16,
                max_depth: 4,
                integrator: integrator.to_owned(),
                light_groups: Some(light_groups.clone()),
                ..Settings::default()
            };
            let parts = parts(rendered(&scene, settings).film());
            let sum =
                |part: &[[f32; 3]], c: usize| part.iter().map(|p| f64::from(p[c])).sum::<f64>();
            for (c, (name, part)) in parts.iter().take(3).enumerate() {
                assert!(sum(part, c) > 1.0, "{integrator}: {name} has light");
                let others = part.iter().map(|p| p[(c + 1) % 3].max(p[(c + 2) % 3]));
                assert_eq!(
                    others.fold(0.0, f32::max),
                    0.0,
                    "{integrator}: {name} is of one colour"
                );
            }
            let (_, rest) = &parts[3];
            assert_eq!(sum(rest, 0) > 0.0, has_sky, "{integrator}: the sky is the rest");
            assert!(rest.iter().all(|p| p[0] == p[1] && p[1] == p[2]), "{integrator}: it is white");
        }
    }
}

/// Removes all lights of a scene except those of this name.
fn without_others(scene: &Scene, name: &str) -> Scene {
    let mut scene = scene.clone();
    scene.lights.to_mut().retain(|light| light.name == name);
    for object in scene.objects.iter().filter(|object| object.name != name) {
        for number in object.materials.iter().flatten() {
            scene.materials[*number as usize].emission = [0.0; 3].into();
        }
    }
    scene
}

/// Mean of each pixel and of all pixels over many seeds, of the sum of red, green and blue, with
/// their variances.
fn means(seeds: u32, render: impl Fn(u32) -> Vec<[f32; 3]>) -> [Vec<f32>; 2] {
    let mut sums: Vec<[f64; 2]> = Vec::new();
    for seed in 0..seeds {
        let pixels = render(seed);
        let light = pixels.iter().map(|rgb| rgb.iter().copied().map(f64::from).sum::<f64>());
        let mut values: Vec<f64> = light.collect();
        values.push(values.iter().sum::<f64>() / values.len() as f64);
        sums.resize(values.len(), [0.0; 2]);
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum = [sum[0] + value, sum[1] + value * value];
        }
    }
    let n = f64::from(seeds);
    let variance = |[sum, squares]: [f64; 2]| (squares / n - (sum / n).powi(2)) / (n - 1.0);
    [
        sums.iter().map(|[sum, _]| (sum / n) as f32).collect(),
        sums.iter().map(|sums| variance(*sums) as f32).collect(),
    ]
}

/// Over many seeds, each pixel of a group has the mean of that pixel in a render without the other
/// lights; also if an error target, which depends on the light of all groups, determines the
/// numbers of samples.
#[test]
fn a_group_is_what_its_lights_would_give_alone() {
    const SEEDS: u32 = 200;
    let down = |x: f64| looking(DVec3::new(x, 1.5, 0.3), DVec3::new(x, 0.0, 0.3));
    let sun = LightKind::DistantDisk { irradiance: [0.5; 3], angular_radius: 20.0 };
    let mut scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), grey())
        .sphere(DVec3::new(0.3, 0.4, 0.0), 0.4, grey())
        .emissive_sphere(DVec3::new(-0.7, 0.8, 0.0), 0.2, 3.0)
        .light(LightKind::Point { intensity: [1.0; 3] }, down(0.6))
        .sky(0.3)
        .light(sun, looking(DVec3::ZERO, DVec3::new(0.3, -1.0, 0.4)))
        .seen_by(camera(DVec3::new(0.0, 1.5, 4.0), DVec3::ZERO, [40.0; 2]));
    scene.objects[2].name = "ball".into();
    scene.lights[0].name = "bulb".into();
    scene.lights[1].name = "sky".into();
    scene.lights[2].name = "sun".into();
    let target = Target { error: Some(0.3), ..Target::NONE };
    for (integrator, target) in
        integrators().map(|name| (name, None)).chain([("path", Some(target))])
    {
        let settings = |seed: u32| {
            let (integrator, spp) = (integrator.to_owned(), 8);
            Settings { spp, max_depth: 4, seed, integrator, ..Settings::default() }
        };
        let together = |seed: u32| {
            let spp = if target.is_some() { 1 << 12 } else { 8 };
            let settings = Settings { target, spp, light_groups: Some(EACH), ..settings(seed) };
            parts(rendered(&scene, settings).film())
        };
        let together: Vec<_> = (0..SEEDS).map(together).collect();
        for (group, name) in ["sky", "sun", "bulb", "ball"].into_iter().enumerate() {
            assert_eq!(together[0][group].0, name);
            let alone = without_others(&scene, name);
            let [mean, variance] = means(SEEDS, |seed| together[seed as usize][group].1.clone());
            let [want, of_want] = means(SEEDS, |seed| {
                rendered(&alone, settings(1000 + seed)).image().pixels.into_vec()
            });
            assert!(mean.last().is_some_and(|mean| *mean > 0.03), "{name} gives light");
            let estimates = Estimates { mean: &mean, variance: &variance };
            z_test(estimates, Estimates { mean: &want, variance: &of_want }, 1e-3)
                .unwrap_or_else(|e| panic!("{name} by {integrator}, {target:?}: {e}"));
        }
    }
}

#[test]
fn groups_that_make_no_sense_are_refused() {
    let scene = colored();
    let new = |groups| {
        let settings = Settings { light_groups: Some(groups), ..Settings::default() };
        Session::new(&scene, size(SIZE), settings).err().map(|error| error.to_string())
    };
    let refused = |groups, why: &str| {
        let message = new(groups).expect("it is refused");
        assert!(message.contains(why), "{message}");
    };
    refused(
        named(&[("a", &["lamp"])]),
        "unknown light \"lamp\"; the lights of the scene are \"sky\"",
    );
    refused(
        named(&[("a", &["lights 1"])]),
        "\"lights 1\" (did you mean \"light 1\" or \"light 10\" or \"light 11\"?); the",
    );
    refused(named(&[("a", &["sky"]), ("b", &["sky"])]), "\"sky\" in two groups");
    assert_eq!(new(named(&[("a", &["sky", "light 1"]), ("b", &[])])), None);
    let many = Session::new(
        &many(90),
        size(SIZE),
        Settings { light_groups: Some(EACH), ..Settings::default() },
    );
    assert!(many.is_err_and(|error| error.to_string().contains("expected at most 128")));
    let base = Settings { light_groups: Some(EACH), spp: 1, ..Settings::default() };
    for settings in [
        Settings { reuse: 2, ..base.clone() },
        Settings { split: 2, ..base.clone() },
        Settings { direct: DirectLight::UniformHemisphere, ..base.clone() },
        Settings { integrator: "ao".into(), ..base },
    ] {
        let mut session = Session::new(&scene, size(SIZE), settings).expect("it compiles");
        let refused = session.render(1, 8, &Silent);
        assert!(matches!(refused, Err(RenderError::NoLightGroups(_))), "{refused:?}");
    }
}
