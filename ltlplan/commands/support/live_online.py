"""`ltlplan online --link`: tasks shared while a team flies over a link, in real time."""

from __future__ import annotations

import json as json_text
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ltlplan.commands.support.followed import followed
from ltlplan.commands.support.links import (
    Asked,
    below_starts,
    controllers_said,
    flying_controllers,
    places_of,
    require_batteries,
    require_sense,
    simulated_robots,
    told_places,
    vehicles,
)
from ltlplan.commands.support.live_flight import (
    FILES,
    data_of,
    flown_over,
    keep_record,
    refusal_of,
    worst_lines,
)
from ltlplan.commands.support.live_view import View, interrupts_land
from ltlplan.commands.support.onlookers import seen_at, services
from ltlplan.commands.support.simulation import Outcome, simulating, written
from ltlplan.online.event_sources.lines import parse_events
from ltlplan.output import write_texts
from verify.data import BadInput
from verify.data.progress import part_of

if TYPE_CHECKING:
    from flight.condition_options import Said
    from flight.link.live_executive import LiveFlight
    from ltlplan.online.live.live_online_flight import OnlineCourse
    from ltlplan.online.online_flight import OnlineFlight
    from verify.data import Mission


@dataclass(frozen=True, slots=True)
class Happening:
    """Event of an online flight.

    Attributes:
        events: As `--event`.
        followed: As `--follow`.
        standby: As `--standby`.
    """

    events: tuple[str, ...]
    followed: tuple[str, ...]
    standby: tuple[str, ...] = ()


def online_over_link(mission: Mission, out: Path | None, asked: Asked, said: Said, happening: Happening, *, json: bool) -> None:
    """Fly a mission online over a link, and show how it ended.

    Args:
        mission: What is asked, with its seed.
        out: Folder for what was measured, asked and proved; None writes nothing.
        asked: Which link, and where robots are.
        said: What simulated robots fly in and with.
        happening: What happens.
        json: One JSON document instead of text.

    Raises:
        NotCertified: The flight was ended, or what was flown does not keep the formula.
        BadInput: A place, an address or an event makes no sense.
        LinkLost: A robot cannot be reached.
        DoesNotFit: The mission has places that vehicles cannot be sent.
    """
    from flight.certificate_checks import require_tube
    from flight.link.live_executive import fly_live
    from ltlplan.online.event_queue import Happenings, checked_events
    from ltlplan.online.files import ONLINE_FILES
    from ltlplan.online.live.live_online_flight import OnlineCourse
    from ltlplan.online.segments.certified_team import CertifiedTeam
    from ltlplan.online.standby import standby_of
    from ltlplan.service.execution.background_executor import Beside
    from ltlplan.transfers import to_starts

    require_sense(asked, said)
    keep_record(out)
    require_tube(mission.margin)
    told, events = told_places(asked.places, mission), parse_events(happening.events)
    standby = standby_of(mission, places_of("--standby", happening.standby, mission), events)
    events = checked_events(mission, events, standby)
    standby.require_out_of_reach(mission)
    everybody = standby.beside(mission)
    with ExitStack() as opened:
        news = [opened.enter_context(closing(followed(name, mission.name))) for name in happening.followed]
        with simulating(out, (*ONLINE_FILES, *FILES), quiet=json) as progress:
            progress("reaching the robots", 0.0)
            link = (
                None
                if asked.kind == "simulated"
                else opened.enter_context(closing(vehicles(asked, everybody, flown="from here")))
            )
            batteries = require_batteries(asked, everybody)
            progress("planning and proving what is asked", 0.1)
            team = CertifiedTeam(mission, seed=mission.planner.seed)
            assert team.present is not None, "it was certified"
            stand, cost = {**below_starts(team.present.team), **told}, team.cost
            before = to_starts(standby.solid(mission), team.present.team, stand, progress=part_of(progress, 0.3, 0.7))
            stand |= standby.places
            progress("making ready who computes beside the flight", 0.7)
            happenings = Happenings(events, lambda: [event for each in news for event in each()])
            course = OnlineCourse(team, Beside(), stand, happenings, standby)
        if link is None:
            robots = simulated_robots(everybody, stand, said.conditions(mission), mission.planner.seed, real_time=True)
            link = opened.enter_context(closing(robots))
        if not json:
            typer.echo(batteries, nl=bool(batteries))
            flown = flying_controllers(asked.kind, everybody, said.conditions(everybody))
            typer.echo(controllers_said(flown, everybody, streamed=asked.kind != "simulated"))
        view, grounds = View(quiet=json), {name: place[2] for name, place in stand.items()}
        seen = seen_at(services(news), link, view.show, lambda: course.team.mission, hears=True)
        with interrupts_land() as heard, seen as (observed, operator):
            done = fly_live(
                observed,
                [transfer.stage for transfer in before],
                grounds=grounds,
                operator=operator,
                onwards=course,
                unchecked=asked.unchecked,
            )
    view.end()
    files, outcome = _kept(course, done, cost, out, kind=asked.kind, failsafe=link.failsafe)
    replace(outcome, interrupted=heard.code(done)).show(files, as_json=json)


def _kept(
    course: OnlineCourse, done: LiveFlight, planned_cost: float, out: Path | None, *, kind: str, failsafe: str
) -> tuple[tuple[Path, ...], Outcome]:
    """Check what was flown and write it; return the files, and what is shown of how it ended."""
    from ltlplan.online.files import write_online
    from ltlplan.online.live.measured_result import flown_live

    mission = course.team.mission
    flown = None
    with suppress(BadInput):  # it never began, or ended at once
        flown = flown_live(course, done, planned_cost=planned_cost)
    outcome = _outcome(course, done, flown, failsafe)
    texts = flown_over(kind, done.record.files(mission.frame))
    texts["live.json"] = json_text.dumps({**json_text.loads(texts["live.json"]), "answers": _answers(course)}, indent=1) + "\n"

    def write(folder: Path) -> None:
        write_texts(texts, folder)
        if flown is not None:
            write_online(flown, outcome.lines, folder)

    return written(out, write), outcome


def _answers(course: OnlineCourse) -> list[dict[str, object]]:
    """Return how long each event was answered in, s, as plain data."""
    return [
        {"event": str(a.event), "time": a.event.time, "stop": a.stop, "proved": a.proved, "begun": a.begun}
        for a in course.answered
    ]


def _outcome(course: OnlineCourse, done: LiveFlight, flown: OnlineFlight | None, failsafe: str) -> Outcome:
    lines = [f"On board when the link is gone: {failsafe}.", *worst_lines(done)]
    for entry in course.answered:
        said = [
            f"{what} after {seconds:.2f} s"
            for what, seconds in (
                ("a way to come to rest was proved", entry.stop),
                ("the next piece", entry.proved),
                ("it began", entry.begun),
            )
            if seconds is not None
        ]
        lines.append(f"{entry.event.time:.2f} s: {entry.event}: {', '.join(said) or 'nothing was proved'}.")
    lines += [event.sentence for event in done.record.events if event.kind in ("alarm", "reaction")]
    data = {"mission": course.team.mission.name, "answers": _answers(course), **data_of(done)}
    refusal = refusal_of(done)
    if flown is not None:
        lines += [f"{name}: {_text(word)}" for name, word in flown.words.items()]
        lines.append(flown.summary())
        data |= {
            "duration": flown.duration,
            "satisfied_at": flown.satisfied_at,
            "verdict": flown.verdict.outcome,
            "sentence": flown.verdict.sentence,
            "certified": flown.certified,
            "certificates": list(flown.certificates),
        }
        if refusal is None and not flown.verdict:
            refusal = f"The flown words do not keep the formula: {flown.verdict.sentence}"
    return Outcome(lines, data, refusal)


def _text(word: tuple[frozenset[str], ...]) -> str:
    return " ".join("{" + ", ".join(sorted(letter)) + "}" for letter in word)
