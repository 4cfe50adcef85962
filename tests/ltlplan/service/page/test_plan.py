"""The second tab: what is on its way to a button arrives, however far the job comes meanwhile."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest

nicegui = pytest.importorskip("nicegui", reason="needs the service's extra")

from nicegui import Client, ui  # noqa: E402
from nicegui.element import Element  # noqa: E402

from ltlplan.service.models import Job, Problem, Stage  # noqa: E402
from ltlplan.service.page.certificate_tab import trust_tab  # noqa: E402
from ltlplan.service.page.elements import Part, Words  # noqa: E402
from ltlplan.service.page.missions.write import _Writing  # noqa: E402  # pyright: ignore[reportPrivateUsage]
from ltlplan.service.page.plan import plan_tab  # noqa: E402
from ltlplan.service.page.session_state import Desk  # noqa: E402
from ltlplan.service.people.roles import Principal, Role  # noqa: E402
from ltlplan.service.settings import Limits  # noqa: E402
from tests.helpers.serving.services import ONE_HOOP  # noqa: E402
from verify.data import Mission, parse_mission  # noqa: E402

QUEUED = Job(id="a-1", mission="firefighting", submitted="2026-01-01T00:00:00+00:00")
RUNNING = QUEUED.model_copy(update={"state": "running", "started": "2026-01-01T00:00:01+00:00"})
PLANNED = RUNNING.model_copy(update={"stages": (Stage(name="plan", state="running"),)})
REFUSED = PLANNED.model_copy(
    update={
        "state": "failed",
        "ended": "2026-01-01T00:00:02+00:00",
        "problem": Problem(
            type="/problems/unsatisfiable", title="Unsatisfiable", status=422, detail="no", core=("F a", "G !a")
        ),
    }
)


HERE = Principal("local", Role.admin, "127.0.0.1")


class _Jobs:
    """Jobs that are what a test says they are."""

    def __init__(self) -> None:
        self.known = [QUEUED]

    async def jobs(self, limit: int, search: str) -> list[Job]:
        assert search == ""
        return self.known[:limit]

    def owns(self, job: Job) -> bool:
        del job
        return True


@pytest.fixture
def client() -> Iterator[Client]:
    made = Client(ui.page("/nowhere"))
    with made:
        yield made
    made.delete()


@pytest.fixture
def desk(client: Client) -> Desk:
    jobs = _Jobs()
    settings = SimpleNamespace(limits=Limits())
    service: Any = SimpleNamespace(jobs=jobs, jobs_of=lambda _: jobs, questions=SimpleNamespace(ask=None), settings=settings)
    return Desk(service, client, HERE)


def buttons(client: Client) -> dict[str, Element]:
    """Return the buttons that have words on them, by their words."""
    return {
        made.text: made for made in client.elements.values() if isinstance(made, Words) and made.tag == "button" and made.text
    }


def inside(place: Element) -> list[str]:
    return [made.text for made in place.descendants() if isinstance(made, Words)]


@pytest.mark.parametrize(("typed", "pace"), [("", 0.7), (" 1 ", 1.0), ("nominal", "nominal"), ("2", None), ("fast", None)])
def test_the_pace_that_is_typed_is_the_submitted_missions(typed: str, pace: float | str | None, client: Client) -> None:
    handed_in: list[Mission] = []

    async def mission(text: str, who: str) -> Mission:
        del who
        return parse_mission(text)

    async def submit(mission: Mission, seed: int | None) -> Job:
        del seed
        handed_in.append(mission)
        return QUEUED

    async def nothing(*_: object) -> None:
        return None

    jobs = SimpleNamespace(submit=submit)
    service: Any = SimpleNamespace(
        jobs_of=lambda _: jobs, mission=mission, questions=SimpleNamespace(ask=None), people=SimpleNamespace(missions=None)
    )
    desk = Desk(service, client, HERE)
    vars(desk)["open"] = nothing
    writing = _Writing(desk)
    vars(writing.drafted)["hand_in"] = nothing
    vars(writing.editor)["text"] = ONE_HOOP.replace("pace: nominal", "pace: 0.7")
    writing._pace_typed(SimpleNamespace(args=typed))  # pyright: ignore[reportPrivateUsage]
    asyncio.run(writing.submit())
    assert [mission.planner.pace for mission in handed_in] == ([] if pace is None else [pace])


def test_a_part_is_drawn_anew_only_when_it_shows_something_else(client: Client) -> None:
    del client
    part, drawn = Part(ui.element("div")), list[str]()

    def draw(text: str) -> Callable[[], None]:
        def drawing() -> None:
            drawn.append(text)
            Words("p", text)

        return drawing

    for what in (None, None, 1, 1, 2, None):
        part.show(what, draw(str(what)))
    assert drawn == ["None", "1", "2", "None"]
    assert inside(part.place) == ["None"]


def test_cancel_stays_the_same_button_while_the_job_comes_further(client: Client, desk: Desk) -> None:
    asyncio.run(_with_tab(desk))
    _tell(desk, QUEUED)
    cancel = buttons(client)["Cancel"]
    for job in (RUNNING, PLANNED, PLANNED.model_copy(update={"share": 0.5})):
        _tell(desk, job)
        assert buttons(client)["Cancel"] is cancel
    _tell(desk, REFUSED)
    assert "Cancel" not in buttons(client)


def test_a_search_can_be_stopped_while_there_is_one(client: Client, desk: Desk) -> None:
    asyncio.run(_with_tab(desk))
    stop = "Take the best plan so far"
    certified = Stage(name="round 1", state="done")
    for job, offered in (
        (QUEUED, False),
        (PLANNED, True),
        (PLANNED.model_copy(update={"stages": (Stage(name="round 1", state="running"),)}), True),
        (PLANNED.model_copy(update={"stages": (certified, Stage(name="flight", state="running"))}), False),
        (REFUSED, False),
    ):
        _tell(desk, job)
        assert (stop in buttons(client)) == offered
    _tell(desk, REFUSED.model_copy(update={"stopped": True}))
    assert any("stopped at the best plan so far" in made.text for made in client.elements.values() if isinstance(made, Words))


def test_what_a_refusal_offers_stays_when_the_same_is_told_again(client: Client, desk: Desk) -> None:
    asyncio.run(_with_tab(desk))
    trust_tab(desk, SimpleNamespace())  # pyright: ignore[reportArgumentType]  # the scene is not looked at
    _tell(desk, PLANNED)
    _tell(desk, REFUSED)
    names = ("What would mend it", "Leave out F a", "Leave out G !a", "Edit the mission", "Delete")
    before = {name: buttons(client)[name] for name in names}
    _tell(desk, REFUSED.model_copy(update={"share": 1.0}))
    assert {name: buttons(client)[name] for name in names} == before
    _tell(desk, None)
    assert not set(names) & set(buttons(client))


def test_the_list_keeps_its_entries(client: Client, desk: Desk) -> None:
    jobs: Any = desk.service.jobs

    def entries() -> list[Element]:
        found = next(made for made in client.elements.values() if "job-list" in made.classes)
        return list(found.default_slot.children)

    async def listed() -> None:
        refresh = await _with_tab(desk)
        first = entries()
        assert inside(first[0])[1:3] == ["firefighting", "waits"]
        jobs.known = [QUEUED.model_copy(update={"id": "a-2", "mission": "hoops"}), RUNNING]
        await refresh()
        second = entries()
        assert second[1:] == first
        assert [inside(made)[1:3] for made in second] == [["hoops", "waits"], ["firefighting", "runs"]]
        jobs.known = []
        await refresh()
        assert [inside(made) for made in entries()] == [["None yet: write a mission and plan it.", "Write a mission"]]

    asyncio.run(listed())


def test_the_list_says_what_the_job_s_head_says(client: Client, desk: Desk) -> None:
    asyncio.run(_with_tab(desk))
    entry = next(made for made in client.elements.values() if "entry" in made.classes)
    for job, word in ((RUNNING, "runs"), (REFUSED, "refused")):
        _tell(desk, job)
        assert inside(entry)[1] == word


async def _with_tab(desk: Desk) -> Callable[[], Any]:
    """Make the tab, and return what lists the jobs again."""
    with desk.client:
        await plan_tab(desk)
    timer = next(made for made in desk.client.elements.values() if isinstance(made, ui.timer))
    assert timer.callback is not None
    return timer.callback


def _tell(desk: Desk, job: Job | None) -> None:
    desk.job = job
    for told in desk.on_job:
        told(job)
