"""Studies as they are kept: a name, the key that is varied, and the job of each value.

The jobs are their owner's as any others. A study is private, or everybody's to read in a shared project; it is deleted without its jobs.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field

from ltlplan.service.job_queue.lru_cache import Recent
from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.people.job_references import References
from ltlplan.service.people.roles import Action, Principal, require
from ltlplan.service.problems import Forbidden, TooManyRequests
from ltlplan.service.study_models import Figures, Study, Varied
from ltlplan.service.times import utc_now
from verify.data.errors import BadInput

MOST = 1000
"""Studies of one owner."""
MOST_MEMBERS = 200
_LONGEST_NAME = 120
_REMEMBERED = 10_000
_LISTED = "SELECT s.id, s.name, s.varied, s.owner, s.project, s.made, (SELECT count(*) FROM study_members WHERE study = s.id) FROM studies s"


@dataclass(frozen=True, slots=True)
class Studies:
    """The studies of a data folder. Each method waits for the disk.

    Attributes:
        database: The file of people.
        references: Whose projects are shared.
        figures: Of jobs that have ended, by their ids.
    """

    database: PeopleDatabase
    references: References
    figures: Recent[Figures] = field(default_factory=lambda: Recent[Figures](_REMEMBERED))

    def listed(self, principal: Principal, *, search: str = "", project: str | None = None) -> tuple[Study, ...]:
        """Return the studies that a user sees, the newest first, without their members.

        Args:
            principal: Who asks.
            search: Letters that name, key, owner or project has, in any case.
            project: Only those of this project.
        """
        require(principal, Action.READ)
        wanted = search.casefold()
        every = [_study(row) for row in self.database.read(f"{_LISTED} ORDER BY s.id DESC")]
        return tuple(
            each
            for each in every
            if self.references.sees(each, principal)
            and project in (None, each.project)
            and wanted in f"{each.name} {each.key} {each.owner} {each.project}".casefold()
        )

    def get(self, principal: Principal, study: int) -> Study:
        """Return a study without its members.

        Raises:
            NotFound: There is none that the user sees.
        """
        require(principal, Action.READ)
        rows = self.database.read(f"{_LISTED} WHERE s.id = ?", (study,))
        return self.references.require_seen(map(_study, rows), principal, f"study {study}")

    def jobs(self, study: int) -> tuple[tuple[Varied, str], ...]:
        """Return the values of a study, each with its job's id, in their order."""
        rows = self.database.read("SELECT value, job FROM study_members WHERE study = ? ORDER BY number", (study,))
        return tuple((_value(json.loads(value)), str(job)) for value, job in rows)

    def all_jobs(self) -> frozenset[str]:
        """Return the ids of the jobs of all studies."""
        return frozenset(str(job) for (job,) in self.database.read("SELECT DISTINCT job FROM study_members"))

    def require_new(self, principal: Principal, name: str, values: Sequence[Varied]) -> None:
        """Require that a study can be made, before its jobs are submitted.

        Args:
            principal: Who makes it.
            name: What it is called.
            values: One job each.

        Raises:
            BadInput: The name, or the number of values, cannot be; or a value comes twice.
            TooManyRequests: The user has too many.
        """
        require(principal, Action.PLAN)
        if not name.isprintable() or not name.strip() or len(name) > _LONGEST_NAME:
            raise BadInput(f"{name[:80]!r} cannot name a study; use at most {_LONGEST_NAME} letters that can be shown.")
        if not 1 <= len(values) <= MOST_MEMBERS:
            raise BadInput(f"A study has 1 to {MOST_MEMBERS} values, not {len(values)}.")
        written = [json.dumps(value) for value in values]
        if (twice := next((each for each in written if written.count(each) > 1), None)) is not None:
            raise BadInput(f"The value {twice[:80]} comes twice; name each once.")
        (count,) = self.database.read("SELECT count(*) FROM studies WHERE owner = ?", (principal.user,))[0]
        if count >= MOST:
            raise TooManyRequests(f"You have {count} studies; {MOST} are the most. Delete one first.", 60.0)

    def add(self, principal: Principal, name: str, key: str, project: str, members: Sequence[tuple[Varied, str]]) -> Study:
        """Keep a study, whose jobs are accepted already.

        Args:
            principal: Whose it is.
            name: What it is called.
            key: Key that is varied.
            project: Its project; empty for none.
            members: Values, each with its job's id.
        """
        with self.database.changing() as run:
            run.execute(
                "INSERT INTO studies (name, owner, project, varied, made) VALUES (?, ?, ?, ?, ?)",
                (name, principal.user, project, key, utc_now()),
            )
            study = run.lastrowid
            assert study is not None
            rows = [(study, number, json.dumps(value), job) for number, (value, job) in enumerate(members)]
            run.executemany("INSERT INTO study_members VALUES (?, ?, ?, ?)", rows)
        return self.get(principal, study)

    def require_own(self, principal: Principal, study: int) -> Study:
        """Return a study that a user may delete and cancel.

        Raises:
            NotFound: There is none that the user sees.
            Forbidden: It is another's.
        """
        require(principal, Action.PLAN)
        found = self.get(principal, study)
        if found.owner != principal.user and not principal.sees_all:
            raise Forbidden(f"The study '{found.name}' is {found.owner}'s; only its owner and admins can change it.")
        return found

    def delete(self, study: int) -> None:
        """Delete a study; its jobs stay."""
        with self.database.changing() as run:
            run.execute("DELETE FROM study_members WHERE study = ?", (study,))
            run.execute("DELETE FROM studies WHERE id = ?", (study,))


def _study(row: tuple[object, ...]) -> Study:
    names = ("id", "name", "key", "owner", "project", "made", "size")
    return Study.model_validate(dict(zip(names, row, strict=True)))


def _value(value: Varied | list[bool | int | float | str]) -> Varied:
    return tuple(value) if isinstance(value, list) else value
