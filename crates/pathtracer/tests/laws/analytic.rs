//! A diffuse plane under each light, against the closed form of its irradiance: L = ρE/π.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use pathtracer::{CompileOptions, EnvironmentMap, IesProfile, Image, Region, Session, Settings};
use pt_math::DVec3;
use pt_scene::texture::Filter;
use pt_scene::{LightKind, Rows};
use pt_testing::{irradiance, sidak};

use crate::furnace::ESTIMATORS;
use crate::materials::row;
use crate::measure::{assert_uniform, finish, settings};
use crate::scenes::{Builder, camera, facing, looking, matte};

const ALBEDO: f32 = 0.6;
const HEIGHT: f64 = 2.0;
const UP: DVec3 = DVec3::Y;
const ABOVE: DVec3 = DVec3::new(0.3, HEIGHT, -0.2);
/// Size of the image of which a few pixels are rendered: they are so small that the radiance does
/// not vary within.
const RESOLUTION: [u32; 2] = [2001, 2001];
const PIXELS: [[u32; 2]; 3] = [[1000, 1000], [500, 800], [1400, 1250]];

struct Case {
    name: &'static str,
    add: fn(Builder) -> Builder,
    map: bool,
    irradiance: fn(DVec3) -> f64,
}

fn image() -> Image {
    let texels = (0..32u16).map(|i| [f32::from(i % 5) * 0.5, f32::from(i % 3), 0.5]);
    Image { width: 8, height: 4, pixels: texels.collect() }
}

fn map() -> EnvironmentMap {
    EnvironmentMap::of_image(Arc::new(image()), Rows::default())
}

/// Irradiance of the map, whose directions are rotated.
fn of_map(to_map: fn(DVec3) -> DVec3) -> f64 {
    let map = map();
    irradiance::of_sky(UP, 512, |d| f64::from(map.radiance(to_map(d).as_vec3()).luminance()))
}

fn inverse_square(p: DVec3) -> f64 {
    let d = ABOVE - p;
    d.normalize().y / d.length_squared()
}

/// Rotationally symmetric: 500 candela straight down, 200 at 45°, and none from 90° on.
pub(crate) fn luminaire() -> IesProfile {
    let file = b"TILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 50\n0 45 90\n0\n500 200 0\n";
    pt_formats::ies::parse(file, Path::new("luminaire.ies")).expect("a good file")
}

/// Corners of a square of half side 0.5 around [`ABOVE`].
fn square() -> [DVec3; 4] {
    [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, z]| ABOVE + DVec3::new(x, 0.0, z))
}

const TILT: DVec3 = DVec3::new(0.6, 0.8, 0.0);

const POINT: Case = Case {
    name: "point",
    add: |b| b.light(LightKind::Point { intensity: [4.0; 3] }, looking(ABOVE, DVec3::ZERO)),
    map: false,
    irradiance: |p| 4.0 * inverse_square(p),
};

const SPOT: Case = Case {
    name: "spot",
    add: |b| {
        let kind =
            LightKind::Spot { intensity: [4.0; 3], falloff_angle: 90.0, falloff_exponent: 3.0 };
        b.light(kind, looking(ABOVE, ABOVE - UP))
    },
    map: false,
    irradiance: |p| {
        let cos = (ABOVE - p).normalize().y;
        if cos > 0.5f64.sqrt() { 4.0 * cos.powi(3) * inverse_square(p) } else { 0.0 }
    },
};

const LINEAR_SPOT: Case = Case {
    name: "linear spot",
    add: |b| {
        let kind = LightKind::LinearSpot {
            intensity: [4.0; 3],
            beam_angle: 20.0,
            cutoff_angle: 80.0,
            texture: None,
        };
        b.light(kind, looking(ABOVE, ABOVE - UP))
    },
    map: false,
    irradiance: |p| {
        let angle = (ABOVE - p).normalize().y.acos().to_degrees();
        4.0 * ((80.0 - angle) / 60.0).clamp(0.0, 1.0) * inverse_square(p)
    },
};

const PUNCTUAL_SPOT: Case = Case {
    name: "punctual spot",
    add: |b| {
        let kind =
            LightKind::PunctualSpot { intensity: [4.0; 3], inner_angle: 20.0, outer_angle: 80.0 };
        b.light(kind, looking(ABOVE, ABOVE - UP))
    },
    map: false,
    irradiance: |p| {
        let [inner, outer] = [20.0_f64, 80.0].map(|angle| angle.to_radians().cos());
        let share = ((ABOVE - p).normalize().y - outer) / (inner - outer);
        4.0 * share.clamp(0.0, 1.0).powi(2) * inverse_square(p)
    },
};

const PROJECTOR: Case = Case {
    name: "projector",
    add: |b| {
        let kind = LightKind::Projector {
            intensity: [4.0; 3],
            x_fov: 110.0,
            y_fov: 100.0,
            texture: row(&[[1.0; 3]], Filter::Nearest),
        };
        b.light(kind, looking(ABOVE, ABOVE - UP))
    },
    map: false,
    // I / cos³ θ at the distance HEIGHT / cos θ.
    irradiance: |_| 4.0 / (HEIGHT * HEIGHT),
};

const LUMINAIRE: Case = Case {
    name: "luminaire",
    add: |b| {
        let kind = LightKind::Ies { profile: Arc::new(luminaire()), scale: [0.01; 3] };
        b.light(kind, looking(ABOVE, ABOVE - UP))
    },
    map: false,
    irradiance: |p| {
        let angle = (ABOVE - p).normalize().y.acos().to_degrees();
        0.01 * f64::from(luminaire().candela(angle as f32, 0.0)) * inverse_square(p)
    },
};

const DISTANT_DISK: Case = Case {
    name: "distant disk",
    add: |b| {
        let kind = LightKind::DistantDisk { irradiance: [2.0; 3], angular_radius: 5.0 };
        b.light(kind, looking(TILT, DVec3::ZERO))
    },
    map: false,
    irradiance: |_| 2.0 * TILT.y,
};

const DIRECTIONAL: Case = Case {
    name: "directional",
    add: |b| b.light(LightKind::Directional { irradiance: [2.0; 3] }, looking(TILT, DVec3::ZERO)),
    map: false,
    irradiance: |_| 2.0 * TILT.y,
};

const AREA: Case = Case {
    name: "area",
    add: |b| b.light(LightKind::Area { radiance: [3.0; 3] }, looking(ABOVE, ABOVE - UP)),
    map: false,
    irradiance: |p| 3.0 * irradiance::of_polygon(&square(), p, UP),
};

const EMISSIVE_MESH: Case = Case {
    name: "emissive mesh",
    add: |b| b.emissive_quad(facing(ABOVE, -UP, 0.5), 3.0),
    map: false,
    irradiance: |p| 3.0 * irradiance::of_polygon(&square(), p, UP),
};

const SPHERE: Case = Case {
    name: "sphere",
    add: |b| b.emissive_sphere(ABOVE, 0.7, 3.0),
    map: false,
    irradiance: |p| 3.0 * irradiance::of_sphere(ABOVE, 0.7, p, UP),
};

const HEMISPHERE: Case = Case {
    name: "hemisphere",
    add: |b| b.light(LightKind::Hemisphere { radiance: [1.5; 3] }, looking(ABOVE, DVec3::ZERO)),
    map: false,
    irradiance: |_| 1.5 * PI,
};

const CONSTANT_SKY: Case =
    Case { name: "constant sky", add: |b| b.sky(1.5), map: false, irradiance: |_| 1.5 * PI };

const SKY_IMAGE: Case = Case {
    name: "image of the sky",
    add: |b| {
        let kind = LightKind::Environment {
            image: Arc::new(image()),
            scale: 2.0,
            rows: Rows::default(),
            portal: None,
        };
        b.light(kind, looking(DVec3::ZERO, DVec3::NEG_X))
    },
    map: false,
    // The node's +z is the world's +x.
    irradiance: |_| 2.0 * of_map(|d| DVec3::new(-d.z, d.y, d.x)),
};

const ENVIRONMENT_MAP: Case =
    Case { name: "environment map", add: |b| b, map: true, irradiance: |_| of_map(|d| d) };

pt_scene::light_kinds!(kinds);

/// Case of a kind of light; `None` for daylight, whose irradiance has no closed form.
fn case_of(kind: Kind) -> Option<Case> {
    Some(match kind {
        Kind::Hemisphere => HEMISPHERE,
        Kind::Constant => CONSTANT_SKY,
        Kind::Environment => SKY_IMAGE,
        Kind::Directional => DIRECTIONAL,
        Kind::DistantDisk => DISTANT_DISK,
        Kind::Point => POINT,
        Kind::Spot => SPOT,
        Kind::LinearSpot => LINEAR_SPOT,
        Kind::PunctualSpot => PUNCTUAL_SPOT,
        Kind::Projector => PROJECTOR,
        Kind::Ies => LUMINAIRE,
        Kind::Area => AREA,
        Kind::Daylight => return None,
    })
}

/// Cases of all kinds of light nodes, of emissive surfaces, and of the environment map that
/// replaces those of scenes.
fn cases() -> Vec<Case> {
    let nodes = KINDS.iter().filter_map(|kind| case_of(*kind));
    nodes.chain([EMISSIVE_MESH, SPHERE, ENVIRONMENT_MAP]).collect()
}

fn session(case: &Case, settings: Settings) -> Session {
    let floor = facing(DVec3::ZERO, UP, 50.0);
    let scene = (case.add)(Builder::default().quad(floor, matte([ALBEDO; 3])));
    let view = camera(DVec3::new(7.0, 6.0, 7.0), DVec3::ZERO, [20.0, 20.0]);
    let options = CompileOptions {
        resolution: Some(RESOLUTION),
        environment: case.map.then(map),
        ..CompileOptions::default()
    };
    Session::new(&scene.seen_by(view), options, settings).expect("the scene makes sense")
}

/// Point of the plane y = 0 at the centre of a pixel.
fn floor_point(session: &Session, [x, y]: [u32; 2]) -> DVec3 {
    let ray = session.scene().camera.ray([x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    o - d * (o.y / d.y)
}

/// Every light, by every estimator, with one and with several samples, by both integrators.
#[test]
fn a_plane_under_each_light_has_the_radiance_of_the_closed_form() {
    let cases = cases();
    let tests = cases.len() * ESTIMATORS.len() * PIXELS.len();
    for case in &cases {
        for (i, direct) in ESTIMATORS.into_iter().enumerate() {
            let integrator = if i % 2 == 0 { "path" } else { "direct" };
            let integrator = integrator.to_owned();
            let light_samples = 1 + 2 * (i as u32 / 2);
            let settings = Settings { direct, integrator, light_samples, ..settings(32_768) };
            let mut session = session(case, settings);
            for [x, y] in PIXELS {
                session.restrict(Region { x, y, width: 1, height: 1 }).expect("inside");
                finish(&mut session);
                let p = floor_point(&session, [x, y]);
                let want = f64::from(ALBEDO) / PI * (case.irradiance)(p);
                let what = format!("{} at {p}, {direct:?}", case.name);
                assert!(want > 0.0, "{what} is dark");
                assert_uniform(session.film(), want, sidak(1e-4, tests), &what);
            }
        }
    }
}

/// A floor close below a square that emits downwards, seen from above beside it, at grazing
/// incidence. The square lies in a plane through the origin, where its coordinates have no error.
#[test]
fn a_floor_close_to_a_square_has_the_radiance_of_the_closed_form() {
    const GAP: f64 = 0.05;
    const PLACES: [f64; 3] = [0.52, 0.7, 1.5];
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let corners = corners.map(|[x, z]| DVec3::new(x, 0.0, z));
    let tests = PLACES.len() * ESTIMATORS.len();
    for x in PLACES {
        let p = DVec3::new(x, -GAP, 0.1);
        let scene = Builder::default()
            .quad(facing(-UP * GAP, UP, 5.0), matte([ALBEDO; 3]))
            .emissive_quad(facing(DVec3::ZERO, -UP, 0.5), 3.0)
            .seen_by(camera(p + UP, p, [20.0, 20.0]));
        let want = f64::from(ALBEDO) / PI * 3.0 * irradiance::of_polygon(&corners, p, UP);
        for direct in ESTIMATORS {
            let options =
                CompileOptions { resolution: Some(RESOLUTION), ..CompileOptions::default() };
            let settings = Settings { direct, ..settings(100_000) };
            let mut session = Session::new(&scene, options, settings).expect("it makes sense");
            session.restrict(Region { x: 1000, y: 1000, width: 1, height: 1 }).expect("inside");
            finish(&mut session);
            let what = format!("beside the square at {p}, {direct:?}");
            assert_uniform(session.film(), want, sidak(1e-4, tests), &what);
        }
    }
}
