"""Memory of long processes."""

import sys
from pathlib import Path

import numpy as np
import pytest

import pathtracer


def resident() -> int:
    """Memory of this process in bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmRSS"))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_thousand_renders_leave_nothing_behind(scene: pathtracer.Scene) -> None:
    rays = np.random.default_rng(1).standard_normal((1000, 3))
    positions = rays[:300].astype(np.float32)
    faces = np.arange(300).reshape(100, 3)
    values = {
        "pathtracer": 1,
        "objects": [{"type": "mesh", "mesh": {"positions": positions, "triangles": faces}}],
    }
    start = 0
    for i in range(1000):
        pathtracer.render(scene, spp=1, width=32, height=24, seed=i, aovs=["normal"])
        if i % 10 == 0:
            made = pathtracer.Scene.from_dict(values)
            made.intersect([0, 0, 0], rays)
            pathtracer.Bvh(positions, faces).occluded([0, 0, 0], rays)
        if i == 99:
            start = resident()
    # The arrays of a thousand images alone would have 18 MB.
    assert resident() - start < 4 << 20
