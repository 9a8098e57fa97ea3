"""Changes the colours and powers of lights after the render, by one image for each light.

    python relighting.py [SAMPLES]
"""

import sys

import pathtracer

TWO_LIGHTS = {
    "pathtracer": 1,
    "cameras": [{"type": "perspective", "y_fov": 35, "to_world": {"translate": [0, 0.6, 6]}}],
    "materials": {"white": {"type": "diffuse", "reflectance": 0.8}},
    "objects": [
        {"type": "sphere", "material": "white"},
        {"type": "sphere", "radius": 100, "material": "white", "to_world": {"translate": [0, -101, 0]}},
    ],
    "lights": [
        {"name": "left", "type": "point", "intensity": 30, "to_world": {"translate": [-3, 3, 2]}},
        {"name": "right", "type": "point", "intensity": 30, "to_world": {"translate": [3, 3, 2]}},
    ],
}

spp = int(sys.argv[1]) if len(sys.argv) > 1 else 64
scene = pathtracer.Scene.from_dict(TWO_LIGHTS)
groups = {"left": ["left"], "right": ["right"]}
image = pathtracer.render(scene, width=320, height=240, spp=spp, light_groups=groups)
warm, cold = (1.0, 0.6, 0.3), (0.3, 0.5, 1.0)
image["color"][:] = image["light_left"] * warm + 2 * image["light_right"] * cold
image.save("relit.png")
