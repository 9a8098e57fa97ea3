//! `<volume>`: values in space.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use pt_math::DAffine3;
use pt_scene::medium::{Grid, GridFilter, PlacedGrid};

use super::super::vol;
use super::object::{ColorRole, MitsubaObject, ObjectTree, Parameters, error, unsupported};
use crate::LoadError;
use crate::shared::names::quote;

const VOLUMES: [&str; 2] = ["constvolume", "gridvolume"];

/// Number of channels of a symmetric 3 × 3 matrix.
const MATRIX: u32 = 6;

/// Values of a `<volume>`, and their placement.
pub(super) enum VolumeField {
    /// Constant in the unit cube, with its transform.
    Constant([f32; 3], DAffine3),
    Grid(PlacedGrid),
}

/// Cache of grids of files, with the transforms to their boxes.
#[derive(Default)]
pub(super) struct Grids {
    read: HashMap<PathBuf, (Arc<Grid>, DAffine3)>,
}

impl Grids {
    /// Reads a volume.
    pub(super) fn volume(
        &mut self,
        tree: &ObjectTree,
        object: &MitsubaObject,
        role: ColorRole,
    ) -> Result<VolumeField, LoadError> {
        tree.children(object, &[])?;
        let mut parameters = Parameters::new(object);
        let to_world = parameters.transform("to_world")?;
        let field = match object.kind.as_str() {
            "constvolume" => VolumeField::Constant(parameters.color("value", role, 1.0)?, to_world),
            "gridvolume" => {
                let placed = self.grid(tree, object, &mut parameters, to_world)?;
                require(&placed, |channels| channels != MATRIX, "one or three", &parameters)?;
                VolumeField::Grid(placed)
            }
            _ => return Err(unsupported(object, &VOLUMES)),
        };
        parameters.finish()?;
        Ok(field)
    }

    /// Reads a grid of symmetric matrices.
    pub(super) fn matrices(
        &mut self,
        tree: &ObjectTree,
        object: &MitsubaObject,
    ) -> Result<PlacedGrid, LoadError> {
        tree.children(object, &[])?;
        if object.kind != "gridvolume" {
            return Err(unsupported(object, &["gridvolume"]));
        }
        let mut parameters = Parameters::new(object);
        let to_world = parameters.transform("to_world")?;
        let placed = self.grid(tree, object, &mut parameters, to_world)?;
        require(&placed, |channels| channels == MATRIX, "six", &parameters)?;
        parameters.finish()?;
        Ok(placed)
    }

    fn grid(
        &mut self,
        tree: &ObjectTree,
        object: &MitsubaObject,
        parameters: &mut Parameters<'_>,
        to_world: DAffine3,
    ) -> Result<PlacedGrid, LoadError> {
        parameters.pass_over(&["raw", "accel"]);
        let Some(text) = parameters.text("filename")? else {
            return Err(error(&object.at, "missing <string name=\"filename\">"));
        };
        let path = tree.resolve(text);
        let path = path.ok_or_else(|| parameters.refuse("filename", tree.not_found(text)))?;
        let (grid, to_box) =
            self.read(tree, path).map_err(|message| parameters.refuse("filename", message))?;
        let filter = match parameters.text("filter_type")? {
            None | Some("trilinear") => GridFilter::Trilinear,
            Some("nearest") => GridFilter::Nearest,
            Some(other) => {
                let message = format!("found {}, expected trilinear or nearest", quote(other));
                return Err(parameters.refuse("filter_type", message));
            }
        };
        if let Some(other) = parameters.text("wrap_mode")?.filter(|mode| *mode != "clamp") {
            let message = format!("unsupported wrap mode {}; supported: clamp", quote(other));
            return Err(parameters.refuse("wrap_mode", message));
        }
        let uses_box = parameters.boolean("use_grid_bbox")?;
        let to_world = if uses_box { to_world * to_box } else { to_world };
        if !to_world.inverse().is_finite() {
            let message = "found a grid file with a flat box, expected one with a volume";
            return Err(parameters.refuse("use_grid_bbox", message));
        }
        Ok(PlacedGrid { grid, to_world, filter })
    }

    /// Returns the grid of a file, which is read once, and the transform to its box.
    fn read(&mut self, tree: &ObjectTree, path: PathBuf) -> Result<(Arc<Grid>, DAffine3), String> {
        if let Some((grid, to_box)) = self.read.get(&path) {
            return Ok((Arc::clone(grid), *to_box));
        }
        let file = vol::parse(&tree.context.read(&path)?);
        let file = file.map_err(|message| format!("{}: {message}", path.display()))?;
        let read = (Arc::new(file.grid), file.to_box);
        self.read.insert(path, (Arc::clone(&read.0), read.1));
        Ok(read)
    }
}

/// Checks the number of channels of a grid.
fn require(
    placed: &PlacedGrid,
    fits: impl Fn(u32) -> bool,
    expected: &str,
    parameters: &Parameters<'_>,
) -> Result<(), LoadError> {
    let channels = placed.grid.channels;
    if fits(channels) {
        return Ok(());
    }
    let message = format!("found {channels} numbers in each cell, expected {expected}");
    Err(parameters.refuse("filename", message))
}
