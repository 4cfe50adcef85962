"""The scene that plays: its controls, and what each robot shows and what is still to do at each time."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flight.pictures import Floats, robot_colour
from ltlplan.report.history.letters import LetterInterval
from ltlplan.report.page import figure_place
from verify.data.language.word import show_letter

Todo = Sequence[tuple[float, Sequence[tuple[str, str]]]]
"""Rows of time in s and (part of the formula, how it stands)."""


@dataclass(frozen=True, eq=False)
class Playing:
    """Contents of a player.

    Attributes:
        times: s, evenly apart. Shape (samples,).
        paths: For each robot of the scene, in its order, positions in m. Shape (samples, 3 or more).
        letters: Each robot's letters over time.
        todo: How each part of the formula stands over time.
        tasks: What each robot is there for, in words.
        happened: (time in s, sentence) of what happened on the way, in order.
    """

    times: Floats
    paths: Mapping[str, Floats]
    letters: Mapping[str, Sequence[LetterInterval]]
    todo: Todo
    tasks: Mapping[str, str]
    happened: Sequence[tuple[float, str]] = ()


def player_data(playing: Playing) -> dict[str, object]:
    """Return what `player.js` reads."""
    return {
        "robots": list(playing.paths),
        "paths": [[[round(float(v), 4) for v in row[:3]] for row in path] for path in playing.paths.values()],
        "step": float(playing.times[1] - playing.times[0]),
        "letters": [[[interval.start, _show(interval)] for interval in playing.letters[name]] for name in playing.paths],
        "todo": [[time, [list(part) for part in parts]] for time, parts in playing.todo],
        "happened": [list(event) for event in playing.happened],
    }


def player_section(playing: Playing, label: str, note: str) -> str:
    """Return the player's markup, with the place of the figure `scene`.

    Args:
        playing: What is shown.
        label: What the scene shows, for those who cannot see it.
        note: Likewise how to read it, for everybody.
    """
    robots = "".join(
        f'<dt><button type="button" aria-pressed="true"><i style="background:{robot_colour(index)}"></i>{html.escape(name)}</button></dt>'
        f'<dd class="visits">{html.escape(playing.tasks.get(name, ""))}</dd><dd class="letter" id="letter{index}"></dd>'
        for index, name in enumerate(playing.paths)
    )
    happened = '<div id="past" hidden><h3>Happened</h3><ul id="happened"></ul></div>' if playing.happened else ""
    speeds = "".join(
        f'<option value="{speed:g}"{" selected" if speed == 1 else ""}>{speed:g}x</option>' for speed in (0.5, 1, 2, 5)
    )
    return f"""<section aria-label="The flight">
<div class="player">
<button id="play" type="button">Play</button>
<input id="clock" type="range" min="0" max="{math.ceil(100 * playing.times[-1] - 1e-6) / 100:g}" step="0.01" value="0" aria-label="Mission time in seconds">
<output id="time">0.0 s</output>
<label>speed <select id="speed">{speeds}</select></label>
</div>
<div class="stage">
{figure_place("scene", label, scene=True)}
<div id="now"><h2>Now</h2><dl id="letters">{robots}</dl><h3>Still to do</h3><ul id="todo"></ul>{happened}</div>
</div>
<p class="note">{html.escape(note)}</p>
</section>"""


def _show(interval: LetterInterval) -> str:
    return show_letter(interval.letter) if interval.letter else "{} (in no region)"
