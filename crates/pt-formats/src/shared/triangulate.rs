//! Triangulation of polygons.

use pt_math::DVec3;

/// Maximum number of corners for which concave polygons are triangulated correctly; beyond, it
/// could take too long (the number of corners times that of nearby concave ones, which may be all).
const MAX_CONCAVE: usize = 10_000;
/// Number of concave corners per cell of the search grid.
const PER_CELL: usize = 2;

/// Triangulates polygons; keeps its memory from one polygon to the next.
#[derive(Default)]
pub(crate) struct Triangulator {
    /// Corners projected to a plane, where the polygon is counter-clockwise.
    plane: Vec<[f64; 2]>,
    next: Vec<usize>,
    previous: Vec<usize>,
    /// Concave corners of the rest of the polygon.
    concave: PointGrid,
}

/// Points of the plane in a grid of cells.
#[derive(Default)]
struct PointGrid {
    /// Lower corner of the bounding box.
    low: [f64; 2],
    /// Number of cells per unit of length along each axis.
    per_cell: [f64; 2],
    /// Number of cells along each axis.
    side: usize,
    /// Indices of the points of each cell.
    points: Vec<Vec<usize>>,
}

impl PointGrid {
    /// Replaces the content by the points with these indices.
    fn hold(&mut self, plane: &[[f64; 2]], points: &[usize]) {
        let bounds = |fold: fn(f64, f64) -> f64, start: f64| {
            [0, 1].map(|axis| points.iter().map(|p| plane[*p][axis]).fold(start, fold))
        };
        let (low, high) = (bounds(f64::min, f64::INFINITY), bounds(f64::max, f64::NEG_INFINITY));
        self.side = (points.len() / PER_CELL).isqrt().max(1);
        self.low = low;
        // If all points are collinear along an axis, or their distance is infinite, one row of
        // cells suffices.
        self.per_cell = [0, 1].map(|axis| {
            let scale = self.side as f64 / (high[axis] - low[axis]);
            if scale.is_finite() { scale } else { 0.0 }
        });
        self.points.truncate(self.side * self.side);
        self.points.iter_mut().for_each(Vec::clear);
        self.points.resize_with(self.side * self.side, Vec::new);
        for p in points {
            let cell = self.cell(plane[*p]);
            self.points[cell].push(*p);
        }
    }

    /// Returns the cell along an axis; points beyond the grid are in the outermost cells.
    fn along(&self, axis: usize, x: f64) -> usize {
        (((x - self.low[axis]) * self.per_cell[axis]) as usize).min(self.side - 1)
    }

    fn cell(&self, [x, y]: [f64; 2]) -> usize {
        self.along(1, y) * self.side + self.along(0, x)
    }

    fn remove(&mut self, point: usize, place: [f64; 2]) {
        let cell = self.cell(place);
        self.points[cell].retain(|other| *other != point);
    }

    /// Returns true if `is_it` holds for a point in any of the cells that a triangle may touch.
    fn any_near(&self, triangle: [[f64; 2]; 3], is_it: impl Fn(usize) -> bool) -> bool {
        let range = |axis: usize| {
            let cells = triangle.map(|p| self.along(axis, p[axis]));
            cells[0].min(cells[1]).min(cells[2])..cells[0].max(cells[1]).max(cells[2]) + 1
        };
        let columns = range(0);
        range(1).any(|row| {
            let cells = row * self.side + columns.start..row * self.side + columns.end;
            self.points[cells].iter().flatten().any(|p| is_it(*p))
        })
    }
}

impl Triangulator {
    /// Emits n − 2 triangles, as indices of corners, with the orientation of a polygon of n
    /// corners. Returns false if the polygon was concave but too large to be triangulated
    /// correctly.
    ///
    /// A convex polygon becomes a fan around its first corner; others lose one ear after the other:
    /// a convex corner whose triangle contains no other corner [Meisters 1975]. Polygons that are
    /// not planar are projected along their mean normal.
    pub(crate) fn cut(&mut self, corners: &[DVec3], mut emit: impl FnMut([usize; 3])) -> bool {
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

    /// Projects the polygon along the largest component of its normal.
    ///
    /// The normal is Σ pᵢ × pᵢ₊₁ (twice the vector area; Newell's method), with coordinates
    /// relative to the first corner so that no precision is lost far from the origin.
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

    /// Returns twice the area of the triangle of three corners; negative if it is clockwise.
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let [[ax, ay], [bx, by], [cx, cy]] = [self.plane[a], self.plane[b], self.plane[c]];
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    }

    fn is_concave(&self, i: usize) -> bool {
        self.turn(self.previous[i], i, self.next[i]) < 0.0
    }

    /// Returns true if a corner is an ear. Triangles without area always are.
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
        let triangle = [a, b, c].map(|corner| self.plane[corner]);
        !self.concave.any_near(triangle, |p| is_inside(p) && !is_corner(p))
    }

    /// Cuts off ears until a triangle is left. A self-intersecting polygon may have none; then the
    /// next corner is cut off.
    fn cut_ears(&mut self, n: usize, mut emit: impl FnMut([usize; 3])) {
        self.next.clear();
        self.next.extend((0..n).map(|i| (i + 1) % n));
        self.previous.clear();
        self.previous.extend((0..n).map(|i| (i + n - 1) % n));
        let concave: Vec<_> = (0..n).filter(|i| self.is_concave(*i)).collect();
        self.concave.hold(&self.plane, &concave);
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
            self.concave.remove(at, self.plane[at]);
            for i in [before, after] {
                if !self.is_concave(i) {
                    self.concave.remove(i, self.plane[i]);
                }
            }
            for i in [before, after] {
                is_ear[i] = self.is_ear(i);
            }
            at = after;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns pseudo-random numbers in [0, 1) (xorshift64*).
    fn numbers(mut state: u64) -> impl FnMut() -> f64 {
        move || {
            state ^= state >> 12;
            state ^= state << 25;
            state ^= state >> 27;
            (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    fn cut(corners: &[DVec3]) -> Vec<[usize; 3]> {
        let mut triangles = Vec::new();
        assert!(Triangulator::default().cut(corners, |t| triangles.push(t)));
        triangles
    }

    fn area_vector(corners: &[DVec3]) -> DVec3 {
        let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
        pairs.map(|(p, q)| p.cross(*q)).sum::<DVec3>() / 2.0
    }

    /// Checks that the triangles face as the polygon does, and that their areas sum to its area, so
    /// that they cover it without overlap. There are n − 2 of them.
    fn check_tiling(corners: &[DVec3]) {
        let triangles = cut(corners);
        assert_eq!(triangles.len(), corners.len() - 2);
        let whole = area_vector(corners);
        let mut sum = 0.0;
        for triangle in &triangles {
            let area = area_vector(&triangle.map(|i| corners[i])).dot(whole.normalize());
            assert!(area >= -1e-12 * whole.length(), "{triangle:?} of {corners:?}");
            sum += area;
        }
        assert!((sum / whole.length() - 1.0).abs() < 1e-9, "{corners:?}");
    }

    /// Maps a planar polygon to a random plane in space, starting with a random corner.
    fn place(flat: &[[f64; 2]], random: &mut impl FnMut() -> f64) -> Vec<DVec3> {
        let mut direction = || DVec3::new(random(), random(), random()) - 0.5;
        let (a, b, origin) = (direction(), direction(), direction() * 20.0);
        let mut corners: Vec<_> = flat.iter().map(|[x, y]| origin + a * *x + b * *y).collect();
        let first = (random() * flat.len() as f64) as usize;
        corners.rotate_left(first);
        corners
    }

    #[test]
    fn star_shaped_polygons_are_tiled() {
        let mut random = numbers(1);
        for round in 0..2000 {
            let n = 4 + round % 60;
            let corner = |i: usize, radius: f64| {
                let angle = std::f64::consts::TAU * i as f64 / n as f64;
                [radius * angle.cos(), radius * angle.sin()]
            };
            let flat: Vec<_> = (0..n).map(|i| corner(i, 0.05 + random())).collect();
            check_tiling(&place(&flat, &mut random));
        }
    }

    /// A comb has long teeth side by side; a spiral has few ears.
    #[test]
    fn combs_and_spirals_are_tiled() {
        let mut random = numbers(2);
        for n in 2..100 {
            let mut comb = vec![[2.0 * n as f64, -1.0], [0.0, -1.0]];
            comb.extend((0..2 * n).map(|i| [i as f64, if i % 2 == 0 { 0.0 } else { 9.0 }]));
            comb.reverse();
            check_tiling(&place(&comb, &mut random));

            let arm = |i: usize, width: f64| {
                let angle = 0.5 * i as f64;
                [(angle + width) * angle.cos(), (angle + width) * angle.sin()]
            };
            let outwards = (0..n).map(|i| arm(i, 3.0));
            let spiral: Vec<_> = outwards.chain((0..n).rev().map(|i| arm(i, 0.5))).collect();
            check_tiling(&place(&spiral, &mut random));
        }
    }

    /// Corners in the middle of edges, coincident corners, and polygons that return to one of their
    /// corners (as those with a hole do).
    #[test]
    fn special_polygons_are_tiled() {
        let mut random = numbers(3);
        let edges: &[[f64; 2]] =
            &[[0., 0.], [1., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.], [0., 1.]];
        let twice: &[[f64; 2]] = &[[0., 0.], [2., 0.], [2., 0.], [1., 0.5], [2., 2.], [0., 2.]];
        let ring: &[[f64; 2]] = &[
            [0., 0.],
            [4., 0.],
            [4., 4.],
            [0., 4.],
            [0., 0.],
            [1., 1.],
            [1., 3.],
            [3., 3.],
            [3., 1.],
            [1., 1.],
        ];
        for flat in [edges, twice, ring] {
            for _ in 0..20 {
                check_tiling(&place(flat, &mut random));
            }
        }
    }

    #[test]
    fn convex_polygons_are_fans() {
        let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, z]| DVec3::new(x, 5.0, z));
        assert_eq!(cut(&square), [[0, 1, 2], [0, 2, 3]]);
    }

    /// For any corners, there are n − 2 triangles of existing corners.
    #[test]
    fn nonsense_is_cut_somehow() {
        let mut random = numbers(4);
        for round in 0..500 {
            let n = 4 + round % 20;
            let mut coordinate = || (random() * 4.0).floor();
            let corners: Vec<_> =
                (0..n).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect();
            let triangles = cut(&corners);
            assert_eq!(triangles.len(), n - 2);
            assert!(triangles.iter().flatten().all(|i| *i < n));
        }
        assert_eq!(cut(&[DVec3::ZERO; 7]).len(), 5);
    }

    /// Ears do not depend on the cells: the result equals a search over all concave corners.
    #[test]
    fn cells_hide_no_corner() {
        let mut random = numbers(5);
        for round in 0..200 {
            let n = 100 + 10 * round;
            let plane: Vec<_> = (0..n).map(|_| [random(), 1e-3 * random()]).collect();
            let points: Vec<_> = (0..n).filter(|i| i % 3 > 0).collect();
            let mut cells = PointGrid::default();
            cells.hold(&plane, &points);
            cells.remove(points[0], plane[points[0]]);
            for p in points.iter().copied() {
                let size = random();
                let mut shift = || size * (random() - 0.5);
                let [x, y] = plane[p];
                let triangle = [[x - 0.1, y - shift()], [x + 0.3, y], [x, y + shift()]];
                assert_eq!(cells.any_near(triangle, |q| q == p), p != points[0]);
            }
        }
    }

    #[test]
    fn large_concave_polygons_say_that_they_are_not_cut_well() {
        let n = MAX_CONCAVE + 1;
        let corners: Vec<_> =
            (0..n).map(|i| DVec3::new(i as f64, f64::from(u8::from(i % 2 == 0)), 0.0)).collect();
        let mut count = 0;
        assert!(!Triangulator::default().cut(&corners, |_| count += 1));
        assert_eq!(count, n - 2);
    }
}
