//! `pathtracer rerender`: renders an image again by its provenance metadata.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail, ensure};
use pathtracer::film_file::FilmHeader;
use pathtracer::provenance::{Provenance, RunStatistics};
use pathtracer::{Observer, Outcome, image};

use super::{render, resume};
use crate::args::Cli;
use crate::command_args::Rerender;
use crate::commands::render::RenderResult;
use crate::resolve::{EarlierRun, resolve};
use crate::trust;

/// Exit status if the images differ.
const ANOTHER: u8 = 1;

/// Second render of an image.
pub(crate) struct SecondRender {
    pub(crate) result: RenderResult,
    /// Difference of the two images, or `None` if they are equal or the render was cancelled.
    pub(crate) difference: Option<String>,
    is_quiet: bool,
}

/// Renders an image again, and compares it with the first one.
///
/// # Errors
/// If the image has no such metadata, if something has changed since, or as a render.
pub(crate) fn run(rerender: &Rerender) -> Result<ExitCode> {
    let enter = |image: &Path, about: &FilmHeader, cli: &Cli| {
        trust::enter(image, about, cli).map(|()| None)
    };
    let SecondRender { result, difference, is_quiet, .. } = second(rerender, None, enter)?;
    if result.progress == Outcome::Cancelled {
        return Ok(result.status.into());
    }
    if let Some(difference) = difference {
        report!("error: {difference}");
        return Ok(ExitCode::from(ANOTHER));
    }
    if !is_quiet {
        report!("{} is the same to the bit", rerender.image.display());
    }
    Ok(result.status.into())
}

/// Renders an image again in a library, and compares it with the first one.
///
/// # Errors
/// As [`run`].
pub(crate) fn rerendered(rerender: &Rerender, observer: &dyn Observer) -> Result<SecondRender> {
    let place =
        |image: &Path, about: &FilmHeader, cli: &Cli| trust::folder(image, about, cli).map(Some);
    second(rerender, Some(observer), place)
}

/// Renders an image again. `place` returns the folder of the paths of its command; `None` is the
/// current one.
fn second(
    rerender: &Rerender,
    observer: Option<&dyn Observer>,
    place: impl FnOnce(&Path, &FilmHeader, &Cli) -> Result<Option<PathBuf>>,
) -> Result<SecondRender> {
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
    let folder = place(&first, &about, &cli)?;
    let is_quiet = cli.quiet;
    let earlier = EarlierRun {
        folder,
        layout: Some(run.layout),
        resumes: false,
        expected: Some(Box::new(receipt.clone())),
    };
    let mut job = resolve(cli, about.command, earlier).map_err(anyhow::Error::msg)?;
    // In a library, a limit of memory would be that of the whole process.
    job.memory.limit = job.memory.limit.filter(|_| observer.is_none());
    let result = render::render(job, observer)?;
    let difference = match result.progress {
        Outcome::Cancelled => None,
        Outcome::Finished => difference([&first, &again], result.provenance.film == receipt.film)?,
    };
    Ok(SecondRender { result, difference, is_quiet })
}

/// Describes the difference of an image and the second one, if there is any.
fn difference([first, again]: [&Path; 2], same_film: bool) -> Result<Option<String>> {
    if same_film && image::load_raw(first)? == image::load_raw(again)? {
        return Ok(None);
    }
    let (a, b) = (first.display(), again.display());
    Ok(Some(if same_film {
        format!(
            "{b} reproduces the samples of {a}, but not its pixels, which were changed or denoised \
             in another way"
        )
    } else {
        format!("{b} differs from {a}, although its metadata are equal")
    }))
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
