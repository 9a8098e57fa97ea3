//! Laws that all builders and kernels obey, on random scenes.

mod agreement;
mod bytes;
mod construction;
mod instances;
mod moving;
mod pieces;
mod precision;
mod refit;
mod spawned;
mod spheres;
mod user;
mod watertight;

use std::collections::HashMap;

use pt_math::Vec3;

use crate::build::SplitLimits;
use crate::{BuildOptions, Bvh, Bvh2, Geometry, Sphere};

/// Scene that owns its arrays.
#[derive(Clone, Debug, Default)]
struct Soup {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    spheres: Vec<Sphere>,
}

impl Soup {
    fn geometry(&self) -> Geometry<'_> {
        Geometry { positions: &self.positions, triangles: &self.triangles, spheres: &self.spheres }
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }
}

/// Builds trees with triangles cut wherever possible.
fn in_pieces(soup: &Soup, options: BuildOptions) -> (Bvh2, Bvh) {
    let geometry = soup.geometry();
    let hub = Bvh2::with_effort(&geometry, options, Some(SplitLimits::EVERYTHING));
    let hub = hub.expect("indices are in range");
    let bvh = Bvh::of(&hub, &geometry, options);
    (hub, bvh)
}

/// A sphere of triangles: an octahedron whose triangles are each subdivided into four, `levels`
/// times. Triangles are counterclockwise seen from outside.
fn ball(levels: u32) -> Soup {
    let mut positions = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for (x, y, z) in (0..8).map(|i| (i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2))) {
        triangles.push(if (x + y + z) % 2 == 0 { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let sum = positions[a as usize] + positions[b as usize];
                positions.push(sum.normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    Soup { positions, triangles, spheres: Vec::new() }
}

/// A [`ball`] with hills of two sizes, star-shaped with respect to its centre.
fn bumpy_ball(levels: u32) -> Soup {
    let wave = |x: f32| {
        let r = x - x.floor();
        4.0 * r * (1.0 - r)
    };
    let mut soup = ball(levels);
    for p in &mut soup.positions {
        let hills = wave(3.1 * p.x) * wave(3.7 * p.y) * wave(4.3 * p.z);
        let ripples = wave(17.0 * p.x) + wave(19.0 * p.y) + wave(23.0 * p.z);
        *p *= 0.7 + 0.4 * hills + 0.02 * ripples;
    }
    soup
}
