"""Events of a job, with numbers that grow: sent as they happen, and again from what is stored.

    1 queued, 2 running; 1 000 000 i: stage i begins, + 1, 2 ...: its progress, + 900 000 ...: its claims, + 999 999: it ended;
    99 000 000: the job has ended

So the events of stages that are done have the same numbers after a restart, and a listener goes on where it was.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator

from ltlplan.service.models import ENDED, Event, Job, Stage

_STAGE = 1_000_000
_CLAIMS = 900_000
_LAST = 999_999
_END = 99 * _STAGE


def state_event(job: Job) -> Event:
    """Return the event that says which state a job is in."""
    number = _END if job.state in ENDED else {"queued": 1, "running": 2}[job.state]
    data = {"state": job.state, "problem": None if job.problem is None else job.problem.model_dump(mode="json")}
    sentence = f"{job.state}" if job.problem is None else f"{job.state}: {job.problem.detail}"
    return Event(id=number, kind="state", job=job.id, sentence=sentence, share=job.share, data=data)


def stage_event(job: Job, stage: Stage, number: int) -> Event:
    """Return the event that says that a stage has begun or ended, and what it found.

    Args:
        job: Whose.
        stage: As it is now.
        number: Which one it is, from 1.
    """
    return Event(
        id=number * _STAGE + (_LAST if stage.state in ENDED else 0),
        kind="stage",
        job=job.id,
        stage=stage.name,
        sentence=f"{stage.name}: {stage.state}",
        share=job.share,
        data=stage.model_dump(mode="json"),
    )


def claim_events(job: Job, stage: Stage, number: int) -> list[Event]:
    """Return an event for each claim that a stage checked.

    Args:
        job: Whose.
        stage: With what it found.
        number: Which one it is, from 1.
    """
    return [
        Event(
            id=number * _STAGE + _CLAIMS + index,
            kind="claim",
            job=job.id,
            stage=stage.name,
            sentence=claim["sentence"],
            share=job.share,
            data=claim,
        )
        for index, claim in enumerate(stage.found.get("claims", ())[: _LAST - _CLAIMS])
    ]


class Feed:
    """The events of one job as they happen; told from any thread, heard in any event loop.

    Of progress only the latest is kept.
    """

    def __init__(self) -> None:
        self._events: list[Event] = []
        self._closed = False
        self._lock = threading.Lock()
        self._listeners: set[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = set()

    def tell(self, event: Event) -> None:
        """Tell an event, unless one with its number or a later one was told."""
        with self._lock:
            if not self._events or event.id > self._events[-1].id:
                self._add(event)

    def progress(self, job: Job, stage: str, sentence: str, share: float) -> None:
        """Return how far a stage has come; its number is the next.

        Args:
            job: Whose.
            stage: Its name.
            sentence: What is being done.
            share: How much of the whole job is done, 0 to 1.
        """
        with self._lock:
            if self._events:
                number = self._events[-1].id + 1
                self._add(Event(id=number, kind="progress", job=job.id, stage=stage, sentence=sentence, share=share))

    def _add(self, event: Event) -> None:
        if self._closed:
            return
        if self._events and self._events[-1].kind == "progress" and event.kind == "progress":
            self._events.pop()
        self._events.append(event)
        self._notify()

    def close(self) -> None:
        """Tell no more, and let listeners go once they have heard all."""
        with self._lock:
            self._closed = True
            self._notify()

    def _notify(self) -> None:
        for loop, news in list(self._listeners):
            try:
                loop.call_soon_threadsafe(news.set)
            except RuntimeError:  # its loop has ended
                self._listeners.discard((loop, news))

    async def after(self, number: int) -> AsyncIterator[Event]:
        """Yield events with greater numbers as they are told, until no more are."""
        news = asyncio.Event()
        listener = (asyncio.get_running_loop(), news)
        with self._lock:
            self._listeners.add(listener)
        try:
            while True:
                news.clear()
                with self._lock:
                    fresh = [event for event in self._events if event.id > number]
                    closed = self._closed
                for event in fresh:
                    number = event.id
                    yield event
                if closed and not fresh:
                    return
                if not fresh:
                    await news.wait()
        finally:
            with self._lock:
                self._listeners.discard(listener)
