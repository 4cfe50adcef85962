"""Faults of missions: where each stands, what is wrong and what would be right; first of all those of single sections.

Every section is validated on its own, so that one mistake does not hide the next.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from verify.data.airframe import AirframeTable
from verify.data.disturbance import Disturbance, StreamedSetpoints, Unrest
from verify.data.errors import BadInput, did_you_mean
from verify.data.frame import Frame
from verify.data.sections import Action, Agent, Box, Edge, Environment, LegLimits, Limits, Planner, Robot, SoftPart, Spec
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.placed_body import PlacedBody
from verify.data.shapes.region import Hoop, Region
from verify.data.shapes.region_shapes import REGION_SHAPES
from verify.data.value import FaultsWithin
from verify.data.vehicle import Vehicle

KeyPath = tuple[str | int, ...]
Finding = tuple[KeyPath, str]

MOST_OBSTACLES = 1000
"""So many are measured, and held against starts, hoops and regions, within about a second; each may have many parts."""

_SECTIONS: dict[tuple[str, ...], type[BaseModel]] = {
    ("spec",): Spec,
    ("spec", "soft", "*"): SoftPart,
    ("hoops", "*"): Hoop,
    ("regions", "*"): Region,
    ("obstacles", "*"): Obstacle,
    ("environment",): Environment,
    ("robot",): Robot,
    ("robot", "actions", "*"): Action,
    ("robots", "*"): Robot,
    ("robots", "*", "actions", "*"): Action,
    ("environment", "edges", "*"): Edge,
    ("agents", "*"): Agent,
    ("agents", "*", "vehicle"): Vehicle,
    ("agents", "*", "limits"): Limits,
    ("agents", "*", "limits", "legs", "*"): LegLimits,
    ("vehicle",): Vehicle,
    ("limits",): Limits,
    ("limits", "legs", "*"): LegLimits,
    ("workspace",): Box,
    ("frame",): Frame,
    ("planner",): Planner,
    ("disturbance",): Disturbance,
    ("disturbance", "airframe"): AirframeTable,
    ("disturbance", "rest"): Unrest,
    ("disturbance", "setpoints"): StreamedSetpoints,
}


@dataclass(frozen=True, slots=True)
class Fault:
    """One mistake in a mission file.

    Attributes:
        keys: Where, as keys and indices.
        line: Line of the file, from 1; None where the mission did not come from a file.
        reason: What is wrong and what would be right.
        file: Another file than the mission's own, which includes it; None for the mission's.
    """

    keys: KeyPath
    line: int | None
    reason: str
    file: str | None = None


class MissionError(BadInput):
    """A mission that cannot be accepted; carries all its faults."""

    def __init__(self, source: str, faults: list[Fault]) -> None:
        self.source = source
        self.faults = tuple(sorted(faults, key=lambda f: (f.file or "", f.line or 0, [str(k) for k in f.keys])))
        lines = []
        for fault in self.faults:
            where = (fault.file or source) + ("" if fault.line is None else f":{fault.line}")
            keys = ".".join(map(str, fault.keys))
            lines.append(f"{where}: {keys + ': ' if keys else ''}{fault.reason}")
        super().__init__("\n".join(lines))


def sound_sections(
    data: Mapping[str, Any],  # of any type: what a mission file may hold
    fields: Mapping[str, FieldInfo],
) -> tuple[dict[str, Any], list[Finding]]:  # of any type: each section has its own
    """Validate each section, and each entry of a table of entries, by itself.

    Args:
        data: The mission as plain data, by key.
        fields: The mission's fields, by key.

    Returns:
        The sound sections, and what is wrong with the others.
    """
    faults: list[Finding] = []
    values: dict[str, Any] = {}
    for key in data:
        if key not in fields:
            faults.append(((key,), f"unknown key.{did_you_mean(key, fields)} Known here: {', '.join(fields)}."))
    for name in ("format", *(n for n, field in fields.items() if field.is_required())):
        if name not in data:
            faults.append(((name,), f"missing: {fields[name].description or 'required'}."))
    for key, field in fields.items():
        if key not in data:
            continue
        if key == "obstacles" and isinstance(data[key], dict) and len(data[key]) > MOST_OBSTACLES:
            reason = f"{len(data[key])} obstacles; {MOST_OBSTACLES} is the most. What belongs together may be one obstacle, a `union`."
            faults.append(((key,), reason))
            continue
        if key in ("hoops", "regions", "obstacles", "agents", "robots") and isinstance(data[key], dict) and data[key]:
            table = field.annotation if field.is_required() or field.default is not None else field.annotation.__args__[0]  # type: ignore[union-attr]  # dict[str, entry], or that or None
            entry_type = table.__args__[1]  # type: ignore[union-attr]
            adapter: TypeAdapter[Any] = TypeAdapter(entry_type)
            values[key] = {}
            for name, raw in data[key].items():
                _validate(adapter, raw, (key, name), values[key], name, faults)
        else:
            whole: TypeAdapter[Any] = TypeAdapter(Annotated[field.annotation, field])  # pyright: ignore[reportArgumentType, reportInvalidTypeForm]  # built at run time
            _validate(whole, data[key], (key,), values, key, faults)
    return values, faults


def _validate(
    adapter: TypeAdapter[Any], raw: Any, keys: KeyPath, into: dict[str, Any], name: str, faults: list[Finding]
) -> None:
    try:
        into[name] = adapter.validate_python(raw)
    except ValidationError as error:
        faults.extend(_readable(error, keys))


def _readable(error: ValidationError, keys: KeyPath) -> Iterator[Finding]:
    """Turn pydantic's findings into sentences."""
    seen: set[Finding] = set()
    for item in error.errors():
        where = (*keys, *(part for part in item["loc"] if not _is_type_name(part)))
        message, value = item["msg"], item.get("input")
        within = item.get("ctx", {}).get("error")
        if isinstance(within, FaultsWithin) and not isinstance(within.found, str):
            yield from _readable(within.found, (*where[:-1], within.key))
            continue
        match item["type"]:
            case "extra_forbidden":
                known = _known_keys(where[:-1])
                reason = f"unknown key.{did_you_mean(str(where[-1]), known)}" + (
                    f" Known here: {', '.join(known)}." if known else ""
                )
            case "missing" if isinstance(item["loc"][-1], int):
                ends = [
                    each["loc"][-1]
                    for each in error.errors()
                    if each["type"] == "missing" and each["loc"][:-1] == item["loc"][:-1]
                ]
                where, reason = where[:-1], f"must have {int(ends[-1]) + 1} entries, not {len(value or ())}: {_short(value)}."
            case "missing":
                reason = "missing: this key is required."
            case "value_error":
                where = (*where[:-1], within.key) if isinstance(within, FaultsWithin) else where
                reason = message.removeprefix("Value error, ").rstrip(".") + "."
            case "too_long" | "too_short" if isinstance(value, list | tuple | dict):
                limits = item.get("ctx", {})
                most, least = limits.get("max_length"), limits.get("min_length", 0)
                if most is None and len(value) >= least:
                    continue  # its entries have faults of their own
                wanted = f"at least {least}" if most is None else f"at most {most}" if most > 3 else f"{most}"
                reason = (
                    f"must have {wanted} {'entry' if wanted.endswith(' 1') else 'entries'}, not {len(value)}: {_short(value)}."
                )
            case "tuple_type" | "list_type" | "dict_type" | "model_type" | "string_type" | "bool_type" as kind:
                reason = f"must be {_WANTED[kind]}, not {_short(value)}."
            case "float_parsing" | "float_type" if where == ("margin",):
                reason = f"must be a number, in m, or `auto` beside `disturbance`, not {_short(value)}."
            case "string_pattern_mismatch" if keys[-1] == "name":
                reason = (
                    f"must begin with a letter or digit and hold letters, digits, `_ . -` and spaces only, not {_short(value)}."
                )
            case "greater_than" | "greater_than_equal" | "less_than" | "less_than_equal":
                reason = f"{message[0].lower()}{message[1:]}, not {_short(value)}{_meaning(where)}."
            case _:
                reason = f"{message[0].lower()}{message[1:]}, not {_short(value)}."
        if (where, reason) not in seen:
            seen.add((where, reason))
            yield where, reason


_WANTED = {
    "tuple_type": "a list, such as [1, 2]",
    "list_type": "a list, such as [1, 2]",
    "dict_type": "a table of keys, such as {key: value}",
    "model_type": "a table of keys, such as {key: value}",
    "string_type": "text (in quotes, where YAML would read a number or a truth value)",
    "bool_type": "true or false",
}


def _is_type_name(part: str | int) -> bool:
    """Return whether a location part is pydantic's name of a union member rather than a key."""
    return isinstance(part, str) and (part.startswith(("tuple[", "literal[", "function-", "lax-or-strict")))


def _section_at(where: KeyPath) -> type[BaseModel] | None:
    """Return the section at `where`; None where there is no fixed one."""
    for pattern, model in _SECTIONS.items():
        if len(pattern) == len(where) and all(p in ("*", k) for p, k in zip(pattern, where, strict=True)):
            return model
    return None


def _meaning(where: KeyPath) -> str:
    """Return the unit and meaning of a number, in brackets; empty where they are not known."""
    keys = where[:-1] if isinstance(where[-1], int) else where  # an entry of a list means what the list does
    section = _section_at(keys[:-1])
    field = None if section is None else section.model_fields.get(str(keys[-1]))
    return f" ({field.description})" if field is not None and field.description else ""


def _known_keys(where: KeyPath) -> tuple[str, ...]:
    """Return the keys that the section at `where` accepts."""
    if (model := _section_at(where)) is not None:
        known = tuple(field.alias or name for name, field in model.model_fields.items())
        more = REGION_SHAPES.names() if issubclass(model, PlacedBody) else ()
        return (*known, *(key for key in more if key not in known))
    if len(where) == 3 and where[0] in ("hoops", "regions", "obstacles") and where[2] in REGION_SHAPES.names():
        return tuple(getattr(REGION_SHAPES.find(str(where[2])).schema, "model_fields", ()))
    return ()


def _short(value: Any) -> str:
    text = {None: "nothing", True: "true", False: "false"}[value] if value is None or isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
