//! Environment light: constant, or given by an image.

use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level, of_infinite_light};
use super::tree::LightBounds;
use super::{EscapedRay, Light, LightHit, LightSample, LightSampleContext, LightTables};
#[cfg(test)]
use pt_math::DVec3;
use pt_math::distribution::Piecewise2D;
use pt_math::{Mat3, Pdf, SolidAngle, Spectrum, Vec3, trig, warp};
use pt_scene::Rows;
use pt_scene::image::Image;

/// Radiance from all directions.
#[derive(Clone, Copy, Debug)]
pub struct Environment {
    /// Radiance if constant, otherwise the factor of the map.
    pub radiance: Spectrum,
    /// Environment map; `None` if constant.
    pub map: Option<PlacedMap>,
}

/// A rotated environment map.
#[derive(Clone, Copy, Debug)]
pub struct PlacedMap {
    /// Index into [`LightTables::environments`].
    pub index: u32,
    /// Orthogonal matrix from directions of the map to those of the world.
    pub to_world: Mat3,
}

impl PlacedMap {
    /// Converts a direction of the world to one of the map.
    #[inline]
    fn local(&self, d: Vec3) -> Vec3 {
        self.to_world.transpose() * d
    }

    #[inline]
    fn of<'a>(&self, tables: &'a LightTables) -> &'a EnvironmentMap {
        &tables.environments[self.index as usize]
    }
}

/// Radiance by direction: an image in latitude and longitude, and its sampling table.
///
/// Column x and row y (both in [0, 1), row 0 up) correspond to the direction with polar angle
/// θ = πy from +y and azimuth φ = 2πx, where d.x = −sin θ cos φ and d.z = sin θ sin φ. Values
/// between texel centres are interpolated linearly; the image wraps around in x and ends at the
/// poles.
pub struct EnvironmentMap {
    image: Arc<Image>,
    rows: Rows,
    density: Option<Piecewise2D>,
}

impl EnvironmentMap {
    /// Creates a map of `width` × `height` texels, the upper row first. A map without light is
    /// black.
    pub fn new(width: u32, height: u32, texels: Vec<[f32; 3]>) -> Self {
        Self::of_image(Arc::new(Image { width, height, pixels: texels.into() }), Rows::PixelCenters)
    }

    /// Image of the map.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Placement of its rows.
    pub fn rows(&self) -> Rows {
        self.rows
    }

    /// Returns true if the map uses this very image, with this placement of rows.
    pub(crate) fn is_of(&self, image: &Arc<Image>, rows: Rows) -> bool {
        let rows = if image.height == 1 { Rows::PixelCenters } else { rows };
        Arc::ptr_eq(&self.image, image) && self.rows == rows
    }

    /// Creates a map from an image with this placement of rows.
    pub fn of_image(image: Arc<Image>, rows: Rows) -> Self {
        // With a single row, the image does not depend on the latitude.
        let rows = if image.height == 1 { Rows::PixelCenters } else { rows };
        let mut map = Self { image, rows, density: None };
        let [w, h] = map.cells();
        map.density = Piecewise2D::new(&map.weights(), w, h);
        map
    }

    /// Returns the columns and rows of the cells of constant density: around each texel, or between
    /// rows if the first and last rows are at the poles.
    fn cells(&self) -> [usize; 2] {
        let between_rows = usize::from(self.rows == Rows::EndpointsAtPoles);
        [self.image.width as usize, self.image.height as usize - between_rows]
    }

    /// Returns the weight of each cell: the mean luminance of the interpolated image over the cell,
    /// times sin θ.
    ///
    /// Over half a texel from its centre, a linear interpolant has its mean at a quarter of the
    /// distance to the neighbour, hence the weights 1/8, 6/8, 1/8 along an axis. They are positive
    /// wherever the image is. Between two rows the mean is at the midpoint.
    fn weights(&self) -> Vec<f32> {
        const AROUND: [(i64, f32); 3] = [(-1, 0.125), (0, 0.75), (1, 0.125)];
        const BETWEEN: [(i64, f32); 2] = [(0, 0.5), (1, 0.5)];
        let down: &[_] = if self.rows == Rows::PixelCenters { &AROUND } else { &BETWEEN };
        let (w, h) = (i64::from(self.image.width), i64::from(self.image.height));
        let pixels = self.image.pixels.as_slice();
        let texel = |x: i64, y: i64| {
            let (x, y) = (x.rem_euclid(w), y.clamp(0, h - 1));
            Spectrum::from(pixels[(y * w + x) as usize]).luminance()
        };
        let mean = |x: i64, y: i64| {
            let row = |y: i64| AROUND.iter().map(|&(i, a)| a * texel(x + i, y)).sum::<f32>();
            down.iter().map(|&(j, b)| b * row(y + j)).sum::<f32>()
        };
        let rows = self.cells()[1];
        (0i64..)
            .zip(sines(rows))
            .flat_map(|(y, sin)| (0..w).map(move |x| (x, y, sin)))
            .map(|(x, y, sin)| mean(x, y) * sin)
            .collect()
    }

    /// Removes directions with little light from light sampling (MIS compensation), for one light
    /// sample combined with one BSDF sample, which then has to find these directions.
    ///
    /// Together, they should have the density of the light: with the density q of BSDF sampling,
    /// p + q = 2 L / ∫L. On average over all surfaces, q is 1/(2π) in their hemispheres; with the
    /// mean L̄ = ∫L / 4π this results in p ∝ max(0, L − L̄). [Karlík et al. 2019, "MIS
    /// Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling"]
    pub fn compensate(&mut self) {
        let Some(density) = &self.density else { return };
        let [w, h] = self.cells();
        let total: f64 = density.densities().iter().map(|&d| f64::from(d)).sum();
        let sines: Vec<f32> = sines(h).collect();
        let sphere: f64 = sines.iter().map(|&s| f64::from(s)).sum::<f64>() * w as f64;
        let mean = (total / sphere) as f32;
        let rows = density.densities().chunks_exact(w).zip(&sines);
        let left: Vec<f32> = rows
            .flat_map(|(row, sin)| row.iter().map(move |d| (d - mean * sin).max(0.0)))
            .collect();
        self.density = Piecewise2D::new(&left, w, h);
    }

    /// Radiance from the unit direction `d`.
    #[inline]
    pub fn radiance(&self, d: Vec3) -> Spectrum {
        let [x, y] = to_image(d);
        let (w, h) = (self.image.width as i32, self.image.height as i32);
        let fx = x * w as f32 - 0.5;
        let fy = match self.rows {
            Rows::PixelCenters => y * h as f32 - 0.5,
            Rows::EndpointsAtPoles => y * (h - 1) as f32,
        };
        let (ix, iy) = (fx.floor(), fy.floor());
        let (ax, ay) = (fx - ix, fy - iy);
        let pixels = self.image.pixels.as_slice();
        let texel = |dx: i32, dy: i32| {
            let (x, y) = (around(ix as i32 + dx, w), (iy as i32 + dy).clamp(0, h - 1));
            Spectrum::from(pixels[y as usize * w as usize + x as usize])
        };
        let row = |dy| texel(0, dy) * (1.0 - ax) + texel(1, dy) * ax;
        row(0) * (1.0 - ay) + row(1) * ay
    }

    /// Samples a direction of the map. Returns it with its density.
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Pdf<SolidAngle>)> {
        let (xy, density) = self.density.as_ref()?.sample(u);
        let (d, sin) = to_direction(xy);
        (sin > 0.0).then(|| (d, Pdf::new(density / (2.0 * PI * PI * sin))))
    }

    /// Density of a direction of the map: dω = 2π² sin θ dx dy.
    #[inline]
    fn pdf(&self, d: Vec3) -> Pdf<SolidAngle> {
        let Some(density) = &self.density else { return Pdf::ZERO };
        let sin = (d.x * d.x + d.z * d.z).sqrt();
        if sin <= 0.0 {
            return Pdf::ZERO;
        }
        Pdf::new(density.pdf(to_image(d)) / (2.0 * PI * PI * sin))
    }
}

/// Wraps column `x`, which is at most one image away, into the image.
#[inline(always)]
fn around(x: i32, width: i32) -> i32 {
    let x = if x < 0 { x + width } else { x };
    if x >= width { x - width } else { x }
}

/// Returns sin θ at the middle of each of `count` rows.
fn sines(count: usize) -> impl Iterator<Item = f32> {
    (0..count).map(move |y| trig::sin_cos((y as f32 + 0.5) / count as f32 * PI).0)
}

/// Converts a direction to image coordinates in [0, 1].
#[inline]
pub(super) fn to_image(d: Vec3) -> [f32; 2] {
    let phi = trig::atan2(-d.z, d.x) + PI;
    [(phi / TAU).clamp(0.0, 1.0), trig::acos(d.y) * FRAC_1_PI]
}

/// Converts image coordinates to a direction, and returns it with sin θ.
#[inline]
pub(super) fn to_direction([x, y]: [f32; 2]) -> (Vec3, f32) {
    let (sin_phi, cos_phi) = trig::sin_cos_tau(x);
    let (sin, cos) = trig::sin_cos(PI * y);
    (Vec3::new(-sin * cos_phi, cos, sin * sin_phi), sin)
}

impl Environment {
    /// Returns true if directions are sampled by a map that is not black.
    pub(super) fn is_sampled_by_map(&self, tables: &LightTables) -> bool {
        self.map.is_some_and(|placed| placed.of(tables).density.is_some())
    }
}

impl Light for Environment {
    const DELTA: bool = false;

    #[inline]
    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let at_infinity = |wi, radiance, pdf| LightSample {
            wi,
            distance: f32::INFINITY,
            end: None,
            radiance,
            pdf: Some(pdf),
        };
        let Some(placed) = &self.map else {
            let wi = warp::uniform_sphere(u);
            return Some(at_infinity(wi, self.radiance, warp::uniform_sphere_pdf()));
        };
        let (d, pdf) = placed.of(tables).sample(u)?;
        let wi = placed.to_world * d;
        Some(at_infinity(wi, self.le_infinite(tables, EscapedRay::new(context.p, wi)), pdf))
    }

    #[inline]
    fn pdf(
        &self,
        tables: &LightTables,
        _: &LightSampleContext,
        wi: Vec3,
        _: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        match &self.map {
            None => warp::uniform_sphere_pdf(),
            Some(placed) => placed.of(tables).pdf(placed.local(wi)),
        }
    }

    #[inline]
    fn le_infinite(&self, tables: &LightTables, ray: EscapedRay) -> Spectrum {
        match &self.map {
            None => self.radiance,
            Some(placed) => placed.of(tables).radiance(placed.local(ray.direction)) * self.radiance,
        }
    }

    fn is_constant(&self) -> bool {
        self.map.is_none()
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// A constant environment, and a map with a bright texel, a dark half and a smooth rest: as it
    /// is, and rotated, mirrored and with rows from pole to pole.
    fn examples() -> Vec<(Self, LightTables)> {
        let constant = Self { radiance: Spectrum::splat(0.5), map: None };
        let (width, height) = (16u32, 8u32);
        let pixels = (0..width * height)
            .map(|i| match (i % width, i / width) {
                (3, 2) => [40.0; 3],
                (x, _) if x >= 8 => [0.0; 3],
                (x, y) => [0.1 * x as f32, 0.2 * y as f32, 0.3],
            })
            .collect();
        let image = Arc::new(Image { width, height, pixels });
        let (s, t) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.48, 0.36, 0.8));
        let turned = Mat3::from_cols(s, t, t.cross(s));
        let maps = [(Mat3::IDENTITY, Rows::PixelCenters), (turned, Rows::EndpointsAtPoles)];
        let of_map = |(to_world, rows)| {
            let mut tables = LightTables::default();
            let map = EnvironmentMap::of_image(Arc::clone(&image), rows);
            tables.environments.push(Arc::new(map));
            let map = Some(PlacedMap { index: 0, to_world });
            (Self { radiance: Spectrum::ONE, map }, tables)
        };
        std::iter::once((constant, LightTables::default())).chain(maps.map(of_map)).collect()
    }
}

#[cfg(test)]
impl LightLaws for Environment {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    fn irradiance(&self, tables: &LightTables, _: DVec3, n: DVec3) -> f64 {
        match self.map {
            None => level(self.radiance) * std::f64::consts::PI,
            Some(_) => of_infinite_light(self, tables, n),
        }
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::{Chi2, Random, chi2_sphere};

    use super::*;

    /// A dark map with one bright texel.
    fn map() -> EnvironmentMap {
        let texels = (0..128).map(|i| match i {
            37 => [50.0; 3],
            _ => [0.1; 3],
        });
        EnvironmentMap::new(16, 8, texels.collect())
    }

    #[test]
    fn compensated_maps_are_sampled_by_their_density() {
        let mut map = map();
        map.compensate();
        let sample = |u| map.sample(u).map(|s| s.0);
        let config = Chi2::new("a compensated map");
        chi2_sphere(sample, |d| map.pdf(d).get(), &config).unwrap_or_else(|e| panic!("{e}"));
    }

    /// For this map these are most directions, but none that is brighter than the mean.
    #[test]
    fn dark_directions_are_left_to_the_bsdf() {
        let (plain, mut map) = (map(), map());
        map.compensate();
        let mut random = Random::new(1);
        let count = 10_000;
        let left = (0..count).filter(|_| {
            let d = random.direction();
            assert!(plain.pdf(d).get() > 0.0);
            let is_left = map.pdf(d).get() == 0.0;
            assert!(!is_left || plain.radiance(d).luminance() < 50.0 / 4.0);
            is_left
        });
        let left = left.count();
        assert!(left > 9 * count / 10 && left < count, "{left}");
    }

    /// A constant map is left to BSDF sampling entirely.
    #[test]
    fn even_maps_are_not_sampled_beside_the_bsdf() {
        let mut map = EnvironmentMap::new(4, 2, vec![[0.7; 3]; 8]);
        map.compensate();
        assert!(map.sample([0.3, 0.6]).is_none() && map.pdf(Vec3::X).get() == 0.0);
    }
}
