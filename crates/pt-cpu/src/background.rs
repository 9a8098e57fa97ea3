//! Pixels that see nothing but an even sky, or the dark: all their samples are the same, and one
//! need not ask how often these missed something.
//!
//! Which they are is a question to the scene and not to samples, so that the answer biases nothing.
//! All primitives are drawn over the squares in which samples of pixels lie; what none touches is
//! vacant. That is on the safe side: squares are a little larger than they are, spheres seen
//! through a lens and placed objects are boxes.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};

use pt_bvh::Sphere;
use pt_core::camera::{Camera, Projection};
use pt_core::film::Region;
use pt_core::scene::RenderScene;
use pt_math::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::render::Renderer;

/// By how much squares of samples are taken for larger, in pixels, besides what rounding of rays
/// may be.
const MARGIN: f64 = 1.0 / 64.0;

/// By which share of its numbers a ray is off by rounding at most.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

/// Side of the squares of pixels that are looked at together.
const BLOCK: u32 = 16;

/// Primitives that are drawn by one thread in a row.
const CHUNK: usize = 4096;

/// Below this, as a share of what it may be, the sign of a determinant is not trusted.
const MIN_DETERMINANT: f64 = 1e-9;

impl Renderer<'_> {
    /// Of each pixel of a film, row by row, whether all its samples are known to be the same;
    /// nothing if none is.
    pub(crate) fn background_pixels(&self, region: Region) -> Vec<bool> {
        let Self { scene, settings, .. } = self;
        let is_uniform = settings.target.is_some_and(|target| target.uniform);
        let has_signs = self.filter.as_ref().is_some_and(|filter| !filter.is_positive());
        let is_even = scene.infinite_lights.iter().all(|&sky| scene.lights[sky].is_constant());
        let is_alone = settings.reuse == 1 && scene.media.camera.is_none() && is_even;
        let Some(view) = View::new(scene, settings.filter.radius()) else { return Vec::new() };
        if is_uniform || has_signs || !is_alone {
            return Vec::new();
        }
        let canvas = Canvas::new(region);
        self.in_pool(|| draw(scene, &view, &canvas));
        canvas.background_only()
    }
}

/// Draws all that a scene holds.
fn draw(scene: &RenderScene, view: &View, canvas: &Canvas) {
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

/// Columns and rows as real numbers, from the upper left corner of the image: least and greatest of
/// each.
#[derive(Clone, Copy, Debug)]
struct Square {
    x: [f64; 2],
    y: [f64; 2],
}

impl Square {
    const ALL: Self =
        Self { x: [f64::NEG_INFINITY, f64::INFINITY], y: [f64::NEG_INFINITY, f64::INFINITY] };

    /// Around points.
    fn around(points: impl Iterator<Item = [f64; 2]>) -> Self {
        const NONE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        let with = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
        points
            .fold(Self { x: NONE, y: NONE }, |s, [x, y]| Self { x: with(s.x, x), y: with(s.y, y) })
    }

    /// With so much more on all sides.
    fn grown(self, by: f64) -> Self {
        let grown = |[low, high]: [f64; 2]| [low - by, high + by];
        Self { x: grown(self.x), y: grown(self.y) }
    }

    /// The greater one of width and height.
    fn size(&self) -> f64 {
        (self.x[1] - self.x[0]).max(self.y[1] - self.y[0])
    }
}

/// From points of the world to those of the image.
struct View {
    /// From the world's directions to right, up and forward.
    to_camera: DMat3,
    position: DVec3,
    is_parallel: bool,
    /// Pixels that a step of 1 to the right and up is, at distance 1.
    scale: [f64; 2],
    /// The greater one.
    finest: f64,
    principal_point: [f64; 2],
    /// How far from the middle of a pixel its samples are.
    reach: f64,
    /// Radius of the lens in pixels at distance 1, and the distance of what is sharp.
    lens: Option<(f64, f64)>,
}

impl View {
    /// `None` for meters, and cameras that move or see all around.
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
        // Directions are of unit length about, and points of lenses are rounded where these are.
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

    /// To the right, up, and forward.
    fn in_camera(&self, p: DVec3) -> DVec3 {
        self.to_camera * (p - self.position)
    }

    /// Column and row of a point in homogeneous coordinates.
    fn on_image(&self, p: DVec3) -> DVec3 {
        let w = if self.is_parallel { 1.0 } else { p.z };
        let ([x0, y0], [sx, sy]) = (self.principal_point, self.scale);
        DVec3::new(p.x * sx + x0 * w, y0 * w - p.y * sy, w)
    }

    /// The direction in which the camera sees a point of the image.
    fn direction(&self, x: f64, y: f64) -> DVec3 {
        let ([x0, y0], [sx, sy]) = (self.principal_point, self.scale);
        DVec3::new((x - x0) / sx, (y0 - y) / sy, 1.0).normalize()
    }

    /// How far from where the middle of the lens sees it another of its points sees something
    /// between these depths, in pixels: by similar triangles r |1/z − 1/f|.
    fn blur(&self, depths: impl Iterator<Item = f64>) -> f64 {
        let Some((radius, focal)) = self.lens else { return 0.0 };
        depths.map(|z| radius * (1.0 / z - 1.0 / focal).abs()).fold(0.0, f64::max)
    }

    /// How far from where they are rays that are parallel may find points, in pixels: the rays
    /// begin somewhere, and are long.
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
            let edges = Edges::new(corners).filter(|_| self.lens.is_none());
            return canvas.cover(Square::ALL, self.reach, |at| {
                edges.map_or_else(|| self.may_see(corners, at), |edges| edges.touch(at))
            });
        }
        let bounds = Square::around(corners.iter().map(|p| [p.x / p.z, p.y / p.z]));
        let reach = self.reach + rounding + self.blur(corners.iter().map(|p| p.z));
        let edges = Edges::new(corners).filter(|_| bounds.size() > 1.0);
        canvas.cover(bounds, reach, |at| edges.is_none_or(|e| e.touch(at)));
    }

    /// Returns true if no side of a square has all corners of a triangle beyond it, as far as the
    /// lens goes. At depth z the rays of a lens are r |1 − z/f| around that of its middle,
    /// which makes what is beyond them convex.
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

    /// A box, by its faces: who is inside sees one everywhere.
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
        // In front of the camera as a whole: the corners of a box with the camera's axes are around
        // it.
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
            // The cosine of the sum of the angles that the square and the sphere have to their
            // middles.
            let apart = cos_square * (1.0 - sin * sin).sqrt() - sin_square * sin;
            middle.dot(axis) >= apart - 1e-9
        });
    }
}

/// Pixels that a step of 1 is to the right and up.
fn scale(camera: &Camera) -> [f64; 2] {
    let of = |i: usize| 0.5 * f64::from(camera.resolution[i]) / f64::from(camera.half_extent[i]);
    [of(0), of(1)]
}

/// The planes through the camera and the edges of a triangle, as linear functions of column and row
/// that are not negative where it is seen. [Olano & Greer 1997, "Triangle Scan Conversion using 2D
/// Homogeneous Coordinates", §3]
#[derive(Clone, Copy)]
struct Edges([DVec3; 3]);

impl Edges {
    /// `None` if it is seen from its edge.
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

/// The pixels of a film, of which some see a surface; many threads draw on it.
struct Canvas {
    region: Region,
    /// Blocks in a row.
    columns: u32,
    drawn: Vec<AtomicBool>,
    /// Number of pixels of each block that are not drawn.
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

    /// Draws what lies within bounds, on pixels whose samples are not further from their middles
    /// than `reach` and whose squares it touches.
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

    /// The pixels on which nothing was drawn; nothing if there are none.
    fn background_only(self) -> Vec<bool> {
        if self.is_full() {
            return Vec::new();
        }
        self.drawn.into_iter().map(|drawn| !drawn.into_inner()).collect()
    }
}

/// Numbers of pixels, from `first`, that have a part between two places; behind the last one.
fn within([low, high]: [f64; 2], first: u32, count: u32) -> [u32; 2] {
    let number = |v: f64| (v - f64::from(first)).clamp(0.0, f64::from(count)) as u32;
    [number(low.floor()), number(high.floor() + 1.0)]
}

/// The parts of a range that lie in each block.
fn blocks([start, end]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> + Clone {
    (start / BLOCK..end.div_ceil(BLOCK))
        .map(move |i| [start.max(i * BLOCK), end.min((i + 1) * BLOCK)])
        .filter(|[start, end]| start < end)
}
