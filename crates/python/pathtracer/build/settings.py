"""Settings of a scene.

Generated from the schema of scene files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

from ._part import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._part import Vector


@dataclass(kw_only=True, eq=False, repr=False)
class Settings(Part):
    """Settings of a render that belong to the scene.

    Parameters
    ----------
    aovs : sequence of {"albedo", "normal", "geometric_normal", "depth", "position", "uv",
    "primitive", "object", "material", "samples", "variance", "refused", "half_a", "half_b",
    "cryptomatte_object", "cryptomatte_material", "alpha", "motion"}, optional
        Names of further channels.
    crop : sequence of numbers, optional
        Column and row of the upper left pixel of the crop window, its width and its height.
    filter : Filter, optional
        Reconstruction filter.
    hidden : {"nothing", "background", "emitters"}, default "nothing"
        What is hidden from the camera.
    integrator : {"path", "reference", "volpath", "direct", "ao", "normals", "cs184"}, optional
        Name of the integrator.
    max_depth : int, optional
        Maximum number of bounces.
    resolution : sequence of numbers, optional
        Width and height of the image in pixels.
    sides_by_shading_normal : bool, default False
        True if interpolated normals alone separate the front of a mesh from its back.
    spp : int, optional
        Samples per pixel.
    straight_is_free : bool, default False
        True if the maximum depth does not count straight transmission through thin glass.
    """

    aovs: (
        Sequence[Literal["albedo", "normal", "geometric_normal", "depth", "position", "uv",
        "primitive", "object", "material", "samples", "variance", "refused", "half_a", "half_b",
        "cryptomatte_object", "cryptomatte_material", "alpha", "motion"]] | None
    ) = None
    crop: Vector | None = None
    filter: Filter | None = None
    hidden: Literal["nothing", "background", "emitters"] | None = None
    integrator: (
        Literal["path", "reference", "volpath", "direct", "ao", "normals", "cs184"] | None
    ) = None
    max_depth: int | None = None
    resolution: Vector | None = None
    sides_by_shading_normal: bool | None = None
    spp: int | None = None
    straight_is_free: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class BoxFilter(Part):
    """Reconstruction filter of type ``box``."""

    type: ClassVar[str | None] = "box"


@dataclass(kw_only=True, eq=False, repr=False)
class TentFilter(Part):
    """Reconstruction filter of type ``tent``.

    Parameters
    ----------
    radius : float, default 1
        Radius in pixels.
    """

    type: ClassVar[str | None] = "tent"
    radius: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class GaussianFilter(Part):
    """Reconstruction filter of type ``gaussian``.

    Parameters
    ----------
    radius : float, default 2
        Radius in pixels.
    stddev : float, default 0.5
        Standard deviation in pixels.
    """

    type: ClassVar[str | None] = "gaussian"
    radius: float | None = None
    stddev: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MitchellFilter(Part):
    """Reconstruction filter of type ``mitchell``.

    Parameters
    ----------
    b : float, default 0.3333333333333333
        Parameter B.
    c : float, default 0.3333333333333333
        Parameter C.
    """

    type: ClassVar[str | None] = "mitchell"
    b: float | None = None
    c: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class BlackmanHarrisFilter(Part):
    """Reconstruction filter of type ``blackman_harris``.

    Parameters
    ----------
    radius : float, default 1.5
        Radius in pixels.
    """

    type: ClassVar[str | None] = "blackman_harris"
    radius: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class LanczosFilter(Part):
    """Reconstruction filter of type ``lanczos``.

    Parameters
    ----------
    lobes : float, default 3
        Number of lobes.
    """

    type: ClassVar[str | None] = "lanczos"
    lobes: float | None = None


Filter: TypeAlias = (
    BoxFilter
    | TentFilter
    | GaussianFilter
    | MitchellFilter
    | BlackmanHarrisFilter
    | LanczosFilter
    | Mapping[str, Any]
    | Literal[
        "box",
        "tent",
        "gaussian",
        "mitchell",
        "blackman_harris",
        "lanczos",
    ]
)
