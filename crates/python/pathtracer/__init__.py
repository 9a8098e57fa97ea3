"""A physically based path tracer.

>>> import pathtracer
>>> image = pathtracer.render(pathtracer.default_scene(), spp=4, width=32, height=24)
>>> image["color"].shape
(24, 32, 3)
"""

from ._async import render_async
from ._native import (
    Bvh,
    Finding,
    Hits,
    Image,
    Images,
    Interrupted,
    Progress,
    Scene,
    SceneError,
    __version__,
    default_scene,
    explain,
    load,
    loads,
    merge,
    render,
    render_iter,
    rerender,
    resume,
    settings,
)

__all__ = [
    "Bvh",
    "Finding",
    "Hits",
    "Image",
    "Images",
    "Interrupted",
    "Progress",
    "Scene",
    "SceneError",
    "__version__",
    "default_scene",
    "explain",
    "load",
    "loads",
    "merge",
    "render",
    "render_async",
    "render_iter",
    "rerender",
    "resume",
    "settings",
]
