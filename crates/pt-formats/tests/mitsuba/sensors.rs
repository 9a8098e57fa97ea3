//! Emitters, sensors, films and integrators of Mitsuba scenes.

use pt_math::{DAffine3, DVec3};
use pt_scene::{Filter, Hidden, LightKind, Projection, Scene};

use crate::{assert_close, good, read};

#[test]
fn lights_shine_as_described() {
    let down = |scene: &Scene| {
        let light = &scene.lights[0];
        assert_eq!(light.kind, LightKind::Directional { irradiance: [1.0; 3] });
        assert!((light.to_world.matrix3.determinant() - 1.0).abs() < 1e-12);
        light.to_world.transform_vector3(DVec3::NEG_Z)
    };
    let by_direction = read(
        "<emitter type=\"directional\"><vector name=\"direction\" x=\"3\" y=\"-4\" z=\"0\"/>\
         </emitter>",
    );
    assert_close(down(&by_direction), DVec3::new(0.6, -0.8, 0.0));
    // +z of the node, rotated about y, is +x.
    let by_node = read(
        "<emitter type=\"directional\"><transform name=\"to_world\"><rotate y=\"1\" \
         angle=\"90\"/><scale value=\"3\"/></transform></emitter>",
    );
    assert_close(down(&by_node), DVec3::X);
    for position in [
        "<point name=\"position\" value=\"1 2 3\"/>",
        "<transform name=\"to_world\"><scale value=\"5\"/><translate value=\"1 2 3\"/></transform>",
    ] {
        let scene = read(&format!("<emitter type=\"point\">{position}</emitter>"));
        assert_eq!(scene.lights[0].kind, LightKind::Point { intensity: [1.0; 3] });
        assert_close(scene.lights[0].to_world.translation, DVec3::new(1.0, 2.0, 3.0));
    }
}

/// As in Mitsuba, angles are measured from the axis, in degrees, and the beam has 3/4 of the
/// cutoff.
#[test]
fn spots_shine_along_z_with_their_angles() {
    let spot = |parameters: &str| {
        read(&format!(
            "<emitter type=\"spot\">{parameters}<transform name=\"to_world\"><lookat origin=\"1 2 3\" \
             target=\"1 0 3\" up=\"1 0 0\"/></transform></emitter>"
        ))
    };
    let (plain, given) = (
        spot(""),
        spot("<float name=\"cutoff_angle\" value=\"40\"/><float name=\"beam_width\" value=\"5\"/>"),
    );
    for (scene, [beam_angle, cutoff_angle]) in [(plain, [15.0, 20.0]), (given, [5.0, 40.0])] {
        let light = &scene.lights[0];
        let kind =
            LightKind::LinearSpot { intensity: [1.0; 3], beam_angle, cutoff_angle, texture: None };
        assert_eq!(light.kind, kind);
        assert_close(light.to_world.translation, DVec3::new(1.0, 2.0, 3.0));
        assert_close(light.to_world.transform_vector3(DVec3::NEG_Z), DVec3::NEG_Y);
    }
}

/// As in Mitsuba, the image scales with x and y of the node, and is projected along its +z.
#[test]
fn spots_throw_pictures_upright() {
    let scene = read(
        "<emitter type=\"spot\"><texture type=\"checkerboard\" name=\"texture\"/>\
         <transform name=\"to_world\"><scale value=\"2\"/><rotate y=\"1\" angle=\"90\"/>\
         <translate x=\"5\"/></transform></emitter>",
    );
    let light = &scene.lights[0];
    let LightKind::LinearSpot { texture: Some(_), .. } = &light.kind else { panic!("{light:?}") };
    let to_world = |v: DVec3| light.to_world.transform_vector3(v) / 2.0;
    assert_close(to_world(DVec3::NEG_Z), DVec3::X);
    assert_close(to_world(DVec3::X), DVec3::NEG_Z);
    assert_close(to_world(DVec3::Y), DVec3::Y);
    assert_close(light.to_world.translation, DVec3::X * 5.0);
}

/// In Mitsuba 3.9.1, uv = (atan2(x, −z) / 2π, acos(y) / π); ours begins at −x of the node and
/// continues towards +z.
#[test]
fn images_of_the_sky_are_turned_to_our_convention() {
    let folder = tempfile::tempdir().unwrap();
    let image =
        pt_scene::image::Image { width: 2, height: 1, pixels: vec![[0.5; 3], [2.0; 3]].into() };
    let path = folder.path().join("sky.exr");
    pt_image::save(&image, &path, &pt_image::SaveOptions::default()).unwrap();
    let emitter = |rest: &str| {
        format!(
            "<emitter type=\"envmap\"><string name=\"filename\" value=\"{}\"/>{rest}</emitter>",
            path.display()
        )
    };
    let turned = "<float name=\"scale\" value=\"3\"/><transform name=\"to_world\"><rotate y=\"1\" \
                  angle=\"90\"/></transform>";
    for (rest, scale, beginning, quarter) in
        [("", 1.0, DVec3::NEG_Z, DVec3::X), (turned, 3.0, DVec3::NEG_X, DVec3::NEG_Z)]
    {
        let scene = read(&emitter(rest));
        let light = &scene.lights[0];
        let kind = LightKind::Environment {
            image: std::sync::Arc::new(image.clone()),
            scale,
            rows: pt_scene::Rows::EndpointsAtPoles,
            portal: None,
        };
        assert_eq!(light.kind, kind);
        assert_close(light.to_world.transform_vector3(DVec3::NEG_X), beginning);
        assert_close(light.to_world.transform_vector3(DVec3::Z), quarter);
        assert_close(light.to_world.transform_vector3(DVec3::Y), DVec3::Y);
    }
}

#[test]
fn cameras_look_at_their_target_with_their_right_to_the_right() {
    let scene = read(
        "<sensor type=\"perspective\"><transform name=\"to_world\"><lookat origin=\"0 0 5\" \
         target=\"0 0 0\" up=\"0 1 0\"/></transform></sensor>",
    );
    // Our camera at this position with this view has the axes of the world.
    let expected = DAffine3::from_translation(DVec3::new(0.0, 0.0, 5.0));
    assert!(scene.cameras[0].to_world.abs_diff_eq(expected, 1e-12));
}

fn fields_of_view(camera: &pt_scene::Camera) -> [f64; 2] {
    let Projection::Perspective { x_fov, y_fov } = camera.projection else { panic!("{camera:?}") };
    [x_fov, y_fov]
}

#[test]
fn fields_of_view_belong_to_their_axis() {
    let half_tangents = |width: u32, height: u32, parameters: &str| {
        let scene = read(&format!(
            "<sensor type=\"perspective\">{parameters}<film type=\"hdrfilm\"><integer \
             name=\"width\" value=\"{width}\"/><integer name=\"height\" value=\"{height}\"/>\
             <rfilter type=\"box\"/></film></sensor>"
        ));
        fields_of_view(&scene.cameras[0]).map(|degrees| (0.5 * degrees.to_radians()).tan())
    };
    let half = 25_f64.to_radians().tan();
    for (axis, wide, tall) in [
        ("x", [half, half / 1.5], [half, half * 1.5]),
        ("y", [half * 1.5, half], [half / 1.5, half]),
        ("smaller", [half * 1.5, half], [half, half * 1.5]),
        ("larger", [half, half / 1.5], [half / 1.5, half]),
    ] {
        let parameters = format!(
            "<float name=\"fov\" value=\"50\"/><string name=\"fov_axis\" value=\"{axis}\"/>"
        );
        for (found, expected) in [
            (half_tangents(300, 200, &parameters), wide),
            (half_tangents(200, 300, &parameters), tall),
        ] {
            for i in 0..2 {
                assert!((found[i] - expected[i]).abs() < 1e-12, "{axis}: {found:?}");
            }
        }
    }
    // A film of 36 mm × 24 mm at a focal length of 50 mm by default.
    for (length, parameters) in
        [(50.0, ""), (35.0, "<string name=\"focal_length\" value=\"35mm\"/>")]
    {
        let [x, y] = half_tangents(300, 200, parameters);
        assert!((x - 18.0 / length).abs() < 1e-12 && (y - 12.0 / length).abs() < 1e-12);
    }
    let diagonal = "<float name=\"fov\" value=\"50\"/><string name=\"fov_axis\" \
                    value=\"diagonal\"/>";
    let [x, y] = half_tangents(200, 300, diagonal);
    assert!((x.hypot(y) - half).abs() < 1e-12 && (y / x - 1.5).abs() < 1e-12);
}

#[test]
fn the_first_sensor_is_the_one_that_is_used() {
    let scene = good("films.xml");
    let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["used", "not used"]);
    let used = scene.camera().expect("a camera");
    assert_eq!((used.lens_radius, used.focal_distance), (0.1, 4.0));
    assert!((fields_of_view(used)[1] - 30.0).abs() < 1e-12);
    assert_eq!(scene.settings.resolution, Some([768, 576]));
    assert_eq!(scene.settings.filter, Some(Filter::GAUSSIAN));
    assert_eq!(scene.settings.max_depth, Some(1));
    assert_eq!(scene.settings.hidden, Hidden::Emitters);
}

#[test]
fn orthographic_cameras_take_their_size_from_the_scale_of_their_node() {
    let camera = |transform: &str| {
        let mut scene = read(&format!(
            "<sensor type=\"orthographic\"><float name=\"near_clip\" value=\"0.5\"/><float \
             name=\"far_clip\" value=\"10\"/><transform name=\"to_world\">{transform}</transform>\
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"100\"/><integer \
             name=\"height\" value=\"50\"/></film></sensor>"
        ));
        scene.cameras.swap_remove(0)
    };
    let plain = camera("");
    let view = |half_width, half_height| Projection::Orthographic { half_width, half_height };
    assert_eq!(plain.projection, view(1.0, 0.5));
    assert_eq!((plain.near, plain.far), (0.5, 10.0));
    // Mitsuba 3.9.1: from (1 − 2, 2, 3 + 0.5 · 4) and (1, 2 + 1.5, 5) over a distance of 9.5.
    let scaled = camera("<scale value=\"2 3 4\"/><translate value=\"1 2 3\"/>");
    assert_eq!(scaled.projection, view(2.0, 1.5));
    assert_eq!((scaled.near, scaled.far), (2.0, 11.5));
    assert_close(scaled.to_world.translation, DVec3::new(1.0, 2.0, 3.0));
    assert_close(scaled.to_world.matrix3.x_axis, DVec3::NEG_X);
    assert_close(scaled.to_world.matrix3.z_axis, DVec3::NEG_Z);
}

#[test]
fn films_are_cropped_and_moved() {
    let sensor = |film: &str, offset: &str| {
        read(&format!(
            "<sensor type=\"perspective\">{offset}<film type=\"hdrfilm\"><integer \
             name=\"width\" value=\"100\"/><integer name=\"height\" value=\"50\"/>{film}</film>\
             </sensor>"
        ))
    };
    let number = |name: &str, value: i32| format!("<integer name=\"{name}\" value=\"{value}\"/>");
    let crop = |values: [i32; 4]| {
        let names = ["crop_offset_x", "crop_offset_y", "crop_width", "crop_height"];
        let film: String = names.iter().zip(values).map(|(name, v)| number(name, v)).collect();
        sensor(&film, "").settings.crop
    };
    assert_eq!(crop([20, 10, 40, 30]), Some([20, 10, 40, 30]));
    assert_eq!(crop([0, 0, 100, 49]), Some([0, 0, 100, 49]));
    assert_eq!(crop([0, 0, 100, 50]), None);
    assert_eq!(sensor(&number("crop_width", 8), "").settings.crop, Some([0, 0, 8, 50]));
    let offset = "<float name=\"principal_point_offset_x\" value=\"0.1\"/><float \
                  name=\"principal_point_offset_y\" value=\"-0.2\"/>";
    assert_eq!(sensor("", offset).cameras[0].principal_point_offset, [0.1, -0.2]);
    assert_eq!(sensor("", "").cameras[0].principal_point_offset, [0.0; 2]);
}

#[test]
fn filters_have_mitsubas_defaults() {
    let filter = |rfilter: &str| {
        let film = format!("<film type=\"hdrfilm\">{rfilter}</film>");
        read(&format!("<sensor type=\"perspective\">{film}</sensor>")).settings.filter
    };
    let number = |name: &str, value: f64| format!("<float name=\"{name}\" value=\"{value}\"/>");
    let with = |kind: &str, parameters: &str| {
        filter(&format!("<rfilter type=\"{kind}\">{parameters}</rfilter>"))
    };
    assert_eq!(filter(""), Some(Filter::GAUSSIAN));
    assert_eq!(read("<sensor type=\"perspective\"/>").settings.filter, Some(Filter::GAUSSIAN));
    assert_eq!(read("").settings.filter, None);
    for (kind, expected) in [
        ("box", Filter::Box),
        ("tent", Filter::Tent { radius: 1.0 }),
        ("gaussian", Filter::Gaussian { stddev: 0.5, radius: 2.0 }),
        ("mitchell", Filter::MITCHELL),
        ("catmullrom", Filter::Mitchell { b: 0.0, c: 0.5 }),
        ("lanczos", Filter::Lanczos { lobes: 3.0 }),
    ] {
        assert_eq!(with(kind, ""), Some(expected), "{kind}");
    }
    assert_eq!(with("tent", &number("radius", 2.5)), Some(Filter::Tent { radius: 2.5 }));
    assert_eq!(with("gaussian", &number("stddev", 1.0)), Some(Filter::gaussian(1.0)));
    let cubic = number("B", 0.5) + &number("C", 0.25);
    assert_eq!(with("mitchell", &cubic), Some(Filter::Mitchell { b: 0.5, c: 0.25 }));
    let lobes = "<integer name=\"lobes\" value=\"2\"/>";
    assert_eq!(with("lanczos", lobes), Some(Filter::Lanczos { lobes: 2.0 }));
}

#[test]
fn depth_counts_interactions_with_surfaces() {
    let depth = |integrator: &str| read(integrator).settings.max_depth;
    let path = |depth: i32| {
        format!(
            "<integrator type=\"path\"><integer name=\"max_depth\" value=\"{depth}\"/></integrator>"
        )
    };
    assert_eq!(depth(""), Some(u32::MAX));
    assert_eq!(depth("<integrator type=\"path\"/>"), Some(u32::MAX));
    assert_eq!(depth(&path(-1)), Some(u32::MAX));
    assert_eq!(depth(&path(1)), Some(0));
    assert_eq!(depth(&path(2)), Some(1));
    assert_eq!(depth("<integrator type=\"direct\"/>"), Some(1));
}

/// An integrator that adds channels computes light as the nested one does.
#[test]
fn channels_besides_light_are_those_of_the_same_meaning() {
    let aov = |inner: &str| {
        let list = "dd.y:depth, nn:sh_normal,ng:geo_normal,p:position,a:albedo,i:prim_index,\
                    s:shape_index,again:depth";
        let list = format!("<string name=\"aovs\" value=\"{list}\"/>");
        read(&format!("<integrator type=\"aov\">{list}{inner}</integrator>")).settings
    };
    let want = ["depth", "normal", "geometric_normal", "position", "albedo", "primitive", "object"];
    assert_eq!(aov("").aovs, want);
    assert_eq!((aov("").max_depth, aov("").integrator), (Some(u32::MAX), None));
    let depth = "<integer name=\"max_depth\" value=\"5\"/>";
    let inner = aov(&format!("<integrator type=\"volpath\" name=\"image\">{depth}</integrator>"));
    assert_eq!((inner.max_depth, inner.integrator), (Some(4), Some("volpath")));
    assert!(read("<integrator type=\"path\"/>").settings.aovs.is_empty());
}

/// Wrappers that add channels do not determine the light transport.
#[test]
fn integrators_inside_of_others_make_the_image() {
    let depth = "<integer name=\"max_depth\" value=\"5\"/>";
    let volpath = format!("<integrator type=\"volpath\">{depth}</integrator>");
    let aov = |list: &str, inner: &str| {
        let list = format!("<string name=\"aovs\" value=\"{list}\"/>");
        format!("<integrator type=\"aov\">{list}{inner}</integrator>")
    };
    let moment = |inner: &str| format!("<integrator type=\"moment\">{inner}</integrator>");
    let settings = |integrator: &str| read(integrator).settings;
    for (integrator, aovs) in [
        (moment(&volpath), &[][..]),
        (moment(&moment(&volpath)), &[]),
        (moment(&aov("d:depth", &volpath)), &["depth"]),
        (aov("d:depth", &moment(&volpath)), &["depth"]),
        (aov("d:depth", &aov("n:sh_normal,e:depth", &volpath)), &["depth", "normal"]),
        (aov("d:depth", &(volpath.clone() + "<integrator type=\"path\"/>")), &["depth"]),
    ] {
        let found = settings(&integrator);
        assert_eq!((found.max_depth, found.integrator), (Some(4), Some("volpath")), "{integrator}");
        assert_eq!(found.aovs, aovs, "{integrator}");
    }
    // Mitsuba 3.9.1: differentiable integrators have a default max_depth of 6, all others none.
    for (kind, most, integrator) in [
        ("ptracer", u32::MAX, None),
        ("prb", 5, None),
        ("prb_basic", 5, None),
        ("prb_projective", 5, None),
        ("prbvolpath", 5, Some("volpath")),
        ("volpathmis", u32::MAX, Some("volpath")),
        ("direct_projective", 1, None),
    ] {
        let found = settings(&format!("<integrator type=\"{kind}\"/>"));
        assert_eq!((found.max_depth, found.integrator), (Some(most), integrator), "{kind}");
    }
}

/// The sample pattern is ours; the number of samples is read from any sampler.
#[test]
fn samplers_say_how_many_samples_there_are() {
    for (kind, rest) in [
        ("independent", "<integer name=\"seed\" value=\"3\"/>"),
        ("stratified", "<boolean name=\"jitter\" value=\"false\"/>"),
        ("multijitter", ""),
        ("orthogonal", "<integer name=\"strength\" value=\"2\"/>"),
        ("ldsampler", ""),
    ] {
        let sampler = format!(
            "<sampler type=\"{kind}\"><integer name=\"sample_count\" value=\"9\"/>{rest}</sampler>"
        );
        let settings = read(&format!("<sensor type=\"perspective\">{sampler}</sensor>")).settings;
        assert_eq!(settings.spp, Some(9), "{kind}");
    }
}

/// A film has alpha according to its pixel format, ignoring case; an "aov" around the integrator
/// adds to it.
#[test]
fn films_and_integrators_say_what_is_cut_out() {
    let settings = |format: &str, integrator: &str| {
        let format = match format {
            "" => String::new(),
            format => format!("<string name=\"pixel_format\" value=\"{format}\"/>"),
        };
        let sensor = format!("<film type=\"hdrfilm\">{format}</film>");
        read(&format!("<sensor type=\"perspective\">{sensor}</sensor>{integrator}")).settings
    };
    for (format, has_alpha) in [
        ("", false),
        ("rgb", false),
        ("luminance", false),
        ("rgba", true),
        ("RGBA", true),
        ("luminance_alpha", true),
        ("xyza", true),
    ] {
        assert_eq!(settings(format, "").aovs == ["alpha"], has_alpha, "{format}");
    }
    let aov = "<integrator type=\"aov\"><string name=\"aovs\" value=\"d:depth\"/></integrator>";
    assert_eq!(settings("rgba", aov).aovs, ["alpha", "depth"]);
    for (hides, hidden) in [("true", Hidden::Emitters), ("false", Hidden::Nothing)] {
        for kind in ["path", "volpath", "volpathmis", "direct"] {
            let parameter = format!("<boolean name=\"hide_emitters\" value=\"{hides}\"/>");
            let integrator = format!("<integrator type=\"{kind}\">{parameter}</integrator>");
            assert_eq!(settings("rgb", &integrator).hidden, hidden, "{kind} {hides}");
        }
    }
}
