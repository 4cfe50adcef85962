"""The fourth tab: what is proved, and where it is tightest; of a refusal why, and what would mend it.

The claims themselves stand beside the scene (`assets/flight.js`); here is what a refusal says and offers.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any

from ltlplan.service.page.components import Flight
from ltlplan.service.page.elements import Part, Words, box, button
from ltlplan.service.page.missions import checking
from ltlplan.service.page.next_steps import next_steps
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.models import Job, Problem
    from ltlplan.service.page.session_state import Desk

_FINER = 1000.0
"""A margin that is offered is a whole number of these parts of a metre."""


class _Refusal:
    """Explanation of a refusal."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.place = box("refusal")
        self.part = Part(self.place)
        desk.on_job.append(self.show)

    def show(self, job: Job | None) -> None:
        """Show what is to be said of a job, if anything."""
        known = None if job is None else (job.id, job.state, job.ended is None, job.problem, _largest_margin(job))
        self.part.show(known, lambda: self._draw(job))

    def _draw(self, job: Job | None) -> None:
        if job is None:
            next_steps(self.desk, "Choose a job under Plan to see what is proved of it.")
        elif job.problem is not None:
            self._problem(job, job.problem)
        elif job.state == "cancelled":
            Words("p", "This job was cancelled: nothing is proved of it.", "soft")
        elif job.ended is None:
            Words("p", "Nothing is proved yet: the job is under way.", "soft")

    def _problem(self, job: Job, problem: Problem) -> None:
        told = problem.model_dump()
        with box("problem"):
            Words("h2", problem.title)
            Words("pre", problem.detail, "words-of-command")
            core, reasons = told.get("core") or (), told.get("reasons") or ()
            if core:
                Words("h3", "The smallest conflict")
                with box("conflict"):
                    for part in core:
                        Words("code", str(part))
                with box(tag="ul"):
                    for reason in reasons:
                        Words("li", str(reason))
            waits = _waits(told)
            if waits:
                Words("h3", "Waits that would rule the counterexample out")
                with box(tag="ul"):
                    for wait in waits:
                        Words("li", wait)
            self._offers(job, told)

    def _offers(self, job: Job, told: dict[str, Any]) -> None:
        offers: list[tuple[str, Callable[[str], Awaitable[str]]]] = []

        def ask(change: Callable[..., str], *arguments: Any) -> Awaitable[str]:
            return self.desk.service.questions.ask(change, *arguments, who=self.desk.who)

        largest = _largest_margin(job)
        if largest is not None:
            offers.append(
                (f"Ask for a margin of {1000 * largest:g} mm", lambda text: ask(checking.change_margin, text, largest))
            )
        edges = [(str(a), str(b)) for a, b in told.get("edges") or ()]
        if edges:
            names = " and ".join(f"{a} - {b}" for a, b in edges)
            offers.append((f"Add the edge{'s' * (len(edges) > 1)} {names}", lambda text: ask(checking.add_edges, text, edges)))
        if len(told.get("core") or ()) > 1:
            for part in told["core"]:
                offers.append((f"Leave out {part}", lambda text, part=part: ask(checking.leave_out, text, part)))
        Words("h3", "What would mend it" if offers else "Change it yourself")
        with box("offers"):
            for what, change in offers:
                button(what, lambda change=change: self.desk.guarded(self._take(job, change), self.place), "primary")
            button("Edit the mission", lambda: self.desk.guarded(self._take(job, None), self.place))

    async def _take(self, job: Job, change: Callable[[str], Awaitable[str]] | None) -> None:
        """Bring the mission back to where it is written, changed as was offered."""
        text = await self.desk.text_of(job)
        try:
            changed = text if change is None else await change(text)
        except LtlplanError:  # what was written differently still reads when it is resolved
            text = await self.desk.jobs.mission(job.id)
            changed = text if change is None else await change(text)
        await self.desk.edit(changed)


def _waits(told: dict[str, Any]) -> list[str]:
    """Return the waits that witnesses ask for, in words."""
    found: list[str] = []
    for witness in told.get("witnesses") or ():
        for (first, before), (then, after) in witness.get("order") or ():
            found.append(f"{first}'s visit {before + 1} is over before {then}'s visit {after + 1} begins")
    return list(dict.fromkeys(found))


def _largest_margin(job: Job) -> float | None:
    """Return the largest margin that the last refused round would hold, in m, rounded down; None where there is none."""
    for stage in reversed(job.stages):
        largest = stage.found.get("largest_margin")
        if largest is not None and stage.name.startswith("round"):
            rounded = int(float(largest) * _FINER) / _FINER
            return rounded if rounded > 0 else None
    return None


def trust_tab(desk: Desk, flight: Flight) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
        flight: Where the claims are shown.
    """
    del flight
    _Refusal(desk).show(None)
