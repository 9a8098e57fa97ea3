"""Objects and their shapes.

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

    from ._part import Array
    from .materials import Material
    from .media import Medium
    from .transforms import MotionKey, Step


@dataclass(kw_only=True, eq=False, repr=False)
class Sphere(Part):
    """Object of type ``sphere``.

    Parameters
    ----------
    material : Material or str, optional
        Material of the whole object; diffuse with reflectance 0.5 by default.
    materials : sequence of Material or str or None, optional
        Material of each slot of the mesh; None is the default material.
    media : Sides, optional
        Media behind and in front of the surface.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    radius : float, default 1
        Radius; the front of a sphere with a negative radius is its inside.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "sphere"
    material: Material | str | None = None
    materials: Sequence[Material | str | None] | None = None
    media: Sides | Mapping[str, Any] | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    radius: float | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class MeshObject(Part):
    """Object of type ``mesh``.

    Parameters
    ----------
    mesh : str or Mesh
        The mesh, or the name of one.
    material : Material or str, optional
        Material of the whole object; diffuse with reflectance 0.5 by default.
    materials : sequence of Material or str or None, optional
        Material of each slot of the mesh; None is the default material.
    media : Sides, optional
        Media behind and in front of the surface.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "mesh"
    mesh: str | Mesh | Mapping[str, Any]
    material: Material | str | None = None
    materials: Sequence[Material | str | None] | None = None
    media: Sides | Mapping[str, Any] | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class PointsObject(Part):
    """Object of type ``points``.

    Parameters
    ----------
    points : str or Points
        The points, or the name of an entry.
    material : Material or str, optional
        Material of the whole object; diffuse with reflectance 0.5 by default.
    materials : sequence of Material or str or None, optional
        Material of each slot of the mesh; None is the default material.
    media : Sides, optional
        Media behind and in front of the surface.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    radius : float, optional
        Radius of spheres and cylinders, in the coordinates of the object; by default derived from
        their distances.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "points"
    points: str | Points | Mapping[str, Any]
    material: Material | str | None = None
    materials: Sequence[Material | str | None] | None = None
    media: Sides | Mapping[str, Any] | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    radius: float | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Rectangle(Part):
    """Object of type ``rectangle``.

    Parameters
    ----------
    material : Material or str, optional
        Material of the whole object; diffuse with reflectance 0.5 by default.
    materials : sequence of Material or str or None, optional
        Material of each slot of the mesh; None is the default material.
    media : Sides, optional
        Media behind and in front of the surface.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "rectangle"
    material: Material | str | None = None
    materials: Sequence[Material | str | None] | None = None
    media: Sides | Mapping[str, Any] | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Cube(Part):
    """Object of type ``cube``.

    Parameters
    ----------
    material : Material or str, optional
        Material of the whole object; diffuse with reflectance 0.5 by default.
    materials : sequence of Material or str or None, optional
        Material of each slot of the mesh; None is the default material.
    media : Sides, optional
        Media behind and in front of the surface.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "cube"
    material: Material | str | None = None
    materials: Sequence[Material | str | None] | None = None
    media: Sides | Mapping[str, Any] | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Disk(Part):
    """Object of type ``disk``.

    Parameters
    ----------
    material : Material or str, optional
        Material of the whole object; diffuse with reflectance 0.5 by default.
    materials : sequence of Material or str or None, optional
        Material of each slot of the mesh; None is the default material.
    media : Sides, optional
        Media behind and in front of the surface.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "disk"
    material: Material | str | None = None
    materials: Sequence[Material | str | None] | None = None
    media: Sides | Mapping[str, Any] | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Cylinder(Part):
    """Object of type ``cylinder``.

    Parameters
    ----------
    material : Material or str, optional
        Material of the whole object; diffuse with reflectance 0.5 by default.
    materials : sequence of Material or str or None, optional
        Material of each slot of the mesh; None is the default material.
    media : Sides, optional
        Media behind and in front of the surface.
    motion : sequence of MotionKey or str, optional
        Keys of an animation, or the name of one, applied after the transform of the object.
    name : str, optional
        Name.
    to_world : Step or sequence of Step or array_like, optional
        Transform to the world: steps, or a matrix of shape (3, 4) or (4, 4).
    """

    type: ClassVar[str | None] = "cylinder"
    material: Material | str | None = None
    materials: Sequence[Material | str | None] | None = None
    media: Sides | Mapping[str, Any] | None = None
    motion: Sequence[MotionKey | Mapping[str, Any]] | str | None = None
    name: str | None = None
    to_world: Step | Sequence[Step] | Array | None = None


Object: TypeAlias = (
    Sphere
    | MeshObject
    | PointsObject
    | Rectangle
    | Cube
    | Disk
    | Cylinder
    | Mapping[str, Any]
)


@dataclass(kw_only=True, eq=False, repr=False)
class Mesh(Part):
    """Triangle mesh.

    Parameters
    ----------
    color_indices : array_like, optional
        Indices of the colours of the corners of each triangle, of shape (m, 3).
    colors : array_like, optional
        Colours, of shape (n, 3), one for each vertex unless there are color_indices.
    face_attributes : dict of str to array, optional
        Further values of the triangles by name, each of shape (m, 3).
    face_colors : array_like, optional
        Colours of the triangles, of shape (m, 3).
    file : str or os.PathLike, optional
        Path of a mesh file (.ply, .obj, .stl, .serialized, .safetensors); shape, or positions and
        triangles replace it.
    name : str, optional
        Name.
    normal_indices : array_like, optional
        Indices of the normals of the corners of each triangle, of shape (m, 3).
    normals : array_like, optional
        Normals, of shape (n, 3), one for each vertex unless there are normal_indices.
    parts : array_like, optional
        First triangle, triangle after the last, and material slot of each part, of shape (parts,
        3).
    positions : array_like, optional
        Positions of the vertices, of shape (n, 3).
    shape : {"rectangle", "cube", "disk", "cylinder"}, optional
        Generated mesh.
    shape_index : int, optional
        Number of the mesh in a .serialized file, from 0.
    triangles : array_like, optional
        Indices of the vertices of each triangle, counter-clockwise as seen from the front, of shape
        (m, 3).
    uv_indices : array_like, optional
        Indices of the texture coordinates of the corners of each triangle, of shape (m, 3).
    uvs : array_like, optional
        Texture coordinates, of shape (n, 2), v upwards, one for each vertex unless there are
        uv_indices.
    vertex_attributes : dict of str to array, optional
        Further values of the vertices by name, each of shape (n, 3).
    """

    table: ClassVar[str | None] = "meshes"
    color_indices: Array | None = None
    colors: Array | None = None
    face_attributes: Mapping[str, Array] | None = None
    face_colors: Array | None = None
    file: str | PathLike[str] | None = None
    name: str | None = None
    normal_indices: Array | None = None
    normals: Array | None = None
    parts: Array | None = None
    positions: Array | None = None
    shape: Literal["rectangle", "cube", "disk", "cylinder"] | None = None
    shape_index: int | None = None
    triangles: Array | None = None
    uv_indices: Array | None = None
    uvs: Array | None = None
    vertex_attributes: Mapping[str, Array] | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Points(Part):
    """Points and segments.

    Parameters
    ----------
    colors : array_like, optional
        Colours, of shape (n, 3).
    file : str or os.PathLike, optional
        Path of a file (.ply, .obj, .safetensors); positions replace it.
    name : str, optional
        Name.
    positions : array_like, optional
        Positions, of shape (n, 3).
    segments : array_like, optional
        Indices of the ends of each segment, of shape (m, 2).
    """

    table: ClassVar[str | None] = "points"
    colors: Array | None = None
    file: str | PathLike[str] | None = None
    name: str | None = None
    positions: Array | None = None
    segments: Array | None = None


@dataclass(kw_only=True, eq=False, repr=False)
class Sides(Part):
    """Media on both sides of a surface.

    Parameters
    ----------
    exterior : Medium or str, optional
        Medium in front of the surface.
    interior : Medium or str, optional
        Medium behind the surface.
    """

    exterior: Medium | str | None = None
    interior: Medium | str | None = None
