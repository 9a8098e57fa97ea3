//! Batches, meters, projectors, and textures in space.

use pt_math::DVec3;
use pt_scene::medium::GridFilter;
use pt_scene::texture::{Pattern, TextureMapping};
use pt_scene::{Camera, Geometry, LightKind, Projection, Quantity};

use crate::materials::bitmap;
use crate::{material, read, refusal};

/// Returns the axis of a camera in the world.
fn axis(camera: &Camera) -> DVec3 {
    camera.to_world.transform_vector3(DVec3::NEG_Z)
}

const PIXEL: &str = "<film type=\"hdrfilm\"><integer name=\"width\" value=\"1\"/><integer name=\"height\" \
                     value=\"1\"/></film>";

/// Each sensor of a "batch" has its part of the film; a note reports that they are not shown side
/// by side.
#[test]
fn the_sensors_of_a_batch_are_cameras() {
    let film = "<film type=\"hdrfilm\"><integer name=\"width\" value=\"60\"/><integer name=\"height\" value=\"20\"/>\
                <rfilter type=\"box\"/></film>";
    let sensor = |id: &str, fov: u32| {
        format!(
            "<sensor type=\"perspective\" id=\"{id}\"><float name=\"fov\" value=\"{fov}\"/></sensor>"
        )
    };
    let inside = [sensor("left", 40), sensor("right", 50), sensor("top", 60)].concat();
    let sampler =
        "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"7\"/></sampler>";
    let scene = read(&format!("<sensor type=\"batch\">{film}{sampler}{inside}</sensor>"));
    let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["left", "right", "top"]);
    assert_eq!((scene.settings.resolution, scene.settings.spp), (Some([20, 20]), Some(7)));
    // For a square film, both angles are equal.
    for (camera, fov) in scene.cameras.iter().zip([40.0, 50.0, 60.0]) {
        let Projection::Perspective { x_fov, y_fov } = camera.projection else { panic!() };
        assert!((x_fov - fov).abs() < 1e-9 && (y_fov - fov).abs() < 1e-9);
    }
    assert!(scene.warnings.iter().any(|w| w.message.contains("not combined in one image")));
    let message = refusal(&format!("<sensor type=\"batch\">{film}</sensor>"));
    assert!(message.contains("without a <sensor>, expected at least one"), "{message}");
    let seven = sensor("x", 40).repeat(7).replace(" id=\"x\"", "");
    let message = refusal(&format!("<sensor type=\"batch\">{film}{seven}</sensor>"));
    assert!(message.contains("a multiple of the 7 sensors"), "{message}");
}

/// Meters use a ray from the origin along the direction, which may be given by a node; with a
/// target, the ray starts outside of the scene.
#[test]
fn meters_measure_along_a_ray() {
    let meter = |kind: &str, inside: &str| {
        let content = format!(
            "<sensor type=\"{kind}\">{PIXEL}{inside}</sensor><shape type=\"sphere\"><float name=\"radius\" \
             value=\"3\"/></shape>"
        );
        read(&content).cameras[0].clone()
    };
    let given =
        "<point name=\"origin\" value=\"1 2 3\"/><vector name=\"direction\" value=\"0 0 -2\"/>";
    let node = "<transform name=\"to_world\"><lookat origin=\"1 2 3\" target=\"1 2 0\" up=\"0 1 0\"/></transform>";
    for inside in [given, node] {
        let camera = meter("radiancemeter", inside);
        assert!((camera.to_world.translation - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12);
        assert!((axis(&camera) - DVec3::NEG_Z).length() < 1e-12);
        let Projection::Orthographic { half_width, half_height } = camera.projection else {
            panic!()
        };
        assert!(half_width == half_height && half_width <= 1e-6);
    }
    let target =
        "<point name=\"target\" value=\"0 1 0\"/><vector name=\"direction\" value=\"0 0 -1\"/>";
    let camera = meter("distant", target);
    let from = camera.to_world.translation;
    assert!(from.x.abs() < 1e-12 && (from.y - 1.0).abs() < 1e-12 && from.z > 3.0, "{from}");
    assert!(from.z < 20.0, "near enough to be precise: {from}");
    let sensor =
        |kind: &str, inside: &str| refusal(&format!("<sensor type=\"{kind}\">{inside}</sensor>"));
    assert!(
        sensor("radiancemeter", "").contains("requires a film of 1 x 1 pixels, found 768 x 576")
    );
    let alone = sensor("irradiancemeter", PIXEL);
    assert!(alone.contains("inside of a static <shape>"), "{alone}");
    let message = sensor("radiancemeter", &format!("{PIXEL}{given}{node}"));
    assert!(message.contains("expected direction or to_world, not both"), "{message}");
}

/// A "distant" sensor aims at a shape, which need not be part of the scene, or at a disk through
/// the bounding sphere of the scene's box. An "irradiancemeter" measures at the shape that contains
/// it.
#[test]
fn meters_are_attached_to_surfaces() {
    let cube = "<shape type=\"cube\"><transform name=\"to_world\"><translate x=\"5\"/></transform></shape>";
    let distant = |inside: &str| {
        let direction = "<vector name=\"direction\" value=\"0 0 -2\"/>";
        let scene =
            read(&format!("<sensor type=\"distant\">{PIXEL}{direction}{inside}</sensor>{cube}"));
        let camera = scene.cameras[0].clone();
        assert!((axis(&camera) - DVec3::NEG_Z).length() < 1e-12);
        assert_eq!(scene.objects.len(), 1, "the target is not seen");
        camera.meter.expect("a meter")
    };
    let around = distant("");
    assert_eq!(around.quantity, Quantity::Radiance);
    assert!((around.to_world.translation - DVec3::new(5.0, 0.0, 0.0)).length() < 1e-12);
    let axes = around.to_world.matrix3;
    for side in [axes.x_axis, axes.y_axis] {
        assert!((side.length() - f64::sqrt(3.0)).abs() < 1e-12 && side.z.abs() < 1e-12, "{side}");
    }
    let ball = "<shape type=\"sphere\"><float name=\"radius\" value=\"2\"/></shape>";
    let aimed = distant(ball);
    assert_eq!(
        (aimed.quantity, aimed.geometry),
        (Quantity::Radiance, Geometry::Sphere { radius: 2.0 })
    );

    let meter = format!("<sensor type=\"irradiancemeter\" id=\"m\">{PIXEL}</sensor>");
    let scene = read(&ball.replace("</shape>", &format!("{meter}</shape>")));
    let camera = &scene.cameras[0];
    let attached = camera.meter.as_ref().expect("a meter");
    assert_eq!((camera.name.as_str(), scene.objects.len()), ("m", 1));
    assert_eq!(attached.quantity, Quantity::Irradiance);
    assert_eq!(attached.geometry, scene.objects[0].geometry);
    let merged = format!("<shape type=\"merge\"><shape type=\"cube\">{meter}</shape></shape>");
    assert!(refusal(&merged).contains("inside of a \"merge\""));
    let two = "<point name=\"target\" value=\"0 0 0\"/>";
    let both = format!("<sensor type=\"distant\">{PIXEL}{two}{ball}</sensor>");
    assert!(refusal(&both).contains("found a target point and a target shape"));
    let large = "<shape type=\"cube\"><sensor type=\"irradiancemeter\"/></shape>";
    assert!(refusal(large).contains("an \"irradiancemeter\" requires a film of 1 x 1"));
}

/// As in Mitsuba 3.9.1: seen along +z of its node, +x is at the left of the image and +y at its
/// top; the angle is that of the width unless `fov_axis` is given; for image values of 1, a plane
/// at distance 1 has the irradiance π.
#[test]
fn projectors_throw_pictures_as_there() {
    let projector = |inside: &str| {
        let scene = read(&format!("<emitter type=\"projector\">{inside}</emitter>"));
        let LightKind::Projector { intensity, x_fov, y_fov, texture } =
            scene.lights[0].kind.clone()
        else {
            panic!("{:?}", scene.lights[0])
        };
        (scene.lights[0].to_world, intensity, [x_fov, y_fov], texture)
    };
    let (node, intensity, fov, _) = projector(
        "<rgb name=\"irradiance\" value=\"1 2 3\"/><float name=\"scale\" value=\"2\"/><float name=\"fov\" value=\"40\"/>",
    );
    assert_eq!(intensity, [2.0 * std::f32::consts::PI; 3]);
    assert!(fov.iter().all(|angle| (angle - 40.0).abs() < 1e-9), "a square: {fov:?}");
    let to_world = |v: DVec3| node.transform_vector3(v);
    assert_eq!(to_world(DVec3::NEG_Z), DVec3::Z);
    // u increases from +x to −x; v of Mitsuba increases downwards, from +y to −y.
    assert_eq!((to_world(DVec3::X), to_world(DVec3::Y)), (DVec3::NEG_X, DVec3::NEG_Y));
    let picture = bitmap("irradiance", "");
    let (_, _, [x, y], texture) =
        projector(&format!("{picture}<float name=\"fov\" value=\"50\"/>"));
    let Pattern::Bitmap(bitmap) = &texture.pattern else { panic!("{texture:?}") };
    let aspect = f64::from(bitmap.image.width) / f64::from(bitmap.image.height);
    let tangent = |degrees: f64| (0.5 * degrees.to_radians()).tan();
    assert!((x - 50.0).abs() < 1e-9 && (tangent(x) / tangent(y) - aspect).abs() < 1e-9);
    let scaled = "<transform name=\"to_world\"><scale value=\"3\"/></transform>";
    assert_eq!(projector(scaled).1, [3.0 * std::f32::consts::PI; 3]);
    let message = refusal(
        "<emitter type=\"projector\"><transform name=\"to_world\"><scale x=\"2\"/></transform></emitter>",
    );
    assert!(message.contains("rotations, reflections and uniform scales only"), "{message}");
}

/// A grid has its own transform to the world; a constant volume is a constant colour.
#[test]
fn volumes_are_textures_in_space() {
    let texture = |volume: &str| {
        let surface = material(&format!(
            "<bsdf type=\"diffuse\"><texture type=\"volume\" name=\"reflectance\">{volume}</texture></bsdf>"
        ))
        .surface;
        let pt_scene::Surface::Diffuse(matte) = surface else { panic!() };
        matte.reflectance.texture().expect("a texture").as_ref().clone()
    };
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/mitsuba/smoke.vol");
    let grid = texture(&format!(
        "<volume name=\"volume\" type=\"gridvolume\"><string name=\"filename\" value=\"{file}\"/><string \
         name=\"filter_type\" value=\"nearest\"/><transform name=\"to_world\"><scale value=\"2\"/><translate x=\"1\"/>\
         </transform></volume>"
    ));
    let Pattern::Grid { filter: GridFilter::Nearest, .. } = grid.pattern else {
        panic!("{grid:?}")
    };
    let TextureMapping::Space { to_texture } = grid.layout else { panic!("{grid:?}") };
    let middle = to_texture.transform_point3(DVec3::new(2.0, 1.0, 1.0));
    assert!((middle - DVec3::splat(0.5)).length() < 1e-12, "{middle}");
    let plain = texture(
        "<volume name=\"volume\" type=\"constvolume\"><rgb name=\"value\" value=\"0.1 0.2 0.3\"/></volume>",
    );
    assert_eq!(plain.pattern, Pattern::Checkerboard([[0.1, 0.2, 0.3]; 2]));
    let message = refusal(
        "<shape type=\"cube\"><bsdf type=\"diffuse\"><texture type=\"volume\" name=\"reflectance\"/></bsdf></shape>",
    );
    assert!(message.contains("expected one <volume name=\"volume\">"), "{message}");
}

/// The texture of a bump map may have any name, and the shapes of a "merge" are shapes of the
/// scene.
#[test]
fn names_of_heights_and_merged_shapes_do_not_matter() {
    for name in ["arbitrary", "heights", ""] {
        let inside = format!("{}<bsdf type=\"diffuse\"/>", bitmap(name, ""));
        material(&format!("<bsdf type=\"bumpmap\">{inside}</bsdf>"));
    }
    let none = refusal(
        "<shape type=\"cube\"><bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf></shape>",
    );
    assert!(none.contains("expected one <texture>"), "{none}");
    let scene =
        read("<shape type=\"merge\"><shape type=\"cube\"/><shape type=\"sphere\"/></shape>");
    let [cube, sphere] = scene.objects.as_slice() else { panic!("{:?}", scene.objects) };
    assert!(matches!(cube.geometry, Geometry::Mesh(_)));
    assert!(matches!(sphere.geometry, Geometry::Sphere { .. }));
}
