//! Scenes of the course, which are not part of the project.

use std::collections::BTreeMap;
use std::path::Path;

use pt_scene::{Geometry, LightKind, Scene, Surface};

use crate::{check_invariants, value};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/dae");

/// Triangles, spheres, lights, and the number of triangles or spheres per material of a scene.
type Content =
    (&'static str, usize, usize, &'static [&'static str], &'static [(&'static str, usize)]);

const WALLS: [(&str, usize); 4] =
    [("0.6 0.6 0.6", 6), ("emits 10 10 10", 2), ("0.6 0.2 0.2", 2), ("0.2 0.2 0.6", 2)];

macro_rules! box_with {
    ($($more:expr),*) => { &[$($more,)* WALLS[0], WALLS[1], WALLS[2], WALLS[3]] };
}

const AREA: &[&str] = &["area 10 10 10"];
const GLASS: (&str, usize) = ("glass 1 1 1, 1 1 1, 1.45", 1);
const MIRROR: (&str, usize) = ("mirror 1 1 1", 1);

/// Content of the scenes as read by the course's renderer. The lights of two scenes without the
/// course's profile are attenuated as in COLLADA, by 1 + 0.001599907 d², with the same strength at
/// the root mean square distance to the box of the scene: d² is 8.831196 in `cube`, from (0, 0,
/// 1.49) to a cube of edges 0.4291 around (0.1298, −2.5714, 0.0216), and 3.049820 in `plane`, to a
/// rectangle of 2 by 1.5 around (0, −0.9957, 0.25).
const COURSE: &[Content] = &[
    (
        "keenan/banana",
        2458,
        0,
        &["ambient 1 1 1", "directional 1 1 1"],
        &[("0.506329 0.375042 0.2765", 28), ("none", 8), ("0.64 0.3728968 0.037932", 2422)],
    ),
    (
        "keenan/building",
        39506,
        0,
        &["ambient 1 1 1", "directional 1 1 1"],
        &[("0.8 0.670901 0.519588", 39498), ("none", 8)],
    ),
    ("meshedit/cow", 5856, 0, &["directional 1 1 1"], &[("0.48 0.48 0.48", 5856)]),
    ("meshedit/maxplanck", 50801, 0, &["directional 1 1 1"], &[("0.48 0.48 0.48", 50801)]),
    ("meshedit/teapot", 2464, 0, &["directional 1 1 1"], &[("0.48 0.48 0.48", 2464)]),
    ("simple/cube", 12, 0, &["point 8.708 8.708 8.708"], &[("none", 12)]),
    ("simple/plane", 2, 0, &["point 3.035 3.035 3.035"], &[("0.6 0.6 0.6", 2)]),
    ("sky/CBbunny", 28588, 0, AREA, box_with!(("0.5 0.5 0.5", 28576))),
    (
        "sky/CBbunny_microfacet_cu",
        28588,
        0,
        AREA,
        box_with!(("conductor 0.33228 1.0162 1.2474, 3.1646 2.5785 2.4603, 0.05", 28576)),
    ),
    ("sky/CBempty", 12, 0, &["point 5.000 5.000 5.000"], &WALLS),
    ("sky/CBspheres", 12, 2, AREA, box_with!(GLASS, MIRROR)),
    ("sky/CBspheres_lambertian", 12, 2, AREA, box_with!(("0.8 0.8 0.8", 2))),
    (
        "sky/CBspheres_microfacet_al_ag",
        12,
        2,
        AREA,
        box_with!(
            ("conductor 0.059193 0.059881 0.047366, 4.1283 3.5892 2.8132, 0.25", 1),
            ("conductor 1.3352 1.0109 0.68955, 7.3398 6.6157 5.6471, 0.025", 1)
        ),
    ),
    ("sky/CBspheres_refract", 12, 2, AREA, box_with!(("refraction 1 1 1, 1.45", 1), MIRROR)),
    ("sky/CBspheres_tex", 12, 2, AREA, box_with!(GLASS, MIRROR)),
    (
        "sky/bunny",
        33696,
        0,
        &["ambient 1 1 1"],
        &[("0.48 0.48 0.48", 28576), ("0.25 0.25 0.25", 5120)],
    ),
    (
        "sky/bunny_unlit",
        33696,
        0,
        &["ambient 0 0 0"],
        &[("0.48 0.48 0.48", 28576), ("0.25 0.25 0.25", 5120)],
    ),
];

fn rgb([r, g, b]: [f32; 3]) -> String {
    format!("{r} {g} {b}")
}

/// Returns the material of the course's renderer, which supports only the base of plastics.
fn cgl_material(scene: &Scene, material: Option<u32>) -> String {
    let Some(material) = material.map(|m| &scene.materials[m as usize]) else {
        return "none".into();
    };
    match &material.surface {
        Surface::Diffuse(m) => rgb(value(&m.reflectance)),
        Surface::Plastic(m) => rgb(value(&m.diffuse)),
        Surface::Mirror(m) => format!("mirror {}", rgb(value(&m.reflectance))),
        Surface::Glass(m) => {
            format!(
                "glass {}, {}, {}",
                rgb(value(&m.reflectance)),
                rgb(value(&m.transmittance)),
                m.ior
            )
        }
        Surface::Refraction(m) => format!("refraction {}, {}", rgb(value(&m.transmittance)), m.ior),
        Surface::Conductor(m) => format!(
            "conductor {}, {}, {}",
            rgb(m.eta),
            rgb(m.k),
            m.roughness.as_ref().map_or(0.0, |r| value(&r.alpha[0]))
        ),
        Surface::ThinGlass(m) => format!("thin glass {}", m.ior),
        Surface::CoatedDiffuse(m) => format!("coated {:?}", m.diffuse),
        Surface::Black(_) => format!("emits {}", rgb(value(&material.emission))),
        other => panic!("the course's scenes have no {other:?}"),
    }
}

fn course_light(kind: &LightKind) -> String {
    match kind {
        LightKind::Hemisphere { radiance } => format!("ambient {}", rgb(*radiance)),
        LightKind::Directional { irradiance } => format!("directional {}", rgb(*irradiance)),
        LightKind::Point { intensity: [r, g, b] } => format!("point {r:.3} {g:.3} {b:.3}"),
        LightKind::Area { radiance } => format!("area {}", rgb(*radiance)),
        other => panic!("the course's scenes have no {other:?}"),
    }
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn scenes_of_the_course_load_completely() {
    for (name, triangles, spheres, lights, materials) in COURSE {
        let path = Path::new(SHARED).join(format!("{name}.dae"));
        let scene = pt_formats::load(&path).expect("a good file");
        check_invariants(&scene);
        let attenuated = usize::from(name.starts_with("simple/"));
        assert_eq!(scene.warnings.len(), attenuated, "{name}: {:?}", scene.warnings);
        assert!(scene.warnings.iter().all(|w| w.message.contains("falls off")), "{name}");
        assert_eq!(scene.cameras.len(), 1, "{name}");
        let found: Vec<_> = scene.lights.iter().map(|l| course_light(&l.kind)).collect();
        assert_eq!(found, *lights, "{name}");
        let (mut counts, mut of_material) = ([0, 0], BTreeMap::new());
        let mut count = |kind: usize, material, n| {
            counts[kind] += n;
            *of_material.entry(cgl_material(&scene, material)).or_insert(0) += n;
        };
        for object in &scene.objects {
            match &object.geometry {
                Geometry::Sphere { .. } => count(1, object.materials[0], 1),
                Geometry::Points { .. } => panic!("{name} has points"),
                Geometry::Mesh(mesh) => mesh.submeshes.iter().for_each(|part| {
                    count(0, object.materials[part.slot as usize], part.triangles.len());
                }),
            }
        }
        assert_eq!(counts, [*triangles, *spheres], "{name}");
        let expected = materials.iter().map(|(m, n)| ((*m).to_owned(), *n)).collect();
        assert_eq!(of_material, expected, "{name}");
    }
}
