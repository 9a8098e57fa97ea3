//! No ray passes through a wall: neither at acute angles between walls, nor by hitting the surface
//! it leaves.

use pathtracer::{Session, Settings};
use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_math::float_error::{EPSILON, gamma};
use pt_math::ray::offset_origin;
use pt_math::{DAffine3, DQuat, DVec3, Ray, Vec3};
use pt_scene::Mesh;
use pt_testing::Random;

use crate::scenes::{Builder, camera, matte, size};

const ANGLES: [f64; 8] = [1.0, 2.0, 5.0, 10.0, 20.0, 45.0, 60.0, 90.0];
const SCALES: [f64; 5] = [1e-3, 1e-1, 1.0, 1e2, 1e5];
/// Distances from the origin, in sizes of the wedge.
const PLACES: [f64; 4] = [0.0, 1.0, 30.0, 1000.0];
const POINTS: usize = 300;

fn mesh(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Mesh {
    let parts = vec![pt_scene::Submesh { triangles: 0..triangles.len() as u32, slot: 0 }];
    Mesh {
        positions: positions.into(),
        triangles: triangles.into(),
        submeshes: parts,
        ..Mesh::default()
    }
}

/// A prism two of whose walls, which have two triangles each, meet at an angle.
fn prism(angle: f64) -> Mesh {
    let (sin, cos) = angle.to_radians().sin_cos();
    let end = |z: f32| [[0.0, 0.0, z], [1.0, 0.0, z], [cos as f32, sin as f32, z]];
    let positions = [end(0.0), end(1.0)].concat();
    let wall = |a: u32, b: u32| [[a, b, b + 3], [a, b + 3, a + 3]];
    let triangles = [wall(0, 1), wall(1, 2), wall(2, 0), [[0, 2, 1], [3, 4, 5]]].concat();
    mesh(positions, triangles)
}

/// A tetrahedron two of whose faces meet at an angle: convex however its corners are rounded.
fn tetrahedron(angle: f64) -> Mesh {
    let (sin, cos) = angle.to_radians().sin_cos();
    let (sin, cos) = (sin as f32, cos as f32);
    let positions = vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.3], [cos, sin, 0.6]];
    mesh(positions, vec![[0, 2, 3], [1, 3, 2], [0, 3, 1], [0, 1, 2]])
}

/// A closed mesh, turned, scaled and moved, with all its triangles and a point inside.
struct Room {
    session: Session,
    inside: DVec3,
}

impl Room {
    fn new(mesh: Mesh, scale: f64, place: f64, random: &mut Random) -> Self {
        let [axis, to] = [(); 2].map(|()| random.direction().as_dvec3().normalize());
        let turn = DQuat::from_axis_angle(axis, f64::from(random.unit()) * 6.0);
        let to_world = DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            turn,
            to * (place * scale),
        );
        let scene = Builder::default()
            .mesh(mesh, to_world, matte([0.5; 3]))
            .sky(1.0)
            .seen_by(camera(DVec3::Z * scale, DVec3::ZERO, [40.0, 40.0]));
        let session = Session::new(&scene, size([4, 4]), Settings::default()).expect("it compiles");
        let corners = &session.scene().shapes.positions;
        let sum: DVec3 = corners.iter().map(|p| p.as_dvec3()).sum();
        let inside = sum / corners.len() as f64;
        Self { session, inside }
    }

    fn scene(&self) -> &RenderScene {
        self.session.scene()
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        let shapes = &self.scene().shapes;
        shapes.triangles[triangle as usize].map(|v| shapes.positions[v as usize].as_dvec3())
    }

    /// A point of a wall, often close to an edge or a corner, as hit by a ray from inside.
    fn hit(&self, random: &mut Random) -> (Ray, Hit) {
        let primitive = random.below(self.scene().shapes.triangles.len()) as u32;
        let small = |r: &mut Random| 10f32.powf(r.between(-8.0, 0.0)) * 0.5;
        let [near, other] = [(); 2].map(|()| small(random));
        let (b1, b2) = match random.below(5) {
            0 => (near, other),
            1 => (1.0 - near - other, other),
            2 => (near, 1.0 - near - other),
            3 => (near, random.between(0.0, 1.0 - near)),
            _ => {
                let share = random.unit();
                ((1.0 - near) * share, (1.0 - near) * (1.0 - share))
            }
        };
        let [a, b, c] = self.corners(primitive);
        let p = a + (b - a) * f64::from(b1) + (c - a) * f64::from(b2);
        let origin = self.inside.as_vec3();
        let to = p.as_vec3() - origin;
        let ray = Ray::new(origin, to.normalize());
        (ray, Hit { t: to.length(), b1, b2, primitive })
    }

    /// Unit normal of a triangle, to the outside.
    fn outwards(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        let n = (b - a).cross(c - a).normalize();
        if n.dot(a - self.inside) < 0.0 { -n } else { n }
    }

    /// Returns true if a point is beyond some wall.
    fn is_beyond(&self, p: DVec3) -> bool {
        let count = self.scene().shapes.triangles.len() as u32;
        (0..count).any(|i| (p - self.corners(i)[0]).dot(self.outwards(i)) > 0.0)
    }

    /// Returns true if the origin that is moved along the normal alone, by the error of a mean of
    /// corners in single precision, is beyond a wall.
    fn leaks_by_offset_alone(&self, hit: &Hit) -> bool {
        let [a, b, c] = self.corners(hit.primitive);
        let (b1, b2) = (f64::from(hit.b1), f64::from(hit.b2));
        let p = (a + (b - a) * b1 + (c - a) * b2).as_vec3();
        let size = a.abs() * (1.0 - b1 - b2) + b.abs() * b1 + c.abs() * b2;
        let inwards = -self.outwards(hit.primitive).as_vec3();
        let error = size.as_vec3() * gamma(7);
        self.is_beyond(offset_origin(p, error, inwards, inwards).as_dvec3())
    }
}

/// A uniform direction on the side of `n`, except those with a sine below 0.02: they may meet the
/// next wall so close to the edge that single precision does not distinguish the two walls.
fn inwards(n: DVec3, random: &mut Random) -> Vec3 {
    loop {
        let w = random.direction();
        let sine = n.dot(w.as_dvec3());
        if sine.abs() > 0.02 {
            return if sine < 0.0 { -w } else { w };
        }
    }
}

/// A direction on the side of `n`, often at a small angle to the plane across it.
fn leaving(n: DVec3, random: &mut Random) -> Vec3 {
    let along = random.direction().as_dvec3();
    let sine = 10f64.powf(f64::from(random.between(-5.0, 0.0)));
    let flat = (along - n * n.dot(along)).normalize_or(n.any_orthonormal_vector());
    (flat * (1.0 - sine * sine).sqrt() + n * sine).normalize().as_vec3()
}

/// All rooms of a kind.
fn rooms(of: fn(f64) -> Mesh, mut each: impl FnMut(&Room, &str, &mut Random)) {
    let mut random = Random::new(7);
    for angle in ANGLES {
        for scale in SCALES {
            for place in PLACES {
                let room = Room::new(of(angle), scale, place, &mut random);
                each(&room, &format!("{angle} degrees, {scale} wide, {place} away"), &mut random);
            }
        }
    }
}

#[test]
fn no_ray_from_a_wall_leaves_a_closed_room() {
    let (mut leaks, mut leaks_by_offset_alone) = (Vec::new(), 0);
    for of in [prism as fn(f64) -> Mesh, tetrahedron] {
        rooms(of, |room, what, random| {
            for _ in 0..POINTS {
                let (ray, hit) = room.hit(random);
                leaks_by_offset_alone += u32::from(room.leaks_by_offset_alone(&hit));
                let at = room.scene().interaction(&ray, &hit, 0.0);
                for _ in 0..4 {
                    let w = inwards(-room.outwards(hit.primitive), random);
                    let next = at.point.spawn(w);
                    let bvh = &room.scene().bvh;
                    if bvh.intersect(&next).is_none() || !bvh.occluded(&next) {
                        leaks.push(format!("{what}: {hit:?} of {ray:?} to {next:?}"));
                    }
                }
            }
        });
    }
    assert!(leaks.is_empty(), "{} leaks: {:#?}", leaks.len(), &leaks[..leaks.len().min(20)]);
    assert!(leaks_by_offset_alone > 5000, "{leaks_by_offset_alone}");
}

#[test]
fn no_ray_that_leaves_a_convex_body_hits_it_again() {
    rooms(tetrahedron, |room, what, random| {
        for _ in 0..POINTS {
            let (ray, hit) = room.hit(random);
            let at = room.scene().interaction(&ray, &hit, 0.0);
            for _ in 0..4 {
                let w = leaving(room.outwards(hit.primitive), random);
                let next = at.point.spawn(w);
                let again = room.scene().bvh.intersect(&next);
                assert_eq!(again, None, "{what}: {hit:?} of {ray:?} to {next:?}");
            }
        }
    });
}

/// Rays that leave a sphere meet it at the right place: nowhere, or at a distance of 2r cos θ.
#[test]
fn rays_that_leave_a_sphere_do_not_hit_it_again() {
    let mut random = Random::new(8);
    for (scale, place) in SCALES.iter().flat_map(|s| PLACES.map(|p| (*s, p))) {
        let center = random.direction().as_dvec3() * (place * scale);
        let scene = Builder::default().sphere(center, scale, matte([0.5; 3])).seen_by(camera(
            DVec3::Z * scale,
            DVec3::ZERO,
            [40.0, 40.0],
        ));
        let session = Session::new(&scene, size([4, 4]), Settings::default()).expect("it compiles");
        let scene = session.scene();
        for _ in 0..POINTS * 10 {
            let target = center + random.in_cube().as_dvec3() * (0.5 * scale);
            let from = target + random.direction().as_dvec3() * (scale * 3.0);
            let (origin, to) = (from.as_vec3(), (target - from).as_vec3());
            let ray = Ray::new(origin, to.normalize());
            let Some(hit) = scene.bvh.intersect(&ray) else { continue };
            let at = scene.interaction(&ray, &hit, 0.0);
            let n = at.point.normal.as_dvec3();
            let outwards = leaving(n, &mut random);
            assert_eq!(scene.bvh.intersect(&at.point.spawn(outwards)), None, "{scale} {place}");
            let inwards = inwards(-n, &mut random);
            let cosine = -n.dot(inwards.as_dvec3());
            // Part of the distance that the offset and the rounding of the origin may take.
            let reach = 16.0 * f64::from(EPSILON) * (place + 1.0) * scale;
            if cosine * cosine * scale > 4.0 * reach {
                let t = scene.bvh.intersect(&at.point.spawn(inwards)).map(|hit| f64::from(hit.t));
                let want = 2.0 * scale * cosine;
                let error = t.map(|t| (t - want).abs() * cosine);
                assert!(error.is_some_and(|e| e < 2.0 * reach), "{scale} {place}: {t:?} {want}");
            }
        }
    }
}
