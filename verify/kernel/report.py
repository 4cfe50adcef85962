"""A statement in words, and what is checked of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

from .checking import LIMITS, Checked
from .formulas import show
from .statement import Robot, Shape, Statement


def _number(value: Fraction) -> str:
    return str(float(value)).removesuffix(".0")


def _point(values: Iterable[Fraction]) -> str:
    return f"({', '.join(map(_number, values))})"


def _shape(shape: Shape) -> Iterator[str]:
    for number, part in enumerate(shape.parts):
        kept = []
        for one in part:
            linear = [] if one.linear is None else [f"{_point(one.linear)}.x"]
            quadratic = [] if one.quadratic is None else [f"x'{' '.join(_point(row) for row in one.quadratic)}x"]
            kept.append(f"{' + '.join([*quadratic, *linear])} <= {_number(one.bound)}")
        yield f"    {'or' if number else 'x with'} {', '.join(kept)}"


def _shapes(what: str, shapes: dict[str, Shape]) -> Iterator[str]:
    for name, shape in shapes.items():
        yield f"  {what} {name}: around {_point(shape.center)} m, that is all points from there on"
        yield from _shape(shape)
        if shape.ring:
            ring = shape.ring
            yield f"    with a ring of normal {_point(ring.normal)}, opening {_number(ring.opening)} m and rim {_number(ring.rim)} m"
        if shape.openings:
            yield f"    less the openings of {', '.join(shape.openings)}"


def _robot(name: str, robot: Robot) -> Iterator[str]:
    limits = ", ".join(f"{key.replace('_', ' ')} {_number(getattr(robot.limits, key))}" for key in LIMITS)
    visits = " ".join(visit.region + (visit.direction or "") for visit in robot.visits) or "none"
    laps = "" if robot.cycle is None else f"; laps begin with piece {robot.cycle} and visit {robot.cycle_visit}"
    yield f"  {name}: starts at {_point(robot.start)} m with heading {_number(robot.yaw)} rad; visits {visits}{laps}"
    yield f"    sphere of {_number(robot.radius)} m, {_number(robot.mass)} kg, arms of {_number(robot.arm)} m, inertia {_point(robot.inertia)}"
    yield f"    limits (SI, rad): {limits}"
    for region, leg in robot.limits.legs.items():
        yield f"    on the way to {region}: " + ", ".join(
            f"{key} {_number(value)}" for key in ("speed", "acceleration") if (value := getattr(leg, key)) is not None
        )
    if robot.end is not None:
        yield f"    finishes at {_point(robot.end)} m"
    if robot.limits.endurance is not None:
        yield f"    endurance {_number(robot.limits.endurance)} s"
    if robot.closed:
        yield f"    may not enter {', '.join(sorted(robot.closed))}"
    if robot.edges is not None:
        ways = "; ".join(f"{source} to {', '.join(sorted(targets))}" for source, targets in sorted(robot.edges.items()))
        yield f"    comes from {robot.vertex}, and may go from {ways}"
    shown = "; ".join(f"{state} shows {', '.join(sorted(names)) or 'nothing'}" for state, names in robot.states.items())
    yield f"    internal states, from {robot.initial} on: {shown}"
    for action in robot.actions:
        yield f"    may become {action.after} where it is {action.before}, at {action.at}"
    for deed in robot.changes:
        yield f"    becomes {deed.after} at {_number(deed.time)} s, during visit {deed.visit}"
    if robot.cuts:
        yield f"    parts begin with pieces {', '.join(map(str, robot.cuts))}"


def statement_lines(statement: Statement) -> Iterator[str]:
    """Yield what a statement says."""
    yield f"Mission {statement.name}. Every flight whose robots stay within {_number(statement.margin)} m of their paths at every time,"
    yield f"with clocks that never differ by more than {_number(statement.clock_error)} s:"
    letters = "letters of all robots are joined" if statement.joint else "each robot is read by itself"
    trace = f"laps for ever, of which {statement.repeat} are in the files" if statement.lasso else "a finite flight"
    yield f"  formula {show(statement.formula)} ({letters}; {trace})"
    if statement.sequence is not None:
        prefix, cycle = (" ".join(hoop + way for hoop, way in part or ()) for part in statement.sequence)
        yield f"  sequence {prefix}{f' ({cycle})*' if cycle else ''}"
    yield f"  workspace from {_point(statement.low)} m to {_point(statement.high)} m"
    z = "" if statement.separation_z is None else f", {_number(statement.separation_z)} m in z"
    yield f"  centres of robots keep {_number(statement.separation)} m apart{z}, and more where radii ask for it"
    yield from _shapes("region", dict(statement.regions))
    yield from _shapes("obstacle", dict(statement.obstacles))
    for name, robot in statement.robots.items():
        yield from _robot(name, robot)
    for name, word in statement.words.items():
        yield f"  {name} is to show {' '.join('{' + ', '.join(sorted(letter)) + '}' for letter in word)}"
    for wait in statement.waits:
        (first, visit), (then, other) = wait.first, wait.then
        yield f"  {first} has {wait.done} at its visit {visit} before {then} {wait.due} at its visit {other}"


def claim_lines(claims: Sequence[Checked]) -> Iterator[str]:
    """Yield each claim, and how many of them are checked."""
    for claim in claims:
        of = f" of {' and '.join(claim.robots)}" if claim.robots else ""
        yield (
            f"not covered by the kernel: {claim.name}{of}: {claim.missing}."
            if claim.missing
            else f"checked: {claim.name}: {claim.sentence}"
        )
    yield summary(claims)


def summary(claims: Sequence[Checked]) -> str:
    """Return how many claims are checked."""
    return f"{sum(not claim.missing for claim in claims)} of {len(claims)} claims checked by the kernel"
