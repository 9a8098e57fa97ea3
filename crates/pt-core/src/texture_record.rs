//! Records of compiled textures.

use pt_math::{Affine2, DAffine3, Spectrum, Vec3};
use pt_scene::texture::{Filter, Procedural, Wrap};

use crate::id::Id;
use crate::image_texture::Texels;

/// A pattern, and its transform from surface coordinates.
#[derive(Clone, Copy, Debug)]
pub struct TextureRecord {
    /// The pattern.
    pub pattern: PatternRecord,
    /// Transform from (u, v) of the surface to coordinates of the pattern.
    pub to_pattern: Affine2,
}

/// A pattern; see [`pt_scene::texture::Pattern`].
#[derive(Clone, Copy, Debug)]
pub enum PatternRecord {
    /// An image.
    Bitmap(Id<Texels>, Wrap, Filter),
    /// Checkerboard of squares of side ½.
    Checkerboard([Spectrum; 2]),
    /// Colours at the corners of triangles, interpolated linearly; index into
    /// [`Textures::mesh_colors`](crate::texture::Textures::mesh_colors).
    VertexColors(u32),
    /// Colours of triangles; index into
    /// [`Textures::mesh_colors`](crate::texture::Textures::mesh_colors).
    FaceColors(u32),
    /// Product of two factors.
    Product([Factor; 2]),
    /// Interpolation between two colours, by the weight of the second.
    Blend([Factor; 2], FloatTexture),
    /// Square root.
    Root(Factor),
    /// Pattern with another mapping, or a procedural one.
    Laid(Id<MappedTexture>),
    /// Magnitude of the cosine between the normal and this unit vector in world space.
    Facing(Vec3),
}

/// A pattern with a mapping.
#[derive(Clone, Copy, Debug)]
pub struct MappedTexture {
    /// Mapping from points to coordinates.
    pub layout: TextureMappingRecord,
    /// Transform from the first two coordinates to those of the pattern.
    pub to_pattern: Affine2,
    /// The pattern.
    pub pattern: MappedPattern,
}

/// Pattern of a [`MappedTexture`].
#[derive(Clone, Copy, Debug)]
pub enum MappedPattern {
    /// An image or a checkerboard.
    Flat(PatternRecord),
    /// Procedural pattern.
    Procedural(Procedural),
    /// A grid; index into [`Textures::grids`](crate::texture::Textures::grids).
    Grid(u32),
}

/// See [`pt_scene::texture::TextureMapping`]; transforms are from world space, in metres.
#[derive(Clone, Copy, Debug)]
pub enum TextureMappingRecord {
    /// The texture coordinates of the surface.
    Surface,
    /// The point itself.
    Space(DAffine3),
    /// Direction of the point from the origin.
    Sphere(DAffine3),
    /// Values of the mesh; index into
    /// [`Textures::mesh_colors`](crate::texture::Textures::mesh_colors).
    Values(u32),
    /// Angle of the point around the z axis, and its height.
    Cylinder(DAffine3),
}

/// A parameter that is a constant or a texture.
#[derive(Clone, Copy, Debug)]
pub enum FloatTexture {
    /// Constant value.
    Value(f32),
    /// Luminance of a texture.
    Texture(Id<TextureRecord>),
}

/// A colour that is combined with another.
#[derive(Clone, Copy, Debug)]
pub enum Factor {
    /// Constant colour.
    Value(Spectrum),
    /// Colour of a texture, which has its own coordinates.
    Texture(Id<TextureRecord>),
}
