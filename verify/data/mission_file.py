"""Mission files: YAML in, `Mission` out, with every fault at once and each at its line.

Two passes. Every section, and every entry of a table of entries, is validated on its own, so one mistake does
not hide the next; then whatever is sound is held against the rest (names, starts, edges, limits).
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, TypeAdapter, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from verify.data.errors import BadInput, did_you_mean
from verify.data.mission import (
    Action,
    Agent,
    Box,
    Environment,
    Hoop,
    LegLimits,
    Limits,
    Mission,
    Planner,
    Region,
    Robot,
    Spec,
)
from verify.data.rules.missions import broken_rules
from verify.data.shapes.region_shapes import REGION_SHAPES
from verify.data.storage.reading import read_text
from verify.data.storage.strict_yaml import MAX_DEPTH, MAX_NODES, NotAccepted, load_tree
from verify.data.value import FaultsWithin, Remembered, plain
from verify.data.vehicle import Vehicle

MAX_BYTES = 1_000_000
MOST = 10**18
"""Greatest whole number that is read; nothing in a mission comes near it."""

KeyPath = tuple[str | int, ...]

_SECTIONS: dict[tuple[str, ...], type[BaseModel]] = {
    ("spec",): Spec,
    ("hoops", "*"): Hoop,
    ("regions", "*"): Region,
    ("environment",): Environment,
    ("robot",): Robot,
    ("robot", "actions", "*"): Action,
    ("agents", "*"): Agent,
    ("vehicle",): Vehicle,
    ("limits",): Limits,
    ("limits", "legs", "*"): LegLimits,
    ("workspace",): Box,
    ("planner",): Planner,
}


@dataclass(frozen=True, slots=True)
class Fault:
    """One mistake in a mission file.

    Attributes:
        keys: Where, as keys and indices.
        line: Line of the file, from 1; None where the mission did not come from a file.
        reason: What is wrong and what would be right.
    """

    keys: KeyPath
    line: int | None
    reason: str


class MissionError(BadInput):
    """A mission that cannot be accepted; carries all its faults."""

    def __init__(self, source: str, faults: list[Fault]) -> None:
        self.source = source
        self.faults = tuple(sorted(faults, key=lambda f: (f.line or 0, [str(k) for k in f.keys])))
        lines = []
        for fault in self.faults:
            where = source if fault.line is None else f"{source}:{fault.line}"
            keys = ".".join(map(str, fault.keys))
            lines.append(f"{where}: {keys + ': ' if keys else ''}{fault.reason}")
        super().__init__("\n".join(lines))


def load_mission_file(source: str | os.PathLike[str], *, installed: bool = True) -> Mission:
    """Read a mission from a file.

    Args:
        source: The file.
        installed: Whether the planning method and the cost terms that it names must be there. What was planned already is judged
            without them.

    Raises:
        MissionError: All faults of the file, each with its line and keys.
        BadInput: There is no such file, or it is too large or unreadable.
    """
    text = read_text(source, most=MAX_BYTES, what="mission file")
    return parse_mission(text, str(source), installed=installed)


def parse_mission(text: str, source: str = "mission", *, installed: bool = True) -> Mission:
    """Read a mission from YAML text.

    Args:
        text: The file's contents.
        source: Names it in messages.
        installed: Whether the planning method and the cost terms that it names must be there.

    Raises:
        MissionError: All faults, each with its line and keys.
        BadInput: It is no table of keys at all.
    """
    tree = _compose(text, source)
    lines: dict[KeyPath, int] = {}
    data = _plain(tree, (), lines, source)
    values, faults = _sections(data)
    found = [Fault(keys, _line(lines, keys), reason) for keys, reason in faults]
    with np.errstate(all="ignore"):  # absurd numbers end as infinities, which lie outside of everything
        found += [Fault(keys, _line(lines, keys), reason) for keys, reason in broken_rules(values, data, installed=installed)]
    if found:
        raise MissionError(source, found)
    return Mission.model_validate(values)


_SOUND = {to_plan: Remembered() for to_plan in (False, True)}


def check_mission(mission: Mission, *, to_plan: bool = True) -> Mission:
    """Return the mission after the same checks that a file undergoes, for missions built or changed in code.

    What is returned is the mission that its fields say, whatever was put into it behind its back.

    Args:
        mission: What claims to be one.
        to_plan: Whether it is to be planned. A flight that is there already can be judged and flown by a mission that asks
            for nothing, whose starts, ends and hoops leave no room, or whose planning method is not installed.

    Raises:
        MissionError: All faults, with keys but without lines.
        BadInput: It is no mission at all.
    """
    if not isinstance(mission, Mission):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"A mission is a Mission, not {type(mission).__name__}; `ltlplan.load_mission` reads one.")
    data = plain(mission)
    if data in _SOUND[to_plan]:
        return mission.model_copy()
    data = _without_none(data)
    values, faults = _sections(data)
    with np.errstate(all="ignore"):
        broken = broken_rules(values, data, to_plan=to_plan, installed=to_plan)
        found = [Fault(keys, None, reason) for keys, reason in [*faults, *broken]]
    if found:
        name = data.get("name")
        raise MissionError(name if isinstance(name, str) and name else "mission", found)
    sound = Mission.model_validate(values)
    _SOUND[to_plan].add(plain(sound))
    return sound


def _without_none(value: Any) -> Any:
    """Leave out what is None: in a mission that says the same as leaving it out."""
    return {key: _without_none(part) for key, part in value.items() if part is not None} if isinstance(value, dict) else value


def mission_to_yaml(mission: Mission) -> str:
    """Return the resolved mission as YAML that reads back as the same mission."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # ruamel declares it as None
    yaml.width = 120
    buffer = io.StringIO()
    buffer.write("# A resolved mission: every default, region matrix and vehicle number is written out.\n")
    yaml.dump(mission.resolved(), buffer)
    return buffer.getvalue()


def _compose(text: str, source: str) -> Any:
    """Parse YAML 1.2 without aliases, refusing what could not be a mission."""
    if not text.strip():
        raise BadInput(f"{source} is empty; `ltlplan missions --new NAME` writes a mission to start from.")
    try:
        tree = load_tree(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = None if mark is None else mark.line + 1
        problem = " ".join(str(part) for part in (error.context, error.problem) if part)
        raise MissionError(source, [Fault((), line, f"this is no YAML: {problem.splitlines()[0]}.")]) from None
    except NotAccepted as error:
        raise MissionError(source, [Fault((), error.line, error.reason)]) from None
    except YAMLError as error:
        raise BadInput(f"{source} is no YAML: {str(error).splitlines()[0]}") from None
    except RecursionError:
        raise BadInput(f"{source} is no mission file: it is nested too deeply.") from None
    except (ValueError, OverflowError) as error:
        raise BadInput(f"{source} is no mission file: {str(error).splitlines()[0]}.") from None
    if not isinstance(tree, CommentedMap):
        raise BadInput(f"{source} is no mission: the file must be a table of keys such as `name:` and `agents:`.")
    return tree


def _plain(node: Any, keys: KeyPath, lines: dict[KeyPath, int], source: str, budget: list[int] | None = None) -> Any:
    """Turn ruamel's tree into plain values and note the line of every key."""
    budget = [MAX_NODES] if budget is None else budget
    budget[0] -= 1
    if budget[0] < 0 or len(keys) > MAX_DEPTH:
        raise BadInput(f"{source} is no mission file: it has too many or too deeply nested values.")
    if isinstance(node, CommentedMap):
        result: dict[str, Any] = {}
        for key, value in node.items():
            if not isinstance(key, str):
                line = node.lc.key(key)[0] + 1
                raise MissionError(source, [Fault((*keys, str(key)), line, "a key must be text; put it in quotes.")])
            lines[(*keys, key)] = node.lc.key(key)[0] + 1
            result[str(key)] = _plain(value, (*keys, key), lines, source, budget)
        return result
    if isinstance(node, CommentedSeq):
        items: list[Any] = []
        for index, value in enumerate(node):
            lines[(*keys, index)] = node.lc.item(index)[0] + 1
            items.append(_plain(value, (*keys, index), lines, source, budget))
        return items
    if isinstance(node, bool) or node is None:
        return node
    if isinstance(node, int) and abs(node) > MOST:
        reason = f"a whole number beyond {MOST:.0e} is no number of a mission."
        raise MissionError(source, [Fault(keys, _line(lines, keys), reason)])
    for kind in (int, float, str):  # ruamel's scalars remember how they were written; we do not
        if isinstance(node, kind):
            return kind(node)
    return str(node)  # a date, say: text to the schema, which then says what it wants


def _line(lines: dict[KeyPath, int], keys: KeyPath) -> int | None:
    """Return the line of the deepest key of `keys` that stands in the file."""
    for length in range(len(keys), 0, -1):
        if keys[:length] in lines:
            return lines[keys[:length]]
    return 1 if lines else None


def _sections(data: dict[str, Any]) -> tuple[dict[str, Any], list[tuple[KeyPath, str]]]:
    """Validate each section by itself; return the sound ones and the faults of the others."""
    faults: list[tuple[KeyPath, str]] = []
    values: dict[str, Any] = {}
    fields = Mission.model_fields
    for key in data:
        if key not in fields:
            faults.append(((key,), f"unknown key.{did_you_mean(key, fields)} Known here: {', '.join(fields)}."))
    for name in ("format", *(n for n, field in fields.items() if field.is_required())):
        if name not in data:
            faults.append(((name,), f"missing: {fields[name].description or 'required'}."))
    for key, field in fields.items():
        if key not in data:
            continue
        if key in ("hoops", "regions", "agents") and isinstance(data[key], dict) and data[key]:
            entry_type = field.annotation.__args__[1]  # type: ignore[union-attr]  # dict[str, entry]
            adapter: TypeAdapter[Any] = TypeAdapter(entry_type)
            values[key] = {}
            for name, raw in data[key].items():
                _validate(adapter, raw, (key, name), values[key], name, faults)
        else:
            whole: TypeAdapter[Any] = TypeAdapter(Annotated[field.annotation, field])  # pyright: ignore[reportArgumentType, reportInvalidTypeForm]  # built at run time
            _validate(whole, data[key], (key,), values, key, faults)
    return values, faults


def _validate(
    adapter: TypeAdapter[Any], raw: Any, keys: KeyPath, into: dict[str, Any], name: str, faults: list[tuple[KeyPath, str]]
) -> None:
    try:
        into[name] = adapter.validate_python(raw)
    except ValidationError as error:
        faults.extend(_readable(error, keys))


def _readable(error: ValidationError, keys: KeyPath) -> Iterator[tuple[KeyPath, str]]:
    """Turn pydantic's findings into sentences."""
    seen: set[tuple[KeyPath, str]] = set()
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
            case "missing":
                reason = "missing: this key is required."
            case "value_error":
                where = (*where[:-1], within.key) if isinstance(within, FaultsWithin) else where
                reason = message.removeprefix("Value error, ").rstrip(".") + "."
            case "too_long" | "too_short" if isinstance(value, list | tuple | dict):
                limits = item.get("ctx", {})
                most, least = limits.get("max_length"), limits.get("min_length")
                wanted = f"at least {least}" if most is None else f"{most}"
                reason = (
                    f"must have {wanted} {'entry' if wanted.endswith(' 1') else 'entries'}, not {len(value)}: {_short(value)}."
                )
            case "tuple_type" | "list_type" | "dict_type" | "model_type" | "string_type" | "bool_type" as kind:
                reason = f"must be {_WANTED[kind]}, not {_short(value)}."
            case "string_pattern_mismatch" if keys[-1] == "name":
                reason = (
                    f"must begin with a letter or digit and hold letters, digits, `_ . -` and spaces only, not {_short(value)}."
                )
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
    """Tell whether a location part is pydantic's name of a union member rather than a key."""
    return isinstance(part, str) and (part.startswith(("tuple[", "literal[", "function-", "lax-or-strict")))


def _known_keys(where: KeyPath) -> tuple[str, ...]:
    """Return the keys that the section at `where` accepts."""
    for pattern, model in _SECTIONS.items():
        if len(pattern) == len(where) and all(p in ("*", k) for p, k in zip(pattern, where, strict=True)):
            known = tuple(field.alias or name for name, field in model.model_fields.items())
            return (*known, *(key for key in REGION_SHAPES.names() if key not in known)) if issubclass(model, Region) else known
    if len(where) == 3 and where[0] in ("hoops", "regions") and where[2] in REGION_SHAPES.names():
        return tuple(getattr(REGION_SHAPES.find(str(where[2])).schema, "model_fields", ()))
    return ()


def _short(value: Any) -> str:
    text = {None: "nothing", True: "true", False: "false"}[value] if value is None or isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
