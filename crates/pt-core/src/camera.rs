//! The compiled camera: pixels to rays.

use pt_math::{Ray, Vec3, trig};

/// A pinhole or thin lens that looks along `forward`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens.
    pub position: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Unit vector along which it looks.
    pub forward: Vec3,
    /// Half width and half height of the image at distance 1.
    pub half_extent: [f32; 2],
    /// Width and height of the image in pixels.
    pub resolution: [u32; 2],
    /// Nothing before this distance is seen.
    pub near: f32,
    /// Nothing behind this distance is seen.
    pub far: f32,
    /// How `near` and `far` are measured.
    pub clip: Clip,
    /// Radius of the lens; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus, along `forward`.
    pub focal_distance: f32,
}

/// Along what the clipping distances are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clip {
    /// The viewing axis.
    Axis,
    /// Each ray.
    Ray,
}

impl Camera {
    /// The ray through point (`x`, `y`) of the image, in pixels from its upper left corner, and
    /// point `lens` of the unit square mapped to the lens. Its direction has unit length.
    ///
    /// Thin lens: all rays through one image point meet in the plane at the focal distance.
    /// [Kolb, Mitchell & Hanrahan 1995, §3]
    #[inline(always)]
    pub fn ray(&self, [x, y]: [f32; 2], lens: [f32; 2]) -> Ray {
        let [w, h] = self.resolution.map(|n| 0.5 * n as f32);
        let sx = (x - w) * (self.half_extent[0] / w);
        let sy = (h - y) * (self.half_extent[1] / h);
        // Seen along the axis, this is at distance 1.
        let pinhole = self.right * sx + self.up * sy + self.forward;
        if self.lens_radius == 0.0 {
            return self.clipped(self.position, pinhole, 1.0);
        }
        let r = self.lens_radius * lens[0].sqrt();
        let (sin, cos) = trig::sin_cos_tau(lens[1]);
        let offset = self.right * (r * cos) + self.up * (r * sin);
        let focal = self.focal_distance;
        self.clipped(self.position + offset, pinhole * focal - offset, focal)
    }

    /// The ray to a point that is `distance` away along the axis.
    #[inline(always)]
    fn clipped(&self, origin: Vec3, to: Vec3, distance: f32) -> Ray {
        let length = to.length();
        let scale = match self.clip {
            Clip::Axis => length / distance,
            Clip::Ray => 1.0,
        };
        Ray { origin, direction: to / length, t_min: self.near * scale, t_max: self.far * scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(lens_radius: f32) -> Camera {
        Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::NEG_Z,
            half_extent: [1.0, 0.75],
            resolution: [640, 480],
            near: 0.5,
            far: 100.0,
            clip: Clip::Axis,
            lens_radius,
            focal_distance: 4.0,
        }
    }

    #[test]
    fn the_middle_looks_ahead_and_corners_are_where_they_should() {
        let c = camera(0.0);
        assert!((c.ray([320.0, 240.0], [0.0; 2]).direction - Vec3::NEG_Z).length() < 1e-6);
        let corner = c.ray([0.0, 0.0], [0.0; 2]);
        let want = Vec3::new(-1.0, 0.75, -1.0).normalize();
        assert!((corner.direction - want).length() < 1e-6);
        assert!((corner.at(corner.t_min).z - 2.5).abs() < 1e-5, "clipped by a plane");
    }

    #[test]
    fn rays_of_one_point_meet_in_the_plane_of_focus() {
        let c = camera(0.3);
        let meet = |lens| {
            let r = c.ray([100.0, 77.0], lens);
            r.at((-1.0 - r.origin.z) / r.direction.z)
        };
        for lens in [[0.1, 0.2], [0.9, 0.7], [0.5, 0.5]] {
            assert!((meet(lens) - meet([0.0; 2])).length() < 1e-5);
        }
    }
}
