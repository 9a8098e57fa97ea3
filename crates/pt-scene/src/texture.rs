//! Textures: numbers that vary over a surface, by its texture coordinates (u, v), by where it is in
//! space or which way it looks, or by the colours of its mesh.

use std::sync::Arc;

use pt_math::{DAffine3, DMat3, noise};

use crate::image::Image;
use crate::medium::{Grid, GridFilter};

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
        Self { pattern, layout: TextureMapping::Surface, to_pattern: DMat3::IDENTITY }
    }
}

/// What varies, and how the surface is laid out on it: a point of it gets coordinates (u, v, w) by
/// the layout, of which the pattern shows what is at `to_pattern` (u, v), and at w. Patterns that
/// are put together of others lie as these do.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// What it shows.
    pub pattern: Pattern,
    /// What gives the surface its coordinates.
    pub layout: TextureMapping,
    /// From the (u, v, 1) of the surface to those of the pattern.
    pub to_pattern: DMat3,
}

/// What gives points of a surface their coordinates (u, v, w) on a texture. Transforms go from the
/// world, in the unit of the scene, to where the texture is; points of what moves are taken where
/// they are at the time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TextureMapping {
    /// The texture coordinates of the surface; w is 0.
    #[default]
    Surface,
    /// The point (x, y, z) itself. What is flat lies on the plane of x and y.
    Space {
        /// From the world.
        to_texture: DAffine3,
    },
    /// Its direction from the origin: the angle from +z over π, and that around it, from +x to +y,
    /// over 2π; w is 0.
    Sphere {
        /// From the world.
        to_texture: DAffine3,
    },
    /// Other texture coordinates of the mesh: the first two numbers of the
    /// [values](crate::Attributes::vertices) of the name [`TextureMapping::set_name`]; w is 0.
    Coordinates {
        /// Which ones, from 1.
        set: u32,
    },
    /// The angle around the z axis, from −x on in the direction from +x to +y, over 2π, and z; w is
    /// 0.
    Cylinder {
        /// From the world.
        to_texture: DAffine3,
    },
}

impl TextureMapping {
    /// The name of other texture coordinates among the values of a mesh.
    pub fn set_name(set: u32) -> String {
        format!("uv_{set}")
    }

    /// Returns true if it is by texture coordinates of the surface.
    fn is_on_surface(self) -> bool {
        matches!(self, Self::Surface | Self::Coordinates { .. })
    }
}

impl Texture {
    /// The same on the texture coordinates of the surface, after a transform of them.
    pub fn on_surface(pattern: Pattern, to_pattern: DMat3) -> Self {
        Self { pattern, layout: TextureMapping::Surface, to_pattern }
    }

    /// Returns true if it shows colours or values of a mesh, or lies by them, which surfaces
    /// without these do not have.
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

    /// Returns true if any part of it lies on the texture coordinates of the surface.
    pub fn uses_coordinates(&self) -> bool {
        let own = self.pattern.has_layout() && self.layout.is_on_surface();
        own || self.pattern.parts().any(|t| t.uses_coordinates())
    }

    /// Returns true if any part of it lies in space, or is by where in space the surface looks to.
    pub fn is_in_space(&self) -> bool {
        let is_laid = self.pattern.has_layout() && !self.layout.is_on_surface();
        let own = is_laid || matches!(self.pattern, Pattern::AbsNormalDot(_));
        own || self.pattern.parts().any(|t| t.is_in_space())
    }
}

impl Pattern {
    /// Returns true if it asks for the layout of its texture: what is put together, colours of
    /// meshes and normals do not.
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

    /// The textures that it is made of.
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
    /// The colour of what emits it where only a share of it is there. All channels of a texture of
    /// the share are to be equal.
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

    /// About what it is on average: of an image the mean, of two colours the middle.
    pub fn mean(&self) -> [f32; 3] {
        match self {
            Self::Value(value) => *value,
            Self::Texture(texture) => texture.pattern.mean(),
        }
    }
}

impl Pattern {
    /// See [`Color::mean`]; colours of meshes are not known here, and count as black.
    pub fn mean(&self) -> [f32; 3] {
        match self {
            Self::Bitmap(bitmap) => {
                let pixels = &bitmap.image.pixels;
                let add = |sum: [f64; 3], p: &[f32; 3]| [0, 1, 2].map(|c| sum[c] + f64::from(p[c]));
                let sum = pixels.iter().fold([0.0; 3], add);
                sum.map(|sum| (sum / pixels.len().max(1) as f64) as f32)
            }
            Self::Checkerboard([a, b]) | Self::Checkerboard3d([a, b]) => {
                [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))
            }
            Self::Dots([inside, outside]) => {
                [0, 1, 2].map(|c| outside[c] + (inside[c] - outside[c]) * DOTS)
            }
            Self::Fbm(_)
            | Self::Windy
            | Self::VertexColors
            | Self::FaceColors
            | Self::VertexAttribute(_)
            | Self::FaceAttribute(_) => [0.0; 3],
            Self::Wrinkled(Noise { octaves, roughness }) => {
                let worth = std::iter::successors(Some(1.0), |worth| Some(worth * roughness));
                let sum: f32 = worth.take(*octaves as usize).sum();
                [sum * noise::MEAN_MAGNITUDE; 3]
            }
            Self::Marble(_) => MARBLE,
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
    /// About what it is on average, where all channels of its texture are equal.
    pub fn mean(&self) -> f32 {
        match self {
            Self::Value(value) => *value,
            Self::Texture(texture) => texture.pattern.mean()[0],
        }
    }
}

/// The share that [`Pattern::Dots`] cover: of the squares 0.394 have one.
const DOTS: f32 = 0.394 * std::f32::consts::PI * 0.35 * 0.35;
/// About the mean of [`Pattern::Marble`].
const MARBLE: [f32; 3] = [0.82, 0.82, 0.85];

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
    /// The values of this name of [`Attributes::vertices`](crate::Attributes::vertices), linear
    /// over each triangle.
    VertexAttribute(String),
    /// The values of this name of [`Attributes::faces`](crate::Attributes::faces).
    FaceAttribute(String),
    /// Cubes of side ½: the first colour where an even number of the fractions of u, v and w is
    /// above ½, the second elsewhere.
    Checkerboard3d([[f32; 3]; 2]),
    /// Dots of radius 0.35, of the first colour, on the second one: about two in five squares of
    /// side 1 around whole numbers have one, not quite in the middle. [Pharr, Jakob &
    /// Humphreys, "Physically Based Rendering", 3rd ed., §10.5.2]
    Dots([[f32; 3]; 2]),
    /// Fractional Brownian motion: noise of both signs, with finer and finer features. [ibid.,
    /// §10.6.3]
    Fbm(Noise),
    /// Turbulence: the same of noise without its sign, so that it has creases. [ibid., §10.6.3]
    Wrinkled(Noise),
    /// Waves that are higher in some places than in others, as wind makes them: |fbm(p / 10)| ·
    /// fbm(p), of 3 and 6 octaves. [ibid., §10.6.5]
    Windy,
    /// Layers of stone along v, which noise bends. [ibid., §10.6.6]
    Marble(Marble),
    /// The numbers of a grid, of one channel or of three, which fills the cube [0, 1]³ of (u, v,
    /// w); beyond it, it is as at its walls.
    Grid {
        /// The numbers.
        grid: Arc<Grid>,
        /// Interpolation between cell centres.
        filter: GridFilter,
    },
    /// How much the surface looks along a line in the world: the magnitude of the cosine between
    /// this direction, of any length but 0, and the normal of its shape.
    AbsNormalDot([f32; 3]),
    /// The product of two colours, channel by channel.
    Product(Box<[Color; 2]>),
    /// Something between two colours.
    Blend(Box<Blend>),
    /// The square root of a colour, channel by channel; 0 of what is below 0.
    Sqrt(Color),
}

/// Of how many octaves of noise a pattern is the sum: at most [`Self::MAX_OCTAVES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Count.
    pub octaves: u32,
    /// What each is worth over the one before, from 0 to 2.
    pub roughness: f32,
}

impl Noise {
    /// Most octaves; of finer ones single precision knows nothing.
    pub const MAX_OCTAVES: u32 = 32;
}

impl Default for Noise {
    fn default() -> Self {
        Self { octaves: 8, roughness: 0.5 }
    }
}

/// Layers that noise bends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marble {
    /// Those of the noise.
    pub noise: Noise,
    /// By how much the noise bends the layers; 2π is the thickness of one.
    pub variation: f32,
}

/// What is between two colours: (1 − t) · first + t · second.
#[derive(Clone, Debug, PartialEq)]
pub struct Blend {
    /// What is there where the share is 0.
    pub first: Color,
    /// What is there where it is 1.
    pub second: Color,
    /// The share t of the second, from 0 to 1; what a texture has beyond is taken as the nearer of
    /// the two.
    pub amount: Scalar,
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
pub struct Wrap {
    /// To the left and to the right.
    pub u: Edge,
    /// Below and above.
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

    /// The same along u and v.
    pub const fn both(edge: Edge) -> Self {
        Self { u: edge, v: edge }
    }
}

/// What an image shows beyond two opposite edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Edge {
    /// Itself again.
    #[default]
    Repeat,
    /// Itself again, mirrored every other time.
    Mirror,
    /// What is at the nearest edge.
    Clamp,
    /// Nothing: texels beyond the image are black.
    Black,
}

impl Edge {
    /// Which texel of a row of `n` stands for number `i` of an endless row; `None` where that is
    /// black.
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

/// Interpolation between texel centres.
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
pub enum NormalOrBump {
    /// By the colours of an image: 2 · rgb − 1 is the normal, in a right-handed frame of which +z
    /// is the normal of the shape, and +x the direction in which u grows.
    Normals(Arc<Texture>),
    /// The same in a frame of which +x is the direction in which u of the image grows, after its
    /// transform: where the image is turned, its relief turns with it.
    TurnedNormals(Arc<Texture>),
    /// The same in a frame of which +x is a ∂p/∂u + b ∂p/∂v: the second texture has a and b in its
    /// first two channels.
    NormalsAlong(Arc<Texture>, Arc<Texture>),
    /// As if the surface were raised by the texture's luminance times a number, in the unit of the
    /// scene.
    Heights(Arc<Texture>, f32),
}
