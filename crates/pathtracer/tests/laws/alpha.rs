//! Alpha of scenes with known coverage, and hidden lights.

use std::f64::consts::PI;

use pathtracer::{
    Adaptive, Aov, Camera, Filter, Hidden, INTEGRATORS, Projection, Scene, Session, Settings,
    Target,
};
use pt_math::{DAffine3, DVec3};
use pt_scene::Surface;
use pt_scene::material::{Black, Glass, ThinGlass};
use pt_scene::medium::Phase;

use crate::measure::{render, settings};
use crate::media::{block, homogeneous, straight};
use crate::scenes::{Builder, camera, facing, matte, size};

const SIZE: u32 = 24;

/// Settings with alpha and a hidden background.
fn cut_out(spp: u32) -> Settings {
    Settings { aovs: vec![Aov::Alpha], hidden: Hidden::Background, ..settings(spp) }
}

fn with(integrator: &str, settings: Settings) -> Settings {
    Settings { integrator: integrator.to_owned(), ..settings }
}

fn alphas(session: &Session) -> Vec<f64> {
    let alpha = session.film().alpha().expect("it is kept");
    alpha.into_iter().map(f64::from).collect()
}

/// Asserts the mean coverage, within 4.5 standard errors of independent samples in [0, 1], times
/// `spread`.
fn assert_covers(scene: &Scene, settings: Settings, want: f64, spread: f64) {
    let samples = f64::from(SIZE * SIZE * settings.spp);
    let name = format!("{} {:?}", settings.integrator, settings.filter);
    let alphas = alphas(&render(scene, size([SIZE; 2]), settings));
    let mean = alphas.iter().sum::<f64>() / alphas.len() as f64;
    let error = spread * (want * (1.0 - want) / samples).sqrt() + 1e-6;
    assert!((mean - want).abs() < 4.5 * error, "{name}: {mean}, expected {want} ± {error}");
}

fn pane() -> Surface {
    ThinGlass { reflectance: [1.0; 3].into(), transmittance: [1.0; 3].into(), ior: 1.5 }.into()
}

fn glass() -> Surface {
    let (reflectance, transmittance) = ([1.0; 3].into(), [1.0; 3].into());
    Glass { reflectance, transmittance, ior: 1.5, roughness: None }.into()
}

fn opaque_by(builder: Builder, opacity: f32) -> Builder {
    let Builder(mut scene) = builder;
    scene.materials.last_mut().expect("it has a material").opacity = opacity.into();
    Builder(scene)
}

/// A ball of radius 1, seen from the distance 5: the cone around it has sin θ = 1/5, so that the
/// coverage of its disk is π tan² θ / (2 tan 20°)². A black, a matte and a clear one have the same
/// coverage, with every integrator and filter.
#[test]
fn a_ball_covers_its_disk() {
    let want = PI / 24.0 / (2.0 * 20f64.to_radians().tan()).powi(2);
    for surface in [Black.into(), matte([0.5; 3]), glass()] {
        let scene = Builder::default().sphere(DVec3::ZERO, 1.0, surface).sky(1.0).seen_by(camera(
            DVec3::new(0.0, 0.0, 5.0),
            DVec3::ZERO,
            [40.0, 40.0],
        ));
        for integrator in INTEGRATORS {
            assert_covers(&scene, with(integrator.name, cut_out(64)), want, 1.0);
        }
        for filter in [Filter::GAUSSIAN, Filter::MITCHELL] {
            assert_covers(&scene, Settings { filter, ..cut_out(64) }, want, 2.0);
        }
        let shown = Settings { hidden: Hidden::Nothing, ..cut_out(4) };
        assert_covers(&scene, shown, 1.0, 1.0);
    }
}

/// A rectangle at a known place in an orthographic projection: the coverage of a pixel is the
/// product of the coverages of its row and of its column.
fn rectangle(surface: Surface) -> (Scene, Vec<f64>) {
    let half = [0.613, 0.37];
    let to_world = facing(DVec3::ZERO, DVec3::Z, 1.0)
        * DAffine3::from_scale(DVec3::new(half[0], half[1], 1.0));
    let view = camera(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, [40.0, 40.0]);
    let projection = Projection::Orthographic { half_width: 1.0, half_height: 1.0 };
    let scene =
        Builder::default().quad(to_world, surface).sky(1.0).seen_by(Camera { projection, ..view });
    let overlap = |i: u32, half: f64| {
        let edge = |i: u32| (f64::from(i) / f64::from(SIZE) * 2.0 - 1.0).clamp(-half, half);
        (edge(i + 1) - edge(i)) * f64::from(SIZE) / 2.0
    };
    let area = |(x, y)| overlap(x, half[0]) * overlap(y, half[1]);
    (scene, (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))).map(area).collect())
}

/// The fraction of 2ᵐ points of a (0, m, 2)-net in a box with a corner at the origin deviates by at
/// most ⌊(m + 3)/2⌋/2ᵐ [Niederreiter 1992, theorem 4.6], and so for any box by at most four times
/// that.
#[test]
fn of_each_pixel_what_is_covered_is_the_area() {
    let (scene, areas) = rectangle(Black.into());
    let settings = Settings { sampler: Settings::default().sampler, ..cut_out(1024) };
    let session = render(&scene, size([SIZE; 2]), settings);
    for (alpha, area) in alphas(&session).into_iter().zip(areas) {
        assert!((alpha - area).abs() < 24.0 / 1024.0, "{alpha}, expected {area}");
    }
    assert!(session.rgba().iter().all(|[r, g, b, _]| [r, g, b] == [&0.0; 3]));
}

/// Of n surfaces with an opacity, the coverage is 1 − (1 − opacity)ⁿ.
#[test]
fn what_is_not_all_there_covers_its_opacity() {
    for n in [1, 2, 5] {
        let quads = (0..n).fold(Builder::default().sky(1.0), |builder, i| {
            let place = facing(DVec3::new(0.0, 0.0, -f64::from(i)), DVec3::Z, 50.0);
            opaque_by(builder.quad(place, matte([0.5; 3])), 0.3)
        });
        let scene = quads.seen_by(straight());
        for integrator in INTEGRATORS {
            assert_covers(&scene, with(integrator.name, cut_out(64)), 1.0 - 0.7f64.powi(n), 1.0);
        }
    }
}

/// A pane reflects 2F/(1 + F) with F = ((1.5 − 1)/(1.5 + 1))², which is its coverage, with any
/// Russian roulette and with path splitting. Roulette compensates terminated paths by weights of up
/// to 1/0.95⁴.
#[test]
fn panes_cover_what_they_reflect() {
    let reflected: f64 = 2.0 * 0.04 / 1.04;
    for n in [1, 6] {
        let panes = (0..n).fold(Builder::default().sky(1.0), |builder, i| {
            builder.quad(facing(DVec3::new(0.0, 0.0, -f64::from(i)), DVec3::Z, 50.0), pane())
        });
        let scene = panes.seen_by(straight());
        let want = 1.0 - (1.0 - reflected).powi(n);
        for integrator in ["path", "volpath"] {
            assert_covers(&scene, with(integrator, cut_out(256)), want, 1.5);
        }
        assert_covers(&scene, Settings { split: 4, ..cut_out(256) }, want, 1.5);
    }
}

/// A cube of a medium, 2 m through, that scatters or only absorbs: 1 − e^(−σd), on average over the
/// channels.
#[test]
fn media_cover_what_they_do_not_let_through() {
    let sigma = [0.2, 0.5, 1.3f32];
    let want = 1.0 - sigma.map(|s| (-2.0 * f64::from(s)).exp()).iter().sum::<f64>() / 3.0;
    for albedo in [0.0, 0.8] {
        let medium = homogeneous(sigma, [albedo; 3], Phase::Isotropic);
        let scene = block(Builder::default().sky(1.0), DAffine3::IDENTITY, medium);
        let scene = scene.seen_by(straight());
        assert_covers(&scene, with("volpath", cut_out(64)), want, 1.0);
        // Without scattering, the transmittance is not sampled but exact.
        let last = Settings { max_depth: 0, ..cut_out(1) };
        assert_covers(&scene, with("volpath", last), want, 0.0);
    }
}

/// Composited over the radiance of the environment, the image with alpha equals that with a visible
/// background, sample by sample.
#[test]
fn over_an_even_sky_the_cut_out_is_the_whole_picture() {
    const SKY: f32 = 0.5;
    let place = |x: f64, z: f64| facing(DVec3::new(x, 0.1, z), DVec3::Z, 0.6);
    let scene = Builder::default()
        .sphere(DVec3::new(-0.4, -0.3, -0.5), 0.5, matte([0.6, 0.4, 0.2]))
        .sphere(DVec3::new(0.5, -0.5, -0.2), 0.35, glass())
        .quad(place(0.2, 0.8), pane())
        .quad(place(0.4, 1.0), pane());
    let scene = opaque_by(scene.quad(place(-0.5, 0.9), matte([0.8; 3])), 0.4);
    let scene = opaque_by(scene.emissive_quad(place(0.5, -1.0), 0.3), 0.7);
    let scene =
        scene.sky(SKY).seen_by(camera(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, [30.0, 30.0]));
    let split = Settings { split: 4, ..cut_out(16) };
    let ways = ["path", "volpath", "direct"].map(|name| with(name, cut_out(16)));
    let mitchell = Settings { filter: Filter::MITCHELL, ..cut_out(16) };
    let halves = Settings { aovs: vec![Aov::HalfA, Aov::Alpha], ..cut_out(15) };
    for settings in ways.into_iter().chain([split, mitchell, halves]) {
        let shown = Settings { hidden: Hidden::Nothing, ..settings.clone() };
        // Of those, the weights of the samples of a pixel are 1 only on average.
        let has_signs = settings.filter == Filter::MITCHELL;
        let name = format!("{} {}", settings.integrator, settings.split);
        let [cut, whole] =
            [settings, shown].map(|settings| render(&scene, size([SIZE; 2]), settings).rgba());
        let mut partial = 0;
        for (a, b) in cut.into_iter().zip(whole) {
            partial += u32::from(a[3] > 0.01 && a[3] < 0.99);
            for c in 0..3 {
                let over = a[c] + (b[3] - a[3]) * SKY;
                assert!((over - b[c]).abs() < 2e-6, "{name}: {a:?} over {SKY} is not {b:?}");
            }
            assert!(b[3] == 1.0 || has_signs, "{name}: a background covers");
        }
        assert!(partial > 100, "{name}: {partial}");
    }
}

/// An emissive square between the camera and a wall: if hidden, the image is that of a camera whose
/// near plane is behind the square, to the bit.
#[test]
fn hidden_emitters_light_what_is_seen_through_them() {
    let view = camera(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, [40.0, 40.0]);
    let lamp = facing(DVec3::new(0.2, 0.1, 1.0), DVec3::NEG_Z, 0.7);
    let scene = |near: f64| {
        Builder::default()
            .quad(facing(DVec3::new(0.0, 0.0, -1.0), DVec3::Z, 1.2), matte([0.7, 0.5, 0.3]))
            .sphere(DVec3::new(-0.4, 0.0, -0.6), 0.3, glass())
            .emissive_quad(lamp, 4.0)
            .seen_by(Camera { near, ..view.clone() })
    };
    for integrator in INTEGRATORS {
        let aovs = vec![Aov::Alpha, Aov::Normal, Aov::Depth];
        let plain = with(integrator.name, Settings { aovs, max_depth: 4, ..settings(8) });
        let hiding = Settings { hidden: Hidden::Emitters, ..plain.clone() };
        let hidden = render(&scene(0.0), size([SIZE; 2]), hiding);
        let behind = render(&scene(4.5), size([SIZE; 2]), plain);
        assert!(hidden.film() == behind.film(), "{}", integrator.name);
        let context = hidden.rgba().iter().filter(|[r, .., a]| *r > 0.0 && *a > 0.0).count();
        assert!(context > 100, "{}: {context}", integrator.name);
    }
}

/// A lamp behind a black surface of opacity ½. Mitsuba's volpath hides it, its path does not.
#[test]
fn behind_holes_volpath_hides_emitters() {
    let lamp = facing(DVec3::new(0.0, 0.0, -1.0), DVec3::Z, 50.0);
    let screen = Builder::default().quad(facing(DVec3::ZERO, DVec3::Z, 50.0), Black.into());
    let scene = opaque_by(screen, 0.5).emissive_quad(lamp, 2.0).seen_by(straight());
    for (integrator, alpha, light) in [("path", 1.0, 1.0), ("volpath", 0.5, 0.0)] {
        let settings = Settings { hidden: Hidden::Emitters, ..cut_out(64) };
        assert_covers(&scene, with(integrator, settings.clone()), alpha, 1.0);
        let session = render(&scene, size([SIZE; 2]), with(integrator, settings));
        let sum: f32 = session.rgba().iter().map(|[r, ..]| *r).sum();
        let mean = sum / (SIZE * SIZE) as f32;
        assert!((mean - light).abs() < 0.05, "{integrator}: {mean}, expected {light}");
    }
}

/// A black object without a background has no noise of radiance, but noise of alpha at its edges.
#[test]
fn adaptive_sampling_goes_on_where_coverage_is_noisy() {
    let (scene, _) = rectangle(Black.into());
    let adaptive = Some(Adaptive { batch: 16, tolerance: 0.1 });
    let session = render(&scene, size([SIZE; 2]), Settings { adaptive, ..cut_out(1024) });
    let counts = session.film().pixels().map(|pixel| pixel.count());
    let mut edges = 0;
    for (alpha, n) in alphas(&session).into_iter().zip(counts) {
        let error = (alpha * (1.0 - alpha) / f64::from(n - 1)).sqrt();
        assert!(1.96 * error <= 0.1 + 1e-6, "{alpha} after {n} samples");
        assert!(n == 16 || alpha > 0.0 && alpha < 1.0, "{alpha} after {n} samples");
        edges += u32::from(n > 16);
    }
    assert!(edges > 40, "{edges} pixels on edges had more samples");
}

/// The measured error of a black rectangle is that of its coverage, which is known.
#[test]
fn an_error_target_is_one_of_coverage_as_well() {
    let (scene, areas) = rectangle(Black.into());
    let of = |error: f64| {
        let target = Some(Target { error: Some(error), ..Target::NONE });
        let session =
            render(&scene, size([SIZE; 2]), Settings { target, spp: 1 << 16, ..cut_out(1) });
        let off =
            alphas(&session).into_iter().zip(&areas).map(|(alpha, area)| (alpha - area).powi(2));
        let square: f64 = areas.iter().map(|area| area * area).sum();
        ((off.sum::<f64>() / square).sqrt(), session.film().samples())
    };
    let [(coarse, few), (fine, many)] = [0.1, 0.01].map(of);
    assert!(coarse < 0.1 && fine < 0.01, "{coarse} {fine}");
    assert!(many > 4 * few, "{few} samples, and {many} for a tenth of the error");
}
