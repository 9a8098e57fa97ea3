//! Textures of positions in space or of the normals of surfaces: on planes, as bump maps, on
//! animated objects, and as emission.

use std::f32::consts::PI;
use std::sync::Arc;

use pathtracer::{CompileOptions, Film, Scene, Session, Settings};
use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::image::Image;
use pt_scene::material::{Black, SurfaceDetail};
use pt_scene::texture::{
    Bitmap, Blend, Color, Filter, Input, Noise, NormalOrBump, Pattern, Procedural, Texture,
    TextureMapping, Wrap,
};
use pt_scene::{Key, LightKind, Mesh, Motion, Surface, shapes};

use crate::furnace::ESTIMATORS;
use crate::measure::{assert_all_agree, render, settings};
use crate::scenes::{Builder, camera, facing, looking, matte, size};

const FAR: DVec3 = DVec3::new(0.0, 0.0, 4.0);

/// A texture of two by two texels, linear between the centres of these and constant beyond.
fn linear() -> Pattern {
    let pixels = vec![[0.2, 0.5, 0.9], [0.8, 0.1, 0.4], [0.6, 0.9, 0.1], [0.3, 0.4, 0.7]];
    let image = Arc::new(Image { width: 2, height: 2, pixels: pixels.into() });
    Pattern::Bitmap(Bitmap { image, wrap: Wrap::CLAMP, filter: Filter::Bilinear })
}

fn in_space(pattern: Pattern, to_texture: DAffine3) -> Arc<Texture> {
    Arc::new(Texture { layout: TextureMapping::Space { to_texture }, ..pattern.into() })
}

fn showing(texture: Arc<Texture>) -> Surface {
    pt_scene::material::Diffuse { reflectance: Color::Texture(texture), two_sided: true }.into()
}

fn seen(mesh: Mesh, surface: Surface, to_world: DAffine3) -> Scene {
    let view = camera(FAR, DVec3::ZERO, [20.0, 16.0]);
    Builder::default().mesh(mesh, to_world, surface).sky(1.0).seen_by(view)
}

fn film(scene: &Scene) -> Film {
    render(scene, size([10, 8]), settings(8)).film().clone()
}

fn assert_alike(a: &Film, b: &Film, what: &str) {
    for (i, (a, b)) in a.pixels().zip(b.pixels()).enumerate() {
        let (a, b) = (a.mean(), b.mean());
        let near = a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4 * b.abs().max(1.0));
        assert!(near, "{what}, pixel {i}: {a:?} {b:?}");
    }
}

/// Transform of the square [−1, 1]² of the plane of x and y to the unit square.
fn onto_square() -> DAffine3 {
    let half = DVec3::new(0.5, 0.5, 1.0);
    DAffine3::from_scale_rotation_translation(
        half,
        pt_math::DQuat::IDENTITY,
        DVec3::new(0.5, 0.5, 0.0),
    )
}

/// On a square whose texture coordinates are those of a plane, a texture on this plane equals one
/// on the texture coordinates; also with a transform of these, and if the unit of the scene is not
/// the metre.
#[test]
fn pictures_on_planes_are_those_on_coordinates() {
    let to_pattern = DMat3::from_cols(
        DVec3::new(0.7, 0.2, 0.0),
        DVec3::new(-0.1, 0.6, 0.0),
        DVec3::new(0.1, 0.3, 1.0),
    );
    let on_surface = Arc::new(Texture::on_surface(linear(), to_pattern));
    let on_plane = Texture { to_pattern, ..(*in_space(linear(), onto_square())).clone() };
    let scene = |texture: Arc<Texture>, unit: f64| {
        let scene = seen(shapes::rectangle(), showing(texture), DAffine3::IDENTITY);
        Scene { metres_per_unit: unit, ..scene }
    };
    let want = film(&scene(Arc::clone(&on_surface), 1.0));
    for unit in [1.0, 0.01] {
        assert_alike(&film(&scene(Arc::new(on_plane.clone()), unit)), &want, &format!("{unit}"));
    }
}

/// A texture in space is fixed while objects move through it, and copies of an object show it at
/// their own places.
#[test]
fn what_moves_shows_what_is_in_space_where_it_is() {
    let texture = in_space(linear(), onto_square());
    let still = seen(
        shapes::rectangle(),
        showing(Arc::clone(&texture)),
        DAffine3::from_scale(DVec3::splat(3.0)),
    );
    let mut moving = still.clone();
    let key = |time: f64, x: f64| Key {
        time,
        to_world: DAffine3::from_translation(DVec3::new(x, 0.3 * x, 0.0))
            * DAffine3::from_scale(DVec3::splat(3.0)),
    };
    let motion = Motion::new(vec![key(0.0, -0.8), key(1.0, 0.9)]).expect("it makes sense");
    moving.objects[0].to_world = DAffine3::IDENTITY;
    moving.objects[0].motion = Some(Arc::new(motion));
    moving.cameras[0].shutter = [0.0, 1.0];
    let turned = DAffine3::from_scale(DVec3::splat(3.0)) * DAffine3::from_rotation_z(0.7);
    let turned = seen(shapes::rectangle(), showing(texture), turned);
    assert_alike(&film(&moving), &film(&still), "moving");
    assert_alike(&film(&turned), &film(&still), "turned");
}

/// Heights h (a x + b y) over a wall z = 0 have the normal (−h a, −h b, 1), whatever the texture
/// coordinates of the wall are, and also without any; the radiance is its cosine with the direction
/// of the light.
#[test]
fn linear_heights_in_space_tilt_the_normal_by_their_gradient() {
    // Between the centres of texels, which are the lines x = ∓4 on the wall, the texture grows from
    // 0.2 to 0.8.
    let pixels = vec![[0.2; 3], [0.8; 3]];
    let image = Arc::new(Image { width: 2, height: 1, pixels: pixels.into() });
    let ramp = Pattern::Bitmap(Bitmap { image, wrap: Wrap::CLAMP, filter: Filter::Bilinear });
    let turn = DAffine3::from_rotation_z(0.5);
    let to_ramp = DAffine3::from_translation(DVec3::splat(0.5))
        * DAffine3::from_scale(DVec3::splat(1.0 / 16.0))
        * turn;
    let heights = in_space(ramp, to_ramp);
    let (height, slope) = (2.5_f64, 0.6 / 8.0);
    let gradient = turn.matrix3.transpose() * (DVec3::X * (slope * height));
    let normal = (DVec3::Z - gradient).normalize();
    let to_light = DVec3::new(0.3, -0.4, 0.9).normalize();
    let want = normal.dot(to_light);
    let mut skewed = shapes::rectangle();
    if let Some(uvs) = &mut skewed.uvs {
        for uv in &mut uvs.values {
            *uv = [3.0 * uv[0] + uv[1], 0.5 * uv[1] - 0.7 * uv[0]];
        }
    }
    let bare = Mesh { uvs: None, ..shapes::rectangle() };
    for mesh in [shapes::rectangle(), skewed, bare] {
        let relief = NormalOrBump::Heights(Arc::clone(&heights), height as f32);
        let surface = SurfaceDetail::new(matte([1.0; 3]), relief);
        let scene = Builder::default()
            .mesh(mesh, DAffine3::IDENTITY, surface.into())
            .light(LightKind::Directional { irradiance: [PI; 3] }, looking(to_light, DVec3::ZERO))
            .seen_by(camera(FAR, DVec3::ZERO, [2.0, 1.6]));
        for pixel in film(&scene).pixels() {
            let got = pixel.luminance().0;
            assert!((got - want).abs() < 1e-4, "{got} for {want}");
        }
    }
}

/// Rotated walls have the magnitude of the cosine between their normal and a direction of any
/// length: static, as one of two copies, and animated.
#[test]
fn what_faces_a_direction_shows_its_cosine() {
    let direction = [0.4, -0.6, 1.4_f32];
    let along = DVec3::from(direction.map(f64::from)).normalize();
    let to_light = DVec3::new(0.3, -0.4, 0.9).normalize();
    let turns = [[0.0, 0.0], [0.9, -0.3], [-0.4, 0.8]];
    for (i, [x, y]) in turns.into_iter().enumerate() {
        let turn = DAffine3::from_rotation_x(x) * DAffine3::from_rotation_y(y);
        let to_world = turn * DAffine3::from_scale(DVec3::splat(5.0));
        let normal = turn.matrix3 * DVec3::Z;
        let want = normal.dot(along).abs() * normal.dot(to_light);
        let still = Builder::default()
            .mesh(
                shapes::rectangle(),
                to_world,
                showing(Arc::new(Pattern::AbsNormalDot(direction).into())),
            )
            .light(LightKind::Directional { irradiance: [PI; 3] }, looking(to_light, DVec3::ZERO))
            .seen_by(camera(FAR, DVec3::ZERO, [20.0, 16.0]));
        let mut copied = still.clone();
        let mut copy = copied.objects[0].clone();
        copy.to_world =
            DAffine3::from_translation(DVec3::Z * -40.0) * DAffine3::from_rotation_x(1.0);
        copied.objects.push(copy);
        let mut moving = still.clone();
        let key = |time: f64, x: f64| Key {
            time,
            to_world: DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)) * to_world,
        };
        let motion = Motion::new(vec![key(0.0, -0.2), key(1.0, 0.2)]).expect("it makes sense");
        moving.objects[0].to_world = DAffine3::IDENTITY;
        moving.objects[0].motion = Some(Arc::new(motion));
        moving.cameras[0].shutter = [0.0, 1.0];
        for (name, scene) in [("still", still), ("copied", copied), ("moving", moving)] {
            for pixel in film(&scene).pixels() {
                let got = pixel.luminance().0;
                assert!((got - want).abs() < 1e-5, "{name} {i}: {got} for {want}");
            }
        }
    }
}

/// A panel and a ball that emit textures of noise and cubes, and of their normals.
fn emitting_noise() -> Scene {
    let noise = Pattern::Procedural(Procedural::Fbm(Noise { octaves: 3, roughness: 0.5 }));
    let noise = in_space(noise, DAffine3::from_scale(DVec3::splat(2.3)));
    let facing_up: Arc<Texture> = Arc::new(Pattern::AbsNormalDot([0.5, 1.0, -0.3]).into());
    let less = Blend {
        first: [0.5, 1.0, 2.0].into(),
        second: [9.0, 7.0, 5.0].into(),
        amount: Input::Texture(Arc::clone(&facing_up)),
    };
    let less = Color::Texture(Arc::new(Pattern::Blend(Box::new(less)).into()));
    let bright = Pattern::Product(Box::new([Color::Texture(noise), less]));
    let cubes = Procedural::Checkerboard3d([[0.0; 3], [2.0, 3.0, 4.0]]);
    let cubes = Pattern::Procedural(cubes);
    let cubes = in_space(cubes, DAffine3::from_scale(DVec3::splat(1.7)));
    let turning = Blend {
        first: Color::Texture(cubes),
        second: [1.0, 0.2, 0.1].into(),
        amount: Input::Texture(facing_up),
    };
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6; 3]))
        .quad(facing(DVec3::new(0.0, 2.0, 0.0), DVec3::NEG_Y, 0.9), Black.into())
        .emitting(Arc::new(bright.into()))
        .sphere(DVec3::new(1.0, 0.4, 0.3), 0.4, Black.into())
        .emitting(Arc::new(Pattern::Blend(Box::new(turning)).into()))
        .seen_by(camera(DVec3::new(0.0, 1.2, 4.5), DVec3::new(0.0, 0.8, 0.0), [44.0, 36.0]))
}

/// Also if noise is below 0, which is black.
#[test]
fn estimators_agree_where_light_lies_in_space() {
    let of = |direct, most_single_lights, seed| {
        let settings = Settings { direct, seed, max_depth: 3, ..settings(4096) };
        let options = CompileOptions { most_single_lights, ..size([10, 8]) };
        let name = format!("{direct:?} {most_single_lights:?}");
        (name, render(&emitting_noise(), options, settings).film().clone())
    };
    let mut films: Vec<_> = ESTIMATORS.into_iter().zip(0..).map(|(d, s)| of(d, None, s)).collect();
    films.push(of(ESTIMATORS[0], Some(0), 17));
    assert_all_agree(&films);
}

/// Textures in space are rejected as slides, and as emission of animated objects.
#[test]
fn light_that_could_not_be_sampled_is_refused() {
    let refused = |scene: &Scene, want: &str| {
        let session = Session::new(scene, size([4, 4]), settings(1));
        let message = session.err().expect("it is refused").to_string();
        assert!(message.contains(want), "{message}");
    };
    let mut moving = emitting_noise();
    let place = |time: f64| Key { time, to_world: DAffine3::from_translation(DVec3::X * time) };
    let motion = Motion::new(vec![place(0.0), place(1.0)]).expect("it makes sense");
    moving.objects[1].motion = Some(Arc::new(motion));
    refused(&moving, "found a texture in space on a moving object");
    let spot = LightKind::LinearSpot {
        intensity: [1.0; 3],
        beam_angle: 10.0,
        cutoff_angle: 30.0,
        texture: Some(in_space(Pattern::Procedural(Procedural::Windy), DAffine3::IDENTITY)),
    };
    let context = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6; 3]))
        .light(spot, looking(DVec3::Y, DVec3::ZERO));
    refused(
        &context.seen_by(camera(FAR, DVec3::ZERO, [20.0, 16.0])),
        "found a texture in space, expected a projected image",
    );
}
