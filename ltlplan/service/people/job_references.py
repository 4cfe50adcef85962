"""References of users to jobs, and projects that share them.

A computation is shared by key. A job is somebody's reference to one: the first who submits it begins it, the next is given it too, and it is deleted with the last
reference. All references are also in memory, so that listing waits for no disk; the service alone writes them.
"""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.people.roles import Principal
from ltlplan.service.people_models import Project
from ltlplan.service.problems import Forbidden, NotFound
from ltlplan.service.times import utc_now
from verify.data.errors import BadInput

EARLIER = "earlier"
"""Project of what was submitted before there were references: everybody could see it, and still can."""
_LONGEST = 60
_ADOPTED = "jobs adopted"


@dataclass(frozen=True, slots=True)
class Reference:
    """A user's reference to a job.

    Attributes:
        job: The job's id.
        user: Whose it is.
        project: Its project; empty for none.
        made: When the job was first submitted by this user, UTC.
    """

    job: str
    user: str
    project: str
    made: str


class Owned(Protocol):
    """Something that is a user's, or in a project of theirs."""

    @property
    def owner(self) -> str:
        """User whose it is."""
        ...

    @property
    def project(self) -> str:
        """Its project; empty for none."""
        ...


SomeOwned = TypeVar("SomeOwned", bound=Owned)


class References:
    """All references and projects of a data folder.

    Args:
        database: The file of people.
    """

    def __init__(self, database: PeopleDatabase) -> None:
        self._database = database
        self._of_job: dict[str, dict[str, Reference]] = {}
        self._projects: dict[str, Project] = {}
        self._lock = threading.Lock()

    def load(self) -> None:
        """Read all; the service does so at its start."""
        rows = self._database.read("SELECT job, user, project, made FROM job_references ORDER BY made")
        with self._lock:
            self._of_job.clear()
            for row in rows:
                self._put(Reference(*row))
            listed = self._database.read("SELECT name, owner, shared, made FROM projects")
            self._projects = {
                name: Project(name=name, owner=owner, shared=bool(shared), made=made) for name, owner, shared, made in listed
            }

    def adopt(self, jobs: Iterable[tuple[str, str]]) -> None:
        """Give each job without any reference to who submitted it; at the first start in the shared project `earlier`.

        Args:
            jobs: Ids, each with a user.
        """
        first = not self._database.read("SELECT 1 FROM facts WHERE name = ?", (_ADOPTED,))
        leaving = set(self.leaving())
        orphans = [(job, user) for job, user in jobs if not self._of_job.get(job) and job not in leaving]
        if not first and not orphans:
            return
        now, project = utc_now(), EARLIER if first and orphans else ""
        made = [Reference(job, user, project, now) for job, user in orphans]
        with self._database.changing() as run:
            if project:
                run.execute("INSERT OR IGNORE INTO projects VALUES (?, '', 1, ?)", (EARLIER, now))
            _insert(run, made)
            run.execute("INSERT OR IGNORE INTO facts VALUES (?, ?)", (_ADOPTED, now))
        self.load()

    def _put(self, reference: Reference) -> None:
        self._of_job.setdefault(reference.job, {})[reference.user] = reference

    def add(self, job: str, user: str, project: str | None) -> Reference:
        """Refer to a job; who does already keeps that, in the project that is named.

        Args:
            job: The job's id.
            user: Whose reference it is.
            project: Its project, empty for none; None leaves it as it is.
        """
        known = self.find(job, user)
        if known is not None and project in (None, known.project):
            return known
        made = Reference(job, user, project or "", utc_now() if known is None else known.made)
        with self._database.changing() as run:
            run.execute("DELETE FROM leaving WHERE job = ?", (job,))
            _insert(run, [made])
        with self._lock:
            self._put(made)
        return made

    def drop(self, job: str, users: Iterable[str]) -> bool:
        """Refer to a job no more, and return whether nobody does; the job is then marked as leaving until it is deleted."""
        gone = set(users)
        left = [user for user in self.users(job) if user not in gone]
        with self._database.changing() as run:
            run.executemany("DELETE FROM job_references WHERE job = ? AND user = ?", [(job, user) for user in gone])
            if not left:
                run.execute("INSERT OR IGNORE INTO leaving VALUES (?, ?)", (job, utc_now()))
        with self._lock:
            for user in gone:
                self._of_job.get(job, {}).pop(user, None)
            if not left:
                self._of_job.pop(job, None)
        return not left

    def left(self, job: str) -> None:
        """Note that a job that was leaving is deleted."""
        with self._database.changing() as run:
            run.execute("DELETE FROM leaving WHERE job = ?", (job,))

    def leaving(self, before: str | None = None) -> tuple[str, ...]:
        """Return the jobs that nobody refers to any more and that are not deleted yet.

        Args:
            before: Only those whose last reference went before this instant.
        """
        asked = "SELECT job FROM leaving WHERE ?1 IS NULL OR since <= ?1"
        return tuple(str(job) for (job,) in self._database.read(asked, (before,)))

    def find(self, job: str, user: str) -> Reference | None:
        """Return a user's own reference to a job, if there is one."""
        return self._of_job.get(job, {}).get(user)

    def users(self, job: str) -> tuple[str, ...]:
        """Return who refers to a job."""
        return tuple(self._of_job.get(job, {}))

    def seen(self, job: str, principal: Principal) -> Reference | None:
        """Return by which reference somebody sees a job: the own one, one of a shared project, or for an admin any; None where the job is not to be seen."""
        of_job = self._of_job.get(job, {})
        if (own := of_job.get(principal.user)) is not None:
            return own
        shared = next((each for each in list(of_job.values()) if self.is_shared(each.project)), None)
        if shared is not None or not principal.sees_all:
            return shared
        return next(iter(of_job.values()), None)

    def is_shared(self, project: str) -> bool:
        """Return whether everybody sees what is in a project."""
        found = self._projects.get(project)
        return found is not None and found.shared

    def sees(self, owned: Owned, principal: Principal) -> bool:
        """Return whether somebody sees what is somebody's, or in a project."""
        return owned.owner == principal.user or principal.sees_all or self.is_shared(owned.project)

    def require_seen(self, found: Iterable[SomeOwned], principal: Principal, what: str) -> SomeOwned:
        """Return the one that was found, if somebody sees it.

        Args:
            found: It, or nothing.
            principal: Who asks.
            what: Names it, such as "study 3".

        Raises:
            NotFound: There is none, or it is not to be seen: nothing tells one from the other.
        """
        seen = next((each for each in found if self.sees(each, principal)), None)
        if seen is None:
            raise NotFound(f"There is no {what}.")
        return seen

    # Projects

    def projects(self, principal: Principal) -> tuple[Project, ...]:
        """Return the projects that somebody sees: the own ones and those that are shared, for an admin all, each with how many of its jobs there are."""
        listed = [each for each in self._projects.values() if self._sees(each, principal)]
        counts = dict.fromkeys((each.name for each in listed), 0)
        for references in list(self._of_job.values()):
            for each in list(references.values()):
                if each.project in counts:
                    counts[each.project] += 1
        ordered = sorted(listed, key=lambda each: each.name)
        return tuple(each.model_copy(update={"jobs": counts[each.name]}) for each in ordered)

    def _sees(self, project: Project, principal: Principal) -> bool:
        return project.shared or principal.sees_all or project.owner == principal.user

    def require_project(self, name: str, principal: Principal) -> None:
        """Require that somebody may put jobs into a project; one that there is not yet is made, private, and theirs.

        Raises:
            BadInput: That cannot name one.
            NotFound: It is another's, and not shared.
        """
        if not name:
            return
        if not name.isprintable() or name.strip() != name or len(name) > _LONGEST:
            raise BadInput(f"{name[:80]!r} cannot name a project; use at most {_LONGEST} letters that can be shown.")
        known = self._projects.get(name)
        if known is None:
            self._keep(Project(name=name, owner=principal.user, shared=False, made=utc_now()))
        elif not self._sees(known, principal):
            raise NotFound(f"The name '{name}' is taken by a project that is not shared with you; take another name.")

    def share(self, name: str, shared: bool, principal: Principal) -> Project:
        """Share a project with everybody, or make it private; one that there is not yet is made.

        Args:
            name: The project's.
            shared: Whether everybody sees its jobs.
            principal: Who asks.

        Raises:
            BadInput: That cannot name one.
            Forbidden: It is another's.
            NotFound: It is another's, and not shared.
        """
        if not name:
            raise BadInput("A project has a name.")
        self.require_project(name, principal)
        known = self._projects[name]
        if known.owner != principal.user and not principal.sees_all:
            raise Forbidden(f"The project '{name}' is {known.owner or 'nobody'}'s; only its owner and admins can share it.")
        if known.shared != shared:
            known = known.model_copy(update={"shared": shared})
            self._keep(known)
        return known

    def _keep(self, project: Project) -> None:
        with self._database.changing() as run:
            run.execute(
                "INSERT OR REPLACE INTO projects VALUES (?, ?, ?, ?)",
                (project.name, project.owner, int(project.shared), project.made),
            )
        with self._lock:
            self._projects[project.name] = project


def _insert(run: sqlite3.Cursor, references: Iterable[Reference]) -> None:
    rows = [(each.job, each.user, each.project, each.made) for each in references]
    run.executemany("INSERT OR REPLACE INTO job_references VALUES (?, ?, ?, ?)", rows)
