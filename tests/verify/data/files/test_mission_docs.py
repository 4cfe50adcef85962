"""docs/missions.md is held against the schema; `python -m tests.verify.data.files.test_mission_docs` rewrites its tables."""

import re
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from verify.data import parse_mission
from verify.data.disturbance import Disturbance, StreamedSetpoints, Unrest
from verify.data.frame import Frame
from verify.data.mission import Mission
from verify.data.sections import Action, Agent, Box, Edge, Environment, LegLimits, Limits, Planner, Robot, SoftPart, Spec
from verify.data.shapes.inequalities import Inequality
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop, Region
from verify.data.uncertain import Uncertain
from verify.data.vehicle import Vehicle

PAGE = Path(__file__).parents[4] / "docs" / "missions.md"
SECTIONS: tuple[tuple[str, type[BaseModel]], ...] = (
    ("Top level", Mission),
    ("`spec`", Spec),
    ("`spec.soft[]`", SoftPart),
    ("`regions.NAME`", Region),
    ("`regions.NAME.parts[][]`", Inequality),
    ("`hoops.NAME` (a region's keys, and)", Hoop),
    ("`obstacles.NAME` (a region's keys, and)", Obstacle),
    ("`environment`", Environment),
    ("`environment.edges[]`, closed to some", Edge),
    ("`robot`", Robot),
    ("`robot.actions[]`", Action),
    ("`agents.NAME`", Agent),
    ("`limits`", Limits),
    ("`limits.legs.REGION`", LegLimits),
    ("`workspace`", Box),
    ("`frame`", Frame),
    ("`disturbance`", Disturbance),
    ("`disturbance.rest`", Unrest),
    ("`disturbance.setpoints`", StreamedSetpoints),
    ("`planner`", Planner),
    ("`vehicle` (inline table)", Vehicle),
    ("`vehicle.uncertain`", Uncertain),
)


def tables() -> str:
    parts = []
    for title, model in SECTIONS:
        skip = set(Region.model_fields) if model in (Hoop, Obstacle) else set()
        rows = [f"### {title}", "", "| key | type | default | meaning |", "|---|---|---|---|"]
        for name, field in model.model_fields.items():
            if name not in skip:
                default = "required" if field.is_required() or name == "format" else show_default(field)
                rows.append(
                    f"| `{field.alias or name}` | {show_type(field.annotation)} | {default} | {field.description or ''} |"
                )
        parts.append("\n".join(rows))
    return "\n\n".join(parts)


def plural(text: str) -> str:
    """Return "lists of 3 numbers" for "list of 3 numbers", and so on."""
    first, _, rest = text.partition(" ")
    many = first if first.endswith("s") else first.removesuffix("y") + "ies" if first.endswith("y") else first + "s"
    return many + (" " + rest if rest else "")


def show_type(annotation: Any) -> str:
    origin, arguments = get_origin(annotation), [a for a in get_args(annotation) if a is not Ellipsis]
    if hasattr(annotation, "__metadata__"):
        return show_type(arguments[0])
    if annotation is type(None):
        return ""
    if origin is tuple:
        count = f"{len(arguments)} " if len(arguments) > 1 else ""
        return f"list of {count}{plural(show_type(arguments[0]))}"
    if origin is dict:
        return f"table of {plural(show_type(arguments[1]))}"
    if origin is not None and arguments and all(isinstance(a, (str, int)) for a in arguments):
        return " or ".join(f"`{a}`" for a in arguments)
    if arguments:
        return " or ".join(text for text in map(show_type, arguments) if text)
    return {float: "number", int: "whole number", str: "text", bool: "yes/no"}.get(
        annotation, annotation.__name__.lower().removeprefix("leg") if annotation is not Edge else "table"
    )


def show_default(field: Any) -> str:
    value = field.get_default(call_default_factory=True)
    if value is None:
        return "none"
    if isinstance(value, BaseModel):
        return "see below"
    return f"`{value}`" if value not in ({}, ()) else "empty"


def rewritten(text: str) -> str:
    before, _, rest = text.partition("## Keys\n")
    after = rest[rest.index("## Rules that span") :]
    return f"{before}## Keys\n\n{tables()}\n\n{after}"


def test_the_tables_are_the_schema() -> None:
    assert PAGE.read_text() == rewritten(PAGE.read_text())


def test_the_example_is_a_mission() -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert parse_mission(example).name == "firefighting"


if __name__ == "__main__":
    PAGE.write_text(rewritten(PAGE.read_text()))
