"""Images of Mitsuba for small comparisons, recorded with far more samples than a comparison could take.

A scene's reference holds means of blocks and their variances, so that the statistics of the comparison are
those of images. It is used only for the scene files, the resolution and the version of Mitsuba that it was
made with: otherwise Mitsuba renders the scene again.
"""

import hashlib
import json
import re

from estimate import Estimate

DIGITS = 7


class References:
    """The references of a file, which need not exist."""

    def __init__(self, path, version):
        self.path = path
        self.version = version
        known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        # Another version may render other images.
        self.scenes = known["scenes"] if known.get("mitsuba") == version else {}

    def get(self, scene, resolution):
        """The estimate of a scene, or None if there is no reference of these files at this resolution."""
        found = self.scenes.get(scene.stem)
        if found is None or found["key"] != key(scene, resolution):
            return None
        return Estimate(found["blocks"], found["variance"], found["noise"])

    def set(self, scene, resolution, estimate, samples):
        """Records the estimate of a scene and its number of samples per pixel, and writes the file."""
        self.scenes[scene.stem] = {
            "key": key(scene, resolution),
            "samples": samples,
            "noise": rounded(estimate.noise),
            "blocks": rounded(estimate.blocks.tolist()),
            "variance": rounded(estimate.variance.tolist()),
        }
        # A line per scene, so that differences are those of scenes.
        lines = [f"{json.dumps(name)}: {json.dumps(row)}" for name, row in sorted(self.scenes.items())]
        text = f'{{"mitsuba": {json.dumps(self.version)}, "scenes": {{\n' + ",\n".join(lines) + "\n}}\n"
        unfinished = self.path.with_suffix(".part")
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(self.path)


def key(scene, resolution):
    """A hash of the scene's files and the resolution (None: that of the scene)."""
    total = hashlib.sha256(str(resolution).encode())
    for file in files(scene):
        total.update(file.read_bytes())
    return total.hexdigest()[:32]


def files(scene):
    """A scene file and those that it names, in order."""
    found, waiting = [], [scene]
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        found.append(file)
        if file.suffix == ".xml":
            names = re.findall(r'"([^"$]+\.\w+)"', file.read_text(encoding="utf-8"))
            waiting += [path for path in (scene.parent / name for name in names) if path.is_file()]
    return found


def rounded(numbers):
    if isinstance(numbers, list):
        return [rounded(number) for number in numbers]
    return float(f"{numbers:.{DIGITS}g}")
