"""Stored missions: every version with who stored it and when, what changed between two, tags, and a search.

One's own are private; those of a shared project are everybody's to read, and planners add versions to them. Versions are never changed: who saves says after which version, so that two windows
do not write over each other.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from ltlplan.service.people.audit_log import AuditLog
from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.people.job_references import References
from ltlplan.service.people.roles import Action, Principal, require
from ltlplan.service.people_models import MissionVersion, StoredMission
from ltlplan.service.problems import Conflict, Forbidden, NotFound, TooManyRequests
from ltlplan.service.times import utc_now
from verify.data.errors import BadInput

LONGEST = 1_000_000
"""Letters of a mission."""
MOST = 500
"""Missions of one owner, and versions of one mission."""
_LONGEST_NAME, _LONGEST_TAG, _MOST_TAGS = 60, 30, 10
_LISTED = (
    "SELECT m.id, m.name, m.owner, m.project, m.tags, v.number, v.made, v.user FROM missions m JOIN mission_versions v ON v.mission = m.id "
    "AND v.number = (SELECT max(number) FROM mission_versions WHERE mission = m.id)"
)


@dataclass(frozen=True, slots=True)
class StoredMissions:
    """The stored missions of a data folder. Each method waits for the disk.

    Attributes:
        database: The file of people.
        references: Whose projects are shared.
        log: Where changes are noted.
    """

    database: PeopleDatabase
    references: References
    log: AuditLog

    def listed(
        self, principal: Principal, *, search: str = "", tag: str | None = None, project: str | None = None
    ) -> tuple[StoredMission, ...]:
        """Return the missions that a user sees, those that were changed last first, without their texts.

        Args:
            principal: Who asks.
            search: Letters that name, owner, project, a tag or the newest text has, in any case.
            tag: Only those with this tag.
            project: Only those of this project.
        """
        require(principal, Action.READ)
        wanted = search.casefold()
        found: list[StoredMission] = []
        for row in self.database.read(f"{_LISTED} ORDER BY v.made DESC, m.id DESC"):
            each = _stored(row)
            if (
                not self.references.sees(each, principal)
                or (tag is not None and tag not in each.tags)
                or project not in (None, each.project)
            ):
                continue
            words = " ".join((each.name, each.owner, each.project, *each.tags)).casefold()
            if wanted in words or wanted in self._text(each.id, each.version).casefold():
                found.append(each)
        return tuple(found)

    def get(self, principal: Principal, mission: int) -> StoredMission:
        """Return a mission.

        Raises:
            NotFound: There is none that the user sees.
        """
        require(principal, Action.READ)
        rows = self.database.read(f"{_LISTED} WHERE m.id = ?", (mission,))
        return self.references.require_seen(map(_stored, rows), principal, f"stored mission {mission}")

    def versions(self, principal: Principal, mission: int) -> tuple[MissionVersion, ...]:
        """Return all versions of a mission without their texts, the newest first.

        Raises:
            NotFound: There is no such mission that the user sees.
        """
        self.get(principal, mission)
        rows = self.database.read(
            "SELECT number, user, made FROM mission_versions WHERE mission = ? ORDER BY number DESC", (mission,)
        )
        return tuple(MissionVersion(number=number, user=user, made=made) for number, user, made in rows)

    def version(self, principal: Principal, mission: int, number: int) -> MissionVersion:
        """Return a version with its text.

        Args:
            principal: Who asks.
            mission: The mission's id.
            number: The version's number.

        Raises:
            NotFound: There is no such mission that the user sees, or it has no such version.
        """
        self.get(principal, mission)
        rows = self.database.read(
            "SELECT number, user, made, text FROM mission_versions WHERE mission = ? AND number = ?", (mission, number)
        )
        if not rows:
            raise NotFound(f"Stored mission {mission} has no version {number}.")
        return MissionVersion(number=rows[0][0], user=rows[0][1], made=rows[0][2], text=rows[0][3])

    def difference(self, principal: Principal, mission: int, before: int, after: int) -> str:
        """Return what changed from one version to another, as a unified diff; empty where nothing did.

        Args:
            principal: Who asks.
            mission: The mission's id.
            before: Number of the one version; 0 for nothing at all.
            after: Of the other.

        Raises:
            NotFound: There is no such mission that the user sees, or it has no such version.
        """
        first, second = (
            [] if number == 0 else [f"{line}\n" for line in self.version(principal, mission, number).text.splitlines()]
            for number in (before, after)
        )
        return "".join(difflib.unified_diff(first, second, f"version {before}", f"version {after}"))

    def store(
        self, principal: Principal, name: str, text: str, *, project: str = "", tags: tuple[str, ...] = ()
    ) -> StoredMission:
        """Store a new mission, as its first version.

        Args:
            principal: Who does.
            name: What it is called; one owner has each name once.
            text: YAML; it may have faults.
            project: Its project; empty for none.
            tags: Words to find it by.

        Raises:
            Conflict: The owner has one of that name.
            TooManyRequests: The owner has too many.
            BadInput: The name, a tag or the text cannot be.
        """
        require(principal, Action.PLAN)
        _require_text(text)
        if not name.isprintable() or not name.strip() or name.strip() != name or len(name) > _LONGEST_NAME:
            raise BadInput(f"{name[:80]!r} cannot name a mission; use at most {_LONGEST_NAME} letters that can be shown.")
        listed = _tags(tags)
        self.references.require_project(project, principal)
        self.log.write(principal, "store", name, project)
        with self.database.changing() as run:
            owned = [str(each) for (each,) in run.execute("SELECT name FROM missions WHERE owner = ?", (principal.user,))]
            if name in owned:
                raise Conflict(f"You have a stored mission '{name}' already.")
            if len(owned) >= MOST:
                raise TooManyRequests(f"{MOST} stored missions are the most of one user; delete some.", 60.0)
            now = utc_now()
            run.execute(
                "INSERT INTO missions (name, owner, project, tags, made) VALUES (?, ?, ?, ?, ?)",
                (name, principal.user, project, listed, now),
            )
            mission = run.lastrowid or 0
            run.execute("INSERT INTO mission_versions VALUES (?, 1, ?, ?, ?)", (mission, text, principal.user, now))
        return self.get(principal, mission)

    def save(self, principal: Principal, mission: int, text: str, *, after: int) -> StoredMission:
        """Save another version; the same text as before makes none.

        Args:
            principal: Who does.
            mission: The mission's id.
            text: YAML; it may have faults.
            after: Number of the version that it was made of, which must be the newest.

        Raises:
            NotFound: There is no such mission that the user sees.
            Conflict: Somebody saved another version meanwhile.
            TooManyRequests: It has too many.
        """
        require(principal, Action.PLAN)
        _require_text(text)
        self.get(principal, mission)
        with self.database.changing() as run:
            newest = run.execute(
                "SELECT number, user, text FROM mission_versions WHERE mission = ? ORDER BY number DESC LIMIT 1", (mission,)
            ).fetchone()
            if newest is None:
                raise NotFound(f"There is no stored mission {mission}.")
            number, user, present = newest
            if number != after:
                raise Conflict(f"{user} saved version {number} meanwhile.")
            if number >= MOST:
                raise TooManyRequests(f"{MOST} versions are the most of one mission; store it under another name.", 60.0)
            if text != present:
                run.execute(
                    "INSERT INTO mission_versions VALUES (?, ?, ?, ?, ?)",
                    (mission, number + 1, text, principal.user, utc_now()),
                )
        return self.get(principal, mission)

    def change(
        self, principal: Principal, mission: int, *, project: str | None = None, tags: tuple[str, ...] | None = None
    ) -> StoredMission:
        """Put a mission into another project, or give it other tags.

        Args:
            principal: Who does.
            mission: The mission's id.
            project: The project's name, empty for none; None leaves it.
            tags: All tags; None leaves them.

        Raises:
            NotFound: There is no such mission that the user sees.
            Forbidden: It is another's.
            BadInput: A tag cannot be.
        """
        found = self._own(principal, mission)
        listed = " ".join(found.tags) if tags is None else _tags(tags)
        if project:
            self.references.require_project(project, principal)
        if project is not None:
            self.log.write(principal, "move mission", found.name, project or "no project")
        with self.database.changing() as run:
            run.execute(
                "UPDATE missions SET project = ?, tags = ? WHERE id = ?",
                (found.project if project is None else project, listed, mission),
            )
        return self.get(principal, mission)

    def delete(self, principal: Principal, mission: int) -> None:
        """Delete a mission with all its versions; jobs that were made of it stay.

        Raises:
            NotFound: There is no such mission that the user sees.
            Forbidden: It is another's.
        """
        found = self._own(principal, mission)
        self.log.write(principal, "delete mission", found.name, f"{found.version} versions")
        with self.database.changing() as run:
            run.execute("DELETE FROM mission_versions WHERE mission = ?", (mission,))
            run.execute("DELETE FROM missions WHERE id = ?", (mission,))

    def _own(self, principal: Principal, mission: int) -> StoredMission:
        require(principal, Action.PLAN)
        found = self.get(principal, mission)
        if found.owner != principal.user and not principal.sees_all:
            raise Forbidden(
                f"The mission '{found.name}' is {found.owner}'s; only its owner and admins can change what is not its text."
            )
        return found

    def _text(self, mission: int, number: int) -> str:
        rows = self.database.read("SELECT text FROM mission_versions WHERE mission = ? AND number = ?", (mission, number))
        return str(rows[0][0]) if rows else ""


def _stored(row: tuple[object, ...]) -> StoredMission:
    names = ("id", "name", "owner", "project", "tags", "version", "changed", "by")
    data = dict(zip(names, row, strict=True))
    return StoredMission.model_validate({**data, "tags": str(data["tags"]).split()})


def _require_text(text: str) -> None:
    if len(text) > LONGEST:
        raise BadInput(f"A mission of {len(text)} letters is not stored; {LONGEST} are the most.")


def _tags(tags: tuple[str, ...]) -> str:
    for tag in tags:
        if not tag.isprintable() or not tag or any(letter.isspace() for letter in tag) or len(tag) > _LONGEST_TAG:
            raise BadInput(f"{tag[:40]!r} is no tag; use one word of at most {_LONGEST_TAG} letters.")
    if len(tags) > _MOST_TAGS:
        raise BadInput(f"{len(tags)} tags; {_MOST_TAGS} are the most.")
    return " ".join(dict.fromkeys(tags))
