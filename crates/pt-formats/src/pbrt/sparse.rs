//! Sparse grids of a scene. Each file is read once, and each derived grid is created once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_scene::medium::Grid;

use super::super::nanovdb::{self, SparseGrid};
use crate::shared::context::{Folder, LoadContext};

/// Name of the grid of densities.
pub(super) const DENSITY: &str = "density";
/// Name of the grid of temperatures.
pub(super) const HEAT: &str = "temperature";

/// Grids of a file.
#[derive(Clone)]
pub(super) struct GridFile {
    pub(super) density: SparseGrid,
    pub(super) heat: Option<SparseGrid>,
    /// Names of all grids of the file.
    pub(super) names: Vec<String>,
}

/// File and parameters of a derived grid.
type SparseGridKey = (PathBuf, Vec<u64>);

/// Cache of files and derived grids.
#[derive(Default)]
pub(super) struct SparseGrids {
    files: HashMap<PathBuf, Result<GridFile, String>>,
    made: HashMap<SparseGridKey, Arc<Grid>>,
}

impl SparseGrids {
    /// Returns the grids of a file. The error is a message.
    pub(super) fn file(&mut self, folder: &Folder, path: &Path) -> Result<GridFile, String> {
        if let Some(known) = self.files.get(path) {
            return known.clone();
        }
        let file = read(&folder.context, path);
        self.files.insert(path.to_owned(), file.clone());
        file
    }

    /// Returns a derived grid, with `N` numbers per cell computed from a grid with one.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub(super) fn made<const N: usize>(
        &mut self,
        folder: &Folder,
        key: SparseGridKey,
        of: &Grid,
        cell: impl Fn(f32) -> [f32; N],
    ) -> Result<Arc<Grid>, String> {
        if let Some(known) = self.made.get(&key) {
            return Ok(Arc::clone(known));
        }
        let _grant = folder.context.reserve((size_of_val(of.values.as_slice()) * N) as u64)?;
        let mut values = Vec::with_capacity(of.values.len() * N);
        values.extend(of.values.iter().flat_map(|value| cell(*value)));
        let grid = Arc::new(Grid { resolution: of.resolution, channels: N as u32, values });
        self.made.insert(key, Arc::clone(&grid));
        Ok(grid)
    }
}

fn read(context: &LoadContext, path: &Path) -> Result<GridFile, String> {
    let bytes = context.read(path)?;
    let grid = |name| {
        let ask = |bytes| context.reserve(bytes);
        nanovdb::parse(&bytes, name, ask).map_err(|why| format!("{}: {why}", path.display()))
    };
    let (density, names) = grid(DENSITY)?;
    let has_heat = names.iter().any(|name| name == HEAT);
    let heat = if has_heat { Some(grid(HEAT)?.0) } else { None };
    Ok(GridFile { density, heat, names })
}
