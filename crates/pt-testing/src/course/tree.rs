//! Bounding volume hierarchy, split at the median of the longest axis.

use pt_math::DVec3;

use super::{Material, Shape};

/// Maximum number of shapes in a leaf.
const LEAF: usize = 4;

/// A box with the indices of its shapes, or two smaller boxes.
pub(super) struct Tree {
    low: DVec3,
    high: DVec3,
    shapes: Vec<usize>,
    halves: Option<Box<[Tree; 2]>>,
}

impl Tree {
    pub(super) fn new(shapes: &[(Shape, Material)]) -> Self {
        Self::of(shapes, (0..shapes.len()).collect())
    }

    fn of(shapes: &[(Shape, Material)], mut inside: Vec<usize>) -> Self {
        let boxes = |i: &usize| bounds(&shapes[*i].0);
        let low = inside.iter().map(|i| boxes(i)[0]).fold(DVec3::INFINITY, DVec3::min);
        let high = inside.iter().map(|i| boxes(i)[1]).fold(DVec3::NEG_INFINITY, DVec3::max);
        let halves = (inside.len() > LEAF).then(|| {
            let size = (high - low).to_array();
            let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
            let middle = |i: &usize| boxes(i).iter().map(|corner| corner[axis]).sum::<f64>();
            inside.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
            let rest = inside.split_off(inside.len() / 2);
            Box::new([Self::of(shapes, std::mem::take(&mut inside)), Self::of(shapes, rest)])
        });
        Self { low, high, shapes: inside, halves }
    }

    /// Box around all shapes.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }

    /// Nearest shape along a ray, between two distances: its index, distance, and normal.
    pub(super) fn nearest(
        &self,
        shapes: &[(Shape, Material)],
        origin: DVec3,
        d: DVec3,
        least: f64,
        most: f64,
    ) -> Option<(usize, f64, DVec3)> {
        let (a, b) = ((self.low - origin) / d, (self.high - origin) / d);
        let enter = a.min(b).max_element().max(least);
        let leave = a.max(b).min_element().min(most);
        // Tolerates flat boxes, and rounding.
        if enter > leave + 1e-9 * (1.0 + leave.abs().min(1e9)) {
            return None;
        }
        let mut found: Option<(usize, f64, DVec3)> = None;
        for half in self.halves.iter().flat_map(|halves| halves.iter()) {
            let limit = found.map_or(most, |(_, t, _)| t);
            found = half.nearest(shapes, origin, d, least, limit).or(found);
        }
        for &i in &self.shapes {
            let limit = found.map_or(most, |(_, t, _)| t);
            let hit = meet(&shapes[i].0, origin, d).filter(|(t, _)| least < *t && *t < limit);
            found = hit.map(|(t, normal)| (i, t, normal)).or(found);
            // The far side of a ball may be the first intersection beyond `least`.
            if let (None, Shape::Ball(middle, radius)) = (hit, &shapes[i].0) {
                let far = far_side(*middle, *radius, origin, d);
                let far = far.filter(|(t, _)| least < *t && *t < limit);
                found = far.map(|(t, normal)| (i, t, normal)).or(found);
            }
        }
        found
    }
}

fn bounds(shape: &Shape) -> [DVec3; 2] {
    match shape {
        Shape::Ball(middle, radius) => [*middle - *radius, *middle + *radius],
        Shape::Triangle([a, b, c], _) => [a.min(*b).min(*c), a.max(*b).max(*c)],
    }
}

/// First intersection of a line with a shape: distance and normal.
fn meet(shape: &Shape, origin: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
    match shape {
        Shape::Ball(middle, radius) => {
            let (near, _) = sides(*middle, *radius, origin, d)?;
            Some((near, (origin + near * d - *middle) / *radius))
        }
        // [Möller & Trumbore 1997]
        Shape::Triangle([p0, p1, p2], normals) => {
            let (e1, e2, s) = (*p1 - *p0, *p2 - *p0, origin - *p0);
            let (s1, s2) = (d.cross(e2), s.cross(e1));
            let det = s1.dot(e1);
            let [t, u, v] = [s2.dot(e2), s1.dot(s), s2.dot(d)].map(|x| x / det);
            let is_inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            let normal = normals[0] * (1.0 - u - v) + normals[1] * u + normals[2] * v;
            is_inside.then_some((t, normal))
        }
    }
}

fn far_side(middle: DVec3, radius: f64, origin: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
    let (_, far) = sides(middle, radius, origin, d)?;
    Some((far, (origin + far * d - middle) / radius))
}

/// Both distances at which a line of unit direction meets a sphere.
fn sides(middle: DVec3, radius: f64, origin: DVec3, d: DVec3) -> Option<(f64, f64)> {
    let to = origin - middle;
    let b = to.dot(d);
    let discriminant = b * b - (to.length_squared() - radius * radius);
    let root = (discriminant >= 0.0).then(|| discriminant.sqrt())?;
    Some((-b - root, -b + root))
}
