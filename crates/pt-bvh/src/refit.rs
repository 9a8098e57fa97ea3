//! The tree of primitives that have moved.

use thiserror::Error;

use crate::geometry::Geometry;
use crate::{BuildError, Bvh, Kernel, Source, build};

/// Why a tree was not refitted; it is as it was.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum RefitError {
    /// The tree is of other primitives.
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
    /// Takes the primitives anew from `geometry`, in which they may have moved. That is much faster
    /// than [`Self::build`], and queries find the same; but the farther neighbours have moved
    /// apart, the slower queries become, and cuts through triangles no longer spare anything.
    ///
    /// Primitives that have become unusable are left out and counted. When one has become usable
    /// that never was, or none is left, the tree is built anew. Of [`Self::statistics`], all but
    /// `skipped` stay those of the build.
    ///
    /// # Errors
    /// Other numbers of primitives than before, or an index out of range.
    pub fn refit(&mut self, geometry: Geometry<'_>) -> Result<(), RefitError> {
        let source = Source::new(&geometry, self.source.options);
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
