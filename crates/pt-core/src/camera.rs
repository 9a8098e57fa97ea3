//! The compiled camera, which maps pixels to rays.

use std::f32::consts::{PI, TAU};

use pt_math::sampler::{LANES, Lanes};
use pt_math::{Ray, Ray8, Vec3, trig, warp};

/// A camera with the viewing direction `forward`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens, or of the image if rays are parallel.
    pub position: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector towards the top of the image.
    pub up: Vec3,
    /// Unit viewing direction.
    pub forward: Vec3,
    /// Mapping of image points to rays.
    pub projection: Projection,
    /// Half width and half height of the image: at distance 1 for perspective cameras, at any
    /// distance for orthographic ones. Unused by panoramas.
    pub half_extent: [f32; 2],
    /// Width and height of the image in pixels.
    pub resolution: [u32; 2],
    /// Image point along `forward`, in pixels from the upper left corner.
    pub principal_point: [f32; 2],
    /// Near clipping distance.
    pub near: f32,
    /// Far clipping distance.
    pub far: f32,
    /// Direction along which `near` and `far` are measured.
    pub clip: Clip,
    /// Radius of the lens; 0 for a pinhole, and for all cameras other than perspective ones.
    pub lens_radius: f32,
    /// Shape of the aperture; `None` for a disk.
    pub aperture: Option<Aperture>,
    /// Distance of the plane of focus, along `forward`.
    pub focal_distance: f32,
}

/// Mapping of image points to camera rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// Perspective, through a pinhole or a thin lens.
    Perspective,
    /// Parallel rays.
    Orthographic,
    /// All directions, in latitude and longitude (equirectangular).
    Panorama,
}

/// Regular polygon centred on the lens, with its corners on the rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// Number of sides.
    pub blades: u32,
    /// Position of the first corner as a fraction of a turn, in [0, 1), from `right` towards `up`.
    pub turn: f32,
}

impl Aperture {
    /// Samples a uniform point of the polygon with circumradius 1: chooses one of its triangles
    /// around the centre, and a uniform point of that.
    #[inline]
    pub fn sample(self, [u, v]: [f32; 2]) -> [f32; 2] {
        let sides = self.blades as f32;
        let side = (u * sides).min(sides.next_down()).floor();
        let corner = |i: f32| {
            let turn = i / sides + self.turn;
            trig::sin_cos_tau(turn - turn.floor())
        };
        let ((s0, c0), (s1, c1)) = (corner(side), corner(side + 1.0));
        let [b0, b1] = warp::uniform_triangle([u * sides - side, v]);
        [b0 * c0 + b1 * c1, b0 * s0 + b1 * s1]
    }
}

/// Direction along which clipping distances are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clip {
    /// The viewing axis.
    Axis,
    /// Each ray.
    Ray,
}

impl Camera {
    /// Returns true if rays depend on a sampled point of the lens.
    #[inline]
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// Returns the ray through image point `at`, in pixels from the upper left corner, and through
    /// the lens point to which `lens`, a point of the unit square, is mapped. Its direction has
    /// unit length.
    #[inline]
    pub fn ray(&self, at: [f32; 2], lens: [f32; 2]) -> Ray {
        match (self.projection, self.aperture) {
            (Projection::Orthographic, _) => self.orthographic(at),
            (Projection::Panorama, _) => self.panorama(at),
            _ if !self.has_lens() => self.pinhole(at),
            (_, None) => self.thin_lens(at, lens),
            (_, Some(aperture)) => self.polygonal_lens(aperture, at, lens),
        }
    }

    /// Returns [`Self::ray`] of many points in structure-of-arrays layout: faster, with bitwise
    /// equal results.
    pub fn rays(
        &self,
        [xs, ys]: &[Lanes<f32>; 2],
        [us, vs]: &[Lanes<f32>; 2],
        rays: &mut [Ray8; LANES / 8],
    ) {
        let (at, lens) = (|i: usize| [xs[i], ys[i]], |i: usize| [us[i], vs[i]]);
        match (self.projection, self.aperture) {
            (Projection::Orthographic, _) => by_columns(|i| self.orthographic(at(i)), rays),
            (Projection::Panorama, _) => by_columns(|i| self.panorama(at(i)), rays),
            _ if !self.has_lens() => by_columns(|i| self.pinhole(at(i)), rays),
            (_, None) => by_columns(|i| self.thin_lens(at(i), lens(i)), rays),
            (_, Some(a)) => by_columns(|i| self.polygonal_lens(a, at(i), lens(i)), rays),
        }
    }

    /// Returns the image point, in pixels from the upper left corner, whose ray through the centre
    /// of the lens passes through `p`; `None` for points that have none, as behind the camera.
    /// Longitudes of a panorama are within half a turn of `forward`.
    pub fn project(&self, p: Vec3) -> Option<[f32; 2]> {
        let to = p - self.position;
        let local = [self.right, self.up, self.forward].map(|axis| to.dot(axis));
        let [x, y, z] = local;
        let [x0, y0] = self.principal_point;
        let [w, h] = self.resolution.map(|n| n as f32);
        let on_plane = |x: f32, y: f32| {
            let [half_width, half_height] = self.half_extent;
            [x0 + x * (0.5 * w / half_width), y0 - y * (0.5 * h / half_height)]
        };
        match self.projection {
            Projection::Perspective => (z > 0.0).then(|| on_plane(x / z, y / z)),
            Projection::Orthographic => Some(on_plane(x, y)),
            Projection::Panorama => {
                let longitude = libm::atan2f(x, z);
                let latitude = libm::atan2f(y, libm::hypotf(x, z));
                (to != Vec3::ZERO).then(|| [x0 + longitude * (w / TAU), y0 - latitude * (h / PI)])
            }
        }
    }

    #[inline(always)]
    fn pinhole(&self, at: [f32; 2]) -> Ray {
        self.clipped(self.position, self.towards(at), 1.0)
    }

    #[inline(always)]
    fn thin_lens(&self, at: [f32; 2], lens: [f32; 2]) -> Ray {
        let r = self.lens_radius * lens[0].sqrt();
        let (sin, cos) = trig::sin_cos_tau(lens[1]);
        self.through([r * cos, r * sin], at)
    }

    #[inline(always)]
    fn polygonal_lens(&self, aperture: Aperture, at: [f32; 2], lens: [f32; 2]) -> Ray {
        self.through(aperture.sample(lens).map(|x| self.lens_radius * x), at)
    }

    /// Returns the ray through a point of the lens. All rays through one image point meet in the
    /// plane of focus. [Kolb, Mitchell & Hanrahan 1995, §3]
    #[inline(always)]
    fn through(&self, [x, y]: [f32; 2], at: [f32; 2]) -> Ray {
        let offset = self.right * x + self.up * y;
        let focal = self.focal_distance;
        self.clipped(self.position + offset, self.towards(at) * focal - offset, focal)
    }

    #[inline(always)]
    fn orthographic(&self, at: [f32; 2]) -> Ray {
        let [x, y] = self.plane_point(at);
        let origin = self.position + self.right * x + self.up * y;
        Ray { origin, direction: self.forward, t_min: self.near, t_max: self.far }
    }

    /// A pixel is 2π/w wide in longitude, which grows to the right, and π/h high in latitude.
    #[inline(always)]
    fn panorama(&self, [x, y]: [f32; 2]) -> Ray {
        let [[w, h], [x0, y0]] = [self.resolution.map(|n| n as f32), self.principal_point];
        let (sin_x, cos_x) = trig::sin_cos((x - x0) * (TAU / w));
        let (sin_y, cos_y) = trig::sin_cos((y0 - y) * (PI / h));
        let level = self.right * sin_x + self.forward * cos_x;
        self.clipped(self.position, level * cos_y + self.up * sin_y, 1.0)
    }

    /// Returns the vector from the centre of the lens to an image point at distance 1 along the
    /// axis.
    #[inline(always)]
    fn towards(&self, at: [f32; 2]) -> Vec3 {
        let [x, y] = self.plane_point(at);
        self.right * x + self.up * y + self.forward
    }

    /// Returns the offset of an image point to the right and up, in the unit of `half_extent`.
    #[inline(always)]
    fn plane_point(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [w, h] = self.resolution.map(|n| 0.5 * n as f32);
        let [x0, y0] = self.principal_point;
        [(x - x0) * (self.half_extent[0] / w), (y0 - y) * (self.half_extent[1] / h)]
    }

    /// Returns the clipped ray from `origin` along `to`, a vector that extends `distance` along the
    /// axis.
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

/// Computes rays in structure-of-arrays layout, which vectorises.
#[inline(always)]
fn by_columns(ray: impl Fn(usize) -> Ray, rays: &mut [Ray8; LANES / 8]) {
    for (first, eight) in (0..).step_by(8).zip(rays) {
        for i in 0..8 {
            eight.set(i, &ray(first + i));
        }
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::{Chi2, chi2_square};

    use super::*;

    fn camera(lens_radius: f32) -> Camera {
        Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::NEG_Z,
            projection: Projection::Perspective,
            half_extent: [1.0, 0.75],
            resolution: [640, 480],
            principal_point: [320.0, 240.0],
            near: 0.5,
            far: 100.0,
            clip: Clip::Axis,
            lens_radius,
            aperture: None,
            focal_distance: 4.0,
        }
    }

    #[test]
    fn image_points_are_those_of_rays() {
        for projection in [Projection::Perspective, Projection::Orthographic, Projection::Panorama]
        {
            for lens_radius in [0.0, 0.2] {
                let principal_point = [300.0, 260.0];
                let camera = Camera { projection, principal_point, ..camera(lens_radius) };
                for at in [[320.0, 240.0], [1.5, 470.0], [600.25, 30.0]] {
                    let ray = Camera { lens_radius: 0.0, ..camera }.ray(at, [0.5; 2]);
                    let seen = camera.project(ray.at(7.0)).expect("in front of the camera");
                    let off = (seen[0] - at[0]).abs().max((seen[1] - at[1]).abs());
                    assert!(off < 2e-3, "{projection:?}: {seen:?} of {at:?}");
                }
            }
        }
        assert_eq!(camera(0.0).project(Vec3::new(1.0, 2.0, 4.0)), None);
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
        for aperture in [None, Some(Aperture { blades: 5, turn: 0.1 })] {
            let c = Camera { aperture, ..camera(0.3) };
            let meet = |lens| {
                let r = c.ray([100.0, 77.0], lens);
                r.at((-1.0 - r.origin.z) / r.direction.z)
            };
            for lens in [[0.1, 0.2], [0.9, 0.7], [0.5, 0.5]] {
                assert!((meet(lens) - meet([0.0; 2])).length() < 1e-5);
            }
        }
    }

    #[test]
    fn a_moved_film_shows_what_was_beside_it() {
        let c = camera(0.0);
        let moved = Camera { principal_point: [320.0 - 64.0, 240.0 + 48.0], ..c };
        let [a, b] = [moved.ray([100.0, 200.0], [0.0; 2]), c.ray([164.0, 152.0], [0.0; 2])];
        assert!((a.direction - b.direction).length() < 1e-6, "{a:?} {b:?}");
        let ahead = moved.ray(moved.principal_point, [0.0; 2]).direction;
        assert!((ahead - Vec3::NEG_Z).length() < 1e-6);
    }

    #[test]
    fn orthographic_rays_are_parallel_and_fill_the_extent() {
        let projection = Projection::Orthographic;
        let c = Camera { projection, half_extent: [2.0, 1.5], ..camera(0.0) };
        let corner = c.ray([0.0, 480.0], [0.0; 2]);
        assert!((corner.origin - Vec3::new(-1.0, 0.5, 3.0)).length() < 1e-6, "{corner:?}");
        assert_eq!(corner.direction, Vec3::NEG_Z);
        assert_eq!((corner.t_min, corner.t_max), (c.near, c.far));
        assert_eq!(c.ray([320.0, 240.0], [0.0; 2]).origin, c.position);
    }

    #[test]
    fn a_panorama_has_every_direction_where_it_belongs() {
        let c = Camera { projection: Projection::Panorama, clip: Clip::Ray, ..camera(0.0) };
        for (at, direction) in [
            ([320.0, 240.0], Vec3::NEG_Z),
            ([480.0, 240.0], Vec3::X),
            ([160.0, 240.0], Vec3::NEG_X),
            ([0.0, 240.0], Vec3::Z),
            ([640.0, 240.0], Vec3::Z),
            ([77.0, 0.0], Vec3::Y),
            ([505.0, 480.0], Vec3::NEG_Y),
            ([480.0, 120.0], Vec3::new(0.5f32.sqrt(), 0.5f32.sqrt(), 0.0)),
        ] {
            let ray = c.ray(at, [0.0; 2]);
            assert!((ray.direction - direction).length() < 1e-6, "{at:?}: {ray:?}");
            assert_eq!((ray.origin, ray.t_min, ray.t_max), (c.position, 0.5, 100.0));
        }
        // Beyond the pole, where filters reach, is the other side.
        let [over, other] = [[77.0, -9.0], [77.0 + 320.0, 9.0]].map(|at| c.ray(at, [0.0; 2]));
        assert!((over.direction - other.direction).length() < 1e-5);
    }

    /// ∂ω/∂x × ∂ω/∂y is the solid angle of a pixel: 2π/w · (sin θ₀ − sin θ₁) for a row between two
    /// latitudes; all add up to 4π.
    #[test]
    fn pixels_of_a_panorama_cover_the_sphere() {
        const STEP: f64 = 1.0 / 64.0;
        let resolution = [24, 10];
        let projection = Projection::Panorama;
        let c = Camera { projection, resolution, principal_point: [12.0, 5.0], ..camera(0.0) };
        let direction = |x: f64, y: f64| c.ray([x as f32, y as f32], [0.0; 2]).direction.as_dvec3();
        let mut sphere = 0.0;
        for row in 0..10 {
            let edge = |y: u32| (0.5 - f64::from(y) / 10.0) * std::f64::consts::PI;
            let want = std::f64::consts::TAU / 24.0 * (edge(row).sin() - edge(row + 1).sin());
            // Midpoint rule over the cells of a pixel.
            let area = |y: f64| {
                let d = |x: f64, dy: f64| direction(7.5 + x, y + dy);
                let (dx, dy) = (d(STEP, 0.0) - d(-STEP, 0.0), d(0.0, STEP) - d(0.0, -STEP));
                dx.cross(dy).length() / (4.0 * STEP * STEP)
            };
            let got =
                (0..16).map(|i| area(f64::from(row) + (f64::from(i) + 0.5) / 16.0)).sum::<f64>();
            let got = got / 16.0;
            assert!((got - want).abs() < 2e-3 * want, "row {row}: {got} is not {want}");
            sphere += 24.0 * got;
        }
        assert!((sphere / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3, "{sphere}");
    }

    /// For a uniform point, the position along the sides is uniform, and so is the square of the
    /// distance to the centre, relative to the polygon that is scaled to run through the point.
    #[test]
    fn polygons_are_sampled_uniformly() {
        for (blades, turn) in [(3, 0.0), (5, 0.13), (6, 0.75), (9, 0.5), (100, 0.999)] {
            let half = std::f64::consts::PI / f64::from(blades);
            let around_and_out = |u| {
                let [x, y] = Aperture { blades, turn }.sample(u).map(f64::from);
                let angle = y.atan2(x) - std::f64::consts::TAU * f64::from(turn);
                let side = (angle / (2.0 * half)).floor();
                // Rotated so that the side is perpendicular to the first axis.
                let (sin, cos) = (angle - (2.0 * side + 1.0) * half).sin_cos();
                let distance = x.hypot(y) * cos / half.cos();
                let along = 0.5 + 0.5 * sin / cos / half.tan();
                let around = (side + along) / f64::from(blades);
                assert!(distance < 1.0 + 1e-6, "{blades}: {u:?}");
                let below_one = f64::from(1.0f32.next_down());
                Some([around.rem_euclid(1.0), distance * distance].map(|v| v.min(below_one) as f32))
            };
            let config = Chi2::new("polygon").one_of(5);
            chi2_square(around_and_out, |_| 1.0, &config)
                .unwrap_or_else(|e| panic!("{blades}: {e}"));
        }
    }

    #[test]
    fn many_rays_have_the_bits_of_each() {
        let polygon = Some(Aperture { blades: 7, turn: 0.3 });
        let panorama = Projection::Panorama;
        for c in [
            camera(0.0),
            Camera { clip: Clip::Ray, ..camera(0.0) },
            camera(0.3),
            Camera { aperture: polygon, ..camera(0.3) },
            Camera { aperture: polygon, ..camera(0.0) },
            Camera { projection: Projection::Orthographic, ..camera(0.0) },
            Camera { projection: panorama, clip: Clip::Ray, ..camera(0.0) },
        ] {
            let column = |step: f32| std::array::from_fn(|i| (i as f32 * step).fract());
            let (at, lens) = ([column(0.37), column(0.73)], [column(0.61), column(0.19)]);
            let at = at.map(|x| x.map(|x| 500.0 * x));
            let mut rays = [Ray8::default(); LANES / 8];
            c.rays(&at, &lens, &mut rays);
            for i in 0..LANES {
                let ray = rays[i / 8].get(i % 8);
                assert_eq!(ray, c.ray(at.map(|x| x[i]), lens.map(|x| x[i])));
            }
        }
    }
}
