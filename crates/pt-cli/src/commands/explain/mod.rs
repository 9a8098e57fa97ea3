//! `pathtracer explain`: the light paths of a pixel and their contributions.

mod json;
mod rows;
mod text;
mod words;

use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, anyhow, bail, ensure};
use pathtracer::explain::{self, NameLookup};
use pathtracer::{HALF_B_OFFSET, Region, Scene, Session, Settings};
use serde_json::Value;

use crate::command_args::{Explain, OfPixel};
use crate::commands::render::{self, PreparedScene};
use crate::job::RenderJob;
use crate::keywords::in_keywords;
use crate::limits::Limit;
use crate::{command_line, output};

/// Message about settings with which samples are not sums of single paths.
const ONE_BY_ONE: &str = "explain follows paths one by one; omit --path-splitting and --path-reuse, \
                          which change the noise only";

/// Prints the explanation of a pixel, or of one of its samples.
///
/// # Errors
/// If the options are invalid, if the pixel or sample does not exist, or as a render.
pub(crate) fn run(Explain { cli, of }: Explain) -> Result<ExitCode> {
    cli.policies().records.map_err(anyhow::Error::msg)?;
    ensure!(cli.split == 1 && cli.path_reuse == 1, ONE_BY_ONE);
    ensure!(
        !cli.man && cli.completions.is_none(),
        "--man and --completions are not supported by explain; use them without a command"
    );
    let job = command_line::resolved(cli, Vec::new()).map_err(anyhow::Error::msg)?;
    let RenderJob { mode, input, compile, memory, schedule, .. } = job;
    let prepared = render::prepare(&input, compile, &Limit::new(memory), mode, Instant::now())?;
    let PreparedScene { scene, session, .. } = &prepared;
    let pixel = pixel(&of, session)?;
    let first = schedule.first;
    render::warn_missing(&scene.missing);
    prepared.report_notes(mode);
    if session.settings().in_halves() && of.sample.is_none() && !mode.quiet {
        report!(
            "note: these samples are the first half; the second half begins with sample \
             {HALF_B_OFFSET}"
        );
    }
    let names = NameLookup::new(scene, session.scene());
    let text = if let Some(number) = of.sample {
        check_sample(number, first, session)
            .map_err(|message| anyhow!("--sample {number}: {message}"))?;
        match explain::explain_sample(session, pixel, number)? {
            Some(sample) if of.json => json::sample(names, pixel, &sample),
            Some(sample) => text::sample(names, pixel, &sample),
            None => bail!("sample {number} cannot be taken"),
        }
    } else {
        let explanation = explain::explain(session, pixel, first, of.top as usize)?;
        if of.json {
            json::explanation(names, session, &explanation)
        } else {
            text::explanation(names, session, &explanation)
        }
    };
    output::print(&text)
}

/// Returns the coordinates of the pixel, or an error if it is not rendered.
fn pixel(of: &OfPixel, session: &Session) -> Result<[u32; 2]> {
    let &OfPixel { column: x, row: y, .. } = of;
    check_pixel([x, y], session).map_err(|message| anyhow!("-x {x} -y {y}: {message}"))?;
    Ok([x, y])
}

/// Returns an error if a pixel is not rendered.
fn check_pixel([x, y]: [u32; 2], session: &Session) -> Result<(), String> {
    let [width, height] = session.scene().camera.resolution;
    if x >= width || y >= height {
        return Err(format!(
            "found a pixel outside of the image of {width} x {height}, expected a column from 0 to \
             {} and a row, from the top, from 0 to {}",
            width - 1,
            height - 1
        ));
    }
    let region @ Region { x: left, y: top, .. } = session.film().region();
    if region.contains([x, y]) {
        return Ok(());
    }
    Err(format!(
        "only columns {left} to {} and rows {top} to {}, from the top, are rendered",
        left + region.width - 1,
        top + region.height - 1
    ))
}

/// Returns an error if a sample is not taken.
fn check_sample(number: u32, first: u32, session: &Session) -> Result<(), String> {
    let spp = session.settings().spp;
    if session.settings().in_halves() {
        let of_half = spp.div_ceil(2);
        if number & !HALF_B_OFFSET < of_half {
            return Ok(());
        }
        return Err(format!(
            "expected 0 to {} (first half) or {HALF_B_OFFSET} to {} (second half)",
            of_half - 1,
            HALF_B_OFFSET + (of_half - 1)
        ));
    }
    if (first..spp).contains(&number) {
        return Ok(());
    }
    Err(format!("expected {first} to {}; set the number of samples with -s", spp.saturating_sub(1)))
}

/// Pixel of a scene in memory that is explained.
#[derive(Clone, Copy, Debug)]
pub struct PixelRequest {
    /// Column from the left and row from the top, from 0.
    pub pixel: [u32; 2],
    /// Number of a sample; `None` for all of them.
    pub sample: Option<u32>,
    /// Maximum number of paths of all samples.
    pub top: usize,
}

/// Table of the light paths of a pixel in descending order of luminance, or of all contributions of
/// one of its samples: JSON objects with the fields of the program's explanation. If `proceed`
/// returns false, the remaining samples are missing.
///
/// # Errors
/// A message if the pixel or the sample is not rendered, or the settings do not follow single
/// paths.
pub fn explain(
    scene: &Scene,
    session: &Session,
    of: PixelRequest,
    proceed: impl Fn() -> bool,
) -> Result<Value, String> {
    let rows = table(scene, session, of, proceed);
    rows.map(Value::Array).map_err(|error| in_keywords(&error.to_string()))
}

fn table(
    scene: &Scene,
    session: &Session,
    of: PixelRequest,
    proceed: impl Fn() -> bool,
) -> Result<Vec<Value>> {
    let PixelRequest { pixel, sample, top } = of;
    let Settings { split, reuse, .. } = session.settings();
    ensure!(*split == 1 && *reuse == 1, ONE_BY_ONE);
    let [x, y] = pixel;
    check_pixel(pixel, session).map_err(|message| anyhow!("x {x}, y {y}: {message}"))?;
    let names = NameLookup::new(scene, session.scene());
    let Some(number) = sample else {
        let explanation = explain::explain_while(session, pixel, 0, top, proceed)?;
        return Ok(rows::explanation(names, session, &explanation));
    };
    check_sample(number, 0, session).map_err(|message| anyhow!("sample {number}: {message}"))?;
    match explain::explain_sample(session, pixel, number)? {
        Some(sample) => Ok(rows::sample(names, &sample)),
        None => bail!("sample {number} cannot be taken"),
    }
}
