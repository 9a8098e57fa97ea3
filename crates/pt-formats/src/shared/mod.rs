//! Components shared by several formats.

pub(crate) mod cameras;
pub(crate) mod context;
pub(crate) mod deadline;
pub(crate) mod decimal;
pub(crate) mod grid;
pub(crate) mod isosurface;
pub(crate) mod legacy_specular;
pub(crate) mod limits;
pub(crate) mod line;
pub(crate) mod mesh_diagnostics;
pub(crate) mod mesh_file;
pub(crate) mod names;
pub(crate) mod number;
pub(crate) mod parameters;
pub(crate) mod placeholder;
pub(crate) mod prefetch;
pub(crate) mod reference_stack;
pub(crate) mod registry;
pub(crate) mod source;
pub(crate) mod source_map;
pub(crate) mod spectra;
pub(crate) mod text;
pub(crate) mod transform;
pub(crate) mod triangulate;
pub(crate) mod tube;
pub(crate) mod xml;
