//! `<shape type="shapegroup">` and `<shape type="instance">`: instanced shapes.

use std::rc::Rc;
use std::sync::Arc;

use super::object::{MitsubaObject, Parameters, error};
use super::scene::SceneBuilder;
use crate::LoadError;
use crate::shared::context::LoadContext;

/// Maximum number of objects of a scene. Short files can request any number: groups of many shapes,
/// and many instances of them.
const MAX_OBJECTS: usize = 1_000_000;

impl SceneBuilder<'_> {
    /// Returns the shapes of a group, in its own coordinates.
    pub(super) fn group(&mut self, index: usize) -> Result<Rc<[pt_scene::Object]>, LoadError> {
        if let Some(known) = self.groups.get(&index) {
            return Ok(Rc::clone(known));
        }
        let tree = self.tree;
        let group = &tree.objects[index];
        Parameters::new(group).finish()?;
        let mut shapes = Vec::new();
        for child in tree.children(group, &["shape"])? {
            let shape = &tree.objects[child];
            if matches!(shape.kind.as_str(), "shapegroup" | "instance") {
                let message =
                    "a shape group cannot contain groups or instances; place them in the scene";
                return Err(error(&shape.at, message));
            }
            for inner in tree.children(shape, &["bsdf", "emitter", "medium"])? {
                let inner = &tree.objects[inner];
                if inner.tag == "emitter" {
                    let message = "shapes of a shape group cannot emit; place them in the scene";
                    return Err(error(&inner.at, message));
                }
            }
            let made = self.shapes(shape)?;
            if made.iter().any(|object| object.motion.is_some()) {
                let message = "shapes of a shape group cannot have a motion; move the <animation> \
                               to the instances";
                return Err(error(&shape.at, message));
            }
            shapes.extend(made);
        }
        let shapes: Rc<[_]> = shapes.into();
        self.groups.insert(index, Rc::clone(&shapes));
        Ok(shapes)
    }

    /// Checks that `more` objects do not exceed the limit of the scene.
    pub(super) fn require_room(
        &self,
        object: &MitsubaObject,
        more: usize,
    ) -> Result<(), LoadError> {
        let most = self.tree.context.limits().shapes(MAX_OBJECTS);
        if self.scene.objects.len() + more <= most {
            return Ok(());
        }
        let message = format!("the number of shapes exceeds {most} with this {}", object.kind);
        Err(LoadContext::exceeded(object.at.clone(), message))
    }

    /// Adds an instance of the shapes of a group. Their meshes are shared.
    pub(super) fn instance(&mut self, instance: &MitsubaObject) -> Result<(), LoadError> {
        let tree = self.tree;
        let mut parameters = Parameters::new(instance);
        let (to_world, motion) = parameters.placement("to_world")?;
        let motion = motion.map(Arc::new);
        let children = tree.children(instance, &["shape"])?;
        let [group] = children.as_slice() else {
            let count = children.len();
            let message = format!("expected one <ref> to a shape group, found {count}");
            return Err(error(&instance.at, message));
        };
        if tree.objects[*group].kind != "shapegroup" {
            let kind = tree.objects[*group].describe();
            let message = format!("expected a <ref> to a shape group, found a {kind}");
            return Err(error(&instance.at, message));
        }
        let shapes = self.group(*group)?;
        self.require_room(instance, shapes.len())?;
        for shape in shapes.iter() {
            let placed = to_world * shape.to_world;
            if !placed.inverse().is_finite() {
                let message = "found a \"to_world\" that flattens a shape of the group, expected \
                               an invertible transform";
                return Err(parameters.refuse("to_world", message));
            }
            self.scene.objects.push(pt_scene::Object {
                name: format!("{} of {}", shape.name, instance.name()),
                to_world: placed,
                motion: motion.clone(),
                at: instance.at.clone(),
                ..shape.clone()
            });
        }
        parameters.finish()
    }
}
