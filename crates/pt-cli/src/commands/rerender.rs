//! `pathtracer rerender`: renders an image again by its provenance metadata.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail, ensure};
use pathtracer::provenance::{Provenance, RunStatistics};
use pathtracer::{Outcome, image};

use super::{render, resume};
use crate::command_args::Rerender;
use crate::commands::render::RenderResult;
use crate::resolve::{EarlierRun, resolve};
use crate::trust;

/// Exit status if the images differ.
const ANOTHER: u8 = 1;

/// Renders an image again, and compares it with the first one.
///
/// # Errors
/// If the image has no such metadata, if something has changed since, or as a render.
pub(crate) fn run(rerender: &Rerender) -> Result<ExitCode> {
    let first = std::path::absolute(&rerender.image)
        .with_context(|| format!("{}", rerender.image.display()))?;
    let (receipt, run) = receipt_of(&rerender.image)?;
    let again = match &rerender.output {
        Some(path) => path.clone(),
        None => beside(&rerender.image),
    };
    ensure!(
        again.extension() == first.extension(),
        "-f {}: found another extension, expected that of {}",
        again.display(),
        rerender.image.display()
    );
    let again = std::path::absolute(&again).with_context(|| format!("{}", again.display()))?;
    ensure!(
        again != first,
        "-f {}: found the image itself, expected another name",
        again.display()
    );
    ensure!(
        rerender.force || again.symlink_metadata().is_err(),
        "{}: exists already; choose another name (-f), or --force to overwrite it",
        again.display()
    );
    let about = receipt.about();
    let mut cli = resume::stored_options(&rerender.image, &about)?;
    cli.output = Some(Some(again.clone()));
    cli.samples = None;
    *(if cli.stop.has_target() { &mut cli.stop.max_spp } else { &mut cli.spp }) = Some(receipt.spp);
    cli.stop.time_limit = None;
    cli.threads = rerender.threads.or(cli.threads);
    cli.quiet |= rerender.quiet;
    cli.restart = true;
    trust::distrust(&rerender.image, &mut cli, &rerender.folders);
    trust::enter(&first, &about, &cli)?;
    let is_quiet = cli.quiet;
    let earlier = EarlierRun {
        layout: Some(run.layout),
        resumes: false,
        expected: Some(Box::new(receipt.clone())),
    };
    let job = resolve(cli, about.command, earlier).map_err(anyhow::Error::msg)?;
    let RenderResult { status, progress, provenance: second } = render::render(job)?;
    if progress == Outcome::Cancelled {
        return Ok(status);
    }
    let pixels = |path: &Path| image::load_raw(path);
    let (before, now) = (pixels(&first)?, pixels(&again)?);
    let same_film = second.is_some_and(|second| second.film == receipt.film);
    if same_film && before == now {
        if !is_quiet {
            report!("{} is the same to the bit", rerender.image.display());
        }
        return Ok(status);
    }
    let (a, b) = (first.display(), again.display());
    if same_film {
        report!(
            "error: {b} reproduces the samples of {a}, but not its pixels, which were changed or \
             denoised in another way"
        );
    } else {
        report!("error: {b} differs from {a}, although its metadata are equal");
    }
    Ok(ExitCode::from(ANOTHER))
}

/// Reads the provenance of an image, with the statistics of its run.
fn receipt_of(path: &Path) -> Result<(Provenance, RunStatistics)> {
    let shown = path.display();
    let found = Provenance::find(&image::metadata(path)?)
        .map_err(|message| anyhow!("{shown}: {message}"))?;
    let Some(receipt) = found else {
        bail!(
            "{shown}: missing provenance metadata, which images of pathtracer have except with \
             --metadata none"
        );
    };
    ensure!(
        !receipt.film.is_empty(),
        "{shown}: found an image that was joined from parts, expected that of one render; render \
         its parts again"
    );
    let Some(run) = receipt.run.clone() else {
        bail!("{shown}: missing command in the provenance metadata, which --metadata full writes");
    };
    ensure!(
        receipt.finished && receipt.first == 0,
        "{shown}: unfinished render; continue it with pathtracer resume {shown}"
    );
    Ok((receipt, run))
}

/// Default path of the second image.
fn beside(image: &Path) -> PathBuf {
    let mut name = image.file_stem().unwrap_or_default().to_owned();
    name.push("_again");
    let name = Path::new(&name).with_extension(image.extension().unwrap_or_default());
    image.with_file_name(name)
}
