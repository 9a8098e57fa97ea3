//! `realistic` cameras: lens systems, approximated by the thin lens that is equivalent for paraxial
//! rays.
//!
//! Paraxial rays are pairs (y, u) of a height and a slope, on which a lens acts linearly.
//! Refraction at a surface of radius R from index n to n′ yields the slope u′ with n′u′ = nu − y(n′
//! − n)/R, and propagation over a distance s the height y + su. [Hecht, Optics, 5th ed., §6.2]
//! Lengths are in millimetres, and are measured along the axis from the scene to the film.

use std::path::Path;

use pt_scene::Projection;

use super::entity::Entity;
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::number::number;
use crate::shared::text;

/// Maximum number of surfaces of a lens.
const MAX: usize = 1000;
/// Smallest valid value of a property of a lens; the largest one is its inverse.
const MIN: f64 = 1e-12;
/// Scene units (metres) per unit of lens files (millimetres).
const METRES: f64 = 1e-3;

/// A surface of a lens, and the space behind it.
#[derive(Clone, Copy, Debug)]
struct LensSurface {
    /// Radius of curvature, positive if the surface is convex towards the scene; 0 for the stop or
    /// a plane.
    radius: f64,
    /// Distance to the next surface.
    thickness: f64,
    index: f64,
    aperture: f64,
}

/// The equivalent thin lens. Lengths are in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// Distance from the film to the thin lens, which is at the entrance pupil.
    pub(super) distance: f64,
    /// Radius of the entrance pupil.
    pub(super) radius: f64,
    /// Distance from the pupil to the plane in focus.
    pub(super) focal_distance: f64,
    /// Tangents of half the field of view, along the sides of the film.
    pub(super) extent: [f64; 2],
    /// Irradiance at the centre of the film, per unit radiance.
    pub(super) light: f64,
    /// Focal length in millimetres; `number` is the f-number.
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

/// Ray transfer matrix: (y, u) becomes (ay + bu, cy + du).
#[derive(Clone, Copy, Debug)]
struct Optics {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

impl Optics {
    const NONE: Self = Self { a: 1.0, b: 0.0, c: 0.0, d: 1.0 };

    /// Appends propagation over a distance.
    fn over(self, distance: f64) -> Self {
        Self { a: self.a + distance * self.c, b: self.b + distance * self.d, ..self }
    }

    /// Appends refraction at a surface.
    fn through(self, radius: f64, [before, behind]: [f64; 2]) -> Self {
        let power = if radius == 0.0 { 0.0 } else { (behind - before) / radius };
        let bent = |height: f64, slope: f64| (before * slope - height * power) / behind;
        Self { c: bent(self.a, self.c), d: bent(self.b, self.d), ..self }
    }
}

/// Reads the lens of a camera for a film of a size in millimetres.
pub(super) fn lens(entity: &Entity, film: [f64; 2], folder: &Folder) -> Result<Lens, LoadError> {
    let refuse = |message: String| entity.refuse("lensfile", message);
    let name = entity
        .text("lensfile")?
        .ok_or_else(|| refuse("missing lensfile; expected the surfaces of the lens".into()))?;
    let stop = entity.positive("aperturediameter", 1.0)?;
    let focus = entity.positive("focusdistance", 10.0)? / METRES;
    let bytes = folder.context.read(&folder.join(name)).map_err(refuse)?;
    let text = text::characters(&bytes, Path::new(name)).map_err(|e| refuse(e.to_string()))?;
    let surfaces = surfaces(&text, stop).map_err(|message| refuse(format!("{name}: {message}")))?;
    thin(&surfaces, film, focus).map_err(|message| entity.refuse("focusdistance", message))
}

/// Reads a lens file. The diameter of the stop is at most `stop`.
fn surfaces(text: &str, stop: f64) -> Result<Vec<LensSurface>, String> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let numbers = lines.flat_map(str::split_whitespace).take(4 * MAX + 1).map(number);
    let numbers = numbers.collect::<Result<Vec<f64>, String>>()?;
    let (rows, rest) = numbers.as_chunks::<4>();
    if !rest.is_empty() || rows.is_empty() || rows.len() > MAX {
        return Err(format!(
            "expected four numbers per surface (radius, distance to the next, index of refraction \
             and diameter) of 1 to {MAX} surfaces"
        ));
    }
    rows.iter()
        .map(|&[radius, thickness, index, aperture]| {
            let is_good = numbers.iter().all(|x| x.is_finite()) && aperture > 0.0 && index >= 0.0;
            if !is_good {
                return Err(format!(
                    "found the surface {radius} {thickness} {index} {aperture}, expected a \
                     diameter above 0 and an index of refraction of at least 0"
                ));
            }
            let aperture = if radius == 0.0 { aperture.min(stop) } else { aperture };
            let index = if index == 0.0 { 1.0 } else { index };
            Ok(LensSurface { radius, thickness, index, aperture })
        })
        .collect()
}

/// Computes the thin lens, focused at a distance from the film.
fn thin(surfaces: &[LensSurface], film: [f64; 2], focus: f64) -> Result<Lens, String> {
    let mut optics = Optics::NONE;
    let (mut length, mut before) = (0.0, 1.0);
    // Aperture stop of rays parallel to the axis: their height, and the optics up to it.
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
        return Err(
            "found a lens that forms no image, expected one with a focal length above 0".to_owned()
        );
    };
    // Positions of the principal planes: of the first one from the front surface, of the second one
    // from the last surface; and the distance between the two.
    let front = (optics.d - 1.0) / optics.c;
    let back = (1.0 - optics.a) / optics.c;
    let between = length + back - front;
    let span = focus - between;
    let square = span * span - 4.0 * span * focal_length;
    if !(span > 0.0 && square >= 0.0) {
        let least = (4.0 * focal_length + between) * METRES;
        return Err(format!(
            "a lens of {focal_length:.1} mm cannot focus at {} m in front of the film; expected at \
             least {least:.3} m",
            focus * METRES
        ));
    }
    let to_film = 0.5 * (span - square.sqrt()) + back;
    let front_to_pupil = to_pupil.b / to_pupil.a;
    let distance = to_film + length - front_to_pupil;
    let focal_distance = focus - distance;
    let whole = optics.over(to_film);
    // A ray of slope 1 through the centre of the pupil, and one from the point in focus through its
    // edge.
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
            "found a focus inside of the lens or an unusable pupil of {} m, {} m behind it, \
             expected a longer focusdistance or another lens",
            lens.radius, lens.focal_distance
        ));
    }
    Ok(lens)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Glass lenses around a stop, and a flat plate behind them.
    const TEXT: &str = "# radius thickness index diameter\n\
        40 6 1.62 24 -90 3 0 24\n 0 4 0 12\n-60 2 1.7 20\n 50 5 0 20 80 7 1.62 22 -35 2 1 22\n\
        0 1.5 1.5 40 0 0 1 40";
    const FILM: [f64; 2] = [24.0, 16.0];

    fn length(surfaces: &[LensSurface]) -> f64 {
        surfaces.iter().rev().skip(1).map(|s| s.thickness).sum()
    }

    /// Traces a ray with this height and slope at the first surface through all surfaces by Snell's
    /// law, and returns its height and slope at the last one.
    fn followed(surfaces: &[LensSurface], height: f64, slope: f64) -> [f64; 2] {
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
                // The solution of |o + td| = |R| near the vertex, with o relative to the centre of
                // curvature.
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

    /// Distances from the first surface to the plane in focus, and from the last surface to the
    /// film, by paraxial rays.
    fn sharp(surfaces: &[LensSurface], focus: f64) -> [f64; 2] {
        const NEAR: f64 = 1e-4;
        let to_film = |to_front: f64| {
            let [y, u] = followed(surfaces, NEAR, NEAR / to_front);
            -y / u
        };
        // Beyond twice the focal length, the film approaches more slowly than the plane in focus
        // recedes.
        let (mut low, mut high) = (150.0, focus);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            let is_beyond = middle + length(surfaces) + to_film(middle) > focus;
            *(if is_beyond { &mut high } else { &mut low }) = middle;
        }
        [low, to_film(low)]
    }

    /// Rays from a point of the plane in focus through different points of the pupil meet in one
    /// point of the film: the image point of the thin lens.
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

    /// Lenses with numbers of any size are rejected, or yield a valid camera.
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

    /// A thin lens of 100 mm and f/5 whose stop is just behind it.
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
