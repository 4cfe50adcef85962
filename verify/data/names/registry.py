"""Registries: tables of what has a name and can be added from outside, through `importlib.metadata` entry points.

A registry is one table of built-in names and one group of entry points. Another package adds to it by naming an object in its own
`pyproject.toml`; nothing is loaded before it is asked for by name. Every place that lists choices reads the registry.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Generic, TypeVar

from verify.data.errors import BadInput, did_you_mean

T = TypeVar("T")


@dataclass(frozen=True)
class Registry(Generic[T]):
    """Named objects of one kind.

    Attributes:
        what: What an object is called in messages, with its article: "an export target".
        group: Group of entry points in which other packages name theirs.
        built_in: Ours, by name: "package.module:object", loaded when first asked for.
        kind: Class that every object must be an instance of.
    """

    what: str
    group: str
    built_in: Mapping[str, str]
    kind: type[T]
    _found: dict[str, T] = field(default_factory=dict, init=False, repr=False, compare=False)

    def names(self) -> tuple[str, ...]:
        """Return all names: ours in their order, then those of other packages, sorted."""
        return (*self.built_in, *sorted({point.name for point in self._points()} - set(self.built_in)))

    def knows(self, name: str) -> bool:
        """Return whether there is such a name; nothing is loaded."""
        return name in self.built_in or any(point.name == name for point in self._points())

    def unknown(self, name: str) -> str:
        """Return the sentence that says that there is no such name, with the nearest ones."""
        return f"'{name}' is not {self.what}.{did_you_mean(name, self.names())} {self._choices()}"

    def find(self, name: str) -> T:
        """Return the object of a name.

        Args:
            name: As users write it.

        Raises:
            BadInput: There is no such name; two packages bring it; or what a package brings cannot be loaded or is of another kind.
        """
        if name not in self._found:
            self._found[name] = self._loaded(name)
        return self._found[name]

    def resolve(self, given: T | str) -> T:
        """Return an object as it is, or the one of a name; library calls take both.

        Raises:
            BadInput: As `find`; or what was given is neither.
        """
        if isinstance(given, self.kind):
            return given
        if not isinstance(given, str):
            raise BadInput(f"{given!r} is not {self.what}: neither a {self.kind.__name__} nor a name of one. {self._choices()}")
        return self.find(given)

    def _points(self) -> tuple[EntryPoint, ...]:
        return tuple(_installed()(group=self.group))

    def _choices(self) -> str:
        return f"Names: {', '.join(self.names())}."

    def _loaded(self, name: str) -> T:
        points = [point for point in self._points() if point.name == name]
        homes = {f"{point.dist.name if point.dist else 'unknown'} ({point.value})" for point in points}
        if name in self.built_in:
            homes.add("ltlplan")
        if len(homes) > 1:
            raise BadInput(f"'{name}' is {self.what} of several packages: {', '.join(sorted(homes))}. Remove all but one.")
        if name in self.built_in:
            module, _, attribute = self.built_in[name].partition(":")
            return getattr(importlib.import_module(module), attribute)
        if not points:
            raise BadInput(self.unknown(name))
        home = homes.pop()
        try:
            found = points[0].load()
        except Exception as error:  # a package of somebody else's may fail in any way
            raise BadInput(f"'{name}', {self.what} of {home}, cannot be loaded: {type(error).__name__}: {error}") from error
        if not isinstance(found, self.kind):
            raise BadInput(f"'{name}' of {home} is not {self.what}: a {type(found).__name__}, not a {self.kind.__name__}.")
        return found


@cache
def _installed() -> Callable[..., EntryPoints]:
    """Return the choice by `group` among the entry points of all packages, which are read once in a process."""
    return entry_points().select
