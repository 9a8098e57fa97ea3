//! Ray sets of four kinds, from coherent to random.

use pt_bvh::{Bvh, Hit};
use pt_math::{DVec3, Frame, Ray, Vec3, trig, warp};

use super::input::TriangleMesh;
use super::random::random as numbers;

/// Edge of the square tiles in which the camera's pixels are ordered, in pixels.
const TILE: usize = 8;
/// Sets are cut to a multiple of this, so that all competitors can trace all rays.
pub(super) const WIDEST_PACKET: usize = 16;

/// Origin of the rays of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RaySetKind {
    /// From a pinhole, through a random position in each pixel, ordered in tiles.
    Primary,
    /// From the primary hits, in cosine-distributed directions.
    Bounce,
    /// From the primary hits to random points of a square under the top of the bounds.
    Shadow,
    /// From random points in the bounds in uniform directions.
    Random,
}

impl RaySetKind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Bounce => "bounce",
            Self::Shadow => "shadow",
            Self::Random => "random",
        }
    }
}

/// Rays of one kind. Directions have unit length.
pub(super) struct RaySet {
    pub(super) kind: RaySetKind,
    pub(super) rays: Vec<Ray>,
}

/// Sets of a mesh, with `resolution`² primary and random rays.
pub(super) fn all(mesh: &TriangleMesh, bvh: &Bvh, resolution: usize) -> Vec<RaySet> {
    let primary = primary(mesh, resolution);
    let (bounce, shadow) = secondary(mesh, bvh, &primary);
    let random = random(mesh, primary.len());
    let sets = [
        (RaySetKind::Primary, primary),
        (RaySetKind::Bounce, bounce),
        (RaySetKind::Shadow, shadow),
        (RaySetKind::Random, random),
    ];
    let cut = |(kind, mut rays): (RaySetKind, Vec<Ray>)| {
        rays.truncate(rays.len() / WIDEST_PACKET * WIDEST_PACKET);
        RaySet { kind, rays }
    };
    sets.into_iter().map(cut).collect()
}

/// Rays of the mesh's camera through a square image, row of tiles by row of tiles.
fn primary(mesh: &TriangleMesh, resolution: usize) -> Vec<Ray> {
    let view = mesh.view();
    let forward = (view.look - view.eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let half = trig::tan(view.fov_degrees.to_radians() / 2.0);
    let ray = |[x, y]: [usize; 2]| {
        let [dx, dy] = numbers(1, y * resolution + x).unit_2d();
        let u = (x as f32 + dx) / resolution as f32 * 2.0 - 1.0;
        let v = 1.0 - (y as f32 + dy) / resolution as f32 * 2.0;
        Ray::new(view.eye, (forward + right * (u * half) + up * (v * half)).normalize())
    };
    let tiles = move || (0..resolution).step_by(TILE);
    tiles()
        .flat_map(|y| tiles().map(move |x| [x, y]))
        .flat_map(|[x, y]| (0..TILE * TILE).map(move |i| [x + i % TILE, y + i / TILE]))
        .filter(|pixel| pixel.iter().all(|&p| p < resolution))
        .map(ray)
        .collect()
}

/// For each hit of `rays` one bounce and, unless it is too close to the light, one shadow ray.
fn secondary(mesh: &TriangleMesh, bvh: &Bvh, rays: &[Ray]) -> (Vec<Ray>, Vec<Ray>) {
    let bounds = bvh.bounds();
    let extent = bounds.diagonal();
    let away = 1e-4 * extent.length();
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    for (i, ray) in rays.iter().enumerate() {
        let Some((origin, normal)) = bvh.intersect(ray).and_then(|h| leave(mesh, ray, &h, away))
        else {
            continue;
        };
        let mut random = numbers(2, i);
        let direction = warp::cosine_hemisphere(random.unit_2d());
        let direction = Frame::from_normal(normal).to_world(direction).normalize();
        bounce.push(Ray::new(origin, direction));
        let [u, v] = random.unit_2d().map(|u| 0.5 + 0.3 * (u - 0.5));
        let light = bounds.min + extent * Vec3::new(u, 0.98, v);
        let distance = (light - origin).length();
        if distance > 4.0 * away {
            let direction = ((light - origin) / distance).normalize();
            shadow.push(Ray::to(origin, direction, distance * 0.999));
        }
    }
    (bounce, shadow)
}

/// Origin of rays that leave a hit, `away` from the surface on the ray's side, and the unit normal
/// there; `None` for triangles that are too thin to have one.
fn leave(mesh: &TriangleMesh, ray: &Ray, hit: &Hit, away: f32) -> Option<(Vec3, Vec3)> {
    let [a, b, c] = mesh.corners(hit.primitive as usize).map(Vec3::as_dvec3);
    let normal: DVec3 = (b - a).cross(c - a).try_normalize()?;
    let normal = normal.as_vec3().normalize();
    let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
    Some((ray.at(hit.t) + normal * away, normal))
}

/// `count` rays from random points in the bounds in uniform directions.
fn random(mesh: &TriangleMesh, count: usize) -> Vec<Ray> {
    let bounds = mesh.bounds();
    let ray = |i: usize| {
        let mut random = numbers(3, i);
        let at = Vec3::new(random.unit(), random.unit(), random.unit());
        let direction = warp::uniform_sphere(random.unit_2d()).normalize();
        Ray::new(bounds.min + bounds.diagonal() * at, direction)
    };
    (0..count).map(ray).collect()
}

#[cfg(test)]
mod tests {
    use pt_bvh::BuildOptions;

    use super::super::shapes;
    use super::*;

    fn sets() -> Vec<RaySet> {
        let mesh = shapes::blob(12);
        let bvh = Bvh::build(mesh.geometry(), &BuildOptions::default()).unwrap();
        all(&mesh, &bvh, 64)
    }

    #[test]
    fn sets_are_the_same_each_time() {
        for (a, b) in sets().iter().zip(sets()) {
            assert_eq!(a.rays, b.rays);
        }
    }

    #[test]
    fn directions_have_unit_length_and_sets_fill_packets() {
        for set in sets() {
            assert!(!set.rays.is_empty(), "{:?}", set.kind);
            assert_eq!(set.rays.len() % WIDEST_PACKET, 0);
            for ray in &set.rays {
                assert!((ray.direction.length() - 1.0).abs() < 1e-6, "{ray:?}");
                assert!(ray.origin.is_finite() && ray.t_min == 0.0 && ray.t_max > 0.0, "{ray:?}");
            }
        }
    }

    #[test]
    fn rays_of_a_tile_are_neighbours() {
        let rays = &sets()[0].rays;
        assert_eq!(rays.len(), 64 * 64);
        // A row of 64 pixels is 40° wide, and the diagonal of a tile 7°.
        for tile in rays.chunks(TILE * TILE) {
            let cos = |ray: &Ray| ray.direction.dot(tile[0].direction);
            assert!(tile.iter().all(|ray| cos(ray) > trig::sin_cos(9f32.to_radians()).1));
        }
    }
}
