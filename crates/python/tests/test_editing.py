"""Edited scenes: their images are those of scenes that are made anew."""

import concurrent.futures
import dataclasses
import gc
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer
from pathtracer import build

RED = build.DiffuseMaterial(reflectance=[0.7, 0.1, 0.1])


def room() -> pathtracer.Scene:
    """A ball and a textured tile under a lamp, in which names are not all different."""
    chess = build.CheckerboardTexture(colors=[0.2, 0.8])
    levels = np.arange(48, dtype=np.uint8).reshape(4, 4, 3) * 5
    image = build.BitmapTexture(image=build.Image(pixels=levels))
    fog = build.HomogeneousMedium(name="fog", extinction=0.05, albedo=0.5)
    lying: list[build.Step] = [
        build.Rotate(rotate=-90, axis=[1, 0, 0]),
        build.Scale(scale=3),
        build.Translate(translate=[0, -1, 0]),
    ]
    return pathtracer.Scene(
        camera=build.PerspectiveCamera(
            name="eye",
            y_fov=40,
            medium=fog,
            to_world=build.LookAt(look_at=[0, 0, 0], from_=[0, 1, 5]),
        ),
        lights=[
            build.ConstantLight(name="sky", radiance=0.2),
            build.PointLight(
                name="lamp", intensity=4, to_world=build.Translate(translate=[1, 3, 2])
            ),
        ],
        materials={
            "gold": build.ConductorMaterial(eta=0.2, k=3.9, roughness=build.Roughness(alpha=0.2)),
            "tile": build.DiffuseMaterial(reflectance=image),
            "chess": build.DiffuseMaterial(reflectance=chess),
        },
        objects=[
            build.Sphere(name="ball", material="gold"),
            build.Rectangle(name="floor", material="tile", to_world=lying),
            build.Cube(material="chess", to_world=build.Translate(translate=[2.2, 0, -1])),
            build.Cube(material="chess", to_world=build.Translate(translate=[-2.2, 0, -1])),
        ],
        settings=build.Settings(integrator="volpath", resolution=[24, 16]),
    )


def pixels(scene: pathtracer.Scene) -> Any:
    image = pathtracer.render(scene, spp=2, aovs=["albedo", "normal", "depth"])
    return {name: image[name] for name in image}


def assert_same(edited: pathtracer.Scene, values: dict[str, Any]) -> None:
    """Asserts that the image is that of the values."""
    wanted = pathtracer.Scene.from_dict(values)
    for name, array in pixels(wanted).items():
        np.testing.assert_array_equal(pixels(edited)[name], array, err_msg=name)
    notes = [pathtracer.render(scene, spp=1).notes for scene in (edited, wanted)]
    assert notes[0] == notes[1]


def shifted(x: float) -> Any:
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def test_a_camera_is_replaced() -> None:
    scene = room()
    before = pixels(scene)
    assert isinstance(scene.camera, build.PerspectiveCamera)
    camera: Any = scene.camera
    assert camera.name == "eye"
    assert camera.medium == "fog"
    assert camera.to_world.shape == (4, 4)
    np.testing.assert_array_equal(camera.to_world[:3, 3], [0, 1, 5])
    moved = shifted(1) @ camera.to_world
    edited = scene.replace(camera=dataclasses.replace(camera, to_world=moved))
    values = scene.to_dict()
    values["cameras"][0]["to_world"] = {"matrix": moved.tolist()}
    assert_same(edited, values)
    back = edited.replace(camera=camera)
    for name, array in pixels(back).items():
        np.testing.assert_array_equal(array, before[name])
    assert len(edited.cameras) == 1
    haze = build.HomogeneousMedium(name="haze", extinction=0.3, albedo=0.9)
    values["media"]["haze"] = {"type": "homogeneous", "extinction": 0.3, "albedo": 0.9}
    values["cameras"][0]["medium"] = "haze"
    camera = edited.camera
    camera.medium = haze
    assert_same(edited.replace(camera=camera), values)
    assert pathtracer.Scene(objects=[]).camera is None


def test_another_camera_is_used() -> None:
    values = room().to_dict()
    other = values["cameras"][0] | {"name": "near", "y_fov": 20}
    values["cameras"].append(other)
    scene = pathtracer.Scene.from_dict(values)
    before = pixels(scene)
    keys: list[tuple[str | int, int]] = [("eye", 0), ("near", 1), (0, 0)]
    for key, number in keys:
        edited = scene.replace(used_camera=key)
        assert edited.camera is not None
        assert edited.camera.name == ["eye", "near"][number]
        assert_same(edited, values | {"used_camera": number})
    back = scene.replace(used_camera="eye").replace(used_camera="near")
    for name, array in pixels(back).items():
        np.testing.assert_array_equal(array, before[name])
    wide: Any = scene.cameras[0]
    wide.y_fov = 60
    cameras: list[Any] = scene.replace(used_camera="eye", camera=wide).cameras
    assert [camera.y_fov for camera in cameras] == pytest.approx([60, 20])
    wrong: list[tuple[str | int, str]] = [
        ("far", 'used_camera: unknown camera "far"'),
        (2, "used_camera: found 2, expected a number below 2"),
    ]
    for key, message in wrong:
        with pytest.raises(ValueError, match=re.escape(message)):
            scene.replace(used_camera=key)
    with pytest.raises(TypeError, match="used_camera: found a key of type float"):
        scene.replace(used_camera=1.5)  # type: ignore[arg-type]


def test_materials_are_replaced() -> None:
    scene = room()
    pixels(scene)
    assert scene.materials == ["gold", "tile", "chess"]
    values = scene.to_dict()
    values["materials"]["gold"] = {"type": "diffuse", "reflectance": [0.7, 0.1, 0.1]}
    edited = scene.replace(materials={"gold": RED})
    assert_same(edited, values)
    glowing = scene.material("tile")
    glowing.emission = [0.5, 0.2, 0.1]
    values["materials"]["tile"]["emission"] = [0.5, 0.2, 0.1]
    assert_same(edited.replace(materials={"tile": glowing}), values)
    gold = scene.material("gold")
    assert isinstance(gold, build.ConductorMaterial)
    for name, array in pixels(edited.replace(materials={"gold": gold})).items():
        np.testing.assert_array_equal(array, pixels(scene)[name])


def test_objects_are_transformed() -> None:
    scene = room()
    pixels(scene)
    assert scene.objects == ["ball", "floor", "", ""]
    transforms = scene.transforms
    assert list(transforms) == ["ball", "floor", 2, 3]
    moved = {"ball": shifted(0.5) @ transforms["ball"], 3: shifted(0.25)[:3] @ transforms[3]}
    edited = scene.replace(transforms=moved)
    values = scene.to_dict()
    values["objects"][0]["to_world"] = {"matrix": moved["ball"].tolist()}
    values["objects"][3]["to_world"] = {"matrix": moved[3].tolist()}
    assert_same(edited, values)
    np.testing.assert_array_equal(edited.transforms["ball"], moved["ball"])
    steps: list[build.Step] = [build.Scale(scale=0.5), build.Translate(translate=[0, 1, 0])]
    values["objects"][0]["to_world"] = [{"scale": 0.5}, {"translate": [0, 1, 0]}]
    assert_same(edited.replace(transforms={"ball": steps}), values)
    assert pathtracer.Scene.from_dict(values).objects == scene.objects
    lists = shifted(0.5).tolist()
    np.testing.assert_array_equal(
        scene.replace(transforms={"ball": lists}).transforms["ball"], lists
    )


def test_lights_and_settings_are_replaced() -> None:
    scene = room()
    pixels(scene)
    assert scene.lights == ["sky", "lamp"]
    lamp = scene.light("lamp")
    lamp.intensity = 9
    edited = scene.replace(lights={"lamp": lamp}, settings=build.Settings(resolution=[20, 20]))
    values = scene.to_dict()
    values["lights"][1]["intensity"] = [9, 9, 9]
    values["settings"] = {"resolution": [20, 20]}
    assert_same(edited, values)
    values["lights"] = [{"type": "area", "radiance": 1}]
    assert_same(edited.replace(lights=[build.AreaLight(radiance=1)]), values)
    values["lights"] = []
    assert_same(edited.replace(lights=[]), values)


def test_instances_are_transformed(scenes: Path) -> None:
    scene = pathtracer.load(scenes / "motion.xml")
    pathtracer.render(scene, width=16, spp=1)
    number = len(scene.objects) - 1
    moved = shifted(0.2) @ list(scene.transforms.values())[number]
    values = scene.to_dict()
    values["objects"][number]["to_world"] = {"matrix": moved.tolist()}
    images = [
        pathtracer.render(each, width=16, spp=1)["color"]
        for each in (
            scene.replace(transforms={number: moved}),
            pathtracer.Scene.from_dict(values),
        )
    ]
    np.testing.assert_array_equal(images[0], images[1])


def test_rays_and_explanations_are_those_of_the_edited_scene() -> None:
    scene = room()
    ray = ([0, 0, 5], [0, 0, -1])
    assert float(scene.intersect(*ray).t) == 4
    edited = scene.replace(transforms={"ball": shifted(9)})
    assert float(edited.intersect(*ray).t) == np.inf
    assert float(scene.intersect(*ray).t) == 4
    pixels(edited)
    nearer = edited.replace(transforms={"ball": np.diag([2.0, 2, 2, 1])})
    assert float(nearer.intersect(*ray).t) == 3
    rows = [
        pathtracer.explain(each, x=12, y=8, spp=4)
        for each in (nearer, pathtracer.Scene.from_dict(nearer.to_dict()))
    ]
    assert rows[0] == rows[1]


def test_receipts_tell_edited_scenes_apart() -> None:
    scene = room()
    files = [
        pathtracer.render(each, spp=1).receipt["files"]
        for each in (
            scene,
            scene.replace(materials={"gold": RED}),
            scene.replace(materials={"gold": build.BlackMaterial()}),
            scene.replace(materials={"gold": RED}),
        )
    ]
    assert files[1] == files[3]
    assert len({str(each) for each in files}) == 3
    assert files[1][-1][0] == "edits in memory"


Wrong = Callable[[pathtracer.Scene], object]


@pytest.mark.parametrize(
    ("edit", "error", "message"),
    [
        (lambda s: s.replace(materals={}), TypeError, 'did you mean "materials"'),
        (lambda s: s.replace(materials={"gould": RED}), ValueError, 'did you mean "gold"'),
        (lambda s: s.replace(materials=[RED]), TypeError, "materials: found a value of type"),
        (
            lambda s: s.replace(materials={"gold": {"type": "diffuse", "reflectance": "x"}}),
            pathtracer.SceneError,
            "materials.gold.reflectance",
        ),
        (lambda s: s.replace(camera={"type": "fish"}), pathtracer.SceneError, "camera.type"),
        (lambda s: s.replace(camera=3), pathtracer.SceneError, "camera: "),
        (lambda s: s.replace(transforms=3), TypeError, "transforms: found a value of type int"),
        (lambda s: s.replace(transforms={"bal": np.eye(4)}), ValueError, 'mean "ball"'),
        (lambda s: s.replace(transforms={"": np.eye(4)}), ValueError, "expected a number"),
        (lambda s: s.replace(transforms={4: np.eye(4)}), ValueError, "a number below 4"),
        (lambda s: s.replace(transforms={-1: np.eye(4)}), ValueError, "a number below 4"),
        (lambda s: s.replace(transforms={2.5: np.eye(4)}), TypeError, "expected str or int"),
        (
            lambda s: s.replace(transforms={"ball": np.eye(3)}),
            ValueError,
            r'transforms\["ball"\]: found shape \(3, 3\)',
        ),
        (
            lambda s: s.replace(transforms={"ball": np.full((4, 4), np.nan)}),
            ValueError,
            r'transforms\["ball"\]\[0\]\[0\]: found NaN',
        ),
        (
            lambda s: s.replace(transforms={"ball": np.diag([1.0, 1, 0, 1])}),
            pathtracer.SceneError,
            r'transforms\["ball"\].*invertible',
        ),
        (
            lambda s: s.replace(transforms={"ball": object()}),
            TypeError,
            r'transforms\["ball"\]: found a value of type object',
        ),
        (
            lambda s: s.replace(transforms={"ball": 1j * np.eye(4)}),
            TypeError,
            "found a value of type array of complex128, expected a matrix of real numbers",
        ),
        (lambda s: s.replace(lights=3), TypeError, "lights: found a value of type int"),
        (lambda s: s.replace(lights={"lam": {}}), ValueError, 'mean "lamp"'),
        (
            lambda s: s.replace(lights={"lamp": build.PointLight(intensity="x")}),
            pathtracer.SceneError,
            r'lights\["lamp"\].intensity',
        ),
        (lambda s: s.material("gould"), ValueError, 'did you mean "gold"'),
        (lambda s: s.light(7), ValueError, "a number below 2"),
    ],
)
def test_wrong_edits_are_refused(edit: Wrong, error: type[Exception], message: str) -> None:
    scene = room()
    with pytest.raises(error, match=message):
        edit(scene)
    assert scene.objects == ["ball", "floor", "", ""]


def resident() -> int:
    """Bytes of memory that the process occupies."""
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[1]
    return int(pages) * 4096


def test_memory_does_not_grow_with_edits() -> None:
    if not Path("/proc/self/statm").exists():
        pytest.skip("the size of the process is unknown")
    positions = np.random.default_rng(1).random((12_000, 3)) * 0.01
    triangles = np.arange(12_000).reshape(-1, 3)
    mesh = build.MeshObject(name="cloud", mesh=build.Mesh(positions=positions, triangles=triangles))
    scene = pathtracer.Scene(objects=[mesh], lights=[build.ConstantLight(radiance=1)])

    def edit(count: int) -> None:
        nonlocal scene
        for i in range(count):
            scene = scene.replace(
                transforms={"cloud": shifted(0.001 * i)}, lights=[build.ConstantLight(radiance=i)]
            )
            pathtracer.render(scene, width=4, height=3, spp=1)

    edit(40)
    gc.collect()
    before = resident()
    edit(160)
    gc.collect()
    assert resident() - before < 24 << 20


def test_threads_edit_and_render_one_scene() -> None:
    scene = room()
    wanted = [pixels(room().replace(transforms={"ball": shifted(i)}))["color"] for i in range(6)]

    def edited(i: int) -> Any:
        return pixels(scene.replace(transforms={"ball": shifted(i % 6)}))["color"]

    with concurrent.futures.ThreadPoolExecutor(4) as threads:
        for i, color in enumerate(threads.map(edited, range(24))):
            np.testing.assert_array_equal(color, wanted[i % 6])
