//! Memory reservations for decoded images.

use pt_memory::Grant;

/// Source of memory reservations for decoded images.
pub struct ImageMemory<'r>(&'r (dyn Fn(u64) -> Result<Grant, String> + Sync));

impl<'r> ImageMemory<'r> {
    /// Reservations from the limit of the process.
    pub const OF_PROCESS: Self = ImageMemory(&pt_memory::ask);

    /// Creates a source of reservations by `grant`, which is passed the number of bytes.
    pub fn new(grant: &'r (dyn Fn(u64) -> Result<Grant, String> + Sync)) -> Self {
        Self(grant)
    }

    /// Reserves memory for this number of bytes of pixels, and the same again for their encoded
    /// form and intermediate results.
    pub(super) fn ask(&self, pixels: Option<u64>) -> Result<Grant, String> {
        check_size(pixels, usize::MAX)?;
        (self.0)(pixels.unwrap_or(u64::MAX).saturating_mul(2))
    }
}

/// Rejects files of `encoded` bytes that claim `decoded` bytes of samples, more than their size can
/// hold.
pub(super) fn check_size(decoded: Option<u64>, encoded: usize) -> Result<(), String> {
    /// One gibibyte.
    const MAX_BYTES: u64 = 1 << 30;
    /// Deflate encodes 258 bytes in two bits at best; no other compression of PNG and OpenEXR
    /// reaches this ratio. JPEG uses at least one bit per block of 64 samples, and with chroma of
    /// half the width and height, 6 bits for 256 pixels.
    const BEST_RATIO: u64 = 1032;
    let decoded = decoded.unwrap_or(u64::MAX);
    if decoded > MAX_BYTES {
        return Err("exceeds 1 GiB of pixels; reduce its resolution".to_owned());
    }
    if decoded / BEST_RATIO > encoded as u64 {
        return Err(format!("declares {decoded} bytes of pixels, but has {encoded} bytes"));
    }
    Ok(())
}
