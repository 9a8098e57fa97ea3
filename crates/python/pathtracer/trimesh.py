"""Ray queries for trimesh.

>>> mesh.ray = pathtracer.trimesh.RayMeshIntersector(mesh)

replaces the ray queries of a ``trimesh.Trimesh``, and with them ``mesh.contains``, by those of
:class:`pathtracer.Bvh`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._native import Bvh

__all__ = ["RayMeshIntersector"]

_Floats = NDArray[np.float64]
_Indices = NDArray[np.int64]

# Queries are in coordinates in which the mesh is in a sphere of radius 1 around the origin, and
# rays begin at most at this sphere. There, single precision has errors of some 10⁻⁷.
#
# Surfaces that are nearer than this behind an origin are hit, as those that contain it.
_BEHIND = 2.5e-7
# Hits of a ray that are nearer to each other than this are one, as at an edge of two triangles.
_SAME = 5e-7
# Cosine of the angle to the plane of a triangle below which the point of a hit is not computed
# from the plane.
_GRAZING = 1e-3


class RayMeshIntersector:
    """Ray queries on a mesh, with the methods of the classes of the same name of trimesh.

    Parameters
    ----------
    geometry : trimesh.Trimesh
        Mesh. If it changes, the next query uses it as it is then.
    scale_to_box : bool, optional
        Has no effect: queries are relative to the position and the size of the mesh.
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True) -> None:
        self.mesh = geometry
        self._built: tuple[int, Bvh, _Floats, float] | None = None

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True
    ) -> tuple[_Floats, _Indices, _Indices]:
        """Find the points at which rays hit the mesh.

        Parameters
        ----------
        ray_origins, ray_directions : array_like of float, shape (n, 3)
            Rays; the directions may have any length.
        multiple_hits : bool, optional
            True for all hits, False for the nearest one of each ray.

        Returns
        -------
        locations : ndarray of float64, shape (m, 3)
            Points.
        index_ray, index_tri : ndarray of int64, shape (m,)
            Ray and triangle of each point.
        """
        hits = self._hits(ray_origins, ray_directions, None if multiple_hits else 1)
        index_tri, index_ray, locations = hits
        return locations, index_ray, index_tri

    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int | None = None,
        return_locations: bool = False,
    ) -> tuple[_Indices, _Indices] | tuple[_Indices, _Indices, _Floats]:
        """Find the triangles that rays hit.

        Parameters
        ----------
        ray_origins, ray_directions : array_like of float, shape (n, 3)
            Rays; the directions may have any length.
        multiple_hits : bool, optional
            True for all hits, False for the nearest one of each ray.
        max_hits : int, optional
            Maximum number of hits of a ray.
        return_locations : bool, optional
            True for points, too.

        Returns
        -------
        index_tri, index_ray : ndarray of int64, shape (m,)
            Triangle and ray of each hit.
        locations : ndarray of float64, shape (m, 3)
            Points, if they are asked for.
        """
        most = max_hits if multiple_hits else 1
        index_tri, index_ray, locations = self._hits(ray_origins, ray_directions, most)
        if return_locations:
            return index_tri, index_ray, locations
        return index_tri, index_ray

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> _Indices:
        """Find the first triangle that each ray hits.

        Parameters
        ----------
        ray_origins, ray_directions : array_like of float, shape (n, 3)
            Rays; the directions may have any length.

        Returns
        -------
        ndarray of int64, shape (n,)
            Triangles; -1 for rays that hit nothing.
        """
        local, _, directions = self._rays(ray_origins, ray_directions)
        return self._bvh().intersect(local, directions).primitive.astype(np.int64)

    def intersects_any(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike
    ) -> NDArray[np.bool_]:
        """Find the rays that hit the mesh.

        Parameters
        ----------
        ray_origins, ray_directions : array_like of float, shape (n, 3)
            Rays; the directions may have any length.

        Returns
        -------
        ndarray of bool, shape (n,)
            True for rays that hit a triangle.
        """
        local, _, directions = self._rays(ray_origins, ray_directions)
        return self._bvh().occluded(local, directions)

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Find the points inside of a closed mesh, by the parity of the hits of rays.

        Parameters
        ----------
        points : array_like of float, shape (n, 3)
            Points; those on the surface may count as inside or outside.

        Returns
        -------
        ndarray of bool, shape (n,)
            True for points inside.
        """
        from trimesh.ray.ray_util import contains_points

        return np.asarray(contains_points(self, points), dtype=np.bool_)

    def __getstate__(self) -> dict[str, Any]:
        return {"mesh": self.mesh, "_built": None}

    def __deepcopy__(self, memo: object) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh)

    def __copy__(self) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh)

    def _frame(self) -> tuple[int, Bvh, _Floats, float]:
        """Hash of the mesh, its tree, and the middle and radius of its sphere."""
        key = hash(self.mesh)
        if self._built is None or self._built[0] != key:
            vertices = np.asarray(self.mesh.vertices, dtype=np.float64)
            faces = np.asarray(self.mesh.faces)
            used = vertices[np.unique(faces)]
            low, high = (used.min(axis=0), used.max(axis=0)) if len(used) else (np.zeros(3),) * 2
            middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
            radius = radius if radius > 0.0 else 1.0
            self._built = key, Bvh((vertices - middle) / radius, faces), middle, radius
        return self._built

    def _bvh(self) -> Bvh:
        return self._frame()[1]

    def _rays(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike
    ) -> tuple[_Floats, _Floats, _Floats]:
        """Origins in the coordinates of the tree, origins as given, and unit directions."""
        origins = np.asarray(ray_origins, dtype=np.float64)
        directions = np.asarray(ray_directions, dtype=np.float64)
        if origins.shape != directions.shape or origins.ndim != 2 or origins.shape[1] != 3:
            raise ValueError(
                f"ray_origins and ray_directions: found shapes {origins.shape} and "
                f"{directions.shape}, expected (n, 3) twice"
            )
        lengths = np.linalg.norm(directions, axis=1, keepdims=True)
        wrong = ~((lengths[:, 0] > 0.0) & np.isfinite(lengths[:, 0]))
        if wrong.any():
            row = int(wrong.argmax())
            raise ValueError(f"ray_directions: row {row} is zero or not finite")
        directions = directions / lengths
        _, _, middle, radius = self._frame()
        local = (origins - middle) / radius
        along = (local * directions).sum(axis=1)
        nearest = local - along[:, None] * directions
        half_chord = np.sqrt(np.maximum(1.0 - (nearest * nearest).sum(axis=1), 0.0))
        # Rays that begin before the sphere begin a little before their entry into it.
        start = np.maximum(-along - half_chord - 1e-3, 0.0) - _BEHIND
        return local + start[:, None] * directions, origins, directions

    def _hits(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, most: int | None
    ) -> tuple[_Indices, _Indices, _Floats]:
        """Triangles, rays and points of at most so many hits of each ray."""
        local, origins, directions = self._rays(ray_origins, ray_directions)
        bvh = self._bvh()
        index_tri = [np.zeros(0, dtype=np.int64)]
        index_ray = [np.zeros(0, dtype=np.int64)]
        weights = [np.zeros((0, 2))]
        rays = np.arange(len(local))
        starts = np.zeros(len(local), dtype=np.float32)
        found = 0
        while len(rays) and (most is None or found < most):
            hits = bvh.intersect(local[rays], directions[rays], tmin=starts)
            hit = hits.primitive >= 0
            rays, starts = rays[hit], hits.t[hit] + np.float32(_SAME)
            index_tri.append(hits.primitive[hit].astype(np.int64))
            index_ray.append(rays)
            weights.append(hits.uv[hit].astype(np.float64))
            found += 1
        triangles, of_ray = np.concatenate(index_tri), np.concatenate(index_ray)
        points = self._points(
            triangles, np.concatenate(weights), origins[of_ray], directions[of_ray]
        )
        return triangles, of_ray, points

    def _points(
        self, triangles: _Indices, weights: _Floats, origins: _Floats, directions: _Floats
    ) -> _Floats:
        """Points of hits: of the ray on the plane of the triangle, or by the weights of its vertices
        if the two are nearly parallel."""
        vertices = np.asarray(self.mesh.vertices, dtype=np.float64)
        p0, p1, p2 = np.moveaxis(vertices[np.asarray(self.mesh.faces)[triangles]], 1, 0)
        u, v = weights[:, :1], weights[:, 1:]
        points = p0 + u * (p1 - p0) + v * (p2 - p0)
        normals = np.cross(p1 - p0, p2 - p0)
        cosines = (normals * directions).sum(axis=1)
        steep = np.abs(cosines) > _GRAZING * np.linalg.norm(normals, axis=1)
        distances = ((p0 - origins)[steep] * normals[steep]).sum(axis=1) / cosines[steep]
        points[steep] = origins[steep] + distances[:, None] * directions[steep]
        return points
