"""Flights that are cut into parts: at each cut the whole team rests, so that it may pause there for as long as it likes.

Parts are uploaded one after another while robots hover. What is flown then is the certified flight with its common clock stopped at
the cuts: nothing new is shown and nobody comes nearer to anything. For that every robot has to rest at each cut, at the same
exact instant, and go on from where it rests; and no part has more pieces than its vehicle holds.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from verify.claims.claim import Claim, claim_of
from verify.claims.evidence import Evidence
from verify.data.trajectory import Trajectory
from verify.motion.continuity import JUMPS, QUANTITIES
from verify.motion.paths import TeamPaths


def part_claims(evidence: Evidence) -> Iterable[Claim]:
    """At each cut the team rests, and each part fits its vehicle; none where no flight is cut."""
    paths, mission = evidence.paths, evidence.plan.mission
    if not any(trajectory.cuts for trajectory in paths.trajectories):
        return
    for index, robot in enumerate(paths.robots):
        trajectory = paths.trajectories[index]
        sizes = [end - begin for begin, end in trajectory.parts]
        held, longest = mission.limits_of(robot).pieces, max(sizes)
        fault = _cut_elsewhere(paths, index) or _not_at_rest(paths, index)
        if fault is None and held is not None and longest > held:
            where = sizes.index(longest)
            fault = (
                paths.knots[index][trajectory.parts[where][0]],
                f"part {where + 1} has {longest} pieces, and its vehicle holds {held}",
            )
        holds = "any number" if held is None else f"{held}"
        sentence = (
            f"{robot} flies in {len(sizes)} parts of at most {longest} pieces (its vehicle holds {holds}). At each cut the team rests and "
            "may hover for any time; the next part begins in common, within the clocks' error."
        )
        if fault is not None:
            sentence = f"{robot}: {fault[1]}."
        margin = None if held is None else float(held - longest)
        yield claim_of(
            "parts", "holds" if fault is None else "fails", sentence, robot=robot, unit="pieces", bound=float(longest),
            limit=None if held is None else float(held), margin=margin, time=None if fault is None else float(fault[0]),
            what="" if fault is None else fault[1],
        )  # fmt: skip


def pauses(trajectory: Trajectory, laps: int) -> int:
    """Return between how many parts a robot pauses, laps that begin with a part counted."""
    return len(trajectory.flown_parts(laps)) - 1 if trajectory.cuts else 0


_Fault = tuple[Fraction, str]
"""When, exact, in s, and what is wrong."""


def _cut_elsewhere(paths: TeamPaths, index: int) -> _Fault | None:
    """Say where a robot is not cut at the instant at which the first one is."""
    ours, first = (
        [paths.knots[i][cut] for cut in paths.trajectories[i].cuts] for i in (index, 0)
    )  # exact sums of the durations that are flown
    for time, wanted in zip(ours, first, strict=False):
        if time != wanted:
            return (
                time,
                f"it is cut at {float(time):.9g} s and {paths.robots[0]} at {float(wanted):.9g} s; a team is cut at one instant",
            )
    if len(ours) != len(first):
        return paths.end, f"it has {len(ours)} cuts and {paths.robots[0]} has {len(first)}; a team is cut at the same instants"
    return None


def _not_at_rest(paths: TeamPaths, index: int) -> _Fault | None:
    """Say at which cut a robot moves, or goes on from elsewhere than where it came to rest."""
    trajectory, knots = paths.trajectories[index], paths.knots[index]
    joints = [(cut - 1, cut, knots[cut]) for cut in trajectory.cuts if cut > 0]
    if trajectory.cycle is not None:
        joints.append((len(trajectory) - 1, trajectory.cycle, knots[-1]))
    for before, after, time in joints:
        ends = [_value(trajectory, before, order, at_end=True) for order in range(4)]
        begins = [_value(trajectory, after, order, at_end=False) for order in range(4)]
        gap = [a - b for a, b in zip(begins[0][:3], ends[0][:3], strict=True)]
        if _size2(gap) > Fraction(JUMPS[0]) ** 2:
            return (
                time,
                f"at the cut at {float(time):.4f} s the next part begins {float(_size2(gap)) ** 0.5:.3g} m from where it rests",
            )
        for order in (1, 2, 3):
            for side in (ends, begins):
                if _size2(side[order][:3]) > Fraction(JUMPS[order]) ** 2:
                    size = float(_size2(side[order][:3])) ** 0.5
                    return time, f"it does not rest at the cut at {float(time):.4f} s: its {QUANTITIES[order]} is {size:.3g}"
                if abs(side[order][3]) > Fraction(JUMPS[order]):
                    return time, f"it does not rest at the cut at {float(time):.4f} s: its heading turns"
    return None


def _value(trajectory: Trajectory, piece: int, order: int, *, at_end: bool) -> list[Fraction]:
    """Return the exact derivative of x, y, z and heading at one end of a piece."""
    time = Fraction(float(trajectory.durations[piece])) if at_end else Fraction(0)
    values: list[Fraction] = []
    for row in trajectory.coefficients[piece].tolist():
        coefficients = [Fraction(value) for value in row]
        for _ in range(order):
            coefficients = [power * value for power, value in enumerate(coefficients)][1:]
        total = Fraction(0)
        for value in reversed(coefficients):
            total = total * time + value
        values.append(total)
    return values


def _size2(vector: list[Fraction]) -> Fraction:
    return sum((value * value for value in vector), Fraction(0))
