//! How a tree is to be built.

/// How the tree is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Builder {
    /// Surface area heuristic, in parallel.
    #[default]
    Sah,
    /// Split at the mean of the centroids along the longest axis.
    Mean,
    /// No tree: every query loops over all primitives.
    None,
}

/// How much time [`Builder::Sah`] may take for a tree that is faster to query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Few bins, and nothing afterwards: the tree is soon there, for geometry that changes or is
    /// looked at briefly.
    Fast,
    /// More bins. Triangles that fill little of their boxes are cut into pieces where there are
    /// enough of them to matter; references to pieces are at most 30 % of the primitives, or about
    /// a thousand. Meshes without such triangles pay next to nothing for that. When the tree is
    /// there, the largest of its subtrees are moved to where they cost less.
    #[default]
    Balanced,
    /// More bins again, and every way to part up to 128 primitives along an axis; triangles are
    /// cut finer, with up to 50 % more references, and subtrees of all sizes are moved to where
    /// they cost less. Takes several times as long as [`Quality::Balanced`] for trees that are
    /// smaller by some percent, and hardly faster unless there are triangles to cut.
    High,
}

/// Options of [`Bvh::build`](crate::Bvh::build).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// How to build.
    pub builder: Builder,
    /// How carefully; [`Builder::Mean`] and [`Builder::None`] know one way only.
    pub quality: Quality,
    /// Leaves of the binary tree hold no more primitives than this; taken as a number from 1 to
    /// 64. The default is 8, as many as are tested at once; for queries, subtrees with up to that
    /// many become one leaf in any case.
    pub max_leaf_size: u32,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self { builder: Builder::default(), quality: Quality::default(), max_leaf_size: 8 }
    }
}
