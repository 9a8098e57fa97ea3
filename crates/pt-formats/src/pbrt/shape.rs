//! `Shape`: surfaces in the world.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::Arc;

use pt_math::DVec3;
use pt_scene::shapes::{flip, single_part};
use pt_scene::{Attribute, Geometry, Hint, Mesh, Warning};

use super::super::ply;
use super::content::content;
use super::curve::curve;
use super::entity::Entity;
use super::quadric;
use super::state::{GraphicsState, mirrors};
use super::subdivision::subdivide;
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::context::LoadContext;

const KINDS: [&str; 8] = [
    "bilinearmesh",
    "curve",
    "cylinder",
    "disk",
    "loopsubdiv",
    "plymesh",
    "sphere",
    "trianglemesh",
];
/// Number of segments along each side of a bilinear patch that is not flat.
const PIECES: u32 = 16;

/// Maximum number of triangles of all curved shapes of a scene; a short line can request 65,536 of
/// them.
const MAX_TRIANGLES: usize = 1 << 24;

/// Cache of meshes.
#[derive(Default)]
pub(super) struct PbrtMeshCache {
    /// Meshes of files by path, and true if they are flipped; or the reason why a file cannot be
    /// read.
    of_files: HashMap<(PathBuf, bool), Result<Arc<Mesh>, String>>,
    /// Disks and cylinders by their parameters, and true if they are flipped.
    round: HashMap<(&'static str, [u64; 4], bool), Arc<Mesh>>,
    /// Number of triangles of shapes without files.
    cut: usize,
}

impl PbrtMeshCache {
    /// Returns a disk or a cylinder with the given parameters.
    fn round(
        &mut self,
        (kind, numbers, is_inside_out): (&'static str, [f64; 4], bool),
        context: &LoadContext,
        make: impl FnOnce() -> Mesh,
    ) -> Result<Geometry, String> {
        let key = (kind, numbers.map(f64::to_bits), is_inside_out);
        if let Some(known) = self.round.get(&key) {
            return Ok(Geometry::Mesh(Arc::clone(known)));
        }
        let mesh = Arc::new(turned(make(), is_inside_out));
        self.count(&mesh, context)?;
        self.round.insert(key, Arc::clone(&mesh));
        Ok(Geometry::Mesh(mesh))
    }

    /// Counts the triangles of a shape.
    ///
    /// # Errors
    /// If those of all shapes exceed the limit.
    pub(super) fn count(&mut self, mesh: &Mesh, context: &LoadContext) -> Result<(), String> {
        self.expect(mesh.triangles.len(), context)
    }

    /// Counts the triangles of a shape before they are created.
    ///
    /// # Errors
    /// If those of all shapes exceed the limit.
    fn expect(&mut self, triangles: usize, context: &LoadContext) -> Result<(), String> {
        let most = context.limits().triangles(MAX_TRIANGLES);
        // A rejected shape is not counted, so that smaller ones may follow.
        if let Some(all) = self.cut.checked_add(triangles).filter(|all| *all <= most) {
            self.cut = all;
            return Ok(());
        }
        context.suggest(Hint::RaiseLimit("triangles"));
        Err(format!("the shapes exceed the limit of {most} triangles; give them as plymesh"))
    }
}

/// Reads a shape, in its own coordinates.
pub(super) fn shape(
    entity: &Entity,
    state: &GraphicsState,
    meshes: &mut PbrtMeshCache,
    folder: &Folder,
    warnings: &mut Vec<Warning>,
) -> Result<Geometry, LoadError> {
    let mesh = |mesh| Geometry::Mesh(Arc::new(mesh));
    let context = &folder.context;
    let refuse = |message: String| entity.at.error(message);
    // In pbrt-v4, a mirroring transform flips the front of round shapes. Their emission remains
    // outwards.
    let is_inside_out = state.reverses != (mirrors(&state.ctm[0]) && state.area_light.is_none());
    let geometry = match entity.kind.as_str() {
        "sphere" => sphere(entity, is_inside_out)?,
        "disk" => {
            let radius = entity.positive("radius", 1.0)?;
            let inner = entity.not_negative("innerradius", 0.0)?;
            if inner >= radius {
                let message = format!(
                    "found an inner radius of {inner}, expected less than the radius {radius}"
                );
                return Err(entity.refuse("innerradius", message));
            }
            let (height, phi_max) = (entity.float("height", 0.0)?, phi_max(entity)?);
            let numbers = [height, radius, inner, phi_max];
            let make = || quadric::disk(height, [radius, inner], phi_max);
            meshes.round(("disk", numbers, is_inside_out), context, make).map_err(refuse)?
        }
        "cylinder" => {
            let range = [entity.float("zmin", -1.0)?, entity.float("zmax", 1.0)?];
            let (radius, range) = (entity.positive("radius", 1.0)?, sorted(entity, range)?);
            let phi_max = phi_max(entity)?;
            let numbers = [radius, range[0], range[1], phi_max];
            let make = || quadric::cylinder(radius, range, phi_max);
            meshes.round(("cylinder", numbers, is_inside_out), context, make).map_err(refuse)?
        }
        "trianglemesh" => mesh(turned(triangles(entity)?, state.reverses)),
        "bilinearmesh" => mesh(turned(bilinear(entity)?, state.reverses)),
        "curve" => mesh(turned(curve(entity)?, state.reverses)),
        // In pbrt-v4, its normals face opposite to its faces.
        "loopsubdiv" => {
            let subdivided = subdivided(entity, meshes, context)?;
            mesh(turned(subdivided, !state.reverses))
        }
        "plymesh" => ply_mesh(entity, state.reverses, meshes, folder, warnings)?,
        _ => return Err(entity.unsupported(&KINDS)),
    };
    if matches!(&geometry, Geometry::Mesh(mesh) if mesh.triangles.is_empty()) {
        return Err(entity.at.error("shape without a triangle that has an area"));
    }
    if let Geometry::Mesh(mesh) = &geometry {
        let is_finite = mesh.positions.as_flattened().iter().all(|x| x.is_finite());
        if !is_finite {
            return Err(entity.at.error("found a shape that is too large to be represented"));
        }
        if !matches!(
            entity.kind.as_str(),
            "cylinder" | "disk" | "loopsubdiv" | "plymesh" | "trianglemesh"
        ) {
            let counted = meshes.count(mesh, context);
            counted.map_err(|message| entity.at.error(message))?;
        }
    }
    Ok(geometry)
}

/// Flips the front of a mesh if requested.
fn turned(mut mesh: Mesh, flips: bool) -> Mesh {
    if flips {
        flip(&mut mesh);
    }
    mesh
}

/// Reads the angle that a shape spans around its axis, in radians.
fn phi_max(entity: &Entity) -> Result<f64, LoadError> {
    let degrees = entity.positive("phimax", 360.0)?;
    Ok(if degrees >= 360.0 { TAU } else { degrees.to_radians() })
}

/// Returns a range of heights in increasing order.
fn sorted(entity: &Entity, [a, b]: [f64; 2]) -> Result<[f64; 2], LoadError> {
    if a == b {
        return Err(entity.refuse(
            "zmax",
            format!("found zmin and zmax of {a}, expected two different heights"),
        ));
    }
    Ok([a.min(b), a.max(b)])
}

/// Reads a sphere. Partial or flipped spheres are meshes.
fn sphere(entity: &Entity, is_inside_out: bool) -> Result<Geometry, LoadError> {
    let radius = entity.positive("radius", 1.0)?;
    let heights = [entity.float("zmin", -radius)?, entity.float("zmax", radius)?];
    let [low, high] = sorted(entity, heights)?;
    let phi_max = phi_max(entity)?;
    if low >= radius || high <= -radius {
        return Err(entity.refuse(
            "zmin",
            format!("found no part of the sphere between {low} and {high}, expected an overlap"),
        ));
    }
    let is_whole = low <= -radius && high >= radius && phi_max == TAU;
    if is_whole && !is_inside_out {
        return Ok(Geometry::Sphere { radius });
    }
    let part = quadric::sphere(radius, [low.max(-radius), high.min(radius)], phi_max);
    Ok(Geometry::Mesh(Arc::new(turned(part, is_inside_out))))
}

/// Creates a mesh of a whole sphere.
pub(super) fn sphere_mesh(radius: f64) -> Mesh {
    quadric::sphere(radius, [-radius, radius], TAU)
}

fn to_f32<const N: usize>(tuples: &[[f64; N]]) -> Vec<[f32; N]> {
    tuples.iter().map(|tuple| tuple.map(|x| x as f32)).collect()
}

/// Reads positions, normals and texture coordinates of vertices.
fn vertices(entity: &Entity) -> Result<Mesh, LoadError> {
    let Some(positions) = entity.points("P")? else {
        return Err(entity.at.error("missing parameter \"point3 P\""));
    };
    let count = positions.len();
    let check = |name: &str, values: usize| {
        let message = format!(
            "found {values} entries of {name} for {count} points of P, expected one for each"
        );
        if values == count { Ok(()) } else { Err(entity.refuse(name, message)) }
    };
    let normals = entity.normals("N")?;
    let uvs = match entity.points2("uv")? {
        Some(uvs) => Some(uvs),
        None => entity.points2("st")?,
    };
    normals.as_ref().map_or(Ok(()), |normals| check("N", normals.len()))?;
    uvs.as_ref().map_or(Ok(()), |uvs| check("uv", uvs.len()))?;
    Ok(Mesh {
        name: entity.kind.clone(),
        positions: to_f32(&positions).into(),
        normals: normals.map(|n| Attribute { values: to_f32(&n).into(), indices: None }),
        uvs: uvs.map(|uv| Attribute { values: to_f32(&uv).into(), indices: None }),
        ..Mesh::default()
    })
}

/// Reads the vertex indices of faces with `N` corners, which are optional for a single face.
fn faces<const N: usize>(entity: &Entity, vertices: usize) -> Result<Vec<[u32; N]>, LoadError> {
    let indices = match entity.indices("indices", vertices)? {
        None if vertices == N => (0..N as u32).collect(),
        None => return Err(entity.at.error("missing parameter \"integer indices\"")),
        Some(indices) => indices,
    };
    let (faces, rest) = indices.as_chunks::<N>();
    if rest.is_empty() && !faces.is_empty() {
        return Ok(faces.to_vec());
    }
    let message = format!("found {} indices, expected faces of {N} corners", indices.len());
    Err(entity.refuse("indices", message))
}

fn triangles(entity: &Entity) -> Result<Mesh, LoadError> {
    let mut mesh = vertices(entity)?;
    entity.pass_over(&["S", "faceIndices"]);
    mesh.triangles = faces::<3>(entity, mesh.positions.len())?.into();
    mesh.submeshes = single_part(mesh.triangles.len());
    face_normals(&mut mesh);
    Ok(mesh)
}

/// Reads a subdivision surface and computes its limit.
fn subdivided(
    entity: &Entity,
    meshes: &mut PbrtMeshCache,
    context: &LoadContext,
) -> Result<Mesh, LoadError> {
    entity.pass_over(&["scheme"]);
    let levels = entity.count("levels", 3, [0, 10])?;
    let mesh = vertices(entity)?;
    let faces = faces::<3>(entity, mesh.positions.len())?;
    let positions = mesh.positions.iter().map(|p| DVec3::from_array(p.map(f64::from)));
    let count = faces.len().saturating_mul(1 << (2 * levels));
    meshes.expect(count, context).map_err(|message| entity.refuse("indices", message))?;
    subdivide(positions.collect(), faces, levels)
        .map_err(|message| entity.refuse("indices", message))
}

/// Orients each triangle to agree with its normals, if it has any.
fn face_normals(mesh: &mut Mesh) {
    let Some(normals) = &mut mesh.normals else { return };
    for (i, triangle) in mesh.triangles.iter_mut().enumerate() {
        let at = |i: u32| DVec3::from_array(mesh.positions[i as usize].map(f64::from));
        let [a, b, c] = triangle.map(at);
        let corners = normals.indices.as_ref().map_or(*triangle, |indices| indices[i]);
        let normal = |i: u32| DVec3::from_array(normals.values[i as usize].map(f64::from));
        let sum: DVec3 = corners.map(normal).into_iter().sum();
        if (b - a).cross(c - a).dot(sum) < 0.0 {
            triangle.swap(1, 2);
            let of_uvs = mesh.uvs.iter_mut().filter_map(|uvs| uvs.indices.as_mut());
            for indices in normals.indices.iter_mut().chain(of_uvs) {
                indices[i].swap(1, 2);
            }
        }
    }
}

/// Reads bilinear patches; flat ones become two triangles.
fn bilinear(entity: &Entity) -> Result<Mesh, LoadError> {
    if entity.text("emissionfilename")?.is_some() {
        return Err(entity.refuse(
            "emissionfilename",
            "unsupported emissionfilename; give the AreaLightSource a filename",
        ));
    }
    entity.pass_over(&["faceIndices"]);
    let source = vertices(entity)?;
    let mut all = Mesh { name: source.name.clone(), ..Mesh::default() };
    let (mut normals, mut uvs) = (Vec::new(), Vec::new());
    for face in faces::<4>(entity, source.positions.len())? {
        let corners = face.map(|i| DVec3::from_array(source.positions[i as usize].map(f64::from)));
        let pieces = if is_flat(corners) { 1 } else { PIECES };
        let patch = quadric::patch(corners, pieces);
        let first = all.positions.len() as u32;
        if u32::try_from(all.positions.len() + patch.positions.len()).is_err() {
            return Err(entity
                .at
                .error("the patches have more vertices than 32-bit indices can address"));
        }
        all.triangles.extend(patch.triangles.iter().map(|t| t.map(|i| i + first)));
        let parameters = patch.uvs.iter().flat_map(|uvs| &uvs.values);
        for &[u, v] in parameters {
            let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
            uvs.push(match &source.uvs {
                Some(given) => blend(face.map(|i| given.values[i as usize]), weights),
                None => [u, v],
            });
            if let Some(given) = &source.normals {
                normals.push(blend(face.map(|i| given.values[i as usize]), weights));
            }
        }
        if source.normals.is_none() {
            normals.extend(patch.normals.into_iter().flat_map(|normals| normals.values));
        }
        all.positions.extend(patch.positions);
    }
    all.normals = Some(Attribute { values: normals.into(), indices: None });
    all.uvs = Some(Attribute { values: uvs.into(), indices: None });
    all.submeshes = single_part(all.triangles.len());
    face_normals(&mut all);
    Ok(all)
}

/// Returns true if a patch is a parallelogram, for which two triangles have the same texture
/// coordinates.
fn is_flat([p00, p10, p01, p11]: [DVec3; 4]) -> bool {
    const TOLERANCE: f64 = 1e-6;
    let size = (p11 - p00).length().max((p10 - p01).length());
    (p00 + p11 - p10 - p01).length() <= TOLERANCE * size
}

fn blend<const N: usize>(values: [[f32; N]; 4], weights: [f32; 4]) -> [f32; N] {
    std::array::from_fn(|c| (0..4).map(|i| values[i][c] * weights[i]).sum())
}

/// Reads the mesh of a file.
fn ply_mesh(
    entity: &Entity,
    flips: bool,
    meshes: &mut PbrtMeshCache,
    folder: &Folder,
    warnings: &mut Vec<Warning>,
) -> Result<Geometry, LoadError> {
    let Some(name) = entity.text("filename")? else {
        return Err(entity.at.error("missing parameter \"string filename\""));
    };
    let key = (folder.join(name), flips);
    let made = meshes.of_files.entry(key.clone()).or_insert_with(|| {
        let bytes = content(&folder.context, &key.0)?;
        let mut file = ply::parse_mesh(&bytes, &key.0).map_err(|error| error.to_string())?;
        warnings.append(&mut file.warnings);
        let mut mesh = Mesh { colors: None, face_colors: None, ..file.mesh };
        face_normals(&mut mesh);
        Ok(Arc::new(turned(mesh, flips)))
    });
    match made {
        Ok(mesh) => Ok(Geometry::Mesh(Arc::clone(mesh))),
        Err(why) => {
            let message = format!("{why}; the shape is omitted");
            folder.context.missing(entity.place("filename").span(""), message);
            Err(LoadError::AlreadyReported)
        }
    }
}
