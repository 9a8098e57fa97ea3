//! Laws of the warps: each follows its density, stretches area by its reciprocal, and has an
//! inverse.

use std::f32::consts::TAU;

use pt_math::Vec3;
use pt_math::warp::*;
use pt_testing::{Chi2, Random, chi2_sphere, chi2_square};

type Sample = Box<dyn Fn([f32; 2]) -> Vec3>;
type Density = Box<dyn Fn(Vec3) -> f32>;

/// Warp onto directions.
struct Spherical {
    name: String,
    sample: Sample,
    invert: Box<dyn Fn(Vec3) -> [f32; 2]>,
    pdf: Density,
}

/// Sizes of cones, as 1 − cos: a sphere, a hemisphere, a lamp, the sun, a star.
const CONES: [f32; 5] = [2.0, 1.0, 0.13, 1.08e-5, 1e-12];

fn spherical() -> Vec<Spherical> {
    let mut all = vec![
        Spherical {
            name: "cosine hemisphere".to_owned(),
            sample: Box::new(cosine_hemisphere),
            invert: Box::new(cosine_hemisphere_invert),
            pdf: Box::new(|w| cosine_hemisphere_pdf(w.z).get()),
        },
        Spherical {
            name: "uniform hemisphere".to_owned(),
            sample: Box::new(uniform_hemisphere),
            invert: Box::new(uniform_hemisphere_invert),
            pdf: Box::new(|w| uniform_hemisphere_pdf(w.z).get()),
        },
        Spherical {
            name: "uniform sphere".to_owned(),
            sample: Box::new(uniform_sphere),
            invert: Box::new(uniform_sphere_invert),
            pdf: Box::new(|_| uniform_sphere_pdf().get()),
        },
    ];
    all.extend(CONES.map(|size| Spherical {
        name: format!("cone of {size}"),
        sample: Box::new(move |u| uniform_cone(u, size)),
        invert: Box::new(move |w| uniform_cone_invert(w, size)),
        pdf: Box::new(move |w| {
            let inside = f64::from(w.z) >= 1.0 - f64::from(size) - 1e-7;
            if inside { uniform_cone_pdf(size).get() } else { 0.0 }
        }),
    }));
    all
}

/// 1 − cos θ without cancellation.
fn one_minus_cos(w: Vec3) -> f32 {
    if w.z > 0.0 { (w.x * w.x + w.y * w.y) / (1.0 + w.z) } else { 1.0 - w.z }
}

#[test]
fn directions_follow_their_densities() {
    // Small cones do not fill a bin; positions in them are tested below.
    let warps: Vec<_> = spherical().into_iter().filter(|w| (w.pdf)(Vec3::Z) < 10.0).collect();
    for w in &warps {
        let config = Chi2::new(&w.name).one_of(warps.len());
        chi2_sphere(|u| Some((w.sample)(u)), &w.pdf, &config).unwrap();
    }
}

#[test]
fn cones_of_all_sizes_are_uniform_inside() {
    for size in CONES {
        // 1 − cos θ and φ are uniform: the area of a cap is 2π(1 − cos θ).
        let place = |u| {
            let w = uniform_cone(u, size);
            let turns = (w.y.atan2(w.x) / TAU).rem_euclid(1.0);
            let height = one_minus_cos(w) / size;
            Some([height.min(1.0f32.next_down()), turns.min(1.0f32.next_down())])
        };
        let name = format!("inside a cone of {size}");
        chi2_square(place, |_| 1.0, &Chi2::new(&name).one_of(CONES.len())).unwrap();
        let area = TAU * size;
        assert!((uniform_cone_pdf(size).get() * area - 1.0).abs() < 1e-6);
    }
}

#[test]
fn the_disk_is_uniform() {
    let place = |u| Some(concentric_disk(u).map(|x| 0.5 * x + 0.5));
    let density = concentric_disk_pdf().get();
    let pdf = |p: [f32; 2]| {
        let [x, y] = p.map(|t| 2.0 * t - 1.0);
        // The square of side 2 has four times the area of the unit square.
        if x * x + y * y < 1.0 + 1e-6 { 4.0 * density } else { 0.0 }
    };
    chi2_square(place, pdf, &Chi2::new("disk")).unwrap();
}

#[test]
fn the_triangle_is_uniform() {
    // Barycentric coordinates fill a triangle of area ½.
    let density = uniform_triangle_pdf(0.5).get();
    let pdf = |b: [f32; 2]| if b[0] + b[1] < 1.0 + 1e-6 { density } else { 0.0 };
    chi2_square(|u| Some(uniform_triangle(u)), pdf, &Chi2::new("triangle")).unwrap();
}

/// Random points, the corners, the midpoints of the sides, and the centre.
fn points() -> Vec<[f32; 2]> {
    let last = 1.0f32.next_down();
    let mut points = Vec::new();
    for a in [0.0, 0.5, last] {
        points.extend([0.0, 0.5, last].map(|b| [a, b]));
    }
    let mut random = Random::new(3);
    points.extend((0..100_000).map(|_| random.unit_2d()));
    points
}

#[test]
fn directions_have_unit_length_and_a_density() {
    for w in spherical() {
        for u in points() {
            let v = (w.sample)(u);
            assert!((v.as_dvec3().length() - 1.0).abs() < 5e-7, "{}: {u:?} gives {v}", w.name);
            let pdf = (w.pdf)(v);
            assert!(pdf > 0.0 && pdf.is_finite(), "{}: {u:?} gives {v}", w.name);
        }
    }
}

#[test]
fn inverses_lead_back() {
    let close = |name: &str, u: [f32; 2], back: [f32; 2]| {
        let error = (u[0] - back[0]).abs().max((u[1] - back[1]).abs());
        assert!(error < 1e-4, "{name}: {u:?} comes back as {back:?}");
    };
    for u in points() {
        close("disk", u, concentric_disk_invert(concentric_disk(u)));
        close("triangle", u, uniform_triangle_invert(uniform_triangle(u)));
    }
    for w in spherical() {
        // The rim of the disk is a single point of the sphere, which has no inverse.
        let has_rim = |u: &[f32; 2]| {
            let v = (w.sample)(*u);
            v.z > 0.0 || v.x.hypot(v.y) > 3e-3
        };
        for u in points().into_iter().filter(has_rim) {
            close(&w.name, u, (w.invert)((w.sample)(u)));
        }
    }
}

/// |∂p/∂u × ∂p/∂v| by central differences.
fn stretch(warp: &dyn Fn([f32; 2]) -> Vec3, [u, v]: [f32; 2], h: f32) -> f32 {
    let along = |a: [f32; 2], b: [f32; 2]| (warp(a) - warp(b)) / (2.0 * h);
    along([u + h, v], [u - h, v]).cross(along([u, v + h], [u, v - h])).length()
}

#[test]
fn area_is_stretched_by_one_over_the_density() {
    const H: f32 = 1.0 / 512.0;
    let mut warps: Vec<(String, Sample, Density)> =
        spherical().into_iter().map(|w| (w.name, w.sample, w.pdf)).collect();
    let flat = |p: [f32; 2]| Vec3::new(p[0], p[1], 0.0);
    warps.push((
        "disk".to_owned(),
        Box::new(move |u| flat(concentric_disk(u))),
        Box::new(|_| concentric_disk_pdf().get()),
    ));
    warps.push((
        "triangle".to_owned(),
        Box::new(move |u| flat(uniform_triangle(u))),
        Box::new(|_| uniform_triangle_pdf(0.5).get()),
    ));
    let mut random = Random::new(5);
    for (name, sample, pdf) in &warps {
        for _ in 0..2000 {
            let u = [random.between(0.02, 0.98), random.between(0.02, 0.98)];
            // The maps have creases on the diagonals, where differences are meaningless.
            let crease = (u[0] - u[1]).abs().min((u[0] + u[1] - 1.0).abs());
            if crease < 3.0 * H {
                continue;
            }
            let product = stretch(sample, u, H) * pdf(sample(u));
            assert!((product - 1.0).abs() < 0.01, "{name} at {u:?}: {product}");
        }
    }
}

#[test]
fn densities_below_the_horizon_are_zero() {
    assert_eq!(cosine_hemisphere_pdf(-0.1).get(), 0.0);
    assert_eq!(uniform_hemisphere_pdf(-0.1).get(), 0.0);
}
