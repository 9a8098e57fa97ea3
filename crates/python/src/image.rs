//! Rendered images, as arrays.

use std::path::{Path, PathBuf};

use numpy::{Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pathtracer::cryptomatte::{self, MatteNames};
use pathtracer::image::{self, Channel, ImageError, Samples, SaveOptions};
use pathtracer::provenance::Provenance;
use pathtracer::{Film, Region, aov, groups};
use pt_cli::{Purpose, SaveRequest};
use pyo3::exceptions::{PyKeyError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyIterator, PyList};

use crate::denoise::{self, Guides};
use crate::pose::Pose;
use crate::settings::words;

/// Image of a render, before its samples become arrays.
pub(crate) struct Rendered {
    color: image::Image,
    alpha: Option<Vec<f32>>,
    channels: Vec<Channel>,
    metadata: Vec<(String, String)>,
    notes: Vec<String>,
    receipt: Provenance,
    guides: Option<Guides>,
    pose: Option<Pose>,
}

impl Rendered {
    pub(crate) fn new(
        film: &Film,
        names: &MatteNames,
        notes: &[String],
        receipt: Provenance,
    ) -> Self {
        let Region { width, height, .. } = film.region();
        let mattes = cryptomatte::channels(film, names);
        let channels = aov::channels(film).into_iter().chain(mattes);
        Self {
            color: image::Image { width, height, pixels: pathtracer::radiance(film).into() },
            alpha: film.alpha(),
            channels: channels.chain(groups::channels(film)).collect(),
            metadata: cryptomatte::metadata(film, names),
            notes: notes.to_vec(),
            receipt,
            guides: Guides::of_film(film),
            pose: None,
        }
    }

    pub(crate) fn with_pose(self, pose: Option<Pose>) -> Self {
        Self { pose, ..self }
    }

    /// Returns true if all samples were taken.
    pub(crate) fn is_complete(&self) -> bool {
        self.receipt.finished
    }
}

/// A rendered image: a mapping from names to NumPy arrays whose first row is the top one.
///
/// `image["color"]` is the mean radiance, linear Rec. 709, of shape (height, width, 3) and type
/// float32; premultiplied by `image["alpha"]`, of shape (height, width), if there is one. Further
/// quantities have shape (height, width) or (height, width, channels). The arrays may be changed;
/// files are written with what they contain.
#[pyclass(frozen, mapping, module = "pathtracer")]
pub(crate) struct Image {
    /// int: Width in pixels.
    #[pyo3(get)]
    width: u32,
    /// int: Height in pixels.
    #[pyo3(get)]
    height: u32,
    /// list of str: Notes about the scene, as about features that the integrator ignores.
    #[pyo3(get)]
    notes: Vec<String>,
    /// bool: False if the render stopped before all samples were taken.
    #[pyo3(get)]
    complete: bool,
    /// int: Number of samples taken.
    #[pyo3(get)]
    samples: u64,
    /// int: Number of rays traced.
    #[pyo3(get)]
    rays: u64,
    /// float: Seconds of rendering, without reading and compiling the scene.
    #[pyo3(get)]
    seconds: f64,
    arrays: Py<PyDict>,
    /// Channels of files besides colours and alpha, in order.
    channels: Vec<FileChannel>,
    /// Metadata of files besides the receipt.
    metadata: Vec<(String, String)>,
    receipt: Provenance,
    guides: Option<Guides>,
    /// Version of the library that has denoised the image.
    denoiser: Option<String>,
    pose: Option<Pose>,
}

/// Channel of a file.
#[derive(Clone)]
struct FileChannel {
    name: String,
    /// Name of its array.
    array: String,
    half_suffices: bool,
}

/// Name of the array of colours.
const COLOR: &str = "color";
/// Name of the array of noisy colours of a denoised image.
const NOISY: &str = "noisy";
/// Name of the array of alpha.
const ALPHA: &str = "alpha";

impl Image {
    pub(crate) fn new(py: Python<'_>, rendered: Rendered) -> PyResult<Self> {
        let Rendered { color, alpha, channels, metadata, notes, receipt, guides, pose } = rendered;
        let size = [color.height as usize, color.width as usize];
        let arrays = PyDict::new(py);
        arrays.set_item(COLOR, shaped(py, color.pixels.into_vec().into_flattened(), size, 3)?)?;
        if let Some(alpha) = alpha {
            arrays.set_item(ALPHA, shaped(py, alpha, size, 1)?)?;
        }
        let array_of =
            |name: &str| name.rsplit_once('.').map_or(name, |(array, _)| array).to_owned();
        let of_files = channels.iter().map(|channel| FileChannel {
            name: channel.name.clone(),
            array: array_of(&channel.name),
            half_suffices: channel.half_suffices,
        });
        let of_files: Vec<_> = of_files.collect();
        let mut channels = channels.into_iter().map(|channel| channel.samples);
        for group in of_files.chunk_by(|a, b| a.array == b.array) {
            let samples = channels.by_ref().take(group.len()).collect();
            arrays.set_item(&group[0].array, array(py, samples, size)?)?;
        }
        Ok(Self {
            width: color.width,
            height: color.height,
            notes,
            complete: receipt.finished,
            samples: receipt.samples,
            rays: receipt.run.as_ref().map_or(0, |run| run.rays),
            seconds: receipt.run.as_ref().map_or(0.0, |run| run.seconds),
            arrays: arrays.unbind(),
            channels: of_files,
            metadata,
            receipt,
            guides,
            denoiser: None,
            pose,
        })
    }

    /// The colours with their alpha and channels, as files contain them.
    fn contents(&self, py: Python<'_>) -> PyResult<(image::Image, SaveOptions)> {
        let (width, height) = (self.width, self.height);
        let pixels = self.values::<f32>(py, COLOR)?;
        let pixels = pixels.as_chunks().0.to_vec();
        let has_alpha = self.arrays.bind(py).contains(ALPHA)?;
        let alpha = has_alpha.then(|| self.values(py, ALPHA)).transpose()?;
        let mut channels = Vec::new();
        for group in self.channels.chunk_by(|a, b| a.array == b.array) {
            let samples = self.samples(py, &group[0].array, group.len())?;
            channels.extend(group.iter().zip(samples).map(|(channel, samples)| Channel {
                name: channel.name.clone(),
                samples,
                half_suffices: channel.half_suffices,
            }));
        }
        let options = SaveOptions { alpha, channels, ..SaveOptions::default() };
        Ok((image::Image { width, height, pixels: pixels.into() }, options))
    }

    /// Samples of the channels of an array.
    fn samples(&self, py: Python<'_>, name: &str, channels: usize) -> PyResult<Vec<Samples>> {
        if let Ok(whole) = self.values::<u32>(py, name) {
            return Ok((0..channels).map(|i| Samples::Whole(lane(&whole, i, channels))).collect());
        }
        let real = self.values::<f32>(py, name)?;
        Ok((0..channels).map(|i| Samples::Real(lane(&real, i, channels))).collect())
    }

    /// Values of an array in row order, whatever its strides.
    fn values<T: Element + Copy>(&self, py: Python<'_>, name: &str) -> PyResult<Vec<T>> {
        let array = self.item(py, name)?;
        let array: PyReadonlyArrayDyn<'_, T> = array.extract()?;
        Ok(array.as_array().iter().copied().collect())
    }

    fn item<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let arrays = self.arrays.bind(py);
        if let Some(array) = arrays.get_item(name)? {
            return Ok(array);
        }
        let names: Vec<String> = arrays.keys().extract()?;
        let names = names.join(", ");
        Err(PyKeyError::new_err(format!("{name:?}; the image has {names}")))
    }

    /// Development and file by keywords.
    fn request(path: &Path, options: Option<&Bound<'_, PyDict>>) -> PyResult<SaveRequest> {
        let words = words(Purpose::Save, options)?;
        SaveRequest::new(path, &words).map_err(PyValueError::new_err)
    }

    /// Bytes of a PNG file, with the default options.
    fn png(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        let file = Path::new("image.png");
        let (image, contents) = self.contents(py)?;
        let request = [("metadata".to_owned(), vec!["none".to_owned()])];
        let request = SaveRequest::new(file, &request).map_err(PyValueError::new_err)?;
        let metadata = request.metadata(&self.receipt);
        let options = SaveOptions { channels: Vec::new(), metadata, ..contents };
        py.detach(|| image::encode(&image, file, &options)).map_err(|error| of_file(&error))
    }
}

/// Channel number `i` of values of all channels, pixel by pixel.
fn lane<T: Copy>(values: &[T], i: usize, channels: usize) -> Vec<T> {
    values.iter().skip(i).step_by(channels).copied().collect()
}

/// Array of the channels of a quantity, which are all real or all whole.
fn array(py: Python<'_>, channels: Vec<Samples>, size: [usize; 2]) -> PyResult<Bound<'_, PyAny>> {
    let count = channels.len();
    let (mut real, mut whole) = (Vec::new(), Vec::new());
    for channel in channels {
        match channel {
            Samples::Real(values) => real.push(values),
            Samples::Whole(values) => whole.push(values),
        }
    }
    if whole.is_empty() {
        Ok(shaped(py, interleaved(real), size, count)?.into_any())
    } else {
        Ok(shaped(py, interleaved(whole), size, count)?.into_any())
    }
}

/// Values of all channels, pixel by pixel; those of a single channel are not copied.
fn interleaved<T: Copy>(mut channels: Vec<Vec<T>>) -> Vec<T> {
    match channels.as_mut_slice() {
        [only] => std::mem::take(only),
        several => {
            let pixels = several.first().map_or(0, Vec::len);
            (0..pixels).flat_map(|i| several.iter().map(move |channel| channel[i])).collect()
        }
    }
}

/// Array of this many channels; one channel has no dimension of its own. The values are not copied.
fn shaped<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    [height, width]: [usize; 2],
    channels: usize,
) -> PyResult<Bound<'_, PyArrayDyn<T>>> {
    let shape = [height, width, channels];
    let shape = if channels == 1 { &shape[..2] } else { &shape[..] };
    values.into_pyarray(py).reshape(shape)
}

/// Error of writing an image: OSError if the file cannot be written, otherwise ValueError.
fn of_file(error: &ImageError) -> PyErr {
    match error {
        ImageError::Read { .. } | ImageError::Write(_) => PyOSError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

#[pymethods]
impl Image {
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.item(py, name)
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> PyResult<bool> {
        self.arrays.bind(name.py()).contains(name)
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.arrays.bind(py).len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        self.keys(py).try_iter()
    }

    /// Names of the arrays.
    ///
    /// Returns
    /// -------
    /// list of str
    fn keys<'py>(&self, py: Python<'py>) -> Bound<'py, PyList> {
        self.arrays.bind(py).keys()
    }

    /// dict: Receipt, as the program writes it into images: version, files of the scene and
    /// settings on which the image depends, the hash of its samples, and the command, machine and
    /// costs of the run. Content in memory is among the files as "scene in memory"; with files,
    /// the command renders the same image.
    #[getter]
    fn receipt<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.receipt.to_text(),))
    }

    /// dict or None: Perspective camera of the image, when the shutter opens, with the names of
    /// transforms.json: `transform_matrix`, camera to world in units of the scene, an array of
    /// shape (4, 4) whose axes point to the right, up and backwards; focal lengths `fl_x`, `fl_y`
    /// and centre `cx`, `cy` in pixels from the upper left corner; width `w` and height `h`. None
    /// for other cameras, and for images that were read from films.
    #[getter]
    fn camera<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.pose.as_ref().map(|pose| pose.to_dict(py)).transpose()
    }

    /// Denoises the colours by Open Image Denoise, as `--denoise` of the program does.
    ///
    /// Albedo and normals guide it if the image was rendered with these AOVs. The library is that
    /// of the package pyoidn (`pip install "pathtracer[denoise]"`), or one that the program finds.
    ///
    /// Parameters
    /// ----------
    /// threads : int, optional
    ///     Number of threads; by default one per core.
    ///
    /// Returns
    /// -------
    /// Image
    ///     A new image, with the noisy colours as `image["noisy"]` and copies of the other arrays.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     If the library is not found or cannot be opened.
    /// RuntimeError
    ///     If the library fails.
    /// TypeError, ValueError
    ///     If the image is denoised already, or the number of threads is wrong.
    #[pyo3(signature = (*, threads = None))]
    fn denoise(&self, py: Python<'_>, threads: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let threads = threads.map(denoise::threads).transpose()?;
        if self.denoiser.is_some() {
            let message = "the image is denoised already; its array noisy is the rendered one";
            return Err(PyValueError::new_err(message));
        }
        let (noisy, _) = self.contents(py)?;
        let (pixels, version) = denoise::denoised(py, noisy, self.guides.clone(), threads)?;
        let size = [self.height as usize, self.width as usize];
        let arrays = PyDict::new(py);
        for (name, array) in self.arrays.bind(py) {
            arrays.set_item(name, array.call_method0("copy")?)?;
        }
        arrays.set_item(NOISY, arrays.as_any().get_item(COLOR)?)?;
        arrays.set_item(COLOR, shaped(py, pixels.into_flattened(), size, 3)?)?;
        let noisy = ["R", "G", "B"].map(|letter| FileChannel {
            name: format!("{NOISY}.{letter}"),
            array: NOISY.to_owned(),
            half_suffices: true,
        });
        Ok(Self {
            notes: self.notes.clone(),
            arrays: arrays.unbind(),
            channels: self.channels.iter().cloned().chain(noisy).collect(),
            metadata: self.metadata.clone(),
            receipt: pt_cli::denoised(self.receipt.clone()),
            guides: self.guides.clone(),
            denoiser: Some(version),
            pose: self.pose.clone(),
            ..*self
        })
    }

    /// Develops the colours for a display.
    ///
    /// Parameters
    /// ----------
    /// exposure : float or "auto", optional
    ///     Exposure in stops; 0 by default.
    /// tonemap : str, optional
    ///     Tone curve: "linear", "filmic", "agx", "aces" or "pbr-neutral".
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     Colours in sRGB, of shape (height, width, 3) and type uint8. They are those of a PNG
    ///     file without alpha.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If an option is unknown or has a wrong value.
    #[pyo3(signature = (**options))]
    fn to_srgb<'py>(
        &self,
        py: Python<'py>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
        let (image, _) = self.contents(py)?;
        let request = Self::request(Path::new("image.png"), options)?;
        let SaveOptions { tone, transfer, .. } = request.options(&image);
        let develop = |pixel: &[f32; 3]| tone.map(*pixel).map(|v| transfer.encode8(v));
        let levels: Vec<_> = py.detach(|| image.pixels.iter().flat_map(develop).collect());
        shaped(py, levels, [self.height as usize, self.width as usize], 3)
    }

    /// Writes the image to a PNG or OpenEXR file, which replaces an existing one when it is
    /// complete.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File, .png or .exr. OpenEXR files contain all quantities.
    /// exposure : float or "auto", optional
    ///     Exposure of a PNG file in stops; 0 by default.
    /// tonemap : str, optional
    ///     Tone curve of a PNG file, as for :meth:`to_srgb`.
    /// png_bits : int, optional
    ///     Bits per channel of a PNG file, 8 or 16.
    /// exr_type : str, optional
    ///     "float" or "half".
    /// exr_compression : str, optional
    ///     "none", "rle", "zips", "zip", "piz", "pxr24", "b44" or "b44a".
    /// metadata : str, optional
    ///     "full" for the receipt (default), "stable" for the receipt without the run, or "none".
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If an option or the extension is unknown, or an option has a wrong value.
    /// OSError
    ///     If the file cannot be written.
    #[pyo3(signature = (path, **options))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let (image, contents) = self.contents(py)?;
        let SaveOptions { alpha, channels, .. } = contents;
        let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        let request = Self::request(&path, options)?;
        let mut metadata = request.metadata(&self.receipt);
        metadata.extend(self.metadata.iter().cloned());
        metadata.extend(self.denoiser.as_ref().map(|version| {
            let place = if is_exr { "; as rendered: layer noisy" } else { "" };
            ("Denoiser".to_owned(), format!("Open Image Denoise {version}{place}"))
        }));
        let channels = if is_exr { channels } else { Vec::new() };
        let options = SaveOptions { alpha, channels, metadata, ..request.options(&image) };
        py.detach(|| image::save(&image, &path, &options)).map_err(|error| of_file(&error))
    }

    /// Bytes of a PNG file, which notebooks show.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.png(py)?))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let names: Vec<String> = self.keys(py).extract()?;
        let (width, height, names) = (self.width, self.height, names.join(", "));
        let state = if self.complete { "" } else { ", incomplete" };
        Ok(format!("<Image {width} x {height}: {names}{state}>"))
    }
}
