//! Assignment of materials to the objects of a file.

use std::collections::HashSet;
use std::path::Path;

use pt_scene::{Geometry, Object, Scene};

use super::library::MaterialLibrary;
use super::material::MaterialConverter;
use super::mtl;
use super::notes::MaterialNotes;
use super::slots::LocatedName;
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::mesh_file::place;
use crate::shared::names::{quote, suggestions};

/// Maximum number of warnings about missing materials.
const MAX_NOT_FOUND: usize = 20;

/// Material references of a file.
pub(super) struct MaterialAssigner<'a> {
    /// Path of the file.
    pub(super) path: &'a Path,
    /// Material name of each slot.
    pub(super) slots: Vec<Option<LocatedName>>,
    /// Number of slots of the mesh; each further slot is that of an object of points and lines.
    pub(super) of_mesh: usize,
    /// Names of the material libraries, as written.
    pub(super) libraries: Vec<LocatedName>,
    pub(super) folder: &'a Folder,
}

impl MaterialAssigner<'_> {
    /// Assigns the materials to the slots of the objects, which have default ones: slots without a
    /// name, or with a name that is not found, keep them.
    ///
    /// # Errors
    /// Returns an error if nothing more can be read.
    pub(super) fn assign(&self, scene: &mut Scene) -> Result<(), LoadError> {
        let mut notes = MaterialNotes::default();
        let library = self.library(&mut notes)?;
        let default = |object: &Object| object.materials.first().copied().flatten();
        let (mesh, clouds) = scene.objects.split_at(usize::from(self.of_mesh > 0));
        let of_mesh = mesh.iter().flat_map(|mesh| vec![default(mesh); self.of_mesh]);
        let defaults: Vec<_> = of_mesh.chain(clouds.iter().map(default)).collect();
        let mut materials = defaults.clone();
        let mut not_found = Vec::new();
        let dressed = self.slots.iter().flatten().filter_map(|n| library.described.get(&n.name));
        self.folder.context.expect_pictures(mtl::pictures(dressed, self.folder));
        let mut maker = MaterialConverter::new(self.folder, &mut notes);
        for (named, slot) in self.slots.iter().zip(&mut materials) {
            let Some(named) = named.as_ref().filter(|named| !named.name.is_empty()) else {
                continue;
            };
            let material = match library.described.get(&named.name) {
                Some(described) => maker.material(&named.name, described)?,
                // The material may be in a missing file, which is reported.
                None if library.is_incomplete => continue,
                None => {
                    not_found.push(named);
                    continue;
                }
            };
            *slot = Some(scene.materials.len() as u32);
            scene.materials.push(material);
        }
        let shows_images = maker.shows_images;
        self.note_not_found(&not_found, &library, &mut notes);
        self.note_left_out(scene, materials != defaults, shows_images, &mut notes);
        let clouds = materials.split_off(self.of_mesh);
        let (mesh, others) = scene.objects.split_at_mut(usize::from(self.of_mesh > 0));
        if let Some(mesh) = mesh.first_mut() {
            mesh.materials = materials;
        }
        for (object, material) in others.iter_mut().zip(clouds) {
            object.materials = vec![material];
        }
        scene.warnings.extend(notes.finish(place(self.path, 0)));
        Ok(())
    }

    /// Reads the material libraries.
    fn library(&self, notes: &mut MaterialNotes) -> Result<MaterialLibrary, LoadError> {
        let names = self.slots.iter().flatten().map(|named| named.name.as_str());
        let wanted: HashSet<&str> = names.collect();
        let mut library = MaterialLibrary::default();
        for named in &self.libraries {
            library.read(named, &wanted, self.folder, self.path, notes)?;
        }
        Ok(library)
    }

    /// Adds warnings about materials that are in no file.
    fn note_not_found(
        &self,
        not_found: &[&LocatedName],
        library: &MaterialLibrary,
        notes: &mut MaterialNotes,
    ) {
        let Some(first) = not_found.first() else { return };
        if self.libraries.is_empty() {
            let message =
                "missing \"mtllib\" with a material library; the default material is used for all";
            return notes.add(place(self.path, first.line), message.to_owned());
        }
        for LocatedName { name, line } in not_found.iter().take(MAX_NOT_FOUND) {
            let near = suggestions(name, library.names.iter().map(String::as_str));
            let hint = near.first().map(|near| format!(" (did you mean {}?)", quote(near)));
            let message = format!(
                "undefined material {}{}; the default material is used",
                quote(name),
                hint.unwrap_or_default()
            );
            notes.add(place(self.path, *line), message);
        }
        if let Some(next) = not_found.get(MAX_NOT_FOUND) {
            let count = not_found.len() - MAX_NOT_FOUND;
            let message = format!("{count} more undefined materials");
            notes.add(place(self.path, next.line), message);
        }
    }

    /// Adds warnings about images and vertex colours that have no effect.
    fn note_left_out(
        &self,
        scene: &Scene,
        is_dressed: bool,
        shows_images: bool,
        notes: &mut MaterialNotes,
    ) {
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { return };
        let whole = place(self.path, 0);
        if shows_images && mesh.uvs.is_none() {
            let message = "materials have images, but the faces have no texture coordinates (\"f \
                           1/1 2/2 3/3\"); each triangle shows half of the image";
            notes.add(whole.clone(), message.to_owned());
        }
        if is_dressed && mesh.colors.is_some() {
            let message = "the colours of vertices are shown only where faces have no material";
            notes.add(whole, message.to_owned());
        }
    }
}
