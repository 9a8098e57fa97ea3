"""Converts the PNG files of a folder to JPEG; those wider than 500 pixels become smaller.

Usage: python3 docs/scenes/to_jpeg.py target/pictures docs/images (needs Pillow)
"""

import sys
from pathlib import Path

from PIL import Image


def main(source, target):
    for path in sorted(source.rglob("*.png")):
        image = Image.open(path).convert("RGB")
        if image.width > 500:
            image.thumbnail((400, 400), Image.Resampling.LANCZOS)
        place = (target / path.relative_to(source)).with_suffix(".jpg")
        place.parent.mkdir(parents=True, exist_ok=True)
        image.save(place, quality=85, optimize=True)


main(Path(sys.argv[1]), Path(sys.argv[2]))
