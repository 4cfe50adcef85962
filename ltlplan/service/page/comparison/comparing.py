"""Two results side by side: their figures, words and claims, what changed in the mission, and both flights on one clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ltlplan.report.summary import TINY
from ltlplan.service.figures import claim_pairs
from ltlplan.service.page.comparison.flight_pair import PairOfFlights
from ltlplan.service.page.comparison.studies import STATES, cells
from ltlplan.service.page.elements import Part, Words, box, button, choice, table
from ltlplan.service.page.folding import differing, folded
from ltlplan.service.page.next_steps import next_steps
from verify.data import LtlplanError

if TYPE_CHECKING:
    from nicegui.element import Element

    from ltlplan.service.models import Job
    from ltlplan.service.page.session_state import Desk
    from ltlplan.service.study_models import ClaimFigure, Comparison

_LISTED = 60
_TOO_FEW = "Two results of jobs are held beside each other here. There are not two jobs yet."
_ROWS = ("cost", "duration", "largest margin", "worst tracking error", "computed in")


class Comparing:
    """The comparison while the tab is used.

    Args:
        desk: What the person has open.
        whole: The tab, in which two results come first once they are chosen.
    """

    def __init__(self, desk: Desk, whole: Element) -> None:
        self.desk, self.whole = desk, whole
        with box("comparing", tag="section").props('aria-label="Two results"'):
            Words("h2", "Two results")
            self.chooser, self.said = Part(box("row")), Part(box())
            self.pair = PairOfFlights()
            self.found = Part(box("compared"))

    async def refresh(self) -> None:
        """Offer the newest jobs, and compare what is chosen."""
        jobs = {job.id: _named(job) for job in await self.desk.jobs.jobs(limit=_LISTED)}
        first, second = self.desk.pair
        if not second and self.desk.job is not None:
            first = self.desk.job.id
        for chosen in filter(None, (first, second)):
            if chosen not in jobs:
                jobs[chosen] = await self._name(chosen)
        self.chooser.show((jobs, first, second), lambda: self._choices(jobs, first, second))
        both = bool(first and second)
        self.whole.classes(add="two") if both else self.whole.classes(remove="two")
        if both:
            await self.show(first, second)
        else:
            self._show_none("")

    async def _name(self, job: str) -> str:
        """Return what a job is called that is not among the newest, or another's; its id where there is none."""
        try:
            return _named(await self.desk.jobs.job(job))
        except LtlplanError:
            return job

    def _choices(self, jobs: dict[str, str], first: str, second: str) -> None:
        if len(jobs) < 2:
            next_steps(self.desk, _TOO_FEW, ("write",))
            return
        offered = {"": "choose a job", **jobs}

        def turned(first: str, second: str) -> None:
            self.desk.pair = first, second
            self.desk.show("compare")

        choice("First", offered, first, lambda job: turned(job, second))
        choice("Second", offered, second, lambda job: turned(first, job))
        if first and second:
            button("Swap", lambda: turned(second, first), "quiet")

    async def show(self, first: str, second: str) -> None:
        """Compare two jobs."""
        try:
            found = await self.desk.service.studies_of(self.desk.principal).compare(first, second)
            files = [{file.name for file in (await self.desk.jobs.job(job)).files} for job in (first, second)]
        except LtlplanError as error:
            self._show_none(str(error))
            return
        self.said.show("", lambda: None)
        self.pair.show(*(f"/api/jobs/{job}/files/watch.json" if "watch.json" in has else None
                         for job, has in zip((first, second), files, strict=True)))  # fmt: skip
        self.found.show(found, lambda: _draw(found))

    def _show_none(self, why: str) -> None:
        """Show no comparison, and why; empty where two were not chosen yet."""
        self.said.show(why, lambda: Words("p", why, "soft").props("role=alert") if why else None)
        self.pair.show(None, None)
        self.found.show(None, lambda: None)


def _named(job: Job) -> str:
    return f"{job.mission}, seed {job.seed}, {STATES[job.state]}, {job.submitted[:16].replace('T', ' ')}"


def _draw(found: Comparison) -> None:
    first, second = found.first, found.second
    Words("h3", "Figures")
    rows = [("state", STATES[first.state], STATES[second.state])]
    rows += list(zip(_ROWS, cells(first), cells(second), strict=True))
    table(("", "first", "second"), rows)
    Words("h3", "Words")
    robots = dict.fromkeys((*first.words, *second.words))
    words = [(robot, first.words.get(robot, ""), second.words.get(robot, "")) for robot in robots]
    folded(words, lambda rows: table(("robot", "first", "second"), rows), "robots")
    if words and all(one == other for _, one, other in words):
        Words("p", "The same words.", "soft")
    Words("h3", "Claims")
    pairs = claim_pairs(found)
    rows = [_claims(*pair) for pair in pairs]
    folded(rows, lambda rows: table(("claim", "robot", "first", "second", "limit"), rows), "claims")
    Words("h3", "What changed in the mission")
    differing(found.difference)


def _claims(first: ClaimFigure | None, second: ClaimFigure | None) -> tuple[str, ...]:
    either = first or second
    assert either is not None
    limits = {
        f"{each.limit:.4g} {each.unit}".strip() for each in (first, second) if each is not None and each.limit is not None
    }
    return (either.name, either.robot or "team", _told(first), _told(second), " / ".join(sorted(limits)))


def _told(claim: ClaimFigure | None) -> str:
    if claim is None:
        return "none"
    bound = None if claim.bound is None else 0.0 if abs(claim.bound) < TINY else claim.bound
    figure = "" if bound is None else f" {bound:.4g} {claim.unit}".rstrip()
    return f"{claim.verdict}{figure}"
