//! Orientation of a lobe in the world.

use pt_math::{Frame, Vec3};

use super::Shadowing;

/// Orientation of a surface for its lobe.
#[derive(Clone, Copy, Debug)]
pub struct Orientation {
    /// Unit normal.
    pub normal: Vec3,
    /// Direction whose projection onto the plane of the surface becomes +x; `None` for isotropic
    /// lobes.
    pub tangent: Option<Vec3>,
    /// Shadowing by the relief.
    pub shadowing: Shadowing,
    /// True if the normal was chosen for the viewer, so that others may see another normal.
    pub is_for_viewer: bool,
}

impl Orientation {
    /// Orientation of a surface without relief.
    pub fn plain(normal: Vec3, tangent: Option<Vec3>) -> Self {
        Self { normal, tangent, shadowing: Shadowing::default(), is_for_viewer: false }
    }

    /// The x and y in the lobe's frame of a unit vector near the normal, clamped to above the
    /// surface; with `is_back`, those for the back of a two-sided surface.
    pub(crate) fn place_of(&self, v: Vec3, is_back: bool) -> [f32; 2] {
        const MIN_COSINE: f32 = 0.05;
        let sign = if is_back { -1.0 } else { 1.0 };
        let local = frame_of(self.normal * sign, self.tangent).to_local(v * sign);
        let [x, y, _] = Vec3::new(local.x, local.y, local.z.max(MIN_COSINE)).normalize().to_array();
        [x, y]
    }
}

/// Frame of a lobe with a normal and an optional tangent.
#[inline(always)]
pub(super) fn frame_of(normal: Vec3, tangent: Option<Vec3>) -> Frame {
    match tangent {
        None => Frame::from_normal(normal),
        Some(tangent) => Frame::from_normal_and_tangent(normal, tangent),
    }
}
