"""The whole way from a mission to files: here a plan is made, refined, and judged until it is certified.

    mission - plan - trajectories - certificate - flight - files

Every arrow is a function from one frozen value to the next. Between plan and certificate stands one counterexample-guided loop
(`certified_team`): each candidate is refined and judged (`attempted`), and what is refused of it becomes a cut that the next one keeps
(`candidates`), a handful of times at most.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ltlplan.allocation import Known
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.paths.costs import with_flown_times
from ltlplan.planner import with_pace
from ltlplan.replanning.alternatives import candidates, no_flight
from ltlplan.replanning.checked_plan import Asked, as_mission, plan
from ltlplan.replanning.cuts import MAX_ROUNDS, Candidate, Certified, Conflict, Cut, Flight
from ltlplan.result import Result
from verify.data import DoesNotFit, Infeasible, LtlplanError, Mission, NotCertified, Plan, Trajectory, check_plan
from verify.data.progress import Progress, part_of, silent
from verify.data.trajectory import MAX_PIECES

if TYPE_CHECKING:
    from flight.processes import Workers
    from refine.single_robot.task import Effort

__all__ = [
    "MAX_ROUNDS",
    "Asked",
    "Candidate",
    "Certified",
    "Conflict",
    "Cut",
    "Flight",
    "as_mission",
    "attempted",
    "candidates",
    "certified_team",
    "fits_margin",
    "no_flight",
    "plan",
    "refitted",
    "run",
]

_FITTINGS = 3
"""Flights that are tried, at most, for a margin that fits its proof."""


def certified_team(
    made: Plan,
    *,
    margin: float | None = None,
    progress: Progress | None = None,
    effort: Effort = "full",
    budget: Budget = DEFAULT_BUDGET,
) -> Certified:
    """Refine a plan until its trajectories are certified.

    Args:
        made: The plan.
        margin: Margin to prove, in m, instead of the mission's.
        progress: Told a sentence and the share done, 0 to 1.
        effort: How hard fastest flights are looked for, as `refine.refine` takes it.
        budget: Bounds on the searches for other plans.

    Raises:
        BadInput: The plan or its mission is not sound.
        Infeasible: Refinement found no trajectory within the limits.
        NotCertified: The last of a handful of rounds was still refused; carries the witnesses.
    """
    refused: list[Flight | Conflict] = []
    first = candidate = Candidate(check_plan(made))
    certified = None
    for candidate in candidates(first, refused, budget):
        step = min(candidate.rounds, MAX_ROUNDS - 1) / MAX_ROUNDS  # more rounds are rare
        found = attempted(candidate, margin=margin, progress=part_of(progress, step, step + 1 / MAX_ROUNDS), effort=effort)
        certified = candidate.better_of(found)
        refused.append(found)
    if certified is None:
        raise no_flight(candidate, refused[-1])
    return certified


def attempted(
    candidate: Candidate, *, margin: float | None = None, progress: Progress | None = None, effort: Effort = "full"
) -> Flight | Conflict:
    """Refine once and judge.

    Args:
        candidate: The plan, and what was refused before.
        margin: Margin to prove, in m, instead of the mission's.
        progress: Told a sentence and the share of this round done, 0 to 1.
        effort: As for `certified_team`.

    Raises:
        BadInput: The plan or its mission is not sound.
    """
    import verify

    say, number = progress or silent, candidate.rounds + 1
    again = "" if number == 1 else f", round {number}"

    def refining(sentence: str, share: float) -> None:
        say(f"refining{again}: {sentence}", share / 2)

    refining("one flight for each robot", 0.0)
    try:
        plan, team = _refined(candidate, effort, refining)
    except (Infeasible, DoesNotFit) as error:
        return Conflict(error)
    say(f"proving{again}", 0.5)
    return Flight(plan, team, verify.judge(plan, team, margin=margin))


def _refined(candidate: Candidate, effort: Effort, refining: Progress) -> tuple[Plan, dict[str, Trajectory]]:
    """Return one trajectory a robot, and the plan with a note on flights that are cut into parts for a vehicle's memory."""
    import refine

    plan, witnesses, pace = candidate.plan, candidate.witnesses, candidate.pace
    notes: list[str] = []
    refined = partial(refine.refine, plan, witnesses=witnesses, pace=pace, note=notes.append, progress=refining, effort=effort)
    if plan.mission.timed_parts:  # between parts a team hovers for any time, which no bound in seconds allows
        team = refined(max_pieces=MAX_PIECES)
        longer = [name for name, path in team.items() if len(path) > (plan.mission.limits_of(name).pieces or MAX_PIECES)]
        why = (
            "flies more pieces than its vehicle holds, and parts would pause for any time, which bounds in seconds do not allow"
        )
        notes += [f"{longer[0]} {why}; stream them (px4, ros2)."] if longer else []
        return with_flown_times(plan.noting(*notes), team), team
    try:
        team = refined(too_long="rest")
        return _with_parts(with_flown_times(plan.noting(*notes), team), team), team
    except DoesNotFit as error:
        refining("leaving the flight whole, to be streamed", 0.0)
        notes = [f"The flight is longer than its vehicles hold, and no parts of it were found: stream it (px4, ros2). {error}"]
        team = refined(max_pieces=MAX_PIECES)
        return with_flown_times(plan.noting(*notes), team), team


def _with_parts(made: Plan, team: Mapping[str, Trajectory]) -> Plan:
    """Return a plan with a note on flights that are uploaded in parts."""
    laps = made.mission.spec.repeat
    parts = {name: len(path.parts) for name, path in team.items() if path.cuts}
    if not parts:
        return made
    name = max(parts, key=lambda each: len(team[each]))
    path = team[name]
    held, flown = made.mission.limits_of(name).pieces, len(path.flattened(laps))
    again = f", the lap once for all {laps} laps" if path.cycle is not None and laps > 1 else ""
    said = (
        f"{name} flies {flown} pieces, and its vehicle holds {held}: the flight is uploaded in {parts[name]} parts{again}, one after another, "
        "while all robots rest."
    )
    return made.noting(said)


def _certified(mission: Mission, planned: Callable[..., Plan], progress: Progress, budget: Budget) -> Certified:
    """Plan, refine and certify, with the margin that the mission states or with one that is fitted.

    Args:
        mission: What is asked.
        planned: Plans a mission.
        progress: Told a sentence and the share done, 0 to 1.
        budget: Bounds on the searches for other plans.
    """
    first = 1 / _FITTINGS if fits_margin(mission) else 1.0
    found = _tried(mission, planned, part_of(progress, 0.0, first), budget)
    if fits_margin(mission):
        found = refitted(found, mission, planned, part_of(progress, first, 1.0), budget)
    if isinstance(found, LtlplanError):
        raise found
    return found


def _tried(mission: Mission, planned: Callable[..., Plan], progress: Progress, budget: Budget) -> Certified | LtlplanError:
    """Plan, refine and certify at one margin; a refusal is returned."""
    made = planned(mission, progress=part_of(progress, 0.0, 0.36))
    try:
        return certified_team(made, progress=part_of(progress, 0.36, 1.0), budget=budget)
    except NotCertified as error:
        return error


def fits_margin(mission: Mission) -> bool:
    """Return whether a mission's margin is taken from the proof of tracking.

    Args:
        mission: As it was read.
    """
    return mission.disturbance is not None and mission.disturbance.fitted


def refitted(
    found: Certified | LtlplanError, mission: Mission, planned: Callable[..., Plan], progress: Progress, budget: Budget
) -> Certified | LtlplanError:
    """Return the flight of the smallest margin that the proof of tracking allows, as far as a few flights tell; else the last refusal.

    Args:
        found: What came of the mission's own margin.
        mission: With that margin.
        planned: Plans a mission.
        progress: Told a sentence and the share done, 0 to 1.
        budget: Bounds on the searches for other plans.
    """
    best, more = found, _FITTINGS - 1
    for number in range(more):
        if isinstance(found, LtlplanError):
            witnesses = found.witnesses if isinstance(found, NotCertified) else ()
            bounds = [witness.bound for witness in witnesses if witness.claim == "tracking"]
        else:
            bounds = [claim.bound for claim in found.certificate.claims if claim.name == "tracking"]
        known = [bound for bound in bounds if bound is not None]
        if not known or len(known) < len(bounds):
            break
        margin = math.ceil(1000.0 * max(known)) / 1000.0
        if margin == mission.margin or (not isinstance(best, LtlplanError) and margin >= best.certificate.margin):
            break
        mission = mission.changed(margin=margin)
        found = _tried(mission, planned, part_of(progress, number / more, (number + 1) / more), budget)
        if isinstance(best, LtlplanError) or not isinstance(found, LtlplanError):
            best = found
    if isinstance(found, LtlplanError) and not isinstance(best, LtlplanError):
        return _kept(best, f"{1000 * mission.margin:g} mm", found)
    return best


def _kept(best: Certified, margin: str, refusal: LtlplanError) -> Certified:
    """Return a flight with a note on the margin that was tried beside its own."""
    import verify

    why = str(refusal).removeprefix("Not certified. ")
    plan = best.plan.noting(f"A margin of {margin}, which the proof of tracking allows of this flight, was refused: {why}")
    return replace(best, plan=plan, certificate=verify.judge(plan, best.team))


def run(
    mission: Asked,
    out: str | Path | None = None,
    *,
    seed: int | None = None,
    pace: float | str | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
    budget: Budget = DEFAULT_BUDGET,
) -> Result:
    """Plan, refine, certify, fly in simulation and, where `out` is given, write all files.

    Args:
        mission: What is asked: a mission, or the path or name that `load_mission` reads one by.
        out: Folder to write, whole or not at all; what in it is not as an earlier run left it is kept, or refused.
        seed: Source of every draw, instead of the mission's own.
        pace: Instead of `planner.pace`: a share of the fastest flight, above 0 up to 1, or "nominal".
        progress: Told a sentence and the share done, 0 to 1.
        workers: Who improves robots' paths side by side; None does it here. The bytes do not depend on it.
        budget: Bounds on the searches for words; a watch in it can end them at the best plan so far.

    Raises:
        BadInput: There is no such mission, its file is at fault, or its margin is 0, which leaves no tube to fly in.
        LtlplanError: Any of the stages refused; the class says which and the message why.
    """
    import flight
    from flight.storage.folders import check_folder
    from ltlplan import output
    from ltlplan.following import followed

    mission = with_pace(as_mission(mission), pace)
    files = () if out is None else output.run_files(mission)
    flight.require_tube(mission.margin)
    conditions = flight.conditions_of(mission)  # whom nobody knows would not be found before the flight
    target = None if out is None else check_folder(out, files)
    planned = partial(plan, seed=seed, workers=workers, known=Known(budget=budget))
    done = _certified(mission, planned, part_of(progress, 0.0, 0.7), budget)
    say = part_of(progress, 0.7, 0.9)
    say("flying in simulation", 0.0)
    done, log = followed(done, attempted, seed=done.plan.seed, conditions=conditions, progress=say, budget=budget)
    result = Result(done.plan.mission, done.plan, done.team, done.certificate, log, done.rounds)
    if target is None:
        return result
    part_of(progress, 0.9, 1.0)("writing files", 0.0)
    return output.write_run(result, target)
