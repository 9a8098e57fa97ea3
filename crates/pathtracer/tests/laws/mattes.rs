//! Cryptomatte coverage in scenes where it is known.

use pathtracer::cryptomatte::{self, id_of};
use pathtracer::image::Samples;
use pathtracer::{Aov, Scene, Session, Settings, aov};
use pt_math::DVec3;
use pt_testing::mean_z_test;

use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

const SIZE: u32 = 64;
const RANKS: usize = 6;

/// Id and coverage of each rank of a pixel.
type Ranks = [[f32; 2]; RANKS];

fn rendered(scene: &Scene, aovs: &[Aov], spp: u32) -> Session {
    let settings = Settings { aovs: aovs.to_vec(), max_depth: 0, ..settings(spp) };
    render(scene, size([SIZE; 2]), settings)
}

/// Ranks of all pixels in the channels of a layer.
fn ranks(session: &Session, layer: &str) -> Vec<Ranks> {
    let channels = session.channels();
    let values = |rank: usize, letter: &str| {
        let name = format!("{layer}{:02}.{letter}", rank / 2);
        let channel = channels.iter().find(|c| c.name == name).expect("a channel of this name");
        assert!(!channel.half_suffices, "{name}");
        let Samples::Real(values) = &channel.samples else { panic!("{name} is real") };
        values.clone()
    };
    let mut ranks = vec![Ranks::default(); (SIZE * SIZE) as usize];
    for rank in 0..RANKS {
        let [id, share] = [["R", "G"], ["B", "A"]][rank % 2].map(|letter| values(rank, letter));
        for (pixel, (id, share)) in ranks.iter_mut().zip(id.into_iter().zip(share)) {
            pixel[rank] = [id, share];
        }
    }
    ranks
}

/// Matte of one object or material.
fn matte_of(ranks: &[Ranks], name: &str) -> Vec<f64> {
    let share =
        |pixel: &Ranks| pixel.iter().find(|rank| rank[0] == id_of(name)).map(|rank| rank[1]);
    ranks.iter().map(|pixel| f64::from(share(pixel).unwrap_or(0.0))).collect()
}

/// Sets the names of objects and materials.
fn named(mut scene: Scene, objects: &[&str], materials: &[&str]) -> Scene {
    for (object, name) in scene.objects.iter_mut().zip(objects) {
        object.name = (*name).into();
    }
    for (material, name) in scene.materials.iter_mut().zip(materials) {
        material.name = (*name).into();
    }
    scene
}

/// A ball of radius r at distance d covers the circle of tangent r/√(d² − r²) in the middle of the
/// image; the probability of a sample to hit it is the coverage of its pixel, so that the variance
/// of the sum is at most that of independent samples.
#[test]
fn a_ball_covers_a_circle_of_the_image() {
    let (radius, distance, spp) = (0.5, 4.0, 64);
    let scene = Builder::default()
        .sphere(DVec3::new(0.0, 0.0, -distance), radius, matte([0.5; 3]))
        .seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [40.0; 2]));
    let scene = named(scene, &["ball"], &["clay"]);
    let session =
        rendered(&scene, &[Aov::CryptomatteObject, Aov::Depth, Aov::CryptomatteMaterial], spp);
    let mattes = [("CryptoObject", "ball"), ("CryptoMaterial", "clay")]
        .map(|(layer, name)| matte_of(&ranks(&session, layer), name));
    assert_eq!(mattes[0], mattes[1], "the only material is that of the only object");
    let tangent = radius / (distance * distance - radius * radius).sqrt();
    let pixels = tangent / 20f64.to_radians().tan() * f64::from(SIZE) / 2.0;
    let want = std::f64::consts::PI * pixels * pixels;
    let area: f64 = mattes[0].iter().sum();
    let variance: f64 = mattes[0].iter().map(|share| share * (1.0 - share) / f64::from(spp)).sum();
    assert!((area - want).abs() < 4.0 * variance.sqrt(), "{area} ± {} and {want}", variance.sqrt());
    assert!(mattes[0].iter().filter(|share| **share == 1.0).count() > 300, "the middle is covered");
    assert_eq!(mattes[0][0], 0.0, "nothing is in the corner");
}

/// A sheet of opacity ¼ in front of a wall: each sample hits one of them.
#[test]
fn what_is_partly_there_covers_as_much_as_there_is_of_it() {
    let z = |z: f64| facing(DVec3::new(0.0, 0.0, z), DVec3::Z, 3.0);
    let scene = Builder::default()
        .quad(z(-4.0), matte([0.5; 3]))
        .quad(z(-3.0), matte([0.5; 3]))
        .seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [40.0; 2]));
    let mut scene = named(scene, &["wall", "sheet"], &[]);
    scene.materials[1].opacity = 0.25.into();
    let ranks = ranks(&rendered(&scene, &[Aov::CryptomatteObject], 256), "CryptoObject");
    let [wall, sheet] = ["wall", "sheet"].map(|name| matte_of(&ranks, name));
    assert!(wall.iter().zip(&sheet).all(|(a, b)| a + b == 1.0));
    mean_z_test(&sheet, 0.25, 1e-3).expect("a quarter");
    // The larger coverage is first.
    assert!(ranks.iter().all(|ranks| ranks[0][1] >= ranks[1][1] && ranks[2] == [0.0; 2]));
}

/// Ten strips side by side in each pixel, of different widths: the six widest are listed in this
/// order, with the coverage that the film has counted.
#[test]
fn the_six_things_that_cover_most_are_reported() {
    let width = 6.0 / f64::from(SIZE);
    let mut builder = Builder::default();
    let widths: Vec<f64> = (1..=10).map(|n| width * f64::from(n) / 55.0).collect();
    let mut x = 0.0;
    for width in &widths {
        let middle = DVec3::new(x + 0.5 * width, 0.0, -3.0);
        let stretch = pt_math::DAffine3::from_scale(DVec3::new(0.5 * width, 3.0, 1.0));
        builder = builder.quad(facing(middle, DVec3::Z, 1.0) * stretch, matte([0.5; 3]));
        x += width;
    }
    // The strips fill column 32.
    let scene = builder.seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [90.0; 2]));
    let names: Vec<_> = (1..=10).map(|n| format!("strip {n}")).collect();
    let names: Vec<_> = names.iter().map(String::as_str).collect();
    let scene = named(scene, &names, &names);
    let session = rendered(&scene, &[Aov::CryptomatteObject], 1024);
    let ranks = ranks(&session, "CryptoObject");
    let things = session.film().id_coverage(Aov::CryptomatteObject).expect("it is kept");
    let mut seen_in_all = 0;
    for ((ranks, things), x) in ranks.iter().zip(things).zip((0..SIZE).cycle()) {
        let mut counts: Vec<_> = things.iter().map(|seen| seen.samples).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        let shares = counts.iter().map(|count| *count as f32 / 1024.0);
        assert!(shares.chain([0.0; RANKS]).zip(ranks).all(|(want, rank)| want == rank[1]));
        if x == 32 {
            assert_eq!(counts.iter().sum::<u32>(), 1024);
            seen_in_all = seen_in_all.max(counts.len());
        }
    }
    assert_eq!(seen_in_all, 10);
    let widest = matte_of(&ranks, "strip 10");
    let column: Vec<_> = widest.into_iter().skip(32).step_by(SIZE as usize).collect();
    mean_z_test(&column, 10.0 / 55.0, 1e-3).expect("the share of its width");
    let metadata = cryptomatte::metadata(session.film(), session.names());
    let manifest = &metadata.iter().find(|(key, _)| key.ends_with("/manifest")).expect("names").1;
    assert_eq!(manifest.matches("strip").count(), 10);
}

/// All surfaces face the camera, so that the mean of their normals over all samples is the fraction
/// of the samples that hit one.
#[test]
fn things_cover_together_what_samples_see() {
    let mut builder = Builder::default();
    for n in 0..5 {
        let place = DVec3::new(
            f64::from(n) * 0.37 - 0.8,
            0.1 * f64::from(n * n),
            -5.0 + 0.3 * f64::from(n),
        );
        builder = builder.quad(facing(place, DVec3::Z, 0.4), matte([0.5; 3]));
    }
    let scene = builder.seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [40.0; 2]));
    let session = rendered(&scene, &[Aov::Normal, Aov::CryptomatteMaterial], 100);
    let normals = aov::means_of_all_samples(session.film(), Aov::Normal).expect("it is kept");
    let ranks = ranks(&session, "CryptoMaterial");
    let mut partly = 0;
    for (normal, ranks) in normals.iter().zip(&ranks) {
        let covered: f32 = ranks.iter().map(|rank| rank[1]).sum();
        assert!((covered - normal[2]).abs() < 1e-5, "{covered} and {}", normal[2]);
        partly += i32::from(covered > 0.0 && covered < 1.0);
    }
    assert!(partly > 50, "{partly}");
}
