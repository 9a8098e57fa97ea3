"""Participating media.

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
    from .transforms import Step


@dataclass(kw_only=True, eq=False, repr=False)
class HomogeneousMedium(Part):
    """Medium of type ``homogeneous``.

    Parameters
    ----------
    extinction : float or color
        Extinction per unit of length.
    albedo : float or color, default 0
        Fraction of the extinction that is scattered, from 0 to 1.
    emission : float or color, default 0
        Radiance of so thick a layer that nothing is seen through it, if it only absorbs.
    name : str, optional
        Name.
    phase : Phase, default "isotropic"
        Distribution of the directions of scattered light, one of the phase functions.
    """

    type: ClassVar[str | None] = "homogeneous"
    table: ClassVar[str | None] = "media"
    extinction: Color
    albedo: Color | None = None
    emission: Color | None = None
    name: str | None = None
    phase: Phase | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class HeterogeneousMedium(Part):
    """Medium of type ``heterogeneous``.

    Parameters
    ----------
    extinction : PlacedGrid
        Extinction, one channel or three.
    albedo : float or color or PlacedGrid, default 0
        Fraction of the extinction that is scattered.
    emission : float or color or PlacedGrid or BlackBody, default 0
        Radiance of an opaque layer that only absorbs; `{ "temperature": …, "scale": 1 }` is thermal
        emission by a placed grid of kelvins, whose peak wavelength has the radiance `scale`.
    name : str, optional
        Name.
    phase : Phase, default "isotropic"
        Distribution of the directions of scattered light, one of the phase functions.
    scale : float, default 1
        Factor of the extinction.
    """

    type: ClassVar[str | None] = "heterogeneous"
    table: ClassVar[str | None] = "media"
    extinction: PlacedGrid | Mapping[str, Any]
    albedo: Color | PlacedGrid | Mapping[str, Any] | None = None
    emission: Color | PlacedGrid | Mapping[str, Any] | BlackBody | Mapping[str, Any] | None = None
    name: str | None = None
    phase: Phase | None = None
    scale: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class CloudMedium(Part):
    """Medium of type ``cloud``.

    Parameters
    ----------
    extinction : float or color
        Extinction of the densest part, per unit of length of the scene.
    albedo : float or color, default 0
        Fraction of the extinction that is scattered.
    density : float, default 1
        Density; values of more than the maximum are clamped to it.
    frequency : float, default 5
        Number of clumps along each axis from 0 to 1.
    high : float or color, default 1
        Upper corner of it.
    low : float or color, default 0
        Lower corner of the box of the cloud, in its own coordinates.
    name : str, optional
        Name.
    phase : Phase, default "isotropic"
        Distribution of the directions of scattered light, one of the phase functions.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    wispiness : float, default 1
        Raggedness of the edges.
    """

    type: ClassVar[str | None] = "cloud"
    table: ClassVar[str | None] = "media"
    extinction: Color
    albedo: Color | None = None
    density: float | None = None
    frequency: float | None = None
    high: Color | None = None
    low: Color | None = None
    name: str | None = None
    phase: Phase | None = None
    to_world: Step | Sequence[Step] | Array | None = None
    wispiness: float | None = None


Medium: TypeAlias = (
    HomogeneousMedium
    | HeterogeneousMedium
    | CloudMedium
    | Mapping[str, Any]
)


@dataclass(kw_only=True, eq=False, repr=False)
class IsotropicPhase(Part):
    """Phase function of type ``isotropic``."""

    type: ClassVar[str | None] = "isotropic"


@dataclass(kw_only=True, eq=False, repr=False)
class HenyeyGreensteinPhase(Part):
    """Phase function of type ``henyey_greenstein``.

    Parameters
    ----------
    g : float
        Mean cosine of the scattering angle, between -1 and 1.
    """

    type: ClassVar[str | None] = "henyey_greenstein"
    g: float


@dataclass(kw_only=True, eq=False, repr=False)
class RayleighPhase(Part):
    """Phase function of type ``rayleigh``."""

    type: ClassVar[str | None] = "rayleigh"


@dataclass(kw_only=True, eq=False, repr=False)
class TablePhase(Part):
    """Phase function of type ``table``.

    Parameters
    ----------
    values : array_like
        Values at equidistant cosines of the scattering angle, from -1 to 1.
    """

    type: ClassVar[str | None] = "table"
    values: Array


@dataclass(kw_only=True, eq=False, repr=False)
class MicroflakesPhase(Part):
    """Phase function of type ``microflakes``.

    Parameters
    ----------
    matrices : PlacedGrid
        Six numbers of each cell: xx, yy, zz, xy, xz, yz of the matrix S.
    """

    type: ClassVar[str | None] = "microflakes"
    matrices: PlacedGrid | Mapping[str, Any]


@dataclass(kw_only=True, eq=False, repr=False)
class BlendPhase(Part):
    """Phase function of type ``blend``.

    Parameters
    ----------
    first : Phase
        Colour for the weight 0.
    second : Phase
        Colour for the weight 1.
    amount : float, default 0.5
        Weight t, clamped to 0 to 1.
    """

    type: ClassVar[str | None] = "blend"
    first: Phase
    second: Phase
    amount: float | None = None


Phase: TypeAlias = (
    IsotropicPhase
    | HenyeyGreensteinPhase
    | RayleighPhase
    | TablePhase
    | MicroflakesPhase
    | BlendPhase
    | Mapping[str, Any]
    | Literal[
        "isotropic",
        "rayleigh",
    ]
)


@dataclass(kw_only=True, eq=False, repr=False)
class PlacedGrid(Part):
    """Grid with a transform from the unit cube.

    Parameters
    ----------
    grid : str or Grid
        The grid, or the name of one.
    filter : {"trilinear", "nearest"}, default "trilinear"
        Interpolation between cells.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    grid: str | Grid | Mapping[str, Any]
    filter: Literal["trilinear", "nearest"] | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Grid(Part):
    """Values in the cells of a box.

    Parameters
    ----------
    channels : {1, 3, 6}, default 1
        Number of values of each cell: 1, 3 or 6.
    file : str or os.PathLike, optional
        Path of a .vol file; resolution and values replace it.
    resolution : sequence of numbers, optional
        Number of cells along x, y and z.
    values : array_like, optional
        Values, of shape (n,) or (z, y, x, channels).
    """

    table: ClassVar[str | None] = "grids"
    channels: Literal[1, 3, 6] | None = None
    file: str | PathLike[str] | None = None
    resolution: Vector | None = None
    values: Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class BlackBody(Part):
    """Thermal emission of a medium.

    Parameters
    ----------
    temperature : PlacedGrid
        Temperatures in kelvins.
    scale : float, default 1
        Radiance of the wavelength of the peak.
    """

    temperature: PlacedGrid | Mapping[str, Any]
    scale: float | None = None
