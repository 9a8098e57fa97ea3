//! Normal maps and bump maps: shadowing, the back of a surface, and normals that face away.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use pathtracer::Film;
use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::material::{
    Averted, CoatNormals, Diffuse, MetallicRoughness, Mix, SurfaceDetail, TwoSided,
};
use pt_scene::texture::{Filter, NormalOrBump, Pattern, Texture};
use pt_scene::{LightKind, Surface, shapes};

use crate::materials::row;
use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, looking, matte, size};

/// A white wall in the plane z = 0, with u along x, and with a normal map or bump map.
fn wall(relief: NormalOrBump) -> SurfaceDetail {
    let white = Diffuse { reflectance: [1.0; 3].into(), two_sided: true };
    SurfaceDetail::new(Surface::from(white), relief)
}

/// Normal map of one normal in the frame of the surface.
fn normals(n: DVec3) -> NormalOrBump {
    let color = n.to_array().map(|x| 0.5 * (x as f32 + 1.0));
    NormalOrBump::Normals(row(&[color], Filter::Nearest))
}

/// Bump map that rises along u by `slope`, and its normal. The side of the wall is 2 for 1 of u.
fn ramp(slope: f64) -> (NormalOrBump, DVec3) {
    let s = slope as f32;
    let heights = row(&[[-s; 3], [s; 3]], Filter::Bilinear);
    (NormalOrBump::Heights(heights, 0.5), DVec3::new(-slope, 0.0, 1.0).normalize())
}

/// The wall seen from far away, lit from a unit direction so that a surface facing the light has
/// radiance 1.
fn film(surface: impl Into<Surface>, from: DVec3, light: DVec3) -> Film {
    let scene = Builder::default()
        .mesh(shapes::rectangle(), DAffine3::IDENTITY, surface.into())
        .light(LightKind::Directional { irradiance: [PI as f32; 3] }, looking(light, DVec3::ZERO))
        .seen_by(camera(from * 4.0, DVec3::ZERO, [2.0, 1.6]));
    render(&scene, size([10, 8]), settings(4)).film().clone()
}

fn assert_is(film: &Film, want: f64, what: &str) {
    for pixel in film.pixels() {
        let got = pixel.luminance().0;
        assert!((got - want).abs() < 2e-4, "{what}: {got} for {want}");
    }
}

/// A texture rotated by a quarter turn has its u along −v or v of the surface, and a reversed one
/// along −u; its normals lean there. A texture of one colour alone does not.
#[test]
fn normals_turn_with_their_image() {
    let lean = DVec3::new(0.6, 0.0, 0.8);
    let NormalOrBump::Normals(image) = normals(lean) else { panic!("normals") };
    let backwards = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
    for (to_pattern, toward) in [
        (DMat3::IDENTITY, DVec3::X),
        (DMat3::from_angle(FRAC_PI_2), DVec3::NEG_Y),
        (DMat3::from_angle(-FRAC_PI_2), DVec3::Y),
        (backwards, DVec3::NEG_X),
    ] {
        let texture = Arc::new(Texture { to_pattern, ..(*image).clone() });
        let n = 0.6 * toward + 0.8 * DVec3::Z;
        for light in [DVec3::Z, DVec3::new(0.0, 0.6, 0.8), DVec3::new(0.6, 0.0, 0.8)] {
            let wall = wall(NormalOrBump::TurnedNormals(Arc::clone(&texture)));
            assert_is(&film(wall, DVec3::Z, light), n.dot(light), &format!("{toward} {light}"));
        }
        let fixed = wall(NormalOrBump::Normals(Arc::clone(&texture)));
        assert_is(&film(fixed, DVec3::Z, lean), 1.0, "not turned");
    }
}

/// A coat has the normals of its base, of the shape, or its own: a black base under a coat with a
/// normal map has the same radiance as both with the map, and with the map on the base alone the
/// radiance of none.
#[test]
fn coats_have_normals_of_their_own() {
    let coated = |clearcoat_normals| {
        Surface::from(MetallicRoughness {
            base_color: [0.0; 3].into(),
            specular: 0.0.into(),
            clearcoat: 1.0.into(),
            clearcoat_roughness: 0.6.into(),
            clearcoat_normals,
            two_sided: true,
            ..MetallicRoughness::default()
        })
    };
    let lean = || normals(DVec3::new(0.48, 0.36, 0.8));
    let level = |surface: Surface, light| film(surface, DVec3::Z, light).pixels().next().unwrap();
    for light in [DVec3::Z, DVec3::new(0.0, 0.6, 0.8), DVec3::new(0.8, 0.0, 0.6)] {
        let of = |surface: Surface| level(surface, light).luminance().0;
        let smooth = of(coated(CoatNormals::Base));
        let both = of(SurfaceDetail::new(coated(CoatNormals::Base), lean()).into());
        let base = of(SurfaceDetail::new(coated(CoatNormals::Shape), lean()).into());
        let coat = of(coated(CoatNormals::Relief(lean())));
        let other = SurfaceDetail::new(
            coated(CoatNormals::Relief(lean())),
            normals(DVec3::new(-0.28, 0.0, 0.96)),
        );
        assert!((both / smooth - 1.0).abs() > 0.1, "{both}, {smooth}");
        assert!((base / smooth - 1.0).abs() < 1e-3, "{base}, {smooth}");
        assert!((coat / both - 1.0).abs() < 1e-3, "{coat}, {both}");
        assert!((of(other.into()) / both - 1.0).abs() < 1e-3, "{both}");
    }
}

/// Bump maps are mirrored with the surface. The normals of a normal map have +x along ∂p/∂u, which
/// is mirrored, and +y along n × ∂p/∂u, which is not.
#[test]
fn mirrored_walls_have_mirrored_heights() {
    let along_v = |relief| {
        let NormalOrBump::Heights(image, height) = relief else { panic!("heights") };
        let to_pattern = DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::Z);
        NormalOrBump::Heights(Arc::new(Texture { to_pattern, ..(*image).clone() }), height)
    };
    let [across, upwards] = [DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.6, 0.8)];
    let [mirrored_x, mirrored_y] = [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0)];
    for (relief, n, scale) in [
        (ramp(0.5).0, ramp(0.5).1 * mirrored_x, mirrored_x),
        (ramp(0.5).0, ramp(0.5).1, mirrored_y),
        (along_v(ramp(0.5).0), DVec3::new(0.0, -0.5, 1.0).normalize(), DVec3::ONE),
        (along_v(ramp(0.5).0), DVec3::new(0.0, -0.5, 1.0).normalize(), mirrored_x),
        (along_v(ramp(0.5).0), DVec3::new(0.0, 0.5, 1.0).normalize(), mirrored_y),
        (normals(across), across * mirrored_x, mirrored_x),
        (normals(upwards), upwards * mirrored_y, mirrored_x),
    ] {
        for light in [DVec3::Z, DVec3::new(0.0, 0.6, 0.8), DVec3::new(-0.6, 0.0, 0.8)] {
            let kind = LightKind::Directional { irradiance: [PI as f32; 3] };
            let scene = Builder::default()
                .mesh(shapes::rectangle(), DAffine3::from_scale(scale), wall(relief.clone()).into())
                .light(kind, looking(light, DVec3::ZERO))
                .seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [2.0, 1.6]));
            let film = render(&scene, size([10, 8]), settings(4)).film().clone();
            assert_is(&film, n.dot(light), &format!("{relief:?} scaled by {scale}"));
        }
    }
}

/// Tangents of the mesh, in ∂p/∂u = 2 x and ∂p/∂v = 2 y of the wall.
#[test]
fn normals_lie_along_directions_of_the_mesh() {
    let lean = DVec3::new(0.6, 0.0, 0.8);
    let NormalOrBump::Normals(image) = normals(lean) else { panic!("normals") };
    for (along, toward) in [
        ([1.0, 0.0, 0.0], DVec3::X),
        ([0.0, 1.0, 0.0], DVec3::Y),
        ([-3.0, -3.0, 0.0], DVec3::new(-1.0, -1.0, 0.0).normalize()),
    ] {
        let directions = Arc::new(Pattern::FaceAttribute("along".into()).into());
        let surface = wall(NormalOrBump::NormalsAlong(Arc::clone(&image), directions));
        let mut mesh = shapes::rectangle();
        mesh.attributes.faces.insert("along".into(), vec![along; mesh.triangles.len()].into());
        let n = 0.6 * toward + 0.8 * DVec3::Z;
        for light in [DVec3::Z, DVec3::new(0.0, 0.6, 0.8), DVec3::new(-0.6, 0.0, 0.8)] {
            let kind = LightKind::Directional { irradiance: [PI as f32; 3] };
            let scene = Builder::default()
                .mesh(mesh.clone(), DAffine3::IDENTITY, surface.clone().into())
                .light(kind, looking(light, DVec3::ZERO))
                .seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [2.0, 1.6]));
            let film = render(&scene, size([10, 8]), settings(4)).film().clone();
            assert_is(&film, n.dot(light), &format!("{toward} {light}"));
        }
    }
}

/// With slope 1/2, α² = (1/2)² / 8; for light at tan θ = 4/3 the factor is 2 / (1 + √(1 + α² tan²
/// θ)), for light along the normal of the shape it is 1.
#[test]
fn low_light_is_shadowed() {
    let (low, high) = (DVec3::new(0.0, 0.8, 0.6), DVec3::Z);
    for (relief, n) in [ramp(0.5), (normals(ramp(0.5).1), ramp(0.5).1)] {
        let embossed = wall(relief);
        assert_is(&film(embossed.clone(), DVec3::Z, low), n.dot(low), "not shadowed");
        let shadowed = SurfaceDetail { shadowing: true, ..embossed };
        let share = 2.0 / (1.0 + (1.0 + 16.0 / 9.0 / 32.0_f64).sqrt());
        assert_is(&film(shadowed.clone(), DVec3::Z, low), n.dot(low) * share, "low");
        assert_is(&film(shadowed, DVec3::Z, high), n.dot(high), "high");
    }
}

/// From behind, a normal is reversed; mirrored, it leans the same way as in front. This holds
/// inside of two-sided surfaces, and in mixtures.
#[test]
fn reliefs_from_behind_are_their_other_side_or_their_mirror_image() {
    let light = DVec3::new(0.6, 0.0, -0.8);
    for (relief, n) in [ramp(0.5), (normals(ramp(0.5).1), ramp(0.5).1)] {
        let through = wall(relief);
        assert_is(&film(through.clone(), DVec3::NEG_Z, light), (-n).dot(light), "through");
        let mirrored = SurfaceDetail { mirrored: true, ..through.clone() };
        let mirror_image = DVec3::new(n.x, n.y, -n.z).dot(light);
        assert_is(&film(mirrored.clone(), DVec3::NEG_Z, light), mirror_image, "mirrored");
        let front = DVec3::new(0.6, 0.0, 0.8);
        assert_is(&film(mirrored.clone(), DVec3::Z, front), n.dot(front), "in front");
        let boxed = || Box::new(Surface::from(mirrored.clone()));
        let sided = TwoSided { front: matte([0.0; 3]).into(), back: boxed() };
        assert_is(&film(sided, DVec3::NEG_Z, light), mirror_image, "sided");
        let mix = Mix { first: boxed(), second: boxed(), amount: 0.5.into() };
        assert_is(&film(mix, DVec3::NEG_Z, light), mirror_image, "mixed");
        // The inner one of two nested normal maps is mirrored, too: about the plane of the shape.
        let outer = SurfaceDetail { surface: boxed(), ..mirrored.clone() };
        let inside = film(outer.clone(), DVec3::Z, front).pixel(5, 4).luminance().0;
        assert_is(&film(outer, DVec3::NEG_Z, light), inside, "nested");
    }
}

/// A normal that faces away from the viewer is rotated by half a turn about that of the shape, or
/// nothing is visible; in front as behind.
#[test]
fn averted_normals_are_turned_or_black() {
    let n = DVec3::new(0.6, 0.0, 0.8);
    let (sin, cos) = 80_f64.to_radians().sin_cos();
    for side in [1.0, -1.0] {
        // n · wo = 0.8 cos 80° − 0.6 sin 80° < 0; from behind, the normal is −n.
        let from = DVec3::new(-sin, 0.0, cos) * side;
        let light = DVec3::new(-0.6, 0.0, 0.8) * side;
        let turned = DVec3::new(-n.x, 0.0, n.z) * side;
        let of = |averted| SurfaceDetail { averted, ..wall(normals(n)) };
        assert_is(&film(of(Averted::Turned), from, light), turned.dot(light), "turned");
        assert_is(&film(of(Averted::Black), from, light), 0.0, "black");
        // A visible normal is unchanged.
        let straight = DVec3::Z * side;
        for averted in [Averted::Turned, Averted::Black, Averted::Bent] {
            assert_is(&film(of(averted), straight, straight), n.z, "seen");
        }
    }
}
