//! Rendered images, as arrays.

use std::path::{Path, PathBuf};

use numpy::{Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pathtracer::image::{self, Channel, ImageError, Samples, SaveOptions};
use pathtracer::{RenderStatistics, Session, cryptomatte};
use pt_cli::{Purpose, save_options};
use pyo3::exceptions::{PyKeyError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyIterator, PyList};

use crate::settings::words;

/// Image of a render, before its samples become arrays.
pub(crate) struct Rendered {
    color: image::Image,
    alpha: Option<Vec<f32>>,
    channels: Vec<Channel>,
    metadata: Vec<(String, String)>,
    notes: Vec<String>,
    is_complete: bool,
    statistics: RenderStatistics,
}

impl Rendered {
    pub(crate) fn new(session: &Session, is_complete: bool, statistics: RenderStatistics) -> Self {
        Self {
            color: session.image(),
            alpha: session.film().alpha(),
            channels: session.channels(),
            metadata: cryptomatte::metadata(session.film(), session.names()),
            notes: session.notes().to_vec(),
            is_complete,
            statistics,
        }
    }

    /// Returns true if all samples were taken.
    pub(crate) fn is_complete(&self) -> bool {
        self.is_complete
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
    metadata: Vec<(String, String)>,
}

/// Channel of a file.
struct FileChannel {
    name: String,
    /// Name of its array.
    array: String,
    half_suffices: bool,
}

/// Name of the array of colours.
const COLOR: &str = "color";
/// Name of the array of alpha.
const ALPHA: &str = "alpha";

impl Image {
    pub(crate) fn new(py: Python<'_>, rendered: Rendered) -> PyResult<Self> {
        let Rendered { color, alpha, channels, metadata, notes, is_complete, statistics } =
            rendered;
        let size = [color.height as usize, color.width as usize];
        let arrays = PyDict::new(py);
        arrays.set_item(COLOR, shaped(py, color.pixels.into_flattened(), size, 3)?)?;
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
            complete: is_complete,
            samples: statistics.samples,
            rays: statistics.rays,
            seconds: statistics.time.as_secs_f64(),
            arrays: arrays.unbind(),
            channels: of_files,
            metadata,
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
        let software = concat!("pathtracer ", env!("CARGO_PKG_VERSION"));
        let software = ("Software".to_owned(), software.to_owned());
        let metadata = std::iter::once(software).chain(self.metadata.iter().cloned()).collect();
        let options = SaveOptions { alpha, channels, metadata, ..SaveOptions::default() };
        Ok((image::Image { width, height, pixels }, options))
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

    /// Options of the development and of the file, by keywords.
    fn options(
        path: &Path,
        image: &image::Image,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<SaveOptions> {
        let words = words(Purpose::Save, options)?;
        save_options(path, &words, image).map_err(PyValueError::new_err)
    }

    /// Bytes of a PNG file, with the default options.
    fn png(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        let (image, options) = self.contents(py)?;
        let options = SaveOptions { channels: Vec::new(), ..options };
        py.detach(|| image::encode(&image, Path::new("image.png"), &options))
            .map_err(|error| of_file(&error))
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
        let SaveOptions { tone, transfer, .. } =
            Self::options(Path::new("image.png"), &image, options)?;
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
        let SaveOptions { alpha, channels, metadata, .. } = contents;
        let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        let channels = if is_exr { channels } else { Vec::new() };
        let options =
            SaveOptions { alpha, channels, metadata, ..Self::options(&path, &image, options)? };
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
