//! From the author's media to those that renderers read, in metres.

use pt_math::{DAffine3, Spectrum};
use pt_scene::medium::{Grid, Heterogeneous, Matter as Written, Phase, PlacedGrid, Volume};
use pt_scene::{Medium, Scene, Sides, Span};

use super::{CompileError, CompileOptions};
use crate::id::Id;
use crate::medium::{
    Albedo, Boundary, Field, GridMedium, Homogeneous, Matter, Media, MediumRecord,
};
use crate::phase::{AnyPhase, Blend, HenyeyGreenstein, Isotropic, Rayleigh};
use crate::scene::SurfaceRecord;

/// Most collisions that a ray through a grid may need on average where all of it is as dense as its
/// densest place: rays through more would take seconds.
const MOST_DEPTH: f64 = 1e5;

/// The media of a scene; the course's program knows none.
pub(super) fn compile(
    scene: &Scene,
    sides: &[(Id<SurfaceRecord>, Sides, Span)],
    metres: f64,
    options: &CompileOptions,
) -> Result<Media, CompileError> {
    let mut media = Media::default();
    if options.course || scene.media.is_empty() {
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
    let camera = options.camera.as_ref().or(scene.cameras.last());
    media.camera = id(camera.and_then(|c| c.medium), &Span::default())?;
    Ok(media)
}

/// A medium in metres.
fn record(medium: &Medium, metres: f64) -> Result<MediumRecord, CompileError> {
    let refuse = |message| CompileError::Value { at: medium.at.clone(), message };
    let matter = match &medium.matter {
        Written::Homogeneous { extinction, albedo } => {
            check_extinction(extinction).map_err(refuse)?;
            check_albedo(albedo).map_err(refuse)?;
            let extinction = extinction.map(|sigma| (f64::from(sigma) / metres) as f32);
            Matter::Homogeneous(Homogeneous {
                extinction: extinction.into(),
                albedo: (*albedo).into(),
            })
        }
        Written::Heterogeneous(heterogeneous) => {
            let Heterogeneous { extinction, scale, albedo } = &**heterogeneous;
            check_grid(extinction, &[1, 3]).map_err(refuse)?;
            check_extinction(&extinction.grid.values).map_err(refuse)?;
            check_extinction(&[*scale]).map_err(refuse)?;
            check_depth(extinction, *scale).map_err(refuse)?;
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
            Matter::Grid(Box::new(GridMedium::new(field(extinction, metres), scale, albedo)))
        }
    };
    Ok(MediumRecord { matter, phase: phase(&medium.phase).map_err(refuse)? })
}

fn phase(phase: &Phase) -> Result<AnyPhase, String> {
    Ok(match phase {
        Phase::Isotropic => Isotropic.into(),
        Phase::Rayleigh => Rayleigh.into(),
        Phase::HenyeyGreenstein { g } => henyey_greenstein(*g)?.into(),
        Phase::Blend(_) => {
            let mut parts = Vec::new();
            add_parts(phase, 1.0, &mut parts)?;
            Blend::new(&parts)?.into()
        }
    })
}

fn henyey_greenstein(g: f32) -> Result<HenyeyGreenstein, String> {
    if -1.0 < g && g < 1.0 {
        return Ok(HenyeyGreenstein { g });
    }
    Err(format!("the mean cosine g of the phase function is {g}; expected -1 < g < 1"))
}

/// The shares of which a phase function is made, and their functions as [`Blend::new`] takes them.
fn add_parts(
    phase: &Phase,
    share: f32,
    parts: &mut Vec<(f32, Option<HenyeyGreenstein>)>,
) -> Result<(), String> {
    match phase {
        Phase::Isotropic => parts.push((share, Some(HenyeyGreenstein { g: 0.0 }))),
        Phase::Rayleigh => parts.push((share, None)),
        Phase::HenyeyGreenstein { g } => parts.push((share, Some(henyey_greenstein(*g)?))),
        Phase::Blend(blend) => {
            let of_second = blend.share;
            if !(0.0..=1.0).contains(&of_second) {
                return Err(format!(
                    "the share of a phase function is {of_second}; expected 0 to 1"
                ));
            }
            add_parts(&blend.first, share * (1.0 - of_second), parts)?;
            add_parts(&blend.second, share * of_second, parts)?;
        }
    }
    Ok(())
}

fn field(placed: &PlacedGrid, metres: f64) -> Field {
    let to_world = DAffine3::from_scale([metres; 3].into()) * placed.to_world;
    Field {
        grid: placed.grid.clone(),
        corner: to_world.translation.as_vec3(),
        to_unit: to_world.matrix3.inverse().as_mat3(),
        filter: placed.filter,
    }
}

fn check_extinction(values: &[f32]) -> Result<(), String> {
    match values.iter().find(|sigma| !(**sigma >= 0.0 && sigma.is_finite())) {
        None => Ok(()),
        Some(bad) => Err(format!("the extinction is {bad}; expected finite numbers of at least 0")),
    }
}

fn check_albedo(values: &[f32]) -> Result<(), String> {
    match values.iter().find(|albedo| !(0.0..=1.0).contains(*albedo)) {
        None => Ok(()),
        Some(bad) => Err(format!("the albedo is {bad}; expected numbers from 0 to 1")),
    }
}

fn check_grid(placed: &PlacedGrid, channels: &[u32]) -> Result<(), String> {
    let Grid { resolution, channels: has, values } = &*placed.grid;
    if !channels.contains(has) {
        let known: Vec<_> = channels.iter().map(u32::to_string).collect();
        let known = known.join(" or ");
        return Err(format!("the grid has {has} numbers in each cell; expected {known}"));
    }
    let [nx, ny, nz] = *resolution;
    if placed.grid.cells() * *has as usize != values.len() || values.is_empty() {
        let count = values.len();
        return Err(format!("{count} numbers do not make a grid of {nx} x {ny} x {nz} cells"));
    }
    let is_placed = placed.to_world.is_finite() && placed.to_world.inverse().is_finite();
    is_placed.then_some(()).ok_or_else(|| "the transform of the grid cannot be undone".to_owned())
}

/// Refuses grids through which a ray would go in too many steps.
fn check_depth(placed: &PlacedGrid, scale: f32) -> Result<(), String> {
    let most = placed.grid.values.iter().fold(0.0_f32, |most, &x| most.max(x));
    let diagonal = placed.to_world.matrix3.to_cols_array().iter().map(|x| x * x).sum::<f64>();
    let depth = f64::from(most) * f64::from(scale) * diagonal.sqrt();
    if depth <= MOST_DEPTH {
        return Ok(());
    }
    Err(format!(
        "the grid is too dense to be rendered: its largest extinction times its size is {depth:.0}; \
         expected at most {MOST_DEPTH:.0}, so give a smaller scale"
    ))
}
