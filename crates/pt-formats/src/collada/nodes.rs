//! The node hierarchy and its instances.

use pt_math::DAffine3;
use pt_scene::{Object, Placement};
use roxmltree::Children;

use super::reader::{ColladaReader, child, name_of};
use super::{attenuation, camera, coordinates, geometry, light, material, transform};
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::names::quote;
use crate::shared::reference_stack::{ReferenceError, ReferenceLimits, ReferenceStack};
use crate::shared::xml::XmlNode;

/// Maximum nesting of nodes and instances of nodes.
const MAX_DEPTH: usize = 1000;

/// A node whose children are being placed.
struct NodeLevel<'a> {
    node: XmlNode<'a>,
    to_world: DAffine3,
    /// True if all transforms from the root to the node are matrices.
    has_matrices: bool,
    rest: Children<'a, 'a>,
}

/// Places the content of a `<visual_scene>`, depth first, in file order.
pub(super) fn place<'a>(
    reader: &mut ColladaReader<'a>,
    visual_scene: XmlNode<'a>,
    to_y_up: DAffine3,
) -> Result<(), LoadError> {
    let rest = visual_scene.children();
    // The number of nodes is limited together with that of all placed items.
    let bounds =
        ReferenceLimits { deep: reader.context.limits().depth(MAX_DEPTH), many: usize::MAX };
    let mut way = ReferenceStack::new(bounds);
    let mut levels =
        vec![NodeLevel { node: visual_scene, to_world: to_y_up, has_matrices: true, rest }];
    while let Some(level) = levels.last_mut() {
        let Some(element) = level.rest.next() else {
            levels.pop();
            way.leave();
            continue;
        };
        let place = (level.node, level.to_world, level.has_matrices);
        let inner = match element.tag_name().name() {
            "node" => Some(element),
            "instance_node" => {
                let found = reader.resolve(element, "url", &["node"]);
                reader.context.ok_or_report(found)?.flatten()
            }
            _ => {
                let done = place_instance(reader, place, element);
                reader.context.ok_or_report(done)?;
                None
            }
        };
        if let Some(node) = inner {
            let level = enter(reader, (&levels, &mut way), element, node);
            levels.extend(reader.context.ok_or_report(level)?);
        }
    }
    Ok(())
}

/// Enters a node, which an element of the previous node contains or refers to.
fn enter<'a>(
    reader: &mut ColladaReader<'a>,
    (levels, way): (&[NodeLevel<'a>], &mut ReferenceStack<XmlNode<'a>>),
    element: XmlNode<'a>,
    node: XmlNode<'a>,
) -> Result<NodeLevel<'a>, LoadError> {
    way.enter(node).map_err(|barred| match barred {
        ReferenceError::Circle => {
            let message = format!("the node {} contains itself", quote(&name_of(node)));
            reader.error(element, message)
        }
        ReferenceError::Deep(most) | ReferenceError::Many(most) => {
            let message = format!("nodes are nested deeper than {most}; such files are rejected");
            LoadContext::exceeded(reader.document.span(element), message)
        }
    })?;
    let level = level(reader, levels, element, node);
    if level.is_err() {
        way.leave();
    }
    level
}

/// Returns the level of a node below the current ones.
fn level<'a>(
    reader: &mut ColladaReader<'a>,
    levels: &[NodeLevel<'a>],
    element: XmlNode<'a>,
    node: XmlNode<'a>,
) -> Result<NodeLevel<'a>, LoadError> {
    reader.count_placed(element, 1)?;
    let outer = levels.last();
    let (outer, has_matrices) =
        outer.map_or((DAffine3::IDENTITY, true), |level| (level.to_world, level.has_matrices));
    let to_world = outer * transform::local(reader, node)?;
    let has_matrices = has_matrices && transform::has_matrices(node);
    if !to_world.is_finite() {
        let message = "the product of the transforms down to this node is infinite";
        return Err(reader.error(node, message));
    }
    Ok(NodeLevel { node, to_world, has_matrices, rest: node.children() })
}

/// Message about omitted cameras and lights.
const LEFT_OUT: &str = "the instance is omitted";

/// Places the target of an `instance_…` element; other elements are ignored.
fn place_instance<'a>(
    reader: &mut ColladaReader<'a>,
    (node, to_world, has_matrices): (XmlNode<'a>, DAffine3, bool),
    instance: XmlNode<'a>,
) -> Result<(), LoadError> {
    match instance.tag_name().name() {
        "instance_camera" => {
            let found = reader.resolve(instance, "url", &["camera"]);
            if let Some(found) = reader.context.forgive(found, LEFT_OUT)?.flatten() {
                let mut camera = camera::read(reader, found, to_world)?;
                if let Some(camera) = camera.as_mut()
                    && reader.has_cgl_profile
                    && has_matrices
                {
                    camera.placement = Placement::Course;
                }
                reader.scene.cameras.extend(camera);
            }
        }
        "instance_light" => {
            let found = reader.resolve(instance, "url", &["light"]);
            if let Some(found) = reader.context.forgive(found, LEFT_OUT)?.flatten()
                && let Some(light) = light::read(reader, found, instance, to_world)?
            {
                attenuation::note(reader, found)?;
                reader.scene.lights.push(light);
            }
        }
        "instance_geometry" => {
            if let Some(found) = reader.resolve(instance, "url", &["geometry"])? {
                place_geometry(reader, node, instance, found, to_world)?;
            }
        }
        "instance_controller" => place_controller(reader, node, instance, to_world)?,
        _ => {}
    }
    Ok(())
}

/// Places a geometry with the materials that the instance binds.
fn place_geometry<'a>(
    reader: &mut ColladaReader<'a>,
    node: XmlNode<'a>,
    instance: XmlNode<'a>,
    geometry: XmlNode<'a>,
    to_world: DAffine3,
) -> Result<(), LoadError> {
    let sets = coordinates::sets(reader, instance)?;
    let Some(shape) = geometry::read(reader, geometry, sets)? else { return Ok(()) };
    reader.count_placed(instance, shape.symbols.len())?;
    let materials = material::bind(reader, instance, &shape.symbols)?;
    let names = [name_of(node), name_of(geometry)];
    let object = Object {
        name: names.into_iter().find(|name| !name.is_empty()).unwrap_or_default(),
        to_world,
        motion: None,
        geometry: shape.geometry,
        materials,
        media: None,
        at: reader.document.span(instance),
    };
    reader.scene.objects.push(object);
    Ok(())
}

/// Places the mesh of a controller in its bind pose, or before morphing.
fn place_controller<'a>(
    reader: &mut ColladaReader<'a>,
    node: XmlNode<'a>,
    instance: XmlNode<'a>,
    mut to_world: DAffine3,
) -> Result<(), LoadError> {
    /// Maximum nesting of controllers; a morph below a skin makes two.
    const MAX_CONTROLLERS: usize = 10;
    let Some(mut found) = reader.resolve(instance, "url", &["controller"])? else { return Ok(()) };
    for _ in 0..MAX_CONTROLLERS {
        let Some(deformer) = child(found, "skin").or(child(found, "morph")) else {
            return Err(reader.error(found, "expected a <skin> or a <morph>"));
        };
        let tag = deformer.tag_name().name();
        reader.warn(instance, format!("the <{tag}> is not applied; the mesh is not deformed"));
        if let Some(matrix) = child(deformer, "bind_shape_matrix") {
            to_world *= transform::matrix(reader, matrix)?;
        }
        match reader.resolve(deformer, "source", &["geometry", "controller"])? {
            None => return Ok(()),
            Some(source) if source.tag_name().name() == "controller" => found = source,
            Some(geometry) => return place_geometry(reader, node, instance, geometry, to_world),
        }
    }
    let message =
        format!("more than {MAX_CONTROLLERS} nested controllers between this instance and a mesh");
    Err(reader.error(instance, message))
}
