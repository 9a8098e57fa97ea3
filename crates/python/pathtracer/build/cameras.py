"""Cameras.

Generated from the schema of scene files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

from ._part import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._part import Array, Vector
    from .media import Medium
    from .objects import Mesh, Points
    from .transforms import MotionKey, Step


@dataclass(kw_only=True, eq=False, repr=False)
class PanoramaCamera(Part):
    """Camera of type ``panorama``.

    Parameters
    ----------
    aperture : Aperture, optional
        Shape of the lens; a disk by default.
    far : float, optional
        Distance of the far clipping plane; infinite by default.
    fit : {"whole", "width", "height"}, default "whole"
        Side of the view that is kept if the image has another aspect ratio.
    focal_distance : float, default 1
        Distance of the plane of focus.
    lens_radius : float, default 0
        Radius of the lens; 0 for a pinhole.
    medium : Medium or str, optional
        Medium around the camera.
    meter : Meter, optional
        Meter that replaces the image.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    near : float, default 0.001
        Distance of the near clipping plane.
    placement : {"node", "course", "fit"}, default "node"
        Node: as given; fit and course: so that all surfaces are visible.
    principal_point_offset : sequence of numbers, default [0, 0]
        Offset of the film, in fractions of its width and height.
    shutter : sequence of numbers, default [0, 0]
        Times at which the shutter opens and closes, in seconds.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "panorama"
    aperture: Aperture | Mapping[str, Any] | None = None
    far: float | None = None
    fit: Literal["whole", "width", "height"] | None = None
    focal_distance: float | None = None
    lens_radius: float | None = None
    medium: Medium | str | None = None
    meter: Meter | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    near: float | None = None
    placement: Literal["node", "course", "fit"] | None = None
    principal_point_offset: Vector | None = None
    shutter: Vector | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PerspectiveCamera(Part):
    """Camera of type ``perspective``.

    Parameters
    ----------
    aperture : Aperture, optional
        Shape of the lens; a disk by default.
    far : float, optional
        Distance of the far clipping plane; infinite by default.
    fit : {"whole", "width", "height"}, default "whole"
        Side of the view that is kept if the image has another aspect ratio.
    focal_distance : float, default 1
        Distance of the plane of focus.
    lens_radius : float, default 0
        Radius of the lens; 0 for a pinhole.
    medium : Medium or str, optional
        Medium around the camera.
    meter : Meter, optional
        Meter that replaces the image.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    near : float, default 0.001
        Distance of the near clipping plane.
    placement : {"node", "course", "fit"}, default "node"
        Node: as given; fit and course: so that all surfaces are visible.
    principal_point_offset : sequence of numbers, default [0, 0]
        Offset of the film, in fractions of its width and height.
    shutter : sequence of numbers, default [0, 0]
        Times at which the shutter opens and closes, in seconds.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    x_fov : float, optional
        Horizontal angle of the whole view in degrees, below 180.
    y_fov : float, optional
        Vertical angle of the whole view in degrees, below 180.
    """

    type: ClassVar[str | None] = "perspective"
    aperture: Aperture | Mapping[str, Any] | None = None
    far: float | None = None
    fit: Literal["whole", "width", "height"] | None = None
    focal_distance: float | None = None
    lens_radius: float | None = None
    medium: Medium | str | None = None
    meter: Meter | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    near: float | None = None
    placement: Literal["node", "course", "fit"] | None = None
    principal_point_offset: Vector | None = None
    shutter: Vector | None = None
    to_world: Step | Sequence[Step] | Array | None = None
    x_fov: float | None = None
    y_fov: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class OrthographicCamera(Part):
    """Camera of type ``orthographic``.

    Parameters
    ----------
    aperture : Aperture, optional
        Shape of the lens; a disk by default.
    far : float, optional
        Distance of the far clipping plane; infinite by default.
    fit : {"whole", "width", "height"}, default "whole"
        Side of the view that is kept if the image has another aspect ratio.
    focal_distance : float, default 1
        Distance of the plane of focus.
    half_height : float, optional
        Half of the height of the view.
    half_width : float, optional
        Half of the width of the view.
    lens_radius : float, default 0
        Radius of the lens; 0 for a pinhole.
    medium : Medium or str, optional
        Medium around the camera.
    meter : Meter, optional
        Meter that replaces the image.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    near : float, default 0.001
        Distance of the near clipping plane.
    placement : {"node", "course", "fit"}, default "node"
        Node: as given; fit and course: so that all surfaces are visible.
    principal_point_offset : sequence of numbers, default [0, 0]
        Offset of the film, in fractions of its width and height.
    shutter : sequence of numbers, default [0, 0]
        Times at which the shutter opens and closes, in seconds.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "orthographic"
    aperture: Aperture | Mapping[str, Any] | None = None
    far: float | None = None
    fit: Literal["whole", "width", "height"] | None = None
    focal_distance: float | None = None
    half_height: float | None = None
    half_width: float | None = None
    lens_radius: float | None = None
    medium: Medium | str | None = None
    meter: Meter | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    near: float | None = None
    placement: Literal["node", "course", "fit"] | None = None
    principal_point_offset: Vector | None = None
    shutter: Vector | None = None
    to_world: Step | Sequence[Step] | Array | None = None


Camera: TypeAlias = (
    PanoramaCamera
    | PerspectiveCamera
    | OrthographicCamera
    | Mapping[str, Any]
    | Literal[
        "panorama",
    ]
)


@dataclass(kw_only=True, eq=False, repr=False)
class Aperture(Part):
    """Polygonal aperture of a lens.

    Parameters
    ----------
    blades : int
        Number of blades of the diaphragm, at least 3.
    rotation : float, default 0
        Rotation of the polygon, in degrees.
    """

    blades: int
    rotation: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class SphereMeter(Part):
    """Surface over which a camera measures one number in place of an image, of type ``sphere``.

    Parameters
    ----------
    quantity : {"irradiance", "radiance"}
        Measured quantity: irradiance of the front of the surface, or radiance of parallel rays
        along the axis of the camera.
    radius : float, default 1
        Radius of the sphere.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "sphere"
    quantity: Literal["irradiance", "radiance"]
    radius: float | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MeshMeter(Part):
    """Surface over which a camera measures one number in place of an image, of type ``mesh``.

    Parameters
    ----------
    mesh : str or Mesh
        The mesh, or the name of one.
    quantity : {"irradiance", "radiance"}
        Measured quantity: irradiance of the front of the surface, or radiance of parallel rays
        along the axis of the camera.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "mesh"
    mesh: str | Mesh | Mapping[str, Any]
    quantity: Literal["irradiance", "radiance"]
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PointsMeter(Part):
    """Surface over which a camera measures one number in place of an image, of type ``points``.

    Parameters
    ----------
    points : str or Points
        The points, or the name of an entry.
    quantity : {"irradiance", "radiance"}
        Measured quantity: irradiance of the front of the surface, or radiance of parallel rays
        along the axis of the camera.
    radius : float, optional
        Radius of spheres and cylinders.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "points"
    points: str | Points | Mapping[str, Any]
    quantity: Literal["irradiance", "radiance"]
    radius: float | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class RectangleMeter(Part):
    """Surface over which a camera measures one number in place of an image, of type ``rectangle``.

    Parameters
    ----------
    quantity : {"irradiance", "radiance"}
        Measured quantity: irradiance of the front of the surface, or radiance of parallel rays
        along the axis of the camera.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "rectangle"
    quantity: Literal["irradiance", "radiance"]
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class CubeMeter(Part):
    """Surface over which a camera measures one number in place of an image, of type ``cube``.

    Parameters
    ----------
    quantity : {"irradiance", "radiance"}
        Measured quantity: irradiance of the front of the surface, or radiance of parallel rays
        along the axis of the camera.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "cube"
    quantity: Literal["irradiance", "radiance"]
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class DiskMeter(Part):
    """Surface over which a camera measures one number in place of an image, of type ``disk``.

    Parameters
    ----------
    quantity : {"irradiance", "radiance"}
        Measured quantity: irradiance of the front of the surface, or radiance of parallel rays
        along the axis of the camera.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "disk"
    quantity: Literal["irradiance", "radiance"]
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class CylinderMeter(Part):
    """Surface over which a camera measures one number in place of an image, of type ``cylinder``.

    Parameters
    ----------
    quantity : {"irradiance", "radiance"}
        Measured quantity: irradiance of the front of the surface, or radiance of parallel rays
        along the axis of the camera.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "cylinder"
    quantity: Literal["irradiance", "radiance"]
    to_world: Step | Sequence[Step] | Array | None = None


Meter: TypeAlias = (
    SphereMeter
    | MeshMeter
    | PointsMeter
    | RectangleMeter
    | CubeMeter
    | DiskMeter
    | CylinderMeter
    | Mapping[str, Any]
)
