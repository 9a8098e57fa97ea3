//! `ellipsoids` and `ellipsoidsmesh`: files of Gaussian splats, shown as surfaces.
//!
//! Each splat is an instance of one mesh. In Mitsuba, rays intersect it only from outside; here it
//! is a closed surface, which is equivalent unless light enters it.

use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DQuat, DVec3, Trs};
use pt_scene::shapes::single_part;
use pt_scene::{Geometry, Mesh, Warning, shapes};

use super::super::ply;
use super::object::{MitsubaObject, ObjectTree, Parameters, error};
use super::shape::{self, MitsubaMeshCache, MitsubaShape, shape};
use crate::LoadError;
use crate::shared::names::quote;

pub(super) const KINDS: [&str; 2] = ["ellipsoids", "ellipsoidsmesh"];

/// Distance from the centre of a splat to its surface, in standard deviations.
const EXTENT: f64 = 3.0;

/// Properties of a splat: its centre, the logarithms of its standard deviations, and a quaternion
/// with its real part first.
const PROPERTIES: [&str; 10] =
    ["x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];

/// Reads the ellipsoids of an object. Nested objects are left to the caller.
pub(super) fn shapes(
    tree: &ObjectTree,
    object: &MitsubaObject,
    meshes: &mut MitsubaMeshCache,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<MitsubaShape>, LoadError> {
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["silhouette_sampling_weight"]);
    let path = shape::mesh_path(tree, object, &mut parameters)?;
    let placing = Placing {
        to_world: parameters.transform("to_world")?,
        scale: parameters.positive("scale_factor", 1.0)?,
        extent: parameters.positive("extent", EXTENT)?,
    };
    let is_mesh = object.kind == "ellipsoidsmesh";
    let mesh = if is_mesh {
        shell(tree, object, &mut parameters, meshes, warnings)?
    } else {
        meshes.made("ellipsoids", shapes::sphere, false)
    };
    let fades = is_mesh && parameters.boolean("extent_adaptive_clamping")?;
    let read = tree.context.read(&path).and_then(|bytes| {
        let rows = if fades {
            let [a, b, c, d, e, f, g, h, i, j] = PROPERTIES;
            let rows =
                ply::columns::parse(&bytes, &path, [a, b, c, d, e, f, g, h, i, j, "opacity"]);
            rows.map(|rows| rows.iter().filter_map(faded).collect())
        } else {
            let rows = ply::columns::parse(&bytes, &path, PROPERTIES);
            rows.map(|rows| rows.into_iter().map(|row| (row, 1.0)).collect())
        };
        rows.map_err(|error| error.to_string())
    });
    let rows: Vec<([f32; 10], f64)> = match read {
        Ok(rows) => rows,
        Err(why) => return Err(shape::left_out(tree, &parameters, &why)),
    };
    let Some(pose) = Trs::of(&placing.to_world) else {
        return Err(parameters.refuse(
            "to_world",
            "found a singular \"to_world\", expected an invertible transform",
        ));
    };
    let geometry = Geometry::Mesh(mesh);
    let placed = rows.iter().filter_map(|(row, share)| placing.place(&pose, row, *share));
    let made: Vec<_> = placed
        .map(|to_world| MitsubaShape { geometry: geometry.clone(), to_world, motion: None })
        .collect();
    if made.len() < rows.len() {
        let message = format!(
            "{} of {} ellipsoids are omitted: too small, too large, or without a valid rotation \
             quaternion",
            rows.len() - made.len(),
            rows.len()
        );
        warnings.push(Warning { at: object.at.clone(), message });
    }
    parameters.finish()?;
    Ok(made)
}

/// Returns a row without its opacity, and the factor of the extent due to the opacity; `None` if
/// the splat is too transparent.
///
/// √(2 ln(opacity / 0.01)) / 3: there a Gaussian of this opacity falls to 0.01.
fn faded(row: &[f32; 11]) -> Option<([f32; 10], f64)> {
    const MIN: f64 = 0.01;
    let [splat @ .., logit] = row;
    let opacity = 1.0 / (1.0 + libm::exp(-f64::from(*logit)));
    let share = (2.0 * libm::log(opacity / MIN)).sqrt() / 3.0;
    (share > 0.0).then_some((*splat, share))
}

/// Placement of splats.
struct Placing {
    to_world: DAffine3,
    scale: f64,
    extent: f64,
}

impl Placing {
    /// Returns the transform from the unit sphere to the ellipsoid of a splat. Of `to_world`, only
    /// the rotation and the mean scale are used, as in Mitsuba. `None` if numbers overflow or the
    /// quaternion is zero.
    fn place(&self, pose: &Trs, row: &[f32; 10], share: f64) -> Option<DAffine3> {
        const MIN: f64 = 1e-6; // standard deviation
        let [x, y, z, a, b, c, real, i, j, k] = row.map(f64::from);
        let stretch = pose.stretch();
        let mean = (stretch.x_axis.x + stretch.y_axis.y + stretch.z_axis.z).abs() / 3.0;
        let deviations = DVec3::new(a, b, c).to_array().map(|log| libm::exp(log).max(MIN));
        let radii = DVec3::from_array(deviations) * (self.scale * mean * self.extent * share);
        let quaternion = DQuat::from_xyzw(i, j, k, real);
        let is_turn = quaternion.length_squared() > 0.0;
        let turn = pose.rotation() * quaternion.normalize();
        let linear = DMat3::from_quat(turn) * DMat3::from_diagonal(radii);
        let center = self.to_world.transform_point3(DVec3::new(x, y, z));
        let placed = DAffine3::from_mat3_translation(linear, center);
        (is_turn && placed.is_finite() && placed.inverse().is_finite()).then_some(placed)
    }
}

/// Returns the mesh that represents the unit sphere: a named one, or a nested shape.
fn shell(
    tree: &ObjectTree,
    object: &MitsubaObject,
    parameters: &mut Parameters<'_>,
    meshes: &mut MitsubaMeshCache,
    warnings: &mut Vec<Warning>,
) -> Result<Arc<Mesh>, LoadError> {
    let children = tree.children(object, &["bsdf", "emitter", "medium", "shape"])?;
    let named = parameters.text("shell")?;
    if let Some(inner) = tree.only(&children, "shape")? {
        let inner = &tree.objects[inner];
        if named.is_some() {
            return Err(
                parameters.refuse("shell", "found a shell name and a shape, expected one of them")
            );
        }
        return match shape(tree, inner, meshes, warnings)? {
            MitsubaShape { geometry: Geometry::Mesh(mesh), to_world, .. } => {
                Ok(Arc::new(around_unit_sphere(&mesh, to_world)))
            }
            _ => Err(error(&inner.at, "found a shell that is not a mesh, expected a mesh")),
        };
    }
    match named {
        None | Some("default" | "ico_sphere") => Ok(meshes.made("ico_sphere", icosahedron, false)),
        Some("box") => Ok(meshes.made("box", cube, false)),
        Some("uv_sphere") => Ok(meshes.made("uv_sphere", barrel, false)),
        Some(other) => {
            let message = format!(
                "unknown shell {}; expected \"box\", \"ico_sphere\" or \"uv_sphere\"",
                quote(other)
            );
            Err(parameters.refuse("shell", message))
        }
    }
}

/// Returns a mesh without normals and texture coordinates, scaled so that no vertex and no centroid
/// of a triangle is inside of the unit sphere.
fn around_unit_sphere(mesh: &Mesh, to_world: DAffine3) -> Mesh {
    let placed = |p: &[f32; 3]| to_world.transform_point3(DVec3::from_array(p.map(f64::from)));
    let points: Vec<DVec3> = mesh.positions.iter().map(placed).collect();
    let nearest = mesh.triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        let middle = (a + b + c) / 3.0;
        [a, b, c, middle].map(DVec3::length).into_iter().fold(f64::INFINITY, f64::min)
    });
    let nearest = nearest.fold(f64::INFINITY, f64::min);
    let scale = if nearest > 0.0 { nearest.recip() } else { 1.0 };
    Mesh {
        name: mesh.name.clone(),
        positions: points.iter().map(|p| (*p * scale).as_vec3().to_array()).collect(),
        triangles: mesh.triangles.clone(),
        submeshes: single_part(mesh.triangles.len()),
        ..Mesh::default()
    }
}

fn cube() -> Mesh {
    around_unit_sphere(&shapes::cube(), DAffine3::IDENTITY)
}

/// Creates a mesh of rings of vertices around the y axis between two poles. Each ring, from below,
/// is given by its height and the rotation of its first vertex, in units of the angle between two
/// vertices.
fn rings(name: &str, sides: u32, rings: &[(f64, f64)]) -> Mesh {
    let corner = |(height, turn): (f64, f64), i: u32| {
        let angle = std::f64::consts::TAU * (f64::from(i) + turn) / f64::from(sides);
        let (sin, cos) = libm::sincos(angle);
        let radius = (1.0 - height * height).sqrt();
        DVec3::new(radius * cos, height, radius * sin).as_vec3().to_array()
    };
    let mut positions = vec![[0.0, -1.0, 0.0]];
    for ring in rings {
        positions.extend((0..sides).map(|i| corner(*ring, i)));
    }
    positions.push([0.0, 1.0, 0.0]);
    let top = positions.len() as u32 - 1;
    let at = |ring: u32, i: u32| 1 + ring * sides + i % sides;
    let last = rings.len() as u32 - 1;
    let mut triangles = Vec::new();
    for i in 0..sides {
        triangles.push([0, at(0, i), at(0, i + 1)]);
        for ring in 0..last {
            triangles.push([at(ring, i), at(ring + 1, i), at(ring, i + 1)]);
            triangles.push([at(ring, i + 1), at(ring + 1, i), at(ring + 1, i + 1)]);
        }
        triangles.push([at(last, i + 1), at(last, i), top]);
    }
    let mesh = Mesh {
        name: name.to_owned(),
        positions: positions.into(),
        triangles: triangles.into(),
        ..Mesh::default()
    };
    around_unit_sphere(&mesh, DAffine3::IDENTITY)
}

/// Icosahedron with two vertices on the y axis; of the five below the equator, one is towards −x.
fn icosahedron() -> Mesh {
    let height = 0.2f64.sqrt();
    rings("ico_sphere", 5, &[(-height, 0.5), (height, 1.0)])
}

/// Sphere of nine sides and four rings, 36° from one another and from the poles; a vertex of each
/// is at −10° about the y axis.
fn barrel() -> Mesh {
    let heights = [-36.0f64, -72.0, 72.0, 36.0].map(|degrees| {
        let cos = libm::cos(degrees.to_radians());
        if degrees < 0.0 { -cos } else { cos }
    });
    rings("uv_sphere", 9, &heights.map(|height| (height, 0.75)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shells are closed, face outwards, and enclose the unit sphere.
    #[test]
    fn shells_are_closed_and_look_outwards() {
        for (mesh, corners, triangles) in
            [(icosahedron(), 12, 20), (barrel(), 38, 72), (cube(), 8, 12)]
        {
            assert_eq!((mesh.positions.len(), mesh.triangles.len()), (corners, triangles));
            let mut volume = 0.0;
            for t in &mesh.triangles {
                let [a, b, c] =
                    t.map(|i| DVec3::from_array(mesh.positions[i as usize].map(f64::from)));
                let middle = (a + b + c) / 3.0;
                assert!((b - a).cross(c - a).dot(middle) > 0.0, "{}: {t:?}", mesh.name);
                assert!(middle.length() > 1.0 - 1e-6, "{}: {t:?}", mesh.name);
                volume += a.dot(b.cross(c)) / 6.0;
            }
            // More than the volume of the unit sphere, 4.19, less the parts where shells intersect
            // it.
            assert!(volume > 4.0, "{}: {volume}", mesh.name);
        }
    }

    /// Vertices of the shells of Mitsuba 3.9.1, from `mesh.vertex_position`.
    #[test]
    fn shells_are_those_of_mitsuba() {
        let has = |mesh: &Mesh, corner: [f32; 3]| {
            let near = |p: &&[f32; 3]| p.iter().zip(corner).all(|(a, b)| (*a - b).abs() < 2e-5);
            assert!(mesh.positions.iter().any(|p| near(&p)), "{}: {corner:?}", mesh.name);
        };
        let icosahedron = icosahedron();
        has(&icosahedron, [0.0, -1.258_425_6, 0.0]);
        has(&icosahedron, [0.910_596_7, -0.562_786_8, 0.661_579_5]);
        has(&icosahedron, [1.125_567_3, 0.562_786_8, 0.0]);
        let barrel = barrel();
        has(&barrel, [0.416_962_4, 0.892_829_36, -0.496_916_95]);
        has(&barrel, [1.033_638_5, -0.341_030_48, -0.182_258_07]);
        has(&cube(), [0.904_534, -0.904_534, -0.904_534]);
    }
}
