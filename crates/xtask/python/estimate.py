"""Means of an image and of its blocks, with their variances."""

import numpy as np

BLOCK = 16
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


class Estimate:
    """`blocks` are means of each channel in blocks of pixels (rows, columns, 3), `variance` those of their
    luminance (rows, columns), and `noise` is the variance of the mean over the image, relative to its
    square, of the noisiest channel."""

    def __init__(self, blocks, variance, noise):
        self.blocks = np.array(blocks)
        self.variance = np.array(variance)
        self.noise = noise

    @classmethod
    def of_images(cls, images, reach):
        """The estimate of the mean of images (images, height, width, 3), in which pixels vary together with
        those as near as `reach`."""
        luminance = in_blocks(variance_of_pixels(images @ LUMINANCE, reach)) / len(images) / BLOCK**2
        return cls(in_blocks(images.mean(0)), luminance, relative_variance(images, reach))

    @property
    def mean(self):
        """The mean of each channel over the image."""
        return self.blocks.mean((0, 1))

    def picture(self):
        """The blocks as an image."""
        return self.blocks.repeat(BLOCK, 0).repeat(BLOCK, 1)


def in_blocks(pixels):
    """Means of the blocks of an image (height, width, …)."""
    height, width, *rest = pixels.shape
    return pixels.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, *rest).mean((1, 3))


def relative_variance(images, reach):
    """The variance of the mean over all pixels and images, relative to its square, of the channel
    where it is greatest."""
    channels = np.moveaxis(images, -1, 0)
    variances = [variance_of_pixels(c, reach).sum() / c[0].size ** 2 / len(c) for c in channels]
    return float(max(v / c.mean() ** 2 for v, c in zip(variances, channels)))


def variance_of_pixels(images, reach):
    """The variance of each pixel, and its covariances with pixels of its block that are near."""
    deviations = images - images.mean(0)
    near = np.zeros_like(deviations)
    height, width = images.shape[1:]
    for top in range(0, height, BLOCK):
        for left in range(0, width, BLOCK):
            block = np.s_[:, top : top + BLOCK, left : left + BLOCK]
            padded = np.pad(deviations[block], ((0, 0), (reach, reach), (reach, reach)))
            offsets = [(y, x) for y in range(2 * reach + 1) for x in range(2 * reach + 1)]
            near[block] = sum(padded[:, y : y + BLOCK, x : x + BLOCK] for y, x in offsets)
    return (deviations * near).sum(0) / (len(images) - 1)
