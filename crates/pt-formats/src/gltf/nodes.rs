//! Nodes: the hierarchy of objects, and their transforms. [glTF 2.0, §3.5]

use std::sync::Arc;

use pt_math::DAffine3;
use pt_scene::medium::Sides;
use pt_scene::{Geometry, Material, Mesh, Object, shapes};

use super::GltfReader;
use super::animation::Pose;
use super::item::Item;
use super::material::{MaterialLayout, MeshAttributes};
use super::mesh::Form;
use crate::LoadError;
use crate::gltf::transform::{affine, composed, quaternion};
use crate::shared::context::LoadContext;
use crate::shared::placeholder;

/// Maximum number of primitives, counted once per instance. Short files can request any number:
/// meshes of many primitives, and many nodes that refer to them.
const MAX_OBJECTS: usize = 1_000_000;

/// Maximum number of morph targets of a mesh.
const MAX_TARGETS: usize = 1024;

/// Nodes of a scene, each of which occurs once.
struct PlacedNodes {
    /// Node indices in the order of the file, parents before children.
    order: Vec<usize>,
    /// Transform to the world by node index; `None` if the node is not part of the scene.
    to_world: Vec<Option<DAffine3>>,
}

impl<'a> GltfReader<'a> {
    /// Reads the cameras, lights and meshes of all nodes of the scene.
    pub(super) fn nodes(&mut self) -> Result<(), LoadError> {
        self.poses = self.read_poses()?;
        let placed = self.placed()?;
        for index in &placed.order {
            let context = self.context;
            let node = self.root.member("nodes", *index, &self.root, "nodes")?;
            let to_world = placed.to_world[*index].unwrap_or(DAffine3::IDENTITY);
            context.ok_or_report(self.camera(&node, to_world))?;
            context.ok_or_report(self.light(&node, to_world))?;
            if let Some(mesh) = context.ok_or_report(node.whole("mesh"))?.flatten() {
                context.ok_or_report(self.mesh((*index, &node), mesh, to_world, &placed))?;
            }
        }
        Ok(())
    }

    /// Computes the transforms of all nodes of the scene.
    fn placed(&self) -> Result<PlacedNodes, LoadError> {
        let count = self.root.count("nodes")?;
        let mut to_world = vec![None; count];
        let (mut order, mut next) = (Vec::new(), Vec::new());
        for (root, item, field) in self.roots(count)?.into_iter().rev() {
            next.push((root, DAffine3::IDENTITY, item, field));
        }
        while let Some((index, parent, from, field)) = next.pop() {
            let found = self.root.member("nodes", index, &from, field);
            let Some(node) = self.context.ok_or_report(found)? else { continue };
            if to_world[index].is_some() {
                let message = format!(
                    "found node {index} twice or inside of itself, expected one parent for each \
                     node"
                );
                self.context.ok_or_report(Err::<(), _>(from.refuse(field, message)))?;
                continue;
            }
            let Some(here) =
                self.context.ok_or_report(place_of(&node, self.poses.get(&index), parent))?
            else {
                continue;
            };
            to_world[index] = Some(here);
            order.push(index);
            let children = node.wholes("children")?;
            next.extend(
                children.into_iter().rev().map(|child| (child, here, node.clone(), "children")),
            );
        }
        Ok(PlacedNodes { order, to_world })
    }

    /// Returns the root nodes and the items that refer to them: the roots of the default scene, or
    /// of the first scene, or, without scenes, all nodes without a parent.
    fn roots(&self, count: usize) -> Result<Vec<(usize, Item<'a>, &'static str)>, LoadError> {
        let root = &self.root;
        let asked = root.whole("scene")?;
        let scenes = root.count("scenes")?;
        let scene = match asked {
            Some(number) => {
                let scene = root.member("scenes", number, root, "scene");
                // Without any scene, all nodes are the only possible meaning.
                let instead = "all nodes are shown";
                if scenes == 0 { self.context.forgive(scene, instead)? } else { Some(scene?) }
            }
            None if scenes > 0 => Some(root.member("scenes", 0, root, "scene")?),
            None => None,
        };
        if let Some(scene) = scene {
            let nodes = scene.wholes("nodes")?;
            return Ok(nodes.into_iter().map(|node| (node, scene.clone(), "nodes")).collect());
        }
        let mut is_child = vec![false; count];
        for node in root.children("nodes")? {
            for child in node.wholes("children")? {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
        }
        let roots = (0..count).filter(|node| !is_child[*node]);
        Ok(roots.map(|node| (node, root.clone(), "nodes")).collect())
    }

    /// Adds the primitives of the mesh of a node.
    fn mesh(
        &mut self,
        (number, node): (usize, &Item<'a>),
        index: usize,
        to_world: DAffine3,
        placed: &PlacedNodes,
    ) -> Result<(), LoadError> {
        let mesh = self.root.member("meshes", index, node, "mesh")?;
        let joints = match node.whole("skin")? {
            None => None,
            Some(skin) => Some(self.skin(node, skin, placed)?),
        };
        let animated = self.poses.get(&number).and_then(|pose| pose.weights.clone());
        let is_shared = joints.is_none() && animated.is_none() && !node.has("weights");
        let weights = match animated {
            Some(weights) => weights,
            None => weights(if node.has("weights") { node } else { &mesh })?,
        };
        // Skinned vertices are placed by the joints, regardless of the transform of the node.
        let places = match joints {
            Some(_) => vec![DAffine3::IDENTITY],
            None => self.instances(node)?.into_iter().map(|place| to_world * place).collect(),
        };
        let count = mesh.count("primitives")?;
        self.shown = self.shown.saturating_add(count.max(1).saturating_mul(places.len().max(1)));
        let most = self.context.limits().shapes(MAX_OBJECTS);
        if self.shown > most {
            let message = format!("the scene exceeds {most} primitives");
            return Err(LoadContext::exceeded(node.span(), message));
        }
        let is_mirrored = |place: &DAffine3| place.matrix3.determinant() < 0.0;
        let form = Form {
            weights: &weights,
            joints: joints.as_ref().map(|joints| joints.as_slice()),
            layout: MaterialLayout::default(),
            is_mirrored: places.iter().any(is_mirrored),
        };
        for (i, primitive) in mesh.children("primitives")?.iter().enumerate() {
            let key = is_shared.then_some((index, i));
            let context = self.context;
            let made = self.object(node, &mesh, primitive, key, &form);
            for mut object in context.ok_or_report(made)?.unwrap_or_default() {
                if count > 1 {
                    object.name = format!("{} {}", object.name, i + 1);
                }
                for (copy, to_world) in places.iter().enumerate() {
                    let mut object = Object { to_world: *to_world, ..object.clone() };
                    if is_mirrored(to_world) {
                        self.mirror(&mut object);
                    }
                    if places.len() > 1 {
                        object.name = format!("{} ({})", object.name, copy + 1);
                    }
                    self.place(node, object)?;
                }
            }
        }
        Ok(())
    }

    /// Creates the objects of a primitive with its material, without a transform: the primitive,
    /// and its back if that emits as well. Returns none if it has no triangles. The mesh is cached
    /// under `key` for all nodes that share it.
    fn object(
        &mut self,
        node: &Item<'a>,
        mesh: &Item<'a>,
        primitive: &Item<'a>,
        key: Option<(usize, usize)>,
        form: &Form<'_>,
    ) -> Result<Vec<Object>, LoadError> {
        if Self::is_of_points(primitive)? {
            let made = self.object_of_points(node, (mesh, primitive), key, form)?;
            return Ok(made.into_iter().collect());
        }
        let index = primitive.whole("material")?;
        let described = index
            .map(|index| self.root.member("materials", index, primitive, "material"))
            .transpose()?;
        let known = key.and_then(|key| self.meshes.get(&key).cloned());
        let shape = if let Some(known) = known {
            known
        } else {
            let form = Form { layout: Self::layout(described.as_ref())?, ..form.clone() };
            let shape = match self.primitive(primitive, &mesh.name(), &form) {
                Err(LoadError::AlreadyReported) => {
                    return Ok(self.stand_in(node, primitive)?.into_iter().collect());
                }
                shape => shape?,
            };
            self.meshes.extend(key.map(|key| (key, shape.clone())));
            shape
        };
        let Some(shape) = shape else { return Ok(Vec::new()) };
        let values = MeshAttributes {
            colors: shape.colors.is_some(),
            tangents: shape.attributes.faces.contains_key(MeshAttributes::TANGENTS),
            opacities: shape.attributes.vertices.contains_key(MeshAttributes::OPACITIES),
        };
        let made = self.material(index, described.as_ref(), values)?;
        let mut materials = vec![Some(made.material)];
        let has_mirrored = shape.submeshes.iter().any(|part| part.slot > 0);
        if let Some(described) = described.filter(|_| has_mirrored || form.is_mirrored) {
            let mirrored = self.mirrored(&described, made)?;
            materials.extend(has_mirrored.then_some(Some(mirrored)));
        }
        let back = made.back.map(|back| (self.back_of(key, &shape), back));
        let front = Object {
            name: node.name(),
            to_world: DAffine3::IDENTITY,
            motion: None,
            geometry: Geometry::Mesh(shape),
            materials,
            media: made.medium.map(|inside| Sides { interior: Some(inside), exterior: None }),
            at: node.span(),
        };
        let back = back.map(|(mesh, material)| Object {
            name: format!("back of {}", front.name),
            materials: vec![Some(material); front.materials.len()],
            geometry: Geometry::Mesh(mesh),
            media: None,
            ..front.clone()
        });
        Ok(std::iter::once(front).chain(back).collect())
    }

    /// Replaces the materials of a mirrored object by their mirrored variants.
    fn mirror(&self, object: &mut Object) {
        for material in object.materials.iter_mut().flatten() {
            *material = self.mirrored.get(material).copied().unwrap_or(*material);
        }
    }

    /// Returns the back of a mesh, which is cached under `key`.
    fn back_of(&mut self, key: Option<(usize, usize)>, mesh: &Mesh) -> Arc<Mesh> {
        let made = || Arc::new(shapes::back_of(mesh));
        match key {
            Some(key) => Arc::clone(self.backs.entry(key).or_insert_with(made)),
            None => made(),
        }
    }

    /// Creates a box in place of a primitive whose buffer is missing, from the bounds of the
    /// accessor; `None` if the file does not contain them.
    fn stand_in(
        &mut self,
        node: &Item<'a>,
        primitive: &Item<'a>,
    ) -> Result<Option<Object>, LoadError> {
        let Some(attributes) = primitive.child("attributes")? else { return Ok(None) };
        let Some(index) = attributes.whole("POSITION")? else { return Ok(None) };
        let accessor = self.root.member("accessors", index, &attributes, "POSITION")?;
        let (Some(least), Some(most)) =
            (accessor.vector::<3>("min")?, accessor.vector::<3>("max")?)
        else {
            return Ok(None);
        };
        let mut mesh = shapes::cube();
        for position in &mut mesh.positions {
            let at = |c: usize| if position[c] > 0.0 { most[c] } else { least[c] };
            *position = [at(0), at(1), at(2)].map(|x| x as f32);
        }
        if !mesh.positions.as_flattened().iter().all(|x| x.is_finite()) {
            return Ok(None);
        }
        let material = self.scene.materials.len() as u32;
        self.scene.materials.push(Material {
            name: "missing".to_owned(),
            surface: placeholder::surface(),
            emission: [0.0; 3].into(),
            hidden_emission: false,
            opacity: 1.0.into(),
        });
        Ok(Some(Object {
            name: node.name(),
            to_world: DAffine3::IDENTITY,
            motion: None,
            materials: vec![Some(material); mesh.submeshes.len()],
            geometry: Geometry::Mesh(Arc::new(mesh)),
            media: None,
            at: node.span(),
        }))
    }

    /// Returns the joint transforms of a skin.
    fn skin(
        &mut self,
        node: &Item<'a>,
        index: usize,
        placed: &PlacedNodes,
    ) -> Result<Arc<Vec<DAffine3>>, LoadError> {
        if let Some(known) = self.joints.get(&index) {
            return Ok(Arc::clone(known));
        }
        let skin = self.root.member("skins", index, node, "skin")?;
        let to_world = |node: usize| placed.to_world.get(node).copied().flatten();
        let joints = Arc::new(self.joints_of(&skin, to_world)?);
        self.joints.insert(index, Arc::clone(&joints));
        Ok(joints)
    }

    /// Adds an object. If its transform is singular, it is omitted with a warning.
    fn place(&mut self, node: &Item<'a>, object: Object) -> Result<(), LoadError> {
        let determinant = object.to_world.matrix3.determinant();
        if determinant == 0.0 {
            self.warn(node, "found a transform that flattens space; its mesh is omitted");
            return Ok(());
        }
        if !object.to_world.is_finite() || !determinant.is_finite() {
            return Err(
                node.error("found a transform that is too large or too far from the origin")
            );
        }
        self.scene.objects.push(object);
        Ok(())
    }

    /// Returns the transforms of the instances of a mesh in the node, from EXT_mesh_gpu_instancing;
    /// without the extension, a single identity.
    fn instances(&mut self, node: &Item<'a>) -> Result<Vec<DAffine3>, LoadError> {
        let Some(instancing) = node.extension("EXT_mesh_gpu_instancing")? else {
            return Ok(vec![DAffine3::IDENTITY]);
        };
        let missing = || instancing.error("missing \"attributes\"");
        let attributes = instancing.child("attributes")?.ok_or_else(missing)?;
        let moved = self.accessors.vectors::<3>(&attributes, "TRANSLATION")?;
        let turned = self.accessors.vectors::<4>(&attributes, "ROTATION")?;
        let scaled = self.accessors.vectors::<3>(&attributes, "SCALE")?;
        let counts = [
            moved.as_ref().map(Vec::len),
            turned.as_ref().map(Vec::len),
            scaled.as_ref().map(Vec::len),
        ];
        let count = counts.into_iter().flatten().next().unwrap_or(0);
        if counts.into_iter().flatten().any(|other| other != count) {
            return Err(attributes.error(
                "found accessors with different numbers of elements, expected the same number",
            ));
        }
        if count > MAX_OBJECTS {
            let message = format!("the scene exceeds {MAX_OBJECTS} primitives");
            return Err(attributes.error(message));
        }
        let wide = |v: [f32; 3]| v.map(f64::from);
        let place = |i: usize| {
            let rotation =
                turned.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |all| all[i].map(f64::from));
            let rotation = quaternion(rotation).ok_or_else(|| {
                attributes.refuse(
                    "ROTATION",
                    format!("found a zero element {i}, expected unit quaternions"),
                )
            })?;
            Ok(composed(
                moved.as_ref().map_or([0.0; 3], |all| wide(all[i])),
                rotation,
                scaled.as_ref().map_or([1.0; 3], |all| wide(all[i])),
            ))
        };
        (0..count).map(place).collect()
    }
}

/// Reads the weights of the morph targets of a mesh or a node.
fn weights(item: &Item<'_>) -> Result<Vec<f64>, LoadError> {
    let count = item.count("weights")?;
    if count > MAX_TARGETS {
        let message = format!("found {count} morph targets, expected at most {MAX_TARGETS}");
        return Err(item.refuse("weights", message));
    }
    item.numbers("weights")
}

/// Computes the transform from a node to the world. `parent` is that of its parent, `pose` contains
/// its animated properties.
fn place_of(node: &Item<'_>, pose: Option<&Pose>, parent: DAffine3) -> Result<DAffine3, LoadError> {
    let here = parent * transform(node, pose)?;
    if here.is_finite() {
        return Ok(here);
    }
    Err(node.error("found a transform that is too large or too far from the origin"))
}

/// Computes the transform from a node to its parent. [glTF 2.0, §3.5.3]
fn transform(node: &Item<'_>, pose: Option<&Pose>) -> Result<DAffine3, LoadError> {
    if let Some(matrix) = node.vector::<16>("matrix")? {
        if [matrix[3], matrix[7], matrix[11], matrix[15]] != [0.0, 0.0, 0.0, 1.0] {
            let message = "expected the last row 0 0 0 1 of an affine transform";
            return Err(node.refuse("matrix", message));
        }
        return Ok(affine(&matrix));
    }
    let rotation = node.vector("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = quaternion(rotation).ok_or_else(|| {
        node.refuse("rotation", "found a zero quaternion, expected a unit quaternion x y z w")
    })?;
    let moved = node.vector("translation")?.unwrap_or([0.0; 3]);
    let scale = node.vector("scale")?.unwrap_or([1.0; 3]);
    Ok(composed(
        pose.and_then(|pose| pose.translation).unwrap_or(moved),
        pose.and_then(|pose| pose.rotation).unwrap_or(rotation),
        pose.and_then(|pose| pose.scale).unwrap_or(scale),
    ))
}
