"""Measures renders on a cluster of Ray on this machine; `cargo xtask bench ray` runs it.

Arguments: the folder of the scenes, seconds of each measurement, and the file of the figure.
"""

import os
import sys
import time
from pathlib import Path

import ray

import pathtracer
import pathtracer.ray
from pathtracer._native import PartialRender
from pathtracer.ray._packing import key_of, pack_scene, pack_settings, unpack, unpack_scene

SIZE = {"width": 320, "height": 240}
# A render of more than 1,000 tasks, for the memory of the head.
MANY_TASKS = {"width": 160, "height": 120, "spp": 1100, "task_seconds": 0.1}


def memory() -> float:
    """Memory of this process in MB."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1000


def speed(scene: pathtracer.Scene) -> float:
    """Samples per pixel of a thread in a second."""
    spp = 4
    while True:
        image = pathtracer.render(scene, spp=spp, threads=1, **SIZE)
        if image.seconds > 1:
            return spp / image.seconds
        spp *= 4


def scaling(scene: pathtracer.Scene, seconds: float, most: int) -> None:
    """Overhead of tasks of 2 s with 1, 2, ... one-thread workers."""
    pace = speed(scene)
    print(f"one thread: {pace:.1f} samples per pixel and second at {SIZE}")
    workers = 1
    while workers <= most:
        # Processes start and compile before the measurement.
        options = {"workers": workers, **SIZE}
        pathtracer.ray.render(scene, spp=16, task_seconds=0.1, **options)
        costs = pathtracer.ray.Statistics()
        spp = max(int(pace * seconds * workers), 16)
        pathtracer.ray.render(scene, spp=spp, statistics=costs, **options)
        in_tasks = costs.worker_seconds - costs.sample_seconds
        print(
            f"workers {workers}: {spp} spp in {costs.seconds:.1f} s, {costs.tasks} tasks of "
            f"{costs.worker_seconds / costs.tasks:.2f} s; "
            f"in tasks, {100 * in_tasks / costs.worker_seconds:.2f} % are no samples; "
            f"of the time of the workers, {100 * (1 - costs.worker_seconds / (workers * costs.seconds)):.1f} % "
            f"are between tasks, at the start or at the end; "
            f"{spp / costs.seconds / workers / pace:.2f} of the samples of a thread alone"
        )
        workers *= 2


def head(scene: pathtracer.Scene, figure: Path) -> None:
    """Memory of the head over many tasks, and sizes and times of films."""
    costs = pathtracer.ray.Statistics()
    points: list[tuple[int, float]] = []

    def note(_: pathtracer.Progress) -> None:
        points.append((costs.tasks, memory()))

    pathtracer.ray.render(scene, statistics=costs, progress=note, **MANY_TASKS)
    before = [mb for tasks, mb in points if tasks < costs.tasks // 10]
    after = [mb for tasks, mb in points if tasks >= costs.tasks // 10]
    print(
        f"head: {costs.tasks} tasks, {costs.films} films of "
        f"{costs.film_bytes / costs.films / 1000:.0f} kB; memory {max(before):.0f} MB in the first "
        f"tenth, {max(after):.0f} MB after; at most {costs.most_waiting} films waited"
    )
    print(
        f"adding: {costs.films / costs.add_seconds:.0f} films/s, "
        f"{costs.film_bytes / costs.add_seconds / 1e6:.0f} MB/s, "
        f"{1e3 * costs.add_seconds / costs.tasks:.2f} ms for each task"
    )
    figure.write_text(drawn(points))


def drawn(points: list[tuple[int, float]]) -> str:
    """Curve of the memory in MB over the number of tasks, as SVG."""
    width, height, left, bottom = 640, 240, 50, 40
    tasks = max(points)[0]
    most = max(mb for _, mb in points) * 1.2
    place = [
        f"{left + (width - left - 10) * t / tasks:.1f},{(height - bottom) * (1 - mb / most) + 5:.1f}"
        for t, mb in points[:: max(len(points) // 200, 1)]
    ]
    base = height - bottom + 5
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'font-family="sans-serif" font-size="12">\n'
        f'<path d="M{left} 5V{base}H{width - 10}" fill="none" stroke="#888"/>\n'
        f'<polyline points="{" ".join(place)}" fill="none" stroke="#06c" stroke-width="2"/>\n'
        f'<text x="{left - 5}" y="14" text-anchor="end">{most:.0f}</text>\n'
        f'<text x="{left - 5}" y="{base}" text-anchor="end">0</text>\n'
        f'<text x="{width - 10}" y="{base + 16}" text-anchor="end">{tasks}</text>\n'
        f'<text x="{width / 2}" y="{base + 30}" text-anchor="middle">tasks added; memory of the '
        f"head in MB</text>\n</svg>\n"
    )


def constants(scenes: Path) -> None:
    """Costs of a scene for the object store and for each worker, and of an empty task."""
    for file in ("cornell.dae", "mitsuba/environment.xml"):
        scene = pathtracer.load(scenes / file)
        start = time.perf_counter()
        packed = pack_scene(scene)
        middle = time.perf_counter()
        settings = pack_settings({"spp": 1, **SIZE}, PartialRender(scene, spp=1, **SIZE).identity)
        key_of(packed, settings)
        then = time.perf_counter()
        unpack(unpack_scene(packed), settings)
        print(
            f"scene {file}: {packed.nbytes / 1e6:.2f} MB, packed in {middle - start:.3f} s, read "
            f"and compiled by each worker in {time.perf_counter() - then:.3f} s"
        )
    size = 100_000_000
    start = time.perf_counter()
    ref = ray.put(bytes(size))
    middle = time.perf_counter()
    ray.get(ref)
    print(
        f"object store: {size / 1e6 / (middle - start):.0f} MB/s in, "
        f"{size / 1e6 / (time.perf_counter() - middle):.0f} MB/s out"
    )
    empty = ray.remote(num_cpus=0)(lambda: None)
    ray.get([empty.remote() for _ in range(100)])
    start = time.perf_counter()
    count = 1000
    ray.get([empty.remote() for _ in range(count)])
    print(f"empty tasks: {count / (time.perf_counter() - start):.0f}/s")


def main() -> None:
    scenes, seconds, figure = Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3])
    processors = len(os.sched_getaffinity(0))
    ray.init(address="local", num_cpus=processors, include_dashboard=False, log_to_driver=False)
    scene = pathtracer.load(scenes / "cornell.dae")
    constants(scenes)
    scaling(scene, seconds, processors)
    head(scene, figure)


if __name__ == "__main__":
    main()
