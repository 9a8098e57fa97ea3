//! Pixels that show only a constant background: they have zero variance and need no missing-mass
//! bound.
//!
//! They are found from the scene and not from samples, so that the result introduces no bias. All
//! primitives are rasterized over the sample areas of the pixels; a pixel touched by none is
//! background. The test is conservative: sample areas are enlarged a little, and spheres seen
//! through a lens and instances are drawn as boxes.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};

use pt_bvh::Sphere;
use pt_core::camera::{Camera, Projection};
use pt_core::film::Region;
use pt_core::scene::RenderScene;
use pt_math::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::render::Renderer;

/// Enlargement of sample areas in pixels, in addition to the rounding of rays.
const MARGIN: f64 = 1.0 / 64.0;

/// Maximum relative rounding error of rays.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

/// Side of the blocks of pixels that are tested together.
const BLOCK: u32 = 16;

/// Number of primitives per parallel task.
const CHUNK: usize = 4096;

/// Below this value, relative to its bound, the sign of a determinant is unreliable.
const MIN_DETERMINANT: f64 = 1e-9;

impl Renderer<'_> {
    /// For each pixel of a film, row by row, a flag that all its samples are known to be the same;
    /// empty if no flag is set.
    pub(crate) fn background_pixels(&self, region: Region) -> Vec<bool> {
        let Self { scene, settings, .. } = self;
        let is_uniform = settings.target.is_some_and(|target| target.uniform);
        let has_signs = self.filter.as_ref().is_some_and(|filter| !filter.is_positive());
        let is_even = scene.infinite_lights.iter().all(|&sky| scene.lights[sky].is_constant());
        let is_alone = settings.reuse == 1 && scene.media.camera.is_none() && is_even;
        let Some(view) = ImageProjection::new(scene, settings.filter.radius()) else {
            return Vec::new();
        };
        if is_uniform || has_signs || !is_alone {
            return Vec::new();
        }
        let canvas = Canvas::new(region);
        self.in_pool(|| draw(scene, &view, &canvas));
        canvas.background_only()
    }
}

/// Rasterizes all primitives of a scene.
fn draw(scene: &RenderScene, view: &ImageProjection, canvas: &Canvas) {
    let shapes = &scene.shapes;
    shapes.triangles.par_chunks(CHUNK).for_each(|triangles| {
        for triangle in triangles.iter().take_while(|_| !canvas.is_full()) {
            let corners = triangle.map(|v| shapes.positions[v as usize].as_dvec3());
            view.draw_triangle(corners, canvas);
        }
    });
    shapes.spheres.par_chunks(CHUNK).for_each(|spheres| {
        for sphere in spheres {
            view.draw_sphere(sphere, canvas);
        }
    });
    let placed = scene.instances.iter().flat_map(|placed| placed.boxes());
    for bounds in placed.filter(|bounds| !bounds.is_empty()) {
        view.draw_box([bounds.min, bounds.max].map(Vec3::as_dvec3), canvas);
    }
}

/// Rectangle of real columns and rows, from the upper left corner of the image: minimum and maximum
/// of each.
#[derive(Clone, Copy, Debug)]
struct Square {
    x: [f64; 2],
    y: [f64; 2],
}

impl Square {
    const ALL: Self =
        Self { x: [f64::NEG_INFINITY, f64::INFINITY], y: [f64::NEG_INFINITY, f64::INFINITY] };

    /// Bounding rectangle of points.
    fn around(points: impl Iterator<Item = [f64; 2]>) -> Self {
        const NONE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        let with = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
        points
            .fold(Self { x: NONE, y: NONE }, |s, [x, y]| Self { x: with(s.x, x), y: with(s.y, y) })
    }

    /// Rectangle enlarged by `by` on all sides.
    fn grown(self, by: f64) -> Self {
        let grown = |[low, high]: [f64; 2]| [low - by, high + by];
        Self { x: grown(self.x), y: grown(self.y) }
    }

    /// Maximum of width and height.
    fn size(&self) -> f64 {
        (self.x[1] - self.x[0]).max(self.y[1] - self.y[0])
    }
}

/// Projection from world space to the image.
struct ImageProjection {
    /// Matrix from world directions to right, up and forward.
    to_camera: DMat3,
    position: DVec3,
    is_parallel: bool,
    /// Number of pixels per unit to the right and up, at distance 1.
    scale: [f64; 2],
    /// Maximum magnitude of `scale`.
    finest: f64,
    principal_point: [f64; 2],
    /// Maximum distance of samples from the middle of their pixel, in pixels.
    reach: f64,
    /// Radius of the lens in pixels at distance 1, and the focal distance.
    lens: Option<(f64, f64)>,
}

impl ImageProjection {
    /// Creates the projection; `None` for meters, moving cameras and panoramas.
    fn new(scene: &RenderScene, radius: f64) -> Option<Self> {
        let camera = &scene.camera;
        if scene.meter.is_some()
            || scene.camera_motion.is_some()
            || camera.projection == Projection::Panorama
        {
            return None;
        }
        let axes = [camera.right, camera.up, camera.forward].map(Vec3::as_dvec3);
        let scale = scale(camera);
        let position = camera.position.as_dvec3();
        let finest = scale[0].abs().max(scale[1].abs());
        // Directions have about unit length, and points of lenses are rounded in world space.
        let wide = camera.half_extent[0].max(camera.half_extent[1]);
        let rounding = ROUNDING * finest * (1.0 + f64::from(wide));
        let lens_radius = f64::from(camera.lens_radius) + ROUNDING * position.length();
        Some(Self {
            to_camera: DMat3::from_cols_array_2d(&axes.map(|axis| axis.to_array())).inverse(),
            position,
            is_parallel: camera.projection == Projection::Orthographic,
            scale,
            principal_point: camera.principal_point.map(f64::from),
            reach: radius + MARGIN + rounding,
            finest,
            lens: camera
                .has_lens()
                .then_some((lens_radius * finest, f64::from(camera.focal_distance))),
        })
    }

    /// Transforms a point to camera coordinates: right, up, and forward.
    fn in_camera(&self, p: DVec3) -> DVec3 {
        self.to_camera * (p - self.position)
    }

    /// Column and row of a point in homogeneous coordinates.
    fn on_image(&self, p: DVec3) -> DVec3 {
        let w = if self.is_parallel { 1.0 } else { p.z };
        let ([x0, y0], [sx, sy]) = (self.principal_point, self.scale);
        DVec3::new(p.x * sx + x0 * w, y0 * w - p.y * sy, w)
    }

    /// Direction from the camera through a point of the image.
    fn direction(&self, x: f64, y: f64) -> DVec3 {
        let ([x0, y0], [sx, sy]) = (self.principal_point, self.scale);
        DVec3::new((x - x0) / sx, (y0 - y) / sy, 1.0).normalize()
    }

    /// Maximum displacement in the image, in pixels, of points between these depths as seen from
    /// another point of the lens than its middle: by similar triangles r |1/z − 1/f|.
    fn blur(&self, depths: impl Iterator<Item = f64>) -> f64 {
        let Some((radius, focal)) = self.lens else { return 0.0 };
        depths.map(|z| radius * (1.0 / z - 1.0 / focal).abs()).fold(0.0, f64::max)
    }

    /// Maximum rounding error of parallel rays at some points, in pixels: the origins of the rays
    /// are rounded, and the rays are long.
    fn rounding(&self, points: [DVec3; 3]) -> f64 {
        let far = points.iter().map(|p| p.distance(self.position)).fold(0.0, f64::max);
        let all = far + self.position.length();
        if self.is_parallel { ROUNDING * self.finest * all } else { 0.0 }
    }

    fn draw_triangle(&self, corners: [DVec3; 3], canvas: &Canvas) {
        if !corners.iter().all(|p| p.is_finite()) {
            return; // No ray hits it.
        }
        let rounding = self.rounding(corners);
        let corners = corners.map(|p| self.on_image(self.in_camera(p)));
        if corners.iter().all(|p| p.z <= 0.0) {
            return;
        }
        if corners.iter().any(|p| p.z <= 0.0) {
            let edges = EdgePlanes::new(corners).filter(|_| self.lens.is_none());
            return canvas.cover(Square::ALL, self.reach, |at| {
                edges.map_or_else(|| self.may_see(corners, at), |edges| edges.touch(at))
            });
        }
        let bounds = Square::around(corners.iter().map(|p| [p.x / p.z, p.y / p.z]));
        let reach = self.reach + rounding + self.blur(corners.iter().map(|p| p.z));
        let edges = EdgePlanes::new(corners).filter(|_| bounds.size() > 1.0);
        canvas.cover(bounds, reach, |at| edges.is_none_or(|e| e.touch(at)));
    }

    /// Returns true unless all corners of a triangle are beyond one side of a square, by more than
    /// the extent of the lens. At depth z the rays of a lens are within r |1 − z/f| of that of its
    /// middle, so the region beyond them is convex.
    fn may_see(&self, corners: [DVec3; 3], at: Square) -> bool {
        let room =
            |z: f64| self.lens.map_or(0.0, |(radius, focal)| radius * (1.0 - z / focal).abs());
        let is_beyond = |sign: f64, side: f64, axis: usize| {
            corners.iter().all(|p| sign * (p[axis] - side * p.z) > room(p.z))
        };
        let Square { x, y } = at;
        let sides = [(-1.0, x[0], 0), (1.0, x[1], 0), (-1.0, y[0], 1), (1.0, y[1], 1)];
        !sides.into_iter().any(|(sign, side, axis)| is_beyond(sign, side, axis))
    }

    /// Draws a box by its faces: from inside, a face is visible everywhere.
    fn draw_box(&self, [least, greatest]: [DVec3; 2], canvas: &Canvas) {
        const FACES: [[usize; 4]; 6] =
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let corner = |i: usize| {
            let end = |axis: usize| if i >> axis & 1 == 0 { least } else { greatest }[axis];
            DVec3::new(end(0), end(1), end(2))
        };
        for [a, b, c, d] in FACES {
            self.draw_triangle([a, b, c].map(corner), canvas);
            self.draw_triangle([a, c, d].map(corner), canvas);
        }
    }

    fn draw_sphere(&self, sphere: &Sphere, canvas: &Canvas) {
        let (in_world, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
        let center = self.in_camera(in_world);
        let distance = center.length();
        let is_usual = distance > radius && center.z > radius && !self.is_parallel;
        if self.lens.is_some() || !is_usual {
            return self.draw_box([in_world - radius, in_world + radius], canvas);
        }
        // The sphere is entirely in front of the camera: a box along the camera's axes contains it.
        let corners = (0..8).map(|i| {
            let end = |axis: usize| if i >> axis & 1 == 0 { -radius } else { radius };
            let corner = self.on_image(center + DVec3::new(end(0), end(1), end(2)));
            [corner.x / corner.z, corner.y / corner.z]
        });
        let (sin, axis) = (radius / distance, center / distance);
        canvas.cover(Square::around(corners), self.reach, |at| {
            let middle = self.direction(0.5 * (at.x[0] + at.x[1]), 0.5 * (at.y[0] + at.y[1]));
            let corners = at.x.into_iter().flat_map(|x| at.y.map(|y| self.direction(x, y)));
            let cos_square = corners.map(|d| d.dot(middle)).fold(1.0, f64::min);
            let sin_square = (1.0 - cos_square * cos_square).max(0.0).sqrt();
            // Cosine of the sum of the angular radii of the square and the sphere.
            let apart = cos_square * (1.0 - sin * sin).sqrt() - sin_square * sin;
            middle.dot(axis) >= apart - 1e-9
        });
    }
}

/// Number of pixels per unit to the right and up.
fn scale(camera: &Camera) -> [f64; 2] {
    let of = |i: usize| 0.5 * f64::from(camera.resolution[i]) / f64::from(camera.half_extent[i]);
    [of(0), of(1)]
}

/// Planes through the camera and the edges of a triangle, as linear functions of column and row
/// that are nonnegative inside of its image. [Olano & Greer 1997, "Triangle Scan Conversion using
/// 2D Homogeneous Coordinates", §3]
#[derive(Clone, Copy)]
struct EdgePlanes([DVec3; 3]);

impl EdgePlanes {
    /// Creates the edge functions; `None` if the triangle is seen edge-on.
    fn new([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let edges = [b.cross(c), c.cross(a), a.cross(b)];
        let determinant = a.dot(edges[0]);
        let is_sure = determinant.abs() > MIN_DETERMINANT * a.length() * edges[0].length();
        is_sure.then(|| Self(edges.map(|edge| edge * determinant.signum())))
    }

    /// Returns true if no edge has all of a square on its outer side.
    fn touch(&self, at: Square) -> bool {
        let greatest = |n: f64, [low, high]: [f64; 2]| n * if n > 0.0 { high } else { low };
        self.0.iter().all(|n| greatest(n.x, at.x) + greatest(n.y, at.y) + n.z >= 0.0)
    }
}

/// Pixels of a film, each marked if it may see a surface; many threads draw on it.
struct Canvas {
    region: Region,
    /// Number of blocks in a row.
    columns: u32,
    drawn: Vec<AtomicBool>,
    /// Number of unmarked pixels of each block.
    left: Vec<AtomicU32>,
    left_of_all: AtomicUsize,
}

impl Canvas {
    fn new(region: Region) -> Self {
        let [columns, rows] = [region.width, region.height].map(|n| n.div_ceil(BLOCK));
        let side = |i: u32, n: u32| BLOCK.min(n - i * BLOCK);
        let left = (0..columns * rows)
            .map(|i| side(i % columns, region.width) * side(i / columns, region.height));
        Self {
            region,
            columns,
            drawn: (0..region.area()).map(|_| AtomicBool::new(false)).collect(),
            left: left.map(AtomicU32::new).collect(),
            left_of_all: AtomicUsize::new(region.area()),
        }
    }

    fn is_full(&self) -> bool {
        self.left_of_all.load(Ordering::Relaxed) == 0
    }

    /// Marks the pixels within bounds whose sample areas, of half side `reach`, satisfy `touches`.
    fn cover(&self, bounds: Square, reach: f64, touches: impl Fn(Square) -> bool) {
        let Region { x, y, width, height } = self.region;
        let Square { x: xs, y: ys } = bounds.grown(reach - 0.5);
        let columns = within(xs, x, width);
        let rows = within(ys, y, height);
        let square = |columns: [u32; 2], rows: [u32; 2]| {
            let ends = |first: u32, [low, high]: [u32; 2]| {
                [first + low, first + high - 1].map(|i| f64::from(i) + 0.5)
            };
            Square { x: ends(x, columns), y: ends(y, rows) }.grown(reach)
        };
        for row in blocks(rows) {
            for column in blocks(columns) {
                let block = row[0] / BLOCK * self.columns + column[0] / BLOCK;
                let is_full = self.left[block as usize].load(Ordering::Relaxed) == 0;
                if is_full || !touches(square(column, row)) {
                    continue;
                }
                for (i, j) in
                    (row[0]..row[1]).flat_map(|j| (column[0]..column[1]).map(move |i| (i, j)))
                {
                    let drawn = &self.drawn[j as usize * width as usize + i as usize];
                    let is_new = !drawn.load(Ordering::Relaxed)
                        && touches(square([i, i + 1], [j, j + 1]))
                        && !drawn.swap(true, Ordering::Relaxed);
                    if is_new {
                        self.left[block as usize].fetch_sub(1, Ordering::Relaxed);
                        self.left_of_all.fetch_sub(1, Ordering::Relaxed);
                    }
                }
            }
        }
    }

    /// Flags of the unmarked pixels; empty if there are none.
    fn background_only(self) -> Vec<bool> {
        if self.is_full() {
            return Vec::new();
        }
        self.drawn.into_iter().map(|drawn| !drawn.into_inner()).collect()
    }
}

/// First pixel, and end of the pixels, counted from `first`, that overlap an interval.
fn within([low, high]: [f64; 2], first: u32, count: u32) -> [u32; 2] {
    let number = |v: f64| (v - f64::from(first)).clamp(0.0, f64::from(count)) as u32;
    [number(low.floor()), number(high.floor() + 1.0)]
}

/// Intersections of a range with the blocks.
fn blocks([start, end]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> + Clone {
    (start / BLOCK..end.div_ceil(BLOCK))
        .map(move |i| [start.max(i * BLOCK), end.min((i + 1) * BLOCK)])
        .filter(|[start, end]| start < end)
}
