"""Scenes of many robots, lightened: a browser draws each trace of a scene apart, up to three times a frame, and 30 frames a second it cannot
draw hundreds.

All paths become one trace and all robots another, which say of each point whose it is, so that a robot can be hidden by its name. All
regions and obstacles become one body of each opacity, all their names one trace, and where these are very many too they are told on
hovering alone. Pages leave out tubes of the margin, flown paths and waypoints: where many robots are seen at once they are thinner than
a line.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flight.figures import Figure, Trace, trace
from flight.pictures import MANY

CROWD = (
    f"Line: path. Tubes of the margin, flown paths and waypoints are left out of scenes of more than {MANY} robots. Robots are discs to scale; "
    "the ring around each only shows where it is. Drag to turn, scroll to zoom, or use arrows, + and -; a click on a robot's name beside the scene hides it, or shows it again."
)


def lightened(figure: Figure) -> Figure:
    """Return a scene with a handful of traces; the last one has the markers that a player may move, in the robots' order.

    Args:
        figure: As `flight.pictures.scene` draws it.
    """
    bodies: dict[float, list[Trace]] = {}
    names: list[Trace] = []
    paths: list[Trace] = []
    robots: list[Trace] = []
    kept: list[Trace] = []
    for drawn in figure.data:
        kind = (drawn["type"], drawn.get("mode"), "since" in drawn.get("meta", {}))
        if kind == ("mesh3d", None, False):
            bodies.setdefault(drawn["opacity"], []).append(drawn)
        elif kind == ("scatter3d", "text", False):
            names.append(drawn)
        elif kind == ("scatter3d", "lines", False) and drawn["line"]["dash"] == "solid":
            paths.append(drawn)
        elif kind == ("scatter3d", "markers", False):
            robots.append(drawn)
        else:
            kept.append(drawn)
    merged = [_body(meshes) for meshes in bodies.values()]
    told = [_names(names)] if 0 < len(names) <= MANY else []
    return Figure([*merged, *told, *kept, _paths(paths), _robots(robots)], figure.layout)


def _body(meshes: Sequence[Trace]) -> Trace:
    firsts = np.cumsum([0, *(len(mesh["x"]) for mesh in meshes)]).tolist()
    places = {axis: [value for mesh in meshes for value in mesh[axis]] for axis in "xyz"}
    faces = {
        axis: [corner + first for mesh, first in zip(meshes, firsts[:-1], strict=True) for corner in mesh[axis]]
        for axis in "ijk"
    }
    return trace(
        "mesh3d", **places, **faces, facecolor=[mesh["color"] for mesh in meshes for _ in mesh["i"]],
        hovertext=[mesh["name"] for mesh in meshes for _ in mesh["x"]], hoverinfo="text", opacity=meshes[0]["opacity"], name="regions",
        showlegend=False, flatshading=False,
    )  # fmt: skip


def _names(texts: Sequence[Trace]) -> Trace:
    places = {axis: [value for text in texts for value in text[axis]] for axis in "xyz"}
    words = [word for text in texts for word in text["text"]]
    return trace("scatter3d", **places, text=words, mode="text", hoverinfo="skip", showlegend=False, name="names")


def _paths(lines: Sequence[Trace]) -> Trace:
    """Return all paths as one line that is broken between robots; `customdata` says of each point whose it is."""
    places = {axis: [value for line in lines for value in (*line[axis], None)] for axis in "xyz"}
    own = [line for line in lines for _ in (*line["x"], None)]
    return trace(
        "scatter3d", **places, mode="lines", line={"color": [line["line"]["color"] for line in own], "width": lines[0]["line"]["width"] if lines else 4},
        customdata=[line["name"] for line in own], hovertemplate="%{customdata}<extra></extra>", showlegend=False, name="paths",
    )  # fmt: skip


def _robots(markers: Sequence[Trace]) -> Trace:
    """Return all robots as one trace of markers; `customdata` names them."""
    places = {axis: [value for marker in markers for value in marker[axis]] for axis in "xyz"}
    said = [marker["meta"] for marker in markers]
    meta = {what: [each for one in said for each in one[what]] for what in ("robots", "radii")}
    look = {**markers[0]["marker"], "color": [each["marker"]["color"] for each in markers]}
    return trace(
        "scatter3d", **places, mode="markers", marker=look, customdata=[marker["name"] for marker in markers], meta=meta,
        hovertemplate="%{customdata}<extra></extra>", showlegend=False, name="robots",
    )  # fmt: skip
