"""Reads mesh files with the library that is named, and prints the time of each.

Files are named on the lines of the input; each is answered by seconds, or by `nan` if the library does not read
the file or finds another number of triangles than 2,000,000.
"""

import sys
import time

TRIANGLES = 2_000_000


def load_assimp(path):
    scene = assimp_py.import_file(path, assimp_py.Process_Triangulate)
    return sum(len(mesh.indices) // 3 if mesh.indices is not None else 0 for mesh in scene.meshes)


def load_mitsuba(path):
    kind = path.rsplit(".", 1)[-1]
    if kind not in ("ply", "obj"):
        raise ValueError("no such plugin")
    return mitsuba.load_dict({"type": kind, "filename": path}).face_count()


def load_trimesh(path):
    return len(trimesh.load_mesh(path, process=False).faces)


name = sys.argv[1]
if name == "assimp":
    import assimp_py
elif name == "mitsuba":
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)  # it warns, and where the answers go
else:
    import trimesh

load = {"assimp": load_assimp, "mitsuba": load_mitsuba, "trimesh": load_trimesh}[name]
for line in sys.stdin:
    begin = time.perf_counter()
    try:
        triangles = load(line.rstrip("\n"))
    except Exception as error:
        print(f"{name}: {error}", file=sys.stderr)
        triangles = 0
    seconds = time.perf_counter() - begin
    print(seconds if triangles == TRIANGLES else "nan", flush=True)
