//! The memory of pictures, which is asked for before it is taken.

use pt_memory::Grant;

/// Where the memory of pictures is asked for.
pub struct Room<'r>(&'r (dyn Fn(u64) -> Result<Grant, String> + Sync));

impl<'r> Room<'r> {
    /// All that the process may take.
    pub const OF_PROCESS: Self = Room(&pt_memory::ask);

    /// What `grant` grants, which is asked for bytes.
    pub fn new(grant: &'r (dyn Fn(u64) -> Result<Grant, String> + Sync)) -> Self {
        Self(grant)
    }

    /// Asks for the memory of so many bytes of pixels, and as much again for what they are made of.
    pub(super) fn ask(&self, pixels: Option<u64>) -> Result<Grant, String> {
        check_size(pixels, usize::MAX)?;
        (self.0)(pixels.unwrap_or(u64::MAX).saturating_mul(2))
    }
}

/// Refuses to decode `decoded` bytes of samples from a file of `encoded` bytes, when a few bytes
/// claim to be a picture larger than memory.
pub(super) fn check_size(decoded: Option<u64>, encoded: usize) -> Result<(), String> {
    /// One gibibyte.
    const MAX_BYTES: u64 = 1 << 30;
    /// Deflate packs 258 bytes into two bits at best; no other compression that PNG and OpenEXR
    /// have reaches that. JPEG takes a bit for a block of 64 samples at least, and with colours of
    /// half the width and height, 6 bits for 256 pixels.
    const BEST_RATIO: u64 = 1032;
    let decoded = decoded.unwrap_or(u64::MAX);
    if decoded > MAX_BYTES {
        return Err("holds more than 1 GiB of pixels; please scale it down".to_owned());
    }
    if decoded / BEST_RATIO > encoded as u64 {
        return Err(format!("claims {decoded} bytes of pixels, but has {encoded} bytes in all"));
    }
    Ok(())
}
