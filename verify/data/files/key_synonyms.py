"""Synonyms of a mission file's keys: `capability` for `robot`, `capabilities` for `robots`, `margin: auto` for a margin that is fitted.

A mission reads the same by either name, and is written by the keys of its format.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from verify.data.files.mission_tree import MissionTree
from verify.data.validation.faults import Fault, KeyPath, MissionError

SYNONYMS = {"capability": "robot", "capabilities": "robots"}
"""The key of the format for each synonym, of a mission and of its agents."""
AUTO = "auto"
"""The margin that is taken from the proof of tracking."""


def in_format_keys(tree: MissionTree) -> MissionTree:
    """Return a mission's values under the keys of its format.

    Args:
        tree: The values as they are written.

    Raises:
        MissionError: A key and its synonym are both given, or a margin is `auto` without disturbances.
    """
    written: dict[KeyPath, str] = {}
    faults: list[Fault] = []

    def renamed(table: dict[str, Any], where: KeyPath) -> dict[str, Any]:  # of any type: what a mission file may hold
        for synonym in SYNONYMS.keys() & table.keys():
            written[*where, SYNONYMS[synonym]] = synonym
            if SYNONYMS[synonym] in table:
                reason = f"`{synonym}` says the same as `{SYNONYMS[synonym]}`; give one of them."
                faults.append(tree.fault((*where, synonym), reason))
        return {SYNONYMS.get(key, key): value for key, value in table.items()}

    data = renamed(tree.data, ())
    if isinstance(agents := data.get("agents"), dict):
        data["agents"] = {
            name: renamed(agent, ("agents", name)) if isinstance(agent, dict) else agent for name, agent in agents.items()
        }
    if data.get("margin") == AUTO:
        told = data.get("disturbance")
        if told is not None:  # what is no table is found to be none later
            fitted = {**told, "fitted": True} if isinstance(told, dict) else told
            data = {key: value for key, value in data.items() if key != "margin"} | {"disturbance": fitted}
        else:
            faults.append(tree.fault(("margin",), "`margin: auto` needs `disturbance`, from whose proof the margin is taken."))
    if faults:
        raise MissionError(tree.source, faults)
    return replace(tree, data=data, written=written)
