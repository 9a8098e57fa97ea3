"""Textures and images.

Generated from the schema of scene files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

from ._part import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._part import Array, Color, Vector
    from .media import Grid
    from .transforms import Step


@dataclass(kw_only=True, eq=False, repr=False)
class BitmapTexture(Part):
    """Texture of type ``bitmap``.

    Parameters
    ----------
    image : str or Image
        An entry of `images`, or `{ "file": …, "raw": false }`, in any of the image formats, or rows
        of `pixels`.
    filter : {"bilinear", "nearest", "trilinear"}, default "bilinear"
        Interpolation between texels; `trilinear` also averages over the footprint of a path by
        mipmaps [Williams 1983, "Pyramidal Parametrics"].
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    wrap : {"repeat", "mirror", "clamp", "black"} or sequence of {"repeat", "mirror", "clamp",
    "black"}, default "repeat"
        Continuation beyond the image; a list of two for u and v.
    """

    type: ClassVar[str | None] = "bitmap"
    table: ClassVar[str | None] = "textures"
    image: str | Image | Mapping[str, Any]
    filter: Literal["bilinear", "nearest", "trilinear"] | None = None
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None
    wrap: (
        Literal["repeat", "mirror", "clamp", "black"] | Sequence[Literal["repeat", "mirror",
        "clamp", "black"]] | None
    ) = None


@dataclass(kw_only=True, eq=False, repr=False)
class CheckerboardTexture(Part):
    """Texture of type ``checkerboard``.

    Parameters
    ----------
    colors : sequence of float or color
        Colours of the squares.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "checkerboard"
    table: ClassVar[str | None] = "textures"
    colors: Sequence[Color]
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class VertexColorsTexture(Part):
    """Texture of type ``vertex_colors``.

    Parameters
    ----------
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "vertex_colors"
    table: ClassVar[str | None] = "textures"
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class FaceColorsTexture(Part):
    """Texture of type ``face_colors``.

    Parameters
    ----------
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "face_colors"
    table: ClassVar[str | None] = "textures"
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class VertexAttributeTexture(Part):
    """Texture of type ``vertex_attribute``.

    Parameters
    ----------
    name : str
        Name of the attribute.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "vertex_attribute"
    table: ClassVar[str | None] = "textures"
    name: str
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class FaceAttributeTexture(Part):
    """Texture of type ``face_attribute``.

    Parameters
    ----------
    name : str
        Name of the attribute.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "face_attribute"
    table: ClassVar[str | None] = "textures"
    name: str
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Checkerboard3dTexture(Part):
    """Texture of type ``checkerboard3d``.

    Parameters
    ----------
    colors : sequence of float or color
        Colours of the cubes.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "checkerboard3d"
    table: ClassVar[str | None] = "textures"
    colors: Sequence[Color]
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class DotsTexture(Part):
    """Texture of type ``dots``.

    Parameters
    ----------
    colors : sequence of float or color
        Colour of the dots, and around them.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "dots"
    table: ClassVar[str | None] = "textures"
    colors: Sequence[Color]
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class FbmTexture(Part):
    """Texture of type ``fbm``.

    Parameters
    ----------
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    octaves : int, default 8
        Number of octaves, at most 32.
    roughness : float, default 0.5
        Ratio of the amplitudes of successive octaves, from 0 to 2.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "fbm"
    table: ClassVar[str | None] = "textures"
    layout: TextureLayout | None = None
    octaves: int | None = None
    roughness: float | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class WrinkledTexture(Part):
    """Texture of type ``wrinkled``.

    Parameters
    ----------
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    octaves : int, default 8
        Number of octaves, at most 32.
    roughness : float, default 0.5
        Ratio of the amplitudes of successive octaves, from 0 to 2.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "wrinkled"
    table: ClassVar[str | None] = "textures"
    layout: TextureLayout | None = None
    octaves: int | None = None
    roughness: float | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class WindyTexture(Part):
    """Texture of type ``windy``.

    Parameters
    ----------
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "windy"
    table: ClassVar[str | None] = "textures"
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MarbleTexture(Part):
    """Texture of type ``marble``.

    Parameters
    ----------
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    octaves : int, default 8
        Number of octaves of the noise, at most 32.
    roughness : float, default 0.5
        Ratio of the amplitudes of successive octaves, from 0 to 2.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    variation : float, default 0.2
        Amplitude of the distortion; 2π is the thickness of a layer.
    """

    type: ClassVar[str | None] = "marble"
    table: ClassVar[str | None] = "textures"
    layout: TextureLayout | None = None
    octaves: int | None = None
    roughness: float | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None
    variation: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class GridTexture(Part):
    """Texture of type ``grid``.

    Parameters
    ----------
    grid : str or Grid
        An entry of `grids`, or a grid.
    filter : {"trilinear", "nearest"}, default "trilinear"
        Interpolation between cell centres.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "grid"
    table: ClassVar[str | None] = "textures"
    grid: str | Grid | Mapping[str, Any]
    filter: Literal["trilinear", "nearest"] | None = None
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class AbsNormalDotTexture(Part):
    """Texture of type ``abs_normal_dot``.

    Parameters
    ----------
    direction : sequence of numbers
        Direction in the world, of any length but 0.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "abs_normal_dot"
    table: ClassVar[str | None] = "textures"
    direction: Vector
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class ProductTexture(Part):
    """Texture of type ``product``.

    Parameters
    ----------
    factors : sequence of float or color or str or Texture
        The factors.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "product"
    table: ClassVar[str | None] = "textures"
    factors: Sequence[Color | str | Texture]
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class BlendTexture(Part):
    """Texture of type ``blend``.

    Parameters
    ----------
    first : float or color or str or Texture
        Colour for the weight 0.
    second : float or color or str or Texture
        Colour for the weight 1.
    amount : float or str or Texture, default 0.5
        Weight t, clamped to 0 to 1.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "blend"
    table: ClassVar[str | None] = "textures"
    first: Color | str | Texture
    second: Color | str | Texture
    amount: float | str | Texture | None = None
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class SqrtTexture(Part):
    """Texture of type ``sqrt``.

    Parameters
    ----------
    square : float or color or str or Texture
        The square.
    layout : TextureLayout, default "surface"
        Mapping from points of a surface to coordinates.
    to_pattern : Step or sequence of Step or array_like, optional
        Transform of the coordinates (u, v).
    """

    type: ClassVar[str | None] = "sqrt"
    table: ClassVar[str | None] = "textures"
    square: Color | str | Texture
    layout: TextureLayout | None = None
    to_pattern: Step | Sequence[Step] | Array | None = None


Texture: TypeAlias = (
    BitmapTexture
    | CheckerboardTexture
    | VertexColorsTexture
    | FaceColorsTexture
    | VertexAttributeTexture
    | FaceAttributeTexture
    | Checkerboard3dTexture
    | DotsTexture
    | FbmTexture
    | WrinkledTexture
    | WindyTexture
    | MarbleTexture
    | GridTexture
    | AbsNormalDotTexture
    | ProductTexture
    | BlendTexture
    | SqrtTexture
    | Mapping[str, Any]
    | Literal[
        "vertex_colors",
        "face_colors",
        "fbm",
        "wrinkled",
        "windy",
        "marble",
    ]
)


@dataclass(kw_only=True, eq=False, repr=False)
class SurfaceMapping(Part):
    """Layout of a texture of type ``surface``."""

    type: ClassVar[str | None] = "surface"


@dataclass(kw_only=True, eq=False, repr=False)
class SpaceMapping(Part):
    """Layout of a texture of type ``space``.

    Parameters
    ----------
    to_texture : Step or sequence of Step or array_like, optional
        Transform from the world to the coordinates of the texture.
    """

    type: ClassVar[str | None] = "space"
    to_texture: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class SphereMapping(Part):
    """Layout of a texture of type ``sphere``.

    Parameters
    ----------
    to_texture : Step or sequence of Step or array_like, optional
        Transform from the world to the coordinates of the texture.
    """

    type: ClassVar[str | None] = "sphere"
    to_texture: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class CoordinatesMapping(Part):
    """Layout of a texture of type ``coordinates``.

    Parameters
    ----------
    set : int, default 1
        Number of the set of texture coordinates.
    """

    type: ClassVar[str | None] = "coordinates"
    set: int | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class CylinderMapping(Part):
    """Layout of a texture of type ``cylinder``.

    Parameters
    ----------
    to_texture : Step or sequence of Step or array_like, optional
        Transform from the world to the coordinates of the texture.
    """

    type: ClassVar[str | None] = "cylinder"
    to_texture: Step | Sequence[Step] | Array | None = None


TextureLayout: TypeAlias = (
    SurfaceMapping
    | SpaceMapping
    | SphereMapping
    | CoordinatesMapping
    | CylinderMapping
    | Mapping[str, Any]
    | Literal[
        "surface",
        "space",
        "sphere",
        "coordinates",
        "cylinder",
    ]
)


@dataclass(kw_only=True, eq=False, repr=False)
class Image(Part):
    """Image of a texture or an environment.

    Parameters
    ----------
    file : str or os.PathLike, optional
        Path of an image file; pixels replace it.
    pixels : array_like, optional
        Colours of shape (height, width, 3), or greys of shape (height, width), top row first: real
        numbers in linear light, or sRGB levels of uint8.
    raw : bool, default False
        True if levels are no sRGB but values divided by the highest level.
    """

    table: ClassVar[str | None] = "images"
    file: str | PathLike[str] | None = None
    pixels: Array | None = None
    raw: bool | None = None
