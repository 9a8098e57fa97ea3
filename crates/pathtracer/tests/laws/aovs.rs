//! AOVs of scenes in which they are known.

use std::f64::consts::PI;

use pathtracer::image::Samples;
use pathtracer::{Aov, Scene, Session, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::LightKind;
use pt_scene::material::Mirror;

use crate::measure::{Luminances, render, settings};
use crate::scenes::{Builder, camera, facing, gloss, looking, matte, metal, size};

const SIZE: u32 = 101;
const ALBEDO: [f32; 3] = [0.2, 0.5, 0.7];

/// All AOVs except those that need half buffers.
pub(crate) fn all() -> Vec<Aov> {
    Aov::NAMES.into_iter().map(|(_, aov)| aov).filter(|aov| !aov.is_of_half()).collect()
}

fn wall() -> DAffine3 {
    facing(DVec3::new(0.0, 0.0, -6.0), DVec3::Z, 1.5)
}

/// A small mirror ball in front of a matte wall, which does not fill the image; between them an
/// area light outside of the view.
fn scene() -> Scene {
    let light = looking(DVec3::new(0.0, 50.0, 0.0), DVec3::ZERO);
    Builder::default()
        .quad(wall(), matte(ALBEDO))
        .sphere(DVec3::new(0.0, 0.0, -4.0), 0.5, Mirror { reflectance: [0.9; 3].into() }.into())
        .quad(facing(DVec3::new(0.0, 30.0, 0.0), DVec3::Z, 1.5), matte(ALBEDO))
        .light(LightKind::Area { radiance: [1.0; 3] }, light)
        .seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [40.0, 40.0]))
}

fn rendered() -> Session {
    render(&scene(), size([SIZE; 2]), Settings { aovs: all(), max_depth: 1, ..settings(16) })
}

pub(crate) fn channel(session: &Session, name: &str, [x, y]: [u32; 2]) -> f64 {
    let channels = session.channels();
    let channel = channels.iter().find(|c| c.name == name).expect("a channel of this name");
    let i = (y * SIZE + x) as usize;
    match &channel.samples {
        Samples::Real(values) => f64::from(values[i]),
        Samples::Whole(values) => f64::from(values[i]),
    }
}

fn vector(session: &Session, name: &str, pixel: [u32; 2]) -> DVec3 {
    let [x, y, z] = ["X", "Y", "Z"].map(|c| channel(session, &format!("{name}.{c}"), pixel));
    DVec3::new(x, y, z)
}

/// Point and normal at the centre of a pixel, on the ball or on the plane of the wall.
fn seen(session: &Session, [x, y]: [u32; 2]) -> (DVec3, DVec3) {
    let ray = session.scene().camera.ray([x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
    let d = ray.direction.as_dvec3();
    let center = DVec3::new(0.0, 0.0, -4.0);
    let (b, c) = (d.dot(center), center.length_squared() - 0.25);
    match b * b - c {
        under if under > 0.0 => {
            let p = d * (b - under.sqrt());
            (p, (p - center) / 0.5)
        }
        _ => (d * (-6.0 / d.z), DVec3::Z),
    }
}

/// Samples are distributed over a pixel, so that positions deviate by a part of it: 2 tan 20° · 6
/// m/101 is its width on the wall; on the ball, normals turn by the width there over the radius and
/// the cosine.
#[test]
fn a_ball_and_a_wall_are_where_and_what_they_are() {
    let session = rendered();
    let mut materials = Vec::new();
    for pixel in [[50, 50], [45, 55], [53, 42], [20, 30], [75, 75], [50, 80]] {
        let (p, n) = seen(&session, pixel);
        let on_ball = p.z > -5.0;
        let place = vector(&session, "position", pixel);
        assert!((place - p).length() < 0.043, "{pixel:?}: {place} and {p}");
        let depth = channel(&session, "depth.Z", pixel);
        assert!((depth - p.length()).abs() < 0.02, "{pixel:?}: {depth} and {}", p.length());
        for name in ["normal", "geometric_normal"] {
            let normal = vector(&session, name, pixel);
            let allowed = if on_ball { 0.05 } else { 1e-6 };
            assert!((normal - n).length() < allowed, "{pixel:?}: {name} {normal} and {n}");
        }
        let [u, v] = ["U", "V"].map(|c| channel(&session, &format!("uv.{c}"), pixel));
        // From pole to pole of the ball, or along the sides of the wall.
        let on_wall = (wall().inverse().transform_point3(p) + 1.0) * 0.5;
        let want = if on_ball { n.z.acos() / PI } else { on_wall.y };
        assert!((v - want).abs() < 0.03, "{pixel:?}: {v} and {want}");
        assert!(on_ball || (u - on_wall.x).abs() < 0.03, "{pixel:?}: {u} and {on_wall}");
        let id = |name: &str| channel(&session, &format!("{name}.id"), pixel);
        let (object, albedo) = if on_ball { (2.0, [0.9; 3]) } else { (1.0, ALBEDO) };
        assert_eq!(id("object"), object, "{pixel:?}");
        materials.push((on_ball, id("material")));
        let triangles = session.scene().shapes.triangles.len() as f64;
        let is_primitive =
            if on_ball { id("primitive") == triangles + 1.0 } else { id("primitive") < 3.0 };
        assert!(is_primitive, "{pixel:?}: {}", id("primitive"));
        for (c, want) in ["R", "G", "B"].into_iter().zip(albedo) {
            let got = channel(&session, &format!("albedo.{c}"), pixel);
            assert!((got - f64::from(want)).abs() < 1e-6, "{pixel:?}: {got} in {c}");
        }
    }
    for (a, b) in materials.iter().flat_map(|a| materials.iter().map(move |b| (a, b))) {
        assert!(a.1 > 0.0 && (a.0 == b.0) == (a.1 == b.1), "{materials:?}");
    }
}

#[test]
fn where_nothing_is_seen_all_is_zero_but_the_number_of_samples() {
    let session = rendered();
    for c in session.channels() {
        let want = if c.name == "samples.count" { 16.0 } else { 0.0 };
        assert_eq!(channel(&session, &c.name, [1, 1]), want, "{}", c.name);
    }
}

/// The wall covers half of a pixel on its edge; the AOVs are nevertheless those of the wall.
#[test]
fn means_are_those_of_what_is_seen() {
    let session = rendered();
    // The wall ends at 1.5/6 = 0.25, the image at tan 20°, so that column 15 is on the edge.
    let edge = (0..SIZE).filter(|&x| {
        let luminance = session.film().pixel(x, 50);
        let [inside, outside] =
            [x + 1, x.saturating_sub(1)].map(|x| channel(&session, "object.id", [x, 50]));
        luminance.count() == 16 && inside == 1.0 && outside == 0.0
    });
    let edge: Vec<_> = edge.collect();
    assert!(!edge.is_empty());
    for x in edge {
        let z = channel(&session, "position.Z", [x, 50]);
        let red = channel(&session, "albedo.R", [x, 50]);
        let nothing = z == 0.0 && red == 0.0;
        assert!(nothing || (z + 6.0).abs() < 1e-5 && (red - 0.2).abs() < 1e-6, "{x}: {z} {red}");
    }
}

/// AOVs change neither the image nor the paths.
#[test]
fn light_is_the_same_with_and_without() {
    let with = rendered();
    let without = render(&scene(), size([SIZE; 2]), Settings { max_depth: 1, ..settings(16) });
    assert!(with.image() == without.image());
    assert!(without.channels().is_empty());
}

/// Under an environment of radiance 1, singly scattered light is the albedo.
#[test]
fn albedo_is_what_an_even_sky_makes_of_a_surface() {
    for surface in [metal(), gloss()] {
        let scene = Builder::default()
            .quad(facing(DVec3::ZERO, DVec3::Y, 50.0), surface)
            .sky(1.0)
            .seen_by(camera(DVec3::new(0.0, 4.0, 3.0), DVec3::ZERO, [5.0, 5.0]));
        let settings = Settings { aovs: vec![Aov::Albedo], max_depth: 1, ..settings(4096) };
        let session = render(&scene, size([8, 8]), settings);
        let (light, error) = Luminances::of(session.film()).whole();
        let means = session.channels().into_iter().map(|c| match c.samples {
            Samples::Real(values) => values.iter().sum::<f32>() / values.len() as f32,
            Samples::Whole(_) => panic!("{} is a real number", c.name),
        });
        let means: Vec<_> = means.collect();
        let albedo = 0.2126 * means[0] + 0.7152 * means[1] + 0.0722 * means[2];
        assert!(error < 0.005 * light && light > 0.2, "{light} ± {error}");
        assert!((albedo - light).abs() < 0.01 * light, "{albedo} and {light} ± {error}");
    }
}
