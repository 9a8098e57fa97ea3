"""Ray queries for trimesh, on meshes whose hits are known."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
import trimesh

from pathtracer.trimesh import RayMeshIntersector


def with_queries(mesh: Any) -> Any:
    mesh.ray = RayMeshIntersector(mesh)
    return mesh


@pytest.mark.parametrize("scale", [1e-8, 1e-3, 1.0, 1e6, 1e12])
@pytest.mark.parametrize("distance", [1.0, 1e3, 1e9])
def test_rays_through_a_box_hit_it_twice(scale: float, distance: float) -> None:
    box = trimesh.creation.box(extents=[2.0, 2.0, 2.0]).subdivide().subdivide()
    box.apply_scale(scale)
    box.apply_translation([3 * scale, -2 * scale, scale])
    with_queries(box)
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, 49), np.linspace(-1.2, 1.2, 49))
    # Rays along edges and diagonals of the triangles are among them.
    origins = scale * np.stack([x + 3, y - 2, np.full_like(x, 1 + distance)], -1).reshape(-1, 3)
    directions = np.tile([0.0, 0.0, -7.0], (len(origins), 1))
    locations, rays, triangles = box.ray.intersects_location(origins, directions)
    inside = (np.maximum(np.abs(x), np.abs(y)) < 0.999).ravel()
    outside = (np.maximum(np.abs(x), np.abs(y)) > 1.001).ravel()
    hits = np.bincount(rays, minlength=len(origins))
    assert (hits[inside] == 2).all()
    assert (hits[outside] == 0).all()
    np.testing.assert_allclose(locations[:, :2], origins[rays, :2], rtol=1e-9)
    upper = box.face_normals[triangles][:, 2] > 0.5
    steep = np.abs(box.face_normals[triangles][:, 2]) > 0.5
    heights = locations[steep, 2] / scale
    expected = np.where(upper, 2.0, 0.0)[steep]
    # A distance of 10⁹ has errors of 10⁻⁷ in double precision.
    np.testing.assert_allclose(heights, expected, atol=1e-6)
    assert (box.ray.intersects_any(origins, directions) == (hits > 0)).all()
    assert ((box.ray.intersects_first(origins, directions) >= 0) == (hits > 0)).all()


def test_points_inside_are_contained() -> None:
    ball = with_queries(trimesh.creation.icosphere(subdivisions=4, radius=2.0))
    points = np.random.default_rng(1).uniform(-3, 3, (3000, 3))
    radii = np.linalg.norm(points, axis=1)
    contained = ball.contains(points)
    assert contained[radii < 1.99].all()
    assert not contained[radii > 2.0].any()


def test_numbers_of_hits_can_be_limited() -> None:
    shells = with_queries(
        trimesh.util.concatenate([trimesh.creation.icosphere(radius=r) for r in [1.0, 2.0, 3.0]])
    )
    origins, directions = np.zeros((5, 3)), np.random.default_rng(2).standard_normal((5, 3))
    cases: list[tuple[dict[str, Any], int]] = [
        ({}, 3),
        ({"max_hits": 2}, 2),
        ({"multiple_hits": False}, 1),
    ]
    for limits, expected in cases:
        triangles, rays = shells.ray.intersects_id(origins, directions, **limits)
        assert np.bincount(rays, minlength=5).tolist() == [expected] * 5
    triangles, rays, points = shells.ray.intersects_id(origins, directions, return_locations=True)
    first = shells.ray.intersects_first(origins, directions)
    assert first.tolist() == triangles[np.argsort(rays, kind="stable")][::3].tolist()
    assert points.shape == (15, 3)


def test_changes_of_the_mesh_are_seen() -> None:
    box = with_queries(trimesh.creation.box())
    ray = [[0.0, 0.0, 5.0]], [[0.0, 0.0, -1.0]]
    assert box.ray.intersects_any(*ray).all()
    box.apply_translation([3.0, 0.0, 0.0])
    assert not box.ray.intersects_any(*ray).any()
    for other in [copy.copy(box.ray), copy.deepcopy(box.ray), pickle.loads(pickle.dumps(box.ray))]:
        assert not other.intersects_any(*ray).any()
        assert other.intersects_any([[3.0, 0.0, 5.0]], [[0.0, 0.0, -1.0]]).all()


def test_meshes_without_faces_are_never_hit() -> None:
    empty = RayMeshIntersector(trimesh.Trimesh())
    locations, rays, triangles = empty.intersects_location([[0, 0, 0]], [[0, 0, 1]])
    assert locations.shape == (0, 3)
    assert len(rays) == len(triangles) == 0
    with pytest.raises(ValueError, match="ray_origins and ray_directions: found shapes"):
        empty.intersects_any([[0, 0, 0]], [[0, 0, 1], [0, 1, 0]])
    with pytest.raises(ValueError, match="ray_directions: row 0 is zero"):
        with_queries(trimesh.creation.box()).ray.intersects_any([[0, 0, 0]], [[0, 0, 0]])
