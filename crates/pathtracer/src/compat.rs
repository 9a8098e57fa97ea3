//! Interpretations of scenes by other programs, whose images are reproduced.

pub use pt_core::compile::policies::Policies;

/// Program of the course CS184: policies, console output and debug image.
pub mod cs184 {
    pub use pt_core::compile::compat::POLICIES;
    pub use pt_formats::collada::compat::cs184_log;
    use pt_math::trig;
    use pt_scene::image::Image;

    /// Debug image of the sampling of an environment map, as in the program: red is the cumulative
    /// probability of the row, green that of the column within the row. The image of a black map is
    /// black.
    pub fn probability_debug(map: &Image) -> Vec<[u8; 3]> {
        let (w, h) = (map.width as usize, map.height as usize);
        let weight = |x: usize, y: usize| {
            let l = pt_math::Spectrum::from(map.pixels[y * w + x]).luminance();
            let (sin, _) = trig::sin_cos((y as f32 + 0.5) / h as f32 * std::f32::consts::PI);
            f64::from(l * sin)
        };
        let rows: Vec<f64> = (0..h).map(|y| (0..w).map(|x| weight(x, y)).sum()).collect();
        let total: f64 = rows.iter().sum();
        let byte =
            |part: f64, whole: f64| if whole > 0.0 { (255.0 * part / whole) as u8 } else { 0 };
        let mut pixels = Vec::with_capacity(w * h);
        let mut above = 0.0;
        for (y, row) in rows.iter().enumerate() {
            above += row;
            let mut left = 0.0;
            for x in 0..w {
                left += weight(x, y);
                pixels.push([byte(above, total), byte(left, *row), 0]);
            }
        }
        pixels
    }
}
