"""The patterns of `docs/patterns.md`, read from that page: its world, and for each pattern the formulas and what is flown."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import yaml

from verify.data import Mission, parse_mission

PAGE = Path(__file__).resolve().parents[3] / "docs" / "patterns.md"


@dataclass(frozen=True, slots=True)
class Pattern:
    """A row of a table.

    Attributes:
        name: What it is called.
        one: The formula for one robot; empty where there is none.
        own: Whether that is also a team's, under `team: own`.
        joint: The formula for two to four robots; empty where there is none.
        trace: Finite, or infinite for patrols.
        flown: The regions that one robot visits.
    """

    name: str
    one: str
    own: bool
    joint: str
    trace: str
    flown: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Case:
    """A pattern for some robots."""

    pattern: Pattern
    robots: int
    team: str

    @property
    def formula(self) -> str:
        """What is asked."""
        return self.pattern.joint if self.team == "joint" else self.pattern.one

    @property
    def mission(self) -> Mission:
        """The world with this formula and these robots, and what lies near a region only where the formula speaks of it."""
        text = PAGE.read_text(encoding="utf-8")
        world = yaml.safe_load(text.split("```yaml\n")[1].split("```")[0])
        world["spec"] = {"formula": self.formula, "trace": self.pattern.trace, "team": self.team}
        world["agents"] = dict(list(world["agents"].items())[: self.robots])
        world["regions"] = {
            name: body for name, body in world["regions"].items() if not name.startswith("near_") or name in self.formula
        }
        return parse_mission(yaml.safe_dump(world, sort_keys=False))

    def __str__(self) -> str:
        return f"{self.pattern.name.replace(' ', '_')}-{self.robots}-{self.team}"


def patterns() -> list[Pattern]:
    """Return the rows of all tables of the page."""
    found: list[Pattern] = []
    columns: list[str] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if cells and cells[0] == "pattern":
            columns = cells
        elif cells and columns and not cells[0].startswith("---"):
            row = dict(zip(columns, cells, strict=True))
            trace = "infinite" if "means for ever" in row else "finite"
            one, joint = row["one robot"].strip("`"), row["joint"].strip("`")
            found.append(Pattern(row["pattern"], one, row["own"] == "yes", joint, trace, tuple(row["flown"].split())))
        elif not cells:
            columns = []
    return found


def cases() -> list[Case]:
    """Return all patterns for one to four robots, as far as they are meant for so many."""
    found: list[Case] = []
    for pattern in patterns():
        found += [Case(pattern, 1, "own")] if pattern.one else []
        for robots in (2, 3, 4):
            found += [Case(pattern, robots, "own")] if pattern.own else []
            found += [Case(pattern, robots, "joint")] if pattern.joint else []
    return found
