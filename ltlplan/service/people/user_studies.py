"""Studies and comparisons as one user has them: a mission over values of one key, submitted as ordinary jobs; two results side by side."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ltlplan.service import queries as asked
from ltlplan.service.figures import compared, figures_of, without_details
from ltlplan.service.job_queue.runner import STUDY
from ltlplan.service.models import ENDED
from ltlplan.service.problems import Conflict, NotFound
from ltlplan.service.study_models import Comparison, Figures, Study, StudyMember, Varied

if TYPE_CHECKING:
    from ltlplan.service.people.people import People
    from ltlplan.service.people.roles import Principal
    from ltlplan.service.people.user_jobs import UserJobs
    from ltlplan.service.query_pool import Questions
    from verify.data import Mission

SEED = "planner.seed"


@dataclass(frozen=True, slots=True)
class UserStudies:
    """Studies as one user has them.

    Attributes:
        jobs: Jobs as the user has them.
        people: Whose they are.
        questions: Who reads missions and writes differences.
        principal: Who asks.
    """

    jobs: UserJobs
    people: People
    questions: Questions
    principal: Principal

    async def make(
        self, text: str, key: str, values: Sequence[Varied], *, name: str = "", project: str = "", pace: str | None = None
    ) -> Study:
        """Submit a mission once for each value of one of its keys, and keep that as a study.

        All missions are read first: one that has faults, and nothing is submitted. Where it is killed on the way there is no study yet, and
        what was submitted of it is done; made again it takes these jobs.

        Args:
            text: The mission, YAML or JSON.
            key: Key with its sections, such as `limits.speed`; `seed` for `planner.seed`.
            values: One job each.
            name: What it is called; by default the mission with the key.
            project: Its project and its jobs'; empty for none.
            pace: Instead of `planner.pace`.

        Raises:
            LtlplanError: The mission has faults with one of the values, there are too many, or as `UserJobs.submit`.
        """
        from ltlplan.planner import pace_of, with_pace

        studies, key = self.people.studies, SEED if key == "seed" else key
        await asyncio.to_thread(studies.require_new, self.principal, name or key, values)
        who = self.principal.client
        missions: list[Mission] = await self.questions.ask(asked.varied_missions, text, key, tuple(values), who=who)
        missions = [with_pace(mission, pace_of(pace)) for mission in missions]
        self.jobs.require_room(len(missions))
        members: list[tuple[Varied, str]] = []
        for value, mission in zip(values, missions, strict=True):
            job = await self.jobs.submit(mission, project=project or None, lane=STUDY)
            members.append((value, job.id))
        called = name or f"{missions[0].name} over {key}"
        made = await asyncio.to_thread(studies.add, self.principal, called[:120], key, project, members)
        await self._log("study", made)
        return await self.study(made.id)

    async def listed(self, *, search: str = "", project: str | None = None) -> tuple[Study, ...]:
        """Return the studies that the user sees, the newest first, without their members.

        Args:
            search: Letters that name, key, owner or project has.
            project: Only those of this project.
        """
        return await asyncio.to_thread(lambda: self.people.studies.listed(self.principal, search=search, project=project))

    async def study(self, study: int) -> Study:
        """Return a study with what its jobs found so far.

        Raises:
            NotFound: There is none that the user sees.
        """
        found = await asyncio.to_thread(self.people.studies.get, self.principal, study)
        jobs = await asyncio.to_thread(self.people.studies.jobs, study)
        members = [StudyMember(value=value, figures=await self._row(job)) for value, job in jobs]
        return found.model_copy(update={"members": tuple(members)})

    async def _row(self, job_id: str) -> Figures:
        """Return a job's figures for a table; those of one that has ended stay as they are."""
        known = self.people.studies.figures.get(job_id)
        try:
            if known is not None:
                self.jobs.require_seen(job_id)
                return known
            job = await self.jobs.job(job_id)
        except NotFound:
            return Figures(job=job_id, state="deleted")
        figures = without_details(figures_of(job))
        return self.people.studies.figures.put(job_id, figures) if job.state in ENDED else figures

    async def cancel(self, study: int) -> Study:
        """Cancel all jobs of a study that have not ended, but those that others wait for.

        Raises:
            NotFound: There is no such study that the user sees.
            Forbidden: It is another's.
        """
        found = await asyncio.to_thread(self.people.studies.require_own, self.principal, study)
        await self._log("cancel study", found)
        for _, job in reversed(await asyncio.to_thread(self.people.studies.jobs, study)):  # what waits before what runs
            try:
                await self.jobs.cancel(job)
            except (NotFound, Conflict):  # deleted, or others wait for it
                continue
        return await self.study(study)

    async def delete(self, study: int) -> None:
        """Delete a study; its jobs stay.

        Raises:
            NotFound: There is no such study that the user sees.
            Forbidden: It is another's.
        """
        found = await asyncio.to_thread(self.people.studies.require_own, self.principal, study)
        await self._log("delete study", found)
        await asyncio.to_thread(self.people.studies.delete, study)

    async def compare(self, first: str, second: str) -> Comparison:
        """Return two results side by side.

        Args:
            first: The one job's id.
            second: The other's.

        Raises:
            NotFound: There is no such job that the user sees.
            Conflict: One is no mission's job.
        """
        jobs = [await self.jobs.job(job) for job in (first, second)]
        texts = [await self.jobs.mission(job.id) for job in jobs]
        difference: str = await self.questions.ask(asked.mission_difference, *texts, who=self.principal.client)
        return compared(figures_of(jobs[0]), figures_of(jobs[1]), difference)

    async def _log(self, action: str, study: Study) -> None:
        detail = f"{study.name}: {study.size} values of {study.key}"
        await asyncio.to_thread(self.people.log.write, self.principal, action, str(study.id), detail)


def table_of(study: Study) -> str:
    """Return a study as a table, CSV: a row for each value."""
    import csv
    import io

    names = ("job", "state", "cost", "duration", "margin", "largest_margin", "worst_error", "rounds", "seconds", "problem")
    text = io.StringIO()
    rows = csv.writer(text)
    rows.writerow((study.key, *names))
    for member in study.members:
        cells = ("" if (cell := getattr(member.figures, name)) is None else cell for name in names)
        rows.writerow((written(member.value), *map(_harmless, cells)))
    return text.getvalue()


def written(value: Varied) -> str:
    """Return a value as people read it: letters as they are, all else as JSON."""
    return value if isinstance(value, str) else json.dumps(value)


def _harmless(cell: object) -> object:
    """Return a cell that no spreadsheet takes for a formula."""
    return f"'{cell}" if isinstance(cell, str) and cell[:1] in ("=", "+", "-", "@") else cell
