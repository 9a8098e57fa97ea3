//! Names of primitives, lights and media of a compiled scene in the scene that it was compiled
//! from.

use pt_core::RenderScene;
use pt_core::light::{AnyLight, LightSourceId};
use pt_scene::{Geometry, Object, Scene};

use super::{LightRef, SampledLight};

/// Lookup of names.
#[derive(Clone, Copy)]
pub struct NameLookup<'a> {
    scene: &'a Scene,
    compiled: &'a RenderScene,
}

/// Item of a scene, by its names there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneItem {
    /// Kind: `triangle`, `sphere`, or the kind of a light.
    pub kind: &'static str,
    /// Object, by its name or by its line in the file, or the name of a light; `None` if the item
    /// is not in the scene.
    pub object: Option<String>,
    /// Name of the material of the object, or `None` if it has none.
    pub material: Option<String>,
}

impl<'a> NameLookup<'a> {
    /// Creates the lookup for a scene and its compiled form.
    pub fn new(scene: &'a Scene, compiled: &'a RenderScene) -> Self {
        Self { scene, compiled }
    }

    /// Returns the kind, object and material of a primitive.
    pub fn primitive(&self, primitive: u32) -> SceneItem {
        let place = self.compiled.locate_primitive(primitive);
        let object = self.scene.objects.get(place.object as usize);
        SceneItem {
            kind: if place.is_sphere { "sphere" } else { "triangle" },
            object: name_of(&self.scene.objects, place.object),
            material: object.and_then(|object| self.material(object, place.index)),
        }
    }

    /// Returns the name of a medium, which is empty if it has none.
    pub fn medium(&self, number: u32) -> &str {
        self.scene.media.get(number as usize).map_or("", |medium| &medium.name)
    }

    /// Returns the kind and name of a sampled light.
    pub fn light(&self, sampled: &SampledLight) -> SceneItem {
        let unknown = SceneItem { kind: "moving light", object: None, material: None };
        let LightRef::Static(number) = sampled.light else { return unknown };
        let Some(light) = self.compiled.lights.as_slice().get(number) else { return unknown };
        let chosen = sampled.chosen.map(|chosen| chosen.number);
        let origin = match (light.tree(&self.compiled.light_tables), chosen) {
            (Some(tree), Some(chosen)) => tree.primitive(chosen),
            _ => self.first_primitive(number),
        };
        let origin = match origin {
            Some(primitive) => Some(self.compiled.source_of_primitive(primitive)),
            None => self.origin(number, chosen),
        };
        let object = origin.and_then(|origin| match origin {
            LightSourceId::Object(number) => name_of(&self.scene.objects, number),
            LightSourceId::Node(number) => {
                let light = self.scene.lights.get(number as usize);
                light.map(|light| light.name.clone()).filter(|name| !name.is_empty())
            }
            LightSourceId::Sky(_) | LightSourceId::Medium(_) => None,
        });
        SceneItem { kind: AnyLight::name(light), object, material: None }
    }

    /// Source of a light without a shape, or of the chosen one of several.
    fn origin(&self, light: usize, chosen: Option<u32>) -> Option<LightSourceId> {
        let origins = self.compiled.light_source_ids();
        origins.get(light)?.get(chosen.unwrap_or(0) as usize).copied()
    }

    /// First primitive whose surface emits a light, or `None` if there is none.
    fn first_primitive(&self, light: usize) -> Option<u32> {
        let is_of = |surface: &pt_core::id::Id<_>| {
            self.compiled.surfaces[*surface].light.is_some_and(|id| id.index() == light)
        };
        let surfaces = &self.compiled.shapes.primitive_surface;
        surfaces.iter().position(is_of).map(|primitive| primitive as u32)
    }

    /// Name of the material of a triangle of an object, or of a sphere.
    fn material(&self, object: &Object, triangle: u32) -> Option<String> {
        let parts = match &object.geometry {
            Geometry::Mesh(mesh) => &mesh.submeshes[..],
            Geometry::Sphere { .. } | Geometry::Points { .. } => &[],
        };
        let part = parts.iter().find(|part| part.triangles.contains(&triangle));
        let slot = part.map_or(0, |part| part.slot);
        let number = object.materials.get(slot as usize).copied().flatten()?;
        let material = self.scene.materials.get(number as usize)?;
        (!material.name.is_empty()).then(|| material.name.clone())
    }
}

/// Name of an object, or its line in the file if it has no name or others have the same.
fn name_of(objects: &[Object], number: u32) -> Option<String> {
    let object = objects.get(number as usize)?;
    let namesakes = objects.iter().filter(|other| other.name == object.name).take(2).count();
    Some(title(object, number as usize, namesakes == 1))
}

/// Name of an object if that is unique; otherwise with its line in the file, or else with its
/// number.
pub(crate) fn title(object: &Object, number: usize, is_alone: bool) -> String {
    let Object { name, at, .. } = object;
    let line = match at.file.file_name() {
        Some(file) if at.line > 0 => Some(format!("{}:{}", file.display(), at.line)),
        _ => None,
    };
    match line {
        _ if !name.is_empty() && is_alone => name.clone(),
        Some(line) if name.is_empty() => line,
        Some(line) => format!("{name} {line}"),
        None => format!("{name} {number}").trim_start().to_owned(),
    }
}
