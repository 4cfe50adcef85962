"""Profiles: a vehicle with what was identified, as YAML that a mission takes as its `vehicle`."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from ruamel.yaml import YAML

from verify.data import BadInput, Vehicle
from verify.data.autopilot import shipped_autopilots
from verify.data.files.mission_tree import read_tree
from verify.data.storage.safe_reading import read_text
from verify.data.value import faults_of, plain

_MOST = 1_000_000
"""Bytes of a profile."""


def profile_text(vehicle: Vehicle, sentences: tuple[str, ...] = ()) -> str:
    """Return a profile as YAML: a table `vehicle`, as a mission has it.

    Args:
        vehicle: The profile.
        sentences: For a person, above it.
    """
    values = {name: value for name, value in plain(vehicle).items() if value is not None}
    if vehicle.uncertain is not None:
        values["uncertain"] = {name: list(ends) for name, ends in vehicle.uncertain.ends.items()}
    if vehicle.autopilot is not None and vehicle.autopilot.name in shipped_autopilots():
        values["autopilot"] = vehicle.autopilot.name
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # ruamel declares it as None
    yaml.width = 120
    buffer = io.StringIO()
    buffer.writelines(f"# {sentence}\n" for sentence in sentences)
    yaml.dump({"vehicle": values}, buffer)
    return buffer.getvalue()


def read_profile(path: str | os.PathLike[str]) -> Vehicle:
    """Read a profile.

    Args:
        path: A file as `profile_text` writes it.

    Raises:
        BadInput: It is no such file, or its numbers make no vehicle.
    """
    source = str(path)
    tree = read_tree(read_text(path, most=_MOST, what="profile"), source, "profile")
    if set(tree.data) != {"vehicle"} or not isinstance(tree.data["vehicle"], dict):
        raise BadInput(f"{source} is no profile: it must hold one table, `vehicle`, as `ltlplan identify --out` writes it.")
    values = _with_tuples(tree.data["vehicle"])
    try:
        return Vehicle.model_validate(values)
    except ValidationError as error:
        raise BadInput(f"{source}: {'; '.join(faults_of(error, 'vehicle'))}") from None


def _with_tuples(table: Mapping[str, Any]) -> dict[str, Any]:  # of any type: YAML nests
    """Return a table whose lists are tuples."""
    nested = {key: _with_tuples(value) for key, value in table.items() if isinstance(value, dict)}
    return {key: tuple(value) if isinstance(value, list) else nested.get(key, value) for key, value in table.items()}
