"""Finds the noisiest pixel of an image, and the light paths that cause its noise.

    python fireflies.py [SAMPLES]
"""

import sys

import numpy as np

import pathtracer

spp = int(sys.argv[1]) if len(sys.argv) > 1 else 64
scene = pathtracer.default_scene()
image = pathtracer.render(scene, width=120, height=90, spp=spp, aovs=["variance"])
noise = np.sqrt(image["variance"]) / (image["color"].mean(axis=-1) + 0.01)
y, x = np.unravel_index(np.argmax(noise), noise.shape)
print(f"the noisiest pixel is in column {x}, row {y}: {noise[y, x]:.0%}")
rows = pathtracer.explain(scene, x=int(x), y=int(y), width=120, height=90, spp=spp, top=3)
for row in rows:
    print(f"{row['share']:.1%} of the light: sample {row['sample']}, {row['type']}")
    if row["cause"]:
        print(f"  {row['cause']}; {row['remedies']}")
