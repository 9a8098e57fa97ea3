//! Receiving points near an emissive triangle, which is then sampled by solid angle.

use pt_math::{Spectrum, Vec3};
use pt_testing::Random;

use super::super::{AnyLight, EmitterTriangle, LightSampleContext, LightTables, MeshLight};
use super::{Example, assert_density, samples};

/// Regular, flat, and long triangles at z = 0 that emit upwards.
fn triangles() -> Vec<Example> {
    let edges = [
        (Vec3::X, Vec3::Y),
        (Vec3::new(1.2, 0.1, 0.0), Vec3::new(0.6, 0.5, 0.0)),
        (Vec3::new(-0.3, 1.2, 0.0), Vec3::new(-0.8, -0.1, 0.0)),
    ];
    let light = |(e1, e2)| {
        let triangle = EmitterTriangle { p0: Vec3::ZERO, e1, e2, normal: Vec3::Z, coat: 0.0 };
        let mut tables = LightTables::default();
        let light = MeshLight::new(&mut tables, &[triangle], Spectrum::ONE).expect("an area");
        (light.into(), tables)
    };
    edges.map(light).into()
}

/// Points above the centre, an edge and a corner, and beside the triangle, from near to nearly
/// edge-on.
fn places((light, tables): &Example) -> Vec<Vec3> {
    let AnyLight::Mesh(_) = light else { panic!("{light:?} is no mesh") };
    let EmitterTriangle { e1, e2, .. } = tables.triangles[0];
    let feet = [(e1 + e2) * 0.3, e1 * 0.5, (e1 + e2) * -0.003];
    let above = feet.iter().flat_map(|&foot| [0.01, 0.1, 0.7].map(|h| foot + Vec3::Z * h));
    let beside = [0.1, 0.3].map(|h| e1 * 1.3 - e2 * 0.2 + Vec3::Z * h);
    above.chain(beside).collect()
}

/// If triangles are sampled by solid angle, the density is constant.
#[test]
fn near_triangles_are_sampled_evenly() {
    for example in triangles() {
        for p in places(&example) {
            let all = samples(&example, &LightSampleContext::in_space(p), &mut Random::new(7), 300);
            let pdfs: Vec<f32> = all.iter().filter_map(|s| s.pdf).map(pt_math::Pdf::get).collect();
            assert!(pdfs.len() > 290, "{p}: {} samples", pdfs.len());
            assert!(pdfs.iter().all(|&pdf| pdf == pdfs[0]), "{:?} {p}", example.0);
        }
    }
}

/// The histogram of samples fits that density, whose integral is 1.
#[test]
fn near_triangles_are_sampled_by_their_density() {
    let all = triangles();
    for example in &all {
        let places = places(example);
        for &p in &places {
            assert_density(
                example,
                &LightSampleContext::in_space(p),
                50_000,
                all.len() * places.len(),
            );
        }
    }
}
