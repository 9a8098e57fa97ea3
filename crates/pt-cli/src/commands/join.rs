//! `pathtracer join`: joins images of parts of an image.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail, ensure};
use pathtracer::checkpoint::in_lines;
use pathtracer::image::{self, DisplayWindow, ImageFile, Mosaic};
use pathtracer::provenance::{KEY, Provenance};
use pathtracer::{Region, cryptomatte, fingerprint};

use super::develop::provenance_of;
use crate::command_args::Join;
use crate::lock::Lock;
use crate::output::has_ending;
use crate::summary::count;
use crate::{crop, output, targets};

/// Joins images of parts of an image.
///
/// # Errors
/// If a part cannot be read or does not belong to the same image as the others, if pixels are
/// missing, or if the output cannot be written.
pub(crate) fn run(join: &Join) -> Result<ExitCode> {
    write(join)?;
    if !join.quiet {
        report!("saved {}, from {}", join.output.display(), count(join.parts.len(), "image"));
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes the joined image.
///
/// # Errors
/// As [`run`].
pub(crate) fn write(join: &Join) -> Result<()> {
    let path = &join.output;
    targets::check(path, &join.parts)?;
    join.png.check(has_ending(path, "png")).map_err(anyhow::Error::msg)?;
    let _lock = Lock::take(path)?;
    let provenances = join.parts.iter().map(|part| provenance(part)).collect::<Result<Vec<_>>>()?;
    check(&join.parts, &provenances)?;
    let mut whole = joined(join, &provenances)?;
    if !has_ending(path, "exr") {
        whole.options.channels.clear();
        whole.options.metadata = provenance_of(&whole.options.metadata);
        whole.options.png_bits = join.png.bits();
        whole.options.tone = join.png.tone_of(&whole.image);
    }
    output::save(&whole.image, path, &whole.options)
}

/// Provenance of a part, which must be a finished OpenEXR image; `None` for images of other
/// programs.
fn provenance(path: &Path) -> Result<Option<Provenance>> {
    ensure!(
        has_ending(path, "exr"),
        "{}: found another format, expected an OpenEXR image (.exr), which stores all channels \
         without rounding",
        path.display()
    );
    let found = Provenance::find(&image::metadata(path)?);
    let found = found.map_err(|message| anyhow!("{}: {message}", path.display()))?;
    ensure!(
        found.as_ref().is_none_or(|part| part.finished),
        "{}: unfinished render; continue it with pathtracer resume {}",
        path.display(),
        path.display()
    );
    Ok(found)
}

/// Returns an error if the parts are of different images.
fn check(paths: &[PathBuf], provenances: &[Option<Provenance>]) -> Result<()> {
    let first = paths[0].display();
    for (path, other) in paths.iter().zip(provenances) {
        let path = path.display();
        match (&provenances[0], other) {
            (Some(before), Some(now)) => {
                let differences = before.differences_of_wholes(now);
                ensure!(
                    differences.is_empty(),
                    "{first} and {path} are parts of different images (of {first} \"before\", of \
                     {path} \"now\"):{}",
                    in_lines(&differences)
                );
            }
            (None, None) => {}
            _ => bail!(
                "{first} and {path}: found provenance metadata in one of them only, expected parts \
                 of the same image"
            ),
        }
    }
    Ok(())
}

/// A part of an image, with the size of the whole and the position of its upper left pixel.
struct Part {
    file: ImageFile,
    whole: [u32; 2],
    position: [u32; 2],
}

/// Whole image that is joined from parts.
struct Joined {
    mosaic: Mosaic,
    size: [u32; 2],
    /// Metadata that all parts so far have, with the names of their mattes.
    metadata: Vec<(String, String)>,
}

impl Joined {
    fn new(first: &Part) -> Result<Self> {
        let mosaic = Mosaic::new(first.whole, &first.file).map_err(anyhow::Error::msg)?;
        Ok(Self { mosaic, size: first.whole, metadata: first.file.options.metadata.clone() })
    }

    fn add(&mut self, part: &Part) -> Result<()> {
        let [[width, height], [w, h]] = [part.whole, self.size];
        ensure!(
            part.whole == self.size,
            "found a part of an image of {width} x {height} pixels, expected {w} x {h} as before"
        );
        self.mosaic.add(part.position, &part.file)?;
        let texts = &part.file.options.metadata;
        cryptomatte::add_names(&mut self.metadata, texts);
        self.metadata.retain(|text| {
            let (key, _) = text;
            key == KEY || key.starts_with("cryptomatte/") || texts.contains(text)
        });
        Ok(())
    }
}

/// The whole image, with the metadata that all parts have.
fn joined(join: &Join, provenances: &[Option<Provenance>]) -> Result<ImageFile> {
    let mut joined: Option<Joined> = None;
    for (path, provenance) in join.parts.iter().zip(provenances) {
        let part = read(path, provenance.as_ref())?;
        let of_part = || format!("{}: does not fit the parts before it", path.display());
        let mut sum = match joined {
            Some(joined) => joined,
            None => Joined::new(&part).with_context(|| path.display().to_string())?,
        };
        sum.add(&part).with_context(of_part)?;
        joined = Some(sum);
    }
    let Joined { mosaic, size, metadata } =
        joined.context("found no parts, expected one at least")?;
    if let Some(gap) = mosaic.gap().filter(|_| !join.allow_gaps) {
        bail!("{}: {}", join.output.display(), missing(gap, size));
    }
    let mut file = mosaic.into_file();
    file.options.metadata = metadata;
    set_provenance(&mut file, provenances, size);
    Ok(file)
}

fn read(path: &Path, provenance: Option<&Provenance>) -> Result<Part> {
    let mut file = image::load_file(path)?;
    let (whole, position) = place(&file, provenance, path)?;
    file.frame = None;
    Ok(Part { file, whole, position })
}

/// Size of the whole and position of a part: by its provenance, or else by its windows.
fn place(
    part: &ImageFile,
    provenance: Option<&Provenance>,
    path: &Path,
) -> Result<([u32; 2], [u32; 2])> {
    let (width, height) = (part.image.width, part.image.height);
    if let Some(provenance) = provenance {
        let found = fingerprint::pixels(&provenance.settings);
        let (size, Region { x, y, .. }) = found
            .filter(|(_, region)| [region.width, region.height] == [width, height])
            .ok_or_else(|| {
                anyhow!(
                    "{}: found {width} x {height} pixels that are not those of its metadata, \
                     expected an image as it was rendered",
                    path.display()
                )
            })?;
        return Ok((size, [x, y]));
    }
    let Some(DisplayWindow { offset: [x, y], size }) = part.frame else {
        bail!(
            "{}: found no position in the whole image, expected provenance metadata, which renders \
             write except with --metadata none, or a data window",
            path.display()
        );
    };
    let position = u32::try_from(x).ok().zip(u32::try_from(y).ok());
    let (x, y) = position.with_context(|| {
        format!("{}: found a data window that begins outside of the display window", path.display())
    })?;
    Ok((size, [x, y]))
}

/// Message about a rectangle without pixels.
fn missing([x, y, width, height]: [u32; 4], size: [u32; 2]) -> String {
    let [x, y, dx, dy] = crop::rectangle(Region { x, y, width, height }, size[1]);
    format!(
        "found no part with the pixels {x} {y} {dx} {dy} (as of --crop) of the image of {} x {}, \
         expected parts of all pixels; render them with --crop {x} {y} {dx} {dy}, or leave them \
         black with --allow-gaps",
        size[0], size[1]
    )
}

/// Replaces the provenance of the first part by that of the whole.
fn set_provenance(file: &mut ImageFile, provenances: &[Option<Provenance>], size: [u32; 2]) {
    let mut parts = provenances.iter().flatten().cloned();
    let Some(first) = parts.next() else { return };
    let others: Vec<_> = parts.collect();
    let text = first.of_whole(&others, size, Region::full(size)).to_text();
    file.options.metadata.retain(|(key, _)| key != KEY);
    file.options.metadata.push((KEY.into(), text));
}
