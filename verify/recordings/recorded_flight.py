"""One recording compared with what is asked of it: when the flight began, where robots can have been, and every claim of that."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from functools import cached_property

import numpy as np

from verify.claims.claim import Claim
from verify.data.errors import BadInput
from verify.data.plan import RobotPlan
from verify.recordings.actions import Action, action_claim, internal_changes, logged_actions, planned_actions, unplanned
from verify.recordings.alignment import Alignment, fitted, given, with_the_recording
from verify.recordings.flight_log import Samples
from verify.recordings.flight_reference import FlightReference, World
from verify.recordings.geometric_claims import obstacle_claim, recorded_claim, rim_claim, separation_claims, workspace_claim
from verify.recordings.measurement import unseen_sentence
from verify.recordings.planned_paths import PlannedPath, planned_paths
from verify.recordings.reachable_sets import Bounds, Track, track
from verify.recordings.recorded_visits import passage_claim, visit_claim, widened
from verify.recordings.temporal_claims import (
    formula_claim,
    recorded_timeline,
    region_rows,
    transition_claim,
    within,
)
from verify.recordings.tube import tube_claim
from verify.recordings.uncertain_start import OpenEnds, change_within, for_every_start

_TOLD = 1e-4
"""m; what times that are off add to the error is named from here on."""


class RecordedFlight:
    """One recording, compared with what is asked of it.

    Attributes:
        samples: What was measured.
        asked: Mission, plan and trajectories.
        alignment: When the flight began on the recording's clock.
        start: When the flight that is checked begins there, s.
        stop: And when it ends, s.
        tracks: For each robot where it can have been while it was part of the team.
        aloft: The same, with how it climbed to the others that were in the air.
    """

    def __init__(
        self, samples: Samples, asked: FlightReference, bounds: Bounds, start: tuple[float, float] | None, budget: int
    ) -> None:
        """Align a recording with what is asked, and bound where robots can have been.

        Args:
            samples: What was measured; checked.
            asked: Mission, plan and trajectories; checked.
            bounds: On speed, acceleration and the measurement's error.
            start: From when to when the flight may have begun on the recording's clock, s; None fits it.
            budget: Configurations that each part of the formula may take.

        Raises:
            BadInput: A robot left before the flight begins, or samples are further apart than the speed allows.
        """
        self.samples, self.asked, self.budget = samples, asked, budget
        self.paths: dict[str, PlannedPath] | None = (
            None if asked.team is None else planned_paths(asked.worlds[0].mission, asked.team)
        )
        self.end = None if self.paths is None else max(path.end for path in self.paths.values())
        self.alignment = self._aligned(start, bounds.error)
        self.start, self.stop = self._window()
        self.bounds = bounds
        self.tracks: dict[str, Track] = {}
        self.aloft: dict[str, Track] = {}
        for robot, places in samples.positions.items():
            whole = track(robot, samples.times, places, bounds, start=self.start, stop=self.stop)
            gone = asked.gone.get(robot)
            if gone is not None and gone < self.start:
                raise BadInput(
                    f"{robot} left at {gone:g} s, before the flight that is checked begins at {self.start:g} s: what it showed last "
                    "was not recorded."
                )
            judged = whole if gone is None else whole.over(self.start, gone)
            came = asked.joined.get(robot)
            if came is not None and not self.start <= came.climbs <= came.since <= self.stop:
                raise BadInput(
                    f"{robot} climbs at {came.climbs:g} s and joins at {came.since:g} s, not within the flight that is checked, from "
                    f"{self.start:g} to {self.stop:g} s."
                )
            self.tracks[robot] = judged if came is None else judged.over(came.since, self.stop)
            self.aloft[robot] = judged if came is None else judged.over(came.climbs, self.stop)
        self.rows = {robot: region_rows(one, asked.worlds) for robot, one in self.tracks.items()}

    def claims(self) -> tuple[Claim, ...]:
        """Check every claim."""
        claims = [*self._tube(), *self._words(), *self._visits(), *self._space()]
        if self.alignment.trusted and self.alignment.high == self.alignment.low:
            return tuple(claims)
        ends = self._open_ends()
        changes = {
            robot: change_within(ends, one, self.rows[robot], self.asked.worlds, self.samples, self.asked.margin)
            for robot, one in self.tracks.items()
        }
        return tuple(for_every_start(claims, ends, changes, self.rows))

    def _open_ends(self) -> OpenEnds:
        """Return what of the checked time may not be the flight's, as its start is left open."""
        low, high, end = self.alignment.low, self.alignment.high, self.end
        logged = self.samples.internal is not None
        if self.alignment.trusted:
            return OpenEnds((low, high), None if end is None else (low + end, high + end), logged=logged)
        whole = end is not None and self.stop - self.start >= end
        return OpenEnds((self.start, self.stop), (self.start, self.stop), whole, logged)

    def _aligned(self, start: tuple[float, float] | None, error: float) -> Alignment:
        if start is not None:
            return given(*start)
        if self.paths is None:
            return with_the_recording(self.samples.span[0])
        found = fitted(self.samples.times, self.samples.positions, self.paths, error=error, clock_error=self.asked.clock_error)
        return replace(found, zero=self.samples.zero)

    def _window(self) -> tuple[float, float]:
        """Return from when until when the flight lasted on the recording's clock.

        Without a start that can be trusted, that is all that the recording covers.
        """
        first, last = self.samples.span
        if self.end is None:
            return self.alignment.low, max(last, self.alignment.high)
        if not self.alignment.trusted:
            return first, last
        return self.alignment.low, self.alignment.high + self.end

    @cached_property
    def lap(self) -> Fraction | None:
        """Duration of the cycle with which the flight ends, s; None where there is none, or its ends are not known on the recording's clock."""
        team, begins = self.asked.team, self.alignment
        known = begins.told and begins.low == begins.high and not self.asked.changes
        if team is None or not known or self.asked.mission.spec.trace != "infinite":
            return None
        laps = {
            None if path.cycle is None else Fraction(path.duration) - Fraction(float(path.knots[path.cycle]))
            for path in team.values()
        }
        lap = laps.pop()
        return lap if not laps and lap is not None and 0 < lap <= Fraction(self.stop) - Fraction(self.start) else None

    @property
    def premise(self) -> str:
        """Assumption of the claim `formula` on the time after the recording; empty where it makes none."""
        if self.lap is None or self.asked.mission.spec.formula is None:
            return ""
        since = self.stop - float(self.lap)
        return f"`formula` holds only if later laps show what the last one did, from {since:.4f} to {self.stop:.4f} s."

    # -- claims -----------------------------------------------------------------------------------------------

    def _tube(self) -> Iterable[Claim]:
        if self.paths is not None and self.end is not None:
            for robot, one in self.tracks.items():
                yield tube_claim(one, self.paths[robot], self.alignment, self.asked.margin, self.end)

    def _words(self) -> Iterable[Claim]:
        mission, timelines, deeds = self.asked.mission, {}, []
        for robot, one in self.tracks.items():
            internal, actions = self._actions(robot)
            deeds.append((robot, actions))
            changes = internal_changes(actions, mission, Fraction(self.start), Fraction(self.stop) - Fraction(self.start))
            timelines[robot] = recorded_timeline(
                one, self.rows[robot], start=self.start, stop=self.stop, internal=internal, actions=changes
            )
        open_ = [action for _, actions in deeds for action in actions if action.outcome == "undecided"]
        doubtful = open_[0].sentence if open_ else ""
        if mission.spec.trace == "infinite" and not self.alignment.told and self.alignment.fitted is None:
            sentence = (
                "Nobody says when the flight began, so that what its laps showed first cannot be told. Say it (`--start`)."
            )
            yield recorded_claim("formula", "undecided", sentence)
        elif mission.timed_parts and not self.alignment.trusted:
            sentence = (
                "Nobody says closely enough when the flight began, from which bounds in seconds count. Say it (`--start`)."
            )
            yield recorded_claim("formula", "undecided", sentence)
        elif mission.spec.formula is not None:
            yield formula_claim(
                self.asked.worlds, timelines, self.rows, doubtful=doubtful, begins=(self.start, self.alignment.high - self.alignment.low),
                lap=self.lap, budget=self.budget,
            )  # fmt: skip
        for timeline in timelines.values():
            yield transition_claim(self.asked.worlds, timeline, zero=self.start)
        for robot, actions in deeds:
            claim = action_claim(robot, actions)
            if claim is not None:
                yield claim

    def _visits(self) -> Iterable[Claim]:
        mission, plan = self.asked.worlds[0].mission, self.asked.plan
        for robot, one in self.tracks.items():
            if plan is not None:
                laps = _all_laps(plan.robots[robot], mission.spec.repeat)
                near = region_rows(one, [World(w.since, widened(w.mission, self.asked.margin)) for w in self.asked.worlds])
                start = np.array(mission.agents[robot].start)
                starts_in = frozenset(name for name, region in mission.all_regions.items() if region.level(start) <= 1)
                yield visit_claim(one, laps, self.rows[robot], near, starts_in)
                wanted = [(v.region, v.direction) for v in laps.visits if v.direction is not None]
                yield passage_claim(one, self.asked.worlds, wanted, self.rows[robot], self.asked.margin)
            elif mission.passages is not None:
                sequence = mission.passages
                flown = [*sequence.prefix, *(sequence.cycle or ()) * mission.spec.repeat]
                yield passage_claim(
                    one, self.asked.worlds, [(p.hoop, p.direction) for p in flown], self.rows[robot], mission.margin
                )

    def _space(self) -> Iterable[Claim]:
        worlds = self.asked.worlds
        radii = {robot: self.asked.mission.vehicle_of(robot).radius for robot in self.tracks}
        for index, world in enumerate(worlds):
            since = self.start if index == 0 else world.since
            until = self.stop if index + 1 == len(worlds) else worlds[index + 1].since
            parts = {robot: one.over(since, until) for robot, one in self.aloft.items()}
            parts = {robot: one for robot, one in parts.items() if one.start <= one.stop}
            rims = (rim_claim(one, world.mission, radii[robot]) for robot, one in parts.items())
            yield from (claim for claim in rims if claim is not None)
            solid = (obstacle_claim(one, world.mission, radii[robot]) for robot, one in parts.items())
            yield from (claim for claim in solid if claim is not None)
        for one in self.tracks.values():
            yield workspace_claim(one, self.asked.mission)
        yield from separation_claims(self.aloft, self.asked.mission)

    def _actions(self, robot: str) -> tuple[frozenset[str], list[Action]]:
        """Return a robot's internal propositions at the start, and its actions, each compared with the samples."""
        mission, rows = self.asked.mission, self.rows[robot]
        planned = planned_actions(self.asked, robot, rows, self.alignment)
        one, times = self.tracks[robot], self.samples.times
        index = within(times, one.start, one.stop)
        if self.samples.internal is None or not len(index):
            return mission.initial_letter(robot), planned
        first = int(index[0])
        at, logged = [*times[index].tolist()], [self.samples.internal[robot][i] for i in index]
        if at[0] > one.start:  # what it was when the flight began: of the last row before, or as the mission says
            at = [float(times[first - 1]) if first else one.start, *at]
            logged = [self.samples.internal[robot][first - 1] if first else mission.initial_letter(robot), *logged]
        shown = [frozenset(letter) & mission.internal_propositions for letter in logged]
        made = logged_actions(robot, np.array(at), shown, mission, rows)
        if self.asked.team is None:
            return shown[0], made
        return shown[0], [*made, *unplanned(robot, made, planned, mission, until=Fraction(at[-1]))]

    def assumptions(self) -> Iterable[str]:
        """Yield what a verdict rests on, a sentence each."""
        first, last = self.samples.span
        lasts = f"The flight lasts from {self.start:.4f} to {self.stop:.4f} s of the recording"
        planned = "" if self.end is None else f" (as planned, {self.end:.4f} s)" if self.alignment.trusted else " (all of it)"
        rest = "; rows beyond are not judged" if last > self.stop or first < self.start else ""
        yield f"{lasts}{planned}{rest}."
        yield self.alignment.sentence
        yield f"No robot is ever faster than {self.bounds.speed:g} m/s."
        if np.isfinite(self.bounds.acceleration):
            yield f"No robot is ever accelerated by more than {self.bounds.acceleration:g} m/s^2."
        yield f"No measured position is off by more than {self.bounds.error:g} m, the digits that it was written with included."
        late = self.samples.rounding[0]
        if late * self.bounds.speed > _TOLD:
            yield f"No time is off by more than {late:g} s, for which {late * self.bounds.speed:.4g} m of that stand, at the bound on the speed."
        if self.premise:
            yield self.premise
        yield from self.samples.notes
        for robot, one in self.tracks.items():
            if unseen := unseen_sentence(robot, one.times[one.real], one.start, one.stop):
                yield unseen
        if self.asked.mission.internal_propositions:
            if self.samples.internal is not None:
                yield "Internal states are those of the log; an action counts where the samples allow it at its place."
            elif self.asked.actions:
                yield (
                    "Internal states are those of the certificate's planned actions, each where the samples allow it at its place."
                )
        for robot, came in self.asked.joined.items():
            yield (
                f"{robot} stood on the ground until {came.climbs:.4f} s and climbed until {came.since:.4f} s: until then it is held against "
                "nobody, and until it joined against the other robots, rims and obstacles only."
            )
        if self.asked.changes:
            yield "The world changed in flight as the folder says; the formula is the one that was asked last."
        if self.paths is None:
            yield "There are no trajectories to hold the flight against: nothing is said of a tube."
        if self.asked.plan is None:
            yield "There is no plan to hold the flight against: nothing is said of planned visits."


def _all_laps(robot: RobotPlan, repeat: int) -> RobotPlan:
    """Return a robot's plan with its cycle flown as often as is asked."""
    if robot.cycle_visit is None:
        return robot
    visits = (*robot.visits[: robot.cycle_visit], *robot.visits[robot.cycle_visit :] * repeat)
    return robot.model_copy(update={"visits": visits, "cycle_visit": None})
