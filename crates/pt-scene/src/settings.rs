//! Render settings suggested by a scene file.

use crate::Filter;

/// Emitters that are invisible to camera rays before their first scattering, although they
/// illuminate the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hidden {
    /// All emitters are visible.
    #[default]
    Nothing,
    /// Environment maps, constant environments, skies and their suns are invisible.
    Background,
    /// These and all emissive surfaces are invisible; camera rays pass through the surfaces.
    Emitters,
}

/// Settings of a scene file; `None` if unspecified.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderHints {
    /// Width and height of the image in pixels.
    pub resolution: Option<[u32; 2]>,
    /// Crop window: column and row of its upper left pixel, its width and its height. It lies
    /// inside of `resolution`.
    pub crop: Option<[u32; 4]>,
    /// Number of samples per pixel.
    pub spp: Option<u32>,
    /// Maximum number of interactions of a path with surfaces or media: 0 is emission only, 1 is
    /// direct light.
    pub max_depth: Option<u32>,
    /// True if `max_depth` does not count undeflected transmission, such as through thin glass, in
    /// scenes with media.
    pub straight_is_free: bool,
    /// True if the sides of a mesh are separated by the interpolated normals alone, as in Mitsuba 3
    /// and pbrt-v4. Otherwise, light must be on the same side of the triangle as well, and normals
    /// that are averted from the viewer are bent until they are not. [Veach 1997, "Robust Monte
    /// Carlo Methods for Light Transport Simulation", §5.3]
    pub sides_by_shading_normal: bool,
    /// Name of the integrator; `None` for the default.
    pub integrator: Option<&'static str>,
    /// Names of the requested AOVs.
    pub aovs: Vec<&'static str>,
    /// Reconstruction filter.
    pub filter: Option<Filter>,
    /// Emitters that are invisible to camera rays.
    pub hidden: Hidden,
}

impl RenderHints {
    /// Returns the crop window for an image of another size: each edge is at the nearest pixel
    /// border, and the window has at least one pixel in each direction. `None` without a crop or
    /// resolution.
    pub fn crop_of(&self, size: [u32; 2]) -> Option<[u32; 4]> {
        let ([x, y, width, height], original) = self.crop.zip(self.resolution)?;
        let range = |start: u32, length: u32, axis: usize| {
            let (old, new) = (u64::from(original[axis]), u64::from(size[axis]));
            let nearest = |edge: u32| ((u64::from(edge) * new * 2 + old) / (2 * old)) as u32;
            let start_of_last = size[axis].saturating_sub(1);
            let first = nearest(start).min(start_of_last);
            (first, nearest(start + length).max(first + 1) - first)
        };
        let ((x, width), (y, height)) = (range(x, width, 0), range(y, height, 1));
        Some([x, y, width, height])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_shows_the_same_part_at_any_size() {
        let crop = Some([20, 10, 40, 30]);
        let file = RenderHints { resolution: Some([100, 50]), crop, ..RenderHints::default() };
        assert_eq!(file.crop_of([100, 50]), crop);
        assert_eq!(file.crop_of([200, 100]), Some([40, 20, 80, 60]));
        assert_eq!(file.crop_of([10, 5]), Some([2, 1, 4, 3]));
        assert_eq!(file.crop_of([1, 1]), Some([0, 0, 1, 1]));
        assert_eq!(RenderHints { crop: None, ..file }.crop_of([100, 50]), None);
        let corner = RenderHints {
            resolution: Some([65_536; 2]),
            crop: Some([65_535, 65_535, 1, 1]),
            ..RenderHints::default()
        };
        assert_eq!(corner.crop_of([7, 1 << 20]), Some([6, 1_048_560, 1, 16]));
    }
}
