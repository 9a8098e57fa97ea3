//! How a lobe is turned in the world.

use pt_math::{Frame, Vec3};

use super::Shadowing;

/// Which way a surface looks to its lobe.
#[derive(Clone, Copy, Debug)]
pub struct Orientation {
    /// Unit normal.
    pub normal: Vec3,
    /// Direction that becomes +x, as far as it is in the plane across the normal; `None` where any
    /// will do.
    pub tangent: Option<Vec3>,
    /// What a relief hides of the light.
    pub shadowing: Shadowing,
    /// True if the normal was chosen for the viewer, so that others may see another.
    pub is_for_viewer: bool,
}

impl Orientation {
    /// That of a surface without relief.
    pub fn plain(normal: Vec3, tangent: Option<Vec3>) -> Self {
        Self { normal, tangent, shadowing: Shadowing::default(), is_for_viewer: false }
    }

    /// The x and y of a unit vector that is near the normal, in the frame of the lobe, of which it
    /// is above the surface; of the back of a surface that is the same from both sides with
    /// `is_back`.
    pub(crate) fn place_of(&self, v: Vec3, is_back: bool) -> [f32; 2] {
        const MIN_COSINE: f32 = 0.05;
        let sign = if is_back { -1.0 } else { 1.0 };
        let local = frame_of(self.normal * sign, self.tangent).to_local(v * sign);
        let [x, y, _] = Vec3::new(local.x, local.y, local.z.max(MIN_COSINE)).normalize().to_array();
        [x, y]
    }
}

/// The frame of a lobe with a normal and perhaps a direction along the surface.
#[inline(always)]
pub(super) fn frame_of(normal: Vec3, tangent: Option<Vec3>) -> Frame {
    match tangent {
        None => Frame::from_normal(normal),
        Some(tangent) => Frame::from_normal_and_tangent(normal, tangent),
    }
}
