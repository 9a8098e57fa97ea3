//! Environment maps in layouts other than latitude and longitude.

use std::f64::consts::{FRAC_1_PI, FRAC_2_PI, PI, TAU};

use pt_math::DVec3;

use crate::image::Image;

/// Layout of a square environment map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyLayout {
    /// Angular map (light probe): the centre is −z, the rim of the disk is +z, and the distance
    /// from the centre is proportional to the angle; +x is at the right, +y at the top. [Debevec
    /// 1998, "Rendering Synthetic Objects into Real Scenes"; format of his light probe images]
    Angular,
    /// Mirror ball, seen along −z by a distant camera: the centre reflects the direction behind the
    /// camera, +z, and the rim the direction behind the ball.
    MirrorBall,
    /// Equal-area octahedral map: the centre is +y, the corners are −y, +x is at the right and +z
    /// at the bottom, as in pbrt-v4 with its +z up. [Clarberg 2008, "Fast Equal-Area Mapping of the
    /// (Hemi)Sphere using SIMD"]
    Octahedral,
}

impl SkyLayout {
    /// Returns the point of the unit square for a direction, from the upper left corner.
    fn square_of(self, direction: DVec3) -> [f64; 2] {
        let DVec3 { x, y, z } = direction.normalize_or_zero();
        let [u, v] = match self {
            Self::Angular => {
                let across = libm::hypot(x, y);
                let r = if across > 0.0 { libm::acos(-z) * FRAC_1_PI / across } else { 0.0 };
                [x * r, -y * r]
            }
            Self::MirrorBall => {
                let normal = DVec3::new(x, y, z + 1.0).normalize_or_zero();
                [normal.x, -normal.y]
            }
            Self::Octahedral => return square_of(DVec3::new(x, z, y)),
        };
        [u, v].map(|t| 0.5 * (t + 1.0))
    }

    /// Resamples an image to latitude and longitude, as in [`crate::LightKind::Environment`].
    ///
    /// # Errors
    /// Returns a message if the image is not square.
    pub fn in_latitude_and_longitude(self, image: &Image) -> Result<Image, String> {
        if image.width != image.height {
            return Err(format!(
                "found an image of {} × {} pixels, expected a square for this layout",
                image.width, image.height
            ));
        }
        Ok(by_directions(image, |d| self.square_of(DVec3::new(d.x, d.z, d.y))))
    }
}

/// Returns the point of the equal-area octahedral map for a direction. The centre is +z, the
/// corners are −z; u increases with x, v with y.
pub fn square_of(direction: DVec3) -> [f64; 2] {
    let d = direction.normalize_or_zero();
    let [x, y, z] = d.abs().to_array();
    let r = (1.0 - z).max(0.0).sqrt();
    let turn = libm::atan2(x.min(y), x.max(y)) * FRAC_2_PI;
    let turn = if x < y { 1.0 - turn } else { turn };
    let v = turn * r;
    let u = r - v;
    let (u, v) = if d.z < 0.0 { (1.0 - v, 1.0 - u) } else { (u, v) };
    [u.copysign(d.x), v.copysign(d.y)].map(|t| 0.5 * (t + 1.0))
}

/// Resamples an equal-area octahedral map to latitude and longitude. The layout is that of
/// [`crate::LightKind::Environment`] with +z of the map up: the left edge is −x, and the column at
/// a quarter of the width is +y.
///
/// Each texel is the mean over a grid of its directions, weighted by solid angle.
pub fn latitude_longitude(square: &Image) -> Image {
    by_directions(square, square_of)
}

/// Resamples a map of any layout to latitude and longitude, with +z up.
fn by_directions(square: &Image, square_of: impl Fn(DVec3) -> [f64; 2]) -> Image {
    const GRID: u32 = 4;
    let side = square.width;
    let height = if side <= 1024 { 2 * side } else { side };
    let width = 2 * height;
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for row in 0..height {
        for column in 0..width {
            let (mut sum, mut weight) = ([0.0; 3], 0.0);
            for i in 0..GRID * GRID {
                let at = |k: u32, texel: u32, count: u32| {
                    (f64::from(texel) + (f64::from(k) + 0.5) / f64::from(GRID)) / f64::from(count)
                };
                let (sin, cos) = libm::sincos(at(i / GRID, row, height) * PI);
                let (across, along) = libm::sincos(at(i % GRID, column, width) * TAU);
                let direction = DVec3::new(-sin * along, sin * across, cos);
                let texel = nearest(square, square_of(direction));
                (0..3).for_each(|c| sum[c] += sin * f64::from(texel[c]));
                weight += sin;
            }
            pixels.push(sum.map(|s| (s / weight) as f32));
        }
    }
    Image { width, height, pixels: pixels.into() }
}

fn nearest(image: &Image, uv: [f64; 2]) -> [f32; 3] {
    let [x, y] = [0, 1].map(|axis| {
        let count = if axis == 0 { image.width } else { image.height };
        ((uv[axis] * f64::from(count)) as u32).min(count - 1)
    });
    image.pixels[y as usize * image.width as usize + x as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map with one bright spot at a direction becomes a map that is bright in that direction.
    #[test]
    fn layouts_show_directions_where_they_say() {
        use SkyLayout::{Angular, MirrorBall, Octahedral};
        let half = f64::sqrt(0.5);
        for (layout, direction, [u, v]) in [
            (Angular, DVec3::NEG_Z, [0.5, 0.5]),
            (Angular, DVec3::X, [0.75, 0.5]),
            (Angular, DVec3::Y, [0.5, 0.25]),
            (Angular, DVec3::new(-half, 0.0, half), [0.5 - 0.375, 0.5]),
            (MirrorBall, DVec3::Z, [0.5, 0.5]),
            (MirrorBall, DVec3::X, [0.5 + half / 2.0, 0.5]),
            (MirrorBall, DVec3::Y, [0.5, 0.5 - half / 2.0]),
            (Octahedral, DVec3::Y, [0.5, 0.5]),
            (Octahedral, DVec3::X, [1.0, 0.5]),
            (Octahedral, DVec3::Z, [0.5, 1.0]),
        ] {
            let found = layout.square_of(direction);
            assert!(
                (found[0] - u).abs() < 1e-9 && (found[1] - v).abs() < 1e-9,
                "{layout:?} {found:?}"
            );
            let side = 64;
            let pixel = |t: f64| ((t * f64::from(side)) as i64).min(i64::from(side) - 1);
            let (x, y) = (pixel(found[0]), pixel(found[1]));
            let value = |i: u32| {
                let (dx, dy) = (i64::from(i % side) - x, i64::from(i / side) - y);
                if dx.abs() < 3 && dy.abs() < 3 { [1.0; 3] } else { [0.0; 3] }
            };
            let square =
                Image { width: side, height: side, pixels: (0..side * side).map(value).collect() };
            let map = layout.in_latitude_and_longitude(&square).unwrap();
            // The upper row is +y, the left edge −x, and the column at a quarter of the width +z.
            let across = (libm::atan2(direction.z, -direction.x) / TAU).rem_euclid(1.0);
            let down = libm::acos(direction.y) / PI;
            let [column, row] = [(across, map.width), (down, map.height)]
                .map(|(t, n)| ((t * f64::from(n)) as u32).min(n - 1));
            assert_eq!(
                map.pixels[(row * map.width + column) as usize],
                [1.0; 3],
                "{layout:?} {direction}"
            );
        }
        let oblong = Image { width: 2, height: 1, pixels: vec![[0.0; 3]; 2].into() };
        assert!(Angular.in_latitude_and_longitude(&oblong).is_err());
    }

    #[test]
    fn the_axes_are_where_they_are_expected() {
        for (direction, expected) in [
            (DVec3::Z, [0.5, 0.5]),
            (DVec3::X, [1.0, 0.5]),
            (DVec3::NEG_X, [0.0, 0.5]),
            (DVec3::Y, [0.5, 1.0]),
            (DVec3::NEG_Y, [0.5, 0.0]),
            (DVec3::new(1e-9, 1e-9, -1.0), [1.0, 1.0]),
            (DVec3::new(-1e-9, 1e-9, -1.0), [0.0, 1.0]),
        ] {
            let found = square_of(direction);
            assert!(
                (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-4),
                "{direction}: {found:?}"
            );
        }
    }

    /// The density of the map is 1 / 4π everywhere: |∂(u, v)/∂ω|, by finite differences.
    #[test]
    fn all_directions_have_the_same_area() {
        const STEP: f64 = 1e-5;
        for i in 0..200 {
            let z = 0.97 * libm::sin(f64::from(i) * 1.37);
            let (sin, cos) = libm::sincos(f64::from(i) * 2.71 + 0.1);
            let r = (1.0 - z * z).sqrt();
            let n = DVec3::new(r * cos, r * sin, z);
            if n.abs().min_element() < 0.01 || (n.x.abs() - n.y.abs()).abs() < 0.01 {
                continue; // the folds
            }
            let s = n.any_orthonormal_vector();
            let t = n.cross(s);
            let [a, b, c] = [n, n + s * STEP, n + t * STEP].map(square_of);
            let [du, dv] = [[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]];
            let area = (du[0] * dv[1] - du[1] * dv[0]).abs() / (STEP * STEP);
            assert!((area * 4.0 * PI - 1.0).abs() < 1e-3, "{n}: {area}");
        }
    }

    #[test]
    fn a_map_in_latitude_and_longitude_shows_the_same_with_the_same_mean() {
        let side = 16;
        let value = |i: u32| [(i % 7) as f32, (i % 5) as f32, 1.0];
        let square =
            Image { width: side, height: side, pixels: (0..side * side).map(value).collect() };
        let map = latitude_longitude(&square);
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for (i, pixel) in map.pixels.iter().enumerate() {
            let row = i / map.width as usize;
            let weight = libm::sin((row as f64 + 0.5) / f64::from(map.height) * PI);
            (0..3).for_each(|c| sum[c] += weight * f64::from(pixel[c]));
            weights += weight;
        }
        for c in 0..3 {
            let mean =
                square.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / f64::from(side * side);
            assert!(
                (sum[c] / weights / mean - 1.0).abs() < 5e-3,
                "{} is not {mean}",
                sum[c] / weights
            );
        }
    }
}
