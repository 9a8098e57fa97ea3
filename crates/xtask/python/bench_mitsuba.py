"""Times Mitsuba 3, or renders a reference with it."""

import time

import numpy as np
import drjit as dr
import mitsuba as mi

from bench_peer import Clock, parse, race, write

# Samples per pixel of one of the images whose mean is a reference.
PASS = 64
# Beyond any path: no Russian roulette.
NEVER = 1000


def main():
    arguments = parse(
        __doc__,
        ("--variant", {"required": True}),
        ("--sampler", {"required": True}),
        ("--reference", {"action": "store_true"}),
    )
    mi.set_variant(arguments.variant)
    imported = time.time()
    dr.set_thread_count(arguments.threads)
    (reference if arguments.reference else measure)(arguments, imported)


def measure(arguments, imported):
    scene = load(arguments, {})
    image = None

    def timed(spp):
        nonlocal image
        with Clock() as clock:
            image = render(scene, spp, seed=1)
        return clock

    race(arguments, imported, timed)
    save(image, arguments.output)


def reference(arguments, _):
    """Means of images with seeds of their own. With the halves H₁ and H₂ of them and the mean R of
    both, the relative mean squared error of R is that of H₁ − H₂ over four."""
    scene = load(arguments, {"rr_depth": str(NEVER)})
    passes = max(arguments.spp // PASS, 2)
    halves = [0, 0]
    for seed in range(passes):
        halves[seed % 2] += render(scene, PASS, seed=1000 + seed).astype(np.float64)
        print(f"\r  reference: {seed + 1} of {passes}", end="", flush=True)
    print()
    first, second = halves[0] / ((passes + 1) // 2), halves[1] / (passes // 2)
    mean = (halves[0] + halves[1]) / passes
    save(mean, arguments.output)
    write(arguments, relative_mse=float(((first - second) ** 2 / 4 / (mean**2 + 0.01)).mean()))


def load(arguments, more):
    return mi.load_file(
        str(arguments.scene),
        res=str(arguments.res),
        spp=str(PASS if arguments.reference else arguments.spp),
        max_depth=str(arguments.depth),
        sampler=arguments.sampler,
        **more,
    )


def render(scene, spp, seed):
    image = mi.render(scene, spp=spp, seed=seed)
    dr.eval(image)
    dr.sync_thread()
    return np.array(image)


def save(pixels, path):
    mi.Bitmap(np.ascontiguousarray(pixels, dtype=np.float32)).write(str(path))


main()
