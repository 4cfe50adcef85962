"""A writer's half of the client: missions that are stored at a service with all their versions."""

from __future__ import annotations

from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.client_parts.transport import Wire, checked, job_of, segment
from ltlplan.service.people_models import DraftTold, MissionVersion, StoredMission


class StoredClient:
    """A service, as those who write missions ask it."""

    _wire: Wire

    def stored_missions(
        self, search: str = "", *, tag: str | None = None, project: str | None = None
    ) -> tuple[StoredMission, ...]:
        """Return your stored missions and those of shared projects, the ones that were changed last first.

        Args:
            search: Letters that name, owner, project, tags or the newest text has.
            tag: Only those with this tag.
            project: Only those of this project.
        """
        asked = {name: value for name, value in (("search", search), ("tag", tag), ("project", project)) if value}
        return tuple(checked(StoredMission, each) for each in self._wire.ask("GET", "/api/stored", params=asked).json())

    def drafts(self) -> tuple[DraftTold, ...]:
        """Return your drafts, the one that was changed last first."""
        return tuple(checked(DraftTold, each) for each in self._wire.ask("GET", "/api/drafts").json())

    def keep_draft(self, name: str, text: str, *, changed: float | None = None) -> DraftTold:
        """Keep a draft, and return what is kept: another text where that was changed later elsewhere.

        Args:
            name: Names it among yours.
            text: YAML; it may have faults.
            changed: When it was changed, ms since 1970; now by default.
        """
        asked = {} if changed is None else {"changed": changed}
        headers = {"content-type": "application/yaml"}
        kept = self._wire.ask("PUT", f"/api/drafts/{segment(name)}", params=asked, content=text.encode(), headers=headers)
        return checked(DraftTold, kept.json())

    def store_mission(self, name: str, text: str, *, project: str = "", tags: tuple[str, ...] = ()) -> StoredMission:
        """Store a mission's text, as its first version.

        Args:
            name: What it is called.
            text: YAML; it may have faults.
            project: Its project; empty for none.
            tags: Words to find it by.

        Raises:
            Conflict: You have one of that name.
        """
        asked = {"name": name, "text": text, "project": project, "tags": list(tags)}
        return checked(StoredMission, self._wire.ask("POST", "/api/stored", json=asked).json())

    def save_mission(self, mission: StoredMission, text: str) -> StoredMission:
        """Save another version, and return the mission with it.

        Args:
            mission: As it was looked at: its version must still be the newest.
            text: YAML; it may have faults.

        Raises:
            Conflict: Somebody saved another version meanwhile.
        """
        asked = {"text": text, "after": mission.version}
        return checked(StoredMission, self._wire.ask("PUT", f"/api/stored/{mission.id}", json=asked).json())

    def change_mission(
        self, mission: StoredMission, *, project: str | None = None, tags: tuple[str, ...] | None = None
    ) -> StoredMission:
        """Put a stored mission into another project, or give it other tags.

        Args:
            mission: The mission.
            project: The project's name, empty for none; None leaves it.
            tags: All tags; None leaves them.
        """
        asked = {"project": project, "tags": None if tags is None else list(tags)}
        given = {name: value for name, value in asked.items() if value is not None}
        return checked(StoredMission, self._wire.ask("PATCH", f"/api/stored/{mission.id}", json=given).json())

    def delete_mission(self, mission: StoredMission) -> None:
        """Delete a stored mission with all its versions."""
        self._wire.ask("DELETE", f"/api/stored/{mission.id}")

    def mission_history(self, mission: StoredMission) -> tuple[MissionVersion, ...]:
        """Return who stored which version when, the newest first, without their texts."""
        return tuple(
            checked(MissionVersion, each) for each in self._wire.ask("GET", f"/api/stored/{mission.id}/versions").json()
        )

    def mission_text(self, mission: StoredMission, version: int | None = None) -> str:
        """Return a version's text, the newest by default."""
        path = f"/api/stored/{mission.id}/versions/{mission.version if version is None else version}"
        return checked(MissionVersion, self._wire.ask("GET", path).json()).text

    def mission_difference(self, mission: StoredMission, before: int, after: int) -> str:
        """Return what changed from one version to another, as a unified diff.

        Args:
            mission: The mission.
            before: Number of the one version; 0 for nothing.
            after: Of the other.
        """
        return self._wire.ask("GET", f"/api/stored/{mission.id}/difference", params={"before": before, "after": after}).text

    def plan_version(self, mission: StoredMission, version: int | None = None, *, seed: int | None = None) -> Submitted:
        """Submit a version, in the mission's project.

        Args:
            mission: The mission.
            version: Its number; the newest by default.
            seed: Source of every draw, instead of the mission's own.

        Raises:
            MissionError: All its faults.
        """
        path = f"/api/stored/{mission.id}/versions/{mission.version if version is None else version}/plan"
        return Submitted(
            self._wire, job_of(self._wire.ask("POST", path, params={} if seed is None else {"seed": seed}).content)
        )
