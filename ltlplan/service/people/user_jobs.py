"""Jobs as one user has them: submitted, looked at, cancelled and deleted by the user's role and references. Routes and pages have no other way to jobs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

from ltlplan.service.models import ENDED, DerivedKind, Event, Job, State, Whose
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Action, Principal, require
from ltlplan.service.problems import Conflict, Forbidden, NotFound
from ltlplan.service.storage.retention import let_go

if TYPE_CHECKING:
    from ltlplan.service.execution.derived import Derived
    from ltlplan.service.job_queue.jobs import Jobs
    from ltlplan.service.job_queue.results import StoredFile
    from verify.data import Mission

_TRIES = 3
"""How often a submission is repeated whose job was deleted by its last user in that instant."""


class UserJobs:
    """Jobs as one user has them.

    Args:
        jobs: All jobs.
        people: Whose they are.
        principal: Who asks.
    """

    def __init__(self, jobs: Jobs, people: People, principal: Principal) -> None:
        self._jobs, self._people, self._principal = jobs, people, principal

    async def submit(self, mission: Mission, *, seed: int | None = None, project: str | None = None, lane: str = "") -> Job:
        """Accept a mission, and refer to its job; as `Jobs.submit`.

        Args:
            mission: What is asked.
            seed: Source of every draw, instead of the mission's own.
            project: Project to put it into, empty for none; None leaves one that is known where it is.
            lane: As `Jobs.submit`.

        Raises:
            Forbidden: The role is not enough.
            LtlplanError: As `Jobs.submit`.
        """
        self._require(Action.PLAN)
        references = self._people.references
        if project:
            await asyncio.to_thread(references.require_project, project, self._principal)
        for _ in range(_TRIES):
            job = await self._jobs.submit(mission, seed=seed, who=self._principal.client, lane=lane)
            async with self._jobs.referring:
                if self._jobs.register.find(job.id) is not None:
                    new = references.find(job.id, self._principal.user) is None
                    await asyncio.to_thread(references.add, job.id, self._principal.user, project)
                    await self._expect(job)
                    if new or not job.found:
                        await self._log("submit", job.id, f"{job.mission}, seed {job.seed}")
                    return self._seen(job)
        raise Conflict("This job was deleted while it was submitted; submit it again.")

    async def derive(self, job_id: str, asked: Derived) -> Job:
        """Accept what is to be made of a job's flight; as `Jobs.derive`.

        Raises:
            NotFound: There is no such job that the user sees.
            Forbidden: The role is not enough.
            LtlplanError: As `Jobs.derive`.
        """
        self._require(Action.PLAN)
        self.require_seen(job_id)
        made = await self._jobs.derive(job_id, asked, who=self._principal.client)
        await self._expect(made)
        if not made.found:
            await self._log(asked.kind, job_id, asked.title[:200])
        return self._seen(made)

    async def derived(self, job_id: str, kind: DerivedKind | None = None) -> list[Job]:
        """Return the jobs of what was made of a job's flight, the newest first, with what they found.

        Args:
            job_id: The job's.
            kind: Only of this kind.

        Raises:
            NotFound: There is no such job that the user sees.
        """
        self.require_seen(job_id)
        entries = reversed(self._jobs.register.derived(job_id))
        return [await self.job(each.job.id) for each in entries if kind in (None, each.job.kind)]

    async def move(self, job_id: str, project: str) -> Job:
        """Put a job of one's own into another project.

        Args:
            job_id: The job's.
            project: The project's name; empty for none.

        Raises:
            NotFound: There is no such job that the user sees.
            Conflict: It is another's.
        """
        self._require(Action.PLAN)
        job = self.require_seen(job_id)
        references = self._people.references
        if job.of is not None or references.find(job_id, self._principal.user) is None:
            raise Conflict(
                f"Job {job_id} is {self._seen(job).owner}'s, or made of a flight; submit its mission, then it is yours too."
            )
        await asyncio.to_thread(references.require_project, project, self._principal)
        await self._log("move", job_id, project or "no project")
        await asyncio.to_thread(references.add, job_id, self._principal.user, project)
        return await self.job(job_id)

    async def jobs(
        self,
        *,
        state: State | None = None,
        limit: int = 50,
        before: str | None = None,
        whose: Whose = "visible",
        project: str | None = None,
        search: str = "",
    ) -> list[Job]:
        """Return jobs, newest first, without what their stages found; what is made of flights is not listed.

        Args:
            state: Only those.
            limit: At most so many.
            before: Only those that were submitted before the job of this id.
            whose: Whose they are.
            project: Only of this project.
            search: Only those that have these letters in name, formula, id, owner or project, in any case.

        Raises:
            Forbidden: Everybody's are for admins.
        """
        self._require(Action.ADMINISTER if whose == "all" else Action.READ)
        everybodys = whose == "all" or (whose == "visible" and not self._people.needed)

        wanted = search.casefold()

        def listed(job: Job) -> bool:
            seen = self._people.references.seen(job.id, self._principal)
            own = seen is not None and (
                seen.user == self._principal.user or (whose != "mine" and self._people.references.is_shared(seen.project))
            )
            where = "" if seen is None else seen.project
            if not (own or everybodys) or project not in (None, where):
                return False
            owner = "" if seen is None else seen.user
            return not wanted or wanted in f"{job.mission} {job.title} {job.id} {owner} {where}".casefold()

        found = await self._jobs.jobs(state=state, limit=limit, before=before, which=listed)
        return [self._seen(job) for job in found]

    async def job(self, job_id: str) -> Job:
        """Return a job with all that its stages found so far.

        Raises:
            NotFound: There is no such job that the user sees.
        """
        self.require_seen(job_id)
        return self._seen(await self._jobs.job(job_id))

    async def events(self, job_id: str, *, after: int = 0) -> AsyncIterator[Event]:
        """Yield a job's events; as `Jobs.events`. It ends with an error once the user does not see the job any more.

        Raises:
            NotFound: There is no such job that the user sees.
        """
        self.require_seen(job_id)
        async for event in self._jobs.events(job_id, after=after):
            if event.kind != "progress":
                self.require_seen(job_id)
            yield event

    async def waited(self, job_id: str, seconds: float) -> Job:
        """Return a job when it has ended, or as it is after so many seconds.

        Raises:
            NotFound: There is no such job that the user sees.
        """
        self.require_seen(job_id)
        return self._seen(await self._jobs.waited(job_id, seconds))

    async def cancel(self, job_id: str) -> Job:
        """Cancel a job, for all who have it; one that others have too is only left, by deleting it.

        Raises:
            NotFound: There is no such job that the user sees.
            Forbidden: It is another's.
            Conflict: Others have it too.
        """
        self._require(Action.PLAN)
        job = self._require_own(job_id, "cancel")
        if job.state in ENDED:
            return self._seen(job)
        self._require_alone(job, "Delete it to take it off your list.")
        await self._log("cancel", job_id)
        return self._seen(await self._jobs.cancel(job_id))

    async def stop_search(self, job_id: str) -> Job:
        """Have a job's search end with the best plan so far; as `Runner.end_search`.

        Raises:
            NotFound: There is no such job that the user sees.
            Forbidden: It is another's.
            Conflict: It does not search, or others wait for its answer.
        """
        self._require(Action.PLAN)
        self._require_alone(self._require_own(job_id, "stop"), "Submit the mission with another seed for a search of your own.")
        entry = self._jobs.register.entry(job_id)
        self._jobs.runner.end_search(entry)
        await self._log("stop-search", job_id)
        return self._seen(entry.job)

    async def delete(self, job_id: str) -> None:
        """Refer to a job no more; the last reference takes the job with it, with its files and what was made of its flight. An admin who has none ends all.

        Raises:
            NotFound: There is no such job that the user sees.
            Forbidden: It is another's.
            Conflict: It has not ended, and nobody else has it.
        """
        self._require(Action.PLAN)
        job = self._require_own(job_id, "delete")
        if job.of is not None:
            await self._log("delete", job_id, job.title)
            await self._jobs.delete(job_id)
            return
        references = self._people.references
        async with self._jobs.referring:
            users = references.users(job_id)
            own = self._principal.user in users and self._people.needed
            gone = {self._principal.user} if own else set(users)
            if gone == set(users):
                self._jobs.require_ended(job_id)
            await self._log("delete", job_id, "" if gone == {self._principal.user} else f"of {', '.join(sorted(gone))}"[:200])
            await let_go(self._jobs, self._people, job_id, gone)

    async def file(self, job_id: str, name: str) -> StoredFile:
        """Return a file of a job; as `Jobs.file`.

        Raises:
            NotFound: There is no such job that the user sees, or it has no such file.
        """
        self.require_seen(job_id)
        return await self._jobs.file(job_id, name)

    async def plan(self, job_id: str) -> tuple[str, str] | None:
        """Return a job's mission.yaml and plan.json as soon as it is planned; None before.

        Raises:
            NotFound: There is no such job that the user sees.
        """
        self.require_seen(job_id)
        return await self._jobs.plan(job_id)

    async def mission(self, job_id: str) -> str:
        """Return the resolved mission of a job as YAML.

        Raises:
            NotFound: There is no such job that the user sees.
        """
        self.require_seen(job_id)
        return await self._jobs.mission(job_id)

    def owns(self, job: Job) -> bool:
        """Return whether the user may cancel and delete a job that is seen."""
        return self._principal.sees_all or job.owner == self._principal.user

    def require_room(self, count: int) -> None:
        """Require that more jobs of the user may wait; as `Admission.require_room`."""
        self._jobs.admission.require_room(self._principal.client, count)

    # What is decided

    def _require(self, action: Action) -> None:
        require(self._principal, action)

    def require_seen(self, job_id: str) -> Job:
        """Return a job, without what its stages found; of what is made of a flight, who sees the flight's job sees it.

        Raises:
            NotFound: There is no such job, or it is not to be seen: nothing tells one from the other.
        """
        self._require(Action.READ)
        job = self._jobs.register.entry(job_id).job
        seen = self._principal.sees_all or self._people.references.seen(job.of or job.id, self._principal) is not None
        if not seen:
            raise NotFound(f"There is no job '{job_id[:80]}'.")
        return job

    def _require_own(self, job_id: str, what: str) -> Job:
        job = self.require_seen(job_id)
        if self._principal.sees_all:
            return job
        users = self._people.references.users(job.of or job.id)
        if self._principal.user not in users:
            raise Forbidden(f"Job {job_id} is {self._seen(job).owner}'s; only its owner and admins can {what} it.")
        if job.of is not None and len(users) > 1:
            raise Forbidden(f"{len(users) - 1} more users have the flight that this is made of; only admins can {what} it.")
        return job

    def _require_alone(self, job: Job, advice: str) -> None:
        """Require that nobody else waits for a job, or an admin who does not decides.

        Raises:
            Conflict: Others have it too.
        """
        others = [user for user in self._people.references.users(job.id) if user != self._principal.user]
        if others and (self._refers(job.id) or not self._principal.sees_all) and self._people.needed:
            raise Conflict(f"Job {job.id} goes on: {len(others)} more of this service's users wait for it. {advice}")

    def _refers(self, job_id: str) -> bool:
        return self._people.references.find(job_id, self._principal.user) is not None

    def _seen(self, job: Job) -> Job:
        """Return a job with the reference by which it is seen."""
        reference = self._people.references.seen(job.of or job.id, self._principal)
        if reference is None:
            return job
        return job.model_copy(update={"owner": reference.user, "project": reference.project})

    async def _expect(self, job: Job) -> None:
        """Have the user's webhooks hear of a job's end."""
        if not (job.found and job.state in ENDED):
            await asyncio.to_thread(self._people.webhooks.expect, self._principal.user, job.id)

    async def _log(self, action: str, job_id: str, detail: str = "") -> None:
        await asyncio.to_thread(self._people.log.write, self._principal, action, job_id, detail)
