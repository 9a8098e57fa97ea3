//! Textures: values that vary over a surface, by its texture coordinates (u, v), by position in
//! space, by the direction of its normal, or by the colours of its mesh.

mod procedural;

use std::sync::Arc;

pub use procedural::{Marble, Noise, Procedural};
use pt_math::{DAffine3, DMat3};

use crate::image::Image;
use crate::medium::{Grid, GridFilter};

/// A parameter of a material: a constant, or a value that varies over the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Input<T> {
    /// Constant value.
    Value(T),
    /// Value of a texture; a scalar is the luminance of the colour.
    Texture(Arc<Texture>),
}

/// A colour parameter, linear Rec. 709.
pub type Color = Input<[f32; 3]>;
/// A scalar parameter.
pub type Scalar = Input<f32>;

impl<T> Input<T> {
    /// Returns the texture, or `None` for a constant.
    pub fn texture(&self) -> Option<&Arc<Texture>> {
        match self {
            Self::Value(_) => None,
            Self::Texture(texture) => Some(texture),
        }
    }
}

impl<T> From<T> for Input<T> {
    fn from(value: T) -> Self {
        Self::Value(value)
    }
}

impl From<Pattern> for Texture {
    /// A pattern in the texture coordinates of the surface, without a transform.
    fn from(pattern: Pattern) -> Self {
        Self { pattern, layout: TextureMapping::Surface, to_pattern: DMat3::IDENTITY }
    }
}

/// A pattern and its mapping: the mapping gives a surface point coordinates (u, v, w), and the
/// value is that of the pattern at `to_pattern` (u, v) and w. Patterns that combine textures use
/// the mappings of these.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The pattern.
    pub pattern: Pattern,
    /// Mapping from surface points to coordinates.
    pub layout: TextureMapping,
    /// Transform from (u, v, 1) of the mapping to (u, v) of the pattern.
    pub to_pattern: DMat3,
}

/// Mapping from surface points to texture coordinates (u, v, w). Transforms are from the world, in
/// units of the scene, to the space of the texture; points of animated objects are taken at the
/// time of the ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TextureMapping {
    /// Texture coordinates of the surface; w is 0.
    #[default]
    Surface,
    /// The transformed point (x, y, z). Two-dimensional patterns are in the plane of x and y.
    Space {
        /// World to texture space.
        to_texture: DAffine3,
    },
    /// Spherical mapping of the transformed point: the angle from +z over π, and the angle around
    /// z, from +x to +y, over 2π; w is 0.
    Sphere {
        /// World to texture space.
        to_texture: DAffine3,
    },
    /// Additional texture coordinates of the mesh: the first two channels of the
    /// [values](crate::Attributes::vertices) named [`TextureMapping::set_name`]; w is 0.
    Coordinates {
        /// Index of the set, from 1.
        set: u32,
    },
    /// Cylindrical mapping of the transformed point: the angle around the z axis, starting at −x in
    /// the direction from +x to +y, over 2π, and z; w is 0.
    Cylinder {
        /// World to texture space.
        to_texture: DAffine3,
    },
}

impl TextureMapping {
    /// Returns the name of additional texture coordinates among the attributes of a mesh.
    pub fn set_name(set: u32) -> String {
        format!("uv_{set}")
    }

    /// Returns true if the mapping uses texture coordinates of the surface.
    fn is_on_surface(self) -> bool {
        matches!(self, Self::Surface | Self::Coordinates { .. })
    }
}

impl Texture {
    /// Creates a texture in the texture coordinates of the surface, with a transform.
    pub fn on_surface(pattern: Pattern, to_pattern: DMat3) -> Self {
        Self { pattern, layout: TextureMapping::Surface, to_pattern }
    }

    /// Returns true if the texture uses colours or attributes of the mesh, which some surfaces do
    /// not have.
    pub fn shows_colors_of_mesh(&self) -> bool {
        match &self.pattern {
            Pattern::VertexColors
            | Pattern::FaceColors
            | Pattern::VertexAttribute(_)
            | Pattern::FaceAttribute(_) => true,
            pattern if pattern.has_layout() => {
                matches!(self.layout, TextureMapping::Coordinates { .. })
            }
            pattern => pattern.parts().any(|t| t.shows_colors_of_mesh()),
        }
    }

    /// Returns true if any part of the texture uses texture coordinates of the surface.
    pub fn uses_coordinates(&self) -> bool {
        let own = self.pattern.has_layout() && self.layout.is_on_surface();
        own || self.pattern.parts().any(|t| t.uses_coordinates())
    }

    /// Returns true if any part of the texture is mapped in space, or depends on the direction of
    /// the normal.
    pub fn is_in_space(&self) -> bool {
        let is_laid = self.pattern.has_layout() && !self.layout.is_on_surface();
        let own = is_laid || matches!(self.pattern, Pattern::AbsNormalDot(_));
        own || self.pattern.parts().any(|t| t.is_in_space())
    }
}

impl Pattern {
    /// Returns true if the pattern depends on the mapping of its texture, which is not the case for
    /// combinations of textures, colours of meshes and normals.
    fn has_layout(&self) -> bool {
        !matches!(
            self,
            Self::VertexColors
                | Self::FaceColors
                | Self::VertexAttribute(_)
                | Self::FaceAttribute(_)
                | Self::Product(_)
                | Self::Blend(_)
                | Self::Sqrt(_)
                | Self::AbsNormalDot(_)
        )
    }

    /// Iterates over the textures that the pattern combines.
    pub fn parts(&self) -> impl Iterator<Item = &Arc<Texture>> {
        let (colors, share) = match self {
            Self::Product(factors) => ([Some(&factors[0]), Some(&factors[1])], None),
            Self::Blend(blend) => {
                ([Some(&blend.first), Some(&blend.second)], blend.amount.texture())
            }
            Self::Sqrt(square) => ([Some(square), None], None),
            _ => ([None; 2], None),
        };
        colors.into_iter().flatten().filter_map(Color::texture).chain(share)
    }
}

impl Color {
    /// Multiplies the colour of an emitter by an opacity. If the opacity is a texture, all its
    /// channels must be equal.
    #[must_use]
    pub fn times(self, share: &Scalar) -> Self {
        let share = match share {
            Scalar::Value(share) => Self::Value([*share; 3]),
            Scalar::Texture(texture) => Self::Texture(Arc::clone(texture)),
        };
        match [self, share] {
            [Self::Value(a), Self::Value(b)] => Self::Value(std::array::from_fn(|c| a[c] * b[c])),
            [Self::Value([0.0, 0.0, 0.0]), _] => Self::Value([0.0; 3]),
            [color, Self::Value([1.0, 1.0, 1.0])] => color,
            [Self::Value([1.0, 1.0, 1.0]), share] => share,
            factors => Self::Texture(Arc::new(Pattern::Product(Box::new(factors)).into())),
        }
    }

    /// Returns the approximate mean: for an image the mean of its pixels, for two colours their
    /// average.
    pub fn mean(&self) -> [f32; 3] {
        match self {
            Self::Value(value) => *value,
            Self::Texture(texture) => texture.pattern.mean(),
        }
    }
}

impl Pattern {
    /// Returns the approximate mean, see [`Color::mean`]. Colours of meshes are not available here,
    /// and count as black.
    pub fn mean(&self) -> [f32; 3] {
        match self {
            Self::Bitmap(bitmap) => {
                let pixels = &bitmap.image.pixels;
                let add = |sum: [f64; 3], p: &[f32; 3]| [0, 1, 2].map(|c| sum[c] + f64::from(p[c]));
                let sum = pixels.iter().fold([0.0; 3], add);
                sum.map(|sum| (sum / pixels.len().max(1) as f64) as f32)
            }
            Self::Checkerboard([a, b]) => [0, 1, 2].map(|c| 0.5 * (a[c] + b[c])),
            Self::Procedural(procedural) => procedural.mean(),
            Self::VertexColors
            | Self::FaceColors
            | Self::VertexAttribute(_)
            | Self::FaceAttribute(_) => [0.0; 3],
            Self::Grid { grid, .. } => grid.mean(),
            Self::AbsNormalDot(_) => [0.5; 3],
            Self::Product(factors) => {
                let [a, b] = factors.each_ref().map(Color::mean);
                [0, 1, 2].map(|c| a[c] * b[c])
            }
            Self::Blend(blend) => {
                let [first, second] = [&blend.first, &blend.second].map(Color::mean);
                let share = blend.amount.mean().clamp(0.0, 1.0);
                [0, 1, 2].map(|c| first[c] + (second[c] - first[c]) * share)
            }
            Self::Sqrt(square) => square.mean().map(|c| c.max(0.0).sqrt()),
        }
    }
}

impl Scalar {
    /// Returns the approximate mean, if all channels of the texture are equal.
    pub fn mean(&self) -> f32 {
        match self {
            Self::Value(value) => *value,
            Self::Texture(texture) => texture.pattern.mean()[0],
        }
    }
}

/// Pattern of a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// An image.
    Bitmap(Bitmap),
    /// Checkerboard with squares of side ½: the first colour where the fractional parts of u and v
    /// are on the same side of ½, the second elsewhere.
    Checkerboard([[f32; 3]; 2]),
    /// [`Mesh::colors`](crate::Mesh::colors), interpolated linearly over each triangle.
    VertexColors,
    /// [`Mesh::face_colors`](crate::Mesh::face_colors).
    FaceColors,
    /// Values of this name of [`Attributes::vertices`](crate::Attributes::vertices), interpolated
    /// linearly over each triangle.
    VertexAttribute(String),
    /// Values of this name of [`Attributes::faces`](crate::Attributes::faces).
    FaceAttribute(String),
    /// A computed pattern.
    Procedural(Procedural),
    /// Values of a grid with one channel or three, which fills the cube [0, 1]³ of (u, v, w) and is
    /// constant beyond its faces.
    Grid {
        /// The grid.
        grid: Arc<Grid>,
        /// Interpolation between cell centres.
        filter: GridFilter,
    },
    /// Magnitude of the cosine between the normal of the shape and this direction in the world,
    /// which has any length but 0.
    AbsNormalDot([f32; 3]),
    /// The product of two colours, channel by channel.
    Product(Box<[Color; 2]>),
    /// Interpolation between two colours.
    Blend(Box<Blend>),
    /// Square root of a colour, channel by channel; negative values count as 0.
    Sqrt(Color),
}

/// Linear interpolation between two colours: (1 − t) · first + t · second.
#[derive(Clone, Debug, PartialEq)]
pub struct Blend {
    /// Colour for the weight 0.
    pub first: Color,
    /// Colour for the weight 1.
    pub second: Color,
    /// Weight t of the second colour, from 0 to 1; values of a texture are clamped to this range.
    pub amount: Scalar,
}

/// An image that covers the unit square: u increases to the right, v upwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Bitmap {
    /// Decoded pixels: linear light or raw values.
    pub image: Arc<Image>,
    /// Wrap mode outside of the unit square.
    pub wrap: Wrap,
    /// Filter between texel centres.
    pub filter: Filter,
}

/// Wrap modes of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wrap {
    /// Wrap mode at the left and right edge.
    pub u: Edge,
    /// Wrap mode at the lower and upper edge.
    pub v: Edge,
}

impl Wrap {
    /// See [`Edge::Repeat`].
    pub const REPEAT: Self = Self::both(Edge::Repeat);
    /// See [`Edge::Mirror`].
    pub const MIRROR: Self = Self::both(Edge::Mirror);
    /// See [`Edge::Clamp`].
    pub const CLAMP: Self = Self::both(Edge::Clamp);
    /// See [`Edge::Black`].
    pub const BLACK: Self = Self::both(Edge::Black);

    /// Returns the same wrap mode for u and v.
    pub const fn both(edge: Edge) -> Self {
        Self { u: edge, v: edge }
    }
}

/// Wrap mode of an image beyond two opposite edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Edge {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Repeats the image, mirroring every other copy.
    Mirror,
    /// Repeats the nearest edge texel.
    Clamp,
    /// Black outside of the image.
    Black,
}

impl Edge {
    /// Returns the index of the texel, in a row of `n`, at position `i` of an unbounded row; `None`
    /// where it is black.
    #[inline]
    pub fn texel(self, i: i64, n: i64) -> Option<i64> {
        match self {
            Self::Repeat => Some(i.rem_euclid(n)),
            Self::Clamp => Some(i.clamp(0, n - 1)),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n);
                Some(i.min(2 * n - 1 - i))
            }
            Self::Black => (0..n).contains(&i).then_some(i),
        }
    }
}

/// Texture filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Bilinear interpolation of the four texels around a point.
    #[default]
    Bilinear,
    /// The nearest texel.
    Nearest,
    /// [`Self::Bilinear`] for magnification; for minification, the mean over the footprint by
    /// mipmaps. [Williams 1983, "Pyramidal Parametrics"]
    Trilinear,
}

/// A normal map or a bump map.
#[derive(Clone, Debug, PartialEq)]
pub enum NormalOrBump {
    /// Normal map: 2 · rgb − 1 is the normal, in a right-handed frame with the normal of the shape
    /// as +z, and the direction of increasing u of the surface as +x.
    Normals(Arc<Texture>),
    /// Normal map with the direction of increasing u of the image, after its transform, as +x of
    /// the frame: the relief rotates with the image.
    TurnedNormals(Arc<Texture>),
    /// Normal map with a ∂p/∂u + b ∂p/∂v as +x of the frame; a and b are the first two channels of
    /// the second texture.
    NormalsAlong(Arc<Texture>, Arc<Texture>),
    /// Bump map: a displacement by the luminance of the texture times the number, in units of the
    /// scene.
    Heights(Arc<Texture>, f32),
}
