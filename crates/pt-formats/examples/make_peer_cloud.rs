//! Writes the grids of a cloud and of coloured smoke, for comparisons with other renderers: for
//! `cloud.xml` and `smoke.xml` in `scenes/mitsuba`, in the format of Mitsuba.
//!
//! ```text
//! cargo run -p pt-formats --example make_peer_cloud -- scenes/mitsuba
//! ```

use std::path::{Path, PathBuf};

use pt_math::DVec3;

/// Number of cells of the cloud along x, y and z.
const CLOUD: [u32; 3] = [24, 16, 20];
/// Number of cells of the smoke.
const SMOKE: [u32; 3] = [14, 12, 10];
/// Centres and radii of the balls of both, in the unit cube.
const BALLS: [(DVec3, f64); 4] = [
    (DVec3::new(0.35, 0.4, 0.5), 0.3),
    (DVec3::new(0.65, 0.45, 0.4), 0.28),
    (DVec3::new(0.5, 0.7, 0.55), 0.22),
    (DVec3::new(0.75, 0.25, 0.7), 0.18),
];

/// Extinction of the smoke in each ball.
const COLORS: [[f64; 3]; 4] = [[1.0, 0.2, 0.1], [0.1, 0.5, 1.0], [0.2, 1.0, 0.3], [0.8, 0.7, 0.0]];

fn main() -> std::io::Result<()> {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err(std::io::Error::other("give the folder to write to"));
    };
    write(&folder.join("cloud.vol"), CLOUD, |p| [density(p)])?;
    write(&folder.join("smoke.vol"), SMOKE, color)
}

/// Writes a grid of N 32-bit floats per cell.
fn write<const N: usize>(
    path: &Path,
    cells: [u32; 3],
    at: impl Fn(DVec3) -> [f64; N],
) -> std::io::Result<()> {
    let mut bytes = b"VOL\x03".to_vec();
    for word in [1, cells[0], cells[1], cells[2], N as u32] {
        bytes.extend(word.to_le_bytes());
    }
    let unit_cube = [0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0];
    bytes.extend(unit_cube.iter().flat_map(|x| x.to_le_bytes()));
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let numbers = at(middle([x, y, z], cells));
                bytes.extend(numbers.iter().flat_map(|&x| (x as f32).to_le_bytes()));
            }
        }
    }
    std::fs::write(path, bytes)
}

/// Returns the centre of a cell in the unit cube.
fn middle(cell: [u32; 3], cells: [u32; 3]) -> DVec3 {
    let [x, y, z] = [0, 1, 2].map(|i| (f64::from(cell[i]) + 0.5) / f64::from(cells[i]));
    DVec3::new(x, y, z)
}

/// Returns a value that falls from 1 at the centre of a ball to 0 at its rim, and 0 beyond.
fn within(p: DVec3, &(middle, radius): &(DVec3, f64)) -> f64 {
    (1.0 - p.distance_squared(middle) / (radius * radius)).max(0.0)
}

/// Returns a density that is highest at the centres of the balls and 0 outside of all, modulated by
/// waves.
fn density(p: DVec3) -> f64 {
    let balls = BALLS.iter().map(|ball| within(p, ball)).fold(0.0, f64::max);
    let furrows = libm::sin(19.0 * p.x) * libm::sin(17.0 * p.y + 1.0) * libm::sin(23.0 * p.z);
    balls * (1.0 + 0.6 * furrows)
}

/// Returns the sum of the colours of all balls.
fn color(p: DVec3) -> [f64; 3] {
    [0, 1, 2].map(|c: usize| {
        BALLS.iter().zip(COLORS).map(|(ball, color)| within(p, ball) * color[c]).sum()
    })
}
