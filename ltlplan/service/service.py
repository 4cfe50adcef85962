"""The parts of a running service, together: what routes and pages are given."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ltlplan.service import queries as asked
from ltlplan.service.event_inbox.control import Act
from ltlplan.service.event_inbox.flights import LiveFlights
from ltlplan.service.execution.derived import SimulationAsked, require_sense
from ltlplan.service.live_view.foretelling import foretell
from ltlplan.service.log import note
from ltlplan.service.metrics import Metrics
from ltlplan.service.models import DerivedKind, EventsAccepted, Job, LiveFlight, StopLevel, StopReceipt
from ltlplan.service.people.openid import OpenId
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Action, Principal, allows, require
from ltlplan.service.people.user_jobs import UserJobs
from ltlplan.service.people.user_studies import UserStudies
from ltlplan.service.problems import Conflict, NotFound
from ltlplan.service.queries import Place
from ltlplan.service.query_pool import Questions
from ltlplan.service.security.tokens import LOCAL
from ltlplan.service.settings import Settings
from ltlplan.service.storage.drafts import Drafts
from ltlplan.service.storage.retention import Retention
from ltlplan.service.webhook_sender import Allowed, Sender
from verify.data.errors import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.job_queue.jobs import Jobs
    from verify.data import Mission

_REMEMBERED = 200
"""Texts of missions whose missions are remembered."""


@dataclass
class Service:
    """A running service.

    Attributes:
        settings: What it was started with.
        jobs: What was accepted, and how far it is.
        questions: What is answered at once.
        people: Who may ask, and whose the jobs are.
        openid: Login by OpenID Connect; None where there is none.
        metrics: Counts for Prometheus.
        retention: Sweep of what is not kept any longer.
        sender: Sender of webhooks.
        live: Flights that listen, and what they are told.
        drafts: Missions that users are writing.
        stopping: Set when the service is about to stop, for streams to end.
    """

    settings: Settings
    jobs: Jobs
    questions: Questions
    people: People
    live: LiveFlights
    stopping: asyncio.Event = field(default_factory=asyncio.Event)
    drafts: Drafts = field(init=False)
    openid: OpenId | None = field(init=False)
    sender: Sender = field(init=False)
    metrics: Metrics = field(init=False)
    retention: Retention = field(init=False)
    _missions: OrderedDict[str, Mission] = field(default_factory=OrderedDict, init=False, repr=False)
    _sending: asyncio.Task[None] | None = field(default=None, init=False, repr=False)
    _sweeping: asyncio.Task[None] | None = field(default=None, init=False, repr=False)
    _shipped: bytes | None = field(default=None, init=False, repr=False)
    _logging: set[asyncio.Task[None]] = field(default_factory=set[asyncio.Task[None]], init=False, repr=False)

    def __post_init__(self) -> None:
        self.drafts = Drafts(self.settings.data)
        self.metrics = Metrics()
        self.retention = Retention(self.jobs, self.people, self.live)
        self.sender = Sender(self.people.webhooks, self.jobs.register, Allowed.read(self.settings.webhook_hosts))
        self.openid = None if self.settings.openid is None else OpenId(self.settings.openid)

    async def start(self) -> None:
        """Open the data folder, go on with all jobs, and have each job be somebody's.

        Raises:
            BadInput: Folder or database cannot be used; the message says why.
        """
        self.live.open()
        await self.jobs.start()
        references = self.people.references
        await asyncio.to_thread(references.load)
        await self.retention.delete_left()
        self._sweeping = asyncio.create_task(self.retention.run())
        if self.sender.allowed.hosts:
            self._sending = asyncio.create_task(self.sender.run())
        asked = [(job, _user(who)) for job, who in self.jobs.register.asked_by().items()]
        await asyncio.to_thread(references.adopt, asked)

    def jobs_of(self, principal: Principal) -> UserJobs:
        """Return the jobs as a user has them."""
        return UserJobs(self.jobs, self.people, principal)

    def studies_of(self, principal: Principal) -> UserStudies:
        """Return the studies as a user has them."""
        return UserStudies(self.jobs_of(principal), self.people, self.questions, principal)

    async def simulate(self, principal: Principal, job: str, kind: DerivedKind, options: dict[str, Any]) -> Job:
        """Submit a campaign or a rehearsal of a job's flight, once its options make sense.

        Args:
            principal: Who does.
            job: The job's id.
            kind: Which of them.
            options: Those of the command of that name that were given.

        Raises:
            BadInput: There are no such conditions.
            LtlplanError: As `UserJobs.derive`.
        """
        require(principal, Action.PLAN)
        await self.questions.ask(require_sense, kind, options, who=principal.client)
        return await self.jobs_of(principal).derive(job, SimulationAsked(kind, options))

    async def plan_stored(self, principal: Principal, mission: int, number: int, *, seed: int | None = None) -> Job:
        """Submit a version of a stored mission, in its project.

        Args:
            principal: Who does.
            mission: The stored mission's id.
            number: The version's number.
            seed: Source of every draw, instead of the mission's own.

        Raises:
            Forbidden: The role is not enough.
            LtlplanError: As `StoredMissions.version` and `UserJobs.submit`.
        """
        require(principal, Action.PLAN)
        stored = await asyncio.to_thread(self.people.missions.get, principal, mission)
        version = await asyncio.to_thread(self.people.missions.version, principal, mission, number)
        asked = await self.mission(version.text, who=principal.client)
        return await self.jobs_of(principal).submit(asked, seed=seed, project=stored.project or None)

    async def tell(self, principal: Principal, flight: str, text: str) -> EventsAccepted:
        """Tell a flight events, as somebody who may; as `LiveFlights.tell`. The log has it before the flight does.

        Args:
            principal: Who tells it.
            flight: What it listens as.
            text: An event a line.

        Raises:
            Forbidden: The role is not enough.
            LtlplanError: As `LiveFlights.tell`.
        """
        require(principal, Action.FLY)
        await asyncio.to_thread(self.people.log.write, principal, "tell", flight, text)
        return await self.live.tell(flight, text, principal.client)

    async def control(self, principal: Principal, flight: str, act: Act, to: str = "") -> LiveFlight:
        """Change who is in control of a flight, as somebody who may; as `LiveFlights.control`. The log has it first.

        Args:
            principal: Who does.
            flight: What it listens as.
            act: What is done.
            to: To whom control is offered.

        Raises:
            Forbidden: The role is not enough.
            LtlplanError: As `LiveFlights.control`.
        """
        require(principal, Action.FLY)
        await asyncio.to_thread(self.people.log.write, principal, "control", flight, f"{act} {to}".strip())
        return await self.live.control(flight, act, principal.client, to=to, admin=allows(principal.role, Action.ADMINISTER))

    async def foretell(self, flight: str, line: str, *, who: str = "") -> list[str]:
        """Say what an event would do to a flight that is seen live, a sentence each.

        Args:
            flight: What it listens as.
            line: The event.
            who: Who asks.

        Raises:
            Conflict: The flight is not seen at the moment.
            BadInput: It is no event.
        """
        feed = self.live.hub.feed(flight)
        if feed is None or not feed.connected or feed.shown is None or feed.frame is None:
            raise Conflict(f"'{flight[:60]}' is not seen live at the moment, so that nothing can be said of an event.")
        return await self.questions.ask(foretell, feed.shown, feed.frame.model_dump_json(), line, who=who)

    def stop_flight(self, principal: Principal, flight: str, run: int, level: StopLevel) -> StopReceipt:
        """Order a flight to stop, as somebody who may. The flight hears it before the log has it, and whether or not it can be written.

        Args:
            principal: Who orders it.
            flight: What it listens as.
            run: Its number among all flights.
            level: What is ordered.

        Raises:
            Forbidden: The role is not enough.
            LtlplanError: As `Hub.stop`.
        """
        require(principal, Action.FLY)
        receipt = self.live.hub.stop(flight, run, level, principal.client)
        self._logging.add(task := asyncio.get_running_loop().create_task(self._log_stop(principal, receipt)))
        task.add_done_callback(self._logging.discard)
        return receipt

    async def _log_stop(self, principal: Principal, receipt: StopReceipt) -> None:
        note("stop", flight=receipt.name, run=receipt.run, stops=receipt.level, client=receipt.who, order=receipt.order)
        try:
            await asyncio.to_thread(self.people.log.write, principal, "stop", receipt.name, f"{receipt.level} {receipt.order}")
        except LtlplanError as error:
            note("a stop was not logged", level=logging.WARNING, order=receipt.order, reason=str(error))

    async def stop(self) -> None:
        """Send and delete no more, and let go of all jobs; those that have not ended go on at the next start."""
        tasks = [task for task in (self._sending, self._sweeping) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self.jobs.stop()

    def close(self) -> None:
        """End all processes; jobs that have not ended go on at the next start."""
        self.people.close()
        self.drafts.close()
        self.questions.close()
        self.jobs.workers.close()

    async def mission(self, text: str, *, who: str = "") -> Mission:
        """Return the mission of a text, read in a process of its own.

        Args:
            text: YAML or JSON.
            who: Who asks.

        Raises:
            MissionError: All faults of the text.
            BadInput: It is no table of keys at all.
        """
        found = self._missions.get(text)
        if found is None:
            found = await self.questions.ask(asked.read_mission, text, who=who)
            self._missions[text] = found
            while len(self._missions) > _REMEMBERED or sum(map(len, self._missions)) > 4_000_000:
                self._missions.popitem(last=False)
        self._missions.move_to_end(text)
        return found

    async def shipped_missions(self) -> bytes:
        """Return the shipped missions as JSON."""
        found = self._shipped
        if found is None:
            found = self._shipped = await self.questions.ask(asked.shipped_missions)
        return found


def _user(who: str) -> str:
    """Return the user who submitted a job: a name, or whoever asked from an address."""
    try:
        ipaddress.ip_address(who)
    except ValueError:
        return who if who not in ("", "unknown") else LOCAL
    return LOCAL


async def places(jobs: UserJobs, job: str) -> Place:
    """Return where the files of a job lie, by their names.

    Args:
        jobs: Jobs as who asks has them.
        job: The job's id.

    Raises:
        BadInput: There is no such job, or it has no files.
    """
    found = await jobs.job(job)
    if not found.files:
        raise Conflict(f"Job {found.id} has no files: it is {found.state}.")
    return tuple([(entry.name, str((await jobs.file(found.id, entry.name)).path)) for entry in found.files])


async def proof_places(jobs: UserJobs, job: str) -> Place:
    """Return where the files of a job's proof lie, by their names: what `check.pyz` reads, and itself.

    Args:
        jobs: Jobs as who asks has them.
        job: The job's id.

    Raises:
        BadInput: There is no such job, or it has no proof.
    """
    from ltlplan.output import PROOF_FILES

    found = await places(jobs, job)
    names = {name for name, _ in found}
    if not names.issuperset(PROOF_FILES):
        raise NotFound(f"Job {job} has no proof: no flight of it was certified, or an earlier version made it.")
    tables = {name for name in names if name.endswith(".csv") and "/" not in name and name != "flight.csv"}
    return tuple(file for file in found if file[0] in tables.union(PROOF_FILES))


async def planned(jobs: UserJobs, job: str) -> tuple[str, str]:
    """Return a job's mission.yaml and plan.json.

    Args:
        jobs: Jobs as who asks has them.
        job: The job's id.

    Raises:
        BadInput: There is no such job, or it has no plan (yet).
    """
    found = await jobs.plan(job)
    if found is None:
        raise Conflict(f"Job {job} has no plan: it is {(await jobs.job(job)).state}.")
    return found
