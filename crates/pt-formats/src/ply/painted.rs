//! Images on faces, as written by MeshLab: a `comment TextureFile NAME` for each image, and for
//! each face the list `texcoord` with two numbers per corner, and the index `texnumber` of its
//! image.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use ply_rs_bw::ply::Comment;
use pt_image::{PixelEncoding, Transfer};
use pt_scene::material::Diffuse;
use pt_scene::texture::{Bitmap, Filter, Input, Pattern, Texture, Wrap};
use pt_scene::{Attribute, Material, Mesh, Scene, Submesh, Surface, Warning};

use crate::shared::context::LoadContext;
use crate::shared::mesh_file::{folder_of, locate, place};
use crate::shared::names::quote;
use crate::shared::{mesh_file, placeholder};

/// References of a file to images.
#[derive(Default)]
pub(super) struct Painted {
    /// File names of the images.
    pub(super) files: Vec<String>,
    /// Texture coordinates at the corners of each triangle.
    pub(super) uvs: Option<Vec<[[f32; 2]; 3]>>,
    /// Index of the image of each triangle; triangles with an invalid index have none.
    pub(super) images: Option<Vec<i64>>,
}

/// Returns the image files in the comments of a header.
pub(super) fn files(comments: &[Comment]) -> Vec<String> {
    let file = |comment: &Comment| {
        let (word, name) = comment.trim().split_once(char::is_whitespace)?;
        word.eq_ignore_ascii_case("TextureFile").then(|| name.trim().to_owned())
    };
    comments.iter().filter_map(file).collect()
}

impl Painted {
    /// Adds the texture coordinates of the faces to a mesh, and a slot for each of its images.
    /// Returns the indices of the images of the slots.
    pub(super) fn lay(&mut self, mesh: &mut Mesh) -> Vec<i64> {
        let count = mesh.triangles.len();
        if let Some(uvs) = self.uvs.take().filter(|uvs| uvs.len() == count) {
            let indices = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            mesh.uvs = Some(Attribute {
                values: uvs.as_flattened().to_vec().into(),
                indices: Some(indices),
            });
        }
        let images = self.images.take().filter(|images| images.len() == count);
        let Some(images) = images.filter(|_| !self.files.is_empty()) else { return vec![0] };
        let (mut slots, mut numbers) = (Vec::new(), HashMap::new());
        let mut parts: Vec<Submesh> = Vec::new();
        for (image, end) in images.into_iter().zip(1_u32..) {
            let slot = *numbers.entry(image).or_insert_with(|| {
                slots.push(image);
                slots.len() as u32 - 1
            });
            match parts.last_mut() {
                Some(part) if part.slot == slot => part.triangles.end = end,
                _ => parts.push(Submesh { triangles: end - 1..end, slot }),
            }
        }
        mesh.submeshes = parts;
        slots
    }

    /// Assigns the images of the slots to the only object of a scene.
    pub(super) fn dress(
        &self,
        scene: &mut Scene,
        slots: &[i64],
        path: &Path,
        context: &LoadContext,
    ) {
        let Some(first) = self.files.first() else { return };
        let object = &scene.objects[0];
        let has_uvs =
            matches!(&object.geometry, pt_scene::Geometry::Mesh(mesh) if mesh.uvs.is_some());
        if !has_uvs {
            let message =
                format!("missing texture coordinates for {}; it is not shown", quote(first));
            scene.warnings.push(Warning { at: place(path, 0), message });
            return;
        }
        let bare = object.materials.first().copied().flatten();
        let mut materials = Vec::with_capacity(slots.len());
        for slot in slots {
            let file = usize::try_from(*slot).ok().and_then(|number| self.files.get(number));
            materials.push(file.map_or(bare, |file| {
                scene.materials.push(shown(file, path, context));
                Some(scene.materials.len() as u32 - 1)
            }));
        }
        scene.objects[0].materials = materials;
    }
}

/// Returns a diffuse material with an image.
fn shown(file: &str, path: &Path, context: &LoadContext) -> Material {
    let image =
        context.picture(&locate(&folder_of(path), file), PixelEncoding::Light(Transfer::Srgb));
    let surface: Surface = match image {
        Ok(decoded) => {
            let image = Arc::new(decoded.image);
            let bitmap = Bitmap { image, wrap: Wrap::REPEAT, filter: Filter::Trilinear };
            let texture = Arc::new(Texture::from(Pattern::Bitmap(bitmap)));
            Diffuse { reflectance: Input::Texture(texture), two_sided: true }.into()
        }
        Err(why) => {
            let message = format!("the image is not shown: {why}; {}", placeholder::INSTEAD);
            context.missing(place(path, 0), message);
            placeholder::surface()
        }
    };
    Material {
        name: mesh_file::name_of(Path::new(file)),
        surface,
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    }
}
