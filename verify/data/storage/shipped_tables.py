"""Tables that are shipped with a package: YAML files of a folder, known by their names, in which each number stands next to its source."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from typing import Any

from pydantic import BeforeValidator
from ruamel.yaml import YAML

from verify.data.errors import BadInput, did_you_mean

_ENDING = ".yaml"


@dataclass(frozen=True, slots=True)
class ShippedTables:
    """Tables of one kind.

    Attributes:
        package: The package that ships them.
        kind: Of what they are, such as "vehicle"; their folder is called after several.
    """

    package: str
    kind: str

    def names(self) -> tuple[str, ...]:
        """Return the names of all, sorted."""
        files = (resources.files(self.package) / f"{self.kind}s").iterdir()
        return tuple(sorted(file.name.removesuffix(_ENDING) for file in files if file.name.endswith(_ENDING)))

    def read(self, name: str) -> dict[str, Any]:  # of any type: tables nest
        """Return what a table says, without the sources; lists are tuples.

        Args:
            name: Its name.

        Raises:
            BadInput: There is no such table; the message lists those that there are.
        """
        known = self.names()
        if name not in known:
            raise BadInput(f"'{name}' is not a shipped {self.kind}.{did_you_mean(name, known)} Shipped: {', '.join(known)}.")
        text = (resources.files(self.package) / f"{self.kind}s" / f"{name}{_ENDING}").read_text(encoding="utf-8")
        return {key: _without_source(entry) for key, entry in YAML(typ="safe", pure=True).load(text).items()}


def or_by_name(load: Callable[[str], object]) -> BeforeValidator:
    """Let a field of a file hold the name of a shipped table in place of a table.

    Args:
        load: Returns the table of a name; raises `BadInput` where there is none.
    """

    def named(value: object) -> object:
        if not isinstance(value, str):
            return value
        try:
            return load(value)
        except BadInput as error:
            raise ValueError(str(error)) from None

    return BeforeValidator(named)


def _without_source(entry: dict[str, Any]) -> Any:
    """Return v of {value: v, source: s}; a section is a table of such."""
    if "value" not in entry:
        return {key: _without_source(part) for key, part in entry.items()}
    value = entry["value"]
    return tuple(value) if isinstance(value, list) else value
