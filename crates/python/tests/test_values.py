"""Scenes as dictionaries with arrays, and back."""

import array
import contextlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer

POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]], dtype=np.float32)
TRIANGLES = np.array([[0, 1, 2], [2, 1, 3]], dtype=np.uint32)


def pixels(scene: pathtracer.Scene) -> Any:
    return pathtracer.render(scene, width=16, height=12, spp=2)["color"]


def grid(side: int) -> tuple[Any, Any]:
    """Positions and triangles of a square net of points."""
    x, y = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side))
    positions = np.stack([x, y, 0.1 * np.cos(9 * x)], axis=-1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1, 1)
    return positions, np.concatenate([corner + [0, 1, side], corner + [1, side + 1, side]])


def of_mesh(positions: Any, triangles: Any, **others: Any) -> dict[str, Any]:
    mesh = {"positions": positions, "triangles": triangles, **others}
    camera = {"type": "perspective", "y_fov": 40, "to_world": {"translate": [0, 0, 5]}}
    return {
        "pathtracer": 1,
        "cameras": [camera],
        "lights": [{"type": "constant", "radiance": 0.5}],
        "objects": [{"name": "net", "type": "mesh", "mesh": mesh}],
    }


@pytest.mark.parametrize(
    "file",
    [
        "cornell.dae",
        "gltf/lights.gltf",
        "gltf/instances.glb",
        "json/shapes.json",
        "mitsuba/blends.xml",
        "obj/materials.obj",
        "pbrt/boxes.pbrt",
    ],
)
def test_scenes_survive_a_dictionary(scenes: Path, file: str) -> None:
    scene = pathtracer.load(scenes / file)
    copy = pathtracer.Scene.from_dict(scene.to_dict())
    assert repr(copy) == repr(scene)
    np.testing.assert_array_equal(pixels(copy), pixels(scene))


def test_meshes_are_arrays() -> None:
    positions, triangles = grid(40)
    colors = np.random.default_rng(1).random((1600, 3))
    scene = pathtracer.Scene.from_dict(of_mesh(positions, triangles, colors=colors))
    mesh = scene.to_dict()["meshes"]["mesh"]
    for key, given, dtype in [
        ("positions", positions, np.float32),
        ("triangles", triangles, np.uint32),
        ("colors", colors, np.float32),
    ]:
        assert mesh[key].dtype == dtype
        np.testing.assert_array_equal(mesh[key], given.astype(dtype))
    mesh["positions"][:] = 0
    assert scene.to_dict()["meshes"]["mesh"]["positions"].any()


def test_arrays_have_the_values_of_lists() -> None:
    positions, triangles = grid(40)
    arrays = pathtracer.Scene.from_dict(of_mesh(positions, triangles))
    lists = pathtracer.Scene.from_dict(of_mesh(positions.tolist(), triangles.tolist()))
    np.testing.assert_array_equal(pixels(arrays), pixels(lists))


@pytest.mark.parametrize(
    "convert",
    [
        lambda a: np.asfortranarray(a),
        lambda a: a[::-1].copy()[::-1],
        lambda a: np.repeat(a, 2, axis=0)[::2],
        lambda a: a.astype(a.dtype.newbyteorder()),
        lambda a: np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(a.dtype).reshape(a.shape),
        lambda a: a.astype(np.float16 if a.dtype.kind == "f" else np.uint16),
        lambda a: a.astype(np.longdouble if a.dtype.kind == "f" else np.int16),
        lambda a: a.astype(np.float64 if a.dtype.kind == "f" else np.uint64),
        lambda a: memoryview(a),
        lambda a: array.array(a.dtype.char, a.ravel().tolist()),
    ],
)
@pytest.mark.parametrize("side", [4, 20])
def test_arrays_of_any_type_and_layout_are_the_same(
    side: int, convert: Callable[[Any], Any]
) -> None:
    positions, triangles = grid(side)
    # Exact in half precision.
    positions = np.round(positions * 64) / 64
    wanted = pathtracer.Scene.from_dict(of_mesh(positions, triangles))
    given = [convert(positions.astype(np.float32)), convert(triangles.astype(np.uint32))]
    if isinstance(given[0], array.array):
        given = [np.reshape(memoryview(each), (-1, 3)) for each in given]
    scene = pathtracer.Scene.from_dict(of_mesh(*given))
    np.testing.assert_array_equal(pixels(scene), pixels(wanted))


def frozen(values: Any) -> Any:
    """Return a read-only copy."""
    values = values.copy()
    values.flags.writeable = False
    return values


def test_scenes_use_the_memory_of_arrays_that_nobody_changes() -> None:
    positions, triangles = grid(20)
    wanted = pixels(pathtracer.Scene.from_dict(of_mesh(positions, triangles)))
    for dtype in (np.uint32, np.int32):
        given = [frozen(positions.astype(np.float32)), frozen(triangles.astype(dtype))]
        before = [sys.getrefcount(each) for each in given]
        scene = pathtracer.Scene.from_dict(of_mesh(*given))
        assert all(sys.getrefcount(each) > count for each, count in zip(given, before))
        np.testing.assert_array_equal(pixels(scene), wanted)
        # A copy of a part of the scene has its own memory.
        scene.to_dict()["meshes"]["mesh"]["positions"][:] = 0
        np.testing.assert_array_equal(pixels(scene), wanted)
        del scene
        assert [sys.getrefcount(each) for each in given] == before
    # The scene keeps the memory.
    scene = pathtracer.Scene.from_dict(
        of_mesh(
            np.frombuffer(positions.astype(np.float32).tobytes(), np.float32).reshape(-1, 3),
            memoryview(triangles.astype(np.uint32).tobytes()).cast("I", triangles.shape),
        )
    )
    np.testing.assert_array_equal(pixels(scene), wanted)
    image = frozen(np.random.default_rng(1).random((8, 8, 3), np.float32))
    before = [sys.getrefcount(image)]
    values = of_mesh(POSITIONS, TRIANGLES)
    values["images"] = {"noise": {"pixels": image}}
    values["lights"] = [{"type": "environment", "image": "noise"}]
    scene = pathtracer.Scene.from_dict(values)
    assert sys.getrefcount(image) > before[0]
    np.testing.assert_array_equal(scene.to_dict()["images"]["image"]["pixels"], image)


@pytest.mark.parametrize(
    "convert",
    [
        lambda a: a,
        lambda a: np.lib.stride_tricks.as_strided(a, writeable=False),
        lambda a: memoryview(a).toreadonly(),
        lambda a: memoryview(bytearray(a.tobytes())).toreadonly().cast(a.dtype.char, a.shape),
        lambda a: frozen(a)[::-1],
        lambda a: frozen(a.astype(a.dtype.newbyteorder())),
        lambda a: frozen(a.astype(np.float64 if a.dtype.kind == "f" else np.int64)),
    ],
)
def test_arrays_that_somebody_may_change_are_copied(convert: Callable[[Any], Any]) -> None:
    positions, triangles = grid(20)
    originals = [positions.astype(np.float32), triangles.astype(np.uint32)]
    given = [convert(each) for each in originals]
    wanted = pathtracer.Scene.from_dict(of_mesh(given[0].tolist(), given[1].tolist()))
    before = [sys.getrefcount(each) for each in given]
    scene = pathtracer.Scene.from_dict(of_mesh(*given))
    assert [sys.getrefcount(each) for each in given] == before
    for each in originals:
        each[:] = 0
    np.testing.assert_array_equal(pixels(scene), pixels(wanted))


def test_a_promise_that_is_broken_does_no_harm() -> None:
    """Memory that was read-only is changed all the same, while scenes with it are compiled."""
    positions, triangles = grid(60)
    given = [frozen(positions.astype(np.float32)), frozen(triangles.astype(np.uint32))]
    for value in [np.nan, 0xFFFFFFFF, np.inf, 12345678, 0]:
        scene = pathtracer.Scene.from_dict(of_mesh(*given))
        for each in given:
            each.flags.writeable = True
        given[0][::7] = value if not isinstance(value, int) else 0
        given[1][::5] = value if isinstance(value, int) else 0
        with contextlib.suppress(ValueError, RuntimeError, pathtracer.SceneError):
            pixels(scene)
        given[0][:], given[1][:] = positions, triangles
        for each in given:
            each.flags.writeable = False
    assert pixels(pathtracer.Scene.from_dict(of_mesh(*given))).max() > 0


class Tensor:
    """An array of another library, which has DLPack only."""

    def __init__(self, values: Any, error: Exception | None = None) -> None:
        self.values, self.error = values, error

    def __dlpack__(self, **options: Any) -> Any:
        if self.error:
            raise self.error
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self) -> Any:
        return self.values.__dlpack_device__()


def test_arrays_of_other_libraries_are_read() -> None:
    positions, triangles = grid(40)
    wanted = pathtracer.Scene.from_dict(of_mesh(positions, triangles))
    scene = pathtracer.Scene.from_dict(of_mesh(Tensor(positions), Tensor(triangles)))
    np.testing.assert_array_equal(pixels(scene), pixels(wanted))
    wrong = Tensor(positions, BufferError("the tensor requires gradients"))
    with pytest.raises(TypeError, match="positions: the array cannot be read: the tensor requires"):
        pathtracer.Scene.from_dict(of_mesh(wrong, triangles))


def test_images_are_arrays() -> None:
    levels = np.arange(48, dtype=np.uint8).reshape(4, 4, 3) * 5
    linear = levels / 255.0
    linear = np.where(linear <= 0.04045, linear / 12.92, ((linear + 0.055) / 1.055) ** 2.4)

    def of(**image: Any) -> Any:
        texture = {"type": "bitmap", "image": image}
        values = of_mesh(POSITIONS, TRIANGLES, uvs=POSITIONS[:, :2])
        values["materials"] = {"m": {"type": "diffuse", "reflectance": texture}}
        values["objects"][0]["material"] = "m"
        return pathtracer.Scene.from_dict(values).to_dict()["images"]["image"]["pixels"]

    assert of(pixels=levels).dtype == np.float32
    np.testing.assert_allclose(of(pixels=levels), linear, rtol=1e-6)
    np.testing.assert_array_equal(of(pixels=linear), linear.astype(np.float32))
    np.testing.assert_array_equal(of(pixels=linear.tolist()), linear.astype(np.float32))
    np.testing.assert_allclose(of(pixels=levels, raw=True), levels / 255.0, rtol=1e-6)
    grey = of(pixels=linear[..., 0])
    np.testing.assert_array_equal(grey, np.repeat(linear[..., :1], 3, axis=-1).astype(np.float32))
    for wrong, message in [
        (linear[..., :2], r"pixels: found an array of shape \(4, 4, 2\)"),
        (np.zeros((0, 4, 3)), "pixels: found 0 pixels"),
        (np.full((4, 4, 3), np.inf), "pixels: found inf in row 0"),
        (levels.astype(np.int32), "pixels: expected an array of real numbers in linear light"),
    ]:
        with pytest.raises(pathtracer.SceneError, match=message):
            of(pixels=wrong)


def test_grids_are_arrays() -> None:
    cells = np.random.default_rng(2).random((3, 4, 5)).astype(np.float32)

    def of(values: Any) -> pathtracer.Scene:
        extinction = {"grid": {"resolution": [5, 4, 3], "values": values}}
        medium = {"type": "heterogeneous", "extinction": extinction}
        return pathtracer.Scene.from_dict(
            of_mesh(POSITIONS, TRIANGLES) | {"media": {"smoke": medium}}
        )

    grids = [of(values).to_dict()["grids"]["grid"] for values in [cells, cells.ravel().tolist()]]
    for made in grids:
        assert made["values"].shape == (3, 4, 5, 1)
        np.testing.assert_array_equal(made["values"][..., 0], cells)
    with pytest.raises(pathtracer.SceneError, match="values: found an array of shape"):
        of(np.zeros((5, 4, 12)))


def test_profiles_are_bytes() -> None:
    text = b"IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 0\n0 90\n0\n100 50\n"
    light = {"type": "ies", "profile": {"file": text}, "to_world": {"translate": [0, 1, 1]}}
    values = of_mesh(POSITIONS, TRIANGLES) | {"lights": [light]}
    scene = pathtracer.Scene.from_dict(values)
    written = scene.to_dict()
    assert isinstance(written["profiles"]["profile"]["file"], bytes)
    copy = pathtracer.Scene.from_dict(written)
    np.testing.assert_array_equal(pixels(copy), pixels(scene))
    light["profile"] = {"file": b"no profile"}
    with pytest.raises(pathtracer.SceneError, match=r"lights\[0\].profile.file: "):
        pathtracer.Scene.from_dict(values)


def test_the_receipt_depends_on_arrays() -> None:
    positions, triangles = grid(40)

    def content(positions: Any) -> Any:
        scene = pathtracer.Scene.from_dict(of_mesh(positions, triangles))
        return pathtracer.render(scene, width=4, height=3, spp=1).receipt["files"]

    assert content(positions) == content(positions.copy())
    assert content(positions) != content(positions + 1)


LARGE = grid(20)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"positions": LARGE[0][:, :2]}, ValueError, r"positions: .* shape \(400, 2\), expected"),
        ({"positions": LARGE[0][None]}, ValueError, r"positions: .* shape \(1, 400, 3\)"),
        ({"positions": LARGE[0] * np.nan}, ValueError, "positions: found NaN in row 0"),
        ({"positions": LARGE[0] * 1e60}, ValueError, "positions: found -?inf in row 0"),
        ({"positions": LARGE[0].astype(complex)}, TypeError, "positions: .* complex128"),
        ({"positions": LARGE[0].astype(object)}, TypeError, "positions: .* object"),
        ({"positions": LARGE[0] > 0}, TypeError, "positions: .* bool"),
        ({"positions": np.zeros((1,) * 9)}, ValueError, "positions: .* 9 dimensions"),
        ({"positions": object()}, TypeError, "positions: found a value of type object"),
        ({"positions": [[np.nan] * 3]}, ValueError, r"positions\[0\]\[0\]: found NaN"),
        (
            {"positions": np.broadcast_to(np.float32(0), (1 << 40, 3))},
            ValueError,
            "positions: it needs",
        ),
        ({"triangles": LARGE[1].astype(float)}, ValueError, "triangles: .* real numbers"),
        ({"triangles": LARGE[1] - 1}, ValueError, "triangles: found -1 in row 0"),
        ({"triangles": LARGE[1] + (1 << 40)}, ValueError, "triangles: found 10995"),
        ({"triangles": LARGE[1] + 1}, ValueError, "mesh: found index 400"),
        ({"uvs": LARGE[0]}, ValueError, r"uvs: .* shape \(400, 3\), expected \(n, 2\)"),
        ({"name": b"bytes"}, ValueError, "name: expected a text, found 5 bytes"),
        ({"name": "\ud800"}, ValueError, "name: found a text that is not Unicode"),
        ({"parts": 1 << 70}, ValueError, "parts: found an integer of more than 64 bits"),
        ({3: 1}, TypeError, "mesh: found a key of type int"),
    ],
)
def test_wrong_arrays_are_named(
    change: dict[Any, Any], error: type[Exception], message: str
) -> None:
    values = of_mesh(*LARGE)
    values["objects"][0]["mesh"].update(change)
    with pytest.raises(error, match=r"objects\[0\]\.(mesh\.)?" + message):
        pathtracer.Scene.from_dict(values)


def test_cycles_are_refused() -> None:
    values = of_mesh(POSITIONS, TRIANGLES)
    values["objects"].append(values)
    with pytest.raises(ValueError, match="nested too deeply"):
        pathtracer.Scene.from_dict(values)
