"""Steps of transforms.

Generated from the schema of scene files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from ._part import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._part import Array, Color, Vector


@dataclass(kw_only=True, eq=False, repr=False)
class Translate(Part):
    """Translation.

    Parameters
    ----------
    translate : sequence of numbers
        Translation, of shape (3,), or (2,) for textures.
    """

    translate: Vector


@dataclass(kw_only=True, eq=False, repr=False)
class Rotate(Part):
    """Rotation.

    Parameters
    ----------
    rotate : float
        Angle in degrees, counter-clockwise as seen from the tip of the axis.
    axis : sequence of numbers, optional
        Axis of the rotation; +y by default, and none for textures.
    """

    rotate: float
    axis: Vector | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Scale(Part):
    """Scaling.

    Parameters
    ----------
    scale : float or color
        Factor of all axes, or of each.
    """

    scale: Color


@dataclass(kw_only=True, eq=False, repr=False)
class LookAt(Part):
    """Placement of a camera or light by the point at which it looks.

    Parameters
    ----------
    look_at : sequence of numbers
        Point at which a camera or light looks, along -z.
    from_ : sequence of numbers, optional
        Position of the camera or light; the origin by default.
    up : sequence of numbers, optional
        Direction on the side of +y; +y by default.
    """

    look_at: Vector
    from_: Vector | None = None
    up: Vector | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Matrix(Part):
    """Matrix of a transform.

    Parameters
    ----------
    matrix : array_like
        Rows of the matrix, of shape (3, 4) or (4, 4), or (3, 3) for textures.
    """

    matrix: Array


Step: TypeAlias = (
    Translate
    | Rotate
    | Scale
    | LookAt
    | Matrix
    | Mapping[str, Any]
)


@dataclass(kw_only=True, eq=False, repr=False)
class MotionKey(Part):
    """Transform at a time.

    Parameters
    ----------
    time : float
        Time in seconds.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    time: float
    to_world: Step | Sequence[Step] | Array | None = None
