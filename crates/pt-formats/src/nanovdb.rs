//! Sparse grids (`.nvdb`), which are converted to dense ones. [Museth 2021, "NanoVDB: A
//! GPU-Friendly and Portable VDB Data Structure For Real-Time Rendering And Simulation"; the layout
//! is that of version 32, which the file headers contain]
//!
//! ```text
//! file  "NanoVDB0" or "NanoVDB2", version, grids, codec │ 176 bytes and the name of each grid
//!       │ each grid, raw or compressed by zlib
//! grid  672 bytes: map, type … │ tree: offsets of nodes
//!       │ root ─▶ upper nodes (32³) ─▶ lower nodes (16³) ─▶ leaves (8³ values)
//! ```
//!
//! All numbers are little-endian. Each node has a table with the offsets of its children relative
//! to the node, and with the values of constant parts.

use std::borrow::Cow;
use std::collections::HashSet;
use std::io::Read;
use std::sync::Arc;

use flate2::read::ZlibDecoder;
use pt_math::{DAffine3, DMat3, DVec3};
use pt_memory::Grant;
use pt_scene::medium::Grid;

const FILE_HEADER: usize = 16;
const METADATA: usize = 176;
const GRID: usize = 672;
/// Type of grids of 32-bit floats.
const FLOAT: u32 = 1;
/// Maximum number of bytes of a decompressed grid, and of a dense one.
const MAX_BYTES: u64 = 1 << 30;
/// Maximum number of cells of a dense grid along an axis.
const MAX_CELLS: i64 = 1 << 16;

/// A grid and its transform.
#[derive(Clone, Debug)]
pub(super) struct SparseGrid {
    /// Values of at least 0; negative ones became 0.
    pub(super) grid: Arc<Grid>,
    /// Unit cube to the world of the file.
    pub(super) to_world: DAffine3,
}

/// Reads the grid of a name, and returns the names of the others as well; `ask` grants the memory
/// of a dense grid. The error is a message, to which the caller adds the location of the reference
/// in the scene.
pub(super) fn parse(
    bytes: &[u8],
    name: &str,
    ask: impl Fn(u64) -> Result<Grant, String>,
) -> Result<(SparseGrid, Vec<String>), String> {
    let mut entries = entries(bytes)?;
    let names: Vec<String> = entries.iter().map(|entry| entry.name.clone()).collect();
    let Some(i) = names.iter().position(|n| n == name) else {
        return Err(format!("unknown grid \"{name}\"; grids of the file: {}", names.join(", ")));
    };
    let entry = entries.swap_remove(i);
    let _grant = if entry.codec == 0 { None } else { Some(pt_memory::ask(entry.size)?) };
    let grid = entry.unpacked()?;
    Ok((NanoVdbReader { bytes: &grid }.dense(ask)?, names))
}

/// An encoded grid of a file.
struct EncodedGrid<'a> {
    name: String,
    bytes: &'a [u8],
    size: u64,
    codec: u16,
}

fn entries(bytes: &[u8]) -> Result<Vec<EncodedGrid<'_>>, String> {
    const EARLY: &str = "unexpected end of the file; it may be incomplete";
    let (mut entries, mut rest) = (Vec::new(), bytes);
    while !rest.is_empty() {
        let header = rest.split_off(..FILE_HEADER).ok_or(EARLY)?;
        if !(header.starts_with(b"NanoVDB0") || header.starts_with(b"NanoVDB2")) {
            return Err(
                "found no NanoVDB file, expected one that begins with \"NanoVDB\" and 0 or 2"
                    .into(),
            );
        }
        let count = u16::from_le_bytes([header[12], header[13]]);
        let mut here = Vec::new();
        for _ in 0..count {
            let metadata = NanoVdbReader { bytes: rest.split_off(..METADATA).ok_or(EARLY)? };
            let name = rest.split_off(..metadata.u32(136)? as usize).ok_or(EARLY)?;
            let name = String::from_utf8_lossy(name).trim_end_matches('\0').to_owned();
            let packed = usize::try_from(metadata.u64(8)?).map_err(|_| EARLY)?;
            let codec = (metadata.u32(168)? & 0xffff) as u16;
            here.push((name, metadata.u64(0)?, packed, codec));
        }
        for (name, size, packed, codec) in here {
            let bytes = rest.split_off(..packed).ok_or(EARLY)?;
            entries.push(EncodedGrid { name, bytes, size, codec });
        }
    }
    Ok(entries)
}

impl EncodedGrid<'_> {
    fn unpacked(&self) -> Result<Cow<'_, [u8]>, String> {
        match self.codec {
            0 => Ok(self.bytes.into()),
            1 if self.size <= MAX_BYTES => {
                let packed = self.bytes.get(8..).ok_or("packed grid too short")?;
                let mut grid = Vec::new();
                let unpacked = ZlibDecoder::new(packed).take(self.size).read_to_end(&mut grid);
                unpacked.map_err(|error| format!("cannot unpack the grid: {error}"))?;
                Ok(grid.into())
            }
            1 => Err(format!("found a packed grid of {} bytes, expected at most 1 GiB", self.size)),
            2 => {
                Err("Blosc compression is not supported; compress the grid with ZIP or not at all"
                    .into())
            }
            other => Err(format!("found codec {other}, expected 0 (none) or 1 (ZIP)")),
        }
    }
}

/// Bytes of a grid.
#[derive(Clone, Copy)]
struct NanoVdbReader<'a> {
    bytes: &'a [u8],
}

/// Layout of nodes between the root and the leaves.
struct TreeLevel {
    /// Base-2 logarithms of the number of children along an axis, and of the cells of a child.
    children: u32,
    cells: u32,
    /// Offsets of the mask of children, and of the table.
    mask: u64,
    table: u64,
}

const UPPER: TreeLevel = TreeLevel { children: 5, cells: 7, mask: 32 + 4096, table: 8256 };
const LOWER: TreeLevel = TreeLevel { children: 4, cells: 3, mask: 32 + 512, table: 1088 };
/// Base-2 logarithm of the values of a leaf along an axis, and their offset.
const LEAF: (u32, u64) = (3, 96);

impl NanoVdbReader<'_> {
    fn array<const N: usize>(&self, at: u64) -> Result<[u8; N], String> {
        let at = usize::try_from(at).ok();
        let bytes = at.and_then(|at| self.bytes.get(at..)?.first_chunk());
        bytes.copied().ok_or_else(|| {
            "found an offset beyond the end of the grid; the file may be damaged".to_owned()
        })
    }

    fn u32(&self, at: u64) -> Result<u32, String> {
        self.array(at).map(u32::from_le_bytes)
    }

    fn u64(&self, at: u64) -> Result<u64, String> {
        self.array(at).map(u64::from_le_bytes)
    }

    fn f32(&self, at: u64) -> Result<f32, String> {
        self.array(at).map(f32::from_le_bytes)
    }

    fn vector(&self, at: u64) -> Result<DVec3, String> {
        let number = |i: u64| self.array(at + 8 * i).map(f64::from_le_bytes);
        Ok(DVec3::new(number(0)?, number(1)?, number(2)?))
    }

    fn coordinates(&self, at: u64) -> Result<[i64; 3], String> {
        let number =
            |i: u64| self.array(at + 4 * i).map(|bytes| i64::from(i32::from_le_bytes(bytes)));
        Ok([number(0)?, number(1)?, number(2)?])
    }

    /// Returns the node at an offset from another node.
    fn behind(&self, node: u64, offset: u64) -> Result<u64, String> {
        let child = node.checked_add_signed(offset.cast_signed());
        let child = child.filter(|&child| child <= self.bytes.len() as u64);
        child.ok_or_else(|| {
            "found an offset outside of the grid; the file may be damaged".to_owned()
        })
    }

    fn dense(&self, ask: impl Fn(u64) -> Result<Grant, String>) -> Result<SparseGrid, String> {
        let (version, kind) = (self.u32(16)? >> 21, self.u32(636)?);
        if !self.bytes.starts_with(b"NanoVDB") || version != 32 {
            return Err(format!("found grid version {version}, expected 32"));
        }
        if kind != FLOAT {
            return Err(format!("found numbers of type {kind}, expected 1 (32-bit float)"));
        }
        let rows = [0, 1, 2].map(|i| self.vector(384 + 24 * i));
        let [x, y, z] = rows;
        let matrix = DMat3::from_cols(x?, y?, z?).transpose();
        let to_world = DAffine3::from_mat3_translation(matrix, self.vector(528)?);
        let root = self.behind(GRID as u64, self.u64(GRID as u64 + 24)?)?;
        let mut cells =
            DenseCells::new(self.coordinates(root)?, self.coordinates(root + 12)?, ask)?;

        cells.fill(cells.least, MAX_CELLS, self.f32(root + 28)?);
        let mut seen = HashSet::new();
        for i in 0..u64::from(self.u32(root + 24)?) {
            let tile = root + 64 + 32 * i;
            let key = self.u64(tile)?;
            if !seen.insert(key) {
                return Err(
                    "found two nodes of the grid at the same location; the file may be damaged"
                        .into(),
                );
            }
            // The key contains the upper 20 bits of each coordinate.
            let origin = [42, 21, 0].map(|shift| {
                let coordinate = ((key >> shift & 0xf_ffff) as u32) << 12;
                i64::from(coordinate.cast_signed())
            });
            match self.u64(tile + 8)? {
                0 => cells.fill(origin, 1 << 12, self.f32(tile + 20)?),
                offset => self.node(self.behind(root, offset)?, &UPPER, origin, &mut cells)?,
            }
        }
        cells.finish(to_world)
    }

    /// Writes the content of a node between the root and the leaves to the dense grid.
    fn node(
        &self,
        node: u64,
        level: &TreeLevel,
        origin: [i64; 3],
        cells: &mut DenseCells,
    ) -> Result<(), String> {
        let side = 1i64 << level.cells;
        let last = (1u64 << level.children) - 1;
        for i in 0..1u64 << (3 * level.children) {
            let place = [2, 1, 0].map(|axis| (i >> (axis * level.children) & last) as i64 * side);
            let origin = [0, 1, 2].map(|axis| origin[axis] + place[axis]);
            if !cells.meets(origin, side) {
                continue;
            }
            let [mask] = self.array(node + level.mask + i / 8)?;
            let entry = node + level.table + 8 * i;
            if mask >> (i % 8) & 1 == 0 {
                cells.fill(origin, side, self.f32(entry)?);
                continue;
            }
            let child = self.behind(node, self.u64(entry)?)?;
            if level.cells == LEAF.0 {
                self.leaf(child, origin, cells)?;
            } else {
                self.node(child, &LOWER, origin, cells)?;
            }
        }
        Ok(())
    }

    fn leaf(&self, leaf: u64, origin: [i64; 3], cells: &mut DenseCells) -> Result<(), String> {
        for i in 0..512 {
            let place = [i >> 6, i >> 3 & 7, i & 7];
            let at = [0, 1, 2].map(|axis| origin[axis] + place[axis]);
            cells.set(at, self.f32(leaf + LEAF.1 + 4 * i as u64)?);
        }
        Ok(())
    }
}

/// Cells of a dense grid.
struct DenseCells {
    /// First cell along each axis, and number of cells.
    least: [i64; 3],
    count: [i64; 3],
    /// Values, with x as the innermost index.
    values: Vec<f32>,
    /// Memory of the values, which are written one by one.
    _grant: Grant,
}

impl DenseCells {
    fn new(
        least: [i64; 3],
        greatest: [i64; 3],
        ask: impl Fn(u64) -> Result<Grant, String>,
    ) -> Result<Self, String> {
        let count = [0, 1, 2].map(|axis| greatest[axis] - least[axis] + 1);
        let [x, y, z] = count;
        let all = count.iter().try_fold(4i64, |all, &n| all.checked_mul(n));
        let fits = all.is_some_and(|bytes| bytes.cast_unsigned() <= MAX_BYTES);
        if !fits || !count.iter().all(|n| (1..=MAX_CELLS).contains(n)) {
            return Err(format!(
                "found a grid of {x} x {y} x {z} cells, expected at least one cell along each axis \
                 and at most 1 GiB"
            ));
        }
        let grant = ask(4 * (x * y * z).cast_unsigned())?;
        Ok(Self { least, count, values: vec![0.0; (x * y * z) as usize], _grant: grant })
    }

    /// Returns the cells of a cube along an axis, relative to the first cell of the grid.
    fn range(&self, axis: usize, origin: [i64; 3], side: i64) -> std::ops::Range<usize> {
        let [start, end] = [0, side]
            .map(|by| (origin[axis] + by - self.least[axis]).clamp(0, self.count[axis]) as usize);
        start..end
    }

    fn meets(&self, origin: [i64; 3], side: i64) -> bool {
        (0..3).all(|axis| !self.range(axis, origin, side).is_empty())
    }

    /// Sets the value of a cell, if it is in the grid.
    fn set(&mut self, at: [i64; 3], value: f32) {
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - self.least[axis]);
        let [nx, ny, nz] = self.count;
        if (0..nx).contains(&x) && (0..ny).contains(&y) && (0..nz).contains(&z) {
            self.values[((z * ny + y) * nx + x) as usize] = value;
        }
    }

    /// Sets the value of all cells of a cube.
    fn fill(&mut self, origin: [i64; 3], side: i64, value: f32) {
        let [xs, ys, zs] = [0, 1, 2].map(|axis| self.range(axis, origin, side));
        let [nx, ny, _] = self.count.map(|n| n as usize);
        for (y, z) in zs.flat_map(|z| ys.clone().map(move |y| (y, z))) {
            let row = (z * ny + y) * nx;
            self.values[row + xs.start..row + xs.end].fill(value);
        }
    }

    /// Converts the cells to a grid. Values are at cell centres, which have integer coordinates.
    fn finish(mut self, to_world: DAffine3) -> Result<SparseGrid, String> {
        if let Some(bad) = self.values.iter().find(|value| !value.is_finite()) {
            return Err(format!("found the number {bad} in the grid, expected finite numbers"));
        }
        for value in &mut self.values {
            *value = value.max(0.0);
        }
        let [least, count] =
            [self.least, self.count].map(|v| DVec3::from_array(v.map(|x| x as f64)));
        let cells = DAffine3::from_translation(least - 0.5) * DAffine3::from_scale(count);
        let to_world = to_world * cells;
        if !(to_world.is_finite() && to_world.inverse().is_finite()) {
            return Err(
                "found a grid map without a finite inverse; the file may be damaged".to_owned()
            );
        }
        let resolution = self.count.map(|n| n as u32);
        let grid = Arc::new(Grid { resolution, channels: 1, values: self.values });
        Ok(SparseGrid { grid, to_world })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const ROOT: usize = GRID + 64;
    const UPPER_SIZE: usize = 8256 + 8 * 32_768;
    const LOWER_SIZE: usize = 1088 + 8 * 4096;
    const LEAF_SIZE: usize = 96 + 4 * 512;
    /// First and last cell.
    const BOX: [[i32; 3]; 2] = [[-5, -3, -2], [20, 140, 7]];

    fn put<const N: usize>(bytes: &mut [u8], at: usize, value: [u8; N]) {
        bytes[at..at + N].copy_from_slice(&value);
    }

    /// Returns the value of the grid of [`grid`] at a cell.
    fn value([x, y, z]: [i32; 3]) -> f32 {
        let is_in = |least: [i32; 3], side: i32| {
            [x, y, z].iter().zip(least).all(|(v, least)| (least..least + side).contains(v))
        };
        if is_in([0; 3], 8) {
            (64 * x + 8 * y + z) as f32 - 3.0
        } else if is_in([8, 0, 0], 8) {
            7.0
        } else if is_in([0, 128, 0], 128) {
            9.0
        } else if x < 0 && y >= 0 && z >= 0 {
            11.0
        } else {
            0.5
        }
    }

    /// Returns a grid with a leaf at (0, 0, 0), a constant of the lower node for the neighbour, one
    /// of the upper node beyond y = 128, one of the root where only x is below 0, and ½ elsewhere.
    /// A step of x is a step of 2 along y of the world.
    fn grid() -> Vec<u8> {
        let (upper, lower) = (ROOT + 64 + 2 * 32, ROOT + 64 + 2 * 32 + UPPER_SIZE);
        let leaf = lower + LOWER_SIZE;
        let mut bytes = vec![0; leaf + LEAF_SIZE];
        bytes[..8].copy_from_slice(b"NanoVDB0");
        put(&mut bytes, 16, (32u32 << 21 | 3 << 10).to_le_bytes());
        put(&mut bytes, 636, FLOAT.to_le_bytes());
        for (i, x) in [0.0, 0.5, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 4.0f64].into_iter().enumerate() {
            put(&mut bytes, 384 + 8 * i, x.to_le_bytes());
        }
        for (i, x) in [10.0, 20.0, 30.0f64].into_iter().enumerate() {
            put(&mut bytes, 528 + 8 * i, x.to_le_bytes());
        }
        put(&mut bytes, GRID + 24, ((ROOT - GRID) as u64).to_le_bytes());
        for (i, x) in BOX.into_iter().flatten().enumerate() {
            put(&mut bytes, ROOT + 4 * i, x.to_le_bytes());
        }
        put(&mut bytes, ROOT + 24, 2u32.to_le_bytes());
        put(&mut bytes, ROOT + 28, 0.5f32.to_le_bytes());
        // The part from −4096 along x has all of the upper 20 bits set in that coordinate.
        let tile = ROOT + 64;
        put(&mut bytes, tile, (0xf_ffffu64 << 42).to_le_bytes());
        put(&mut bytes, tile + 20, 11.0f32.to_le_bytes());
        let tile = tile + 32;
        put(&mut bytes, tile + 8, ((upper - ROOT) as u64).to_le_bytes());
        for i in 0..32_768 {
            put(&mut bytes, upper + 8256 + 8 * i, 0.5f32.to_le_bytes());
        }
        bytes[upper + 32 + 4096] = 1;
        put(&mut bytes, upper + 8256, ((lower - upper) as u64).to_le_bytes());
        put(&mut bytes, upper + 8256 + 8 * 32, 9.0f32.to_le_bytes());
        for i in 0..4096 {
            put(&mut bytes, lower + 1088 + 8 * i, 0.5f32.to_le_bytes());
        }
        bytes[lower + 32 + 512] = 1;
        put(&mut bytes, lower + 1088, ((leaf - lower) as u64).to_le_bytes());
        put(&mut bytes, lower + 1088 + 8 * 256, 7.0f32.to_le_bytes());
        for i in 0..512i32 {
            let at = [i >> 6, i >> 3 & 7, i & 7];
            put(&mut bytes, leaf + 96 + 4 * i as usize, value(at).to_le_bytes());
        }
        bytes
    }

    /// Creates a file of an empty grid and this one.
    fn file(grid: &[u8], codec: u16) -> Vec<u8> {
        let packed = if codec == 1 {
            let mut packer =
                flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            packer.write_all(grid).expect("memory");
            let packed = packer.finish().expect("memory");
            [&(packed.len() as u64).to_le_bytes(), packed.as_slice()].concat()
        } else {
            grid.to_vec()
        };
        let mut bytes = b"NanoVDB0\0\0\0\0\x02\0\0\0".to_vec();
        for (name, size, of_file) in [("heat\0", 0, 0), ("density\0", grid.len(), packed.len())] {
            let mut metadata = vec![0; METADATA];
            put(&mut metadata, 0, (size as u64).to_le_bytes());
            put(&mut metadata, 8, (of_file as u64).to_le_bytes());
            put(&mut metadata, 136, (name.len() as u32).to_le_bytes());
            put(&mut metadata, 168, codec.to_le_bytes());
            bytes.extend(metadata);
            bytes.extend(name.as_bytes());
        }
        bytes.extend(packed);
        bytes
    }

    #[test]
    fn sparse_grids_become_dense_ones() {
        for codec in [0, 1] {
            let (sparse, names) =
                parse(&file(&grid(), codec), "density", pt_memory::ask).expect("a good file");
            assert_eq!(names, ["heat", "density"]);
            let SparseGrid { grid, to_world } = sparse;
            assert_eq!((grid.resolution, grid.channels), ([26, 144, 10], 1));
            let mut values = grid.values.iter().copied();
            for z in -2..=7 {
                for y in -3..=140 {
                    for x in -5..=20 {
                        let wanted = value([x, y, z]).max(0.0);
                        assert_eq!(values.next(), Some(wanted), "{x} {y} {z}");
                    }
                }
            }
            // The centre of the cell at (−5, −3, −2).
            let middle = DVec3::new(0.5 / 26.0, 0.5 / 144.0, 0.5 / 10.0);
            let wanted = DVec3::new(10.0 - 1.5, 20.0 - 10.0, 30.0 - 8.0);
            assert!(to_world.transform_point3(middle).distance(wanted) < 1e-9);
        }
    }

    #[test]
    fn what_is_wrong_with_a_sparse_grid_is_error_of() {
        let error_of =
            |bytes: &[u8]| parse(bytes, "density", pt_memory::ask).expect_err("it is damaged");
        let changed = |at: usize, byte: u8| {
            let mut bytes = grid();
            bytes[at] = byte;
            error_of(&file(&bytes, 0))
        };
        assert!(
            parse(&file(&grid(), 0), "fog", pt_memory::ask)
                .expect_err("no grid")
                .contains("heat, density")
        );
        assert!(error_of(b"nothing of that sort").contains("no NanoVDB file"));
        assert!(error_of(&file(&grid(), 2)).contains("Blosc"));
        assert!(changed(636, 6).contains("type 6"));
        assert!(changed(19, 0).contains("version"));
        assert!(changed(ROOT + 3, 0x80).contains("cells"));
        assert!(changed(ROOT + 64 + 32 + 14, 1).contains("offset"));
        assert!(changed(GRID + 64 + 64 + 64 + 8256 + 3, 0x7f).contains("offset"));
        let whole = file(&grid(), 0);
        for length in [5, 100, 300, 2000, whole.len() - 1] {
            assert!(error_of(&whole[..length]).contains("unexpected end"), "{length}");
        }
    }

    /// Damage is more frequent where numbers describe the structure.
    #[test]
    fn damaged_sparse_grids_do_no_harm() {
        let mut random = pt_testing::Random::new(3);
        let mut below = |n: usize| ((random.unit() * n as f32) as usize).min(n - 1);
        let good = grid();
        let upper = ROOT + 64 + 64;
        let structure: Vec<usize> = (0..upper + 32)
            .chain(upper + 32 + 4096..upper + 8256 + 64)
            .chain(upper + UPPER_SIZE..upper + UPPER_SIZE + 1088 + 64)
            .collect();
        let mut read = 0;
        for round in 0..2000 {
            let mut bytes = good.clone();
            for _ in 0..=below(3) {
                let at = if round % 4 == 0 {
                    below(good.len())
                } else {
                    structure[below(structure.len())]
                };
                bytes[at] = below(256) as u8;
            }
            let codec = u16::from(round % 50 == 0);
            let mut file = file(&bytes, codec);
            if round % 5 == 0 {
                let at = below(2 * (METADATA + 20));
                file[at] ^= 1 << below(8);
            }
            read += u32::from(parse(&file, "density", pt_memory::ask).is_ok());
        }
        assert!(read > 200, "{read}");
    }
}
