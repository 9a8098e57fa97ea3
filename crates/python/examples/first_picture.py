"""Renders the embedded scene, and writes it as light (.exr) and as a picture (.png).

    python first_picture.py [WIDTH [SAMPLES]]
"""

import sys

import pathtracer

width, spp = (int(word) for word in (sys.argv[1:] + ["320", "32"][len(sys.argv) - 1 :])[:2])
scene = pathtracer.default_scene()
image = pathtracer.render(scene, width=width, spp=spp, aovs=["albedo", "normal"], progress=True)
image.save("first.exr")
image.save("first.png", exposure="auto")
print(f"{image['color'].shape[1]} columns, {image.samples} samples, {image.seconds:.1f} s")
