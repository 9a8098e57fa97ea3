//! Generated meshes, and computed normals.
//!
//! Rectangle, cube, disk and cylinder have the texture coordinates of Mitsuba 3.9.

mod round;

use std::collections::HashMap;

use pt_math::DVec3;
pub use round::{cylinder, disk, sphere};

use crate::{Attribute, Attributes, Mesh, Submesh};

/// Returns the square [−1, 1]² in the xy plane; the front is +z, and (u, v) runs from (0, 0) at
/// (−1, −1) to (1, 1).
pub fn rectangle() -> Mesh {
    let positions = vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let uvs = positions.iter().map(|p: &[f32; 3]| [0.5 * (p[0] + 1.0), 0.5 * (p[1] + 1.0)]);
    let uvs = Some(Attribute { values: uvs.collect(), indices: None });
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    let parts = single_part(triangles.len());
    Mesh {
        name: "rectangle".to_owned(),
        positions: positions.into(),
        triangles: triangles.into(),
        normals: None,
        uvs,
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: parts,
    }
}

/// Returns the cube [−1, 1]³; the front is outside, and (u, v) covers [0, 1]² on each face.
pub fn cube() -> Mesh {
    /// Axes along which u and v run on the faces −x, +x, −y, +y, −z, +z; bit 2 reverses the
    /// direction.
    const UV_AXES: [[u32; 2]; 6] = [[1, 2], [1, 6], [2, 0], [4, 6], [5, 0], [1, 0]];
    let sign = |bits: u32, axis: u32| if bits >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let positions = (0..8).map(|i| [sign(i, 0), sign(i, 1), sign(i, 2)]).collect();
    let uv_values = (0..4).map(|i| [f32::from(i & 1 != 0), f32::from(i & 2 != 0)]).collect();
    let (mut triangles, mut uv_indices) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        // The two axes that follow in cyclic order span the face, so that their cross product is
        // along `axis`.
        let (s, t) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let positive = 1 << axis;
        let faces = [[0, t, s + t, s], [0, s, s + t, t].map(|i: u32| i + positive)];
        for (face, [a, b, c, d]) in (2 * axis..).zip(faces) {
            let uv = |corner: u32| {
                let [u, v] = UV_AXES[face].map(|axis| (corner >> (axis & 3) ^ axis >> 2) & 1);
                u + 2 * v
            };
            for triangle in [[a, b, c], [a, c, d]] {
                triangles.push(triangle);
                uv_indices.push(triangle.map(uv));
            }
        }
    }
    let uvs = Some(Attribute { values: uv_values, indices: Some(uv_indices.into()) });
    let parts = single_part(triangles.len());
    Mesh {
        name: "cube".to_owned(),
        positions,
        triangles: triangles.into(),
        normals: None,
        uvs,
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: parts,
    }
}

/// Returns a closed bumpy surface around the origin, of radius 0.8 to 1.2, without normals.
///
/// The edges of an icosahedron are subdivided into `subdivision` pieces, which makes 20 ·
/// subdivision² triangles, and each vertex in direction (x, y, z) is moved to the radius 1 +
/// (T₉(x) + T₈(y) + T₇(z)) / 15, with Tₙ the Chebyshev polynomials. Only sums, products and square
/// roots are used, so that the mesh has the same bits on every machine.
///
/// # Panics
/// If `subdivision` is 0 or above 10 000, where indices would overflow.
pub fn bumpy_sphere(subdivision: u32) -> Mesh {
    assert!((1..=10_000).contains(&subdivision), "subdivision is {subdivision}");
    let (corners, faces) = icosahedron();
    let mut vertices = HashMap::new();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for face in faces {
        // The vertex with weights (n − i − j, i, j) over n at the corners of the face. Faces share
        // the vertices of their edges because they share the weights of the corners.
        let mut vertex = |i: u32, j: u32| {
            let mut key = [(subdivision - i - j, face[0]), (i, face[1]), (j, face[2])];
            for pair in &mut key {
                if pair.0 == 0 {
                    *pair = (0, 0);
                }
            }
            key.sort_unstable();
            *vertices.entry(key).or_insert_with(|| {
                let sum = key.iter().map(|(weight, c)| corners[*c] * f64::from(*weight));
                positions.push(bump(sum.sum::<DVec3>().normalize()).as_vec3().to_array());
                positions.len() as u32 - 1
            })
        };
        for i in 0..subdivision {
            for j in 0..subdivision - i {
                let (a, b, c) = (vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
                triangles.push([a, b, c]);
                if i + j + 1 < subdivision {
                    triangles.push([b, vertex(i + 1, j + 1), c]);
                }
            }
        }
    }
    let parts = single_part(triangles.len());
    let name = "bumpy sphere".to_owned();
    Mesh {
        name,
        positions: positions.into(),
        triangles: triangles.into(),
        normals: None,
        uvs: None,
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
        submeshes: parts,
    }
}

/// Returns the corners of a regular icosahedron, and its faces counter-clockwise as seen from
/// outside.
fn icosahedron() -> ([DVec3; 12], [[usize; 3]; 20]) {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    // Three golden rectangles at right angles.
    let corners = std::array::from_fn(|i| {
        let short = if i & 1 == 0 { 1.0 } else { -1.0 };
        let long = if i & 2 == 0 { golden } else { -golden };
        let corner = [0.0, short, long];
        DVec3::from_array(std::array::from_fn(|axis| corner[(axis + 3 - i / 4) % 3]))
    });
    // An edge has length 2; a face is three corners at that distance from one another.
    let near = |a: usize, b: usize| (corners[a].distance_squared(corners[b]) - 4.0).abs() < 1e-9;
    let mut faces = [[0; 3]; 20];
    let mut count = 0;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outside = corners[a].cross(corners[b]).dot(corners[c]) > 0.0;
                    faces[count] = if outside { [a, b, c] } else { [a, c, b] };
                    count += 1;
                }
            }
        }
    }
    (corners, faces)
}

/// Moves a point of the unit sphere along its direction. See [`bumpy_sphere`].
fn bump(p: DVec3) -> DVec3 {
    p * (1.0 + (chebyshev(9, p.x) + chebyshev(8, p.y) + chebyshev(7, p.z)) / 15.0)
}

/// Tₙ(x) by T₀ = 1, T₁ = x, Tₖ₊₁ = 2x Tₖ − Tₖ₋₁; in [−1, 1] for x in [−1, 1].
fn chebyshev(n: u32, x: f64) -> f64 {
    let (mut previous, mut current) = (1.0, x);
    for _ in 1..n {
        (previous, current) = (current, 2.0 * x * current - previous);
    }
    current
}

/// Returns the single submesh of a mesh whose triangles all use slot 0.
pub fn single_part(triangles: usize) -> Vec<Submesh> {
    vec![Submesh { triangles: 0..triangles as u32, slot: 0 }]
}

/// Appends a mesh to another one and returns true, if both have the same attributes, with one value
/// per vertex, and no colours. Otherwise returns false, and nothing is changed.
pub fn append(to: &mut Mesh, mesh: &Mesh) -> bool {
    fn fits<T>(to: Option<&Attribute<T>>, more: Option<&Attribute<T>>) -> bool {
        let is_plain = |a: &Attribute<T>| a.indices.is_none();
        to.is_some() == more.is_some() && to.is_none_or(is_plain) && more.is_none_or(is_plain)
    }
    fn add<T: Copy>(to: Option<&mut Attribute<T>>, more: Option<&Attribute<T>>) {
        if let (Some(to), Some(more)) = (to, more) {
            to.values.extend(more.values.iter().copied());
        }
    }
    let is_colored = |m: &Mesh| {
        m.colors.is_some() || m.face_colors.is_some() || m.attributes.all().next().is_some()
    };
    let fits = fits(to.normals.as_ref(), mesh.normals.as_ref())
        && fits(to.uvs.as_ref(), mesh.uvs.as_ref())
        && !is_colored(to)
        && !is_colored(mesh);
    let Some(first) = u32::try_from(to.positions.len()).ok().filter(|_| fits) else { return false };
    if u32::try_from(to.positions.len() + mesh.positions.len()).is_err() {
        return false;
    }
    to.positions.extend(mesh.positions.iter().copied());
    to.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|i| first + i)));
    add(to.normals.as_mut(), mesh.normals.as_ref());
    add(to.uvs.as_mut(), mesh.uvs.as_ref());
    to.submeshes = single_part(to.triangles.len());
    true
}

/// Turns a mesh inside out: front and back are exchanged, and normals are inverted.
pub fn flip(mesh: &mut Mesh) {
    for normal in mesh.normals.iter_mut().flat_map(|n| &mut n.values) {
        *normal = normal.map(|x| -x);
    }
    let uvs = mesh.uvs.iter_mut().filter_map(|uvs| uvs.indices.as_mut());
    let normals = mesh.normals.iter_mut().filter_map(|normals| normals.indices.as_mut());
    let colors = mesh.colors.iter_mut().filter_map(|colors| colors.indices.as_mut());
    let all = std::iter::once(&mut mesh.triangles).chain(uvs).chain(normals).chain(colors);
    for corners in all.flatten() {
        corners.swap(1, 2);
    }
}

/// Distance of the back of a two-sided light from its front, relative to the size of the mesh.
const GAP: f64 = 1e-5;

/// Returns the back of a mesh: an inverted copy slightly behind it.
pub fn back_of(mesh: &Mesh) -> Mesh {
    let mut back = mesh.clone();
    let normals = smooth_normals(&Mesh { uvs: None, ..mesh.clone() });
    let size = mesh.positions.as_flattened().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
    for (position, normal) in back.positions.iter_mut().zip(&normals.values) {
        let moved = DVec3::from_array(position.map(f64::from))
            - DVec3::from_array(normal.map(f64::from)) * (GAP * f64::from(size));
        *position = moved.as_vec3().to_array();
    }
    flip(&mut back);
    back
}

/// Returns smooth vertex normals: the mean of the normals of the triangles around a vertex,
/// weighted by their angles at the vertex. [Thürmer & Wüthrich 1998, "Computing Vertex Normals from
/// Polygonal Facets"]
///
/// A vertex is a pair of a position and a texture coordinate, so that a texture seam is an edge of
/// the surface, as in renderers with one index per corner. If no triangle of positive area touches
/// a vertex, or all normals cancel, the result is +z.
pub fn smooth_normals(mesh: &Mesh) -> Attribute<[f32; 3]> {
    let (count, indices) = match mesh.uvs.as_ref().and_then(|uvs| uvs.indices.as_ref()) {
        Some(uvs) => {
            let (count, indices) = number_pairs(&mesh.triangles, uvs);
            (count, Some(indices))
        }
        None => (mesh.positions.len(), None),
    };
    let mut sums = vec![DVec3::ZERO; count];
    let positions: &[_] = &mesh.positions;
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        let position = |i: u32| pt_math::Vec3::from_array(positions[i as usize]).as_dvec3();
        let p = corners.map(position);
        let Some(normal) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else { continue };
        let vertices = indices.as_ref().map_or(*corners, |indices| indices[triangle]);
        for (i, vertex) in vertices.into_iter().enumerate() {
            let angle = angle_between(p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
            sums[vertex as usize] += normal * angle;
        }
    }
    let values = sums.iter().map(|s| s.try_normalize().unwrap_or(DVec3::Z).as_vec3().to_array());
    Attribute { values: values.collect(), indices: indices.map(Into::into) }
}

/// Numbers the distinct pairs of two indices per corner in order of appearance.
fn number_pairs(first: &[[u32; 3]], second: &[[u32; 3]]) -> (usize, Vec<[u32; 3]>) {
    let mut numbers = HashMap::new();
    let pairs = first.iter().zip(second).map(|(a, b)| {
        [0, 1, 2].map(|corner| {
            let next = numbers.len() as u32;
            *numbers.entry((a[corner], b[corner])).or_insert(next)
        })
    });
    let pairs = pairs.collect();
    (numbers.len(), pairs)
}

/// Returns the angle between two vectors, accurate for small and for flat angles. [Kahan 2006, "How
/// Futile are Mindless Assessments of Roundoff in Floating-Point Computation?", §12]
fn angle_between(a: DVec3, b: DVec3) -> f64 {
    let (a, b) = (a.normalize_or_zero(), b.normalize_or_zero());
    2.0 * libm::atan2((a - b).length(), (a + b).length())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns six times the enclosed volume; positive if the triangles face outwards.
    fn volume6(mesh: &Mesh) -> f64 {
        let p = |i: u32| pt_math::Vec3::from_array(mesh.positions[i as usize]).as_dvec3();
        mesh.triangles.iter().map(|&[a, b, c]| p(a).cross(p(b)).dot(p(c))).sum()
    }

    /// Returns true if every edge runs once in each direction: closed and consistently oriented.
    fn is_closed(mesh: &Mesh) -> bool {
        let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
        let mut all: Vec<_> = mesh.triangles.iter().flat_map(edges).collect();
        all.sort_unstable();
        let distinct = all.windows(2).all(|pair| pair[0] != pair[1]);
        distinct && all.iter().all(|&(a, b)| all.binary_search(&(b, a)).is_ok())
    }

    #[test]
    fn cube_is_closed_looks_outwards_and_has_volume_8() {
        let mesh = cube();
        assert!(is_closed(&mesh));
        assert_eq!(volume6(&mesh), 48.0);
    }

    #[test]
    fn flipping_turns_inside_out_and_twice_is_nothing() {
        let mut mesh = cube();
        mesh.normals = Some(smooth_normals(&mesh));
        let original = mesh.clone();
        flip(&mut mesh);
        assert_eq!(volume6(&mesh), -48.0);
        flip(&mut mesh);
        assert_eq!(mesh, original);
    }

    #[test]
    fn rectangle_looks_to_z_and_its_uvs_follow_x_and_y() {
        let mesh = rectangle();
        let normals = smooth_normals(&mesh);
        assert!(normals.values.iter().all(|n| *n == [0.0, 0.0, 1.0]));
        let uvs = mesh.uvs.unwrap();
        for (p, uv) in mesh.positions.iter().zip(&uvs.values) {
            assert_eq!([2.0 * uv[0] - 1.0, 2.0 * uv[1] - 1.0], [p[0], p[1]]);
        }
    }

    /// Texture coordinates in Mitsuba 3.9 of the points (1, −0.3, 0.2), (0.5, 1, 0.2) and so on of
    /// its cube.
    #[test]
    fn faces_of_the_cube_have_the_texture_coordinates_of_mitsuba() {
        let mesh = cube();
        let uvs = mesh.uvs.as_ref().unwrap();
        for (axis, side, expected) in [
            (0, 1.0, [0.35, 0.4]),
            (0, -1.0, [0.35, 0.6]),
            (1, 1.0, [0.25, 0.4]),
            (1, -1.0, [0.6, 0.75]),
            (2, 1.0, [0.35, 0.75]),
            (2, -1.0, [0.65, 0.75]),
        ] {
            let mut point = [0.5, -0.3, 0.2];
            point[axis] = side;
            let mut found = 0;
            for (i, &triangle) in mesh.triangles.iter().enumerate() {
                let p = triangle.map(|c| mesh.positions[c as usize].map(f64::from));
                if p.iter().any(|p| p[axis] != side) {
                    continue;
                }
                // Texture coordinates are linear on a face: corner 0 plus multiples of the two
                // edges.
                let uv = uvs.corners(i, triangle).map(|c| uvs.values[c as usize].map(f64::from));
                let edges = [1, 2].map(|k| DVec3::from_array(p[k]) - DVec3::from_array(p[0]));
                let rest = DVec3::from_array(point) - DVec3::from_array(p[0]);
                let normal = edges[0].cross(edges[1]);
                let weight = |a: DVec3, b: DVec3| a.cross(b).dot(normal) / normal.length_squared();
                let (s, t) = (weight(rest, edges[1]), weight(edges[0], rest));
                for k in 0..2 {
                    let value = uv[0][k] + s * (uv[1][k] - uv[0][k]) + t * (uv[2][k] - uv[0][k]);
                    assert!((value - expected[k]).abs() < 1e-12, "{axis} {side}: {value}");
                }
                found += 1;
            }
            assert_eq!(found, 2, "triangles of a face");
        }
    }

    #[test]
    fn bumpy_sphere_is_closed_and_stays_within_its_radii() {
        for n in [1, 2, 7] {
            let mesh = bumpy_sphere(n);
            // V − E + F = 2 with E = 3F/2.
            assert_eq!(mesh.triangles.len(), 20 * (n * n) as usize);
            assert_eq!(mesh.positions.len(), 10 * (n * n) as usize + 2);
            assert!(is_closed(&mesh) && volume6(&mesh) > 0.0);
            for p in &mesh.positions {
                let radius = pt_math::Vec3::from_array(*p).length();
                assert!((0.799..1.201).contains(&radius), "{radius}");
            }
        }
    }

    #[test]
    fn chebyshev_polynomials_are_cosines_of_multiples() {
        for i in 0..=20 {
            let angle = f64::from(i) * 0.157;
            assert!((chebyshev(7, libm::cos(angle)) - libm::cos(7.0 * angle)).abs() < 1e-12);
        }
    }

    /// At a corner of a cube three faces meet with 90° each, however they are cut into triangles.
    #[test]
    fn smooth_normals_do_not_depend_on_how_faces_are_cut() {
        let mut mesh = cube();
        mesh.uvs = None;
        let normals = smooth_normals(&mesh);
        for (p, n) in mesh.positions.iter().zip(&normals.values) {
            for axis in 0..3 {
                assert!((n[axis] - p[axis] / 3f32.sqrt()).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn seams_of_the_texture_are_edges() {
        let mesh = cube();
        let normals = smooth_normals(&mesh);
        // The faces at a corner of this cube may have different texture coordinates there; each
        // pair of position and texture coordinate has a normal of its own.
        let mut pairs: Vec<_> = normals.indices.iter().flatten().flatten().collect();
        pairs.sort_unstable();
        pairs.dedup();
        assert_eq!(pairs.len(), normals.values.len());
        assert!(normals.values.len() > mesh.positions.len());
    }
}
