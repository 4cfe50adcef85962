"""Mission files: YAML in, `Mission` out, with every fault at once and each at its line.

Two passes, both of `verify.data.validation`: every section, and every entry of a table of entries, is validated on its own, so one
mistake does not hide the next; then whatever is sound is held against the rest (names, starts, edges, limits).
"""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from verify.data.files.key_synonyms import in_format_keys
from verify.data.files.mission_rooms import INCLUDE, MAX_BYTES, ROOM_KEYS, with_rooms, without_rooms
from verify.data.files.mission_tree import MissionTree, read_tree
from verify.data.mission import Mission
from verify.data.storage.safe_reading import read_text
from verify.data.validation.faults import MissionError, sound_sections
from verify.data.validation.kinds import unused_tables
from verify.data.validation.missions import broken_rules


def load_mission_file(source: str | os.PathLike[str], *, installed: bool = True, alone: bool = False) -> Mission:
    """Read a mission from a file, with the rooms that it includes.

    Args:
        source: The file.
        installed: Whether the planning method and the cost terms that it names must be there. What was planned already is judged
            without them.
        alone: Whether the file must hold everything itself, as a run's does.

    Raises:
        MissionError: All faults of the file and its rooms, each with its line and keys.
        BadInput: There is no such file, or it is too large or unreadable.
    """
    text = read_text(source, most=MAX_BYTES, what="mission file")
    tree = read_tree(text, str(source))
    _refuse_rooms(tree)
    whole = without_rooms(tree) if alone else with_rooms(tree, Path(source), len(text.encode()))
    return _sound(whole, installed=installed)


def parse_mission(text: str, source: str = "mission", *, installed: bool = True) -> Mission:
    """Read a mission from YAML text, which opens no file: it includes no rooms.

    Args:
        text: The file's contents.
        source: Names it in messages.
        installed: Whether the planning method and the cost terms that it names must be there.

    Raises:
        MissionError: All faults, each with its line and keys.
        BadInput: It is no table of keys at all.
    """
    return _sound(without_rooms(read_tree(text, source)), installed=installed)


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


def _sound(tree: MissionTree, *, installed: bool) -> Mission:
    """Return the mission that plain values say.

    Args:
        tree: The values.
        installed: Whether the planning method and the cost terms that they name must be there.

    Raises:
        MissionError: All faults, each with its line and keys.
    """
    tree = in_format_keys(tree)
    values, faults = sound_sections(tree.data, Mission.model_fields)
    with np.errstate(all="ignore"):  # absurd numbers end as infinities, which lie outside of everything
        broken = [*faults, *broken_rules(values, tree.data, installed=installed), *unused_tables(values)]
    if broken:
        raise MissionError(tree.source, [tree.fault(keys, reason) for keys, reason in broken])
    mission = Mission.model_validate(values)
    if mission.timed_parts and "pace" not in (tree.data.get("planner") or {}):  # haste is asked for, and no pace is given
        mission = mission.model_copy(update={"planner": mission.planner.model_copy(update={"pace": 1.0})})
    return mission


def _refuse_rooms(tree: MissionTree) -> None:
    """Say of a room that is taken for a mission what it is."""
    if {"format"} < tree.data.keys() <= set(ROOM_KEYS):
        reason = f"this is a room, which missions have by `{INCLUDE}: {Path(tree.source).name}`; name one of them."
        raise MissionError(tree.source, [tree.fault((), reason)])
