//! Media of a scene, and the sizes of their grids.

use pt_scene::Medium;

use crate::LoadError;
use crate::pbrt::entity::Entity;
use crate::pbrt::sparse::SparseGrids;
use crate::shared::context::Folder;
use crate::shared::registry::Registry;

/// Maximum number of cells of a grid along an axis.
const MAX_CELLS: u32 = 1 << 16;

/// Media of a scene.
pub(super) struct PbrtMedia {
    pub(super) folder: Folder,
    pub(super) made: Vec<Medium>,
    /// Indices of media.
    pub(super) numbers: Registry<u32>,
    pub(super) sparse: SparseGrids,
}

/// Reads the number of cells of a grid along x, y and z.
pub(super) fn resolution(entity: &Entity) -> Result<[u32; 3], LoadError> {
    let count = |name| entity.count(name, 1, [1, MAX_CELLS]);
    Ok([count("nx")?, count("ny")?, count("nz")?])
}

/// Checks that a list has one entry per cell.
pub(super) fn check_count(
    entity: &Entity,
    name: &str,
    what: &str,
    [x, y, z]: [u32; 3],
    found: usize,
) -> Result<(), LoadError> {
    let cells: u64 = [x, y, z].into_iter().map(u64::from).product();
    if cells == found as u64 {
        return Ok(());
    }
    Err(entity.refuse(name, format!("expected {x} · {y} · {z} {what}, found {found}")))
}
