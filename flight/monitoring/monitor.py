"""The monitor: what can be said of a flight while it is flown, from what is measured.

It follows the formula on the measured path, the distance of every robot from its plan against the certificate's
margin, and the distances between robots, and says at once when the certificate no longer covers the flight.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from flight.logs.log import Event
from flight.model.attitude import Floats
from flight.monitoring.formula_state import FormulaState, FormulaVerdict, PartState, has_formula
from flight.monitoring.letters import PlannedAction, RegionMasks, region_letters
from flight.monitoring.timed_state import TimedState, both
from flight.monitoring.tube import Tube, TubeVerdict, relative_acceleration
from verify.data import BadInput, Mission, check_mission
from verify.data.language.relaxation import relaxed
from verify.data.sections import SoftPart
from verify.logic.explanation import show
from verify.logic.normal_form import conjuncts, normal_form, to_formula
from verify.recordings.planned_paths import PlannedPath

_SOFT: dict[FormulaVerdict, str] = {
    "satisfied": "the flown path satisfies it",
    "violated": "the flown path does not satisfy it",
    "open": "nothing broke it yet; it speaks of infinite flights",
    "undecided": "it is too large to be followed",
}
"""What is said of soft specifications at a flight's end; none of them is an alarm."""


COVERED = "the certificate covers this flight"
"""What a tube that was never left means."""


class Monitor:
    """Watches one flight of a team, sample by sample.

    Attributes:
        mission: Whose formula, regions and separation.
        events: What was said so far, in order.
        closest: The least distance between two robots at any sample so far, m, and who; None for a single robot.
        too_close: Whether two robots were measured nearer to each other than the mission allows.
    """

    def __init__(
        self,
        mission: Mission,
        actions: Sequence[PlannedAction],
        *,
        margin: float | None,
        measurement: float,
        planned_acceleration: float,
        planned: Mapping[str, PlannedPath] | None = None,
    ) -> None:
        """Begin before the first sample.

        Args:
            mission: Whose formula, regions and separation.
            actions: When internal states change.
            margin: delta of the certificate, m; None where there is none.
            measurement: Bound on a measured position's error, m.
            planned_acceleration: Bound on the planned acceleration, m/s^2.
            planned: What is flown, for where its pieces meet; without it one joint at most is taken to lie between two samples.
        """
        mission = check_mission(mission, to_plan=False)
        for name, value in (("margin", margin), ("measurement", measurement), ("planned_acceleration", planned_acceleration)):
            if value is not None and not 0 <= value < float("inf"):
                raise BadInput(f"{name} must be a number of at least 0, not {value!r:.40}.")
        self.mission, self._robots = mission, tuple(mission.agents)
        self._actions = [[a for a in sorted(actions, key=lambda a: a.time) if a.robot == name] for name in self._robots]
        self._initial = [mission.initial_letter(name) for name in self._robots]
        self._margin, self._measurement = margin, measurement
        tube_margin = float("inf") if margin is None else margin
        self._tubes = [
            Tube(
                tube_margin,
                measurement,
                relative_acceleration(mission.vehicle_of(name), planned_acceleration),
                None if planned is None else planned[name],
            )
            for name in self._robots
        ]
        self._pairs = np.triu_indices(len(self._robots), 1)
        self._least = np.array([mission.least_distance(one, other) for one, other in itertools.combinations(self._robots, 2)])
        self._table = region_letters(mission)
        self._masks = RegionMasks(mission)
        self._regions = self._masks.none(len(self._robots))
        self._formula: FormulaState | None = None
        self._timed = TimedState(mission.timed_parts)
        words = (part for timed in mission.timed_parts for part in conjuncts(normal_form(relaxed(timed))))
        self._follows = {show(to_formula(part)) for part in words}  # what words know of what is bounded in seconds
        self._soft: list[tuple[SoftPart, FormulaState]] = []
        self._letters: list[frozenset[str]] = []
        self.events: list[Event] = []
        self.closest: tuple[float, str, str] | None = None
        self.too_close = False
        self._time, self._paused = 0.0, 0.0

    @property
    def formula(self) -> FormulaVerdict:
        """The formula's state on the measured path; of a mission without one, which has nothing to break, it means nothing."""
        return "open" if self._formula is None else both(self._formula.verdict, self._timed.verdict)

    @property
    def to_do(self) -> tuple[str, ...]:
        """The formula's parts that would not hold if the flight ended now; none before anything was seen."""
        if self._formula is None:
            return ()
        return (*self._timed.to_do, *(part for part in self._formula.to_do if part not in self._follows))

    @property
    def parts(self) -> tuple[tuple[str, PartState], ...]:
        """The formula's parts, each with its state; none before anything was seen, and where nothing is asked."""
        if self._formula is None or not has_formula(self.mission):
            return ()
        return (*self._timed.parts, *(part for part in self._formula.parts if part[0] not in self._follows))

    @property
    def tube(self) -> TubeVerdict | None:
        """The team's tube: the worst of its robots'; None without a certificate."""
        if self._margin is None:
            return None
        verdicts = {tube.verdict for tube in self._tubes}
        return "outside" if "outside" in verdicts else "unknown" if "unknown" in verdicts else "inside"

    @property
    def bounds(self) -> dict[str, float]:
        """Each robot's largest tracking error, m, that cannot be ruled out at any time so far."""
        return {name: tube.bound for name, tube in zip(self._robots, self._tubes, strict=True)}

    @property
    def alarmed(self) -> bool:
        """True if the certificate no longer covers the flight, the formula is broken, or robots came too close."""
        return self.tube in ("unknown", "outside") or self.formula == "violated" or self.too_close

    def pause(self, seconds: float) -> None:
        """Say for how long the plan's clock stood still up to the next sample, all pauses between parts together: actions come later by that.

        Args:
            seconds: s, never less than before.
        """
        self._paused = seconds

    def see(self, time: float, measured: Floats, planned: Floats) -> list[Event]:
        """Take one sample of the whole team and return what is new.

        Args:
            time: s.
            measured: Positions, m; NaN for a robot that was not seen. Shape (3, robots).
            planned: Where they should be. Shape (3, robots).
        """
        off = measured - planned
        return self.see_errors(time, measured, np.sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]))

    def see_errors(self, time: float, measured: Floats, errors: Floats) -> list[Event]:
        """Take one sample of which the distances from the plan are known, m. Shapes (3, robots) and (robots,).

        Args:
            time: s.
            measured: m. Shape (3, robots).
            errors: m. Shape (robots,).

        Returns:
            What is to be said of it.
        """
        before, self._time = len(self.events), time
        for name, tube, error in zip(self._robots, self._tubes, errors.tolist(), strict=True):
            was = tube.verdict
            if tube.see(time, error, self._paused) != was and self._margin is not None:
                self._say_tube(name, tube, error)
        self._see_letters(time - self._paused, measured)
        self._see_distances(measured)
        return self.events[before:]

    def finish(self, end: float | None = None, *, covered: str = COVERED) -> None:
        """Take the flight as over and say how it ended.

        Args:
            end: When it ended, s; None takes the last sample for it.
            covered: What it means that the tube was never left.
        """
        if self._margin is not None:
            for name, tube in zip(self._robots, self._tubes, strict=True):
                was = tube.verdict
                if tube.end(self._time if end is None else end) != was:
                    self._say(
                        name, "tube", f"{name} was not seen at the flight's start or end: up to {tube.bound:.4f} m from its plan "
                        f"cannot be ruled out, the tube is {self._margin:g} m; the certificate cannot be shown to cover this flight.",
                    )  # fmt: skip
        finite = self.mission.spec.trace == "finite"
        if has_formula(self.mission) and self._formula is not None and self.formula == "open":
            last = self._time if end is None else end
            verdict = both(self._formula.end(finite=finite), self._timed.end(last, finite=finite))
            if verdict == "satisfied":
                self._say(None, "formula", "the flown path satisfies the formula.")
            elif verdict == "violated":
                broken = self._formula.broken or self._timed.broken
                self._say(None, "formula", f"the flown path breaks the formula: `{broken}` was not fulfilled.")
            elif not finite:
                self._say(None, "formula", "the formula is still open: it speaks of infinite flights, and nothing broke it.")
        for part, state in self._soft:
            self._say(None, "soft", f"soft part `{part.formula}` (weight {part.weight:g}): {_SOFT[state.end(finite=finite)]}.")
        if self._margin is not None and self.tube == "inside":
            worst = max(self.bounds.values())
            self._say(
                None,
                "tube",
                f"every robot stayed within {worst:.4f} m of its plan at every time, inside the tube of {self._margin:g} m: {covered}.",
            )
        if self.closest is not None:
            distance, one, other = self.closest
            self._say(None, "separation", f"{one} and {other} came closest, {distance:.3f} m at a sample.")

    def _say(self, robot: str | None, kind: str, sentence: str) -> None:
        self.events.append(Event(self._time, robot, kind, sentence))

    def _say_tube(self, name: str, tube: Tube, error: float) -> None:
        if tube.verdict == "outside":
            self._say(
                name, "tube", f"{name} is {error:.4f} m from its plan, outside the tube of {self._margin:g} m: "
                "the certificate does not cover this flight.",
            )  # fmt: skip
        elif error != error:
            self._say(
                name, "tube", f"{name} has not been seen for too long: up to {tube.bound:.4f} m from its plan cannot be ruled "
                f"out, the tube is {self._margin:g} m; the certificate can no longer be shown to cover this flight.",
            )  # fmt: skip
        else:
            self._say(
                name, "tube", f"{name} is {error:.4f} m from its plan and up to {tube.bound:.4f} m cannot be ruled out, "
                f"the tube is {self._margin:g} m: the certificate can no longer be shown to cover this flight.",
            )  # fmt: skip

    def _see_letters(self, time: float, measured: Floats) -> None:
        """Follow the formula: actions are made at instants of the plan's clock, s; bounds in seconds go on in pauses."""
        seen = ~np.isnan(measured[0])
        self._regions = np.where(seen, self._masks.of(np.where(seen, measured, 0.0)), self._regions)
        letters = [self._table[mask] | self._inner(robot, time) for robot, mask in enumerate(self._regions.tolist())]
        was = self.formula
        if self._formula is None:
            self._formula = FormulaState(self.mission.formula, self.mission.spec.team, letters, self._robots)
            for part in self.mission.soft_parts:
                asked = self.mission.asking(part.formula).formula
                self._soft.append((part, FormulaState(asked, self.mission.spec.team, letters, self._robots)))
        elif letters != self._letters:
            for state in (self._formula, *(state for _, state in self._soft)):
                state.change(dict(enumerate(letters)))
        self._timed.see(self._time, dict(zip(self._robots, letters, strict=True)))
        self._letters = letters
        if self.formula != was and has_formula(self.mission):
            self._say_formula(self._formula.broken or self._timed.broken)

    def _inner(self, robot: int, time: float) -> frozenset[str]:
        now = self._initial[robot]
        for action in self._actions[robot]:
            if action.time > time:
                break
            now = action.propositions
        return now

    def _say_formula(self, broken: str | None) -> None:
        if self.formula == "satisfied":
            self._say(None, "formula", "the formula is satisfied, whatever comes.")
        elif self.formula == "violated":
            self._say(None, "formula", f"the flown path breaks the formula: `{broken}` cannot hold any more.")
        else:
            self._say(None, "formula", "the formula is too large to be followed; its state is undecided.")

    def _see_distances(self, measured: Floats) -> None:
        if not len(self._least):
            return
        first, second = self._pairs
        squeeze = 1.0 if self.mission.separation_z is None else self.mission.separation / self.mission.separation_z
        x, y, z = measured[:, first] - measured[:, second]
        distances = np.sqrt(x * x + y * y + (squeeze * z) ** 2)
        distances[np.isnan(distances)] = np.inf  # of robots that were not seen
        pair = int(np.argmin(distances))
        nearest = float(distances[pair])
        if nearest < (float("inf") if self.closest is None else self.closest[0]):
            self.closest = (nearest, self._robots[first[pair]], self._robots[second[pair]])
        if not self.too_close and (near := distances < self._least).any():
            pair = int(np.argmax(near))
            self.too_close = True
            self._say(
                None, "separation", f"{self._robots[first[pair]]} and {self._robots[second[pair]]} are "
                f"{distances[pair]:.3f} m apart, less than {self._least[pair]:g} m.",
            )  # fmt: skip
