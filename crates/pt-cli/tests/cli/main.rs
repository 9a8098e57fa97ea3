//! The program as its users run it.

mod common;
mod course;
mod denoise;
mod documentation;
mod images;
mod interrupt;
mod media;
mod refusals;
mod report;
mod resume;
mod texts;
mod viewer;
