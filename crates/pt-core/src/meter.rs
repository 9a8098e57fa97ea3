//! Meters: measurements over a surface instead of an image. Every camera ray is a sample of one
//! number.

use std::f32::consts::PI;

use pt_math::distribution::AliasTable;
use pt_math::float_error::gamma;
use pt_math::ray::offset_origin;
use pt_math::sampler::{LANES, Lanes};
use pt_math::{Frame, Ray, Ray8, Vec3, warp};

use crate::light::EmitterTriangle;

/// A meter: the surface from which its rays start, and their directions.
#[derive(Clone, Debug)]
pub struct Meter {
    /// Surface over which the mean is taken.
    pub surface: MeterSurface,
    /// Distribution of rays at a point.
    pub rays: MeterRays,
}

/// The surface of a meter, in metres in the world.
#[derive(Clone, Debug)]
pub enum MeterSurface {
    /// Triangles, sampled by area.
    Triangles {
        /// The triangles.
        triangles: Vec<EmitterTriangle>,
        /// Vertex normals; empty if all triangles are flat.
        normals: Vec<[Vec3; 3]>,
        /// Sampling table of the triangles.
        choice: AliasTable,
    },
    /// A sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius; negative if the front is inside.
        radius: f32,
    },
}

/// Distribution of the rays of a meter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeterRays {
    /// Cosine-weighted hemisphere around the normal, which measures irradiance.
    Hemisphere,
    /// Parallel rays that start in front of a sphere around the scene.
    Parallel {
        /// Unit direction.
        direction: Vec3,
        /// Centre of the sphere.
        center: Vec3,
        /// Radius of the sphere.
        radius: f32,
    },
}

/// A sampled point of a surface.
struct MeterPoint {
    p: Vec3,
    error: Vec3,
    /// Unit geometric normal.
    geometric: Vec3,
    /// Unit normal of the hemisphere over which light is measured.
    normal: Vec3,
}

impl Meter {
    /// Weight of the radiance of each ray: importance over density, W cos θ / p. Irradiance is
    /// ∫ L cos θ dω, whose directions have the density cos θ / π.
    pub fn importance(&self) -> f32 {
        match self.rays {
            MeterRays::Hemisphere => PI,
            MeterRays::Parallel { .. } => 1.0,
        }
    }

    /// Returns the ray from a uniform point of the surface, sampled by `u`, in a direction sampled
    /// by `v`.
    pub fn ray(&self, u: [f32; 2], v: [f32; 2]) -> Ray {
        let at = self.surface.point(u);
        match self.rays {
            MeterRays::Hemisphere => {
                let direction = Frame::from_normal(at.normal).to_world(warp::cosine_hemisphere(v));
                let origin = offset_origin(at.p, at.error, at.geometric, direction);
                Ray::new(origin, direction)
            }
            MeterRays::Parallel { direction, center, radius } => {
                let back = (at.p - center).dot(direction) + radius;
                Ray::new(at.p - direction * back, direction)
            }
        }
    }

    /// Returns [`Self::ray`] of many samples in structure-of-arrays layout.
    pub fn rays(&self, [us, vs]: [&[Lanes<f32>; 2]; 2], rays: &mut [Ray8; LANES / 8]) {
        for i in 0..LANES {
            let ray = self.ray(us.map(|x| x[i]), vs.map(|x| x[i]));
            rays[i / 8].set(i % 8, &ray);
        }
    }
}

impl MeterSurface {
    /// Creates a surface of triangles with the vertex normals of each, or with no normals. `None`
    /// if the triangles have no area.
    pub fn triangles(triangles: Vec<EmitterTriangle>, normals: Vec<[Vec3; 3]>) -> Option<Self> {
        let areas: Vec<f32> = triangles.iter().map(EmitterTriangle::area).collect();
        let choice = AliasTable::new(&areas)?;
        Some(Self::Triangles { triangles, normals, choice })
    }

    /// Samples a uniform point.
    fn point(&self, [u, v]: [f32; 2]) -> MeterPoint {
        match self {
            Self::Triangles { triangles, normals, choice } => {
                let (i, _, u) = choice.sample(u);
                let EmitterTriangle { p0, e1, e2, normal, .. } = triangles[i];
                let [b1, b2] = warp::uniform_triangle([u, v]);
                let (q1, q2) = (e1 * b1, e2 * b2);
                let error = (p0.abs() + q1.abs() + q2.abs()) * gamma(7);
                let smooth = normals.get(i).map_or(normal, |[n0, n1, n2]| {
                    (*n0 * (1.0 - b1 - b2) + *n1 * b1 + *n2 * b2).normalize_or(normal)
                });
                MeterPoint { p: p0 + q1 + q2, error, geometric: normal, normal: smooth }
            }
            &Self::Sphere { center, radius } => {
                let outwards = warp::uniform_sphere([u, v]);
                let offset = outwards * radius.abs();
                let error = (center.abs() + offset.abs()) * gamma(5);
                let normal = outwards * radius.signum();
                MeterPoint { p: center + offset, error, geometric: normal, normal }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::{Chi2, chi2_square};

    use super::*;

    fn flat(p0: Vec3, e1: Vec3, e2: Vec3) -> EmitterTriangle {
        EmitterTriangle { p0, e1, e2, normal: e1.cross(e2).normalize(), coat: 0.0 }
    }

    /// For a square of two triangles, both coordinates are uniform.
    #[test]
    fn points_are_uniform_over_the_area() {
        let corner = Vec3::new(0.25, 0.0, 0.0);
        let triangles = vec![
            flat(Vec3::ZERO, Vec3::X, Vec3::Y),
            flat(Vec3::new(1.0, 1.0, 0.0), Vec3::NEG_X, Vec3::NEG_Y),
        ];
        let triangles: Vec<_> =
            triangles.into_iter().map(|t| EmitterTriangle { p0: t.p0 + corner, ..t }).collect();
        let surface = MeterSurface::triangles(triangles, Vec::new()).expect("it has an area");
        let place = |u| {
            let p = surface.point(u).p - corner;
            Some([p.x, p.y].map(|x| x.clamp(0.0, 1.0f32.next_down())))
        };
        chi2_square(place, |_| 1.0, &Chi2::new("square of a meter")).unwrap();
        assert!(
            MeterSurface::triangles(vec![flat(Vec3::ZERO, Vec3::X, Vec3::X)], Vec::new()).is_none()
        );
    }

    /// Around a normal, cos² and the azimuth are uniform, on the front of both kinds of spheres.
    #[test]
    fn directions_follow_the_cosine() {
        for radius in [2.0, -2.0] {
            let surface = MeterSurface::Sphere { center: Vec3::new(1.0, 2.0, 3.0), radius };
            let meter = Meter { surface, rays: MeterRays::Hemisphere };
            let u = [0.3, 0.7];
            let normal = meter.surface.point(u).normal;
            let frame = Frame::from_normal(normal);
            let around = |v| {
                let ray = meter.ray(u, v);
                let local = frame.to_local(ray.direction);
                let side = (ray.origin - Vec3::new(1.0, 2.0, 3.0)).length() - 2.0;
                assert!(side * radius > 0.0, "on the front: {side}");
                let turn = f32::atan2(local.y, local.x) / (2.0 * PI);
                let below_one = 1.0f32.next_down();
                Some([local.z * local.z, turn.rem_euclid(1.0)].map(|x| x.clamp(0.0, below_one)))
            };
            chi2_square(around, |_| 1.0, &Chi2::new("directions of a meter").one_of(2)).unwrap();
        }
    }

    /// Parallel rays start before the sphere around the scene, wherever their point is.
    #[test]
    fn parallel_rays_come_from_before_the_scene() {
        let direction = Vec3::new(0.0, 0.6, -0.8);
        let (center, radius) = (Vec3::new(3.0, 0.0, 0.0), 5.0);
        let surface = MeterSurface::Sphere { center: Vec3::new(2.0, 1.0, 0.0), radius: 2.0 };
        let meter = Meter { surface, rays: MeterRays::Parallel { direction, center, radius } };
        for u in [[0.1, 0.2], [0.9, 0.4], [0.5, 0.99]] {
            let ray = meter.ray(u, [0.5; 2]);
            assert_eq!(ray.direction, direction);
            assert!(((ray.origin - center).dot(direction) + radius).abs() < 1e-5, "{ray:?}");
            let along = meter.surface.point(u).p - ray.origin;
            assert!((along - direction * along.dot(direction)).length() < 1e-5, "{ray:?}");
        }
    }
}
