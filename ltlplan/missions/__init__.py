"""The missions that come with the package, and the reader that knows them by name.

`notes` says what is allowed in a mission and may yet not be meant.
"""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path

from verify.data import BadInput, Mission, did_you_mean, load_mission_file, parse_mission


def shipped_missions() -> tuple[str, ...]:
    """Return the names of the missions that come with the package, sorted."""
    folder = resources.files("ltlplan.missions")
    return tuple(sorted(f.name.removesuffix(".yaml") for f in folder.iterdir() if f.name.endswith(".yaml")))


def shipped_mission_text(name: str) -> str:
    """Return the file of a shipped mission.

    Raises:
        BadInput: There is no such mission; the message lists those that there are.
    """
    known = shipped_missions()
    if name not in known:
        files = [file for file in (f"{name}.yaml", f"{name}.yml") if Path(file).is_file()]
        here = [each.name for each in Path().iterdir() if each.is_dir() or each.suffix in (".yaml", ".yml")]
        hint = f" Did you mean '{files[0]}'?" if files else did_you_mean(name, (*known, *here))
        raise BadInput(f"'{name}' is neither a file nor a shipped mission.{hint} Shipped: {', '.join(known)}.")
    return (resources.files("ltlplan.missions") / f"{name}.yaml").read_text(encoding="utf-8")


def template_text(name: str, *, alone: bool = False) -> str:
    """Return a commented mission to start from.

    Args:
        name: What it is called.
        alone: Whether it is written where there are no files beside it, so that it says nothing of `include`.
    """
    text = (resources.files("ltlplan.missions") / "template" / "mission.yaml").read_text(encoding="utf-8")
    paragraphs = text.replace("NAME", name).split("\n\n")
    return "\n\n".join(part for part in paragraphs if not (alone and "\n# include:" in part))


def load_mission(source: str | os.PathLike[str]) -> Mission:
    """Read a mission from a file, or a shipped one by its name.

    Raises:
        MissionError: All faults of the file, each with its line and keys.
        BadInput: There is no such file or mission, or the file is too large or unreadable.
    """
    if isinstance(source, str) and not Path(source).suffix and not Path(source).exists():
        return parse_mission(shipped_mission_text(source), f"{source}.yaml")
    return load_mission_file(source)
