"""Renders cut-out scenes with Mitsuba 3 and with pathtracer, and compares their alpha and colours.

Both take several images of each scene with independent seeds and independent samples, so that the
variance of each pixel is known. The criterion, for each scene: the mean of alpha, and each block of
16 x 16 pixels of alpha and of the luminance of the premultiplied colours, differ by at most 5
standard errors of the difference (of 330 numbers of Student's t with 30 degrees of freedom one is
beyond that with a probability of 0.8 %), and the mean of alpha by at most 0.005.

Mitsuba lets a sample count for all pixels that its filter reaches; the variance of a block is that of
the means of blocks over the images, in which that is.
"""

import argparse
import pathlib
import subprocess
import sys

import mitsuba as mi
import numpy as np

# The scalar variant needs no compiler on this machine.
mi.set_variant("scalar_rgb")

BLOCK = 16
MOST_MEAN = 0.005
STANDARD_ERRORS = 5.0
# Numbers of 32 bits are the least that images can differ by.
ROUNDING = 1e-6
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Resolution, number of images, samples per pixel of each.
SIZES = {"small": (64, 16, 16), "full": (128, 24, 64)}


def main():
    arguments = parse()
    resolution, seeds, spp = SIZES[arguments.size]
    print(f"alpha of Mitsuba {mi.__version__} and of pathtracer: {resolution} x {resolution} pixels, "
          f"{seeds} images of {spp} samples per pixel each")
    print(f"{'scene':<16}{'mean theirs':>12}{'ours':>9}{'se':>9}{'worst block':>13}{'in se':>7}"
          f"{'colours, in se':>16}")
    failed = []
    for path in sorted(arguments.scenes.glob("*.xml")):
        scene = mi.load_file(str(path), spp=str(spp), res=str(resolution))
        theirs = np.stack([render_theirs(scene, spp, seed) for seed in range(seeds)])
        ours = np.stack(
            [render_ours(arguments, path, resolution, spp, seed) for seed in range(seeds)]
        )
        if not compare(path.stem, theirs, ours):
            failed.append(path.stem)
    if failed:
        sys.exit(f"FAILED: {', '.join(failed)}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--scenes", type=pathlib.Path, required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--size", choices=SIZES, required=True)
    return parser.parse_args()


def render_theirs(scene, spp, seed):
    # Images of one seed and of the next must not share samples.
    return np.array(mi.render(scene, spp=spp, seed=seed * 1_000_003 + 1), dtype=np.float64)


def render_ours(arguments, path, resolution, spp, seed):
    image = arguments.output / f"{path.stem}_work.exr"
    size = ["-r", str(resolution), str(resolution), "-s", str(spp), "--seed", str(seed)]
    new = ["--restart", "--checkpoint-every", "0"]
    size += ["--sampler", "independent", "-f", image]
    command = [arguments.program, path, "-q", *new, *size]
    subprocess.run(command, check=True)
    pixels = np.array(mi.Bitmap(str(image)), dtype=np.float64)
    image.unlink()
    if pixels.shape[2] != 4:
        sys.exit(f"{path}: the image of pathtracer has no alpha")
    return pixels


def compare(name, theirs, ours):
    """Prints the row of a scene, and says whether both agree."""
    alpha = difference(theirs[..., 3], ours[..., 3])
    colors = difference(theirs[..., :3] @ LUMINANCE, ours[..., :3] @ LUMINANCE)
    means = [images[..., 3].mean((1, 2)) for images in (theirs, ours)]
    error = np.sqrt(sum(mean.var(ddof=1) / len(mean) for mean in means)) + ROUNDING
    off = abs(means[1].mean() - means[0].mean())
    worst = [np.abs(d / e).max() for d, e in (alpha, colors)]
    good = max(worst) <= STANDARD_ERRORS and off <= min(MOST_MEAN, STANDARD_ERRORS * error)
    print(f"{name:<16}{means[0].mean():>12.5f}{means[1].mean():>9.5f}{error:>9.5f}"
          f"{np.abs(alpha[0]).max():>13.5f}{worst[0]:>7.2f}{worst[1]:>16.2f}"
          f"{'' if good else '  FAILED'}", flush=True)
    return good


def difference(theirs, ours):
    """Of each block the difference of the means, and its standard error.

    The variance of a block is a poor estimate from few images: at least half of that of all blocks on average is
    taken where a block varies at all.
    """
    blocks = [in_blocks(images) for images in (theirs, ours)]
    variance = sum(block.var(0, ddof=1) / len(block) for block in blocks)
    variance = np.where(variance > 0, np.maximum(variance, 0.5 * variance.mean()), 0)
    return blocks[1].mean(0) - blocks[0].mean(0), np.sqrt(variance) + ROUNDING


def in_blocks(images):
    """The means of the blocks of each image."""
    count, height, width = images.shape
    cut = images.reshape(count, height // BLOCK, BLOCK, width // BLOCK, BLOCK)
    return cut.mean((2, 4))


main()
