"""Scenes from files and text, their errors, and the package around them."""

import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer

SQUARE = """
<scene version="3.0.0">
    <sensor type="perspective">
        <film type="hdrfilm">
            <integer name="width" value="$width"/><integer name="height" value="4"/>
        </film>
    </sensor>
    <shape type="rectangle"/>
    <emitter type="constant"/>
</scene>
"""


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
def test_every_format_is_read(scenes: Path, file: str) -> None:
    scene = pathtracer.load(scenes / file)
    assert not [finding for finding in scene.check() if finding.severity == "error"]
    assert "objects" in repr(scene)
    image = pathtracer.render(scene, width=8, height=6, spp=1)
    assert image["color"].shape == (6, 8, 3)


def test_text_is_read_as_files_are(tmp_path: Path) -> None:
    file = tmp_path / "square.xml"
    file.write_text(SQUARE)
    variables = {"width": 7}
    of_file = pathtracer.load(file, variables=variables)
    of_text = pathtracer.loads(SQUARE, "mitsuba", variables=variables)
    of_bytes = pathtracer.loads(SQUARE.encode(), ".xml", variables=variables)
    images = [pathtracer.render(scene, spp=1)["color"] for scene in [of_file, of_text, of_bytes]]
    assert images[0].shape == (4, 7, 3)
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])


def mesh_scene(positions: Any, triangles: Any) -> dict[str, Any]:
    """Scene of a mesh under a grey sky."""
    mesh = {"positions": positions, "triangles": triangles}
    return {
        "pathtracer": 1,
        "cameras": [
            {"type": "perspective", "y_fov": 40, "to_world": {"translate": np.array([0, 0, 5])}}
        ],
        "lights": [{"type": "constant", "radiance": np.float32(0.5)}],
        "objects": [{"name": "net", "type": "mesh", "mesh": mesh}],
    }


def test_scenes_are_made_from_values_and_arrays() -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, 40), np.linspace(-1, 1, 40))
    positions = np.stack([x, y, 0.2 * np.cos(5 * x)], axis=-1).reshape(-1, 3)
    corner = (np.arange(39)[:, None] * 40 + np.arange(39)).reshape(-1, 1)
    triangles = np.concatenate([corner + [0, 1, 40], corner + [1, 41, 40]])
    scene = pathtracer.Scene.from_dict(mesh_scene(positions, triangles))
    lists = pathtracer.Scene.from_dict(mesh_scene(positions.tolist(), triangles.tolist()))
    images = [pathtracer.render(each, width=24, height=18, spp=2) for each in [scene, lists]]
    np.testing.assert_array_equal(images[0]["color"], images[1]["color"])
    bvh = pathtracer.Bvh(positions, triangles)
    rays = [0.1, 0.2, 5.0], [[0.0, 0.0, -1.0], [0.1, 0.0, -1.0]]
    of_scene, of_mesh = scene.intersect(*rays), bvh.intersect(*rays)
    np.testing.assert_array_equal(of_scene.primitive, of_mesh.primitive)
    np.testing.assert_allclose(of_scene.t, of_mesh.t, rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"objects": [{"type": "spere"}]}, pathtracer.SceneError, "spere"),
        ({"object": []}, pathtracer.SceneError, "object"),
        (
            {"lights": [{"type": "constant", "radiance": float("nan")}]},
            ValueError,
            r"lights\[0\].radiance: found NaN, expected a finite number",
        ),
        (
            {"lights": [object()]},
            TypeError,
            r"lights\[0\]: found a value of type object, expected values of JSON",
        ),
    ],
)
def test_wrong_values_are_named(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    scene = mesh_scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(error, match=message):
        pathtracer.Scene.from_dict(scene | change)


def test_scenes_survive_a_file(scene: pathtracer.Scene, tmp_path: Path) -> None:
    file = tmp_path / "copy.json"
    scene.save(file)
    with pytest.raises(FileExistsError, match="exists already"):
        scene.save(file)
    scene.save(file, overwrite=True)
    copy = pathtracer.load(file)
    images = [
        pathtracer.render(each, width=16, height=12, spp=2)["color"] for each in [scene, copy]
    ]
    np.testing.assert_array_equal(images[0], images[1])
    with pytest.raises(ValueError, match="unknown scene format"):
        scene.save(tmp_path / "copy.dae")


def test_all_errors_are_listed_with_locations() -> None:
    text = SQUARE.replace("rectangle", "rectangel").replace("constant", "constantt")
    with pytest.raises(pathtracer.SceneError) as found:
        pathtracer.loads(text, "mitsuba", variables={"width": 4})
    errors = found.value.errors
    assert len(errors) == 2
    first = errors[0]
    assert (first.severity, first.line) == ("error", 8)
    assert first.file == Path("scene.xml")
    assert "rectangel" in first.message
    assert str(first).startswith("scene.xml:8:")
    assert isinstance(found.value, ValueError)


def test_missing_files_are_found(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    texture = '<bsdf type="diffuse"><texture type="bitmap" name="reflectance">' \
        '<string name="filename" value="no.png"/></texture></bsdf>'
    shape = '<shape type="rectangle"/>'
    file.write_text(SQUARE.replace(shape, f'<shape type="rectangle">{texture}</shape>'))
    scene = pathtracer.load(file, variables={"width": 4})
    assert [finding.severity for finding in scene.missing] == ["missing"]
    assert "no.png" in str(scene.missing[0])
    with pytest.raises(pathtracer.SceneError, match="no.png"):
        pathtracer.load(file, variables={"width": 4}, strict=True)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"tim": 1}, TypeError, 'tim: unknown option; did you mean "time"'),
        ({"time": "soon"}, TypeError, "time: "),
        ({"time": float("nan")}, ValueError, "time: found NaN, expected a finite number"),
        ({"point_radius": 0.0}, ValueError, "point_radius: found 0, expected a number above 0"),
        ({"limits": {"memori": 1}}, ValueError, 'unknown limit "memori"'),
        ({"limits": {"memory": -1}}, ValueError, "limits: memory: "),
        ({"camera": []}, TypeError, "camera: "),
        ({"camera": "nobody"}, pathtracer.SceneError, "nobody"),
        ({"variables": {"height": 3}}, pathtracer.SceneError, "height"),
        ({"variables": 3}, TypeError, "variables: "),
        ({"allow_outside": "yes"}, TypeError, "allow_outside: "),
    ],
)
def test_wrong_options_are_named(
    options: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        pathtracer.loads(SQUARE.replace("$width", "4"), "xml", **options)


def test_files_that_cannot_be_opened_are_os_errors(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as found:
        pathtracer.load(tmp_path / "no.dae")
    assert found.value.filename == tmp_path / "no.dae"
    assert found.value.strerror == "No such file or directory"
    with pytest.raises(pathtracer.SceneError, match="unknown scene format"):
        pathtracer.load("scene.docx")
    with pytest.raises(TypeError, match="text: found int"):
        pathtracer.loads(3, "json")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="format: found"):
        pathtracer.loads("", "docx")


def test_the_package_has_the_program(program: Callable[[Sequence[object]], str]) -> None:
    program(["--version"])
    wrong = subprocess.run(
        [sys.executable, "-m", "pathtracer", "--spp", "0"], capture_output=True, text=True
    )
    assert wrong.returncode == 2
    assert "expected a whole number" in wrong.stderr


def test_the_stub_has_all_settings() -> None:
    stub = Path(pathtracer.__file__).with_name("_native.pyi").read_text()
    _, body = stub.split("class _Settings(TypedDict, total=False):\n")
    body, _ = body.split("class _Development")
    names = [line.split(":")[0].strip() for line in body.splitlines() if line.startswith("    ")]
    names = [name for name in names if name.isidentifier()]
    assert names == list(pathtracer.settings())


def test_documented_names_have_docstrings() -> None:
    for name in set(pathtracer.__all__) - {"__version__"}:
        assert getattr(pathtracer, name).__doc__, name
