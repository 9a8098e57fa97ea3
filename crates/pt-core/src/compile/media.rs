//! Converts the author's media to those that renderers read, in metres.

use std::sync::Arc;

use pt_math::{DAffine3, DVec3, Spectrum};
use pt_scene::medium::{
    BlackBody, Cloud as WrittenCloud, Grid, Heterogeneous, MediumEmission as WrittenEmission,
    MediumProperties as Written, Phase, PlacedGrid, Volume,
};
use pt_scene::{Medium, Placement, Scene, Sides, Span};

use super::{CompileError, CompileOptions, camera};
use crate::id::{Id, SurfaceId};
use crate::medium::{
    Albedo, BlackbodyEmission, Boundary, Cloud, Density, Flakes, GridMedium, Homogeneous, Media,
    MediumEmission, MediumProperties, MediumRecord, Phase as PhaseRecord, WorldGrid,
};
use crate::phase::{
    AnyPhase, BlendPhase, HenyeyGreenstein, Isotropic, Microflakes, Rayleigh, TabulatedPhase,
};

/// Maximum expected number of collisions along a ray through a grid of the maximum density
/// throughout; rays through more would take seconds.
const MAX_DEPTH: f64 = 1e5;
/// Maximum of the parameters of clouds, for which their noise still has sufficient precision.
const MAX_OF_CLOUD: f32 = 1e3;
/// Maximum temperature, in kelvins.
const HOTTEST: f32 = 1e9;

/// Compiles the media of a scene.
pub(super) fn compile(
    scene: &Scene,
    sides: &[(SurfaceId, Sides, Span)],
    metres: f64,
    options: &CompileOptions,
) -> Result<Media, CompileError> {
    let mut media = Media::default();
    if !options.policies.media || scene.media.is_empty() {
        return Ok(media);
    }
    let ids: Vec<_> = scene
        .media
        .iter()
        .map(|medium| Ok(media.table.push(record(medium, metres)?)))
        .collect::<Result<_, CompileError>>()?;
    let id = |index: Option<u32>, at: &Span| match index {
        None => Ok(None),
        Some(index) => ids.get(index as usize).copied().map(Some).ok_or_else(|| {
            CompileError::Index { at: at.clone(), what: "medium", index, count: ids.len() }
        }),
    };
    for (surface, Sides { interior, exterior }, at) in sides {
        let boundary = Boundary { interior: id(*interior, at)?, exterior: id(*exterior, at)? };
        media.boundaries.resize(media.boundaries.len().max(surface.index() + 1), None);
        media.boundaries[surface.index()] = Some(boundary);
    }
    Ok(media)
}

/// Returns the medium around the camera; `None` is empty space.
///
/// # Errors
/// If the camera refers to a medium that does not exist.
pub(super) fn of_camera(
    scene: &Scene,
    media: &Media,
    options: &CompileOptions,
) -> Result<Option<Id<MediumRecord>>, CompileError> {
    let author = options.camera.as_ref().or(scene.camera());
    let stays = author.filter(|_| camera::placement(author, options) == Placement::Node);
    let Some(index) = stays.and_then(|c| c.medium).filter(|_| !media.is_empty()) else {
        return Ok(None);
    };
    let found = media.table.iter().nth(index as usize).map(|(id, _)| id);
    found.map(Some).ok_or_else(|| {
        let count = media.table.as_slice().len();
        CompileError::Index { at: Span::default(), what: "medium", index, count }
    })
}

/// Converts a medium to metres.
fn record(medium: &Medium, metres: f64) -> Result<MediumRecord, CompileError> {
    let refuse = |message| CompileError::Value { at: medium.at.clone(), message };
    let is_even = matches!(medium.matter, Written::Homogeneous { .. });
    let phase = phase_record(&medium.phase, is_even, metres).map_err(refuse)?;
    let area = phase.max_area();
    let matter = match &medium.matter {
        Written::Homogeneous { extinction, albedo, emission } => {
            check_extinction(extinction).map_err(refuse)?;
            check_albedo(albedo).map_err(refuse)?;
            check_radiance(emission).map_err(refuse)?;
            let extinction = extinction.map(|sigma| (f64::from(sigma) / metres) as f32);
            MediumProperties::Homogeneous(Homogeneous {
                extinction: extinction.into(),
                albedo: (*albedo).into(),
                emission: (*emission).into(),
            })
        }
        Written::Heterogeneous(heterogeneous) => {
            let Heterogeneous { extinction, scale, albedo, emission } = &**heterogeneous;
            check_grid(extinction, &[1, 3]).map_err(refuse)?;
            check_extinction(&extinction.grid.values).map_err(refuse)?;
            check_extinction(&[*scale]).map_err(refuse)?;
            check_depth(extinction, *scale * area).map_err(refuse)?;
            let albedo = match albedo {
                Volume::Constant(albedo) => {
                    check_albedo(albedo).map_err(refuse)?;
                    Albedo::Constant(Spectrum::from(*albedo))
                }
                Volume::Grid(placed) => {
                    check_grid(placed, &[1, 3]).map_err(refuse)?;
                    check_albedo(&placed.grid.values).map_err(refuse)?;
                    Albedo::Field(field(placed, metres))
                }
            };
            let scale = (f64::from(*scale) / metres) as f32;
            let emission = self::emission(emission, metres).map_err(refuse)?;
            let extinction = Density::Field(field(extinction, metres));
            MediumProperties::Grid(Arc::new(GridMedium::new(extinction, scale, albedo, emission)))
        }
        Written::Cloud(written) => {
            check_albedo(&written.albedo).map_err(refuse)?;
            let (cloud, scale) = cloud(written, area, metres).map_err(refuse)?;
            let albedo = Albedo::Constant(written.albedo.into());
            MediumProperties::Grid(Arc::new(GridMedium::new(
                Density::Cloud(cloud),
                scale,
                albedo,
                None,
            )))
        }
    };
    Ok(MediumRecord { matter, phase })
}

fn phase_record(of: &Phase, is_even: bool, metres: f64) -> Result<PhaseRecord, String> {
    let Phase::Microflakes { matrices } = of else { return phase(of).map(PhaseRecord::Same) };
    check_grid(matrices, &[6])?;
    let indefinite = || "found a microflake matrix that is not positive definite".to_owned();
    if let ([1, 1, 1], [entries]) = (matrices.grid.resolution, matrices.grid.values.as_chunks().0) {
        return Ok(PhaseRecord::Same(Microflakes::new(*entries).ok_or_else(indefinite)?.into()));
    }
    if is_even {
        return Err(
            "found a microflake grid of several cells in a homogeneous medium, expected a \
             heterogeneous medium"
                .to_owned(),
        );
    }
    let flakes = Flakes::new(field(matrices, metres)).ok_or_else(indefinite)?;
    Ok(PhaseRecord::Flakes(Arc::new(flakes)))
}

/// Homogeneous phase function.
fn phase(phase: &Phase) -> Result<AnyPhase, String> {
    Ok(match phase {
        Phase::Isotropic => Isotropic.into(),
        Phase::Rayleigh => Rayleigh.into(),
        Phase::HenyeyGreenstein { g } => henyey_greenstein(*g)?.into(),
        Phase::Table { values } => TabulatedPhase::new(values)?.into(),
        Phase::Microflakes { .. } => {
            return Err("microflakes cannot be blended with other particles".to_owned());
        }
        Phase::Blend(_) => {
            let mut parts = Vec::new();
            add_parts(phase, 1.0, &mut parts)?;
            BlendPhase::new(parts).into()
        }
    })
}

fn henyey_greenstein(g: f32) -> Result<HenyeyGreenstein, String> {
    if -1.0 < g && g < 1.0 {
        return Ok(HenyeyGreenstein { g });
    }
    Err(format!("found the mean cosine g = {g} of a phase function, expected -1 < g < 1"))
}

/// Adds the parts of a phase function with their weights, resolving blends.
fn add_parts(of: &Phase, share: f32, parts: &mut Vec<(f32, AnyPhase)>) -> Result<(), String> {
    let Phase::Blend(blend) = of else {
        parts.push((share, phase(of)?));
        return Ok(());
    };
    let of_second = blend.amount;
    if !(0.0..=1.0).contains(&of_second) {
        return Err(format!("found a phase function weight of {of_second}, expected 0 to 1"));
    }
    add_parts(&blend.first, share * (1.0 - of_second), parts)?;
    add_parts(&blend.second, share * of_second, parts)
}

fn field(placed: &PlacedGrid, metres: f64) -> WorldGrid {
    let to_world = DAffine3::from_scale([metres; 3].into()) * placed.to_world;
    WorldGrid {
        grid: placed.grid.clone(),
        corner: to_world.translation.as_vec3(),
        to_unit: to_world.matrix3.inverse().as_mat3(),
        filter: placed.filter,
    }
}

/// Clouds, and their maximum extinction per metre; `area` is the maximum projected area of their
/// particles.
fn cloud(written: &WrittenCloud, area: f32, metres: f64) -> Result<(Cloud, f32), String> {
    let &WrittenCloud { extinction, density, wispiness, frequency, low, high, to_world, .. } =
        written;
    check_extinction(&extinction)?;
    let is_good = |x: f32| (0.0..=MAX_OF_CLOUD).contains(&x);
    if !(is_good(density) && is_good(wispiness) && is_good(frequency) && frequency > 0.0) {
        return Err(format!(
            "found clouds of density {density}, wispiness {wispiness} and frequency {frequency}, \
             expected numbers of at least 0 and at most {MAX_OF_CLOUD}, and a frequency above 0"
        ));
    }
    let [low, high] = [low, high].map(|corner| DVec3::from_array(corner.map(f64::from)));
    let size = high - low;
    let reach = low.abs().max(high.abs()).max_element();
    if !(size.min_element() > 0.0 && reach <= f64::from(MAX_OF_CLOUD)) {
        return Err(format!(
            "found a cloud box from {low} to {high}, expected one with a volume and numbers of at \
             most {MAX_OF_CLOUD}"
        ));
    }
    let to_box = to_world * DAffine3::from_translation(low) * DAffine3::from_scale(size);
    if !(to_box.is_finite() && to_box.inverse().is_finite()) {
        return Err("found a singular transform of clouds, expected an invertible one".to_owned());
    }
    let greatest = extinction.into_iter().fold(0.0, f32::max);
    check_size(greatest * area, &to_box)?;
    let to_world = DAffine3::from_scale([metres; 3].into()) * to_box;
    let color = if greatest > 0.0 { extinction.map(|sigma| sigma / greatest) } else { [1.0; 3] };
    let cloud = Cloud {
        color: color.into(),
        density,
        wispiness,
        frequency,
        low: low.as_vec3(),
        size: size.as_vec3(),
        corner: to_world.translation.as_vec3(),
        to_unit: to_world.matrix3.inverse().as_mat3(),
    };
    Ok((cloud, (f64::from(greatest) / metres) as f32))
}

/// Emission of a heterogeneous medium; `None` without.
fn emission(written: &WrittenEmission, metres: f64) -> Result<Option<MediumEmission>, String> {
    Ok(match written {
        WrittenEmission::Constant(radiance) => {
            check_radiance(radiance)?;
            let radiance = Spectrum::from(*radiance);
            (!radiance.is_black()).then_some(MediumEmission::Constant(radiance))
        }
        WrittenEmission::Grid(placed) => {
            check_grid(placed, &[1, 3])?;
            check_radiance(&placed.grid.values)?;
            Some(MediumEmission::Field(field(placed, metres)))
        }
        WrittenEmission::BlackBody(BlackBody { temperature, scale }) => {
            check_grid(temperature, &[1])?;
            check_radiance(&[*scale])?;
            let is_good = |kelvin: &&f32| (0.0..=HOTTEST).contains(*kelvin);
            if let Some(bad) = temperature.grid.values.iter().find(|kelvin| !is_good(kelvin)) {
                return Err(format!("found a temperature of {bad} K, expected 0 to {HOTTEST} K"));
            }
            Some(MediumEmission::Heat(BlackbodyEmission::new(field(temperature, metres), *scale)))
        }
    })
}

fn check_radiance(values: &[f32]) -> Result<(), String> {
    match values.iter().find(|radiance| !(**radiance >= 0.0 && radiance.is_finite())) {
        None => Ok(()),
        Some(bad) => {
            Err(format!("found an emission of {bad}, expected finite numbers of at least 0"))
        }
    }
}

fn check_extinction(values: &[f32]) -> Result<(), String> {
    match values.iter().find(|sigma| !(**sigma >= 0.0 && sigma.is_finite())) {
        None => Ok(()),
        Some(bad) => {
            Err(format!("found an extinction of {bad}, expected finite numbers of at least 0"))
        }
    }
}

fn check_albedo(values: &[f32]) -> Result<(), String> {
    match values.iter().find(|albedo| !(0.0..=1.0).contains(*albedo)) {
        None => Ok(()),
        Some(bad) => Err(format!("found an albedo of {bad}, expected numbers from 0 to 1")),
    }
}

fn check_grid(placed: &PlacedGrid, channels: &[u32]) -> Result<(), String> {
    let Grid { resolution, channels: has, values } = &*placed.grid;
    if !channels.contains(has) {
        let known: Vec<_> = channels.iter().map(u32::to_string).collect();
        let known = known.join(" or ");
        return Err(format!("found {has} numbers in each cell of the grid, expected {known}"));
    }
    let [nx, ny, nz] = *resolution;
    if placed.grid.cells() * *has as usize != values.len() || values.is_empty() {
        let count = values.len();
        return Err(format!(
            "found {count} numbers, expected those of a grid of {nx} x {ny} x {nz} cells"
        ));
    }
    let is_placed = placed.to_world.is_finite() && placed.to_world.inverse().is_finite();
    is_placed.then_some(()).ok_or_else(|| {
        "found a singular transform of a grid, expected an invertible one".to_owned()
    })
}

/// Returns an error for grids through which a ray would take too many steps.
fn check_depth(placed: &PlacedGrid, scale: f32) -> Result<(), String> {
    let most = placed.grid.values.iter().fold(0.0_f32, |most, &x| most.max(x));
    check_size(most * scale, &placed.to_world)
}

/// Returns an error if the greatest extinction `most` times the size of the transformed unit cube
/// is too large.
fn check_size(most: f32, to_world: &DAffine3) -> Result<(), String> {
    let diagonal = to_world.matrix3.to_cols_array().iter().map(|x| x * x).sum::<f64>();
    let depth = f64::from(most) * diagonal.sqrt();
    if depth <= MAX_DEPTH {
        return Ok(());
    }
    Err(format!(
        "found a grid of optical depth {depth:.0} (maximum extinction times size), expected at \
         most {MAX_DEPTH:.0}; give a smaller scale"
    ))
}
