"""Random arguments: results, or errors that name them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import pathtracer
from pathtracer import build

DTYPES = st.one_of(
    arrays.floating_dtypes(endianness="?"),
    arrays.integer_dtypes(endianness="?"),
    arrays.unsigned_integer_dtypes(endianness="?"),
    st.sampled_from(["bool", "complex64", "object", "U3", "datetime64[s]", "V8"]),
)
ROWS = st.tuples(st.integers(0, 40), st.sampled_from([3, 3, 3, 2, 4]))
SHAPES = st.one_of(ROWS, arrays.array_shapes(min_dims=0, max_dims=5, min_side=0, max_side=6))


@st.composite
def any_array(draw: Callable[..., Any]) -> Any:
    """An array of any type, shape and layout."""
    dtype = np.dtype(draw(DTYPES))
    shape = draw(SHAPES)
    small = st.integers(0, 9)
    if dtype.kind in "fiu" and draw(st.booleans()):
        made = draw(arrays.arrays(np.uint8, shape, elements=small)).astype(dtype)
    elif dtype.kind == "V" or dtype.kind == "O":
        made = np.zeros(shape, dtype)
    else:
        made = draw(arrays.arrays(dtype, shape))
    layouts = ["as made", "reversed", "Fortran", "strided", "unaligned", "fixed"]
    layout = draw(st.sampled_from(layouts))
    if layout == "reversed" and made.ndim:
        return made[::-1]
    if layout == "Fortran":
        return np.asfortranarray(made)
    if layout == "strided" and made.ndim:
        return np.repeat(made, 2, axis=0)[::2]
    if layout == "unaligned" and made.size and dtype.kind != "O":
        flat = np.frombuffer(b"\0" + made.tobytes(), np.uint8)[1:]
        return flat.view(dtype).reshape(made.shape)
    if layout == "fixed":
        made.flags.writeable = False
    return made


@st.composite
def any_value(draw: Callable[..., Any]) -> Any:
    """An array, or any other value."""
    others = st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=3),
        max_leaves=8,
    )
    return draw(st.one_of(any_array(), any_array(), others))


def result(work: Callable[[], Any]) -> Any:
    """The result, or None after an error about an argument."""
    try:
        return work()
    except (TypeError, ValueError) as error:
        assert str(error)
        return None


TRIANGLE = pathtracer.Bvh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
SCENE = pathtracer.default_scene()
MANY = settings(max_examples=100, deadline=None)


@MANY
@given(any_value(), any_value(), any_value(), any_value())
def test_queries(origins: Any, directions: Any, tmin: Any, tmax: Any) -> None:
    targets: list[pathtracer.Bvh | pathtracer.Scene] = [TRIANGLE, SCENE]
    for target in targets:
        hits = result(lambda: target.intersect(origins, directions, tmax, tmin=tmin))
        occluded = result(lambda: target.occluded(origins, directions, tmax, tmin=tmin))
        if hits is not None and occluded is not None:
            np.testing.assert_array_equal(np.isfinite(hits.t), occluded)


@MANY
@given(any_value(), any_value())
def test_meshes_for_queries(vertices: Any, faces: Any) -> None:
    bvh = result(lambda: pathtracer.Bvh(vertices, faces))
    if bvh is not None:
        assert len(bvh) == len(faces)
        bvh.intersect([[0.1, 0.2, 5]], [[0, 0, -1]])


@MANY
@given(st.dictionaries(st.sampled_from(
    ["positions", "triangles", "normals", "uvs", "colors", "uv_indices", "parts", "name"]
), any_value()))
def test_meshes_of_scenes(fields: dict[str, Any]) -> None:
    mesh = build.Mesh(**fields)
    scene = result(lambda: pathtracer.Scene(objects=[build.MeshObject(mesh=mesh)]))
    if scene is not None:
        copy = pathtracer.Scene.from_dict(scene.to_dict())
        result(lambda: copy.intersect([[0.1, 0.2, 5]], [[0, 0, -1]]))


@MANY
@given(any_value())
def test_images_of_scenes(pixels: Any) -> None:
    light = build.EnvironmentLight(image=build.Image(pixels=pixels))
    scene = result(lambda: pathtracer.Scene(lights=[light]))
    if scene is not None:
        result(lambda: pathtracer.render(scene, width=2, height=2, spp=1))


@MANY
@given(st.dictionaries(st.sampled_from(list(pathtracer.settings())), any_value(), max_size=2))
def test_settings_of_renders(values: dict[str, Any]) -> None:
    # These take long, or files.
    for name in ["spp", "resolution", "max_spp", "light_samples", "environment", "camera_file"]:
        values.pop(name, None)
    values |= {"width": 2, "height": 2, "spp": 1, "time_limit": 1}
    result(lambda: pathtracer.render(SCENE, **values))


@MANY
@given(any_value())
def test_values_of_scenes(value: Any) -> None:
    for key in ["objects", "lights", "materials", "cameras", "settings", "name"]:
        result(lambda: pathtracer.Scene.from_dict({"pathtracer": 1, key: value}))
        result(lambda: pathtracer.Scene(**{key: value}))


@settings(max_examples=40, deadline=None)
@given(any_value(), st.sampled_from(["camera", "materials", "lights", "transforms", "settings"]))
def test_edits(value: Any, key: str) -> None:
    lamp = build.PointLight(name="lamp", intensity=1)
    scene = pathtracer.Scene(objects=[build.Sphere(name="ball")], lights=[lamp])
    for name in ["ball", "lamp", 0]:
        changes: dict[str, Any] = {key: {name: value}}
        result(lambda: scene.replace(**changes))
    changes = {key: value}
    result(lambda: scene.replace(**changes))


LOBE = pathtracer.Bsdf("diffuse")
PHASE = pathtracer.PhaseFunction("rayleigh")
(LIGHT,) = pathtracer.lights(pathtracer.Scene(lights=[build.ConstantLight(radiance=1)]))


@MANY
@given(any_value(), any_value(), any_value())
def test_lobes_and_lights(first: Any, second: Any, normal: Any) -> None:
    for function in [LOBE.eval, LOBE.pdf, LOBE.sample, PHASE.eval, PHASE.sample]:
        result(lambda: function(first, second))
    for light in [LIGHT.sample, LIGHT.pdf]:
        result(lambda: light(first, second, normal))


@MANY
@given(any_value())
def test_materials(value: Any) -> None:
    result(lambda: pathtracer.Bsdf(value))
    result(lambda: pathtracer.Bsdf(build.DiffuseMaterial(reflectance=value)))
    result(lambda: pathtracer.PhaseFunction(build.TablePhase(values=value)))
