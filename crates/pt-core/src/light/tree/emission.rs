//! What is known of the light of a node.

use std::f32::consts::{FRAC_PI_2, PI};

use pt_math::{Bounds3, Spectrum, Vec3, trig};

use super::super::{AnyLight, Falloff, LightTables, SphereLight, Spot};
use super::TreeLight;

/// Bounds of some lights: where they are, where to they shine, and how much.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emission {
    pub(super) bounds: Bounds3,
    /// Middle of the directions of their axes (of triangles, the normals).
    axis: Vec3,
    /// Greatest angle between it and one of them, θo, and its sine and cosine.
    spread: f32,
    sin_cos_spread: (f32, f32),
    /// Greatest angle to its own axis at which one of them shines, θe, and its cosine.
    reach: f32,
    cos_reach: f32,
    /// Irradiance at distance 1 of all, if they face the point.
    pub(super) strength: f32,
}

/// Less than what rounding may do to a cosine is no reason to leave out a light.
const MARGIN: f32 = 1e-3;

impl Emission {
    fn new(bounds: Bounds3, axis: Vec3, spread: f32, reach: f32, strength: f32) -> Self {
        Self {
            bounds,
            axis,
            spread,
            sin_cos_spread: trig::sin_cos(spread),
            reach,
            cos_reach: trig::sin_cos(reach).1,
            strength,
        }
    }

    /// Of one light.
    pub(super) fn of(light: &TreeLight, tables: &LightTables) -> Self {
        let at = |p: Vec3| std::iter::once(p).collect::<Bounds3>();
        match light {
            TreeLight::Triangle(t, radiance) => {
                let corners = [t.p0, t.p0 + t.e1, t.p0 + t.e2];
                let strength = radiance.luminance() * t.area();
                Self::new(corners.into_iter().collect(), t.normal, 0.0, FRAC_PI_2, strength)
            }
            TreeLight::Textured(t, laid) => {
                let mean = tables.textured_triangles[*laid as usize].mean;
                Self::of(&TreeLight::Triangle(*t, Spectrum::splat(mean)), tables)
            }
            TreeLight::Other(AnyLight::Spot(spot)) => Self::of_spot(spot, 1.0),
            TreeLight::Other(AnyLight::Projector(projector)) => {
                Self::of_spot(&projector.spot, tables.slides[projector.slide as usize].mean)
            }
            TreeLight::Other(AnyLight::Sphere(s)) => Self::of_sphere(s, 1.0),
            TreeLight::Other(AnyLight::TexturedSphere(s)) => {
                Self::of_sphere(&s.sphere, tables.sphere_maps[s.map as usize].mean)
            }
            TreeLight::Other(AnyLight::Point(l)) => {
                Self::everywhere(at(l.position), l.intensity.luminance())
            }
            TreeLight::Other(AnyLight::Ies(l)) => {
                let mean = tables.profiles[l.profile as usize].mean_candela();
                Self::everywhere(at(l.position), l.scale.luminance() * mean)
            }
            TreeLight::Other(other) => unreachable!("{other:?} is in no tree"),
        }
    }

    /// Of a spot with a share of its light.
    fn of_spot(spot: &Spot, share: f32) -> Self {
        let reach = match spot.falloff {
            Falloff::Cosine { cos_cutoff, .. } => trig::acos(cos_cutoff),
            Falloff::Linear { cutoff, .. } => cutoff,
        };
        let strength = spot.intensity.luminance() * share;
        let bounds = std::iter::once(spot.position).collect();
        Self::new(bounds, spot.axis, 0.0, reach.min(PI), strength)
    }

    /// Of a sphere with a share of its light.
    fn of_sphere(s: &SphereLight, share: f32) -> Self {
        let radius = Vec3::splat(s.radius);
        let bounds = Bounds3 { min: s.center - radius, max: s.center + radius };
        let strength = s.radiance.luminance() * PI * s.radius * s.radius;
        Self::everywhere(bounds, strength * share)
    }

    fn everywhere(bounds: Bounds3, strength: f32) -> Self {
        Self::new(bounds, Vec3::Z, PI, FRAC_PI_2, strength)
    }

    /// Of two together. [Conty Estevez & Kulla 2018, §4.2, the union of cones]
    pub(super) fn union(&self, other: &Self) -> Self {
        let (axis, spread) = cone_union((self.axis, self.spread), (other.axis, other.spread));
        let reach = self.reach.max(other.reach);
        let bounds = self.bounds.union(other.bounds);
        Self::new(bounds, axis, spread, reach, self.strength + other.strength)
    }

    /// The measure of directions into which it shines, by which builders weigh its strength.
    /// [Conty Estevez & Kulla 2018, eq. 1]
    pub(super) fn orientation_cost(&self) -> f32 {
        let (sin, cos) = self.sin_cos_spread;
        let widest = (self.spread + self.reach).min(PI);
        let beyond = 2.0 * widest * sin
            - trig::sin_cos((self.spread - 2.0 * widest).abs()).1
            - 2.0 * self.spread * sin
            + cos;
        2.0 * PI * (1.0 - cos) + FRAC_PI_2 * beyond
    }

    /// How much it may matter at `p`; 0 only where it does not shine.
    ///
    /// strength · cos θ′ / d², with the least angle θ′ that an axis may have towards `p` from anywhere
    /// in the sphere around the bounds.
    #[inline]
    pub(super) fn importance(&self, p: Vec3) -> f32 {
        const MOST: f32 = 1e30;
        let to_p = p - self.bounds.center();
        let distance_squared = to_p.length_squared();
        let radius_squared = 0.25 * self.bounds.diagonal().length_squared();
        let cos = if distance_squared <= radius_squared {
            1.0
        } else {
            let distance = distance_squared.sqrt();
            let cos_axis = (self.axis.dot(to_p) / distance).clamp(-1.0, 1.0);
            let sin_axis = (1.0 - cos_axis * cos_axis).sqrt();
            let beyond_spread = less((sin_axis, cos_axis), self.sin_cos_spread);
            let sin2 = radius_squared / distance_squared;
            less(beyond_spread, (sin2.sqrt(), (1.0 - sin2).sqrt())).1
        };
        if cos < self.cos_reach - MARGIN {
            return 0.0;
        }
        let nearest = distance_squared.max(radius_squared).max(f32::MIN_POSITIVE);
        (self.strength * cos.max(MARGIN) / nearest).min(MOST)
    }
}

/// Sine and cosine of max(0, a − b), of angles from 0 to π that are given so.
#[inline]
fn less((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> (f32, f32) {
    if cos_a > cos_b {
        (0.0, 1.0)
    } else {
        (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b)
    }
}

/// The least cone around two, as axis and half angle.
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = trig::acos(wide.0.dot(narrow.0).clamp(-1.0, 1.0));
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let half = 0.5 * (wide.1 + between + narrow.1);
    let across = narrow.0 - wide.0 * wide.0.dot(narrow.0);
    match across.try_normalize() {
        Some(across) if half < PI => {
            let (sin, cos) = trig::sin_cos(half - wide.1);
            (wide.0 * cos + across * sin, half)
        }
        _ => (wide.0, PI),
    }
}

/// Whether a light can be in a tree.
pub(crate) fn is_bounded(light: &AnyLight) -> bool {
    use AnyLight::{Ies, Point, Projector, Sphere, Spot, TexturedSphere};
    matches!(light, Point(_) | Spot(_) | Projector(_) | Ies(_) | Sphere(_) | TexturedSphere(_))
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;

    /// Directions within one of two cones are within their union.
    #[test]
    fn unions_of_cones_hold_both() {
        let mut random = Random::new(2);
        for _ in 0..2000 {
            let mut cone = || (random.direction(), random.unit() * random.unit() * PI);
            let (a, b) = (cone(), cone());
            let (axis, spread) = cone_union(a, b);
            for (of, half) in [a, b] {
                for _ in 0..10 {
                    let across = of.cross(random.direction()).normalize();
                    let (sin, cos) = trig::sin_cos(half * random.unit());
                    let w = of * cos + across * sin;
                    let angle = trig::acos(w.dot(axis).clamp(-1.0, 1.0));
                    assert!(angle <= spread + 2e-3, "{a:?} {b:?}: {angle} {spread}");
                }
            }
        }
    }
}
