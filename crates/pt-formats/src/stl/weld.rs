//! Welding of equal corners to one vertex.

use std::path::Path;

use rayon::prelude::*;

use crate::LoadError;
use crate::shared::mesh_file;

/// Binary logarithm of the size of the table of vertices: the table and the vertices fit into the
/// cache of a core.
const PLACES_LOG2: u32 = 15;

/// Triangles with shared vertices.
pub(super) struct WeldedTriangles {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Welds equal corners of a piece of a file.
///
/// A vertex is stored in a table at a hash of its coordinates, until another one replaces it. So a
/// corner is nearly always found among those near it in the file, at a cost that does not grow with
/// the file.
pub(super) struct Welder {
    positions: Vec<[f32; 3]>,
    /// Last vertex of each entry of the table, or 0.
    places: Vec<u32>,
}

impl Welder {
    pub(super) fn new() -> Self {
        Self { positions: Vec::new(), places: vec![0; 1 << PLACES_LOG2] }
    }

    /// Returns the index of the vertex of a corner.
    pub(super) fn vertex(&mut self, corner: [f32; 3]) -> u32 {
        // −0 becomes 0.
        let position = corner.map(|x| x + 0.0);
        let bits = position.map(f32::to_bits);
        let place = &mut self.places[place_of(bits)];
        let known = self.positions.get(*place as usize);
        if known.is_none_or(|known| known.map(f32::to_bits) != bits) {
            *place = self.positions.len() as u32;
            self.positions.push(position);
        }
        *place
    }

    /// Returns the vertices of the piece, and clears the state for the next one.
    pub(super) fn finish(&mut self) -> Vec<[f32; 3]> {
        self.places.fill(0);
        let positions = self.positions.clone();
        self.positions.clear();
        positions
    }
}

/// Returns the table index of a vertex. Odd multipliers (the first of which is 2³² over the golden
/// ratio) spread the bits of each coordinate to the high ones, which are used.
fn place_of([x, y, z]: [u32; 3]) -> usize {
    const SPREAD: u32 = 0x9E37_79B1;
    let y = y.wrapping_mul(0x85EB_CA77).rotate_left(15);
    let z = z.wrapping_mul(0xC2B2_AE3D).rotate_left(7);
    let mixed = (x.wrapping_mul(SPREAD) ^ y ^ z).wrapping_mul(SPREAD);
    (mixed >> (u32::BITS - PLACES_LOG2)) as usize
}

/// Joins pieces to one mesh, in order; each has its vertices and its number of triangles.
///
/// # Errors
/// Returns an error if the number of vertices exceeds 32 bits.
pub(super) fn join(
    pieces: &[(Vec<[f32; 3]>, usize)],
    mut triangles: Vec<[u32; 3]>,
    path: &Path,
) -> Result<WeldedTriangles, LoadError> {
    let vertices = pieces.iter().map(|(vertices, _)| vertices.len()).sum();
    if u32::try_from(vertices).is_err() {
        let message = format!("{vertices} vertices exceed the range of 32-bit indices");
        return Err(mesh_file::error(path, 0, message));
    }
    let mut positions = pt_memory::zeros(vertices);
    let (mut places, mut corners) = (positions.as_mut_slice(), triangles.as_mut_slice());
    let (mut jobs, mut first) = (Vec::with_capacity(pieces.len()), 0);
    for (vertices, count) in pieces {
        let its_places = places.split_off_mut(..vertices.len()).unwrap_or_default();
        let its_corners = corners.split_off_mut(..*count).unwrap_or_default();
        jobs.push((vertices, its_places, its_corners, first));
        first += vertices.len() as u32;
    }
    jobs.into_par_iter().for_each(|(vertices, places, corners, first)| {
        places.copy_from_slice(vertices);
        corners.as_flattened_mut().iter_mut().for_each(|corner| *corner += first);
    });
    Ok(WeldedTriangles { positions, triangles })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_corners_of_a_piece_are_one_vertex_and_zeros_have_no_sign() {
        let mut welder = Welder::new();
        let corners =
            [[0.0; 3], [1.0, 2.0, 3.0], [-0.0, 0.0, -0.0], [1.0, 2.0, 3.0], [3.0, 2.0, 1.0]];
        assert_eq!(corners.map(|corner| welder.vertex(corner)), [0, 1, 0, 1, 2]);
        let positions = welder.finish();
        assert_eq!(positions, [[0.0; 3], [1.0, 2.0, 3.0], [3.0, 2.0, 1.0]]);
        assert!(positions[0].iter().all(|x| x.is_sign_positive()));
        assert_eq!(welder.vertex([3.0, 2.0, 1.0]), 0, "the next piece begins anew");
    }

    /// Three times as many vertices as table entries: many replace others, but each corner gets its
    /// own position.
    #[test]
    fn vertices_that_are_forgotten_are_made_again() {
        let mut welder = Welder::new();
        let count = 3_u32 << PLACES_LOG2;
        let position = |i: u32| [i as f32, 0.5 * i as f32, -(i as f32)];
        let corners = (0..2 * count).map(|i| welder.vertex(position(i % count)));
        let numbers: Vec<u32> = corners.collect();
        let positions = welder.finish();
        assert!(positions.len() > count as usize);
        for (i, number) in (0..).zip(numbers) {
            assert_eq!(positions[number as usize], position(i % count));
        }
    }

    #[test]
    fn pieces_are_joined_in_their_order() {
        let pieces =
            [(vec![[1.0; 3], [2.0; 3], [3.0; 3]], 1), (vec![[4.0; 3]], 2), (Vec::new(), 0)];
        let triangles = vec![[0, 1, 2], [0, 0, 0], [0, 0, 0]];
        let joined = join(&pieces, triangles, Path::new("a.stl")).expect("few vertices");
        assert_eq!(joined.positions, [[1.0; 3], [2.0; 3], [3.0; 3], [4.0; 3]]);
        assert_eq!(joined.triangles, [[0, 1, 2], [3, 3, 3], [3, 3, 3]]);
    }
}
