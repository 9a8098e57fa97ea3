"""A physically based path tracer.

>>> import pathtracer
>>> image = pathtracer.render(pathtracer.default_scene(), spp=4, width=32, height=24)
>>> image["color"].shape
(24, 32, 3)
"""

from ._async import render_async
from ._native import (
    Bsdf,
    Bvh,
    Finding,
    Hits,
    Image,
    Images,
    Interrupted,
    Light,
    PhaseFunction,
    Progress,
    Sampler,
    Scene,
    SceneError,
    __version__,
    default_scene,
    denoise,
    develop,
    explain,
    join,
    lights,
    load,
    loads,
    merge,
    render,
    render_iter,
    rerender,
    resume,
    settings,
)
from ._views import render_views

__all__ = [
    "Bsdf",
    "Bvh",
    "Finding",
    "Hits",
    "Image",
    "Images",
    "Interrupted",
    "Light",
    "PhaseFunction",
    "Progress",
    "Sampler",
    "Scene",
    "SceneError",
    "__version__",
    "default_scene",
    "denoise",
    "develop",
    "explain",
    "join",
    "lights",
    "load",
    "loads",
    "merge",
    "render",
    "render_async",
    "render_iter",
    "render_views",
    "rerender",
    "resume",
    "settings",
]
