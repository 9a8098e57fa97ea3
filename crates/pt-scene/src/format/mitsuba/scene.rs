//! Objects to a scene.

use std::collections::HashMap;

use super::bsdf::{on_both_sides, surface};
use super::object::{Object, Tree, error};
use super::shape::{Meshes, Shape, shape};
use super::{emitter, sensor};
use crate::material::{Black, CoatedDiffuse, Conductor, Matte};
use crate::{LoadError, Material, Scene, Surface, Warning};

/// The scene that a tree describes.
pub(super) fn build(tree: &Tree) -> Result<Scene, LoadError> {
    let root = &tree.objects[0];
    if let Some(stray) = root.parameters.first() {
        return Err(error(&stray.at, "a scene has no parameters; it belongs into an object"));
    }
    let mut builder = Builder {
        tree,
        scene: Scene { warnings: tree.warnings.clone(), ..Scene::default() },
        materials: HashMap::new(),
        meshes: Meshes::default(),
    };
    let mut sensors = Vec::new();
    let mut integrators = Vec::new();
    for child in &root.children {
        let index = tree.target(child)?;
        let object = &tree.objects[index];
        match object.tag.as_str() {
            "shape" => builder.shape(object)?,
            // Area emitters may be described here and referred to by shapes.
            "emitter" if object.kind == "area" && !object.id.is_empty() => {}
            "emitter" => builder.scene.lights.push(emitter::light(tree, object)?),
            "sensor" => sensors.push(object),
            "integrator" => integrators.push(index),
            // What these describe is read where it is referred to.
            "bsdf" | "film" | "rfilter" | "sampler" | "spectrum" | "texture" => {}
            tag => {
                return Err(error(&object.at, format!("<{tag}> is not supported")));
            }
        }
    }
    let Scene { cameras, settings, warnings, .. } = &mut builder.scene;
    if let Some(first) = sensors.first() {
        *settings = sensor::settings(tree, first)?;
    }
    for object in sensors.into_iter().rev() {
        cameras.push(sensor::camera(tree, object)?);
    }
    let integrator = tree.only(&integrators, "integrator")?.map(|i| &tree.objects[i]);
    settings.max_depth = Some(sensor::max_depth(tree, integrator, warnings)?);
    Ok(builder.scene)
}

/// What a material is made of: a bsdf, an area emitter, and whether it is on an inverted sphere.
type MaterialKey = (Option<usize>, Option<usize>, bool);

struct Builder<'t> {
    tree: &'t Tree,
    scene: Scene,
    /// Materials of the scene by what they are made of.
    materials: HashMap<MaterialKey, u32>,
    meshes: Meshes,
}

impl Builder<'_> {
    /// Adds a shape with its material.
    fn shape(&mut self, object: &Object) -> Result<(), LoadError> {
        let Shape { geometry, to_world, is_inverted_sphere } =
            shape(self.tree, object, &mut self.meshes, &mut self.scene.warnings)?;
        let children = self.tree.children(object, &["bsdf", "emitter"])?;
        let bsdf = self.tree.only(&children, "bsdf")?;
        let emitter = self.tree.only(&children, "emitter")?;
        let material = self.material(object, (bsdf, emitter, is_inverted_sphere))?;
        self.scene.objects.push(crate::Object {
            name: object.name().to_owned(),
            to_world,
            geometry,
            materials: vec![Some(material)],
            at: object.at.clone(),
        });
        Ok(())
    }

    /// The index of a material, which is added if it is new. Without a bsdf it is grey on the
    /// front, or black if it emits.
    fn material(&mut self, shape: &Object, key: MaterialKey) -> Result<u32, LoadError> {
        if let Some(index) = self.materials.get(&key) {
            return Ok(*index);
        }
        let tree = self.tree;
        let (bsdf, emitter, is_inverted) = key;
        let emission = emitter.map(|i| emitter::area(tree, &tree.objects[i])).transpose()?;
        let (name, mut surface) = match bsdf.map(|i| &tree.objects[i]) {
            Some(bsdf) => (bsdf.name(), surface(tree, bsdf)?),
            None if emission.is_some() => (shape.name(), Black.into()),
            None => ("default", Matte { reflectance: [0.5; 3], two_sided: false }.into()),
        };
        if is_inverted {
            if let Some(emitter) = emitter {
                let message = "a sphere that emits towards its inside is not supported; use a mesh";
                return Err(error(&tree.objects[emitter].at, message));
            }
            surface = self.invert(shape, surface);
        }
        let material =
            Material { name: name.to_owned(), surface, emission: emission.unwrap_or_default() };
        let index = self.scene.materials.len() as u32;
        self.scene.materials.push(material);
        self.materials.insert(key, index);
        Ok(index)
    }

    /// A surface whose front is on the inside of a sphere, as far as that can be said.
    fn invert(&mut self, shape: &Object, surface: Surface) -> Surface {
        match surface {
            Surface::Glass(mut glass) => {
                glass.ior = glass.ior.recip();
                glass.into()
            }
            Surface::Matte(Matte { two_sided: false, .. })
            | Surface::CoatedDiffuse(CoatedDiffuse { two_sided: false, .. })
            | Surface::Conductor(Conductor { two_sided: false, .. }) => {
                let message = "a sphere whose front is inside cannot be described; both its sides \
                               reflect";
                self.scene
                    .warnings
                    .push(Warning { at: shape.at.clone(), message: message.to_owned() });
                on_both_sides(surface)
            }
            other => other,
        }
    }
}
