"""Measurements of the Python module; see python.rs."""

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pathtracer
import trimesh
from pathtracer.trimesh import RayMeshIntersector
from trimesh.ray.ray_pyembree import RayMeshIntersector as Embree


def best(work: Callable[[], object], times: int = 5) -> float:
    """Shortest duration in seconds."""
    work()
    durations = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        durations.append(time.perf_counter() - start)
    return min(durations)


def best_of_each(
    work: dict[str, Callable[[], object]], rounds: int = 12
) -> dict[str, float]:
    """Shortest duration of each function in seconds, measured in turns."""
    seconds: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(rounds + 1):
        for name, function in work.items():
            start = time.perf_counter()
            function()
            seconds[name].append(time.perf_counter() - start)
    return {name: min(durations[1:]) for name, durations in seconds.items()}


def meshes() -> dict[str, trimesh.Trimesh]:
    """A bumpy ball, and triangles without order."""
    rng = np.random.default_rng(1)
    ball = trimesh.creation.icosphere(subdivisions=7)
    waves = 1 + 0.05 * np.sin(20 * ball.vertices).prod(axis=1)
    ball.vertices *= waves[:, None]
    corners = rng.random((100_000, 1, 3)) + 0.02 * rng.standard_normal((100_000, 3, 3))
    faces = np.arange(300_000).reshape(-1, 3)
    soup = trimesh.Trimesh(corners.reshape(-1, 3) - 0.5, faces, process=False)
    return {"bumpy ball": ball, "triangles": soup}


def rays(mesh: trimesh.Trimesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a sphere around a mesh to random points of its box."""
    rng = np.random.default_rng(2)
    low, high = mesh.bounds
    outside = rng.standard_normal((count, 3))
    outside /= np.linalg.norm(outside, axis=1)[:, None]
    origins = (low + high) / 2 + np.linalg.norm(high - low) * outside
    directions = low + (high - low) * rng.random((count, 3)) - origins
    return origins, directions / np.linalg.norm(directions, axis=1)[:, None]


def open3d_scene(mesh: trimesh.Trimesh) -> Callable[[np.ndarray], object] | None:
    try:
        import open3d
    except (ImportError, OSError) as error:
        print(f"Open3D cannot be imported: {error}")
        return None
    scene = open3d.t.geometry.RaycastingScene()
    tensors = [mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)]
    scene.add_triangles(*map(open3d.core.Tensor, tensors))
    return lambda rays: scene.cast_rays(open3d.core.Tensor(rays))


def queries(count: int) -> None:
    for name, mesh in meshes().items():
        print(f"\n{count} rays to {name}, {len(mesh.faces)} triangles: ms, and millions in a second")
        origins, directions = rays(mesh, count)
        single = origins.astype(np.float32), directions.astype(np.float32)
        both = np.concatenate(single, axis=1)
        positions = mesh.vertices.astype(np.float32)
        part = {"type": "mesh", "mesh": {"positions": positions, "triangles": mesh.faces}}
        scene = pathtracer.Scene.from_dict({"pathtracer": 1, "objects": [part]})
        bvh = pathtracer.Bvh(mesh.vertices, mesh.faces)
        theirs, ours = Embree(mesh), RayMeshIntersector(mesh)
        work = {
            "trimesh, embreex": lambda: theirs.intersects_first(origins, directions),
            "trimesh, embreex, points": lambda: theirs.intersects_location(
                origins, directions, multiple_hits=False
            ),
            "pathtracer.trimesh": lambda: ours.intersects_first(origins, directions),
            "Scene.intersect": lambda: scene.intersect(origins, directions),
            "Bvh.intersect": lambda: bvh.intersect(origins, directions),
            "Scene.intersect, float32": lambda: scene.intersect(*single),
            "Bvh.intersect, float32": lambda: bvh.intersect(*single),
        }
        cast = open3d_scene(mesh)
        if cast is not None:
            work["Open3D, float32"] = lambda: cast(both)
        seconds = best_of_each(work)
        for each, duration in seconds.items():
            print(f"{each:26} {1e3 * duration:8.1f} {count / duration / 1e6:8.2f}")
        for each in ["trimesh, embreex", "trimesh, embreex, points"]:
            ratio = seconds[each] / seconds["Scene.intersect"]
            print(f"{each} / Scene.intersect {ratio:.2f}, asked 3")
        if cast is not None:
            ratio = seconds["Open3D, float32"] / seconds["Scene.intersect, float32"]
            print(f"Open3D / Scene.intersect, float32 {ratio:.2f}, asked 1.2")
        hit = scene.intersect(origins, directions).primitive >= 0
        same = np.mean(hit == (theirs.intersects_first(origins, directions) >= 0))
        print(f"{100 * hit.mean():.1f} % of the rays hit; both agree for {100 * same:.3f} %")


def imports() -> None:
    print("\nseconds until a module is imported, in a new process, without the start of Python")
    empty = best(lambda: subprocess.run([sys.executable, "-c", ""], check=True))
    for name in ["numpy", "pathtracer", "mitsuba", "bpy"]:
        command = [sys.executable, "-c", f"import {name}"]
        if subprocess.run(command, capture_output=True).returncode:
            print(f"{name:12} cannot be imported")
        else:
            duration = best(lambda: subprocess.run(command, check=True, capture_output=True))
            print(f"{name:12} {duration - empty:.3f}")


RENDER = """
import sys, pathtracer
scene = pathtracer.load(sys.argv[1])
pathtracer.render(scene, spp=128, width=320, height=240).save(sys.argv[2])
"""


def renders(scenes: Path) -> None:
    scene = str(scenes / "cornell.dae")
    with tempfile.TemporaryDirectory() as folder:
        image = str(Path(folder, "image.exr"))
        options = ["-q", "--restart", "-s", "128", "-r", "320", "240", "-f", image, scene]
        commands = {
            "program": [sys.executable, "-m", "pathtracer", *options],
            "render": [sys.executable, "-c", RENDER, scene, image],
        }
        seconds: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(6):
            for name, command in commands.items():
                start = time.perf_counter()
                subprocess.run(command, check=True)
                seconds[name].append(time.perf_counter() - start)
        program, module = (statistics.median(seconds[name]) for name in commands)
    print("\nseconds of a whole process, cornell.dae, 320 x 240, 128 samples: median of 6")
    print(f"program {program:.3f}, pathtracer.render {module:.3f}: {module / program:.3f}, asked 1.02")


queries(int(sys.argv[2]))
imports()
renders(Path(sys.argv[1]))
