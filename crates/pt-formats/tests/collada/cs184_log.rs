//! Log of the course's program.

use std::path::Path;

use pt_formats::collada::compat::cs184_log;

use crate::{files, good_text, name_of};

/// Returns the lines about a text, without their common prefix.
fn log(text: &str) -> Vec<String> {
    let lines = cs184_log(text.as_bytes(), Path::new("scene.dae")).expect("a good file");
    let rest = |line: &String| line.strip_prefix("[COLLADA Parser] ").map(str::to_owned);
    lines.iter().map(|line| rest(line).expect("the prefix of that program")).collect()
}

/// All kinds of lights and cameras. Those that the course's program does not support (the tube, the
/// orthographic cameras) have no line. The fields of view satisfy tan(x/2) = aspect · tan(y/2).
#[test]
fn lights_and_cameras() {
    let expected = " |- Node:  (id:)
  |- LightInfo: ambient (id:ambient) [ type=ambient spectrum=(1,2,3) ]
  |- LightInfo: directional (id:directional) [ type=directional spectrum=(1,2,3) direction=(0,0,-1) ]
  |- LightInfo: point (id:point) [ type=point spectrum=(1,2,3) position=(0,0,0) constant_att=1 linear_att=0 quadratic_att=0.0016 ]
  |- LightInfo: linear (id:linear) [ type=point spectrum=(1,2,3) position=(0,0,0) constant_att=1 linear_att=1 quadratic_att=0 ]
  |- LightInfo: spot (id:spot) [ type=spot spectrum=(1,2,3) position=(0,0,0) direction=(0,0,-1) falloff_deg=45 falloff_exp=0.15 constant_att=1 linear_att=0 quadratic_att=0 ]
  |- LightInfo: wide-spot (id:wide-spot) [ type=spot spectrum=(1,2,3) position=(0,0,0) direction=(0,0,-1) falloff_deg=180 falloff_exp=0 constant_att=1 linear_att=0 quadratic_att=0 ]
  |- LightInfo: area (id:area) [ type=area spectrum=(10,11,12) direction=(0,0,-1) ]
  |- LightInfo: channels (id:channels) [ type=point spectrum=(8,4,2) position=(0,0,0) constant_att=1 linear_att=0 quadratic_att=0 ]
  |- LightInfo: colourless (id:colourless) [ type=point spectrum=(1,1,1) position=(0,0,0) constant_att=1 linear_att=0 quadratic_att=0 ]
  |- LightInfo: only-blender (id:only-blender) [ type=area spectrum=(4,5,6) direction=(0,0,-1) ]
  |- CameraInfo: both (id: both) [ hfov=90 vfov=60 nclip=0.5 fclip=20 ]
  |- CameraInfo: x and aspect (id: x and aspect) [ hfov=90 vfov=53.1301 nclip=0.5 fclip=20 ]
  |- CameraInfo: y and aspect (id: y and aspect) [ hfov=53.1301 vfov=90 nclip=0.001 fclip=1000 ]
  |- CameraInfo: aspect (id: aspect) [ hfov=50 vfov=50 nclip=0.001 fclip=1000 ]
  |- CameraInfo: x (id: x) [ hfov=60 vfov=46.8264 nclip=0.001 fclip=1000 ]";
    assert_eq!(log(&good_text("lights_cameras.dae")), expected.lines().collect::<Vec<_>>());
}

/// The line of a node precedes those of its inner nodes, which precede those of its instances;
/// equal numbers of materials mean the same material; geometries of other files have no line.
#[test]
fn order_of_nodes_geometries_and_materials() {
    let bound = |geometry: &str, materials: &[&str]| {
        let bindings = materials.iter().map(|m| format!("<instance_material target='#{m}'/>"));
        let bindings = bindings.collect::<Vec<_>>().concat();
        format!(
            "<instance_geometry url='{geometry}'><bind_material><technique_common>{bindings}\
             </technique_common></bind_material></instance_geometry>"
        )
    };
    let nodes = [
        "<node id='outer' name='Outer'>",
        &bound("#ball", &["red"]),
        "<node id='inner' name='In&#10;ner'>",
        &bound("#quad", &["blue", "no such material", "red"]),
        "</node></node><node id='last'>",
        &bound("other.dae#x", &["red"]),
        &bound("#triangles", &["blue"]),
        "</node>",
    ];
    let text = format!(
        "<COLLADA>
        <library_materials><material id='red' name='Red'><instance_effect url='#e'/></material>
          <material id='blue' name='Blue'><instance_effect url='#e'/></material>
        </library_materials>
        <library_effects><effect id='e'/></library_effects>
        <library_geometries>
          <geometry id='ball' name='Ball'><extra><technique profile='CGL'>
            <sphere><radius>.25</radius></sphere></technique></extra></geometry>
          <geometry id='quad' name='Quad'><mesh>
            <source id='p'><float_array>0 0 0 1 0 0 1 1 0 0 1 0</float_array></source>
            <source id='n'><float_array>0 0 1</float_array></source>
            <source id='t'><float_array>0 0 1 0 1 1 0 1 2 2</float_array></source>
            <vertices id='v'><input semantic='POSITION' source='#p'/></vertices>
            <polylist><input semantic='VERTEX' source='#v' offset='0'/>
              <input semantic='NORMAL' source='#n' offset='1'/>
              <input semantic='TEXCOORD' source='#t' offset='2'/>
              <vcount>4</vcount><p>0 0 0 1 0 1 2 0 2 3 0 3</p></polylist>
          </mesh></geometry>
          <geometry id='triangles' name='Triangles'><mesh>
            <source id='q'><float_array>0 0 0 1 0 0 1 1 0 0 1 0</float_array></source>
            <vertices id='w'><input semantic='POSITION' source='#q'/></vertices>
            <triangles><input semantic='VERTEX' source='#w' offset='1'/>
              <p>9 0 9 1 9 2 9 0 9 2 9 3</p></triangles>
          </mesh></geometry>
        </library_geometries>
        <library_visual_scenes><visual_scene id='s'>{}</visual_scene></library_visual_scenes>
        <scene><instance_visual_scene url='#s'/></scene></COLLADA>",
        nodes.concat()
    );
    let sizes = |n| format!("num_polygons={n} num_vertices=4");
    let expected = [
        " |- Node: Outer (id:outer)".to_owned(),
        " |- Node: In ner (id:inner)".to_owned(),
        format!("  |- PolymeshInfo: Quad (id:quad) [ {} num_normals=1 num_texcoords=5 ]", sizes(1)),
        "  |- MaterialInfo: Blue (id:blue) [ BSDF=0x1 ]".to_owned(),
        "  |- MaterialInfo: Red (id:red) [ BSDF=0x2 ]".to_owned(),
        "  |- Sphere: Ball (id:ball) [ radius=0.25 ]".to_owned(),
        "  |- MaterialInfo: Red (id:red) [ BSDF=0x2 ]".to_owned(),
        " |- Node: last (id:last)".to_owned(),
        format!(
            "  |- PolymeshInfo: Triangles (id:triangles) [ {} num_normals=0 num_texcoords=0 ]",
            sizes(2)
        ),
        "  |- MaterialInfo: Blue (id:blue) [ BSDF=0x1 ]".to_owned(),
    ];
    assert_eq!(log(&text), expected);
    crate::read(&text).expect("a file that can be rendered");
}

#[test]
fn what_can_be_read_can_be_listed() {
    for file in files("good") {
        let bytes = std::fs::read(&file).expect("a readable file");
        let lines = cs184_log(&bytes, name_of(&file)).expect("a good file");
        assert!(lines.iter().all(|line| line.starts_with("[COLLADA Parser]  ")));
    }
}

/// Names are repeated for each instance, so long ones are truncated.
#[test]
fn long_names_do_not_multiply() {
    let name = "n".repeat(100_000);
    let text =
        good_text("lights_cameras.dae").replace("name=\"ambient\"", &format!("name=\"{name}\""));
    let instances = "<instance_light url=\"#ambient\"/>".repeat(3000);
    let text = text.replace("<instance_light url=\"#ambient\"/>", &instances);
    let total: usize = log(&text).iter().map(String::len).sum();
    assert!(total < 10 * text.len(), "{total} bytes");
}

/// The scene in the specification of the course's program, which lists its lines.
#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn scene_of_the_course() {
    const PATH: &str = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/scenes/dae/sky/CBspheres_lambertian.dae"
    );
    let text = std::fs::read_to_string(PATH).expect("a readable file");
    let mut expected: Vec<_> = " |- Node: Area (id:Area)
  |- LightInfo: Light (id:Area-light) [ type=area spectrum=(10,10,10) direction=(0,0,-1) ]
 |- Node: Sphere1 (id:Sphere1)
  |- Sphere: Sphere1 (id:Sphere1-data) [ radius=0.3 ]
  |- MaterialInfo: refract (id:refract) [ BSDF=0x1 ]
 |- Node: Sphere2 (id:Sphere2)
  |- Sphere: Sphere1 (id:Sphere1-data) [ radius=0.3 ]
  |- MaterialInfo: lambertian (id:lambertian) [ BSDF=0x2 ]
 |- Node: Camera (id:Camera)
  |- CameraInfo: Camera (id: Camera-camera) [ hfov=49.1343 vfov=37.8493 nclip=0.1 fclip=100 ]"
        .lines()
        .map(str::to_owned)
        .collect();
    let squares = ["ceiling", "light", "floor", "leftWall", "rightWall", "backWall"];
    for (square, number) in squares.into_iter().zip(3..) {
        let sizes = "num_polygons=2 num_vertices=4 num_normals=2 num_texcoords=6";
        expected.extend([
            format!(" |- Node: {square} (id:{square})"),
            format!("  |- PolymeshInfo: {square} (id:{square}-mesh) [ {sizes} ]"),
            format!("  |- MaterialInfo: {square} (id:{square}-material) [ BSDF=0x{number} ]"),
        ]);
    }
    assert_eq!(log(&text), expected);
}
