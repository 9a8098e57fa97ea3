//! Converts objects to a scene.

use std::collections::HashMap;
use std::rc::Rc;

use pt_scene::material::{Black, Diffuse};
use pt_scene::{Color, Material, Scene, framing};

use super::bsdf::{Scattering, scattering};
use super::daylight::see_spans;
use super::medium::MitsubaMediumCache;
use super::meter::{MeterSphere, is_aimed};
use super::object::{MitsubaObject, ObjectTree, Parameters, error};
use super::seat::Seat;
use super::shape::{MitsubaMeshCache, MitsubaShape, shape};
use super::texture::{self, MitsubaTextureCache};
use super::{ellipsoids, emitter, integrator, sensor};
use crate::LoadError;
use crate::shared::{cameras, placeholder};

/// Builds the scene of a tree.
pub(super) fn build(tree: &ObjectTree) -> Result<Scene, LoadError> {
    let root = &tree.objects[0];
    if let Some(stray) = root.parameters.first() {
        return Err(error(
            &stray.at,
            "found a parameter of the scene, expected parameters inside of objects",
        ));
    }
    tree.context.expect_pictures(texture::pictures(tree));
    let mut builder = SceneBuilder {
        tree,
        scene: Scene { warnings: tree.warnings.clone(), ..Scene::default() },
        materials: HashMap::new(),
        textures: MitsubaTextureCache::new(tree),
        media: MitsubaMediumCache::new(tree),
        meshes: MitsubaMeshCache::default(),
        groups: HashMap::new(),
    };
    let mut sensors = Vec::new();
    let mut integrators = Vec::new();
    for child in &root.children {
        let Some(index) = tree.context.ok_or_report(tree.target(child))? else { continue };
        let object = &tree.objects[index];
        match object.tag.as_str() {
            "sensor" => {
                let seats = tree.context.ok_or_report(sensor::seats(tree, object))?;
                sensors.extend(seats.into_iter().flatten());
            }
            "integrator" => integrators.push(index),
            _ => {
                let first = builder.scene.objects.len();
                let done = builder.item(index);
                tree.context.ok_or_report(done)?;
                let attached = attached(tree, object, &builder.scene.objects[first..]);
                sensors.extend(tree.context.ok_or_report(attached)?.flatten());
            }
        }
    }
    for seat in sensors.iter_mut().filter(|seat| is_aimed(seat.object)) {
        let aimed = builder.aim(seat);
        tree.context.ok_or_report(aimed)?;
    }
    let used = used_sensor(tree, &sensors);
    let is_far = sensors.iter().any(|seat| is_aimed(seat.object));
    let around = if is_far { sphere_around(&builder.scene) } else { MeterSphere::default() };
    let Scene { cameras, used_camera, settings, settings_of_camera, warnings, lights, .. } =
        &mut builder.scene;
    if let Some(used) = sensors.get(used) {
        *settings = tree.context.ok_or_report(sensor::settings(tree, used))?.unwrap_or_default();
        let is_other = |seat| sensor::settings(tree, seat).ok().as_ref() != Some(&*settings);
        *settings_of_camera = sensors.iter().any(is_other);
    }
    for seat in &sensors {
        let camera = sensor::camera(tree, seat, &mut builder.media, around);
        cameras.extend(tree.context.ok_or_report(camera)?);
    }
    cameras::open_shutters(cameras, tree.context.options().time);
    *used_camera = (sensors.len() > 1).then_some(used as u32);
    see_spans(lights, cameras.get(used).map_or([0.0; 2], |camera| camera.shutter));
    let outermost = tree.only(&integrators, "integrator");
    let outermost = tree.context.ok_or_report(outermost)?.flatten().map(|i| &tree.objects[i]);
    settings.sides_by_shading_normal = true;
    tree.context.ok_or_report(integrator::integrator(tree, outermost, settings, warnings))?;
    let MitsubaMediumCache { made, warnings, .. } = builder.media;
    builder.scene.media = made.into();
    builder.scene.warnings.extend(warnings);
    integrator::fill_holes(&mut builder.scene);
    Ok(builder.scene)
}

/// Returns the circumscribed sphere of the bounding box of all surfaces.
fn sphere_around(scene: &Scene) -> MeterSphere {
    let [low, high] = framing::surface_extent(scene, None).unwrap_or_default();
    MeterSphere { center: 0.5 * (low + high), radius: 0.5 * (high - low).length() }
}

/// Returns the only nested object with a tag, if there is one.
fn inside(
    tree: &ObjectTree,
    object: &MitsubaObject,
    tag: &str,
) -> Result<Option<usize>, LoadError> {
    let children = object.children.iter().map(|child| tree.target(child));
    tree.only(&children.collect::<Result<Vec<_>, _>>()?, tag)
}

/// Returns the sensor inside of a shape, if there is one.
fn attached<'t>(
    tree: &'t ObjectTree,
    object: &'t MitsubaObject,
    made: &[pt_scene::Object],
) -> Result<Option<Seat<'t>>, LoadError> {
    if object.tag != "shape" {
        return Ok(None);
    }
    let Some(sensor) = inside(tree, object, "sensor")? else { return Ok(None) };
    let surface = match made {
        [one] if one.motion.is_none() => Some((one.geometry.clone(), one.to_world)),
        _ => None,
    };
    Ok(Some(Seat::alone(&tree.objects[sensor]).at(surface)))
}

/// Returns the index of the sensor that is used: the requested one, or the first.
fn used_sensor(tree: &ObjectTree, sensors: &[Seat<'_>]) -> usize {
    let names: Vec<_> = sensors.iter().map(|seat| seat.object.name()).collect();
    let wanted = tree.context.options().camera.as_ref();
    // A requested sensor that does not exist is reported after the whole scene is read.
    wanted.and_then(|wanted| cameras::find(wanted, &names).ok()).unwrap_or(0)
}

/// Indices of the bsdf and the area emitter of a material.
type BsdfEmitterKey = (Option<usize>, Option<usize>);

/// State of the conversion.
pub(super) struct SceneBuilder<'t> {
    pub(super) tree: &'t ObjectTree,
    pub(super) scene: Scene,
    /// Materials by bsdf and area emitter.
    materials: HashMap<BsdfEmitterKey, u32>,
    textures: MitsubaTextureCache<'t>,
    media: MitsubaMediumCache<'t>,
    meshes: MitsubaMeshCache,
    /// Contents of shape groups, by object index.
    pub(super) groups: HashMap<usize, Rc<[pt_scene::Object]>>,
}

impl SceneBuilder<'_> {
    /// Reads an item of the scene other than sensors and integrators.
    fn item(&mut self, index: usize) -> Result<(), LoadError> {
        let object = &self.tree.objects[index];
        match object.tag.as_str() {
            "shape" => self.place(index)?,
            // Area emitters may be described here and referred to by shapes.
            "emitter" if object.kind == "area" && !object.id.is_empty() => {}
            "emitter" => self.scene.lights.push(emitter::light(&mut self.textures, object)?),
            // These are read where they are referenced.
            "bsdf" | "film" | "medium" | "phase" | "rfilter" | "sampler" | "texture" | "volume" => {
            }
            tag => return Err(error(&object.at, format!("unsupported <{tag}>"))),
        }
        Ok(())
    }

    /// Sets the target shape of a sensor, which need not be part of the scene.
    fn aim(&mut self, seat: &mut Seat<'_>) -> Result<(), LoadError> {
        let tree = self.tree;
        let Some(target) = inside(tree, seat.object, "shape")? else { return Ok(()) };
        let target = &tree.objects[target];
        let MitsubaShape { geometry, to_world, motion } =
            shape(tree, target, &mut self.meshes, &mut self.scene.warnings)?;
        if motion.is_some() {
            let message = "found a moving target shape of a sensor, expected a static one";
            return Err(error(&target.at, message));
        }
        seat.surface = Some((geometry, to_world));
        Ok(())
    }

    /// Adds a shape, or the shapes of a group or instance, to the scene.
    fn place(&mut self, index: usize) -> Result<(), LoadError> {
        let object = &self.tree.objects[index];
        match object.kind.as_str() {
            // Not visible itself, but its errors are reported.
            "shapegroup" => drop(self.group(index)?),
            "instance" => self.instance(object)?,
            "merge" => {
                Parameters::new(object).finish()?;
                for shape in self.tree.children(object, &["shape"])? {
                    if let Some(sensor) = inside(self.tree, &self.tree.objects[shape], "sensor")? {
                        let message = "sensor inside of a \"merge\", expected outside";
                        return Err(error(&self.tree.objects[sensor].at, message));
                    }
                    let placed = self.place(shape);
                    self.tree.context.ok_or_report(placed)?;
                }
            }
            _ => {
                let placed = self.shapes(object)?;
                self.scene.objects.extend(placed);
            }
        }
        Ok(())
    }

    /// Reads a shape, or several in the case of ellipsoids, with their material.
    pub(super) fn shapes(
        &mut self,
        object: &MitsubaObject,
    ) -> Result<Vec<pt_scene::Object>, LoadError> {
        let tree = self.tree;
        let shapes = if ellipsoids::KINDS.contains(&object.kind.as_str()) {
            let made =
                ellipsoids::shapes(tree, object, &mut self.meshes, &mut self.scene.warnings)?;
            self.require_room(object, made.len())?;
            made
        } else {
            vec![shape(tree, object, &mut self.meshes, &mut self.scene.warnings)?]
        };
        let has_shell = object.kind == "ellipsoidsmesh";
        let supported = ["bsdf", "emitter", "medium", "sensor", "shape"];
        let children = tree.children(object, &supported[..if has_shell { 5 } else { 4 }])?;
        let bsdf = tree.only(&children, "bsdf")?;
        let emitter = tree.only(&children, "emitter")?;
        let material = self.material(object, (bsdf, emitter))?;
        let media = self.media.sides(object)?;
        let object = |MitsubaShape { geometry, to_world, motion }| pt_scene::Object {
            name: object.name().to_owned(),
            to_world,
            motion,
            geometry,
            materials: vec![Some(material)],
            media,
            at: object.at.clone(),
        };
        Ok(shapes.into_iter().map(object).collect())
    }

    /// Returns the index of a material, which is added if it is new. Without a bsdf it is grey on
    /// the front, or black if it emits.
    fn material(&mut self, shape: &MitsubaObject, key: BsdfEmitterKey) -> Result<u32, LoadError> {
        if let Some(index) = self.materials.get(&key) {
            return Ok(*index);
        }
        let tree = self.tree;
        let (bsdf, emitter) = key;
        let emission = emitter.map(|i| emitter::area(&mut self.textures, &tree.objects[i]));
        let emission = emission.transpose()?;
        tree.context.take_placeholder_used(); // a placeholder emission is visible as is
        let opaque = |surface| Scattering { surface, opacity: 1.0.into() };
        let (name, what) = match bsdf.map(|i| &tree.objects[i]) {
            Some(bsdf) => (bsdf.name(), scattering(&mut self.textures, bsdf)?),
            None if emission.is_some() => (shape.name(), opaque(Black.into())),
            None => {
                let matte = Diffuse { reflectance: [0.5; 3].into(), two_sided: false };
                ("default", opaque(matte.into()))
            }
        };
        let Scattering { mut surface, opacity } = what;
        if tree.context.take_placeholder_used() {
            surface = placeholder::surface();
        }
        let emission = emission.unwrap_or(Color::Value([0.0; 3]));
        let material =
            Material { name: name.to_owned(), surface, emission, hidden_emission: false, opacity };
        let index = self.scene.materials.len() as u32;
        self.scene.materials.push(material);
        self.materials.insert(key, index);
        Ok(index)
    }
}
