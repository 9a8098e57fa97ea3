//! Meshing of the zero set of a grid of signed distances.
//!
//! Between the samples of the grid, distances are trilinear. [Hansson-Söderlund, Evans &
//! Akenine-Möller 2022, "Ray Tracing of Signed Distance Function Grids", JCGT 11(3)]

use std::collections::HashMap;

use pt_math::DVec3;
use pt_scene::medium::Grid;
use pt_scene::shapes::single_part;
use pt_scene::{Attribute, Attributes, Mesh};

/// Number of triangles beyond which the subdivision of voxels is reduced.
const FINE_TRIANGLES: usize = 1 << 20;

/// Average number of triangles of a cell that the surface crosses, rounded up.
const TRIANGLES_PER_CELL: usize = 8;

/// Six tetrahedra around the diagonal of a cube [Kuhn 1960]: the bits of a corner are its
/// coordinates, and each corner lies along +x, +y or +z of the previous one.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

/// Normals of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum IsosurfaceNormals {
    /// Gradient, which is discontinuous between voxels.
    Analytic,
    /// Continuous normals, blended from the gradients of eight voxels. [§4 of the paper]
    Smooth,
}

/// Signed distances whose samples fill the unit cube, including its corners.
pub(crate) struct Distances<'a> {
    /// Number of samples along each axis, at least 2.
    samples: [usize; 3],
    values: &'a [f32],
}

impl<'a> Distances<'a> {
    /// Creates a view of a grid; `None` if it has fewer than two samples along an axis, or several
    /// channels.
    pub(crate) fn new(grid: &'a Grid) -> Option<Self> {
        let samples = grid.resolution.map(|n| n as usize);
        let is_fit = grid.channels == 1 && samples.iter().all(|&n| n >= 2);
        is_fit.then_some(Self { samples, values: &grid.values })
    }

    /// Returns the surface, with its front where distances are positive. Cells are 1/8 of a voxel,
    /// and up to a whole voxel if there would otherwise be more than 2²⁰ triangles.
    ///
    /// # Errors
    /// Returns a message if there are more than `most` triangles.
    pub(crate) fn surface(&self, normals: IsosurfaceNormals, most: usize) -> Result<Mesh, String> {
        let too_many = || format!("the surface exceeds the limit of {most} triangles");
        // Each corner of a voxel belongs to at least two tetrahedra, so that each crossed voxel has
        // at least two triangles.
        let voxels: Vec<_> = self.crossed_voxels().take(most / 2 + 1).collect();
        if voxels.len() > most / 2 {
            return Err(too_many());
        }
        let triangles = |cut: usize| voxels.len().saturating_mul(cut * cut * TRIANGLES_PER_CELL);
        let cut = [8, 4, 2].into_iter().find(|&cut| triangles(cut) <= FINE_TRIANGLES.min(most));
        let mut builder = IsosurfaceBuilder::new(self, cut.unwrap_or(1), normals);
        for voxel in voxels {
            builder.add_voxel(voxel);
            if builder.triangles.len() > most {
                return Err(too_many());
            }
        }
        Ok(builder.finish())
    }

    /// Returns the lower corners of the voxels with samples of both signs.
    fn crossed_voxels(&self) -> impl Iterator<Item = [usize; 3]> {
        let [nx, ny, nz] = self.samples.map(|n| n - 1);
        let all =
            (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        all.filter(|voxel| {
            let inside = (0..8).filter(|&i| self.sample(corner_of(*voxel, i)) < 0.0).count();
            inside != 0 && inside != 8
        })
    }

    fn sample(&self, [x, y, z]: [usize; 3]) -> f64 {
        let [nx, ny, _] = self.samples;
        f64::from(self.values[(z * ny + y) * nx + x])
    }

    /// Returns the voxel that contains a point in units of voxels, and the position in it.
    fn voxel_at(&self, point: DVec3) -> ([usize; 3], DVec3) {
        let voxel = [0, 1, 2].map(|a| (point[a].floor() as usize).min(self.samples[a] - 2));
        (voxel, point - real(voxel))
    }

    /// Returns the distance on the plane of samples `plane` perpendicular to `axis`, in the row of
    /// the voxel, where `place` is the position along the other axes. Planes beyond the grid are
    /// clamped to its sides.
    fn on_plane(&self, axis: usize, plane: isize, voxel: [usize; 3], place: DVec3) -> f64 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let plane = plane.clamp(0, self.samples[axis] as isize - 1) as usize;
        let row = |step: usize| {
            let at = |next: usize| {
                let mut at = voxel;
                at[axis] = plane;
                at[b] += next;
                at[c] += step;
                self.sample(at)
            };
            at(0) + place[b] * (at(1) - at(0))
        };
        row(0) + place[c] * (row(1) - row(0))
    }

    /// Returns the distance at a point in units of voxels.
    fn distance(&self, point: DVec3) -> f64 {
        let (voxel, place) = self.voxel_at(point);
        let x = voxel[0] as isize;
        let [low, high] = [x, x + 1].map(|plane| self.on_plane(0, plane, voxel, place));
        low + place.x * (high - low)
    }

    /// Returns the gradient of the distances of a voxel, in coordinates of the unit cube.
    fn gradient(&self, voxel: [usize; 3], place: DVec3) -> DVec3 {
        self.gradient_of(voxel.map(|x| x as isize), voxel, place)
    }

    /// Returns the gradient whose components are differences across `layers`, each at the position
    /// of the other two axes.
    fn gradient_of(&self, layers: [isize; 3], voxel: [usize; 3], place: DVec3) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|a| {
            let [low, high] =
                [layers[a], layers[a] + 1].map(|plane| self.on_plane(a, plane, voxel, place));
            (high - low) * (self.samples[a] - 1) as f64
        }))
    }

    /// Returns the blend of the gradient directions of the eight voxels around the nearest sample,
    /// by the position between their centres; voxels below the grid have no weight.
    fn smooth_gradient(&self, point: DVec3) -> DVec3 {
        let (voxel, place) = self.voxel_at(point);
        let lower = [0, 1, 2].map(|a| point[a].round() as isize - 1);
        let weights = [0, 1, 2].map(|a| match lower[a] {
            0.. => point[a] - lower[a] as f64 - 0.5,
            _ => 1.0,
        });
        let neighbours = (0..8).map(|i| {
            let high = [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit == 1);
            let weight = |a: usize| if high[a] { weights[a] } else { 1.0 - weights[a] };
            let layers = [0, 1, 2].map(|a| lower[a] + isize::from(high[a]));
            let gradient = self.gradient_of(layers, voxel, place);
            gradient.normalize_or_zero() * (weight(0) * weight(1) * weight(2))
        });
        neighbours.sum()
    }
}

/// Returns a corner of a cube; the bits of its index are its coordinates.
fn corner_of([x, y, z]: [usize; 3], corner: usize) -> [usize; 3] {
    [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)]
}

fn real(point: [usize; 3]) -> DVec3 {
    DVec3::from_array(point.map(|x| x as f64))
}

/// A mesh under construction: voxels are divided into cells, and those into tetrahedra, each of
/// whose edges the surface crosses at most once. Neighbours share their vertices. [Doi & Koide
/// 1991, "An Efficient Method of Triangulating Equi-Valued Surfaces by Using Tetrahedral Cells"]
struct IsosurfaceBuilder<'a> {
    distances: &'a Distances<'a>,
    /// Number of cells of a voxel along an axis.
    cut: usize,
    normals: IsosurfaceNormals,
    /// Vertices by the lower end of their edge, and the axes along which it runs.
    vertices: HashMap<([usize; 3], usize), u32>,
    /// Positions in units of voxels.
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normal_values: Vec<[f32; 3]>,
    normal_indices: Vec<[u32; 3]>,
}

impl<'a> IsosurfaceBuilder<'a> {
    fn new(distances: &'a Distances<'a>, cut: usize, normals: IsosurfaceNormals) -> Self {
        Self {
            distances,
            cut,
            normals,
            vertices: HashMap::new(),
            points: Vec::new(),
            triangles: Vec::new(),
            normal_values: Vec::new(),
            normal_indices: Vec::new(),
        }
    }

    /// Returns the position of a cell corner in units of voxels.
    fn place(&self, [x, y, z]: [usize; 3]) -> DVec3 {
        real([x, y, z]) / self.cut as f64
    }

    fn add_voxel(&mut self, voxel: [usize; 3]) {
        let first = self.triangles.len();
        let cut = self.cut;
        for z in 0..cut {
            for y in 0..cut {
                for x in 0..cut {
                    let [i, j, k] = voxel.map(|corner| corner * cut);
                    self.add_cell([i + x, j + y, k + z]);
                }
            }
        }
        if self.normals == IsosurfaceNormals::Analytic {
            self.add_gradients(voxel, first);
        }
    }

    fn add_cell(&mut self, cell: [usize; 3]) {
        let corners: [_; 8] = std::array::from_fn(|i| corner_of(cell, i));
        let is_inside = corners.map(|corner| self.distances.distance(self.place(corner)) < 0.0);
        let inside = is_inside.iter().filter(|inside| **inside).count();
        if inside == 0 || inside == 8 {
            return;
        }
        for tetrahedron in TETRAHEDRA {
            let (inside, outside): (Vec<_>, Vec<_>) =
                tetrahedron.into_iter().partition(|&corner| is_inside[corner]);
            let mut vertex = |a: usize, b: usize| self.vertex(corners[a.min(b)], a ^ b);
            let polygon: Vec<_> = match (&inside[..], &outside[..]) {
                (&[a], others) | (others, &[a]) => others.iter().map(|&b| vertex(a, b)).collect(),
                (&[a, b], &[c, d]) => vec![vertex(a, c), vertex(a, d), vertex(b, d), vertex(b, c)],
                _ => continue,
            };
            let middle = |of: &[usize]| {
                of.iter().map(|&i| real(corners[i])).sum::<DVec3>() / of.len() as f64
            };
            let out = middle(&outside) - middle(&inside);
            for i in 2..polygon.len() {
                self.add_triangle([polygon[0], polygon[i - 1], polygon[i]], out);
            }
        }
    }

    /// Returns the vertex on an edge with ends of different sign: the root between them, slightly
    /// away from the ends.
    fn vertex(&mut self, from: [usize; 3], axes: usize) -> u32 {
        const END: f64 = 1.0 / 4096.0;
        if let Some(vertex) = self.vertices.get(&(from, axes)) {
            return *vertex;
        }
        let [a, b] = [from, corner_of(from, axes)].map(|end| self.place(end));
        let at = |t: f64| a + (b - a) * t;
        let is_inside = |t: f64| self.distances.distance(at(t)) < 0.0;
        let begins_inside = is_inside(0.0);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..32 {
            let middle = 0.5 * (low + high);
            *(if is_inside(middle) == begins_inside { &mut low } else { &mut high }) = middle;
        }
        let vertex = self.points.len() as u32;
        self.points.push(at(low.clamp(END, 1.0 - END)));
        self.vertices.insert((from, axes), vertex);
        vertex
    }

    /// Adds a triangle whose front faces `out`.
    fn add_triangle(&mut self, [a, b, c]: [u32; 3], out: DVec3) {
        let [p, q, r] = [a, b, c].map(|i| self.points[i as usize]);
        let looks_out = (q - p).cross(r - p).dot(out) > 0.0;
        self.triangles.push(if looks_out { [a, b, c] } else { [a, c, b] });
    }

    /// Adds the gradients of a voxel at the corners of its triangles.
    fn add_gradients(&mut self, voxel: [usize; 3], first: usize) {
        let mut known = HashMap::new();
        for i in first..self.triangles.len() {
            let indices = self.triangles[i].map(|vertex| {
                *known.entry(vertex).or_insert_with(|| {
                    let place = self.points[vertex as usize] - real(voxel);
                    self.normal_values.push(unit(self.distances.gradient(voxel, place)));
                    self.normal_values.len() as u32 - 1
                })
            });
            self.normal_indices.push(indices);
        }
    }

    fn finish(self) -> Mesh {
        let Self { distances, points, triangles, .. } = self;
        let size = DVec3::from_array(distances.samples.map(|n| (n - 1) as f64));
        let normals = match self.normals {
            IsosurfaceNormals::Analytic => Attribute {
                values: self.normal_values.into(),
                indices: Some(self.normal_indices.into()),
            },
            IsosurfaceNormals::Smooth => Attribute {
                values: points.iter().map(|&p| unit(distances.smooth_gradient(p))).collect(),
                indices: None,
            },
        };
        let parts = single_part(triangles.len());
        Mesh {
            name: "sdfgrid".to_owned(),
            positions: points.iter().map(|&p| (p / size).as_vec3().to_array()).collect(),
            triangles: triangles.into(),
            normals: Some(normals),
            uvs: None,
            colors: None,
            face_colors: None,
            attributes: Attributes::default(),
            submeshes: parts,
        }
    }
}

/// Normalizes a vector; +z if it has no direction.
fn unit(v: DVec3) -> [f32; 3] {
    v.normalize_or(DVec3::Z).as_vec3().to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples a function at the corners of a grid that fills the unit cube.
    fn sampled(resolution: [u32; 3], f: impl Fn(DVec3) -> f64) -> Grid {
        let [nx, ny, nz] = resolution;
        let place = |i: u32, n: u32| f64::from(i) / f64::from(n - 1);
        let all = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        let at = |[x, y, z]: [u32; 3]| DVec3::new(place(x, nx), place(y, ny), place(z, nz));
        Grid { resolution, channels: 1, values: all.map(|i| f(at(i)) as f32).collect() }
    }

    fn sphere(p: DVec3) -> f64 {
        (p - 0.5).length() - 0.4
    }

    #[test]
    fn vertices_are_where_the_distance_is_zero_and_edges_are_shared() {
        // Irregular values from −1 to 1, around which every edge must be closed except at the
        // sides.
        let jumble =
            |p: DVec3| 2.0 * (4321.1 * p.dot(DVec3::new(1.3, 2.7, 5.1)).sin()).fract() - 1.0;
        for grid in [sampled([9, 6, 12], sphere), sampled([5, 6, 4], jumble)] {
            let distances = Distances::new(&grid).unwrap();
            for normals in [IsosurfaceNormals::Analytic, IsosurfaceNormals::Smooth] {
                let mesh = distances.surface(normals, usize::MAX).unwrap();
                let cut = 1.0 / 8.0; // few voxels, the finest cut
                let size = DVec3::from_array(grid.resolution.map(|n| f64::from(n - 1)));
                for p in &mesh.positions {
                    let d = distances.distance(DVec3::from_array(p.map(f64::from)) * size);
                    // Vertices may be moved by 1/4096 of an edge, along which samples change by
                    // less than 2·√3.
                    assert!(d.abs() < cut * 4.0 / 4096.0, "{p:?}: {d}");
                }
                let mut edges = HashMap::new();
                for &[a, b, c] in &mesh.triangles {
                    for (from, to) in [(a, b), (b, c), (c, a)] {
                        *edges.entry((from.min(to), from.max(to))).or_insert(0) +=
                            if from < to { 1 } else { -1 };
                    }
                }
                let is_at_side = |vertex: u32| {
                    mesh.positions[vertex as usize].iter().any(|x| *x == 0.0 || *x == 1.0)
                };
                let open = edges.iter().filter(|(_, sum)| **sum != 0);
                assert!(open.clone().all(|((a, b), _)| is_at_side(*a) && is_at_side(*b)));
            }
        }
    }

    #[test]
    fn the_front_and_its_normals_look_to_positive_distances() {
        let grid = sampled([17, 17, 17], sphere);
        for normals in [IsosurfaceNormals::Analytic, IsosurfaceNormals::Smooth] {
            let mesh = Distances::new(&grid).unwrap().surface(normals, usize::MAX).unwrap();
            let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
            let given = mesh.normals.as_ref().unwrap();
            let mut volume = 0.0;
            for (i, &corners) in mesh.triangles.iter().enumerate() {
                let [a, b, c] = corners.map(|v| vector(mesh.positions[v as usize]) - 0.5);
                volume += a.dot(b.cross(c)) / 6.0;
                for (vertex, normal) in [a, b, c].into_iter().zip(given.corners(i, corners)) {
                    let normal = vector(given.values[normal as usize]);
                    // A trilinear sphere: a sixteenth of a unit turns the normal by 0.16 of its
                    // radius.
                    assert!(normal.dot(vertex.normalize()) > 0.99, "{vertex}: {normal}");
                }
            }
            let want = 4.0 / 3.0 * std::f64::consts::PI * 0.4f64.powi(3);
            assert!((volume / want - 1.0).abs() < 0.02, "{volume}, not {want}");
        }
    }

    #[test]
    fn what_is_no_grid_of_distances_or_too_much_is_refused() {
        assert!(Distances::new(&Grid::uniform(1.0)).is_none());
        let grid = sampled([9, 9, 9], sphere);
        assert!(Distances::new(&Grid { channels: 3, ..grid.clone() }).is_none());
        let refused =
            Distances::new(&grid).unwrap().surface(IsosurfaceNormals::Smooth, 100).unwrap_err();
        assert!(refused.contains("limit of 100 triangles"), "{refused}");
    }
}
