"""Materials.

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

    from ._part import Color
    from .textures import Texture


@dataclass(kw_only=True, eq=False, repr=False)
class DiffuseMaterial(Part):
    """Material of type ``diffuse``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    reflectance : float or color or str or Texture, default 0.5
        Albedo, each channel from 0 to 1.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "diffuse"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    reflectance: Color | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class RoughDiffuseMaterial(Part):
    """Material of type ``rough_diffuse``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    reflectance : float or color or str or Texture, default 0.5
        Albedo of the walls of the cavities, each channel from 0 to 1.
    roughness : float or str or Texture, default 0.5
        From 0, which is Lambertian, to 1.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "rough_diffuse"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    reflectance: Color | str | Texture | None = None
    roughness: float | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MirrorMaterial(Part):
    """Material of type ``mirror``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    reflectance : float or color or str or Texture, default 1
        Reflectance, each channel from 0 to 1.
    """

    type: ClassVar[str | None] = "mirror"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    reflectance: Color | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class GlassMaterial(Part):
    """Material of type ``glass``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the back over that of the front, above 0.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    reflectance : float or color or str or Texture, default 1
        Tint of reflected light; 1 is physical.
    roughness : Roughness, optional
        Microfacets; without it the interface is smooth.
    transmittance : float or color or str or Texture, default 1
        Tint of transmitted light at each surface; 1 is physical.
    """

    type: ClassVar[str | None] = "glass"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    reflectance: Color | str | Texture | None = None
    roughness: Roughness | Mapping[str, Any] | None = None
    transmittance: Color | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class ThinGlassMaterial(Part):
    """Material of type ``thin_glass``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the pane over that around it, above 0.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    reflectance : float or color or str or Texture, default 1
        Tint of reflected light; 1 is physical.
    transmittance : float or color or str or Texture, default 1
        Tint of transmitted light; 1 is physical.
    """

    type: ClassVar[str | None] = "thin_glass"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    reflectance: Color | str | Texture | None = None
    transmittance: Color | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class RefractionMaterial(Part):
    """Material of type ``refraction``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the back over that of the front, above 0.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    transmittance : float or color or str or Texture, default 1
        Tint of transmitted light.
    """

    type: ClassVar[str | None] = "refraction"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    transmittance: Color | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class ConductorMaterial(Part):
    """Material of type ``conductor``.

    Parameters
    ----------
    eta : float or color
        Real part η of the index of refraction, per channel.
    k : float or color
        Imaginary part k, per channel.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    reflectance : float or color or str or Texture, default 1
        Tint of the reflection; 1 is physical.
    roughness : Roughness, optional
        Microfacets; without it the metal is smooth.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "conductor"
    table: ClassVar[str | None] = "materials"
    eta: Color
    k: Color
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    reflectance: Color | str | Texture | None = None
    roughness: Roughness | Mapping[str, Any] | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class CoatedDiffuseMaterial(Part):
    """Material of type ``coated_diffuse``.

    Parameters
    ----------
    diffuse : float or color or str or Texture, default 0.5
        Albedo of the base.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the coat, above 0.
    name : str, optional
        Name of the material.
    nonlinear : bool, default False
        Internally reflected light is tinted by the base again.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    specular : float or color or str or Texture, default 1
        Tint of the reflection of the coat; 1 is physical.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "coated_diffuse"
    table: ClassVar[str | None] = "materials"
    diffuse: Color | str | Texture | None = None
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    nonlinear: bool | None = None
    opacity: float | str | Texture | None = None
    specular: Color | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class RoughCoatedDiffuseMaterial(Part):
    """Material of type ``rough_coated_diffuse``.

    Parameters
    ----------
    alpha : float, default 0.1
        Roughness α of the coat, above 0.
    diffuse : float or color or str or Texture, default 0.5
        Albedo of the base.
    distribution : {"beckmann", "ggx"}, default "ggx"
        Distribution of the slopes of the facets.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the coat; values below 1 count as 1.
    name : str, optional
        Name of the material.
    nonlinear : bool, default False
        Internally reflected light is tinted by the base again.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    specular : float or color or str or Texture, default 1
        Tint of the reflection of the coat; 1 is physical.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "rough_coated_diffuse"
    table: ClassVar[str | None] = "materials"
    alpha: float | None = None
    diffuse: Color | str | Texture | None = None
    distribution: Literal["beckmann", "ggx"] | None = None
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    nonlinear: bool | None = None
    opacity: float | str | Texture | None = None
    specular: Color | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class FresnelPlasticMaterial(Part):
    """Material of type ``fresnel_plastic``.

    Parameters
    ----------
    roughness : Roughness
        Microfacets; `multiple_scattering` has no effect.
    diffuse : float or color or str or Texture, default 0.5
        Albedo of the base.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction; values below 1 count as 1.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    specular : float or color or str or Texture, default 1
        Tint of the reflection of the facets; 1 is physical.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "fresnel_plastic"
    table: ClassVar[str | None] = "materials"
    roughness: Roughness | Mapping[str, Any]
    diffuse: Color | str | Texture | None = None
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    specular: Color | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class CoatedConductorMaterial(Part):
    """Material of type ``coated_conductor``.

    Parameters
    ----------
    eta : float or color
        Real part of the metal's index of refraction over that above the coat, per channel.
    k : float or color
        Imaginary part of it, per channel.
    alpha : float, default 0
        Roughness α of the metal; 0 is smooth.
    coat_alpha : float, default 0
        Roughness α of the coat; 0 is smooth.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the coat; values below 1 count as 1.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    thickness : float, default 0
        Optical thickness t of the coat: at normal incidence it transmits e⁻ᵗ. 0 is clear.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "coated_conductor"
    table: ClassVar[str | None] = "materials"
    eta: Color
    k: Color
    alpha: float | None = None
    coat_alpha: float | None = None
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    thickness: float | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PlasticMaterial(Part):
    """Material of type ``plastic``.

    Parameters
    ----------
    alpha : float, default 0.1
        Roughness α of the glossy part, above 0.
    diffuse : float or color or str or Texture, default 0.5
        Albedo of the base.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    specular : float or color or str or Texture, default 0.04
        Reflectance of the glossy part at normal incidence.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "plastic"
    table: ClassVar[str | None] = "materials"
    alpha: float | None = None
    diffuse: Color | str | Texture | None = None
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    specular: Color | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PrincipledMaterial(Part):
    """Material of type ``principled``.

    Parameters
    ----------
    anisotropic : float or str or Texture, default 0
        Elongation of highlights along increasing u.
    base_color : float or color or str or Texture, default 0.5
        Colour of the base, of the metal, and of transmitted light (its square root at each
        surface).
    clearcoat : float or str or Texture, default 0
        Amount of clear coat.
    clearcoat_gloss : float or str or Texture, default 0
        Gloss of the coat, from satin (0) to glossy (1).
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    flatness : float or str or Texture, default 0
        Weight of the approximate subsurface scattering against the diffuse reflection.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the back over the front, above 0.
    metallic : float or str or Texture, default 0
        Weight of the metal.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    roughness : float or str or Texture, default 0.5
        √α of the GGX facets.
    sheen : float or str or Texture, default 0
        Amount of sheen.
    sheen_tint : float or str or Texture, default 0
        Tint of the sheen by the base.
    spec_tint : float or str or Texture, default 0
        Tint of the dielectric's reflection by the base.
    spec_trans : float or str or Texture, default 0
        Weight of transmission in the dielectric.
    two_sided : bool, default False
        The back reflects as the front does; otherwise it transmits light or is black.
    """

    type: ClassVar[str | None] = "principled"
    table: ClassVar[str | None] = "materials"
    anisotropic: float | str | Texture | None = None
    base_color: Color | str | Texture | None = None
    clearcoat: float | str | Texture | None = None
    clearcoat_gloss: float | str | Texture | None = None
    emission: Color | str | Texture | None = None
    flatness: float | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    metallic: float | str | Texture | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    roughness: float | str | Texture | None = None
    sheen: float | str | Texture | None = None
    sheen_tint: float | str | Texture | None = None
    spec_tint: float | str | Texture | None = None
    spec_trans: float | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PrincipledThinMaterial(Part):
    """Material of type ``principled_thin``.

    Parameters
    ----------
    anisotropic : float or str or Texture, default 0
        Elongation of highlights along increasing u.
    base_color : float or color or str or Texture, default 0.5
        Colour of the diffuse part, and of light that facets transmit.
    diff_trans : float or str or Texture, default 0
        Diffuse transmission, from 0 (all is reflected) to 2 (all is transmitted).
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    flatness : float or str or Texture, default 0
        Weight of the approximate subsurface scattering against the diffuse reflection.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the sheet over that around it, above 0.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    roughness : float or str or Texture, default 0.5
        √α of the reflecting facets; transmission is smoother for an index below 2.08.
    sheen : float or str or Texture, default 0
        Amount of sheen.
    sheen_tint : float or str or Texture, default 0
        Tint of the sheen by the base.
    spec_tint : float or str or Texture, default 0
        Tint of the facets' reflection by the base.
    spec_trans : float or str or Texture, default 0
        Weight of the facets; the remainder is diffuse.
    """

    type: ClassVar[str | None] = "principled_thin"
    table: ClassVar[str | None] = "materials"
    anisotropic: float | str | Texture | None = None
    base_color: Color | str | Texture | None = None
    diff_trans: float | str | Texture | None = None
    emission: Color | str | Texture | None = None
    flatness: float | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    roughness: float | str | Texture | None = None
    sheen: float | str | Texture | None = None
    sheen_tint: float | str | Texture | None = None
    spec_tint: float | str | Texture | None = None
    spec_trans: float | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MetallicRoughnessMaterial(Part):
    """Material of type ``metallic_roughness``.

    Parameters
    ----------
    anisotropy : float or str or Texture, default 0
        Strength of anisotropy.
    anisotropy_along : str or Texture, optional
        Direction that replaces that of increasing u: red and green are the coefficients of ∂p/∂u
        and ∂p/∂v.
    anisotropy_direction : sequence of float or str or Texture, default [1, 0.5]
        Direction along increasing u and v; 0 to 1 stands for −1 to 1.
    anisotropy_rotation : float, default 0
        Rotation of that direction from u to v, in radians.
    base_color : float or color or str or Texture, default 1
        Colour of the base, of the metal, and of transmitted light (once for sheets, otherwise its
        square root at each surface).
    clearcoat : float or str or Texture, default 0
        Amount of clear coat.
    clearcoat_normals : CoatNormals, default "base"
        Normals of the coat: those of the layers below; those of the shape; or a relief of its own,
        `{ "type": "relief", … }` with the map keys of `surface_detail`.
    clearcoat_roughness : float or str or Texture, default 0
        √α of the coat.
    diffuse_transmission : float or str or Texture, default 0
        Fraction of the diffuse base that scatters light to the other side; for sheets.
    diffuse_transmission_color : float or color or str or Texture, default 1
        Colour of diffuse transmission.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    film_ior : float, default 1.3
        Index of refraction of the film, at least 1.
    film_thickness : float or str or Texture, default 400
        Thickness of the film in nanometres.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.5
        Index of refraction of the back over the front, at least 1.
    iridescence : float or str or Texture, default 0
        Weight of a thin film.
    metallic : float or str or Texture, default 0
        Weight of the metal.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    roughness : float or str or Texture, default 1
        √α of the GGX facets.
    sheen_color : float or color or str or Texture, default 0
        Colour of the sheen of cloth.
    sheen_roughness : float or str or Texture, default 0
        √α of the sheen.
    specular : float or str or Texture, default 1
        Amount of specular reflection of the dielectric.
    specular_color : float or color or str or Texture, default 1
        Its colour at normal incidence; values above 1 are possible.
    thin : bool, default False
        A sheet without an interior, equal on both sides.
    transmission : float or str or Texture, default 0
        Weight of transmission in the dielectric.
    two_sided : bool, default False
        The back of opaque parts reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "metallic_roughness"
    table: ClassVar[str | None] = "materials"
    anisotropy: float | str | Texture | None = None
    anisotropy_along: str | Texture | None = None
    anisotropy_direction: Sequence[float | str | Texture] | None = None
    anisotropy_rotation: float | None = None
    base_color: Color | str | Texture | None = None
    clearcoat: float | str | Texture | None = None
    clearcoat_normals: CoatNormals | None = None
    clearcoat_roughness: float | str | Texture | None = None
    diffuse_transmission: float | str | Texture | None = None
    diffuse_transmission_color: Color | str | Texture | None = None
    emission: Color | str | Texture | None = None
    film_ior: float | None = None
    film_thickness: float | str | Texture | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    iridescence: float | str | Texture | None = None
    metallic: float | str | Texture | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    roughness: float | str | Texture | None = None
    sheen_color: Color | str | Texture | None = None
    sheen_roughness: float | str | Texture | None = None
    specular: float | str | Texture | None = None
    specular_color: Color | str | Texture | None = None
    thin: bool | None = None
    transmission: float | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class DiffuseTransmissionMaterial(Part):
    """Material of type ``diffuse_transmission``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    reflectance : float or color or str or Texture, default 0.5
        Diffuse reflectance.
    transmittance : float or color or str or Texture, default 0.5
        Diffuse transmittance.
    """

    type: ClassVar[str | None] = "diffuse_transmission"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    reflectance: Color | str | Texture | None = None
    transmittance: Color | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class HairMaterial(Part):
    """Material of type ``hair``.

    Parameters
    ----------
    absorption : float or color, optional
        In place of pigments: absorption of a fibre of radius 1, per channel.
    azimuthal_roughness : float, default 0.3
        Roughness around the fibre, from 0 to 1.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    eumelanin : float, optional
        Concentration of the brown pigment; brown hair (1.3) if no colour is given.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    ior : float, default 1.55
        Index of refraction, at least 1.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    pheomelanin : float, optional
        Concentration of the red pigment, 0 by default.
    reflectance : float or color or str or Texture, optional
        In place of pigments: colour of the hair, each channel from 0 to 1.
    roughness : float, default 0.3
        Roughness along the fibre, from 0 to 1.
    scale_angle : float, default 2
        Tilt of the scales in degrees, from −45 to 45.
    two_sided : bool, default False
        The back scatters as the front does, for ribbons; otherwise rays pass through the back, so
        that light crosses a closed tube once.
    """

    type: ClassVar[str | None] = "hair"
    table: ClassVar[str | None] = "materials"
    absorption: Color | None = None
    azimuthal_roughness: float | None = None
    emission: Color | str | Texture | None = None
    eumelanin: float | None = None
    hidden_emission: bool | None = None
    ior: float | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    pheomelanin: float | None = None
    reflectance: Color | str | Texture | None = None
    roughness: float | None = None
    scale_angle: float | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MeasuredMaterial(Part):
    """Material of type ``measured``.

    Parameters
    ----------
    measurements : str or Measurements
        A name of the table `measurements`, or `{ "file": "gold.bsdf" }`.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    two_sided : bool, default True
        The back reflects as the front does; otherwise it is black.
    """

    type: ClassVar[str | None] = "measured"
    table: ClassVar[str | None] = "materials"
    measurements: str | Measurements | Mapping[str, Any]
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None
    two_sided: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class BlackMaterial(Part):
    """Material of type ``black``.

    Parameters
    ----------
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    """

    type: ClassVar[str | None] = "black"
    table: ClassVar[str | None] = "materials"
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MixMaterial(Part):
    """Material of type ``mix``.

    Parameters
    ----------
    first : Material
        Surface for the weight 0.
    second : Material
        Surface for the weight 1.
    amount : float or str or Texture, default 0.5
        Weight of the second surface, from 0 to 1.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    """

    type: ClassVar[str | None] = "mix"
    table: ClassVar[str | None] = "materials"
    first: Material
    second: Material
    amount: float | str | Texture | None = None
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class TwoSidedMaterial(Part):
    """Material of type ``two_sided``.

    Parameters
    ----------
    back : Material
        Surface of the other side.
    front : Material
        Surface of the side of the normal.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    name : str, optional
        Name of the material.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    """

    type: ClassVar[str | None] = "two_sided"
    table: ClassVar[str | None] = "materials"
    back: Material
    front: Material
    emission: Color | str | Texture | None = None
    hidden_emission: bool | None = None
    name: str | None = None
    opacity: float | str | Texture | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class SurfaceDetailMaterial(Part):
    """Material of type ``surface_detail``.

    Parameters
    ----------
    surface : Material
        The surface below the relief.
    along : str or Texture, optional
        With `normal_map`: directions that are +x instead; red and green are the coefficients of
        ∂p/∂u and ∂p/∂v.
    averted : {"bent", "turned", "black"}, default "bent"
        Where the normal looks away from the viewer: bent until it just faces the viewer; rotated by
        half a turn about the normal of the shape; or black.
    emission : float or color or str or Texture, default 0
        Radiance emitted from the front; emissive surfaces are lights.
    height : float, default 1
        With `height_map`: factor of the height, in units of the scene.
    height_map : str or Texture, optional
        In place of `normal_map`: bump map, of which the luminance is the height.
    hidden_emission : bool, default False
        True if the emission is invisible, both directly and in mirrors.
    mirrored : bool, default False
        Bumps of the front are bumps of the back; otherwise they are dents.
    name : str, optional
        Name of the material.
    normal_map : str or Texture, optional
        Normal map: 2 · rgb − 1 is the normal, with the normal of the shape as +z and increasing u
        as +x.
    opacity : float or str or Texture, default 1
        Opacity; it does not change the emission.
    shadowing : bool, default False
        Steep relief reduces light at grazing angles, as shadowing by facets would [Conty Estevez,
        Lecocq & Stein 2019].
    turned_normal_map : str or Texture, optional
        In place of `normal_map`: normal map that rotates with its `to_pattern`; increasing u of the
        image is +x.
    """

    type: ClassVar[str | None] = "surface_detail"
    table: ClassVar[str | None] = "materials"
    surface: Material
    along: str | Texture | None = None
    averted: Literal["bent", "turned", "black"] | None = None
    emission: Color | str | Texture | None = None
    height: float | None = None
    height_map: str | Texture | None = None
    hidden_emission: bool | None = None
    mirrored: bool | None = None
    name: str | None = None
    normal_map: str | Texture | None = None
    opacity: float | str | Texture | None = None
    shadowing: bool | None = None
    turned_normal_map: str | Texture | None = None


Material: TypeAlias = (
    DiffuseMaterial
    | RoughDiffuseMaterial
    | MirrorMaterial
    | GlassMaterial
    | ThinGlassMaterial
    | RefractionMaterial
    | ConductorMaterial
    | CoatedDiffuseMaterial
    | RoughCoatedDiffuseMaterial
    | FresnelPlasticMaterial
    | CoatedConductorMaterial
    | PlasticMaterial
    | PrincipledMaterial
    | PrincipledThinMaterial
    | MetallicRoughnessMaterial
    | DiffuseTransmissionMaterial
    | HairMaterial
    | MeasuredMaterial
    | BlackMaterial
    | MixMaterial
    | TwoSidedMaterial
    | SurfaceDetailMaterial
    | Mapping[str, Any]
    | Literal[
        "diffuse",
        "rough_diffuse",
        "mirror",
        "glass",
        "thin_glass",
        "refraction",
        "coated_diffuse",
        "rough_coated_diffuse",
        "plastic",
        "principled",
        "principled_thin",
        "metallic_roughness",
        "diffuse_transmission",
        "hair",
        "black",
    ]
)


@dataclass(kw_only=True, eq=False, repr=False)
class Roughness(Part):
    """Roughness of a surface of microfacets.

    Parameters
    ----------
    alpha : float or str or Texture, optional
        Roughness α; alpha_u and alpha_v replace it.
    alpha_u : float or str or Texture, optional
        Roughness α along increasing u.
    alpha_v : float or str or Texture, optional
        Roughness α along increasing v.
    distribution : {"beckmann", "ggx"}, default "ggx"
        Distribution of the facets.
    masking : {"correlated", "separable"}, default "correlated"
        Masking and shadowing of facets.
    multiple_scattering : bool, default False
        True if it includes multiple scattering between facets.
    """

    alpha: float | str | Texture | None = None
    alpha_u: float | str | Texture | None = None
    alpha_v: float | str | Texture | None = None
    distribution: Literal["beckmann", "ggx"] | None = None
    masking: Literal["correlated", "separable"] | None = None
    multiple_scattering: bool | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class BaseCoatNormals(Part):
    """Normals of a clear coat of type ``base``."""

    type: ClassVar[str | None] = "base"


@dataclass(kw_only=True, eq=False, repr=False)
class ShapeCoatNormals(Part):
    """Normals of a clear coat of type ``shape``."""

    type: ClassVar[str | None] = "shape"


@dataclass(kw_only=True, eq=False, repr=False)
class ReliefCoatNormals(Part):
    """Normals of a clear coat of type ``relief``.

    Parameters
    ----------
    along : str or Texture, optional
        Texture of directions a ∂p/∂u + b ∂p/∂v as +x.
    height : float, default 1
        Factor of the bump map.
    height_map : str or Texture, optional
        Bump map.
    normal_map : str or Texture, optional
        Normal map with ∂p/∂u as +x.
    turned_normal_map : str or Texture, optional
        Normal map that rotates with its to_pattern.
    """

    type: ClassVar[str | None] = "relief"
    along: str | Texture | None = None
    height: float | None = None
    height_map: str | Texture | None = None
    normal_map: str | Texture | None = None
    turned_normal_map: str | Texture | None = None


CoatNormals: TypeAlias = (
    BaseCoatNormals
    | ShapeCoatNormals
    | ReliefCoatNormals
    | Mapping[str, Any]
    | Literal[
        "base",
        "shape",
    ]
)


@dataclass(kw_only=True, eq=False, repr=False)
class Measurements(Part):
    """Measured reflection of a material.

    Parameters
    ----------
    file : str or os.PathLike or bytes
        Path of a file of the RGL, or its content as bytes.
    """

    table: ClassVar[str | None] = "measurements"
    file: str | PathLike[str] | bytes
