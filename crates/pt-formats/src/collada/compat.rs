//! Log of the program of the course CS184 while it reads a scene.

use std::collections::HashMap;
use std::path::Path;

use pt_math::DAffine3;
use pt_scene::{Camera, LightKind, Projection};
use roxmltree::NodeId;

use super::reader::{ColladaReader, cgl_techniques, child, children, elements, name_of};
use super::source::inputs;
use super::{camera, light};
use crate::shared::context::LoadContext;
use crate::shared::xml::{XmlDocument, XmlNode, decode, words};
use crate::{Limits, LoadError, LoadOptions};

/// Prefix of the lines about nodes.
const NODE: &str = "[COLLADA Parser]  |- Node:";
/// Prefix of the lines about instances in a node.
const INSTANCE: &str = "[COLLADA Parser]   |-";
/// Maximum length of a name or id, in characters.
const MAX_NAME: usize = 200;

/// Returns the lines with which the program of CS184 (`pathtracer`, editions 2019 to 2025) lists
/// the nodes of a COLLADA file, their lights, cameras, spheres and meshes, and the materials of
/// those.
///
/// The line of a node is followed by its inner nodes, then by its instances. That program supports
/// neither instances of nodes nor controllers, so those have no lines, and neither has what the
/// reader omits. Where it prints the address of a material, these lines contain its number, from 1
/// in order of the lines.
///
/// # Errors
/// Returns an error if the file is no XML, has no visual scene, or has invalid cameras or lights:
/// only where the reader of scenes fails as well.
pub fn cs184_log(bytes: &[u8], path: &Path) -> Result<Vec<String>, LoadError> {
    let text = decode(bytes, path)?;
    let document = XmlDocument::parse(&text, path, &Limits::default())?;
    let context = LoadContext::new(path, &LoadOptions::default());
    let mut log = Cs184Log {
        reader: ColladaReader::new(&document, &context),
        lines: Vec::new(),
        summaries: HashMap::new(),
        materials: HashMap::new(),
    };
    let visual_scene = super::visual_scene(&mut log.reader)?;
    for node in children(visual_scene, "node") {
        log.add_node(node)?;
    }
    Ok(log.lines)
}

/// State of the log.
struct Cs184Log<'a> {
    /// The scene and the warnings of the reader are not used.
    reader: ColladaReader<'a>,
    lines: Vec<String>,
    /// Summary of each camera, light and geometry; `None` if it has no line.
    summaries: HashMap<NodeId, Option<String>>,
    /// Line of each material.
    materials: HashMap<NodeId, String>,
}

impl<'a> Cs184Log<'a> {
    /// Adds the lines of a node. Recursion is bounded, since the nesting of documents is limited.
    fn add_node(&mut self, node: XmlNode<'a>) -> Result<(), LoadError> {
        self.lines.push(format!("{NODE} {}", label(node)));
        for inner in children(node, "node") {
            self.add_node(inner)?;
        }
        for instance in elements(node) {
            match instance.tag_name().name() {
                "instance_camera" => self.add_instance(instance, "camera")?,
                "instance_light" => self.add_instance(instance, "light")?,
                "instance_geometry" => self.add_instance(instance, "geometry")?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds the line of an instance, if it has one, and those of its materials.
    fn add_instance(&mut self, instance: XmlNode<'a>, tag: &str) -> Result<(), LoadError> {
        let Some(found) = self.target(instance, "url", tag) else { return Ok(()) };
        if !self.summaries.contains_key(&found.id()) {
            let summary = self.summary(instance, found)?;
            self.summaries.insert(found.id(), summary);
        }
        let Some(Some(summary)) = self.summaries.get(&found.id()) else { return Ok(()) };
        self.lines.push(format!("{INSTANCE} {summary}"));
        let bindings = child(instance, "bind_material").and_then(|b| child(b, "technique_common"));
        for binding in bindings.iter().flat_map(|b| children(*b, "instance_material")) {
            let Some(material) = self.target(binding, "target", "material") else { continue };
            let number = self.materials.len() + 1;
            let line = self.materials.entry(material.id()).or_insert_with(|| {
                format!("{INSTANCE} MaterialInfo: {} [ BSDF={number:#x} ]", label(material))
            });
            self.lines.push(line.clone());
        }
        Ok(())
    }

    /// Returns the summary of a camera, a light or a geometry; `None` if it has no line.
    fn summary(
        &mut self,
        instance: XmlNode<'a>,
        found: XmlNode<'a>,
    ) -> Result<Option<String>, LoadError> {
        Ok(match found.tag_name().name() {
            "camera" => {
                let camera = camera::read(&mut self.reader, found, DAffine3::IDENTITY)?;
                camera.and_then(|camera| camera_summary(found, &camera))
            }
            "light" => {
                let light = light::read(&mut self.reader, found, instance, DAffine3::IDENTITY)?;
                let described = light.zip(light::description(found));
                described.map(|(light, element)| {
                    let parameters = light_parameters(&self.reader, &light.kind, element);
                    format!("LightInfo: {} [ {parameters} ]", label(found))
                })
            }
            _ => match child(found, "mesh") {
                Some(mesh) => mesh_summary(&self.reader, found, mesh),
                None => sphere_summary(&self.reader, found),
            },
        })
    }

    /// Returns the element to which an attribute refers, if it is in this file.
    fn target(&self, node: XmlNode<'a>, attribute: &str, tag: &str) -> Option<XmlNode<'a>> {
        self.reader.look_up(node.attribute(attribute)?, &[tag])
    }
}

/// Returns the summary of a camera; the program supports perspective cameras only.
fn camera_summary(element: XmlNode<'_>, camera: &Camera) -> Option<String> {
    let Projection::Perspective { x_fov, y_fov } = camera.projection else { return None };
    let [hfov, vfov, near, far] = [x_fov, y_fov, camera.near, camera.far].map(general);
    // The space before the id is in the original.
    Some(format!(
        "CameraInfo: {} (id: {}) [ hfov={hfov} vfov={vfov} nclip={near} fclip={far} ]",
        shown(&name_of(element)),
        id_of(element)
    ))
}

/// Returns the parameters of a light, in its own frame; `element` describes it in the file.
fn light_parameters(reader: &ColladaReader<'_>, kind: &LightKind, element: XmlNode<'_>) -> String {
    let (position, direction) = ("position=(0,0,0)", "direction=(0,0,-1)");
    let attenuation = || {
        let term = |tag, default| {
            let written = child(element, tag).and_then(|n| reader.scalar(n).ok());
            general(written.unwrap_or(default))
        };
        format!(
            "constant_att={} linear_att={} quadratic_att={}",
            term("constant_attenuation", 1.0),
            term("linear_attenuation", 0.0),
            term("quadratic_attenuation", 0.0)
        )
    };
    let start = |color: &[f32; 3]| {
        format!("type={} spectrum={}", element.tag_name().name(), vector(*color))
    };
    match kind {
        LightKind::Hemisphere { radiance } | LightKind::Constant { radiance, .. } => {
            start(radiance)
        }
        LightKind::Directional { irradiance: color } | LightKind::Area { radiance: color } => {
            format!("{} {direction}", start(color))
        }
        LightKind::Point { intensity } => {
            format!("{} {position} {}", start(intensity), attenuation())
        }
        LightKind::Spot { intensity, falloff_angle, falloff_exponent } => format!(
            "{} {position} {direction} falloff_deg={} falloff_exp={} {}",
            start(intensity),
            general(*falloff_angle),
            general(*falloff_exponent),
            attenuation()
        ),
        // COLLADA has no other kinds.
        _ => format!("type={}", element.tag_name().name()),
    }
}

fn sphere_summary<'a>(reader: &ColladaReader<'a>, geometry: XmlNode<'a>) -> Option<String> {
    let sphere = cgl_techniques(geometry).find_map(|t| child(t, "sphere"))?;
    let radius = reader.scalar(child(sphere, "radius")?).ok()?;
    Some(format!("Sphere: {} [ radius={} ]", label(geometry), general(radius)))
}

/// Returns the sizes of a mesh by its first polygons or, if it has none, its first triangles; the
/// program does not support other primitives.
fn mesh_summary<'a>(
    reader: &ColladaReader<'a>,
    geometry: XmlNode<'a>,
    mesh: XmlNode<'a>,
) -> Option<String> {
    let primitive = child(mesh, "polylist").or_else(|| child(mesh, "triangles"))?;
    let source = |owner: XmlNode<'a>, semantic: &str, tag| {
        let input = inputs(owner).find(|n| n.attribute("semantic") == Some(semantic))?;
        reader.look_up(input.attribute("source")?, &[tag])
    };
    let entries = |source: Option<XmlNode<'a>>, size| {
        let array = source.and_then(|s| child(s, "float_array"));
        array.map_or(0, |array| words(array).count() / size)
    };
    let vertices = source(primitive, "VERTEX", "vertices");
    Some(format!(
        "PolymeshInfo: {} [ num_polygons={} num_vertices={} num_normals={} num_texcoords={} ]",
        label(geometry),
        polygons(primitive),
        entries(vertices.and_then(|v| source(v, "POSITION", "source")), 3),
        entries(source(primitive, "NORMAL", "source"), 3),
        entries(source(primitive, "TEXCOORD", "source"), 2)
    ))
}

/// Returns the number of polygons of a `<polylist>` or `<triangles>`.
fn polygons(primitive: XmlNode<'_>) -> usize {
    if primitive.tag_name().name() == "polylist" {
        return child(primitive, "vcount").map_or(0, |vcount| words(vcount).count());
    }
    let offsets = inputs(primitive).filter_map(|n| n.attribute("offset")?.trim().parse().ok());
    let largest: usize = offsets.max().unwrap_or(0);
    let indices: usize = children(primitive, "p").map(|p| words(p).count()).sum();
    indices / largest.saturating_add(1).saturating_mul(3)
}

/// Formats `name (id:…)`.
fn label(node: XmlNode<'_>) -> String {
    format!("{} (id:{})", shown(&name_of(node)), id_of(node))
}

fn id_of(node: XmlNode<'_>) -> String {
    shown(node.attribute("id").unwrap_or_default())
}

/// Returns a name on one line, truncated if it is long.
fn shown(name: &str) -> String {
    name.chars().take(MAX_NAME).map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Formats `(x,y,z)`.
fn vector(v: [f32; 3]) -> String {
    let [x, y, z] = v.map(|c| general(f64::from(c)));
    format!("({x},{y},{z})")
}

/// Formats a number as C's `%g` and C++'s streams do: six significant digits, without trailing
/// zeros, and with an exponent if that is below −4 or above 5. [ISO C11, section 7.21.6.1]
fn general(number: f64) -> String {
    const DIGITS: i32 = 6;
    // The exponent is that after rounding: 999999.5 is 1e+06.
    let scientific = format!("{number:.*e}", DIGITS as usize - 1);
    let parts = scientific.split_once('e').and_then(|(m, e)| Some((m, e.parse::<i32>().ok()?)));
    let Some((mantissa, exponent)) = parts else { return scientific };
    if (-4..DIGITS).contains(&exponent) {
        let decimals = (DIGITS - 1 - exponent) as usize;
        return without_zeros(&format!("{number:.decimals$}")).to_owned();
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", without_zeros(mantissa), exponent.abs())
}

/// Removes the trailing zeros of the fraction of a decimal number.
fn without_zeros(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::general;

    /// Output of `printf("%g")` of the GNU C library.
    #[test]
    fn numbers_are_written_as_by_c() {
        for (number, written) in [
            (0.0, "0"),
            (-0.0, "-0"),
            (10.0, "10"),
            (0.3, "0.3"),
            (f64::from(0.3_f32), "0.3"),
            (49.13434, "49.1343"),
            (-1.0 / 3.0, "-0.333333"),
            (100_000.0, "100000"),
            (123_456.5, "123456"),
            (123_457.5, "123458"),
            (999_999.4, "999999"),
            (999_999.5, "1e+06"),
            (1_234_567.0, "1.23457e+06"),
            (0.001_599_967, "0.00159997"),
            (0.0001, "0.0001"),
            (0.000_099_999_95, "0.0001"),
            (0.000_012_345_67, "1.23457e-05"),
            (1e-7, "1e-07"),
            (-1.5e300, "-1.5e+300"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(general(number), written);
        }
    }
}
