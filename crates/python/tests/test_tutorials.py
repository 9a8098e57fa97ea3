"""The steps of tutorials in the documentation run, and are not longer than those of Mitsuba."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).parent / "mitsuba-tutorials.md"

ROOM = """
<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective" id="camera">
        <float name="fov" value="40"/>
        <transform name="to_world">
            <lookat origin="0, -6, 2" target="0, 0, 0" up="0, 0, 1"/>
        </transform>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film>
    </sensor>
    <bsdf type="diffuse" id="yellow"><rgb name="reflectance" value="0.9, 0.9, 0"/></bsdf>
    <shape type="ply" id="ball"><string name="filename" value="ball.ply"/><ref id="yellow"/></shape>
    <emitter type="point" id="left"><point name="position" x="-3" y="-3" z="2"/><rgb name="intensity" value="10"/></emitter>
    <emitter type="point" id="right"><point name="position" x="3" y="-3" z="2"/><rgb name="intensity" value="10"/></emitter>
</scene>
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with the files of the tutorials, in which they run."""
    (tmp_path / "room.xml").write_text(ROOM)
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]
    header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    header += "property float z\nelement face 4\nproperty list uchar int vertex_indices\n"
    rows = [" ".join(map(str, row)) for row in corners]
    rows += [" ".join(map(str, (3, *face))) for face in faces]
    (tmp_path / "ball.ply").write_text(header + "end_header\n" + "\n".join(rows) + "\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_steps_run_and_are_not_longer(folder: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    theirs, ours = blocks[::2], blocks[1::2]
    assert len(theirs) == len(ours) >= 10
    for one, other in zip(theirs, ours):
        assert other.count("\n") <= one.count("\n"), other
    names: dict[str, object] = {}
    exec("".join(ours), names)  # noqa: S102
    images = names["images"]
    assert isinstance(images, list)
    assert len(images) == 6
    assert (folder / "room.exr").exists()
    assert all(image["color"].mean() > 0.1 for image in images)
