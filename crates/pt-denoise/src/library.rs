//! C interface of Open Image Denoise 2. [oidn.h]

#![expect(unsafe_code, reason = "the C interface of a library that is opened at run time")]

use std::ffi::{CStr, c_char, c_int, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;
use std::ptr;

use libloading::Library;

type OidnHandle = *mut c_void;

/// `OIDN_DEVICE_TYPE_CPU`.
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;

/// Declares the functions that are used, and loads them from a library.
macro_rules! functions {
    ($($name:ident = $symbol:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Library and its functions.
        pub(crate) struct OidnFunctions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            /// Keeps the functions loaded until the program ends, since threads of the library may
            /// outlive its devices.
            _library: ManuallyDrop<Library>,
        }

        impl OidnFunctions {
            /// Opens the library; a name without a folder is searched for on the system's library
            /// path.
            ///
            /// # Errors
            /// A message, if it cannot be opened, or lacks a function.
            pub(crate) fn load(path: &Path) -> Result<Self, String> {
                let message = |error: libloading::Error| error.to_string();
                // SAFETY: Open Image Denoise and its threading library may be initialised at any
                // time and from any thread.
                let library = ManuallyDrop::new(unsafe { Library::new(path) }.map_err(message)?);
                $(
                    // SAFETY: the type is that of the public header of version 2.
                    let $name = *unsafe { library.get($symbol) }.map_err(message)?;
                )*
                Ok(Self { $($name,)* _library: library })
            }
        }
    };
}

functions! {
    new_device = b"oidnNewDevice": fn(c_int) -> OidnHandle;
    set_device_int = b"oidnSetDeviceInt": fn(OidnHandle, *const c_char, c_int);
    set_device_bool = b"oidnSetDeviceBool": fn(OidnHandle, *const c_char, bool);
    get_device_int = b"oidnGetDeviceInt": fn(OidnHandle, *const c_char) -> c_int;
    commit_device = b"oidnCommitDevice": fn(OidnHandle);
    device_error = b"oidnGetDeviceError": fn(OidnHandle, *mut *const c_char) -> c_int;
    release_device = b"oidnReleaseDevice": fn(OidnHandle);
    new_filter = b"oidnNewFilter": fn(OidnHandle, *const c_char) -> OidnHandle;
    set_image = b"oidnSetSharedFilterImage":
        fn(OidnHandle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);
    set_filter_bool = b"oidnSetFilterBool": fn(OidnHandle, *const c_char, bool);
    commit_filter = b"oidnCommitFilter": fn(OidnHandle);
    execute_filter = b"oidnExecuteFilter": fn(OidnHandle);
    release_filter = b"oidnReleaseFilter": fn(OidnHandle);
}

/// Image as rows of pixels from the top.
pub(crate) struct OidnImage {
    width: usize,
    pixels: Vec<[f32; 3]>,
}

impl OidnImage {
    /// The number of pixels must be a multiple of the width, which must not be 0.
    pub(crate) fn new(width: usize, pixels: Vec<[f32; 3]>) -> Self {
        Self { width, pixels }
    }

    pub(crate) fn into_pixels(self) -> Vec<[f32; 3]> {
        self.pixels
    }
}

/// Compute device.
pub(crate) struct Device {
    functions: OidnFunctions,
    handle: OidnHandle,
}

impl Device {
    /// Creates a CPU device with `threads` threads, which are not bound to cores.
    ///
    /// # Errors
    /// Message of the library, if it creates no device.
    pub(crate) fn new(functions: OidnFunctions, threads: usize) -> Result<Self, String> {
        // SAFETY: the constant is one of the header's.
        let handle = unsafe { (functions.new_device)(CPU) };
        // With a null device, the library returns the error of a device that could not be created.
        let device = Self { functions, handle };
        if handle.is_null() {
            device.check()?;
            return Err("it gives no reason".into());
        }
        let threads = c_int::try_from(threads).unwrap_or(c_int::MAX);
        // SAFETY: the device is alive, and the names end with a NUL.
        unsafe {
            (device.functions.set_device_int)(handle, c"numThreads".as_ptr(), threads);
            (device.functions.set_device_bool)(handle, c"setAffinity".as_ptr(), false);
            (device.functions.commit_device)(handle);
        }
        device.check().map(|()| device)
    }

    /// Version as 10000 · major + 100 · minor + patch.
    pub(crate) fn version(&self) -> i32 {
        // SAFETY: the device is alive, and the name ends with a NUL.
        unsafe { (self.functions.get_device_int)(self.handle, c"version".as_ptr()) }
    }

    /// Applies the ray tracing filter to images of one size, with these switches on.
    ///
    /// # Errors
    /// Message of the library.
    pub(crate) fn filter(
        &self,
        inputs: &[(&CStr, &OidnImage)],
        switches: &[&CStr],
    ) -> Result<OidnImage, String> {
        let Some((_, like)) = inputs.first() else { return Err("nothing to filter".into()) };
        let mut output = OidnImage::new(like.width, vec![[0.0; 3]; like.pixels.len()]);
        let is_like = |image: &OidnImage| {
            image.pixels.len() == like.pixels.len() && image.width == like.width
        };
        assert!(inputs.iter().all(|(_, image)| is_like(image)), "images of one size");
        let f = &self.functions;
        // SAFETY: the device is alive, and the name ends with a NUL.
        let filter = unsafe { (f.new_filter)(self.handle, c"RT".as_ptr()) };
        self.check()?;
        for (name, image) in inputs {
            self.bind(filter, name, image, image.pixels.as_ptr().cast_mut().cast());
        }
        let target = output.pixels.as_mut_ptr().cast();
        self.bind(filter, c"output", &output, target);
        // SAFETY: the filter is alive, the names end with a NUL, and the images live until it is
        // released. It writes only to its output, to which nothing else refers meanwhile.
        unsafe {
            for name in switches {
                (f.set_filter_bool)(filter, name.as_ptr(), true);
            }
            (f.commit_filter)(filter);
            (f.execute_filter)(filter);
            (f.release_filter)(filter);
        }
        self.check().map(|()| output)
    }

    /// Binds the pixels of an image, at `pixels`, to an input or output of a filter.
    fn bind(&self, filter: OidnHandle, name: &CStr, image: &OidnImage, pixels: *mut c_void) {
        let (width, height) = (image.width, image.pixels.len() / image.width);
        let pixel = size_of::<[f32; 3]>();
        // SAFETY: the filter is alive, the name ends with a NUL, and the pixels are contiguous and
        // as many as the size says.
        unsafe {
            let set = self.functions.set_image;
            set(filter, name.as_ptr(), pixels, FLOAT3, width, height, 0, pixel, width * pixel);
        }
    }

    /// Checks the device for errors.
    ///
    /// # Errors
    /// Message of the first error since the last call.
    fn check(&self) -> Result<(), String> {
        let mut message = ptr::null();
        // SAFETY: the device is alive or null, which requests the error of a device that could not
        // be created.
        let error = unsafe { (self.functions.device_error)(self.handle, &raw mut message) };
        if error == 0 {
            return Ok(());
        }
        if message.is_null() {
            return Err(format!("error {error}"));
        }
        // SAFETY: the text ends with a NUL, and is valid until the next error of this thread.
        Err(unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned())
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // SAFETY: the device is alive, and not used any more.
            unsafe { (self.functions.release_device)(self.handle) };
        }
    }
}
