"""Values of several fields: frozen, without unknown keys, changed by making a new one, and told from what only looks like one.

Python can make a value without validating it (`model_copy(update=...)`, `model_construct`, `object.__setattr__`), and can
change one that was validated. The doors of the library therefore look at every value again; what was found sound once is
remembered by its contents, so that looking costs a fraction of a millisecond.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from verify.data.errors import BadInput, did_you_mean

_REMEMBERED = 1024
_SIMPLE = {float, int, str, bool, type(None)}


class FaultsWithin(ValueError):
    """Faults of what stands under one key of a value, for validators that read the key themselves.

    Attributes:
        key: Where it stands.
        found: What is wrong with it: a sentence, or pydantic's findings.
    """

    def __init__(self, key: str, found: str | ValidationError) -> None:
        self.key = key
        self.found = found
        sentences = [found] if isinstance(found, str) else faults_of(found, key)
        super().__init__(" ".join(sentences))


class Value(BaseModel):
    """A frozen value that knows no other fields than its own."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    computed_from: ClassVar[dict[str, tuple[str, ...]]] = {}
    """Fields that are computed where they are not given, and the fields that they are computed from."""

    def changed(self, **fields: Any) -> Self:  # of any type: pydantic looks at them
        """Return a new value with some fields replaced, validated like any other; what is computed from them is computed anew.

        Raises:
            BadInput: There is no such field, or the new value is not allowed; all faults are listed.
        """
        self._require_fields(fields)
        stale = {
            name for name, sources in self.computed_from.items() if name not in fields and not fields.keys().isdisjoint(sources)
        }
        kept = {name: getattr(self, name) for name in self.model_fields_set - stale}
        try:
            return type(self).model_validate({**kept, **fields})
        except ValidationError as error:
            raise BadInput("\n".join(faults_of(error, type(self).__name__))) from None

    def _require_fields(self, fields: dict[str, Any]) -> None:
        known = type(self).model_fields
        for name in fields:
            if name not in known:
                raise BadInput(
                    f"A {type(self).__name__} has no field '{name}'.{did_you_mean(name, known)} Fields: {', '.join(known)}."
                )


def faults_of(error: ValidationError, owner: str) -> list[str]:
    """Return pydantic's findings about a value as sentences."""
    found: list[str] = []
    for item in error.errors(include_url=False):
        within = item.get("ctx", {}).get("error")
        if isinstance(within, FaultsWithin):
            found.append(f"{owner}.{within}" if not isinstance(within.found, str) else f"{owner}.{within.key}: {within}")
            continue
        where = ".".join(str(part) for part in item["loc"])
        reason = item["msg"].removeprefix("Value error, ").rstrip(".")
        value = "" if item["type"] in ("missing", "value_error") else f", not {item.get('input')!r:.60}"
        found.append(f"{owner}{'.' + where if where else ''}: {reason}{value}.")
    return list(dict.fromkeys(found))


def plain(value: BaseModel) -> dict[str, Any]:  # of any type: what fields may hold
    """Return what a value holds, whatever that is, as plain data under the names of its file format.

    Raises:
        BadInput: It holds what cannot even be looked at.
    """
    try:
        return value.model_dump(mode="python", by_alias=True, warnings=False)
    except Exception as error:
        raise BadInput(f"This is no {type(value).__name__}: {error}.") from None


class Remembered:
    """Contents that were found sound, by their digests; the oldest are forgotten."""

    def __init__(self) -> None:
        self._values: OrderedDict[bytes, int] = OrderedDict()

    def knows(self, value: BaseModel, data: Mapping[str, object]) -> bool:
        """Return whether a value was found sound, and holds values where that one did: a table in the place of one looks the same.

        Args:
            value: What is looked at.
            data: The same as plain data.
        """
        digest = _digest(data)
        if self._values.get(digest) != _values_within(value):
            return False
        self._values.move_to_end(digest)
        return True

    def add(self, value: BaseModel) -> None:
        """Remember a sound value."""
        self._values[_digest(plain(value))] = _values_within(value)
        while len(self._values) > _REMEMBERED:
            self._values.popitem(last=False)


def _values_within(value: BaseModel) -> int:
    """Return how many values a value is made of, itself among them. Of two with the same contents, one with tables in their place has fewer."""
    count, left = 0, list[object]([value])
    while left:
        held = left.pop()
        if isinstance(held, BaseModel):
            count += 1
            own = vars(held)
            left += [own[name] for name in type(held).model_fields if type(own.get(name)) not in _SIMPLE]
        elif isinstance(held, Mapping):
            left += held.values()  # pyright: ignore[reportUnknownMemberType]  # of any type: what fields may hold
        elif isinstance(held, tuple | list) and held and type(held[0]) not in _SIMPLE:  # pyright: ignore[reportUnknownArgumentType]
            left += held
    return count


def _digest(data: Mapping[str, object]) -> bytes:
    """Tell contents apart with the types of all their parts: a list is no tuple here, and NaN no number."""
    return hashlib.sha256(repr(data).encode("utf-8", "backslashreplace")).digest()


def without_none(value: Any) -> Any:
    """Leave out what is None: in a mission that says the same as leaving it out.

    Args:
        value: Of YAML: mappings are looked into, and all else is returned as it is.
    """
    return {key: without_none(part) for key, part in value.items() if part is not None} if isinstance(value, dict) else value
