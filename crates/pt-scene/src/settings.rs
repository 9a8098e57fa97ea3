//! Render settings that a scene file may carry.

use crate::Filter;

/// What is not seen directly, though it lights as if it were there: by rays of the camera that
/// nothing has scattered yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hidden {
    /// All that shines is seen.
    #[default]
    Nothing,
    /// Environment maps, constant environments, skies and their suns.
    Background,
    /// These, and all surfaces that emit, through which the camera sees what is behind.
    Emitters,
}

/// What a file asks for; `None` where it is silent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderHints {
    /// Width and height of the image in pixels.
    pub resolution: Option<[u32; 2]>,
    /// The only part of the image that is wanted: column and row of its upper left pixel, and its
    /// width and height, all of which lies inside of `resolution`.
    pub crop: Option<[u32; 4]>,
    /// Samples per pixel.
    pub spp: Option<u32>,
    /// Largest number of interactions of a path, with surfaces or media: 0 is emission only, 1
    /// direct light.
    pub max_depth: Option<u32>,
    /// True if `max_depth` counts no interaction from which light goes straight on, as through
    /// thin glass, in scenes with media.
    pub straight_is_free: bool,
    /// True if the interpolated normals of meshes alone divide their front from their back, as in
    /// Mitsuba 3 and pbrt-v4. Else light has to be on the same side of the triangle as well,
    /// and normals that look away from the viewer are bent until they do not. [Veach 1997,
    /// "Robust Monte Carlo Methods for Light Transport Simulation", §5.3]
    pub sides_by_shading_normal: bool,
    /// Name of the integrator, if it is not the usual one.
    pub integrator: Option<&'static str>,
    /// Names of the channels besides light that are asked for.
    pub aovs: Vec<&'static str>,
    /// Reconstruction filter.
    pub filter: Option<Filter>,
    /// What is not seen directly.
    pub hidden: Hidden,
}

impl RenderHints {
    /// The same part of an image of another size: each edge at the nearest border between two
    /// pixels, at least one pixel wide and high.
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
