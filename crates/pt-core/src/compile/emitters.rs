//! Lights of emissive shapes.

use pt_bvh::Sphere;
use pt_math::{DAffine3, DVec3, Spectrum, Vec3};

use crate::compile::shapes::Shapes;
use crate::light::{EmitterTriangle, SphereLight};

/// Light of an emissive sphere.
pub(super) fn sphere_light(
    shapes: &Shapes,
    sphere: usize,
    radiance: Spectrum,
    coat: f32,
) -> SphereLight {
    let Sphere { center, radius } = shapes.spheres[sphere];
    SphereLight { center, radius: radius.abs(), radiance, inward: radius < 0.0, coat }
}

pub(super) fn emitter_triangles(
    shapes: &Shapes,
    runs: &[std::ops::Range<usize>],
    coat: f32,
) -> Vec<EmitterTriangle> {
    let all = runs.iter().flat_map(Clone::clone);
    all.map(|i| {
        let [p0, p1, p2] = shapes.corners(i);
        EmitterTriangle { p0, e1: p1 - p0, e2: p2 - p0, normal: shapes.front(i), coat }
    })
    .collect()
}

/// A corner and the two edges of the unit square of an area light.
pub(super) fn area_square(to_world: DAffine3) -> (Vec3, Vec3, Vec3) {
    let origin = to_world.transform_point3(DVec3::new(-0.5, -0.5, 0.0)).as_vec3();
    (origin, to_world.matrix3.x_axis.as_vec3(), to_world.matrix3.y_axis.as_vec3())
}
