//! `realistic` cameras: lenses of many surfaces, taken as the thin lens that does the same near the
//! axis.
//!
//! Rays near the axis are (y, u), a height and a slope, on which what a lens does is linear: a
//! surface of radius R from index n to n′ makes n′u′ = nu − y(n′ − n)/R of a slope, and a distance
//! s makes y + su of a height. [Hecht, Optics, 5th ed., §6.2] Lengths are in millimetres, and along
//! the axis from the scene to the film.

use std::path::Path;

use super::super::context::Folder;
use super::super::text;
use super::entity::{Entity, number};
use crate::{LoadError, Projection};

/// The most surfaces of a lens.
const MAX: usize = 1000;
/// The least of what can be computed with; the greatest is its inverse.
const MIN: f64 = 1e-12;
/// Lengths of lens files in those of a scene.
const METRES: f64 = 1e-3;

/// A surface of a lens, and what is behind it.
#[derive(Clone, Copy, Debug)]
struct Surface {
    /// Its radius, above 0 where the scene sees it bulge; 0 is the stop, or flat.
    radius: f64,
    /// The distance to the next one.
    thickness: f64,
    index: f64,
    aperture: f64,
}

/// A lens as seen from afar. Lengths are in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// How far in front of the film what stands for it is: its entrance pupil.
    pub(super) distance: f64,
    /// Radius of the pupil.
    pub(super) radius: f64,
    /// How far in front of the pupil all is sharp.
    pub(super) focal_distance: f64,
    /// Tangents of half of what the film sees, along its sides.
    pub(super) extent: [f64; 2],
    /// What arrives in the middle of the film, over the radiance that is there.
    pub(super) light: f64,
    /// The focal length in millimetres, and its number.
    pub(super) focal_length: f64,
    pub(super) number: f64,
}

impl Lens {
    /// Perspective projection that covers the film.
    pub(super) fn projection(&self) -> Projection {
        let [x_fov, y_fov] = self.extent.map(|half| 2.0 * libm::atan(half).to_degrees());
        Projection::Perspective { x_fov, y_fov }
    }
}

/// What happens to rays: (y, u) becomes (ay + bu, cy + du).
#[derive(Clone, Copy, Debug)]
struct Optics {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

impl Optics {
    const NONE: Self = Self { a: 1.0, b: 0.0, c: 0.0, d: 1.0 };

    /// And then over a distance.
    fn over(self, distance: f64) -> Self {
        Self { a: self.a + distance * self.c, b: self.b + distance * self.d, ..self }
    }

    /// And then through a surface.
    fn through(self, radius: f64, [before, behind]: [f64; 2]) -> Self {
        let power = if radius == 0.0 { 0.0 } else { (behind - before) / radius };
        let bent = |height: f64, slope: f64| (before * slope - height * power) / behind;
        Self { c: bent(self.a, self.c), d: bent(self.b, self.d), ..self }
    }
}

/// The lens of a camera before a film of this size, in millimetres.
pub(super) fn lens(entity: &Entity, film: [f64; 2], folder: &Folder) -> Result<Lens, LoadError> {
    let refuse = |message: String| entity.refuse("lensfile", message);
    let name = entity
        .text("lensfile")?
        .ok_or_else(|| refuse("there is no lensfile; expected the surfaces of the lens".into()))?;
    let stop = entity.positive("aperturediameter", 1.0)?;
    let focus = entity.positive("focusdistance", 10.0)? / METRES;
    let bytes = folder.context.read(&folder.join(name)).map_err(refuse)?;
    let text = text::characters(&bytes, Path::new(name)).map_err(|e| refuse(e.to_string()))?;
    let surfaces = surfaces(&text, stop).map_err(|message| refuse(format!("{name}: {message}")))?;
    thin(&surfaces, film, focus).map_err(|message| entity.refuse("focusdistance", message))
}

/// Reads a lens file, of which the stop has a diameter of its own.
fn surfaces(text: &str, stop: f64) -> Result<Vec<Surface>, String> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let numbers = lines.flat_map(str::split_whitespace).take(4 * MAX + 1).map(number);
    let numbers = numbers.collect::<Result<Vec<f64>, String>>()?;
    let (rows, rest) = numbers.as_chunks::<4>();
    if !rest.is_empty() || rows.is_empty() || rows.len() > MAX {
        return Err(format!(
            "expected four numbers for each surface, of which there are 1 to {MAX}: radius, distance to \
             the next, index of refraction and diameter"
        ));
    }
    rows.iter()
        .map(|&[radius, thickness, index, aperture]| {
            let is_good = numbers.iter().all(|x| x.is_finite()) && aperture > 0.0 && index >= 0.0;
            if !is_good {
                return Err(format!(
                    "the surface {radius} {thickness} {index} {aperture} makes no sense; expected a diameter \
                     above 0, and an index of refraction of at least 0"
                ));
            }
            let aperture = if radius == 0.0 { aperture.min(stop) } else { aperture };
            let index = if index == 0.0 { 1.0 } else { index };
            Ok(Surface { radius, thickness, index, aperture })
        })
        .collect()
}

/// The thin lens, focused at a distance in front of the film.
fn thin(surfaces: &[Surface], film: [f64; 2], focus: f64) -> Result<Lens, String> {
    let mut optics = Optics::NONE;
    let (mut length, mut before) = (0.0, 1.0);
    // What limits rays that are parallel to the axis: its height there, and the optics up to it.
    let mut pupil: Option<(f64, Optics)> = None;
    for (i, surface) in surfaces.iter().enumerate() {
        let radius = 0.5 * surface.aperture / optics.a.abs();
        if pupil.is_none_or(|(least, _)| radius < least) {
            pupil = Some((radius, optics));
        }
        let is_last = i + 1 == surfaces.len();
        let behind = if is_last { 1.0 } else { surface.index };
        optics = optics.through(surface.radius, [before, behind]);
        if !is_last {
            optics = optics.over(surface.thickness);
            length += surface.thickness;
        }
        before = behind;
    }
    let focal_length = -1.0 / optics.c;
    let usable = pupil.filter(|_| focal_length > 0.0 && focal_length.is_finite());
    let Some((radius, to_pupil)) = usable else {
        return Err("the lens makes no image; expected one with a focal length above 0".to_owned());
    };
    // From the front to one principal plane, from the other to the film, and between the two.
    let front = (optics.d - 1.0) / optics.c;
    let back = (1.0 - optics.a) / optics.c;
    let between = length + back - front;
    let span = focus - between;
    let square = span * span - 4.0 * span * focal_length;
    if !(span > 0.0 && square >= 0.0) {
        let least = (4.0 * focal_length + between) * METRES;
        return Err(format!(
            "a lens of {focal_length:.1} mm has no sharp image of what is {} m in front of the film; expected at \
             least {least:.3} m",
            focus * METRES
        ));
    }
    let to_film = 0.5 * (span - square.sqrt()) + back;
    let front_to_pupil = to_pupil.b / to_pupil.a;
    let distance = to_film + length - front_to_pupil;
    let focal_distance = focus - distance;
    let whole = optics.over(to_film);
    // A ray of slope 1 through the middle of the pupil, and one from the point that is sharp
    // through its edge.
    let height = whole.b - whole.a * front_to_pupil;
    let slope = radius / focal_distance;
    let arriving = optics.c * (radius - front_to_pupil * slope) + optics.d * slope;
    let lens = Lens {
        distance: distance * METRES,
        radius: radius * METRES,
        focal_distance: focal_distance * METRES,
        extent: film.map(|side| 0.5 * side / height.abs()),
        light: std::f64::consts::PI * arriving * arriving,
        focal_length,
        number: focal_length / (2.0 * radius),
    };
    let [x, y] = lens.extent;
    let is_good = |x: f64| (MIN..1.0 / MIN).contains(&x);
    if ![lens.radius, lens.focal_distance, x, y, lens.light].into_iter().all(is_good) {
        return Err(format!(
            "what is sharp lies inside of the lens, or nothing sensible is seen: a pupil of {} m that is {} m behind \
             it; expected a longer focusdistance, or another lens",
            lens.radius, lens.focal_distance
        ));
    }
    Ok(lens)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lenses of glass around a stop, and a flat plate behind them.
    const TEXT: &str = "# radius thickness index diameter\n\
        40 6 1.62 24 -90 3 0 24\n 0 4 0 12\n-60 2 1.7 20\n 50 5 0 20 80 7 1.62 22 -35 2 1 22\n\
        0 1.5 1.5 40 0 0 1 40";
    const FILM: [f64; 2] = [24.0, 16.0];

    fn length(surfaces: &[Surface]) -> f64 {
        surfaces.iter().rev().skip(1).map(|s| s.thickness).sum()
    }

    /// Follows a ray with this height and slope at the first surface through all of them by Snell's
    /// law, to those at the last one.
    fn followed(surfaces: &[Surface], height: f64, slope: f64) -> [f64; 2] {
        let (mut z, mut y, mut angle) = (0.0, height, slope.atan());
        let (mut before, mut vertex) = (1.0, 0.0);
        for (i, surface) in surfaces.iter().enumerate() {
            let is_last = i + 1 == surfaces.len();
            let behind = if is_last { 1.0 } else { surface.index };
            let snell = |sin: f64| (before / behind * sin).asin();
            if surface.radius == 0.0 {
                y += (vertex - z) * angle.tan();
                z = vertex;
                angle = snell(angle.sin());
            } else {
                // |o + td| = |R| with o as seen from the centre, where it is near the vertex.
                let (dz, dy) = (angle.cos(), angle.sin());
                let (oz, oy) = (z - vertex - surface.radius, y);
                let b = oz * dz + oy * dy;
                let c = oz * oz + oy * oy - surface.radius * surface.radius;
                let t = -b - surface.radius.signum() * (b * b - c).sqrt();
                (z, y) = (z + t * dz, y + t * dy);
                let normal = (y / surface.radius).asin();
                angle = snell((angle + normal).sin()) - normal;
            }
            before = behind;
            vertex += if is_last { 0.0 } else { surface.thickness };
        }
        [y + (vertex - z) * angle.tan(), angle.tan()]
    }

    /// How far what is sharp is in front of the first surface, and the film behind the last one, by
    /// rays near the axis.
    fn sharp(surfaces: &[Surface], focus: f64) -> [f64; 2] {
        const NEAR: f64 = 1e-4;
        let to_film = |to_front: f64| {
            let [y, u] = followed(surfaces, NEAR, NEAR / to_front);
            -y / u
        };
        // From twice the focal length on, the film comes nearer more slowly than what is sharp goes
        // away.
        let (mut low, mut high) = (150.0, focus);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            let is_beyond = middle + length(surfaces) + to_film(middle) > focus;
            *(if is_beyond { &mut high } else { &mut low }) = middle;
        }
        [low, to_film(low)]
    }

    /// From a point of the plane that is sharp through different points of the pupil: rays arrive
    /// in one point of the film, which is that where the thin lens has them from.
    #[test]
    fn near_the_axis_the_thin_lens_does_what_all_surfaces_do() {
        let surfaces = surfaces(TEXT, 100.0).expect("it makes sense");
        for focus in [400.0, 2000.0, 1e6] {
            let lens = thin(&surfaces, FILM, focus).expect("it has an image");
            let [to_front, to_film] = sharp(&surfaces, focus);
            let [distance, focal] = [lens.distance, lens.focal_distance].map(|x| x / METRES);
            assert!((distance + focal - focus).abs() < 1e-6 * focus);
            let front_to_pupil = focal - to_front;
            assert!((to_film + length(&surfaces) - front_to_pupil - distance).abs() < 1e-3);
            let tangent = 1e-4;
            for height in [-0.02, 0.0, 0.02] {
                let slope = tangent + height / focal;
                let [y, u] = followed(&surfaces, height - front_to_pupil * slope, slope);
                let arrives = (y + to_film * u).abs();
                let wanted = 0.5 * FILM[0] / lens.extent[0] * tangent;
                assert!(
                    (arrives / wanted - 1.0).abs() < 1e-3,
                    "{focus} {height}: {arrives} {wanted}"
                );
            }
        }
    }

    /// Lenses of numbers of all sizes are refused, or give a camera that makes sense.
    #[test]
    fn no_lens_makes_no_sense() {
        let mut random = pt_testing::Random::new(2);
        let mut good = 0;
        for _ in 0..40_000 {
            let count = 1 + (5.0 * random.unit()) as usize;
            let mut number = || match (8.0 * random.unit()) as u32 {
                0 => 0.0,
                1 => -f64::from(random.unit()) * 1e38,
                2 => 1e-38,
                _ => 100.0 * (f64::from(random.unit()) - 0.3),
            };
            let rows = (0..count).map(|_| {
                let [radius, thickness, index, aperture] = [0; 4].map(|_| number());
                format!("{radius} {thickness} {} {}\n", index.abs() * 0.02, aperture.abs())
            });
            let Ok(surfaces) = surfaces(&rows.collect::<String>(), 20.0) else { continue };
            let Ok(lens) = thin(&surfaces, FILM, 3000.0) else { continue };
            good += 1;
            let Projection::Perspective { x_fov, y_fov } = lens.projection() else { panic!() };
            for fov in [x_fov, y_fov] {
                assert!(fov > 0.0 && fov < 180.0, "{lens:?}");
            }
            assert!(lens.distance.is_finite() && lens.light.is_finite(), "{lens:?}");
        }
        assert!(good > 1000, "{good}");
    }

    /// Of a thin lens of 100 mm and f/5 whose stop is just behind it.
    #[test]
    fn numbers_are_those_of_text_books() {
        let text = "100 1e-9 1.5 50  -100 1e-9 1 50  0 0 0 50";
        let surfaces = surfaces(text, 20.0).expect("it makes sense");
        let lens = thin(&surfaces, FILM, 1e9).expect("it has an image");
        let is_near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        assert!(is_near(lens.focal_length, 100.0) && is_near(lens.number, 5.0), "{lens:?}");
        assert!(is_near(lens.radius, 0.01) && is_near(lens.distance, 0.1), "{lens:?}");
        assert!(is_near(lens.light, std::f64::consts::PI / 100.0), "{lens:?}");
        assert!(is_near(lens.extent[0], 0.12) && is_near(lens.extent[1], 0.08), "{lens:?}");
        // 1/300 + 1/150 = 1/100.
        let lens = thin(&surfaces, FILM, 450.0).expect("it has an image");
        assert!(is_near(lens.distance, 0.15) && is_near(lens.focal_distance, 0.3), "{lens:?}");
        assert!(thin(&surfaces, FILM, 399.0).is_err());
    }
}
