"""Missions as a service reads them: the shipped ones, and checks of texts."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ltlplan.service.client_parts.transport import Wire
from verify.data import Mission, parse_mission

YAML = {"content-type": "application/yaml"}


class MissionsClient:
    """A service, as those who read missions ask it."""

    _wire: Wire

    def load_mission(self, source: str | os.PathLike[str]) -> Mission:
        """Read a mission: a shipped one of the service's by its name, or a file of yours.

        Args:
            source: Name or path.

        Raises:
            BadInput: There is no such mission, or it has faults.
        """
        if isinstance(source, str) and not Path(source).suffix and not Path(source).exists():
            for each in self.missions():
                if each["name"] == source:
                    return parse_mission(each["text"], f"{source}.yaml")
        from ltlplan.missions import load_mission

        return load_mission(source)

    def missions(self) -> list[dict[str, Any]]:
        """Return the shipped missions: name, robots, trace, what each asks, and its text."""
        return self._wire.ask("GET", "/api/missions").json()

    def check_mission(self, text: str) -> Mission:
        """Return the mission of a text, after the service has checked it.

        Args:
            text: YAML or JSON.

        Raises:
            MissionError: All faults, with their lines.
        """
        self._wire.ask("POST", "/api/missions/check", content=text.encode(), headers=YAML)
        return parse_mission(text)
