//! Portals: rectangles through which the light of infinite lights arrives.

use pt_math::DVec3;

/// A rectangle, such as a window: the light arrives only along rays through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portal {
    /// Corners in the world, counter-clockwise as seen from the side where the light arrives. From
    /// the other side, no light is visible through it.
    pub corners: [[f64; 3]; 4],
}

impl Portal {
    /// Returns the first corner, and the edges from there to the second and to the last.
    ///
    /// # Errors
    /// Returns a message if the corners are not a rectangle.
    pub fn edges(&self) -> Result<[DVec3; 3], String> {
        const TOLERANCE: f64 = 1e-3;
        let [a, b, c, d] = self.corners.map(DVec3::from_array);
        let sides = [b - a, c - b, d - c, a - d].map(DVec3::try_normalize);
        let is_rectangle = match sides {
            [Some(ab), Some(bc), Some(cd), Some(da)] => {
                let are_opposite = |u: DVec3, v: DVec3| u.dot(v) < TOLERANCE - 1.0;
                are_opposite(ab, cd) && are_opposite(bc, da) && ab.dot(bc).abs() < TOLERANCE
            }
            _ => false,
        };
        if is_rectangle {
            return Ok([a, b - a, d - a]);
        }
        let corners = self.corners;
        Err(format!(
            "found a portal {corners:?} that is not a rectangle, expected its four corners in order"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn portals_are_rectangles() {
        let portal = |corners: [[f64; 3]; 4]| Portal { corners }.edges();
        let (a, b, c, d) = ([1.0, 2.0, 3.0], [1.0, 4.0, 3.0], [1.0, 4.0, 4.0], [1.0, 2.0, 4.0]);
        let edges = [DVec3::new(1.0, 2.0, 3.0), DVec3::Y * 2.0, DVec3::Z];
        assert_eq!(portal([a, b, c, d]), Ok(edges));
        let (bent, none) = ([1.2, 4.0, 4.0], [f64::NAN; 3]);
        for bad in [[a, c, b, d], [a, b, bent, d], [a, a, c, d], [a, b, c, none]] {
            assert!(
                portal(bad).is_err_and(|message| message.contains("not a rectangle")),
                "{bad:?}"
            );
        }
    }
}
