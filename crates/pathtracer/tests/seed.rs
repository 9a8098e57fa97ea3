//! Figures of a report on the course's program, compared with a second path tracer.
//!
//! [`pt_testing::course`] contains the scenes, as COLLADA and in its own form, and the second path
//! tracer, which shares no code with this one. For each figure of the report, both render its
//! options in the course's mode and at the size of the report, and the means of blocks of 120 × 120
//! pixels must agree within their standard errors. The variance of our means is estimated from four
//! renders with different seeds, that of the second path tracer from the differences between
//! samples of small cells of the block.

use std::path::{Path, PathBuf};

use pathtracer::compat::cs184;
use pathtracer::{
    Adaptive, CompileOptions, DirectLight, EnvironmentMap, FORMATS, LoadOptions, Region, Roulette,
    SamplerKind, Scene, Session, Settings, Silent,
};
use pt_math::DVec3;
use pt_testing::Random;
use pt_testing::course::{BoxContent, CourseLight, Eye, Map, Plan, Room, World, unit};

const SIZE: [u32; 2] = [480, 360];
const BLOCK: u32 = 120;
const RENDERS: u32 = 4;
/// Of normally distributed means of 12 blocks in three channels and 60 images, one in a million
/// deviates by more; the variance from four renders is uncertain, so that the limit is doubled.
const STANDARD_ERRORS: f64 = 6.0;

fn scene(room: &Room) -> Scene {
    let format = FORMATS.iter().find(|format| format.extensions.contains(&"dae")).unwrap();
    let text = room.collada();
    let scene = format.parse(text.as_bytes(), Path::new("room.dae"), &LoadOptions::default());
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.warnings, []);
    scene
}

/// A room for both programs.
struct Both {
    world: World,
    eye: Eye,
    scene: Scene,
    /// Radius and focal distance of the lens.
    lens: Option<[f64; 2]>,
    sky: Option<Map>,
}

impl Both {
    fn new(content: BoxContent) -> Self {
        Self::of(&Room::new(content))
    }

    fn of(room: &Room) -> Self {
        let world = room.world();
        let (ahead, x_fov, aspect) = room.camera();
        let eye = Eye::of_course(&world, ahead, x_fov, aspect, SIZE);
        Self { world, eye, scene: scene(room), lens: None, sky: None }
    }

    /// Adds the lens of `-b` and `-d`.
    fn with_lens(self, [radius, focal_distance]: [f64; 2]) -> Self {
        let eye = self.eye.with_lens(radius, focal_distance);
        Self { eye, lens: Some([radius, focal_distance]), ..self }
    }

    /// Adds the environment map of `-e`.
    fn with_sky(self, map: Map) -> Self {
        let world = self.world.with_light(CourseLight::Environment(map.clone()));
        Self { world, sky: Some(map), ..self }
    }

    fn session(&self, settings: Settings) -> Session {
        let map = |Map(width, height, texels): Map| {
            EnvironmentMap::new(width as u32, height as u32, texels)
        };
        let options = CompileOptions {
            resolution: Some(SIZE),
            policies: cs184::POLICIES,
            lens_radius: self.lens.map(|[radius, _]| radius as f32),
            focal_distance: self.lens.map(|[_, distance]| distance as f32),
            environment: self.sky.clone().map(map),
            ..CompileOptions::default()
        };
        Session::new(&self.scene, options, settings).expect("a scene that can be rendered")
    }

    /// Means of the blocks and their variances, by our program.
    fn ours(&self, settings: &Settings) -> Vec<[DVec3; 2]> {
        let means: Vec<_> = (0..RENDERS)
            .map(|seed| {
                let mut session = self.session(Settings { seed, ..settings.clone() });
                session.render(0, 32, &Silent).expect("it renders");
                assert_eq!(session.film().invalid_samples().count(), 0);
                let image = session.image();
                let at = |x: u32, y: u32| image.pixels[(y * SIZE[0] + x) as usize];
                blocks()
                    .map(|block| mean(block, |x, y| DVec3::from(at(x, y).map(f64::from))))
                    .collect()
            })
            .collect();
        let of_block = |i: usize| statistics(means.iter().map(|means: &Vec<DVec3>| means[i]));
        (0..blocks().count()).map(of_block).collect()
    }

    /// Compares images of radiance with these options.
    fn check(&self, what: &str, settings: &Settings, plan: Plan, samples: u32) {
        let means = theirs(samples, |at, r| self.world.radiance(&self.eye, at, &plan, r));
        assert_equal(what, &self.ours(settings), &means);
    }
}

/// Means of the blocks and their variances, by the second path tracer, from about `samples` samples
/// of each block: two in each of its cells, whose difference gives the variance of their mean.
fn theirs(samples: u32, sample: impl Fn([f64; 2], &mut Random) -> DVec3) -> Vec<[DVec3; 2]> {
    let mut random = Random::new(7);
    let (side, size) = ((samples / 2).isqrt(), SIZE.map(f64::from));
    let cells = f64::from(side * side);
    let each = |corner: [u32; 2]| {
        let mut both = |cell: u32| {
            let cell = [cell % side, cell / side].map(f64::from);
            [(); 2].map(|()| {
                let inside = cell.map(|c| (c + unit(&mut random)) / f64::from(side));
                let at = [0, 1].map(|i| f64::from(corner[i]) + f64::from(BLOCK) * inside[i]);
                sample([at[0] / size[0], 1.0 - at[1] / size[1]], &mut random)
            })
        };
        let sums = (0..side * side).fold([DVec3::ZERO; 2], |[mean, variance], cell| {
            let [a, b] = both(cell);
            [mean + 0.5 * (a + b), variance + 0.25 * (a - b) * (a - b)]
        });
        [sums[0] / cells, sums[1] / (cells * cells)]
    };
    blocks().map(each).collect()
}

/// Upper left corners of all blocks.
fn blocks() -> impl Iterator<Item = [u32; 2]> {
    let columns = SIZE[0] / BLOCK;
    (0..columns * (SIZE[1] / BLOCK)).map(move |i| [i % columns * BLOCK, i / columns * BLOCK])
}

fn mean([x0, y0]: [u32; 2], pixel: impl Fn(u32, u32) -> DVec3) -> DVec3 {
    let sum: DVec3 = (0..BLOCK * BLOCK).map(|i| pixel(x0 + i % BLOCK, y0 + i / BLOCK)).sum();
    sum / f64::from(BLOCK * BLOCK)
}

/// Mean and its variance.
fn statistics(values: impl ExactSizeIterator<Item = DVec3>) -> [DVec3; 2] {
    let n = values.len() as f64;
    let (s1, s2) = values.fold((DVec3::ZERO, DVec3::ZERO), |(a, b), v| (a + v, b + v * v));
    let mean = s1 / n;
    [mean, ((s2 / n - mean * mean) / (n - 1.0)).max(DVec3::ZERO)]
}

fn assert_equal(what: &str, ours: &[[DVec3; 2]], theirs: &[[DVec3; 2]]) {
    let mut worst = 0.0_f64;
    for (i, ([a, va], [b, vb])) in ours.iter().zip(theirs).enumerate() {
        for c in 0..3 {
            let error = (2.0 * va[c] + vb[c]).sqrt();
            let off = (a[c] - b[c]).abs();
            worst = worst.max(off / (error + 1e-9));
            assert!(
                off <= STANDARD_ERRORS * error + 1e-6,
                "{what}: block {i} is {a} for {b}, {} standard errors",
                off / error
            );
        }
    }
    let total = |all: &[[DVec3; 2]]| all.iter().map(|[mean, _]| mean.y).sum::<f64>();
    println!(
        "{what}: {:.5} of theirs, at most {worst:.1} standard errors",
        total(ours) / total(theirs)
    );
}

/// Settings of the course's mode, and the plan of the second path tracer.
fn options(light_samples: u32, depth: u32, hemisphere: bool, spp: u32) -> (Settings, Plan) {
    let direct = if hemisphere { DirectLight::UniformHemisphere } else { DirectLight::Light };
    let settings = Settings {
        integrator: "cs184".into(),
        roulette: Roulette::Fixed(0.65),
        max_depth: depth,
        light_samples,
        direct,
        spp,
        ..Settings::default()
    };
    (settings, Plan { depth, light_samples, hemisphere, accumulate: true })
}

/// Figures 3 and 4: normals as colours.
#[test]
fn normals() {
    for content in [BoxContent::MatteBalls, BoxContent::Ring] {
        let both = Both::new(content);
        let (settings, _) = options(1, 0, false, 4);
        let settings = Settings { integrator: "normals".into(), ..settings };
        let means = theirs(6000, |at, r| both.world.normal_as_color(&both.eye, at, r));
        assert_equal("normals", &both.ours(&settings), &means);
    }
}

/// Figure 5: direct light on a mesh by 1, 4 … directions of the hemisphere, and by light samples.
#[test]
fn direct_light_of_a_mesh() {
    let both = Both::new(BoxContent::Ring);
    for hemisphere in [true, false] {
        for light_samples in [1, 4] {
            let (settings, plan) = options(light_samples, 1, hemisphere, 1);
            both.check(&format!("-l {light_samples} -H {hemisphere}"), &settings, plan, 6000);
        }
    }
}

/// Figure 7: direct, indirect and all light of matte balls.
#[test]
fn parts_of_light() {
    let both = Both::new(BoxContent::MatteBalls);
    let (settings, plan) = options(1, 5, false, 2);
    both.check("all light", &settings, plan, 6000);
    for depth in 0..=3 {
        let (settings, plan) = options(1, depth, false, 2);
        let settings = Settings {
            min_bounce: depth,
            max_bounce: depth,
            roulette: Roulette::Fixed(1.0),
            ..settings
        };
        let plan = Plan { accumulate: false, ..plan };
        both.check(&format!("-o 0 -m {depth}"), &settings, plan, 6000);
    }
}

/// Figure 8: depths.
#[test]
fn depths_of_a_mesh() {
    let both = Both::new(BoxContent::Ring);
    for depth in [0, 1, 2, 3, 100] {
        let (settings, plan) = options(1, depth, true, 1);
        both.check(&format!("-m {depth} -H"), &settings, plan, 6000);
    }
}

/// Assignment 3-2: mirror and glass, at the depths at which light through them appears.
#[test]
fn mirror_and_glass() {
    let both = Both::new(BoxContent::MirrorAndGlass);
    for depth in [0, 1, 2, 3, 4, 5, 100] {
        let (settings, plan) = options(1, depth, false, 4);
        both.check(&format!("-m {depth}"), &settings, plan, 12_000);
    }
}

/// Assignment 3-2: glass without reflection, which is black where it reflects totally.
#[test]
fn mirror_and_refraction() {
    let both = Both::new(BoxContent::MirrorAndRefraction);
    for depth in [1, 2, 3, 5] {
        let (settings, plan) = options(1, depth, false, 4);
        both.check(&format!("refraction -m {depth}"), &settings, plan, 12_000);
    }
}

/// Assignment 3-2: microfacet metals, with light samples and with hemisphere sampling.
#[test]
fn metals() {
    let both = Both::new(BoxContent::Metals);
    for (depth, hemisphere) in [(1, false), (1, true), (2, false), (5, false)] {
        let (settings, plan) = options(1, depth, hemisphere, 4);
        both.check(&format!("metals -m {depth} -H {hemisphere}"), &settings, plan, 12_000);
    }
}

fn sunlight() -> CourseLight {
    CourseLight::Directional(DVec3::new(0.5, 1.0, 2.5), DVec3::new(2.0, 1.5, 1.0))
}

/// Other lights than squares, one by one and all at once: the course's files have point lights and
/// ambient light.
#[test]
fn other_lights() {
    let point = CourseLight::Point(DVec3::new(0.3, 1.0, 0.5), DVec3::new(0.5, 1.0, 2.0));
    let ambient = CourseLight::Ambient(DVec3::new(0.5, 0.75, 1.0));
    let all = vec![point.clone(), sunlight(), ambient.clone()];
    for (what, lights) in [
        ("point", vec![point]),
        ("sun", vec![sunlight()]),
        ("ambient", vec![ambient]),
        ("all", all),
    ] {
        let both = Both::of(&Room::lit(BoxContent::MatteBalls, lights));
        for depth in [1, 3] {
            let (settings, plan) = options(2, depth, false, 2);
            both.check(&format!("{what} -m {depth}"), &settings, plan, 6000);
        }
    }
}

/// Assignment 3-2: an environment map, which camera rays and light samples find, and mirrors do
/// not.
#[test]
fn environment_map() {
    let texel = |i: u8| [f32::from(i % 5), f32::from(i % 3), f32::from(i % 7)];
    let map = Map(8, 4, (0..32).map(texel).collect());
    for content in [BoxContent::MatteBalls, BoxContent::MirrorAndGlass] {
        let both = Both::of(&Room::lit(content, vec![sunlight()])).with_sky(map.clone());
        for depth in [0, 1, 3] {
            let (settings, plan) = options(2, depth, false, 4);
            both.check(&format!("{content:?} -e -m {depth}"), &settings, plan, 12_000);
        }
    }
}

/// Assignment 3-2: a lens, in focus on the front of the room and behind it.
#[test]
fn lens() {
    for lens in [[0.2, 3.8], [0.1, 5.0]] {
        let both = Both::new(BoxContent::MatteBalls).with_lens(lens);
        let (settings, plan) = options(1, 2, false, 4);
        both.check(&format!("-b {} -d {}", lens[0], lens[1]), &settings, plan, 12_000);
    }
}

/// Figure 9: the variance of a pixel is inversely proportional to the number of its independent
/// samples, and so is the mean squared difference of two renders.
#[test]
fn samples_per_pixel() {
    let both = Both::new(BoxContent::MatteBalls);
    let noise = |spp: u32| {
        let (settings, _) = options(1, 5, false, spp);
        let [a, b] = [0, 1].map(|seed| {
            let sampler = SamplerKind::Independent;
            let mut session = both.session(Settings { seed, sampler, ..settings.clone() });
            session.render(0, 32, &Silent).expect("it renders");
            session.image().pixels
        });
        let squares = a.iter().zip(&b).map(|(a, b)| f64::from(a[1] - b[1]).powi(2));
        squares.sum::<f64>()
    };
    let one = noise(1);
    for spp in [2, 4, 16] {
        let ratio = f64::from(spp) * noise(spp) / one;
        assert!((ratio - 1.0).abs() < 0.1, "{spp} samples: {ratio}");
    }
}

/// Figure 10: the mean number of samples after which pixels stop.
#[test]
fn adaptive_sampling() {
    const MAX: u32 = 128;
    const PIXELS: u32 = 250;
    let both = Both::new(BoxContent::Ring);
    let (settings, plan) = options(1, 5, false, MAX);
    let region = Region { x: 180, y: 120, width: BLOCK, height: BLOCK };
    for (batch, tolerance) in [(16, 0.1), (32, 0.2)] {
        let adaptive = Some(Adaptive { batch, tolerance });
        let sampler = SamplerKind::Independent;
        let mut session = both.session(Settings { adaptive, sampler, ..settings.clone() });
        session.restrict(region).expect("inside of the image");
        session.render(0, 32, &Silent).expect("it renders");
        let count = |x, y| session.film().pixel(region.x + x, region.y + y).count();
        let ours = (0..BLOCK * BLOCK).map(|i| DVec3::splat(f64::from(count(i % BLOCK, i / BLOCK))));
        let [ours, our_variance] = statistics(ours.collect::<Vec<_>>().into_iter());
        let mut random = Random::new(3);
        let theirs: Vec<_> = (0..PIXELS)
            .map(|_| {
                let at = [region.x, region.y].map(|c| c + random.below(BLOCK as usize) as u32);
                // Rows are counted from below.
                let at = [at[0], SIZE[1] - 1 - at[1]];
                let rule = (MAX, batch, f64::from(tolerance));
                let view = (&both.eye, SIZE);
                let n = both.world.samples_of_pixel(view, at, &plan, rule, &mut random);
                DVec3::splat(f64::from(n))
            })
            .collect();
        let [theirs, their_variance] = statistics(theirs.into_iter());
        let error = (our_variance.x + their_variance.x).sqrt();
        println!("-a {batch} {tolerance}: {} for {} ± {error}", ours.x, theirs.x);
        assert!(theirs.x > f64::from(batch) && theirs.x < f64::from(MAX));
        assert!((ours.x - theirs.x).abs() < 4.0 * error, "{} for {} ± {error}", ours.x, theirs.x);
    }
}

/// The files of the repository equal those generated from the rooms. `PT_WRITE_EXPECTED=1` writes
/// them.
#[test]
fn the_files_are_those_of_the_rooms() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/course"));
    for (name, content) in
        [("matte_balls", BoxContent::MatteBalls), ("mirror_and_glass", BoxContent::MirrorAndGlass)]
    {
        let (path, text) = (folder.join(name).with_extension("dae"), Room::new(content).collada());
        if std::env::var_os("PT_WRITE_EXPECTED").is_some() {
            std::fs::create_dir_all(&folder).expect("a folder");
            std::fs::write(&path, &text).expect("a file that can be written");
        }
        let found = std::fs::read_to_string(&path).expect("a readable file");
        assert!(found == text, "{}", path.display());
    }
}
