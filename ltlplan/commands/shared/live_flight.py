"""`ltlplan fly RUN --link`: a certified mission flown live."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ltlplan.commands.shared.live_view import View, sigterm_interrupts
from ltlplan.commands.shared.simulation import Outcome, certified, simulating, written
from verify.data import BadInput
from verify.data.events import unknown
from verify.data.progress import part_of

if TYPE_CHECKING:
    from flight import Conditions
    from flight.link.live import LiveFlight
    from ltlplan.transfers import Place
    from verify.data import Mission, Trajectory

FILES = ("poses.csv", "setpoints.csv", "live.csv", "live.json")
"""What a live flight writes."""


def fly_over_simulated_link(
    source: str, out: Path | None, conditions: Conditions, seed: int | None, *, places: list[str], real_time: bool, json: bool
) -> None:  # as many as the command's options that matter here
    """Fly a certified mission over a link to the simulation, and show how it ended.

    Args:
        source: A run's folder, a mission's file, or the name of a shipped mission.
        out: Folder for what was measured and asked; None writes nothing.
        conditions: What it flies in and with.
        seed: Of every random number; None takes the plan's.
        places: `NAME=x,y,z`, where robots stand.
        real_time: Whether a second takes a second.
        json: One JSON document instead of text.

    Raises:
        NotCertified: The flight was not flown to its end inside the margin.
        BadInput: A place makes no sense.
    """
    from flight.link.live import fly_live
    from flight.link.simulated import SimulatedLink
    from ltlplan.live import stages

    with simulating(out, FILES, quiet=json) as progress:
        plan, team, certificate = certified(source, part_of(progress, 0.0, 0.5))
        stand = _places(places, plan.mission, team)
        flown = stages(plan, team, certificate, stand, progress=part_of(progress, 0.5, 1.0))
    link = SimulatedLink(
        plan.mission, stand, conditions=conditions, seed=plan.seed if seed is None else seed, real_time=real_time
    )
    view = View(quiet=json)
    with sigterm_interrupts():
        done = fly_live(link, flown, grounds={name: place[2] for name, place in stand.items()}, show=view.show)
    view.end()
    texts = done.record.files()

    def write(folder: Path) -> None:
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")

    files = written(out, write)
    _outcome(done, plan.mission.name, link.failsafe).show(files, as_json=json)


def _places(texts: list[str], mission: Mission, team: dict[str, Trajectory]) -> dict[str, Place]:
    """Return where robots stand: as said, or at z = 0 below their starts."""
    found: dict[str, Place] = {}
    for name, path in team.items():
        x, y, _ = path.evaluate(0.0)[:3].tolist()
        found[name] = (x, y, 0.0)
    for text in texts:
        name, _, numbers = text.partition("=")
        if name not in mission.agents:
            raise BadInput(f"--place {text}: {unknown(name, 'robot of the mission', mission.agents)}")
        try:
            x, y, z = (float(part) for part in numbers.split(","))
        except ValueError:
            raise BadInput(f"--place {text}: write NAME=x,y,z in m, such as {name}=0.5,-1,0.") from None
        found[name] = (x, y, z)
    return found


def _outcome(done: LiveFlight, mission: str, failsafe: str) -> Outcome:
    lines = [
        f"{stage}: " + ", ".join(f"{robot} at most {1000 * off:.1f} mm from its plan" for robot, off in worst.items())
        for stage, worst in done.record.worst.items()
    ]
    lines += [event.sentence for event in done.record.events if event.kind in ("alarm", "reaction")]
    lines.append(f"On board when the link is gone: {failsafe}.")
    refusal = None if done.flown else f"The flight was ended: {done.reason or 'not every robot is known to stand still'}"
    data = {
        "mission": mission,
        "flown": done.flown,
        "reason": done.reason,
        "unsafe": list(done.unsafe),
        "worst": done.record.worst,
        "checks": [{"name": c.name, "robot": c.robot, "passed": c.passed, "sentence": c.sentence} for c in done.checks],
    }
    return Outcome(lines, data, refusal)
