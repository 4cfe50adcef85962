"""Tasks on a worker of a Dask cluster: each in a process of its own, with the bounds that it has on one machine.

Workers are asked with bytes and answer with bytes, so that nothing of the work is loaded in the worker's own process.
"""

from __future__ import annotations

import pickle
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal

from ltlplan.service.execution.resource_limits import Bounds, WorkerDied
from ltlplan.service.execution.worker_main import error_data
from ltlplan.service.execution.worker_process import Stopped, supervised, warm_up
from ltlplan.service.provenance import differences, here
from verify.data import LtlplanError
from verify.data.progress import Progress

if TYPE_CHECKING:
    from distributed import Worker

TOPIC = "ltlplan"
"""Of the events by which progress travels through the scheduler."""
_BETWEEN = 0.5
"""s between two sentences of progress: each is a message to all who listen."""

Answer = tuple[Literal["found"], bytes] | tuple[Literal["raised"], Any] | tuple[Literal["differs"], tuple[str, list[str]]]
"""What was found, pickled; what an error is made of; or where which versions differ."""


def join_in() -> dict[str, str]:
    """Get ready for work, and tell what this machine's findings rest on; runs on every worker."""
    with suppress(WorkerDied):  # the first piece of work begins it then
        warm_up()
    return here()


_ENOUGH: set[str] = set()
"""Keys of tasks whose searches are to end with the best plan so far."""


def end_search(key: str) -> None:
    """Have the search of a task end; runs on every worker.

    Args:
        key: Of the Dask task.
    """
    _ENOUGH.add(key)


def do_supervised(packed: bytes, bounds: Bounds, versions: dict[str, str], key: str) -> Answer:
    """Do a piece of work in a process of its own; runs in a thread of a Dask worker.

    Args:
        packed: The function and its arguments, pickled.
        bounds: What the work may take.
        versions: What `versions.here` says where the work comes from.
        key: Of the Dask task, under which progress is told and by which its end is noticed.

    Raises:
        Reschedule: This worker is closing, or nobody waits for the work any more.
    """
    from distributed import Reschedule, get_worker

    worker = get_worker()
    if differing := differences(versions, here()):
        return "differs", (worker.address, differing)
    try:
        return "found", supervised(
            _unpacked,
            (packed,),
            bounds=bounds,
            progress=_through(worker, key),
            stopped=lambda: _stopped(worker, key),
            enough=lambda: key in _ENOUGH,
        )
    except Stopped:
        raise Reschedule from None
    except LtlplanError as error:
        return "raised", error_data(error)
    finally:
        _ENOUGH.discard(key)


def _stopped(worker: Worker, key: str) -> bool:
    """Return whether nobody waits for a task any more: the scheduler took it back, or the worker is leaving."""
    task = worker.state.tasks.get(key)
    return task is None or task.state == "cancelled" or worker.status.name in ("closing", "closed", "failed")


def _through(worker: Worker, key: str) -> Progress:
    """Return a progress that is told to all who listen to the scheduler, now and then."""
    last = -_BETWEEN

    def tell(sentence: str, share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _BETWEEN:
            last = now
            worker.log_event(TOPIC, [key, sentence, share])

    return tell


def _unpacked(packed: bytes, progress: Progress) -> bytes:
    """Do the work; runs in the process of its own."""
    work, arguments = pickle.loads(packed)
    return pickle.dumps(work(*arguments, progress), protocol=5)
