"""Health of the jobs: whether database and workers answer, whether every job goes on, and whether there is room."""

from __future__ import annotations

from collections.abc import Mapping

from ltlplan.service.job_queue.engine import TRIES, Interruption
from ltlplan.service.job_queue.job_index import Register
from ltlplan.service.job_queue.results import RESERVE
from ltlplan.service.job_queue.runner import Pool
from ltlplan.service.models import Health
from ltlplan.service.provenance import software


def health_of(database: str, interrupted: Mapping[str, Interruption], room: int, workers: Pool, register: Register) -> Health:
    """Return the health of the jobs.

    Args:
        database: "answers", or what is wrong with it.
        interrupted: Jobs whose work was given up, until they come a step further.
        room: Bytes that are free.
        workers: Who computes missions.
        register: All jobs.
    """
    stopped = dict(interrupted)
    loops = any(each.times >= TRIES for each in stopped.values())
    return Health(
        ok=database == "answers" and workers.trouble is None and not loops and room >= RESERVE,
        database=database,
        computing=workers.trouble or "answers",
        interrupted={job: f"given up {each.times} times: {each.why}" for job, each in stopped.items()},
        workers=workers.count,
        alive=workers.alive,
        running=register.count("running"),
        queued=register.count("queued"),
        room=room,
        versions=software(),
    )
