//! Provenance metadata of images.

use std::path::Path;

use pathtracer::Session;
use pathtracer::film_file::FilmHeader;
use pathtracer::provenance::{KEY, Provenance, RunStatistics};

use crate::arg_values::ReceiptKind;
use crate::film_header::run_of;
use crate::{origin, seal};

/// Provenance of the image of a session, which `threads` threads have rendered.
pub fn provenance(about: &FilmHeader, session: &Session, threads: usize) -> Provenance {
    let run = run_of(about, Some(threads));
    let measured = session.look().map(|look| look.measured.to_array());
    Provenance { measured, ..Provenance::new(about, session.film(), Some(run)) }
}

/// Provenance of the denoised image in place of the noisy one.
pub fn denoised(mut noisy: Provenance) -> Provenance {
    if let Some(run) = &mut noisy.run {
        run.command.insert(0, "--denoise".to_owned());
    }
    noisy
}

/// Provenance of an image in memory that is written to a file by these further arguments.
pub(crate) fn of_file(provenance: &Provenance, file: &Path, arguments: &[String]) -> Provenance {
    let run = provenance.run.clone().map(|mut run| {
        run.command.extend_from_slice(arguments);
        run.command
            .extend(["-f".to_owned(), origin::argument(file).to_string_lossy().into_owned()]);
        RunStatistics { seal: seal::of(file, &run.folder, &run.command), ..run }
    });
    Provenance { run, ..provenance.clone() }
}

/// Metadata of an image file: the software, and the provenance as far as it is requested.
pub(crate) fn metadata(kind: ReceiptKind, provenance: &Provenance) -> Vec<(String, String)> {
    let text = match kind {
        ReceiptKind::Full => Some(provenance.to_text()),
        ReceiptKind::Stable => Some(Provenance { run: None, ..provenance.clone() }.to_text()),
        ReceiptKind::None => None,
    };
    let provenance = text.map(|text| (KEY.to_owned(), text));
    std::iter::once(software()).chain(provenance).collect()
}

/// Metadata with the name and version of the program.
pub(crate) fn software() -> (String, String) {
    ("Software".to_owned(), concat!("pathtracer ", env!("CARGO_PKG_VERSION")).to_owned())
}
