"""Renders glTF scenes with Blender's Cycles and with pathtracer, and compares the images.

The mean of the image over pixels and channels may differ by at most 3 %. Blocks are printed beside it, without a
bound: the two have different principled materials.

Blender reads the file with its own importer, with lights in its "compatible" units: candela are watts per
steradian, as pathtracer takes them. Both use a box filter and the same number of bounces; nothing is clamped, and
denoising and adaptive sampling are off.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import bpy
import numpy as np

MOST = 0.03
BLOCK = 16
# Width and height of images in pixels, samples of a pixel, and surfaces that a path meets at most.
SIZE = (192, 144)
SAMPLES = 256
DEPTH = 33


def main():
    arguments = parse()
    scenes = [s for name in arguments.names for s in sorted(arguments.scenes.glob(f"{name}.gl*"))]
    if not scenes:
        sys.exit(f"no scene of these names in {arguments.scenes}")
    print(f"Blender {bpy.app.version_string} against pathtracer: {SIZE[0]} x {SIZE[1]} pixels, {SAMPLES} samples of each")
    print(f"{'scene':<14}{'mean theirs':>12}{'ours':>9}{'%':>8}{'R':>8}{'G':>8}{'B':>8}{'blocks within 5 %':>20}")
    failed = [scene.name for scene in scenes if not compare(scene, arguments)]
    if failed:
        sys.exit(f"FAILED: {', '.join(failed)}; images are in {arguments.output}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--scenes", type=pathlib.Path, required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("names", nargs="+")
    return parser.parse_args()


def compare(scene, arguments):
    """Prints a row of the table; false if the images differ."""
    theirs = cycles(scene, arguments.output / f"{scene.stem}_blender.exr")
    ours = pathtracer(arguments.program, scene, arguments.output / f"{scene.stem}_pathtracer.exr")
    means = [image.mean((0, 1)) for image in (theirs, ours)]
    difference = means[1].mean() / means[0].mean() - 1
    blocks = [in_blocks(image) for image in (theirs, ours)]
    near = np.abs(blocks[1] / np.maximum(blocks[0], 1e-9) - 1) <= 0.05
    channels = "".join(f"{100 * m:>8.2f}" for m in means[1] / means[0] - 1)
    good = abs(difference) <= MOST
    print(f"{scene.stem:<14}{means[0].mean():>12.5f}{means[1].mean():>9.5f}{100 * difference:>8.2f}{channels}"
          f"{near.sum():>12} of {near.size}{'' if good else '  FAILED'}", flush=True)
    return good


def in_blocks(image):
    """The means of blocks of pixels."""
    height, width = (n // BLOCK * BLOCK for n in image.shape[:2])
    shape = (height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)
    return image[:height, :width].reshape(shape).mean((1, 3, 4))


def cycles(path, image):
    """Renders with Blender."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path), export_import_convert_lighting_mode="COMPAT")
    scene = bpy.context.scene
    scene.camera = next(o for o in scene.objects if o.type == "CAMERA")
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    for bounces in ("max", "diffuse", "glossy", "transmission", "volume", "transparent_max"):
        setattr(scene.cycles, f"{bounces}_bounces", DEPTH - 1)
    for material in bpy.data.materials:
        emit_in_front(material)
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
    scene.cycles.blur_glossy = 0
    scene.cycles.light_sampling_threshold = 0
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(image)
    bpy.ops.render.render(write_still=True)
    return read(image)


def emit_in_front(material):
    """Emissive surfaces emit on their front only, as in glTF; the importer makes both sides emit."""
    if not material.use_nodes:
        return
    nodes, links = material.node_tree.nodes, material.node_tree.links
    for node in [n for n in nodes if n.type == "BSDF_PRINCIPLED"]:
        strength = node.inputs["Emission Strength"]
        if strength.default_value > 0 and not strength.is_linked:
            geometry, front = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeMath")
            front.operation = "MULTIPLY_ADD"
            front.inputs[1].default_value = -strength.default_value
            front.inputs[2].default_value = strength.default_value
            links.new(geometry.outputs["Backfacing"], front.inputs[0])
            links.new(front.outputs[0], strength)


def pathtracer(program, scene, image):
    """Renders with pathtracer."""
    size = [str(n) for n in SIZE]
    settings = ["-s", str(SAMPLES), "-m", str(DEPTH), "--filter", "box", "-r", *size]
    subprocess.run([program, "-q", *settings, "-f", image, scene], check=True)
    return read(image)


def read(path):
    """Red, green and blue of an image, from its lowest row on."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.array(image.pixels[:], dtype=np.float64).reshape(height, width, 4)
    bpy.data.images.remove(image)
    return pixels[..., :3]


main()
