"""The values between stages as bytes and back, bit for bit: JSON for what is said, arrays as they are, and nothing is evaluated.

    zip: value.json, 0.npy, 1.npy, ...

What is not plain in JSON is an object with the key "$", which names one of the kinds below; other names are rejected. A value of ours is
written by its own fields, so that a new field is stored as soon as its class has it; a mission is written as its file is.
"""

from __future__ import annotations

import dataclasses
import io
import json
import zipfile
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from verify.data import InternalError, Mission, Plan
from verify.data.plan import plan_from_json
from verify.data.value import Value

Array = NDArray[Any]  # of any type: what a value holds

_KIND = "$"
_TEXT = "value.json"


def to_bytes(value: object) -> bytes:
    """Return a value as bytes; the same value gives the same bytes.

    Raises:
        InternalError: It holds what has no written form.
    """
    arrays: list[Array] = []
    text = json.dumps(_plain(value, arrays), separators=(",", ":"))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr(zipfile.ZipInfo(_TEXT), text, zipfile.ZIP_DEFLATED)
        for index, array in enumerate(arrays):
            part = io.BytesIO()
            np.lib.format.write_array(part, np.ascontiguousarray(array), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{index}.npy"), part.getvalue(), zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def from_bytes(data: bytes) -> Any:  # the kind of value is in the bytes
    """Return the value that bytes were made of.

    Raises:
        InternalError: They were not made by `to_bytes` of this version.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = archive.namelist()
            arrays = [_array(archive.read(f"{index}.npy")) for index in range(len(names) - 1)]
            return _value(json.loads(archive.read(_TEXT)), arrays)
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError, IndexError) as error:
        raise InternalError(f"A stored value cannot be read: {error}.") from None


def _array(data: bytes) -> Array:
    array = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
    array.setflags(write=False)
    return array


def _plain(value: Any, arrays: list[Array]) -> Any:
    """Return what JSON can say of a value; arrays are put aside and named by their index."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int | float):
        return value if type(value) in (int, float) else (float(value) if isinstance(value, float) else int(value))
    if isinstance(value, dict):
        items = cast("dict[str, Any]", value)
        return {_KIND: "dict", "items": [[_plain(key, arrays), _plain(item, arrays)] for key, item in items.items()]}
    if isinstance(value, list):
        return [_plain(item, arrays) for item in cast("list[Any]", value)]
    if isinstance(value, tuple):
        return {_KIND: "tuple", "items": [_plain(item, arrays) for item in cast("tuple[Any, ...]", value)]}
    if isinstance(value, frozenset):
        items = [_plain(item, arrays) for item in cast("frozenset[Any]", value)]
        return {_KIND: "set", "items": sorted(items, key=json.dumps)}  # its elements may be of kinds that have no order
    if isinstance(value, Fraction):
        return {_KIND: "fraction", "value": str(value)}
    if isinstance(value, np.ndarray):
        arrays.append(cast(Array, value))
        return {_KIND: "array", "index": len(arrays) - 1}
    if isinstance(value, np.generic):
        return _plain(value.item(), arrays)
    return _object(value, arrays)


def _object(value: Any, arrays: list[Array]) -> dict[str, Any]:
    """Return what JSON can say of a value of ours: its fields, by name."""
    kind = type(value)
    if kind is Mission:
        return {_KIND: Mission.__name__, "data": value.resolved()}
    if stored_classes().get(kind.__name__) is not kind:
        raise InternalError(f"A {kind.__name__} has no written form.")
    return {_KIND: kind.__name__, "fields": {name: _plain(getattr(value, name), arrays) for name in fields_of(kind)}}


def fields_of(kind: type[Any]) -> tuple[str, ...]:
    """Return the names of the fields that a value of ours is made of.

    Args:
        kind: Its class: a dataclass, or one of `verify.data.value`.
    """
    return tuple(kind.model_fields) if issubclass(kind, Value) else tuple(field.name for field in dataclasses.fields(kind))


def _value(data: Any, arrays: list[Array]) -> Any:
    if isinstance(data, list):
        return [_value(item, arrays) for item in cast("list[Any]", data)]
    if not isinstance(data, dict):
        return data
    parts = cast("dict[str, Any]", data)
    kind = parts[_KIND]
    if kind in _READERS:
        return _READERS[kind](parts, arrays)
    if kind in stored_classes():
        return stored_classes()[kind](**{name: _value(part, arrays) for name, part in parts["fields"].items()})
    raise InternalError(f"A stored value is of an unknown kind, {kind!r:.80}.")


def _items(parts: dict[str, Any], arrays: list[Array]) -> list[Any]:
    return [_value(item, arrays) for item in parts["items"]]


def _read_plan(parts: dict[str, Any], arrays: list[Array]) -> Plan:
    if "text" in parts:  # as ltlplan 0.2.0 wrote it, whose jobs go on after an upgrade
        return plan_from_json(parts["text"], _value(parts["mission"], arrays), "a stored plan")
    return Plan(**{name: _value(part, arrays) for name, part in parts["fields"].items()})


def _read_draft(parts: dict[str, Any], arrays: list[Array]) -> Any:
    """Return the candidate that ltlplan 0.2.0 stored as a draft, whose jobs go on: its plan, and the counterexamples to it."""
    from ltlplan.pipeline import Candidate, Cut

    plan, rounds, witnesses, certified = (
        _value(parts["fields"][name], arrays) for name in ("plan", "rounds", "witnesses", "certified")
    )
    cut = Cut("waits", "Refused by an earlier version.", rounds, witnesses=witnesses)
    return Candidate(plan, (cut,) if witnesses else (), rounds, certified)


_READERS: dict[str, Callable[[dict[str, Any], list[Array]], Any]] = {
    "dict": lambda parts, arrays: {_value(key, arrays): _value(item, arrays) for key, item in parts["items"]},
    "tuple": lambda parts, arrays: tuple(_items(parts, arrays)),
    "set": lambda parts, arrays: frozenset(_items(parts, arrays)),
    "fraction": lambda parts, _arrays: Fraction(parts["value"]),
    "array": lambda parts, arrays: arrays[parts["index"]],
    "Mission": lambda parts, _arrays: Mission.model_validate(parts["data"]),
    "Plan": _read_plan,
    "Draft": _read_draft,
}


@cache
def stored_classes() -> dict[str, type[Any]]:
    """Return the classes whose values may be stored besides missions, by name."""
    from flight import FlightLog
    from flight.logs.log import Event
    from ltlplan.pipeline import Candidate, Certified, Cut
    from verify import Certificate, Claim
    from verify.certificate import ActionInstant
    from verify.claims.soft_claims import SoftClaim
    from verify.data import Trajectory, Witness, Word
    from verify.data.obstruction import Obstruction
    from verify.data.plan import Hover, Meeting, Precedence, RobotPlan, Visit, Waypoint
    from verify.data.sections import Action
    from verify.model_checking.timeline import Change, Enclosure, InternalChange, Timeline

    known = (
        Action, ActionInstant, Candidate, Certificate, Certified, Change, Claim, Cut, Enclosure, Event, FlightLog, Hover, InternalChange,
        Meeting, Obstruction, Plan, Precedence, RobotPlan, SoftClaim, Timeline, Trajectory, Visit, Waypoint, Witness, Word,
    )  # fmt: skip
    return {kind.__name__: kind for kind in known}
