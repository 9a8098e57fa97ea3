//! Receipts: what an image says about how it was made, so that anybody can check it, and make it
//! again.

use std::path::PathBuf;

use pt_core::Film;
use serde::{Deserialize, Serialize};

use crate::film_file::{FilmHeader, hash_of_film};
use crate::fingerprint::Entry;

/// The key of an image's metadata under which the receipt is, as JSON.
pub const KEY: &str = "pathtracer receipt";

/// What an image says about how it was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// The files of which the scene was read, each with the BLAKE3 hash of what it held.
    pub files: Vec<Entry>,
    /// Files that the scene names and that could not be used, where and why: the image is not the
    /// one of the whole scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// All settings on which samples depend.
    pub settings: Vec<Entry>,
    /// The number of the first sample of each pixel.
    pub first: u32,
    /// The number behind that of the last sample that was asked for.
    pub spp: u32,
    /// Samples that were taken, of all pixels together.
    pub samples: u64,
    /// Number of pixels.
    pub pixels: u64,
    /// True if these are all that were asked for.
    pub finished: bool,
    /// Samples that were refused, by cause; empty if none were.
    pub refused: String,
    /// See [`Film::relative_error`]; none below two samples, and where nothing is lit.
    pub error: Option<f64>,
    /// What an error target measured ([`ErrorEstimate`](crate::ErrorEstimate)): the best guess,
    /// hardly less, hardly more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<[f64; 3]>,
    /// BLAKE3 hash of the film, of which the image is developed: the same for the same bits.
    pub film: String,
    /// How it came about; nothing of it changes a bit of the image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<RunStatistics>,
}

/// How an image came about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunStatistics {
    /// Arguments of the program, without its name.
    pub command: Vec<String>,
    /// The folder in which it ran.
    pub folder: PathBuf,
    /// What shows its user that the command is theirs; empty if nothing does.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub seal: String,
    /// Samples of each pixel for which random numbers are laid out.
    pub layout: u32,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// Rays.
    pub rays: u64,
    /// Threads of the last run; films do not tell.
    pub threads: Option<usize>,
    /// Processor and system of the last run; likewise.
    pub machine: Option<String>,
    /// When the image was written, in UTC; likewise.
    pub date: Option<String>,
}

impl Provenance {
    /// The receipt of a film's image.
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

    /// What a film of the same image would say about itself.
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

    /// Mean number of samples of a pixel.
    pub fn per_pixel(&self) -> f64 {
        self.samples as f64 / self.pixels.max(1) as f64
    }

    /// As a value of the key [`KEY`].
    ///
    /// # Panics
    /// Never: all of it can be written as JSON.
    pub fn to_text(&self) -> String {
        serde_json::to_string(self).expect("names, texts and numbers are JSON")
    }

    /// The receipt among the metadata of an image, if there is one.
    ///
    /// # Errors
    /// A message, if it is none that this version can read.
    pub fn find(metadata: &[(String, String)]) -> Result<Option<Self>, String> {
        let text = metadata.iter().find(|(key, _)| key == KEY).map(|(_, text)| text);
        text.map(|text| serde_json::from_str(text))
            .transpose()
            .map_err(|e| format!("has a receipt that this version cannot read: {e}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pt_core::Region;

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
            let receipt = Provenance::new(&about, &film, run);
            let metadata = [("Software".into(), "x".into()), (KEY.into(), receipt.to_text())];
            assert_eq!(Provenance::find(&metadata), Ok(Some(receipt)));
            assert_eq!(Provenance::find(&metadata[..1]), Ok(None));
        }
        assert!(Provenance::find(&[(KEY.into(), "{}".into())]).is_err());
    }
}
