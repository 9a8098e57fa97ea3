//! Denoising by Intel Open Image Denoise 2, a library that is loaded at run time.
//!
//! `find.rs` locates the library, and `library.rs` calls it. This file prepares its inputs: the
//! image, and the albedo and normals of the first surfaces, which are prefiltered by their own
//! networks. [Open Image Denoise, documentation, "RT" filter, "Prefiltering"]

mod find;
mod library;

use std::path::PathBuf;

pub use find::VARIABLE;
use library::{Device, OidnImage};

/// Reason for which there is no denoised image.
#[derive(Debug, thiserror::Error)]
pub enum DenoiseError {
    /// The library is in none of the usual locations.
    #[error(
        "Open Image Denoise is not found; install it by\n  {}\nor set {VARIABLE} to the library or its folder{}",
        find::install_command(),
        list(.tried)
    )]
    Missing {
        /// Files that were found but could not be opened, with the reasons.
        tried: Vec<String>,
    },
    /// The program is statically linked, so that its C library opens no others.
    #[error(
        "a static program cannot open Open Image Denoise; expected a program for the GNU C library: that of the Python \
         package (pip install pathtracer-*.whl), or one built from source. Both also denoise images that are rendered \
         (pathtracer denoise IMAGE)"
    )]
    Static,
    /// The library is not at the location given by [`VARIABLE`].
    #[error(
        "{VARIABLE} is {}, where Open Image Denoise cannot be opened; expected the library, or a folder with it or with \
         the package pyoidn{}",
        .place.display(),
        list(.tried)
    )]
    NotThere {
        /// Value of [`VARIABLE`].
        place: PathBuf,
        /// Files that were found but could not be opened, with the reasons.
        tried: Vec<String>,
    },
    /// The library has an unsupported version.
    #[error(
        "{} is version {}.{} of Open Image Denoise; expected 2.0 or later",
        .path.display(),
        version / 10_000,
        version / 100 % 100
    )]
    Version {
        /// Path of the library.
        path: PathBuf,
        /// Version as 10000 · major + 100 · minor + patch.
        version: i32,
    },
    /// The library creates no device.
    #[error(
        "{} cannot compute on this processor (is the library of its CPU device beside it?): {message}",
        .path.display()
    )]
    Device {
        /// Path of the library.
        path: PathBuf,
        /// Error message of the library.
        message: String,
    },
    /// The library reports an error; this is its message.
    #[error("Open Image Denoise fails: {0}")]
    Failed(String),
    /// The number of pixels of a plane differs from that of the image.
    #[error("{what} has {found} pixels, and the image {expected}")]
    Shape {
        /// Name of the plane.
        what: &'static str,
        /// Number of pixels of the plane.
        found: usize,
        /// Number of pixels of the image.
        expected: usize,
    },
}

impl DenoiseError {
    /// Returns true if the library is missing or unsuitable, whatever the image.
    pub fn is_about_library(&self) -> bool {
        !matches!(self, Self::Failed(_) | Self::Shape { .. })
    }
}

fn list(tried: &[String]) -> String {
    tried.iter().flat_map(|line| ["\n  ", line]).collect()
}

/// Input images of the network: rows of pixels from the top.
#[derive(Clone, Copy, Debug)]
pub struct DenoiserInput<'a> {
    /// Number of pixels per row.
    pub width: u32,
    /// Noisy linear radiance, unbounded.
    pub color: &'a [[f32; 3]],
    /// Albedo of the first surface, in [0, 1], if it is known.
    pub albedo: Option<&'a [[f32; 3]]>,
    /// Normal of the first surface, in [−1, 1], if it is known; not used without albedo.
    pub normal: Option<&'a [[f32; 3]]>,
}

/// Open device of the library.
pub struct Denoiser {
    device: Device,
}

impl Denoiser {
    /// Opens the library. Searches at the location in the environment variable [`VARIABLE`], if it
    /// is set. Otherwise searches beside the program, in the data folder of the user
    /// (`pathtracer/oidn`), in the package `pyoidn` of the usual Python folders, and on the
    /// system's library path.
    ///
    /// The device computes with `threads` threads.
    ///
    /// # Errors
    /// If the program is static, or the library is not found, is too old, or creates no device.
    pub fn open(threads: usize) -> Result<Self, DenoiseError> {
        Self::open_in(&[], threads)
    }

    /// Opens the library as [`open`](Self::open) does, but searches in further folders before the
    /// usual ones.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_in(folders: &[PathBuf], threads: usize) -> Result<Self, DenoiseError> {
        let (library, path) = find::open(folders)?;
        let device = Device::new(library, threads)
            .map_err(|message| DenoiseError::Device { path: path.clone(), message })?;
        match device.version() {
            20_000.. => Ok(Self { device }),
            version => Err(DenoiseError::Version { path, version }),
        }
    }

    /// Version of the library, as in "2.5.1".
    pub fn version(&self) -> String {
        let version = self.device.version();
        format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
    }

    /// Returns the denoised image.
    ///
    /// # Errors
    /// If the planes differ in size, or the library fails.
    pub fn denoise(&self, planes: DenoiserInput<'_>) -> Result<Vec<[f32; 3]>, DenoiseError> {
        let expected = planes.color.len();
        for (what, plane) in [("albedo", planes.albedo), ("normal", planes.normal)] {
            let found = plane.map_or(expected, <[_]>::len);
            if found != expected {
                return Err(DenoiseError::Shape { what, found, expected });
            }
        }
        let width = planes.width as usize;
        if width == 0 || !expected.is_multiple_of(width) {
            return Err(DenoiseError::Shape { what: "the last row", found: 0, expected: width });
        }
        let image = |pixels: &[[f32; 3]]| OidnImage::new(width, pixels.to_vec());
        let cleaned = |name, pixels| self.device.filter(&[(name, &image(pixels))], &[]);
        let mut guides = Vec::new();
        if let Some(albedo) = planes.albedo {
            let named = [(c"albedo", Some(albedo)), (c"normal", planes.normal)];
            for (name, plane) in named {
                let plane = plane.map(|plane| cleaned(name, plane)).transpose();
                guides.extend(plane.map_err(DenoiseError::Failed)?.map(|plane| (name, plane)));
            }
        }
        let color = image(planes.color);
        let mut inputs = vec![(c"color", &color)];
        inputs.extend(guides.iter().map(|(name, plane)| (*name, plane)));
        let flags = if guides.is_empty() { &[c"hdr"][..] } else { &[c"hdr", c"cleanAux"] };
        let denoised = self.device.filter(&inputs, flags);
        denoised.map(OidnImage::into_pixels).map_err(DenoiseError::Failed)
    }
}

#[cfg(test)]
mod tests;
