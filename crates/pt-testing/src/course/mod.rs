//! Path tracer after the handout of the university course, assignments 3-1 and 3-2: slow, short,
//! and without code of the renderer, so that it does not share its errors.
//!
//! It has its own camera, intersections, tree, random choices, estimators and adaptive sampling,
//! all in double precision. The peculiarities of the course are reproduced: an area light is
//! multiplied by the distance to it, and a point light has no distance attenuation. Scattered rays
//! do not add emission or the sky, mirrors and glass have no direct light, and Russian roulette
//! continues with a fixed probability from the second indirect bounce on.

mod lights;
mod metal;
mod scene;
mod tree;

use std::f64::consts::PI;

pub use lights::{CourseLight, Map};
pub use metal::BeckmannMetal;
use pt_math::DVec3;
pub use scene::{BoxContent, Room};
use tree::Tree;

use crate::Random;

/// Offset of ray origins, and of the ends of shadow rays before the light.
const EPSILON: f64 = 1e-5;
/// Continuation probability of Russian roulette. The mean does not depend on it.
const GOES_ON: f64 = 0.65;

/// Scattering or emission of a surface.
#[derive(Clone, Copy, Debug)]
pub enum Material {
    /// Lambertian reflection with this albedo.
    Diffuse(DVec3),
    /// Emission of this radiance on both sides, without reflection.
    Emission(DVec3),
    /// Perfect mirror.
    Mirror,
    /// Glass that reflects and transmits, with this index of refraction.
    Glass(f64),
    /// Glass that transmits all light without total internal reflection, with this index of
    /// refraction.
    Refraction(f64),
    /// Microfacet metal.
    Microfacet(BeckmannMetal),
}

/// Geometric shape.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Sphere: center and radius.
    Ball(DVec3, f64),
    /// Triangle: vertices, and the normals there.
    Triangle([DVec3; 3], [DVec3; 3]),
}

/// Scene of the reference tracer.
pub struct World {
    shapes: Vec<(Shape, Material)>,
    lights: Vec<CourseLight>,
    tree: Tree,
}

/// Point on a surface.
struct CourseHit {
    p: DVec3,
    normal: DVec3,
    material: Material,
}

/// Camera of the reference tracer.
pub struct Eye {
    position: DVec3,
    right: DVec3,
    up: DVec3,
    back: DVec3,
    /// Half of the width and height of the image plane at distance 1.
    half: [f64; 2],
    /// Radius of the lens, and distance of the plane in focus.
    lens: [f64; 2],
}

/// Options of the course's program.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Maximum number of interactions with surfaces: `-m`.
    pub depth: u32,
    /// Number of samples of each light: `-l`.
    pub light_samples: u32,
    /// True if direct light is estimated by directions of the hemisphere: `-H`.
    pub hemisphere: bool,
    /// True for light of up to `depth` interactions, false for exactly `depth`: `-o`.
    pub accumulate: bool,
}

impl Eye {
    /// Camera of a file: `ahead` is the point one unit in front of it, seen from the origin, and
    /// `x_fov` its field of view in degrees. `size` is the size of the image.
    pub fn of_course(world: &World, ahead: DVec3, x_fov: f64, aspect: f64, size: [u32; 2]) -> Self {
        let [low, high] = world.tree.bounds();
        let (target, distance) = (0.5 * (low + high), 1.5 * (high - low).length());
        let d = ahead.normalize();
        let (phi, theta) = (libm::acos(d.y), libm::atan2(d.x, d.z));
        let back = DVec3::new(
            libm::sin(phi) * libm::sin(theta),
            libm::cos(phi),
            libm::sin(phi) * libm::cos(theta),
        );
        let right = DVec3::Y.cross(back).normalize();
        // Fitted to a window of 800 × 600, with a fixed size of pixels.
        let half_width = libm::tan(0.5 * x_fov.to_radians());
        let half_height = (half_width / aspect).max(half_width * 0.75);
        let pixel = half_height / 300.0;
        Self {
            position: target + distance * back,
            right,
            up: back.cross(right),
            back,
            half: size.map(|n| 0.5 * f64::from(n) * pixel),
            lens: [0.0, 1.0],
        }
    }

    /// The same camera with a lens of this radius, focused on a plane at this distance: `-b` and
    /// `-d`.
    pub fn with_lens(self, radius: f64, focal_distance: f64) -> Self {
        Self { lens: [radius, focal_distance], ..self }
    }

    /// Origin and direction of a ray through a point of [0, 1]², where (0, 0) is the lower left.
    fn ray(&self, [x, y]: [f64; 2], random: &mut Random) -> (DVec3, DVec3) {
        let [radius, focal_distance] = self.lens;
        let at = [(2.0 * x - 1.0) * self.half[0], (2.0 * y - 1.0) * self.half[1]];
        let in_focus = focal_distance * (at[0] * self.right + at[1] * self.up - self.back);
        let (r, phi) = (radius * unit(random).sqrt(), 2.0 * PI * unit(random));
        let of_lens = r * (libm::cos(phi) * self.right + libm::sin(phi) * self.up);
        (self.position + of_lens, (in_focus - of_lens).normalize())
    }
}

impl World {
    fn new(shapes: Vec<(Shape, Material)>, lights: Vec<CourseLight>) -> Self {
        let tree = Tree::new(&shapes);
        Self { shapes, lights, tree }
    }

    /// The same scene with another light.
    pub fn with_light(mut self, light: CourseLight) -> Self {
        self.lights.push(light);
        self
    }

    /// Nearest surface along a ray.
    fn hit(&self, origin: DVec3, d: DVec3, most: f64) -> Option<CourseHit> {
        let (index, t, normal) = self.tree.nearest(&self.shapes, origin, d, EPSILON, most)?;
        Some(CourseHit { p: origin + t * d, normal, material: self.shapes[index].1 })
    }

    /// (n + 1) / 2 at the first surface; black without one.
    pub fn normal_as_color(&self, eye: &Eye, at: [f64; 2], random: &mut Random) -> DVec3 {
        let (origin, d) = eye.ray(at, random);
        let hit = self.hit(origin, d, f64::INFINITY);
        hit.map_or(DVec3::ZERO, |hit| 0.5 * (hit.normal + DVec3::ONE))
    }

    /// Samples the radiance through a point of the image.
    pub fn radiance(&self, eye: &Eye, at: [f64; 2], plan: &Plan, random: &mut Random) -> DVec3 {
        let (origin, d) = eye.ray(at, random);
        let Some(hit) = self.hit(origin, d, f64::INFINITY) else {
            return self.lights.iter().map(|light| light.seen(d)).sum();
        };
        let zero = if plan.accumulate || plan.depth == 0 { emission(&hit) } else { DVec3::ZERO };
        let more = plan.depth > 0;
        zero + if more { self.bounced(&hit, -d, plan.depth, plan, random) } else { DVec3::ZERO }
    }

    /// Samples light that is scattered at least once, with `depth` interactions left.
    fn bounced(
        &self,
        hit: &CourseHit,
        wo: DVec3,
        depth: u32,
        plan: &Plan,
        r: &mut Random,
    ) -> DVec3 {
        let counts = plan.accumulate || depth == 1;
        if let Some((wi, weight)) = scattered_sharply(hit, wo, r) {
            let Some(next) = self.hit(hit.p, wi, f64::INFINITY) else { return DVec3::ZERO };
            let seen = if counts { emission(&next) } else { DVec3::ZERO };
            let more = depth > 1;
            return weight
                * (seen
                    + if more {
                        self.bounced(&next, -wi, depth - 1, plan, r)
                    } else {
                        DVec3::ZERO
                    });
        }
        if matches!(hit.material, Material::Emission(_)) {
            return DVec3::ZERO;
        }
        let direct = if !counts {
            DVec3::ZERO
        } else if plan.hemisphere {
            self.by_hemisphere(hit, wo, plan, r)
        } else {
            self.by_lights(hit, wo, plan, r)
        };
        // The first indirect bounce is always traced.
        let goes_on = if depth == plan.depth || !plan.accumulate { 1.0 } else { GOES_ON };
        if depth <= 1 || unit(r) >= goes_on {
            return direct;
        }
        let Some((wi, weight)) = scattered(hit, wo, r) else { return direct };
        let next = self.hit(hit.p, wi, f64::INFINITY);
        let indirect = next.map_or(DVec3::ZERO, |n| self.bounced(&n, -wi, depth - 1, plan, r));
        direct + weight * indirect / goes_on
    }

    /// Direct light by light sampling, with the same number of samples for each light that is not a
    /// delta light.
    fn by_lights(&self, hit: &CourseHit, wo: DVec3, plan: &Plan, r: &mut Random) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for light in &self.lights {
            let n = if light.is_delta() { 1 } else { plan.light_samples };
            for _ in 0..n {
                let Some((d, distance, weight)) = light.sample(hit.p, r) else { continue };
                let f_cos = f_cos(hit, wo, d);
                if f_cos != DVec3::ZERO && self.hit(hit.p, d, distance - EPSILON).is_none() {
                    sum += f_cos * weight / f64::from(n);
                }
            }
        }
        sum
    }

    /// Direct light by uniform directions.
    fn by_hemisphere(&self, hit: &CourseHit, wo: DVec3, plan: &Plan, r: &mut Random) -> DVec3 {
        let n = plan.light_samples * self.lights.len() as u32;
        let sum: DVec3 = (0..n)
            .map(|_| {
                let cos = unit(r);
                let d = around(hit.normal, (1.0 - cos * cos).sqrt(), 2.0 * PI * unit(r), cos);
                let seen = self.hit(hit.p, d, f64::INFINITY);
                seen.map_or(DVec3::ZERO, |s| emission(&s) * f_cos(hit, wo, d) * 2.0 * PI)
            })
            .sum();
        sum / f64::from(n)
    }

    /// Number of samples after which a pixel stops, at most `most`. Every `batch` samples it stops
    /// if 1.96 standard errors of its mean luminance are within `tolerance` of the mean.
    pub fn samples_of_pixel(
        &self,
        (eye, size): (&Eye, [u32; 2]),
        [x, y]: [u32; 2],
        plan: &Plan,
        (most, batch, tolerance): (u32, u32, f64),
        random: &mut Random,
    ) -> u32 {
        let (mut s1, mut s2) = (0.0, 0.0);
        for n in 1..=most {
            let at = [f64::from(x) + unit(random), f64::from(y) + unit(random)];
            let at = [at[0] / f64::from(size[0]), at[1] / f64::from(size[1])];
            let l = self.radiance(eye, at, plan, random).dot(DVec3::new(0.2126, 0.7152, 0.0722));
            (s1, s2) = (s1 + l, s2 + l * l);
            if n % batch == 0 {
                let count = f64::from(n);
                let mean = s1 / count;
                let variance = ((s2 - s1 * s1 / count) / (count - 1.0)).max(0.0);
                if 1.96 * (variance / count).sqrt() <= tolerance * mean {
                    return n;
                }
            }
        }
        most
    }
}

/// Emitted radiance of a surface.
fn emission(hit: &CourseHit) -> DVec3 {
    if let Material::Emission(radiance) = hit.material { radiance } else { DVec3::ZERO }
}

/// f cos θ of a surface without delta scattering, for two directions.
fn f_cos(hit: &CourseHit, wo: DVec3, wi: DVec3) -> DVec3 {
    let n = hit.normal.normalize();
    let cos = wi.dot(n);
    match hit.material {
        Material::Diffuse(albedo) if cos > 0.0 => albedo * (cos / PI),
        Material::Microfacet(metal) => metal.f(n, wo, wi) * cos,
        _ => DVec3::ZERO,
    }
}

/// Samples a direction at a surface without delta scattering; returns it and its weight f cos θ /
/// pdf.
fn scattered(hit: &CourseHit, wo: DVec3, r: &mut Random) -> Option<(DVec3, DVec3)> {
    match hit.material {
        // Cosine-weighted.
        Material::Diffuse(albedo) => {
            let (u, phi) = (unit(r), 2.0 * PI * unit(r));
            Some((around(hit.normal, u.sqrt(), phi, (1.0 - u).sqrt()), albedo))
        }
        Material::Microfacet(metal) => {
            let (wi, pdf) = metal.sample(hit.normal.normalize(), wo, r)?;
            Some((wi, f_cos(hit, wo, wi) / pdf))
        }
        _ => None,
    }
}

/// Samples the direction of a mirror or glass; returns it and its weight.
fn scattered_sharply(hit: &CourseHit, wo: DVec3, random: &mut Random) -> Option<(DVec3, f64)> {
    let n = hit.normal.normalize();
    let reflected = 2.0 * wo.dot(n) * n - wo;
    let ior = match hit.material {
        Material::Mirror => return Some((reflected, 1.0)),
        Material::Glass(ior) | Material::Refraction(ior) => ior,
        _ => return None,
    };
    let reflects = matches!(hit.material, Material::Glass(_));
    let cos = wo.dot(n);
    let eta = if cos > 0.0 { 1.0 / ior } else { ior };
    let cos2_refracted = 1.0 - eta * eta * (1.0 - cos * cos);
    let r0 = ((1.0 - ior) / (1.0 + ior)).powi(2);
    let schlick = r0 + (1.0 - r0) * (1.0 - cos.abs()).powi(5);
    if cos2_refracted < 0.0 || reflects && unit(random) < schlick {
        return Some((reflected, if reflects { 1.0 } else { 0.0 }));
    }
    let refracted = -eta * (wo - cos * n) - cos.signum() * cos2_refracted.sqrt() * n;
    Some((refracted, 1.0 / (eta * eta)))
}

/// Direction with these spherical coordinates about a normal.
fn around(normal: DVec3, sin: f64, phi: f64, cos: f64) -> DVec3 {
    let z = normal.normalize();
    let x = if z.x.abs() < 0.5 { DVec3::X } else { DVec3::Y }.cross(z).normalize();
    sin * libm::cos(phi) * x + sin * libm::sin(phi) * z.cross(x) + cos * z
}

/// Uniform number in [0, 1).
pub fn unit(random: &mut Random) -> f64 {
    (random.bits() >> 11) as f64 * (0.5_f64).powi(53)
}
