//! Polygons to triangles.

use pt_math::DVec3;

/// Corners up to which concave polygons are cut well; beyond, the time would grow too long (it is
/// the number of corners times the number of concave ones).
const MAX_CONCAVE: usize = 10_000;

/// Cuts polygons into triangles; keeps its memory from one polygon to the next.
#[derive(Default)]
pub(in crate::format) struct Triangulator {
    /// The corners in the plane of the polygon, which runs counter-clockwise there.
    plane: Vec<[f64; 2]>,
    next: Vec<usize>,
    previous: Vec<usize>,
    /// Corners that are concave in what is left of the polygon.
    concave: Vec<usize>,
}

impl Triangulator {
    /// Gives n − 2 triangles, as numbers of corners, that keep the orientation of a polygon of n
    /// corners. False if the polygon was concave but too large to be cut properly.
    ///
    /// A convex polygon becomes a fan around its first corner; others lose one ear after the
    /// other: a convex corner whose triangle contains no other corner [Meisters 1975]. Polygons
    /// that are not flat are seen along their mean normal.
    pub(in crate::format) fn cut(
        &mut self,
        corners: &[DVec3],
        mut emit: impl FnMut([usize; 3]),
    ) -> bool {
        let n = corners.len();
        self.project(corners);
        let is_convex = (0..n).all(|i| self.turn((i + n - 1) % n, i, (i + 1) % n) >= 0.0);
        if is_convex || n > MAX_CONCAVE {
            (2..n).for_each(|i| emit([0, i - 1, i]));
            return is_convex;
        }
        self.cut_ears(n, emit);
        true
    }

    /// Looks at the polygon along the largest component of its normal.
    ///
    /// The normal is Σ pᵢ × pᵢ₊₁ (twice the vector area; Newell's method), with the coordinates
    /// taken from the first corner so that nothing is lost far from the origin.
    fn project(&mut self, corners: &[DVec3]) {
        let origin = corners.first().copied().unwrap_or_default();
        let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
        let normal: DVec3 = pairs.map(|(p, q)| (p - origin).cross(q - origin)).sum();
        let a = normal.abs();
        let (u, v, w) = if a.z >= a.x && a.z >= a.y {
            (0, 1, normal.z)
        } else if a.x >= a.y {
            (1, 2, normal.x)
        } else {
            (2, 0, normal.y)
        };
        let (u, v) = if w < 0.0 { (v, u) } else { (u, v) };
        self.plane.clear();
        self.plane.extend(corners.iter().map(|p| {
            let p = *p - origin;
            [p[u], p[v]]
        }));
    }

    /// Twice the area of the triangle of three corners; negative where it runs clockwise.
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let [[ax, ay], [bx, by], [cx, cy]] = [self.plane[a], self.plane[b], self.plane[c]];
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    }

    fn is_concave(&self, i: usize) -> bool {
        self.turn(self.previous[i], i, self.next[i]) < 0.0
    }

    /// Whether a corner can be cut off. A triangle without area always can.
    fn is_ear(&self, i: usize) -> bool {
        let (a, b, c) = (self.previous[i], i, self.next[i]);
        let area = self.turn(a, b, c);
        if area <= 0.0 {
            return area == 0.0;
        }
        let is_corner = |p: usize| [a, b, c].iter().any(|q| self.plane[*q] == self.plane[p]);
        let is_inside = |p: usize| {
            self.turn(a, b, p) >= 0.0 && self.turn(b, c, p) >= 0.0 && self.turn(c, a, p) >= 0.0
        };
        !self.concave.iter().any(|p| is_inside(*p) && !is_corner(*p))
    }

    /// Cuts off ears until a triangle is left. A polygon that crosses itself may have none; then
    /// the next corner goes.
    fn cut_ears(&mut self, n: usize, mut emit: impl FnMut([usize; 3])) {
        self.next.clear();
        self.next.extend((0..n).map(|i| (i + 1) % n));
        self.previous.clear();
        self.previous.extend((0..n).map(|i| (i + n - 1) % n));
        self.concave.clear();
        let concave = (0..n).filter(|i| self.is_concave(*i)).collect();
        self.concave = concave;
        let mut is_ear: Vec<bool> = (0..n).map(|i| self.is_ear(i)).collect();
        let mut at = 0;
        for left in (3..=n).rev() {
            let mut looked_at = 0;
            while !is_ear[at] && looked_at < left {
                at = self.next[at];
                looked_at += 1;
            }
            let (before, after) = (self.previous[at], self.next[at]);
            emit([before, at, after]);
            self.next[before] = after;
            self.previous[after] = before;
            self.concave.retain(|i| *i != at);
            for i in [before, after] {
                if !self.is_concave(i) {
                    self.concave.retain(|other| *other != i);
                }
            }
            for i in [before, after] {
                is_ear[i] = self.is_ear(i);
            }
            at = after;
        }
    }
}
