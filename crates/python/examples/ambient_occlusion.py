"""Ambient occlusion of an image by ray queries: the fraction of directions that are free.

    python ambient_occlusion.py [SCENE [RADIUS]]
"""

import sys

import numpy as np

import pathtracer

words = sys.argv[1:]
scene = pathtracer.load(words[0]) if words else pathtracer.default_scene()
radius = float(words[1]) if len(words) > 1 else 0.3

aovs = ["position", "geometric_normal", "depth"]
image = pathtracer.render(scene, width=160, spp=1, max_depth=0, aovs=aovs)
position, normal = image["position"], image["geometric_normal"]

random = np.random.default_rng(0)
free = np.zeros(image["depth"].shape)
for _ in range(64):
    # The sum of the normal and a point of the unit sphere is distributed by the cosine.
    directions = random.normal(size=position.shape)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    free += ~scene.occluded(position + 1e-4 * normal, normal + 0.999 * directions, radius)
free *= image["depth"] > 0

image["color"][:] = free[..., np.newaxis] / 64
image.save("occlusion.png")
print(f"{free.mean() / 64:.1%} of the directions are free on average")
