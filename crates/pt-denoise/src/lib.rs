//! Denoising by Intel Open Image Denoise 2, a library that is looked for at run time.
//!
//! `find.rs` says where, `library.rs` calls it, and this file says what for: the neural network
//! sees the image and, of the first surfaces, the albedo and the normals, which are cleaned by
//! networks of their own before. [Open Image Denoise, documentation, "RT" filter, "Prefiltering"]

mod find;
mod library;

use std::path::PathBuf;

use library::{Device, Image};

pub use find::VARIABLE;

/// Why there is no denoised image.
#[derive(Debug, thiserror::Error)]
pub enum DenoiseError {
    /// The library is in none of the usual places.
    #[error(
        "Open Image Denoise is not found; install it by\n  {}\nor set {VARIABLE} to the library or its folder{}",
        find::install_command(),
        list(.tried)
    )]
    Missing {
        /// Where something was found that did not open, and why.
        tried: Vec<String>,
    },
    /// The place that [`VARIABLE`] gives is none of the library.
    #[error(
        "{VARIABLE} is {}, where Open Image Denoise cannot be opened; expected the library, or a folder with it or with \
         the package pyoidn{}",
        .place.display(),
        list(.tried)
    )]
    NotThere {
        /// The place.
        place: PathBuf,
        /// What was found there, and why it did not open.
        tried: Vec<String>,
    },
    /// It is another version.
    #[error(
        "{} is version {}.{} of Open Image Denoise; expected 2.0 or later",
        .path.display(),
        version / 10_000,
        version / 100 % 100
    )]
    Version {
        /// Where it is.
        path: PathBuf,
        /// As 10000 · major + 100 · minor + patch.
        version: i32,
    },
    /// It makes no device.
    #[error(
        "{} cannot compute on this processor (is the library of its CPU device beside it?): {message}",
        .path.display()
    )]
    Device {
        /// Where it is.
        path: PathBuf,
        /// What it says.
        message: String,
    },
    /// It fails.
    #[error("Open Image Denoise fails: {0}")]
    Failed(String),
    /// The planes have other numbers of pixels than the image.
    #[error("{what} has {found} pixels, and the image {expected}")]
    Shape {
        /// Which plane.
        what: &'static str,
        /// Its pixels.
        found: usize,
        /// Those there should be.
        expected: usize,
    },
}

fn list(tried: &[String]) -> String {
    tried.iter().flat_map(|line| ["\n  ", line]).collect()
}

/// What the network sees: rows of pixels from the top.
#[derive(Clone, Copy, Debug)]
pub struct Planes<'a> {
    /// Pixels in a row.
    pub width: u32,
    /// Linear radiance, with noise and without an end.
    pub color: &'a [[f32; 3]],
    /// Albedo of the first surface, in [0, 1].
    pub albedo: &'a [[f32; 3]],
    /// Normal of the first surface, in [−1, 1].
    pub normal: &'a [[f32; 3]],
}

/// A device of the library.
pub struct Denoiser {
    device: Device,
}

impl Denoiser {
    /// Looks for the library: at the place that the environment variable [`VARIABLE`] gives, if it
    /// is set; else beside the program, among the data of the user (`pathtracer/oidn`), in the
    /// package `pyoidn` of the usual places of Python, and where the system has its libraries.
    ///
    /// It will compute on so many threads.
    ///
    /// # Errors
    /// If it is not found, too old, or makes no device.
    pub fn open(threads: usize) -> Result<Self, DenoiseError> {
        let (library, path) = find::open()?;
        let device = Device::new(library, threads)
            .map_err(|message| DenoiseError::Device { path: path.clone(), message })?;
        match device.version() {
            20_000.. => Ok(Self { device }),
            version => Err(DenoiseError::Version { path, version }),
        }
    }

    /// The version of the library, as in "2.5.1".
    pub fn version(&self) -> String {
        let version = self.device.version();
        format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
    }

    /// The image without its noise.
    ///
    /// # Errors
    /// If the planes are not of one size, or the library fails.
    pub fn denoise(&self, planes: Planes<'_>) -> Result<Vec<[f32; 3]>, DenoiseError> {
        let expected = planes.color.len();
        for (what, plane) in [("albedo", planes.albedo), ("normal", planes.normal)] {
            if plane.len() != expected {
                return Err(DenoiseError::Shape { what, found: plane.len(), expected });
            }
        }
        let width = planes.width as usize;
        if width == 0 || !expected.is_multiple_of(width) {
            return Err(DenoiseError::Shape { what: "the last row", found: 0, expected: width });
        }
        let image = |pixels: &[[f32; 3]]| Image::new(width, pixels.to_vec());
        let cleaned = |name, pixels| self.device.filter(&[(name, &image(pixels))], &[]);
        let albedo = cleaned(c"albedo", planes.albedo).map_err(DenoiseError::Failed)?;
        let normal = cleaned(c"normal", planes.normal).map_err(DenoiseError::Failed)?;
        let color = image(planes.color);
        let inputs = [(c"color", &color), (c"albedo", &albedo), (c"normal", &normal)];
        let denoised = self.device.filter(&inputs, &[c"hdr", c"cleanAux"]);
        denoised.map(Image::into_pixels).map_err(DenoiseError::Failed)
    }
}

#[cfg(test)]
mod tests;
