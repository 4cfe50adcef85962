"""`ltlplan fly RUN --link`: a certified mission flown live."""

from __future__ import annotations

import json as json_text
from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ltlplan.commands.support.links import (
    Asked,
    below_starts,
    controllers_said,
    flying_controllers,
    require_batteries,
    require_sense,
    simulated_robots,
    told_places,
    vehicles,
)
from ltlplan.commands.support.live_view import View, interrupts_land
from ltlplan.commands.support.onlookers import followed_services, seen_at, services
from ltlplan.commands.support.simulation import Outcome, certified, simulating, written
from ltlplan.output import write_texts
from verify.data.progress import part_of

if TYPE_CHECKING:
    from flight.condition_options import Said
    from flight.link.live_executive import LiveFlight
    from flight.link.phases import Stage
    from verify.data import Mission

FILES = ("poses.csv", "setpoints.csv", "live.csv", "live.json")
"""What a live flight writes."""

_MOST = 200_000_000
"""Bytes of a record that are read."""


def fly_over_link(source: str, out: Path | None, asked: Asked, said: Said, seed: int | None, *, json: bool) -> None:
    """Fly a certified mission over a link, and show how it ended.

    Args:
        source: A run's folder, a mission's file, or the name of a shipped mission.
        out: Folder for what was measured and asked; None writes nothing.
        asked: Which link, and where robots are.
        said: What simulated robots fly in and with.
        seed: Of every random number of theirs; None takes the plan's.
        json: One JSON document instead of text.

    Raises:
        NotCertified: The flight was not flown to its end inside the margin.
        Exit: It was interrupted, and landed.
        BadInput: A place or an address makes no sense.
        LinkLost: A robot cannot be reached.
    """
    from flight.link.live_executive import fly_live
    from ltlplan.live_phases import stages

    require_sense(asked, said)
    keep_record(out)
    mission = _mission(source)
    told, conditions = told_places(asked.places, mission), said.conditions(mission)
    with ExitStack() as opened:
        news = [opened.enter_context(closing(source)) for source in followed_services(asked.followed, mission.name)]
        with simulating(out, FILES, quiet=json) as progress:
            progress("reaching the robots", 0.0)  # before what takes its time: who is not there is said at once
            link = None if asked.kind == "simulated" else opened.enter_context(closing(vehicles(asked, mission, source)))
            batteries = require_batteries(asked, mission)
            plan, team, certificate = certified(source, part_of(progress, 0.1, 0.5))
            stand = {**below_starts(team), **told}
            flown = stages(plan, team, certificate, stand, progress=part_of(progress, 0.5, 0.9))
            progress("judging whether it can be broken off", 0.9)
            abort = _abort(asked.kind, flown)
        controllers = flying_controllers(asked.kind, mission, conditions)
        if not json:
            typer.echo(controllers_said(controllers, mission))
            typer.echo(abort)
            typer.echo(batteries, nl=bool(batteries))
        if link is None:
            seed = plan.seed if seed is None else seed
            link = opened.enter_context(closing(simulated_robots(mission, stand, conditions, seed, real_time=asked.real_time)))
        view = View(quiet=json)
        grounds = {name: place[2] for name, place in stand.items()}
        seen = seen_at(services(news), link, view.show, lambda: mission, hears=False)
        with interrupts_land() as heard, seen as (observed, operator):
            done = fly_live(observed, flown, grounds=grounds, operator=operator, unchecked=asked.unchecked)
    view.end()
    texts = flown_over(asked.kind, done.record.files(mission.frame))
    files = written(out, lambda folder: write_texts(texts, folder))
    outcome = _outcome(done, mission.name, link.failsafe, abort)
    outcome.data["controllers"] = controllers
    replace(outcome, interrupted=heard.code(done)).show(files, as_json=json)


def keep_record(out: Path | None) -> None:
    """Reject a folder with the record of a flight that vehicles flew: it cannot be flown again.

    Args:
        out: Folder to write; None writes nothing.

    Raises:
        BadInput: It holds such a record, or one that cannot be read.
    """
    from flight.storage.folders import FLOWN
    from verify.data import BadInput
    from verify.data.storage.safe_reading import parse_json, read_text

    if out is None or not (out / FLOWN).is_file():
        return
    about = parse_json(read_text(out / FLOWN, most=_MOST, what="record of a flight"), str(out / FLOWN))
    if not isinstance(about, dict) or about.get("link") != "simulated":
        raise BadInput(f"{out} holds the record of a live flight, which would be lost; name another folder with --out.")


def flown_over(kind: str, texts: Mapping[str, str]) -> dict[str, str]:
    """Return the files of a live flight, its record saying over which kind of link it was flown."""
    return {**texts, "live.json": json_text.dumps({"link": kind, **json_text.loads(texts["live.json"])}, indent=1) + "\n"}


def _abort(kind: str, flown: tuple[Stage, ...]) -> str:
    """Return what is proved of breaking the flight off, all stages checked."""
    from flight.link.phases import BRAKING
    from ltlplan.result import aborts_of

    if kind != "simulated":
        return "Abort not certified: what vehicles have on board brakes in a way of its own."
    verdicts = {stage.name: aborts_of(stage.plan.mission, stage.team, stage.certificate) for stage in flown}
    for stage in flown:
        if stage.braking:
            verdicts[BRAKING] = aborts_of(stage.world, stage.behind, stage.certificate)
    refused = [f"{name}: {verdict.sentence}" for name, verdict in verdicts.items() if not verdict]
    return " ".join(refused) or next(iter(verdicts.values())).sentence


def _mission(source: str) -> Mission:
    """Read the mission that is to be flown, without proving anything."""
    from ltlplan.missions import load_mission
    from verify.run_folder import mission_of

    folder = Path(source)
    return mission_of(folder) if folder.is_dir() else load_mission(source)


def _outcome(done: LiveFlight, mission: str, failsafe: str, abort: str) -> Outcome:
    lines = [
        *worst_lines(done),
        *_pauses(done),
        *(event.sentence for event in done.record.events if event.kind in ("alarm", "reaction")),
        f"On board when the link is gone: {failsafe}.",
    ]
    return Outcome(lines, {"mission": mission, "abort": abort, **data_of(done)}, refusal_of(done))


def worst_lines(done: LiveFlight) -> list[str]:
    """Return how far robots were from their plans at most, a line a stage.

    Args:
        done: The flight.
    """
    return [
        f"{stage}: " + ", ".join(f"{robot} at most {1000 * off:.1f} mm from its plan" for robot, off in worst.items())
        for stage, worst in done.record.worst.items()
    ]


def _pauses(done: LiveFlight) -> list[str]:
    """Return for how long the team hovered between parts, as `certify` is told it, s to the microsecond."""
    from flight.link.phases import FLIGHT

    pauses = done.record.pauses(FLIGHT)
    return [f"Between its parts the team hovered: --pauses {','.join(f'{each:.6f}' for each in pauses)}"] if pauses else []


def refusal_of(done: LiveFlight) -> str | None:
    """Return why a flight was ended; None where it was flown to its end.

    Args:
        done: The flight.
    """
    return None if done.flown else f"The flight was ended: {done.reason or 'not every robot is known to stand still'}"


def data_of(done: LiveFlight) -> dict[str, Any]:
    """Return how a live flight ended as plain data.

    Args:
        done: The flight.
    """
    return {
        "flown": done.flown,
        "reason": done.reason,
        "unsafe": list(done.unsafe),
        "worst": done.record.worst,
        "checks": [{"name": c.name, "robot": c.robot, "passed": c.passed, "sentence": c.sentence} for c in done.checks],
    }
