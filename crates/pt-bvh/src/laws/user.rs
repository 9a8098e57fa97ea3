//! Hits in trees over user primitives are those of a loop over all of them.

use proptest::prelude::*;
use pt_math::{Bounds3, DVec3, Ray, Vec3};

use super::agreement::point;
use crate::{BuildError, DEFAULT_ERROR_BOUND, UserBvh, UserPrimitives};

/// Asserts that all queries return the hits of a loop over the primitives; returns the number of
/// rays that hit.
pub(super) fn assert_looped<P>(bvh: &UserBvh<P>, rays: &[Ray]) -> usize
where
    P: UserPrimitives<Hit: PartialEq + std::fmt::Debug>,
{
    let primitives = bvh.primitives();
    let looped = |ray: &Ray| {
        let hits = (0..primitives.len() as u32).filter_map(|id| primitives.intersect(id, ray));
        // The first of several minima.
        hits.min_by(|a, b| P::t(a).total_cmp(&P::t(b)))
    };
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    bvh.intersect_batch(rays, &mut hits);
    bvh.occluded_batch(rays, &mut occluded);
    assert_eq!([hits.len(), occluded.len()], [rays.len(); 2]);
    for (i, ray) in rays.iter().enumerate() {
        let expected = looped(ray);
        assert_eq!([bvh.intersect(ray), hits[i]], [expected; 2], "{ray:?}");
        assert_eq!([bvh.occluded(ray), occluded[i]], [expected.is_some(); 2], "{ray:?}");
    }
    hits.iter().flatten().count()
}

/// Analytic shapes.
#[derive(Clone, Copy, Debug)]
enum Shape {
    /// Disc with a unit axis.
    Disc { center: DVec3, axis: DVec3, radius: f64 },
    /// All points within `radius` of a line segment.
    Capsule { ends: [DVec3; 2], radius: f64 },
    /// Torus around z, intersected by ray marching, so that hits are off by `Shape::MARCH`.
    Torus { center: DVec3, radii: [f64; 2] },
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ShapeHit {
    t: f32,
    id: u32,
}

impl Shape {
    /// Tolerance of ray marching at a torus, relative to the distance to it.
    const MARCH: f64 = 1e-3;

    fn roots(&self, o: DVec3, d: DVec3) -> Vec<f64> {
        match *self {
            Self::Disc { center, axis, radius } => {
                let t = (center - o).dot(axis) / d.dot(axis);
                let is_inside = (o + d * t - center).length() <= radius;
                Vec::from_iter(is_inside.then_some(t))
            }
            Self::Capsule { ends: [a, b], radius } => {
                let line = b - a;
                let part = |v: DVec3| v.dot(line) / line.length_squared();
                let is_side = |t: &f64| (0.0..=1.0).contains(&part(o + d * *t - a));
                let across = |v: DVec3| v - line * part(v);
                let side = quadratic(across(o - a), across(d), radius).into_iter().filter(is_side);
                let caps = [a, b].map(|end| quadratic(o - end, d, radius));
                let caps = caps.into_iter().flatten().filter(|t| !is_side(t));
                side.chain(caps).collect()
            }
            Self::Torus { center, radii: [large, small] } => {
                let distance = |p: DVec3| {
                    let q = p - center;
                    (q.truncate().length() - large).hypot(q.z) - small
                };
                let (mut t, reach) = (0.0, (o - center).length() + large + small);
                while t * d.length() < 2.0 * reach {
                    let step = distance(o + d * t).abs();
                    if step <= Self::MARCH * reach * 0.5 {
                        return vec![t];
                    }
                    t += step / d.length();
                }
                Vec::new()
            }
        }
    }

    fn bounds(&self) -> Bounds3 {
        let (points, extent) = match *self {
            Self::Disc { center, axis, radius } => {
                ([center; 2], radius * (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt))
            }
            Self::Capsule { ends, radius } => (ends, DVec3::splat(radius)),
            Self::Torus { center, radii: [large, small] } => {
                ([center; 2], DVec3::new(large, large, 0.0) + small)
            }
        };
        let corners = points.into_iter().flat_map(|p| [p - extent, p + extent]);
        corners.map(DVec3::as_vec3).collect()
    }
}

/// Solutions t of |f + t·d| = r.
fn quadratic(f: DVec3, d: DVec3, r: f64) -> Vec<f64> {
    let (a, b, c) = (d.dot(d), f.dot(d), f.dot(f) - r * r);
    let root = (b * b - a * c).sqrt();
    if root.is_nan() || a == 0.0 { Vec::new() } else { vec![(-b - root) / a, (-b + root) / a] }
}

impl UserPrimitives for Vec<Shape> {
    type Hit = ShapeHit;

    fn len(&self) -> usize {
        self.len()
    }

    fn bounds(&self, id: u32) -> Option<Bounds3> {
        Some(self[id as usize].bounds())
    }

    fn error_bound(&self, id: u32) -> f32 {
        match self[id as usize] {
            Shape::Torus { .. } => Shape::MARCH as f32,
            _ => DEFAULT_ERROR_BOUND,
        }
    }

    fn intersect(&self, id: u32, ray: &Ray) -> Option<ShapeHit> {
        let roots = self[id as usize].roots(ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let roots = roots.into_iter().map(|t| t as f32);
        let t = roots.filter(|&t| t > ray.t_min && t < ray.t_max).min_by(f32::total_cmp)?;
        Some(ShapeHit { t, id })
    }

    fn t(hit: &ShapeHit) -> f32 {
        hit.t
    }
}

fn shape() -> impl Strategy<Value = Shape> {
    let axis = prop_oneof![Just(Vec3::X), Just(Vec3::Y), Just(Vec3::Z), point()];
    let axis = axis.prop_map(|v| v.as_dvec3().normalize_or(DVec3::Y));
    let place = || point().prop_map(Vec3::as_dvec3);
    let radius = || prop_oneof![Just(0.5f64), Just(1.0), 0.01..2.0];
    let capsule = (place(), place(), radius());
    prop_oneof![
        2 => (place(), axis, radius())
            .prop_map(|(center, axis, radius)| Shape::Disc { center, axis, radius }),
        2 => capsule.prop_map(|(a, b, radius)| Shape::Capsule { ends: [a, b + 1e-3], radius }),
        1 => (place(), radius(), 0.1..0.5)
            .prop_map(|(center, large, small)| Shape::Torus { center, radii: [large, small] }),
    ]
}

fn ray() -> impl Strategy<Value = Ray> {
    let axis = || prop_oneof![Just(0.0f32), Just(1.0), Just(-1.0)];
    let along = [axis(), axis(), axis()].prop_map(Vec3::from_array);
    let direction = prop_oneof![along, point()];
    let interval = prop_oneof![4 => Just((0.0, f32::INFINITY)), 1 => (0.0f32..3.0, 0.0f32..9.0)];
    (point(), direction, interval).prop_map(|(origin, direction, (t_min, t_max))| Ray {
        origin,
        direction,
        t_min,
        t_max,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn shapes_are_hit_as_in_a_loop(
        shapes in prop::collection::vec(shape(), 0..40),
        rays in prop::collection::vec(ray(), 300),
    ) {
        let bvh = UserBvh::build(shapes).expect("there are few");
        assert_looped(&bvh, &rays);
    }
}

fn discs(radii: &[f64]) -> Vec<Shape> {
    let disc = |&radius| Shape::Disc { center: DVec3::ZERO, axis: DVec3::Z, radius };
    radii.iter().map(disc).collect()
}

#[test]
fn of_coincident_primitives_the_first_is_hit() {
    let bvh = UserBvh::build(discs(&[1.0, 3.0, 2.0, 3.0, 3.0])).expect("there are few");
    let hit = |x: f32| bvh.intersect(&Ray::new(Vec3::new(x, 0.0, -5.0), Vec3::Z)).map(|h| h.id);
    assert_eq!([0.5, 1.5, 2.5, 3.5].map(hit), [Some(0), Some(1), Some(1), None]);
}

#[test]
fn changed_primitives_are_hit_where_they_are() {
    let mut bvh = UserBvh::build(discs(&[1.0])).expect("there are few");
    let far = Shape::Capsule { ends: [DVec3::Y * 7.0, DVec3::Y * 9.0], radius: 0.5 };
    let number = bvh.update(|shapes| {
        shapes.push(far);
        shapes.len()
    });
    assert_eq!(number, Ok(2));
    let ray = Ray::new(Vec3::new(0.0, 8.0, -5.0), Vec3::Z);
    assert_eq!(bvh.intersect(&ray), Some(ShapeHit { t: 4.5, id: 1 }));
    assert_eq!(bvh.update(Vec::clear), Ok(()));
    assert!(bvh.bounds().is_empty() && !bvh.occluded(&ray));
}

/// Primitives that all rays hit at t = 1, with arbitrary boxes and error bounds.
struct Boxes(Vec<(Option<Bounds3>, f32)>);

impl UserPrimitives for Boxes {
    type Hit = u32;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn bounds(&self, id: u32) -> Option<Bounds3> {
        self.0[id as usize].0
    }

    fn error_bound(&self, id: u32) -> f32 {
        self.0[id as usize].1
    }

    fn intersect(&self, id: u32, _: &Ray) -> Option<u32> {
        Some(id)
    }

    fn t(_: &u32) -> f32 {
        1.0
    }
}

#[test]
fn unusable_primitives_are_skipped_and_counted() {
    let around = |p: Vec3| Bounds3 { min: p - 1.0, max: p + 1.0 };
    let good = around(Vec3::ZERO);
    let bvh = UserBvh::build(Boxes(vec![
        (None, 0.0),
        (Some(Bounds3::EMPTY), 0.0),
        (Some(around(Vec3::new(0.0, f32::NAN, 0.0))), 0.0),
        (Some(around(Vec3::X * 1e19)), 0.0),
        (Some(good), f32::NAN),
        (Some(good), -1e-6),
        (Some(good), f32::INFINITY),
        (Some(good), 0.0),
        (Some(good), 128.0),
    ]));
    let bvh = bvh.expect("there are few");
    assert_eq!((bvh.skipped(), bvh.bounds()), (7, good));
    assert_eq!(bvh.intersect(&Ray::new(Vec3::Z, Vec3::X)), Some(7));
}

#[test]
fn nothing_is_hit_outside_of_the_interval() {
    let bvh = UserBvh::build(Boxes(vec![(Some(Bounds3::point(Vec3::X)), 0.0)]));
    let bvh = bvh.expect("there is one");
    let hit = |t_min, t_max| {
        let ray = Ray { t_min, t_max, ..Ray::new(Vec3::ZERO, Vec3::X) };
        bvh.intersect(&ray)
    };
    assert_eq!(hit(0.5, 1.5), Some(0));
    for (t_min, t_max) in [(1.0, 2.0), (0.0, 1.0), (2.0, 0.0), (0.0, f32::NAN)] {
        assert_eq!(hit(t_min, t_max), None, "{t_min} {t_max}");
    }
}

/// More primitives than allowed.
struct Endless;

impl UserPrimitives for Endless {
    type Hit = ();

    fn len(&self) -> usize {
        (1 << 30) + 1
    }

    fn bounds(&self, _: u32) -> Option<Bounds3> {
        None
    }

    fn intersect(&self, _: u32, _: &Ray) -> Option<()> {
        None
    }

    fn t((): &()) -> f32 {
        0.0
    }
}

#[test]
fn too_many_primitives_are_an_error() {
    let error = BuildError::TooManyPrimitives { primitives: (1 << 30) + 1 };
    assert_eq!(UserBvh::build(Endless).err(), Some(error));
}
