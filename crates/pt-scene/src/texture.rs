//! Textures: numbers that vary over a surface, by its texture coordinates (u, v) or the colours of its
//! mesh.

use std::sync::Arc;

use pt_math::DMat3;

use crate::image::Image;

/// A parameter of a material: one value, or one that varies over the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Input<T> {
    /// The same everywhere.
    Value(T),
    /// By a texture. Where one number is wanted, it is the luminance of the colour.
    Texture(Arc<Texture>),
}

/// A colour, linear Rec. 709.
pub type Color = Input<[f32; 3]>;
/// A number.
pub type Scalar = Input<f32>;

impl<T> Input<T> {
    /// The texture, if there is one.
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
    /// A pattern that lies on the texture coordinates of the surface as they are.
    fn from(pattern: Pattern) -> Self {
        Self { pattern, to_pattern: DMat3::IDENTITY }
    }
}

/// What varies, and how the surface is laid out on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// What it shows.
    pub pattern: Pattern,
    /// From the (u, v, 1) of the surface to those of the pattern.
    pub to_pattern: DMat3,
}

impl Texture {
    /// Whether it shows colours of a mesh, which surfaces without these do not have.
    pub fn shows_colors_of_mesh(&self) -> bool {
        match &self.pattern {
            Pattern::Bitmap(_) | Pattern::Checkerboard(_) => false,
            Pattern::VertexColors | Pattern::FaceColors => true,
            Pattern::Product(_) | Pattern::Blend(_) => {
                self.pattern.parts().any(|t| t.shows_colors_of_mesh())
            }
        }
    }
}

impl Pattern {
    /// The textures that it is made of.
    pub fn parts(&self) -> impl Iterator<Item = &Arc<Texture>> {
        let (colors, share) = match self {
            Self::Product(factors) => (Some([&factors[0], &factors[1]]), None),
            Self::Blend(blend) => (Some([&blend.first, &blend.second]), blend.share.texture()),
            Self::Bitmap(_) | Self::Checkerboard(_) | Self::VertexColors | Self::FaceColors => {
                (None, None)
            }
        };
        colors.into_iter().flatten().filter_map(Color::texture).chain(share)
    }
}

/// What a texture shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// An image.
    Bitmap(Bitmap),
    /// Squares of side ½: the first colour where the fractions of u and v are on the same side of
    /// ½, the second elsewhere.
    Checkerboard([[f32; 3]; 2]),
    /// [`Mesh::colors`](crate::Mesh::colors), linear over each triangle.
    VertexColors,
    /// [`Mesh::face_colors`](crate::Mesh::face_colors).
    FaceColors,
    /// The product of two colours, channel by channel.
    Product(Box<[Color; 2]>),
    /// Something between two colours.
    Blend(Box<Blend>),
}

/// What is between two colours: (1 − t) · first + t · second.
#[derive(Clone, Debug, PartialEq)]
pub struct Blend {
    /// What is there where the share is 0.
    pub first: Color,
    /// What is there where it is 1.
    pub second: Color,
    /// The share t of the second, from 0 to 1; what a texture has beyond is taken as the nearer of the two.
    pub share: Scalar,
}

/// An image that covers the unit square: u runs along its rows from the left, v upwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Bitmap {
    /// Its values, as light or as they are: nothing is decoded any more.
    pub image: Arc<Image>,
    /// What is beyond the unit square.
    pub wrap: Wrap,
    /// What is between the middles of texels.
    pub filter: Filter,
}

/// What an image shows beyond its edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Itself again.
    #[default]
    Repeat,
    /// Itself again, mirrored every other time.
    Mirror,
    /// What is at the nearest edge.
    Clamp,
}

/// What an image shows between the middles of its texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// What the four texels around a point show, by their distances.
    #[default]
    Bilinear,
    /// The nearest texel.
    Nearest,
    /// As [`Self::Bilinear`]; but where many texels are seen at once, what they are on average.
    /// [Williams 1983, "Pyramidal Parametrics"]
    Trilinear,
}

/// How the normal of a surface differs from that of its shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Relief {
    /// By the colours of an image: 2 · rgb − 1 is the normal, in a right-handed frame of which +z is
    /// the normal of the shape, and +x the direction in which u grows.
    Normals(Arc<Texture>),
    /// As if the surface were raised by the texture's luminance times a number, in the unit of the scene.
    Heights(Arc<Texture>, f32),
}
