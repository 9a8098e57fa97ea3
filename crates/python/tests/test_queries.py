"""Ray queries on meshes, against a loop over all triangles in double precision."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import pathtracer

Floats = NDArray[np.float64]

TRIANGLE: tuple[list[list[float]], list[list[int]]] = (
    [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
    [[0, 1, 2]],
)


def triangles(count: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Random triangles in the unit cube."""
    random = np.random.default_rng(seed)
    centers = random.random((count, 1, 3))
    corners = centers + 0.1 * random.standard_normal((count, 3, 3))
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * count).reshape(-1, 3)


def nearest(
    vertices: NDArray[np.float32], faces: NDArray[np.int64], origins: Floats, directions: Floats
) -> tuple[Floats, Floats]:
    """Distances of the nearest and of the second nearest hits, inf if there are none."""
    p0, p1, p2 = np.moveaxis(vertices.astype(np.float64)[faces], 1, 0)
    e1, e2 = p1 - p0, p2 - p0
    normals = np.cross(e1, e2)
    o, d = origins[:, None], directions[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        det = -(d * normals).sum(-1)
        across = np.cross(o - p0, d)
        b1 = (e2 * across).sum(-1) / det
        b2 = -(e1 * across).sum(-1) / det
        t = ((o - p0) * normals).sum(-1) / det
    hit = (b1 >= 0) & (b2 >= 0) & (b1 + b2 <= 1) & (t > 0)
    ordered = np.sort(np.where(hit, t, np.inf), axis=1)
    return ordered[:, 0], ordered[:, 1]


@pytest.mark.parametrize("quality", ["fast", "balanced", "high"])
def test_hits_are_those_of_a_loop_over_all_triangles(quality: Any) -> None:
    vertices, faces = triangles(300, seed=1)
    bvh = pathtracer.Bvh(vertices, faces, quality=quality)
    assert len(bvh) == 300
    random = np.random.default_rng(2)
    # More than one batch, and not a whole number of them.
    origins = random.random((5000, 3)).astype(np.float32)
    directions = random.standard_normal((5000, 3)).astype(np.float32)
    found = bvh.intersect(origins, directions)
    expected, _ = nearest(vertices, faces, origins.astype(float), directions.astype(float))
    # Rays through an edge may differ by rounding.
    same = np.isclose(found.t, expected, rtol=1e-3)
    assert same.mean() > 0.998
    hit = np.isfinite(found.t)
    assert 0.2 < hit.mean() < 1.0
    np.testing.assert_array_equal(found.primitive >= 0, hit)
    np.testing.assert_array_equal(bvh.occluded(origins, directions), hit)

    points = origins + found.t[:, None] * directions
    np.testing.assert_allclose(found.position[hit], points[hit], atol=2e-5)
    p0, p1, p2 = np.moveaxis(vertices[faces[found.primitive[hit]]], 1, 0)
    u, v = found.uv[hit].T[:, :, None]
    np.testing.assert_allclose(found.position[hit], (1 - u - v) * p0 + u * p1 + v * p2, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found.normal[hit], axis=1), 1.0, atol=1e-6)
    assert (np.cross(p1 - p0, p2 - p0) * found.normal[hit]).sum(-1).min() > 0.0
    assert np.isnan(found.position[~hit]).all()
    assert np.isnan(found.normal[~hit]).all()
    assert (found.primitive[~hit] == -1).all()
    np.testing.assert_array_equal(found.shape, np.where(hit, 0, -1))


@pytest.mark.parametrize("dtypes", [("f4", "f4"), ("f4", "f8"), ("f8", "f4"), ("f8", "f8")])
def test_results_do_not_depend_on_the_order_of_rays(dtypes: tuple[str, str]) -> None:
    vertices, faces = triangles(200, seed=3)
    bvh = pathtracer.Bvh(vertices, faces)
    random = np.random.default_rng(4)
    # More than a thread takes at a time.
    count = 40_001
    origins = random.random((count, 3)).astype("f4").astype(dtypes[0])
    directions = random.standard_normal((count, 3)).astype("f4").astype(dtypes[1])
    ends = random.random(count)
    all_at_once = bvh.intersect(origins, directions, ends)
    assert 0.05 < (all_at_once.primitive >= 0).mean() < 0.9
    occluded = bvh.occluded(origins, directions, ends)
    np.testing.assert_array_equal(occluded, all_at_once.primitive >= 0)
    order = random.permutation(count)
    for part in np.array_split(order, 27):
        few = bvh.intersect(origins[part], directions[part], ends[part])
        for name in ["t", "shape", "primitive", "uv", "position", "normal"]:
            of_all = getattr(all_at_once, name)[part]
            np.testing.assert_array_equal(getattr(few, name), of_all, err_msg=name)


def test_shapes_are_those_of_the_rays() -> None:
    bvh = pathtracer.Bvh(*TRIANGLE)
    single = bvh.intersect([0.5, 0.5, 3.0], [0.0, 0.0, -2.0])
    assert single.t.shape == ()
    assert single.t == 1.5
    assert single.position.tolist() == [0.5, 0.5, 0.0]
    assert single.normal.tolist() == [0.0, 0.0, 1.0]
    assert single.uv.tolist() == [0.25, 0.25]
    directions = np.zeros((4, 5, 3))
    directions[..., 2] = -1.0
    grid = bvh.intersect([0.5, 0.5, 3.0], directions)
    assert grid.t.shape == grid.primitive.shape == (4, 5)
    assert grid.uv.shape == (4, 5, 2)
    assert grid.normal.shape == (4, 5, 3)
    assert bvh.occluded(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    origins = np.full((4, 1, 3), [0.5, 0.5, 3.0])
    assert bvh.occluded(origins, [[[0.0, 0.0, -1.0]] * 5]).tolist() == [[True] * 5] * 4
    assert bvh.intersect(origins[:, 0], [[0.0, 0.0, -2.0]]).t.tolist() == [1.5] * 4
    assert bvh.bounds == ([0.0, 0.0, 0.0], [2.0, 2.0, 0.0])
    assert bvh.nbytes > 0


def test_rays_end_at_tmax() -> None:
    bvh = pathtracer.Bvh(*TRIANGLE)
    origins = np.full((3, 3), [0.5, 0.5, 1.0])
    down = [0.0, 0.0, -1.0]
    assert bvh.occluded(origins, down, tmax=[0.5, 1.5, np.inf]).tolist() == [False, True, True]
    assert bvh.occluded(origins, down, tmax=0.5).tolist() == [False] * 3
    assert np.isinf(bvh.intersect(origins, down, tmax=0.5).t).all()
    assert bvh.occluded(origins, down, tmin=[0.5, 1.0, 1.5]).tolist() == [True, False, False]


def test_any_layout_and_type_of_array_is_read() -> None:
    vertices, faces = triangles(50, seed=3)
    random = np.random.default_rng(4)
    origins, directions = random.random((64, 3)), random.standard_normal((64, 3))
    expected = pathtracer.Bvh(vertices, faces).intersect(origins, directions).t
    read_only = vertices.copy()
    read_only.flags.writeable = False
    backwards = faces[::-1].copy()[::-1]
    for mesh in [
        (read_only, faces.astype(np.uint8)),
        (np.asfortranarray(vertices), backwards),
        (vertices.astype(">f4"), faces.tolist()),
        (np.repeat(vertices, 2, axis=0)[::2], faces.astype(np.uint64)),
    ]:
        np.testing.assert_array_equal(
            pathtracer.Bvh(*mesh).intersect(origins, directions).t, expected
        )
    flipped = pathtracer.Bvh(vertices, faces).intersect(origins[::-1], directions[::-1])
    np.testing.assert_array_equal(flipped.t[::-1], expected)


@pytest.mark.parametrize(
    ("vertices", "faces", "error", "message"),
    [
        ([[0, 0]], [[0, 0, 0]], ValueError, r"vertices: found shape \(1, 2\), expected \(n, 3\)"),
        ([[0, 0, 0], [1, 1]], [[0, 0, 0]], ValueError, "vertices: "),
        ([["a", "b", "c"]], [[0, 0, 0]], TypeError, "vertices: found an array of <U1"),
        ([[0, 0, 1j]], [[0, 0, 0]], TypeError, "vertices: found an array of complex128"),
        ([[0, 0, np.nan]], [[0, 0, 0]], ValueError, "vertices: found NaN in place 2"),
        ([[0, 0, 1e300]], [[0, 0, 0]], ValueError, "vertices: found inf in place 2"),
        ([[0, 0, 0]], [0, 0, 0], ValueError, r"faces: found shape \(3,\), expected \(m, 3\)"),
        ([[0, 0, 0]], [[0.0, 0.0, 0.0]], TypeError, "faces: found an array of float64"),
        ([[0, 0, 0]], [[0, 0, 1]], ValueError, "faces: row 0 refers to vertex 1, but there are 1"),
        ([[0, 0, 0]], [[0, -1, 0]], ValueError, "faces: row 0 refers to vertex -1"),
        (None, [[0, 0, 0]], TypeError, "vertices: found an array of object"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow")
def test_wrong_meshes_are_named(
    vertices: Any, faces: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        pathtracer.Bvh(vertices, faces)


@pytest.mark.parametrize(
    ("origins", "directions", "tmax", "error", "message"),
    [
        ([0, 0], [0, 0, 1], None, ValueError, r"origins: found shape \(2,\), expected \(..., 3\)"),
        (0.0, [0, 0, 1], None, ValueError, r"origins: found shape \(\)"),
        ([0, 0, 0], [0, 0, 0], None, ValueError, "directions: that of ray 0 is zero"),
        ([0, 0, 0], [0, np.inf, 0], None, ValueError, "directions: found inf in place 1"),
        ([0, np.nan, 0], [0, 1, 0], None, ValueError, "origins: found NaN in place 1"),
        (np.zeros((2, 3)), np.ones((5, 3)), None, ValueError, "origins and directions: shapes"),
        ([0, 0, 0], [0, 1, 0], [1, 2], ValueError, "tmax: shape"),
        ([0, 0, 0], [0, 1, 0], np.nan, ValueError, "tmax: found NaN"),
        ([0, 0, 0], [0, 1, 0], "far", TypeError, "tmax: found an array of <U3"),
    ],
)
def test_wrong_rays_are_named(
    origins: Any, directions: Any, tmax: Any, error: type[Exception], message: str
) -> None:
    bvh = pathtracer.Bvh(*TRIANGLE)
    for query in [bvh.intersect, bvh.occluded]:
        with pytest.raises(error, match=message):
            query(origins, directions, tmax)


def test_meshes_without_triangles_are_never_hit() -> None:
    bvh = pathtracer.Bvh(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    assert bvh.bounds is None
    assert not bvh.occluded([0, 0, 0], [0, 0, 1])
    flat = pathtracer.Bvh([[0, 0, 0]], [[0, 0, 0]])
    assert flat.skipped == 1
    with pytest.raises(ValueError, match="quality: found"):
        pathtracer.Bvh(*TRIANGLE, quality="best")  # type: ignore[arg-type]


def test_surfaces_of_scenes_are_found(scene: pathtracer.Scene) -> None:
    image = pathtracer.render(
        scene, width=32, height=24, spp=1, aovs=["position", "primitive", "depth", "object"]
    )
    # Rays of the first samples, from the camera through the points that they met.
    position, depth = image["position"], image["depth"]
    met = depth > 0
    assert met.sum() > 300
    camera = camera_position(position[met], depth[met])
    towards = position[met] - camera
    found = scene.intersect(camera, 2.0 * towards)
    near = np.isclose(found.t, 0.5, atol=1e-3)
    assert near.mean() > 0.99
    np.testing.assert_allclose(found.position[near], position[met][near], atol=5e-3)
    # There, 0 is no object.
    objects = image["object"][met][near].astype(int) - 1
    assert (found.shape[near] == objects).mean() > 0.99
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-6)
    assert scene.occluded(camera, towards, tmax=1.1).mean() > 0.99
    assert scene.occluded(camera, towards, tmax=0.5).mean() < 0.5


@pytest.mark.parametrize("length", [1e-40, 1e-20, 1.0, 1e20, 3e38])
def test_directions_have_any_length(scene: pathtracer.Scene, length: float) -> None:
    found = scene.intersect([0.0, 1.0, 0.0], [0.0, -length, 0.0])
    assert found.position[1] == pytest.approx(0.5488, abs=1e-6)
    if 1e-30 < length < 1e30:
        assert found.t * length == pytest.approx(0.4512, rel=1e-5)
    ends = [0.9 * 0.4512 / length, 1.1 * 0.4512 / length]
    if length > 1e-30:
        hit = [bool(scene.occluded([0.0, 1.0, 0.0], [0.0, -length, 0.0], end)) for end in ends]
        assert hit == [False, True]


def camera_position(points: NDArray[np.float32], distances: NDArray[np.float32]) -> Floats:
    """Point with these distances from points, by least squares."""
    p, d = points.astype(float), distances.astype(float)
    matrix = np.column_stack([-2.0 * p, np.ones(len(p))])
    solution = np.linalg.lstsq(matrix, d**2 - (p**2).sum(1), rcond=None)[0]
    return np.asarray(solution[:3])
