"""Renders scenes with Mitsuba 3 and with pathtracer, and compares the images.

Both take several images of each scene with independent seeds and independent samples, so that the
variance of each pixel is known. The criterion, for each scene:

* the mean over the image differs by at most 0.5 % in each channel, which is at least 3 standard
  errors of the difference: a scene that is noisier is rendered again with as many more samples as
  its noise asks for, shared out so that the fewest are taken, and fails if these are too many;
* no block of 16 x 16 pixels differs by more than 5.5 standard errors of the difference in
  luminance: of exact images, one of 26 million does;
* at least 99.5 % of the blocks differ by at most 3 of these standard errors. Of exact images
  99.73 % do, so that in few blocks more may be outside by chance: as many as happen with a
  probability of 0.1 % or less count as chance. Over all scenes of the full size, where blocks are
  many, the share itself has to be reached.

The default sampler of pathtracer is compared likewise, by the standard errors of independent
samples, which are greater than its own.

Mitsuba lets a sample count for all pixels that its filter reaches, so that neighbours vary together;
their covariances belong to the variance of a block. Pathtracer draws the samples of each pixel by the
filter instead: the mean is the same, and pixels are independent. At the edge of the image its pixels
see what lies beyond, as Mitsuba's do with sample_border.

With references (see references.py), Mitsuba's side is known with a tenth of the variance that the mean may
have, and is rendered only for scenes without one. --record makes them.

A scene that does not use $res keeps its own size. If that is greater, it has as many samples per
image as the others, and thus fewer per pixel.
"""

import argparse
import math
import pathlib
import subprocess
import sys
import time

import mitsuba as mi
import numpy as np

from estimate import BLOCK, LUMINANCE, Estimate, in_blocks
from page import Page
from references import References

# The scalar variant needs no compiler on this machine.
mi.set_variant("scalar_rgb")

MOST_MEAN = 0.005
LEAST_BLOCKS = 0.995
STANDARD_ERRORS = 3.0
# Relative variance of the mean with which the most that means may differ by is 3 standard errors.
WANTED = (MOST_MEAN / STANDARD_ERRORS) ** 2
WORST_BLOCK = 5.5
# How often a scene is rendered until it is precise, with how many more samples than its noise asks
# for, and with how many samples per pixel of an image at most.
ROUNDS = 4
MARGIN = 1.2
MOST_SAMPLES = 6000
CHANCE = 1e-3
# Resolution, number of images, samples per pixel of each.
SIZES = {"small": (64, 12, 24), "full": (320, 16, 32)}


def main():
    arguments = parse()
    sizes = SIZES[arguments.size]
    paths = sorted(arguments.scenes.glob("*.xml"))
    if arguments.scene:
        paths = [p for p in paths if p.stem == arguments.scene]
    if not paths:
        sys.exit(f"no scene {arguments.scene or ''} in {arguments.scenes}")
    if not arguments.scene:
        check_plugins(arguments.scenes / "plugins.txt")
    references = References(arguments.references, mi.__version__) if arguments.references else None
    if arguments.record:
        for path in paths:
            record(path, sizes, references)
        return
    resolution, seeds, spp = sizes
    introduction = (
        f"Mitsuba {mi.__version__} against pathtracer: {resolution} x {resolution} pixels,\n"
        f"{seeds} images of {spp} samples per pixel each; * is the default sampler; scenes without\n"
        "seconds of theirs are compared with references, which have more samples"
    )
    print(introduction)
    page = Page(arguments.output, introduction)
    print(f"{'scene':<16}{'mean, %: R':>11}{'G':>8}{'B':>8}{'se':>7}{'blocks within 3 se':>20}"
          f"{'worst':>7}{'s theirs':>10}{'s ours':>8}")
    failed, outside, blocks = [], 0, 0
    for path in paths:
        images, rows = compare(path, arguments, sizes, references)
        judged = []
        for name, row in rows:
            good = row.print(name)
            judged.append((name, row, good))
            outside, blocks = outside + row.outside, blocks + row.blocks
            if not good:
                failed.append(name)
        page.add(path, images, judged)
    share = 1 - outside / blocks
    verdict = f"all: {100 * share:.2f} % of {blocks} blocks within 3 standard errors"
    print(f"{verdict}\n{page.write(verdict)}")
    if arguments.size == "full" and not arguments.scene and share < LEAST_BLOCKS:
        failed.append("all scenes together")
    if failed:
        sys.exit(f"FAILED: {', '.join(failed)}; images are in {arguments.output}")


def check_plugins(path):
    """Ends the program if the plugins that are installed are not those of a list, all of which the
    tests find read or refused."""
    if not path.exists():
        return
    rows = [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]
    listed = {kind for _, kind in rows}
    folder = pathlib.Path(mi.__file__).parent
    installed = {file.stem for file in (folder / "plugins").iterdir() if file.stem != "__pycache__"}
    installed |= {file.stem for file in (folder / "python" / "ad" / "integrators").glob("*.py")}
    installed -= {"__init__", "common"}
    if listed != installed:
        sys.exit(f"{path} is not the list of the plugins that are installed: {listed ^ installed}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--scenes", type=pathlib.Path, required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--size", choices=SIZES, required=True)
    parser.add_argument("--scene")
    parser.add_argument("--references", type=pathlib.Path)
    parser.add_argument("--record", action="store_true")
    return parser.parse_args()


def compare(path, arguments, sizes, references):
    """The images of one scene (theirs, ours, standard errors) and its rows of the table."""
    resolution, seeds, spp = sizes
    folder = arguments.output
    budget = resolution**2 * spp
    resolution = resolution if has_any_resolution(path) else None
    program = Program(arguments.program, path, resolution, folder)
    reference = references.get(path, resolution) if references else None
    if reference is None:
        peer = Mitsuba(path, resolution)
        theirs, ours = converged([peer, program], share(spp, budget, peer.pixels), seeds, WANTED)
        seconds = [theirs.seconds, ours.seconds]
        save(theirs.pixels, folder / f"{path.stem}_mitsuba.exr")
        theirs, pixels = theirs.estimate, theirs.pixels
    else:
        size = share(spp, budget, reference.variance.size * BLOCK**2)
        [ours] = converged([program], size, seeds, WANTED - reference.noise)
        theirs, pixels, seconds = reference, reference.picture(), [None, ours.seconds]
    sobol = in_blocks(program.render(ours.samples * seeds, "sobol", 0))
    save(ours.pixels, folder / f"{path.stem}_pathtracer.exr")
    independent = Row(theirs, ours.estimate, ours.estimate.blocks, seconds)
    save(independent.picture(), folder / f"{path.stem}_standard_errors.exr")
    rows = [
        (path.stem, independent),
        (path.stem + " *", Row(theirs, ours.estimate, sobol, None)),
    ]
    return (pixels, ours.pixels, independent.picture() / STANDARD_ERRORS), rows


def record(path, sizes, references):
    """Renders a scene with Mitsuba until its noise is small beside that of a comparison."""
    resolution, _, spp = sizes
    budget = resolution**2 * spp
    resolution = resolution if has_any_resolution(path) else None
    if references.get(path, resolution) is not None:
        return
    peer = Mitsuba(path, resolution)
    # More than in a comparison, for the variances of single blocks.
    seeds = 32
    samples = share(spp, budget, peer.pixels)
    [theirs] = converged([peer], samples, seeds, WANTED / 10, most=math.inf)
    references.set(path, resolution, theirs.estimate, theirs.samples * seeds)
    print(f"{path.stem:<19}{100 * math.sqrt(theirs.estimate.noise):>7.3f} %{theirs.seconds:>9.1f} s", flush=True)


def has_any_resolution(path):
    """True for a scene file without a size of its own."""
    return "$res" in path.read_text()


def share(spp, budget, pixels):
    """The samples per pixel of an image, the pixels of which share a budget of samples."""
    return min(spp, math.ceil(budget / pixels))


class Rendered:
    """The images of a renderer, the samples per pixel of each, and the seconds of all rounds until then."""

    def __init__(self, images, reach, samples, seconds):
        self.estimate = Estimate.of_images(images, reach)
        self.pixels = images.mean(0)
        self.samples = samples
        self.seconds = seconds


def converged(programs, spp, seeds, wanted, most=MOST_SAMPLES):
    """Images of each program, which together have this relative variance of the mean, if that takes at
    most `most` samples per pixel of an image."""
    samples, seconds = [spp for _ in programs], [0.0 for _ in programs]
    for turn in range(ROUNDS):
        # No two rounds share samples.
        numbers = range(turn * seeds, (turn + 1) * seeds)
        rendered = []
        for i, program in enumerate(programs):
            start = time.perf_counter()
            images = [program.render(samples[i], "independent", seed) for seed in numbers]
            seconds[i] += time.perf_counter() - start
            rendered.append(Rendered(np.stack(images), program.reach, samples[i], seconds[i]))
        more = needed([r.estimate.noise for r in rendered], wanted)
        if max(more) <= 1 or MARGIN * max(m * n for m, n in zip(more, samples)) > most:
            break
        samples = [math.ceil(MARGIN * m * n) if m > 1 else n for m, n in zip(more, samples)]
    return rendered


def needed(noise, wanted):
    """By what to multiply the samples of each program, so that their variances have this sum, with the
    fewest samples in all; at least 1."""
    if sum(noise) <= wanted:
        return [1.0 for _ in noise]
    # v0 / k0 + v1 / k1 = wanted where k0 + k1 is least: k is as the root of v.
    roots = [math.sqrt(v) for v in noise]
    return [max(1.0, root * sum(roots) / wanted) for root in roots]


class Mitsuba:
    """Renders a scene with Mitsuba."""

    def __init__(self, path, resolution):
        size = {} if resolution is None else {"res": str(resolution)}
        self.scene = mi.load_file(str(path), **size)
        film = self.scene.sensors()[0].film()
        self.pixels = math.prod(film.crop_size())
        radius = film.rfilter().radius()
        # How far away from each other pixels vary together.
        self.reach = max(0, math.ceil(radius - 0.5 - 1e-3))

    def render(self, spp, _sampler, seed):
        # Images of one seed and of the next must not share samples.
        image = mi.render(self.scene, spp=spp, seed=seed * 1_000_003 + 1)
        # A "moment" adds channels.
        return np.array(image, dtype=np.float64)[..., :3]


class Program:
    """Renders a scene with pathtracer."""

    # Its pixels do not vary together.
    reach = 0

    def __init__(self, program, path, resolution, folder):
        size = [] if resolution is None else ["-r", str(resolution), str(resolution)]
        # Films of an earlier program are not gone on with.
        new = ["--restart", "--checkpoint-every", "0"]
        self.command = [program, path, "-q", *new, *size]
        self.image = folder / f"{path.stem}_work.exr"

    def render(self, spp, sampler, seed):
        rest = ["-s", str(spp), "--sampler", sampler, "--seed", str(seed), "-f", self.image]
        subprocess.run(self.command + rest, check=True)
        image = np.array(mi.Bitmap(str(self.image)), dtype=np.float64)
        self.image.unlink()
        return image


class Row:
    """The comparison of blocks of ours with their estimate; `ours` has the variances of independent samples."""

    def __init__(self, theirs, ours, blocks, seconds):
        mean = theirs.mean
        self.mean = blocks.mean((0, 1)) / mean - 1
        # That of the noisiest channel.
        self.mean_error = math.sqrt(theirs.noise + ours.noise)
        difference = (blocks - theirs.blocks) @ LUMINANCE
        # Numbers of 32 bits are the least that images can differ by.
        rounding = (1e-6 * (mean @ LUMINANCE)) ** 2
        self.z = difference / np.sqrt(theirs.variance + ours.variance + rounding)
        self.blocks = self.z.size
        self.outside = int((np.abs(self.z) > STANDARD_ERRORS).sum())
        self.seconds = seconds

    def print(self, name):
        is_precise = STANDARD_ERRORS * self.mean_error <= MOST_MEAN
        worst = np.abs(self.z).max()
        good = (is_precise and np.abs(self.mean).max() <= MOST_MEAN and worst <= WORST_BLOCK
                and self.outside <= allowed(self.blocks))
        mean = "".join(f"{100 * m:>8.3f}" for m in self.mean) + f"{100 * self.mean_error:>7.3f}"
        within = f"{self.blocks - self.outside} of {self.blocks}"
        times = "".join(f"{'-' if s is None else f'{s:.1f}':>9}" for s in self.seconds or [])
        verdict = "" if good else "  FAILED" if is_precise else "  FAILED: too noisy to judge"
        print(f"{name:<19}{mean}{within:>20}{worst:>7.2f}{times}{verdict}", flush=True)
        return good

    def picture(self):
        """Standard errors of the blocks, red where ours is brighter and blue where theirs is."""
        return np.stack([np.maximum(self.z, 0), 0 * self.z, np.maximum(-self.z, 0)], -1)


def allowed(blocks):
    """How many of these blocks may be outside."""
    chance = math.erfc(STANDARD_ERRORS / math.sqrt(2))
    probability = (1 - chance) ** blocks
    below, outside = probability, 0
    while 1 - below > CHANCE:
        outside += 1
        probability *= (blocks - outside + 1) / outside * chance / (1 - chance)
        below += probability
    return max(outside, math.floor((1 - LEAST_BLOCKS) * blocks))


def save(pixels, path):
    mi.Bitmap(np.ascontiguousarray(pixels, dtype=np.float32)).write(str(path))


main()
