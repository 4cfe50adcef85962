"""The whole way from a mission to files: here a plan is made, refined, and judged until it is certified.

    mission - plan - trajectories - certificate - flight - files

Every arrow is a function from one frozen value to the next. A refused certificate goes back to refinement with
its witnesses, a handful of times at most.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ltlplan.missions import load_mission
from ltlplan.planner import SEQUENCE, make_plan
from ltlplan.precedences import with_planned_waits, with_waits
from ltlplan.result import Result
from verify.data import (
    BadInput,
    DoesNotFit,
    Infeasible,
    InternalError,
    Mission,
    NotCertified,
    Plan,
    Trajectory,
    Unsatisfiable,
    Witness,
    check_mission,
    check_plan,
)
from verify.data.choices import PLANNING_METHODS
from verify.data.progress import Progress, part_of, silent
from verify.data.trajectory import MAX_PIECES

if TYPE_CHECKING:
    from flight.processes import Workers
    from ltlplan.allocation import PlanningMethod
    from verify import Certificate, Claim

Asked = Mission | str | os.PathLike[str]

MAX_ROUNDS = 6
"""How often refinement may try to mend what the checker refused."""


def plan(
    mission: Asked,
    *,
    method: PlanningMethod | str | None = None,
    seed: int | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
) -> Plan:
    """Plan a mission and check the planned words, as words.

    Args:
        mission: What is asked: a mission, or the path or name that `load_mission` reads one by.
        method: Planning method, as a function or by its name, instead of the mission's own.
        seed: Source of every draw, instead of the mission's own.
        progress: Told a sentence and the share done, 0 to 1.
        workers: Who improves robots' paths side by side; None does it here. The plan does not depend on it.

    Raises:
        BadInput: There is no such mission, or its file is at fault.
        Unsatisfiable: No word that these robots can fly satisfies the formula.
        Infeasible: A word exists, but no way between the hoops was found.
        NotCertified: The sequence, or the words of a method of another package, break the formula.
        InternalError: The words of one of our methods fail in the checker.
    """
    from verify import check_team, check_word
    from verify.words.planned_order import check_planned_order

    mission = as_mission(mission)
    if mission.soft_parts and mission.passages is None:
        from ltlplan.soft_parts import plan_with_soft_parts

        def planned(asked: Mission, say: Progress) -> Plan:
            return plan(asked, method=method, seed=seed, progress=say)

        return plan_with_soft_parts(mission, planned, progress or silent)
    made = make_plan(mission, method=method, seed=seed, progress=progress, workers=workers)
    words = made.words
    if mission.spec.trace == "infinite" and len(words) > 1:
        return made  # its words are laps that begin together, which the certificate proves of the flight
    if mission.spec.trace == "infinite":
        (word,) = words.values()
        verdict = check_word(mission.formula, word.prefix, word.cycle)
    elif made.precedences or made.meetings:
        verdict = check_planned_order(made)
        if verdict.outcome == "undecided":
            doubt = f"That the words hold when robots wait for each other so is proved of the flight alone: {verdict.sentence}"
            made = made.model_copy(update={"notes": (*made.notes, doubt)})
    else:
        verdict = check_team(mission.formula, words, reading=mission.spec.team).sequential
    if verdict.outcome == "fails" and made.method == SEQUENCE:
        raise NotCertified(f"The sequence breaks the formula: {verdict.sentence}")
    if verdict.outcome == "fails" and (method is None or isinstance(method, str)) and made.method in PLANNING_METHODS.built_in:
        raise InternalError(f"The planner's words fail in the checker: {verdict.sentence}")
    if verdict.outcome == "fails":
        raise NotCertified(f"The words of the planning method '{made.method}' break the formula: {verdict.sentence}")
    vacuous = tuple(f"Holds only vacuously: {part}" for part in verdict.vacuous)
    return made.model_copy(update={"notes": (*made.notes, *vacuous)}) if vacuous else made


def as_mission(mission: Asked) -> Mission:
    """Return the mission that an argument means.

    Raises:
        BadInput: It means none, or one that is not allowed; all faults are listed.
    """
    if isinstance(mission, Mission):
        return check_mission(mission)
    if not isinstance(mission, str | os.PathLike):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers may not check
        raise BadInput(f"A mission is a Mission, a path, or the name of a shipped mission, not {type(mission).__name__}.")
    return load_mission(mission)


@dataclass(frozen=True)
class Draft:
    """A plan that is not certified yet, with what the judge refused of it so far.

    Attributes:
        plan: With the precedences that the refusals asked for.
        rounds: How many times refinement ran.
        witnesses: Of all claims that were refused, in all rounds.
        certified: What is certified already, while refinement tries to keep more of the planned soft parts.
        begun: Rounds that were spent on plans that keep more soft parts, and that no flight kept.
        fewer: Missions with fewer soft parts, to be planned next where this plan is not certified; None before that was asked.
        reworded: How many other ways to keep the soft parts were tried, of `_WAYS`.
    """

    plan: Plan
    rounds: int = 0
    witnesses: tuple[Witness, ...] = ()
    certified: Certified | None = None
    begun: int = 0
    fewer: tuple[Mission, ...] | None = None
    reworded: int = 0

    @property
    def last_round(self) -> int:
        """After how many rounds this plan is given up: a handful, two where plans with fewer soft parts are left."""
        return self.begun + (2 if self.fewer else MAX_ROUNDS)


@dataclass(frozen=True)
class Refused:
    """A team that was refined and not certified.

    Attributes:
        draft: What was refined.
        team: One trajectory a robot.
        certificate: What the judge said of them.
        instead: What may keep more of the soft parts, where only these are missed.
    """

    draft: Draft
    team: dict[str, Trajectory]
    certificate: Certificate
    instead: Draft | None = None

    @property
    def rounds(self) -> int:
        """How many times refinement ran."""
        return self.draft.rounds + 1

    @property
    def claims(self) -> tuple[Claim, ...]:
        """The claims that were refused."""
        return tuple(claim for claim in self.certificate.claims if claim.outcome != "holds")


@dataclass(frozen=True)
class Certified:
    """A team that is certified.

    Attributes:
        plan: With the precedences that the proof asked for.
        team: One trajectory a robot.
        certificate: The proof.
        rounds: How many times refinement ran.
    """

    plan: Plan
    team: dict[str, Trajectory]
    certificate: Certificate
    rounds: int


def certified_team(made: Plan, *, margin: float | None = None, progress: Progress | None = None) -> Certified:
    """Refine a plan until its trajectories are certified.

    Args:
        made: The plan.
        margin: Margin to prove, in m, instead of the mission's.
        progress: Told a sentence and the share done, 0 to 1.

    Raises:
        BadInput: The plan or its mission is not sound.
        Infeasible: Refinement found no trajectory within the limits.
        NotCertified: The last of a handful of rounds was still refused; carries the witnesses.
    """
    draft = Draft(check_plan(made))
    while True:
        number = draft.rounds
        step = min(number, MAX_ROUNDS - 1) / MAX_ROUNDS  # more rounds are rare: see `Draft.fewer`
        found = next_round(draft, margin=margin, progress=part_of(progress, step, step + 1 / MAX_ROUNDS))
        if isinstance(found, Certified):
            return found
        draft = mended(found)


def next_round(draft: Draft, *, margin: float | None = None, progress: Progress | None = None) -> Certified | Refused:
    """Refine once and judge.

    Args:
        draft: The plan, and what was refused before.
        margin: Margin to prove, in m, instead of the mission's.
        progress: Told a sentence and the share of this round done, 0 to 1.

    Raises:
        BadInput: The plan or its mission is not sound.
        Infeasible: Refinement found no trajectory within the limits.
    """
    import verify

    say, number = progress or silent, draft.rounds + 1
    again = "" if number == 1 else f", round {number}"

    def refining(sentence: str, share: float) -> None:
        say(f"refining{again}: {sentence}", share / 2)

    before = None if draft.certified is None else replace(draft.certified, rounds=number)
    refining("one flight for each robot", 0.0)
    try:
        draft, team = _refined(draft, refining)
    except (Infeasible, DoesNotFit) as error:
        if before is not None:
            return before
        other = _without_this_flight(replace(draft, rounds=number), str(error))
        if other is None:
            raise
        return next_round(replace(other, rounds=draft.rounds), margin=margin, progress=progress)
    say(f"proving{again}", 0.5)
    certificate = verify.judge(draft.plan, team, margin=margin)
    if not certificate.holds:
        return before or Refused(draft, team, certificate)
    done = Certified(draft.plan, team, certificate, number)
    if before is not None and before.certificate.soft_weight >= certificate.soft_weight:
        done = before
    refused = Refused(replace(draft, certified=done), team, certificate)
    instead = None if number >= draft.last_round else _for_soft_parts(refused)
    return done if instead is None else replace(refused, instead=instead)


def _refined(draft: Draft, refining: Progress) -> tuple[Draft, dict[str, Trajectory]]:
    """Return one trajectory a robot, and the draft with a note on flights that are cut into parts for a vehicle's memory."""
    import refine

    try:
        return draft, refine.refine(draft.plan, witnesses=draft.witnesses, progress=refining)
    except DoesNotFit:
        refining("letting robots rest on their long ways, where flights are cut for their vehicles' memories", 0.0)
    try:
        team = refine.refine(draft.plan, witnesses=draft.witnesses, too_long="rest", progress=refining)
        return replace(draft, plan=_with_parts(draft.plan, team)), team
    except (DoesNotFit, Infeasible) as error:
        refining("leaving the flight whole, to be streamed", 0.0)
        team = refine.refine(draft.plan, witnesses=draft.witnesses, max_pieces=MAX_PIECES, progress=refining)
        said = f"The flight is longer than its vehicles hold, and no parts of it were found: stream it (px4, ros2). {error}"
        notes = tuple(dict.fromkeys((*draft.plan.notes, said)))
        return replace(draft, plan=draft.plan.model_copy(update={"notes": notes})), team


def _without_this_flight(draft: Draft, why: str) -> Draft | None:
    """Return other words for the same soft parts, or for fewer of them, in the place of a plan that no flight keeps; None where there are none."""
    made = draft.plan
    if not made.mission.soft_parts or made.method == SEQUENCE or not PLANNING_METHODS.knows(made.method):
        return None
    other = None if draft.reworded == _WAYS or draft.fewer is not None else _other_words_for_soft_parts(made)
    if other is not None:
        return Draft(other, draft.rounds, begun=draft.rounds, reworded=_WAYS)
    return _with_fewer_soft_parts(draft, why)


def _with_fewer_soft_parts(draft: Draft, why: str) -> Draft | None:
    from ltlplan.soft_parts import less_wished, part_text

    made = draft.plan
    fewer = tuple(less_wished(made)) if draft.fewer is None else draft.fewer
    if not fewer:
        return None
    other = plan(fewer[0], method=made.method)
    lost = " and ".join(part_text(part) for part in made.mission.soft_parts if part not in fewer[0].soft_parts)
    notes = (
        *other.notes,
        f"Given up: {lost}; a plan that keeps more, at a cost of {made.cost:.3f} in all, has no flight that is certified.",
        f"A plan that keeps more of the soft parts was given up: {why}",
    )
    return Draft(
        other.model_copy(update={"mission": made.mission, "notes": notes}), draft.rounds, begun=draft.rounds, fewer=fewer[1:]
    )


_WAYS = 2
"""Ways beyond waits to keep soft parts: the same words under precedences, and other words."""


def _for_soft_parts(refused: Refused) -> Draft | None:
    """Return what may keep soft parts which the words keep and the flight may not: waits, precedences, other words; None where nothing may."""
    from ltlplan.soft_parts import kept_by_plan, same_words_under_precedences

    draft, made = refused.draft, refused.draft.plan
    lost = [part.outcome != "holds" for part in refused.certificate.soft]
    laps = made.mission.spec.trace == "infinite" and len(made.robots) > 1  # in which no waits are known that would help
    if not any(lost) or made.method == SEQUENCE or laps:
        return None
    meant = range(len(lost)) if made.meetings else kept_by_plan(made.mission, made)
    witnesses = [p.witness for i, p in enumerate(refused.certificate.soft) if lost[i] and i in meant and p.witness is not None]
    if not witnesses:
        return None  # these parts were not meant to be kept
    with contextlib.suppress(NotCertified):  # the waits go round in a circle
        waiting = with_waits(made, witnesses)
        if waiting.precedences != made.precedences:
            return replace(draft, plan=waiting, rounds=refused.rounds)
    for way in range(draft.reworded, _WAYS):
        other = same_words_under_precedences(made) if way == 0 else _other_words_for_soft_parts(made)
        if other is not None:
            return replace(draft, plan=other, rounds=refused.rounds, witnesses=(), reworded=way + 1)
    return None


def _other_words_for_soft_parts(made: Plan) -> Plan | None:
    from ltlplan.search.method import under_precedences
    from ltlplan.soft_parts import other_words_under_precedences

    return other_words_under_precedences(made, lambda asked: plan(asked, method=under_precedences))


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
    return made.model_copy(update={"notes": tuple(dict.fromkeys((*made.notes, said)))})


def mended(refused: Refused) -> Draft:
    """Return what to refine next after a refusal: the plan with the waits that it asks for, and all witnesses so far.

    Raises:
        NotCertified: This was the last of a handful of rounds, the flight outlasts a vehicle's endurance, or the waits go round in a circle; carries the witnesses.
    """
    try:
        return _mended(refused)
    except NotCertified as error:
        other = _without_this_flight(replace(refused.draft, rounds=refused.rounds), str(error))
        if other is None:
            raise
        return other


def _mended(refused: Refused) -> Draft:
    if refused.draft.certified is not None:
        return refused.instead or replace(refused.draft, rounds=refused.rounds)
    latest = tuple(claim.witness for claim in refused.claims if claim.witness is not None)
    if long := [claim.sentence for claim in refused.claims if claim.name == "limits.endurance"]:
        hint = "No other flight of this plan is shorter; plan faster flights (`planner.speed`), or with room for waits."
        raise NotCertified(f"Not certified. {' '.join(long)} {hint}", latest)
    if refused.rounds >= refused.draft.last_round:
        sentences = " ".join(claim.sentence for claim in refused.claims)
        raise NotCertified(f"Not certified after {refused.rounds} rounds of refinement. {sentences}", latest)
    draft, witnesses = refused.draft, (*refused.draft.witnesses, *latest)
    try:
        waiting = with_waits(draft.plan, latest)
        mends = waiting is not draft.plan or all(witness.claim != "formula" for witness in latest)
    except NotCertified:
        replanned = _replanned(refused)
        if replanned is None:
            raise
        return replanned
    replanned = None if mends else _replanned(refused)
    return replanned or replace(draft, plan=waiting, rounds=refused.rounds, witnesses=witnesses)


def _replanned(refused: Refused) -> Draft | None:
    """Return the draft with precedences that planning finds for its words, or with other words that have some; None where it finds none."""
    draft = refused.draft
    others = tuple(witness for witness in draft.witnesses if witness.claim != "formula")  # planning orders all events
    try:
        planned = with_planned_waits(draft.plan)
    except Unsatisfiable:
        planned = _with_other_words(draft.plan)
    return None if planned is None else replace(draft, plan=planned, rounds=refused.rounds, witnesses=others)


def _with_other_words(made: Plan) -> Plan | None:
    """Return a plan whose words hold under precedences, in the place of one that holds in every order of whole words and in no flight."""
    from ltlplan.search.method import under_precedences

    if made.method == SEQUENCE:
        return None
    if made.mission.soft_parts:
        return _other_words_for_soft_parts(made)
    try:
        other = plan(made.mission, method=under_precedences)
    except (BadInput, Unsatisfiable, Infeasible, NotCertified):
        return None
    why = "Words that hold in every order of the robots were given up: they hold under no precedences, as a flight asks."
    return other.model_copy(update={"method": made.method, "notes": (*other.notes, why)})


def run(
    mission: Asked,
    out: str | Path | None = None,
    *,
    seed: int | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
) -> Result:
    """Plan, refine, certify, fly in simulation and, where `out` is given, write all files.

    Args:
        mission: What is asked: a mission, or the path or name that `load_mission` reads one by.
        out: Folder to write, whole or not at all; what in it is not as an earlier run left it is kept, or refused.
        seed: Source of every draw, instead of the mission's own.
        progress: Told a sentence and the share done, 0 to 1.
        workers: Who improves robots' paths side by side; None does it here. The bytes do not depend on it.

    Raises:
        BadInput: There is no such mission, its file is at fault, or its margin is 0, which leaves no tube to fly in.
        LtlplanError: Any of the stages refused; the class says which and the message why.
    """
    import flight
    from flight.certified import require_tube
    from flight.conditions import conditions_of
    from ltlplan import output
    from verify.data.storage.folders import check_folder

    mission = as_mission(mission)
    require_tube(mission.margin)
    target = None if out is None else check_folder(out, output.run_files(mission))
    made = plan(mission, seed=seed, progress=part_of(progress, 0.0, 0.25), workers=workers)
    done = certified_team(made, progress=part_of(progress, 0.25, 0.7))
    part_of(progress, 0.7, 0.9)("flying in simulation", 0.0)
    flying = part_of(progress, 0.7, 0.9)
    conditions = conditions_of(done.plan.mission)
    log = flight.fly(done.plan, done.team, done.certificate, seed=made.seed, conditions=conditions, progress=flying)
    result = Result(done.plan.mission, done.plan, done.team, done.certificate, log, done.rounds)
    if target is None:
        return result
    part_of(progress, 0.9, 1.0)("writing files", 0.0)
    return replace(result, files=output.write_run(result, target))
