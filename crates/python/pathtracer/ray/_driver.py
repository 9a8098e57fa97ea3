"""The head of a render on a cluster: issues tasks, adds their films, and keeps the film on disk."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import ray
from ray import exceptions

from .._native import Interrupted, PartialRender
from . import _worker
from ._packing import PackedScene, key_of, pack_scene, pack_settings, view_of
from ._schedule import Schedule, Task

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from .._native import Image, Progress, Scene

# Failures of a worker, a machine or the object store, after which a task is issued again. Errors of
# the task itself would come again.
_LOST = (
    exceptions.WorkerCrashedError,
    exceptions.NodeDiedError,
    exceptions.OutOfMemoryError,
    exceptions.ObjectLostError,
    exceptions.RaySystemError,
    exceptions.LocalRayletDiedError,
    exceptions.TaskUnschedulableError,
)
# Failures of one task in succession after which the render ends: its scene may exceed a machine.
_MOST_FAILURES = 50
# Tasks under way for each worker: the next one is there when a worker is free.
_DEPTH = 2
# Tasks for each worker whose films are not added yet.
_MOST_WAITING = 4
# A task is issued again if it takes longer than this factor times the usual latency, and this many
# seconds.
_STRAGGLE = 4.0
_STRAGGLE_SECONDS = 10.0
# Tasks of one tile whose films are merged by a worker.
_MERGED = 16
# Seconds between two looks at the size of the cluster.
_LOOK = 5.0


@dataclass
class Statistics:
    """Costs of a render on a cluster.

    Attributes
    ----------
    tasks : int
        Tasks whose films were added.
    lost : int
        Tasks that were lost with their worker or machine, and issued again.
    reissued : int
        Copies of tasks that took too long.
    duplicates : int
        Results that came again, and were discarded.
    films : int
        Films that were added at the head.
    film_bytes : int
        Size of these films.
    scene_bytes : int
        Size of the scenes in the object store.
    worker_seconds : float
        Sum of the durations of all tasks in their processes.
    compile_seconds : float
        Of these, reading and compiling the scene.
    sample_seconds : float
        Of these, taking samples.
    add_seconds : float
        Adding films at the head.
    seconds : float
        Wall-clock time since the cluster was there.
    most_waiting : int
        Largest number of films that waited for their predecessors.
    """

    tasks: int = 0
    lost: int = 0
    reissued: int = 0
    duplicates: int = 0
    films: int = 0
    film_bytes: int = 0
    scene_bytes: int = 0
    worker_seconds: float = 0.0
    compile_seconds: float = 0.0
    sample_seconds: float = 0.0
    add_seconds: float = 0.0
    seconds: float = 0.0
    most_waiting: int = 0


@dataclass(frozen=True)
class Plan:
    """Arguments of renders on a cluster."""

    threads: int
    workers: int | None
    task_seconds: float
    merge_above: int
    checkpoint_every: float
    progress: Callable[[Progress], object] | None
    statistics: Statistics


@dataclass(frozen=True)
class Job:
    """An image to be rendered.

    Attributes
    ----------
    scene : Scene
        Scene to be rendered.
    settings : mapping
        Settings, as keywords of :func:`pathtracer.render`.
    checkpoint : str or os.PathLike, optional
        As for :func:`render`.
    camera : str or int, optional
        Name or number of a camera of the scene; by default the one that the scene uses. A scene
        that was read for a time, or whose cameras have settings of their own (Mitsuba), has to be
        loaded with its camera instead.
    """

    scene: Scene
    settings: Mapping[str, Any]
    checkpoint: str | os.PathLike[str] | None = None
    camera: str | int | None = None


@dataclass
class _Attempt:
    """A task under way."""

    render: _Render
    task: Task
    started: float
    # Results of its copies.
    refs: list[ray.ObjectRef[Any]] = field(default_factory=list)
    failures: int = 0


class _Render:
    """One image at the head."""

    def __init__(self, job: Job, store: _Store, plan: Plan, workers: int) -> None:
        self.head = PartialRender(view_of(job.scene, job.camera), **job.settings)
        scene, scene_ref = store.scene(job.scene)
        packed = pack_settings(job.settings, job.camera, self.head.identity)
        self.key = key_of(scene, packed)
        self.packed = [scene_ref, ray.put(packed)]
        self.start = time.monotonic()
        self.limit = self.head.time_limit
        self.keeps = job.checkpoint is not None
        if job.checkpoint is not None:
            self.head.keep(job.checkpoint)
        self.earlier = (self.head.seconds, self.head.rays)
        self.rays = 0
        self.schedule = Schedule(self.head, plan.task_seconds, workers)
        self.saved = (self.start, self.head.samples)
        self.shown = (-1, 0)

    @property
    def seconds(self) -> float:
        return time.monotonic() - self.start

    @property
    def is_late(self) -> bool:
        return self.limit is not None and self.seconds >= self.limit

    def save(self) -> None:
        seconds, rays = self.earlier
        self.head.save(seconds + self.seconds, rays + self.rays, self.schedule.finished)
        self.saved = (time.monotonic(), self.head.samples)

    def show(self, progress: Callable[[Progress], object]) -> None:
        samples, total = self.head.samples, self.schedule.total
        if (samples, total) != self.shown:
            self.shown = (samples, total)
            progress(self.head.progress(samples, total, self.rays, self.seconds))


class _Store:
    """Scenes in the object store, each once."""

    def __init__(self, statistics: Statistics) -> None:
        self._last: tuple[Scene, PackedScene, ray.ObjectRef[Any]] | None = None
        self._statistics = statistics

    def scene(self, scene: Scene) -> tuple[PackedScene, ray.ObjectRef[Any]]:
        if self._last is None or self._last[0] is not scene:
            packed = pack_scene(scene)
            self._statistics.scene_bytes += packed.nbytes
            self._last = (scene, packed, ray.put(packed))
        _, packed, ref = self._last
        return packed, ref


class Driver:
    """Renders images one after the other; the next one begins while the last tasks of one end."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._store = _Store(plan.statistics)
        options: dict[str, Any] = {"num_cpus": plan.threads, "max_retries": 0}
        self._take = ray.remote(**options)(_worker.take)
        # Merges are short, and wait for tasks that have the processors.
        self._merge = ray.remote(num_cpus=0, max_retries=0)(_worker.merge)
        self._under_way: dict[ray.ObjectRef[Any], _Attempt] = {}
        self._again: deque[_Attempt] = deque()
        self._latency = plan.task_seconds
        self._looked = float("-inf")
        self._workers = self._depth = 1

    def run(self, jobs: Iterable[Job]) -> Iterator[Image]:
        """Render images, and return each of them when it is complete, in order."""
        coming = iter(jobs)
        active: deque[_Render] = deque()
        start = time.monotonic()
        try:
            while True:
                self._look()
                while len(active) < 2 and not any(render.schedule.has_work for render in active):
                    job = next(coming, None)
                    if job is None:
                        break
                    active.append(_Render(job, self._store, self._plan, self._workers))
                if not active:
                    return
                self._issue(active)
                self._wait()
                self._copy_stragglers(active)
                self._keep(active)
                self._plan.statistics.seconds = time.monotonic() - start
                while active and (active[0].schedule.finished or active[0].is_late):
                    image = self._end(active[0])
                    # Its film is then free for other processes.
                    active.popleft()
                    yield image
        except KeyboardInterrupt as error:
            interrupted = Interrupted("the render was interrupted")
            interrupted.partial = self._end(active[0]) if active else None
            raise interrupted from error
        finally:
            for ref in self._under_way:
                ray.cancel(ref)
            self._under_way.clear()

    def _look(self) -> None:
        now = time.monotonic()
        if now - self._looked < _LOOK:
            return
        self._looked = now
        resources: dict[str, float] = ray.cluster_resources()  # type: ignore[no-untyped-call]
        cpus = resources.get("CPU", 0.0)
        workers = max(int(cpus // self._plan.threads), 1)
        most = self._plan.workers or workers
        self._workers = min(workers, most)
        # With free processors, a task that waits would run.
        self._depth = _DEPTH if most >= workers else 1

    def _issue(self, active: Iterable[_Render]) -> None:
        limit = self._depth * self._workers
        while self._again and len(self._under_way) < limit:
            self._start(self._again.popleft())
        merges = _MERGED if self._workers > self._plan.merge_above else 1
        for render in active:
            while not render.is_late and len(self._under_way) < limit:
                if render.schedule.waiting > _MOST_WAITING * self._workers:
                    break
                task = render.schedule.next(self._workers, merges)
                if task is None:
                    break
                self._start(_Attempt(render, task, time.monotonic()))

    def _start(self, attempt: _Attempt) -> None:
        render, threads = attempt.render, self._plan.threads
        attempt.started = time.monotonic()
        leaves = [
            self._take.remote(render.key, render.packed, [item for _, item in leaf], threads)
            for leaf in attempt.task.leaves
        ]
        ref = leaves[0] if len(leaves) == 1 else self._merge.remote(*leaves)
        attempt.refs.append(ref)
        self._under_way[ref] = attempt

    def _wait(self) -> None:
        if not self._under_way:
            return
        refs = list(self._under_way)
        ready, _ = ray.wait(refs, num_returns=1, timeout=0.2)
        if ready:
            # All others that are there by now.
            ready, _ = ray.wait(refs, num_returns=len(refs), timeout=0)
        for ref in ready:
            attempt = self._under_way.pop(ref, None)
            if attempt is None:
                continue
            try:
                done = ray.get(ref)
            except _LOST as error:
                self._lose(attempt, ref, error)
                continue
            except exceptions.TaskCancelledError:
                continue
            except exceptions.RayTaskError as error:
                raise error.cause if isinstance(error.cause, Exception) else error from None
            self._add(attempt, done)

    def _lose(self, attempt: _Attempt, ref: ray.ObjectRef[Any], error: Exception) -> None:
        attempt.refs.remove(ref)
        self._plan.statistics.lost += 1
        attempt.failures += 1
        if attempt.failures > _MOST_FAILURES:
            message = f"a task was lost {attempt.failures} times; the last time: {error}"
            raise RuntimeError(message) from error
        if not attempt.refs:
            self._again.append(attempt)

    def _add(self, attempt: _Attempt, done: _worker.Done) -> None:
        # Copies of the task that are under way count for nothing.
        for other in attempt.refs:
            if self._under_way.pop(other, None) is not None:
                self._plan.statistics.duplicates += 1
                ray.cancel(other)
        attempt.refs.clear()
        self._latency += 0.1 * (time.monotonic() - attempt.started - self._latency)
        start = time.perf_counter()
        attempt.render.schedule.add(attempt.task, done)
        attempt.render.rays += sum(taken.rays for taken in done.items)
        statistics = self._plan.statistics
        statistics.add_seconds += time.perf_counter() - start
        statistics.tasks += 1
        statistics.films += len(done.items)
        statistics.film_bytes += sum(len(taken.film) for taken in done.items)
        statistics.worker_seconds += done.seconds
        statistics.compile_seconds += done.compilation
        statistics.sample_seconds += sum(taken.seconds for taken in done.items)
        waiting = attempt.render.schedule.waiting
        statistics.most_waiting = max(statistics.most_waiting, waiting)

    def _copy_stragglers(self, active: Iterable[_Render]) -> None:
        """Issue tasks again that take long, where a worker is free or their film is waited for."""
        is_idle = len(self._under_way) < self._workers
        is_stuck = any(r.schedule.waiting > _MOST_WAITING * self._workers for r in active)
        if not is_idle and not is_stuck:
            return
        limit = max(_STRAGGLE_SECONDS, _STRAGGLE * self._latency)
        now = time.monotonic()
        for attempt in list(self._under_way.values()):
            if now - attempt.started > limit and len(attempt.refs) == 1:
                self._plan.statistics.reissued += 1
                self._start(attempt)

    def _keep(self, active: Iterable[_Render]) -> None:
        for render in active:
            then, samples = render.saved
            is_due = time.monotonic() - then >= self._plan.checkpoint_every
            if render.keeps and is_due and render.head.samples > samples:
                render.save()
        if self._plan.progress is not None:
            for render in list(active)[:1]:
                render.show(self._plan.progress)

    def _end(self, render: _Render) -> Image:
        """End a render: its tasks that are under way count for nothing any more."""
        for ref, attempt in list(self._under_way.items()):
            if attempt.render is render:
                del self._under_way[ref]
                ray.cancel(ref)
        self._again = deque(attempt for attempt in self._again if attempt.render is not render)
        render.save()
        if self._plan.progress is not None:
            render.show(self._plan.progress)
        return render.head.image(self._workers * self._plan.threads)
