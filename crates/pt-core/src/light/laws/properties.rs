//! Properties of lights that the laws take into account.

use pt_math::DVec3;

use super::super::{EmitterTriangle, LightTables, SphereLight};

/// Properties of a light that the laws take into account and cannot derive.
pub(in crate::light) trait LightLaws {
    /// Returns true if samples depend on the surface of the receiving point.
    fn depends_on_surface(&self) -> bool;
    /// Geometry of the light, which rays hit.
    fn geometry(&self, tables: &LightTables) -> LightGeometry;
    /// Irradiance at `p` on a surface of unit normal `n` without occlusion, by its closed form or
    /// by quadrature.
    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64;
}

/// Geometry of a light in the scene.
pub(in crate::light) enum LightGeometry {
    /// No geometry: rays do not hit the light.
    None,
    /// Triangles that emit on their front, with the numbers of their primitives.
    Triangles(Vec<(EmitterTriangle, u32)>),
    /// A sphere that emits on one side.
    Sphere(SphereLight),
}
