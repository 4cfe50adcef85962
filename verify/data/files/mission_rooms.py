"""Rooms as files: what several missions share (`include: lab.yaml`), read into each of them before anything is checked.

A room is opened only where the mission's own folder holds it, links followed. After this nothing of files is left: a mission with rooms
is the mission that would stand in one file, rooms first.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from verify.data.errors import BadInput, did_you_mean
from verify.data.files.mission_tree import MissionTree, Place, read_tree
from verify.data.storage.safe_reading import read_text
from verify.data.storage.strict_yaml import MAX_NODES
from verify.data.validation.faults import Fault, KeyPath, MissionError

INCLUDE = "include"
TABLES = ("hoops", "regions", "obstacles")
"""Tables of a room, whose entries are put together by name."""
ROOM_KEYS = ("format", INCLUDE, *TABLES, "environment", "workspace")
MAX_ROOMS = 20
"""Files that a mission includes, directly or not."""
MAX_BYTES = 1_000_000
"""Of one file, and of a mission with all of its rooms."""


def with_rooms(tree: MissionTree, file: Path, size: int) -> MissionTree:
    """Return a mission with everything that its rooms hold, rooms first, each in the order in which it is included.

    Args:
        tree: What the mission's own file says.
        file: The mission's file.
        size: Bytes of it.

    Raises:
        MissionError: A room is none, lies elsewhere, is included twice or in a circle, or gives a name that is given already; all faults,
            each with its file and line.
    """
    if INCLUDE not in tree.data:
        return tree
    reader = _Reader(tree, file, size)
    reader.add(tree, file)
    if reader.faults:
        raise MissionError(tree.source, reader.faults)
    return MissionTree(tree.source, reader.data, reader.places)


def without_rooms(tree: MissionTree) -> MissionTree:
    """Return a mission that has no file of its own, or that stands on its own, and so can include nothing.

    Args:
        tree: What its text says.

    Raises:
        MissionError: It includes something.
    """
    if INCLUDE not in tree.data:
        return tree
    reason = (
        "rooms are read only for a mission file that is named by its path, not for text that is handed over, and not in a run's folder; "
        "`ltlplan missions --resolved FILE` writes the mission with its rooms as one file."
    )
    raise MissionError(tree.source, [tree.fault((INCLUDE,), reason)])


def included_files(text: str, file: Path) -> tuple[Path, ...]:
    """Return the files that a mission's or a room's file names, whether or not they are there; none where it cannot be read.

    Args:
        text: What it holds.
        file: Where it is.
    """
    if INCLUDE not in text:
        return ()
    try:
        named = read_tree(text, str(file)).data.get(INCLUDE)
    except BadInput:
        return ()
    names = named if isinstance(named, list) else [named]
    return tuple(file.parent / name for name in names if isinstance(name, str) and _path_fault(name) is None)


_SHARED = frozenset((key,) for key in ROOM_KEYS[2:])
"""Where what a room brings stands in the mission; its `format` and `include` are its own."""


class _Reader:
    """Assembly of a mission from its files, with places and faults found so far."""

    def __init__(self, mission: MissionTree, file: Path, size: int) -> None:
        self.data: dict[str, Any] = {}
        self.places: dict[KeyPath, Place] = {}
        self.faults: list[Fault] = []
        self._mission = mission
        self._folder = Path(os.path.realpath(file.parent))
        self._size = size
        self._nodes = len(mission.places)
        self._included: dict[Path, Place] = {}
        self._open: list[Path] = []

    def add(self, tree: MissionTree, file: Path) -> None:
        """Put a file's rooms and then what it says itself to the rest."""
        self._open.append(Path(os.path.realpath(file)))
        named = tree.data.get(INCLUDE, [])
        for index, name in enumerate(named if isinstance(named, list) else [named]):
            self._include(name, (INCLUDE, index) if isinstance(named, list) else (INCLUDE,), tree, file)
        self._open.pop()
        before = len(self._edges())
        for key, value in tree.data.items():
            if (tree is self._mission and key != INCLUDE) or key in ROOM_KEYS[2:]:
                self._put(key, value, tree)
        for keys, place in tree.places.items():
            if tree is not self._mission and keys[:1] not in _SHARED:
                continue
            edge = keys[2] if keys[:2] == ("environment", "edges") and len(keys) > 2 else None
            self.places.setdefault((*keys[:2], before + edge, *keys[3:]) if isinstance(edge, int) else keys, place)

    def _include(self, name: object, keys: KeyPath, tree: MissionTree, file: Path) -> None:
        try:
            path = self._inside(name, file)
            if path in self._open:
                raise BadInput(f"'{name}' includes itself; a room's rooms are others.")
            if path in self._included:
                first = self._included[path]
                raise BadInput(f"'{name}' is included twice; the first time is at {first.source}:{first.line}.")
            if len(self._included) == MAX_ROOMS:
                raise BadInput(f"a mission includes at most {MAX_ROOMS} files.")
            self._included[path] = tree.place(keys) or Place(tree.source, 1)
            room = self._read(path, str(Path(tree.source).parent / str(name)))
        except MissionError as error:
            self.faults += [Fault(fault.keys, fault.line, fault.reason, error.source) for fault in error.faults]
        except BadInput as error:
            self.faults.append(self._fault(tree, keys, str(error)))
        else:
            self._check_keys(room)
            self.add(room, path)

    def _inside(self, name: object, file: Path) -> Path:
        """Return the real path of a room's file, which lies in the mission's folder or below."""
        if not isinstance(name, str):
            raise BadInput("must be the name of a room's file, such as lab.yaml, or a list of such names.")
        if (fault := _path_fault(name)) is not None:
            raise BadInput(fault)
        path = Path(os.path.realpath(file.parent / name))
        if not path.is_relative_to(self._folder):
            raise BadInput(f"'{name}' leads out of the mission's folder by a link; rooms lie in that folder or below.")
        if not path.exists():
            there = sorted(each.name for each in (file.parent / name).parent.glob("*.y*ml") if each != file)
            raise BadInput(f"there is no file '{name}' beside {file.name}.{did_you_mean(Path(name).name, there)}")
        return path

    def _read(self, path: Path, source: str) -> MissionTree:
        text = read_text(path, most=MAX_BYTES, what="room file")
        self._size += len(text.encode())
        if self._size > MAX_BYTES:
            raise BadInput(f"the mission with its rooms is larger than {MAX_BYTES // 1_000_000} MB.")
        room = read_tree(text, source, "room")
        self._nodes += len(room.places)
        if self._nodes > MAX_NODES:
            raise BadInput(f"the mission with its rooms has more than {MAX_NODES} keys and values.")
        return room

    def _check_keys(self, room: MissionTree) -> None:
        if "format" not in room.data:
            self.faults.append(Fault(("format",), 1, "missing: a room's file begins with `format: 1`.", room.source))
        elif type(room.data["format"]) is not int or room.data["format"] != 1:
            self.faults.append(self._fault(room, ("format",), f"must be 1, not {room.data['format']!r:.60}."))
        for key in room.data:
            if key not in ROOM_KEYS:
                reason = f"a room has no such key.{did_you_mean(key, ROOM_KEYS)} It may hold: {', '.join(ROOM_KEYS)}."
                self.faults.append(self._fault(room, (key,), reason))

    def _put(self, key: str, value: Any, tree: MissionTree) -> None:
        """Put what stands under one key to what stands there already."""
        if key in TABLES:
            self._put_entries(key, value, tree)
        elif key == "environment":
            self._put_environment(value, tree)
        elif key in self.data:
            self._twice((key,), f"`{key}`", tree)
        else:
            self.data[key] = dict(value) if isinstance(value, dict) else value

    def _put_entries(self, table: str, entries: object, tree: MissionTree) -> None:
        here = self.data.setdefault(table, {})
        if not isinstance(entries, dict):
            self.faults.append(self._fault(tree, (table,), "must be a table of keys, such as {key: value}."))
            return
        for name, entry in entries.items():
            if name in here:
                self._twice((table, name), f"'{name}'", tree)
            else:
                here[name] = entry

    def _put_environment(self, value: object, tree: MissionTree) -> None:
        """Put edges to those that other files bring; what else an environment says, all files must say alike."""
        if not (isinstance(value, dict) and isinstance(value.get("edges", []), list)):
            self.faults.append(self._fault(tree, ("environment",), "must be a table with a list of `edges`."))
            return
        here = self.data.setdefault("environment", dict(value))
        if ("environment",) not in self.places:
            return
        for key, default in (("start", "robot"), ("directed", False)):
            said = here.get(key, default)
            if value.get(key, default) != said:
                first = self.places.get(("environment", key), self.places[("environment",)])
                reason = f"`{key}` must be the same in all files; at {first.source}:{first.line} it is {said!r:.60}."
                self.faults.append(self._fault(tree, ("environment", key), reason))
        self.data["environment"] = {**value, **here, "edges": [*self._edges(), *value.get("edges", [])]}

    def _edges(self) -> list[Any]:
        return self.data.get("environment", {}).get("edges", [])

    def _twice(self, keys: KeyPath, what: str, tree: MissionTree) -> None:
        first = self.places[keys]
        self.faults.append(self._fault(tree, keys, f"{what} is given twice; the first is at {first.source}:{first.line}."))

    def _fault(self, tree: MissionTree, keys: KeyPath, reason: str) -> Fault:
        fault = tree.fault(keys, reason)
        return fault if tree is self._mission else Fault(keys, fault.line, reason, tree.source)


def _path_fault(name: str) -> str | None:
    """Return why a text cannot be the path of a room's file, or None."""
    parts = name.split("/")
    if not name or "\0" in name or "\\" in name or re.match(r"[A-Za-z]:", name):
        return (
            f"'{name[:60]!s}' is no path of a room; write it with `/`, from the file that includes it, such as rooms/lab.yaml."
        )
    if name.startswith("/") or ".." in parts:
        return f"'{name[:60]}' leads out of the mission's folder; rooms lie in that folder or below, without `..`."
    if not name.endswith((".yaml", ".yml")):
        return f"'{name[:60]}' is no room's file; they are called *.yaml or *.yml."
    return None
