//! Writes the grid of a cloud that peers render, for `scenes/mitsuba/cloud.xml`, in the format of Mitsuba.
//!
//! ```text
//! cargo run -p pt-scene --example make_peer_cloud -- scenes/mitsuba/cloud.vol
//! ```

use std::path::PathBuf;

use pt_math::DVec3;

/// Cells along x, y and z.
const CELLS: [u32; 3] = [24, 16, 20];
/// Middles and radii of the balls that it is made of, in the unit cube.
const BALLS: [(DVec3, f64); 4] = [
    (DVec3::new(0.35, 0.4, 0.5), 0.3),
    (DVec3::new(0.65, 0.45, 0.4), 0.28),
    (DVec3::new(0.5, 0.7, 0.55), 0.22),
    (DVec3::new(0.75, 0.25, 0.7), 0.18),
];

fn main() -> std::io::Result<()> {
    let Some(path) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err(std::io::Error::other("give the name of the file to write"));
    };
    let mut bytes = b"VOL\x03".to_vec();
    // 32-bit floating-point numbers, one in each cell.
    for word in [1, CELLS[0], CELLS[1], CELLS[2], 1] {
        bytes.extend(word.to_le_bytes());
    }
    let unit_cube = [0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0];
    bytes.extend(unit_cube.iter().flat_map(|x| x.to_le_bytes()));
    for z in 0..CELLS[2] {
        for y in 0..CELLS[1] {
            for x in 0..CELLS[0] {
                bytes.extend((density(middle([x, y, z])) as f32).to_le_bytes());
            }
        }
    }
    std::fs::write(path, bytes)
}

/// The middle of a cell in the unit cube.
fn middle(cell: [u32; 3]) -> DVec3 {
    let [x, y, z] = [0, 1, 2].map(|i| (f64::from(cell[i]) + 0.5) / f64::from(CELLS[i]));
    DVec3::new(x, y, z)
}

/// Most in the middle of a ball, nothing outside of all, with furrows.
fn density(p: DVec3) -> f64 {
    let ball = |&(middle, radius): &(DVec3, f64)| {
        let share = p.distance_squared(middle) / (radius * radius);
        (1.0 - share).max(0.0)
    };
    let balls = BALLS.iter().map(ball).fold(0.0, f64::max);
    let furrows = libm::sin(19.0 * p.x) * libm::sin(17.0 * p.y + 1.0) * libm::sin(23.0 * p.z);
    balls * (1.0 + 0.6 * furrows)
}
