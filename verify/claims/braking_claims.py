"""Claims about braking to a hover that are not proved: of whom, when, how near, and whether that is sure or only could not be ruled out."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from verify.claims.claim import Claim, Outcome, claim_of
from verify.motion.braking.closed_regions import ClosedRegions
from verify.motion.braking.pairs import closest_braking
from verify.motion.braking.surroundings import Braking, Nearness
from verify.motion.braking.targets import WALLS, Rims, Solids, Walls
from verify.motion.separation import stretch_of


@dataclass(frozen=True, eq=False, slots=True)
class BrakingClaims:
    """Requirements on a team that brakes.

    Attributes:
        braking: What is flown, and how long braking takes.
        margin: delta, m, exact.
        clock_error: s between two clocks at any moment, exact.
    """

    braking: Braking
    margin: Fraction
    clock_error: Fraction

    def refused(self) -> Iterator[Claim]:
        """Yield a claim for each kind of distance that is not proved, where least is: to others, walls, rims, obstacles, closed regions."""
        yield from self._separation()
        yield from self._workspace()
        yield from self._rims()
        yield from self._obstacles()
        yield from self._regions()

    def _separation(self) -> Iterator[Claim]:
        paths = self.braking.paths
        mission, robots, both = paths.mission, paths.robots, 2 * self.margin * stretch_of(paths)
        asked = [
            [Fraction(mission.least_distance(one, other)) + both if one != other else both for other in robots]
            for one in robots
        ]
        found = closest_braking(paths, self.braking.length, asked, self.clock_error)
        if found is None:
            return
        one, other = (robots[robot] for robot in found.robots)
        limit = float(asked[found.robots[0]][found.robots[1]])
        apart = f", with clocks up to {float(self.clock_error):g} s apart" if self.clock_error else ""
        need = f"{limit:.4f} m are asked (separation {mission.least_distance(one, other):g} m, margin {float(self.margin):g} m)"
        when = self._when(found.instants, found.shares)
        if found.fails:
            sentence = f"{one} and {other} come within {found.high:.4f} m of one another {when}{apart}; {need}."
        else:
            known = _known(found.low, found.high)
            sentence = f"it could not be proved that {one} and {other} keep apart {when}{apart}: {known}; {need}."
        yield claim_of(
            "separation", _outcome(found.fails), sentence, robot=one, other=other, unit="m", time=found.instants[0],
            bound=found.low, limit=limit, margin=found.low - limit,
        )  # fmt: skip

    def _workspace(self) -> Iterator[Claim]:
        found = self.braking.nearness(Walls(self.braking.paths, self.margin))
        if found is not None:
            wall = WALLS[found.target]
            yield self._claim("workspace", found, f"the wall {wall}", self.margin, f"the margin is {float(self.margin):g} m")

    def _rims(self) -> Iterator[Claim]:
        rims = Rims(self.braking.paths, self.margin)
        found = self.braking.nearness(rims)
        if found is not None:
            limit = rims.limits[found.robot]
            name = list(self.braking.paths.mission.hoops)[found.target]
            yield self._claim("rims", found, f"the rim of '{name}'", limit, _need(limit), region=name)

    def _obstacles(self) -> Iterator[Claim]:
        solids = Solids(self.braking.paths, self.margin)
        found = self.braking.nearness(solids)
        if found is not None:
            limit, name = solids.limits[found.robot], solids.bodies.parts[found.target].obstacle
            yield self._claim("obstacles", found, f"obstacle '{name}'", limit, _need(limit), region=name)

    def _regions(self) -> Iterator[Claim]:
        closed = ClosedRegions(self.braking.paths, self.margin)
        found = self.braking.nearness(closed)
        if found is None:
            return
        mission, robot, name = self.braking.paths.mission, self.braking.paths.robots[found.robot], closed.names[found.target]
        only, when = " and ".join(mission.all_regions[name].only or ()), self._when(found.instants, found.shares)
        enters = f"{robot} enters {name}" if found.fails else f"it could not be proved that {robot} stays out of {name}"
        sentence = f"{enters} {when}, which is open to {only} only."
        yield claim_of("transitions", _outcome(found.fails), sentence, robot=robot, region=name, time=found.instants[0])

    # six parameters: a claim's name, what was found and of what, and what was asked
    def _claim(self, name: str, found: Nearness, what: str, limit: Fraction, need: str, *, region: str | None = None) -> Claim:
        robot, when = self.braking.paths.robots[found.robot], self._when(found.instants, found.shares)
        if not found.fails:
            sentence = (
                f"it could not be proved that {robot} stays clear of {what} {when}: {_known(found.low, found.high)}; {need}."
            )
        elif found.high < 0:
            sentence = f"{robot} is {-found.high:.4f} m beyond {what} {when}; {need}."
        else:
            sentence = f"{robot} comes within {found.high:.4f} m of {what} {when}; {need}."
        return claim_of(
            name, _outcome(found.fails), sentence, robot=robot, unit="m", time=found.instants[0], bound=found.low, limit=float(limit),
            margin=found.low - float(limit), region=region, what=what,
        )  # fmt: skip

    def _when(self, instants: tuple[float, float], shares: tuple[float, float]) -> str:
        """Word at which instants braking begins, and how long after that."""
        (first, last), (begin, end) = instants, (share * float(self.braking.length) for share in shares)
        into = f"{begin:.3f} s" if begin == end else f"{begin:.3f} to {end:.3f} s"
        at = f"at {first:.4f} s" if first == last else f"from {first:.4f} to {last:.4f} s"
        return f"{into} into braking that begins {at}"


def _outcome(fails: bool) -> Outcome:
    return "fails" if fails else "undecided"


def _need(limit: Fraction) -> str:
    return f"radius and margin need {float(limit):.4f} m"


def _known(low: float, high: float) -> str:
    proved = f"{low:.4f} m is proved" if low > 0 else "no distance is proved"
    return proved + (f", and {high:.4f} m is reached" if math.isfinite(high) else "")
