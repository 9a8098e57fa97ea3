"""Renders on a cluster of Ray, which runs on this machine: the bits are those of one machine."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer

ray = pytest.importorskip("ray")
from pathtracer import ray as cluster  # noqa: E402
from pathtracer._native import PartialRender, merge_parts, with_hierarchies  # noqa: E402
from pathtracer.ray import _driver  # noqa: E402
from pathtracer.ray._packing import pack_scene, unpack_scene  # noqa: E402

Program = Callable[[Sequence[object]], str]


@pytest.fixture(scope="module", autouse=True)
def address() -> Iterator[str]:
    """A cluster of four processors, whatever this machine has."""
    options = {"num_cpus": 4, "include_dashboard": False, "log_to_driver": False}
    ray.init(address="local", object_store_memory=200_000_000, **options)
    yield ray.get_runtime_context().gcs_address
    ray.shutdown()


def workers() -> list[int]:
    """Processes of the cluster that take samples."""
    found, parents = [], {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name = (folder / "cmdline").read_bytes()
            parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError):
            continue
        if name.startswith(b"ray::take"):
            found.append(int(folder.name))

    def is_ours(process: int) -> bool:
        while process in parents:
            if process == os.getpid():
                return True
            process = parents[process]
        return False

    return [process for process in found if is_ours(process)]


@pytest.fixture
def killer() -> Iterator[list[int]]:
    """Kills a worker every three seconds, later less often; the list has those that are killed."""
    killed: list[int] = []
    stopped = threading.Event()

    def kill() -> None:
        # On a busy machine, a new worker may take longer than this to begin.
        pause = 3.0
        while not stopped.wait(pause):
            for process in workers()[:1]:
                os.kill(process, signal.SIGKILL)
                killed.append(process)
                pause *= 1.1

    thread = threading.Thread(target=kill)
    thread.start()
    yield killed
    stopped.set()
    thread.join()


def assert_same(image: pathtracer.Image, expected: pathtracer.Image) -> None:
    """The images have the same bits, and so have their films."""
    assert image.keys() == expected.keys()
    for name in expected.keys():
        assert np.array_equal(image[name], expected[name], equal_nan=True), name
    assert image.complete == expected.complete
    assert image.samples == expected.samples
    for key in ("film", "files", "settings"):
        assert image.receipt.get(key) == expected.receipt.get(key)


SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    "aovs": (
        "gltf/materials.gltf",
        {"spp": 24, "aovs": ["albedo", "depth", "cryptomatte_object"], "alpha": True},
    ),
    "target": ("cornell.dae", {"target_error": "15%", "max_spp": 4096}),
    "motion": ("motion.xml", {"spp": 200, "seed": 7, "clamp": 4}),
}


@pytest.mark.parametrize("name", SCENES)
def test_bits_are_those_of_one_machine_while_workers_are_killed(
    name: str, scenes: Path, tmp_path: Path, program: Program, killer: list[int]
) -> None:
    file, settings = SCENES[name]
    settings = {"width": 96, "height": 72, **settings}
    scene = pathtracer.load(scenes / file)
    expected = pathtracer.render(scene, **settings)
    options = {key: value for key, value in settings.items() if key not in ("width", "height")}
    words: list[object] = ["-q", "-r", 96, 72, "--metadata", "none"]
    for key, value in options.items():
        word = "--" + {"aovs": "aov"}.get(key, key).replace("_", "-")
        words += [word] if value is True else [word, ",".join(value) if key == "aovs" else value]
    program([*words, "-f", tmp_path / "program.exr", scenes / file])
    for count in (1, 2, 4):
        statistics = cluster.Statistics()
        image = cluster.render(
            scene, workers=count, task_seconds=0.3, statistics=statistics, **settings
        )
        assert_same(image, expected)
        assert statistics.tasks > 1
    image.save(tmp_path / "ray.exr", metadata="none")
    assert (tmp_path / "ray.exr").read_bytes() == (tmp_path / "program.exr").read_bytes()
    assert killer and not set(killer) & set(workers())


DRIVER = """
import sys, ray, pathtracer.ray
ray.init(address=sys.argv[1], log_to_driver=False)
scene = pathtracer.load(sys.argv[2])
pathtracer.ray.render(scene, checkpoint=sys.argv[3], checkpoint_every=0.2, task_seconds=0.2,
                      spp=300, width=96, height=72)
"""


def test_a_killed_driver_resumes_to_the_same_bits(
    address: str, scenes: Path, tmp_path: Path
) -> None:
    scene = pathtracer.load(scenes / "cornell.dae")
    expected = pathtracer.render(scene, spp=300, width=96, height=72)
    film = tmp_path / "image.exr.film"
    command = [sys.executable, "-c", DRIVER, address, scenes / "cornell.dae", film]
    with subprocess.Popen(list(map(str, command))) as driver:
        while not film.exists():
            assert driver.poll() is None
            time.sleep(0.02)
        time.sleep(0.3)
        driver.send_signal(signal.SIGKILL)
    copy = tmp_path / "copy.exr.film"
    copy.write_bytes(film.read_bytes())
    states: list[pathtracer.Progress] = []
    image = cluster.render(
        scene,
        checkpoint=film,
        spp=300,
        width=96,
        height=72,
        task_seconds=0.2,
        progress=states.append,
    )
    assert states[0].samples > 0 and states[-1].fraction == 1.0
    assert [s.samples for s in states] == sorted(s.samples for s in states)
    assert_same(image, expected)
    # The program resumes the film of the cluster, too, and the cluster a film of the program.
    resumed = pathtracer.resume(copy, allow_folders=[scenes])
    assert np.array_equal(resumed["color"], expected["color"])
    again = cluster.render(scene, checkpoint=film, spp=300, width=96, height=72)
    assert_same(again, expected)
    with pytest.raises(ValueError, match="film of another image"):
        cluster.render(scene, checkpoint=film, spp=300, width=96, height=72, seed=5)


def test_a_film_of_the_program_is_continued(
    scenes: Path, tmp_path: Path, program: Program
) -> None:
    """Tiles that the program has left half done have pixels with different numbers of samples."""
    scene = pathtracer.load(scenes / "cornell.dae")
    settings: dict[str, Any] = {"spp": 300, "width": 96, "height": 72}
    film = tmp_path / "image.exr.film"
    words = ["-q", "-s", 300, "-r", 96, 72, "--time-limit", "0.4s", "-t", 1]
    program([*words, "-f", tmp_path / "image.exr", scenes / "cornell.dae"])
    image = cluster.render(scene, checkpoint=film, task_seconds=0.2, **settings)
    assert_same(image, pathtracer.render(scene, **settings))


def test_a_stopped_worker_is_passed_over(
    scene: pathtracer.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_driver, "_STRAGGLE_SECONDS", 1.0)
    settings: dict[str, Any] = {"spp": 300, "width": 96, "height": 72}
    stopped: list[int] = []

    def stop(state: pathtracer.Progress) -> None:
        if state.samples and not stopped:
            stopped.extend(workers()[:1])
            for process in stopped:
                os.kill(process, signal.SIGSTOP)

    statistics = cluster.Statistics()
    image = cluster.render(
        scene, task_seconds=0.2, progress=stop, statistics=statistics, **settings
    )
    for process in stopped:
        os.kill(process, signal.SIGKILL)
    assert stopped and statistics.reissued > 0
    assert_same(image, pathtracer.render(scene, **settings))


@pytest.mark.parametrize(
    "settings",
    [
        {"path_reuse": 2, "clamp": 1, "spp": 50},
        {"spp": 64, "adaptive": (16, 0.3)},
        {"spp": 33, "aovs": ["half_a", "half_b"], "crop": (3, 5, 50, 40)},
        {"spp": 40, "light_groups": "each", "filter": "mitchell", "sampler": "stratified"},
    ],
)
def test_settings_on_which_tiles_depend(scene: pathtracer.Scene, settings: dict[str, Any]) -> None:
    settings = {"width": 72, "height": 64, **settings}
    image = cluster.render(scene, task_seconds=0.1, merge_above=0, **settings)
    assert_same(image, pathtracer.render(scene, **settings))


def test_merges_of_workers_are_exact(scene: pathtracer.Scene) -> None:
    settings: dict[str, Any] = {"spp": 2000, "width": 16, "height": 16}
    few, many = cluster.Statistics(), cluster.Statistics()
    image = cluster.render(scene, task_seconds=0.1, merge_above=0, statistics=few, **settings)
    assert_same(image, pathtracer.render(scene, **settings))
    image = cluster.render(scene, task_seconds=0.1, statistics=many, **settings)
    assert_same(image, pathtracer.render(scene, **settings))
    assert few.films < many.films


def test_a_time_limit_ends_the_render_with_the_image_so_far(
    scene: pathtracer.Scene, tmp_path: Path
) -> None:
    film = tmp_path / "image.exr.film"
    settings: dict[str, Any] = {"spp": 1 << 16, "width": 64, "height": 48, "time_limit": "1.5s"}
    start = time.monotonic()
    image = cluster.render(scene, checkpoint=film, task_seconds=0.2, **settings)
    assert time.monotonic() - start < 30
    assert not image.complete and image.samples > 0
    assert image["color"].any()
    assert film.exists()


INTERRUPTED = """
import sys, ray, pathtracer.ray
ray.init(address=sys.argv[1], log_to_driver=False)
def report(state):
    if state.samples:
        print("samples", flush=True)
try:
    pathtracer.ray.render(pathtracer.default_scene(), spp=1 << 16, task_seconds=0.2,
                          width=64, height=48, progress=report)
except KeyboardInterrupt as error:
    print(error.partial.samples > 0, error.partial.complete)
"""


def test_ctrl_c_has_the_image_so_far(
    address: str, interruptible: Callable[..., subprocess.Popen[str]]
) -> None:
    driver = interruptible(INTERRUPTED, address)
    assert driver.stdout is not None
    assert driver.stdout.readline() == "samples\n"
    driver.send_signal(signal.SIGINT)
    *_, last = driver.stdout.read().splitlines()
    assert last == "True False"


def test_frames_and_views_are_one_job(scenes: Path) -> None:
    def jobs() -> Iterator[cluster.Job]:
        scene = pathtracer.load(scenes / "cornell.dae")
        for seed in range(3):
            yield cluster.Job(scene, {"spp": 40, "width": 48, "height": 36, "seed": seed})
        yield cluster.Job(pathtracer.default_scene(), {"spp": 8, "width": 24, "height": 18})

    images = list(cluster.render_many(jobs(), task_seconds=0.2))
    expected = [pathtracer.render(job.scene, **job.settings) for job in jobs()]
    assert len(images) == len(expected) == 4
    for image, one in zip(images, expected):
        assert_same(image, one)


def test_the_command_line_has_the_options_of_the_program(
    address: str, scenes: Path, tmp_path: Path, program: Program
) -> None:
    options: list[object] = ["-q", "-s", 64, "-r", 64, 48, "--seed", 3, "--metadata", "none"]
    options += ["--aov", "normal", "--exr-type", "half", scenes / "cornell.dae"]
    program([*options, "-f", tmp_path / "program.exr"])
    command: list[object] = [sys.executable, "-m", "pathtracer", "ray", "--ray-address", address]
    image = tmp_path / "ray.exr"
    done = subprocess.run(list(map(str, [*command, *options, "-f", image])), check=False)
    assert done.returncode == 0
    assert image.read_bytes() == (tmp_path / "program.exr").read_bytes()
    refused = [*command, "--samples", "0..4", "-f", image]
    done_badly = subprocess.run(
        list(map(str, refused)), check=False, capture_output=True, text=True
    )
    assert done_badly.returncode == 2
    assert done_badly.stderr == "error: --samples is not supported on several machines\n"


def test_sequences_of_the_command_line_are_one_job(
    address: str, scenes: Path, tmp_path: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ours").mkdir()
    (tmp_path / "theirs").mkdir()
    turn = [[0, 0, 1, 0], [0, 1, 0, 0.5], [-1, 0, 0, 0], [0, 0, 0, 1]]
    ahead = [[1, 0, 0, 0], [0, 1, 0, 0.5], [0, 0, 1, 2], [0, 0, 0, 1]]
    views = {
        "camera_angle_x": 0.8,
        "frames": [{"transform_matrix": matrix} for matrix in (turn, ahead)],
    }
    Path("transforms.json").write_text(json.dumps(views))
    options: list[object] = ["-s", 16, "-r", 32, 24, "--metadata", "none"]
    options += ["--cameras", "transforms.json", scenes / "cornell.dae"]
    program([*options, "-f", "theirs/%d.exr"])
    command = [sys.executable, "-m", "pathtracer", "ray", "--ray-address", address]
    done = subprocess.run(
        [*command, *map(str, options), "-f", "ours/%d.exr"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[-1] == "saved 2 images, ours/0.exr to ours/1.exr"
    for name in ["0.exr", "1.exr"]:
        assert Path("ours", name).read_bytes() == Path("theirs", name).read_bytes()


def test_cameras_of_a_scene_share_its_copy(
    address: str, scenes: Path, tmp_path: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = pathtracer.load(scenes / "cornell.dae")
    values = scene.to_dict()
    (camera,) = values["cameras"]
    turned = {**camera, "name": "turned", "y_fov": 30.0}
    values["cameras"] = [camera, turned]
    scene = pathtracer.Scene.from_dict(values)
    settings = {"spp": 8, "width": 32, "height": 24}
    costs = cluster.Statistics()
    jobs = [cluster.Job(scene, settings, camera=each) for each in (None, "0", "turned", 1)]
    images = list(cluster.render_many(jobs, address=address, statistics=costs))
    single = cluster.Statistics()
    for job, image in zip(jobs, images):
        used = 0 if job.camera == "0" else job.camera
        alone = scene if used is None else scene.replace(used_camera=used)
        wanted = pathtracer.render(alone, spp=8, width=32, height=24)
        np.testing.assert_array_equal(image["color"], wanted["color"])
    list(cluster.render_many(jobs[:1], address=address, statistics=single))
    assert costs.scene_bytes == single.scene_bytes > 0
    with pytest.raises(ValueError, match="camera: "):
        list(cluster.render_many([cluster.Job(scene, settings, camera="up")], address=address))
    scene.save(tmp_path / "views.json")
    timed = pathtracer.load(tmp_path / "views.json", time=0.5)
    with pytest.raises(ValueError, match=r"has to be read for each camera.*camera='turned'"):
        list(cluster.render_many([cluster.Job(timed, settings, camera="turned")], address=address))
    # From the command line.
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ours").mkdir()
    (tmp_path / "theirs").mkdir()
    options: list[object] = ["-s", 8, "-r", 32, 24, "--metadata", "none", "--cameras", "all"]
    program([*options, "-f", "theirs/%d.exr", "views.json"])
    command = [sys.executable, "-m", "pathtracer", "ray", "--ray-address", address]
    done = subprocess.run(
        [*command, *map(str, options), "-f", "ours/%d.exr", "views.json"],
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    for name in ["0.exr", "1.exr"]:
        assert Path("ours", name).read_bytes() == Path("theirs", name).read_bytes()


def test_the_store_has_the_hierarchies_of_the_scene(scene: pathtracer.Scene) -> None:
    render = PartialRender(scene, width=16, spp=1)
    packed = pack_scene(scene)
    known = packed.hierarchies
    assert packed.nbytes == len(known) + sum(map(len, packed.files.values())) > len(known) > 1000
    elsewhere = unpack_scene(packed)
    assert PartialRender(elsewhere, width=16, spp=1).identity == render.identity
    assert pack_scene(elsewhere).hierarchies == known
    with pytest.raises(ValueError, match="hierarchies: the tree is cut off"):
        with_hierarchies(scene, known[:-1])


def test_each_film_counts_once(scene: pathtracer.Scene) -> None:
    head = PartialRender(scene, spp=8, width=16, height=16)
    whole = (0, 0, 16, 16)
    first, *_ = head.render_part(whole, 0, 5, 1)
    second, *_ = head.render_part(whole, 5, 8, 1)
    with pytest.raises(ValueError, match="found samples from 5 on"):
        head.add(second)
    head.add(first)
    with pytest.raises(ValueError, match="do not follow those of the render"):
        head.add(first)
    with pytest.raises(ValueError, match="expected consecutive samples"):
        merge_parts([second, first])
    head.add(second)
    assert head.parts(16) == [(whole, 8, 8, 8, 0)]
    with pytest.raises(ValueError, match="expected one in"):
        head.render_part((8, 8, 16, 16), 0, 1, 1)
    with pytest.raises(ValueError, match="film: 100 bytes are too few"):
        head.add(first[:100])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"workers": 0}, "workers: found 0, expected a whole number from 1 on"),
        ({"threads": 0}, "threads: found 0, expected a whole number from 1 on"),
        ({"task_seconds": -1}, "task_seconds: found -1, expected seconds above 0"),
        ({"checkpoint_every": 0}, "checkpoint_every: found 0, expected seconds above 0"),
        ({"checkpoint": "film.exr"}, "checkpoint: found film.exr, expected a file name"),
        ({"max_dept": 3}, "did you mean \"max_depth\""),
        ({"address": "local"}, "connected to a cluster already"),
    ],
)
def test_wrong_arguments_are_named(
    scene: pathtracer.Scene, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        cluster.render(scene, spp=1, width=8, height=8, **options)
