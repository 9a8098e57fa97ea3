//! The program as its users run it.

mod alpha;
mod common;
mod convert;
mod course;
mod denoise;
mod disk;
mod documentation;
mod explain;
mod hostile;
mod images;
mod interrupt;
mod light_groups;
mod mattes;
mod media;
mod progress;
mod receipts;
mod references;
mod refusals;
mod refused_samples;
mod report;
mod resume;
mod scenes;
mod strangers;
mod target;
mod texts;
mod viewer;
