//! The compiled camera: pixels to rays.

use pt_math::sampler::{LANES, Lanes};
use pt_math::{Ray, Vec3, trig};
use wide::f32x8;

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
    #[inline]
    pub fn ray(&self, at: [f32; 2], lens: [f32; 2]) -> Ray {
        if self.lens_radius == 0.0 { self.pinhole(at) } else { self.thin_lens(at, lens) }
    }

    /// [`Self::ray`] of many points, which are given in columns: the same bits, sooner.
    pub fn rays(
        &self,
        [xs, ys]: &[Lanes<f32>; 2],
        [us, vs]: &[Lanes<f32>; 2],
        rays: &mut Lanes<Ray>,
    ) {
        if self.lens_radius == 0.0 {
            by_columns(|i| self.pinhole([xs[i], ys[i]]), rays);
        } else {
            by_columns(|i| self.thin_lens([xs[i], ys[i]], [us[i], vs[i]]), rays);
        }
    }

    #[inline(always)]
    fn pinhole(&self, at: [f32; 2]) -> Ray {
        self.clipped(self.position, self.towards(at), 1.0)
    }

    /// All rays through one image point meet in the plane at the focal distance. [Kolb, Mitchell &
    /// Hanrahan 1995, §3]
    #[inline(always)]
    fn thin_lens(&self, at: [f32; 2], lens: [f32; 2]) -> Ray {
        let r = self.lens_radius * lens[0].sqrt();
        let (sin, cos) = trig::sin_cos_tau(lens[1]);
        let offset = self.right * (r * cos) + self.up * (r * sin);
        let focal = self.focal_distance;
        self.clipped(self.position + offset, self.towards(at) * focal - offset, focal)
    }

    /// From the middle of the lens to a point of the image at distance 1 along the axis.
    #[inline(always)]
    fn towards(&self, [x, y]: [f32; 2]) -> Vec3 {
        let [w, h] = self.resolution.map(|n| 0.5 * n as f32);
        let sx = (x - w) * (self.half_extent[0] / w);
        let sy = (h - y) * (self.half_extent[1] / h);
        self.right * sx + self.up * sy + self.forward
    }

    /// The ray to a point that is `distance` away along the axis.
    #[inline(always)]
    fn clipped(&self, origin: Vec3, to: Vec3, distance: f32) -> Ray {
        let length = to.length();
        let scale = match self.clip {
            Clip::Axis => length / distance,
            Clip::Ray => 1.0,
        };
        let direction = to * length.recip();
        Ray { origin, direction, t_min: self.near * scale, t_max: self.far * scale }
    }
}

/// Each number of all rays before the next one: a form in which they are computed side by side.
#[inline(always)]
fn by_columns(ray: impl Fn(usize) -> Ray, rays: &mut Lanes<Ray>) {
    let mut columns = [[0.0; LANES]; 8];
    for i in 0..LANES {
        let Ray { origin: o, direction: d, t_min, t_max } = ray(i);
        for (column, x) in columns.iter_mut().zip([o.x, o.y, o.z, d.x, d.y, d.z, t_min, t_max]) {
            column[i] = x;
        }
    }
    for (first, rays) in (0..).step_by(8).zip(rays.as_chunks_mut::<8>().0) {
        let eight = |column: [f32; LANES]| f32x8::new(std::array::from_fn(|i| column[first + i]));
        *rays = f32x8::transpose(columns.map(eight)).map(bytemuck::cast);
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

    #[test]
    fn many_rays_have_the_bits_of_each() {
        for (radius, clip) in [(0.0, Clip::Axis), (0.0, Clip::Ray), (0.3, Clip::Axis)] {
            let c = Camera { clip, ..camera(radius) };
            let column = |step: f32| std::array::from_fn(|i| (i as f32 * step).fract());
            let (at, lens) = ([column(0.37), column(0.73)], [column(0.61), column(0.19)]);
            let at = at.map(|x| x.map(|x| 500.0 * x));
            let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); LANES];
            c.rays(&at, &lens, &mut rays);
            for (i, ray) in rays.into_iter().enumerate() {
                assert_eq!(ray, c.ray(at.map(|x| x[i]), lens.map(|x| x[i])));
            }
        }
    }
}
