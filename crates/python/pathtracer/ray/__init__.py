"""Renders on clusters, by Ray (``pip install "pathtracer[ray]"``).

>>> import pathtracer.ray  # doctest: +SKIP
>>> image = pathtracer.ray.render(scene, spp=4096, address="auto")  # doctest: +SKIP

The image is that of :func:`pathtracer.render`, bit for bit, on any number of workers, whichever of
them are lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

try:
    import ray as _ray
except ImportError as _error:
    _message = 'pathtracer.ray needs Ray; pip install "pathtracer[ray]" installs it'
    raise ImportError(_message) from _error

from .._progress import bar
from ._driver import Driver, Job, Plan, Statistics

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from typing_extensions import Unpack

    from .._native import Image, Progress, Scene, _Integer, _Settings
    from .._progress import _Line, _Tqdm

__all__ = ["Job", "Statistics", "render", "render_many"]


def render(
    scene: Scene,
    *,
    address: str | None = None,
    workers: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: float = 60.0,
    task_seconds: float = 2.0,
    merge_above: int = 64,
    statistics: Statistics | None = None,
    width: _Integer | None = None,
    height: _Integer | None = None,
    aovs: Sequence[str] | None = None,
    progress: Callable[[Progress], object] | bool | None = None,
    **settings: Unpack[_Settings],
) -> Image:
    """Render a scene on a cluster.

    Parameters
    ----------
    scene : Scene
        Scene to be rendered, which is sent to the workers with its files.
    address : str, optional
        Address of the cluster, as for ``ray.init``: "auto" for the one that runs on this machine,
        "local" for a new one on this machine. By default, the cluster to which this process is
        connected, or what ``ray.init`` finds, or a new one.
    workers : int, optional
        Maximum number of tasks at a time; by default one for each `threads` processors.
    checkpoint : str or os.PathLike, optional
        Film file (.film) that is written now and then, and at the end. If it exists, the render
        resumes from it. ``image.exr.film`` is the film of ``image.exr``, which the program resumes.
    checkpoint_every : float, optional
        Seconds between two writes of the film.
    task_seconds : float, optional
        Intended duration of a task in seconds.
    merge_above : int, optional
        Number of workers above which ranges of samples of one tile are merged by workers.
    statistics : Statistics, optional
        Object to which the costs of the render are added.
    width, height, aovs, progress, **settings
        As for :func:`pathtracer.render`; `threads` is the number of threads of each worker, 1 by
        default, and `time_limit` counts from the compilation of the scene at the head.

    Returns
    -------
    Image
        Equal to the one of :func:`pathtracer.render`, bit for bit.

    Raises
    ------
    SceneError, TypeError, ValueError
        As :func:`pathtracer.render`; ValueError also if the film has samples of another image.
    OSError
        If the film cannot be read or written, or another process writes it.
    RuntimeError
        If a task is lost with its worker again and again, or the workers have another version of
        the package.
    Interrupted
        After Ctrl-C, with the image so far as `partial`.
    """
    named: dict[str, Any] = {"width": width, "height": height, "aovs": aovs, **settings}
    images = render_many(
        [Job(scene, named, checkpoint)],
        address=address,
        workers=workers,
        checkpoint_every=checkpoint_every,
        task_seconds=task_seconds,
        merge_above=merge_above,
        statistics=statistics,
        progress=progress,
        threads=settings.get("threads"),
    )
    return list(images)[0]


def render_many(
    jobs: Iterable[Job],
    *,
    address: str | None = None,
    workers: int | None = None,
    checkpoint_every: float = 60.0,
    task_seconds: float = 2.0,
    merge_above: int = 64,
    statistics: Statistics | None = None,
    progress: Callable[[Progress], object] | bool | None = None,
    threads: _Integer | None = None,
) -> Iterator[Image]:
    """Render many frames or views on a cluster as one job.

    An image begins while the last tasks of the one before end, so that no worker waits. Two films
    are in memory at a time. Jobs that follow one another with the same `Scene` share its copy in
    the object store.

    Parameters
    ----------
    jobs : iterable of Job
        Images, of which each has a scene, settings as keywords of :func:`pathtracer.render`, a film
        file or None, and a camera of the scene or None. They may be generated: a job is taken when
        the workers are free for it.
    threads : int, optional
        Number of threads of each worker, whatever the settings of the jobs are.
    address, workers, checkpoint_every, task_seconds, merge_above, statistics, progress
        As for :func:`render`; progress is that of the image which is returned next.

    Yields
    ------
    Image
        The images, in order.

    Raises
    ------
    SceneError, TypeError, ValueError, OSError, RuntimeError, Interrupted
        As :func:`render`.
    """
    of_worker = int(threads) if threads is not None else 1
    _check("threads", of_worker, of_worker >= 1, "a whole number from 1 on")
    _check("workers", workers, workers is None or workers >= 1, "a whole number from 1 on")
    _check("checkpoint_every", checkpoint_every, checkpoint_every > 0.0, "seconds above 0")
    _check("task_seconds", task_seconds, task_seconds > 0.0, "seconds above 0")
    _check("merge_above", merge_above, merge_above >= 0, "a whole number from 0 on")
    shown = bar() if progress is True else None
    report = shown if progress is True else progress or None
    if report is not None and not callable(report):
        found = type(progress).__name__
        message = f"progress: found {found}, expected a callable, True or None"
        raise TypeError(message)
    plan = Plan(
        of_worker,
        workers,
        task_seconds,
        merge_above,
        checkpoint_every,
        report,
        statistics if statistics is not None else Statistics(),
    )
    return _images(jobs, plan, address, shown)


def _images(
    jobs: Iterable[Job], plan: Plan, address: str | None, shown: _Line | _Tqdm | None
) -> Iterator[Image]:
    starts = not _ray.is_initialized()
    if starts:
        options: dict[str, Any] = {"address": address, "log_to_driver": False}
        if plan.workers is not None and address == "local":
            options["num_cpus"] = plan.workers * plan.threads
        _ray.init(include_dashboard=False if address == "local" else None, **options)
    elif address == "local":
        message = "address: found local, but this process is connected to a cluster already"
        raise ValueError(message)
    try:
        yield from Driver(plan).run(map(_checked, jobs))
    finally:
        if shown is not None:
            shown.close()
        if starts:
            _ray.shutdown()


def _checked(job: Job) -> Job:
    settings: Mapping[str, Any] = {k: v for k, v in job.settings.items() if v is not None}
    return Job(job.scene, settings, job.checkpoint, job.camera)


def _check(name: str, value: object, is_valid: bool, expected: str) -> None:
    if not is_valid:
        message = f"{name}: found {value}, expected {expected}"
        raise ValueError(message)
