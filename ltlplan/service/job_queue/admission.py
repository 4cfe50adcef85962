"""Admission of jobs: what is asked, checked against all rules before it is accepted, and how much may wait."""

from __future__ import annotations

import asyncio
import hashlib
from dataclasses import dataclass, field

from ltlplan.service.execution.derived import Derived
from ltlplan.service.job_queue.job_index import Register
from ltlplan.service.job_queue.lru_cache import Recent
from ltlplan.service.job_queue.results import Results
from ltlplan.service.models import Job
from ltlplan.service.problems import TooManyRequests
from ltlplan.service.provenance import key_of, key_of_asked
from ltlplan.service.settings import Limits
from verify.data import Mission, check_mission


@dataclass(frozen=True, slots=True)
class Admission:
    """Rules by which jobs are accepted.

    Attributes:
        limits: How many may wait.
        register: All jobs.
        results: Where what is found needs room.
    """

    limits: Limits
    register: Register
    results: Results
    _known: Recent[tuple[str, Mission, Mission]] = field(default_factory=lambda: Recent(200))

    async def asked(self, mission: Mission, seed: int | None) -> tuple[str, Mission]:
        """Return the key of what is asked, and the mission with its seed; of a value that was asked before as they were.

        Raises:
            BadInput: The mission is not allowed.
        """
        known = self._known.get((id(mission), seed))
        if known is None:
            # kept with the mission, so that no other has its identity
            known = (*await asyncio.to_thread(_checked, mission, seed), mission)
            self._known.put((id(mission), seed), known)
        return known[:2]

    def require_room(self, who: str, count: int = 1) -> None:
        """Require that more jobs may wait.

        Args:
            who: Who asks for them.
            count: How many.

        Raises:
            TooManyRequests: Too many jobs wait.
            NoRoom: The disk is full.
        """
        waiting = self.register.count("queued")
        more = "submit this one later" if count == 1 else f"{count} more are too many; submit them later"
        if who and (own := self.register.count("queued", who)) + count > (most := self.limits.queued_each):
            raise TooManyRequests(f"{own} of your jobs are waiting already, and {most} may; {more}.", 30.0)
        if waiting + count > (most := self.limits.queued):
            raise TooManyRequests(f"{waiting} jobs are waiting already, and {most} may; {more}.", 30.0)
        self.results.require_room()


def _checked(mission: Mission, seed: int | None) -> tuple[str, Mission]:
    """Return the key of a mission, and the mission with its seed, checked against all rules."""
    from flight.certificate_checks import require_tube
    from ltlplan.planner import with_seed

    mission = with_seed(check_mission(mission), seed)
    require_tube(mission.margin)
    return key_of(mission), mission


def derived_key(flown: Job, asked: Derived) -> str:
    """Return the key of a request about a flight: the same request about the same files by the same versions has the same.

    Args:
        flown: The flight's job.
        asked: What is to be made of it.
    """
    files = {file.name: file.sha256 for file in flown.files}
    sent = {"sent": hashlib.sha256(asked.recording).hexdigest()} if asked.recording else {}
    return key_of_asked({asked.kind: asked.plain(), "of": flown.id, "files": files, **sent})
