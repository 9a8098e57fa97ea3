//! Media of Mitsuba scenes.

use pt_math::{DAffine3, DVec3};
use pt_scene::medium::{
    Grid, GridFilter, Heterogeneous, MediumProperties, Phase, PhaseBlend, Volume,
};
use pt_scene::{Medium, Scene, Sides};

use crate::{assert_close, good, read, refusal};

fn scene() -> Scene {
    good("media.xml")
}

/// Returns the media on both sides of a shape.
fn sides<'s>(scene: &'s Scene, name: &str) -> [Option<&'s Medium>; 2] {
    let object = scene.objects.iter().find(|o| o.name == name).expect("there is such a shape");
    let Sides { interior, exterior } = object.media.expect("it has media");
    [interior, exterior].map(|side| side.map(|index| &scene.media[index as usize]))
}

fn inside<'s>(scene: &'s Scene, name: &str) -> &'s Medium {
    sides(scene, name)[0].expect("there is a medium inside")
}

fn heterogeneous(medium: &Medium) -> &Heterogeneous {
    let MediumProperties::Heterogeneous(grid) = &medium.matter else { panic!("{medium:?}") };
    grid
}

#[test]
fn media_are_those_of_their_shapes_and_of_the_sensor() {
    let scene = scene();
    let fog = scene.media.iter().position(|m| m.name == "fog").expect("the fog");
    assert_eq!(scene.cameras[0].medium, Some(fog as u32));
    assert_eq!(
        sides(&scene, "cloud").map(|m| m.map(|m| m.name.as_str())),
        [Some("heterogeneous"), Some("fog")]
    );
    assert_eq!(scene.media.iter().filter(|m| m.name == "fog").count(), 1, "it is made once");
    let [behind, ahead] = sides(&scene, "inside out");
    assert!(behind.is_some_and(|m| m.name == "fog") && ahead.is_none(), "its normals look inside");
    let plain = scene.objects.iter().find(|o| o.name == "plain").expect("the plain sphere");
    assert_eq!(plain.media, None);
    assert_eq!(scene.settings.integrator, Some("volpath"));
    assert_eq!(scene.settings.max_depth, Some(7));
    let other = read("<integrator type=\"volpathmis\"/>");
    assert_eq!(other.settings.integrator, Some("volpath"));
    assert_eq!(read("<integrator type=\"path\"/>").settings.integrator, None);
}

#[test]
fn homogeneous_media_have_their_numbers_or_mitsubas() {
    let scene = scene();
    let fog = &scene.media[scene.cameras[0].medium.expect("the fog") as usize];
    let matter = MediumProperties::Homogeneous {
        extinction: [0.5; 3],
        albedo: [0.75; 3],
        emission: [0.0; 3],
    };
    assert_eq!((&fog.matter, &fog.phase), (&matter, &Phase::Isotropic));
    let juice = inside(&scene, "juice");
    let kinds = PhaseBlend {
        first: Phase::Rayleigh,
        second: Phase::HenyeyGreenstein { g: 0.6 },
        amount: 0.25,
    };
    assert_eq!(juice.phase, Phase::Blend(Box::new(kinds)));
    assert_eq!(
        juice.matter,
        MediumProperties::Homogeneous {
            extinction: [0.5, 2.0, 4.5],
            albedo: [0.0; 3],
            emission: [0.0; 3]
        }
    );
    let forwards = read(
        "<shape type=\"sphere\"><medium type=\"homogeneous\" name=\"interior\"><phase type=\"hg\"/>\
         </medium></shape>",
    );
    assert_eq!(forwards.media[0].phase, Phase::HenyeyGreenstein { g: 0.8 });
    let air = read(
        "<shape type=\"sphere\"><medium type=\"homogeneous\" name=\"interior\">\
         <phase type=\"rayleigh\"/></medium></shape>",
    );
    assert_eq!(air.media[0].phase, Phase::Rayleigh);
}

#[test]
fn phase_functions_may_be_tables() {
    let medium = |values: &str| {
        format!(
            "<shape type=\"sphere\"><medium type=\"homogeneous\" name=\"interior\"><phase type=\"tabphase\">\
             {values}</phase></medium></shape>"
        )
    };
    let of = |values: &str| medium(&format!("<string name=\"values\" value=\"{values}\"/>"));
    let scene = read(&of("0.5, 0, 1.5 2"));
    assert_eq!(scene.media[0].phase, Phase::Table { values: vec![0.5, 0.0, 1.5, 2.0] });
    for (bad, found) in [
        (of("1"), "found \"1\"; expected two or more numbers from 0 up"),
        (of("0, 0"), "found \"0, 0\"; expected"),
        (of("1, -0.5"), "found -0.5; expected"),
        (of("1, 1e39"), "found \"1e39\", expected a finite number within ±3.4e38; expected two"),
        (of("1, x"), "found \"x\", expected a number"),
        (medium(""), "found \"\"; expected"),
    ] {
        let message = refusal(&bad);
        assert!(message.contains(found), "{message}");
    }
}

/// The matrices of microflakes are a grid with six channels.
#[test]
fn microflakes_are_grids_of_matrices() {
    let medium = |inside: &str| {
        format!(
            "<shape type=\"sphere\"><medium type=\"heterogeneous\" name=\"interior\">{inside}</medium></shape>"
        )
    };
    let grid = |name: &str, file: &str| {
        let file = format!("<string name=\"filename\" value=\"{file}\"/>");
        format!("<volume name=\"{name}\" type=\"gridvolume\">{file}</volume>")
    };
    let flakes = |inside: &str| medium(&format!("<phase type=\"sggx\">{inside}</phase>"));
    let scene = read(&flakes(&grid("S", "parts/flakes.vol")));
    let Phase::Microflakes { matrices } = &scene.media[0].phase else { panic!("microflakes") };
    assert_eq!((matrices.grid.resolution, matrices.grid.channels), ([5, 4, 3], 6));
    for (bad, found) in [
        (flakes(""), "expected one <volume name=\"S\">"),
        (flakes(&grid("S", "parts/cloud.vol")), "1 numbers in each cell, expected six"),
        (flakes("<volume name=\"S\" type=\"constvolume\"/>"), "supported: gridvolume"),
        (
            medium(&grid("sigma_t", "parts/flakes.vol")),
            "6 numbers in each cell, expected one or three",
        ),
    ] {
        let message = refusal(&bad);
        assert!(message.contains(found), "{message}");
    }
}

#[test]
fn grids_are_read_and_placed() {
    let scene = scene();
    let cloud = inside(&scene, "cloud");
    assert_eq!(cloud.phase, Phase::HenyeyGreenstein { g: 0.6 });
    let Heterogeneous { extinction, scale, albedo, .. } = heterogeneous(cloud);
    let Grid { resolution, channels, values } = &*extinction.grid;
    assert_eq!((*resolution, *channels, values[2], values[6]), ([3, 2, 2], 1, 1.0, 3.0));
    assert_eq!((*scale, extinction.filter), (3.0, GridFilter::Trilinear));
    assert_close(extinction.to_world.transform_point3(DVec3::ONE), DVec3::splat(2.0));
    let Volume::Grid(albedo) = albedo else { panic!() };
    assert_eq!((albedo.grid.channels, albedo.filter), (3, GridFilter::Nearest));
    // The box of the file, rotated.
    let extinction = &heterogeneous(inside(&scene, "box")).extinction;
    let turn = DAffine3::from_rotation_z(30f64.to_radians());
    let corner = turn.transform_point3(DVec3::new(1.0, 1.0, 2.0));
    assert_close(extinction.to_world.transform_point3(DVec3::ONE), corner);
    let extinction = &heterogeneous(inside(&scene, "even box")).extinction;
    assert_eq!(*extinction.grid, Grid::uniform(2.0));
}

#[test]
fn extinction_of_grids_may_have_colours() {
    let medium = |extinction: &str| {
        let medium =
            format!("<medium type=\"heterogeneous\" name=\"interior\">{extinction}</medium>");
        let scene = read(&format!("<shape type=\"sphere\">{medium}</shape>"));
        heterogeneous(&scene.media[0]).extinction.clone()
    };
    let colored = Grid::uniform_color([1.0, 0.5, 0.25]);
    let value = "value=\"1, 0.5, 0.25\"";
    assert_eq!(*medium(&format!("<rgb name=\"sigma_t\" {value}/>")).grid, colored);
    let volume = format!(
        "<volume type=\"constvolume\" name=\"sigma_t\"><rgb name=\"value\" {value}/></volume>"
    );
    assert_eq!(*medium(&volume).grid, colored);
    let scene = scene();
    let coloured = &heterogeneous(inside(&scene, "coloured")).extinction.grid;
    assert_eq!((coloured.channels, coloured.cells()), (3, 2));
}
