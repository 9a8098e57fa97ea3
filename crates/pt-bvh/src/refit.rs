//! Refitting of a tree to primitives that have moved.

use thiserror::Error;

use crate::geometry::Geometry;
use crate::{BuildError, BuildSource, Bvh, Kernel, build};

/// Reason for which a tree was not refitted; it is then unchanged.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum RefitError {
    /// The tree was built over other numbers of primitives.
    #[error("{triangles} triangles and {spheres} spheres are not as many as the tree has")]
    Counts {
        /// Triangles in the geometry.
        triangles: usize,
        /// Spheres in the geometry.
        spheres: usize,
    },
    /// The geometry is not valid.
    #[error(transparent)]
    Geometry(#[from] BuildError),
}

impl Bvh {
    /// Estimated cost of a query, in arbitrary units: the sum of the areas of the boxes of the
    /// tree. After [`Self::refit`], the increase since the build shows how far neighbours have
    /// moved apart.
    pub fn query_cost(&self) -> f32 {
        match &self.kernel {
            Kernel::Wide(wide) => wide.area_of_boxes(),
            Kernel::List(_) => 0.0,
        }
    }

    /// Updates the tree to `geometry`, in which the primitives may have moved. Much faster than
    /// [`Self::build`], with the same hits; but the farther neighbours have moved apart, the slower
    /// queries become, and cuts of triangles lose their benefit.
    ///
    /// Primitives that have become unusable are left out and counted. If a primitive has become
    /// usable that was not in the tree, or none is left, the tree is rebuilt. Of
    /// [`Self::statistics`], all but `skipped` remain those of the build.
    ///
    /// # Errors
    /// Other numbers of primitives than before, or an index out of range.
    pub fn refit(&mut self, geometry: Geometry<'_>) -> Result<(), RefitError> {
        let source = BuildSource::new(&geometry, self.source.options);
        let (triangles, spheres) = (geometry.triangles.len(), geometry.spheres.len());
        build::check(&geometry)?;
        if (source.triangles, source.spheres) != (self.source.triangles, self.source.spheres) {
            return Err(RefitError::Counts { triangles, spheres });
        }
        let is_refitted = match &mut self.kernel {
            Kernel::List(_) => false,
            Kernel::Wide(wide) => {
                let usable = |id: usize| geometry.primitive(id as u32).bounds().is_some();
                let present = wide.present(geometry.len());
                let is_missing = |(id, present): (usize, &bool)| !present && usable(id);
                if present.iter().enumerate().any(is_missing) {
                    false
                } else {
                    self.bounds = wide.refit(&geometry);
                    let left = (0..geometry.len()).filter(|&id| usable(id)).count();
                    self.statistics.skipped = (geometry.len() - left) as u32;
                    !self.bounds.is_empty()
                }
            }
        };
        if !is_refitted {
            *self = Self::build(geometry, &self.source.options)?;
        }
        Ok(())
    }
}
