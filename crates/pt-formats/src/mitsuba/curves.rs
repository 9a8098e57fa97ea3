//! Files of curves: `linearcurve` and `bsplinecurve`.

use std::path::Path;

use pt_math::{DAffine3, DVec3};
use pt_scene::shapes::append;
use pt_scene::{Hint, Mesh};

use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::names::quote;
use crate::shared::tube::{Detail, Spline};
use crate::shared::{mesh_file, text};

/// Maximum number of triangles of the curves of a file.
const MAX_TRIANGLES: usize = 1 << 24;

/// Number of triangles up to which a finer tessellation is used.
const FINE_TRIANGLES: usize = 1 << 21;

/// A curve, the radii at its control points, and the line after it.
struct SplineCurve {
    spline: Spline,
    radii: Vec<f64>,
    end: usize,
}

/// Parses a file of curves, with a control point in each line: x, y, z and the radius. An empty
/// line ends a curve. Points are transformed, radii are not.
///
/// # Errors
/// If a line does not have four finite numbers, of which the last is not negative; if a curve has
/// too few points, or there is none; or if the tubes have too many triangles.
pub(super) fn parse_mesh(
    bytes: &[u8],
    path: &Path,
    degree: usize,
    to_world: DAffine3,
    context: &LoadContext,
) -> Result<Mesh, LoadError> {
    let error = |line: usize, message: String| {
        mesh_file::error(path, u32::try_from(line + 1).unwrap_or(u32::MAX), message)
    };
    let curves = curves(&text::characters(bytes, path)?, degree, to_world)
        .map_err(|(line, message)| error(line, message))?;
    let triangles = |detail| {
        let each = curves.iter().map(|curve| curve.spline.triangles_of_tube(detail));
        each.fold(0, usize::saturating_add)
    };
    let finer = [Detail::FINE, Detail::MIDDLE];
    let fine = finer.into_iter().find(|detail| triangles(*detail) <= FINE_TRIANGLES);
    let detail = fine.unwrap_or(Detail::MIN);
    let most = context.limits().triangles(MAX_TRIANGLES);
    if triangles(detail) > most {
        context.suggest(Hint::RaiseLimit("triangles"));
        let message = format!("the curves exceed the limit of {most} triangles");
        return Err(mesh_file::error(path, 0, message));
    }
    let mut made: Option<Mesh> = None;
    for SplineCurve { spline, radii, end } in &curves {
        let tube = spline.tube(detail, |place| spline.between(radii, place));
        let Some(all) = &mut made else {
            made = Some(tube);
            continue;
        };
        if !append(all, &tube) {
            return Err(error(*end, "the curves up to here have too many vertices".to_owned()));
        }
    }
    made.ok_or_else(|| mesh_file::error(path, 0, "found no control points in the file"))
}

/// Parses all curves. The error is a line and a message.
fn curves(
    text: &str,
    degree: usize,
    to_world: DAffine3,
) -> Result<Vec<SplineCurve>, (usize, String)> {
    let mut curves = Vec::new();
    let (mut points, mut radii) = (Vec::new(), Vec::new());
    // An additional line ends the last curve.
    for (number, line) in text.lines().chain([""]).enumerate() {
        if !line.trim().is_empty() {
            let [x, y, z, radius] = numbers(line).map_err(|message| (number, message))?;
            points.push(to_world.transform_point3(DVec3::new(x, y, z)));
            radii.push(radius);
        } else if !points.is_empty() {
            let spline = Spline { points: std::mem::take(&mut points), degree, is_bspline: true };
            if !spline.is_whole() {
                let message = format!(
                    "found {} control points in the preceding curve, expected at least {}",
                    spline.points.len(),
                    degree + 1
                );
                return Err((number, message));
            }
            curves.push(SplineCurve { spline, radii: std::mem::take(&mut radii), end: number });
        }
    }
    Ok(curves)
}

/// Parses the four numbers of a line.
fn numbers(line: &str) -> Result<[f64; 4], String> {
    let mut words = line.split_ascii_whitespace();
    let mut found = [0.0; 4];
    for number in &mut found {
        let word = words.next().ok_or_else(|| {
            format!(
                "found too few numbers in {}, expected x, y, z and a radius",
                quote(line.trim())
            )
        })?;
        *number = word
            .parse()
            .ok()
            .filter(|x: &f64| x.is_finite() && x.abs() <= f64::from(f32::MAX))
            .ok_or_else(|| format!("found {}, expected a finite number", quote(word)))?;
    }
    if let Some(more) = words.next() {
        return Err(format!(
            "found the additional number {}, expected x, y, z and a radius",
            quote(more)
        ));
    }
    if found[3] < 0.0 {
        return Err(format!("found the radius {}, expected at least 0", found[3]));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Limits, LoadOptions};

    fn read(text: &str, degree: usize, limits: &Limits) -> Result<Mesh, String> {
        let to_world = DAffine3::from_scale(DVec3::new(1.0, 1.0, 10.0));
        let options = LoadOptions { limits: limits.clone(), ..LoadOptions::default() };
        let context = LoadContext::new(Path::new("a.txt"), &options);
        parse_mesh(text.as_bytes(), Path::new("a.txt"), degree, to_world, &context)
            .map_err(|error| error.to_string())
    }

    /// Two polylines, of which the first has a joint. Points are stretched, radii are not.
    #[test]
    fn curves_end_at_empty_lines() {
        let text = "0 0 0 1\n0 0 1 2\n0 0 2 2\n\n \t\n5 0 0 .5\r\n5 0 1 .5";
        let mesh = read(text, 1, &Limits::default()).expect("two curves");
        let sides = Detail::FINE.sides as usize;
        assert_eq!(mesh.triangles.len(), 3 * 2 * sides);
        let ring = |z: f32, right: bool| {
            let points = mesh.positions.iter().filter(|p| p[2] == z && (p[0] > 3.5) == right);
            points.map(|p| (p[0] - if right { 5.0 } else { 0.0 }).hypot(p[1])).collect::<Vec<_>>()
        };
        for (z, right, radius) in [
            (0.0, false, 1.0_f32),
            (10.0, false, 2.0),
            (20.0, false, 2.0),
            (0.0, true, 0.5),
            (10.0, true, 0.5),
        ] {
            let ring = ring(z, right);
            assert_eq!(ring.len(), sides + 1, "{z} {right}");
            assert!(ring.iter().all(|r| (r / radius - 1.0).abs() < 2e-3), "{z} {right}: {ring:?}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_reported_with_its_line() {
        for (text, degree, want) in [
            ("", 3, "a.txt: found no control points in the file"),
            (
                "0 0 0 1\n0 0 1\n",
                1,
                "a.txt:2: found too few numbers in \"0 0 1\", expected x, y, z and a radius",
            ),
            (
                "0 0 0 1 7\n",
                1,
                "a.txt:1: found the additional number \"7\", expected x, y, z and a radius",
            ),
            ("0 0 0 -1\n", 1, "a.txt:1: found the radius -1, expected at least 0"),
            ("0 nan 0 1\n", 1, "a.txt:1: found \"nan\", expected a finite number"),
            ("0 0 1e39 1\n", 1, "a.txt:1: found \"1e39\", expected a finite number"),
            (
                "0 0 0 1\n\n",
                1,
                "a.txt:2: found 1 control points in the preceding curve, expected at least 2",
            ),
            (
                "0 0 0 1\n0 0 1 1\n0 1 0 1",
                3,
                "a.txt:4: found 3 control points in the preceding curve, expected at least 4",
            ),
        ] {
            assert_eq!(read(text, degree, &Limits::default()).unwrap_err(), want);
        }
        let few = Limits { triangles: Some(20), ..Limits::default() };
        let reported = read("0 0 0 1\n0 0 1 1", 1, &few).unwrap_err();
        assert!(reported.contains("exceed the limit of 20 triangles"), "{reported}");
    }

    /// Tubes of many curves have fewer sides.
    #[test]
    fn many_curves_have_fewer_sides() {
        let line = "0 0 0 1\n0 0 1 1\n\n";
        for (count, sides) in [(20_000, 48), (40_000, 24), (50_000, 12)] {
            let mesh = read(&line.repeat(count), 1, &Limits::default()).expect("curves");
            assert_eq!(mesh.triangles.len(), count * 2 * sides);
        }
    }

    /// Damaged files that can be read have finite positions.
    #[test]
    fn damaged_curves_do_no_harm() {
        let good = b"0 0 0 .1\n0 1 0 .05\n.5 1 0 .05\n.5 2 1 0\n\n1 0 0 1e2\n1 1 0 .1\n1 -1 2 3\n0 0 1 1\n";
        let mut random = pt_testing::Random::new(5);
        let mut below = |n: usize| ((random.unit() * n as f32) as usize).min(n - 1);
        let mut read = 0;
        for round in 0..2000 {
            let mut bytes = good.to_vec();
            for _ in 0..=below(3) {
                let at = below(bytes.len());
                let words = b"0123456789 \n-.e\xFF";
                bytes[at] = words[below(words.len())];
            }
            let degree = if round % 2 == 0 { 1 } else { 3 };
            let path = Path::new("a.txt");
            let context = LoadContext::new(path, &LoadOptions::default());
            if let Ok(mesh) = parse_mesh(&bytes, path, degree, DAffine3::IDENTITY, &context) {
                read += 1;
                assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()), "{bytes:?}");
            }
        }
        assert!((400..1900).contains(&read), "{read}");
    }
}
