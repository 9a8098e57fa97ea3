//! `<shape>`: surfaces in the world.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3, Frame};
use pt_scene::shapes::smooth_normals;
use pt_scene::{Attribute, Attributes, Geometry, Hint, Mesh, Motion, Warning, shapes};

use super::super::ply::{self, attributes};
use super::super::{obj, serialized, vol};
use super::object::{MitsubaObject, ObjectTree, Parameters, error, unsupported};
use super::{curves, texture};
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::isosurface::{Distances, IsosurfaceNormals};
use crate::shared::mesh_file;
use crate::shared::mesh_file::{ColorLevels, MeshFile};
use crate::shared::names::quote;

const KINDS: [&str; 16] = [
    "bsplinecurve",
    "cube",
    "cylinder",
    "disk",
    "ellipsoids",
    "ellipsoidsmesh",
    "instance",
    "linearcurve",
    "merge",
    "obj",
    "ply",
    "rectangle",
    "sdfgrid",
    "serialized",
    "shapegroup",
    "sphere",
];

/// A shape without its material.
pub(super) struct MitsubaShape {
    pub(super) geometry: Geometry,
    pub(super) to_world: DAffine3,
    /// Motion of the shape, if it is animated.
    pub(super) motion: Option<Arc<Motion>>,
}

/// Key of a mesh: its file, and the options with which it is read.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[expect(clippy::struct_excessive_bools, reason = "they are parameters that authors write")]
struct MeshKey {
    path: PathBuf,
    /// Index of the mesh in the file. For an "sdfgrid": 0 with analytic normals, 1 with smooth
    /// ones.
    index: u32,
    is_flat: bool,
    flips: bool,
    /// True if v is replaced by 1 − v.
    flips_v: bool,
    /// True if the transform of the shape mirrors.
    mirrored: bool,
}

impl MeshKey {
    /// Key of the first mesh of a file with default options.
    fn of_file(path: PathBuf) -> Self {
        Self { path, index: 0, is_flat: false, flips: false, flips_v: false, mirrored: false }
    }
}

/// Cache of meshes, shared by shapes.
#[derive(Default)]
pub(super) struct MitsubaMeshCache {
    /// Meshes of files, each with true if its smooth normals are computed, or the reason why it
    /// cannot be read.
    of_files: HashMap<MeshKey, Result<(Arc<Mesh>, bool), String>>,
    /// Meshes whose smooth normals are computed in world space, by the bits of the linear part of
    /// the transform.
    placed: HashMap<(MeshKey, [u64; 9]), Arc<Mesh>>,
    /// Procedural meshes, by the type of shape, and true if the front is flipped.
    made: HashMap<(&'static str, bool), Arc<Mesh>>,
}

/// Reads the shape of an object. Nested objects are left to the caller.
pub(super) fn shape(
    tree: &ObjectTree,
    object: &MitsubaObject,
    meshes: &mut MitsubaMeshCache,
    warnings: &mut Vec<Warning>,
) -> Result<MitsubaShape, LoadError> {
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["silhouette_sampling_weight"]);
    let (to_world, motion) = parameters.placement("to_world")?;
    let mirrors = motion.as_ref().is_some_and(Motion::is_mirrored);
    let flips = parameters.boolean("flip_normals")?;
    let mesh =
        |mesh: Arc<Mesh>| MitsubaShape { geometry: Geometry::Mesh(mesh), to_world, motion: None };
    let mut shape = match object.kind.as_str() {
        "sphere" => sphere(&mut parameters, to_world, flips != mirrors)?,
        "rectangle" => mesh(meshes.made("rectangle", shapes::rectangle, flips)),
        "cube" => mesh(meshes.made("cube", shapes::cube, flips)),
        "disk" => mesh(meshes.made("disk", shapes::disk, flips)),
        "cylinder" => {
            let to_world = cylinder(&mut parameters, to_world)?;
            MitsubaShape { to_world, ..mesh(meshes.made("cylinder", shapes::cylinder, flips)) }
        }
        kind @ ("bsplinecurve" | "linearcurve") => {
            let path = mesh_path(tree, object, &mut parameters)?;
            let degree = if kind == "linearcurve" { 1 } else { 3 };
            // Radii are not transformed, unless the curves are animated.
            let (points, placed) = match motion {
                None => (to_world, DAffine3::IDENTITY),
                Some(_) => (DAffine3::IDENTITY, to_world),
            };
            let read = tree.context.read(&path).and_then(|bytes| {
                curves::parse_mesh(&bytes, &path, degree, points, &tree.context)
                    .map_err(|error| error.to_string())
            });
            match read {
                Ok(read) => MitsubaShape { to_world: placed, ..mesh(turned(read, flips)) },
                Err(why) => return Err(left_out(tree, &parameters, &why)),
            }
        }
        kind @ ("ply" | "obj" | "serialized") => {
            let mirrored = mirrors || to_world.matrix3.determinant() < 0.0;
            let key = mesh_key(tree, object, &mut parameters, (flips, mirrored))?;
            let wanted = texture::attributes(tree);
            let read = || {
                let bytes = tree.context.read(&key.path)?;
                let read = match kind {
                    "ply" => ply::parse_mesh(&bytes, &key.path).and_then(|mut file| {
                        if !wanted.is_empty() {
                            let found = attributes::parse(&bytes, &key.path, &wanted)?;
                            add_attributes(&mut file.mesh, found);
                        }
                        Ok(file)
                    }),
                    "obj" => obj::parse_mesh(&bytes, &key.path),
                    _ => serialized::parse_mesh(&bytes, &key.path, key.index),
                };
                read.map_err(|error| error.to_string())
            };
            match meshes.of_file(&key, to_world.matrix3, read, warnings) {
                Ok(read) => mesh(read),
                Err(why) => return Err(left_out(tree, &parameters, &why)),
            }
        }
        "sdfgrid" => {
            let normals = normals_of_grid(&mut parameters)?;
            let path = mesh_path(tree, object, &mut parameters)?;
            let key = MeshKey {
                index: u32::from(normals == IsosurfaceNormals::Smooth),
                flips,
                ..MeshKey::of_file(path)
            };
            let read = || surface_of_grid(&tree.context.read(&key.path)?, normals, &tree.context);
            match meshes.of_file(&key, to_world.matrix3, read, warnings) {
                Ok(read) => mesh(read),
                Err(why) => return Err(left_out(tree, &parameters, &why)),
            }
        }
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    shape.motion = motion.map(Arc::new);
    Ok(shape)
}

/// Adds attributes to a mesh; those of the name `color` are its colours, unless it has some.
fn add_attributes(mesh: &mut Mesh, mut found: Attributes) {
    let of_vertices = found.vertices.remove(texture::COLOR);
    let of_faces = found.faces.remove(texture::COLOR);
    if mesh.colors.is_none() {
        mesh.colors = of_vertices.map(|values| Attribute { values, indices: None });
    }
    mesh.face_colors = mesh.face_colors.take().or(of_faces);
    mesh.attributes = found;
}

/// Reads the mesh file of an object and its options; a missing file is reported.
fn mesh_key(
    tree: &ObjectTree,
    object: &MitsubaObject,
    parameters: &mut Parameters<'_>,
    (flips, mirrored): (bool, bool),
) -> Result<MeshKey, LoadError> {
    let is_flat = parameters.boolean("face_normals")?;
    let flips_v = match object.kind.as_str() {
        "serialized" => false,
        // The top row of an image is at v = 0 in Mitsuba, and at v = 1 for most writers of OBJ.
        kind => parameters.boolean_or("flip_tex_coords", kind == "obj")?,
    };
    let index = match object.kind.as_str() {
        "serialized" => parameters.integer("shape_index")?.unwrap_or(0),
        _ => 0,
    };
    let index = u32::try_from(index).map_err(|_| {
        let message = format!("found \"shape_index\" = {index}, expected a whole number from 0");
        parameters.refuse("shape_index", message)
    })?;
    let path = mesh_path(tree, object, parameters)?;
    Ok(MeshKey { path, index, is_flat, flips, flips_v, mirrored })
}

/// Returns the file of an object; a missing file is reported.
pub(super) fn mesh_path(
    tree: &ObjectTree,
    object: &MitsubaObject,
    parameters: &mut Parameters<'_>,
) -> Result<PathBuf, LoadError> {
    let Some(text) = parameters.text("filename")? else {
        let message = "missing <string name=\"filename\">";
        return Err(error(&object.at, message));
    };
    tree.resolve(text).ok_or_else(|| left_out(tree, parameters, &tree.not_found(text)))
}

/// Reads the parameter "normals" of an "sdfgrid".
fn normals_of_grid(parameters: &mut Parameters<'_>) -> Result<IsosurfaceNormals, LoadError> {
    parameters.pass_over(&["watertight"]);
    match parameters.text("normals")? {
        None | Some("smooth") => Ok(IsosurfaceNormals::Smooth),
        Some("analytic") => Ok(IsosurfaceNormals::Analytic),
        Some(other) => {
            let message = format!("found {}, expected \"smooth\" or \"analytic\"", quote(other));
            Err(parameters.refuse("normals", message))
        }
    }
}

/// Extracts the surface of a file of signed distances.
fn surface_of_grid(
    bytes: &[u8],
    normals: IsosurfaceNormals,
    context: &LoadContext,
) -> Result<MeshFile, String> {
    /// Maximum number of triangles if the caller sets no limit.
    const MAX_TRIANGLES: usize = 1 << 23;
    let grid = vol::parse(bytes)?.grid;
    let distances = Distances::new(&grid).ok_or_else(|| {
        let [x, y, z] = grid.resolution;
        format!(
            "found a grid of {x} x {y} x {z} cells of {} numbers, expected one signed distance in \
             each of at least 2 x 2 x 2",
            grid.channels
        )
    })?;
    let most = context.limits().triangles(MAX_TRIANGLES);
    let mut mesh = distances.surface(normals, most).inspect_err(|_| {
        context.suggest(Hint::RaiseLimit("triangles"));
    })?;
    if mesh.triangles.is_empty() {
        return Err("found distances of one sign, expected a surface inside of the grid".to_owned());
    }
    // As in Mitsuba, all textures are seen at one point.
    let values = vec![[0.0; 2]; mesh.positions.len()].into();
    mesh.uvs = Some(Attribute { values, indices: None });
    Ok(MeshFile { mesh, levels: ColorLevels::default(), warnings: Vec::new() })
}

/// Reports a file that cannot be used, with the reason.
pub(super) fn left_out(tree: &ObjectTree, parameters: &Parameters<'_>, why: &str) -> LoadError {
    let reported = tree.miss(parameters.place("filename"), why, "the shape is omitted");
    reported.err().unwrap_or(LoadError::AlreadyReported)
}

/// Flips the front of a mesh if requested.
fn turned(mut mesh: Mesh, flips: bool) -> Arc<Mesh> {
    if flips {
        shapes::flip(&mut mesh);
    }
    Arc::new(mesh)
}

/// Transform of [`shapes::cylinder`]: its axis from `p0` to `p1`, with the same frame around it as
/// in Mitsuba.
fn cylinder(parameters: &mut Parameters<'_>, to_world: DAffine3) -> Result<DAffine3, LoadError> {
    let p0 = parameters.vector("p0")?.unwrap_or(DVec3::ZERO);
    let p1 = parameters.vector("p1")?.unwrap_or(DVec3::Z);
    let radius = parameters.positive("radius", 1.0)?;
    let Some(axis) = (p1 - p0).try_normalize() else {
        return Err(parameters
            .refuse("p1", "found a cylinder without length, expected different p0 and p1"));
    };
    let Frame { s, t, .. } = Frame::from_normal(axis.as_vec3());
    let linear = DMat3::from_cols(s.as_dvec3() * radius, t.as_dvec3() * radius, p1 - p0);
    let placed = to_world * DAffine3::from_mat3_translation(linear, p0);
    if placed.inverse().is_finite() {
        return Ok(placed);
    }
    Err(parameters
        .refuse("radius", "found a cylinder that is too thin or too large to be represented"))
}

/// Reads a sphere, whose transform has to scale uniformly.
fn sphere(
    parameters: &mut Parameters<'_>,
    to_world: DAffine3,
    flips: bool,
) -> Result<MitsubaShape, LoadError> {
    const TOLERANCE: f64 = 1e-4; // matrices are written with a few digits
    let center = parameters.vector("center")?.unwrap_or_default();
    let radius = parameters.float("radius")?.unwrap_or(1.0);
    let linear = to_world.matrix3;
    let scale = linear.x_axis.length();
    let error = linear.transpose() * linear - DMat3::from_diagonal([scale * scale; 3].into());
    if error.to_cols_array().iter().any(|x| x.abs() > TOLERANCE * scale * scale) {
        let message =
            "found a non-uniform scale of a sphere, expected the same scale in all directions";
        return Err(parameters.refuse("to_world", message));
    }
    let world_radius = radius.abs() * scale;
    if !(world_radius > 0.0 && world_radius.is_finite()) {
        let message =
            format!("found a radius of {world_radius} in world space, expected more than 0");
        return Err(parameters.refuse("radius", message));
    }
    let mirrored = (linear.determinant() < 0.0) != (radius < 0.0);
    let sign = if flips == mirrored { 1.0 } else { -1.0 };
    // The rotation of the sphere is kept for its texture coordinates.
    let center = to_world.transform_point3(center);
    Ok(MitsubaShape {
        geometry: Geometry::Sphere { radius: sign * world_radius },
        to_world: DAffine3::from_mat3_translation(linear * scale.recip(), center),
        motion: None,
    })
}

impl MitsubaMeshCache {
    /// Returns a procedural mesh.
    pub(super) fn made(
        &mut self,
        kind: &'static str,
        make: fn() -> Mesh,
        flips: bool,
    ) -> Arc<Mesh> {
        let mesh = self.made.entry((kind, flips)).or_insert_with(|| turned(make(), flips));
        Arc::clone(mesh)
    }

    /// Returns the mesh of a file, which is read once per key. Smooth normals that Mitsuba computes
    /// are computed in world space, since they depend on non-uniform scales.
    fn of_file(
        &mut self,
        key: &MeshKey,
        to_world: DMat3,
        read: impl Fn() -> Result<MeshFile, String>,
        warnings: &mut Vec<Warning>,
    ) -> Result<Arc<Mesh>, String> {
        let known = self.of_files.get(key).cloned().unwrap_or_else(|| {
            let made = read().map(|mut file| {
                warnings.append(&mut file.warnings);
                let is_smoothed = file.mesh.normals.is_none() && !key.is_flat;
                (Arc::new(prepare(file, key)), is_smoothed)
            });
            self.of_files.insert(key.clone(), made.clone());
            made
        });
        let (mesh, is_smoothed) = known?;
        if !is_smoothed || keeps_angles(to_world) {
            return Ok(mesh);
        }
        let bits = to_world.to_cols_array().map(f64::to_bits);
        let placed = self.placed.entry((key.clone(), bits));
        let smoothed = || Arc::new(smoothed_in_world((*mesh).clone(), to_world));
        Ok(Arc::clone(placed.or_insert_with(smoothed)))
    }
}

/// Returns true if a transform consists of rotation, reflection and uniform scale, up to rounding.
fn keeps_angles(linear: DMat3) -> bool {
    const TOLERANCE: f64 = 1e-6;
    let scale = linear.x_axis.length_squared();
    let error = linear.transpose() * linear - DMat3::from_diagonal(DVec3::splat(scale));
    error.to_cols_array().iter().all(|x| x.abs() <= TOLERANCE * scale)
}

/// Computes smooth normals of a mesh in world space, in which their weights, the angles of
/// triangles, are measured.
///
/// Normals of the world are the inverse transpose of those of the mesh, and a mirroring transform
/// reverses the front of triangles: n = ± Mᵀ n_world, with the sign of det M.
fn smoothed_in_world(mut mesh: Mesh, to_world: DMat3) -> Mesh {
    let placed = |p: &[f32; 3]| (to_world * DVec3::from_array(p.map(f64::from))).as_vec3();
    let in_world = mesh.positions.iter().map(|p| placed(p).to_array()).collect();
    let positions = std::mem::replace(&mut mesh.positions, in_world);
    let mut normals = smooth_normals(&mesh);
    let back = to_world.transpose() * to_world.determinant().signum();
    for normal in &mut normals.values {
        let local = back * DVec3::from_array(normal.map(f64::from));
        *normal = local.normalize_or(DVec3::Z).as_vec3().to_array();
    }
    Mesh { positions, normals: Some(normals), ..mesh }
}

/// Sets the normals of a mesh as in Mitsuba: those of the file, or smooth ones, or none.
///
/// A mirrored mesh keeps its front here. In Mitsuba it does so if the file has normals; otherwise
/// normals are computed from the mirrored triangles, whose front is on the other side.
///
/// As in Mitsuba, integer colours are not normalized.
fn prepare(MeshFile { mut mesh, levels, .. }: MeshFile, key: &MeshKey) -> Mesh {
    mesh_file::map_colors(&mut mesh, |channel, of_faces| {
        channel * if of_faces { levels.faces } else { levels.vertices }
    });
    if key.flips_v {
        for [_, v] in mesh.uvs.iter_mut().flat_map(|uvs| &mut uvs.values) {
            *v = 1.0 - *v;
        }
    }
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
