//! Emission of media.

use std::sync::Arc;

use pt_math::DAffine3;
use pt_scene::medium::{BlackBody, Grid, GridFilter, MediumEmission, MediumProperties, PlacedGrid};

use super::color::{SpectrumType, color};
use super::entity::Entity;
use super::media::{PbrtMedia, check_count, resolution};
use crate::LoadError;

/// Sum of ȳ over the wavelengths in nanometres. Unlike other light, thermal emission, whose
/// radiance is 1 at its strongest wavelength, and grids of colours, whose white has this luminance,
/// are not divided by it in pbrt-v4. [CIE 1931, at each nanometre]
const EQUAL_ENERGY: f64 = 106.856_895;

impl PbrtMedia {
    /// Reads the emission of a homogeneous medium.
    pub(super) fn constant_emission(&self, entity: &Entity) -> Result<[f32; 3], LoadError> {
        let light = color(entity, "Le", SpectrumType::Light, &self.folder)?.unwrap_or_default();
        let scale = scale(entity)? as f32;
        Ok(light.map(|c| c * scale))
    }

    /// Reads the emission of a grid of densities, which has the same transform.
    pub(super) fn grid_emission(
        &self,
        entity: &Entity,
        to_world: DAffine3,
    ) -> Result<MediumEmission, LoadError> {
        let light = color(entity, "Le", SpectrumType::Light, &self.folder)?;
        let resolution = resolution(entity)?;
        let scales = list_of_scales(entity)?;
        if let Some((name, scales)) = scales.filter(|(_, scales)| scales.len() != 1) {
            check_count(entity, name, "numbers", resolution, scales.len())?;
        }
        let scales = scales.map_or([1.0].as_slice(), |(_, scales)| scales);
        let [offset, scale_of_kelvins] = temperatures(entity)?;
        let kelvins = entity.floats("temperature")?;
        if let Some(kelvins) = kelvins {
            check_count(entity, "temperature", "temperatures", resolution, kelvins.len())?;
        }
        let place = |channels, values| PlacedGrid {
            grid: Arc::new(Grid { resolution, channels, values }),
            to_world,
            filter: GridFilter::Trilinear,
        };
        match (kelvins, light) {
            (Some(_), Some(_)) => {
                let message = "found Le and temperature, expected one of the two";
                Err(entity.refuse("temperature", message))
            }
            (Some(kelvins), None) => match scales {
                [scale, others @ ..] if others.iter().all(|other| other == scale) => {
                    let scale = (scale * EQUAL_ENERGY) as f32;
                    let kelvins = kelvins.iter().map(|t| hot(*t, offset, scale_of_kelvins));
                    let temperature = place(1, kelvins.collect());
                    Ok(MediumEmission::BlackBody(BlackBody { temperature, scale }))
                }
                _ => {
                    let message = "found a Lescale that varies between cells together with \
                                   temperatures, expected the same number for all cells";
                    Err(entity.refuse("Lescale", message))
                }
            },
            (None, Some(light)) if scales.len() > 1 => {
                let of_cell = |scale: &f64| light.map(|c| (f64::from(c) * scale) as f32);
                Ok(MediumEmission::Grid(place(3, scales.iter().flat_map(of_cell).collect())))
            }
            (None, light) => {
                let scale = scales[0];
                let light = light.unwrap_or_default();
                Ok(MediumEmission::Constant(light.map(|c| (f64::from(c) * scale) as f32)))
            }
        }
    }
}

/// Reads the emission of a grid of colours.
pub(super) fn color_emission(
    entity: &Entity,
    resolution: [u32; 3],
    to_world: DAffine3,
) -> Result<MediumEmission, LoadError> {
    let scale = scale(entity)?;
    let Some(cells) = entity.rgbs("Le")? else { return Ok(DARK) };
    check_count(entity, "Le", "colours", resolution, cells.len())?;
    if cells.iter().all(|light| *light == [0.0; 3]) || scale == 0.0 {
        return Ok(DARK);
    }
    if entity.find("sigma_a").is_none() {
        let message = "missing sigma_a; a grid that emits light requires it";
        return Err(entity.refuse("Le", message));
    }
    let light =
        |cell| entity.color_space.to_rec709(cell).map(|c| (c * scale * EQUAL_ENERGY) as f32);
    let values = cells.into_iter().flat_map(light).collect();
    let grid = Arc::new(Grid { resolution, channels: 3, values });
    Ok(MediumEmission::Grid(PlacedGrid { grid, to_world, filter: GridFilter::Trilinear }))
}

/// Creates the emission of a grid of temperatures in kelvins.
pub(super) fn blackbody_emission(
    entity: &Entity,
    grid: Arc<Grid>,
    to_world: DAffine3,
) -> Result<MediumEmission, LoadError> {
    let temperature = PlacedGrid { grid, to_world, filter: GridFilter::Trilinear };
    let scale = (scale(entity)? * EQUAL_ENERGY) as f32;
    Ok(MediumEmission::BlackBody(BlackBody { temperature, scale }))
}

/// No emission.
pub(super) const DARK: MediumEmission = MediumEmission::Constant([0.0; 3]);

/// Parameters of the conversion of temperatures.
pub(super) const TEMPERATURES: [&str; 3] =
    ["temperatureoffset", "temperaturecutoff", "temperaturescale"];

/// Names of the scale of the emission; both spellings occur in files.
pub(super) const SCALES: [&str; 2] = ["Lescale", "LeScale"];

/// Reads the offset that is subtracted from temperatures, and the scale of the difference.
pub(super) fn temperatures(entity: &Entity) -> Result<[f64; 2], LoadError> {
    let [offset, cutoff, scale] = TEMPERATURES;
    let offset = entity.float(offset, entity.float(cutoff, 0.0)?)?;
    Ok([offset, entity.float(scale, 1.0)?])
}

/// Converts a temperature to kelvins, at least 0.
pub(super) fn hot(temperature: f64, offset: f64, scale: f64) -> f32 {
    ((temperature - offset) * scale).max(0.0) as f32
}

/// Reads the scale of the emission.
fn scale(entity: &Entity) -> Result<f64, LoadError> {
    let [first, second] = SCALES;
    let scale = entity.float(first, entity.float(second, 1.0)?)?;
    if scale >= 0.0 {
        return Ok(scale);
    }
    Err(entity
        .refuse(first, format!("found \"{first}\" = {scale}, expected a number of at least 0")))
}

fn list_of_scales(entity: &Entity) -> Result<Option<(&'static str, &[f64])>, LoadError> {
    for name in SCALES {
        if let Some(scales) = entity.floats(name)? {
            return Ok(Some((name, scales)));
        }
    }
    Ok(None)
}

/// Multiplies the emission of a medium by `exposure`.
pub(super) fn expose(matter: &mut MediumProperties, exposure: f32) {
    let bright = |light: &mut [f32; 3]| *light = light.map(|c| c * exposure);
    match matter {
        MediumProperties::Homogeneous { emission, .. } => bright(emission),
        MediumProperties::Cloud(_) => {}
        MediumProperties::Heterogeneous(matter) => match &mut matter.emission {
            MediumEmission::Constant(light) => bright(light),
            MediumEmission::Grid(placed) => {
                for value in &mut Arc::make_mut(&mut placed.grid).values {
                    *value *= exposure;
                }
            }
            MediumEmission::BlackBody(heat) => heat.scale *= exposure,
        },
    }
}
