//! Interpretations of scenes by other programs, whose images are reproduced.

pub mod cs184;

pub use pt_core::compile::compat::Policies;
