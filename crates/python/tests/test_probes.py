"""Materials, lights, phase functions and samplers over arrays."""

from typing import Any

import numpy as np
import pytest

import pathtracer
from pathtracer import build

ROUGH = build.Roughness(alpha=0.4)
MATERIALS: dict[str, build.Material] = {
    "diffuse": build.DiffuseMaterial(reflectance=1.0),
    "rough_diffuse": build.RoughDiffuseMaterial(reflectance=1.0),
    "conductor": build.ConductorMaterial(eta=0.2, k=3.9, roughness=ROUGH),
    "plastic": build.RoughCoatedDiffuseMaterial(diffuse=0.8, alpha=0.3),
    "glass": build.GlassMaterial(ior=1.5, roughness=ROUGH),
    "gltf": build.MetallicRoughnessMaterial(base_color=0.9, roughness=0.6),
    "sheet": build.DiffuseTransmissionMaterial(reflectance=0.5, transmittance=0.5),
}
PHASES = [
    "isotropic",
    "rayleigh",
    build.HenyeyGreensteinPhase(g=0.6),
    build.TablePhase(values=[0.1, 0.5, 0.2, 1.0]),
    build.BlendPhase(first="rayleigh", second=build.HenyeyGreensteinPhase(g=-0.4), amount=0.3),
]
WO = [0.6, 0.0, 0.8]


def sphere(rows: int) -> tuple[Any, float]:
    """Directions at the centres of cells of equal area, and that area; shape (rows, 2 rows, 3)."""
    z = (np.arange(rows) + 0.5) / rows * 2 - 1
    phi = (np.arange(2 * rows) + 0.5) / (2 * rows) * 2 * np.pi
    r = np.sqrt(1 - z * z)[:, None]
    x, y = r * np.cos(phi), r * np.sin(phi)
    return np.stack([x, y, np.broadcast_to(z[:, None], x.shape)], axis=-1), 2 * np.pi / rows**2


def cells(directions: Any, rows: int) -> Any:
    """Number of directions in each cell of a coarse grid; nan are left out."""
    directions = directions[np.isfinite(directions[:, 0])]
    row = np.clip((directions[:, 2] + 1) / 2 * rows, 0, rows - 1).astype(int)
    phi = np.arctan2(directions[:, 1], directions[:, 0]) % (2 * np.pi)
    column = np.clip(phi / (2 * np.pi) * 2 * rows, 0, 2 * rows - 1).astype(int)
    return np.bincount(row * 2 * rows + column, minlength=2 * rows * rows)


def check_chi2(samples: Any, pdf: Any, weight: float) -> None:
    """Pearson's test of samples against a density on a fine grid of the sphere."""
    rows = 8
    fine = pdf.shape[0] // rows
    share = pdf.reshape(rows, fine, 2 * rows, fine).sum(axis=(1, 3)).ravel() * weight
    expected = share * len(samples)
    found = cells(samples, rows)
    used = expected > 50
    chi2 = ((found - expected)[used] ** 2 / expected[used]).sum()
    degrees = used.sum()
    # Beyond this, the probability is below 1e-6 for any number of degrees of freedom from 10 on.
    assert chi2 < degrees + 7 * np.sqrt(2 * degrees) + 25, (chi2, degrees)


@pytest.mark.parametrize("name", MATERIALS)
def test_materials_sample_their_density(name: str) -> None:
    bsdf = pathtracer.Bsdf(MATERIALS[name])
    directions, area = sphere(512)
    pdf = bsdf.pdf(WO, directions)
    u = np.random.default_rng(3).random((200_000, 3))
    wi, weight, density = bsdf.sample(WO, u)
    kept = np.isfinite(wi[:, 0])
    # Directions below the surface are absorbed.
    assert pdf.sum() * area == pytest.approx(kept.mean(), abs=0.005)
    check_chi2(wi, pdf, area)
    np.testing.assert_allclose(bsdf.pdf(WO, wi[kept]), density[kept], rtol=2e-2, atol=1e-4)
    value = bsdf.eval(WO, wi[kept])
    np.testing.assert_allclose(
        value, weight[kept] * density[kept, None], rtol=2e-2, atol=1e-4
    )


@pytest.mark.parametrize("name", MATERIALS)
def test_materials_conserve_energy(name: str) -> None:
    bsdf = pathtracer.Bsdf(MATERIALS[name])
    directions, area = sphere(256)
    for wo in np.array([[0, 0, 1], WO, [0.98, 0, 0.2]]):
        light = bsdf.eval(wo, directions)
        if name == "glass":
            # Radiance grows where light enters the glass, by the square of the index.
            light[directions[..., 2] < 0] *= 1.5**2
        reflected = light.sum(axis=(0, 1)) * area
        assert (reflected <= 1.01).all(), reflected
        assert (reflected > 0.2).all(), reflected


@pytest.mark.parametrize("name", ["diffuse", "rough_diffuse", "conductor", "plastic"])
def test_reflection_is_reciprocal(name: str) -> None:
    bsdf = pathtracer.Bsdf(MATERIALS[name])
    random = np.random.default_rng(4)
    wo, wi = random.standard_normal((2, 1000, 3))
    wo[:, 2], wi[:, 2] = np.abs(wo[:, 2]) + 0.1, np.abs(wi[:, 2]) + 0.1
    cosines = [w[:, 2:] / np.linalg.norm(w, axis=-1, keepdims=True) for w in (wi, wo)]
    there, back = bsdf.eval(wo, wi) / cosines[0], bsdf.eval(wi, wo) / cosines[1]
    np.testing.assert_allclose(there, back, rtol=2e-3, atol=1e-5)


def test_a_diffuse_lobe_is_that_of_lambert() -> None:
    bsdf = pathtracer.Bsdf(build.DiffuseMaterial(reflectance=[0.2, 0.4, 0.8]))
    value = bsdf.eval(WO, [0, 0, 2])
    np.testing.assert_allclose(value, np.array([0.2, 0.4, 0.8]) / np.pi, rtol=1e-6)
    assert bsdf.pdf(WO, [[0, 0, 1], [0, 0, -1]]) == pytest.approx([1 / np.pi, 0])
    assert bsdf.eval(np.zeros((4, 1, 3)) + WO, np.zeros((5, 3)) + WO).shape == (4, 5, 3)


def test_mirrors_are_deltas() -> None:
    bsdf = pathtracer.Bsdf("mirror")
    wi, weight, pdf = bsdf.sample(WO, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(wi, [-0.6, 0, 0.8], atol=1e-6)
    np.testing.assert_allclose(weight, 1)
    assert pdf == np.inf
    assert not bsdf.eval(WO, wi).any()


def test_textures_and_mixtures_are_evaluated() -> None:
    checks = build.CheckerboardTexture(colors=[0.2, 0.8], to_pattern=build.Scale(scale=2))
    material = build.DiffuseMaterial(reflectance=checks)
    values = {
        pathtracer.Bsdf(material, uv=uv).eval(WO, [0, 0, 1])[0].item() * np.pi
        for uv in [(0.1, 0.1), (0.4, 0.1), (0.6, 0.1), (0.9, 0.9)]
    }
    assert sorted(values) == pytest.approx([0.2, 0.8])
    mixture = build.MixMaterial(first="black", second="diffuse", amount=0.3)
    shares = [pathtracer.Bsdf(mixture, choice=c).eval(WO, WO).any() for c in (0.2, 0.4)]
    assert shares == [True, False]


@pytest.mark.parametrize("phase", PHASES)
def test_phase_functions_sample_their_density(phase: Any) -> None:
    function = pathtracer.PhaseFunction(phase)
    directions, area = sphere(256)
    values = function.eval(WO, directions)
    assert values.sum() * area == pytest.approx(1, abs=2e-3)
    wi, pdf = function.sample(WO, np.random.default_rng(5).random((100_000, 2)))
    check_chi2(wi, values, area)
    np.testing.assert_allclose(function.pdf(WO, wi), pdf, rtol=1e-4)
    np.testing.assert_allclose(function.eval(wi[:100], WO), pdf[:100], rtol=1e-3)


SPHERE = build.Sphere(
    material=build.BlackMaterial(emission=2.0), to_world=build.Translate(translate=[0, 0, 3])
)


def test_lights_sample_their_density() -> None:
    (light,) = pathtracer.lights(pathtracer.Scene(objects=[SPHERE]))
    assert light.kind == "Sphere"
    u = np.random.default_rng(6).random((20_000, 2))
    wi, distance, radiance, pdf = light.sample([0, 0, 0], u)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=-1), 1, rtol=1e-5)
    np.testing.assert_allclose(radiance, 2)
    assert ((distance >= 1.999) & (distance <= 3)).all()
    np.testing.assert_allclose(light.pdf([0, 0, 0], wi[:500]), pdf[:500], rtol=1e-2)
    # Irradiance of a sphere of radius 1 at distance 3.
    irradiance = (radiance[:, 0] * wi[:, 2] / pdf).mean()
    assert irradiance == pytest.approx(2 * np.pi / 9, rel=0.01)
    # The edge of the sphere is within a row of the grid, of which it covers twenty.
    directions, area = sphere(700)
    assert light.pdf([0, 0, 0], directions).sum() * area == pytest.approx(1, abs=0.05)
    below = light.sample([0, 0, 0], u, normal=[0, 0, -1])[2]
    assert below.shape == (20_000, 3)


def test_lights_without_extent_are_deltas() -> None:
    point = build.PointLight(intensity=[1, 2, 4], to_world=build.Translate(translate=[0, 0, 2]))
    (light,) = pathtracer.lights(pathtracer.Scene(lights=[point]))
    wi, distance, radiance, pdf = light.sample([[0, 0, 0], [0, 0, 1]], [0.5, 0.5])
    np.testing.assert_allclose(wi, np.array([[0, 0, 1.0]] * 2))
    np.testing.assert_allclose(distance, [2, 1])
    np.testing.assert_allclose(radiance, np.array([[0.25, 0.5, 1], [1, 2, 4]]))
    assert (pdf == np.inf).all()
    assert light.pdf([0, 0, 0], [0, 0, 1]) == 0


@pytest.mark.parametrize("kind", ["sobol", "zsobol", "stratified", "independent"])
def test_samplers_have_uniform_points(kind: Any) -> None:
    points = pathtracer.Sampler(kind, seed=1).points(1024, 5)
    assert points.shape == (1024, 5)
    assert ((points >= 0) & (points < 1)).all()
    np.testing.assert_allclose(points.mean(axis=0), 0.5, atol=0.06)
    other = pathtracer.Sampler(kind, seed=1).points(1024, 5, pixel=(3, 4))
    assert (other != points).any()
    if kind == "sobol":
        strata = np.floor(points[:, :2] * 32).astype(int)
        assert len(np.unique(strata, axis=0)) == 1024
    again = pathtracer.Sampler(kind, seed=1).points(1024, 5)
    np.testing.assert_array_equal(points, again)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: pathtracer.Bsdf({"type": "mirorr"}), ValueError, 'material.type: unknown type "'),
        (
            lambda: pathtracer.Bsdf(build.DiffuseMaterial(reflectance=-1)),
            ValueError,
            "material.reflectance: ",
        ),
        (lambda: pathtracer.Bsdf("diffuse", uv=(2, 0)), ValueError, "uv: found"),
        (lambda: pathtracer.Bsdf("diffuse", choice=-1), ValueError, "choice: found -1"),
        (lambda: pathtracer.Bsdf("diffuse").eval([0, 0], WO), ValueError, "wo: found shape"),
        (lambda: pathtracer.Bsdf("diffuse").eval(WO, [0, 0, 0]), ValueError, "wi: vector 0 is"),
        (lambda: pathtracer.Bsdf("diffuse").pdf(WO, "up"), TypeError, "wi: found an array"),
        (lambda: pathtracer.Bsdf("diffuse").sample(WO, [0, 0, 1]), ValueError, "u: found 1"),
        (
            lambda: pathtracer.Bsdf("diffuse").eval(np.ones((2, 3)), np.ones((4, 3))),
            ValueError,
            "wo, wi: shapes .* cannot be broadcast",
        ),
        (lambda: pathtracer.PhaseFunction({"type": "mie"}), ValueError, 'phase.type: unknown type "mie"'),
        (
            lambda: pathtracer.PhaseFunction("rayleigh").sample(WO, [0.5]),
            ValueError,
            r"u: found shape \(1,\), expected \(..., 2\)",
        ),
        (
            lambda: pathtracer.Sampler("halton"),  # type: ignore[arg-type]
            ValueError,
            'kind: found "halton"',
        ),
        (lambda: pathtracer.Sampler().points(1 << 31, 1 << 31), ValueError, "memory"),
        (lambda: pathtracer.lights(3), TypeError, "Scene"),  # type: ignore[arg-type]
    ],
)
def test_wrong_arguments_are_named(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_materials_have_names() -> None:
    materials: dict[str, build.Material] = {
        "material": build.DiffuseMaterial(reflectance=0.25),
        "other": "black",
    }
    for material, expected in [("material", 0.25), ("other", 0.0), ("diffuse", 0.5)]:
        bsdf = pathtracer.Bsdf(material, materials=materials)  # type: ignore[arg-type]
        np.testing.assert_allclose(bsdf.eval(WO, WO) * np.pi, expected * 0.8, rtol=1e-5)
