"""Everything that is seen of a flight in the page, as one JSON file of a job: the scene, what plays in it, and every claim.

It is made once, in the worker that proved (or refused) the flight, where all that it needs is at hand. The builders are those of
`ltlplan.report`, so that the page and the report show the same.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from flight.figures import Figure
from flight.pictures import robot_colour, scene
from ltlplan.report.charts import label_chart, truth_chart
from ltlplan.report.inline import figures_data
from ltlplan.report.player import player_data
from ltlplan.report.replay import Replay, replay_of
from ltlplan.report.run_page import BOUNDS, THIN
from ltlplan.report.summary import claim_rows
from ltlplan.service.problems import witness_data
from ltlplan.service.views.drawings import MOST_STATES, automaton_svg
from ltlplan.service.views.formulas import automaton_states, part_automata
from verify.certificate import proof_word
from verify.checked_claims import proof_sentences
from verify.data import LtlplanError

if TYPE_CHECKING:
    from flight import FlightLog
    from verify import Certificate, Claim, FlightVerdict
    from verify.data import Mission, Plan, Trajectory

NAME = "watch.json"
"""Its name among a job's files."""

FORMAT = 1

Json = dict[str, Any]  # of any type: JSON nests


def watch_json(plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate, log: FlightLog | None = None) -> bytes:
    """Return what the page shows of a flight, as JSON.

    Args:
        plan: What was planned; carries the mission.
        team: One trajectory a robot.
        certificate: What was proved of them, or refused, with its timelines.
        log: How they were flown in simulation, where they were.
    """
    mission = plan.mission
    replay = replay_of(plan, team, certificate)
    flown = None if log is None else {name: log.position[::THIN, i] for i, name in enumerate(log.robots)}
    waypoints = {name: [w.position for w in robot.waypoints] for name, robot in plan.robots.items()}
    figure = scene(mission, replay.playing.paths, flown=flown, waypoints=waypoints, margin=certificate.margin)
    formula = mission.spec.formula
    data: Json = {
        "format": FORMAT,
        "mission": mission.name,
        "holds": certificate.holds,
        "formula": formula or mission.sequence,
        "margin": certificate.margin,
        "largest_margin": certificate.largest_margin,
        "duration": certificate.duration,
        "digest": certificate.digest(),
        **drawn(figure),
        "player": player_data(replay.playing),
        "radii": radii(mission),
        "colours": [robot_colour(index) for index, _ in enumerate(mission.agents)],
        "tasks": dict(replay.playing.tasks),
        "end": replay.end,
        "bounds": BOUNDS if mission.timed_parts else "",
        "labels": label_chart(certificate, replay.playing.letters, replay.end, replay.cycle),
        "truth": ""
        if formula is None
        else truth_chart(mission, replay.playing.letters, replay.readings, replay.end, replay.cycle),
        "automata": automata_data(mission, replay),
        "claims": [
            {**row, **proof_word(claim)} for row, claim in zip(claims_data(certificate), certificate.claims, strict=True)
        ],
        "proof": list(proof_sentences(certificate.claims, certificate.kernel)),
        "tracking": None if log is None else {name: log.worst_error(name) for name in log.robots},
    }
    return json.dumps(data, allow_nan=False, separators=(",", ":")).encode()


def radii(mission: Mission) -> list[float]:
    """Return every robot's radius in m, in the order of the mission's agents."""
    return [mission.vehicle_of(robot).radius for robot in mission.agents]


def drawn(figure: Figure) -> Json:
    """Return a figure as what the page's scene reads: `traces` and `layout`."""
    data = figures_data({"scene": figure})
    shown: Any = data["figures"]
    traces: Any = data["traces"]
    places: list[int] = shown["scene"]["data"]
    return {"traces": [traces[place] for place in places], "layout": shown["scene"]["layout"]}


def automata_data(mission: Mission, replay: Replay | None = None) -> list[Json]:
    """Return the automata of a formula's parts: their text, drawing and, of a flight, their states over time.

    Args:
        mission: Whose formula it is.
        replay: What the automata read.
    """
    if mission.spec.formula is None:
        return []
    try:
        parts = part_automata(mission)
    except LtlplanError as error:
        return [{"part": mission.spec.formula, "note": str(error), "svg": None, "states": []}]
    letters = [] if replay is None else [(reading.time, reading.letter) for reading in replay.readings]
    found: list[Json] = []
    for part, automaton in parts:
        count = len(automaton.states)
        small = 0 < count <= MOST_STATES
        found.append(
            {
                "part": str(part) + (" (bounds in seconds left out)" if mission.timed_parts else ""),
                "svg": automaton_svg(automaton) if small else None,
                "note": "" if small else f"{count} states, too many to draw here; `ltlplan automaton` writes them all.",
                "states": [[time, list(states)] for time, states in automaton_states(automaton, letters)] if small else [],
                "accepting": sorted(automaton.accepting),
            }
        )
    return found


def claims_data(certificate: Certificate | FlightVerdict) -> list[Json]:
    """Return every claim as plain data, each with its row of text as the command line shows it."""
    rows = claim_rows(certificate)
    return [_claim_data(claim, row) for claim, row in zip(certificate.claims, rows, strict=True)]


def _claim_data(claim: Claim, row: tuple[str, ...]) -> Json:
    room = None if claim.margin is None else claim.margin / abs(claim.limit) if claim.limit else claim.margin
    return {
        "name": claim.name,
        "robot": claim.robot,
        "other": claim.other,
        "outcome": claim.outcome,
        "sentence": claim.sentence,
        "time": _finite(claim.time),
        "room": _finite(room),
        "row": list(row),
        "witness": None if claim.witness is None else witness_data(claim.witness),
    }


def _finite(number: float | None) -> float | None:
    return number if number is not None and math.isfinite(number) else None
