//! Commands on rendered images and their samples (resume, merge, info, rerender, develop, denoise,
//! join), on pixels (explain), and on scenes (info, check, convert).

pub(crate) mod check;
pub(crate) mod convert;
pub(crate) mod denoise;
pub(crate) mod develop;
pub(crate) mod explain;
pub(crate) mod info_image;
pub(crate) mod info_scene;
pub(crate) mod join;
pub(crate) mod merge;
pub(crate) mod render;
pub(crate) mod rerender;
pub(crate) mod resume;
pub(crate) mod sequence;
