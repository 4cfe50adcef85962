"""An experimenter's half of the client: studies of one mission over values of a key, and two results compared."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.client_parts.missions_client import MissionsClient
from ltlplan.service.client_parts.transport import checked, job_of, segment
from ltlplan.service.models import ENDED
from ltlplan.service.study_models import Comparison, Figure, Study, Varied
from verify.data import Mission, mission_to_yaml

if TYPE_CHECKING:
    from ltlplan.pipeline import Asked


class StudiesClient(MissionsClient):
    """A service, as those who vary missions ask it."""

    # as many parameters as a study has parts, each but the first three by its keyword
    def study(
        self,
        mission: Asked,
        key: str,
        values: Iterable[Varied],
        *,
        name: str = "",
        project: str = "",
        pace: float | str | None = None,
    ) -> Study:
        """Submit a mission once for each value of one of its keys, as one study.

        Args:
            mission: What is asked: a mission, or the path or name that `ltlplan.load_mission` reads one by.
            key: The key that is varied, with its sections, such as "limits.speed"; "seed" for "planner.seed".
            values: One job each.
            name: What it is called; by default the mission with the key.
            project: Its project and its jobs'; empty for none.
            pace: Instead of `planner.pace`.

        Raises:
            MissionError: All faults of the mission with one of the values; nothing was submitted.
        """
        asked = {
            "mission": self._text(mission),
            "key": key,
            "values": list(values),
            "name": name,
            "project": project,
            "pace": None if pace is None else str(pace),
        }
        return checked(Study, self._wire.ask("POST", "/api/studies", json=asked).json())

    def _text(self, mission: Asked) -> str:
        """Return a mission as it is sent: a file as its author wrote it, so that what it leaves out follows from the varied value."""
        if isinstance(mission, str | os.PathLike) and Path(mission).suffix in (".yaml", ".yml", ".json"):
            self.load_mission(mission)
            text = Path(mission).read_text(encoding="utf-8")
            return text if "include" not in text else mission_to_yaml(self.load_mission(mission))
        return mission_to_yaml(mission if isinstance(mission, Mission) else self.load_mission(mission))

    def studies(self, search: str = "", *, project: str | None = None) -> tuple[Study, ...]:
        """Return your studies and those of shared projects, the newest first, without their members.

        Args:
            search: Letters that name, key, owner or project has.
            project: Only those of this project.
        """
        asked = {name: value for name, value in (("search", search), ("project", project)) if value}
        return tuple(checked(Study, each) for each in self._wire.ask("GET", "/api/studies", params=asked).json())

    def studied(self, study: Study | int) -> Study:
        """Return a study with the figures of all its jobs so far.

        Args:
            study: A study, or its id.
        """
        return checked(Study, self._wire.ask("GET", f"/api/studies/{_id(study)}").json())

    def wait_study(self, study: Study | int) -> Study:
        """Wait until all jobs of a study have ended, however they did, and return it with their figures.

        Args:
            study: A study, or its id.
        """
        for member in self.studied(study).members:
            if member.figures.state not in (*ENDED, "deleted"):
                told = self._wire.ask("GET", f"/api/jobs/{segment(member.figures.job)}").content
                for _ in Submitted(self._wire, job_of(told)).events():
                    pass
        return self.studied(study)

    def study_table(self, study: Study | int) -> str:
        """Return a study as a table, CSV.

        Args:
            study: A study, or its id.
        """
        return self._wire.ask("GET", f"/api/studies/{_id(study)}/table").text

    def study_plot(self, study: Study | int, figure: Figure = "duration") -> str:
        """Return a plot of one figure over a study's values, SVG.

        Args:
            study: A study, or its id.
            figure: "cost", "duration", "largest_margin", "worst_error" or "seconds".
        """
        return self._wire.ask("GET", f"/api/studies/{_id(study)}/plot", params={"figure": figure}).text

    def cancel_study(self, study: Study | int) -> Study:
        """Cancel all jobs of a study that have not ended, but those that others wait for.

        Args:
            study: A study, or its id.
        """
        return checked(Study, self._wire.ask("POST", f"/api/studies/{_id(study)}/cancel").json())

    def delete_study(self, study: Study | int) -> None:
        """Delete a study; its jobs stay.

        Args:
            study: A study, or its id.
        """
        self._wire.ask("DELETE", f"/api/studies/{_id(study)}")

    def compare(self, first: Submitted | str, second: Submitted | str) -> Comparison:
        """Return two results side by side: cost, duration, margins, words, claims, and what changed in the mission.

        Args:
            first: A job, or its id.
            second: Another.
        """
        ids = [segment(job if isinstance(job, str) else job.id) for job in (first, second)]
        return checked(Comparison, self._wire.ask("GET", f"/api/jobs/{ids[0]}/compare/{ids[1]}").json())


def _id(study: Study | int) -> int:
    return study if isinstance(study, int) else study.id
