//! Values of a source.

use std::collections::HashMap;
use std::ops::Range;

use roxmltree::NodeId;

/// Values of `N` numbers from all sources that the primitives of a mesh use for one semantic.
#[derive(Default)]
pub(super) struct Pool<const N: usize> {
    pub(super) values: Vec<[f32; N]>,
    /// Range of the values of each source.
    pub(super) sources: HashMap<NodeId, Range<u32>>,
}
