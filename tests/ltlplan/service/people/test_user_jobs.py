"""Jobs as users have them: computed once for all, each one's own until shared, gone with the last who has them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from ltlplan.service.execution.exporting import ExportAsked
from ltlplan.service.models import ENDED, Job
from ltlplan.service.people.job_references import EARLIER
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Principal, Role
from ltlplan.service.people.user_jobs import UserJobs
from ltlplan.service.problems import Conflict, Forbidden, NotFound
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.settings import Limits


class _Jobs:
    """As `Jobs`, of missions that are words and computed by nobody."""

    def __init__(self) -> None:
        self.referring, self.register, self.runner = asyncio.Lock(), self, self
        self.held: dict[str, Job] = {}
        self.cancelled: list[str] = []
        self.settings = SimpleNamespace(limits=Limits())

    async def submit(self, mission: Any, *, seed: int | None, who: str, lane: str) -> Job:
        await asyncio.sleep(0)
        known = self.held.get(mission)
        if known is not None:
            return known.model_copy(update={"found": True})
        self.held[mission] = Job(id=mission, mission=mission, state="done", submitted="")
        return self.held[mission]

    async def derive(self, job_id: str, asked: Any, *, who: str) -> Job:
        self.held[f"{job_id}-export"] = Job(id=f"{job_id}-export", mission="", of=job_id, state="done", submitted="")
        return self.held[f"{job_id}-export"]

    def find(self, job_id: str) -> Job | None:
        return self.held.get(job_id)

    def entry(self, job_id: str) -> Any:
        if job_id not in self.held:
            raise NotFound(f"There is no job '{job_id}'.")
        return SimpleNamespace(job=self.held[job_id])

    async def job(self, job_id: str) -> Job:
        return self.held[job_id]

    async def jobs(self, *, which: Callable[[Job], bool], **_: Any) -> list[Job]:
        return [job for job in reversed(self.held.values()) if job.of is None and which(job)]

    async def cancel(self, job_id: str) -> Job:
        self.held[job_id] = self.held[job_id].model_copy(update={"state": "cancelled"})
        return self.held[job_id]

    def end_search(self, entry: Any) -> None:
        self.cancelled.append(entry.job.id)

    def require_ended(self, job_id: str) -> None:
        if self.held[job_id].state not in ENDED:
            raise Conflict(f"Job {job_id} is running; cancel it first, then delete it.")

    async def delete(self, job_id: str) -> None:
        self.require_ended(job_id)
        await asyncio.sleep(0)
        del self.held[job_id]

    def begin(self, job_id: str) -> None:
        self.held[job_id] = self.held[job_id].model_copy(update={"state": "running"})


Lab = tuple[_Jobs, Callable[..., Any]]


@pytest.fixture
def lab(people: People) -> Lab:
    """Return jobs, and what gives them to a user; there are accounts, so that nobody is alone."""
    people.accounts.add("root", Role.admin)
    jobs: Any = _Jobs()
    return jobs, lambda user, role=Role.planner: UserJobs(jobs, people, Principal(user, role))


def _run(work: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(work, 60))


async def _ids(jobs: UserJobs, **asked: Any) -> list[str]:
    return [job.id for job in await jobs.jobs(**asked)]


def test_a_job_is_its_submitter_s_alone(lab: Lab) -> None:
    _, of = lab

    async def check() -> None:
        await of("alice").submit("a")
        assert (await of("alice").job("a")).owner == "alice"
        bob = of("bob")
        assert await _ids(bob) == []
        for ask in (
            bob.job,
            bob.cancel,
            bob.delete,
            bob.plan,
            bob.mission,
            lambda job: bob.file(job, "x"),
            lambda job: bob.waited(job, 0),
        ):
            with pytest.raises(NotFound, match="There is no job 'a'"):
                await ask("a")
        with pytest.raises(NotFound):
            await anext(bob.events("a"))
        assert await _ids(of("root", Role.admin)) == []
        assert await _ids(of("root", Role.admin), whose="all") == ["a"]
        assert (await of("root", Role.admin).job("a")).owner == "alice"
        with pytest.raises(Forbidden):
            await bob.jobs(whose="all")

    _run(check())


def test_a_computation_is_shared_and_goes_with_the_last_who_has_it(lab: Lab, people: People) -> None:
    jobs, of = lab

    async def check() -> None:
        assert not (await of("alice").submit("a")).found
        assert (await of("bob").submit("a")).found
        await of("alice").delete("a")
        assert "a" in jobs.held
        assert (await _ids(of("alice")), await _ids(of("bob"))) == ([], ["a"])
        await of("bob").delete("a")
        assert "a" not in jobs.held
        assert [each.action for each in people.log.entries()] == ["delete", "delete", "submit", "submit"]
        assert people.references.leaving() == ()

    _run(check())


def test_what_runs_for_others_too_is_left_not_cancelled(lab: Lab) -> None:
    jobs, of = lab

    async def check() -> None:
        for user in ("alice", "bob"):
            await of(user).submit("a")
        jobs.begin("a")
        with pytest.raises(Conflict, match="1 more of this service's users"):
            await of("alice").cancel("a")
        with pytest.raises(Conflict, match=r"1 more of this service's users .* another seed"):
            await of("alice").stop_search("a")
        await of("alice").delete("a")
        assert jobs.held["a"].state == "running"
        with pytest.raises(Conflict, match="cancel it first"):
            await of("bob").delete("a")
        assert await _ids(of("bob")) == ["a"], "a delete that is refused changes nothing"
        await of("bob").stop_search("a")
        assert jobs.cancelled == ["a"]
        assert (await of("bob").cancel("a")).state == "cancelled"
        await of("bob").delete("a")
        assert "a" not in jobs.held

    _run(check())


def test_a_shared_project_is_seen_by_all_and_changed_by_its_owners(lab: Lab, people: People) -> None:
    _, of = lab
    alice = Principal("alice", Role.planner)

    async def check() -> None:
        await of("alice").submit("a", project="show")
        await of("alice").submit("b")
        assert await _ids(of("bob")) == []
        people.references.share("show", True, alice)
        assert await _ids(of("bob")) == await _ids(of("bob"), project="show") == ["a"]
        assert await _ids(of("bob"), whose="mine") == []
        for search, ids in (("A", ["b", "a"]), ("SHOW", ["a"]), ("alice", ["b", "a"]), ("b", ["b"]), ("nothing", [])):
            assert await _ids(of("alice"), search=search) == ids, search
        seen = await of("bob").job("a")
        assert (seen.owner, seen.project) == ("alice", "show")
        assert not of("bob").owns(seen)
        for ask in (of("bob").delete, of("bob").cancel):
            with pytest.raises(Forbidden, match="is alice's; only its owner and admins"):
                await ask("a")
        with pytest.raises(Forbidden, match="is alice's"):
            people.references.share("show", False, Principal("bob", Role.planner))
        with pytest.raises(Conflict, match="submit its mission"):
            await of("bob").move("a", "")
        people.references.share("show", False, alice)
        with pytest.raises(NotFound):
            await of("bob").job("a")
        with pytest.raises(NotFound, match="taken"):
            await of("bob").submit("c", project="show")
        await of("alice").move("b", "show")
        assert await _ids(of("alice"), project="show") == ["b", "a"]
        assert [(each.name, each.jobs) for each in people.references.projects(alice)] == [("show", 2)]

    _run(check())


@pytest.mark.parametrize("name", [" a", "a\n", "x" * 61, "\u202e"])
def test_names_of_projects(name: str, lab: Lab) -> None:
    _, of = lab
    with pytest.raises(Exception, match="cannot name a project"):
        _run(_submitted(of("alice"), name))


async def _submitted(jobs: Any, project: str) -> None:
    await jobs.submit("a", project=project)


def test_an_export_is_seen_by_who_sees_its_flight(lab: Lab) -> None:
    _, of = lab

    async def check() -> None:
        await of("alice").submit("a")
        with pytest.raises(NotFound):
            await of("bob").derive("a", None)
        made = await of("alice").derive("a", ExportAsked("px4"))
        with pytest.raises(NotFound):
            await of("bob").job(made.id)
        await of("bob").submit("a")
        await of("bob").job(made.id)
        with pytest.raises(Forbidden, match="1 more users"):
            await of("bob").delete(made.id)
        await of("alice").delete("a")
        await of("bob").delete(made.id)

    _run(check())


def test_an_admin_ends_for_all_what_is_not_the_own(lab: Lab, people: People) -> None:
    jobs, of = lab

    async def check() -> None:
        for user in ("alice", "bob"):
            await of(user).submit("a")
        jobs.begin("a")
        root = of("root", Role.admin)
        await root.cancel("a")
        await root.delete("a")
        assert "a" not in jobs.held
        assert people.log.entries()[0].detail == "of alice, bob"

    _run(check())


@pytest.mark.parametrize("role", [Role.viewer])
def test_a_viewer_changes_nothing(role: Role, lab: Lab) -> None:
    _, of = lab

    async def check() -> None:
        await of("alice").submit("a")
        viewer = of("alice", role)
        assert await _ids(viewer) == ["a"]
        for ask in (
            lambda: viewer.submit("b"),
            lambda: viewer.cancel("a"),
            lambda: viewer.stop_search("a"),
            lambda: viewer.delete("a"),
            lambda: viewer.derive("a", None),
            lambda: viewer.move("a", ""),
        ):
            with pytest.raises(Forbidden, match="Only the role 'planner'"):
                await ask()

    _run(check())


def test_a_submission_and_the_last_deletion_at_once_leave_either_both_or_none(lab: Lab) -> None:
    jobs, of = lab

    async def check() -> None:
        for _ in range(10):
            await of("alice").submit("a")
            _, made = await asyncio.gather(of("alice").delete("a"), of("bob").submit("a"))
            assert made.id in jobs.held
            assert await _ids(of("bob")) == ["a"]
            await of("bob").delete("a")
            assert "a" not in jobs.held

    _run(check())


def test_one_person_on_one_machine_has_all_jobs_and_deletes_them(people: People) -> None:
    jobs: Any = _Jobs()

    async def check() -> None:
        people.references.add("a", "earlier-token", "")
        here: Any = UserJobs(jobs, people, people.local("127.0.0.1"))
        there = UserJobs(jobs, people, people.local("::1"))
        await here.submit("a")
        assert await _ids(there) == ["a"]
        await there.delete("a")
        assert "a" not in jobs.held

    _run(check())


def test_what_was_there_before_references_is_shared_and_what_a_kill_orphaned_is_not(people: People, tmp_path: Path) -> None:
    people.references.adopt([("a", "alice"), ("b", "bob")])
    assert people.references.is_shared(EARLIER)
    people.references.drop("b", ["bob"])
    people.close()
    again = People(Tokens(tmp_path))  # killed before the job was deleted
    again.references.load()
    assert again.references.leaving() == ("b",)
    again.references.left("b")
    again.references.adopt([("a", "alice"), ("c", "carol")])
    eve = Principal("eve", Role.viewer)
    seen = [again.references.seen(job, eve) for job in ("a", "b", "c")]
    assert [None if each is None else each.user for each in seen] == ["alice", None, None]
    assert again.references.users("c") == ("carol",)


def test_a_new_service_has_no_project_of_earlier_jobs(people: People) -> None:
    people.references.adopt([])
    people.references.adopt([("a", "alice")])
    assert not people.references.is_shared(EARLIER)
