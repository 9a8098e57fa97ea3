"""Division of a render into tasks, and addition of their films, each exactly once."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ._worker import Item

if TYPE_CHECKING:
    from .._native import PartialRender
    from ._worker import Done, Taken

# Samples of a pixel in the first pass, so that an image that ends early is complete.
_FIRST_PASS = 16
# Ratio of the samples of a pixel after a pass to those before.
_GROWTH = 4
# Sample numbers at which path reuse changes its squares: ranges end there if they can.
_ALIGNMENT = 16
# Seconds of a task for each item besides its samples.
_ITEM_SECONDS = 0.0005
# Smallest tasks, at the end of a render.
_LEAST_SECONDS = 0.1
# Squares that are tried, in pixels, and how many there are to be for each worker.
_SIZES = (64, 32, 16, 8)
_PER_WORKER = 8
# Items of a task, so that its films are small.
_ITEMS = 256


@dataclass
class Tile:
    """A rectangle of the film, with the numbers of samples that it has, awaits and needs."""

    region: tuple[int, int, int, int]
    taken: int
    issued: int
    # Largest number of samples of a pixel at the start of the round.
    most: int
    wanted: int
    # Samples of all pixels for each number.
    width: float
    # Seconds of a sample, once they are known.
    rate: float | None = None
    # Films that came before their predecessors, by their first sample.
    early: dict[int, tuple[int, Taken]] = field(default_factory=dict)


@dataclass
class Task:
    """Items that one process takes; several lists of them are ranges of one tile to be merged."""

    leaves: list[list[tuple[int, Item]]]
    expected: float


class Schedule:
    """A render whose samples are taken by tasks.

    The film is at any time one that the program could have written: the samples of a pixel are
    added in order. Films that come early wait; the number of tasks under way bounds them.
    """

    def __init__(self, head: PartialRender, seconds: float, workers: int) -> None:
        self._head = head
        self._seconds = seconds
        self._tiles: list[Tile] = []
        self._queue: list[tuple[int, int]] = []
        # Samples that are neither issued nor taken.
        self._missing = 0.0
        self._samples = self._costs = 0.0
        self._size = self._size_for(workers)
        self.waiting = 0
        self.finished = False
        self._under_way = 0
        self._plan()

    def _size_for(self, workers: int) -> int:
        # Ranges of samples divide a render further, unless samples depend on earlier ones.
        sizes = _SIZES if self._head.is_continued else _SIZES[:-1]
        _, _, width, height = self._head.region
        for size in sizes:
            if -(-width // size) * -(-height // size) >= _PER_WORKER * workers:
                return size
        return sizes[-1]

    def _plan(self) -> None:
        """Plan the next round, which is the only one without an error target."""
        rates = [tile.rate for tile in self._tiles]
        parts = self._head.parts(self._size)
        if self._head.has_target and not any(missing for *_, missing in parts):
            if not self._head.plan_round():
                self.finished = True
                return
            parts = self._head.parts(self._size)
        self._tiles = [
            Tile(region, taken, taken, most, wanted, missing / max(wanted - taken, 1))
            for region, taken, most, wanted, missing in parts
        ]
        for tile, rate in zip(self._tiles, rates, strict=False):
            tile.rate = rate
        self._queue = [(t.issued, i) for i, t in enumerate(self._tiles) if t.issued < t.wanted]
        heapq.heapify(self._queue)
        self._missing = float(sum(missing for *_, missing in parts))
        self._end_round()

    def _end_round(self) -> None:
        if not self._queue and self._under_way == 0:
            if self._head.has_target:
                self._plan()
            else:
                self.finished = True

    @property
    def total(self) -> int:
        """Samples of the film and those that it lacks by now."""
        lacking = sum((tile.wanted - tile.taken) * tile.width for tile in self._tiles)
        return self._head.samples + round(lacking)

    @property
    def has_work(self) -> bool:
        """True if a task can be issued."""
        return bool(self._queue)

    def next(self, workers: int, merges: int) -> Task | None:
        """Next task, or None if there is none now.

        With `merges` above 1, one pass of a tile that exceeds a task becomes up to so many tasks
        whose films are merged before they come back.
        """
        if not self._queue:
            return None
        rate = self._costs / self._samples if self._samples else None
        if rate is None:
            budget = None
        else:
            left = self._missing * rate / (2 * max(workers, 1))
            budget = min(max(left, _LEAST_SECONDS), self._seconds)
        items: list[tuple[int, Item]] = []
        expected = 0.0
        while self._queue and len(items) < _ITEMS:
            _, index = self._queue[0]
            tile = self._tiles[index]
            pace = tile.rate or rate
            end = self._pass_end(tile)
            if budget is None or pace is None:
                return Task([[self._issue(index, min(end, tile.issued + _FIRST_PASS))]], 0.0)
            fits = (budget - expected - _ITEM_SECONDS) / max(pace * tile.width, 1e-12)
            if items and fits < min(end - tile.issued, _FIRST_PASS):
                break
            count = _aligned(tile.issued, max(int(fits), 1), end)
            is_continued = self._head.is_continued or tile.most > tile.issued
            if not items and count < end and merges > 1 and not is_continued:
                return self._group(index, end, count - tile.issued, merges, pace)
            expected += _ITEM_SECONDS + (count - tile.issued) * tile.width * pace
            items.append(self._issue(index, count))
        return Task([items], expected)

    def _pass_end(self, tile: Tile) -> int:
        end = _FIRST_PASS
        while end <= tile.issued:
            end *= _GROWTH
        return min(end, tile.wanted)

    def _group(self, index: int, end: int, count: int, merges: int, pace: float) -> Task:
        tile = self._tiles[index]
        leaves: list[list[tuple[int, Item]]] = []
        while tile.issued < end and len(leaves) < merges:
            leaves.append([self._issue(index, min(tile.issued + count, end))])
        return Task(leaves, count * tile.width * pace)

    def _issue(self, index: int, end: int) -> tuple[int, Item]:
        tile = self._tiles[index]
        first = tile.issued
        # The pixels of a film of the program may have different numbers of samples.
        is_uneven = tile.most > first
        end = max(end, tile.most) if is_uneven and not self._head.is_continued else end
        tile.issued = end
        self._missing -= (end - first) * tile.width
        is_continued = self._head.is_continued or is_uneven
        film = self._head.part(tile.region) if is_continued else None
        # Parts that are continued come back before they are issued again.
        waits = is_continued or end >= tile.wanted
        if self._queue[0][1] == index:
            heapq.heappop(self._queue)
        else:
            self._queue = [entry for entry in self._queue if entry[1] != index]
            heapq.heapify(self._queue)
        if not waits:
            heapq.heappush(self._queue, (end, index))
        self._under_way += 1
        return index, Item(tile.region, first, end, film)

    def add(self, task: Task, done: Done) -> None:
        """Add the films of a task, which must be added once."""
        merged = len(task.leaves) > 1
        items = [item for leaf in task.leaves for item in leaf]
        if merged:
            index, item = items[0]
            pairs = [((index, Item(item.region, item.first, items[-1][1].end)), done.items[0])]
        else:
            pairs = list(zip(items, done.items, strict=True))
        self._under_way -= len(items)
        for (index, item), taken in pairs:
            tile = self._tiles[index]
            if taken.samples:
                self._samples += taken.samples
                self._costs += taken.seconds
                tile.rate = taken.seconds / taken.samples
            self._place(index, tile, item, taken)
        self._end_round()

    def _place(self, index: int, tile: Tile, item: Item, taken: Taken) -> None:
        if item.film is not None:
            # A part may need no more samples by a tolerance.
            if taken.samples:
                self._head.put_back(taken.film)
            tile.taken = item.end
            if tile.taken < tile.wanted:
                heapq.heappush(self._queue, (tile.taken, index))
            return
        tile.early[item.first] = (item.end, taken)
        self.waiting += 1
        while tile.taken in tile.early:
            end, next_taken = tile.early.pop(tile.taken)
            self._head.add(next_taken.film)
            tile.taken = end
            self.waiting -= 1


def _aligned(start: int, count: int, end: int) -> int:
    """End of a range of about this many samples, at most `end`."""
    stop = start + count
    if stop - stop % _ALIGNMENT > start:
        stop -= stop % _ALIGNMENT
    return min(stop, end)
