//! Light from all around, far away: constant, or by an image.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use pt_math::distribution::Piecewise2D;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, trig, warp};

use super::{Light, LightHit, LightSample, LightTables};

/// All of the sky.
#[derive(Clone, Copy, Debug)]
pub struct Environment {
    /// What a constant sky radiates, or by what a map is multiplied.
    pub radiance: Spectrum,
    /// Index into [`LightTables::environments`]; `None` is constant.
    pub map: Option<u32>,
}

/// Radiance by direction: an image in latitude and longitude, and how to sample it.
///
/// Column x and row y (both in [0, 1), row 0 up) look in the direction of polar angle θ = πy from
/// +y and azimuth φ = 2πx, where d.x = −sin θ cos φ and d.z = sin θ sin φ. Values between texel
/// centres are interpolated linearly; the image wraps around in x and ends at the poles.
pub struct EnvironmentMap {
    width: u32,
    height: u32,
    texels: Vec<[f32; 3]>,
    density: Option<Piecewise2D>,
}

impl EnvironmentMap {
    /// From `width` × `height` texels, the upper row first. A map without light is black.
    pub fn new(width: u32, height: u32, texels: Vec<[f32; 3]>) -> Self {
        let mut map = Self { width, height, texels, density: None };
        map.density = Piecewise2D::new(&map.weights(), width as usize, height as usize);
        map
    }

    /// Weight of each texel: the mean luminance of the interpolated image over the texel, times
    /// sin θ. A linear interpolant over half a texel from the middle has its mean a quarter of
    /// the way to the neighbour, hence the weights 1/8, 6/8, 1/8 along each axis: nowhere zero
    /// where the image is not.
    fn weights(&self) -> Vec<f32> {
        const ALONG: [(i64, f32); 3] = [(-1, 0.125), (0, 0.75), (1, 0.125)];
        let (w, h) = (i64::from(self.width), i64::from(self.height));
        let texel = |x: i64, y: i64| {
            let (x, y) = (x.rem_euclid(w), y.clamp(0, h - 1));
            Spectrum::from(self.texels[(y * w + x) as usize]).luminance()
        };
        let mean = |x: i64, y: i64| {
            let row = |y: i64| ALONG.iter().map(|&(i, a)| a * texel(x + i, y)).sum::<f32>();
            ALONG.iter().map(|&(j, b)| b * row(y + j)).sum::<f32>()
        };
        (0..h)
            .flat_map(|y| {
                let (sin, _) = trig::sin_cos((y as f32 + 0.5) / h as f32 * PI);
                (0..w).map(move |x| (x, y, sin))
            })
            .map(|(x, y, sin)| mean(x, y) * sin)
            .collect()
    }

    /// Radiance from direction `d` (unit).
    #[inline]
    pub fn radiance(&self, d: Vec3) -> Spectrum {
        let [x, y] = to_image(d);
        let (fx, fy) = (x * self.width as f32 - 0.5, y * self.height as f32 - 0.5);
        let (ix, iy) = (fx.floor(), fy.floor());
        let (ax, ay) = (fx - ix, fy - iy);
        let (w, h) = (self.width as i32, self.height as i32);
        let texel = |dx: i32, dy: i32| {
            let (x, y) = ((ix as i32 + dx).rem_euclid(w), (iy as i32 + dy).clamp(0, h - 1));
            Spectrum::from(self.texels[y as usize * w as usize + x as usize])
        };
        let row = |dy| texel(0, dy) * (1.0 - ax) + texel(1, dy) * ax;
        row(0) * (1.0 - ay) + row(1) * ay
    }
}

/// Direction to image coordinates in [0, 1].
#[inline]
fn to_image(d: Vec3) -> [f32; 2] {
    let phi = trig::atan2(-d.z, d.x) + PI;
    [(phi / TAU).clamp(0.0, 1.0), trig::acos(d.y) * FRAC_1_PI]
}

/// Image coordinates to direction, and sin θ.
#[inline]
fn to_direction([x, y]: [f32; 2]) -> (Vec3, f32) {
    let (sin_phi, cos_phi) = trig::sin_cos_tau(x);
    let (sin, cos) = trig::sin_cos(PI * y);
    (Vec3::new(-sin * cos_phi, cos, sin * sin_phi), sin)
}

impl Light for Environment {
    const DELTA: bool = false;

    #[inline]
    fn sample(&self, tables: &LightTables, _p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let at_infinity = |wi, radiance, pdf| LightSample {
            wi,
            distance: f32::INFINITY,
            end: None,
            radiance,
            pdf: Some(pdf),
        };
        let Some(map) = self.map else {
            let wi = warp::uniform_sphere(u);
            return Some(at_infinity(wi, self.radiance, warp::uniform_sphere_pdf()));
        };
        let map = &tables.environments[map as usize];
        let (xy, density) = map.density.as_ref()?.sample(u);
        let (wi, sin) = to_direction(xy);
        if sin <= 0.0 {
            return None;
        }
        let pdf = Pdf::new(density / (2.0 * PI * PI * sin));
        Some(at_infinity(wi, map.radiance(wi) * self.radiance, pdf))
    }

    /// dω = 2π² sin θ dx dy.
    #[inline]
    fn pdf(
        &self,
        tables: &LightTables,
        _p: Vec3,
        wi: Vec3,
        _: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        let Some(map) = self.map else { return warp::uniform_sphere_pdf() };
        let Some(density) = &tables.environments[map as usize].density else { return Pdf::ZERO };
        let sin = (wi.x * wi.x + wi.z * wi.z).sqrt();
        if sin <= 0.0 {
            return Pdf::ZERO;
        }
        Pdf::new(density.pdf(to_image(wi)) / (2.0 * PI * PI * sin))
    }

    #[inline]
    fn escaped(&self, tables: &LightTables, d: Vec3) -> Spectrum {
        match self.map {
            None => self.radiance,
            Some(map) => tables.environments[map as usize].radiance(d) * self.radiance,
        }
    }

    /// A constant sky, and a map with a bright texel, a dark half and a soft rest.
    fn examples() -> Vec<(Self, LightTables)> {
        let constant = Self { radiance: Spectrum::splat(0.5), map: None };
        let (w, h) = (16u32, 8u32);
        let texels = (0..w * h)
            .map(|i| match (i % w, i / w) {
                (3, 2) => [40.0; 3],
                (x, _) if x >= 8 => [0.0; 3],
                (x, y) => [0.1 * x as f32, 0.2 * y as f32, 0.3],
            })
            .collect();
        let mut tables = LightTables::default();
        tables.environments.push(EnvironmentMap::new(w, h, texels));
        let map = Self { radiance: Spectrum::ONE, map: Some(0) };
        vec![(constant, LightTables::default()), (map, tables)]
    }
}
