"""Converts the PNG files of a folder to JPEG, and puts those of materials on one sheet.

Usage: python3 docs/scenes/to_jpeg.py target/pictures docs/images (needs Pillow)
"""

import sys
from pathlib import Path

from PIL import Image

# Order on the contact sheet, row by row.
MATERIALS = """diffuse rough_diffuse mirror conductor coated_conductor glass
thin_glass refraction coated_diffuse rough_coated_diffuse fresnel_plastic plastic
principled principled_thin metallic_roughness diffuse_transmission hair measured
black opacity mix two_sided surface_detail""".split()
COLUMNS, SIDE = 6, 150


def save(image, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, quality=85, optimize=True)


def main(source, target):
    for path in sorted(source.rglob("*.png")):
        image = Image.open(path).convert("RGB")
        save(image, (target / path.relative_to(source)).with_suffix(".jpg"))
    rows = -(-len(MATERIALS) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * SIDE, rows * SIDE), "white")
    for i, name in enumerate(MATERIALS):
        image = Image.open(source / "materials" / f"{name}.png").convert("RGB")
        place = (i % COLUMNS * SIDE, i // COLUMNS * SIDE)
        sheet.paste(image.resize((SIDE, SIDE), Image.Resampling.LANCZOS), place)
    save(sheet, target / "materials" / "all.jpg")


main(Path(sys.argv[1]), Path(sys.argv[2]))
