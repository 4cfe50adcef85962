"""All jobs in memory: by their ids, in the order in which they were submitted, and by what they ask."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import get_args

from ltlplan.service.job_queue.job_records import Entry
from ltlplan.service.models import ENDED, Job, Problem, State
from ltlplan.service.problems import NotFound

_TRANSIENT = frozenset(
    {
        "cluster-error", "damaged", "internal-error", "limit-reached", "missing-engine", "no-room", "out-of-memory", "out-of-time",
        "solver-timeout", "stopped-early", "stored-error", "worker-died",
    }
)  # fmt: skip
"""Problems that are not a mission's own."""


class Register:
    """Index of all jobs. The same mission, seed and versions have one key; each job with a key is an attempt at it."""

    def __init__(self) -> None:
        self._entries: dict[str, Entry] = {}
        self._attempts: dict[str, list[str]] = {}

    def __iter__(self) -> Iterator[Entry]:
        """Yield all entries, those that were submitted first before others."""
        return iter(list(self._entries.values()))

    def add(self, entry: Entry) -> None:
        """Enter a job, as the one that was submitted last."""
        self._entries[entry.job.id] = entry
        self._attempts.setdefault(entry.job.key, []).append(entry.job.id)

    def drop(self, entry: Entry) -> None:
        """Forget a job."""
        del self._entries[entry.job.id]
        self._attempts[entry.job.key].remove(entry.job.id)

    def find(self, job_id: str) -> Entry | None:
        """Return what is known of a job; None where there is no such job."""
        return self._entries.get(job_id)

    def entry(self, job_id: str) -> Entry:
        """Return what is known of a job.

        Raises:
            NotFound: There is no such job.
        """
        entry = self._entries.get(job_id)
        if entry is None:
            raise NotFound(f"There is no job '{job_id[:80]}'.")
        return entry

    def new_id(self, key: str) -> str:
        """Return an id that no job with this key has."""
        attempts = self._attempts.get(key, [])
        return f"{key[:16]}-{1 + max((int(job_id.rpartition('-')[2]) for job_id in attempts), default=0)}"

    def answer(self, key: str) -> Job | None:
        """Return the job with a key that need not be tried again, if there is one.

        One that was cancelled, whose search was stopped at the best plan so far, whose values were found damaged, or that failed for a reason which is not its
        mission's own (time, memory, a bug), is tried again.
        """
        attempts = self._attempts.get(key)
        if not attempts:
            return None
        entry = self._entries[attempts[-1]]
        stopped = entry.job.stopped or (entry.stopping and entry.job.state not in ENDED)
        again = entry.damaged or entry.cancelled or stopped or entry.job.state == "cancelled"
        if again or (entry.job.state == "failed" and not _is_final(entry.job.problem)):
            return None
        return entry.job.model_copy(update={"found": True})

    def newest(
        self, *, state: State | None, limit: int, before: str | None, which: Callable[[Job], bool] | None = None
    ) -> list[Job]:
        """Return jobs, newest first; what is made of their flights is not listed.

        Args:
            state: Only those.
            limit: At most so many.
            before: Only those that were submitted before the job of this id.
            which: Only those of which this is true.
        """
        found: list[Job] = []
        passed = before is None
        for job_id in reversed(self._entries):
            job = self._entries[job_id].job
            if passed and job.of is None and state in (None, job.state) and (which is None or which(job)):
                found.append(job)
                if len(found) >= limit:
                    break
            passed = passed or job_id == before
        return found

    def derived(self, job_id: str) -> list[Entry]:
        """Return the jobs of what is made of a job's flight."""
        return [entry for entry in self if entry.job.of == job_id]

    def count(self, state: State, who: str | None = None) -> int:
        """Return how many jobs are in a state, of all users or of one."""
        return sum(entry.job.state == state and who in (None, entry.asked.get("who")) for entry in self)

    def counts(self) -> dict[State, int]:
        """Return how many jobs are in each state, without what is made of flights."""
        found: dict[State, int] = dict.fromkeys(get_args(State), 0)
        for entry in self:
            if entry.job.of is None:
                found[entry.job.state] += 1
        return found

    def asked_by(self) -> dict[str, str]:
        """Return who submitted each job first, without what is made of flights."""
        return {entry.job.id: entry.asked.get("who", "") for entry in self if entry.job.of is None}

    def going(self) -> set[str]:
        """Return the ids of all jobs that have not ended."""
        return {entry.job.id for entry in self if entry.job.state not in ENDED}


def _is_final(problem: Problem | None) -> bool:
    """Return whether a job failed for a reason that is its mission's own, so that another try would fail alike."""
    return problem is not None and problem.type.rpartition("/")[2] not in _TRANSIENT
