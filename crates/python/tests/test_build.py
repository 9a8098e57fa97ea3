"""Scenes of parts."""

import dataclasses
import inspect
import json
from typing import Any

import numpy as np
import pytest

import pathtracer
from pathtracer import build

CAMERA = build.PerspectiveCamera(y_fov=40, to_world=build.Translate(translate=[0, 0, 5]))
SKY = build.ConstantLight(radiance=0.5)


def pixels(scene: pathtracer.Scene) -> Any:
    return pathtracer.render(scene, width=16, height=12, spp=2)["color"]


def test_parts_are_those_of_a_scene_file() -> None:
    red = build.DiffuseMaterial(name="red", reflectance=[0.7, 0.1, 0.1])
    scene = pathtracer.Scene(
        camera=CAMERA,
        lights=[SKY],
        objects=[
            build.Sphere(material=red),
            build.Cube(material=red, to_world=build.Translate(translate=[1, 0, 0])),
        ],
    )
    assert repr(scene) == '<Scene "scene": 2 objects, 1 lights, 1 cameras>'
    values = {
        "pathtracer": 1,
        "cameras": [
            {"type": "perspective", "y_fov": 40, "to_world": {"translate": [0, 0, 5]}}
        ],
        "lights": [{"type": "constant", "radiance": 0.5}],
        "materials": {"red": {"type": "diffuse", "reflectance": [0.7, 0.1, 0.1]}},
        "objects": [
            {"type": "sphere", "material": "red"},
            {"type": "cube", "material": "red", "to_world": {"translate": [1, 0, 0]}},
        ],
    }
    wanted = pathtracer.Scene.from_dict(values)
    np.testing.assert_array_equal(pixels(scene), pixels(wanted))
    assert list(scene.to_dict()["materials"]) == ["red"]


def test_parts_are_shared_and_named() -> None:
    texture = build.CheckerboardTexture(colors=[0.1, 0.9])
    first, second = [build.DiffuseMaterial(reflectance=texture) for _ in range(2)]
    mesh = build.Mesh(positions=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles=[[0, 1, 2]])
    fog = build.HomogeneousMedium(extinction=0.1)
    materials: list[build.Material | str] = [first, second, "named", first]
    objects = [
        build.MeshObject(mesh=mesh, material=material, media=build.Sides(interior=fog))
        for material in materials
    ]
    named = build.MixMaterial(first=build.MirrorMaterial(), second="black", amount=texture)
    scene = pathtracer.Scene(
        camera=CAMERA, objects=objects, materials={"named": named}, lights=[SKY]
    )
    values = scene.to_dict()
    assert list(values["materials"]) == ["named", "diffuse", "diffuse_2"]
    assert list(values["textures"]) == ["texture"]
    assert list(values["meshes"]) == ["mesh"]
    assert list(values["media"]) == ["homogeneous"]
    assert [each["material"] for each in values["objects"]] == [
        "diffuse", "diffuse_2", "named", "diffuse"
    ]


def test_parts_may_be_dictionaries_and_matrices() -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = [0, 0, 5]
    cameras: list[build.Camera] = [
        build.PerspectiveCamera(y_fov=40, to_world=matrix),
        build.PerspectiveCamera(y_fov=40, to_world=matrix[:3]),
        {"type": "perspective", "y_fov": 40, "to_world": [{"translate": [0, 0, 5]}]},
        build.PerspectiveCamera(
            y_fov=40, to_world=[build.LookAt(look_at=[0, 0, 0], from_=[0, 0, 5])]
        ),
    ]
    scenes = [
        pathtracer.Scene(camera=camera, lights=["daylight", SKY], objects=[{"type": "sphere"}])
        for camera in cameras
    ]
    for scene in scenes[1:]:
        np.testing.assert_array_equal(pixels(scene), pixels(scenes[0]))


def test_a_missing_camera_sees_everything() -> None:
    scene = pathtracer.Scene(objects=[build.Sphere()], lights=[SKY])
    assert pixels(scene).any()


def of_material(**values: Any) -> dict[str, Any]:
    material = build.RoughDiffuseMaterial(**values)
    return {"objects": [build.Cube(), build.Sphere(material=material)]}


CYCLE = build.MixMaterial(first="black", second="black")
CYCLE.first = CYCLE


@pytest.mark.parametrize(
    ("parts", "error", "message"),
    [
        (
            of_material(roughness="x"),
            ValueError,
            'objects[1].material.roughness: unknown texture "x"; known: none',
        ),
        (
            of_material(roughness=2),
            ValueError,
            "objects[1].material.roughness: expected a number from 0 to 1, found 2",
        ),
        (
            of_material(roughness=np.nan),
            ValueError,
            "objects[1].material.roughness: found NaN, expected a finite number",
        ),
        (
            {"materials": {"my red": build.DiffuseMaterial(two_sided=3)}},  # type: ignore[arg-type]
            ValueError,
            'materials["my red"].two_sided: expected true or false, found 3',
        ),
        (
            of_material(reflectance=build.BitmapTexture(image=build.Image(pixels=[1.0]))),
            ValueError,
            "objects[1].material.reflectance.image.pixels[0]: expected a row of pixels, found 1.0",
        ),
        (
            {"camera": build.PerspectiveCamera(y_fov=400)},
            ValueError,
            "camera: found a field of view out of range",
        ),
        (
            {"objects": [build.Sphere(material=CYCLE)]},
            ValueError,
            "objects[0].material.first: found a part that contains itself",
        ),
        ({"objects": build.Sphere()}, ValueError, "objects: expected a list"),
        ({"materials": [CYCLE]}, TypeError, "materials: found a value of type list"),
        ({"materials": {3: CYCLE}}, TypeError, "materials: found a key of type int"),
        ({"camera": CAMERA, "cameras": [CAMERA]}, TypeError, "found camera and cameras"),
        ({"objcts": []}, TypeError, 'unknown keyword "objcts"; did you mean "objects"?'),
        ({"objects": [3]}, ValueError, "objects[0]: expected an object"),
    ],
)
def test_wrong_parts_are_named(
    parts: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as found:
        pathtracer.Scene(**parts)
    assert message in str(found.value)


def test_errors_have_the_places_of_arguments() -> None:
    wrong = build.DiffuseMaterial(reflectance=-1)
    with pytest.raises(pathtracer.SceneError) as found:
        pathtracer.Scene(objects=[build.Sphere(material=wrong), {"type": "spere"}])
    assert [error.element for error in found.value.errors] == [
        "objects[0].material.reflectance",
        "objects[1].type",
    ]
    assert found.value.errors[0].file is None


def test_wrong_fields_are_refused_at_once() -> None:
    with pytest.raises(TypeError, match="reflectence"):
        build.DiffuseMaterial(reflectence=1)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="radiance"):
        build.ConstantLight()  # type: ignore[call-arg]


def test_parts_have_readable_forms() -> None:
    part = build.Sphere(radius=2, material=build.DiffuseMaterial(reflectance=0.5))
    assert repr(part) == "Sphere(material=DiffuseMaterial(reflectance=0.5), radius=2)"
    assert json.dumps(part.type) == '"sphere"'


def test_all_parts_are_documented() -> None:
    classes = [each for each in vars(build).values() if inspect.isclass(each)]
    assert len(classes) > 90
    for each in classes:
        assert dataclasses.is_dataclass(each)
        docs = each.__doc__ or ""
        for field in dataclasses.fields(each):
            assert f"    {field.name} : " in docs, (each, field.name)
