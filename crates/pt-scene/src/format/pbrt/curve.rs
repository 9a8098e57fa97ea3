//! `Shape "curve"`: hair, and whatever is long and thin, as tubes and ribbons of triangles.

use std::f64::consts::TAU;

use pt_math::DVec3;

use super::super::transform::perpendicular;
use super::super::xml::quote;
use super::entity::Entity;
use super::quadric::mesh;
use crate::{LoadError, Mesh};

/// Pieces of a curve around it.
const SIDES: u32 = 6;
/// Degrees by which a curve may turn between two pieces along it.
const TURN: f64 = 8.0;
/// Least and most pieces of a segment along the curve.
const PIECES: [f64; 2] = [2.0, 32.0];
/// Most segments of one curve.
const MAX_SEGMENTS: usize = 10_000;

/// The segments of a curve, each by the degree and its control points.
struct Spline {
    points: Vec<DVec3>,
    degree: usize,
    is_bspline: bool,
}

impl Spline {
    fn segments(&self) -> usize {
        let n = self.points.len();
        if self.is_bspline {
            n.saturating_sub(self.degree)
        } else {
            n.saturating_sub(1) / self.degree
        }
    }

    /// Whether the control points make whole segments.
    fn is_whole(&self) -> bool {
        self.segments() > 0
            && (self.is_bspline || (self.points.len() - 1).is_multiple_of(self.degree))
    }

    /// Into how many pieces each segment is cut, by how much the line through its control points turns, which is no
    /// less than the curve does.
    fn pieces(&self) -> usize {
        let edges = self.points.windows(2).map(|pair| pair[1] - pair[0]);
        let edges: Vec<_> = edges.filter_map(DVec3::try_normalize).collect();
        let turn =
            |pair: &[DVec3]| libm::atan2(pair[0].cross(pair[1]).length(), pair[0].dot(pair[1]));
        let degrees = edges.windows(2).map(turn).sum::<f64>().to_degrees();
        (degrees / TURN / self.segments() as f64).ceil().clamp(PIECES[0], PIECES[1]) as usize
    }

    /// A point of a segment: sums of Bernstein polynomials, or of uniform B-splines, which are
    /// convolutions of boxes with each other.
    fn at(&self, segment: usize, t: f64) -> DVec3 {
        let s = 1.0 - t;
        let weights = match (self.degree, self.is_bspline) {
            (2, false) => [s * s, 2.0 * s * t, t * t, 0.0],
            (2, true) => [0.5 * s * s, 0.5 + s * t, 0.5 * t * t, 0.0],
            (_, false) => [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
            (_, true) => {
                let inner = |x: f64| (4.0 - 6.0 * x * x + 3.0 * x * x * x) / 6.0;
                [s * s * s / 6.0, inner(t), inner(s), t * t * t / 6.0]
            }
        };
        let first = segment * if self.is_bspline { 1 } else { self.degree };
        (0..=self.degree).map(|i| self.points[first + i] * weights[i]).sum()
    }
}

/// A place on a curve: its middle, its direction, and a direction across it.
struct Station {
    middle: DVec3,
    along: DVec3,
    across: DVec3,
}

/// The curve as a mesh. Ribbons lie across their normals; others, also those that face the eye there, are tubes.
pub(super) fn curve(entity: &Entity) -> Result<Mesh, LoadError> {
    entity.pass_over(&["splitdepth"]);
    let spline = spline(entity)?;
    let normals = ribbon(entity, &spline)?;
    let width = entity.not_negative("width", 1.0)?;
    let [start, end] =
        [entity.not_negative("width0", width)?, entity.not_negative("width1", width)?];
    let count = (spline.segments() * spline.pieces()) as u32;
    let stations = stations(&spline, normals.as_deref());
    let station =
        |u: f64| &stations[((u * f64::from(count)).round() as usize).min(stations.len() - 1)];
    let width_at = |u: f64| start * (1.0 - u) + end * u;
    if normals.is_some() {
        return Ok(mesh("curve", [count, 1], |u, v| {
            let Station { middle, along, across } = station(u);
            (*middle + across.cross(*along) * ((v - 0.5) * width_at(u)), *across)
        }));
    }
    Ok(mesh("curve", [count, SIDES], |u, v| {
        let Station { middle, along, across } = station(u);
        let (sin, cos) = libm::sincos(-TAU * v);
        let normal = *across * cos + along.cross(*across) * sin;
        (*middle + normal * (0.5 * width_at(u)), normal)
    }))
}

/// Whether a shape is a curve that becomes a closed tube.
pub(super) fn is_tube(entity: &Entity) -> Result<bool, LoadError> {
    Ok(entity.kind == "curve" && entity.text("type")? != Some("ribbon"))
}

fn spline(entity: &Entity) -> Result<Spline, LoadError> {
    let Some(points) = entity.points("P")? else {
        return Err(entity.at.error("the parameter \"point3 P\" is missing"));
    };
    let is_bspline = match entity.text("basis")? {
        None | Some("bezier") => false,
        Some("bspline") => true,
        Some(other) => {
            let message =
                format!("the basis {} is unknown; there are bezier, bspline", quote(other));
            return Err(entity.refuse("basis", message));
        }
    };
    let degree = entity.count("degree", 3, [2, 3])? as usize;
    let points = points.into_iter().map(DVec3::from_array).collect();
    let spline = Spline { points, degree, is_bspline };
    if spline.is_whole() && spline.segments() <= MAX_SEGMENTS {
        return Ok(spline);
    }
    let message = format!(
        "{} control points make no whole segments of degree {degree}; expected {} and more, up to {MAX_SEGMENTS} segments",
        spline.points.len(),
        degree + 1
    );
    Err(entity.refuse("P", message))
}

/// The normals of a ribbon where segments meet; `None` if the curve is none.
fn ribbon(entity: &Entity, spline: &Spline) -> Result<Option<Vec<DVec3>>, LoadError> {
    let normals = entity.normals("N")?;
    match entity.text("type")? {
        None | Some("flat" | "cylinder") => Ok(None),
        Some("ribbon") => {
            let normals = normals.unwrap_or_default();
            let expected = spline.segments() + 1;
            if normals.len() != expected {
                let message = format!(
                    "a ribbon of {} segments has {expected} normals, but there are {}",
                    expected - 1,
                    normals.len()
                );
                return Err(entity.refuse("N", message));
            }
            Ok(Some(normals.into_iter().map(DVec3::from_array).collect()))
        }
        Some(other) => {
            let message =
                format!("the type {} is unknown; there are flat, cylinder, ribbon", quote(other));
            Err(entity.refuse("type", message))
        }
    }
}

/// Places along a curve, with the direction across as given, or else carried on with as little turning as
/// possible.
fn stations(spline: &Spline, normals: Option<&[DVec3]>) -> Vec<Station> {
    let pieces = spline.pieces();
    let count = spline.segments() * pieces;
    let place = |i: usize| {
        let segment = (i / pieces).min(spline.segments() - 1);
        (segment, (i - segment * pieces) as f64 / pieces as f64)
    };
    let middles: Vec<_> =
        (0..=count).map(place).map(|(segment, t)| spline.at(segment, t)).collect();
    let mut along = DVec3::Z;
    let mut across: Option<DVec3> = None;
    let mut stations = Vec::with_capacity(middles.len());
    for (i, &middle) in middles.iter().enumerate() {
        let chord = middles[(i + 1).min(count)] - middles[i.saturating_sub(1)];
        along = chord.try_normalize().unwrap_or(along);
        let wanted = match normals {
            Some(normals) => {
                let (segment, t) = place(i);
                normals[segment] * (1.0 - t) + normals[segment + 1] * t
            }
            None => across.unwrap_or_else(|| perpendicular(along)),
        };
        let flat = (wanted - along * wanted.dot(along)).try_normalize();
        let direction = flat.unwrap_or_else(|| perpendicular(along));
        across = Some(direction);
        stations.push(Station { middle, along, across: direction });
    }
    stations
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

    /// Weights that add up to 1, and segments that go on where those before end, in the same direction if they are
    /// B-splines.
    #[test]
    fn segments_meet_and_follow_straight_lines() {
        const STEP: f64 = 1e-6;
        for (degree, is_bspline) in [(2, false), (2, true), (3, false), (3, true)] {
            let spline = spline(degree, is_bspline);
            assert!(spline.is_whole());
            for segment in 1..spline.segments() {
                let [end, start] = [spline.at(segment - 1, 1.0), spline.at(segment, 0.0)];
                assert!(end.distance(start) < 1e-12);
                let before = (end - spline.at(segment - 1, 1.0 - STEP)) / STEP;
                let after = (spline.at(segment, STEP) - start) / STEP;
                assert!(!is_bspline || before.distance(after) < 1e-3, "{before} {after}");
            }
            let line =
                Spline { points: (0..7).map(|i| DVec3::X * f64::from(i)).collect(), ..spline };
            for i in 0..=10 {
                let p = line.at(0, f64::from(i) / 10.0);
                assert!(p.y == 0.0 && (0.0..=f64::from(degree as u32)).contains(&p.x));
            }
        }
    }
}
