//! Subdivision surfaces of triangles. [Loop 1987, "Smooth Subdivision Surfaces Based on Triangles";
//! rules at borders: Hoppe et al. 1994, "Piecewise Smooth Surface Reconstruction", §3]

use std::f64::consts::{PI, TAU};

use pt_math::DVec3;
use pt_scene::shapes::single_part;
use pt_scene::{Attribute, Attributes, Mesh};

/// Maximum number of triangles of a surface.
const MAX_TRIANGLES: usize = 1 << 22;

/// Subdivides each triangle of a mesh into four, `levels` times, and moves the vertices to their
/// limit positions, with the normals of the limit surface. The orientation is kept.
///
/// # Errors
/// If an edge has more than two triangles, or two of opposite orientation, or there are too many
/// triangles.
pub(super) fn subdivide(
    mut points: Vec<DVec3>,
    mut faces: Vec<[u32; 3]>,
    levels: u32,
) -> Result<Mesh, String> {
    let count = faces.len().saturating_mul(1 << (2 * levels));
    if count > MAX_TRIANGLES {
        return Err(format!(
            "{levels} levels subdivide {} triangles into {count}; expected at most {MAX_TRIANGLES}",
            faces.len()
        ));
    }
    let mut fans = Fans::of(&faces, points.len())?;
    for _ in 0..levels {
        let moved = (0..points.len()).map(|v| fans.around(v as u32).smoothed(&points, points[v]));
        let mut next: Vec<DVec3> = moved.collect();
        faces = fans.cut(&faces, &points, &mut next);
        points = next;
        fans = Fans::of(&faces, points.len())?;
    }
    let numbers = |v: DVec3| v.as_vec3().to_array();
    let (positions, normals) = (0..)
        .zip(&points)
        .map(|(v, p)| {
            let ring = fans.around(v);
            (numbers(ring.limit(&points, *p)), numbers(ring.normal(&points, *p)))
        })
        .unzip();
    Ok(Mesh {
        name: "loopsubdiv".to_owned(),
        positions,
        normals: Some(Attribute { values: normals, indices: None }),
        uvs: None,
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: single_part(faces.len()),
        triangles: faces.into(),
    })
}

/// Adjacency of triangles, by directed edges. Edges from the same vertex are contiguous and sorted
/// by their end vertex.
struct Fans {
    /// Index of the first edge from each vertex, followed by the number of edges.
    starts: Vec<u32>,
    sides: Vec<DirectedEdge>,
    /// End vertex of an edge from each vertex.
    first: Vec<Option<u32>>,
}

/// Directed edge of a triangle, from a known vertex.
#[derive(Clone, Copy)]
struct DirectedEdge {
    to: u32,
    /// Third vertex of the triangle.
    third: u32,
}

/// Neighbours of a vertex, counter-clockwise as seen from the front.
struct Ring {
    vertices: Vec<u32>,
    /// True if they do not form a closed ring.
    is_at_border: bool,
}

/// Returns the edges of a triangle: start, end, and the third vertex.
fn sides_of([a, b, c]: [u32; 3]) -> [[u32; 3]; 3] {
    [[a, b, c], [b, c, a], [c, a, b]]
}

impl Fans {
    fn of(faces: &[[u32; 3]], vertices: usize) -> Result<Self, String> {
        let error = |from: usize, to: u32| {
            format!(
                "the edge from vertex {from} to vertex {to} has two triangles on the same side, or \
                 zero length; expected a manifold surface"
            )
        };
        let mut starts = vec![0_u32; vertices + 1];
        let mut first = vec![None; vertices];
        for [from, to, _] in faces.iter().copied().flat_map(sides_of) {
            if from == to {
                return Err(error(from as usize, to));
            }
            starts[from as usize + 1] += 1;
            first[from as usize] = Some(to);
        }
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut sides = vec![DirectedEdge { to: 0, third: 0 }; 3 * faces.len()];
        let mut ends = starts.clone();
        for [from, to, third] in faces.iter().copied().flat_map(sides_of) {
            let end = &mut ends[from as usize];
            sides[*end as usize] = DirectedEdge { to, third };
            *end += 1;
        }
        for (from, ends) in starts.windows(2).enumerate() {
            let sides = &mut sides[ends[0] as usize..ends[1] as usize];
            sides.sort_unstable_by_key(|side| side.to);
            if let Some(two) = sides.windows(2).find(|two| two[0].to == two[1].to) {
                return Err(error(from, two[0].to));
            }
        }
        Ok(Self { starts, sides, first })
    }

    /// Returns the index of the edge from one vertex to another, if there is one.
    fn side(&self, from: u32, to: u32) -> Option<usize> {
        let [start, end] = [from, from + 1].map(|v| self.starts[v as usize] as usize);
        let found = self.sides[start..end].binary_search_by_key(&to, |side| side.to);
        found.ok().map(|i| start + i)
    }

    /// Returns the third vertex of the triangle with an edge from one vertex to another.
    fn third(&self, from: u32, to: u32) -> Option<u32> {
        self.side(from, to).map(|side| self.sides[side].third)
    }

    fn around(&self, vertex: u32) -> Ring {
        let Some(some) = self.first[vertex as usize] else {
            return Ring { vertices: Vec::new(), is_at_border: true };
        };
        // Clockwise to the border, or once around.
        let mut start = some;
        let mut is_at_border = true;
        while let Some(before) = self.third(start, vertex) {
            start = before;
            if start == some {
                is_at_border = false;
                break;
            }
        }
        let mut vertices = vec![start];
        let mut last = start;
        while let Some(next) = self.third(vertex, last) {
            if next == start {
                break;
            }
            vertices.push(next);
            last = next;
        }
        Ring { vertices, is_at_border }
    }

    /// Splits each triangle into four. The vertices on its edges are added to `next`.
    fn cut(&self, faces: &[[u32; 3]], points: &[DVec3], next: &mut Vec<DVec3>) -> Vec<[u32; 3]> {
        // By directed edges; the two of an undirected edge share a vertex.
        let mut middles: Vec<Option<u32>> = vec![None; self.sides.len()];
        let mut on_edge = |[a, b, c]: [u32; 3]| {
            let (own, opposite) = (self.side(a, b), self.side(b, a));
            if let Some(known) = own.and_then(|side| middles[side]) {
                return known;
            }
            let at = |v: u32| points[v as usize];
            next.push(match opposite.map(|side| self.sides[side].third) {
                Some(d) => (at(a) + at(b)) * 0.375 + (at(c) + at(d)) * 0.125,
                None => (at(a) + at(b)) * 0.5,
            });
            let made = next.len() as u32 - 1;
            for side in [own, opposite].into_iter().flatten() {
                middles[side] = Some(made);
            }
            made
        };
        let four = |&[a, b, c]: &[u32; 3]| {
            let [ab, bc, ca] = sides_of([a, b, c]).map(&mut on_edge);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces.iter().flat_map(four).collect()
    }
}

impl Ring {
    fn sum(&self, points: &[DVec3]) -> DVec3 {
        self.vertices.iter().map(|v| points[*v as usize]).sum()
    }

    /// Returns the sum of the first and the last neighbour.
    fn ends(&self, points: &[DVec3]) -> Option<DVec3> {
        let [first, .., last] = self.vertices[..] else { return None };
        Some(points[first as usize] + points[last as usize])
    }

    /// β of Warren: the weight of each neighbour, 3/16 for three of them and 3/8n for n.
    fn weight(&self) -> f64 {
        let n = self.vertices.len() as f64;
        if self.vertices.len() == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * n) }
    }

    /// Returns the position of a vertex after a subdivision step.
    fn smoothed(&self, points: &[DVec3], p: DVec3) -> DVec3 {
        match self.ends(points) {
            Some(ends) if self.is_at_border => p * 0.75 + ends * 0.125,
            Some(_) => self.blended(points, p, self.weight()),
            None => p,
        }
    }

    /// Returns the limit position of a vertex. (At borders pbrt-v4 has the weights 3/5 and 1/5,
    /// which are not those of the limit.)
    fn limit(&self, points: &[DVec3], p: DVec3) -> DVec3 {
        match self.ends(points) {
            Some(ends) if self.is_at_border => (p * 4.0 + ends) / 6.0, // as of cubic B-splines
            Some(_) => {
                let n = self.vertices.len() as f64;
                self.blended(points, p, 1.0 / (n + 3.0 / (8.0 * self.weight())))
            }
            None => p,
        }
    }

    fn blended(&self, points: &[DVec3], p: DVec3, weight: f64) -> DVec3 {
        let n = self.vertices.len() as f64;
        p * (1.0 - n * weight) + self.sum(points) * weight
    }

    /// Returns the normal of the limit surface, from two tangents. [Hoppe et al. 1994, appendix A]
    fn normal(&self, points: &[DVec3], p: DVec3) -> DVec3 {
        let at = |i: usize| points[self.vertices[i] as usize];
        let n = self.vertices.len();
        let (mut s, mut t) = (DVec3::ZERO, DVec3::ZERO);
        if !self.is_at_border {
            for i in 0..n {
                let (sin, cos) = libm::sincos(TAU * i as f64 / n as f64);
                s += at(i) * cos;
                t += at(i) * sin;
            }
        } else if n >= 2 {
            s = at(0) - at(n - 1);
            t = match n {
                2 => at(0) + at(1) - p * 2.0,
                3 => at(1) - p,
                4 => (at(1) + at(2)) * 2.0 - at(0) - at(3) - p * 2.0,
                _ => {
                    let angle = PI / (n - 1) as f64;
                    let inner = (1..n - 1).map(|i| at(i) * libm::sin(i as f64 * angle));
                    let factor = 2.0 - 2.0 * libm::cos(angle);
                    inner.sum::<DVec3>() * factor - (at(0) + at(n - 1)) * libm::sin(angle)
                }
            };
        }
        s.cross(t).normalize_or(DVec3::Z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn octahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let points = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let faces = [
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        (points.to_vec(), faces.to_vec())
    }

    #[test]
    fn a_closed_surface_stays_closed_and_looks_outwards() {
        let (points, faces) = octahedron();
        let mesh = subdivide(points, faces, 3).expect("a surface");
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (8 * 64, 4 * 64 + 2));
        let normals = &mesh.normals.as_ref().expect("normals").values;
        for (p, n) in mesh.positions.iter().zip(normals) {
            let [p, n] = [*p, *n].map(|v| DVec3::from_array(v.map(f64::from)));
            assert!(p.normalize().dot(n) > 0.9 && (n.length() - 1.0).abs() < 1e-6);
        }
        for triangle in &mesh.triangles {
            let [a, b, c] =
                triangle.map(|v| DVec3::from_array(mesh.positions[v as usize].map(f64::from)));
            assert!((b - a).cross(c - a).dot(a) > 0.0);
        }
    }

    /// The limit of a vertex does not depend on the number of previous subdivision steps.
    #[test]
    fn limits_are_limits() {
        let (points, faces) = octahedron();
        let border = (points.clone(), faces[..6].to_vec());
        for (points, faces) in [(points.clone(), faces.clone()), border] {
            let meshes = [0, 1, 4]
                .map(|levels| subdivide(points.clone(), faces.clone(), levels).expect("a surface"));
            for v in 0..points.len() {
                let at = |mesh: &Mesh| DVec3::from_array(mesh.positions[v].map(f64::from));
                let normal = |mesh: &Mesh| {
                    mesh.normals.as_ref().map(|n| DVec3::from_array(n.values[v].map(f64::from)))
                };
                assert!(
                    at(&meshes[0]).distance(at(&meshes[1])) < 1e-6
                        && at(&meshes[0]).distance(at(&meshes[2])) < 1e-6
                );
                let [a, b] = [normal(&meshes[0]), normal(&meshes[2])].map(|n| n.expect("normals"));
                assert!(a.dot(b) > 1.0 - 1e-5, "{v}: {a}, {b}");
            }
        }
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        assert!(subdivide(points.clone(), vec![[0, 1, 2], [0, 1, 3]], 1).is_err());
        assert!(subdivide(points.clone(), vec![[0, 0, 2]], 1).is_err());
        assert!(subdivide(points.clone(), vec![[0, 1, 2]], 6).is_ok());
        let message = subdivide(points, vec![[0, 1, 2]; 64], 10).expect_err("too many");
        assert!(message.contains("expected at most"), "{message}");
    }
}
