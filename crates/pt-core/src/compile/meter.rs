//! Compiles the author's meter.

use pt_math::{DAffine3, DVec3, Vec3};
use pt_scene::extent::Extent;
use pt_scene::{Camera, Geometry, Mesh, Quantity};

use super::CompileError;
use super::collector::is_similarity;
use crate::compile::refuse;
use crate::light::EmitterTriangle;
use crate::meter::{Meter, MeterRays, MeterSurface};

/// Compiles the meter of a camera; `None` if it has none. `surfaces` returns the bounding box of
/// the surfaces of the scene.
pub(super) fn compile(
    camera: &Camera,
    surfaces: impl FnOnce() -> Option<Extent>,
    metres: f64,
) -> Result<Option<Meter>, CompileError> {
    let Some(meter) = &camera.meter else { return Ok(None) };
    let refuse = |message| refuse(&format!("camera \"{}\"", camera.name), message);
    let to_world = DAffine3::from_mat3_translation(
        meter.to_world.matrix3 * metres,
        meter.to_world.translation * metres,
    );
    if !to_world.is_finite() || !to_world.inverse().is_finite() {
        return Err(refuse(
            "found a meter on a flattened surface or at a location that is not finite",
        ));
    }
    let surface = match &meter.geometry {
        Geometry::Sphere { radius } if is_similarity(to_world.matrix3) => {
            let radius = (radius * to_world.matrix3.x_axis.length()) as f32;
            let is_sphere = radius.is_finite() && radius != 0.0;
            is_sphere
                .then(|| MeterSurface::Sphere { center: to_world.translation.as_vec3(), radius })
        }
        Geometry::Sphere { .. } => {
            return Err(refuse("found a meter on a non-uniformly scaled sphere, expected a mesh"));
        }
        Geometry::Mesh(mesh) => triangles(mesh, to_world),
        Geometry::Points { .. } => {
            return Err(refuse("found a meter on points, expected a mesh or a sphere"));
        }
    };
    let Some(surface) = surface else {
        return Err(refuse("found a meter on a surface without area"));
    };
    let rays = match meter.quantity {
        Quantity::Irradiance => MeterRays::Hemisphere,
        Quantity::Radiance => {
            let [low, high] = surfaces().unwrap_or_default().map(|p| p * metres);
            let axis = camera.to_world.transform_vector3(DVec3::NEG_Z);
            let Some(direction) = axis.try_normalize() else {
                return Err(refuse("found a node transform that flattens the viewing axis"));
            };
            // Slightly more than half of the diagonal, to include surfaces on the bounding sphere.
            let radius = 0.501 * (high - low).length() + f64::from(f32::MIN_POSITIVE);
            MeterRays::Parallel {
                direction: direction.as_vec3(),
                center: (0.5 * (low + high)).as_vec3(),
                radius: radius as f32,
            }
        }
    };
    Ok(Some(Meter { surface, rays }))
}

/// Triangles of a mesh in world space; `None` if an index is out of range or they have no area.
fn triangles(mesh: &Mesh, to_world: DAffine3) -> Option<MeterSurface> {
    let point = |i: u32| {
        let p = mesh.positions.get(i as usize)?;
        Some(to_world.transform_point3(DVec3::from_array(p.map(f64::from))).as_vec3())
    };
    let mirror = to_world.matrix3.determinant().signum() as f32;
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for corners in &mesh.triangles {
        let [p0, p1, p2] = corners.map(point);
        let (p0, p1, p2) = (p0?, p1?, p2?);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let normal = e1.cross(e2).normalize_or_zero() * mirror;
        triangles.push(EmitterTriangle { p0, e1, e2, normal, coat: 0.0 });
    }
    let to_normal = to_world.matrix3.inverse().transpose();
    let normal = |n: &[f32; 3]| {
        let n = to_normal * DVec3::from_array(n.map(f64::from));
        n.normalize_or_zero().as_vec3()
    };
    let mut normals: Vec<[Vec3; 3]> = Vec::new();
    if let Some(given) = &mesh.normals {
        for (i, corners) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = given.corners(i, *corners).map(|n| given.values.get(n as usize));
            normals.push([normal(a?), normal(b?), normal(c?)]);
        }
    }
    MeterSurface::triangles(triangles, normals)
}
