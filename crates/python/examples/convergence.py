"""Prints the error of an image as samples are added: it halves for four times as many.

The reference has a different seed, so that its noise is independent.

    python convergence.py [SAMPLES_OF_REFERENCE]
"""

import sys

import numpy as np

import pathtracer

most = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
scene = pathtracer.default_scene()
reference = pathtracer.render(scene, width=64, max_depth=1, spp=most, seed=1)["color"]
print("samples per pixel  relative error")
for spp in (4, 16, 64, 256):
    color = pathtracer.render(scene, width=64, max_depth=1, spp=spp)["color"]
    # Squares relative to the reference, without the largest thousandth.
    errors = (color - reference) ** 2 / (reference**2 + 0.01)
    errors = np.sort(errors.ravel())[: int(0.999 * errors.size)]
    print(f"{spp:17} {np.sqrt(errors.mean()):14.1%}")
