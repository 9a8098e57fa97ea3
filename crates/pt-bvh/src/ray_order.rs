//! Orders of rays in which those that visit the same nodes are neighbours.

use pt_math::{Bounds3, Ray, Vec3};

/// Number of cells of the grid along each axis, as bits.
const BITS: u32 = 5;
/// Number of cells of the grid.
const CELLS: usize = 1 << (3 * BITS);
/// Fewer rays remain in their order: hardly any two of them would be near each other.
const MIN_RAYS: usize = 4096;

/// Returns the indices of the rays in an order for batches of queries. `bounds` are those of the
/// primitives.
///
/// Rays are ordered by the cell of a regular grid of the box at which they enter the box, or begin,
/// along a Z-order curve: neighbours visit the same nodes, which are in the caches then. Rays whose
/// neighbours begin near them already, and few rays, remain in their order. [after Moon et al.
/// 2010, "Cache-Oblivious Ray Reordering", where they are ordered by their hits]
pub fn coherent_order(rays: &[Ray], bounds: &Bounds3) -> Vec<u32> {
    let in_order = || (0..rays.len() as u32).collect();
    if rays.len() < MIN_RAYS {
        return in_order();
    }
    let cells: Vec<u16> = rays.iter().map(|ray| cell(entry(ray, bounds), bounds)).collect();
    // Eight cells are a cube.
    let near = cells.windows(2).filter(|pair| pair[0] >> 3 == pair[1] >> 3).count();
    if 2 * near >= rays.len() {
        return in_order();
    }
    let mut starts = vec![0_u32; CELLS + 1];
    for &cell in &cells {
        starts[usize::from(cell) + 1] += 1;
    }
    for cell in 0..CELLS {
        starts[cell + 1] += starts[cell];
    }
    let mut order = vec![0; rays.len()];
    for (ray, &cell) in cells.iter().enumerate() {
        let place = &mut starts[usize::from(cell)];
        order[*place as usize] = ray as u32;
        *place += 1;
    }
    order
}

/// Point at which a ray enters a box, or begins; any point if it misses the box.
fn entry(ray: &Ray, bounds: &Bounds3) -> Vec3 {
    let [a, b] = [bounds.min, bounds.max].map(|corner| (corner - ray.origin) / ray.direction);
    ray.at(a.min(b).max_element().max(ray.t_min))
}

/// Number of the cell of a point along the Z-order curve; points outside belong to cells at the
/// sides of the box.
fn cell(p: Vec3, bounds: &Bounds3) -> u16 {
    let places = (p - bounds.min) / bounds.diagonal() * (1 << BITS) as f32;
    let [x, y, z] = places.to_array().map(|place| spread((place as u16).min((1 << BITS) - 1)));
    x | y << 1 | z << 2
}

/// Moves bit i to bit 3i.
fn spread(bits: u16) -> u16 {
    const { assert!(BITS == 5) };
    let bits = (bits | bits << 8) & 0x100f;
    let bits = (bits | bits << 4) & 0x10c3;
    (bits | bits << 2) & 0x1249
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds3 = Bounds3 { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) };

    fn random_rays(count: u32) -> Vec<Ray> {
        let number = |i: u32| (i.wrapping_mul(2_654_435_769) >> 8) as f32 / (1 << 24) as f32 - 0.5;
        let vector = |i| Vec3::new(number(i), number(i + 1), number(i + 2));
        (0..count).map(|i| Ray::new(vector(6 * i) * 10.0, vector(6 * i + 3))).collect()
    }

    #[test]
    fn bits_are_spread() {
        for bits in 0..1 << BITS {
            let expected: u16 = (0..BITS).map(|bit| (bits >> bit & 1) << (3 * bit)).sum();
            assert_eq!(spread(bits), expected);
        }
    }

    #[test]
    fn each_ray_occurs_once_and_neighbours_enter_near_each_other() {
        let rays = random_rays(20_000);
        let order = coherent_order(&rays, &BOX);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..rays.len() as u32));
        let entries = |order: &[u32]| -> f32 {
            let at = |ray: &u32| entry(&rays[*ray as usize], &BOX).clamp(BOX.min, BOX.max);
            let distances = order.windows(2).map(|pair| at(&pair[0]).distance(at(&pair[1])));
            distances.sum::<f32>() / order.len() as f32
        };
        let before = entries(&(0..rays.len() as u32).collect::<Vec<_>>());
        assert!(entries(&order) < 0.2 * before, "{} {before}", entries(&order));
    }

    #[test]
    fn coherent_rays_remain_in_order() {
        let ray = |i: u32| {
            let across = Vec3::new((i % 100) as f32, (i / 100) as f32, 0.0) / 50.0 - 1.0;
            Ray::new(Vec3::new(0.0, 0.0, 8.0), Vec3::new(across.x, across.y, -6.0))
        };
        let rays: Vec<_> = (0..10_000).map(ray).collect();
        assert!(coherent_order(&rays, &BOX).into_iter().eq(0..10_000));
    }

    /// Neither empty boxes nor rays along the axes or without end harm.
    #[test]
    fn every_ray_has_a_cell() {
        let flat = Bounds3 { max: BOX.max.with_y(BOX.min.y), ..BOX };
        let mut rays = random_rays(MIN_RAYS as u32);
        rays.push(Ray::new(BOX.min, Vec3::X));
        rays.push(Ray::new(Vec3::ZERO, Vec3::ZERO));
        rays.push(Ray::new(Vec3::splat(f32::MAX), Vec3::Z));
        for bounds in [flat, Bounds3::EMPTY, Bounds3::point(Vec3::ZERO)] {
            assert_eq!(coherent_order(&rays, &bounds).len(), rays.len());
        }
        for count in [0, 1, MIN_RAYS - 1] {
            assert!(coherent_order(&rays[..count], &BOX).into_iter().eq(0..count as u32));
        }
    }
}
