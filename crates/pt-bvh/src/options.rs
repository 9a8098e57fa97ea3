//! Options of the build.

/// Algorithm that builds the tree.
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

/// Trade-off of [`Builder::Sah`] between build time and query speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Few bins, no post-processing: a short build, for geometry that changes or is rendered
    /// briefly.
    Fast,
    /// More bins. If enough triangles fill little of their boxes, they are cut into pieces;
    /// references to pieces are at most 30 % of the primitives, or about a thousand. For other
    /// meshes the cost of this step is negligible. After the build, the largest subtrees are moved
    /// to cheaper positions.
    #[default]
    Balanced,
    /// Still more bins, and a full sweep of up to 128 primitives along each axis. Triangles are cut
    /// finer, with up to 50 % more references, and subtrees of all sizes are moved to cheaper
    /// positions. Takes several times as long as [`Quality::Balanced`], for trees that are cheaper
    /// by some percent and hardly faster unless there are triangles to cut.
    High,
}

/// Options of [`Bvh::build`](crate::Bvh::build).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// Algorithm.
    pub builder: Builder,
    /// Effort of [`Builder::Sah`]; the other builders ignore it.
    pub quality: Quality,
    /// Maximum number of primitives per leaf of the binary tree, clamped to [1, 64]. The default is
    /// 8, the number of primitives tested at once. For queries, subtrees with up to that many
    /// primitives become one leaf in any case.
    pub max_leaf_size: u32,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self { builder: Builder::default(), quality: Quality::default(), max_leaf_size: 8 }
    }
}
