"""Retention: for how long jobs, the log, recordings and what was deleted are kept, and the sweep that lets go of the rest.

A job goes only where nothing needs it. It has ended, and so has all that is made of its flight; who refers to it does so in no project and in no study. Each of its users is
asked by itself: what one lets go of, another keeps. Of its values those go that no other job has.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from ltlplan.service.event_inbox.flights import LiveFlights
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.models import ENDED, Job
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Principal, Role
from ltlplan.service.settings import FOR_EVER, Limits

EVERY = 3600.0
"""s between two sweeps."""
FIRST = 60.0
"""s from the start to the first one."""
_SWEEP = Principal("(retention)", Role.admin)
"""Who lets go, as the log says; no account has such a name."""

_log = logging.getLogger("ltlplan.service")


@dataclass(frozen=True, slots=True)
class Swept:
    """Counts of what a sweep let go of.

    Attributes:
        references: Jobs that were taken off somebody's list, once for each user.
        jobs: Jobs that were deleted.
        entries: Entries of the log.
        recordings: Recordings of flights.
    """

    references: int = 0
    jobs: int = 0
    entries: int = 0
    recordings: int = 0


@dataclass(frozen=True, slots=True)
class Retention:
    """The sweep of a service.

    Attributes:
        jobs: All jobs.
        people: Whose they are, and the log.
        live: Flights, with their recordings.
    """

    jobs: Jobs
    people: People
    live: LiveFlights

    @property
    def limits(self) -> Limits:
        """For how long what is kept."""
        return self.jobs.settings.limits

    async def run(self) -> None:
        """Sweep until this is cancelled."""
        await asyncio.sleep(FIRST)
        while True:
            try:
                swept = await self.sweep()
                if swept != Swept():
                    _log.info("retention: %s", swept)
            except Exception:  # the next one tries again
                _log.exception("what is not kept any longer cannot be deleted yet")
            await asyncio.sleep(EVERY)

    async def sweep(self, now: datetime | None = None) -> Swept:
        """Let go of what is not kept any longer.

        Args:
            now: The time; by default what it is.
        """
        now = now or datetime.now(UTC)
        references = await self._let_go_of_references(before(now, self.limits.keep_jobs_days))
        jobs = await self.delete_left(now)
        entries = await asyncio.to_thread(self.people.log.forget, before(now, self.limits.keep_log_days))
        age = self.limits.keep_recordings_days * 86_400.0
        recordings = 0 if age >= FOR_EVER * 86_400.0 else await self.live.forget_recordings(now.timestamp() - age)
        return Swept(references, jobs, entries, recordings)

    async def delete_left(self, now: datetime | None = None) -> int:
        """Delete jobs that nobody has referred to for as long as such are kept, and return how many they were; also those of which a kill kept that.

        Args:
            now: The time; by default what it is.
        """
        instant = before(now or datetime.now(UTC), self.limits.keep_deleted_days)
        gone = 0
        for job in await asyncio.to_thread(self.people.references.leaving, instant):
            async with self.jobs.referring:
                if self.people.references.users(job):
                    continue
                if self.jobs.register.find(job) is not None:
                    await self.jobs.cancel(job)
                    await self.jobs.delete(job)
                    gone += 1
                await asyncio.to_thread(self.people.references.left, job)
        return gone

    async def _let_go_of_references(self, instant: str) -> int:
        """Take jobs that ended before an instant off the lists of those who have them in no project and no study."""
        if not instant:
            return 0
        studied = await asyncio.to_thread(self.people.studies.all_jobs)
        gone = 0
        for entry in self.jobs.register:
            if not self._is_over(entry.job, instant) or entry.job.id in studied:
                continue
            async with self.jobs.referring:
                users = self._unbound(entry.job.id)
                if users and self._is_over(entry.job, instant):
                    await asyncio.to_thread(
                        self.people.log.write, _SWEEP, "expire", entry.job.id, f"of {', '.join(users)}"[:200]
                    )
                    await let_go(self.jobs, self.people, entry.job.id, users)
                    gone += len(users)
        return gone

    def _is_over(self, job: Job, instant: str) -> bool:
        """Return whether a job ended before an instant, and nothing is made of its flight at the moment."""
        if job.of is not None or job.ended is None or job.ended >= instant:
            return False
        made = self.jobs.register.derived(job.id)
        return all(each.job.state in ENDED and (each.job.ended or "") < instant for each in made)

    def _unbound(self, job: str) -> list[str]:
        """Return the users who have a job in no project."""
        found = ((user, self.people.references.find(job, user)) for user in self.people.references.users(job))
        return sorted(user for user, reference in found if reference is not None and not reference.project)


async def let_go(jobs: Jobs, people: People, job: str, users: Iterable[str]) -> None:
    """Have users refer to a job no more; one that nobody refers to is deleted, at once unless such are kept. `Jobs.referring` is held meanwhile.

    Args:
        jobs: All jobs.
        people: Whose they are.
        job: The job's id; it has ended where these are all.
        users: Who refers to it.
    """
    references, gone = people.references, list(users)
    kept = bool(gone) and jobs.settings.limits.keep_deleted_days > 0.0  # an admin deletes what nobody had any more
    if await asyncio.to_thread(references.drop, job, gone) and not kept:
        await jobs.delete(job)
        await asyncio.to_thread(references.left, job)


def before(now: datetime, days: float) -> str:
    """Return when it was so many days ago, as times are kept; of what is kept for ever the first of all.

    Args:
        now: The time.
        days: How many.
    """
    return "" if days >= FOR_EVER else (now - timedelta(days=days)).isoformat(timespec="milliseconds")


def kept_until(job: Job, limits: Limits) -> str | None:
    """Return the day until which a job that has ended is kept where no project and no study has it; None for ever."""
    if job.ended is None or job.project or limits.keep_jobs_days >= FOR_EVER:
        return None
    ended = datetime.fromisoformat(job.ended).timestamp()
    return time.strftime("%Y-%m-%d", time.gmtime(ended + 86_400.0 * limits.keep_jobs_days))
