//! Points and segments, such as scans and line drawings.

use std::f64::consts::{PI, TAU};

use pt_math::{DMat3, DVec3};
use rayon::prelude::*;

use crate::extent::{Extent, extent_of};
use crate::shapes::single_part;
use crate::{Attribute, Mesh};

/// Points, rendered as spheres, and segments between them, rendered as cylinders, all with the same
/// radius, in their own coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Name in the file.
    pub name: String,
    /// Positions of the points.
    pub positions: Vec<[f32; 3]>,
    /// Colour of each point, linear Rec. 709, interpolated along segments.
    pub colors: Option<Vec<[f32; 3]>>,
    /// End points of each segment, as indices into `positions`.
    pub segments: Vec<[u32; 2]>,
}

/// Maximum number of distances that [`Points::radius`] computes: the number of points times that of
/// the samples.
const MAX_DISTANCES: usize = 1 << 27;
/// Minimum and maximum number of sample points whose neighbours are searched.
const SAMPLES: [usize; 2] = [32, 1024];
/// Rank of the neighbour whose distance approximates the mean spacing.
const NEIGHBOUR: usize = 4;
/// Maximum radius of points relative to the diagonal of their bounding box.
const LARGEST: f64 = 1.0 / 20.0;
/// Radius of segments relative to the diagonal of the bounding box.
const OF_SEGMENTS: f64 = 1.0 / 250.0;

/// Returns the scale of radii under a linear map: the cube root of the scale of volumes.
pub fn scale(map: DMat3) -> f64 {
    libm::cbrt(map.determinant().abs())
}

impl Points {
    /// Returns the memory of the arrays, in bytes.
    pub fn bytes(&self) -> u64 {
        let colors = self.colors.as_deref().map_or(0, size_of_val);
        (size_of_val(&*self.positions) + colors + size_of_val(&*self.segments)) as u64
    }

    /// Removes points with coordinates that are not finite, and their segments. Returns the number
    /// of removed points.
    pub fn drop_infinite(&mut self) -> usize {
        let is_finite = |p: &[f32; 3]| p.iter().all(|x| x.is_finite());
        let before = self.positions.len();
        if self.positions.iter().all(is_finite) {
            return 0;
        }
        let mut numbers = Vec::with_capacity(before);
        for position in &self.positions {
            let last = numbers.last().map_or(0, |(_, next)| *next);
            numbers.push((is_finite(position), last + u32::from(is_finite(position))));
        }
        let number = |i: u32| {
            let (is_kept, next) = *numbers.get(i as usize)?;
            is_kept.then(|| next - 1)
        };
        let kept = self.segments.iter().filter_map(|[a, b]| Some([number(*a)?, number(*b)?]));
        self.segments = kept.collect();
        let mut flags = numbers.iter().map(|(is_kept, _)| *is_kept);
        if let Some(colors) = &mut self.colors {
            let mut flags = flags.clone();
            colors.retain(|_| flags.next().unwrap_or(false));
        }
        self.positions.retain(|_| flags.next().unwrap_or(false));
        before - self.positions.len()
    }

    /// Returns the bounding box of the points, without their radius.
    pub fn extent(&self) -> Option<Extent> {
        let all = self.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
        extent_of(all.filter(|p| p.is_finite()))
    }

    /// Returns a radius with which points on a surface appear as a surface, in their own
    /// coordinates: half of the median distance to the fourth nearest other point, which is about
    /// the mean spacing both on a regular grid and for random points of a surface. It is at most
    /// 1/20 of the diagonal of the bounding box; for segments, it is 1/250.
    ///
    /// The result is 0 if all points are at one position. In a large set, a fixed subset of the
    /// points is examined.
    pub fn radius(&self) -> f64 {
        let diagonal = self.extent().map_or(0.0, |[low, high]| (high - low).length());
        if !self.segments.is_empty() {
            return diagonal * OF_SEGMENTS;
        }
        let half = self.spacing().map_or(f64::INFINITY, |spacing| 0.5 * spacing);
        half.min(diagonal * LARGEST)
    }

    /// Returns the median distance to the fourth nearest other point, or to the last one if there
    /// are fewer.
    fn spacing(&self) -> Option<f64> {
        let all = &self.positions;
        let [least, most] = SAMPLES;
        let samples = (MAX_DISTANCES / all.len().max(1)).clamp(least, most).min(all.len());
        let sample = |i: usize| nearest(all, all[i * all.len() / samples]);
        let mut distances: Vec<f32> = (0..samples).into_par_iter().filter_map(sample).collect();
        distances.sort_by(f32::total_cmp);
        distances.get(distances.len() / 2).map(|squared| f64::from(*squared).sqrt())
    }

    /// Returns the cylinders of all segments of positive length, with smooth normals and open ends.
    ///
    /// # Panics
    /// If an index of a segment is out of range.
    pub fn cylinders(&self, radius: f64) -> Mesh {
        let sides = self.sides();
        // The mean width of the silhouette then equals that of a round cylinder.
        let half_a_side = PI / f64::from(sides);
        let wider = half_a_side / libm::sin(half_a_side);
        let mut mesh = Mesh { name: self.name.clone(), ..Mesh::default() };
        let (mut normals, mut colors) = (Vec::new(), self.colors.as_ref().map(|_| Vec::new()));
        for segment in &self.segments {
            let ends = segment.map(|i| DVec3::from(self.positions[i as usize].map(f64::from)));
            let Some(along) = (ends[1] - ends[0]).try_normalize() else { continue };
            let (x, y) = along.any_orthonormal_pair();
            let base = mesh.positions.len() as u32;
            for side in 0..sides {
                let (sin, cos) = libm::sincos(TAU * f64::from(side) / f64::from(sides));
                let normal = x * cos + y * sin;
                let [start, end] = ends.map(|end| end + normal * (wider * radius));
                mesh.positions.extend([start, end].map(|p| p.as_vec3().to_array()));
                normals.extend([normal.as_vec3().to_array(); 2]);
                let [a, c] = [side, (side + 1) % sides].map(|side| base + 2 * side);
                mesh.triangles.extend([[a, c, c + 1], [a, c + 1, a + 1]]);
            }
            if let (Some(all), Some(colors)) = (&self.colors, &mut colors) {
                let ends = segment.map(|i| all[i as usize]);
                colors.extend(std::iter::repeat_n(ends, sides as usize).flatten());
            }
        }
        mesh.normals = Some(Attribute { values: normals.into(), indices: None });
        mesh.colors = colors.map(|values| Attribute { values: values.into(), indices: None });
        mesh.submeshes = single_part(mesh.triangles.len());
        mesh
    }

    /// Returns the number of triangles of all cylinders, including those of segments without
    /// length.
    pub fn triangles(&self) -> usize {
        2 * self.sides() as usize * self.segments.len()
    }

    /// Returns the number of faces of each cylinder, which decreases with the number of segments.
    fn sides(&self) -> u32 {
        match self.segments.len() {
            0..=10_000 => 24,
            10_001..=100_000 => 12,
            _ => 6,
        }
    }
}

/// Returns the squared distance from a position to the fourth nearest point at another position, or
/// to the last one if there are fewer; `None` if there are none.
fn nearest(all: &[[f32; 3]], from: [f32; 3]) -> Option<f32> {
    let mut least = [f32::INFINITY; NEIGHBOUR];
    for p in all {
        let [x, y, z] = [p[0] - from[0], p[1] - from[1], p[2] - from[2]];
        let squared = x * x + y * y + z * z;
        if squared < least[NEIGHBOUR - 1] && squared > 0.0 {
            let at = least.partition_point(|known| *known <= squared);
            least[at..].rotate_right(1);
            least[at] = squared;
        }
    }
    least.into_iter().rfind(|squared| squared.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(positions: Vec<[f32; 3]>) -> Points {
        Points { positions, ..Points::default() }
    }

    #[test]
    fn points_of_a_grid_touch_each_other() {
        let grid = (0..2500).map(|i| [(i % 50) as f32 * 0.2, (i / 50) as f32 * 0.2, 7.0]);
        assert!((of(grid.collect()).radius() - 0.1).abs() < 1e-6);
    }

    #[test]
    fn random_points_of_a_square_have_about_the_radius_of_a_grid() {
        let mut random = pt_testing::Random::new(3);
        let points = (0..10_000).map(|_| [random.unit(), random.unit(), 0.0]);
        let radius = of(points.collect()).radius();
        assert!((0.0045..0.0065).contains(&radius), "{radius}");
    }

    #[test]
    fn few_points_are_small_and_copies_count_once() {
        let corners = |i: u8| [0, 1, 2].map(|axis| f32::from(i >> axis & 1));
        let cube = of((0..8).map(corners).collect());
        assert!((cube.radius() - 3.0_f64.sqrt() / 20.0).abs() < 1e-6);
        let grid = (0..2500).map(|i| [(i % 50) as f32, (i / 50) as f32, 0.0]);
        let twice = of(grid.flat_map(|p| [p; 8]).collect());
        assert!((twice.radius() - 0.5).abs() < 1e-6);
        assert_eq!(of(vec![[1.0; 3]; 5]).radius(), 0.0);
        assert_eq!(of(Vec::new()).radius(), 0.0);
        assert_eq!(of(vec![[f32::NAN; 3], [0.0; 3]]).radius(), 0.0);
    }

    #[test]
    fn points_that_are_nowhere_take_their_segments_along() {
        let mut points = Points {
            positions: vec![[0.0; 3], [f32::NAN; 3], [1.0; 3], [2.0; 3]],
            colors: Some(vec![[0.1; 3], [0.2; 3], [0.3; 3], [0.4; 3]]),
            segments: vec![[0, 1], [0, 2], [3, 2]],
            ..Points::default()
        };
        assert_eq!(points.drop_infinite(), 1);
        assert_eq!(points.positions, [[0.0; 3], [1.0; 3], [2.0; 3]]);
        assert_eq!(points.colors, Some(vec![[0.1; 3], [0.3; 3], [0.4; 3]]));
        assert_eq!(points.segments, [[0, 1], [2, 1]]);
        assert_eq!(points.drop_infinite(), 0);
    }

    #[test]
    fn cylinders_are_round_and_look_outwards() {
        let points = Points {
            positions: vec![[0.0; 3], [0.0, 0.0, 2.0], [0.0; 3]],
            colors: Some(vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]]),
            segments: vec![[0, 1], [0, 2]],
            ..Points::default()
        };
        let mesh = points.cylinders(0.5);
        // The segment without length has no triangles.
        assert_eq!(mesh.triangles.len(), points.triangles() / 2);
        let at = |i: u32| DVec3::from(mesh.positions[i as usize].map(f64::from));
        let mut area = 0.0;
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(at);
            let normal = (b - a).cross(c - a);
            area += 0.5 * normal.length();
            let middle = (a + b + c) / 3.0;
            assert!(normal.dot(middle.with_z(0.0)) > 0.0);
        }
        let whole = std::f64::consts::TAU * 0.5 * 2.0;
        assert!((area / whole - 1.0).abs() < 1e-2, "{area} of {whole}");
        let colors = &mesh.colors.as_ref().unwrap().values;
        for (p, color) in mesh.positions.iter().zip(colors) {
            assert_eq!(*color, if p[2] == 0.0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] });
        }
    }
}
