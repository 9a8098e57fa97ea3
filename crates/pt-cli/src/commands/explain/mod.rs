//! `pathtracer explain`: the light paths of a pixel and their contributions.

mod json;
mod text;
mod words;

use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, bail, ensure};
use pathtracer::explain::{self, NameLookup};
use pathtracer::{HALF_B_OFFSET, Region, Session};

use crate::command_args::{Explain, OfPixel};
use crate::commands::render::{self, PreparedScene};
use crate::job::RenderJob;
use crate::limits::Limit;
use crate::{command_line, output};

/// Prints the explanation of a pixel, or of one of its samples.
///
/// # Errors
/// If the options are invalid, if the pixel or sample does not exist, or as a render.
pub(crate) fn run(Explain { cli, of }: Explain) -> Result<ExitCode> {
    cli.policies().records.map_err(anyhow::Error::msg)?;
    ensure!(
        cli.split == 1 && cli.path_reuse == 1,
        "explain follows paths one by one; omit --path-splitting and --path-reuse, which change \
         the noise only"
    );
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
        check_sample(number, first, session)?;
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
    let [width, height] = session.scene().camera.resolution;
    ensure!(
        x < width && y < height,
        "-x {x} -y {y}: found a pixel outside of the image of {width} x {height}, expected a \
         column from 0 to {} and a row, from the top, from 0 to {}",
        width - 1,
        height - 1
    );
    let region @ Region { x: left, y: top, .. } = session.film().region();
    ensure!(
        region.contains([x, y]),
        "-x {x} -y {y}: only columns {left} to {} and rows {top} to {}, from the top, are rendered",
        left + region.width - 1,
        top + region.height - 1
    );
    Ok([x, y])
}

fn check_sample(number: u32, first: u32, session: &Session) -> Result<()> {
    let spp = session.settings().spp;
    if session.settings().in_halves() {
        let of_half = spp.div_ceil(2);
        ensure!(
            number & !HALF_B_OFFSET < of_half,
            "--sample {number}: expected 0 to {} (first half) or {HALF_B_OFFSET} to {} (second \
             half)",
            of_half - 1,
            HALF_B_OFFSET + (of_half - 1)
        );
        return Ok(());
    }
    ensure!(
        (first..spp).contains(&number),
        "--sample {number}: expected {first} to {}; set the number of samples with -s",
        spp.saturating_sub(1)
    );
    Ok(())
}
