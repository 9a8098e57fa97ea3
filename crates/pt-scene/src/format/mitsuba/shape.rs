//! `<shape>`: surfaces placed in the world.

use std::path::PathBuf;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3};

use super::super::mesh_file::{self, MeshFile};
use super::super::{obj, ply};
use super::object::{Object, Parameters, Tree, error, unsupported};
use crate::shapes::{self, smooth_normals};
use crate::{Geometry, LoadError, Mesh, Warning};

const KINDS: [&str; 5] = ["cube", "obj", "ply", "rectangle", "sphere"];

/// A shape without its material.
pub(super) struct Shape {
    pub(super) geometry: Geometry,
    pub(super) to_world: DAffine3,
    /// Whether it is a sphere whose front looks inwards.
    pub(super) is_inverted_sphere: bool,
}

/// A mesh file, and what is made of it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct MeshKey {
    path: PathBuf,
    is_flat: bool,
    flips: bool,
    /// Whether its transform mirrors.
    mirrored: bool,
}

/// Meshes that several shapes share.
#[derive(Default)]
pub(super) struct Meshes(std::collections::HashMap<MeshKey, Arc<Mesh>>);

/// The shape that an object describes; its children are left to the caller.
pub(super) fn shape(
    tree: &Tree,
    object: &Object,
    meshes: &mut Meshes,
    warnings: &mut Vec<Warning>,
) -> Result<Shape, LoadError> {
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["silhouette_sampling_weight"]);
    let to_world = parameters.transform("to_world")?;
    let flips = parameters.boolean("flip_normals")?;
    let mesh = |mesh: Arc<Mesh>| Shape {
        geometry: Geometry::Mesh(mesh),
        to_world,
        is_inverted_sphere: false,
    };
    let shape = match object.kind.as_str() {
        "sphere" => sphere(&mut parameters, to_world, flips)?,
        "rectangle" => mesh(turned(shapes::rectangle(), flips)),
        "cube" => mesh(turned(shapes::cube(), flips)),
        kind @ ("ply" | "obj") => {
            parameters.pass_over(&["flip_tex_coords"]);
            let is_flat = parameters.boolean("face_normals")?;
            let Some(text) = parameters.text("filename")? else {
                let message = "the <string name=\"filename\"> is missing";
                return Err(error(&object.at, message));
            };
            let mirrored = to_world.matrix3.determinant() < 0.0;
            let path = tree.resolve(text);
            let path = path.ok_or_else(|| parameters.refuse("filename", tree.not_found(text)))?;
            let parse = if kind == "ply" { ply::parse_mesh } else { obj::parse_mesh };
            let key = MeshKey { path, is_flat, flips, mirrored };
            let bytes = || {
                let bytes = mesh_file::read(&key.path);
                bytes.map_err(|message| parameters.refuse("filename", message))
            };
            mesh(meshes.get(&key, || parse(&bytes()?, &key.path), warnings)?)
        }
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    Ok(shape)
}

/// A mesh with its front on the other side if that is asked for.
fn turned(mut mesh: Mesh, flips: bool) -> Arc<Mesh> {
    if flips {
        shapes::flip(&mut mesh);
    }
    Arc::new(mesh)
}

/// A sphere: the product of its transforms has to keep it one.
fn sphere(
    parameters: &mut Parameters<'_>,
    to_world: DAffine3,
    flips: bool,
) -> Result<Shape, LoadError> {
    const TOLERANCE: f64 = 1e-4; // matrices are written with a few digits
    let center = parameters.vector("center")?.unwrap_or_default();
    let radius = parameters.float("radius")?.unwrap_or(1.0);
    let linear = to_world.matrix3;
    let scale = linear.x_axis.length();
    let error = linear.transpose() * linear - DMat3::from_diagonal([scale * scale; 3].into());
    if error.to_cols_array().iter().any(|x| x.abs() > TOLERANCE * scale * scale) {
        let message = "a sphere has to stay one; expected the same scale in all directions";
        return Err(parameters.refuse("to_world", message));
    }
    let world_radius = radius.abs() * scale;
    if !(world_radius > 0.0 && world_radius.is_finite()) {
        let message = format!("the radius in the world is {world_radius}; expected more than 0");
        return Err(parameters.refuse("radius", message));
    }
    let mirrored = (linear.determinant() < 0.0) != (radius < 0.0);
    Ok(Shape {
        geometry: Geometry::Sphere { radius: world_radius },
        // Its axes are those of its texture coordinates.
        to_world: DAffine3 {
            matrix3: linear * scale.recip(),
            translation: to_world.transform_point3(center),
        },
        is_inverted_sphere: flips != mirrored,
    })
}

impl Meshes {
    /// The mesh of a file, read once for all shapes that are alike.
    fn get(
        &mut self,
        key: &MeshKey,
        read: impl Fn() -> Result<MeshFile, LoadError>,
        warnings: &mut Vec<Warning>,
    ) -> Result<Arc<Mesh>, LoadError> {
        if let Some(mesh) = self.0.get(key) {
            return Ok(Arc::clone(mesh));
        }
        let file = read()?;
        warnings.extend(file.warnings);
        let mesh = Arc::new(prepare(file.mesh, key));
        self.0.insert(key.clone(), Arc::clone(&mesh));
        Ok(mesh)
    }
}

/// Gives a mesh the normals that Mitsuba gives it: those of the file, or smooth ones, or none.
///
/// A mirrored mesh keeps its front here. In Mitsuba it does so if the file has normals; otherwise
/// normals are made from the mirrored triangles, whose front is on the other side.
fn prepare(mut mesh: Mesh, key: &MeshKey) -> Mesh {
    let mut turns = key.flips;
    if key.is_flat {
        mesh.normals = None;
    }
    if mesh.normals.is_none() {
        turns ^= key.mirrored;
        mesh.normals = (!key.is_flat).then(|| smooth_normals(&mesh));
    }
    if turns {
        shapes::flip(&mut mesh);
    }
    mesh
}
