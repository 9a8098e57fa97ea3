//! Writer of scenes as binary glTF files.
//!
//! ```text
//! Scene ─┬▶ mesh ───────────────────────────────────────┬▶ binary ─▶ container ─▶ bytes
//!        ├▶ material ─▶ approximate ─▶ layer ─▶ image ──┘
//!        └▶ camera (cameras, lights)                     ▶ notes
//! ```
//!
//! Content of a file that our reader supports is written so that it is read back unchanged. Content
//! that glTF does not support is approximated or omitted, with a note.

mod approximate;
mod binary;
mod camera;
mod exact;
mod extension;
mod image;
mod layer;
mod material;
mod mesh;
mod notes;
mod points;
mod trs;

use std::collections::{BTreeSet, HashMap};
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;

use binary::BinaryBuffer;
use image::ImageTables;
use material::Worn;
use mesh::{MeshPartsKey, PrimitiveCache};
use notes::WriteNotes;
use pt_math::{DAffine3, DVec3};
use pt_scene::{Geometry, Hidden, Mesh, Object, RenderHints, Scene, Submesh, shapes};
use serde_json::{Map, Value, json};

use super::super::encoded::Encoded;

/// Encodes a scene as a file.
///
/// # Errors
/// If numbers are not finite, indices are out of range, or the file would exceed 4 GiB.
pub(crate) fn encode(scene: &Scene, _path: &Path) -> Result<Encoded, String> {
    let mut writer = GltfWriter::new(scene);
    writer.cameras()?;
    writer.lights()?;
    for object in &scene.objects {
        writer.object(object).map_err(|message| format!("{}: {message}", object.at))?;
    }
    writer.settings(&scene.settings);
    writer.finish()
}

/// State of the writer of a file.
struct GltfWriter<'a> {
    scene: &'a Scene,
    /// Metres per unit of the scene; lengths of glTF are metres.
    metres: f64,
    binary: BinaryBuffer,
    images: ImageTables,
    notes: WriteNotes,
    /// Extensions that are used.
    extensions: BTreeSet<&'static str>,
    materials: Vec<Value>,
    /// Written materials by material and interior medium of the scene.
    worn: HashMap<(Option<u32>, Option<u32>), Worn>,
    meshes: Vec<Value>,
    /// Indices of written meshes; `None` if they have no triangles.
    known_meshes: HashMap<MeshPartsKey, Option<usize>>,
    /// Meshes of points and lines by address and material.
    known_points: HashMap<(usize, Option<usize>), usize>,
    primitives: PrimitiveCache,
    /// Mesh of a unit sphere, created on first use.
    sphere: Option<Arc<Mesh>>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    nodes: Vec<Value>,
    /// Nodes without a parent.
    roots: Vec<usize>,
}

impl<'a> GltfWriter<'a> {
    fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            metres: scene.metres_per_unit,
            binary: BinaryBuffer::default(),
            images: ImageTables::default(),
            notes: WriteNotes::default(),
            extensions: BTreeSet::new(),
            materials: Vec::new(),
            worn: HashMap::new(),
            meshes: Vec::new(),
            known_meshes: HashMap::new(),
            known_points: HashMap::new(),
            primitives: HashMap::new(),
            sphere: None,
            cameras: Vec::new(),
            lights: Vec::new(),
            nodes: Vec::new(),
            roots: Vec::new(),
        }
    }

    /// Writes an object with its materials.
    fn object(&mut self, object: &Object) -> Result<(), String> {
        let media = object.media.unwrap_or_default();
        if media.exterior.is_some() {
            self.notes.note(&object.at, "the medium outside of the scene is omitted");
        }
        let used: Vec<usize> = match &object.geometry {
            Geometry::Sphere { .. } | Geometry::Points { .. } => vec![0],
            Geometry::Mesh(mesh) => mesh.submeshes.iter().map(|part| part.slot as usize).collect(),
        };
        let slots = used.iter().max().map_or(0, |last| last + 1);
        let mut worn: Vec<Option<Worn>> = vec![None; slots];
        for slot in used {
            let material = self.unmirrored(object, slot);
            worn[slot] = Some(self.material(material, media.interior)?);
        }
        // Parts refer only to slots that exist.
        let first = worn.iter().flatten().next().copied();
        let worn: Vec<_> = worn.into_iter().filter_map(|worn| worn.or(first)).collect();
        self.dressed(object, &worn)
    }

    /// Returns the material of a slot. If the second slot has the mirrored variant of the first
    /// one, that is the material of the first slot.
    fn unmirrored(&self, object: &Object, slot: usize) -> Option<u32> {
        let material = object.materials.get(slot).copied().flatten();
        let known = |index: Option<u32>| self.scene.materials.get(index? as usize);
        let first = object.materials.first().copied().flatten();
        match (slot, known(material), known(first)) {
            (1, Some(second), Some(original)) if material::is_mirrored(second, original) => first,
            _ => material,
        }
    }

    /// Writes an object whose slots have these materials.
    fn dressed(&mut self, object: &Object, worn: &[Worn]) -> Result<(), String> {
        let mut to_world = object.to_world;
        if let Some(motion) = &object.motion {
            let opens = self.scene.camera().map_or(0.0, |camera| camera.shutter[0]);
            self.notes.note(
                &object.at,
                "the motion is omitted; the pose when the shutter opens is written",
            );
            to_world = motion.at(opens) * to_world;
        }
        let mesh = match &object.geometry {
            Geometry::Mesh(mesh) => Arc::clone(mesh),
            Geometry::Points { points, radius } => {
                if radius.is_some() {
                    self.notes.note(
                        &object.at,
                        "the radius of points and lines is not representable in glTF; it is \
                         omitted",
                    );
                }
                let shown = self.points(points, worn.first().map(|worn| worn.index))?;
                return self.node(&object.name, self.in_metres(to_world), shown, &object.at);
            }
            Geometry::Sphere { radius } => {
                self.notes.note(&object.at, "the sphere becomes triangles");
                to_world *= DAffine3::from_scale(DVec3::splat(radius.abs()));
                let sphere = self.sphere.get_or_insert_with(|| Arc::new(shapes::sphere()));
                let mut sphere = Arc::clone(sphere);
                if *radius < 0.0 {
                    shapes::flip(Arc::make_mut(&mut sphere));
                }
                sphere
            }
        };
        let parts: Vec<(Submesh, Worn)> = match worn {
            // Readers find the mirrored triangles themselves.
            [first, second] if first.index == second.index => {
                vec![(Submesh { triangles: 0..mesh.triangles.len() as u32, slot: 0 }, *first)]
            }
            _ => {
                let dress = |part: &Submesh| (part.clone(), worn[part.slot as usize]);
                let parts: Vec<_> = mesh.submeshes.iter().map(dress).collect();
                let leans = |(part, worn): &(Submesh, Worn)| {
                    worn.has_relief && mesh::is_mirrored_somewhere(&mesh, part)
                };
                if parts.iter().any(leans) {
                    let note = "normals are mirrored where the texture coordinates are mirrored";
                    self.notes.note(&object.at, note);
                }
                parts
            }
        };
        let Some(index) = self.mesh(&mesh, &parts)? else {
            self.notes.note(&object.at, "mesh without triangles; it is omitted");
            return Ok(());
        };
        let shown = Map::from_iter([("mesh".to_owned(), index.into())]);
        self.node(&object.name, self.in_metres(to_world), shown, &object.at)
    }

    /// Adds a node with the fields `shown`.
    fn node(
        &mut self,
        name: &str,
        to_world: DAffine3,
        shown: Map<String, Value>,
        place: impl Display,
    ) -> Result<(), String> {
        if !to_world.is_finite() {
            return Err(format!("{place}: found a transform that is not finite"));
        }
        let trs::Place { parent, mut node } = trs::place(to_world);
        node.extend(shown);
        if !name.is_empty() {
            node.insert("name".to_owned(), name.into());
        }
        self.nodes.push(Value::Object(node));
        let mut root = self.nodes.len() - 1;
        if let Some(mut parent) = parent {
            parent.insert("children".to_owned(), json!([root]));
            self.nodes.push(Value::Object(parent));
            root += 1;
        }
        self.roots.push(root);
        Ok(())
    }

    /// Converts a transform from scene units to metres.
    fn in_metres(&self, to_world: DAffine3) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(self.metres)) * to_world
    }

    /// Reports render settings that are omitted.
    fn settings(&mut self, settings: &RenderHints) {
        let asked = [
            (settings.resolution.is_some(), "image size"),
            (settings.crop.is_some(), "crop window"),
            (settings.spp.is_some(), "samples per pixel"),
            (settings.max_depth.is_some(), "path depth"),
            (settings.integrator.is_some_and(|name| name != "volpath"), "the integrator"),
            (!settings.aovs.is_empty(), "additional channels"),
            (settings.filter.is_some(), "the filter"),
            (settings.hidden != Hidden::Nothing, "visibility of lights"),
        ];
        let lost: Vec<_> = asked.iter().filter(|(is, _)| *is).map(|(_, what)| *what).collect();
        if !lost.is_empty() {
            let note = format!(
                "render settings are not representable in glTF and omitted: {}",
                lost.join(", ")
            );
            self.notes.note("settings", note);
        }
    }

    /// Assembles the file.
    fn finish(mut self) -> Result<Encoded, String> {
        let generator = concat!("pathtracer ", env!("CARGO_PKG_VERSION"));
        let asset = json!({"version": "2.0", "generator": generator});
        let mut shown = Map::new();
        if !self.roots.is_empty() {
            shown.insert("nodes".to_owned(), self.roots.into());
        }
        if !self.scene.name.is_empty() {
            shown.insert("name".to_owned(), self.scene.name.clone().into());
        }
        let mut root = Map::from_iter([
            ("asset".to_owned(), asset),
            ("scene".to_owned(), 0.into()),
            ("scenes".to_owned(), json!([shown])),
        ]);
        if !self.lights.is_empty() {
            let lights = json!({"KHR_lights_punctual": {"lights": self.lights}});
            root.insert("extensions".to_owned(), lights);
        }
        let lists = [
            ("cameras", self.cameras),
            ("materials", self.materials),
            ("meshes", self.meshes),
            ("nodes", std::mem::take(&mut self.nodes)),
        ];
        for (name, list) in lists.into_iter().chain(self.images.lists()) {
            if !list.is_empty() {
                root.insert(name.to_owned(), list.into());
            }
        }
        if !self.extensions.is_empty() {
            let names: Vec<_> = self.extensions.into_iter().collect();
            root.insert("extensionsUsed".to_owned(), names.into());
        }
        let bytes = self.binary.finish(root)?;
        Ok(Encoded { bytes, files: Vec::new(), notes: self.notes.finish() })
    }
}
