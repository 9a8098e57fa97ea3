//! Laws of media.

use std::sync::Arc;

use pt_math::sampler::{RngStream, Sampler, SamplerConfig, SamplerKind};
use pt_math::{Mat3, Ray, Spectrum, Vec3};
use pt_scene::medium::{Grid, GridFilter};
use pt_testing::{mean_z_test, sidak};

use super::{
    Albedo, Cloud, Density, Flakes, GridMedium, Homogeneous, MediumEmission, MediumProperties,
    MediumRecord, MediumSample, Phase, WorldGrid,
};
use crate::phase::{Isotropic, Microflakes};

const SAMPLES: u32 = 40_000;

/// A ray whose interval is inside of all media; its direction is not a unit vector.
fn ray() -> Ray {
    let direction = Vec3::new(0.48, 0.64, 0.6) * 1.5;
    Ray { t_min: 0.1, t_max: 0.9, ..Ray::new(Vec3::new(-0.05, -0.1, 0.02), direction) }
}

fn record(matter: MediumProperties) -> MediumRecord {
    MediumRecord { matter, phase: Phase::Same(Isotropic.into()) }
}

fn homogeneous(extinction: [f32; 3], albedo: f32) -> MediumRecord {
    let (extinction, albedo) = (extinction.into(), Spectrum::splat(albedo));
    let emission = GLOW.into();
    record(MediumProperties::Homogeneous(Homogeneous { extinction, albedo, emission }))
}

fn grid(values: Vec<f32>, resolution: [u32; 3], scale: f32, albedo: f32) -> MediumRecord {
    of_grid(Grid { resolution, channels: 1, values }, scale, albedo)
}

fn of_grid(grid: Grid, scale: f32, albedo: f32) -> MediumRecord {
    let grid = Arc::new(grid);
    let (corner, to_unit) = (Vec3::splat(-0.5), Mat3::from_diagonal(Vec3::splat(0.5)));
    let field = WorldGrid { grid, corner, to_unit, filter: GridFilter::Trilinear };
    of_density(Density::Field(field), scale, albedo)
}

fn of_density(density: Density, scale: f32, albedo: f32) -> MediumRecord {
    let albedo = Albedo::Constant(Spectrum::splat(albedo));
    let emission = Some(MediumEmission::Constant(GLOW.into()));
    record(MediumProperties::Grid(Arc::new(GridMedium::new(density, scale, albedo, emission))))
}

/// A cloud around the ray, as a medium and by itself.
fn cloud(scale: f32, albedo: f32) -> (MediumRecord, Cloud) {
    let cloud = Cloud {
        color: Spectrum::rgb(1.0, 0.25, 0.0),
        density: 2.0,
        wispiness: 1.0,
        frequency: 5.0,
        low: Vec3::new(0.0, 0.3, 0.0),
        size: Vec3::splat(0.6),
        corner: Vec3::splat(-0.5),
        to_unit: Mat3::from_diagonal(Vec3::splat(0.5)),
    };
    (of_density(Density::Cloud(cloud.clone()), scale, albedo), cloud)
}

/// Emitted radiance of the media.
const GLOW: [f32; 3] = [3.0, 2.0, 0.5];

/// Twelve cells along x, of increasing density, constant along the other axes.
fn gradient(scale: f32, albedo: f32) -> MediumRecord {
    let values = (0..12 * 2 * 3).map(|i| (i % 12) as f32 / 11.0).collect();
    grid(values, [12, 2, 3], scale, albedo)
}

/// A gradient in red, its reverse in green, and a constant in blue.
fn colored_gradient(scale: f32, albedo: f32) -> MediumRecord {
    let cell = |i: u32| [(i % 12) as f32 / 11.0, 1.0 - (i % 12) as f32 / 11.0, 0.1];
    let values = (0..12 * 2 * 3).flat_map(cell).collect();
    of_grid(Grid { resolution: [12, 2, 3], channels: 3, values }, scale, albedo)
}

/// Optical depth of [`colored_gradient`] along [`ray`] up to a ray parameter.
fn colored_depth(t: f32, scale: f64) -> [f64; 3] {
    let along = |sigma: &dyn Fn(Vec3) -> f64| depth(&ray(), t, |p| scale * sigma(p));
    [along(&gradient_at), along(&|p| 1.0 - gradient_at(p)), along(&|_| 0.1)]
}

/// Extinction of [`gradient`] with scale 1 at a point in world space.
fn gradient_at(p: Vec3) -> f64 {
    let cell = (f64::from(p.x) + 0.5) * 0.5 * 12.0 - 0.5;
    cell.clamp(0.0, 11.0) / 11.0
}

/// Optical depth ∫ σ along the ray up to `t`, by the midpoint rule.
fn depth(ray: &Ray, t: f32, sigma: impl Fn(Vec3) -> f64) -> f64 {
    const STEPS: u32 = 20_000;
    let step = f64::from(t - ray.t_min) / f64::from(STEPS);
    let place = |i: u32| ray.t_min + (step * (f64::from(i) + 0.5)) as f32;
    let length = f64::from(ray.direction.length()) * step;
    (0..STEPS).map(|i| sigma(ray.at(place(i))) * length).sum()
}

fn numbers(sample: u32) -> ([f32; 2], RngStream) {
    let set = SamplerConfig { kind: SamplerKind::Independent, seed: 3, spp: SAMPLES };
    let mut sampler = Sampler::new(set, [1, 2], sample);
    (sampler.next_2d(), sampler.stream([0, 0]))
}

/// Tests the mean of `f` over many samples against the expected value, for each channel.
fn check(
    what: &str,
    want: [f64; 3],
    tests: usize,
    f: impl Fn([f32; 2], &mut RngStream) -> Spectrum,
) {
    let all: Vec<_> = (0..SAMPLES).map(numbers).map(|(u, mut s)| f(u, &mut s)).collect();
    for (channel, want) in want.into_iter().enumerate() {
        let values: Vec<_> = all.iter().map(|s| f64::from(s.to_array()[channel])).collect();
        let result = mean_z_test(&values, want, sidak(1e-4, 3 * tests));
        result.unwrap_or_else(|e| panic!("{what}, channel {channel}: {e}"));
    }
}

/// Name of a medium, the medium, and its optical depth along [`ray`] up to a ray parameter, per
/// channel.
type Case = (&'static str, MediumRecord, fn(f32) -> [f64; 3]);

fn media(albedo: f32) -> Vec<Case> {
    fn of(t: f32, sigmas: [f64; 3]) -> [f64; 3] {
        sigmas.map(|sigma| depth(&ray(), t, |_| sigma))
    }
    vec![
        ("grey", homogeneous([1.2; 3], albedo), |t| of(t, [1.2; 3])),
        ("coloured", homogeneous([0.3, 4.0, 0.0], albedo), |t| of(t, [0.3, 4.0, 0.0])),
        ("uniform grid", grid(vec![0.5; 60], [3, 4, 5], 2.4, albedo), |t| of(t, [1.2; 3])),
        ("gradient", gradient(3.0, albedo), |t| [depth(&ray(), t, |p| 3.0 * gradient_at(p)); 3]),
        ("dense", gradient(12.0, albedo), |t| [depth(&ray(), t, |p| 12.0 * gradient_at(p)); 3]),
        (
            "uniform coloured grid",
            of_grid(Grid::uniform_color([0.3, 4.0, 0.0]), 1.0, albedo),
            |t| of(t, [0.3, 4.0, 0.0]),
        ),
        ("coloured gradient", colored_gradient(3.0, albedo), |t| colored_depth(t, 3.0)),
        ("dense coloured", colored_gradient(12.0, albedo), |t| colored_depth(t, 12.0)),
        ("flakes", flaky(homogeneous([1.2, 0.3, 4.0], albedo), even()), |t| {
            [1.2, 0.3, 4.0].map(|sigma| depth(&ray(), t, |_| sigma * area(LEFT)))
        }),
        ("flakes in a grid", flaky(gradient(5.0, albedo), even()), |t| {
            [depth(&ray(), t, |p| 5.0 * area(LEFT) * gradient_at(p)); 3]
        }),
        ("turning flakes", flaky(gradient(5.0, albedo), turning()), |t| {
            [depth(&ray(), t, |p| 5.0 * turning_area(p) * gradient_at(p)); 3]
        }),
        ("turning flakes in colours", flaky(colored_gradient(5.0, albedo), turning()), |t| {
            [0, 1, 2].map(|channel| {
                let sigma = |p| [gradient_at(p), 1.0 - gradient_at(p), 0.1][channel];
                depth(&ray(), t, |p| 5.0 * turning_area(p) * sigma(p))
            })
        }),
    ]
}

fn is_homogeneous(medium: &MediumRecord) -> bool {
    matches!(medium.matter, MediumProperties::Homogeneous(_))
}

/// Two kinds of microflakes.
const LEFT: [f32; 6] = [0.9, 0.1, 0.2, 0.05, 0.1, -0.02];
const RIGHT: [f32; 6] = [0.1, 0.5, 0.9, -0.1, 0.0, 0.2];

fn flaky(medium: MediumRecord, phase: Phase) -> MediumRecord {
    MediumRecord { phase, ..medium }
}

fn even() -> Phase {
    Phase::Same(Microflakes::new(LEFT).expect("flakes").into())
}

/// Interpolation between the two kinds along x, in the grid of [`of_grid`].
fn turning() -> Phase {
    let values = [LEFT, RIGHT].concat();
    let grid = Arc::new(Grid { resolution: [2, 1, 1], channels: 6, values });
    let (corner, to_unit) = (Vec3::splat(-0.5), Mat3::from_diagonal(Vec3::splat(0.5)));
    let field = WorldGrid { grid, corner, to_unit, filter: GridFilter::Trilinear };
    Phase::Flakes(Arc::new(Flakes::new(field).expect("flakes")))
}

/// Projected area √(ωᵀ S ω) along the ray.
fn area([xx, yy, zz, xy, xz, yz]: [f32; 6]) -> f64 {
    let [x, y, z] = ray().direction.normalize().to_array().map(f64::from);
    let [xx, yy, zz, xy, xz, yz] = [xx, yy, zz, xy, xz, yz].map(f64::from);
    let squared = xx * x * x + yy * y * y + zz * z * z;
    (squared + 2.0 * (xy * x * y + xz * x * z + yz * y * z)).sqrt()
}

fn turning_area(p: Vec3) -> f64 {
    let share = (((p.x + 0.5) * 0.5) * 2.0 - 0.5).clamp(0.0, 1.0);
    area(std::array::from_fn(|i| LEFT[i] + share * (RIGHT[i] - LEFT[i])))
}

/// T = e^(−∫σ), in closed form or on average.
#[test]
fn transmittance_follows_beers_law() {
    let media = media(0.5);
    for (name, medium, depth) in &media {
        let want = depth(ray().t_max).map(|depth| libm::exp(-depth));
        check(name, want, media.len(), |_, stream| medium.transmittance(&ray(), stream));
    }
}

/// Clouds transmit light by Beer's law, and emit what they absorb.
#[test]
fn clouds_are_as_dense_as_their_noise() {
    let (medium, cloud) = cloud(3.0, 0.5);
    let at = |p: Vec3| 3.0 * f64::from(cloud.at((p + 0.5) * 0.5));
    let depth = depth(&ray(), ray().t_max, at);
    let depths = [depth, 0.25 * depth, 0.0];
    assert!(depth > 0.3, "{depth}");
    let want = depths.map(|depth| libm::exp(-depth));
    check("clouds", want, 2, |_, stream| medium.transmittance(&ray(), stream));
    let want: [f64; 3] = std::array::from_fn(|c| 0.5 * f64::from(GLOW[c]) * (1.0 - want[c]));
    check("clouds", want, 2, |_, stream| medium.le(&ray(), Spectrum::ONE, stream));
}

/// ∫ T σa Le dt is (1 − T) times the absorbed fraction times Le, if the latter two are constant.
#[test]
fn matter_emits_as_it_absorbs() {
    let beta = Spectrum::rgb(0.9, 0.2, 0.5);
    for albedo in [0.0, 0.75] {
        let media = media(albedo);
        for (name, medium, depth) in &media {
            assert!(medium.is_emissive());
            let taken = depth(ray().t_max).map(|depth| -libm::expm1(-depth));
            let share = f64::from(1.0 - albedo);
            let want = std::array::from_fn(|c| taken[c] * share * f64::from(GLOW[c]));
            check(name, want, 2 * media.len(), |_, s| medium.le(&ray(), beta, s));
        }
    }
}

/// Emission that varies in space: twice as strong at the end of a grid as at its start, in a part
/// of the medium; and 0 outside of its box.
#[test]
fn grids_may_emit_in_places() {
    const STEPS: u32 = 20_000;
    let of = |values: Vec<f32>, resolution| {
        let grid = Arc::new(Grid { resolution, channels: 1, values });
        let (corner, to_unit) = (Vec3::splat(-0.5), Mat3::from_diagonal(Vec3::new(0.8, 0.5, 0.5)));
        WorldGrid { grid, corner, to_unit, filter: GridFilter::Nearest }
    };
    let density = of(vec![1.0; 8], [2; 3]);
    let emission = of(vec![1.0, 2.0], [2, 1, 1]);
    let medium = |emission| {
        let density = Density::Field(WorldGrid {
            to_unit: Mat3::from_diagonal(Vec3::splat(0.5)),
            ..density.clone()
        });
        let albedo = Albedo::Constant(Spectrum::ZERO);
        record(MediumProperties::Grid(Arc::new(GridMedium::new(
            density,
            1.5,
            albedo,
            Some(emission),
        ))))
    };
    // For x below 0.125 in world space, up to 0.75, and beyond that.
    let radiance = |p: Vec3| {
        if p.x < 0.125 {
            1.0
        } else if p.x < 0.75 {
            2.0
        } else {
            0.0
        }
    };
    let (ray, mut want) = (ray(), 0.0);
    let length = f64::from(ray.direction.length());
    for i in 0..STEPS {
        let t = ray.t_min + (ray.t_max - ray.t_min) * (i as f32 + 0.5) / STEPS as f32;
        let step = length * f64::from(ray.t_max - ray.t_min) / f64::from(STEPS);
        let depth = 1.5 * length * f64::from(t - ray.t_min);
        want += step * 1.5 * libm::exp(-depth) * radiance(ray.at(t));
    }
    let medium = medium(MediumEmission::Field(emission));
    check("an emissive grid", [want; 3], 1, |_, s| medium.le(&ray, Spectrum::ONE, s));
}

/// The transmittance of homogeneous media has no variance.
#[test]
fn homogeneous_transmittance_is_exact() {
    for (name, medium, depth) in media(0.5).iter().filter(|case| is_homogeneous(&case.1)) {
        let (_, mut stream) = numbers(0);
        let got = medium.transmittance(&ray(), &mut stream).to_array();
        for (got, depth) in got.into_iter().zip(depth(ray().t_max)) {
            assert!((f64::from(got) - libm::exp(-depth)).abs() < 1e-6, "{name}: {got} {depth}");
        }
    }
}

/// Media that only absorb transmit all paths, with the transmittance as their weight; it is in
/// closed form for homogeneous media.
#[test]
fn absorption_takes_no_random_distances() {
    for (name, medium, depth) in media(0.0).iter().filter(|case| is_homogeneous(&case.1)) {
        for sample in 0..10 {
            let (u, mut stream) = numbers(sample);
            let MediumSample::Transmitted { weight } =
                medium.sample(&ray(), Spectrum::ONE, u, &mut stream)
            else {
                panic!("{name} scatters");
            };
            for (got, depth) in weight.to_array().into_iter().zip(depth(ray().t_max)) {
                assert!((f64::from(got) - libm::exp(-depth)).abs() < 1e-6, "{name}: {got}");
            }
        }
    }
}

/// Transmitted paths have the transmittance as mean weight, for any throughput; scattered paths
/// have the albedo times the removed light, also of those before a distance.
#[test]
fn weights_of_flights_are_the_terms_of_the_transport_equation() {
    const ALBEDO: f32 = 0.8;
    let beta = Spectrum::rgb(0.9, 0.2, 0.5);
    let absorbing = media(0.0);
    let scattering = media(ALBEDO);
    let tests = 3 * (scattering.len() + absorbing.len());
    for (is_black, (name, medium, depth)) in
        scattering.iter().map(|m| (false, m)).chain(absorbing.iter().map(|m| (true, m)))
    {
        let passed = |flight| match flight {
            MediumSample::Transmitted { weight } => weight,
            MediumSample::Scattered { .. } => Spectrum::ZERO,
        };
        let before = |end: f32| {
            move |flight| match flight {
                MediumSample::Scattered { t, weight } if t < end => weight,
                _ => Spectrum::ZERO,
            }
        };
        let sample = |u, stream: &mut RngStream| medium.sample(&ray(), beta, u, stream);
        let want = depth(ray().t_max).map(|depth| libm::exp(-depth));
        check(name, want, tests, |u, s| passed(sample(u, s)));
        for end in [0.35, ray().t_max] {
            let albedo = if is_black { 0.0 } else { f64::from(ALBEDO) };
            let want = depth(end).map(|depth| albedo * (1.0 - libm::exp(-depth)));
            check(name, want, tests, |u, s| before(end)(sample(u, s)));
        }
    }
}

/// The sum of the throughput over the channels is preserved by all events: no weight is more than
/// the inverse of the fraction of its channel.
#[test]
fn coloured_grids_keep_the_sum_of_the_throughput() {
    let medium = colored_gradient(12.0, 1.0);
    for beta in [Spectrum::ONE, Spectrum::rgb(0.9, 0.2, 0.5), Spectrum::rgb(0.0, 1e-20, 3.0)] {
        let sum = |spectrum: Spectrum| spectrum.to_array().iter().sum::<f32>();
        for sample in 0..1000 {
            let (u, mut stream) = numbers(sample);
            let (MediumSample::Scattered { weight, .. } | MediumSample::Transmitted { weight }) =
                medium.sample(&ray(), beta, u, &mut stream);
            let (got, want) = (sum(beta * weight), sum(beta));
            assert!((got - want).abs() < 1e-5 * want, "{beta:?}: {got}, expected {want}");
        }
    }
}

/// A grey grid agrees with a grid of three equal channels, sample by sample.
#[test]
fn grey_grids_are_coloured_ones_of_equal_channels() {
    let values: Vec<_> = (0..12 * 2 * 3).map(|i| (i % 12) as f32 / 11.0).collect();
    let colors = values.iter().flat_map(|&x| [x; 3]).collect();
    let grey = grid(values, [12, 2, 3], 5.0, 0.8);
    let colored = of_grid(Grid { resolution: [12, 2, 3], channels: 3, values: colors }, 5.0, 0.8);
    let beta = Spectrum::rgb(0.9, 0.2, 0.5);
    let of = |medium: &MediumRecord, sample| {
        let (u, mut stream) = numbers(sample);
        match medium.sample(&ray(), beta, u, &mut stream) {
            MediumSample::Scattered { t, weight } => (Some(t), weight),
            MediumSample::Transmitted { weight } => (None, weight),
        }
    };
    for sample in 0..1000 {
        let ((at, weight), (want_at, want)) = (of(&colored, sample), of(&grey, sample));
        assert_eq!(at, want_at);
        assert!((weight.0 - want.0).abs().max_element() < 1e-5, "{weight:?} {want:?}");
    }
}

/// At infinity nothing is transmitted, except in channels without extinction, and scattering
/// distances are finite.
#[test]
fn rays_may_be_infinite() {
    let ray = Ray { t_max: f32::INFINITY, ..ray() };
    let medium = homogeneous([0.0, 1e-12, 2.0], 0.5);
    let (_, mut stream) = numbers(0);
    assert_eq!(medium.transmittance(&ray, &mut stream).to_array(), [1.0, 0.0, 0.0]);
    for sample in 0..1000 {
        let (u, mut stream) = numbers(sample);
        match medium.sample(&ray, Spectrum::ONE, u, &mut stream) {
            MediumSample::Scattered { t, weight } => assert!(t < 1e15 && weight.is_finite()),
            MediumSample::Transmitted { weight } => {
                assert!(weight.is_finite() && weight.0.y == 0.0);
            }
        }
    }
    let cloud = gradient(3.0, 0.5);
    let finite = Ray { t_max: 100.0, ..ray };
    let transmittance = |ray| {
        let (_, mut stream) = numbers(1);
        cloud.transmittance(&ray, &mut stream)
    };
    assert_eq!(transmittance(ray), transmittance(finite), "outside of the grid there is nothing");
}

/// Channels may differ by the full range of single precision.
#[test]
fn extremely_coloured_media_give_numbers() {
    let beta = Spectrum::rgb(1.0, 1e-20, 0.5);
    for extinction in [[0.0, 1e38, 1e-38], [1e-30, 1e30, 1.0], [3e38, 1e-44, 0.0]] {
        let medium = homogeneous(extinction, 0.5);
        for (sample, t_max) in (0..1000).flat_map(|i| [(i, 0.9), (i, f32::INFINITY)]) {
            let (u, mut stream) = numbers(sample);
            let ray = Ray { t_max, ..ray() };
            let (MediumSample::Scattered { weight, .. } | MediumSample::Transmitted { weight }) =
                medium.sample(&ray, beta, u, &mut stream);
            assert!(weight.is_finite() && weight.0.min_element() >= 0.0, "{weight:?}");
        }
    }
    for extinction in [[0.0, 1e4, 1e-38], [1e-30, 1e3, 1.0], [1e4, 1e-44, 0.0]] {
        let medium = of_grid(Grid::uniform_color(extinction), 1.0, 0.5);
        for sample in 0..1000 {
            let (u, mut stream) = numbers(sample);
            let (MediumSample::Scattered { weight, .. } | MediumSample::Transmitted { weight }) =
                medium.sample(&ray(), beta, u, &mut stream);
            assert!(weight.is_finite() && weight.0.min_element() >= 0.0, "{weight:?}");
        }
    }
}

/// Empty media have no effect, and very dense ones scatter at once.
#[test]
fn extremes_give_numbers() {
    let empty = grid(vec![0.0; 8], [2; 3], 1.0, 1.0);
    let wall = grid(vec![1.0; 8], [2; 3], 3e4, 1.0);
    for sample in 0..100 {
        let (u, mut stream) = numbers(sample);
        assert_eq!(empty.transmittance(&ray(), &mut stream), Spectrum::ONE);
        assert!(matches!(
            empty.sample(&ray(), Spectrum::ONE, u, &mut stream),
            MediumSample::Transmitted { weight: Spectrum::ONE }
        ));
        assert_eq!(wall.transmittance(&ray(), &mut stream), Spectrum::ZERO);
        let MediumSample::Scattered { t, weight } =
            wall.sample(&ray(), Spectrum::ONE, u, &mut stream)
        else {
            panic!("it is as thin as air");
        };
        assert!(t >= ray().t_min && t < ray().t_min + 1e-2 && weight == Spectrum::ONE);
    }
}
