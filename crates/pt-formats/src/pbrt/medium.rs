//! `MakeNamedMedium` and `MediumInterface`: participating media.

use std::sync::Arc;

use pt_math::{DAffine3, DVec3};
use pt_scene::medium::{
    Cloud, Grid, GridFilter, Heterogeneous, MediumProperties, Phase, PlacedGrid, Volume,
};
use pt_scene::{Medium, Sides, Warning};

use super::color::{SpectrumType, color};
use super::entity::Entity;
use super::measured_media::MeasuredMedium;
use super::medium_emission::{
    DARK, SCALES, TEMPERATURES, blackbody_emission, color_emission, hot, temperatures,
};
use super::position::TokenPosition;
use super::sparse::{DENSITY, HEAT, SparseGrids};
use super::state::GraphicsState;
use crate::LoadError;
use crate::pbrt::media::{PbrtMedia, check_count, resolution};
use crate::pbrt::types::MediumInterface;
use crate::shared::context::Folder;
use crate::shared::names::quote;
use crate::shared::registry::Registry;

const KINDS: [&str; 5] = ["cloud", "homogeneous", "nanovdb", "rgbgrid", "uniformgrid"];

impl PbrtMedia {
    pub(super) fn new(folder: Folder) -> Self {
        Self {
            folder,
            made: Vec::new(),
            numbers: Registry::default(),
            sparse: SparseGrids::default(),
        }
    }

    /// Defines the medium of a directive.
    pub(super) fn define(
        &mut self,
        name: &str,
        entity: &Entity,
        state: &GraphicsState,
        warnings: &mut Vec<Warning>,
    ) -> Result<(), LoadError> {
        if self.numbers.find(name).is_some() {
            return Err(entity.at.error(format!("duplicate medium {}", quote(name))));
        }
        if state.ctm[0] != state.ctm[1] {
            return Err(entity
                .at
                .error("found a moving medium, expected the same transform at all times"));
        }
        let matter = match entity.kind.as_str() {
            "cloud" => self.cloud(entity, state.ctm[0])?,
            "homogeneous" => {
                let [extinction, albedo] =
                    self.coefficients(entity, [DEFAULT_ABSORBED, DEFAULT_SCATTERED])?;
                MediumProperties::Homogeneous {
                    extinction,
                    albedo,
                    emission: self.constant_emission(entity)?,
                }
            }
            "nanovdb" => self.sparse_grid(entity, state.ctm[0], warnings)?,
            "rgbgrid" => color_grid(entity, state.ctm[0])?,
            "uniformgrid" => self.grid(entity, state.ctm[0])?,
            _ => return Err(entity.unsupported(&KINDS)),
        };
        let g = mean_cosine(entity)?;
        entity.finish()?;
        let number = self.add(name, entity, matter, g);
        self.numbers.define(name.to_owned(), number);
        Ok(())
    }

    /// Adds a medium with mean cosine g and returns its index.
    pub(super) fn add(
        &mut self,
        name: &str,
        entity: &Entity,
        matter: MediumProperties,
        g: f32,
    ) -> u32 {
        let phase = if g == 0.0 { Phase::Isotropic } else { Phase::HenyeyGreenstein { g } };
        self.made.push(Medium { name: name.to_owned(), matter, phase, at: entity.at.span("") });
        self.made.len() as u32 - 1
    }

    /// Reads the extinction coefficient and the single-scattering albedo.
    fn coefficients(
        &self,
        entity: &Entity,
        defaults: [[f32; 3]; 2],
    ) -> Result<[[f32; 3]; 2], LoadError> {
        let scale = entity.not_negative("scale", 1.0)? as f32;
        if let Some(preset) = entity.text("preset")? {
            entity.pass_over(&["sigma_a", "sigma_s"]);
            let MeasuredMedium { absorbed, scattered, .. } = MeasuredMedium::named(preset)
                .map_err(|message| entity.refuse("preset", message))?;
            return extinction_and_albedo(entity, absorbed, scattered, scale);
        }
        let read = |name, default| {
            Ok(color(entity, name, SpectrumType::Unbounded, &self.folder)?.unwrap_or(default))
        };
        let (absorbed, scattered) = (read("sigma_a", defaults[0])?, read("sigma_s", defaults[1])?);
        extinction_and_albedo(entity, absorbed, scattered, scale)
    }

    /// Reads a grid of densities in a box.
    fn grid(&self, entity: &Entity, to_world: DAffine3) -> Result<MediumProperties, LoadError> {
        let [extinction, albedo] = self.coefficients(entity, [[1.0; 3]; 2])?;
        let resolution = resolution(entity)?;
        let densities = entity.floats("density")?.unwrap_or_default();
        check_count(entity, "density", "densities", resolution, densities.len())?;
        if let Some(bad) = densities.iter().find(|density| **density < 0.0) {
            return Err(entity.refuse(
                "density",
                format!("found a density of {bad}, expected numbers of at least 0"),
            ));
        }
        let to_world = to_world * unit_cube_to_box(entity, to_world)?;
        let is_grey = extinction[0] == extinction[1] && extinction[1] == extinction[2];
        let values = densities.iter().flat_map(|density| {
            let of = move |sigma: f32| (*density * f64::from(sigma)) as f32;
            extinction.into_iter().take(if is_grey { 1 } else { 3 }).map(of)
        });
        let values: Vec<_> = values.collect();
        if !values.iter().all(|value| value.is_finite()) {
            return Err(
                entity.refuse("density", "found a medium that is too dense to be represented")
            );
        }
        let emission = self.grid_emission(entity, to_world)?;
        let grid = Grid { resolution, channels: if is_grey { 1 } else { 3 }, values };
        let extinction =
            PlacedGrid { grid: Arc::new(grid), to_world, filter: GridFilter::Trilinear };
        let albedo = Volume::Constant(albedo);
        let scale = 1.0;
        Ok(MediumProperties::Heterogeneous(Box::new(Heterogeneous {
            extinction,
            scale,
            albedo,
            emission,
        })))
    }

    /// Reads a cloud of noise in a box, placed by `to_world`.
    fn cloud(&self, entity: &Entity, to_world: DAffine3) -> Result<MediumProperties, LoadError> {
        let [extinction, albedo] = self.coefficients(entity, [[1.0; 3]; 2])?;
        let number = |name, default| Ok(entity.not_negative(name, default)? as f32);
        let [low, high] = corners(entity)?;
        Ok(MediumProperties::Cloud(Box::new(Cloud {
            extinction,
            albedo,
            density: number("density", 1.0)?,
            wispiness: number("wispiness", 1.0)?,
            frequency: entity.positive("frequency", 5.0)? as f32,
            low: low.as_vec3().to_array(),
            high: high.as_vec3().to_array(),
            to_world,
        })))
    }

    /// Reads a sparse grid of densities of a file, in the coordinates of the file.
    fn sparse_grid(
        &mut self,
        entity: &Entity,
        to_world: DAffine3,
        warnings: &mut Vec<Warning>,
    ) -> Result<MediumProperties, LoadError> {
        let [extinction, albedo] = self.coefficients(entity, [[1.0; 3]; 2])?;
        let refuse = |message: String| entity.refuse("filename", message);
        let name = entity
            .text("filename")?
            .ok_or_else(|| refuse("missing filename of a grid".to_owned()))?;
        let path = self.folder.join(name);
        let file = self.sparse.file(&self.folder, &path).map_err(refuse)?;
        let emission = if let Some(heat) = &file.heat {
            let ([offset, scale], to_heat) = (temperatures(entity)?, to_world * heat.to_world);
            let kelvins = |value: f32| [hot(f64::from(value), offset, scale)];
            let key = (path.clone(), vec![offset.to_bits(), scale.to_bits()]);
            let grid = self.sparse.made(&self.folder, key, &heat.grid, kelvins).map_err(refuse)?;
            blackbody_emission(entity, grid, to_heat)?
        } else {
            entity.pass_over(&TEMPERATURES);
            entity.pass_over(&SCALES);
            DARK
        };
        let is_other = |name: &&String| *name != DENSITY && *name != HEAT;
        let others: Vec<_> = file.names.iter().filter(is_other).map(String::as_str).collect();
        if !others.is_empty() {
            let message = format!(
                "from {}, only the grids \"{DENSITY}\" and \"{HEAT}\" are read, not {}",
                quote(name),
                others.join(", ")
            );
            warnings.push(Warning { at: entity.place("filename").span(""), message });
        }
        let [red, green, blue] = extinction;
        let (grid, scale) = if red == green && green == blue {
            (Arc::clone(&file.density.grid), red)
        } else {
            let key = (path, extinction.map(|sigma| sigma.to_bits().into()).to_vec());
            let colored = |value: f32| extinction.map(|sigma| value * sigma);
            let grid = self.sparse.made(&self.folder, key, &file.density.grid, colored);
            (grid.map_err(refuse)?, 1.0)
        };
        if !grid.values.iter().all(|value| (value * scale).is_finite()) {
            return Err(
                entity.refuse("scale", "found a medium that is too dense to be represented")
            );
        }
        let to_world = to_world * file.density.to_world;
        let extinction = PlacedGrid { grid, to_world, filter: GridFilter::Trilinear };
        let albedo = Volume::Constant(albedo);
        Ok(MediumProperties::Heterogeneous(Box::new(Heterogeneous {
            extinction,
            scale,
            albedo,
            emission,
        })))
    }

    /// Returns the index of a medium; `None` for vacuum.
    pub(super) fn number(
        &self,
        name: &str,
        at: Option<&TokenPosition>,
    ) -> Result<Option<u32>, LoadError> {
        let (false, Some(at)) = (name.is_empty(), at) else { return Ok(None) };
        let undefined = |hint: &str| at.error(format!("undefined medium {}{hint}", quote(name)));
        self.numbers.get(name, undefined).copied().map(Some)
    }

    /// Returns the media on both sides of a surface; `None` if they are the same. The medium of a
    /// subsurface material, `within`, takes precedence over the interior medium.
    pub(super) fn sides(
        &self,
        interface: &MediumInterface,
        within: Option<u32>,
    ) -> Result<Option<Sides>, LoadError> {
        let at = interface.at.as_ref();
        let interior = match within {
            Some(_) => within,
            None => self.number(&interface.inside, at)?,
        };
        let exterior = self.number(&interface.outside, at)?;
        Ok((interior != exterior).then_some(Sides { interior, exterior }))
    }
}

/// Reads the minimum and maximum corners of a box.
fn corners(entity: &Entity) -> Result<[DVec3; 2], LoadError> {
    let [a, b] =
        [entity.point("p0")?.unwrap_or(DVec3::ZERO), entity.point("p1")?.unwrap_or(DVec3::ONE)];
    Ok([a.min(b), a.max(b)])
}

/// Returns the transform from the unit cube to the box of a grid, which must be invertible with
/// `to_world`.
fn unit_cube_to_box(entity: &Entity, to_world: DAffine3) -> Result<DAffine3, LoadError> {
    let [low, high] = corners(entity)?;
    let to_box = DAffine3::from_translation(low) * DAffine3::from_scale(high - low);
    let placed = to_world * to_box;
    if placed.is_finite() && placed.inverse().is_finite() {
        return Ok(to_box);
    }
    Err(entity.refuse("p1", "found a flat box of the grid, expected one with a volume"))
}

/// Reads a grid of absorption and scattering coefficients; one of the two may be missing, and is 1
/// then.
fn color_grid(entity: &Entity, to_world: DAffine3) -> Result<MediumProperties, LoadError> {
    let scale = entity.not_negative("scale", 1.0)?;
    let resolution = resolution(entity)?;
    let read = |name| {
        let Some(cells) = entity.rgbs(name)? else { return Ok(None) };
        check_count(entity, name, "colours", resolution, cells.len())?;
        if cells.as_flattened().iter().any(|sigma| *sigma < 0.0) {
            let message =
                format!("found a number below 0 in \"{name}\", expected numbers of at least 0");
            return Err(entity.refuse(name, message));
        }
        let to_rec709 = |cell| entity.color_space.to_rec709(cell);
        Ok(Some(cells.into_iter().map(to_rec709).collect::<Vec<_>>()))
    };
    let (absorbed, scattered) = (read("sigma_a")?, read("sigma_s")?);
    let Some(cells) = absorbed.as_ref().or(scattered.as_ref()).map(Vec::len) else {
        return Err(entity.at.error("found a grid without cells, expected sigma_a or sigma_s"));
    };
    let numbers = |list: Option<Vec<[f64; 3]>>| list.map_or(vec![1.0; 3 * cells], |l| l.concat());
    let pairs: Vec<_> = numbers(absorbed).into_iter().zip(numbers(scattered)).collect();
    let extinction: Vec<_> = pairs.iter().map(|(a, s)| ((a + s) * scale) as f32).collect();
    if !extinction.iter().all(|sigma| sigma.is_finite()) {
        return Err(entity.refuse("scale", "found a medium that is too dense to be represented"));
    }
    let share = |(a, s): &(f64, f64)| if *s > 0.0 { (s / (a + s)) as f32 } else { 0.0 };
    let albedo: Vec<_> = pairs.iter().map(share).collect();
    let to_world = to_world * unit_cube_to_box(entity, to_world)?;
    let emission = color_emission(entity, resolution, to_world)?;
    let [extinction, albedo] = [extinction, albedo].map(|values| PlacedGrid {
        grid: Arc::new(Grid { resolution, channels: 3, values }),
        to_world,
        filter: GridFilter::Trilinear,
    });
    let (albedo, scale) = (Volume::Grid(albedo), 1.0);
    Ok(MediumProperties::Heterogeneous(Box::new(Heterogeneous {
        extinction,
        scale,
        albedo,
        emission,
    })))
}

/// Returns the extinction coefficient and the single-scattering albedo.
pub(super) fn extinction_and_albedo(
    entity: &Entity,
    absorbed: [f32; 3],
    scattered: [f32; 3],
    scale: f32,
) -> Result<[[f32; 3]; 2], LoadError> {
    let extinction: [f32; 3] = std::array::from_fn(|c| (absorbed[c] + scattered[c]) * scale);
    if !extinction.iter().all(|sigma| sigma.is_finite()) {
        return Err(entity.refuse("scale", "found a medium that is too dense to be represented"));
    }
    let share = |c: usize| {
        let sum = absorbed[c] + scattered[c];
        if sum > 0.0 { scattered[c] / sum } else { 0.0 }
    };
    Ok([extinction, std::array::from_fn(share)])
}

/// Reads the mean cosine g of the phase function.
pub(super) fn mean_cosine(entity: &Entity) -> Result<f32, LoadError> {
    let g = entity.float("g", 0.0)? as f32;
    if -1.0 < g && g < 1.0 {
        return Ok(g);
    }
    Err(entity.refuse("g", format!("found \"g\" = {g}, expected a number above -1 and below 1")))
}

/// Default absorption and scattering coefficients of a homogeneous medium, per unit of length.
pub(super) const DEFAULT_ABSORBED: [f32; 3] = [0.0011, 0.0024, 0.014];
pub(super) const DEFAULT_SCATTERED: [f32; 3] = [2.55, 3.21, 3.77];
