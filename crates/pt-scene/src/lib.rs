//! What the author wrote: plain scene data, the formats it is read from, and image files.
//!
//! ```text
//! bytes ─ format::load ─▶ Scene            Image ─ image::save ─▶ bytes
//! ```
//!
//! A [`Scene`] may be cloned, compared and edited; it does not know how to be rendered.

pub mod camera;
pub mod camera_file;
mod catch_panic;
pub mod error;
pub mod file;
pub mod filter;
pub mod format;
pub mod framing;
pub mod hair;
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
mod sky_layout;
pub mod source;
pub mod span;
pub mod spelling;
pub mod texture;

pub use camera::{Aperture, Camera, Fit, Meter, Placement, Projection, Quantity};
pub use error::{LoadError, Warning};
pub use filter::Filter;
pub use light::{
    DateTime, Daylight, GeoLocation, IesProfile, Light, LightKind, Portal, Rows, TimeRange,
};
pub use material::{Material, Surface};
pub use medium::{Medium, Sides};
pub use mesh::{Attribute, Attributes, Mesh, Submesh};
pub use motion::{Key, Motion, MotionError};
pub use points::Points;
pub use scene::{Geometry, Object, Scene};
pub use settings::{Hidden, RenderHints};
pub use sky_layout::SkyLayout;
pub use source::SourceFile;
pub use span::Span;
pub use texture::{Color, Scalar, Texture};
