//! Render settings that a scene file may carry.

/// What a file asks for; `None` where it is silent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileSettings {
    /// Width and height of the image in pixels.
    pub resolution: Option<[u32; 2]>,
    /// Samples per pixel.
    pub spp: Option<u32>,
    /// Largest number of surface interactions of a path: 0 is emission only, 1 direct light.
    pub max_depth: Option<u32>,
}
