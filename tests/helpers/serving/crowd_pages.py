"""Pages of many robots that swing over a field of regions: no planning, but the scene and the player of a report."""

import numpy as np

from flight.pictures import scene
from ltlplan.report.crowds import CROWD, lightened
from ltlplan.report.history.letters import LetterInterval
from ltlplan.report.page import page_html
from ltlplan.report.player import Playing, player_data, player_section
from verify.data import Mission, parse_mission


def field(robots: int) -> Mission:
    """Return a mission of robots in a row each before a region."""
    side = int(np.ceil(np.sqrt(robots)))
    places = [(i % side * 1.5, i // side * 1.5) for i in range(robots)]
    lines = ["format: 1\nname: field\nspec: {formula: F g0}\nvehicle: crazyflie-2.1\nregions:"]
    lines += [
        f"  g{i}: {{center: [{x}, {y + 1.5 * side + 2}, 1.0], radii: [0.2, 0.2, 0.2]}}" for i, (x, y) in enumerate(places)
    ]
    lines += ["agents:", *(f"  q{i}: {{start: [{x}, {y}, 1.0]}}" for i, (x, y) in enumerate(places))]
    lines += [f"workspace: {{min: [-3, -3, 0.2], max: [{1.5 * side + 3}, {3 * side + 6}, 4]}}", ""]
    return parse_mission("\n".join(lines))


def crowd_page(robots: int, *, seconds: float = 40.0) -> str:
    """Return a page on which robots swing towards their regions and back."""
    mission = field(robots)
    times = np.linspace(0.0, seconds, round(20 * seconds) + 1)
    ahead = (1 - np.cos(times / 5))[:, None] * np.array([0.0, 3.0, 0.2]) + np.sin(times)[:, None] * np.array([0.1, 0.0, 0.1])
    paths = {name: np.round(np.array(agent.start) + ahead, 4) for name, agent in mission.agents.items()}
    letters = {name: [LetterInterval(0.0, seconds, frozenset())] for name in paths}
    playing = Playing(times, paths, letters, [(0.0, [("F g0", "open")])], dict.fromkeys(paths, ""))
    return page_html(
        "A field", header="", sections=[player_section(playing, "robots", CROWD)],
        figures={"scene": lightened(scene(mission, paths))}, player=player_data(playing),
    )  # fmt: skip
