//! Hair fibres as tubes of triangles.

use std::path::Path;

use pathtracer::{DirectLight, Scene, Settings};
use pt_core::bsdf::{Hair, Lobe};
use pt_math::{Spectrum, Vec3};
use pt_testing::{Random, sidak};

use crate::measure::{Luminances, assert_uniform, render, settings};
use crate::scenes::size;

fn scene(eye: &str, world: &str) -> Scene {
    let text = format!(
        "{eye} Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 PixelFilter \"box\"
        WorldBegin LightSource \"infinite\" {world}"
    );
    pt_formats::parse(text.as_bytes(), Path::new("hair.pbrt")).expect("a scene")
}

/// Bent fibres in front of each other, one of them so thick that single pixels resolve its edges,
/// and a ribbon.
fn white_tuft(roughness: f32) -> Scene {
    let material = format!(
        "Material \"hair\" \"rgb sigma_a\" [0 0 0] \"float beta_m\" {roughness} \"float beta_n\" {roughness}"
    );
    let mut random = Random::new(5);
    let mut fibre = |_| {
        let [x, z, bend] =
            [random.between(-1.0, 1.0), random.between(-1.0, 0.6), random.between(-0.8, 0.8)];
        let points =
            format!("{x} -1 {z}  {x} 0 {z}  {} .6 {z}  {} 1 {z}", x + 0.4 * bend, x + bend);
        format!(
            "Shape \"curve\" \"point3 P\" [{points}] \"float width0\" .12 \"float width1\" .05\n"
        )
    };
    let fibres: String = (0..40).map(&mut fibre).collect();
    let world = format!(
        "{material} {fibres}
        Shape \"curve\" \"point3 P\" [-.8 -.9 1  -.3 -.4 1  .3 .4 1  .8 .5 1] \"float width\" .5
        Shape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [.6 -1 1  .6 -.7 1  .6 -.4 1  .6 0 1] \"float width\" .3
          \"normal N\" [0 0 1 1 0 1]"
    );
    scene("LookAt 0 0 5  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 20", &world)
}

/// White fibres are invisible under a constant environment, with any number of interactions: on the
/// edges of the facets of tubes, at their outlines, where normals face away, and behind each other.
#[test]
fn white_fibres_are_invisible_under_an_even_sky() {
    let cases = [
        ("path", DirectLight::Mis, 0.3),
        ("path", DirectLight::Mis, 0.8),
        ("path", DirectLight::Light, 0.8),
        ("volpath", DirectLight::Mis, 0.3),
    ];
    for (integrator, direct, roughness) in cases {
        let settings =
            Settings { integrator: integrator.into(), direct, max_depth: 1000, ..settings(256) };
        let film = render(&white_tuft(roughness), size([8, 8]), settings);
        let what = format!("{integrator}, {direct:?}, {roughness}");
        println!("{what}: {:?}", Luminances::of(film.film()).whole());
        assert_uniform(film.film(), 1.0, sidak(1e-4, cases.len()), &what);
    }
}

/// The same with path reuse, in which paths from fibres do not take part; the samples are
/// correlated then.
#[test]
fn paths_from_fibres_share_no_light() {
    let settings = Settings { reuse: 4, max_depth: 1000, ..settings(64) };
    let film = render(&white_tuft(0.3), size([8, 8]), settings);
    let (mean, _) = Luminances::of(film.film()).whole();
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
}

/// Light scatters at a tube once, though it has two walls: under a constant environment, a fibre
/// has the radiance that one scattering leaves. The tube has six sides, so that its h is up to
/// 1/cos 30° of the position across it.
#[test]
fn light_goes_through_a_fibre_once() {
    let world =
        "Material \"hair\" \"rgb sigma_a\" [.5 .5 .5] \"float beta_m\" .3 \"float beta_n\" .3
        Shape \"curve\" \"point3 P\" [0 -9 0  0 -3 0  0 3 0  0 9 0] \"float width\" 2";
    let eye = "LookAt 0 0 100  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" .573";
    let film =
        render(&scene(eye, world), size([8, 8]), Settings { max_depth: 100, ..settings(1024) });
    let (found, error) = Luminances::of(film.film()).whole();
    let lobe = Hair::new(Spectrum::splat(0.5), 1.55, [0.3; 2], 2.0);
    let mut random = Random::new(9);
    let mut mean = |stretch: f32| {
        const SAMPLES: u16 = 20_000;
        let mut sum = 0.0;
        for _ in 0..SAMPLES {
            let h = stretch * random.between(-0.5, 0.5);
            let wo = Vec3::new(0.0, h, (1.0 - h * h).sqrt());
            let [u, v] = random.unit_2d();
            sum += lobe.sample(wo, [u, v, random.unit()]).map_or(0.0, |s| s.weight.max_channel());
        }
        sum / f32::from(SAMPLES)
    };
    let [round, edged] = [1.0, 1.0 / 0.866].map(&mut mean);
    println!("{found} ± {error}; {round} to {edged}");
    let slack = 4.0 * error + 0.005;
    let range = round.min(edged) - slack..round.max(edged) + slack;
    assert!(range.contains(&found), "{found} ± {error}: {range:?}");
}
