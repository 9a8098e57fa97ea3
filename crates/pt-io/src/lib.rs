//! Files: bounded reading, atomic writing, and panics of decoders as errors.

pub mod file;
mod guard;
mod write;

pub use guard::guarded;
pub use write::{WriteError, check_target, folder_of, sync_folder, write_atomically};
