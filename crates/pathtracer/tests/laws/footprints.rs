//! Mipmapped textures: footprints and their filtering.

use std::sync::Arc;

use pathtracer::{CompileOptions, DirectLight, Film, Scene, Session, Settings};
use pt_core::footprint::Footprint;
use pt_core::texture_eval_context::TextureEvalContext;
use pt_math::{DAffine3, DMat3, DVec3, Ray, Spectrum, Vec2, Vec3};
use pt_scene::image::Image;
use pt_scene::material::{Diffuse, Mirror};
use pt_scene::texture::{Bitmap, Color, Filter, Pattern, Texture, Wrap};
use pt_scene::{Geometry, Surface, shapes};

use crate::measure::{Luminances, render, settings};
use crate::scenes::{Builder, camera, facing, looking, matte, size};

/// Width of the cone of a camera ray as a fraction of a pixel.
const SHARE: f32 = 0.5;

/// Squares of one texel, repeated many times over the surface.
fn fine(filter: Filter, times: f64) -> Surface {
    let (a, b) = ([0.9, 0.7, 0.1], [0.1, 0.3, 0.5]);
    let pixels = (0..64).map(|i| if (i / 8 + i) % 2 == 0 { a } else { b }).collect();
    let image = Arc::new(Image { width: 8, height: 8, pixels });
    let pattern = Pattern::Bitmap(Bitmap { image, wrap: Wrap::REPEAT, filter });
    let to_pattern = DMat3::from_diagonal(DVec3::new(times, times, 1.0));
    let reflectance = Color::Texture(Arc::new(Texture::on_surface(pattern, to_pattern)));
    Diffuse { reflectance, two_sided: true }.into()
}

/// A tilted plane before a camera of each kind.
fn tilted() -> [(Scene, CompileOptions); 3] {
    let plane = |eye| {
        let to_world = facing(DVec3::ZERO, DVec3::new(0.3, 0.9, 0.5), 9.0)
            * DAffine3::from_scale(DVec3::new(1.0, 2.5, 1.0));
        Builder::default().quad(to_world, fine(Filter::Trilinear, 3.0)).seen_by(eye)
    };
    let from = DVec3::new(0.5, 3.0, 4.0);
    let perspective = camera(from, DVec3::ZERO, [70.0, 56.0]);
    let parallel = pathtracer::Camera {
        projection: pathtracer::Projection::Orthographic { half_width: 1.5, half_height: 1.2 },
        ..perspective.clone()
    };
    let panorama = CompileOptions { panorama: true, ..size([200, 100]) };
    [
        (plane(perspective.clone()), size([100, 80])),
        (plane(parallel), size([100, 80])),
        (plane(perspective), panorama),
    ]
}

/// Texture coordinates at the intersection of a ray with the plane, and the size of the footprint
/// of its cone there.
fn seen(session: &Session, ray: &Ray) -> Option<(Vec2, f32)> {
    let scene = session.scene();
    let hit = scene.bvh.intersect(ray)?;
    let at = scene.interaction(ray, &hit, 0.0);
    let place = scene.texture_eval_context(&at, &hit, 0.0);
    let width = scene.camera.cone(ray.direction).width_at(at.distance);
    let footprint = Footprint::new(&at, width);
    let [a, b] = TextureEvalContext { footprint, ..place }.footprint_on_surface();
    Some((place.uv, a.perp_dot(b).abs()))
}

/// The ellipse that a cone covers has the area of the parallelogram between the rays of
/// neighbouring pixels.
#[test]
fn footprints_are_as_large_as_neighbouring_rays_are_apart() {
    const STEP: f32 = 0.25;
    for (scene, options) in tilted() {
        let session = Session::new(&scene, options, settings(1)).expect("the scene makes sense");
        let camera = session.scene().camera;
        let at = |x: f32, y: f32| seen(&session, &camera.ray([x, y], [0.0; 2]));
        let [w, h] = camera.resolution;
        let mut found = 0;
        for (x, y) in (0..h).step_by(7).flat_map(|y| (0..w).step_by(7).map(move |x| (x, y))) {
            let (x, y) = (x as f32 + 0.5, y as f32 + 0.5);
            let Some((_, area)) = at(x, y) else { continue };
            let across = [at(x - STEP, y), at(x + STEP, y)];
            let down = [at(x, y - STEP), at(x, y + STEP)];
            let ([Some(a), Some(b)], [Some(c), Some(d)]) = (across, down) else { continue };
            let per_pixel = 0.5 / STEP;
            let want = ((b.0 - a.0) * per_pixel).perp_dot((d.0 - c.0) * per_pixel).abs();
            let error = area / (want * SHARE * SHARE) - 1.0;
            assert!(error.abs() < 0.02, "{:?} at {x} {y}: {error}", camera.projection);
            found += 1;
        }
        assert!(found > 50, "{:?}: {found}", camera.projection);
    }
}

/// Seen along its normal, a footprint is a circle in the world.
#[test]
fn footprints_seen_from_above_are_round() {
    let scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), fine(Filter::Trilinear, 1.0))
        .seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [20.0, 16.0]));
    let session = Session::new(&scene, size([10, 8]), settings(1)).expect("the scene makes sense");
    let ray = Ray::new(Vec3::new(0.3, 0.2, 4.0), Vec3::NEG_Z);
    let compiled = session.scene();
    let hit = compiled.bvh.intersect(&ray).expect("the wall");
    let at = compiled.interaction(&ray, &hit, 0.0);
    let place = compiled.texture_eval_context(&at, &hit, 0.0);
    let footprint = Footprint::new(&at, 0.1);
    let [a, b] = TextureEvalContext { footprint, ..place }.footprint_on_surface();
    // The side of 2 metres has the length 1 in u and v.
    for (axis, name) in [(a, "across"), (b, "along")] {
        assert!((axis.length() - 0.05).abs() < 1e-6, "{name}: {axis}");
    }
    assert!(a.dot(b).abs() < 1e-8);
}

/// Rendered with hemisphere sampling, whose estimate under a constant environment has no noise.
fn film(scene: &Scene, spp: u32, seed: u32) -> Film {
    let direct = DirectLight::CosineHemisphere;
    let settings = Settings { direct, seed, max_depth: 3, ..settings(spp) };
    render(scene, size([10, 8]), settings).film().clone()
}

fn far_wall(filter: Filter) -> Scene {
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Z, 40.0), fine(filter, 500.0))
        .sky(1.0)
        .seen_by(camera(DVec3::Z * 60.0, DVec3::ZERO, [40.0, 32.0]))
}

/// Far away, a texture is its mean: with mipmaps without noise, without them with all the noise of
/// its texels.
#[test]
fn images_far_away_are_their_mean() {
    let wall = |filter| Luminances::of(&film(&far_wall(filter), 16, 3)).whole();
    let want = Spectrum::rgb(0.5, 0.5, 0.3).luminance();
    let (filtered, error) = wall(Filter::Trilinear);
    assert!((filtered - want).abs() < 1e-6 && error < 1e-6, "{filtered} ± {error}, {want}");
    let (bilinear, noise) = wall(Filter::Bilinear);
    assert!((bilinear - want).abs() < 4.0 * noise && noise > 1e-3, "{bilinear} ± {noise}, {want}");
}

/// Close by, a texture is unfiltered, to the bit.
#[test]
fn images_near_by_are_themselves() {
    let near = |filter| {
        let scene = Builder::default()
            .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), fine(filter, 0.25))
            .sky(1.0)
            .seen_by(camera(DVec3::Z * 2.0, DVec3::ZERO, [40.0, 32.0]));
        film(&scene, 16, 1)
    };
    assert!(near(Filter::Trilinear) == near(Filter::Bilinear));
}

/// A flat mirror shows a distant texture as if seen directly; a curved one shows it unfiltered.
#[test]
fn cones_go_on_behind_flat_mirrors() {
    let mirror = || Surface::from(Mirror { reflectance: [1.0; 3].into() });
    let wall = |filter| {
        let to_world = facing(DVec3::Z * 60.0, DVec3::NEG_Z, 40.0);
        Builder::default().quad(to_world, fine(filter, 500.0)).sky(1.0)
    };
    let eye = || camera(DVec3::Z * 2.0, DVec3::ZERO, [40.0, 32.0]);
    let flat = |filter| {
        let scene = wall(filter).quad(facing(DVec3::ZERO, DVec3::Z, 3.0), mirror()).seen_by(eye());
        Luminances::of(&film(&scene, 16, 5)).whole()
    };
    let ((_, error), (_, noise)) = (flat(Filter::Trilinear), flat(Filter::Bilinear));
    assert!(noise * noise > 4.0 * error * error, "{noise} {error}");
    let curved =
        |filter| film(&wall(filter).sphere(DVec3::ZERO, 1.0, mirror()).seen_by(eye()), 16, 5);
    assert!(curved(Filter::Trilinear) == curved(Filter::Bilinear));
}

/// A room with a finely textured floor.
pub(crate) fn room(filter: Filter) -> Scene {
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), fine(filter, 40.0))
        .quad(facing(DVec3::NEG_Z, DVec3::Z, 2.0), matte([0.7; 3]))
        .emissive_quad(facing(DVec3::Y * 2.0, DVec3::NEG_Y, 0.5), 5.0)
        .seen_by(camera(DVec3::new(0.0, 1.0, 4.0), DVec3::Y * 0.5, [40.0, 32.0]))
}

/// Indirect light of a finely textured floor is the same with mipmaps, up to noise; with media as
/// well.
#[test]
fn pyramids_keep_the_light_of_a_room() {
    for integrator in ["path", "volpath"] {
        let of = |filter, seed| {
            let integrator = integrator.to_owned();
            let settings = Settings { seed, max_depth: 3, integrator, ..settings(2048) };
            Luminances::of(render(&room(filter), size([10, 8]), settings).film())
        };
        let (with, without) = (of(Filter::Trilinear, 1), of(Filter::Bilinear, 2));
        with.compare(&without, 1e-4).unwrap_or_else(|e| panic!("{integrator}: {e}"));
    }
}

/// A mipmap takes a third more values, which are counted, and shared by all textures of the image.
#[test]
fn memory_of_pyramids_is_counted_and_shared() {
    let bytes = |scene: &Scene| {
        let session = Session::new(scene, size([8, 8]), settings(1)).expect("it makes sense");
        session.scene().materials.textures.bytes()
    };
    let image = Arc::new(Image { width: 16, height: 16, pixels: vec![[0.3; 3]; 256].into() });
    let texture = |filter| {
        let bitmap = Bitmap { image: Arc::clone(&image), wrap: Wrap::REPEAT, filter };
        let texture = Arc::new(Texture::from(Pattern::Bitmap(bitmap)));
        Surface::from(Diffuse { reflectance: Color::Texture(texture), two_sided: true })
    };
    let scene = |filters: &[Filter]| {
        let quad = || (shapes::rectangle(), looking(DVec3::Z, DVec3::ZERO));
        filters.iter().fold(Builder::default(), |b, &f| b.mesh(quad().0, quad().1, texture(f))).0
    };
    let plain = bytes(&scene(&[Filter::Bilinear]));
    assert_eq!(plain, 256 * 12);
    let pyramid = (256 + 64 + 16 + 4 + 1) * 12;
    assert_eq!(bytes(&scene(&[Filter::Trilinear])), pyramid);
    let all = scene(&[Filter::Bilinear, Filter::Trilinear, Filter::Nearest, Filter::Trilinear]);
    assert!(matches!(all.objects[0].geometry, Geometry::Mesh(_)));
    assert_eq!(bytes(&all), pyramid);
}
