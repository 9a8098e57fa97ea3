//! Provenance metadata of images, by which an image can be verified and rendered again.

use std::path::PathBuf;

use pt_core::{Film, Region};
use serde::{Deserialize, Deserializer, Serialize};

use crate::checkpoint;
use crate::film_file::{FilmHeader, hash_of_film};
use crate::fingerprint::{self, FingerprintDifference, FingerprintEntry};

/// Key of the metadata of an image whose value is the provenance as JSON.
pub const KEY: &str = "pathtracer receipt";

/// Provenance of an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Files of the scene, each with the BLAKE3 hash of its content.
    pub files: Vec<FingerprintEntry>,
    /// Files that the scene references and that could not be used, with place and reason: the image
    /// is not that of the complete scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// Settings on which the samples depend.
    pub settings: Vec<FingerprintEntry>,
    /// Number of the first sample of each pixel.
    pub first: u32,
    /// End of the range of requested sample numbers, exclusive.
    pub spp: u32,
    /// Number of samples taken, of all pixels together.
    pub samples: u64,
    /// Number of pixels.
    pub pixels: u64,
    /// True if all requested samples were taken.
    pub finished: bool,
    /// Numbers of invalid samples by cause; empty if there are none.
    pub refused: String,
    /// Result of [`Film::relative_error`]; `None` for fewer than two samples and for black images.
    pub error: Option<f64>,
    /// Error measured by an error target ([`ErrorEstimate`](crate::ErrorEstimate)): estimate, lower
    /// bound, upper bound. Infinity is written as `null`.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "with_infinity")]
    pub measured: Option<[f64; 3]>,
    /// BLAKE3 hash of the film from which the image is developed, equal for equal bits; empty for
    /// an image that was assembled from others.
    pub film: String,
    /// Statistics of the run, none of which changes a bit of the image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<RunStatistics>,
}

/// Command, machine and costs of the run that made an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunStatistics {
    /// Arguments of the program, without its name.
    pub command: Vec<String>,
    /// Folder in which the program ran.
    pub folder: PathBuf,
    /// Seal by which the user recognises the command as their own; empty if there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub seal: String,
    /// Number of samples per pixel for which the points of the sampler are generated.
    pub layout: u32,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// Number of rays.
    pub rays: u64,
    /// Number of threads of the last run; `None` if read from a film.
    pub threads: Option<usize>,
    /// Processor and system of the last run; `None` if read from a film.
    pub machine: Option<String>,
    /// Time of writing the image, in UTC; `None` if read from a film.
    pub date: Option<String>,
}

impl Provenance {
    /// Creates the provenance of the image of a film.
    pub fn new(about: &FilmHeader, film: &Film, run: Option<RunStatistics>) -> Self {
        Self {
            version: about.version.clone(),
            files: about.files.clone(),
            missing: about.missing.clone(),
            settings: about.settings.clone(),
            first: film.first(),
            spp: about.spp,
            samples: film.samples(),
            pixels: film.region().area() as u64,
            finished: about.finished,
            refused: film.invalid_samples().to_string(),
            error: film.relative_error(),
            measured: None,
            film: hash_of_film(film),
            run,
        }
    }

    /// Returns the header of a film of the same image.
    pub fn about(&self) -> FilmHeader {
        let run = self.run.as_ref();
        FilmHeader {
            version: self.version.clone(),
            files: self.files.clone(),
            missing: self.missing.clone(),
            settings: self.settings.clone(),
            spp: self.spp,
            layout: run.map_or(self.spp, |run| run.layout),
            finished: self.finished,
            command: run.map(|run| run.command.clone()).unwrap_or_default(),
            folder: run.map(|run| run.folder.clone()).unwrap_or_default(),
            seal: run.map(|run| run.seal.clone()).unwrap_or_default(),
            seconds: run.map_or(0.0, |run| run.seconds),
            rays: run.map_or(0, |run| run.rays),
            ..FilmHeader::default()
        }
    }

    /// Returns the differences between the images of which two images are parts: version, scene,
    /// settings and samples.
    pub fn differences_of_wholes(&self, other: &Self) -> Vec<FingerprintDifference> {
        let mut found = checkpoint::differences(&self.about(), &other.about());
        found.retain(|(name, ..)| name != fingerprint::PART);
        let samples = |part: &Self| Some(format!("{} to {}", part.first, part.spp));
        if samples(self) != samples(other) {
            found.push(("samples".into(), samples(self), samples(other)));
        }
        found
    }

    /// Returns the provenance of an image with the pixels of this region, assembled from an image
    /// with this provenance and others of the same whole. The hash of its film is not known, and it
    /// has no run.
    #[must_use]
    pub fn of_whole(mut self, others: &[Self], resolution: [u32; 2], region: Region) -> Self {
        self.samples += others.iter().map(|part| part.samples).sum::<u64>();
        self.pixels = region.area() as u64;
        self.finished &= others.iter().all(|part| part.finished);
        for part in others.iter().filter(|part| !part.refused.is_empty()) {
            let separator = if self.refused.is_empty() { "" } else { "; " };
            self.refused = std::mem::take(&mut self.refused) + separator + &part.refused;
        }
        for entry in fingerprint::of_pixels(resolution, region) {
            self.settings
                .iter_mut()
                .filter(|own| own.0 == entry.0)
                .for_each(|own| *own = entry.clone());
        }
        Self { error: None, measured: None, film: String::new(), run: None, ..self }
    }

    /// Mean number of samples of a pixel.
    pub fn per_pixel(&self) -> f64 {
        self.samples as f64 / self.pixels.max(1) as f64
    }

    /// Formats the provenance as the value of the key [`KEY`].
    ///
    /// # Panics
    /// Never: all fields can be written as JSON.
    pub fn to_text(&self) -> String {
        serde_json::to_string(self).expect("names, texts and numbers are JSON")
    }

    /// Parses the provenance from the metadata of an image; returns `None` if there is none.
    ///
    /// # Errors
    /// A message, if this version cannot read it.
    pub fn find(metadata: &[(String, String)]) -> Result<Option<Self>, String> {
        let text = metadata.iter().find(|(key, _)| key == KEY).map(|(_, text)| text);
        text.map(|text| serde_json::from_str(text))
            .transpose()
            .map_err(|e| format!("has provenance metadata that this version cannot read: {e}"))
    }
}

/// Reads numbers of which `null` is infinity.
fn with_infinity<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[f64; 3]>, D::Error> {
    let numbers = Option::<[Option<f64>; 3]>::deserialize(from)?;
    Ok(numbers.map(|numbers| numbers.map(|number| number.unwrap_or(f64::INFINITY))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn receipts_are_read_as_they_were_written() {
        let about = FilmHeader {
            version: "1".into(),
            files: vec![("a \"b\".xml".into(), "00ff".into())],
            missing: vec!["a \"b\".xml:3: c.png".into()],
            settings: vec![("seed".into(), "3".into())],
            spp: 7,
            ..FilmHeader::default()
        };
        let film = Film::new(Region::full([2, 3]));
        let run = RunStatistics {
            command: vec!["-s".into(), "7".into()],
            folder: "there".into(),
            seal: "00ff".into(),
            layout: 9,
            seconds: 0.1,
            rays: 5,
            threads: Some(2),
            machine: Some("Ω".into()),
            date: None,
        };
        for run in [None, Some(run)] {
            let measured = Some([0.5, 0.0, f64::INFINITY]);
            let receipt = Provenance { measured, ..Provenance::new(&about, &film, run) };
            let metadata = [("Software".into(), "x".into()), (KEY.into(), receipt.to_text())];
            assert_eq!(Provenance::find(&metadata), Ok(Some(receipt)));
            assert_eq!(Provenance::find(&metadata[..1]), Ok(None));
        }
        assert!(Provenance::find(&[(KEY.into(), "{}".into())]).is_err());
    }

    #[test]
    fn parts_of_an_image_become_a_whole() {
        let part = |y: u32, spp: u32| {
            let region = Region { x: 0, y, width: 2, height: 1 };
            let settings = fingerprint::of_pixels([2, 2], region).to_vec();
            let about = FilmHeader { settings, spp, finished: true, ..FilmHeader::default() };
            Provenance {
                samples: 2 * u64::from(spp),
                ..Provenance::new(&about, &Film::new(region), None)
            }
        };
        let (first, second) = (part(0, 3), part(1, 3));
        assert_eq!(first.differences_of_wholes(&second), []);
        let of_other = first.differences_of_wholes(&part(1, 4));
        assert_eq!(of_other, [("samples".into(), Some("0 to 3".into()), Some("0 to 4".into()))]);
        let whole = first.of_whole(&[second], [2, 2], Region::full([2, 2]));
        assert_eq!(fingerprint::pixels(&whole.settings), Some(([2, 2], Region::full([2, 2]))));
        assert_eq!((whole.samples, whole.pixels, whole.finished), (12, 4, true));
    }
}
