"""Times Cycles of Blender, without its denoiser, clamping and adaptive sampling.

Its `max_bounces` are two fewer than the surfaces that light meets with the lamp. Data stay in memory
between renders, so that no image but the first has its scene sent and its tree built.
"""

import json
import math
import os
import sys
import time

import bpy
import numpy as np
from mathutils import Matrix, Vector

from bench_peer import Clock, parse, race


def main():
    imported = time.time()
    arguments = parse(__doc__, ("--no-light-tree", {"action": "store_true"}))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = json.loads(arguments.scene.read_text())
    folder = arguments.scene.parent
    blender = bpy.context.scene
    for mesh in scene["meshes"]:
        add_mesh(blender, mesh, folder)
    add_camera(blender, scene["camera"])
    add_sky(blender, scene["sky"] and folder / scene["sky"])
    settings(blender, arguments)

    def render(spp):
        blender.cycles.samples = spp
        # Else a changed setting is not seen, data being kept.
        blender.update_tag()
        with Clock() as clock:
            bpy.ops.render.render()
        return clock

    with silence():
        race(arguments, imported, render)
        bpy.data.images["Render Result"].save_render(str(arguments.output))


class silence:
    """Standard output goes nowhere: Blender prints its progress there."""

    def __enter__(self):
        sys.stdout.flush()
        self.kept = os.dup(1)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.close(nowhere)

    def __exit__(self, *_):
        os.dup2(self.kept, 1)
        os.close(self.kept)


def read_ply(path):
    """Positions and triangles of a binary file with nothing else in it."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    vertices, faces = (
        int(line.split()[2]) for line in header.splitlines() if line.startswith(b"element")
    )
    positions = np.frombuffer(body, "<f4", 3 * vertices).reshape(-1, 3)
    record = np.dtype([("corners", "u1"), ("triangle", "<u4", 3)])
    return positions, np.frombuffer(body, record, faces, 12 * vertices)["triangle"]


def add_mesh(blender, description, folder):
    name = description["name"]
    positions, triangles = read_ply(folder / description["ply"])
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", positions.ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.astype(np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_flat()
    mesh.materials.append(material(name, description["surface"]))
    blender.collection.objects.link(bpy.data.objects.new(name, mesh))


def material(name, surface):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    if "diffuse" in surface:
        shader = nodes.new("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (*surface["diffuse"], 1)
        shader.inputs["Roughness"].default_value = 0
    elif "metal" in surface:
        metal = surface["metal"]
        shader = nodes.new("ShaderNodeBsdfMetallic")
        shader.fresnel_type, shader.distribution = "PHYSICAL_CONDUCTOR", "GGX"
        # Its roughness is the root of α.
        shader.inputs["Roughness"].default_value = math.sqrt(metal["alpha"])
        shader.inputs["IOR"].default_value = metal["eta"]
        shader.inputs["Extinction"].default_value = metal["k"]
    else:
        shader = emission(nodes, links, surface["emission"])
        made.cycles.emission_sampling = "FRONT"
    links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def emission(nodes, links, radiance):
    """Emission of the outside: its strength times 1 − backfacing."""
    most = max(radiance)
    shader, side = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeNewGeometry")
    strength = nodes.new("ShaderNodeMath")
    strength.operation = "MULTIPLY_ADD"
    strength.inputs[1].default_value, strength.inputs[2].default_value = -most, most
    shader.inputs["Color"].default_value = (*(c / most for c in radiance), 1)
    links.new(side.outputs["Backfacing"], strength.inputs[0])
    links.new(strength.outputs[0], shader.inputs["Strength"])
    return shader


def add_camera(blender, description):
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "HORIZONTAL", math.radians(description["fov_degrees"])
    camera.clip_start, camera.clip_end = 0.001, 1000
    placed = bpy.data.objects.new("camera", camera)
    eye, look = Vector(description["eye"]), Vector(description["look"])
    back = (eye - look).normalized()
    right = Vector((0, 1, 0)).cross(back).normalized()
    placed.matrix_world = Matrix((right, back.cross(right), back)).transposed().to_4x4()
    placed.matrix_world.translation = eye
    blender.collection.objects.link(placed)
    blender.camera = placed


def add_sky(blender, path):
    world = blender.world = bpy.data.worlds.new("world")
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    background = nodes.new("ShaderNodeBackground")
    links.new(background.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    if path is None:
        background.inputs["Strength"].default_value = 0
        return
    # Its map has +z above and its middle towards +x; ours has +y above, and its middle towards +z.
    direction, parts = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeSeparateXYZ")
    turned, texture = nodes.new("ShaderNodeCombineXYZ"), nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(str(path))
    texture.image.colorspace_settings.name = "Linear Rec.709"
    links.new(direction.outputs["Generated"], parts.inputs[0])
    for ours, theirs in (("Z", "X"), ("X", "Y"), ("Y", "Z")):
        links.new(parts.outputs[ours], turned.inputs[theirs])
    links.new(turned.outputs[0], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])


def settings(blender, arguments):
    render, cycles = blender.render, blender.cycles
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = arguments.res
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", arguments.threads
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = False
    render.dither_intensity = 0
    image = render.image_settings
    image.file_format, image.color_mode = "OPEN_EXR", "RGB"
    image.color_depth, image.exr_codec = "32", "ZIP"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = arguments.depth - 2
    cycles.glossy_bounces = cycles.transmission_bounces = arguments.depth - 2
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.use_auto_tile = False
    cycles.pixel_filter_type = "BOX"
    cycles.use_light_tree = not arguments.no_light_tree
    cycles.light_sampling_threshold = 0


main()
