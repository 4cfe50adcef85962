"""The tab of simulations: campaigns and rehearsals of the job's flight, begun and followed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from ltlplan.service.api.answers import CampaignAsked, RehearsalAsked
from ltlplan.service.page.derived_jobs import DerivedJobs
from ltlplan.service.page.elements import Words, box, button, named_field, one_at_a_time, say
from ltlplan.service.page.next_steps import next_steps
from ltlplan.service.people.roles import Action
from verify.data import BadInput, LtlplanError
from verify.data.value import faults_of

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from ltlplan.service.models import DerivedKind, Job
    from ltlplan.service.page.session_state import Desk

_NO_JOB = "Choose a job that is done under Plan; its flight is flown again here, many times."
_NONE = "None yet. Fill in a form above, or leave it as it is, and press its button."
_CAMPAIGN = {
    "runs": ("Flights", "100"),
    "wind": ("Wind, m/s", "such as 0.5+0.3"),
    "noise": ("Noise of motion capture, m", "such as 0.001"),
    "controller": ("Controller", "the vehicles' own"),
    "latency": ("Latency, s", "such as 0.015"),
    "seed": ("Seed", "the plan's"),
}
_REHEARSAL = {
    "runs": ("Flights of each", "20"),
    "controllers": ("Controllers", "all that all vehicles run"),
    "masses": ("Shares of the mass", "0.95, 1, 1.05"),
    "latencies": ("Latencies, s", "0.005, 0.015, 0.025"),
    "winds": ("Winds, m/s", "0, 0.2+0.1, 0.5+0.3"),
    "hunt": ("Hunt with winds of, m/s", "no hunt"),
}
_LISTED = ("controllers", "masses", "latencies", "winds")


def options_of(model: type[BaseModel], fields: dict[str, str]) -> dict[str, Any]:
    """Return options out of what was typed; what is empty is not said.

    Args:
        model: What they are of.
        fields: Texts by the options' names; lists are separated by commas, winds and names too.

    Raises:
        BadInput: One cannot be.
    """
    given: dict[str, Any] = {}
    for name, text in fields.items():
        if name in _LISTED and text.strip():
            given[name] = [_plain(part, name) for part in text.split(",") if part.strip()]
        elif text.strip():
            given[name] = _plain(text, name)
    try:
        return model.model_validate(given).model_dump(mode="json", exclude_none=True)
    except ValidationError as error:
        raise BadInput("\n".join(faults_of(error, "options"))) from None


def _plain(text: str, name: str) -> object:
    """Return a number where the option is one, else the text."""
    if name in ("wind", "winds", "noise", "controller", "controllers"):
        return text.strip()
    try:
        return json.loads(text.strip())
    except ValueError:
        return text.strip()


class _Simulating:
    """The tab while it is used."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        with box("simulating"):
            self.note = next_steps(desk, _NO_JOB)
            with box("forms") as self.forms:
                self._form("campaign", "Campaign", "The same flight many times, in wind and noise.", CampaignAsked, _CAMPAIGN)
                self._form(
                    "rehearsal", "Rehearsal", "By several controllers, masses, latencies and winds.", RehearsalAsked, _REHEARSAL
                )
            self.listed = DerivedJobs(desk, "simulate", ("campaign", "rehearsal"), _NONE)
        desk.on_job.append(self.show)

    def _form(
        self, kind: DerivedKind, title: str, what: str, model: type[BaseModel], fields: dict[str, tuple[str, str]]
    ) -> None:
        typed: dict[str, str] = {}

        def kept(name: str) -> Callable[[str], Awaitable[None]]:
            async def keep(text: str) -> None:
                typed[name] = text

            return keep

        async def begun(_event: object = None) -> None:
            try:
                await self._begin(kind, options_of(model, typed))
            except LtlplanError as error:
                with form:
                    say(error)

        with box("bounds", tag="form").props(f'aria-label="{title}"') as form:
            Words("h2", title)
            Words("p", what, "soft")
            for name, (label, hint) in fields.items():
                named_field(label, "", kept(name), hint=hint)
            button(f"Begin a {kind}", lambda: None, "primary").props("type=submit")
        form.on(
            "submit",
            one_at_a_time(begun),
            js_handler="(event) => { event.preventDefault(); document.activeElement.blur(); setTimeout(emit, 50); }",
        )

    async def _begin(self, kind: DerivedKind, options: dict[str, Any]) -> None:
        job = self.desk.job
        if job is None:
            return
        made = await self.desk.service.simulate(self.desk.principal, job.id, kind, options)
        if made.found:
            with self.forms:
                say("This was flown before; here is what was found.", good=True)
        await self.listed.refresh()
        self.listed.look()

    def show(self, job: Job | None) -> None:
        """Offer simulations of a job that is done."""
        ready = job is not None and job.state == "done"
        self.note.set_visibility(not ready)
        self.forms.set_visibility(ready and self.desk.may(Action.PLAN))
        self.listed.place.set_visibility(ready)


def simulations_tab(desk: Desk) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
    """
    _Simulating(desk).show(None)
