//! Sources of the lights of a compiled scene.

/// Source of a light in the scene that was compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LightSourceId {
    /// Index of an object that emits light.
    Object(u32),
    /// Index of a light node.
    Node(u32),
    /// Index among the visible lights at infinity.
    Sky(u32),
    /// Index of a medium that emits light.
    Medium(u32),
}

/// Indices of the light nodes from which lights were made.
#[derive(Clone, Debug, Default)]
pub struct LightSourceIds {
    /// For each light; `None` if it was made of something else, or of several.
    pub(crate) lights: Vec<Option<u32>>,
    /// For each light in the tree of lights without extent.
    pub(crate) points: Vec<u32>,
    /// For each emissive square: two triangles each, after those of all objects.
    pub(crate) squares: Vec<u32>,
}
