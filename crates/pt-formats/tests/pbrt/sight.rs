//! Cameras, films, filters, samplers and integrators.

use pt_math::DVec3;
use pt_scene::{Filter, Projection, Scene};

use super::{read, read_all};

fn seen(text: &str) -> Scene {
    read_all(&format!("{text} WorldBegin"))
}

/// In camera space +x is to the right. The camera faces the origin from +z, with +x of the world to
/// the left, since coordinates are left-handed in pbrt-v4.
#[test]
fn left_is_left_and_right_is_right() {
    let scene = seen("LookAt 0 0 5  0 0 0  0 1 0 Camera \"perspective\"");
    let node = scene.cameras[0].to_world;
    assert!(node.transform_point3(DVec3::ZERO).distance(DVec3::new(0.0, 0.0, 5.0)) < 1e-12);
    assert!(node.transform_vector3(DVec3::NEG_Z).distance(DVec3::NEG_Z) < 1e-12);
    assert!(node.transform_vector3(DVec3::Y).distance(DVec3::Y) < 1e-12);
    assert!(node.transform_vector3(DVec3::X).distance(DVec3::NEG_X) < 1e-12);
    let mirrored = seen("Scale -1 1 1 LookAt 0 0 5  0 0 0  0 1 0 Camera \"perspective\"");
    assert!(mirrored.cameras[0].to_world.transform_vector3(DVec3::X).distance(DVec3::X) < 1e-12);
}

#[test]
fn the_field_of_view_is_that_of_the_shorter_side() {
    let film = |w: u32, h: u32| {
        format!("Film \"rgb\" \"integer xresolution\" {w} \"integer yresolution\" {h}")
    };
    let fov = |text: &str| match seen(text).cameras[0].projection {
        Projection::Perspective { x_fov, y_fov } => [x_fov, y_fov],
        _ => panic!("not in perspective"),
    };
    let camera = "Camera \"perspective\" \"float fov\" 60";
    let [wide, high] = fov(&format!("{} {camera}", film(200, 100)));
    let tangent = |degrees: f64| (0.5 * degrees.to_radians()).tan();
    assert!((high - 60.0).abs() < 1e-9 && (tangent(wide) / tangent(60.0) - 2.0).abs() < 1e-9);
    let [wide, high] = fov(&format!("{} {camera}", film(100, 200)));
    assert!((wide - 60.0).abs() < 1e-9 && (tangent(high) / tangent(60.0) - 2.0).abs() < 1e-9);
}

/// In a window from −1 to 3, the axis is at a quarter of the width; without an offset it would be
/// in the centre.
#[test]
fn a_window_moves_the_picture() {
    let text = "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 100 \
                Camera \"perspective\" \"float screenwindow\" [-1 3 -1 3]";
    let [x, y] = seen(text).cameras[0].principal_point_offset;
    assert!((0.5 - x - 0.25).abs() < 1e-12);
    // y increases downwards on the film, and upwards in the window.
    assert!((0.5 - y - 0.75).abs() < 1e-12);
}

#[test]
fn defaults_are_those_of_pbrt() {
    let settings = seen("Camera \"perspective\"").settings;
    assert_eq!(settings.resolution, Some([1280, 720]));
    assert_eq!((settings.spp, settings.max_depth), (Some(16), Some(5)));
    assert_eq!(settings.filter, Some(Filter::Gaussian { stddev: 0.5, radius: 1.5 }));
    assert_eq!((settings.integrator, settings.crop), (None, None));
}

#[test]
fn crops_are_pixels_or_shares() {
    let crop = |what: &str| {
        let film = "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 50";
        seen(&format!("{film} {what} Camera \"perspective\"")).settings.crop
    };
    assert_eq!(crop("\"integer pixelbounds\" [10 30 5 50]"), Some([10, 5, 20, 45]));
    assert_eq!(crop("\"float cropwindow\" [0 .5 0.25 1]"), Some([0, 13, 50, 37]));
    assert_eq!(crop("\"float cropwindow\" [0 1 0 1]"), None);
}

#[test]
fn filters_have_their_radii() {
    let filter =
        |what: &str| seen(&format!("PixelFilter {what} Camera \"perspective\"")).settings.filter;
    assert_eq!(filter("\"box\""), Some(Filter::Box));
    assert_eq!(filter("\"triangle\""), Some(Filter::Tent { radius: 2.0 }));
    assert_eq!(filter("\"mitchell\""), Some(Filter::MITCHELL));
    let gaussian = Some(Filter::Gaussian { stddev: 0.6, radius: 2.0 });
    assert_eq!(
        filter("\"gaussian\" \"float xradius\" 2 \"float yradius\" 2 \"float sigma\" .6"),
        gaussian
    );
    assert_eq!(filter("\"sinc\" \"float xradius\" 3 \"float yradius\" 3"), Some(Filter::LANCZOS));
}

/// The left edge of a spherical image is along +x of the camera; a quarter of its width further, it
/// faces +z.
#[test]
fn a_spherical_camera_turns_from_the_right_over_the_front_to_the_left() {
    let text = "Camera \"spherical\" \"string mapping\" \"equirectangular\"";
    let node = seen(text).cameras[0].to_world;
    // Our panoramas have −z in the centre, +x a quarter to the right, and −x a quarter to the left.
    assert_eq!(node.transform_vector3(DVec3::NEG_Z), DVec3::NEG_X);
    assert_eq!(node.transform_vector3(DVec3::NEG_X), DVec3::Z);
    assert_eq!(node.transform_vector3(DVec3::Y), DVec3::Y);
}

/// 48.4 mm at f/2.1, focused at 2.5 m in front of the film. The exposure time and the lens multiply
/// light.
#[test]
fn a_lens_of_many_surfaces_is_a_thin_one() {
    let lens = "\"string lensfile\" \"double_gauss.dat\" \"float focusdistance\" 2.5 \
                \"float aperturediameter\" 18";
    let film = "Film \"rgb\" \"integer xresolution\" 300 \"integer yresolution\" 200 \
                \"float diagonal\" 43.2666";
    let text = format!(
        "{film} Camera \"realistic\" {lens} WorldBegin LightSource \"infinite\" \"rgb L\" [1 1 1]"
    );
    let scene = read_all(&text);
    let camera = &scene.cameras[0];
    let Projection::Perspective { x_fov, y_fov } = camera.projection else {
        panic!("not in perspective")
    };
    // Half of 36 mm at 48.4 mm, which is slightly more at a close focus.
    let [x, y] = [x_fov, y_fov].map(|fov: f64| (0.5 * fov.to_radians()).tan());
    assert!((x / (18.0 / 49.36) - 1.0).abs() < 0.01 && (x / y - 1.5).abs() < 1e-9, "{x} {y}");
    let before = -camera.to_world.transform_point3(DVec3::ZERO).z;
    assert!((before.abs() + camera.focal_distance - 2.5).abs() < 1e-9, "{before}");
    assert!(
        (camera.lens_radius / (0.0484 / 2.1 / 2.0) - 1.0).abs() < 0.03,
        "{}",
        camera.lens_radius
    );
    let pt_scene::LightKind::Constant { radiance, .. } = scene.lights[0].kind else {
        panic!("not the same from all sides")
    };
    let wanted = std::f32::consts::PI / (4.0 * 2.1 * 2.1);
    assert!((radiance[0] / wanted - 1.0).abs() < 0.08, "{} {wanted}", radiance[0]);
    assert!(scene.warnings.iter().any(|w| w.message.contains("48.4 mm and f/2.1")));
}

/// Light of the temperature becomes white: blue sky becomes grey, and white light yellow.
#[test]
fn white_is_balanced_in_the_colours_of_light() {
    let light = |film: &str| {
        let scene = read(film, "LightSource \"point\" \"rgb I\" [1 1 1] Shape \"sphere\"");
        let pt_scene::LightKind::Point { intensity } = scene.lights[0].kind else { panic!() };
        intensity
    };
    let white = light("Film \"rgb\" \"float whitebalance\" 0");
    assert_eq!(white, light("Film \"rgb\""));
    let [r, g, b] = light("Film \"rgb\" \"float whitebalance\" 9000");
    assert!(r / white[0] > 1.05 && b / white[2] < 0.9, "{r} {g} {b}");
    let refused = super::parse(
        b"Film \"rgb\" \"float whitebalance\" 100 Camera \"perspective\" WorldBegin",
        std::path::Path::new("a.pbrt"),
    );
    assert!(refused.is_err_and(|error| error.to_string().contains("kelvins")));
}
