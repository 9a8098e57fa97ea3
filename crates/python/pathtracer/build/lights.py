"""Lights.

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
    from .textures import Image, Texture
    from .transforms import Step


@dataclass(kw_only=True, eq=False, repr=False)
class HemisphereLight(Part):
    """Light of type ``hemisphere``.

    Parameters
    ----------
    radiance : float or color
        Radiance.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "hemisphere"
    radiance: Color
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class ConstantLight(Part):
    """Light of type ``constant``.

    Parameters
    ----------
    radiance : float or color
        Radiance.
    name : str, optional
        Name.
    portal : array_like, optional
        Rectangle through which the light arrives.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "constant"
    radiance: Color
    name: str | None = None
    portal: Array | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class EnvironmentLight(Part):
    """Light of type ``environment``.

    Parameters
    ----------
    image : str or Image
        An entry of `images`, or `{ "file": … }`.
    name : str, optional
        Name.
    portal : array_like, optional
        Rectangle through which the light arrives.
    rows : {"pixel_centers", "endpoints_at_poles"}, default "pixel_centers"
        Polar angles of the rows; with the latter, the first and the last row are the poles, as in
        Mitsuba 3.
    scale : float, default 1
        Factor of the image.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "environment"
    image: str | Image | Mapping[str, Any]
    name: str | None = None
    portal: Array | None = None
    rows: Literal["pixel_centers", "endpoints_at_poles"] | None = None
    scale: float | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class DirectionalLight(Part):
    """Light of type ``directional``.

    Parameters
    ----------
    irradiance : float or color
        Irradiance on a surface that faces the light.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "directional"
    irradiance: Color
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class DistantDiskLight(Part):
    """Light of type ``distant_disk``.

    Parameters
    ----------
    irradiance : float or color
        Irradiance on a surface that faces the centre of the disk.
    angular_radius : float, default 0.2679
        Angular radius in degrees, up to 90; below 0.0058 the light is parallel and invisible.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "distant_disk"
    irradiance: Color
    angular_radius: float | None = None
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PointLight(Part):
    """Light of type ``point``.

    Parameters
    ----------
    intensity : float or color
        Radiant intensity.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "point"
    intensity: Color
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class SpotLight(Part):
    """Light of type ``spot``.

    Parameters
    ----------
    intensity : float or color
        Radiant intensity along the axis.
    falloff_angle : float, default 180
        Full opening angle of the cone in degrees.
    falloff_exponent : float, default 0
        Exponent of the cosine.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "spot"
    intensity: Color
    falloff_angle: float | None = None
    falloff_exponent: float | None = None
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class LinearSpotLight(Part):
    """Light of type ``linear_spot``.

    Parameters
    ----------
    intensity : float or color
        Radiant intensity along the axis.
    beam_angle : float, default 0
        Angle to the axis up to which the intensity is constant, in degrees.
    cutoff_angle : float, default 45
        Angle to the axis beyond which it is 0; below 90 with a `texture`.
    name : str, optional
        Name.
    texture : str or Texture, optional
        Factor of the intensity.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "linear_spot"
    intensity: Color
    beam_angle: float | None = None
    cutoff_angle: float | None = None
    name: str | None = None
    texture: str | Texture | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PunctualSpotLight(Part):
    """Light of type ``punctual_spot``.

    Parameters
    ----------
    intensity : float or color
        Radiant intensity along the axis.
    inner_angle : float, default 0
        Angle i to the axis up to which the intensity is constant, in degrees.
    name : str, optional
        Name.
    outer_angle : float, default 45
        Angle o to the axis beyond which it is 0.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "punctual_spot"
    intensity: Color
    inner_angle: float | None = None
    name: str | None = None
    outer_angle: float | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class ProjectorLight(Part):
    """Light of type ``projector``.

    Parameters
    ----------
    intensity : float or color
        Radiant intensity along the axis for a picture of value 1.
    texture : str or Texture
        The picture; there is no light beyond its edges.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    x_fov : float, default 45
        Horizontal angle of the picture in degrees, below 180.
    y_fov : float, default 45
        Vertical angle of the picture in degrees, below 180.
    """

    type: ClassVar[str | None] = "projector"
    intensity: Color
    texture: str | Texture
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None
    x_fov: float | None = None
    y_fov: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class IesLight(Part):
    """Light of type ``ies``.

    Parameters
    ----------
    profile : str or IesProfile
        An entry of `profiles`, or `{ "file": … }`.
    name : str, optional
        Name.
    scale : float or color, default 1
        Radiant intensity of one candela.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "ies"
    profile: str | IesProfile | Mapping[str, Any]
    name: str | None = None
    scale: Color | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class DaylightLight(Part):
    """Light of type ``daylight``.

    Parameters
    ----------
    albedo : float or color, default 0.3
        Albedo of the ground, which illuminates the sky from below.
    aperture : float, default 0.5358
        Apparent diameter of the sun in degrees, from 0.0116 to 180.
    limb_darkening : bool, default False
        The sun is darker at its rim.
    name : str, optional
        Name.
    sky : float, default 1
        Factor of the sky.
    span : TimeRange, optional
        Period over which the light is averaged, in place of `to_sun`.
    sun : float, default 1
        Factor of the sun.
    to_sun : sequence of numbers, default [0, 1, 0]
        Direction to the sun, of any length.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    turbidity : float, default 3
        Turbidity of the air, from 1 (arctic) to 10 (hazy).
    """

    type: ClassVar[str | None] = "daylight"
    albedo: Color | None = None
    aperture: float | None = None
    limb_darkening: bool | None = None
    name: str | None = None
    sky: float | None = None
    span: TimeRange | Mapping[str, Any] | None = None
    sun: float | None = None
    to_sun: Vector | None = None
    to_world: Step | Sequence[Step] | Array | None = None
    turbidity: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class AreaLight(Part):
    """Light of type ``area``.

    Parameters
    ----------
    radiance : float or color
        Emitted radiance.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "area"
    radiance: Color
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


Light: TypeAlias = (
    HemisphereLight
    | ConstantLight
    | EnvironmentLight
    | DirectionalLight
    | DistantDiskLight
    | PointLight
    | SpotLight
    | LinearSpotLight
    | PunctualSpotLight
    | ProjectorLight
    | IesLight
    | DaylightLight
    | AreaLight
    | Mapping[str, Any]
    | Literal[
        "daylight",
    ]
)


@dataclass(kw_only=True, eq=False, repr=False)
class IesProfile(Part):
    """Intensity distribution of a luminaire.

    Parameters
    ----------
    file : str or os.PathLike or bytes
        Path of an IES file, or its content as bytes.
    """

    table: ClassVar[str | None] = "profiles"
    file: str | PathLike[str] | bytes


@dataclass(kw_only=True, eq=False, repr=False)
class TimeRange(Part):
    """Period over which daylight is averaged.

    Parameters
    ----------
    first : sequence of numbers
        Year, month and day of the first day.
    place : GeoLocation
        Place on the earth.
    days : int, default 1
        Number of days.
    hours : sequence of numbers, default [0, 24]
        Start and end of the hours of each day.
    part : sequence of numbers, default [0, 1]
        Start and end of the part of the period that is averaged.
    timezone : float, default 0
        Offset of local time, in hours.
    """

    first: Vector
    place: GeoLocation | Mapping[str, Any]
    days: int | None = None
    hours: Vector | None = None
    part: Vector | None = None
    timezone: float | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class GeoLocation(Part):
    """Place on the earth.

    Parameters
    ----------
    latitude : float
        Latitude in degrees.
    longitude : float
        Longitude in degrees.
    """

    latitude: float
    longitude: float
