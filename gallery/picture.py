"""The picture of the first page: fire-fighting from above, as it is flown, with what is still to do; an SVG that moves by itself.

`python -m gallery.picture` plans and certifies the mission, and writes `docs/firefighting.svg`.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path

import numpy as np

import ltlplan
import refine
import verify
from flight.pictures import robot_colour
from verify.data import Mission, Trajectory
from verify.data.shapes.region import Hoop

FILE = Path(__file__).parents[1] / "docs" / "firefighting.svg"
WIDTH, HEIGHT, SCALE, FOOT = 800, 500, 190.0, 40
FRAMES = 60
HOLD = 0.25
"""Share of the time for which the last picture stands."""
SLOWER = 1.4
"""The picture lasts so many times the flight."""


def picture(mission: Mission, team: Mapping[str, Trajectory], done: Mapping[str, float]) -> str:
    """Return the moving picture.

    Args:
        mission: The world.
        team: What is flown.
        done: What is to do, in words, and when each is done, s.
    """
    lasts = max(path.duration for path in team.values())
    seconds = SLOWER * lasts / (1 - HOLD)
    times = np.append(np.linspace(0, 1 - HOLD, FRAMES), 1.0)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" font-family="system-ui, sans-serif" font-size="17">',
        f"<title>{escape(mission.name)}: {escape(str(mission.spec.formula))}</title>",
        f'<rect width="{WIDTH}" height="{HEIGHT}" rx="12" fill="#f7f8fa"/>',
    ]
    for name, region in {**mission.regions, **mission.hoops}.items():
        x, y = _place(region.center)
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{0.2 * SCALE:.1f}" fill="{"#d9c9a8" if name == "smoke" else "#c3d4ea"}" opacity="0.7"/>'
        )
        if isinstance(region, Hoop):
            normal = np.asarray(region.normal, dtype=float)
            across = np.array([-normal[1], normal[0]]) * region.opening * SCALE
            parts.append(
                f'<line x1="{x - across[0]:.1f}" y1="{y + across[1]:.1f}" x2="{x + across[0]:.1f}" y2="{y - across[1]:.1f}" '
                'stroke="#56606e" stroke-width="5" stroke-linecap="round"/>'
            )
        parts.append(f'<text x="{x:.1f}" y="{y - 54:.1f}" text-anchor="middle" fill="#333a44">{escape(name)}</text>')
    for index, (name, path) in enumerate(team.items()):
        colour = robot_colour(index)
        ways = np.array([_place(path.evaluate(min(lasts * time / (1 - HOLD), path.duration))[:3]) for time in times[:-1]])
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in ways)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2" opacity="0.35"/>')
        keys = ";".join(f"{time:.4f}" for time in times)
        moves = "".join(
            f'<animate attributeName="{axis}" dur="{seconds:.2f}s" repeatCount="indefinite" keyTimes="{keys}" '
            f'values="{";".join(f"{value:.1f}" for value in [*ways[:, column], ways[-1, column]])}"/>'
            for column, axis in enumerate(("cx", "cy"))
        )
        x, y = ways[0]
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="9" fill="{colour}"><title>{escape(name)}</title>{moves}</circle>')
    for column, (what, when) in enumerate(done.items()):
        x, y = 26 + column * (WIDTH - 40) / len(done), HEIGHT - 22
        share = when / lasts * (1 - HOLD)
        for text, look, shown in ((what, 'fill="#56606e"', "1;0"), (f"{what} ✓", 'fill="#1d7a3c" font-weight="600"', "0;1")):
            parts.append(
                f'<text x="{x:.1f}" y="{y}" {look}>{escape(text)}<animate attributeName="opacity" calcMode="discrete" '
                f'dur="{seconds:.2f}s" repeatCount="indefinite" keyTimes="0;{share:.4f}" values="{shown}"/></text>'
            )
    return "\n".join([*parts, "</svg>"]) + "\n"


def main() -> None:
    """Plan, refine and certify fire-fighting, and write its picture."""
    mission = ltlplan.load_mission("firefighting")
    plan = ltlplan.plan(mission)
    team = refine.refine(plan)
    verify.certify(plan, team)  # raises where it is not proved
    first = {name: _first_inside(mission, team, name) for name in ("loc1", "loc2")}
    done = {f"visit {name}": when for name, when in first.items()}
    done["never in smoke without water"] = max(path.duration for path in team.values())
    FILE.write_text(picture(mission, team, done), encoding="utf-8")


def _first_inside(mission: Mission, team: Mapping[str, Trajectory], region: str) -> float:
    """Return when a robot is first inside a region, to a hundredth of a second: for the picture, not for a proof."""
    body = mission.hoops[region]
    return min(
        time
        for path in team.values()
        for time in np.arange(0.0, path.duration, 0.01)
        if np.sum(((path.evaluate(time)[:3] - body.center) / np.asarray(body.radii, dtype=float)) ** 2) <= 1.0
    )


def _place(point: object) -> tuple[float, float]:
    x, y, *_ = np.asarray(point, dtype=float)
    return WIDTH / 2 + SCALE * x, (HEIGHT - FOOT) / 2 - SCALE * y


if __name__ == "__main__":
    main()
