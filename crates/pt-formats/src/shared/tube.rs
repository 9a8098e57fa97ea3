//! Tessellation of curves as tubes and ribbons.

use std::f64::consts::{PI, TAU};
use std::iter::Sum;
use std::ops::Mul;

use pt_math::DVec3;
use pt_scene::Mesh;

use super::grid::grid;

/// Tessellation of a curve.
#[derive(Clone, Copy)]
pub(crate) struct Detail {
    /// Number of sides of a tube.
    pub(crate) sides: u32,
    /// Maximum angle in degrees between successive pieces along a curve.
    pub(crate) turn: f64,
}

impl Detail {
    /// Coarsest tessellation. Blocks of 16 x 16 pixels of a tuft of hair have an error of up to 2 %
    /// with it (8 % with six sides), since rays that graze fibres are missed.
    pub(crate) const MIN: Self = Self { sides: 12, turn: 8.0 };
    /// Tessellation of scenes with few curves.
    pub(crate) const FINE: Self = Self { sides: 48, turn: 2.0 };
    /// Medium tessellation.
    pub(crate) const MIDDLE: Self = Self { sides: 24, turn: 4.0 };
}

/// Minimum and maximum number of pieces of a segment.
const PIECES: [f64; 2] = [2.0, 32.0];

/// A curve of segments with control points: lines, or polynomials of degree 2 or 3 in the Bernstein
/// basis or in that of uniform B-splines.
pub(crate) struct Spline {
    pub(crate) points: Vec<DVec3>,
    pub(crate) degree: usize,
    pub(crate) is_bspline: bool,
}

/// A position on a curve: the segment, the parameter of the segment, and that of the whole curve,
/// both from 0 to 1.
#[derive(Clone, Copy)]
pub(crate) struct TubePoint {
    pub(crate) segment: usize,
    pub(crate) t: f64,
    pub(crate) u: f64,
}

/// Frame at a position of a curve: its centre, its direction, and a direction across it.
struct Station {
    place: TubePoint,
    middle: DVec3,
    along: DVec3,
    across: DVec3,
}

impl Spline {
    pub(crate) fn segments(&self) -> usize {
        let n = self.points.len();
        if self.is_bspline {
            n.saturating_sub(self.degree)
        } else {
            n.saturating_sub(1) / self.degree
        }
    }

    /// Returns true if the number of control points matches whole segments.
    pub(crate) fn is_whole(&self) -> bool {
        self.segments() > 0
            && (self.is_bspline || (self.points.len() - 1).is_multiple_of(self.degree))
    }

    /// Returns the number of triangles of the tube of the curve.
    pub(crate) fn triangles_of_tube(&self, detail: Detail) -> usize {
        self.segments() * self.pieces(detail) * 2 * detail.sides as usize
    }

    /// Returns the number of pieces of each segment, by the total turn of the control polygon,
    /// which is an upper bound of that of the curve.
    fn pieces(&self, detail: Detail) -> usize {
        if self.degree == 1 {
            return 1;
        }
        let edges = self.points.windows(2).map(|pair| pair[1] - pair[0]);
        let edges: Vec<_> = edges.filter_map(DVec3::try_normalize).collect();
        let turn =
            |pair: &[DVec3]| libm::atan2(pair[0].cross(pair[1]).length(), pair[0].dot(pair[1]));
        let degrees = edges.windows(2).map(turn).sum::<f64>().to_degrees();
        (degrees / detail.turn / self.segments() as f64).ceil().clamp(PIECES[0], PIECES[1]) as usize
    }

    /// Interpolates values at the control points: by Bernstein polynomials, or by uniform
    /// B-splines, which are repeated convolutions of boxes.
    pub(crate) fn between<T>(&self, values: &[T], TubePoint { segment, t, .. }: TubePoint) -> T
    where
        T: Copy + Mul<f64, Output = T> + Sum,
    {
        let s = 1.0 - t;
        let weights = match (self.degree, self.is_bspline) {
            (1, _) => [s, t, 0.0, 0.0],
            (2, false) => [s * s, 2.0 * s * t, t * t, 0.0],
            (2, true) => [0.5 * s * s, 0.5 + s * t, 0.5 * t * t, 0.0],
            (_, false) => [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
            (_, true) => {
                let inner = |x: f64| (4.0 - 6.0 * x * x + 3.0 * x * x * x) / 6.0;
                [s * s * s / 6.0, inner(t), inner(s), t * t * t / 6.0]
            }
        };
        let first = segment * if self.is_bspline { 1 } else { self.degree };
        (0..=self.degree).map(|i| values[first + i] * weights[i]).sum()
    }

    /// Returns a tube of varying radius, open at its ends, with the texture coordinate u along it.
    /// The mean width of its silhouette equals that of a round tube: the mean width of a convex
    /// shape is its perimeter over π.
    pub(crate) fn tube(&self, detail: Detail, radius: impl Fn(TubePoint) -> f64) -> Mesh {
        let stations = self.stations(detail, None);
        let half_a_side = PI / f64::from(detail.sides);
        let wider = half_a_side / libm::sin(half_a_side);
        spanned(&stations, detail.sides, |station, v| {
            let Station { place, middle, along, across } = *station;
            let (sin, cos) = libm::sincos(-TAU * v);
            let normal = across * cos + along.cross(across) * sin;
            (middle + normal * (wider * radius(place)), normal)
        })
    }

    /// Returns a ribbon of varying width, which is perpendicular to normals given at the ends of
    /// segments.
    pub(crate) fn ribbon(&self, normals: &[DVec3], width: impl Fn(TubePoint) -> f64) -> Mesh {
        let stations = self.stations(Detail::MIN, Some(normals));
        spanned(&stations, 1, |station, v| {
            let Station { place, middle, along, across } = *station;
            (middle + across.cross(along) * ((v - 0.5) * width(place)), across)
        })
    }

    /// Returns frames along a curve. The direction across is given, or transported with minimal
    /// rotation.
    fn stations(&self, detail: Detail, normals: Option<&[DVec3]>) -> Vec<Station> {
        let pieces = self.pieces(detail);
        let count = self.segments() * pieces;
        let place = |i: usize| {
            let segment = (i / pieces).min(self.segments() - 1);
            let t = (i - segment * pieces) as f64 / pieces as f64;
            TubePoint { segment, t, u: i as f64 / count as f64 }
        };
        let middles: Vec<_> = (0..=count).map(|i| self.between(&self.points, place(i))).collect();
        let mut along = DVec3::Z;
        let mut across: Option<DVec3> = None;
        let mut stations = Vec::with_capacity(middles.len());
        for (i, &middle) in middles.iter().enumerate() {
            let chord = middles[(i + 1).min(count)] - middles[i.saturating_sub(1)];
            along = chord.try_normalize().unwrap_or(along);
            let place = place(i);
            let wanted = match normals {
                Some(normals) => {
                    let TubePoint { segment, t, .. } = place;
                    normals[segment] * (1.0 - t) + normals[segment + 1] * t
                }
                None => across.unwrap_or_else(|| along.any_orthonormal_vector()),
            };
            let flat = (wanted - along * wanted.dot(along)).try_normalize();
            let direction = flat.unwrap_or_else(|| along.any_orthonormal_vector());
            across = Some(direction);
            stations.push(Station { place, middle, along, across: direction });
        }
        stations
    }
}

/// Returns a mesh across the frames of a curve, with this number of rows.
fn spanned(stations: &[Station], rows: u32, at: impl Fn(&Station, f64) -> (DVec3, DVec3)) -> Mesh {
    let count = stations.len() - 1;
    grid("curve", [count as u32, rows], |u, v| {
        at(&stations[((u * count as f64).round() as usize).min(count)], v)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spline(degree: usize, is_bspline: bool) -> Spline {
        let points =
            [[0.0, 0.0], [1.0, 2.0], [3.0, 1.0], [4.0, 5.0], [6.0, 2.0], [7.0, 7.0], [9.0, 8.0]];
        let points = points.map(|[x, y]| DVec3::new(x, y, x * y)).to_vec();
        Spline { points, degree, is_bspline }
    }

    /// Weights sum to 1, and segments continue where the previous ones end, for B-splines in the
    /// same direction.
    #[test]
    fn segments_meet_and_follow_straight_lines() {
        const STEP: f64 = 1e-6;
        for (degree, is_bspline) in [(1, false), (2, false), (2, true), (3, false), (3, true)] {
            let spline = spline(degree, is_bspline);
            let at = |spline: &Spline, segment, t| {
                spline.between(&spline.points, TubePoint { segment, t, u: 0.0 })
            };
            assert!(spline.is_whole());
            for segment in 1..spline.segments() {
                let [end, start] = [at(&spline, segment - 1, 1.0), at(&spline, segment, 0.0)];
                assert!(end.distance(start) < 1e-12);
                let before = (end - at(&spline, segment - 1, 1.0 - STEP)) / STEP;
                let after = (at(&spline, segment, STEP) - start) / STEP;
                assert!(!is_bspline || before.distance(after) < 1e-3, "{before} {after}");
            }
            let line =
                Spline { points: (0..7).map(|i| DVec3::X * f64::from(i)).collect(), ..spline };
            for i in 0..=10 {
                let p = at(&line, 0, f64::from(i) / 10.0);
                assert!(p.y == 0.0 && (0.0..=f64::from(degree as u32)).contains(&p.x));
            }
        }
    }

    /// The mean width of a straight tube over all views equals its diameter.
    #[test]
    fn a_tube_is_as_wide_as_it_is_thick() {
        const VIEWS: u32 = 3600;
        let line = Spline { points: vec![DVec3::ZERO, DVec3::Z], degree: 1, is_bspline: false };
        for (sides, end, radius) in [(12, 0.0, 0.25), (12, 1.0, 1.25), (5, 1.0, 1.25)] {
            let detail = Detail { sides, turn: 8.0 };
            let tube = line.tube(detail, |place| 0.25 + place.u);
            assert_eq!(tube.triangles.len(), line.triangles_of_tube(detail));
            let width = |view: u32| {
                let (sin, cos) = (TAU * f64::from(view) / f64::from(VIEWS)).sin_cos();
                let ring = tube.positions.iter().filter(|p| f64::from(p[2]) == end);
                let across = ring.map(|p| f64::from(p[0]) * cos + f64::from(p[1]) * sin);
                let [least, most] = across
                    .fold([f64::MAX, f64::MIN], |[least, most], x| [least.min(x), most.max(x)]);
                most - least
            };
            let mean = (0..VIEWS).map(width).sum::<f64>() / f64::from(VIEWS);
            assert!((mean / (2.0 * radius) - 1.0).abs() < 1e-4, "{mean}");
        }
    }
}
