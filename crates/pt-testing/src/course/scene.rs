//! A box as in the course's scenes, as a file in the format of the course's exporter, and as a
//! scene of the reference tracer.

use std::f64::consts::PI;
use std::fmt::Write;

use pt_math::{DAffine3, DMat3, DVec3};

use super::{BeckmannMetal, CourseLight, Material, Shape, World};

/// Content of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoxContent {
    /// Two diffuse balls.
    MatteBalls,
    /// A mirror ball, and a glass ball.
    MirrorAndGlass,
    /// A mirror ball, and a ball of a glass that does not reflect.
    MirrorAndRefraction,
    /// A ball of aluminium, and a rough one of copper.
    Metals,
    /// A ring of 30 000 triangles with smooth normals.
    Ring,
}

/// A box, 2 wide and deep and 1.6 high, without a front; y is up, and its front is at +z. A lamp is
/// below the ceiling. The camera is at the height of the floor.
pub struct Room {
    content: BoxContent,
    lights: Vec<CourseLight>,
}

const RADIANCE: f64 = 10.0;
/// Center of the lamp, and its extent along x and z.
const LAMP: (DVec3, [f64; 2]) = (DVec3::new(0.0, 1.59, 0.0), [0.6, 0.8]);
const BALLS: [(DVec3, f64); 2] =
    [(DVec3::new(-0.45, 0.3, -0.25), 0.3), (DVec3::new(0.45, 0.35, 0.2), 0.35)];
const WHITE: DVec3 = DVec3::splat(0.6);
/// Indices of refraction of metals at the wavelengths of the course's files.
const ALUMINIUM: BeckmannMetal = BeckmannMetal {
    alpha: 0.2,
    eta: DVec3::new(1.3352, 1.0109, 0.68955),
    k: DVec3::new(7.3398, 6.6157, 5.6471),
};
const COPPER: BeckmannMetal = BeckmannMetal {
    alpha: 0.5,
    eta: DVec3::new(0.33228, 1.0162, 1.2474),
    k: DVec3::new(3.1646, 2.5785, 2.4603),
};
/// Rows and columns of the ring.
const RING: [usize; 2] = [150, 100];

/// Rectangle whose corners are counter-clockwise seen from outside of the box, or from below the
/// lamp.
struct Wall {
    name: &'static str,
    corners: [DVec3; 4],
    material: Material,
}

fn walls() -> Vec<Wall> {
    let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let (middle, [a, b]) = LAMP;
    let lamp = |x: f64, z: f64| middle + DVec3::new(0.5 * a * x, 0.0, 0.5 * b * z);
    let wall = |name, corners, material| Wall { name, corners, material };
    let (white, h) = (Material::Diffuse(WHITE), 1.6);
    let [red, blue] = [DVec3::new(0.6, 0.2, 0.2), DVec3::new(0.2, 0.2, 0.6)].map(Material::Diffuse);
    let (l, r, f, k) = (-1.0, 1.0, 1.0, -1.0);
    vec![
        wall("floor", [v(l, 0.0, k), v(r, 0.0, k), v(r, 0.0, f), v(l, 0.0, f)], white),
        wall("ceiling", [v(l, h, f), v(r, h, f), v(r, h, k), v(l, h, k)], white),
        wall("back", [v(r, 0.0, k), v(l, 0.0, k), v(l, h, k), v(r, h, k)], white),
        wall("left", [v(l, 0.0, k), v(l, 0.0, f), v(l, h, f), v(l, h, k)], red),
        wall("right", [v(r, 0.0, f), v(r, 0.0, k), v(r, h, k), v(r, h, f)], blue),
        wall(
            "lamp",
            [lamp(-1.0, -1.0), lamp(1.0, -1.0), lamp(1.0, 1.0), lamp(-1.0, 1.0)],
            Material::Emission(DVec3::splat(RADIANCE)),
        ),
    ]
}

/// A torus whose tube swells seven times around: vertices, and triangles that are counter-clockwise
/// from outside.
fn ring() -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let [rows, columns] = RING;
    let angle = |i: usize, n: usize| 2.0 * PI * i as f64 / n as f64;
    let lean = DMat3::from_rotation_x(0.9);
    let vertex = |k: usize| {
        let (u, v) = (angle(k / columns, rows), angle(k % columns, columns));
        let tube = 0.16 + 0.03 * libm::cos(7.0 * u);
        let out = 0.45 + tube * libm::cos(v);
        let p = DVec3::new(out * libm::cos(u), tube * libm::sin(v), -out * libm::sin(u));
        DVec3::new(0.0, 0.65, 0.0) + lean * p
    };
    let index = |i: usize, j: usize| i % rows * columns + j % columns;
    let cell = |k: usize| {
        let (i, j) = (k / columns, k % columns);
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let count = rows * columns;
    // Rounded to the printed digits, so that both scenes have the same vertices.
    let rounded = |p: DVec3| (p * 1e6).round() * 1e-6;
    ((0..count).map(vertex).map(rounded).collect(), (0..count).flat_map(cell).collect())
}

impl Room {
    /// Creates a box with this content, lit by the lamp.
    pub fn new(content: BoxContent) -> Self {
        let (middle, [a, b]) = LAMP;
        let edges = [a * DVec3::X, b * DVec3::Z];
        let radiance = DVec3::splat(RADIANCE);
        Self::lit(content, vec![CourseLight::Area { middle, edges, along: DVec3::Y, radiance }])
    }

    /// Creates a box with this content, lit by `lights`; the lamp is visible but not sampled.
    pub fn lit(content: BoxContent, lights: Vec<CourseLight>) -> Self {
        Self { content, lights }
    }

    /// The point one unit in front of the camera, its field of view in degrees, and its aspect
    /// ratio.
    pub fn camera(&self) -> (DVec3, f64, f64) {
        (DVec3::new(0.0, 0.0, 6.0), 49.134_34, 1.333_333)
    }

    fn balls(&self) -> Vec<(DVec3, f64, Material)> {
        let [one, two] = match self.content {
            BoxContent::MatteBalls => [Material::Diffuse(DVec3::splat(0.8)); 2],
            BoxContent::MirrorAndGlass => [Material::Mirror, Material::Glass(1.45)],
            BoxContent::MirrorAndRefraction => [Material::Mirror, Material::Refraction(1.45)],
            BoxContent::Metals => [ALUMINIUM, COPPER].map(Material::Microfacet),
            BoxContent::Ring => return Vec::new(),
        };
        let [(p, r), (q, s)] = BALLS;
        vec![(p, r, one), (q, s, two)]
    }

    /// Scene of the reference tracer. The course's program flips the normals of flat pieces, so
    /// that walls whose winding faces outwards have inward normals.
    pub fn world(&self) -> World {
        let mut shapes = Vec::new();
        for Wall { corners: [a, b, c, d], material, .. } in walls() {
            let inwards = -(b - a).cross(c - a).normalize();
            for corners in [[a, b, c], [a, c, d]] {
                shapes.push((Shape::Triangle(corners, [inwards; 3]), material));
            }
        }
        let balls = self.balls();
        shapes.extend(balls.into_iter().map(|(p, r, material)| (Shape::Ball(p, r), material)));
        if self.content == BoxContent::Ring {
            let (vertices, triangles) = ring();
            let mut normals = vec![DVec3::ZERO; vertices.len()];
            for t in &triangles {
                let [a, b, c] = t.map(|i| vertices[i]);
                for i in t {
                    normals[*i] += (b - a).cross(c - a);
                }
            }
            let triangle = |t: [usize; 3]| {
                let smooth = t.map(|i| normals[i].normalize());
                let shape = Shape::Triangle(t.map(|i| vertices[i]), smooth);
                (shape, Material::Diffuse(DVec3::splat(0.5)))
            };
            shapes.extend(triangles.into_iter().map(triangle));
        }
        World::new(shapes, self.lights.clone())
    }

    /// COLLADA file: z is up there, and all nodes have matrices.
    pub fn collada(&self) -> String {
        let mut parts = ColladaLibraries::default();
        for (i, light) in self.lights.iter().enumerate() {
            parts.light(&format!("light{i}"), light);
        }
        let (ahead, ..) = self.camera();
        let camera = DAffine3::from_translation(ahead + DVec3::Z);
        parts.node("camera", &camera, "<instance_camera url=\"#camera-camera\"/>");
        for Wall { name, corners, material } in walls() {
            parts.mesh(name, &corners, &[[0, 1, 2], [0, 2, 3]], material);
        }
        for (i, (p, radius, material)) in self.balls().into_iter().enumerate() {
            parts.ball(&format!("ball{i}"), p, radius, material);
        }
        if self.content == BoxContent::Ring {
            let (vertices, triangles) = ring();
            parts.mesh("ring", &vertices, &triangles, Material::Diffuse(DVec3::splat(0.5)));
        }
        parts.finish(self.camera())
    }
}

/// Libraries of a COLLADA file.
#[derive(Default)]
struct ColladaLibraries {
    lights: String,
    effects: String,
    materials: String,
    geometries: String,
    nodes: String,
}

/// Appends lines; writing to a string cannot fail.
macro_rules! add {
    ($text:expr, $($words:tt)*) => {
        let _ = writeln!($text, $($words)*);
    };
}

fn numbers(v: DVec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

impl ColladaLibraries {
    fn node(&mut self, name: &str, to_world: &DAffine3, instance: &str) {
        // x to the left, y forwards, z up.
        let turned = DMat3::from_cols(DVec3::NEG_X, DVec3::Z, DVec3::Y);
        let m = DAffine3::from_mat3(turned) * *to_world;
        let rows = [0, 1, 2].map(|i| {
            let row = [m.x_axis[i], m.y_axis[i], m.z_axis[i], m.translation[i]];
            // Avoids negative zeros.
            row.map(|x| (x + 0.0).to_string()).join(" ")
        });
        add!(
            self.nodes,
            "      <node id=\"{name}\" name=\"{name}\" type=\"NODE\">\n        <matrix sid=\"transform\">{} 0 0 0 1\
             </matrix>\n        {instance}\n      </node>",
            rows.join(" ")
        );
    }

    fn light(&mut self, name: &str, light: &CourseLight) {
        let (to_world, kind, color) = match light {
            CourseLight::Area { middle, edges: [a, b], along, radiance } => {
                let square = DMat3::from_cols(*a, -*b, *along);
                (DAffine3::from_mat3_translation(square, *middle), "area", radiance)
            }
            CourseLight::Point(at, irradiance) => {
                (DAffine3::from_translation(*at), "point", irradiance)
            }
            // The light comes from the point in front of its node.
            CourseLight::Directional(towards, irradiance) => {
                (DAffine3::from_translation(*towards + DVec3::Z), "directional", irradiance)
            }
            CourseLight::Ambient(radiance) => (DAffine3::IDENTITY, "ambient", radiance),
            // Given on the command line.
            CourseLight::Environment(_) => return,
        };
        let color = format!("<color>{}</color>", numbers(*color));
        let attenuation = "<constant_attenuation>1</constant_attenuation><linear_attenuation>0\
             </linear_attenuation><quadratic_attenuation>0</quadratic_attenuation>";
        let common = match kind {
            "area" | "point" => format!("<point>{color}{attenuation}</point>"),
            _ => format!("<{kind}>{color}</{kind}>"),
        };
        let extra = match kind {
            "area" => format!(
                "      <extra><technique profile=\"CGL\"><area>{color}</area></technique></extra>\n"
            ),
            _ => String::new(),
        };
        add!(
            self.lights,
            "    <light id=\"{name}-light\" name=\"{name}\">\n      <technique_common>{common}</technique_common>\n\
             {extra}    </light>"
        );
        self.node(name, &to_world, &format!("<instance_light url=\"#{name}-light\"/>"));
    }

    fn shape(&mut self, name: &str, to_world: &DAffine3, geometry: &str, material: Material) {
        add!(
            self.geometries,
            "    <geometry id=\"{name}-mesh\" name=\"{name}\">\n{geometry}    </geometry>"
        );
        let course = |inner: &str| {
            format!("      <extra><technique profile=\"CGL\">{inner}</technique></extra>\n")
        };
        let (color, extra) = match material {
            Material::Diffuse(color) => (color, String::new()),
            Material::Emission(l) => {
                let inner = format!("<emission><radiance>{}</radiance></emission>", numbers(l));
                (DVec3::splat(0.8), course(&inner))
            }
            Material::Mirror => {
                (WHITE, course("<mirror><reflectance>1 1 1</reflectance></mirror>"))
            }
            Material::Glass(ior) => {
                let inner = format!(
                    "<glass><transmittance>1 1 1</transmittance><reflectance>1 1 1</reflectance>\
                     <roughness>0</roughness><ior>{ior}</ior></glass>"
                );
                (WHITE, course(&inner))
            }
            Material::Refraction(ior) => {
                let inner = format!(
                    "<refraction><transmittance>1 1 1</transmittance><roughness>0</roughness><ior>{ior}</ior>\
                     </refraction>"
                );
                (WHITE, course(&inner))
            }
            Material::Microfacet(BeckmannMetal { alpha, eta, k }) => {
                let inner = format!(
                    "<microfacet><reflectance>1 1 1</reflectance><alpha>{alpha}</alpha><eta>{}</eta><k>{}</k>\
                     </microfacet>",
                    numbers(eta),
                    numbers(k)
                );
                (WHITE, course(&inner))
            }
        };
        add!(
            self.effects,
            "    <effect id=\"{name}-effect\">\n      <profile_COMMON><technique sid=\"common\"><phong>\
             <diffuse><color sid=\"diffuse\">{} 1</color></diffuse></phong></technique></profile_COMMON>\n{extra}    \
             </effect>",
            numbers(color)
        );
        add!(
            self.materials,
            "    <material id=\"{name}-material\" name=\"{name}\"><instance_effect url=\"#{name}-effect\"/></material>"
        );
        let instance = format!(
            "<instance_geometry url=\"#{name}-mesh\"><bind_material><technique_common><instance_material \
             symbol=\"{name}-material\" target=\"#{name}-material\"/></technique_common></bind_material>\
             </instance_geometry>"
        );
        self.node(name, to_world, &instance);
    }

    fn ball(&mut self, name: &str, middle: DVec3, radius: f64, material: Material) {
        let geometry = format!(
            "      <extra><technique profile=\"CGL\"><sphere><radius>{radius}</radius></sphere></technique></extra>\n"
        );
        self.shape(name, &DAffine3::from_translation(middle), &geometry, material);
    }

    fn mesh(
        &mut self,
        name: &str,
        vertices: &[DVec3],
        triangles: &[[usize; 3]],
        material: Material,
    ) {
        let positions: Vec<_> = vertices.iter().map(|v| numbers(*v)).collect();
        let corners: Vec<_> = triangles.iter().flatten().map(ToString::to_string).collect();
        let (count, values) = (vertices.len(), 3 * vertices.len());
        let mut geometry = String::from("      <mesh>\n");
        add!(
            geometry,
            "        <source id=\"{name}-positions\"><float_array id=\"{name}-array\" count=\"{values}\">{}\
             </float_array><technique_common><accessor source=\"#{name}-array\" count=\"{count}\" stride=\"3\">\
             <param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/>\
             </accessor></technique_common></source>\n        <vertices id=\"{name}-vertices\"><input \
             semantic=\"POSITION\" source=\"#{name}-positions\"/></vertices>\n        <polylist \
             material=\"{name}-material\" count=\"{}\"><input semantic=\"VERTEX\" source=\"#{name}-vertices\" \
             offset=\"0\"/><vcount>{}</vcount><p>{}</p></polylist>\n      </mesh>",
            positions.join(" "),
            triangles.len(),
            vec!["3"; triangles.len()].join(" "),
            corners.join(" ")
        );
        self.shape(name, &DAffine3::IDENTITY, &geometry, material);
    }

    fn finish(self, (_, x_fov, aspect): (DVec3, f64, f64)) -> String {
        let Self { lights, effects, materials, geometries, nodes } = self;
        format!(
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
             <COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n  \
             <asset><unit name=\"meter\" meter=\"1\"/><up_axis>Z_UP</up_axis></asset>\n  \
             <library_cameras>\n    <camera id=\"camera-camera\" name=\"Camera\"><optics><technique_common>\
             <perspective><xfov sid=\"xfov\">{x_fov}</xfov><aspect_ratio>{aspect}</aspect_ratio>\
             <znear sid=\"znear\">0.1</znear><zfar sid=\"zfar\">100</zfar></perspective></technique_common></optics>\
             </camera>\n  </library_cameras>\n  \
             <library_lights>\n{lights}  </library_lights>\n  \
             <library_effects>\n{effects}  </library_effects>\n  \
             <library_materials>\n{materials}  </library_materials>\n  \
             <library_geometries>\n{geometries}  </library_geometries>\n  \
             <library_visual_scenes>\n    <visual_scene id=\"Scene\" name=\"Scene\">\n{nodes}    </visual_scene>\n  \
             </library_visual_scenes>\n  \
             <scene><instance_visual_scene url=\"#Scene\"/></scene>\n</COLLADA>\n"
        )
    }
}
