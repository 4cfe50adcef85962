"""A process that keeps jobs, to be killed: it submits missions, notes what was accepted and which stages begin, and ends with them.

python -m tests.helpers.serving.jobs_process DATA SEEDS [DATABASE]
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import sys
from pathlib import Path

from ltlplan.service.execution.workers import LocalWorkers
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.models import ENDED
from ltlplan.service.settings import Settings
from tests.helpers.motion.flights import small_mission

MISSION = small_mission("F a", margin=0.05)
NOTES = "notes"
"""File beside the data: a line each for what was accepted, which stage begins, and how jobs ended."""


class Notes(logging.Handler):
    """Writes each message of the service as one line, at once."""

    def __init__(self, place: Path) -> None:
        super().__init__()
        self.file = os.open(place, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def emit(self, record: logging.LogRecord) -> None:
        self.note(record.getMessage())

    def note(self, text: str) -> None:
        os.write(self.file, f"{text}\n".encode())


async def main(data: Path, seeds: int, database: str | None) -> None:
    data.mkdir(exist_ok=True)
    notes = Notes(data.with_name(data.name + "." + NOTES))
    log = logging.getLogger("ltlplan.service")
    log.setLevel(logging.INFO)
    log.addHandler(notes)
    workers = LocalWorkers(2)
    jobs = Jobs(Settings(data=data, database=database), workers)
    await jobs.start()
    notes.note("ready")
    for seed in range(seeds):
        job = await jobs.submit(MISSION, seed=seed)
        notes.note(f"accepted {job.id} {seed}")
    states: dict[str, str] = {}
    for job in await jobs.jobs(limit=10_000):
        async for _event in jobs.events(job.id):
            pass
        whole = await jobs.job(job.id)
        assert whole.state in ENDED
        states[job.id] = json.dumps([whole.state, [stage.name for stage in whole.stages], len(whole.files)])
    await jobs.stop()
    for name, state in states.items():
        notes.note(f"ended {name} {state}")
    notes.note("over")


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else None))
