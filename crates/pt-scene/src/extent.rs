//! Bounding boxes in double precision.

use pt_math::DVec3;

/// A box: its lower and upper corners.
pub type Extent = [DVec3; 2];

/// Returns the bounding box of points; `None` if there are none.
pub fn extent_of(points: impl Iterator<Item = DVec3>) -> Option<Extent> {
    points.map(|p| [p, p]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}
