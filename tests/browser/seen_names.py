"""Names as they are seen in a scene of a browser, and what is wrong with where they are."""

from __future__ import annotations

from typing import Any

LOOK = """
(place) => {
  const around = place.querySelector(".scene-names").getBoundingClientRect();
  const names = [...place.querySelectorAll(".scene-name")].filter((each) => each.style.visibility === "visible");
  const lines = [...place.querySelectorAll(".scene-names path")].map((path) => path.getAttribute("d").slice(1).split("L").map((at) => at.split(",").map(Number)));
  return {
    names: names.map((each) => {
      const box = each.getBoundingClientRect(), [x, y, reach] = each.dataset.at.split(" ").map(Number);
      return { name: each.textContent, left: box.left - around.left, top: box.top - around.top, right: box.right - around.left, bottom: box.bottom - around.top, x, y, reach };
    }),
    lines, width: around.width, height: around.height,
    hidden: place.querySelector(".names-left").hidden ? 0 : Number(place.querySelector(".names-left summary").textContent.split(" ")[0]),
    told: place.querySelector(".names-left p").textContent,
  };
}
"""
"""Function in JavaScript of a scene's element: its names, the lines to them, and those without room."""


def faults(seen: dict[str, Any]) -> list[str]:
    """Return which names lie over others, over the edge, or far from their things without a line."""
    found: list[str] = []
    names = seen["names"]
    for index, one in enumerate(names):
        if (
            one["left"] < -0.6
            or one["top"] < -0.6
            or one["right"] > seen["width"] + 0.6
            or one["bottom"] > seen["height"] + 0.6
        ):
            found.append(f"{one['name']} is over the edge")
        for other in names[:index]:
            if (one["left"] < other["right"] and other["left"] < one["right"]
                    and one["top"] < other["bottom"] and other["top"] < one["bottom"]):  # fmt: skip
                found.append(f"{one['name']} lies over {other['name']}")
        off = max(one["left"] - one["x"], one["x"] - one["right"], one["top"] - one["y"], one["y"] - one["bottom"])
        joined = any(abs(start[0] - one["x"]) + abs(start[1] - one["y"]) < 0.3 for start, _ in seen["lines"])
        if off > one["reach"] + 4 and not joined:
            found.append(f"{one['name']} is {off:.0f} pixels from its thing and has no line")
    return found
