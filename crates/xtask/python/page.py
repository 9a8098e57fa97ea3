"""The comparison of scenes as a page to look at: a table with the images of both renderers."""

import html
import re

import mitsuba as mi
import numpy as np

# Blocks are a few pixels each in the picture of standard errors, which a browser shows without smoothing.
STYLE = """
body { font-family: sans-serif; margin: 2em; }
table { border-collapse: collapse; }
th, td { padding: 0.3em 0.8em; border-bottom: 1px solid #ccc; text-align: right; vertical-align: top; }
th:first-child, td:first-child { text-align: left; max-width: 24em; }
.failed { background: #fdd; }
img { width: 240px; image-rendering: pixelated; }
"""
HEADS = [
    "scene", "Mitsuba", "pathtracer", "standard errors of blocks", "mean R, %", "G", "B", "its standard error, %",
    "blocks within 3 standard errors", "worst", "Mitsuba, s", "pathtracer, s",
]


class Page:
    """Collects the scenes, and writes them to a folder."""

    def __init__(self, folder, introduction):
        self.folder = folder
        self.introduction = introduction
        self.rows = []

    def add(self, path, images, rows):
        """Adds a scene file, its images (theirs, ours, standard errors), and its rows of the table: name, row
        and whether it is good."""
        shown = []
        for name, pixels in zip(("mitsuba", "pathtracer", "standard_errors"), images):
            file = f"{path.stem}_{name}.png"
            mi.Bitmap(np.ascontiguousarray(pixels, dtype=np.float32)).convert(
                mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True
            ).write(str(self.folder / file))
            shown.append(f'<a href="{file}"><img src="{file}" alt="{name}"></a>')
        for first, (name, row, good) in zip((True, False), rows):
            cells = [f"<b>{html.escape(name)}</b>" + (f"<br>{describe(path)}" if first else "")]
            cells += shown if first else [""] * len(shown)
            cells += [f"{100 * m:.3f}" for m in row.mean]
            cells += [f"{100 * row.mean_error:.3f}", f"{row.blocks - row.outside} of {row.blocks}"]
            cells.append(f"{np.abs(row.z).max():.2f}")
            cells += ["" if s is None else f"{s:.1f}" for s in row.seconds or (None, None)]
            self.rows.append(tag("tr", "".join(tag("td", cell) for cell in cells), "" if good else "failed"))

    def write(self, verdict):
        """Writes the page; returns where it is."""
        heads = tag("tr", "".join(tag("th", head) for head in HEADS))
        body = tag("h1", "Comparison with Mitsuba") + tag("p", html.escape(self.introduction))
        body += tag("p", html.escape(verdict)) + tag("table", heads + "".join(self.rows))
        page = f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>Peers</title><style>{STYLE}</style>{body}</html>'
        path = self.folder / "index.html"
        unfinished = path.with_suffix(".part")
        unfinished.write_text(page, encoding="utf-8")
        unfinished.replace(path)
        return path


def tag(name, content, kind=""):
    attribute = f' class="{kind}"' if kind else ""
    return f"<{name}{attribute}>{content}</{name}>\n"


def describe(path):
    """What the first comment of the scene file says."""
    comment = re.search(r"<!--(.*?)-->", path.read_text(encoding="utf-8"), re.DOTALL)
    return html.escape(" ".join(comment.group(1).split())) if comment else ""
