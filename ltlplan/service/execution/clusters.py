"""The workers of a Dask cluster, behind the interface of those of this machine.

A scheduler and its workers run already; we are one of its clients. A worker that dies costs only the piece of work that it was at,
which the scheduler gives to another. Where the scheduler itself goes away, a command ends with a sentence and the service waits and
asks again. Whoever would compute otherwise than we do, for its versions or its processor, takes no part.

Everything Dask happens in one thread with a loop of its own: a piece of work is a coroutine there, and a future outside.
"""

from __future__ import annotations

import asyncio
import logging
import pickle
import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from secrets import token_hex
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar
from weakref import WeakKeyDictionary

from ltlplan.service.execution.cluster_tasks import TOPIC, Answer, do_supervised, end_search, join_in
from ltlplan.service.execution.resource_limits import Bounds, WorkerDied
from ltlplan.service.execution.worker_main import error_from
from ltlplan.service.provenance import differences, here
from verify.data import BadInput, MissingEngine
from verify.data.progress import Progress, silent

if TYPE_CHECKING:
    from distributed import Client

Found = TypeVar("Found")

TRIES = 3
"""How often work is begun whose process is ended from outside."""
_CONNECT = 5.0
"""s that a scheduler has to answer, and to have a worker."""
_GRACE = 30.0
"""s without any worker until a command gives up: as long as a worker takes that is started again."""
_LOOK = 1.0
"""s between looks at the scheduler."""


class ClusterError(BadInput):
    """A Dask cluster that cannot be used, or not any more."""


class _Tell(Protocol):
    """Progress whose share may be the one that was told last."""

    def __call__(self, sentence: str, share: float | None = None, /) -> None: ...


@dataclass(slots=True)
class _Task:
    """A piece of work.

    Attributes:
        packed: The function and its arguments, pickled.
        rank: Work of a lower rank is begun first.
        key: Of the Dask task that does it at the moment; empty before there is one.
    """

    packed: bytes
    rank: float
    key: str = ""


class _Lost(Exception):
    """The scheduler went away."""


class Cluster:
    """A Dask cluster at work for us.

    Attributes:
        address: Of the scheduler.
        bounds: What one piece of work may take.
        versions: What our own findings rest on; workers of which that is not true take no part.
    """

    def __init__(
        self, address: str, *, patient: bool = False, seconds: float = 3600.0, megabytes: int = 4096, wall: float = 86_400.0
    ) -> None:
        """Become a client of a scheduler.

        Args:
            address: Of the scheduler, such as "tcp://10.0.0.1:8786".
            patient: Wait where the scheduler goes away later, or loses its last worker, instead of giving up.
            seconds: s of processor time that a piece of work may take.
            megabytes: MB of memory that it may take.
            wall: s that it may last.

        Raises:
            MissingEngine: The extra `dask` is not installed.
            ClusterError: No scheduler answers, it has no workers, or one of them would not find the same.
        """
        try:
            import_module("distributed")
        except ImportError:
            raise MissingEngine("A Dask cluster needs distributed: pip install 'ltlplan[dask]'.") from None
        for name in ("client", "comm", "core", "batched"):  # what they complain of is told in our own words
            logging.getLogger(f"distributed.{name}").setLevel(logging.CRITICAL)
        self.address = address
        self.bounds = Bounds(seconds=seconds, megabytes=megabytes, wall=wall)
        self.versions = here()
        self._patient = patient
        self._client: Client | None = None
        self._threads: dict[str, int] = {}
        self._refused: dict[str, str] = {}
        self._without_workers: float | None = None
        self._work: set[asyncio.Task[Any] | None] = set()
        self._begun: set[str] = set()
        self._told: dict[str, Progress] = {}
        self._tasks: WeakKeyDictionary[Future[Any], _Task] = WeakKeyDictionary()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="Dask client", daemon=True)
        self._keeper: asyncio.Task[None] | None = None
        self._thread.start()
        try:
            asyncio.run_coroutine_threadsafe(self._begin(), self._loop).result()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_raised: object) -> None:
        self.close()

    @property
    def count(self) -> int:
        """Number of pieces of work that are done at the same time: the threads of all workers."""
        return max(sum(threads for worker, threads in self._threads.items() if worker not in self._refused), 1)

    @property
    def trouble(self) -> str | None:
        """Reason why nothing is computed at the moment: the scheduler has gone, or no worker may take part; None where one does."""
        if self._client is None:
            return f"the Dask scheduler at {self.address} does not answer"
        if any(worker not in self._refused for worker in self._threads):
            return None
        return next((self._refused[worker] for worker in self._threads), self._no_workers())

    @property
    def alive(self) -> int:
        """Number of pieces of work that have begun."""
        return len(self._begun)

    def submit(
        self, work: Callable[..., Found], /, *arguments: object, progress: Progress | None = None, rank: float = 0.0
    ) -> Future[Found]:
        """Have work done on the cluster; cancelling ends the process that does it, at once.

        Args:
            work: A function that is given the arguments and, last, whom to tell its progress.
            arguments: What it is given; must be picklable.
            progress: Receives a sentence and the share done, 0 to 1, from a thread of ours.
            rank: Work of a lower rank is begun first.

        Raises:
            BadInput: The cluster was closed.
        """
        import cloudpickle  # comes with distributed; a script's own functions and classes travel whole

        if self._loop.is_closed():
            raise BadInput("The cluster was closed.")
        task = _Task(cloudpickle.dumps((work, arguments)), rank)
        future = asyncio.run_coroutine_threadsafe(self._done(task, progress or silent), self._loop)
        self._tasks[future] = task
        return future

    def end_search(self, work: Future[Any]) -> None:
        """Have the search of work that has begun end with the best plan so far."""
        task, client = self._tasks.get(work), self._client
        if task is not None and task.key and client is not None:
            asyncio.run_coroutine_threadsafe(_told_all(client, task.key), self._loop)

    def close(self) -> None:
        """End all work of ours on the cluster, and leave it."""
        if self._loop.is_closed():
            return
        with suppress(Exception):  # a cluster that has gone has nothing to say on our leaving
            asyncio.run_coroutine_threadsafe(self._end(), self._loop).result(timeout=2 * _CONNECT)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=_CONNECT)
        if not self._thread.is_alive():
            self._loop.close()

    # In the thread of the loop

    async def _begin(self) -> None:
        await self._connect()
        if self._refused:
            raise ClusterError(next(iter(self._refused.values())))
        self._keeper = asyncio.create_task(self._keep())

    async def _connect(self) -> None:
        """Become a client of the scheduler, and ask all workers what their findings would rest on."""
        from distributed import Client

        client: Any = None  # the types of distributed leave most unknown
        try:
            client = Client(self.address, asynchronous=True, set_as_default=False, timeout=_CONNECT)
            await client
            client.subscribe_topic(TOPIC, self._hear)
            began = time.monotonic()
            while not (threads := await client.nthreads()) and time.monotonic() - began < _CONNECT:
                await asyncio.sleep(0.1)
            if not threads:
                raise ClusterError(self._no_workers())
            answers = await asyncio.wait_for(client.run(join_in, on_error="return"), 4 * _CONNECT)
            told = {worker: _refusal(worker, self.versions, theirs) for worker, theirs in answers.items()}
            self._refused = {worker: refusal for worker, refusal in told.items() if refusal}
        except (OSError, ValueError, CancelledError) as error:
            await _left(client)
            raise ClusterError(
                f"No Dask scheduler answers at {self.address} ({str(error) or type(error).__name__}); start one with `dask scheduler`, give "
                "the address that it names, or leave --dask out to compute on this machine."
            ) from None
        except BaseException:
            await _left(client)
            raise
        self._client = client
        self._see(threads)

    async def _keep(self) -> None:
        """Look at the scheduler now and then; go back to one that went away."""
        while True:
            await asyncio.sleep(_LOOK)
            client: Any = self._client
            try:
                if client is None:
                    await self._connect()
                elif client.status != "running":
                    raise _Lost
                else:
                    self._see(await asyncio.wait_for(client.nthreads(), 4 * _CONNECT))
            except Exception:  # whatever a scheduler that is going away makes of it: nobody else would go back to it
                self._client, self._threads = None, {}
                await _left(client)
                if not self._patient:
                    return

    def _see(self, threads: dict[str, int]) -> None:
        self._threads = dict(threads)
        if any(worker not in self._refused for worker in threads):
            self._without_workers = None
        elif self._without_workers is None:
            self._without_workers = time.monotonic()

    def _hear(self, event: tuple[float, Any]) -> None:
        key, sentence, share = event[1]
        if key in self._told:
            self._begun.add(key)
            self._told[key](sentence, share)

    async def _done(self, work: _Task, progress: Progress) -> Any:
        """Have work done, on one worker after the other if need be, and return what was found or raise what was raised."""
        task, died, reached = asyncio.current_task(), 0, 0.0
        self._work.add(task)

        def tell(sentence: str, share: float | None = None) -> None:
            nonlocal reached
            reached = reached if share is None else share
            progress(sentence, reached)

        try:
            while True:
                answer = await self._answer(work, tell)
                if answer is None:
                    await self._patience(tell)
                elif answer[0] == "found":
                    return pickle.loads(answer[1])
                elif answer[0] == "differs":
                    self._refused[answer[1][0]] = _told_differences(*answer[1])
                else:
                    error = error_from(answer[1])
                    died += isinstance(error, WorkerDied)
                    if not isinstance(error, WorkerDied) or died == TRIES:
                        raise error
        finally:
            self._work.discard(task)

    async def _patience(self, tell: _Tell) -> None:
        """Wait a moment for a scheduler that went away, or give up."""
        if not self._patient:
            raise ClusterError(  # nothing of ours is lost: files are written whole, by us
                f"The Dask scheduler at {self.address} went away in the middle; nothing was left half done. Start it and its workers "
                "again and repeat this, or leave --dask out to compute on this machine."
            )
        if self._client is None:
            tell(f"waiting for the Dask scheduler at {self.address}")
        await asyncio.sleep(_LOOK)

    async def _answer(self, work: _Task, tell: _Tell) -> Answer | None:
        """Ask the cluster once; None where its scheduler has gone."""
        from distributed import KilledWorker

        client: Any = self._client
        if client is None or client.status != "running":
            return None
        some = [worker for worker in self._threads if worker not in self._refused] if self._refused else None
        if some == []:
            self._give_up(tell)
            return None
        key = work.key = f"ltlplan-{token_hex(16)}"
        self._told[key] = tell
        asked = client.submit(
            do_supervised, work.packed, self.bounds, self.versions, key, key=key, pure=False, priority=-work.rank, workers=some
        )
        result = asyncio.ensure_future(asked.result())
        result.add_done_callback(lambda ended: ended.cancelled() or ended.exception())  # whoever still waits hears it too
        try:
            while not (await asyncio.wait([result], timeout=_LOOK))[0]:
                if self._client is not client:
                    return None
                self._check_workers(tell)
            return result.result()
        except CancelledError:  # Dask's own word for what it lost with the scheduler; ours is asyncio's
            return None
        except KilledWorker:
            raise WorkerDied(f"One worker of {self.address} after the other died while it did this.") from None
        except (BadInput, WorkerDied):
            raise
        except Exception as error:
            raise ClusterError(
                f"A worker of {self.address} could not begin ({type(error).__name__}: {error}); install the same ltlplan on all of them."
            ) from None
        finally:
            result.cancel()
            asked.release()
            self._told.pop(key, None)
            self._begun.discard(key)

    def _check_workers(self, tell: _Tell) -> None:
        """Give up, or say that we wait, where the scheduler has named no worker for long; one that is slow to answer may have some."""
        if self._without_workers is not None and time.monotonic() - self._without_workers > _GRACE:
            self._give_up(tell)

    def _give_up(self, tell: _Tell) -> None:
        """Say why no worker does the work, and raise it unless we are patient."""
        told = self.trouble or self._no_workers()
        if not self._patient:
            raise ClusterError(told)
        tell(f"waiting: {told}")

    def _no_workers(self) -> str:
        return (
            f"The Dask scheduler at {self.address} has no workers; start some with `dask worker {self.address}`, where the same "
            "ltlplan is installed."
        )

    async def _end(self) -> None:
        if self._keeper is not None:
            self._keeper.cancel()
        work = [task for task in self._work if task is not None]
        for task in work:
            task.cancel()
        await asyncio.gather(*work, return_exceptions=True)
        client, self._client = self._client, None
        await _left(client)


async def _told_all(client: Any, key: str) -> None:
    """Have whichever worker does a task end its search."""
    with suppress(Exception):  # whoever asked sees that it goes on, and asks again
        await asyncio.wait_for(client.run(end_search, key, on_error="ignore"), _CONNECT)


async def _left(client: Any) -> None:
    """Close a client, whatever became of its scheduler."""
    if client is not None:
        with suppress(Exception):
            await asyncio.wait_for(client.close(timeout=1), _CONNECT)


def _refusal(worker: str, ours: dict[str, str], theirs: dict[str, str] | Exception) -> str:
    """Return why a worker takes no part; empty where it may."""
    if isinstance(theirs, Exception):
        return f"ltlplan is missing on the Dask worker {worker}, or another version ({theirs}); install the same as here."
    differing = differences(ours, theirs)
    return _told_differences(worker, differing) if differing else ""


def _told_differences(worker: str, differing: list[str]) -> str:
    return (
        f"The Dask worker {worker} could find something else than this machine: {'; '.join(differing)}. Install the same versions on "
        "all machines (constraints.txt), of one kind, or leave --dask out."
    )
