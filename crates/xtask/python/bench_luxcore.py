"""Times LuxCore.

Its film has no pixel filter, so that a sample counts for its own pixel. Each image is a session of
its own: the scene is prepared when that starts, which is not timed as rendering.
"""

import json
import os
import sys
import time

import pyluxcore as lux

from bench_peer import Clock, parse, race

# How often to ask whether an image is done, in seconds.
POLL = 0.005


def main():
    imported = time.time()
    arguments = parse(__doc__)
    lux.Init(lambda message: None)
    scene = json.loads(arguments.scene.read_text())
    os.chdir(arguments.scene.parent)
    built = lux.Scene()
    built.Parse(properties(describe(scene, arguments.res)))
    image = None

    def render(spp):
        nonlocal image
        config = lux.RenderConfig(properties(settings(arguments, spp)), built)
        image = lux.RenderSession(config)
        image.Start()
        with Clock() as clock:
            while True:
                image.UpdateStats()
                if image.HasDone():
                    break
                time.sleep(POLL)
        # It stops a little late.
        done = image.GetStats().Get("stats.renderengine.total.samplecount").GetFloat()
        share = spp * arguments.res**2 / done
        clock.wall, clock.cpu = clock.wall * share, clock.cpu * share
        image.Stop()
        return clock

    race(arguments, imported, render)
    image.GetFilm().SaveOutput(str(arguments.output), lux.FilmOutputType.RGB, properties({}))
    sys.stdout.flush()
    # It does not survive the end of the interpreter with its messages caught.
    os._exit(0)


def properties(values):
    all_of_them = lux.Properties()
    for key, value in values.items():
        all_of_them.Set(lux.Property(key, value))
    return all_of_them


def settings(arguments, spp):
    depth = arguments.depth
    return {
        "renderengine.type": "PATHCPU",
        "native.threads.count": arguments.threads,
        "sampler.type": "SOBOL",
        "sampler.sobol.adaptive.strength": 0.0,
        "film.width": arguments.res,
        "film.height": arguments.res,
        "film.filter.type": "NONE",
        "film.imagepipelines.0.0.type": "NOP",
        "path.pathdepth.total": depth,
        "path.pathdepth.diffuse": depth,
        "path.pathdepth.glossy": depth,
        "path.pathdepth.specular": depth,
        "path.hybridbackforward.enable": False,
        "path.clamping.variance.maxvalue": 0.0,
        "batch.haltspp": spp,
        "batch.halttime": 0,
    }


def describe(scene, res):
    """The scene in the words of LuxCore."""
    camera = scene["camera"]
    # Its rows of pixels lie one row lower than those of the others.
    shift = -2.0 / res
    values = {
        "scene.camera.type": "perspective",
        "scene.camera.lookat.orig": camera["eye"],
        "scene.camera.lookat.target": camera["look"],
        "scene.camera.up": [0.0, 1.0, 0.0],
        "scene.camera.fieldofview": camera["fov_degrees"],
        "scene.camera.cliphither": 0.001,
        "scene.camera.clipyon": 1000.0,
        "scene.camera.lensradius": 0.0,
        "scene.camera.autofocus.enable": False,
        "scene.camera.screenwindow": [-1.0, 1.0, -1.0 + shift, 1.0 + shift],
    }
    if scene["sky"]:
        values |= sky(scene["sky"])
    for mesh in scene["meshes"]:
        name = mesh["name"]
        values |= material(name, mesh["surface"])
        values[f"scene.shapes.{name}.type"] = "mesh"
        values[f"scene.shapes.{name}.ply"] = mesh["ply"]
        values[f"scene.objects.{name}.shape"] = name
        values[f"scene.objects.{name}.material"] = name
    return values


def sky(path):
    # Its map has +z above and its middle towards −x, and is seen from outside; ours has +y above and its
    # middle towards +z, and is seen from inside.
    rows = [[0, 1, 0, 0], [0, 0, 1, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]
    columns = [float(rows[r][c]) for c in range(4) for r in range(4)]
    return {
        "scene.lights.sky.type": "infinite",
        "scene.lights.sky.file": path,
        "scene.lights.sky.gamma": 1.0,
        "scene.lights.sky.gain": [1.0, 1.0, 1.0],
        "scene.lights.sky.transformation": columns,
    }


def material(name, surface):
    at = f"scene.materials.{name}"
    if "diffuse" in surface:
        return {f"{at}.type": "matte", f"{at}.kd": surface["diffuse"]}
    if "emission" in surface:
        return {
            f"{at}.type": "matte",
            f"{at}.kd": [0.0, 0.0, 0.0],
            f"{at}.emission": surface["emission"],
            f"{at}.emission.gain": [1.0, 1.0, 1.0],
            f"{at}.emission.power": 0.0,
            f"{at}.emission.efficency": 0.0,
        }
    metal = surface["metal"]
    return {
        f"scene.textures.{name}.type": "fresnelconst",
        f"scene.textures.{name}.n": metal["eta"],
        f"scene.textures.{name}.k": metal["k"],
        f"{at}.type": "metal2",
        f"{at}.fresnel": name,
        f"{at}.uroughness": metal["alpha"],
        f"{at}.vroughness": metal["alpha"],
    }


main()
