//! Scene description: plain data as written by the author.
//!
//! A [`Scene`] may be cloned, compared and edited. This crate has no parser and no renderer:
//! `pt-formats` reads and writes scenes, and `pt-core` compiles them.

pub mod camera;
pub mod extent;
pub mod filter;
pub mod framing;
pub mod geometry;
pub mod hair;
mod hint;
pub mod image;
pub mod light;
pub mod material;
pub mod measured;
pub mod medium;
pub mod mesh;
pub mod metals;
pub mod motion;
pub mod points;
pub mod scene;
pub mod settings;
pub mod shapes;
mod shared;
pub mod sky_layout;
pub mod source;
pub mod span;
pub mod texture;
mod warning;

pub use camera::{Aperture, Camera, Fit, Meter, Placement, Projection, Quantity};
pub use filter::Filter;
pub use geometry::Geometry;
pub use hint::{Hint, Notes};
pub use light::{
    DateTime, Daylight, GeoLocation, IesProfile, Light, LightKind, Portal, Rows, SimpleLight,
    TimeRange,
};
pub use material::{Material, Surface};
pub use medium::{Medium, Sides};
pub use mesh::{Attribute, Attributes, Mesh, Submesh};
pub use motion::{Key, Motion, MotionError};
pub use points::Points;
pub use scene::{Object, Scene};
pub use settings::{Hidden, RenderHints};
pub use shared::Shared;
pub use sky_layout::SkyLayout;
pub use source::SourceFile;
pub use span::Span;
pub use texture::{Color, Scalar, Texture};
pub use warning::Warning;
