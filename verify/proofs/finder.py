"""The finder of proofs: what the judge proved, written down for the kernel."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from verify.certificate import Certificate
from verify.data.files.trajectory_csv import write_csv
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.kernel.checking import Check, Owed
from verify.kernel.flights import Path, Segment, read_team
from verify.kernel.limits import kept
from verify.kernel.statement import Limit, Refused, read_statement
from verify.kernel.timelines import Course, Window
from verify.kernel.trees import Cell, Evidence, Part, Rules
from verify.kernel.zones import Two, along, opening
from verify.proofs.half_space_sums import half_space_sums
from verify.proofs.proposed_limits import FlownPieces
from verify.proofs.proposed_roots import FlownSegments, parted_trees
from verify.proofs.search import EDGE, FINE, STYLES, OnTheWay, proof_text, run_lengths, starts_of, trees_of
from verify.proofs.statement import statement_of
from verify.proofs.words import find_formula, find_ordered

_HALVINGS = 6
"""Of a segment beside what it stays clear of, in floats; then the search goes on exactly."""


@dataclass(frozen=True, slots=True)
class Proof:
    """Files that the kernel reads beside the trajectories.

    Attributes:
        statement: Text of statement.json.
        evidence: Text of proof.json.
    """

    statement: str
    evidence: str


def prove(plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate) -> Proof:
    """Write down a proof of what a certificate claims, as far as one is found.

    Args:
        plan: What was planned.
        team: The trajectories that were certified.
        certificate: What was proved of them.

    Raises:
        BadInput: The trajectories' numbers are not float32.
    """
    tables = {name: write_csv(path, plan.mission.spec.repeat) for name, path in team.items()}
    return prove_statement(statement_of(plan, certificate), tables)


def prove_statement(text: str, tables: Mapping[str, str]) -> Proof:
    """Write down a proof of a statement, as far as one is found.

    Args:
        text: Of the statement.
        tables: Each robot's CSV file.
    """
    statement = read_statement(text)
    flown = read_team(statement, tables)
    floats = FlownSegments(flown.paths)
    hulls = {name: floats.lines[own, :3].transpose(0, 2, 1) for name, own in floats.of.items()}
    evidence: dict[str, Any] = {**half_space_sums(statement, flown, hulls)}
    check = Check(statement, flown, Evidence(evidence))
    pieces = FlownPieces(flown.paths)
    found = {name: _Found(check, path, floats, pieces) for name, path in flown.paths.items()}
    with suppress(Refused):  # without timelines there is nothing to say of words
        evidence |= find_formula(statement, {name: one.timeline for name, one in found.items()})
    with suppress(Refused):
        evidence |= find_ordered(statement)
    for course in found.values():
        evidence |= course.marks()
    check.courses = found
    for owed in check.owed():
        with suppress(Refused):
            evidence |= _trees(found, owed, evidence)
    return Proof(text, proof_text(evidence))


class _Found(Course):
    """A robot's path whose evidence is found when it is asked for."""

    def __init__(self, check: Check, path: Path, segments: FlownSegments, pieces: FlownPieces) -> None:
        super().__init__(check.statement, path, check.evidence)
        self.segments, self.pieces = segments, pieces
        self._sought: dict[str, list[str]] = {}

    def _along(self, key: str, segments: Sequence[Segment], cells: Iterable[Cell]) -> list[tuple[Fraction, Fraction, str, Any]]:
        """Return the leaves of a region's trees; they are sought."""
        kind, rules = key.partition("/")[0], next(iter(cells)).rules
        if key not in self._sought:
            depth, near = FINE if self.statement.timed else EDGE, self.statement.margin and kind == "inside"
            trees = self.segments.region_trees(self.name, rules, depth) if near else ["?"]
            told = not any("?" in tree for tree in trees)
            self._sought[key] = trees if told else self._exactly(kind, rules, trees)
        found: list[tuple[Fraction, str]] = []
        for segment, tree in zip(segments, self._sought[key], strict=True):
            if not found or tree != found[-1][1]:
                length = segment.stop - segment.start
                found += [(segment.start + start * length if start else segment.start, mark) for start, mark in starts_of(tree)]
        stops = [*(start for start, _ in found[1:]), segments[-1].stop]
        return [(start, stop, mark, None) for (start, mark), stop in zip(found, stops, strict=True)]

    def _exactly(self, kind: str, rules: Rules, known: Sequence[str] = ()) -> list[str]:
        roots = self.segments.trees(self.name, rules, "n" if kind == "openings" else "nm")
        trees = ["" if "?" in tree else tree for tree in known] if len(known) == len(roots) else roots
        return trees_of(kind, list(along(self.path, rules)), trees)

    def marks(self) -> dict[str, str]:
        """Return marks of regions and openings."""
        with suppress(Refused):
            self.rows  # noqa: B018  # which are sought
        for number, visit in enumerate(self.robot.visits):
            for limit in self.robot.legs.get(visit.region, {}).items():
                with suppress(Refused):
                    self._sought[f"legs/{limit[0]}/{self.name}/{number}"] = self._leg(limit, self.windows(number))
        for name, shape in self.statement.regions.items():
            if shape.ring:
                rules = opening(shape, (self.statement.margin, self.robot.radius))
                self._sought[f"openings/{self.name}/{name}"] = self._exactly("openings", rules)
        return {key: run_lengths(trees) for key, trees in self._sought.items()}

    def _leg(self, limit: tuple[Limit, Fraction], ways: Sequence[Window]) -> list[str]:
        """Return trees of a limit on the way to a visit, open beside it."""
        whole = zip(self.path.pieces, kept(self.path, limit), strict=True)
        trees = trees_of("legs", [OnTheWay(cell, piece.start, piece.stop, ways) for piece, cell in whole])
        return [tree.replace("k", "?") for tree in trees]

    def roots(self, key: str, first: Part) -> list[str]:
        """Return marks of parts, of which this is the first, as far as floats tell them, else nothing."""
        kind, *names = key.split("/")
        if kind in ("workspace", "rims", "obstacles") and isinstance(first, Cell):
            return self.segments.trees(self.name, first.rules, STYLES[kind].marks, _HALVINGS)
        if kind == "limits" and len(names) == 2:
            limit = next(value for one, value in self.robot.limits.items() if one == names[0])
            return self.pieces.roots(self.name, names[0], float(limit))
        return self.pieces.turning(self.name) if kind == "turning" else []


def _trees(found: Mapping[str, _Found], owed: Owed, known: Mapping[str, Any]) -> dict[str, str]:
    """Return the marks of a claim's trees."""
    texts: dict[str, str] = {}
    for key, parts in ((key, iter(parts)) for key, parts in owed.trees if key not in known):
        first = next(parts, None)
        every = [] if first is None else [first]
        if owed.name == "separation":
            every += parts
            roots = parted_trees([part for part in every if isinstance(part, Two)])
        else:
            roots = found[owed.robots[0]].roots(key, first) if first else []
        if not roots or not all(roots):
            roots = trees_of(key.partition("/")[0], [*every, *parts], roots)
        if roots:  # where no part is left, no entry is read
            texts[key] = run_lengths(roots)
    return texts
